//! Samples: the codes of the converters, block by block.
//!
//! A block is a run of samples of one channel without a gap. Blocks stand in the order in which they begin,
//! those that begin at once in the order of their channels. So a file is read in the memory of what is
//! decoded together.

use std::io::{self, Read, Write};

use super::head::{self, HEADER};
use super::source::{Source, number};
use super::{Digest, Error, Form, LONGEST_FS, What};
use crate::record::RecordKind;
use crate::samples::Samples;

const MAGIC: &[u8; 8] = b"MPSAMPL\0";

/// Bytes before the codes of a block.
const RECORD: usize = 16;

/// Codes of a block at most: 2 MiB.
const MOST_CODES: usize = 1 << 20;

/// Codes that are read at once. The length that a block claims is believed so far and no further.
const AT_ONCE: usize = 1 << 14;

/// How far the step of a file may be from that of the sensor, as a share: it may have been computed in
/// another way, or in four bytes.
const SAME_STEP: f64 = 1e-6;

/// The header of a file of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleHeader {
    /// From sample to sample, fs: a tick.
    pub tick_fs: i64,
    /// Detector channels, which are counted from 0.
    pub channels: u32,
    /// The lowest code and the highest one, at which the converter clips.
    pub codes: (i16, i16),
    /// Step of a code, as the number of detected photons of a mark of this height; if it is known.
    pub step_photons: Option<f64>,
    /// The sensor that they are of, if it is known.
    pub digest: Option<Digest>,
    /// Blocks in the file, if it is known.
    pub count: Option<u64>,
}

/// Samples of one channel, one tick after the other.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SampleBlock {
    /// The absolute tick of the first one.
    pub first: i64,
    /// The detector.
    pub channel: u16,
    /// Codes.
    pub code: Vec<i16>,
}

impl SampleBlock {
    /// The absolute tick behind the last one.
    pub fn end(&self) -> i64 {
        self.first + self.code.len() as i64
    }
}

/// Reads samples block by block.
#[derive(Debug)]
pub struct SampleReader<R> {
    source: Source<R>,
    header: SampleHeader,
    read: u64,
    /// Tick at which the last block began, and its channel.
    last: Option<(i64, u16)>,
    /// Tick at which the last block of each channel ended.
    ends: Vec<Option<i64>>,
}

impl<R: Read> SampleReader<R> {
    /// Reads the header of the samples of a sensor whose own would be `wanted`; its digest and count are
    /// not looked at.
    ///
    /// # Errors
    /// If it cannot be read, is of no version that is known, or is of another sensor. Samples of another
    /// sensor have another rate, another number of channels, other codes or another step.
    pub fn new(reader: R, wanted: &SampleHeader) -> Result<Self, Error> {
        let mut source = Source::new(reader, What::Record(RecordKind::Samples))?;
        if source.form == Form::Text {
            return source.refuse("is text: samples are read in their binary form alone");
        }
        let bytes = head::binary(&mut source)?;
        let header = header_of(&bytes);
        if let Some(why) = unlike(&header, number!(bytes, 64, f64), wanted) {
            return source.refuse(why);
        }
        let ends = vec![None; header.channels as usize];
        Ok(Self { source, header, read: 0, last: None, ends })
    }

    /// Returns the header of the file.
    pub fn header(&self) -> &SampleHeader {
        &self.header
    }

