//! Reads PLY files: ours, and those of others, stored as text or binary in either byte order.

use super::CloudRoom;
use super::about::About;
use super::cloud_file::CloudFile;
use super::headings::Meaning;
use super::number::Kind;
use super::table::{self, Digits, Gathered, Layout, Record};
use crate::points::PointCloud;

/// How the points are stored.
#[derive(Clone, Copy, PartialEq)]
enum Stored {
    Text,
    LittleEndian,
    BigEndian,
}

impl Stored {
    /// Fills `number` with the next one of the file, the lowest byte first, and tells whether there is one.
    fn fill(self, file: &mut CloudFile, number: &mut [u8]) -> Result<bool, String> {
        let is_there = file.fill(number)?;
        if self == Self::BigEndian {
            number.reverse();
        }
        Ok(is_there)
    }
}

/// Part of an element.
enum Property {
    Number(Kind),
    /// A number that says how many follow, and these.
    List(Kind, Kind),
}

#[derive(Default)]
struct Element {
    count: usize,
    properties: Vec<Property>,
}

#[derive(Default)]
struct Header {
    about: About,
    stored: Option<Stored>,
    /// The elements before the points.
    before: Vec<Element>,
    /// The points.
    vertices: Option<Element>,
    /// True if an element behind the points has begun.
    is_over: bool,
    /// The single numbers of the points.
    layout: Layout,
    /// The meanings of these numbers, in their order.
    meanings: Vec<Option<Meaning>>,
}

/// The cloud of a PLY file, and what it says beside it.
pub(super) fn parse(file: &mut CloudFile, room: CloudRoom) -> Result<(PointCloud, About), String> {
    let mut header = parse_header(file)?;
    let mut about = About { room, ..std::mem::take(&mut header.about) };
    let vertices = header.vertices.as_ref().ok_or("it has no element `vertex`")?;
    room.check(vertices.count as u64)?;
    let cloud = match header.stored {
        Some(Stored::Text) => text(&header, vertices, file, &mut about),
        Some(order) => {
            for element in &header.before {
                if !element.skip_all(file, order)? {
                    return Err("it ends before its points; the file was cut short".to_owned());
                }
            }
            table::list(&mut about, &header.layout, vertices.count, &mut |record| {
                vertices.fill(file, order, record)
            })
        }
        None => Err("its header has no line `format`".to_owned()),
    };
    Ok((cloud?, about))
}

/// The header.
fn parse_header(file: &mut CloudFile) -> Result<Header, String> {
    let mut header = Header::default();
    let mut number = 0;
    while let Some(line) = file.header_line()? {
        let line = std::str::from_utf8(line)
            .map_err(|_| "its header is not text; PLY files begin with `ply`")?
            .trim_end();
        number += 1;
        if number == 1 && line != "ply" {
            break;
        }
        if line == "end_header" {
            return Ok(header);
        }
        header.take(line).map_err(|fault| format!("line {number}: {fault}"))?;
    }
    Err("it has no header from `ply` to `end_header`".to_owned())
}

impl Header {
    fn take(&mut self, line: &str) -> Result<(), String> {
        if let Some(comment) = line.strip_prefix("comment ") {
            return self.about.take(comment);
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        match *words.as_slice() {
            ["format", "binary_little_endian", _] => self.stored = Some(Stored::LittleEndian),
            ["format", "binary_big_endian", _] => self.stored = Some(Stored::BigEndian),
            ["format", "ascii", _] => self.stored = Some(Stored::Text),
            ["format", other, ..] => {
                return Err(format!(
                    "its format is {other}; ascii, binary_little_endian and binary_big_endian \
                     are read"
                ));
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| format!("`{count}` is no count"))?;
                let element = Element { count, properties: Vec::new() };
                if self.vertices.is_some() {
                    self.is_over = true;
                } else if name == "vertex" {
                    self.vertices = Some(element);
                } else {
                    self.before.push(element);
                }
            }
            ["property", "list", count, item, _] if !self.is_over => {
                self.add(Property::List(kind_of(count)?, kind_of(item)?));
            }
            ["property", kind, name] if !self.is_over => {
                let kind = kind_of(kind)?;
                if self.vertices.is_some() {
                    let meaning = Meaning::of_heading(name, Some(kind));
                    // The first property of an attribute counts.
                    let is_new = |meaning: &Meaning| !self.layout.has(meaning.attribute);
                    self.meanings.push(meaning.filter(is_new));
                    self.layout.push(name, kind, 1)?;
                }
                self.add(Property::Number(kind));
            }
            _ => {}
        }
        Ok(())
    }

    /// Adds a property to the last element.
    fn add(&mut self, property: Property) {
        let last = self.vertices.as_mut().or(self.before.last_mut());
        if let Some(element) = last {
            element.properties.push(property);
        }
    }
}

