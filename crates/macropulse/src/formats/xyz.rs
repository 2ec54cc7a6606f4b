//! Text without a header: the returns as lines of x, y, z and intensity, with blanks between them.

use super::Names;
use super::attributes::{Attribute, Value, returns};
use super::csv::add_real;
use super::format::CloudWriter;
use super::holding::{Further, Holding};
use super::kitti::ATTRIBUTES;
use crate::points::PointCloud;
use std::io::{self, Write};

/// Lines of x, y, z and, if the cloud has it, intensity. Numbers have the digits that it takes to read the same
/// number back.
pub(super) struct Xyz;

impl CloudWriter for Xyz {
    fn name(&self) -> &'static str {
        "xyz"
    }

    fn other_extensions(&self) -> &'static [&'static str] {
        &["txt"]
    }

    fn holds(&self, attribute: Attribute) -> Holding {
        Holding::among(&ATTRIBUTES, attribute)
    }

    fn holds_further(&self, further: Further) -> bool {
        further == Further::Digits
    }

    fn write(&self, cloud: &PointCloud, _names: &Names, out: &mut dyn Write) -> io::Result<()> {
        let has = Attribute::of(cloud);
        let columns: Vec<_> = ATTRIBUTES.into_iter().filter(|one| has.contains(one)).collect();
        let mut line = String::new();
        for point in returns(cloud) {
            line.clear();
            for (place, attribute) in columns.iter().enumerate() {
                line.push_str(if place > 0 { " " } else { "" });
                match attribute.value(cloud, point) {
                    Value::F8(value) if value.is_finite() => add_real(&mut line, value),
                    Value::F4(value) if value.is_finite() => add_real(&mut line, value),
                    _ => line.push_str("nan"),
                }
            }
            line.push('\n');
            out.write_all(line.as_bytes())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;

    fn text(cloud: &PointCloud) -> String {
        let mut bytes = Vec::new();
        Xyz.write(cloud, &Names::default(), &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn a_line_is_a_return() {
        let lines =
            "30 1 0.5 0.8\n30.5 0 0.5 0.1\n29 1.5 -0.5 0.3\n31.25 0.25 -0.25 1\n28 -1 -0.75 0\n";
        assert_eq!(text(&sample_cloud()), lines);
    }

    #[test]
    fn an_intensity_that_is_none_keeps_its_column() {
        let mut cloud = sample_cloud();
        cloud.intensity[0] = f32::NAN;
        assert!(text(&cloud).starts_with("30 1 0.5 nan\n"));
        cloud.intensity.clear();
        assert!(text(&cloud).starts_with("30 1 0.5\n"));
    }
}
