//! Shot logs and records as files and streams: the seam at which recorded hardware takes the place of a simulation.
//!
//! Shots and ticks have two forms that hold the same. **Text** has lines of comma-separated whole numbers
//! under a line that says what they are. **Binary** has little-endian records under a header. A reader tells
//! them apart by their first byte. All other records are binary. `docs/formats.md` has them byte by byte.
//!
//! Readers and writers go over any [`Read`](std::io::Read) and [`Write`](std::io::Write), record by record,
//! and keep none. [`Stream`] reads shots and their record at once and cuts them into bands to be decoded. An
//! error names the line or the byte that is wrong.

mod at_hand;
mod beats;
mod head;
mod histograms;
mod records;
mod sample_files;
mod shots;
mod source;
mod stream;
mod taps;
mod tick_files;

use std::fmt;
use std::io;

use crate::record::RecordKind;

pub use head::HEADER;
pub use records::{
    RecordColumn, RecordHeader, RecordReader, RecordValues, RecordWriter, ShotRecord,
};
pub use sample_files::{SampleBlock, SampleHeader, SampleReader, SampleWriter};
pub use shots::{Limits, Shot, ShotHeader, ShotReader, ShotWriter};
pub use stream::Stream;
pub use tick_files::{TickHeader, TickReader, TickWriter};

/// The version of all these files that is written, and the only one that is read.
pub const VERSION: u32 = 1;

/// The longest time, fs, from the beginning of the first scan to a shot or a tick, before it or after it.
pub const LONGEST_FS: i64 = 9_000_000_000_000_000_000;

/// Stands in a binary header for a number that is not known.
const UNKNOWN: u64 = u64::MAX;

/// How a file holds its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Little-endian records.
    Binary,
    /// Lines of comma-separated numbers.
    Text,
}

/// A digest of the sensor of a shot log, ticks or samples: a hash of all that is sent and how it is timed.
/// Logs of sensors that differ in it are not decoded by each other's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest(pub [u8; 16]);

impl Digest {
    /// The digest of 32 hexadecimal digits.
    pub fn parse(text: &str) -> Option<Self> {
        let is_hex = text.len() == 32 && text.bytes().all(|digit| digit.is_ascii_hexdigit());
        let number = is_hex.then(|| u128::from_str_radix(text, 16).ok())??;
        Some(Self(number.to_be_bytes()))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", u128::from_be_bytes(self.0))
    }
}

/// A place in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A line, from 1.
    Line(u64),
    /// A byte, from 0.
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// Which of the files an error is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// The shot log.
    Shots,
    /// The record beside it.
    Record(RecordKind),
}

/// Why a file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The system did not give it.
    #[error("cannot be read: {cause}")]
    Read {
        /// Which file.
        what: What,
        /// Why.
        cause: io::Error,
    },
    /// It says something that cannot be.
    #[error("{place}: {message}")]
    Content {
        /// Which file.
        what: What,
        /// Where.
        place: Place,
        /// The fault, and the remedy.
        message: String,
    },
}

impl Error {
    /// Which of the files it is about.
    pub fn what(&self) -> What {
        match self {
            Self::Read { what, .. } | Self::Content { what, .. } => *what,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digest_is_32_digits() {
        let text = "00112233445566778899aabbccddeeff";
        assert_eq!(Digest::parse(text).unwrap().to_string(), text);
        assert_eq!(Digest::parse(text).unwrap().0[..3], [0x00, 0x11, 0x22]);
        assert_eq!(Digest::parse(&text[1..]), None);
        assert_eq!(Digest::parse("+0112233445566778899aabbccddeeff"), None);
    }
}