    /// The next block; `None` behind the last one.
    ///
    /// # Errors
    /// If it cannot be read, does not come after those before it, or if the file ends too early. Also if it
    /// has a channel that the sensor has not, or a code that its converter does not make.
    pub fn next_block(&mut self) -> Result<Option<SampleBlock>, Error> {
        let mut record = [0; RECORD];
        if !self.source.record(&mut record)? {
            return match self.header.count {
                Some(count) if self.read < count => self.refuse(format!(
                    "the file ends after {} of {count} blocks: it is truncated",
                    self.read
                )),
                _ => Ok(None),
            };
        }
        if let Some(count) = self.header.count.filter(|count| self.read >= *count) {
            return self.refuse(format!("the header says that there are {count} blocks only"));
        }
        let first = number!(record, 0, i64);
        let (count, channel) = (number!(record, 8, u32), number!(record, 12, u16));
        self.check((first, count), (channel, number!(record, 14, u16)))?;
        let (lowest, highest) = self.header.codes;
        let mut block = SampleBlock { first, channel, code: Vec::new() };
        let mut bytes = [0; 2 * AT_ONCE];
        while block.code.len() < count as usize {
            let wanted = (count as usize - block.code.len()).min(AT_ONCE);
            let bytes = &mut bytes[..2 * wanted];
            if !self.source.record(bytes)? {
                return self.refuse(format!(
                    "the file ends after {} of {count} codes of a block: it is truncated",
                    block.code.len()
                ));
            }
            let tick = first + block.code.len() as i64;
            let codes = bytes.chunks_exact(2).map(|code| i16::from_le_bytes([code[0], code[1]]));
            block.code.extend(codes);
            let read = &block.code[(tick - first) as usize..];
            if let Some(at) = read.iter().position(|code| !(lowest..=highest).contains(code)) {
                let message = format!(
                    "code {} at tick {} of channel {channel} is none of the converter, whose codes are \
                     {lowest} to {highest}",
                    read[at],
                    tick + at as i64
                );
                return self.source.refuse_behind(2 * at as u64, message);
            }
        }
        self.last = Some((first, channel));
        self.ends[usize::from(channel)] = Some(block.end());
        self.read += 1;
        Ok(Some(block))
    }

    /// Checks that a block of `count` codes can stand here.
    fn check(&self, (first, count): (i64, u32), (channel, rest): (u16, u16)) -> Result<(), Error> {
        if count == 0 || count as usize > MOST_CODES || rest != 0 {
            return self.refuse(format!(
                "a block of {count} codes, where one has 1 to {MOST_CODES}, and two bytes of 0 behind its \
                 channel: is the file damaged?"
            ));
        }
        if first.unsigned_abs() > (LONGEST_FS / self.header.tick_fs).unsigned_abs() {
            return self.refuse(format!("tick {first} is more than 9000 s from the first scan"));
        }
        let Some(end) = self.ends.get(usize::from(channel)) else {
            return self.refuse(format!(
                "channel {channel} is not among the {} of the sensor, which are counted from 0",
                self.header.channels
            ));
        };
        if let Some((tick, other)) = self.last.filter(|last| (first, channel) < *last) {
            return self.refuse(format!(
                "the block of channel {channel} from tick {first} on comes after that of channel {other} \
                 from tick {tick} on: sort them by tick, and those of one tick by channel"
            ));
        }
        if let Some(end) = end.filter(|end| first < *end) {
            return self.refuse(format!(
                "the block from tick {first} on begins before tick {end}, at which the one before it of \
                 channel {channel} ends"
            ));
        }
        Ok(())
    }

    /// An error about what was read last.
    pub(super) fn refuse<T>(&self, message: impl Into<String>) -> Result<T, Error> {
        self.source.refuse(message)
    }
}

fn header_of(bytes: &[u8; HEADER]) -> SampleHeader {
    let step = number!(bytes, 64, f64);
    SampleHeader {
        tick_fs: number!(bytes, 24, i64),
        channels: number!(bytes, 56, u32),
        codes: (number!(bytes, 60, i16), number!(bytes, 62, i16)),
        step_photons: (step != 0.0).then_some(step),
        digest: head::digest(bytes, 32),
        count: head::known(number!(bytes, 16, u64)),
    }
}

