//! NumPy's `.npy` 1.0: the returns as a structured array, and range images.

use super::Names;
use super::about::About;
use super::attributes::{Attribute, returns};
use super::cloud_file::{CloudFile, LONGEST_HEADER};
use super::format::CloudWriter;
use super::holding::{Further, Holding};
use super::number::Kind;
use super::table::{self, Layout};
use super::{CloudRoom, interleave};
use crate::points::PointCloud;
use std::io::{self, Write};

/// Bytes at the beginning of every file, before the version.
const MAGIC: &[u8] = b"\x93NUMPY";

/// The returns as one structured array.
pub(super) struct Npy;

impl CloudWriter for Npy {
    fn name(&self) -> &'static str {
        "npy"
    }

    fn holds_further(&self, further: Further) -> bool {
        further == Further::Digits
    }

    fn write(&self, cloud: &PointCloud, _names: &Names, out: &mut dyn Write) -> io::Result<()> {
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
}

/// The range image: rows × columns, m. A pixel has the range of its picked return, or NaN if it has no return.
pub(super) struct RangeNpy;

impl CloudWriter for RangeNpy {
    fn name(&self) -> &'static str {
        "range-npy"
    }

    fn extension(&self) -> &'static str {
        "npy"
    }

    fn file_name(&self, scan: u64) -> String {
        format!("range-{scan:06}.npy")
    }

    fn is_range_image(&self) -> bool {
        true
    }

    fn holds(&self, attribute: Attribute) -> Holding {
        Holding::in_image(Holding::Whole, attribute)
    }

    fn holds_further(&self, further: Further) -> bool {
        further.is_in_image()
    }

    fn write(&self, cloud: &PointCloud, _names: &Names, out: &mut dyn Write) -> io::Result<()> {
        if cloud.rows * cloud.columns == 0 {
            return Err(io::Error::other("an image needs at least one row and one column"));
        }
        write_header("'<f4'", &format!("({}, {})", cloud.rows, cloud.columns), out)?;
        for range in cloud.image(cloud.pick).spread(&cloud.distances(), f32::NAN) {
            out.write_all(&range.to_le_bytes())?;
        }
        Ok(())
    }
}

fn descr(attribute: Attribute, cloud: &PointCloud) -> String {
    let kind = attribute.kind(cloud);
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

/// Reads the cloud of an array: a structured one with fields x, y and z, or a plain one with a line per
/// point. The columns of a plain one are x, y, z and intensity.
pub(super) fn parse(file: &mut CloudFile, room: CloudRoom) -> Result<(PointCloud, About), String> {
    let header = header(file)?;
    let mut about = About::within(room);
    let (fields, points) = fields(&header)?;
    room.check(points as u64)?;
    let mut layout = Layout::default();
    for Stored { name, kind, .. } in &fields {
        layout.push(name, *kind, 1)?;
    }
    let sizes: Vec<usize> = fields.iter().map(|field| field.kind.size()).collect();
    let by_columns = match is_by_columns(&header, &fields) {
        true => Some(by_columns(file, &sizes, points, room)?),
        false => None,
    };
    let ends = sizes.iter().scan(0, |end, size| {
        *end += size;
        Some(*end)
    });
    let numbers = fields.iter().zip(&sizes).zip(ends);
    let big_endian = numbers.filter(|((field, _), _)| field.is_big_endian);
    let big_endian: Vec<_> = big_endian.map(|((_, size), end)| end - size..end).collect();
    let mut columns = by_columns.as_deref().map(table::records);
    let cloud = table::list(&mut about, &layout, points, &mut |record| {
        let is_there = match &mut columns {
            Some(next) => next(record)?,
            None => file.fill(record)?,
        };
        big_endian.iter().for_each(|number| record[number.clone()].reverse());
        Ok(is_there)
    })?;
    Ok((cloud, about))
}

/// The text of the header.
fn header(file: &mut CloudFile) -> Result<String, String> {
    let ends = "it ends within its header";
    let mut next = |bytes: &mut [u8]| file.fill(bytes)?.then_some(()).ok_or(ends.to_owned());
    let mut magic = [0; MAGIC.len()];
    if next(&mut magic).is_err() || magic != MAGIC {
        return Err("it does not begin as NumPy files do".to_owned());
    }
    let mut version = [0; 2];
    next(&mut version)?;
    let mut length = [0; 4];
    let bytes = match version[0] {
        1 => 2,
        2 | 3 => 4,
        version => return Err(format!("its version is {version}; 1 to 3 are read")),
    };
    next(&mut length[..bytes])?;
    let length = u64::from(u32::from_le_bytes(length));
    if length > LONGEST_HEADER {
        return Err(format!("its header is longer than {LONGEST_HEADER} bytes"));
    }
    let header = file.bytes(length)?.ok_or(ends)?;
    String::from_utf8(header).map_err(|_| "its header is not text".to_owned())
}

/// A field of a point as it is stored.
struct Stored<'a> {
    name: &'a str,
    kind: Kind,
    is_big_endian: bool,
}

