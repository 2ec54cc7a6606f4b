//! Points that are little-endian floats and nothing else: x, y, z and reflectance, as the KITTI data
//! sets have them, or these and the ring, as nuScenes has them.

use super::CloudRoom;
use super::Names;
use super::about::About;
use super::attributes::{Attribute, Value, returns};
use super::cloud_file::CloudFile;
use super::format::CloudWriter;
use super::holding::{Further, Holding};
use super::number::Kind;
use super::table::{self, Layout};
use crate::points::PointCloud;
use std::io::{self, Write};
use std::path::Path;

/// Attributes of a point.
pub(super) const ATTRIBUTES: [Attribute; 4] =
    [Attribute::X, Attribute::Y, Attribute::Z, Attribute::Intensity];

/// Points as the KITTI data sets have them.
pub(super) struct Kitti;

impl CloudWriter for Kitti {
    fn name(&self) -> &'static str {
        "kitti"
    }

    fn extension(&self) -> &'static str {
        "bin"
    }

    fn holds(&self, attribute: Attribute) -> Holding {
        Holding::among(&ATTRIBUTES, attribute)
    }

    fn holds_further(&self, _further: Further) -> bool {
        false
    }

    fn write(&self, cloud: &PointCloud, _names: &Names, out: &mut dyn Write) -> io::Result<()> {
        let has = Attribute::of(cloud);
        let value = |attribute: Attribute, point| match has.contains(&attribute) {
            true => attribute.value(cloud, point),
            // Each point has room for a reflectance.
            false => Value::F4(f32::NAN),
        };
        let mut bytes = Vec::with_capacity(16);
        for point in returns(cloud) {
            bytes.clear();
            let values = ATTRIBUTES.map(|attribute| value(attribute, point));
            values.into_iter().for_each(|value| value.narrowed().append_to(&mut bytes));
            out.write_all(&bytes)?;
        }
        Ok(())
    }
}

/// How many floats a point has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Floats {
    /// As KITTI has them.
    Four,
    /// As nuScenes has them, in files that end in `.pcd.bin`: the ring is the fifth.
    Five,
}

impl Floats {
    /// The number that the name of a file stands for.
    pub fn of_name(path: &Path) -> Self {
        let name = path.file_name().map(|name| name.to_string_lossy().to_lowercase());
        match name.is_some_and(|name| name.ends_with(".pcd.bin")) {
            true => Self::Five,
            false => Self::Four,
        }
    }

