//! Reads the clouds of an MCAP file one after the other, from its beginning: a file that was not
//! finished, too.

use super::super::about::About;
use super::super::{Error, Format};
use super::{ABOUT, METADATA, Message, Profile, point_cloud2, ros2};
use crate::points::PointCloud;
use ::mcap::records::Record;
use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use ::mcap::{McapError, parse_record};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// What the files are called in messages to people.
const FORMAT: Format = Format::Mcap(Message::Ros2(Profile::Extended));

/// More than this many bytes cannot come of one that is compressed.
const MOST_COMPRESSED: u64 = 256;

/// Bytes of the longest message that is read.
const LONGEST: u64 = 1 << 32;

/// The clouds of a file, in its order.
pub(in super::super) struct Messages {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    /// Names of the schemas, and of the channels with clouds or transforms what they have.
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Content>,
    about: About,
    clouds: u64,
    is_over: bool,
}

#[derive(Clone, Copy)]
enum Content {
    Clouds,
    Transforms,
}

impl Messages {
    /// # Errors
    /// If the file cannot be opened.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = File::open(path).map_err(|cause| Error::read(path, cause))?;
        let length = file.metadata().map_err(|cause| Error::read(path, cause))?.len();
        let limit = length.saturating_mul(MOST_COMPRESSED).min(LONGEST) as usize;
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(limit);
        Ok(Self {
            path: path.to_owned(),
            file,
            reader: LinearReader::new_with_options(options),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            about: About::default(),
            clouds: 0,
            is_over: false,
        })
    }

    /// What the file says beside its clouds, as far as it was read.
    pub fn about(&self) -> &About {
        &self.about
    }

    fn fault(&self, fault: &str) -> Error {
        let clouds = self.clouds;
        Error::invalid(&self.path, FORMAT, format!("after {clouds} scans: {fault}"))
    }

    fn advance(&mut self) -> Result<Option<PointCloud>, Error> {
        while let Some(event) = self.reader.next_event() {
            let event = match event {
                Ok(event) => event,
                Err(error) => {
                    let fault = told(&error);
                    return Err(self.fault(&fault));
                }
            };
            match event {
                LinearReadEvent::ReadRequest(need) => {
                    let read = self.file.read(self.reader.insert(need));
                    let read = read.map_err(|cause| Error::read(&self.path, cause))?;
                    self.reader.notify_read(read);
                }
                LinearReadEvent::Record { data, opcode } => {
                    let taken = parse_record(opcode, data)
                        .map_err(|error| error.to_string())
                        .and_then(|record| {
                            take(&record, &mut self.schemas, &mut self.channels, &mut self.about)
                        });
                    match taken {
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
            let fault = "it has no messages of the type sensor_msgs/msg/PointCloud2";
            return Err(Error::invalid(&self.path, FORMAT, fault));
        }
        Ok(None)
    }
}

fn told(error: &McapError) -> String {
    match error {
        McapError::UnexpectedEof => "it ends within a record; the file was cut short".to_owned(),
        other => other.to_string(),
    }
}

/// Takes in a record; the cloud of a message that is one.
fn take(
    record: &Record,
    schemas: &mut BTreeMap<u16, String>,
    channels: &mut BTreeMap<u16, Content>,
    about: &mut About,
) -> Result<Option<PointCloud>, String> {
    match record {
        Record::Schema { header, .. } => {
            schemas.insert(header.id, header.name.clone());
        }
        Record::Channel(channel) => {
            let schema = schemas.get(&channel.schema_id).map(String::as_str);
            let is_cdr = channel.message_encoding == "cdr";
            match (schema, channel.topic.as_str()) {
                (Some(ros2::POINT_CLOUD2), _) if is_cdr => {
                    channels.insert(channel.id, Content::Clouds);
                }
                (_, ros2::TF) if is_cdr => {
                    channels.insert(channel.id, Content::Transforms);
                }
                _ => {}
            }
        }
        Record::Metadata(metadata) if metadata.name == METADATA => {
            let text = metadata.metadata.get(ABOUT).map_or("", String::as_str);
            text.lines().try_for_each(|line| about.take(line))?;
        }
        Record::Message { header, data } => match channels.get(&header.channel_id) {
            Some(Content::Transforms) => {
                about.viewpoint = ros2::viewpoint(data)?.unwrap_or(about.viewpoint);
            }
            Some(Content::Clouds) => {
                about.scan = header.sequence.into();
                return point_cloud2::decode(data, about).map(Some);
            }
            None => {}
        },
        _ => {}
    }
    Ok(None)
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
