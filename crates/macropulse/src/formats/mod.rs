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
mod table;

pub use atomic::{WholeFile, clear_unfinished, prove_writable, write_atomically, write_named};
pub use clouds::{Clouds, Reading, read_cloud, read_pcd};
pub use contained::is_contained;
pub use csv::quoted;
pub use error::Error;
pub use format::Format;
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
use std::path::Path;

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
    write_named(path, |out| write_even(format, (cloud, names), out))
}

/// Writes a cloud whose columns are even.
fn write_even(
    format: Format,
    (cloud, names): (&PointCloud, &Names),
    out: &mut dyn std::io::Write,
) -> std::io::Result<()> {
    match format {
        Format::Pcd => pcd::write(cloud, names, out),
        Format::Ply => ply::write(cloud, names, ply::Called::AsTheyAre, out),
        Format::PlyCloudCompare => ply::write(cloud, names, ply::Called::Scalars, out),
        Format::Las => las::write(cloud, names, false, out),
        Format::Laz => las::write(cloud, names, true, out),
        Format::E57 => e57::write(cloud, names, out),
        Format::Npy => npy::write(cloud, out),
        Format::Csv => csv::write(cloud, names, out),
        Format::Kitti => kitti::write(cloud, out),
        #[cfg(feature = "parquet")]
        Format::Parquet => parquet::write(cloud, names, out),
        Format::Mcap(message) => mcap::write(message, cloud, names, out),
        Format::Png => png16::write(cloud, out),
        Format::RangeNpy => npy::write_range(cloud, out),
    }
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
    csv::write(cloud, &Names::default(), &mut lines)?;
    let behind = lines.iter().position(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    out.write_all(if is_first { &lines } else { &lines[behind..] })
}

/// A cloud of 2 × 3 pixels, one of them empty, for the tests of all formats.
#[cfg(test)]
fn sample_cloud() -> PointCloud {
    use crate::points::{NO_OBJECT, Outcome, Pick, Surfaces, Truth, Viewpoint};
    let nan = f32::NAN;
    let fired_ns = vec![0.0, 40.946_5, 81.893, 122.84, 163.786, 204.732_5];
    PointCloud {
        scan: 3,
        rows: 2,
        columns: 3,
        viewpoint: Viewpoint { position: [1.5, -2.0, 0.25], turn: [0.6, 0.0, 0.0, -0.8] },
        returns_per_shot: 1,
        pick: Pick::Strongest,
        row: vec![0, 0, 1, 1, 1],
        column: vec![0, 1, 0, 1, 2],
        return_number: vec![1; 5],
        number_of_returns: vec![1; 5],
        x: vec![30.0, 30.5, 29.0, 31.25, 28.0],
        y: vec![1.0, 0.0, 1.5, 0.25, -1.0],
        z: vec![0.5, 0.5, -0.5, -0.25, -0.75],
        intensity: vec![0.8, 0.1, 0.3, 1.0, 0.0],
        range: vec![30.02, 30.5, 29.04, 31.26, 28.03],
        time_ns: [0, 1, 3, 4, 5].map(|pixel| fired_ns[pixel]).to_vec(),
        peak: vec![174, 170, 60, 174, 58],
        marks: vec![174, 174, 174, 174, 58],
        margin: vec![80, 70, 3, 81, 20],
        photons: vec![nan; 5],
        saturated: vec![false; 5],
        fired_ns,
        truth: Truth {
            returns: Surfaces {
                range: vec![30.02, 30.5, 40.0, 31.26, nan],
                object: vec![0, 0, 1, 0, NO_OBJECT],
                material: vec![1, 0, 2, 0, NO_OBJECT],
                cosine: vec![1.0, 0.5, 0.0, 0.999_999_9, nan],
                outcome: vec![
                    Outcome::Right,
                    Outcome::Near,
                    Outcome::Wrong,
                    Outcome::Right,
                    Outcome::False,
                ],
            },
            pixels: Surfaces {
                range: vec![30.02, 30.5, nan, 40.0, 31.26, nan],
                object: vec![0, 0, NO_OBJECT, 1, 0, NO_OBJECT],
                material: vec![1, 0, NO_OBJECT, 2, 0, NO_OBJECT],
                cosine: vec![1.0, 0.5, nan, 0.0, 0.999_999_9, nan],
                outcome: vec![
                    Outcome::Right,
                    Outcome::Near,
                    Outcome::Empty,
                    Outcome::Wrong,
                    Outcome::Right,
                    Outcome::False,
                ],
            },
            ..Truth::default()
        },
        ..PointCloud::default()
    }
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