    fn attributes(self) -> &'static [Attribute] {
        const ATTRIBUTES: [Attribute; 5] =
            [Attribute::X, Attribute::Y, Attribute::Z, Attribute::Intensity, Attribute::Ring];
        match self {
            Self::Four => &ATTRIBUTES[..4],
            Self::Five => &ATTRIBUTES,
        }
    }

    /// Bytes of a point.
    fn stride(self) -> usize {
        self.attributes().len() * Kind::F4.size()
    }

    /// Returns true if the bytes look like points of this number of floats: coordinates on Earth, no negative
    /// intensity, and rings that are small whole numbers.
    fn fit(self, file: &mut CloudFile) -> Result<bool, String> {
        if !file.length().is_multiple_of(self.stride() as u64) {
            return Ok(false);
        }
        file.go_to(0)?;
        let mut point = vec![0; self.stride()];
        while file.fill(&mut point)? {
            let numbers = point.chunks_exact(Kind::F4.size()).map(|bytes| Kind::F4.read(bytes));
            let fits = self.attributes().iter().zip(numbers).all(|(attribute, number)| {
                match attribute {
                    // A point that has none is NaN.
                    Attribute::Intensity => number.is_nan() || number >= 0.0,
                    Attribute::Ring => number.fract() == 0.0 && (0.0..MOST_RINGS).contains(&number),
                    _ => number.is_nan() || number.abs() < FARTHEST_M,
                }
            });
            if !fits {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// No usual frame on Earth has coordinates beyond this.
const FARTHEST_M: f64 = 1e8;

/// No sensor has more rings.
const MOST_RINGS: f64 = 1024.0;

/// The cloud of a file whose name stands for this number of floats. If its points look like the other
/// number alone, they are read as that.
pub(super) fn parse(
    file: &mut CloudFile,
    by_name: Floats,
    room: CloudRoom,
) -> Result<(PointCloud, About), String> {
    let other = match by_name {
        Floats::Four => Floats::Five,
        Floats::Five => Floats::Four,
    };
    let floats = match by_name.fit(file)? {
        true => by_name,
        false if other.fit(file)? => other,
        false => {
            let length = file.length();
            return Err(format!(
                "its {length} bytes are neither points of four floats (x, y, z, intensity) nor of \
                 five (and the ring): was it cut short, or does it hold other numbers? Name a file \
                 of four floats `.bin`, one of five `.pcd.bin`, and save other numbers as .npy or \
                 .csv"
            ));
        }
    };
    let mut layout = Layout::default();
    for attribute in floats.attributes() {
        layout.push(attribute.name(), Kind::F4, 1)?;
    }
    let mut about = About { is_of_driver: true, ..About::within(room) };
    let points = file.length() / layout.stride as u64;
    file.go_to(0)?;
    let cloud = table::list(&mut about, &layout, points as usize, &mut |record| file.fill(record))?;
    Ok((cloud, about))
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;

    fn parse(bytes: &[u8], by_name: Floats) -> Result<(PointCloud, About), String> {
        super::parse(&mut CloudFile::of_bytes(bytes), by_name, CloudRoom::default())
    }

    fn floats(numbers: &[f32]) -> Vec<u8> {
        numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
    }

    #[test]
    fn four_floats_are_a_point() {
        let cloud = sample_cloud();
        let mut bytes = Vec::new();
        Kitti.write(&cloud, &Names::default(), &mut bytes).unwrap();
        assert_eq!(bytes.len(), 5 * 16);
        let (read, _) = parse(&bytes, Floats::Four).unwrap();
        assert_eq!((&read.x, &read.y, &read.z), (&cloud.x, &cloud.y, &cloud.z));
        assert_eq!(read.intensity, cloud.intensity);
        assert_eq!((read.rows, read.columns, read.returns_per_shot), (0, 0, 1));
        assert!(parse(&bytes[..79], Floats::Four).unwrap_err().starts_with("its 79 bytes"));
    }

    #[test]
    fn the_points_decide_where_the_name_is_wrong() {
        // 80 bytes are five points of four floats and four of five.
        let five = floats(&[
            -3.5, -0.4, -1.8, 4.0, 0.0, //
            -3.6, -0.4, -1.8, 9.0, 1.0, //
            -3.7, -0.4, -1.8, 7.0, 2.0, //
            -3.8, -0.4, -1.8, 10.0, 31.0,
        ]);
        for by_name in [Floats::Five, Floats::Four] {
            let (read, _) = parse(&five, by_name).unwrap();
            assert_eq!(read.x, [-3.5, -3.6, -3.7, -3.8]);
            assert_eq!(
                (&read.intensity[..], &read.row[..]),
                (&[4.0, 9.0, 7.0, 10.0][..], &[0, 1, 2, 31][..])
            );
        }
        let mut four = Vec::new();
        Kitti.write(&sample_cloud(), &Names::default(), &mut four).unwrap();
        assert_eq!(parse(&four, Floats::Five).unwrap().0.returns(), 5);
        // Floats that could be either are what the name says.
        let either = floats(&[1.0; 20]);
        assert_eq!(parse(&either, Floats::Four).unwrap().0.returns(), 5);
        assert_eq!(parse(&either, Floats::Five).unwrap().0.returns(), 4);
        assert_eq!(parse(&[], Floats::Four).unwrap().0.returns(), 0);
    }

    #[test]
    fn what_does_not_look_right_is_refused() {
        let doubles: Vec<u8> =
            [1.5_f64, -7.3, 1e-3, 0.2].iter().flat_map(|number| number.to_le_bytes()).collect();
        let six = floats(&[-3.5, -0.4, -1.8, -4.0, 0.5, 7.0, 1.0, 2.0, 3.0, -9.0, 5.0, 6.0]);
        let far = floats(&[1e30, 0.0, 0.0, 1.0]);
        for bytes in [&doubles, &six, &far] {
            let told = parse(bytes, Floats::Four).unwrap_err();
            assert!(told.contains("one of five `.pcd.bin`, and save other"), "{told}");
        }
    }

    #[test]
    fn a_name_says_how_many_floats() {
        let of = |name: &str| Floats::of_name(Path::new(name));
        assert_eq!(
            (of("a/0.bin"), of("n015__LIDAR_TOP__15.pcd.BIN")),
            (Floats::Four, Floats::Five)
        );
    }
}
