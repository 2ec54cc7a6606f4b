//! MCAP: all scans of a run in one file of messages, which fill up scan by scan.
//!
//! A scan is flushed as a chunk of its own when it is done, and the summary follows at the end. So the file
//! cannot appear as a whole, as our others do: it grows under its own name. A run that is broken off leaves
//! the finished scans in it. Readers that go through a file from its beginning read those, and `mcap recover`
//! adds the summary.

mod cdr;
mod foxglove;
mod osi;
mod point_cloud2;
mod profile;
mod protobuf;
mod reader;
mod ros2;
mod zstd;

pub(super) use reader::Messages;

use super::about::{list_line, name_lines};
use super::atomic::{growing, growing_named};
use super::attributes::Attribute;
use super::format::CloudWriter;
use super::holding::{Further, Holding};
use super::{Error, Names};
use crate::points::PointCloud;
use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::{Compression, McapError, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Cursor, Seek, Write};
use std::path::{Path, PathBuf};

/// Time that stands for the beginning of the first scan, ns. ROS takes a time of 0 for none at all.
pub(super) const EPOCH_NS: u64 = 1_000_000_000;

/// Name of the metadata that is ours, and its one key.
const METADATA: &str = "macropulse";
const ABOUT: &str = "about";

/// Type of the messages of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Message {
    /// ROS 2: `sensor_msgs/msg/PointCloud2`, `/tf` and `/tf_static`.
    Ros2(Profile),
    /// `foxglove.PointCloud` and `foxglove.FrameTransforms`.
    Foxglove,
    /// ASAM OSI: `osi3.SensorData` with lidar detections and, with the truth, `osi3.SensorView` with
    /// reflections.
    Osi,
}

/// Which fields a `PointCloud2` has: those that programs for these sensors expect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Profile {
    /// All attributes under their own names.
    Extended,
    /// `XYZIRT` as the ROS 2 driver of Velodyne has it.
    Velodyne,
    /// As the driver of Ouster has it.
    Ouster,
    /// As the driver of Livox has it.
    Livox,
    /// `XYZIRCAEDT` of Autoware, 32 bytes.
    Autoware,
}

/// A stream of messages of one kind.
struct Topic {
    name: &'static str,
    schema: &'static str,
    schema_encoding: &'static str,
    schema_text: Vec<u8>,
    encoding: &'static str,
    metadata: BTreeMap<String, String>,
}

/// A message for the topic of this number.
type Payload = (usize, Vec<u8>);

impl Message {
    fn topics(self) -> Vec<Topic> {
        match self {
            Self::Ros2(_) => ros2::topics(),
            Self::Foxglove => foxglove::topics(),
            Self::Osi => osi::topics(),
        }
    }

    fn file_metadata(self) -> Option<Metadata> {
        (self == Self::Osi).then(osi::file_metadata)
    }

    /// Encodes a scan; the first scan also brings the contents that a file has once.
    fn payloads(self, cloud: &PointCloud, is_first: bool) -> io::Result<Vec<Payload>> {
        match self {
            Self::Ros2(profile) => ros2::payloads(profile, cloud, is_first),
            Self::Foxglove => foxglove::payloads(cloud),
            Self::Osi => osi::payloads(cloud),
        }
    }

    fn profile_name(self) -> &'static str {
        match self {
            Self::Ros2(_) => "ros2",
            Self::Foxglove | Self::Osi => "",
        }
    }
}

/// A file of messages that is being written.
pub(super) struct Recorder<W: Write + Seek> {
    writer: Writer<W>,
    message: Message,
    channels: Vec<u16>,
    scans: u64,
    /// The stamp of the last scan, ns, and how many scans were moved behind the one before.
    last_ns: Option<u64>,
    moved: u64,
}

