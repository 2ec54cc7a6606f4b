//! ASTM E57: the returns as one scan with its pose, and an extension for what the standard has no
//! field for.

use super::about::{About, list_line, name_lines, scan_line};
use super::attributes::{Attribute, Value, returns};
use super::table::{Digits, Gathered, Record as Point, check_coordinates};
use super::{CloudRoom, Names};
use crate::points::{PointCloud, Viewpoint};
use e57::{
    E57Reader, E57Writer, Extension, Quaternion, RawValues, Record, RecordDataType, RecordName,
    RecordValue, Transform, Translation,
};
use std::io::{self, Cursor, Write};

/// Prefix of our attributes, and what it stands for.
const NAMESPACE: &str = "macropulse";
const NAMESPACE_URL: &str = "urn:macropulse:attributes:1";

/// Writes the returns of a cloud whose columns are even.
pub(super) fn write(cloud: &PointCloud, names: &Names, out: &mut dyn Write) -> io::Result<()> {
    let written = encode(cloud, names).map_err(io::Error::other)?;
    out.write_all(&written)
}

fn encode(cloud: &PointCloud, names: &Names) -> e57::Result<Vec<u8>> {
    let mut attributes = Attribute::of(cloud);
    // The ring is the row.
    if attributes.contains(&Attribute::Row) {
        attributes.retain(|attribute| *attribute != Attribute::Ring);
    }
    let mut file = Cursor::new(Vec::new());
    let scan = cloud.scan;
    let mut writer = E57Writer::new(&mut file, &format!("macropulse-file-{scan}"))?;
    writer.register_extension(Extension::new(NAMESPACE, NAMESPACE_URL))?;
    let records = attributes.iter().map(|attribute| record(*attribute, cloud)).collect();
    let mut points = writer.add_pointcloud(&format!("macropulse-scan-{scan}"), records)?;
    points.set_name(Some(format!("scan {scan}")));
    let lines = [scan_line(cloud), list_line(cloud)].into_iter().chain(name_lines(names));
    points.set_description(Some(lines.collect::<Vec<_>>().join("\n")));
    points.set_transform(Some(transform(&cloud.viewpoint)));
    for point in returns(cloud) {
        let values =
            attributes.iter().map(|attribute| value(*attribute, attribute.value(cloud, point)));
        points.add_point(RawValues::from_iter(values))?;
    }
    points.finalize()?;
    writer.finalize()?;
    drop(writer);
    Ok(file.into_inner())
}

/// The name of an attribute: that of the standard, or one of our extension.
fn name(attribute: Attribute) -> RecordName {
    match attribute {
        Attribute::X => RecordName::CartesianX,
        Attribute::Y => RecordName::CartesianY,
        Attribute::Z => RecordName::CartesianZ,
        Attribute::Intensity => RecordName::Intensity,
        Attribute::TimeNs => RecordName::TimeStamp,
        Attribute::Row | Attribute::Ring => RecordName::RowIndex,
        Attribute::Column => RecordName::ColumnIndex,
        Attribute::ReturnNumber => RecordName::ReturnIndex,
        Attribute::NumberOfReturns => RecordName::ReturnCount,
        other => RecordName::Unknown { namespace: NAMESPACE.into(), name: other.name().into() },
    }
}

fn record(attribute: Attribute, cloud: &PointCloud) -> Record {
    let data_type = match attribute.blank(cloud) {
        Value::F4(_) => RecordDataType::F32,
        Value::F8(_) => RecordDataType::F64,
        Value::U1(_) => RecordDataType::Integer { min: 0, max: 255 },
        Value::U2(_) => RecordDataType::Integer { min: 0, max: 65_535 },
        Value::U4(_) => RecordDataType::Integer { min: 0, max: i64::from(u32::MAX) },
    };
    Record { name: name(attribute), data_type }
}

/// The value as E57 has it: time in seconds, returns from 0.
fn value(attribute: Attribute, value: Value) -> RecordValue {
    match (attribute, value) {
        (Attribute::TimeNs, Value::F8(time)) => RecordValue::Double(time * 1e-9),
        (Attribute::ReturnNumber, Value::U1(number)) => {
            RecordValue::Integer(i64::from(number.saturating_sub(1)))
        }
        (_, Value::F4(value)) => RecordValue::Single(value),
        (_, Value::F8(value)) => RecordValue::Double(value),
        (_, Value::U1(value)) => RecordValue::Integer(value.into()),
        (_, Value::U2(value)) => RecordValue::Integer(value.into()),
        (_, Value::U4(value)) => RecordValue::Integer(value.into()),
    }
}

fn transform(viewpoint: &Viewpoint) -> Transform {
    let Viewpoint { position: [x, y, z], turn: [w, i, j, k] } = *viewpoint;
    Transform { rotation: Quaternion { w, x: i, y: j, z: k }, translation: Translation { x, y, z } }
}

/// The cloud of the first scan of an E57 file, in the frame of the scanner, and what the file says
/// beside it.
pub(super) fn parse(bytes: Vec<u8>, room: CloudRoom) -> Result<(PointCloud, About), String> {
    read(bytes, room).map_err(|error| match error {
        Fault::File(error) => error.to_string(),
        Fault::Told(sentence) => sentence,
    })
}

enum Fault {
    File(e57::Error),
    Told(String),
}

impl From<e57::Error> for Fault {
    fn from(error: e57::Error) -> Self {
        Self::File(error)
    }
}

