//! Comma-separated text: the returns, one per line, for spreadsheets and for eyes.

use super::Names;
use super::attributes::{Attribute, Value, outcome_from_code, returns};
use super::format::CloudWriter;
use super::holding::Further;
use crate::points::{NO_OBJECT, PointCloud};
use std::borrow::Cow;
use std::io::{self, Write};

/// Comma-separated text. Numbers have the digits that it takes to read the same number back.
pub(super) struct Csv;

impl CloudWriter for Csv {
    fn name(&self) -> &'static str {
        "csv"
    }

    fn holds_further(&self, further: Further) -> bool {
        matches!(further, Further::Names | Further::Digits)
    }

    fn write(&self, cloud: &PointCloud, names: &Names, out: &mut dyn Write) -> io::Result<()> {
        let attributes = &Attribute::of(cloud);
        let header: Vec<_> =
            attributes.iter().map(|attribute| attribute.name_with_unit()).collect();
        writeln!(out, "{}", header.join(","))?;
        let mut line = String::new();
        for point in returns(cloud) {
            line.clear();
            for (place, attribute) in attributes.iter().enumerate() {
                if place > 0 {
                    line.push(',');
                }
                add_cell(&mut line, *attribute, attribute.value(cloud, point), names);
            }
            line.push('\n');
            out.write_all(line.as_bytes())?;
        }
        Ok(())
    }
}

/// Adds the cell of a value to `line`; that of no value is empty, which is what spreadsheets take
/// for it.
fn add_cell(line: &mut String, attribute: Attribute, value: Value, names: &Names) {
    match (attribute, value) {
        (Attribute::Object, Value::U2(at)) => add_name(line, names.objects, at),
        (Attribute::Material, Value::U2(at)) => add_name(line, names.materials, at),
        (Attribute::Outcome, Value::U1(code)) => {
            line.push_str(outcome_from_code(code).map_or("", |outcome| outcome.name()));
        }
        (_, Value::F4(value)) => add_real(line, value),
        (_, Value::F8(value)) => add_real(line, value),
        (_, Value::U1(value)) => add_whole(line, value.into()),
        (_, Value::U2(value)) => add_whole(line, value.into()),
        (_, Value::U4(value)) => add_whole(line, value),
    }
}

pub(super) fn add_real<T: zmij::Float + Into<f64> + Copy>(line: &mut String, value: T) {
    let wide: f64 = value.into();
    if wide.is_finite() {
        let mut buffer = zmij::Buffer::new();
        let text = buffer.format_finite(value);
        line.push_str(text.strip_suffix(".0").unwrap_or(text));
    } else if wide.is_infinite() {
        line.push_str(if wide > 0.0 { "inf" } else { "-inf" });
    }
}

fn add_whole(line: &mut String, value: u32) {
    line.push_str(itoa::Buffer::new().format(value));
}

fn add_name(line: &mut String, names: &[String], at: u16) {
    match names.get(usize::from(at)) {
        _ if at == NO_OBJECT => {}
        Some(name) => line.push_str(&quoted(name)),
        None => add_whole(line, at.into()),
    }
}

/// Signs by which a spreadsheet knows a formula.
const OF_FORMULAS: [char; 6] = ['=', '+', '-', '@', '\t', '\r'];

/// A name as the text of a cell: in quotes if it would otherwise end its cell \[RFC4180\], and behind an
/// apostrophe if a spreadsheet would compute it. A number stays as it is.
pub fn quoted(name: &str) -> Cow<'_, str> {
    let is_formula = name.starts_with(OF_FORMULAS) && name.parse::<f64>().is_err();
    let name = if is_formula { Cow::Owned(format!("'{name}")) } else { Cow::Borrowed(name) };
    match name.contains([',', '"', '\n', '\r']) {
        true => Cow::Owned(format!("\"{}\"", name.replace('"', "\"\""))),
        false => name,
    }
}

/// The name that [`quoted`] put behind an apostrophe, or `cell` itself.
pub(super) fn unquoted(cell: &str) -> &str {
    cell.strip_prefix('\'').filter(|name| name.starts_with(OF_FORMULAS)).unwrap_or(cell)
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;
    use crate::points::Truth;

    fn lines(cloud: &PointCloud, names: &Names) -> Vec<String> {
        let mut bytes = Vec::new();
        Csv.write(cloud, names, &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap().lines().map(str::to_owned).collect()
    }

    #[test]
    fn a_line_reads_as_expected() {
        let objects = ["car, red".to_owned()];
        let materials = ["paint".to_owned(), "glass".to_owned()];
        let lines = lines(&sample_cloud(), &Names { objects: &objects, materials: &materials });
        assert_eq!(
            lines[0],
            "x_m,y_m,z_m,intensity,range_m,time_ns,row,column,ring,peak,marks,margin,\
             return_number,number_of_returns,flags,true_range_m,object,material,incidence_rad,outcome"
        );
        assert_eq!(
            lines[1],
            "30,1,0.5,0.8,30.02,0,0,0,0,174,174,80,1,1,0,30.02,\"car, red\",glass,0,right"
        );
        assert_eq!(lines.len(), 1 + 5);
    }

    #[test]
    fn a_false_return_has_empty_truth() {
        let lines = lines(&sample_cloud(), &Names::default());
        assert!(lines[5].ends_with(",58,58,20,1,1,0,,,,,false"), "{}", lines[5]);
    }

    #[test]
    fn spreadsheet_computes_no_name() {
        for (name, cell) in [
            ("=1+1", "'=1+1"),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("-x", "'-x"),
            ("+x, y", "\"'+x, y\""),
            ("-1.5", "-1.5"),
            ("car", "car"),
            ("'tis", "'tis"),
        ] {
            assert_eq!(quoted(name), cell);
            let inner = cell.trim_matches('"');
            assert_eq!(unquoted(inner), name);
        }
    }

    #[test]
    fn without_truth_the_line_is_shorter() {
        let cloud = PointCloud { truth: Truth::default(), ..sample_cloud() };
        assert_eq!(lines(&cloud, &Names::default())[0].split(',').count(), 15);
    }
}
