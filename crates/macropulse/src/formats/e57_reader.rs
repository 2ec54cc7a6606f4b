//! Reads E57 files: every scan is a cloud.

use super::CloudRoom;
use super::about::About;
use super::attributes::Attribute;
use super::cloud_file::{CloudFile, Scans};
use super::e57::{GPS_BEHIND_S, NAMESPACE, name};
use super::left_out::NoPoint;
use super::table::{Digits, Gathered, Record as Point, check_coordinates};
use crate::points::{PointCloud, Viewpoint};
use ::e57::{
    E57Reader, PointCloud as Scan, Record, RecordDataType, RecordName, RecordValue, Transform,
};

/// The clouds of an E57 file, one for each of its scans, in the frame of the scanner.
pub(super) struct E57Scans {
    reader: E57Reader<CloudFile>,
    /// Bytes of the file.
    size: u64,
    scans: Vec<Scan>,
    next: usize,
    about: About,
}

impl E57Scans {
    /// Reads what the file says of its scans.
    pub fn open(file: CloudFile, room: CloudRoom) -> Result<Self, String> {
        let size = file.length();
        let reader = E57Reader::new(file).map_err(|why| told(&why))?;
        let scans = reader.pointclouds();
        if scans.is_empty() {
            return Err("it has no scan".to_owned());
        }
        let mut about = About::within(room);
        let system = reader.coordinate_metadata().map(str::trim).filter(|text| !text.is_empty());
        about.left_out.reference_system = system.map(str::to_owned);
        Ok(Self { reader, size, scans, next: 0, about })
    }
}

impl Scans for E57Scans {
    fn count(&self) -> usize {
        self.scans.len()
    }

    fn about(&self) -> &About {
        &self.about
    }

    fn advance(&mut self) -> Option<Result<PointCloud, String>> {
        let scan = self.scans.get(self.next)?.clone();
        self.next += 1;
        let place = |fault| match self.scans.len() {
            1 => fault,
            all => format!("scan {} of {all}: {fault}", self.next),
        };
        let checked = check_size(&scan.prototype, scan.records, self.size);
        let read = checked.and_then(|()| read(&mut self.reader, &scan, &mut self.about));
        Some(read.map_err(place))
    }
}

/// Returns an error of the library in our words.
fn told(error: &::e57::Error) -> String {
    match error {
        ::e57::Error::NotImplemented { .. } => "it has parts of E57 that are not read".to_owned(),
        _ => "it was cut short, or is damaged".to_owned(),
    }
}

fn read(
    reader: &mut E57Reader<CloudFile>,
    scan: &Scan,
    about: &mut About,
) -> Result<PointCloud, String> {
    let left_out = std::mem::take(&mut about.left_out);
    *about = About { left_out, ..About::within(about.room) };
    for line in scan.description.iter().flat_map(|text| text.lines()) {
        about.take(line)?;
    }
    if let Some(Transform { rotation, translation }) = &scan.transform {
        about.viewpoint = Viewpoint {
            position: [translation.x, translation.y, translation.z],
            turn: [rotation.w, rotation.x, rotation.y, rotation.z],
        };
    }
    let start_s = scan.acquisition_start.as_ref().map(|start| start.gps_time);
    // Writers that know no time write 0.
    let start_s = start_s.filter(|start| *start > 0.0);
    let unix_ns = |gps_s: f64| ((gps_s + GPS_BEHIND_S) * 1e9).round();
    about.stamp_ns = about.stamp_ns.or(start_s.map(|start| unix_ns(start) as u64));
    let columns = Columns::of(&scan.prototype);
    columns.unread.iter().for_each(|name| about.left_out.field(name));
    let attributes = columns.attributes();
    check_coordinates(&attributes)?;
    let mut gathered = Gathered::new(about, &attributes, columns.digits)?;
    let points = scan.records;
    gathered.expect(points)?;
    let broken = |at: usize| format!("it ends after {at} of {points} points, or is damaged");
    for (at, values) in reader.pointcloud_raw(scan).map_err(|why| told(&why))?.enumerate() {
        let values = values.map_err(|_| broken(at))?;
        match columns.point(at, &values)? {
            Some(point) => gathered.add(point),
            None => gathered.drop_point(NoPoint::Invalid),
        }
    }
    gathered.cloud(about)
}

/// Refuses a scan with more records than a file of `size` bytes can hold. A column whose numbers are
/// all the same takes no bits, so the number of records of such columns has no other bound.
fn check_size(prototype: &[Record], records: u64, size: u64) -> Result<(), String> {
    let bits = |record: &Record| match record.data_type {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::ScaledInteger { min, max, .. } | RecordDataType::Integer { min, max } => {
            u128::BITS - (i128::from(max) - i128::from(min)).max(0).unsigned_abs().leading_zeros()
        }
    };
    let bits: u64 = prototype.iter().map(|record| u64::from(bits(record))).sum();
    if records.saturating_mul(bits.max(1)) > size.saturating_mul(8) {
        return Err(format!(
            "it says that it has {records} points of {bits} bits, which its {size} bytes cannot \
             hold; the file is damaged"
        ));
    }
    Ok(())
}

