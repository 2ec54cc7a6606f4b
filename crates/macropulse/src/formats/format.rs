//! The formats a point cloud can be written in, and what they are called.

use super::Error;
use super::mcap::{Message, Profile};

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

    /// Name on the command line and in scenario files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pcd => "pcd",
            Self::Ply => "ply",
            Self::PlyCloudCompare => "ply-cloudcompare",
            Self::Las => "las",
            Self::Laz => "laz",
            Self::E57 => "e57",
            Self::Npy => "npy",
            Self::Csv => "csv",
            Self::Kitti => "kitti",
            #[cfg(feature = "parquet")]
            Self::Parquet => "parquet",
            Self::Mcap(Message::Ros2(Profile::Extended)) => "mcap",
            Self::Mcap(Message::Ros2(Profile::Velodyne)) => "mcap-velodyne",
            Self::Mcap(Message::Ros2(Profile::Ouster)) => "mcap-ouster",
            Self::Mcap(Message::Ros2(Profile::Livox)) => "mcap-livox",
            Self::Mcap(Message::Ros2(Profile::Autoware)) => "mcap-autoware",
            Self::Mcap(Message::Foxglove) => "mcap-foxglove",
            Self::Mcap(Message::Osi) => "mcap-osi",
            Self::Png => "png",
            Self::RangeNpy => "range-npy",
        }
    }

    /// Returns the ending of the names of its files, after the dot. The program that opens a file goes by it,
    /// so formats may share one.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Kitti => "bin",
            Self::PlyCloudCompare => "ply",
            Self::Mcap(_) => "mcap",
            Self::RangeNpy => "npy",
            other => other.name(),
        }
    }

    /// Name of the file with scan number `scan`, another one for every format.
    pub fn file_name(self, scan: u64) -> String {
        let extension = self.extension();
        match self {
            Self::Png | Self::RangeNpy => format!("range-{scan:06}.{extension}"),
            Self::PlyCloudCompare => format!("scan-{scan:06}-cloudcompare.{extension}"),
            Self::Mcap(_) => format!("{}.{extension}", self.name().replace("mcap", "scans")),
            _ => format!("scan-{scan:06}.{extension}"),
        }
    }

    /// Returns true if all scans of a run go into one file.
    pub fn is_of_run(self) -> bool {
        matches!(self, Self::Mcap(_))
    }

    /// The format called `name`, in either case.
    ///
    /// # Errors
    /// [`Error::UnknownFormat`], which names the nearest known format.
    pub fn parse(name: &str) -> Result<Self, Error> {
        let lower = name.trim().to_lowercase();
        let known = Self::ALL.iter().find(|format| format.name() == lower);
        known.copied().ok_or_else(|| Error::unknown_format(name, &lower))
    }

    /// The first format whose files end in `extension`, in either case.
    pub fn of_extension(extension: &str) -> Option<Self> {
        let lower = extension.to_lowercase();
        Self::ALL.iter().find(|format| format.extension() == lower).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_format_is_found_by_name_in_either_case() {
        for &format in Format::ALL {
            assert_eq!(Format::parse(format.name()).unwrap(), format);
        }
        assert_eq!(Format::parse(" PCD ").unwrap(), Format::Pcd);
    }

    #[test]
    fn formats_share_neither_a_name_nor_the_name_of_a_file() {
        for (at, one) in Format::ALL.iter().enumerate() {
            for other in &Format::ALL[at + 1..] {
                assert_ne!(one.name(), other.name());
                assert_ne!(one.file_name(7), other.file_name(7));
            }
        }
        assert_eq!(Format::Pcd.file_name(7), "scan-000007.pcd");
        assert_eq!(Format::Png.file_name(1_234_567), "range-1234567.png");
        assert_eq!(Format::parse("mcap").unwrap().file_name(7), "scans.mcap");
        assert_eq!(Format::parse("mcap-osi").unwrap().file_name(7), "scans-osi.mcap");
    }

    #[test]
    fn an_ending_names_a_format() {
        assert_eq!(Format::of_extension("LAZ"), Some(Format::Laz));
        assert_eq!(Format::of_extension("npy"), Some(Format::Npy));
        assert_eq!(Format::of_extension("bin"), Some(Format::Kitti));
        assert_eq!(Format::of_extension("docx"), None);
    }

    #[test]
    fn a_misspelt_format_names_its_neighbour() {
        let told = Format::parse("pdc").unwrap_err().to_string();
        assert!(
            told.starts_with("unknown format `pdc`; did you mean `pcd`? known: pcd, ply, ply-cl")
        );
        let told = Format::parse("holograms").unwrap_err().to_string();
        assert!(told.starts_with("unknown format `holograms`; known: pcd, ply,"), "{told}");
    }
}
