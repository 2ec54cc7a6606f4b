//! Reads the clouds of an MCAP file one after the other, from its beginning: a file that was not
//! finished, too.

use super::super::about::About;
use super::super::contained::contained;
use super::super::{Error, Reading};
use super::zstd::Zstd;
use super::{ABOUT, METADATA, point_cloud2, ros2};
use crate::opened;
use crate::points::PointCloud;
use ::mcap::McapError;
use ::mcap::records::op;
use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Name of the format in messages to people.
const FORMAT: &str = "mcap";

/// More than this many bytes cannot come of one that is compressed.
const MOST_COMPRESSED: u64 = 256;

/// Bytes of the longest message that is read.
const LONGEST: u64 = 1 << 32;

/// Bytes that are read at a time.
const AT_A_TIME: usize = 1 << 20;

/// The clouds of a file, in its order.
pub(in super::super) struct Messages {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    contents: Contents,
    about: About,
    clouds: u64,
    is_over: bool,
}

/// Contents of the records of a file that were read so far.
#[derive(Default)]
struct Contents {
    /// The one topic whose clouds are wanted; all topics without it.
    wanted: Option<String>,
    /// Names of the schemas, and the content of each channel with clouds or transforms.
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Content>,
    /// Topics with clouds.
    topics: BTreeSet<String>,
}

#[derive(Clone, Copy)]
enum Content {
    Clouds,
    Transforms,
}

impl Messages {
    /// The clouds of the file at `path`.
    ///
    /// # Errors
    /// If the file cannot be opened.
    pub fn open(path: &Path, reading: &Reading) -> Result<Self, Error> {
        let file = opened::file(path, u64::MAX).map_err(|cause| Error::read(path, cause))?;
        let length = file.metadata().map_err(|cause| Error::read(path, cause))?.len();
        let limit =
            length.saturating_mul(MOST_COMPRESSED).min(LONGEST).min(reading.room.bytes()) as usize;
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(limit);
        let mut reader = LinearReader::new_with_options(options);
        let added = reader.add_decompressor(Zstd::new());
        added.map_err(|error| Error::invalid(path, FORMAT, told(&error)))?;
        Ok(Self {
            path: path.to_owned(),
            file,
            reader,
            contents: Contents { wanted: reading.topic.clone(), ..Contents::default() },
            about: About::within(reading.room),
            clouds: 0,
            is_over: false,
        })
    }

    /// The contents of the file beside its clouds, as far as it was read.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// The topics with clouds, as far as the file was read.
    pub fn topics(&self) -> &BTreeSet<String> {
        &self.contents.topics
    }

    fn fault(&self, fault: &str) -> Error {
        let clouds = self.clouds;
        Error::invalid(&self.path, FORMAT, format!("after {clouds} scans: {fault}"))
    }

    fn advance(&mut self) -> Result<Option<PointCloud>, Error> {
        loop {
            let reader = &mut self.reader;
            let event = match contained(|| reader.next_event()) {
                Ok(Some(event)) => event,
                Ok(None) => break,
                Err(fault) => return Err(self.fault(&fault)),
            };
            let event = match event {
                Ok(event) => event,
                Err(error) => {
                    let fault = told(&error);
                    return Err(self.fault(&fault));
                }
            };
            match event {
                LinearReadEvent::ReadRequest(need) => {
                    // A length in the file is not believed at once.
                    let read = self.file.read(self.reader.insert(need.min(AT_A_TIME)));
                    let read = read.map_err(|cause| Error::read(&self.path, cause))?;
                    self.reader.notify_read(read);
                }
                LinearReadEvent::Record { data, opcode } => {
                    match self.contents.take(opcode, data, &mut self.about) {
                        Ok(None) => {}
                        Ok(Some(cloud)) => {
                            self.clouds += 1;
                            return Ok(Some(cloud));
                        }
                        Err(fault) => return Err(self.fault(&fault)),
                    }
                }
            }
        }
        if self.clouds == 0 {
            return Err(Error::invalid(&self.path, FORMAT, self.contents.nothing()));
        }
        Ok(None)
    }
}

