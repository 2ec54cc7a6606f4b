//! PLY, binary little endian: the returns as vertices.
//!
//! There is no agreement on names of properties beyond `x`, `y` and `z`. Readers that take any have
//! them by our names; CloudCompare, where nobody picks them in its dialogue, takes for scalar fields
//! those with `scal` in their name, and intensity.

use super::Names;
use super::about::all_lines;
use super::attributes::{Attribute, Value, returns};
use super::format::CloudWriter;
use super::holding::Further;
use super::number::Kind;
use crate::points::PointCloud;
use std::io::{self, Write};

/// Prefix of the names of attributes that CloudCompare is to take for scalar fields; it is no part of the
/// name there.
pub(super) const SCALAR: &str = "scalar_";

/// Names of the properties of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PropertyNames {
    /// Names of the attributes.
    Plain,
    /// The same with [`SCALAR`] before all but coordinates and intensity.
    CloudCompare,
}

impl CloudWriter for PropertyNames {
    fn name(&self) -> &'static str {
        match self {
            Self::Plain => "ply",
            Self::CloudCompare => "ply-cloudcompare",
        }
    }

    fn extension(&self) -> &'static str {
        "ply"
    }

    fn file_name(&self, scan: u64) -> String {
        match self {
            Self::Plain => format!("scan-{scan:06}.ply"),
            Self::CloudCompare => format!("scan-{scan:06}-cloudcompare.ply"),
        }
    }

    fn holds_further(&self, further: Further) -> bool {
        further != Further::EmptyPixels
    }

    // Numbers of two bytes become `int`: readers that many use drop a `ushort`.
    fn write(&self, cloud: &PointCloud, names: &Names, out: &mut dyn Write) -> io::Result<()> {
        let attributes = Attribute::of(cloud);
        writeln!(out, "ply\nformat binary_little_endian 1.0")?;
        writeln!(out, "comment metres, radians; x forward, y left, z up")?;
        for line in all_lines(cloud, names) {
            writeln!(out, "comment {line}")?;
        }
        writeln!(out, "element vertex {}", cloud.returns())?;
        for attribute in &attributes {
            let kind = match attribute.kind(cloud) {
                Kind::U1 => "uchar",
                Kind::F4 => "float",
                Kind::F8 => "double",
                _ => "int",
            };
            let is_known = matches!(
                attribute,
                Attribute::X | Attribute::Y | Attribute::Z | Attribute::Intensity
            );
            let before = if is_known || *self == PropertyNames::Plain { "" } else { SCALAR };
            writeln!(out, "property {kind} {before}{}", attribute.name())?;
        }
        writeln!(out, "end_header")?;
        let mut bytes = Vec::new();
        for point in returns(cloud) {
            bytes.clear();
            for attribute in &attributes {
                match attribute.value(cloud, point) {
                    Value::U2(value) => bytes.extend(i32::from(value).to_le_bytes()),
                    value => value.append_to(&mut bytes),
                }
            }
            out.write_all(&bytes)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;
    use crate::points::Truth;

    fn written(cloud: &PointCloud, names: &Names) -> (String, Vec<u8>) {
        let mut bytes = Vec::new();
        PropertyNames::Plain.write(cloud, names, &mut bytes).unwrap();
        let end = b"end_header\n";
        let at = bytes.windows(end.len()).position(|window| window == end).unwrap() + end.len();
        (String::from_utf8(bytes[..at].to_vec()).unwrap(), bytes[at..].to_vec())
    }

    #[test]
    fn only_returns_are_vertices() {
        let (header, body) = written(&sample_cloud(), &Names::default());
        assert!(header.contains("element vertex 5\n"));
        assert_eq!(body.len(), 5 * (5 * 4 + 8 + 6 * 4 + 3 + 4 + 4 + 4 + 4 + 1));
        assert_eq!(body[..4], 30f32.to_le_bytes());
    }

    #[test]
    fn a_cloud_without_returns_is_a_valid_empty_file() {
        let nothing = PointCloud { truth: Truth::default(), ..PointCloud::default() };
        let (header, body) = written(&nothing, &Names::default());
        assert!(header.contains("element vertex 0\n"));
        assert!(body.is_empty());
    }

    #[test]
    fn a_name_cannot_break_out_of_its_comment() {
        let objects = ["car\nelement vertex 9".to_owned()];
        let (header, _) = written(&sample_cloud(), &Names { objects: &objects, materials: &[] });
        assert!(header.contains("comment object 0 car element vertex 9\n"));
    }
}