impl<'a> Stored<'a> {
    fn of(name: &'a str, descr: &str) -> Result<Self, String> {
        let fault =
            || format!("`{name}` is of type `{descr}`; whole and floating numbers are read");
        let (order, code) = descr.split_at_checked(1).ok_or_else(fault)?;
        if !matches!(order, "<" | ">" | "|" | "=") {
            return Err(fault());
        }
        let (letter, size) = code.split_at_checked(1).ok_or_else(fault)?;
        let kind = size.parse().ok().and_then(|size| Kind::from_letter(letter, size));
        Ok(Self { name, kind: kind.ok_or_else(fault)?, is_big_endian: order == ">" })
    }
}

/// The fields of a point, and how many points there are.
fn fields(header: &str) -> Result<(Vec<Stored<'_>>, usize), String> {
    let shape = shape(header).ok_or("its header has no shape")?;
    let descr = header.split_once("'descr':").map(|(_, rest)| rest.trim_start());
    let descr = descr.ok_or("its header has no type")?;
    if let Some((inner, _)) = descr.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        let points = shape.iter().try_fold(1_usize, |product, side| product.checked_mul(*side));
        let points = points.ok_or("its shape is beyond all bounds")?;
        let mut quoted = inner.split('\'').skip(1).step_by(2);
        let mut fields = Vec::new();
        while let (Some(name), Some(descr)) = (quoted.next(), quoted.next()) {
            fields.push(Stored::of(name, descr)?);
        }
        return Ok((fields, points));
    }
    let descr = descr.split('\'').nth(1).ok_or("its type is none that is read")?;
    let names = match *shape.as_slice() {
        [_, columns] if columns >= 3 => PLAIN.get(..columns),
        _ => None,
    };
    let names = names.ok_or_else(|| {
        let shape = shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" × ");
        format!(
            "its shape is {shape}; arrays of N × 3 (x, y, z) and N × 4 (and intensity) are read, \
             and structured arrays with fields x, y and z"
        )
    })?;
    let fields: Result<Vec<Stored>, String> =
        names.iter().map(|name| Stored::of(name, descr)).collect();
    Ok((fields?, shape[0]))
}

/// Columns of a plain array; the last two are no attribute. More are rather an image.
const PLAIN: [&str; 6] = ["x", "y", "z", "intensity", "column 5", "column 6"];

/// Returns true if the numbers of the first column come first, then those of the second. In a list of
/// structures the order is the same either way.
fn is_by_columns(header: &str, fields: &[Stored]) -> bool {
    let order = header.split_once("'fortran_order':");
    let is_by_columns = order.is_some_and(|(_, rest)| rest.trim_start().starts_with("True"));
    let is_plain =
        fields.iter().all(|field| field.kind == fields[0].kind) && !header.contains("'descr': [");
    is_by_columns && is_plain
}

/// The records of points whose numbers, of these sizes, are stored column by column.
fn by_columns(
    file: &mut CloudFile,
    sizes: &[usize],
    points: usize,
    room: CloudRoom,
) -> Result<Vec<u8>, String> {
    let stride: usize = sizes.iter().sum();
    let size = points.saturating_mul(stride) as u64;
    // The bytes as read, and the same bytes point by point.
    room.check_beside(size.saturating_mul(2), points as u64)?;
    let whole = file.rest() / stride.max(1) as u64;
    let columns = file.bytes(size)?.ok_or_else(|| table::cut_short(whole, points as u64))?;
    Ok(interleave::columns(&columns, sizes, points))
}

