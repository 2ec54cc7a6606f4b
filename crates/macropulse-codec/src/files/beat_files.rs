//! Beats: the peaks of the spectra of each shot, shot by shot.

use std::io::{self, Read, Write};

use super::by_shot::ByShot;
use super::head::{self, HEADER};
use super::source::{Source, number};
use super::{Digest, Error, Form, What};
use crate::{Beats, Peak};

const MAGIC: &[u8; 8] = b"MPBEATS\0";

/// Bytes before the peaks of a shot: its id.
const RECORD: usize = 8;

/// Ramps of a shot at most.
const MOST_RAMPS: u32 = 2;

/// Places for peaks of a ramp at most.
const MOST_PEAKS: u32 = 256;

/// Bytes of a peak: its frequency and its power.
const PEAK: usize = 8;

/// The header of a file of beats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BeatHeader {
    /// Ramps of a shot, 1 or 2.
    pub ramps: u32,
    /// Places for peaks of a ramp, 1 to 256.
    pub peaks: u32,
    /// The sensor that they are of, if it is known.
    pub digest: Option<Digest>,
    /// Shots in the file, if it is known.
    pub count: Option<u64>,
}

/// Reads the peaks of one shot after another.
#[derive(Debug)]
pub struct BeatReader<R> {
    records: ByShot<R>,
    header: BeatHeader,
}

impl<R: Read> BeatReader<R> {
    /// Reads the header of the beats of a sensor whose own would be `wanted`; its digest and count are not looked at.
    ///
    /// # Errors
    /// If it cannot be read, is of no version that is known, or is of a sensor with other numbers of ramps and
    /// peaks.
    pub fn new(reader: R, wanted: &BeatHeader) -> Result<Self, Error> {
        let mut source = Source::new(reader, What::Beats)?;
        if source.form == Form::Text {
            return source.refuse("is text: beats are read in their binary form alone");
        }
        let bytes = head::binary(&mut source)?;
        let header = BeatHeader {
            ramps: number!(bytes, 24, u32),
            peaks: number!(bytes, 28, u32),
            digest: head::digest(&bytes, 32),
            count: head::known(number!(bytes, 16, u64)),
        };
        let BeatHeader { ramps, peaks, .. } = header;
        let told = format!("{ramps} ramps of a shot with {peaks} peaks each");
        if !(1..=MOST_RAMPS).contains(&ramps) || !(1..=MOST_PEAKS).contains(&peaks) {
            let most = format!("1 to {MOST_RAMPS} with 1 to {MOST_PEAKS}");
            return source.refuse(format!("{told}, where it has {most}"));
        }
        if (ramps, peaks) != (wanted.ramps, wanted.peaks) {
            let own = format!("{} with {}", wanted.ramps, wanted.peaks);
            return source.refuse(format!("{told}, where the sensor has {own}"));
        }
        let length = RECORD + PEAK * (ramps * peaks) as usize;
        let records = ByShot::new(source, header.count, length, ["the record", "shots"]);
        Ok(Self { records, header })
    }

    /// The header, before the beats.
    pub fn header(&self) -> &BeatHeader {
        &self.header
    }

    /// An error about what was read last.
    pub(super) fn refuse<T>(&self, message: impl Into<String>) -> Result<T, Error> {
        self.records.refuse(message)
    }

    /// The absolute id of the next shot, and its peaks; `None` behind the last one.
    ///
    /// # Errors
    /// If they cannot be read, do not come after those before them, or if the file ends too early.
    pub fn next_shot(&mut self) -> Result<Option<(u64, Vec<Peak>)>, Error> {
        let peak = |bytes: &[u8]| Peak {
            frequency: number!(bytes, 0, i32),
            power: number!(bytes, 4, u32),
        };
        let peaks = |bytes: &[u8]| bytes[RECORD..].chunks_exact(PEAK).map(peak).collect();
        Ok(self.records.next()?.map(|(shot, bytes)| (shot, peaks(bytes))))
    }
}

/// Writes beats.
#[derive(Debug)]
pub struct BeatWriter<W> {
    out: W,
    bytes: Vec<u8>,
}

impl<W: Write> BeatWriter<W> {
    /// Writes the header. If it states a number of shots, the caller writes the peaks of that many.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(mut out: W, header: &BeatHeader) -> io::Result<Self> {
        let mut bytes: [u8; HEADER] = head::begun(MAGIC, header.count);
        bytes[24..28].copy_from_slice(&header.ramps.to_le_bytes());
        bytes[28..32].copy_from_slice(&header.peaks.to_le_bytes());
        if let Some(Digest(digest)) = header.digest {
            bytes[32..48].copy_from_slice(&digest);
        }
        out.write_all(&bytes)?;
        Ok(Self::behind(out))
    }

    /// A writer of beats behind a header that is written already. A header is as long whatever its count, so that it
    /// may be written again when that is known.
    pub fn behind(out: W) -> Self {
        Self { out, bytes: Vec::new() }
    }

    /// Writes `beats`, beginning with those of the shot with the absolute id `first`.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn write(&mut self, beats: &Beats, first: u64) -> io::Result<()> {
        let each = (beats.ramps * beats.peaks).max(1) as usize;
        for (shot, peaks) in (first..).zip(beats.found.chunks(each)) {
            self.bytes.clear();
            self.bytes.extend(shot.to_le_bytes());
            for peak in peaks {
                self.bytes.extend(peak.frequency.to_le_bytes());
                self.bytes.extend(peak.power.to_le_bytes());
            }
            self.out.write_all(&self.bytes)?;
        }
        Ok(())
    }
}