/// Describes an error of the library in our words.
fn told(error: &McapError) -> String {
    match error {
        McapError::UnexpectedEof => "it ends within a record; the file was cut short".to_owned(),
        McapError::BadMagic => "it does not begin as MCAP files do".to_owned(),
        McapError::UnsupportedCompression(name) => {
            format!("its chunks are compressed by `{name}`; lz4 and zstd are read")
        }
        McapError::BadChunkCrc { .. } => "a chunk is damaged: its checksum differs".to_owned(),
        McapError::DecompressionError(_) | McapError::Io(_) => {
            "a chunk is damaged: it does not unpack".to_owned()
        }
        McapError::RecordTooLarge { .. } | McapError::ChunkTooLarge(_) => {
            "a record says that it is longer than the file can hold".to_owned()
        }
        _ => "a record is damaged".to_owned(),
    }
}

impl Contents {
    /// Takes in a record; the cloud of a message that is one.
    fn take(
        &mut self,
        opcode: u8,
        data: &[u8],
        about: &mut About,
    ) -> Result<Option<PointCloud>, String> {
        let mut fields = Fields(data);
        match opcode {
            op::SCHEMA => {
                let number = fields.u2()?;
                self.schemas.insert(number, fields.text()?.to_owned());
            }
            op::CHANNEL => self.take_channel(fields)?,
            op::METADATA if fields.text()? == METADATA => {
                let mut entries = Fields(fields.bytes()?);
                while !entries.0.is_empty() {
                    let (key, text) = (entries.text()?, entries.text()?);
                    let mut lines = text.lines().filter(|_| key == ABOUT);
                    lines.try_for_each(|line| about.take(line))?;
                }
            }
            op::MESSAGE => {
                let channel = fields.u2()?;
                let sequence = fields.u4()?;
                // When it was recorded, and when it was published.
                fields.take(16)?;
                match self.channels.get(&channel) {
                    Some(Content::Transforms) => {
                        about.viewpoint = ros2::viewpoint(fields.0)?.unwrap_or(about.viewpoint);
                    }
                    Some(Content::Clouds) => {
                        about.scan = sequence.into();
                        return point_cloud2::decode(fields.0, about).map(Some);
                    }
                    None => {}
                }
            }
            _ => {}
        }
        Ok(None)
    }

    fn take_channel(&mut self, mut fields: Fields) -> Result<(), String> {
        let number = fields.u2()?;
        let schema = self.schemas.get(&fields.u2()?).map(String::as_str);
        let (topic, encoding) = (fields.text()?, fields.text()?);
        if encoding != "cdr" {
            return Ok(());
        }
        if schema == Some(ros2::POINT_CLOUD2) {
            self.topics.insert(topic.to_owned());
            if self.wanted.as_ref().is_none_or(|wanted| wanted == topic) {
                self.channels.insert(number, Content::Clouds);
            }
        } else if topic == ros2::TF {
            self.channels.insert(number, Content::Transforms);
        }
        Ok(())
    }

    /// Why there is no cloud.
    fn nothing(&self) -> String {
        let topics: Vec<&str> = self.topics.iter().map(String::as_str).collect();
        match (&self.wanted, topics.as_slice()) {
            (_, []) => "it has no messages of the type sensor_msgs/msg/PointCloud2".to_owned(),
            (Some(wanted), topics) => {
                format!("it has no clouds on the topic `{wanted}`, but on {}", topics.join(", "))
            }
            (None, topics) => format!("there is no message on {}", topics.join(", ")),
        }
    }
}

/// The unread rest of a record. The parser of the library takes the memory that a length asks for before it
/// looks whether the record is as long.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, size: usize) -> Result<&'a [u8], String> {
        let split = self.0.split_at_checked(size);
        let (taken, rest) = split.ok_or("a record ends within a field")?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        self.take(N)?.try_into().map_err(|_| "a record ends within a field".to_owned())
    }

    fn u2(&mut self) -> Result<u16, String> {
        self.array().map(u16::from_le_bytes)
    }

    fn u4(&mut self) -> Result<u32, String> {
        self.array().map(u32::from_le_bytes)
    }

    fn bytes(&mut self) -> Result<&'a [u8], String> {
        let size = self.u4()? as usize;
        self.take(size)
    }

    fn text(&mut self) -> Result<&'a str, String> {
        std::str::from_utf8(self.bytes()?).map_err(|_| "a name in a record is not text".to_owned())
    }
}

impl Iterator for Messages {
    type Item = Result<PointCloud, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let next = self.advance();
        self.is_over = !matches!(next, Ok(Some(_)));
        next.transpose()
    }
}
