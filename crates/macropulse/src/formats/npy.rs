//! NumPy's `.npy` 1.0: the returns as a structured array, and range images.

use super::about::About;
use super::attributes::{Attribute, returns};
use super::number::Kind;
use super::table::{self, Layout};
use crate::points::PointCloud;
use std::io::{self, Write};

/// What every file begins with, before the version.
const MAGIC: &[u8] = b"\x93NUMPY";

/// Writes the returns of a cloud whose columns are even, as one structured array.
pub(super) fn write(cloud: &PointCloud, out: &mut dyn Write) -> io::Result<()> {
    let attributes = Attribute::of(cloud);
    let fields: Vec<String> = attributes
        .iter()
        .map(|attribute| format!("('{}', '{}')", attribute.name(), descr(*attribute, cloud)))
        .collect();
    write_header(&format!("[{}]", fields.join(", ")), &format!("({},)", cloud.returns()), out)?;
    let mut bytes = Vec::new();
    for point in returns(cloud) {
        bytes.clear();
        for attribute in &attributes {
            attribute.value(cloud, point).append_to(&mut bytes);
        }
        out.write_all(&bytes)?;
    }
    Ok(())
}

/// Writes the range image of a cloud whose columns are even: rows × columns, m, NaN where there is no
/// return; of each pixel the return picked.
pub(super) fn write_range(cloud: &PointCloud, out: &mut dyn Write) -> io::Result<()> {
    if cloud.rows * cloud.columns == 0 {
        return Err(io::Error::other("an image needs at least one row and one column"));
    }
    write_header("'<f4'", &format!("({}, {})", cloud.rows, cloud.columns), out)?;
    for range in cloud.image(cloud.pick).spread(&cloud.distances(), f32::NAN) {
        out.write_all(&range.to_le_bytes())?;
    }
    Ok(())
}

fn descr(attribute: Attribute, cloud: &PointCloud) -> String {
    let kind = attribute.blank(cloud).kind();
    let order = if kind.size() == 1 { "|" } else { "<" };
    format!("{order}{}{}", kind.letter().to_lowercase(), kind.size())
}

/// The header, a dictionary of Python padded to 64 bytes.
fn write_header(descr: &str, shape: &str, out: &mut dyn Write) -> io::Result<()> {
    let text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}");
    let length = (MAGIC.len() + 4 + text.len() + 1).next_multiple_of(64) - MAGIC.len() - 4;
    let size = u16::try_from(length).map_err(io::Error::other)?;
    out.write_all(MAGIC)?;
    out.write_all(&[1, 0])?;
    out.write_all(&size.to_le_bytes())?;
    writeln!(out, "{text:width$}", width = length - 1)
}

/// The cloud of a structured array with fields x, y and z; other fields that we do not know are
/// skipped.
pub(super) fn parse(bytes: &[u8]) -> Result<(PointCloud, About), String> {
    let rest = bytes.strip_prefix(MAGIC).ok_or("it does not begin as NumPy files do")?;
    let (header, body) = match *rest {
        [1, _, a, b, ..] => rest[4..].split_at_checked(usize::from(u16::from_le_bytes([a, b]))),
        [2 | 3, _, a, b, c, d, ..] => {
            rest[6..].split_at_checked(u32::from_le_bytes([a, b, c, d]) as usize)
        }
        [version, ..] => return Err(format!("its version is {version}; 1 to 3 are read")),
        [] => None,
    }
    .ok_or("it ends within its header")?;
    let header = std::str::from_utf8(header).map_err(|_| "its header is not text")?;
    let points = shape(header).ok_or(
        "its shape is not that of one list of points, a structured array with fields x, y and z",
    )?;
    let mut about = About::default();
    let cloud = table::list(&mut about, &layout(header)?, body, points)?;
    Ok((cloud, about))
}

/// Length of a one-dimensional array.
fn shape(header: &str) -> Option<usize> {
    let (_, rest) = header.split_once("'shape':")?;
    let (inner, _) = rest.trim_start().strip_prefix('(')?.split_once(')')?;
    inner.trim().trim_end_matches(',').trim().parse().ok()
}

/// Where the fields of a structured array are: `[('x', '<f4'), …]`.
fn layout(header: &str) -> Result<Layout, String> {
    let list = header.split_once("'descr':").and_then(|(_, rest)| {
        let (inner, _) = rest.trim_start().strip_prefix('[')?.split_once(']')?;
        Some(inner)
    });
    let list = list.ok_or("it is no structured array; fields x, y and z are read")?;
    let mut quoted = list.split('\'').skip(1).step_by(2);
    let mut layout = Layout::default();
    while let (Some(name), Some(descr)) = (quoted.next(), quoted.next()) {
        let fault =
            || format!("field `{name}` is of type `{descr}`; little-endian numbers are read");
        let code = descr.strip_prefix(['<', '|', '=']).ok_or_else(fault)?;
        let (letter, size) = code.split_at_checked(1).ok_or_else(fault)?;
        let size = size.parse().map_err(|_| fault())?;
        layout.push(name, Kind::from_letter(letter, size).ok_or_else(fault)?, 1)?;
    }
    Ok(layout)
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;
    use crate::points::Truth;

    #[test]
    fn the_header_is_as_numpy_writes_it() {
        let cloud = PointCloud { truth: Truth::default(), ..sample_cloud() };
        let mut bytes = Vec::new();
        write(&cloud, &mut bytes).unwrap();
        let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert_eq!(end % 64, 0);
        let header = std::str::from_utf8(&bytes[10..end]).unwrap();
        assert!(header.starts_with("{'descr': [('x', '<f4'), ('y', '<f4'),"), "{header}");
        assert!(header.contains("('time_ns', '<f8'), ('row', '<u2')"), "{header}");
        assert!(header.contains("('flags', '|u1')], 'fortran_order': False, 'shape': (5,), }"));
        assert!(header.ends_with(" \n"));
        assert_eq!(bytes.len() - end, 5 * (5 * 4 + 8 + 6 * 2 + 3));
    }

    #[test]
    fn a_range_image_has_its_rows_and_columns() {
        let mut bytes = Vec::new();
        write_range(&sample_cloud(), &mut bytes).unwrap();
        let image = &bytes[bytes.len() - 6 * 4..];
        let at = |place: usize| f32::from_le_bytes(image[4 * place..][..4].try_into().unwrap());
        assert!(at(0) == 30.02 && at(2).is_nan() && at(5) == 28.03);
        assert!(String::from_utf8_lossy(&bytes).contains("'shape': (2, 3)"));
    }

    #[test]
    fn faults_are_told_apart() {
        let fault = |bytes: &[u8]| parse(bytes).unwrap_err();
        assert_eq!(fault(b"PK"), "it does not begin as NumPy files do");
        let mut image = Vec::new();
        write_range(&sample_cloud(), &mut image).unwrap();
        assert!(fault(&image).starts_with("its shape is not that of one list of points"));
        let mut bytes = Vec::new();
        write(&sample_cloud(), &mut bytes).unwrap();
        assert!(fault(&bytes[..40]).contains("ends within its header"));
        assert!(fault(&bytes[..bytes.len() - 1]).contains("ends after 4 of 5 points"));
        let swapped = String::from_utf8_lossy(&bytes).replace("('x', '<f4')", "('x', '>f4')");
        assert!(parse(swapped.as_bytes()).is_err());
    }
}
