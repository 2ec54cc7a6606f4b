//! Clouds from files, whatever their format.

use super::about::About;
use super::mcap::Messages;
use super::{
    CloudRoom, Error, Format, LeftOut, Names, csv_reader, e57, kitti, las_reader, npy, pcd_reader,
    ply_reader,
};
use crate::opened;
use crate::points::PointCloud;
use std::io::{self, Read};
use std::path::Path;

/// Most bytes of a file with one cloud, which is read at once.
const MOST_BYTES: u64 = 8 << 30;

/// The clouds of a file, one after the other: many of an MCAP file, one of any other.
pub struct Clouds(Source);

enum Source {
    One { cloud: Option<Box<PointCloud>>, about: About },
    Many(Box<Messages>),
}

impl Clouds {
    /// Opens the file at `path`, whose ending says what it is: `pcd`, `ply`, `las`, `laz`, `e57`,
    /// `npy`, `csv`, `xyz`, `txt`, `pts`, `bin` (KITTI, nuScenes) or `mcap` (`PointCloud2` of ROS 2).
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
        Self::open_within(path, CloudRoom::default())
    }

    /// The same with a limit of memory. [`Clouds::open`] allows four fifths of what the machine has.
    ///
    /// # Errors
    /// As [`Clouds::open`], and if they take more.
    pub fn open_within(path: &Path, room: CloudRoom) -> Result<Self, Error> {
        let Some(format) = format_of(path) else {
            // A name that is misspelt is no format that is unknown.
            std::fs::metadata(path).map_err(|cause| Error::read(path, cause))?;
            return Err(Error::unreadable(path));
        };
        if let Format::Mcap(_) = format {
            return Ok(Self(Source::Many(Box::new(Messages::open(path, room)?))));
        }
        let size = std::fs::metadata(path).map_err(|cause| Error::read(path, cause))?.len();
        let room = room.beside(size).map_err(|fault| Error::invalid(path, format, fault))?;
        let read = || whole(path, format).map_err(|cause| Error::read(path, cause));
        let parsed = match format {
            Format::Pcd => pcd_reader::parse(&read()?, room),
            Format::Ply => ply_reader::parse(&read()?, room),
            Format::Las | Format::Laz => las_reader::parse(read()?, room),
            Format::E57 => e57::parse(read()?, room),
            Format::Npy => npy::parse(&read()?, room),
            Format::Csv => csv_reader::parse(&read()?, room),
            Format::Kitti => kitti::parse(&read()?, kitti::Floats::of_name(path), room),
            _ => return Err(Error::unreadable(path)),
        };
        let (cloud, about) = parsed.map_err(|fault| Error::invalid(path, format, fault))?;
        Ok(Self(Source::One { cloud: Some(Box::new(cloud)), about }))
    }

    /// What of the file, as far as it was read, is not in its clouds.
    pub fn left_out(&self) -> &LeftOut {
        &self.about().left_out
    }

    fn about(&self) -> &About {
        match &self.0 {
            Source::One { about, .. } => about,
            Source::Many(messages) => messages.about(),
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
        match &mut self.0 {
            Source::One { cloud, .. } => cloud.take().map(|cloud| Ok(*cloud)),
            Source::Many(messages) => messages.next(),
        }
    }
}

/// The format that the file at `path` is read as, by its ending.
fn format_of(path: &Path) -> Option<Format> {
    let ending = path.extension()?.to_str()?;
    match ending.to_ascii_lowercase().as_str() {
        "xyz" | "txt" | "pts" => Some(Format::Csv),
        _ => Format::of_extension(ending),
    }
}

/// Bytes of a file by which it is told whether it may be of its format.
const BEGINNING: usize = 4096;

/// All bytes of the file at `path`; or its beginning, if that is none of a file of this format.
fn whole(path: &Path, format: Format) -> io::Result<Vec<u8>> {
    let mut begins = Vec::with_capacity(BEGINNING);
    opened::file(path, MOST_BYTES)?.take(BEGINNING as u64).read_to_end(&mut begins)?;
    if may_begin(&begins, format) { opened::bytes(path, MOST_BYTES) } else { Ok(begins) }
}

/// Whether a file of this format may begin so.
fn may_begin(bytes: &[u8], format: Format) -> bool {
    match format {
        Format::Las | Format::Laz => bytes.starts_with(b"LASF"),
        Format::E57 => bytes.starts_with(b"ASTM-E57"),
        Format::Npy => bytes.starts_with(b"\x93NUMPY"),
        Format::Ply => bytes.starts_with(b"ply"),
        // Text at first.
        Format::Pcd | Format::Csv => !bytes.starts_with(b"\0"),
        _ => true,
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
    let bytes = opened::bytes(path, MOST_BYTES).map_err(|cause| Error::read(path, cause))?;
    let parsed = pcd_reader::parse(&bytes, CloudRoom::default());
    parsed.map(|(cloud, _)| cloud).map_err(|fault| Error::invalid(path, Format::Pcd, fault))
}
