//! Reads PCD files back, ours and those of others that are binary and have x, y and z.

use super::attributes::{Attribute, Value, outcome_from_code};
use super::pcd::{SCAN_COMMENT, type_letter};
use super::{Error, Format};
use crate::points::{NO_OBJECT, Outcome, PointCloud, Truth, Viewpoint};
use std::path::Path;

/// Reads a binary PCD file into an organised cloud.
///
/// Fields we do not know are skipped. Of ours, x, y and z must be there; the others are NaN or 0
/// where the file lacks them, except that the range is then the length of (x, y, z). Truth is read
/// if the file has the outcome.
///
/// # Errors
/// [`Error::Read`] if the file cannot be read, [`Error::Invalid`] if it is no such PCD file.
pub fn read_pcd(path: &Path) -> Result<PointCloud, Error> {
    let bytes = std::fs::read(path).map_err(|cause| Error::read(path, cause))?;
    parse(&bytes).map_err(|fault| Error::invalid(path, Format::Pcd, fault))
}

/// Where one of our attributes lies in a record.
#[derive(Debug, Clone, Copy)]
struct Field {
    attribute: Attribute,
    offset: usize,
}

#[derive(Debug, Default)]
struct Header {
    scan: u64,
    viewpoint: Viewpoint,
    fields: Vec<String>,
    sizes: Vec<String>,
    types: Vec<String>,
    counts: Vec<String>,
    columns: Option<usize>,
    rows: Option<usize>,
    points: Option<usize>,
}

fn parse(bytes: &[u8]) -> Result<PointCloud, String> {
    let (header, body) = parse_header(bytes)?;
    let columns = header.columns.ok_or("the header has no WIDTH")?;
    let rows = header.rows.ok_or("the header has no HEIGHT")?;
    let points = rows.checked_mul(columns).ok_or("WIDTH × HEIGHT is beyond all bounds")?;
    if header.points.is_some_and(|declared| declared != points) {
        return Err(format!("POINTS is not WIDTH × HEIGHT = {points}"));
    }
    let (fields, stride) = layout(&header)?;
    let expected = points.checked_mul(stride).ok_or("the points are beyond all bounds")?;
    if body.len() < expected {
        let whole = body.len() / stride;
        return Err(format!("it ends after {whole} of {points} points; the file was cut short"));
    }
    let Header { scan, viewpoint, .. } = header;
    let mut cloud = PointCloud { scan, rows, columns, viewpoint, ..PointCloud::default() };
    for record in body.chunks_exact(stride).take(points) {
        append(&mut cloud, &fields, record)?;
    }
    if !fields.iter().any(|field| field.attribute == Attribute::Outcome) {
        cloud.truth = Truth::default();
    }
    Ok(cloud)
}

/// The header, and the bytes after it.
fn parse_header(bytes: &[u8]) -> Result<(Header, &[u8]), String> {
    let mut header = Header::default();
    let mut rest = bytes;
    while let Some(end) = rest.iter().position(|&byte| byte == b'\n') {
        let line = std::str::from_utf8(&rest[..end])
            .map_err(|_| "its header is not text; PCD files begin with `# .PCD` or `VERSION`")?
            .trim();
        rest = &rest[end + 1..];
        if let Some(scan) = line.strip_prefix(SCAN_COMMENT) {
            header.scan = scan.parse().unwrap_or(0);
        }
        let (key, values) = line.split_once(' ').unwrap_or((line, ""));
        let words = || values.split_whitespace().map(str::to_owned).collect();
        match key {
            "VERSION" if values != "0.7" && values != ".7" => {
                return Err(format!("its version is {values}; only 0.7 is read"));
            }
            "FIELDS" => header.fields = words(),
            "SIZE" => header.sizes = words(),
            "TYPE" => header.types = words(),
            "COUNT" => header.counts = words(),
            "WIDTH" => header.columns = Some(whole_number(key, values)?),
            "HEIGHT" => header.rows = Some(whole_number(key, values)?),
            "POINTS" => header.points = Some(whole_number(key, values)?),
            "DATA" if values == "binary" => return Ok((header, rest)),
            "DATA" => {
                return Err(format!(
                    "its points are stored as `{values}`; only `DATA binary` is read"
                ));
            }
            "VIEWPOINT" => header.viewpoint = viewpoint(values)?,
            "VERSION" | "" => {}
            _ if key.starts_with('#') => {}
            _ => return Err(format!("its header has a line that begins with `{key}`")),
        }
    }
    Err("its header has no DATA line".into())
}

