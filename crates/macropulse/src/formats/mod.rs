//! Writers and readers of files: point clouds, range images, the manifest of a run.
//!
//! A file is written under a temporary name and renamed when it is whole; but one with all scans of a
//! run fills up under its own. Nothing here knows how a point came about.

mod about;
mod atomic;
mod attributes;
mod cloud_file;
mod clouds;
mod contained;
mod csv;
mod csv_reader;
mod e57;
mod e57_reader;
mod error;
mod format;
mod headings;
mod holding;
mod interleave;
mod kitti;
mod las;
mod las_reader;
mod left_out;
mod lzf;
mod manifest;
mod mcap;
mod npy;
mod number;
mod own;
#[cfg(feature = "parquet")]
mod parquet;
mod pcd;
mod pcd_reader;
mod ply;
mod ply_reader;
mod png16;
mod ptx_reader;
mod recording;
mod room;
#[cfg(test)]
mod sample;
mod table;
mod xyz;

pub use atomic::{WholeFile, clear_unfinished, prove_writable, write_atomically, write_named};
pub use clouds::{Clouds, Reading, read_cloud, read_pcd};
pub use contained::is_contained;
pub use csv::quoted;
pub use error::Error;
pub use left_out::{LeftOut, NoPoint};
pub use manifest::{
    Begun, Entries, Manifest, Named, SCHEMA_VERSION, State, Surroundings, versioned, write_manifest,
};
pub use mcap::{Message, Profile};
pub use own::{GENERATOR, Own, is_of_scan};
pub use png16::{RangeImage, read_range_png};
pub use recording::Recording;
pub use room::CloudRoom;

use crate::points::PointCloud;
use format::CloudWriter;
#[cfg(test)]
use sample::sample_cloud;
use std::path::Path;

/// A format that a point cloud can be written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// Point Cloud Data 0.7, binary. Organised, every pixel, NaN where nothing returned; where a shot
    /// may have several returns, a list of them.
    Pcd,
    /// Polygon file format, binary little endian; returns only.
    Ply,
    /// The same with names by which CloudCompare takes all attributes for scalar fields.
    PlyCloudCompare,
    /// LAS 1.4, point format 6, with extra bytes; returns only.
    Las,
    /// The same, compressed.
    Laz,
    /// ASTM E57, with attributes of ours as an extension; returns only.
    E57,
    /// NumPy, a structured array; returns only.
    Npy,
    /// Comma-separated text with units in the header; returns only.
    Csv,
    /// Text without a header: x, y, z and intensity of a return, with blanks between them.
    Xyz,
    /// Points as the KITTI data sets have them, x, y, z and reflectance as floats; returns only.
    Kitti,
    /// Apache Parquet, a column for each attribute; returns only.
    #[cfg(feature = "parquet")]
    Parquet,
    /// All scans of a run in one MCAP file, as messages of this kind.
    Mcap(Message),
    /// Range image, 16-bit grey, metres = value / 256, 0 = no return; of each pixel the return picked.
    Png,
    /// Range image, NumPy, rows × columns of floats in m, NaN = no return; of each pixel the return
    /// picked.
    RangeNpy,
}

impl Format {
    /// All formats, in the order in which they are listed to people.
    pub const ALL: &'static [Self] = &[
        Self::Pcd,
        Self::Ply,
        Self::PlyCloudCompare,
        Self::Las,
        Self::Laz,
        Self::E57,
        Self::Npy,
        Self::Csv,
        Self::Xyz,
        Self::Kitti,
        #[cfg(feature = "parquet")]
        Self::Parquet,
        Self::Mcap(Message::Ros2(Profile::Extended)),
        Self::Mcap(Message::Ros2(Profile::Velodyne)),
        Self::Mcap(Message::Ros2(Profile::Ouster)),
        Self::Mcap(Message::Ros2(Profile::Livox)),
        Self::Mcap(Message::Ros2(Profile::Autoware)),
        Self::Mcap(Message::Foxglove),
        Self::Mcap(Message::Osi),
        Self::Png,
        Self::RangeNpy,
    ];

    /// The writer of its files.
    fn writer(&self) -> &dyn CloudWriter {
        match self {
            Self::Pcd => &pcd::Pcd,
            Self::Ply => &ply::PropertyNames::Plain,
            Self::PlyCloudCompare => &ply::PropertyNames::CloudCompare,
            Self::Las => &las::Compression::None,
            Self::Laz => &las::Compression::Laz,
            Self::E57 => &e57::E57,
            Self::Npy => &npy::Npy,
            Self::Csv => &csv::Csv,
            Self::Xyz => &xyz::Xyz,
            Self::Kitti => &kitti::Kitti,
            #[cfg(feature = "parquet")]
            Self::Parquet => &parquet::Parquet,
            Self::Mcap(message) => message,
            Self::Png => &png16::Png,
            Self::RangeNpy => &npy::RangeNpy,
        }
    }
}

/// Names of the object and material numbers of a scene. Numbers without a name are written as numbers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Names<'a> {
    /// Names of the scene's objects, by number.
    pub objects: &'a [String],
    /// Names of the scene's materials, by number.
    pub materials: &'a [String],
}

/// Writes `cloud` to `path`, as [`write_named`] does. Truth is written when the cloud has it and the format can hold it. A
/// format with all scans of a run in one file has this one alone; see [`Recording`].
///
/// # Errors
/// [`Error::Uneven`] if a column of the cloud has not one entry per return or pixel, and [`Error::TooLarge`]
/// if it has too many pixels to number. [`Error::Write`] if the file cannot be written; an older file of that
/// name is then untouched.
pub fn write_cloud(
    format: Format,
    cloud: &PointCloud,
    names: &Names,
    path: &Path,
) -> Result<(), Error> {
    attributes::check_even(cloud)?;
    write_named(path, |out| format.writer().write(cloud, names, out))
}

/// Writes the returns of `cloud` as lines of [`Format::Csv`], for a stream of parts: only the first part has
/// the line of names before it.
///
/// # Errors
/// If `out` cannot be written to.
pub fn write_csv_lines(
    cloud: &PointCloud,
    is_first: bool,
    out: &mut dyn std::io::Write,
) -> std::io::Result<()> {
    let mut lines = Vec::new();
    csv::Csv.write(cloud, &Names::default(), &mut lines)?;
    let behind = lines.iter().position(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    out.write_all(if is_first { &lines } else { &lines[behind..] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cloud_with_a_short_column_is_refused() {
        let mut cloud = sample_cloud();
        cloud.margin.pop();
        let path = std::env::temp_dir().join("never-written.pcd");
        let error = write_cloud(Format::Pcd, &cloud, &Names::default(), &path).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the point cloud cannot be written: column `margin` has 4 entries, its returns need 5"
        );
        assert!(!path.exists());
    }
}