impl From<String> for Fault {
    fn from(sentence: String) -> Self {
        Self::Told(sentence)
    }
}

fn read(bytes: Vec<u8>, room: CloudRoom) -> Result<(PointCloud, About), Fault> {
    let size = bytes.len() as u64;
    let mut reader = E57Reader::new(Cursor::new(bytes))?;
    let scans = reader.pointclouds();
    let Some(scan) = scans.first() else {
        return Err("it has no scan".to_owned().into());
    };
    let mut about = About::within(room);
    for line in scan.description.iter().flat_map(|text| text.lines()) {
        about.take(line)?;
    }
    if let Some(Transform { rotation, translation }) = &scan.transform {
        about.viewpoint = Viewpoint {
            position: [translation.x, translation.y, translation.z],
            turn: [rotation.w, rotation.x, rotation.y, rotation.z],
        };
    }
    let known =
        |record: &Record| Attribute::ALL.into_iter().find(|&ours| name(ours) == record.name);
    let columns: Vec<Option<Attribute>> = scan.prototype.iter().map(known).collect();
    let attributes: Vec<Attribute> = columns.iter().flatten().copied().collect();
    check_coordinates(&attributes)?;
    let is_single = |record: &Record| matches!(record.data_type, RecordDataType::Single { .. });
    let coordinates = scan.prototype.iter().filter(|record| {
        use RecordName::{CartesianX, CartesianY, CartesianZ};
        matches!(record.name, CartesianX | CartesianY | CartesianZ)
    });
    let digits =
        if coordinates.into_iter().all(is_single) { Digits::Single } else { Digits::Double };
    check_size(&scan.prototype, scan.records, size)?;
    room.check(scan.records)?;
    let mut gathered = Gathered::new(&about, &attributes, digits)?;
    for (at, values) in reader.pointcloud_raw(scan)?.enumerate() {
        let mut point = Point::default();
        for ((column, record), value) in columns.iter().zip(&scan.prototype).zip(&values?) {
            let Some(attribute) = *column else { continue };
            point.set(at, attribute, number(attribute, value, &record.data_type)?)?;
        }
        gathered.add(point);
    }
    Ok((gathered.cloud(&mut about)?, about))
}

/// Refuses a scan with more records than a file of `size` bytes can hold. A column whose numbers are
/// all the same takes no bits, so the number of records of such columns has no other bound.
fn check_size(prototype: &[Record], records: u64, size: u64) -> Result<(), String> {
    let bits = |record: &Record| match record.data_type {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::ScaledInteger { min, max, .. } | RecordDataType::Integer { min, max } => {
            u128::BITS - (i128::from(max) - i128::from(min)).max(0).leading_zeros()
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

/// The number of a value of the file, in our units.
fn number(attribute: Attribute, value: &RecordValue, stored: &RecordDataType) -> e57::Result<f64> {
    let number = match (value, stored) {
        (RecordValue::Single(value), _) => f64::from(*value),
        (RecordValue::Double(value), _) => *value,
        (RecordValue::Integer(value), _) => *value as f64,
        (RecordValue::ScaledInteger(_), _) => value.to_f64(stored)?,
    };
    Ok(match attribute {
        Attribute::TimeNs => number * 1e9,
        Attribute::ReturnNumber => number + 1.0,
        _ => number,
    })
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;

    fn parse(bytes: Vec<u8>) -> Result<(PointCloud, About), String> {
        super::parse(bytes, CloudRoom::default())
    }

    #[test]
    fn records_that_the_file_cannot_hold_are_refused() {
        let record = |data_type| Record { name: RecordName::CartesianX, data_type };
        let same = record(RecordDataType::Integer { min: 7, max: 7 });
        let bit = record(RecordDataType::ScaledInteger { min: 0, max: 1, scale: 1.0, offset: 0.0 });
        let wide = record(RecordDataType::Integer { min: i64::MIN, max: i64::MAX });
        for (prototype, most) in [
            (vec![same.clone(); 3], 8000),
            (vec![same, bit.clone()], 8000),
            (vec![bit, wide.clone(), wide], 8000 / 129),
        ] {
            check_size(&prototype, most, 1000).unwrap();
            let told = check_size(&prototype, most + 1, 1000).unwrap_err();
            assert!(told.contains("which its 1000 bytes cannot hold"), "{told}");
        }
    }

    #[test]
    fn what_was_written_is_read() {
        let cloud = sample_cloud();
        let objects = ["car <red> & more".to_owned()];
        let bytes = encode(&cloud, &Names { objects: &objects, materials: &[] }).unwrap();
        let (read, about) = parse(bytes).unwrap();
        assert_eq!((read.scan, read.rows, read.columns, read.pick), (3, 2, 3, cloud.pick));
        assert_eq!(read.viewpoint, cloud.viewpoint);
        assert_eq!((&read.x, &read.range), (&cloud.x, &cloud.range));
        assert_eq!((&read.peak, &read.return_number), (&cloud.peak, &cloud.return_number));
        assert_eq!(read.truth.returns.outcome, cloud.truth.returns.outcome);
        assert_eq!(about.objects, objects);
    }

    #[test]
    fn a_file_cut_short_is_refused() {
        let bytes = encode(&sample_cloud(), &Names::default()).unwrap();
        for length in [0, 20, 1024, bytes.len() - 1] {
            assert!(parse(bytes[..length].to_vec()).is_err(), "{length}");
        }
    }
}