fn kind_of(name: &str) -> Result<Kind, String> {
    Ok(match name {
        "uchar" | "uint8" => Kind::U1,
        "char" | "int8" => Kind::I1,
        "ushort" | "uint16" => Kind::U2,
        "short" | "int16" => Kind::I2,
        "uint" | "uint32" => Kind::U4,
        "int" | "int32" => Kind::I4,
        "float" | "float32" => Kind::F4,
        "double" | "float64" => Kind::F8,
        _ => return Err(format!("`{name}` is no type")),
    })
}

impl Element {
    /// Passes over all of these elements, and tells whether they are whole.
    fn skip_all(&self, file: &mut CloudFile, order: Stored) -> Result<bool, String> {
        let mut numbers = 0;
        let mut has_lists = false;
        for property in &self.properties {
            match property {
                Property::Number(kind) => numbers += kind.size(),
                Property::List(..) => has_lists = true,
            }
        }
        if !has_lists {
            return file.skip((numbers as u64).saturating_mul(self.count as u64));
        }
        let mut record = vec![0; numbers];
        for _ in 0..self.count {
            if !self.fill(file, order, &mut record)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Fills a record with the single numbers of the next element, the lowest byte first, and tells whether
    /// the element is whole.
    fn fill(&self, file: &mut CloudFile, order: Stored, record: &mut [u8]) -> Result<bool, String> {
        let mut rest = record;
        for property in &self.properties {
            match property {
                Property::Number(kind) => {
                    let whole = std::mem::take(&mut rest);
                    let Some((number, behind)) = whole.split_at_mut_checked(kind.size()) else {
                        return Ok(false);
                    };
                    if !order.fill(file, number)? {
                        return Ok(false);
                    }
                    rest = behind;
                }
                Property::List(count, item) => {
                    let mut number = [0; 8];
                    let number = &mut number[..count.size()];
                    if !order.fill(file, number)? {
                        return Ok(false);
                    }
                    let items = count.read(number) as u64;
                    if !file.skip(items.saturating_mul(item.size() as u64))? {
                        return Ok(false);
                    }
                }
            }
        }
        Ok(true)
    }
}

/// Points that are lines of text.
fn text(
    header: &Header,
    vertices: &Element,
    file: &mut CloudFile,
    about: &mut About,
) -> Result<PointCloud, String> {
    let meanings = || header.meanings.iter();
    let attributes: Vec<_> = meanings().flatten().map(|meaning| meaning.attribute).collect();
    table::check_coordinates(&attributes)?;
    let mut gathered = Gathered::new(about, &attributes, Digits::AsWritten)?;
    for element in &header.before {
        for _ in 0..element.count {
            // An element is a line.
            if file.line()?.is_none() {
                break;
            }
        }
    }
    let points = vertices.count;
    for at in 0..points {
        let line = file.line()?.ok_or_else(|| table::cut_short(at as u64, points as u64))?;
        let line = std::str::from_utf8(line).map_err(|_| "its points are not text")?;
        let mut words = line.split_whitespace();
        let mut number = || {
            let word = words.next().ok_or_else(|| format!("point {at} lacks numbers"))?;
            word.parse::<f64>().map_err(|_| format!("point {at}: `{word}` is no number"))
        };
        let mut record = Record::default();
        let mut meanings = meanings();
        for property in &vertices.properties {
            let value = number()?;
            match property {
                Property::Number(_) => {
                    if let Some(Some(meaning)) = meanings.next() {
                        record.set(at, meaning.attribute, meaning.number(value))?;
                    }
                }
                Property::List(..) => {
                    for _ in 0..value as usize {
                        number()?;
                    }
                }
            }
        }
        gathered.add(record);
    }
    header.layout.unknown.iter().for_each(|name| about.left_out.field(name));
    gathered.cloud(about)
}

#[cfg(test)]
mod tests {
    use super::super::format::CloudWriter;
    use super::super::ply::PropertyNames;
    use super::super::{Names, sample_cloud};
    use super::*;

    fn parse(bytes: &[u8]) -> Result<(PointCloud, About), String> {
        super::parse(&mut CloudFile::of_bytes(bytes), CloudRoom::default())
    }

    #[test]
    fn what_was_written_is_read() {
        let cloud = sample_cloud();
        let objects = ["car".to_owned(), "road".to_owned()];
        let names = Names { objects: &objects, materials: &[] };
        let [bytes, scalars] = [PropertyNames::Plain, PropertyNames::CloudCompare].map(|kind| {
            let mut bytes = Vec::new();
            kind.write(&cloud, &names, &mut bytes).unwrap();
            bytes
        });
        let header = String::from_utf8_lossy(&scalars);
        assert!(
            header.contains("float z\nproperty float intensity\nproperty float scalar_range\n")
        );
        assert_eq!(parse(&scalars).unwrap().0.time_ns, cloud.time_ns);
        let (read, about) = parse(&bytes).unwrap();
        assert_eq!((read.scan, read.viewpoint, read.pick), (3, cloud.viewpoint, cloud.pick));
        assert_eq!((&read.range, &read.margin), (&cloud.range, &cloud.margin));
        assert_eq!(read.truth.returns.object, cloud.truth.returns.object);
        assert_eq!(about.objects, objects);
        let told = parse(&bytes[..bytes.len() - 1]).unwrap_err();
        assert_eq!(told, "it ends after 4 of 5 points; the file was cut short");
    }

    #[test]
    fn a_stranger_s_text_is_read() {
        let file = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\n\
                    property double z\nproperty uchar red\nelement face 0\n\
                    property list uchar int vertex_indices\nend_header\n3 4 12 255\n0 0 2.5 0\n";
        let (read, _) = parse(file.as_bytes()).unwrap();
        assert_eq!(*read.distances(), [13.0, 2.5]);
        assert_eq!((read.rows, read.columns), (0, 0));
        let short = file.replace("0 0 2.5 0\n", "");
        assert!(parse(short.as_bytes()).unwrap_err().contains("ends after 1 of 2 points"));
        let word = file.replace("2.5", "far");
        assert_eq!(parse(word.as_bytes()).unwrap_err(), "point 1: `far` is no number");
    }

    #[test]
    fn faults_are_told_apart() {
        let fault = |text: &str| parse(text.as_bytes()).unwrap_err();
        assert_eq!(fault("plx\n"), "it has no header from `ply` to `end_header`");
        assert!(fault("ply\nformat braille 1.0\n").contains("line 2: its format is braille"));
        let start = "ply\nformat ascii 1.0\n";
        assert_eq!(fault(&format!("{start}end_header\n")), "it has no element `vertex`");
        let end = "property float x\nend_header\n";
        assert_eq!(fault(&format!("{start}element vertex 9\n{end}")), "it has no field `y`");
    }

    const LISTS: &str = "element camera 2\nproperty list uchar short view\nelement pose 1\n\
                         property double x\nelement vertex 2\nproperty float x\n\
                         property list uint uchar seen\nproperty double Y\nproperty float z\n\
                         property uchar Intensity\nelement face 9\n\
                         property list uchar int vertex_indices\nend_header\n";

    #[test]
    fn lists_and_elements_before_the_points_are_passed_over() {
        let check = |file: &[u8]| {
            let (read, _) = parse(file).unwrap();
            assert_eq!((&read.x[..], &read.y[..]), (&[3.0, 0.0][..], &[4.0, 0.0][..]));
            assert_eq!((&read.z[..], &read.intensity[..]), (&[12.0, 2.5][..], &[200.0, 7.0][..]));
        };
        check(
            format!("ply\nformat ascii 1.0\n{LISTS}2 1 2\n0\n99\n3 2 8 9 4 12 200\n0 0 0 2.5 7\n")
                .as_bytes(),
        );
        for is_big in [false, true] {
            let bytes = |bytes: &[u8]| {
                let mut bytes = bytes.to_vec();
                if is_big {
                    bytes.reverse();
                }
                bytes
            };
            let name = if is_big { "big" } else { "little" };
            let mut file = format!("ply\nformat binary_{name}_endian 1.0\n{LISTS}").into_bytes();
            file.extend([1, 5, 5, 0]);
            file.extend(bytes(&99_f64.to_le_bytes()));
            for (x, seen, y, z, intensity) in
                [(3_f32, &[8, 9][..], 4_f64, 12_f32, 200), (0.0, &[], 0.0, 2.5, 7)]
            {
                file.extend(bytes(&x.to_le_bytes()));
                file.extend(bytes(&(seen.len() as u32).to_le_bytes()));
                file.extend(seen);
                file.extend(bytes(&y.to_le_bytes()));
                file.extend(bytes(&z.to_le_bytes()));
                file.push(intensity);
            }
            check(&file);
            let told = parse(&file[..file.len() - 1]).unwrap_err();
            assert_eq!(told, "it ends after 1 of 2 points; the file was cut short");
            let lies = String::from_utf8_lossy(&file).replace("camera 2", "camera 999999999");
            assert!(parse(lies.as_bytes()).unwrap_err().contains("ends before its points"));
        }
    }

    #[test]
    fn big_endian_points_are_read() {
        let mut file = b"ply\r\nformat binary_big_endian 1.0\r\nelement vertex 2\r\nproperty float x\r\n\
                         property float y\r\nproperty double z\r\nproperty ushort ring\r\nend_header\r\n"
            .to_vec();
        for (x, y, z, ring) in [(3_f32, 4_f32, 12_f64, 258_u16), (0.0, 0.0, 2.5, 1)] {
            file.extend(x.to_be_bytes());
            file.extend(y.to_be_bytes());
            file.extend(z.to_be_bytes());
            file.extend(ring.to_be_bytes());
        }
        let (read, _) = parse(&file).unwrap();
        assert_eq!((&*read.distances(), &read.row[..]), (&[13.0, 2.5][..], &[258, 1][..]));
        assert!(parse(&file[..file.len() - 1]).unwrap_err().contains("ends after 1 of 2"));
    }
}
