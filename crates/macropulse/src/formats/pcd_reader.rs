//! Reads PCD files: ours, and those of PCL and others, of the versions 0.5 to 0.7, stored as text,
//! binary or compressed.

use super::about::{About, viewpoint};
use super::attributes::Attribute;
use super::cloud_file::CloudFile;
use super::headings::Meaning;
use super::number::Kind;
use super::table::{self, Layout};
use super::{CloudRoom, interleave, lzf};
use crate::points::PointCloud;
use std::iter::repeat_n;

/// How the points are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Data {
    Text,
    Binary,
    Compressed,
}

#[derive(Debug, Default)]
struct Header {
    about: About,
    fields: Vec<String>,
    sizes: Vec<String>,
    types: Vec<String>,
    counts: Vec<String>,
    columns: Option<usize>,
    rows: Option<usize>,
    points: Option<usize>,
}

/// A field of a point: `count` numbers of a kind.
struct Field<'a> {
    name: &'a str,
    kind: Kind,
    count: usize,
}

/// The cloud of a PCD file, and what it says beside it. Points without x, y and z are pixels that had
/// no return. Truth is read if the file has the outcome.
///
/// An organised file has an image, with a pixel for each of its points. A list has the image that its header
/// describes; a list of another program has no image: no rows, no columns.
pub(super) fn parse(file: &mut CloudFile, room: CloudRoom) -> Result<(PointCloud, About), String> {
    let (mut header, data) = parse_header(file)?;
    header.about.room = room;
    let [rows, columns] = header.shape()?;
    let points = rows.checked_mul(columns).ok_or("WIDTH × HEIGHT is beyond all bounds")?;
    if header.points.is_some_and(|declared| declared != points) {
        return Err(format!("POINTS is not WIDTH × HEIGHT = {points}"));
    }
    room.check(points as u64)?;
    let fields = header.fields()?;
    let (layout, words_of) = match data {
        Data::Text => layout_of_text(&fields),
        Data::Binary | Data::Compressed => (layout(&fields)?, Vec::new()),
    };
    let unpacked = match data {
        Data::Compressed => unpacked(&fields, file, points, room)?,
        Data::Binary | Data::Text => Vec::new(),
    };
    let mut read = 0;
    let mut unpacked = table::records(&unpacked);
    let next: table::Next = &mut |record| match data {
        Data::Binary => file.fill(record),
        Data::Compressed => unpacked(record),
        Data::Text => {
            let Some(line) = file.line_of_words()? else { return Ok(false) };
            let line = std::str::from_utf8(line).map_err(|_| "its points are not text")?;
            numbers(line, &words_of, record).map_err(|fault| format!("point {read}{fault}"))?;
            read += 1;
            Ok(true)
        }
    };
    let is_list = header.about.list.is_some() || rows == 1 && !layout.has(Attribute::Column);
    let cloud = match is_list {
        true => table::list(&mut header.about, &layout, points, next),
        false => table::image(&mut header.about, &layout, [rows, columns], next),
    };
    Ok((cloud?, header.about))
}

/// The header, and how the points behind it are stored.
fn parse_header(file: &mut CloudFile) -> Result<(Header, Data), String> {
    let mut header = Header::default();
    while let Some(line) = file.header_line()? {
        let line = std::str::from_utf8(line)
            .map_err(|_| "its header is not text; PCD files begin with `# .PCD` or `VERSION`")?
            .trim();
        if let Some(comment) = line.strip_prefix("# ") {
            header.about.take(comment)?;
        }
        let (key, values) = line.split_once([' ', '\t']).unwrap_or((line, ""));
        let values = values.trim();
        let words = || values.split_whitespace().map(str::to_owned).collect();
        match key {
            "VERSION" if !is_read(values) => {
                return Err(format!("its version is {values}; 0.5, 0.6 and 0.7 are read"));
            }
            // As the fields were called before version 0.6.
            "FIELDS" | "COLUMNS" => header.fields = words(),
            "SIZE" => header.sizes = words(),
            "TYPE" => header.types = words(),
            "COUNT" => header.counts = words(),
            "WIDTH" => header.columns = Some(whole_number(key, values)?),
            "HEIGHT" => header.rows = Some(whole_number(key, values)?),
            "POINTS" => header.points = Some(whole_number(key, values)?),
            "DATA" => {
                let data = match values {
                    "ascii" => Data::Text,
                    "binary" => Data::Binary,
                    "binary_compressed" => Data::Compressed,
                    _ => {
                        return Err(format!(
                            "its points are stored as `{values}`; ascii, binary and \
                             binary_compressed are read"
                        ));
                    }
                };
                return Ok((header, data));
            }
            "VIEWPOINT" => header.about.viewpoint = viewpoint(values)?,
            "VERSION" | "" => {}
            _ if key.starts_with('#') => {}
            _ => return Err(format!("its header has a line that begins with `{key}`")),
        }
    }
    Err("its header has no DATA line".into())
}

