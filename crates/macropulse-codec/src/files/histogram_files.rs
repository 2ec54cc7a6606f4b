//! Histograms: the counts of each shot, shot by shot.
//!
//! A record is one histogram with the number of its shot.

use std::io::{self, Read, Write};

use super::by_shot::ByShot;
use super::head::{self, HEADER};
use super::source::{Source, number};
use super::{Digest, Error, Form, LONGEST_FS, What};
use crate::histograms::Histograms;

const MAGIC: &[u8; 8] = b"MPHISTO\0";

/// Bytes before the counts of a histogram.
const RECORD: usize = 16;

/// Bins of a histogram at most: 256 KiB.
const MOST_BINS: u32 = 1 << 16;

/// Bytes of a count.
const COUNT: usize = size_of::<u32>();

/// The header of a file of histograms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HistogramHeader {
    /// Width of a bin, fs.
    pub bin_fs: i64,
    /// Beginning of the first bin after the firing of the shot, fs.
    pub offset_fs: i64,
    /// Bins of a histogram, 1 to 65536.
    pub bins: u32,
    /// The sensor that they are of, if it is known.
    pub digest: Option<Digest>,
    /// Histograms in the file, if it is known.
    pub count: Option<u64>,
}

/// The histogram of one shot.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Histogram {
    /// Absolute id of the shot.
    pub shot: u64,
    /// Laser pulses that are accumulated; 0 where their number is not known.
    pub cycles: u32,
    /// Photons counted in each bin.
    pub counts: Vec<u32>,
}

/// Reads histograms one by one.
#[derive(Debug)]
pub struct HistogramReader<R> {
    records: ByShot<R>,
    header: HistogramHeader,
}

impl<R: Read> HistogramReader<R> {
    /// Reads the header of the histograms of a sensor whose own would be `wanted`; its digest and count
    /// are not looked at.
    ///
    /// # Errors
    /// If it cannot be read, is of no version that is known, or has bins that no file has. Also if it is of
    /// another sensor: bins of another width, at another time or of another number.
    pub fn new(reader: R, wanted: &HistogramHeader) -> Result<Self, Error> {
        let mut source = Source::new(reader, What::Histograms)?;
        if source.form == Form::Text {
            return source.refuse("is text: histograms are read in their binary form alone");
        }
        let header = header_of(&head::binary(&mut source)?);
        if let Some(why) = impossible(&header).or_else(|| unlike(&header, wanted)) {
            return source.refuse(why);
        }
        let length = RECORD + COUNT * header.bins as usize;
        let records = ByShot::new(source, header.count, length, ["the histogram", "histograms"]);
        Ok(Self { records, header })
    }

    /// Returns the header of the file.
    pub fn header(&self) -> &HistogramHeader {
        &self.header
    }

    /// An error about what was read last.
    pub(super) fn refuse<T>(&self, message: impl Into<String>) -> Result<T, Error> {
        self.records.refuse(message)
    }

    /// The next histogram; `None` behind the last one.
    ///
    /// # Errors
    /// If it cannot be read, does not come after those before it, or if the file ends too early.
    pub fn next_histogram(&mut self) -> Result<Option<Histogram>, Error> {
        let Some((shot, bytes)) = self.records.next()? else { return Ok(None) };
        let (cycles, blank) = (number!(bytes, 8, u32), number!(bytes, 12, u32));
        let counts = bytes[RECORD..].chunks_exact(COUNT).map(|count| number!(count, 0, u32));
        let histogram = Histogram { shot, cycles, counts: counts.collect() };
        match blank {
            0 => Ok(Some(histogram)),
            _ => self
                .refuse("a histogram has four bytes of 0 behind its cycles: is the file damaged?"),
        }
    }
}

fn header_of(bytes: &[u8; HEADER]) -> HistogramHeader {
    HistogramHeader {
        bin_fs: number!(bytes, 24, i64),
        offset_fs: number!(bytes, 48, i64),
        bins: number!(bytes, 56, u32),
        digest: head::digest(bytes, 32),
        count: head::known(number!(bytes, 16, u64)),
    }
}

/// Why no histograms can be like this.
fn impossible(header: &HistogramHeader) -> Option<String> {
    let HistogramHeader { bin_fs, offset_fs, bins, .. } = *header;
    if !(1..=MOST_BINS).contains(&bins) {
        return Some(format!("histograms of {bins} bins, where they have 1 to {MOST_BINS}"));
    }
    if !(1..=LONGEST_FS / i64::from(MOST_BINS)).contains(&bin_fs) {
        return Some(format!("bins of {bin_fs} fs, where they are 1 fs to 137 s wide"));
    }
    (offset_fs.unsigned_abs() > LONGEST_FS.unsigned_abs())
        .then(|| format!("the first bin begins {offset_fs} fs after firing, more than 9000 s"))
}

/// Why a `header` is not of the sensor whose own would be `wanted`.
fn unlike(header: &HistogramHeader, wanted: &HistogramHeader) -> Option<String> {
    let HistogramHeader { bin_fs, offset_fs, bins, .. } = *header;
    if bin_fs != wanted.bin_fs {
        let own = wanted.bin_fs;
        return Some(format!("bins of {bin_fs} fs, where those of the sensor are of {own} fs"));
    }
    if offset_fs != wanted.offset_fs {
        let own = wanted.offset_fs;
        return Some(format!(
            "the first bin begins {offset_fs} fs after firing, where that of the sensor does after {own} fs"
        ));
    }
    (bins != wanted.bins).then(|| {
        format!("histograms of {bins} bins, where those of the sensor have {}", wanted.bins)
    })
}

/// Writes histograms.
#[derive(Debug)]
pub struct HistogramWriter<W> {
    out: W,
    bytes: Vec<u8>,
}

impl<W: Write> HistogramWriter<W> {
    /// Writes the header. If it has a count, this number of histograms must follow.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(mut out: W, header: &HistogramHeader) -> io::Result<Self> {
        out.write_all(&bytes_of(header))?;
        Ok(Self::behind(out))
    }

    /// A writer of histograms behind a header that is written already. A header is as long whatever its
    /// count, so that it may be written again when that is known.
    pub fn behind(out: W) -> Self {
        Self { out, bytes: Vec::new() }
    }

    /// Writes `histograms`. The first one belongs to the shot with the absolute id `first`.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn write(&mut self, histograms: &Histograms, first: u64) -> io::Result<()> {
        for (shot, cycles) in histograms.cycles.iter().enumerate() {
            self.bytes.clear();
            self.bytes.extend(first.saturating_add(shot as u64).to_le_bytes());
            self.bytes.extend(cycles.to_le_bytes());
            self.bytes.extend([0; 4]);
            self.bytes.extend(histograms.of(shot).iter().flat_map(|count| count.to_le_bytes()));
            self.out.write_all(&self.bytes)?;
        }
        Ok(())
    }
}

fn bytes_of(header: &HistogramHeader) -> [u8; HEADER] {
    let mut bytes = head::begun(MAGIC, header.count);
    bytes[24..32].copy_from_slice(&header.bin_fs.to_le_bytes());
    if let Some(Digest(digest)) = header.digest {
        bytes[32..48].copy_from_slice(&digest);
    }
    bytes[48..56].copy_from_slice(&header.offset_fs.to_le_bytes());
    bytes[56..60].copy_from_slice(&header.bins.to_le_bytes());
    bytes
}