/// The purpose of a value of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Meaning {
    /// An attribute of ours.
    Of(Attribute),
    /// An angle of spherical coordinates: azimuth or elevation.
    Angle(usize),
    /// Says by another number than 0 that the coordinates are none.
    Invalid,
    /// Says by another number than 0 that this attribute is not known.
    Unknown(Attribute),
}

/// The meanings of the values of a scan's points.
struct Columns {
    each: Vec<(Option<Meaning>, RecordDataType)>,
    is_spherical: bool,
    digits: Digits,
    unread: Vec<String>,
}

impl Columns {
    fn of(prototype: &[Record]) -> Self {
        let has = |name| prototype.iter().any(|record| record.name == name);
        let is_cartesian = |name: &RecordName| {
            use RecordName::{CartesianX, CartesianY, CartesianZ};
            matches!(name, CartesianX | CartesianY | CartesianZ)
        };
        let is_spherical = !prototype.iter().any(|record| is_cartesian(&record.name))
            && has(RecordName::SphericalRange);
        let state = match is_spherical || !has(RecordName::CartesianInvalidState) {
            true => RecordName::SphericalInvalidState,
            false => RecordName::CartesianInvalidState,
        };
        let meaning = |record: &Record| match &record.name {
            known if *known == state => Some(Meaning::Invalid),
            RecordName::IsIntensityInvalid => Some(Meaning::Unknown(Attribute::Intensity)),
            RecordName::IsTimeStampInvalid => Some(Meaning::Unknown(Attribute::TimeNs)),
            RecordName::SphericalRange => Some(Meaning::Of(Attribute::Range)),
            RecordName::SphericalAzimuth => Some(Meaning::Angle(0)),
            RecordName::SphericalElevation => Some(Meaning::Angle(1)),
            known => {
                let ours = Attribute::in_files().find(|&ours| name(ours) == *known);
                ours.map(Meaning::Of)
            }
        };
        let is_single = |record: &Record| {
            !is_cartesian(&record.name) || matches!(record.data_type, RecordDataType::Single { .. })
        };
        let is_single = !is_spherical && prototype.iter().all(is_single);
        Self {
            each: prototype.iter().map(|one| (meaning(one), one.data_type.clone())).collect(),
            is_spherical,
            digits: if is_single { Digits::Single } else { Digits::Double },
            unread: prototype.iter().filter_map(|record| unread(&record.name)).collect(),
        }
    }

    /// The attributes that points have.
    fn attributes(&self) -> Vec<Attribute> {
        let mut attributes: Vec<Attribute> = Vec::new();
        for (meaning, _) in &self.each {
            attributes.extend(match meaning {
                Some(Meaning::Of(attribute)) => Some(*attribute),
                _ => None,
            });
        }
        if self.is_spherical {
            attributes.extend([Attribute::X, Attribute::Y, Attribute::Z]);
        }
        attributes
    }

    /// Point `at`; `None` if the file marks it as invalid.
    fn point(&self, at: usize, values: &[RecordValue]) -> Result<Option<Point>, String> {
        let mut point = Point::default();
        let (mut range, mut angles) = (f64::NAN, [f64::NAN; 2]);
        for ((meaning, kind), value) in self.each.iter().zip(values) {
            let number = number(value, kind);
            match *meaning {
                Some(Meaning::Invalid) if number != 0.0 => return Ok(None),
                Some(Meaning::Angle(which)) => angles[which] = number,
                Some(Meaning::Of(attribute)) => {
                    if attribute == Attribute::Range {
                        range = number;
                    }
                    point.set(at, attribute, in_our_units(attribute, number))?;
                }
                _ => {}
            }
        }
        if self.is_spherical {
            let [azimuth, elevation] = angles;
            let level = range * libm::cos(elevation);
            point.set(at, Attribute::X, level * libm::cos(azimuth))?;
            point.set(at, Attribute::Y, level * libm::sin(azimuth))?;
            point.set(at, Attribute::Z, range * libm::sin(elevation))?;
        }
        for ((meaning, kind), value) in self.each.iter().zip(values) {
            if let Some(Meaning::Unknown(attribute)) = *meaning
                && number(value, kind) != 0.0
            {
                point.set(at, attribute, f64::NAN)?;
            }
        }
        Ok(Some(point))
    }
}