/// The sides of an array.
fn shape(header: &str) -> Option<Vec<usize>> {
    let (_, rest) = header.split_once("'shape':")?;
    let (inner, _) = rest.trim_start().strip_prefix('(')?.split_once(')')?;
    let sides = inner.split(',').map(str::trim).filter(|side| !side.is_empty());
    sides.map(|side| side.parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;

    fn parse(bytes: &[u8]) -> Result<(PointCloud, About), String> {
        super::parse(&mut CloudFile::of_bytes(bytes), CloudRoom::default())
    }
    use crate::points::Truth;

    #[test]
    fn the_header_is_as_numpy_writes_it() {
        let cloud = PointCloud { truth: Truth::default(), ..sample_cloud() };
        let mut bytes = Vec::new();
        Npy.write(&cloud, &Names::default(), &mut bytes).unwrap();
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
        RangeNpy.write(&sample_cloud(), &Names::default(), &mut bytes).unwrap();
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
        let three = PointCloud { rows: 3, columns: 2, ..sample_cloud() };
        RangeNpy.write(&three, &Names::default(), &mut image).unwrap();
        assert!(fault(&image).starts_with("its shape is 3 × 2; arrays of N × 3 (x, y, z)"));
        let mut bytes = Vec::new();
        Npy.write(&sample_cloud(), &Names::default(), &mut bytes).unwrap();
        assert!(fault(&bytes[..40]).contains("ends within its header"));
        assert!(fault(&bytes[..bytes.len() - 1]).contains("ends after 4 of 5 points"));
        let complex = array("[('x', '<c8')]", "False", "(0,)", []);
        assert!(fault(&complex).starts_with("`x` is of type `<c8`"));
    }

    fn array(descr: &str, order: &str, shape: &str, body: impl IntoIterator<Item = u8>) -> Vec<u8> {
        let mut bytes = Vec::new();
        write_header(descr, shape, &mut bytes).unwrap();
        let text = String::from_utf8_lossy(&bytes[10..]).replace("False", order);
        bytes.truncate(10);
        bytes.extend(text.bytes());
        bytes.extend(body);
        bytes
    }

    #[test]
    fn plain_arrays_are_read_in_either_order() {
        let rows = [3.0, 4.0, 12.0, 0.5, 0.0, 0.0, 2.5, 1.0];
        let columns = [3.0, 0.0, 4.0, 0.0, 12.0, 2.5, 0.5, 1.0];
        let float = |number: f64| (number as f32).to_le_bytes();
        for file in [
            array("'<f4'", "False", "(2, 4)", rows.into_iter().flat_map(float)),
            array("'<f4'", "True ", "(2, 4)", columns.into_iter().flat_map(float)),
            array("'<f8'", "False", "(2, 4)", rows.into_iter().flat_map(f64::to_le_bytes)),
            array("'>f8'", "False", "(2, 4)", rows.into_iter().flat_map(f64::to_be_bytes)),
            array("'>f8'", "True ", "(2, 4)", columns.into_iter().flat_map(f64::to_be_bytes)),
        ] {
            let (read, _) = parse(&file).unwrap();
            assert_eq!(
                (&*read.distances(), &read.intensity[..]),
                (&[13.0, 2.5][..], &[0.5, 1.0][..])
            );
            assert!(parse(&file[..file.len() - 1]).unwrap_err().contains("ends after 1 of 2"));
        }
        let short = rows.iter().take(6).copied().flat_map(float);
        let (read, _) = parse(&array("'<f4'", "False", "(2, 3)", short)).unwrap();
        assert_eq!(read.x, [3.0, 0.5]);
        assert!(read.intensity.is_empty());
        let huge = array("'<f4'", "True ", "(18446744073709551615, 3)", []);
        assert!(parse(&huge).unwrap_err().contains("points take about"));
    }

    #[test]
    fn structures_of_the_other_byte_order_are_read() {
        let descr = "[('X', '>f4'), ('Y', '<f4'), ('I', '|u1'), ('Z', '>f8')]";
        let mut body = 3_f32.to_be_bytes().to_vec();
        body.extend(4_f32.to_le_bytes());
        body.push(7);
        body.extend(12_f64.to_be_bytes());
        let (read, _) = parse(&array(descr, "False", "(1, 1)", body)).unwrap();
        assert_eq!((read.distances()[0], read.intensity[0]), (13.0, 7.0));
    }
}
