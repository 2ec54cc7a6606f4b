//! Reads PCD files back, ours and those of others that are binary and have x, y and z.

use super::attributes::{Attribute, Value, outcome_from_code};
use super::pcd::{LIST_COMMENT, SCAN_COMMENT, type_letter};
use super::{Error, Format};
use crate::points::{Outcome, Pick, PointCloud, Surface, Surfaces, Truth, Viewpoint};
use std::path::Path;

/// Reads a binary PCD file into a cloud. Points without x, y and z are pixels that had no return.
///
/// Fields we do not know are skipped. Of ours, x, y and z must be there; the others are NaN or 0
/// where the file lacks them, except that the range is then the length of (x, y, z), and a point the
/// first return of one. Truth is read if the file has the outcome.
///
/// An organised file has an image, with a pixel for each of its points. A list has the image of which
/// its header tells; of the pixels that have no return it says nothing, of the others what it says of
/// the return they show. A list of
/// another program has no image: no rows, no columns.
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
    /// What the header of a list says of its image, if it does.
    list: Option<List>,
}

/// The image of a list: rows, columns, returns of a shot at most, and which of them is shown.
#[derive(Debug, Clone, Copy, Default)]
struct List {
    rows: usize,
    columns: usize,
    most: u8,
    pick: Pick,
}

/// One point of a file: a return, or a pixel without one.
#[derive(Debug, Clone, Copy)]
struct Record {
    position: [f32; 3],
    intensity: f32,
    range: f32,
    time_ns: f64,
    pixel: [u16; 2],
    number: [u8; 2],
    peak: u16,
    marks: u16,
    margin: u16,
    surface: Surface,
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
    let has = |attribute| fields.iter().any(|field: &Field| field.attribute == attribute);
    let has_truth = has(Attribute::Outcome);
    let records = body.chunks_exact(stride).take(points);
    let is_others = rows == 1 && !has(Attribute::Column);
    if header.list.is_some() || is_others {
        let list = header.list.unwrap_or_default();
        let pixels = list.rows.checked_mul(list.columns).filter(|&pixels| pixels <= MOST_PIXELS);
        let pixels = pixels.ok_or("its list has more pixels than rows and columns can number")?;
        let mut cloud = empty(&header, list);
        cloud.fired_ns.resize(pixels, f64::NAN);
        for (at, record) in records.enumerate() {
            let record = Record::read(&fields, record, at)?;
            if record.is_return() {
                cloud.add(&record);
            }
        }
        cloud.truth = if has_truth { with_pixels(&cloud) } else { Truth::default() };
        let image = cloud.image(cloud.pick);
        for (fired, at) in cloud.fired_ns.iter_mut().zip(image.iter()) {
            *fired = at.map_or(f64::NAN, |at| cloud.time_ns[at]);
        }
        return Ok(cloud);
    }
    if rows.max(columns) > 1 << 16 {
        return Err(format!("it has {rows} × {columns} pixels; 65536 rows and columns are read"));
    }
    let mut cloud = empty(&header, List { rows, columns, most: 1, pick: Pick::default() });
    for (at, record) in records.enumerate() {
        let mut record = Record::read(&fields, record, at)?;
        // An organised file tells the pixel by the place.
        record.pixel = [(at / columns) as u16, (at % columns) as u16];
        record.number = [1, 1];
        cloud.fired_ns.push(record.time_ns);
        cloud.truth.pixels.push(record.of_pixel());
        if record.is_return() {
            cloud.add(&record);
        }
    }
    if !has_truth {
        cloud.truth = Truth::default();
    }
    Ok(cloud)
}

/// Rows times columns that 16 bits can number.
const MOST_PIXELS: usize = 1 << 32;

/// A cloud without a return, of the image that `list` tells.
fn empty(header: &Header, list: List) -> PointCloud {
    PointCloud {
        scan: header.scan,
        viewpoint: header.viewpoint,
        rows: list.rows,
        columns: list.columns,
        returns_per_shot: list.most.max(1),
        pick: list.pick,
        ..PointCloud::default()
    }
}

