//! The messages of ASAM OSI 3.7: what the lidar detected and, with the truth, what it might have.

use super::super::attributes::Attribute;
use super::super::holding::Holding;
use super::protobuf::{Described, Of, Package, descriptor_set};
use super::{Payload, Topic, stamp_ns};
use crate::points::{NO_OBJECT, Outcome, PointCloud};
use crate::units::tof_from_range;
use ::mcap::records::Metadata;
use prost::Message;
use std::collections::BTreeMap;
use std::io;

/// Says how a detection or a reflection holds an attribute of a point.
pub(super) fn holds(attribute: Attribute) -> Holding {
    use Holding::{Not, Partly, Whole};
    match attribute {
        Attribute::X | Attribute::Y | Attribute::Z => Partly("as distance, azimuth, elevation"),
        Attribute::Intensity => Partly("`reflectivity`; `intensity` in percent"),
        Attribute::Range | Attribute::RadialVelocity => Whole,
        Attribute::Row | Attribute::Ring => Partly("`beam_id`"),
        Attribute::TimeNs => Partly("of the scan alone"),
        Attribute::TrueRange => Partly("`time_of_flight` of a reflection"),
        Attribute::Object => Partly("`object_id`"),
        Attribute::Outcome => Partly("`classification`: right, near and edge, wrong, false"),
        _ => Not,
    }
}

/// The version of OSI whose messages these are.
const VERSION: [u32; 3] = [3, 7, 0];
const VERSION_TEXT: &str = "3.7.0";

/// A version of protobuf that reads and writes them.
const PROTOBUF_VERSION: &str = "3.20.1";

/// The number of the one sensor.
const SENSOR_ID: u64 = 1;

