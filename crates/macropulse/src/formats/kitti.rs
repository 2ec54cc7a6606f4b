//! Points as the KITTI data sets have them: x, y, z and reflectance, four little-endian floats each,
//! and nothing else.

use super::about::About;
use super::attributes::{Attribute, returns};
use super::number::Kind;
use super::table::{self, Layout};
use crate::points::PointCloud;
use std::io::{self, Write};

/// What a point has.
pub(super) const ATTRIBUTES: [Attribute; 4] =
    [Attribute::X, Attribute::Y, Attribute::Z, Attribute::Intensity];

/// Writes the returns of a cloud whose columns are even.
pub(super) fn write(cloud: &PointCloud, out: &mut dyn Write) -> io::Result<()> {
    let has = Attribute::of(cloud);
    let value = |attribute: Attribute, point| match has.contains(&attribute) {
        true => attribute.value(cloud, point),
        // Each point has room for a reflectance.
        false => attribute.blank(cloud),
    };
    let mut bytes = Vec::with_capacity(16);
    for point in returns(cloud) {
        bytes.clear();
        let values = ATTRIBUTES.map(|attribute| value(attribute, point));
        values.into_iter().for_each(|value| value.narrowed().append_to(&mut bytes));
        out.write_all(&bytes)?;
    }
    Ok(())
}

/// The cloud of a file.
pub(super) fn parse(bytes: &[u8]) -> Result<(PointCloud, About), String> {
    let mut layout = Layout::default();
    for attribute in ATTRIBUTES {
        layout.push(attribute.name(), Kind::F4, 1)?;
    }
    let points = bytes.len() / layout.stride;
    if !bytes.len().is_multiple_of(layout.stride) {
        let length = bytes.len();
        return Err(format!("it has {length} bytes, and 16 to a point; the file was cut short"));
    }
    let mut about = About { is_of_driver: true, ..About::default() };
    let cloud = table::list(&mut about, &layout, bytes, points)?;
    Ok((cloud, about))
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;

    #[test]
    fn four_floats_are_a_point() {
        let cloud = sample_cloud();
        let mut bytes = Vec::new();
        write(&cloud, &mut bytes).unwrap();
        assert_eq!(bytes.len(), 5 * 16);
        let (read, _) = parse(&bytes).unwrap();
        assert_eq!((&read.x, &read.y, &read.z), (&cloud.x, &cloud.y, &cloud.z));
        assert_eq!(read.intensity, cloud.intensity);
        assert_eq!((read.rows, read.columns, read.returns_per_shot), (0, 0, 1));
        assert!(parse(&bytes[..79]).unwrap_err().contains("79 bytes"));
    }
}
