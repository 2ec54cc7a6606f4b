//! PCD 0.7, binary: organised, every pixel, where a shot has one return at most; else a list.

use super::Names;
use super::about::{list_line, name_lines, scan_line, stamp_line, viewpoint_text};
use super::attributes::{Attribute, pixels, returns};
use super::format::CloudWriter;
use super::holding::Further;
use crate::points::PointCloud;
use std::io::{self, Write};

/// Point Cloud Data 0.7, binary. If a shot has one return at most, the file has every pixel: `WIDTH`
/// is the number of columns, `HEIGHT` the number of rows. A pixel without a return is NaN, never 0. If a shot
/// may have several returns, or the cloud has no pixels, the file has the returns as a list: `HEIGHT` is 1.
pub(super) struct Pcd;

impl CloudWriter for Pcd {
    fn name(&self) -> &'static str {
        "pcd"
    }

    fn holds_further(&self, _further: Further) -> bool {
        true
    }

    fn write(&self, cloud: &PointCloud, names: &Names, out: &mut dyn Write) -> io::Result<()> {
        let attributes = Attribute::of(cloud);
        write_header(cloud, &attributes, names, out)?;
        let mut bytes = Vec::new();
        let points = if is_list(cloud) { returns(cloud).collect() } else { pixels(cloud) };
        for point in points {
            bytes.clear();
            for attribute in &attributes {
                attribute.value(cloud, point).append_to(&mut bytes);
            }
            out.write_all(&bytes)?;
        }
        Ok(())
    }
}

/// Returns true if the points are a list and no image.
pub(super) fn is_list(cloud: &PointCloud) -> bool {
    let has_pixels = cloud.has(cloud.row.len()) && cloud.has(cloud.column.len());
    cloud.returns_per_shot > 1 || cloud.rows * cloud.columns == 0 || !has_pixels
}

fn write_header(
    cloud: &PointCloud,
    attributes: &[Attribute],
    names: &Names,
    out: &mut dyn Write,
) -> io::Result<()> {
    let row = |each: &dyn Fn(&Attribute) -> String| {
        attributes.iter().map(each).collect::<Vec<_>>().join(" ")
    };
    writeln!(out, "# .PCD v0.7 - Point Cloud Data file format")?;
    writeln!(out, "# {}", scan_line(cloud))?;
    let (mut columns, mut rows) = (cloud.columns, cloud.rows);
    if is_list(cloud) {
        writeln!(out, "# {}", list_line(cloud))?;
        (columns, rows) = (cloud.returns(), 1);
    }
    for line in stamp_line(cloud).into_iter().chain(name_lines(names)) {
        writeln!(out, "# {line}")?;
    }
    writeln!(out, "VERSION 0.7")?;
    writeln!(out, "FIELDS {}", row(&|attribute| attribute.name().to_owned()))?;
    writeln!(out, "SIZE {}", row(&|attribute| attribute.kind(cloud).size().to_string()))?;
    writeln!(out, "TYPE {}", row(&|attribute| attribute.kind(cloud).letter().to_owned()))?;
    writeln!(out, "COUNT {}", row(&|_| "1".to_owned()))?;
    writeln!(out, "WIDTH {columns}\nHEIGHT {rows}")?;
    writeln!(out, "VIEWPOINT {}", viewpoint_text(&cloud.viewpoint))?;
    writeln!(out, "POINTS {}", columns * rows)?;
    writeln!(out, "DATA binary")
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;
    use crate::points::Truth;

    fn header(cloud: &PointCloud, names: &Names) -> String {
        let mut bytes = Vec::new();
        write_header(cloud, &Attribute::of(cloud), names, &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn the_header_of_a_measurement_is_as_documented() {
        let cloud = PointCloud { truth: Truth::default(), ..sample_cloud() };
        assert_eq!(
            header(&cloud, &Names::default()),
            "# .PCD v0.7 - Point Cloud Data file format\n\
             # macropulse scan 3\n\
             VERSION 0.7\n\
             FIELDS x y z intensity range time_ns row column ring peak marks margin \
             return_number number_of_returns flags\n\
             SIZE 4 4 4 4 4 8 2 2 2 2 2 2 1 1 1\n\
             TYPE F F F F F F U U U U U U U U U\n\
             COUNT 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1\n\
             WIDTH 3\nHEIGHT 2\nVIEWPOINT 1.5 -2 0.25 0.6 0 0 -0.8\nPOINTS 6\nDATA binary\n"
        );
    }

    #[test]
    fn truth_adds_five_fields_and_the_names() {
        let objects = ["car".to_owned()];
        let header = header(&sample_cloud(), &Names { objects: &objects, materials: &[] });
        assert!(header.contains(" flags true_range object material incidence outcome\n"));
        assert!(header.contains(" 4 2 2 4 1\n"));
        assert!(header.contains("# object 0 car\n"));
    }

    #[test]
    fn several_returns_of_a_shot_are_a_list() {
        let cloud = PointCloud { returns_per_shot: 2, ..sample_cloud() };
        let text = header(&cloud, &Names::default());
        assert!(text.contains("# macropulse list 2 3 2 strongest\n"), "{text}");
        assert!(text.contains("WIDTH 5\nHEIGHT 1\n"), "{text}");
        let mut bytes = Vec::new();
        Pcd.write(&cloud, &Names::default(), &mut bytes).unwrap();
        assert_eq!((bytes.len() - text.len()) % 5, 0);
    }

    #[test]
    fn every_pixel_is_written_the_empty_one_as_nan() {
        let cloud = PointCloud { truth: Truth::default(), ..sample_cloud() };
        let mut bytes = Vec::new();
        Pcd.write(&cloud, &Names::default(), &mut bytes).unwrap();
        let body = &bytes[header(&cloud, &Names::default()).len()..];
        let stride = 5 * 4 + 8 + 6 * 2 + 3;
        assert_eq!(body.len(), 6 * stride);
        let x = f32::from_le_bytes(body[2 * stride..2 * stride + 4].try_into().unwrap());
        assert!(x.is_nan());
    }
}