#[derive(Clone, Copy, PartialEq, Message)]
struct InterfaceVersion {
    #[prost(uint32, optional, tag = "1")]
    version_major: Option<u32>,
    #[prost(uint32, optional, tag = "2")]
    version_minor: Option<u32>,
    #[prost(uint32, optional, tag = "3")]
    version_patch: Option<u32>,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct Timestamp {
    #[prost(int64, optional, tag = "1")]
    seconds: Option<i64>,
    #[prost(uint32, optional, tag = "2")]
    nanos: Option<u32>,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct Identifier {
    #[prost(uint64, optional, tag = "1")]
    value: Option<u64>,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct Spherical3d {
    #[prost(double, optional, tag = "1")]
    distance: Option<f64>,
    #[prost(double, optional, tag = "2")]
    azimuth: Option<f64>,
    #[prost(double, optional, tag = "3")]
    elevation: Option<f64>,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct LidarDetection {
    #[prost(message, optional, tag = "2")]
    object_id: Option<Identifier>,
    #[prost(message, optional, tag = "3")]
    position: Option<Spherical3d>,
    #[prost(double, optional, tag = "7")]
    intensity: Option<f64>,
    #[prost(int32, optional, tag = "9")]
    classification: Option<i32>,
    #[prost(double, optional, tag = "10")]
    reflectivity: Option<f64>,
    #[prost(double, optional, tag = "12")]
    radial_velocity: Option<f64>,
    #[prost(message, optional, tag = "13")]
    beam_id: Option<Identifier>,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct SensorDetectionHeader {
    #[prost(message, optional, tag = "1")]
    measurement_time: Option<Timestamp>,
    #[prost(uint64, optional, tag = "2")]
    cycle_counter: Option<u64>,
    #[prost(int32, optional, tag = "5")]
    data_qualifier: Option<i32>,
    #[prost(uint32, optional, tag = "6")]
    number_of_valid_detections: Option<u32>,
    #[prost(message, optional, tag = "7")]
    sensor_id: Option<Identifier>,
}

#[derive(Clone, PartialEq, Message)]
struct LidarDetectionData {
    #[prost(message, optional, tag = "1")]
    header: Option<SensorDetectionHeader>,
    #[prost(message, repeated, tag = "2")]
    detection: Vec<LidarDetection>,
}

#[derive(Clone, PartialEq, Message)]
struct FeatureData {
    #[prost(message, optional, tag = "1")]
    version: Option<InterfaceVersion>,
    #[prost(message, repeated, tag = "3")]
    lidar_sensor: Vec<LidarDetectionData>,
}

#[derive(Clone, PartialEq, Message)]
struct SensorData {
    #[prost(message, optional, tag = "1")]
    version: Option<InterfaceVersion>,
    #[prost(message, optional, tag = "2")]
    timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "5")]
    sensor_id: Option<Identifier>,
    #[prost(message, optional, tag = "9")]
    last_measurement_time: Option<Timestamp>,
    #[prost(message, optional, tag = "26")]
    feature_data: Option<FeatureData>,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct Reflection {
    #[prost(double, optional, tag = "2")]
    time_of_flight: Option<f64>,
    #[prost(message, optional, tag = "6")]
    object_id: Option<Identifier>,
}

#[derive(Clone, PartialEq, Message)]
struct LidarSensorView {
    #[prost(message, repeated, tag = "2")]
    reflection: Vec<Reflection>,
}

#[derive(Clone, PartialEq, Message)]
struct SensorView {
    #[prost(message, optional, tag = "1")]
    version: Option<InterfaceVersion>,
    #[prost(message, optional, tag = "2")]
    timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "3")]
    sensor_id: Option<Identifier>,
    #[prost(message, repeated, tag = "1002")]
    lidar_sensor_view: Vec<LidarSensorView>,
}

const IDENTIFIER: Of = Of::Message(".osi3.Identifier");
const TIMESTAMP: Of = Of::Message(".osi3.Timestamp");
const INTERFACE_VERSION: Of = Of::Message(".osi3.InterfaceVersion");

const QUALIFIERS: &[&str] = &[
    "DATA_QUALIFIER_UNKNOWN",
    "DATA_QUALIFIER_OTHER",
    "DATA_QUALIFIER_AVAILABLE",
    "DATA_QUALIFIER_AVAILABLE_REDUCED",
    "DATA_QUALIFIER_NOT_AVAILABLE",
    "DATA_QUALIFIER_BLINDNESS",
    "DATA_QUALIFIER_TEMPORARY_AVAILABLE",
    "DATA_QUALIFIER_INVALID",
];

/// Index in [`QUALIFIERS`] of a sensor that works.
const AVAILABLE: i32 = 2;

const CLASSIFICATIONS: &[&str] = &[
    "DETECTION_CLASSIFICATION_UNKNOWN",
    "DETECTION_CLASSIFICATION_OTHER",
    "DETECTION_CLASSIFICATION_INVALID",
    "DETECTION_CLASSIFICATION_CLUTTER",
    "DETECTION_CLASSIFICATION_OVERDRIVABLE",
    "DETECTION_CLASSIFICATION_UNDERDRIVABLE",
];

/// Indices in [`CLASSIFICATIONS`]: a surface, a surface at a wrong range, and nothing but noise.
const SURFACE: i32 = 1;
const INVALID: i32 = 2;
const CLUTTER: i32 = 3;

const MESSAGES: &[Described] = &[
    (
        "InterfaceVersion",
        &[("version_major", 1, Of::U4), ("version_minor", 2, Of::U4), ("version_patch", 3, Of::U4)],
    ),
    ("Timestamp", &[("seconds", 1, Of::I8), ("nanos", 2, Of::U4)]),
    ("Identifier", &[("value", 1, Of::U8)]),
    ("Spherical3d", &[("distance", 1, Of::F8), ("azimuth", 2, Of::F8), ("elevation", 3, Of::F8)]),
    (
        "LidarDetection",
        &[
            ("object_id", 2, IDENTIFIER),
            ("position", 3, Of::Message(".osi3.Spherical3d")),
            ("intensity", 7, Of::F8),
            ("classification", 9, Of::Kind(".osi3.DetectionClassification")),
            ("reflectivity", 10, Of::F8),
            ("radial_velocity", 12, Of::F8),
            ("beam_id", 13, IDENTIFIER),
        ],
    ),
    (
        "SensorDetectionHeader",
        &[
            ("measurement_time", 1, TIMESTAMP),
            ("cycle_counter", 2, Of::U8),
            (
                "data_qualifier",
                5,
                Of::Choice(".osi3.SensorDetectionHeader.DataQualifier", QUALIFIERS),
            ),
            ("number_of_valid_detections", 6, Of::U4),
            ("sensor_id", 7, IDENTIFIER),
        ],
    ),
    (
        "LidarDetectionData",
        &[
            ("header", 1, Of::Message(".osi3.SensorDetectionHeader")),
            ("detection", 2, Of::Many(".osi3.LidarDetection")),
        ],
    ),
    (
        "FeatureData",
        &[
            ("version", 1, INTERFACE_VERSION),
            ("lidar_sensor", 3, Of::Many(".osi3.LidarDetectionData")),
        ],
    ),
    (
        "SensorData",
        &[
            ("version", 1, INTERFACE_VERSION),
            ("timestamp", 2, TIMESTAMP),
            ("sensor_id", 5, IDENTIFIER),
            ("last_measurement_time", 9, TIMESTAMP),
            ("feature_data", 26, Of::Message(".osi3.FeatureData")),
        ],
    ),
    ("Reflection", &[("time_of_flight", 2, Of::F8), ("object_id", 6, IDENTIFIER)]),
    ("LidarSensorView", &[("reflection", 2, Of::Many(".osi3.Reflection"))]),
    (
        "SensorView",
        &[
            ("version", 1, INTERFACE_VERSION),
            ("timestamp", 2, TIMESTAMP),
            ("sensor_id", 3, IDENTIFIER),
            ("lidar_sensor_view", 1002, Of::Many(".osi3.LidarSensorView")),
        ],
    ),
];

const PACKAGE: Package = Package {
    file: "osi_lidar.proto",
    package: "osi3",
    syntax: "proto2",
    imports: &[],
    messages: MESSAGES,
    choices: &[(".osi3.DetectionClassification", CLASSIFICATIONS)],
};

pub(super) fn topics() -> Vec<Topic> {
    let metadata = BTreeMap::from([
        ("net.asam.osi.trace.channel.osi_version".to_owned(), VERSION_TEXT.to_owned()),
        ("net.asam.osi.trace.channel.protobuf_version".to_owned(), PROTOBUF_VERSION.to_owned()),
    ]);
    let topic = |(name, schema)| Topic {
        name,
        schema,
        schema_encoding: "protobuf",
        schema_text: descriptor_set(&[PACKAGE]),
        encoding: "protobuf",
        metadata: metadata.clone(),
    };
    [("SensorData", "osi3.SensorData"), ("SensorView", "osi3.SensorView")].map(topic).into()
}

/// The metadata that describes a trace of OSI.
pub(super) fn file_metadata() -> Metadata {
    let entries = [
        ("version", VERSION_TEXT),
        ("min_osi_version", VERSION_TEXT),
        ("max_osi_version", VERSION_TEXT),
        ("min_protobuf_version", PROTOBUF_VERSION),
        ("max_protobuf_version", PROTOBUF_VERSION),
        ("description", "lidar detections simulated by Macropulse"),
    ];
    let metadata = entries.map(|(key, value)| (key.to_owned(), value.to_owned()));
    Metadata { name: "net.asam.osi.trace".to_owned(), metadata: metadata.into() }
}

/// The detections of a scan and, with the truth, the reflections.
pub(super) fn payloads(cloud: &PointCloud) -> io::Result<Vec<Payload>> {
    let stamp = stamp_ns(cloud);
    let timestamp = Some(Timestamp {
        seconds: Some((stamp / 1_000_000_000) as i64),
        nanos: Some((stamp % 1_000_000_000) as u32),
    });
    let [major, minor, patch] = VERSION.map(Some);
    let version =
        Some(InterfaceVersion { version_major: major, version_minor: minor, version_patch: patch });
    let sensor_id = identifier(SENSOR_ID);
    let header = SensorDetectionHeader {
        measurement_time: timestamp,
        cycle_counter: Some(cloud.scan),
        data_qualifier: Some(AVAILABLE),
        number_of_valid_detections: Some(cloud.returns() as u32),
        sensor_id,
    };
    let detection = (0..cloud.returns()).map(|at| detection(cloud, at)).collect();
    let lidar_sensor = vec![LidarDetectionData { header: Some(header), detection }];
    let data = SensorData {
        version,
        timestamp,
        sensor_id,
        last_measurement_time: timestamp,
        feature_data: Some(FeatureData { version, lidar_sensor }),
    };
    let mut payloads = vec![(0, data.encode_to_vec())];
    if cloud.has_truth() {
        let lidar_sensor_view = vec![LidarSensorView { reflection: reflections(cloud) }];
        let view = SensorView { version, timestamp, sensor_id, lidar_sensor_view };
        payloads.push((1, view.encode_to_vec()));
    }
    Ok(payloads)
}

fn identifier(value: u64) -> Option<Identifier> {
    Some(Identifier { value: Some(value) })
}

/// A return. Its object and what it is are known with the truth alone.
fn detection(cloud: &PointCloud, at: usize) -> LidarDetection {
    let [x, y, z] = cloud.position(at);
    let reflectivity = cloud.intensity.get(at).map(|&intensity| f64::from(intensity));
    let object = cloud.truth.returns.object.get(at).copied();
    LidarDetection {
        object_id: object.and_then(object_id),
        position: Some(Spherical3d {
            distance: Some(cloud.distance(at)),
            azimuth: Some(libm::atan2(y, x)),
            elevation: Some(libm::atan2(z, libm::hypot(x, y))),
        }),
        intensity: reflectivity.map(|reflectivity| (100.0 * reflectivity).clamp(0.0, 100.0)),
        classification: cloud.truth.returns.outcome.get(at).map(classification),
        reflectivity,
        radial_velocity: cloud.radial_velocity.get(at).map(|&velocity| f64::from(velocity)),
        beam_id: cloud.row.get(at).and_then(|&row| identifier(row.into())),
    }
}

/// Index in [`CLASSIFICATIONS`] of a return with this outcome.
fn classification(outcome: &Outcome) -> i32 {
    match outcome {
        Outcome::Right | Outcome::Near | Outcome::Edge => SURFACE,
        Outcome::Wrong => INVALID,
        Outcome::False | Outcome::Empty | Outcome::Missed => CLUTTER,
    }
}

/// The largest number stands for no object.
fn object_id(object: u16) -> Option<Identifier> {
    identifier(if object == NO_OBJECT { u64::MAX } else { object.into() })
}

/// Lists the surface of each return that came from one.
fn reflections(cloud: &PointCloud) -> Vec<Reflection> {
    let truth = &cloud.truth.returns;
    let surfaces = truth.range.iter().zip(&truth.object).filter(|(range, _)| range.is_finite());
    surfaces
        .map(|(range, object)| Reflection {
            time_of_flight: Some(tof_from_range(f64::from(*range))),
            object_id: object_id(*object),
        })
        .collect()
}
