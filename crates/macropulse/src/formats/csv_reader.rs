//! Reads comma-separated text back: a header with names of ours, then a point a line.

use super::about::About;
use super::attributes::Attribute;
use super::table::{Digits, Gathered, Record, check_coordinates};
use crate::points::{NO_OBJECT, Outcome, PointCloud};
use std::borrow::Cow;

/// The cloud of a CSV file, and the names in it. Columns whose names we do not know are skipped, and
/// an empty cell is no value. Objects and materials may be names or numbers; names are numbered in
/// the order in which they come.
pub(super) fn parse(bytes: &[u8]) -> Result<(PointCloud, About), String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not text")?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines();
    let header = lines.next().ok_or("it is empty; its first line names the columns")?;
    let columns: Vec<Option<Attribute>> =
        header.split(',').map(|name| Attribute::named(name.trim().trim_matches('"'))).collect();
    let attributes: Vec<Attribute> = columns.iter().flatten().copied().collect();
    check_coordinates(&attributes).map_err(|fault| {
        format!(
            "{fault}; its first line has the names of columns with commas between, as `x_m,y_m,z_m`"
        )
    })?;
    let mut about = About::default();
    let mut gathered = Gathered::new(&about, &attributes, Digits::AsWritten)?;
    for (at, line) in lines.enumerate() {
        if line.is_empty() {
            continue;
        }
        // The second line of the file is that of point 0.
        let fault = |fault: String| format!("line {}: {fault}", at + 2);
        let mut rest = Some(line);
        let mut record = Record::default();
        for column in &columns {
            let cell = next_cell(&mut rest).map_err(fault)?;
            let Some(attribute) = *column else { continue };
            let value = value(attribute, &cell, &mut about).map_err(fault)?;
            if let Some(value) = value {
                record.set(at, attribute, value).map_err(fault)?;
            }
        }
        if rest.is_some() {
            return Err(fault("it has more cells than there are columns".to_owned()));
        }
        gathered.add(record);
    }
    for name in header.split(',').map(|name| name.trim().trim_matches('"')) {
        if Attribute::named(name).is_none() {
            about.left_out.field(name);
        }
    }
    Ok((gathered.cloud(&mut about)?, about))
}

/// Takes a cell off the line, without the quotes around it.
fn next_cell<'a>(rest: &mut Option<&'a str>) -> Result<Cow<'a, str>, String> {
    let line = rest.ok_or("it has fewer cells than there are columns; was the file cut short?")?;
    let Some(mut inner) = line.strip_prefix('"') else {
        let (cell, behind) = line.split_once(',').map_or((line, None), |(a, b)| (a, Some(b)));
        *rest = behind;
        return Ok(Cow::Borrowed(cell));
    };
    let mut cell = String::new();
    loop {
        let (part, behind) = inner.split_once('"').ok_or("a quote is not closed")?;
        cell.push_str(part);
        match behind.strip_prefix('"') {
            Some(further) => (cell.push('"'), inner = further).1,
            None => {
                *rest = behind.strip_prefix(',');
                return Ok(Cow::Owned(cell));
            }
        }
    }
}

/// The number that a cell stands for; none for an empty one.
fn value(attribute: Attribute, cell: &str, about: &mut About) -> Result<Option<f64>, String> {
    let cell = cell.trim();
    if cell.is_empty() {
        return Ok(None);
    }
    let number = cell.parse::<f64>().ok();
    let number = match attribute {
        Attribute::Outcome => {
            let known = Outcome::ALL.into_iter().find(|outcome| outcome.name() == cell);
            known.map(|outcome| f64::from(outcome as u8)).or(number)
        }
        Attribute::Object => number.or_else(|| numbered(&mut about.objects, cell)),
        Attribute::Material => number.or_else(|| numbered(&mut about.materials, cell)),
        _ => number,
    };
    number.map(Some).ok_or_else(|| format!("`{cell}` is no {}", attribute.name()))
}

/// The number of a name, a new one for a new name.
fn numbered(names: &mut Vec<String>, name: &str) -> Option<f64> {
    let at = names.iter().position(|known| known == name).unwrap_or(names.len());
    if at == names.len() {
        if at >= usize::from(NO_OBJECT) {
            return None;
        }
        names.push(name.to_owned());
    }
    Some(at as f64)
}

#[cfg(test)]
mod tests {
    use super::super::{Names, csv, sample_cloud};
    use super::*;

    #[test]
    fn what_was_written_is_read() {
        let cloud = sample_cloud();
        let objects = ["car, red".to_owned(), "the \"road\"".to_owned()];
        let mut bytes = Vec::new();
        csv::write(&cloud, &Names { objects: &objects, materials: &[] }, &mut bytes).unwrap();
        let (read, about) = parse(&bytes).unwrap();
        assert_eq!((read.rows, read.columns), (2, 3));
        assert_eq!((&read.range, &read.time_ns), (&cloud.range, &cloud.time_ns));
        assert_eq!(read.truth.returns.outcome, cloud.truth.returns.outcome);
        assert_eq!(read.truth.returns.object, cloud.truth.returns.object);
        assert_eq!(read.truth.returns.material, cloud.truth.returns.material);
        assert_eq!(about.objects, objects);
    }

    #[test]
    fn faults_have_their_line() {
        let fault = |text: &str| parse(text.as_bytes()).unwrap_err();
        assert_eq!(fault(""), "it is empty; its first line names the columns");
        assert!(fault("a,b\n1,2\n").starts_with("it has no field `x`; its first line has"));
        assert_eq!(fault("x,y,z\n1,2,far\n"), "line 2: `far` is no z");
        assert!(fault("x,y,z\n1,2,3\n1,2\n").starts_with("line 3: it has fewer cells"));
        assert!(fault("x,y,z\n1,2,3,4\n").starts_with("line 2: it has more cells"));
        assert!(fault("x,y,z\n1,2,\"3\n").starts_with("line 2: a quote is not closed"));
        assert!(fault("x,y,z,row\n1,2,3,-1\n").contains("whole numbers from 0 to 65535"));
    }

    #[test]
    fn a_file_of_another_program_needs_x_y_and_z_alone() {
        let (read, _) = parse(b"z,name,y,x\n12,a,4,3\n\n").unwrap();
        assert_eq!((&*read.distances(), read.rows), (&[13.0][..], 0));
        assert!(read.range.is_empty() && read.time_ns.is_empty() && read.intensity.is_empty());
    }

    #[test]
    fn digits_beyond_those_of_a_float_are_kept() {
        let far = b"x,y,z,range_m\n494428.61,4877455.58,123.456,30.02\n1,2,3,4\n";
        let (read, about) = parse(far).unwrap();
        assert_eq!(read.position(0), [494_428.61, 4_877_455.58, 123.456]);
        assert!(read.exact.range.is_empty() && about.left_out.is_empty());
        let (read, _) = parse(b"x,y,z\n0.1,30.02,-5e-3\n").unwrap();
        assert!(read.exact.x.is_empty());
        assert_eq!((read.x[0], read.y[0], read.z[0]), (0.1, 30.02, -5e-3));
    }
}
