//! Names and endings of the formats that a point cloud can be written in.

use super::attributes::Attribute;
use super::holding::{Further, Holding};
use super::{Error, Format, Names};
use crate::points::PointCloud;
use std::io;

/// A format of files: its names, its contents, and the writer of one file. Each format implements it in a file of its own.
pub(super) trait CloudWriter {
    /// Name on the command line and in scenario files.
    fn name(&self) -> &'static str;

    /// Ending of the names of its files, after the dot. The program that opens a file goes by it, so formats may
    /// share one.
    fn extension(&self) -> &'static str {
        self.name()
    }

    /// Other endings by which a file asks for this format.
    fn other_extensions(&self) -> &'static [&'static str] {
        &[]
    }

    /// Name of the file with scan number `scan`, another one for every format.
    fn file_name(&self, scan: u64) -> String {
        format!("scan-{scan:06}.{}", self.extension())
    }

    /// Returns true if all scans of a run go into one file.
    fn is_of_run(&self) -> bool {
        false
    }

    /// Returns true if it has the ranges of an image of pixels, and no points.
    fn is_range_image(&self) -> bool {
        false
    }

    /// Says how it holds an attribute of a point.
    fn holds(&self, _attribute: Attribute) -> Holding {
        Holding::Whole
    }

    /// Returns true if it holds `further`, which is no attribute of a point.
    fn holds_further(&self, further: Further) -> bool;

    /// Writes a cloud whose columns are even.
    fn write(&self, cloud: &PointCloud, names: &Names, out: &mut dyn io::Write) -> io::Result<()>;
}

impl Format {
    /// Name on the command line and in scenario files.
    pub fn name(self) -> &'static str {
        self.writer().name()
    }

    /// Returns the ending of the names of its files, after the dot. Formats may share one.
    pub fn extension(self) -> &'static str {
        self.writer().extension()
    }

    /// Returns true if a file that ends in `extension`, in either case, can be one of this format.
    pub fn has_extension(self, extension: &str) -> bool {
        let writer = self.writer();
        let mut all = writer.other_extensions().iter().copied().chain([writer.extension()]);
        all.any(|known| known.eq_ignore_ascii_case(extension))
    }

    /// Name of the file with scan number `scan`, another one for every format.
    pub fn file_name(self, scan: u64) -> String {
        self.writer().file_name(scan)
    }

    /// Returns true if all scans of a run go into one file.
    pub fn is_of_run(self) -> bool {
        self.writer().is_of_run()
    }

    /// Returns true if it has the ranges of an image of pixels, and no points.
    pub fn is_range_image(self) -> bool {
        self.writer().is_range_image()
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
        Self::ALL.iter().find(|format| format.has_extension(extension)).copied()
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
        assert_eq!(Format::of_extension("txt"), Some(Format::Xyz));
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
