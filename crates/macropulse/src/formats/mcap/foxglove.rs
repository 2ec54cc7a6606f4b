//! The messages of Foxglove: the returns with all their attributes, and where the sensor is.

use super::super::attributes::{Attribute, returns};
use super::super::number::Kind;
use super::point_cloud2::SENSOR_FRAME;
use super::protobuf::{Described, Field, Of, Package, descriptor_set};
use super::ros2::{FRAMES, TF};
use super::{Payload, Topic, stamp_ns};
use crate::points::{PointCloud, Viewpoint};
use prost::Message;
use std::collections::BTreeMap;
use std::io;

#[derive(Clone, Copy, PartialEq, Message)]
struct Time {
    #[prost(int64, tag = "1")]
    seconds: i64,
    #[prost(int32, tag = "2")]
    nanos: i32,
}

#[derive(Clone, PartialEq, Message)]
struct Vector3 {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
}

#[derive(Clone, PartialEq, Message)]
struct Quaternion {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
    #[prost(double, tag = "4")]
    w: f64,
}

#[derive(Clone, PartialEq, Message)]
struct Pose {
    #[prost(message, optional, tag = "1")]
    position: Option<Vector3>,
    #[prost(message, optional, tag = "2")]
    orientation: Option<Quaternion>,
}

#[derive(Clone, PartialEq, Message)]
struct PackedElementField {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(fixed32, tag = "2")]
    offset: u32,
    #[prost(int32, tag = "3")]
    kind: i32,
}

#[derive(Clone, PartialEq, Message)]
struct Points {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Time>,
    #[prost(string, tag = "2")]
    frame_id: String,
    #[prost(message, optional, tag = "3")]
    pose: Option<Pose>,
    #[prost(fixed32, tag = "4")]
    point_stride: u32,
    #[prost(message, repeated, tag = "5")]
    fields: Vec<PackedElementField>,
    #[prost(bytes = "vec", tag = "6")]
    data: Vec<u8>,
}

#[derive(Clone, PartialEq, Message)]
struct FrameTransform {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Time>,
    #[prost(string, tag = "2")]
    parent_frame_id: String,
    #[prost(string, tag = "3")]
    child_frame_id: String,
    #[prost(message, optional, tag = "4")]
    translation: Option<Vector3>,
    #[prost(message, optional, tag = "5")]
    rotation: Option<Quaternion>,
}

#[derive(Clone, PartialEq, Message)]
struct FrameTransforms {
    #[prost(message, repeated, tag = "1")]
    transforms: Vec<FrameTransform>,
}

const NUMBERS: &[&str] =
    &["UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"];

const TIME: &str = ".google.protobuf.Timestamp";

const VECTOR3: &[Field] = &[("x", 1, Of::F8), ("y", 2, Of::F8), ("z", 3, Of::F8)];

const QUATERNION: &[Field] =
    &[("x", 1, Of::F8), ("y", 2, Of::F8), ("z", 3, Of::F8), ("w", 4, Of::F8)];

const MESSAGES: &[Described] = &[
    ("Vector3", VECTOR3),
    ("Quaternion", QUATERNION),
    (
        "Pose",
        &[
            ("position", 1, Of::Message(".foxglove.Vector3")),
            ("orientation", 2, Of::Message(".foxglove.Quaternion")),
        ],
    ),
    (
        "PackedElementField",
        &[
            ("name", 1, Of::Text),
            ("offset", 2, Of::Fixed4),
            ("type", 3, Of::Choice(".foxglove.PackedElementField.NumericType", NUMBERS)),
        ],
    ),
    (
        "PointCloud",
        &[
            ("timestamp", 1, Of::Message(TIME)),
            ("frame_id", 2, Of::Text),
            ("pose", 3, Of::Message(".foxglove.Pose")),
            ("point_stride", 4, Of::Fixed4),
            ("fields", 5, Of::Many(".foxglove.PackedElementField")),
            ("data", 6, Of::Bytes),
        ],
    ),
    (
        "FrameTransform",
        &[
            ("timestamp", 1, Of::Message(TIME)),
            ("parent_frame_id", 2, Of::Text),
            ("child_frame_id", 3, Of::Text),
            ("translation", 4, Of::Message(".foxglove.Vector3")),
            ("rotation", 5, Of::Message(".foxglove.Quaternion")),
        ],
    ),
    ("FrameTransforms", &[("transforms", 1, Of::Many(".foxglove.FrameTransform"))]),
];