fn is_read(version: &str) -> bool {
    matches!(version.trim_start_matches('0'), ".5" | ".6" | ".7")
}

fn whole_number(key: &str, text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| format!("{key} is `{text}`, not a whole number"))
}

impl Header {
    /// Rows and columns. Version 0.5 has the number of points alone.
    fn shape(&self) -> Result<[usize; 2], String> {
        match (self.rows, self.columns, self.points) {
            (Some(rows), Some(columns), _) => Ok([rows, columns]),
            (None, Some(columns), _) => Ok([1, columns]),
            (None, None, Some(points)) => Ok([1, points]),
            (_, None, _) => Err("the header has no WIDTH".to_owned()),
        }
    }

    /// The fields. A field whose size, type and count are not in the header is a single float.
    fn fields(&self) -> Result<Vec<Field<'_>>, String> {
        let names = &self.fields;
        let lists = [&self.sizes, &self.types, &self.counts];
        if lists.iter().any(|list| !list.is_empty() && list.len() != names.len()) {
            return Err("FIELDS, SIZE, TYPE and COUNT have different lengths".to_owned());
        }
        let mut fields = Vec::new();
        for (at, name) in names.iter().enumerate() {
            let size = self.sizes.get(at).map_or(Ok(4), |size| whole_number("SIZE", size))?;
            let count = self.counts.get(at).map_or(Ok(1), |count| whole_number("COUNT", count))?;
            let letter = self.types.get(at).map_or("F", String::as_str);
            let kind = Kind::from_letter(letter, size).ok_or_else(|| {
                format!("field `{name}` is of type {letter}{size}, which is none")
            })?;
            fields.push(Field { name, kind, count });
        }
        Ok(fields)
    }
}

/// Places of our attributes in binary points.
fn layout(fields: &[Field]) -> Result<Layout, String> {
    let mut layout = Layout::default();
    for Field { name, kind, count } in fields {
        layout.push(name, *kind, *count)?;
    }
    Ok(layout)
}

/// The points of a compressed body, point by point. They are packed field by field, behind the sizes
/// of all of it packed and unpacked.
fn unpacked(
    fields: &[Field],
    file: &mut CloudFile,
    points: usize,
    room: CloudRoom,
) -> Result<Vec<u8>, String> {
    let cut_short = "it ends within its compressed points; the file was cut short";
    let mut size = || {
        let mut bytes = [0; 4];
        let is_there = file.fill(&mut bytes)?;
        is_there.then_some(u32::from_le_bytes(bytes)).ok_or_else(|| cut_short.to_owned())
    };
    let (packed, size) = (size()?, size()? as usize);
    let width = |field: &Field| field.kind.size().checked_mul(field.count);
    let widths: Option<Vec<usize>> = fields.iter().map(width).collect();
    let widths = widths.ok_or("a point is beyond all bounds")?;
    let stride = widths.iter().try_fold(0_usize, |sum, width| sum.checked_add(*width));
    let stride = stride.ok_or("a point is beyond all bounds")?;
    if points.checked_mul(stride) != Some(size) {
        return Err(format!(
            "its compressed points are {size} bytes, and {points} points of {stride} bytes are \
             not; the file is damaged"
        ));
    }
    // The packed bytes, and the unpacked ones twice: field by field and point by point.
    room.check_beside(u64::from(packed) + 2 * size as u64, points as u64)?;
    let packed = file.bytes(packed.into())?.ok_or(cut_short)?;
    let columns = lzf::unpack(&packed, size).ok_or("its compressed points are damaged")?;
    Ok(interleave::columns(&columns, &widths, points))
}

/// Places of our attributes in points made of the words of a line. For each field, true if its words are
/// kept, and their number.
fn layout_of_text(fields: &[Field]) -> (Layout, Vec<(bool, usize)>) {
    let mut layout = Layout::of_text();
    let mut words_of = Vec::new();
    for Field { name, kind, count } in fields {
        let meaning = Meaning::of_heading(name, Some(*kind)).filter(|_| *count == 1);
        let is_kept = layout.place((name, meaning), Kind::F8, layout.stride);
        words_of.push((is_kept, *count));
        layout.stride += if is_kept { Kind::F8.size() } else { 0 };
    }
    (layout, words_of)
}

