//! The errors of reading and writing a file, and whose fault each is.

use super::Format;
use crate::told;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file was not written or read. Each message is one whole sentence; the cause is part of
/// it, so that printing a chain of errors does not say it twice.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The world would not take the file.
    #[error("cannot write {}: {}", path.display(), reason(cause))]
    Write {
        /// The file that was wanted.
        path: PathBuf,
        /// The error of the operating system.
        cause: io::Error,
    },
    /// The world would not give the file.
    #[error("cannot read {}: {}", path.display(), reason(cause))]
    Read {
        /// The file that was wanted.
        path: PathBuf,
        /// The error of the operating system.
        cause: io::Error,
    },
    /// The file is not what its name promises.
    #[error("{} is not a {format} file that can be read: {fault}", path.display())]
    Invalid {
        /// The faulty file.
        path: PathBuf,
        /// Name of the format it was read as.
        format: &'static str,
        /// The fault, its place, and what would be right.
        fault: String,
    },
    /// The caller's cloud is not rectangular.
    #[error(
        "the point cloud cannot be written: column `{column}` has {found} entries, its {of} need {needed}"
    )]
    Uneven {
        /// Name of the column.
        column: &'static str,
        /// Its entries.
        found: usize,
        /// Entries it should have.
        needed: usize,
        /// The things that should have one entry each: returns or pixels.
        of: &'static str,
    },
    /// The caller's cloud has more rows or columns than files can number.
    #[error(
        "the point cloud cannot be written: it has {rows} × {columns} pixels, but rows and columns are numbered in 16 bits, 65536 at most"
    )]
    TooLarge {
        /// Rows of the cloud.
        rows: usize,
        /// Columns of the cloud.
        columns: usize,
    },
    /// Clouds are not read from such files.
    #[error(
        "{}: no point cloud is read from such a file; read are files that end in .pcd, .ply, .las, .laz, .e57, .npy, .csv, .xyz, .txt, .pts, .ptx, .bin (KITTI, nuScenes) and .mcap (ROS 2)",
        path.display()
    )]
    Unreadable {
        /// The file.
        path: PathBuf,
    },
    /// A topic was chosen of a file without topics.
    #[error("{}: has no topics; only MCAP files have them: leave the topic out", path.display())]
    NoTopics {
        /// The file.
        path: PathBuf,
    },
    /// No format is called so.
    #[error("unknown format `{name}`;{suggestion} known: {}", known().join(", "))]
    UnknownFormat {
        /// The name as given.
        name: String,
        /// The nearest known name as a question, or nothing.
        suggestion: String,
    },
}

impl Error {
    pub(super) fn write(path: &Path, cause: io::Error) -> Self {
        Self::Write { path: path.to_owned(), cause }
    }

    pub(super) fn read(path: &Path, cause: io::Error) -> Self {
        Self::Read { path: path.to_owned(), cause }
    }

    /// Returns an error with the fault in one line, whatever a name in the file holds.
    pub(super) fn invalid(path: &Path, format: &'static str, fault: impl Into<String>) -> Self {
        let fault = fault.into().replace(char::is_control, " ");
        Self::Invalid { path: path.to_owned(), format, fault }
    }

    pub(super) fn unreadable(path: &Path) -> Self {
        Self::Unreadable { path: path.to_owned() }
    }

    pub(super) fn unknown_format(name: &str, lower: &str) -> Self {
        let nearest = crate::names::nearest(lower, known());
        let suggestion =
            nearest.map(|known| format!(" did you mean `{known}`?")).unwrap_or_default();
        Self::UnknownFormat { name: name.to_owned(), suggestion }
    }
}

fn known() -> Vec<&'static str> {
    Format::ALL.iter().map(|format| format.name()).collect()
}

/// The cause in words that also say what to do, where we know.
fn reason(cause: &io::Error) -> String {
    let remedy = match cause.kind() {
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; choose a place that is open to you"
        }
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "; make room, or choose another place"
        }
        _ => "",
    };
    told::unwritable(cause) + remedy
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::error::Error as _;

    #[test]
    fn the_cause_is_said_once() {
        let error = Error::write(Path::new("a/b.pcd"), io::ErrorKind::PermissionDenied.into());
        assert_eq!(
            error.to_string(),
            "cannot write a/b.pcd: permission denied; choose a place that is open to you"
        );
        assert!(error.source().is_none());
        let full = Error::write(Path::new("a.pcd"), io::ErrorKind::StorageFull.into());
        assert!(
            full.to_string().ends_with(": the disk is full; make room, or choose another place")
        );
    }
}