impl<W: Write + Seek> Recorder<W> {
    fn begin(message: Message, out: W) -> Result<Self, McapError> {
        let options = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .chunk_size(None)
            // A chunk is written when it is whole.
            .disable_seeking(true)
            .profile(message.profile_name())
            .library(concat!("macropulse ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(out)?;
        let mut channels = Vec::new();
        for topic in message.topics() {
            let Topic { schema, schema_encoding, ref schema_text, .. } = topic;
            let schema = writer.add_schema(schema, schema_encoding, schema_text)?;
            let Topic { name, encoding, ref metadata, .. } = topic;
            channels.push(writer.add_channel(schema, name, encoding, metadata)?);
        }
        if let Some(metadata) = message.file_metadata() {
            writer.write_metadata(&metadata)?;
        }
        Ok(Self { writer, message, channels, scans: 0, last_ns: None, moved: 0 })
    }

    /// Adds a scan, whose columns are even, as a chunk that is flushed. A scan that does not begin
    /// after the one before is moved behind it: messages are told apart by their stamps.
    fn add(&mut self, cloud: &PointCloud, names: &Names) -> Result<(), McapError> {
        let stamp = stamp_ns(cloud);
        match self.last_ns {
            Some(last) if stamp <= last => {
                self.moved += 1;
                let later = last.saturating_add(PAUSE_NS) - stamp;
                self.add_in_order(&moved(cloud, later), names)
            }
            _ => self.add_in_order(cloud, names),
        }
    }

    fn add_in_order(&mut self, cloud: &PointCloud, names: &Names) -> Result<(), McapError> {
        let is_first = self.scans == 0;
        if is_first {
            let lines = [list_line(cloud)].into_iter().chain(name_lines(names));
            let about = lines.collect::<Vec<_>>().join("\n");
            let metadata = BTreeMap::from([(ABOUT.to_owned(), about)]);
            self.writer.write_metadata(&Metadata { name: METADATA.to_owned(), metadata })?;
        }
        let time = stamp_ns(cloud);
        for (topic, payload) in self.message.payloads(cloud, is_first)? {
            let Some(&channel_id) = self.channels.get(topic) else { continue };
            let sequence = cloud.scan as u32;
            let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
            self.writer.write_to_known_channel(&header, &payload)?;
        }
        self.scans += 1;
        self.last_ns = Some(time);
        self.writer.flush()
    }
}

/// A file of messages on the disk.
pub(super) struct Recording {
    recorder: Recorder<BufWriter<File>>,
    path: PathBuf,
}

impl Recording {
    /// Begins the file at `path`, in place of an older one; `is_named` says that a user typed its name.
    pub fn begin(message: Message, path: &Path, is_named: bool) -> Result<Self, Error> {
        let file = if is_named { growing_named(path) } else { growing(path) };
        let file = file.map_err(|cause| Error::write(path, cause))?;
        let recorder = Recorder::begin(message, BufWriter::with_capacity(1 << 16, file))
            .map_err(|error| Error::write(path, cause(error)))?;
        Ok(Self { recorder, path: path.to_owned() })
    }

    /// Adds a scan, whose columns are even. When this returns, it is readable.
    pub fn add(&mut self, cloud: &PointCloud, names: &Names) -> Result<(), Error> {
        let added = self.recorder.add(cloud, names);
        added.map_err(|error| Error::write(&self.path, cause(error)))
    }

    /// How many scans were moved behind the one before, as they did not begin after it.
    pub fn moved(&self) -> u64 {
        self.recorder.moved
    }

    /// Writes the summary.
    pub fn finish(mut self) -> Result<(), Error> {
        let finished = self.recorder.writer.finish();
        finished.map(|_| ()).map_err(|error| Error::write(&self.path, cause(error)))
    }
}

impl CloudWriter for Message {
    fn name(&self) -> &'static str {
        match self {
            Self::Ros2(Profile::Extended) => "mcap",
            Self::Ros2(Profile::Velodyne) => "mcap-velodyne",
            Self::Ros2(Profile::Ouster) => "mcap-ouster",
            Self::Ros2(Profile::Livox) => "mcap-livox",
            Self::Ros2(Profile::Autoware) => "mcap-autoware",
            Self::Foxglove => "mcap-foxglove",
            Self::Osi => "mcap-osi",
        }
    }

    fn extension(&self) -> &'static str {
        "mcap"
    }

    fn file_name(&self, _scan: u64) -> String {
        format!("{}.mcap", self.name().replace("mcap", "scans"))
    }

    fn is_of_run(&self) -> bool {
        true
    }

    fn holds(&self, attribute: Attribute) -> Holding {
        match self {
            Self::Ros2(profile) => profile.holds(attribute),
            Self::Foxglove => Holding::Whole,
            Self::Osi => osi::holds(attribute),
        }
    }

    fn holds_further(&self, further: Further) -> bool {
        match (self, further) {
            (Self::Ros2(profile), Further::EmptyPixels) => profile.is_organised(),
            (Self::Ros2(profile), Further::Digits) => *profile == Profile::Extended,
            (Self::Ros2(_), Further::Pose | Further::Names | Further::Stamp) => true,
            (Self::Foxglove, further) => further != Further::EmptyPixels,
            (Self::Osi, further) => {
                matches!(further, Further::Names | Further::Stamp | Further::Digits)
            }
        }
    }

    fn write(&self, cloud: &PointCloud, names: &Names, out: &mut dyn Write) -> io::Result<()> {
        let mut file = Cursor::new(Vec::new());
        let written = (|| {
            let mut recorder = Recorder::begin(*self, &mut file)?;
            recorder.add(cloud, names)?;
            recorder.writer.finish()
        })();
        written.map_err(cause)?;
        out.write_all(file.get_ref())
    }
}

fn cause(error: McapError) -> io::Error {
    match error {
        McapError::Io(cause) => cause,
        other => io::Error::other(other),
    }
}

/// Time of the first shot of a scan, ns from the beginning of the first scan. It is the earliest time of a
/// pixel, or of a return if the cloud has no pixels.
fn begins_ns(cloud: &PointCloud) -> f64 {
    let times = if cloud.fired_ns.is_empty() { &cloud.time_ns } else { &cloud.fired_ns };
    let first = times.iter().copied().filter(|time| !time.is_nan()).fold(f64::INFINITY, f64::min);
    if first.is_finite() { first } else { 0.0 }
}

/// Time, ns, by which a sum of floats may fall short of the whole ns that it stands for.
const SHORT_NS: f64 = 1e-3;

/// The stamp of a scan, ns: its own or, of a scan without one, its beginning from the epoch of the
/// file, in whole ns.
fn stamp_ns(cloud: &PointCloud) -> u64 {
    let begins = || EPOCH_NS.saturating_add((begins_ns(cloud) + SHORT_NS).max(0.0) as u64);
    cloud.stamp_ns.unwrap_or_else(begins)
}

/// The time from which `time_ns` of a cloud counts, ns.
fn times_from_ns(cloud: &PointCloud) -> u64 {
    cloud.stamp_ns.unwrap_or(EPOCH_NS)
}

/// Time that passes, ns, between two clouds that would have one stamp.
const PAUSE_NS: u64 = 100_000_000;

/// The same cloud, taken `later_ns` later.
fn moved(cloud: &PointCloud, later_ns: u64) -> PointCloud {
    let mut moved = cloud.clone();
    if cloud.stamp_ns.is_some() || cloud.time_ns.is_empty() {
        moved.stamp_ns = Some(stamp_ns(cloud).saturating_add(later_ns));
    } else {
        let times = moved.time_ns.iter_mut().chain(&mut moved.fired_ns);
        times.for_each(|time| *time += later_ns as f64);
    }
    moved
}
