//! Clouds from files, whatever their format.

use super::about::About;
use super::cloud_file::{CloudFile, Scans};
use super::mcap::Messages;
use super::{
    CloudRoom, Error, Format, LeftOut, Names, csv_reader, e57_reader, kitti, las_reader, npy,
    pcd_reader, ply_reader, ptx_reader,
};
use crate::points::PointCloud;
use std::path::{Path, PathBuf};

/// How the clouds of a file are read.
#[derive(Debug, Clone, Default)]
pub struct Reading {
    /// The memory that the clouds may take: by default four fifths of what the machine has.
    pub room: CloudRoom,
    /// The topic of an MCAP file whose clouds alone are read; all topics without it.
    pub topic: Option<String>,
}

/// The clouds of a file, one after the other: many of an MCAP, E57 or PTX file, one of any other. Their
/// numbers ascend.
pub struct Clouds {
    path: PathBuf,
    kind: FileKind,
    source: Source,
    /// The number that the next cloud has at least.
    next: u64,
}

enum Source {
    One { cloud: Option<Box<PointCloud>>, about: Box<About> },
    Scans(Box<dyn Scans + Send>),
    Messages(Box<Messages>),
}

/// The format in which a file is read.
#[derive(Clone, Copy, PartialEq)]
enum FileKind {
    /// A format that is written, too.
    Written(Format),
    /// Scans of Leica Cyclone.
    Ptx,
}

impl FileKind {
    /// Returns the kind of the file at `path`, by its ending.
    fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?;
        match ending.to_ascii_lowercase().as_str() {
            "ptx" => Some(Self::Ptx),
            "pts" => Some(Self::Written(Format::Csv)),
            _ => Format::of_extension(ending).map(Self::Written),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Written(format) => format.name(),
            Self::Ptx => "ptx",
        }
    }
}

impl Clouds {
    /// Opens the file at `path`, whose ending says what it is: `pcd`, `ply`, `las`, `laz`, `e57`,
    /// `npy`, `csv`, `xyz`, `txt`, `pts`, `ptx`, `bin` (KITTI, nuScenes) or `mcap` (`PointCloud2` of ROS 2).
    ///
    /// Attributes that the file lacks are absent in the cloud; [`Clouds::left_out`] names those that a
    /// cloud has no column for, and counts points that are none. Truth is read if the file has the
    /// outcome. A file that does not tell its rows and columns has those of its highest ones, or no
    /// image.
    ///
    /// # Errors
    /// [`Error::Read`] if the file cannot be read, [`Error::Invalid`] if it is not what its ending
    /// says, [`Error::Unreadable`] if no cloud is read from files of that ending.
    pub fn open(path: &Path) -> Result<Self, Error> {
        Self::open_with(path, &Reading::default())
    }

    /// As [`Clouds::open`], with a limit of memory and a choice of the topic.
    ///
    /// # Errors
    /// As [`Clouds::open`]; if the clouds take more memory than the limit; and [`Error::NoTopics`] if
    /// a topic is chosen in a file of a format that has none.
    pub fn open_with(path: &Path, reading: &Reading) -> Result<Self, Error> {
        let Some(kind) = FileKind::of(path) else {
            // A name that is misspelt is no format that is unknown.
            std::fs::metadata(path).map_err(|cause| Error::read(path, cause))?;
            return Err(Error::unreadable(path));
        };
        let source = match kind {
            FileKind::Written(Format::Mcap(_)) => {
                Source::Messages(Box::new(Messages::open(path, reading)?))
            }
            _ if reading.topic.is_some() => {
                return Err(Error::NoTopics { path: path.to_owned() });
            }
            _ => Source::of_file(path, kind, reading.room)?,
        };
        Ok(Self { path: path.to_owned(), kind, source, next: 0 })
    }

    /// Returns true if the file may hold several clouds.
    pub fn has_several(&self) -> bool {
        match &self.source {
            Source::One { .. } => false,
            Source::Scans(scans) => scans.count() > 1,
            Source::Messages(_) => true,
        }
    }