const PACKAGES: [Package; 2] = [
    Package {
        file: "google/protobuf/timestamp.proto",
        package: "google.protobuf",
        syntax: "proto3",
        imports: &[],
        messages: &[("Timestamp", &[("seconds", 1, Of::I8), ("nanos", 2, Of::I4)])],
        choices: &[],
    },
    Package {
        file: "foxglove/messages.proto",
        package: "foxglove",
        syntax: "proto3",
        imports: &["google/protobuf/timestamp.proto"],
        messages: MESSAGES,
        choices: &[],
    },
];

pub(super) fn topics() -> Vec<Topic> {
    let topic = |(name, schema)| Topic {
        name,
        schema,
        schema_encoding: "protobuf",
        schema_text: descriptor_set(&PACKAGES),
        encoding: "protobuf",
        metadata: BTreeMap::new(),
    };
    [("/points", "foxglove.PointCloud"), (TF, "foxglove.FrameTransforms")].map(topic).into()
}

/// The transforms of a scan, and its points.
pub(super) fn payloads(cloud: &PointCloud) -> io::Result<Vec<Payload>> {
    let stamp = stamp_ns(cloud);
    let time =
        Time { seconds: (stamp / 1_000_000_000) as i64, nanos: (stamp % 1_000_000_000) as i32 };
    let [map, odom, base] = FRAMES;
    let still = Viewpoint::default();
    let frames =
        [(map, odom, &still), (odom, base, &cloud.viewpoint), (base, SENSOR_FRAME, &still)];
    let transform = |(parent, child, viewpoint): (&str, &str, &Viewpoint)| FrameTransform {
        timestamp: Some(time),
        parent_frame_id: parent.to_owned(),
        child_frame_id: child.to_owned(),
        translation: Some(position(viewpoint)),
        rotation: Some(orientation(viewpoint)),
    };
    let transforms = FrameTransforms { transforms: frames.map(transform).into() };
    let points = points(cloud, time);
    Ok(vec![(1, transforms.encode_to_vec()), (0, points.encode_to_vec())])
}

fn points(cloud: &PointCloud, time: Time) -> Points {
    let attributes = Attribute::of(cloud);
    let mut stride = 0;
    let field = |attribute: &Attribute| {
        let (offset, kind) = (stride, attribute.kind(cloud));
        stride += kind.size() as u32;
        PackedElementField { name: attribute.name().to_owned(), offset, kind: number(kind) }
    };
    let fields = attributes.iter().map(field).collect();
    let mut data = Vec::with_capacity(cloud.returns() * stride as usize);
    for point in returns(cloud) {
        attributes.iter().for_each(|attribute| attribute.value(cloud, point).append_to(&mut data));
    }
    let still = Viewpoint::default();
    Points {
        timestamp: Some(time),
        frame_id: SENSOR_FRAME.to_owned(),
        pose: Some(Pose {
            position: Some(position(&still)),
            orientation: Some(orientation(&still)),
        }),
        point_stride: stride,
        fields,
        data,
    }
}

fn position(viewpoint: &Viewpoint) -> Vector3 {
    let [x, y, z] = viewpoint.position;
    Vector3 { x, y, z }
}

fn orientation(viewpoint: &Viewpoint) -> Quaternion {
    let [w, x, y, z] = viewpoint.turn;
    Quaternion { x, y, z, w }
}

/// The number of a kind among the types of `PackedElementField`; 0 is none.
fn number(kind: Kind) -> i32 {
    let all = [Kind::U1, Kind::I1, Kind::U2, Kind::I2, Kind::U4, Kind::I4, Kind::F4, Kind::F8];
    all.iter().position(|known| *known == kind).map_or(0, |at| at as i32 + 1)
}
