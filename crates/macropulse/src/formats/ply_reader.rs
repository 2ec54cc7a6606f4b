//! Reads PLY files back, ours and those of others that are binary little endian or text and have
//! their points first.

use super::about::About;
use super::attributes::Attribute;
use super::number::Kind;
use super::ply;
use super::table::{self, Digits, Gathered, Layout, Record};
use crate::points::PointCloud;

/// How the points are stored.
#[derive(Clone, Copy, PartialEq)]
enum Stored {
    Binary,
    Text,
}

#[derive(Default)]
struct Header {
    about: About,
    stored: Option<Stored>,
    points: Option<usize>,
    /// Whether another element has begun.
    is_over: bool,
    layout: Layout,
    /// What the words of a line of text are.
    words: Vec<Option<Attribute>>,
}

/// The cloud of a PLY file, and what it says beside it.
pub(super) fn parse(bytes: &[u8]) -> Result<(PointCloud, About), String> {
    let (mut header, body) = parse_header(bytes)?;
    let points = header.points.ok_or("it has no element `vertex`")?;
    let cloud = match header.stored {
        Some(Stored::Binary) => table::list(&mut header.about, &header.layout, body, points),
        Some(Stored::Text) => text(&mut header, body, points),
        None => Err("its header has no line `format`".to_owned()),
    };
    Ok((cloud?, header.about))
}

/// The header, and the bytes after it.
fn parse_header(bytes: &[u8]) -> Result<(Header, &[u8]), String> {
    let mut header = Header::default();
    let mut rest = bytes;
    let mut number = 0;
    while let Some(end) = rest.iter().position(|&byte| byte == b'\n') {
        let line = std::str::from_utf8(&rest[..end])
            .map_err(|_| "its header is not text; PLY files begin with `ply`")?
            .trim_end();
        rest = &rest[end + 1..];
        number += 1;
        if number == 1 && line != "ply" {
            break;
        }
        if line == "end_header" {
            return Ok((header, rest));
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
            ["format", "binary_little_endian", _] => self.stored = Some(Stored::Binary),
            ["format", "ascii", _] => self.stored = Some(Stored::Text),
            ["format", other, ..] => {
                return Err(format!(
                    "its format is {other}; binary_little_endian and ascii are read"
                ));
            }
            ["element", "vertex", count] => {
                if self.is_over {
                    return Err("its points do not come first".to_owned());
                }
                let points = count.parse().map_err(|_| format!("`{count}` is no count"))?;
                self.points = Some(points);
            }
            ["element", ..] => self.is_over = true,
            ["property", "list", ..] if !self.is_over => {
                return Err("a point has a list; single numbers are read".to_owned());
            }
            ["property", kind, name] if !self.is_over => {
                // As CloudCompare calls scalar fields.
                let name = name.strip_prefix(ply::SCALAR).unwrap_or(name);
                let known = kind_of(kind).ok_or_else(|| format!("`{kind}` is no type"))?;
                self.words.push(Attribute::named(name));
                self.layout.push(name, known, 1)?;
            }
            _ => {}
        }
        Ok(())
    }
}

fn kind_of(name: &str) -> Option<Kind> {
    Some(match name {
        "uchar" | "uint8" => Kind::U1,
        "char" | "int8" => Kind::I1,
        "ushort" | "uint16" => Kind::U2,
        "short" | "int16" => Kind::I2,
        "uint" | "uint32" => Kind::U4,
        "int" | "int32" => Kind::I4,
        "float" | "float32" => Kind::F4,
        "double" | "float64" => Kind::F8,
        _ => return None,
    })
}

/// Points that are lines of text.
fn text(header: &mut Header, body: &[u8], points: usize) -> Result<PointCloud, String> {
    let text = std::str::from_utf8(body).map_err(|_| "its points are not text")?;
    let attributes: Vec<Attribute> = header.words.iter().flatten().copied().collect();
    table::check_coordinates(&attributes)?;
    let mut gathered = Gathered::new(&header.about, &attributes, Digits::AsWritten)?;
    let mut lines = text.lines();
    for at in 0..points {
        let line = lines.next().ok_or_else(|| {
            format!("it ends after {at} of {points} points; the file was cut short")
        })?;
        let mut words = line.split_whitespace();
        let mut record = Record::default();
        for attribute in &header.words {
            let word = words.next().ok_or_else(|| format!("point {at} lacks numbers"))?;
            let value = word.parse().map_err(|_| format!("point {at}: `{word}` is no number"))?;
            if let Some(attribute) = attribute {
                record.set(at, *attribute, value)?;
            }
        }
        gathered.add(record);
    }
    header.layout.unknown.iter().for_each(|name| header.about.left_out.field(name));
    gathered.cloud(&mut header.about)
}

#[cfg(test)]
mod tests {
    use super::super::ply::Called;
    use super::super::{Names, sample_cloud};
    use super::*;

    #[test]
    fn what_was_written_is_read() {
        let cloud = sample_cloud();
        let objects = ["car".to_owned(), "road".to_owned()];
        let names = Names { objects: &objects, materials: &[] };
        let [bytes, scalars] = [Called::AsTheyAre, Called::Scalars].map(|called| {
            let mut bytes = Vec::new();
            ply::write(&cloud, &names, called, &mut bytes).unwrap();
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
        assert!(fault("ply\nformat binary_big_endian 1.0\n").contains("line 2: its format is"));
        let start = "ply\nformat ascii 1.0\n";
        assert_eq!(fault(&format!("{start}end_header\n")), "it has no element `vertex`");
        let end = "property float x\nend_header\n";
        assert_eq!(fault(&format!("{start}element vertex 9\n{end}")), "it has no field `y`");
    }
}