    /// The topics with clouds, as far as the file was read; none of a format without topics.
    pub fn topics(&self) -> Vec<&str> {
        match &self.source {
            Source::Messages(messages) => messages.topics().iter().map(String::as_str).collect(),
            Source::One { .. } | Source::Scans(_) => Vec::new(),
        }
    }

    /// Returns the parts of the file, as far as it was read, that are not in its clouds.
    pub fn left_out(&self) -> &LeftOut {
        &self.about().left_out
    }

    fn about(&self) -> &About {
        match &self.source {
            Source::One { about, .. } => about,
            Source::Scans(scans) => scans.about(),
            Source::Messages(messages) => messages.about(),
        }
    }

    /// The names of objects and materials, as far as the file was read and tells them.
    pub fn names(&self) -> Names<'_> {
        let about = self.about();
        Names { objects: &about.objects, materials: &about.materials }
    }
}

impl Iterator for Clouds {
    type Item = Result<PointCloud, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let next = match &mut self.source {
            Source::One { cloud, .. } => Ok(*cloud.take()?),
            Source::Scans(scans) => {
                let invalid = |fault| Error::invalid(&self.path, self.kind.name(), fault);
                scans.advance()?.map_err(invalid)
            }
            Source::Messages(messages) => messages.next()?,
        };
        Some(next.map(|mut cloud| {
            // Many writers number every scan 0.
            cloud.scan = cloud.scan.max(self.next);
            self.next = cloud.scan.saturating_add(1);
            cloud
        }))
    }
}

impl Source {
    /// The clouds of a file in a format without messages.
    fn of_file(path: &Path, kind: FileKind, room: CloudRoom) -> Result<Self, Error> {
        let mut file = CloudFile::open(path).map_err(|cause| Error::read(path, cause))?;
        let invalid = |fault| Error::invalid(path, kind.name(), fault);
        let format = match kind {
            FileKind::Written(format) => format,
            FileKind::Ptx => {
                let scans = ptx_reader::PtxScans::open(file, room).map_err(invalid)?;
                return Ok(Self::Scans(Box::new(scans)));
            }
        };
        let parsed = match format {
            Format::Pcd => pcd_reader::parse(&mut file, room),
            Format::Ply => ply_reader::parse(&mut file, room),
            Format::Las | Format::Laz => las_reader::parse(file, room),
            Format::E57 => {
                let scans = e57_reader::E57Scans::open(file, room).map_err(invalid)?;
                return Ok(Self::Scans(Box::new(scans)));
            }
            Format::Npy => npy::parse(&mut file, room),
            Format::Csv | Format::Xyz => csv_reader::parse(&mut file, room),
            Format::Kitti => kitti::parse(&mut file, kitti::Floats::of_name(path), room),
            _ => return Err(Error::unreadable(path)),
        };
        let (cloud, about) = parsed.map_err(invalid)?;
        Ok(Self::One { cloud: Some(Box::new(cloud)), about: Box::new(about) })
    }
}

/// The cloud in the file at `path`, as [`Clouds::open`] reads it; of several the first.
///
/// # Errors
/// As [`Clouds::open`].
pub fn read_cloud(path: &Path) -> Result<PointCloud, Error> {
    let no_cloud = || Error::unreadable(path);
    Clouds::open(path)?.next().ok_or_else(no_cloud)?
}

/// The cloud in the PCD file at `path`, whatever its ending.
///
/// # Errors
/// [`Error::Read`] if the file cannot be read, [`Error::Invalid`] if it is no such PCD file.
pub fn read_pcd(path: &Path) -> Result<PointCloud, Error> {
    let mut file = CloudFile::open(path).map_err(|cause| Error::read(path, cause))?;
    let parsed = pcd_reader::parse(&mut file, CloudRoom::default());
    parsed.map(|(cloud, _)| cloud).map_err(|fault| Error::invalid(path, Format::Pcd.name(), fault))
}