/// Position and quaternion, as PCD has them: x y z, then w i j k.
fn viewpoint(text: &str) -> Result<Viewpoint, String> {
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    let numbers = numbers.unwrap_or_default();
    match *numbers.as_slice() {
        [x, y, z, w, i, j, k] if numbers.iter().all(|number| number.is_finite()) => {
            Ok(Viewpoint { position: [x, y, z], turn: [w, i, j, k] })
        }
        _ => Err(format!("VIEWPOINT is `{text}`, not seven finite numbers")),
    }
}

fn whole_number(key: &str, text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| format!("{key} is `{text}`, not a whole number"))
}

/// Our fields and the length of a record in bytes.
fn layout(header: &Header) -> Result<(Vec<Field>, usize), String> {
    let names = &header.fields;
    let ones = vec!["1".to_owned(); names.len()];
    let counts = if header.counts.is_empty() { &ones } else { &header.counts };
    if [&header.sizes, &header.types, counts].iter().any(|list| list.len() != names.len()) {
        return Err("FIELDS, SIZE, TYPE and COUNT have different lengths".into());
    }
    let mut fields = Vec::new();
    let mut stride = 0_usize;
    let blank = PointCloud {
        truth: Truth { outcome: vec![Outcome::Empty], ..Truth::default() },
        ..PointCloud::default()
    };
    let known = Attribute::of(&blank);
    for (at, name) in names.iter().enumerate() {
        let size = whole_number("SIZE", &header.sizes[at])?;
        let count = whole_number("COUNT", &counts[at])?;
        if let Some(&attribute) = known.iter().find(|attribute| attribute.name() == name) {
            let ours = attribute.blank();
            if (size, header.types[at].as_str(), count) != (ours.size(), type_letter(ours), 1) {
                return Err(format!(
                    "field `{name}` is not of type {}{}",
                    type_letter(ours),
                    ours.size()
                ));
            }
            fields.push(Field { attribute, offset: stride });
        }
        let bytes = size.checked_mul(count).ok_or("a field is beyond all bounds")?;
        stride = stride.checked_add(bytes).ok_or("a record is beyond all bounds")?;
    }
    for needed in [Attribute::X, Attribute::Y, Attribute::Z] {
        if !fields.iter().any(|field| field.attribute == needed) {
            return Err(format!("it has no field `{}`", needed.name()));
        }
    }
    Ok((fields, stride))
}

/// Appends one record to all columns: first as a pixel without a return, then what the file has.
fn append(cloud: &mut PointCloud, fields: &[Field], record: &[u8]) -> Result<(), String> {
    let at = cloud.x.len();
    for column in [&mut cloud.x, &mut cloud.y, &mut cloud.z, &mut cloud.intensity, &mut cloud.range]
    {
        column.push(f32::NAN);
    }
    cloud.time_ns.push(0.0);
    for column in [&mut cloud.peak, &mut cloud.marks, &mut cloud.margin] {
        column.push(0);
    }
    cloud.truth.range.push(f32::NAN);
    cloud.truth.cosine.push(f32::NAN);
    cloud.truth.object.push(NO_OBJECT);
    cloud.truth.material.push(NO_OBJECT);
    cloud.truth.outcome.push(Outcome::Empty);
    for field in fields {
        let value = read(field.attribute.blank(), &record[field.offset..]);
        set(cloud, at, field.attribute, value)?;
    }
    if !fields.iter().any(|field| field.attribute == Attribute::Range) {
        cloud.range[at] = cloud.x[at].hypot(cloud.y[at]).hypot(cloud.z[at]);
    }
    Ok(())
}

/// The value at the start of `bytes`, of the same type as `like`; `layout` made sure of the length.
fn read(like: Value, bytes: &[u8]) -> Value {
    let mut wide = [0; 8];
    wide[..like.size()].copy_from_slice(&bytes[..like.size()]);
    let [a, b, c, d, ..] = wide;
    match like {
        Value::U1(_) => Value::U1(a),
        Value::U2(_) => Value::U2(u16::from_le_bytes([a, b])),
        Value::F4(_) => Value::F4(f32::from_le_bytes([a, b, c, d])),
        Value::F8(_) => Value::F8(f64::from_le_bytes(wide)),
    }
}