/// Why a `header`, in which such a step is typed, is not of the sensor whose own would be `wanted`.
fn unlike(header: &SampleHeader, step: f64, wanted: &SampleHeader) -> Option<String> {
    let SampleHeader { tick_fs, channels, codes: (lowest, highest), .. } = *header;
    if tick_fs != wanted.tick_fs {
        return Some(format!(
            "samples {tick_fs} fs apart, where those of the sensor are {} fs apart",
            wanted.tick_fs
        ));
    }
    if tick_fs < 1 {
        return Some(format!("samples {tick_fs} fs apart, where they are 1 fs or more"));
    }
    if channels != wanted.channels {
        return Some(format!("{channels} channels, where the sensor has {}", wanted.channels));
    }
    if header.codes != wanted.codes {
        let (low, high) = wanted.codes;
        return Some(format!(
            "codes from {lowest} to {highest}, where those of the sensor are {low} to {high}"
        ));
    }
    if !step.is_finite() || step < 0.0 {
        return Some(format!(
            "a step of {step} photons: write one above 0, or 0 where it is not known"
        ));
    }
    let (typed, own) = (header.step_photons?, wanted.step_photons?);
    ((typed / own - 1.0).abs() > SAME_STEP)
        .then(|| format!("steps of {typed} photons, where those of the sensor are of {own}"))
}

/// Writes samples.
#[derive(Debug)]
pub struct SampleWriter<W> {
    out: W,
}

impl<W: Write> SampleWriter<W> {
    /// Writes the header. If it has a count, this number of blocks must follow.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(mut out: W, header: &SampleHeader) -> io::Result<Self> {
        out.write_all(&bytes_of(header))?;
        Ok(Self { out })
    }

    /// A writer of samples behind a header that is written already. A header is as long whatever its
    /// count, so that it may be written again when that is known.
    pub fn behind(out: W) -> Self {
        Self { out }
    }

    /// Writes the `samples` before the absolute tick `end`, and gives how many blocks they are.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, samples: &Samples, end: i64) -> io::Result<u64> {
        let count = usize::try_from(end.saturating_sub(samples.epoch)).unwrap_or(0);
        let count = count.min(samples.per_channel());
        let mut blocks = 0;
        for from in (0..count).step_by(MOST_CODES) {
            let to = count.min(from + MOST_CODES);
            for channel in &samples.channel {
                let codes = samples.of(*channel).get(from..to).unwrap_or_default();
                self.write_block(samples.epoch + from as i64, *channel, codes)?;
                blocks += 1;
            }
        }
        Ok(blocks)
    }

    fn write_block(&mut self, first: i64, channel: u16, codes: &[i16]) -> io::Result<()> {
        let mut record = [0; RECORD];
        record[..8].copy_from_slice(&first.to_le_bytes());
        record[8..12].copy_from_slice(&(codes.len() as u32).to_le_bytes());
        record[12..14].copy_from_slice(&channel.to_le_bytes());
        self.out.write_all(&record)?;
        let mut bytes = Vec::with_capacity(2 * AT_ONCE);
        for codes in codes.chunks(AT_ONCE) {
            bytes.clear();
            bytes.extend(codes.iter().flat_map(|code| code.to_le_bytes()));
            self.out.write_all(&bytes)?;
        }
        Ok(())
    }
}

fn bytes_of(header: &SampleHeader) -> [u8; HEADER] {
    let mut bytes = head::begun(MAGIC, header.count);
    bytes[24..32].copy_from_slice(&header.tick_fs.to_le_bytes());
    if let Some(Digest(digest)) = header.digest {
        bytes[32..48].copy_from_slice(&digest);
    }
    bytes[56..60].copy_from_slice(&header.channels.to_le_bytes());
    bytes[60..62].copy_from_slice(&header.codes.0.to_le_bytes());
    bytes[62..64].copy_from_slice(&header.codes.1.to_le_bytes());
    bytes[64..72].copy_from_slice(&header.step_photons.unwrap_or(0.0).to_le_bytes());
    bytes
}