/// The truth of a list, with that of its pixels as far as their returns tell.
fn with_pixels(cloud: &PointCloud) -> Truth {
    let returns = cloud.truth.returns.clone();
    let mut of_pixels = Surfaces::default();
    for at in cloud.image(cloud.pick).iter() {
        let outcome = at.map_or(Outcome::Empty, |at| returns.outcome[at]);
        of_pixels.push(Surface { outcome, ..Surface::NONE });
    }
    Truth { returns, pixels: of_pixels }
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
        if let Some(list) = line.strip_prefix(LIST_COMMENT) {
            header.list = Some(list_of(list)?);
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

/// Rows, columns, most returns of a shot and the return picked, as the header of a list has them.
fn list_of(text: &str) -> Result<List, String> {
    let list = |words: Vec<&str>| -> Option<List> {
        let [rows, columns, most, pick] = words.try_into().ok()?;
        let picks = [Pick::First, Pick::Strongest, Pick::Last];
        Some(List {
            rows: rows.parse().ok()?,
            columns: columns.parse().ok()?,
            most: most.parse().ok()?,
            pick: picks.into_iter().find(|known| known.name() == pick)?,
        })
    };
    let fault = || format!("its list is `{text}`, not rows, columns, returns and the one shown");
    list(text.split_whitespace().collect()).ok_or_else(fault)
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
        truth: Truth {
            pixels: Surfaces { outcome: vec![Outcome::Empty], ..Surfaces::default() },
            ..Truth::default()
        },
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

impl Record {
    /// What the file has of point `at`; what it lacks, as of a pixel without a return.
    fn read(fields: &[Field], bytes: &[u8], at: usize) -> Result<Self, String> {
        let mut record = Self {
            position: [f32::NAN; 3],
            intensity: f32::NAN,
            range: f32::NAN,
            time_ns: 0.0,
            pixel: [0; 2],
            number: [1; 2],
            peak: 0,
            marks: 0,
            margin: 0,
            surface: Surface::NONE,
        };
        for field in fields {
            let value = read(field.attribute.blank(), &bytes[field.offset..]);
            record.set(at, field.attribute, value)?;
        }
        if !fields.iter().any(|field| field.attribute == Attribute::Range) {
            let [x, y, z] = record.position;
            record.range = x.hypot(y).hypot(z);
        }
        Ok(record)
    }

    /// What stands beside its pixel.
    fn of_pixel(&self) -> Surface {
        match self.is_return() {
            true => Surface { outcome: self.surface.outcome, ..Surface::NONE },
            false => self.surface,
        }
    }

    fn is_return(&self) -> bool {
        self.range.is_finite()
    }

    fn set(&mut self, at: usize, attribute: Attribute, value: Value) -> Result<(), String> {
        match (attribute, value) {
            (Attribute::X, Value::F4(x)) => self.position[0] = x,
            (Attribute::Y, Value::F4(y)) => self.position[1] = y,
            (Attribute::Z, Value::F4(z)) => self.position[2] = z,
            (Attribute::Intensity, Value::F4(intensity)) => self.intensity = intensity,
            (Attribute::Range, Value::F4(range)) => self.range = range,
            (Attribute::TimeNs, Value::F8(time)) => self.time_ns = time,
            (Attribute::Row, Value::U2(row)) => self.pixel[0] = row,
            (Attribute::Column, Value::U2(column)) => self.pixel[1] = column,
            (Attribute::ReturnNumber, Value::U1(number)) => self.number[0] = number,
            (Attribute::NumberOfReturns, Value::U1(number)) => self.number[1] = number,
            (Attribute::Peak, Value::U2(peak)) => self.peak = peak,
            (Attribute::Marks, Value::U2(marks)) => self.marks = marks,
            (Attribute::Margin, Value::U2(margin)) => self.margin = margin,
            (Attribute::TrueRange, Value::F4(range)) => self.surface.range = range,
            (Attribute::Object, Value::U2(object)) => self.surface.object = object,
            (Attribute::Material, Value::U2(material)) => self.surface.material = material,
            (Attribute::Incidence, Value::F4(angle)) => {
                self.surface.cosine = libm::cos(f64::from(angle)) as f32;
            }
            (Attribute::Outcome, Value::U1(code)) => {
                self.surface.outcome = outcome_from_code(code).ok_or_else(|| {
                    format!("point {at} has the outcome {code}; known are 0 to 5")
                })?;
            }
            // The ring is the row; flags follow from the other columns.
            _ => {}
        }
        Ok(())
    }
}

impl PointCloud {
    /// Adds a return that was read.
    fn add(&mut self, record: &Record) {
        let [x, y, z] = record.position;
        self.x.push(x);
        self.y.push(y);
        self.z.push(z);
        self.intensity.push(record.intensity);
        self.range.push(record.range);
        self.time_ns.push(record.time_ns);
        let ([row, column], [number, of]) = (record.pixel, record.number);
        self.row.push(row);
        self.column.push(column);
        self.return_number.push(number);
        self.number_of_returns.push(of);
        self.peak.push(record.peak);
        self.marks.push(record.marks);
        self.margin.push(record.margin);
        self.photons.push(f32::NAN);
        self.truth.returns.push(record.surface);
    }
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
        assert_eq!((cloud.rows, cloud.columns, cloud.returns()), (0, 0, 2));
        assert_eq!(cloud.range, [13.0, 13.0]);
        assert!(cloud.intensity[0].is_nan());
        assert!(cloud.truth.returns.outcome.is_empty());
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
