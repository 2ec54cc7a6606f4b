//! ASTM E57: the returns as one scan with its pose, and an extension for what the standard has no
//! field for.

use super::Names;
use super::about::{list_line, name_lines, scan_line, stamp_line};
use super::attributes::{Attribute, Value, returns};
use super::format::CloudWriter;
use super::holding::{Further, Holding};
use super::number::Kind;
use crate::points::{PointCloud, Viewpoint};
use e57::{
    DateTime, E57Writer, Extension, Quaternion, RawValues, Record, RecordDataType, RecordName,
    RecordValue, Transform, Translation,
};
use std::io::{self, Cursor, Write};

/// Prefix of our attributes, and what it stands for.
pub(super) const NAMESPACE: &str = "macropulse";
const NAMESPACE_URL: &str = "urn:macropulse:attributes:1";

/// Seconds by which GPS time, in which E57 counts, is behind Unix time: it began in 1980, and has been
/// 18 leap seconds ahead since 2017.
pub(super) const GPS_BEHIND_S: f64 = 315_964_800.0 - 18.0;

/// ASTM E57.
pub(super) struct E57;

impl CloudWriter for E57 {
    fn name(&self) -> &'static str {
        "e57"
    }

    fn holds(&self, attribute: Attribute) -> Holding {
        match attribute {
            Attribute::TimeNs => Holding::Partly("`timeStamp`, s"),
            Attribute::ReturnNumber => Holding::Partly("`returnIndex`, from 0"),
            _ => Holding::Whole,
        }
    }

    fn holds_further(&self, further: Further) -> bool {
        further != Further::EmptyPixels
    }

    fn write(&self, cloud: &PointCloud, names: &Names, out: &mut dyn Write) -> io::Result<()> {
        let written = encode(cloud, names).map_err(io::Error::other)?;
        out.write_all(&written)
    }
}

pub(super) fn encode(cloud: &PointCloud, names: &Names) -> e57::Result<Vec<u8>> {
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
    let lines = [scan_line(cloud), list_line(cloud)].into_iter().chain(stamp_line(cloud));
    let lines = lines.chain(name_lines(names));
    points.set_description(Some(unclosed(&lines.collect::<Vec<_>>().join(
        "
",
    ))));
    points.set_transform(Some(transform(&cloud.viewpoint)));
    points.set_acquisition_start(cloud.stamp_ns.map(|stamp| DateTime {
        gps_time: stamp as f64 * 1e-9 - GPS_BEHIND_S,
        atomic_reference: false,
    }));
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

/// Returns a `text` that does not end the section of character data (CDATA) that it is written into. At a
/// mark that would end it, the text goes on in a second section, and readers join both.
fn unclosed(text: &str) -> String {
    text.replace("]]>", "]]]]><![CDATA[>")
}

/// The name of an attribute: that of the standard, or one of our extension.
pub(super) fn name(attribute: Attribute) -> RecordName {
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
    let data_type = match attribute.kind(cloud) {
        Kind::F4 => RecordDataType::F32,
        Kind::F8 => RecordDataType::F64,
        Kind::U1 => RecordDataType::Integer { min: 0, max: 255 },
        _ => RecordDataType::Integer { min: 0, max: 65_535 },
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
