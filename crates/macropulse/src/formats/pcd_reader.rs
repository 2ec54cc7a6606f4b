//! Reads PCD files back, ours and those of others that are binary and have x, y and z.

use super::about::{About, viewpoint};
use super::attributes::Attribute;
use super::number::Kind;
use super::table::{self, Layout};
use crate::points::PointCloud;

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

/// The cloud of a binary PCD file, and what it says beside it. Points without x, y and z are pixels
/// that had no return.
///
/// Fields we do not know are skipped and named. Of ours, x, y and z must be there. Truth is read if
/// the file has the outcome.
///
/// An organised file has an image, with a pixel for each of its points. A list has the image of which
/// its header tells; a list of another program has no image: no rows, no columns.
pub(super) fn parse(bytes: &[u8]) -> Result<(PointCloud, About), String> {
    let (mut header, body) = parse_header(bytes)?;
    let columns = header.columns.ok_or("the header has no WIDTH")?;
    let rows = header.rows.ok_or("the header has no HEIGHT")?;
    let points = rows.checked_mul(columns).ok_or("WIDTH × HEIGHT is beyond all bounds")?;
    if header.points.is_some_and(|declared| declared != points) {
        return Err(format!("POINTS is not WIDTH × HEIGHT = {points}"));
    }
    let layout = layout(&header)?;
    let is_list = header.about.list.is_some() || rows == 1 && !layout.has(Attribute::Column);
    let cloud = match is_list {
        true => table::list(&mut header.about, &layout, body, points),
        false => table::image(&mut header.about, &layout, body, [rows, columns]),
    };
    Ok((cloud?, header.about))
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
        if let Some(comment) = line.strip_prefix("# ") {
            header.about.take(comment)?;
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
            "VIEWPOINT" => header.about.viewpoint = viewpoint(values)?,
            "VERSION" | "" => {}
            _ if key.starts_with('#') => {}
            _ => return Err(format!("its header has a line that begins with `{key}`")),
        }
    }
    Err("its header has no DATA line".into())
}

fn whole_number(key: &str, text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| format!("{key} is `{text}`, not a whole number"))
}

/// Where our fields are.
fn layout(header: &Header) -> Result<Layout, String> {
    let names = &header.fields;
    let ones = vec!["1".to_owned(); names.len()];
    let counts = if header.counts.is_empty() { &ones } else { &header.counts };
    if [&header.sizes, &header.types, counts].iter().any(|list| list.len() != names.len()) {
        return Err("FIELDS, SIZE, TYPE and COUNT have different lengths".into());
    }
    let mut layout = Layout::default();
    for (at, name) in names.iter().enumerate() {
        let size = whole_number("SIZE", &header.sizes[at])?;
        let count = whole_number("COUNT", &counts[at])?;
        let letter = &header.types[at];
        let kind = Kind::from_letter(letter, size)
            .ok_or_else(|| format!("field `{name}` is of type {letter}{size}, which is none"))?;
        layout.push(name, kind, count)?;
    }
    Ok(layout)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::Viewpoint;

    fn read(file: &[u8]) -> Result<PointCloud, String> {
        parse(file).map(|(cloud, _)| cloud)
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
    fn faults_are_told_apart() {
        let fault = |file: &[u8]| read(file).unwrap_err();
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
    }
}