/// The name of a column that is not read, as the file has it.
fn unread(name: &RecordName) -> Option<String> {
    Some(match name {
        RecordName::ColorRed => "colorRed".to_owned(),
        RecordName::ColorGreen => "colorGreen".to_owned(),
        RecordName::ColorBlue => "colorBlue".to_owned(),
        RecordName::Unknown { namespace, name } if namespace != NAMESPACE => {
            format!("{namespace}:{name}").trim_start_matches(':').to_owned()
        }
        _ => return None,
    })
}

/// A stored number.
fn number(value: &RecordValue, kind: &RecordDataType) -> f64 {
    match (value, kind) {
        (RecordValue::Single(value), _) => f64::from(*value),
        (RecordValue::Double(value), _) => *value,
        (
            RecordValue::ScaledInteger(value),
            RecordDataType::ScaledInteger { scale, offset, .. },
        ) => *value as f64 * scale + offset,
        (RecordValue::Integer(value) | RecordValue::ScaledInteger(value), _) => *value as f64,
    }
}

/// A number of the file in our units: E57 has times in seconds, and counts returns from 0.
fn in_our_units(attribute: Attribute, number: f64) -> f64 {
    match attribute {
        Attribute::TimeNs => number * 1e9,
        Attribute::ReturnNumber => number + 1.0,
        _ => number,
    }
}

#[cfg(test)]
mod tests {
    use super::super::e57::encode;
    use super::super::{Names, sample_cloud};
    use super::*;
    use ::e57::{DateTime, E57Writer, Quaternion, RawValues, Translation};
    use std::io::Cursor;

    #[test]
    fn records_that_the_file_cannot_hold_are_refused() {
        let record = |data_type| Record { name: RecordName::CartesianX, data_type };
        let same = record(RecordDataType::Integer { min: 7, max: 7 });
        let bit = record(RecordDataType::ScaledInteger { min: 0, max: 1, scale: 1.0, offset: 0.0 });
        let wide = record(RecordDataType::Integer { min: i64::MIN, max: i64::MAX });
        for (prototype, most) in [
            (vec![same.clone(), same.clone(), same.clone()], 8000),
            (vec![same, bit.clone()], 8000),
            (vec![bit, wide.clone(), wide], 8000 / 129),
        ] {
            check_size(&prototype, most, 1000).unwrap();
            let told = check_size(&prototype, most + 1, 1000).unwrap_err();
            assert!(told.contains("which its 1000 bytes cannot hold"), "{told}");
        }
    }

    fn first(bytes: Vec<u8>) -> Result<PointCloud, String> {
        E57Scans::open(CloudFile::of_bytes(&bytes), CloudRoom::default())?.advance().unwrap()
    }

    /// The records of a scan, and the values of its points.
    type Written = (Vec<(RecordName, RecordDataType)>, Vec<Vec<RecordValue>>);

