//! Writers, and readers to check them by: point clouds, range images, the manifest of a run.
//!
//! Every file is written under a temporary name and renamed when it is whole. Nothing here knows
//! how a point came about.

mod atomic;
mod attributes;
mod csv;
mod error;
mod manifest;
mod pcd;
mod pcd_reader;
mod ply;
mod png16;

pub use atomic::write_atomically;
pub use csv::quoted;
pub use error::Error;
pub use manifest::{Begun, Entries, Manifest, Named, SCHEMA_VERSION, Surroundings, versioned};
pub use pcd_reader::read_pcd;
pub use png16::{RangeImage, read_range_png};

use crate::points::PointCloud;
use std::path::Path;

/// The formats a point cloud can be written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// Point Cloud Data 0.7, binary. Organised, every pixel, NaN where nothing returned; where a shot
    /// may have several returns, a list of them.
    Pcd,
    /// Polygon file format, binary little endian; returns only.
    Ply,
    /// Comma-separated text with units in the header; returns only.
    Csv,
    /// Range image, 16-bit grey, metres = value / 256, 0 = no return; of each pixel the return picked.
    Png,
}

impl Format {
    /// All formats, in the order in which they are listed to people.
    pub const ALL: [Self; 4] = [Self::Pcd, Self::Ply, Self::Csv, Self::Png];

    /// Name on the command line and in scenario files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pcd => "pcd",
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Png => "png",
        }
    }

    /// What the names of its files end in, after the dot: the program that opens a file goes by it,
    /// so formats may share one.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Pcd => "pcd",
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Png => "png",
        }
    }

    /// Name of the file of scan number `scan`, another one for every format.
    pub fn file_name(self, scan: u64) -> String {
        let kind = match self {
            Self::Png => "range",
            Self::Pcd | Self::Ply | Self::Csv => "scan",
        };
        format!("{kind}-{scan:06}.{}", self.extension())
    }

    /// The format called `name`, in either case.
    ///
    /// # Errors
    /// [`Error::UnknownFormat`], which names the nearest known format.
    pub fn parse(name: &str) -> Result<Self, Error> {
        let lower = name.trim().to_lowercase();
        Self::ALL
            .into_iter()
            .find(|format| format.name() == lower)
            .ok_or_else(|| Error::unknown_format(name, &lower))
    }
}

/// What the object and material numbers of a scene are called. Numbers without a name are written
/// as numbers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Names<'a> {
    /// Names of the scene's objects, by number.
    pub objects: &'a [String],
    /// Names of the scene's materials, by number.
    pub materials: &'a [String],
}

/// Writes `cloud` to `path`. Truth is written when the cloud has it.
///
/// # Errors
/// [`Error::Uneven`] if a column of the cloud has not one entry per return or pixel, [`Error::TooLarge`] if it
/// has too many pixels to number, [`Error::Write`] if the file cannot be written; then an older file of that name is untouched.
pub fn write_cloud(
    format: Format,
    cloud: &PointCloud,
    names: &Names,
    path: &Path,
) -> Result<(), Error> {
    attributes::check_even(cloud)?;
    match format {
        Format::Pcd => write_atomically(path, |out| pcd::write(cloud, names, out)),
        Format::Ply => write_atomically(path, |out| ply::write(cloud, names, out)),
        Format::Csv => write_atomically(path, |out| csv::write(cloud, names, out)),
        Format::Png => write_atomically(path, |out| png16::write(cloud, out)),
    }
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
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_format_is_found_by_name_in_either_case() {
        for format in Format::ALL {
            assert_eq!(Format::parse(format.name()).unwrap(), format);
        }
        assert_eq!(Format::parse(" PCD ").unwrap(), Format::Pcd);
    }

    #[test]
    fn formats_share_neither_a_name_nor_the_name_of_a_file() {
        for (at, one) in Format::ALL.into_iter().enumerate() {
            for other in &Format::ALL[at + 1..] {
                assert_ne!(one.name(), other.name());
                assert_ne!(one.file_name(7), other.file_name(7));
            }
        }
        assert_eq!(Format::Pcd.file_name(7), "scan-000007.pcd");
        assert_eq!(Format::Png.file_name(1_234_567), "range-1234567.png");
    }

    #[test]
    fn a_misspelt_format_names_its_neighbour() {
        assert_eq!(
            Format::parse("pdc").unwrap_err().to_string(),
            "unknown format `pdc`; did you mean `pcd`? known: pcd, ply, csv, png"
        );
        assert_eq!(
            Format::parse("holograms").unwrap_err().to_string(),
            "unknown format `holograms`; known: pcd, ply, csv, png"
        );
    }

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