/// Fills a record with the numbers of a line that are kept.
fn numbers(line: &str, words_of: &[(bool, usize)], record: &mut [u8]) -> Result<(), String> {
    let mut words = line.split_whitespace();
    let mut kept = record.chunks_exact_mut(Kind::F8.size());
    let each = words_of.iter().flat_map(|(is_kept, count)| repeat_n(*is_kept, *count));
    for is_kept in each {
        let word = words.next().ok_or(" lacks numbers")?;
        if is_kept && let Some(bytes) = kept.next() {
            let number: f64 = word.parse().map_err(|_| format!(": `{word}` is no number"))?;
            bytes.copy_from_slice(&number.to_le_bytes());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::Viewpoint;

    fn read(file: &[u8]) -> Result<PointCloud, String> {
        parse(&mut CloudFile::of_bytes(file), CloudRoom::default()).map(|(cloud, _)| cloud)
    }

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
        let cloud = read(&foreign(XYZ_RGB, 2)).unwrap();
        assert_eq!((cloud.rows, cloud.columns, cloud.returns()), (0, 0, 2));
        assert_eq!(*cloud.distances(), [13.0, 13.0]);
        assert!(cloud.range.is_empty() && cloud.intensity.is_empty() && cloud.marks.is_empty());
        assert_eq!(cloud.flags(0), 0);
        assert!(cloud.truth.returns.outcome.is_empty());
    }

    #[test]
    fn text_is_read_as_the_field_types_say() {
        // An organised 2 × 2 image with a pixel that met nothing, a descriptor of three numbers, and a
        // range in whole millimetres.
        let file = "# .PCD v.7\r\nVERSION .7\r\nFIELDS X Y Z hist rgb Intensity range\r\n\
                    SIZE 4 4 4 4 4 4 4\r\nTYPE F F F F F F U\r\nCOUNT 1 1 1 3 1 1 1\r\nWIDTH 2\r\n\
                    HEIGHT 2\r\nVIEWPOINT 0 0 0 1 0 0 0\r\nPOINTS 4\r\nDATA ascii\r\n\
                    3 4 12 .1 .2 .3 4.2108e+06 0.5 13001\r\nnan nan nan 0 0 0 0 0 0\r\n\r\n\
                    0 0 2.5 0 0 0 0 1 2500\r\n1 2 2 0 0 0 0 7e-1 3000\r\n";
        let cloud = read(file.as_bytes()).unwrap();
        assert_eq!((cloud.rows, cloud.columns, cloud.returns()), (2, 2, 3));
        assert_eq!(cloud.range, [13.001, 2.5, 3.0]);
        assert_eq!(cloud.intensity, [0.5, 1.0, 0.7]);
        assert_eq!(
            (cloud.row.as_slice(), cloud.column.as_slice()),
            (&[0, 1, 1][..], &[0, 0, 1][..])
        );
        let fault = |from: &str, to: &str| read(file.replace(from, to).as_bytes()).unwrap_err();
        assert_eq!(fault("2.5", "far"), "point 2: `far` is no number");
        assert_eq!(fault(" 3000", ""), "point 3 lacks numbers");
        assert!(fault("1 2 2 0 0 0 0 7e-1 3000", "").contains("ends after 3 of 4 points"));
        assert!(
            fault("1 1 1 3 1 1 1", "1 1 1 99999999999 1 1 1").contains("point 0 lacks numbers")
        );
    }

    #[test]
    fn old_headers_are_read() {
        let cloud = read(b"# .PCD v.5\nCOLUMNS x y z\nPOINTS 2\nDATA ascii\n3 4 12\n0 0 2\n");
        assert_eq!(*cloud.unwrap().distances(), [13.0, 2.0]);
        let file = "VERSION 0.6\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n1 2 2\n";
        assert_eq!(*read(file.as_bytes()).unwrap().distances(), [3.0]);
        let later = file.replace("0.6", "0.8");
        assert!(read(later.as_bytes()).unwrap_err().starts_with("its version is 0.8; 0.5, 0.6"));
    }

    /// Two points of x, y, z and a whole number of 2 bytes, packed field by field as one run.
    fn compressed() -> Vec<u8> {
        let mut columns = Vec::new();
        for column in [[3f32, 0.0], [4.0, 0.0], [12.0, 2.5]] {
            columns.extend(column.iter().flat_map(|value| value.to_le_bytes()));
        }
        columns.extend([7_u16, 9].iter().flat_map(|value| value.to_le_bytes()));
        let mut file =
            b"VERSION 0.7\nFIELDS x y z ring\nSIZE 4 4 4 2\nTYPE F F F U\nCOUNT 1 1 1 1\n\
                         WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA binary_compressed\n"
                .to_vec();
        file.extend((columns.len() as u32 + 1).to_le_bytes());
        file.extend((columns.len() as u32).to_le_bytes());
        file.push(columns.len() as u8 - 1);
        file.extend(columns);
        file
    }

    #[test]
    fn compressed_points_are_read() {
        let file = compressed();
        let cloud = read(&file).unwrap();
        assert_eq!((&*cloud.distances(), cloud.row.as_slice()), (&[13.0, 2.5][..], &[7, 9][..]));
        assert!(read(&file[..file.len() - 1]).unwrap_err().contains("cut short"));
        let mut lies = file.clone();
        let at = lies.len() - 29 - 4;
        lies[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(read(&lies).unwrap_err().contains("compressed points are 4294967295 bytes"));
    }

    #[test]
    fn faults_are_told_apart() {
        let fault = |file: &[u8]| read(file).unwrap_err();
        let whole = foreign(XYZ_RGB, 2);
        assert_eq!(
            fault(&whole[..whole.len() - 1]),
            "it ends after 1 of 2 points; the file was cut short"
        );
        assert_eq!(
            fault(b"VERSION 0.7\nDATA braille\n"),
            "its points are stored as `braille`; ascii, binary and binary_compressed are read"
        );
        assert_eq!(fault(b"ply\n"), "its header has a line that begins with `ply`");
        assert_eq!(fault(b""), "its header has no DATA line");
        assert_eq!(
            fault(&foreign("FIELDS x y\nSIZE 4 4\nTYPE F F\nCOUNT 1 1", 1)),
            "it has no field `z`"
        );
        assert_eq!(
            fault(&foreign("FIELDS x y z\nSIZE 2 4 4\nTYPE F F F\nCOUNT 1 1 1", 1)),
            "field `x` is of type F2, which is none"
        );
        assert_eq!(
            fault(&foreign("FIELDS x y z\nSIZE 4 4\nTYPE F F F\nCOUNT 1 1 1", 1)),
            "FIELDS, SIZE, TYPE and COUNT have different lengths"
        );
    }

    #[test]
    fn a_viewpoint_is_seven_numbers() {
        let with = |viewpoint: &str| read(&foreign(&format!("{viewpoint}\n{XYZ_RGB}"), 1));
        let cloud = with("VIEWPOINT 1 2 -3.5 0.8 0 0 0.6").unwrap();
        assert_eq!(cloud.viewpoint.position, [1.0, 2.0, -3.5]);
        assert_eq!(cloud.viewpoint.turn, [0.8, 0.0, 0.0, 0.6]);
        assert_eq!(read(&foreign(XYZ_RGB, 1)).unwrap().viewpoint, Viewpoint::default());
        for wrong in ["0 0 0 1 0 0", "0 0 0 1 0 0 0 0", "0 0 0 1 0 0 x 0", "0 0 nan 1 0 0 0"] {
            let told = with(&format!("VIEWPOINT {wrong}")).unwrap_err();
            assert_eq!(told, format!("VIEWPOINT is `{wrong}`, not seven finite numbers"));
        }
    }

    #[test]
    fn absurd_sizes_are_refused_not_allocated() {
        let huge = format!("{XYZ_RGB}\nWIDTH {}\nHEIGHT 9\nDATA binary\n", usize::MAX);
        assert_eq!(read(huge.as_bytes()).unwrap_err(), "WIDTH × HEIGHT is beyond all bounds");
        let huge = format!("{XYZ_RGB}\nWIDTH {}\nHEIGHT 1\nDATA ascii\n1 2 3 4\n", usize::MAX);
        assert!(read(huge.as_bytes()).unwrap_err().contains("points take about"));
        let long = XYZ_RGB.replace("1 1 1 1", "1 1 1 300000");
        let long = format!("{long}\nWIDTH 1\nHEIGHT 1\nDATA binary\n");
        assert_eq!(
            read(long.as_bytes()).unwrap_err(),
            "a point takes 1200012 bytes; up to 1048576 are read"
        );
    }
}