    /// A file with these scans.
    fn file(scans: &[Written]) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut bytes, "file").unwrap();
        for (at, (records, points)) in scans.iter().enumerate() {
            let record = |(name, data_type): &(RecordName, RecordDataType)| Record {
                name: name.clone(),
                data_type: data_type.clone(),
            };
            let records = records.iter().map(record).collect();
            let mut scan = writer.add_pointcloud(&format!("scan-{at}"), records).unwrap();
            let translation = Translation { x: at as f64, y: 0.0, z: 0.0 };
            let rotation = Quaternion { w: 1.0, x: 0.0, y: 0.0, z: 0.0 };
            scan.set_transform(Some(Transform { rotation, translation }));
            let gps_time = 1_400_000_000.5;
            scan.set_acquisition_start(Some(DateTime { gps_time, atomic_reference: true }));
            points.iter().for_each(|point| {
                scan.add_point(RawValues::from_iter(point.clone())).unwrap();
            });
            scan.finalize().unwrap();
        }
        writer.finalize().unwrap();
        drop(writer);
        bytes.into_inner()
    }

    fn cartesian(kind: &RecordDataType) -> Vec<(RecordName, RecordDataType)> {
        use RecordName::{CartesianX, CartesianY, CartesianZ};
        [CartesianX, CartesianY, CartesianZ].map(|name| (name, kind.clone())).to_vec()
    }

    #[test]
    fn every_scan_is_a_cloud_with_its_pose_stamp_and_digits() {
        let double = |values: [f64; 3]| values.map(RecordValue::Double).to_vec();
        let scaled =
            RecordDataType::ScaledInteger { min: 0, max: 1 << 40, scale: 1e-3, offset: 4e6 };
        let far = [494_428.61, 4_877_455.58, 123.456];
        let bytes = file(&[
            (cartesian(&RecordDataType::F64), vec![double(far), double([1.0, 2.0, 3.0])]),
            (
                cartesian(&scaled),
                vec![[877_455_581, 1, 2].map(RecordValue::ScaledInteger).to_vec()],
            ),
        ]);
        let mut scans = E57Scans::open(CloudFile::of_bytes(&bytes), CloudRoom::default()).unwrap();
        assert_eq!(scans.count(), 2);
        let one = scans.advance().unwrap().unwrap();
        assert_eq!((one.position(0), one.returns()), (far, 2));
        // 1 400 000 000.5 s of GPS time: 2024-05-17 16:53:02.5 UTC.
        assert_eq!(one.stamp_ns, Some(1_715_964_782_500_000_000));
        assert!(one.intensity.is_empty() && one.time_ns.is_empty());
        let other = scans.advance().unwrap().unwrap();
        assert!((other.position(0)[0] - 4_877_455.581).abs() < 1e-6);
        assert_eq!(other.viewpoint.position, [1.0, 0.0, 0.0]);
        assert!(scans.advance().is_none());
    }

    #[test]
    fn invalid_points_are_none_and_colours_are_named() {
        let state = RecordDataType::Integer { min: 0, max: 2 };
        let mut records = cartesian(&RecordDataType::F32);
        records.push((RecordName::CartesianInvalidState, state));
        records.push((RecordName::Intensity, RecordDataType::F32));
        let unknown = RecordDataType::Integer { min: 0, max: 1 };
        records.push((RecordName::IsIntensityInvalid, unknown));
        let grey = RecordDataType::Integer { min: 0, max: 255 };
        let colours = [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue];
        records.extend(colours.map(|name| (name, grey.clone())));
        let point = |x: f32, state: i64, unknown: i64| {
            let mut values = [x, 0.0, 0.0].map(RecordValue::Single).to_vec();
            values.push(RecordValue::Integer(state));
            values.extend([RecordValue::Single(0.5), RecordValue::Integer(unknown)]);
            values.extend([9, 9, 9].map(RecordValue::Integer));
            values
        };
        let points = vec![point(1.0, 0, 0), point(0.0, 2, 0), point(3.0, 1, 0), point(4.0, 0, 1)];
        let mut scans =
            E57Scans::open(CloudFile::of_bytes(&file(&[(records, points)])), CloudRoom::default())
                .unwrap();
        let read = scans.advance().unwrap().unwrap();
        assert_eq!(read.x, [1.0, 4.0]);
        assert!(read.intensity[0] == 0.5 && read.intensity[1].is_nan());
        assert!(read.exact.x.is_empty());
        assert_eq!(
            scans.about().left_out.to_string(),
            "fields colorRed, colorGreen, colorBlue; 2 points marked as invalid"
        );
    }

    #[test]
    fn spherical_coordinates_are_read() {
        use RecordName::{SphericalAzimuth, SphericalElevation, SphericalRange};
        let records = [SphericalRange, SphericalAzimuth, SphericalElevation];
        let records = records.map(|name| (name, RecordDataType::F64)).to_vec();
        let angle = std::f64::consts::FRAC_PI_6;
        let point = [10.0, 2.0 * angle, angle].map(RecordValue::Double).to_vec();
        let read = first(file(&[(records, vec![point])])).unwrap();
        // r cos 30° cos 60°, r cos 30° sin 60°, r sin 30°.
        let expected = [10.0 * 0.75_f64.sqrt() * 0.5, 7.5, 5.0];
        for (found, expected) in read.position(0).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        assert_eq!(read.range, [10.0]);
    }

    #[test]
    fn what_was_written_is_read() {
        let cloud = sample_cloud();
        let objects = ["car <red> & more".to_owned()];
        let bytes = encode(&cloud, &Names { objects: &objects, materials: &[] }).unwrap();
        let mut scans = E57Scans::open(CloudFile::of_bytes(&bytes), CloudRoom::default()).unwrap();
        let read = scans.advance().unwrap().unwrap();
        assert!(scans.advance().is_none() && scans.about().left_out.is_empty());
        assert_eq!((read.scan, read.rows, read.columns, read.pick), (3, 2, 3, cloud.pick));
        assert_eq!(read.viewpoint, cloud.viewpoint);
        assert_eq!((&read.x, &read.range), (&cloud.x, &cloud.range));
        assert_eq!((&read.peak, &read.return_number), (&cloud.peak, &cloud.return_number));
        assert_eq!(read.truth.returns.outcome, cloud.truth.returns.outcome);
        assert_eq!(scans.about().objects, objects);
    }

    #[test]
    fn a_file_cut_short_is_refused() {
        let bytes = encode(&sample_cloud(), &Names::default()).unwrap();
        for length in [0, 20, 1024, bytes.len() - 1] {
            let told = first(bytes[..length].to_vec()).unwrap_err();
            assert_eq!(told, "it was cut short, or is damaged", "{length}");
        }
    }
}
