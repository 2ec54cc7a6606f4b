//! The messages of ROS 2: the cloud, and where the sensor is.
//!
//! Frames by REP-105: `map` → `odom` → `base_link`, and behind it the sensor's own, `lidar`, x forward,
//! y left, z up (REP-103). The sensor stands in `base_link`, which moves in `odom`; a simulation knows
//! of no drift, so `odom` is `map`.

use super::cdr::{Decoder, Encoder};
use super::point_cloud2::{self, SENSOR_FRAME, write_stamp};
use super::{Payload, Profile, Topic, stamp_ns};
use crate::points::{PointCloud, Viewpoint};
use std::collections::BTreeMap;
use std::io;

/// Topics of the points and of the transforms.
const POINTS: &str = "/points";
pub(super) const TF: &str = "/tf";
const TF_STATIC: &str = "/tf_static";

/// Type of the messages with points and with transforms.
pub(super) const POINT_CLOUD2: &str = "sensor_msgs/msg/PointCloud2";
const TF_MESSAGE: &str = "tf2_msgs/msg/TFMessage";

/// The frames above that of the sensor.
pub(super) const FRAMES: [&str; 3] = ["map", "odom", "base_link"];

/// Definition of the header in the schema of every message with a stamp.
macro_rules! header {
    () => {
        "\
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"
    };
}

const POINT_CLOUD2_SCHEMA: &str = concat!(
    "\
std_msgs/Header header
uint32 height
uint32 width
sensor_msgs/PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
",
    header!(),
    "\
================================================================================
MSG: sensor_msgs/PointField
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count
"
);

const TF_SCHEMA: &str = concat!(
    "\
geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
",
    header!(),
    "\
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"
);

/// Quality of service, for `ros2 bag` and nodes, of a topic whose last message is also for nodes that
/// subscribe later.
const LATCHED: &str = "\
- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
";

pub(super) fn topics() -> Vec<Topic> {
    let topic = |(name, schema, text, profiles): (_, _, &str, &str)| Topic {
        name,
        schema,
        schema_encoding: "ros2msg",
        schema_text: text.as_bytes().to_vec(),
        encoding: "cdr",
        metadata: BTreeMap::from([("offered_qos_profiles".to_owned(), profiles.to_owned())]),
    };
    let all = [
        (POINTS, POINT_CLOUD2, POINT_CLOUD2_SCHEMA, ""),
        (TF, TF_MESSAGE, TF_SCHEMA, ""),
        (TF_STATIC, TF_MESSAGE, TF_SCHEMA, LATCHED),
    ];
    all.map(topic).into()
}

/// The transforms of a scan before its points, so that who plays the file knows them in time.
pub(super) fn payloads(
    profile: Profile,
    cloud: &PointCloud,
    is_first: bool,
) -> io::Result<Vec<Payload>> {
    let stamp = stamp_ns(cloud);
    let [map, odom, base] = FRAMES;
    let mut payloads = Vec::new();
    if is_first {
        let still = Viewpoint::default();
        let fixed = [(map, odom, &still), (base, SENSOR_FRAME, &still)];
        payloads.push((2, transforms(stamp, &fixed)));
    }
    payloads.push((1, transforms(stamp, &[(odom, base, &cloud.viewpoint)])));
    payloads.push((0, point_cloud2::encode(profile, cloud)?));
    Ok(payloads)
}

/// A message with transforms, each of a frame within another.
fn transforms(stamp_ns: u64, all: &[(&str, &str, &Viewpoint)]) -> Vec<u8> {
    let mut message = Encoder::new();
    message.u4(all.len() as u32);
    for (parent, child, Viewpoint { position, turn: [w, x, y, z] }) in all {
        write_stamp(&mut message, stamp_ns, parent);
        message.text(child);
        position.iter().chain([x, y, z, w]).for_each(|number| message.f8(*number));
    }
    message.done()
}

/// The pose of the sensor, if a message with transforms has it.
pub(super) fn viewpoint(message: &[u8]) -> Result<Option<Viewpoint>, String> {
    let mut message = Decoder::new(message)?;
    let mut found = None;
    for _ in 0..message.u4()? {
        message.u4()?;
        message.u4()?;
        message.text()?;
        let child = message.text()?;
        let mut numbers = [0.0; 7];
        for number in &mut numbers {
            *number = message.f8()?;
        }
        let [x, y, z, i, j, k, w] = numbers;
        if child == FRAMES[2] && numbers.iter().all(|number| number.is_finite()) {
            found = Some(Viewpoint { position: [x, y, z], turn: [w, i, j, k] });
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::super::super::sample_cloud;
    use super::*;

    #[test]
    fn the_pose_goes_there_and_back() {
        let cloud = sample_cloud();
        let payloads = payloads(Profile::Extended, &cloud, true).unwrap();
        let [(2, fixed), (1, moving), (0, _)] = payloads.as_slice() else { panic!() };
        assert_eq!(viewpoint(moving).unwrap(), Some(cloud.viewpoint));
        assert_eq!(viewpoint(fixed).unwrap(), None);
        for length in 0..moving.len() {
            assert!(viewpoint(&moving[..length]).is_err(), "{length}");
        }
    }
}