fn set(
    cloud: &mut PointCloud,
    at: usize,
    attribute: Attribute,
    value: Value,
) -> Result<(), String> {
    let truth = &mut cloud.truth;
    match (attribute, value) {
        (Attribute::X, Value::F4(x)) => cloud.x[at] = x,
        (Attribute::Y, Value::F4(y)) => cloud.y[at] = y,
        (Attribute::Z, Value::F4(z)) => cloud.z[at] = z,
        (Attribute::Intensity, Value::F4(intensity)) => cloud.intensity[at] = intensity,
        (Attribute::Range, Value::F4(range)) => cloud.range[at] = range,
        (Attribute::TimeNs, Value::F8(time)) => cloud.time_ns[at] = time,
        (Attribute::Peak, Value::U2(peak)) => cloud.peak[at] = peak,
        (Attribute::Marks, Value::U2(marks)) => cloud.marks[at] = marks,
        (Attribute::Margin, Value::U2(margin)) => cloud.margin[at] = margin,
        (Attribute::TrueRange, Value::F4(range)) => truth.range[at] = range,
        (Attribute::Object, Value::U2(object)) => truth.object[at] = object,
        (Attribute::Material, Value::U2(material)) => truth.material[at] = material,
        (Attribute::Incidence, Value::F4(angle)) => {
            truth.cosine[at] = libm::cos(f64::from(angle)) as f32;
        }
        (Attribute::Outcome, Value::U1(code)) => {
            truth.outcome[at] = outcome_from_code(code)
                .ok_or_else(|| format!("point {at} has the outcome {code}; known are 0 to 5"))?;
        }
        // Row, column and ring follow from the place in an organised file, return numbers and
        // flags from the other columns.
        _ => {}
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn foreign(fields: &str, points: usize) -> Vec<u8> {
        let mut file = format!(
            "# .PCD v0.7\nVERSION 0.7\n{fields}\nWIDTH {points}\nHEIGHT 1\nPOINTS {points}\nDATA binary\n"
        )
        .into_bytes();
        for _ in 0..points {
            for value in [3f32, 4.0, 12.0, 99.0] {
                file.extend(value.to_le_bytes());
            }
        }
        file
    }

    const XYZ_RGB: &str = "FIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1";

    #[test]
    fn a_stranger_s_file_is_read_without_the_fields_it_lacks() {
        let cloud = parse(&foreign(XYZ_RGB, 2)).unwrap();
        assert_eq!((cloud.rows, cloud.columns), (1, 2));
        assert_eq!(cloud.range, [13.0, 13.0]);
        assert!(cloud.intensity[0].is_nan());
        assert!(cloud.truth.outcome.is_empty());
    }

    #[test]
    fn faults_are_told_apart() {
        let fault = |file: &[u8]| parse(file).unwrap_err();
        let whole = foreign(XYZ_RGB, 2);
        assert_eq!(
            fault(&whole[..whole.len() - 1]),
            "it ends after 1 of 2 points; the file was cut short"
        );
        assert_eq!(
            fault(b"VERSION 0.7\nDATA ascii\n"),
            "its points are stored as `ascii`; only `DATA binary` is read"
        );
        assert_eq!(fault(b"ply\n"), "its header has a line that begins with `ply`");
        assert_eq!(fault(b""), "its header has no DATA line");
        assert_eq!(
            fault(&foreign("FIELDS x y\nSIZE 4 4\nTYPE F F\nCOUNT 1 1", 1)),
            "it has no field `z`"
        );
        assert_eq!(
            fault(&foreign("FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1", 1)),
            "field `x` is not of type F4"
        );
        assert_eq!(
            fault(&foreign("FIELDS x y z\nSIZE 4 4\nTYPE F F F\nCOUNT 1 1 1", 1)),
            "FIELDS, SIZE, TYPE and COUNT have different lengths"
        );
    }

    #[test]
    fn a_viewpoint_is_seven_numbers() {
        let read = |viewpoint: &str| parse(&foreign(&format!("{viewpoint}\n{XYZ_RGB}"), 1));
        let cloud = read("VIEWPOINT 1 2 -3.5 0.8 0 0 0.6").unwrap();
        assert_eq!(cloud.viewpoint.position, [1.0, 2.0, -3.5]);
        assert_eq!(cloud.viewpoint.turn, [0.8, 0.0, 0.0, 0.6]);
        assert_eq!(parse(&foreign(XYZ_RGB, 1)).unwrap().viewpoint, Viewpoint::default());
        for wrong in ["0 0 0 1 0 0", "0 0 0 1 0 0 0 0", "0 0 0 1 0 0 x 0", "0 0 nan 1 0 0 0"] {
            let told = read(&format!("VIEWPOINT {wrong}")).unwrap_err();
            assert_eq!(told, format!("VIEWPOINT is `{wrong}`, not seven finite numbers"));
        }
    }

    #[test]
    fn absurd_sizes_are_refused_not_allocated() {
        let huge = format!("{XYZ_RGB}\nWIDTH {}\nHEIGHT 9\nDATA binary\n", usize::MAX);
        assert_eq!(parse(huge.as_bytes()).unwrap_err(), "WIDTH × HEIGHT is beyond all bounds");
    }
}
