//! Taps: the codes of each shot, shot by shot.

use std::io::{self, Read, Write};

use super::by_shot::ByShot;
use super::head::{self, HEADER};
use super::source::{Source, number};
use super::{Digest, Error, Form, What};
use crate::Taps;

const MAGIC: &[u8; 8] = b"MPTAPS\0\0";

/// Bytes before the codes of a shot: its id.
const RECORD: usize = 8;

/// Taps of a shot at most.
const MOST_TAPS: u32 = 1024;

/// Bytes of a code.
const CODE: usize = size_of::<u16>();

/// The header of a file of taps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TapHeader {
    /// Taps of a shot, 1 to 1024.
    pub taps: u32,
    /// The sensor that they are of, if it is known.
    pub digest: Option<Digest>,
    /// Shots in the file, if it is known.
    pub count: Option<u64>,
}

/// Reads the taps of one shot after another.
#[derive(Debug)]
pub struct TapReader<R> {
    records: ByShot<R>,
    header: TapHeader,
}

impl<R: Read> TapReader<R> {
    /// Reads the header of the taps of a sensor whose own would be `wanted`; its digest and count are not looked at.
    ///
    /// # Errors
    /// If it cannot be read, is of no version that is known, or is of a sensor with another number of taps.
    pub fn new(reader: R, wanted: &TapHeader) -> Result<Self, Error> {
        let mut source = Source::new(reader, What::Taps)?;
        if source.form == Form::Text {
            return source.refuse("is text: taps are read in their binary form alone");
        }
        let bytes = head::binary(&mut source)?;
        let header = TapHeader {
            taps: number!(bytes, 24, u32),
            digest: head::digest(&bytes, 32),
            count: head::known(number!(bytes, 16, u64)),
        };
        let (taps, own) = (header.taps, wanted.taps);
        if !(1..=MOST_TAPS).contains(&taps) {
            let message = format!("{taps} taps of a shot, where it has 1 to {MOST_TAPS}");
            return source.refuse(message);
        }
        if taps != own {
            return source.refuse(format!("{taps} taps of a shot, where the sensor has {own}"));
        }
        let length = RECORD + CODE * taps as usize;
        let records = ByShot::new(source, header.count, length, ["the record", "shots"]);
        Ok(Self { records, header })
    }

    /// The header, before the taps.
    pub fn header(&self) -> &TapHeader {
        &self.header
    }

    /// An error about what was read last.
    pub(super) fn refuse<T>(&self, message: impl Into<String>) -> Result<T, Error> {
        self.records.refuse(message)
    }

    /// The absolute id of the next shot, and its codes; `None` behind the last one.
    ///
    /// # Errors
    /// If they cannot be read, do not come after those before them, or if the file ends too early.
    pub fn next_shot(&mut self) -> Result<Option<(u64, Vec<u16>)>, Error> {
        let codes = |bytes: &[u8]| {
            bytes[RECORD..].chunks_exact(CODE).map(|code| number!(code, 0, u16)).collect()
        };
        Ok(self.records.next()?.map(|(shot, bytes)| (shot, codes(bytes))))
    }
}

/// Writes taps.
#[derive(Debug)]
pub struct TapWriter<W> {
    out: W,
    bytes: Vec<u8>,
}

impl<W: Write> TapWriter<W> {
    /// Writes the header. If it states a number of shots, the caller writes the taps of that many.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(mut out: W, header: &TapHeader) -> io::Result<Self> {
        let mut bytes: [u8; HEADER] = head::begun(MAGIC, header.count);
        bytes[24..28].copy_from_slice(&header.taps.to_le_bytes());
        if let Some(Digest(digest)) = header.digest {
            bytes[32..48].copy_from_slice(&digest);
        }
        out.write_all(&bytes)?;
        Ok(Self::behind(out))
    }

    /// A writer of taps behind a header that is written already. A header is as long whatever its count, so that it
    /// may be written again when that is known.
    pub fn behind(out: W) -> Self {
        Self { out, bytes: Vec::new() }
    }

    /// Writes `taps`, beginning with those of the shot with the absolute id `first`.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn write(&mut self, taps: &Taps, first: u64) -> io::Result<()> {
        for (shot, codes) in (first..).zip(taps.codes.chunks(taps.taps.max(1) as usize)) {
            self.bytes.clear();
            self.bytes.extend(shot.to_le_bytes());
            self.bytes.extend(codes.iter().flat_map(|code| code.to_le_bytes()));
            self.out.write_all(&self.bytes)?;
        }
        Ok(())
    }
}
