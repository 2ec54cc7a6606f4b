//! Records of shots: the same numbers for each shot, made of the light of that shot alone. Each kind declares its
//! layout once, by [`ShotRecord`]; one reader and one writer serve all of them.

use std::fmt::Debug;
use std::io::{self, Read, Write};
use std::ops::Range;

use super::head::{self, HEADER};
use super::source::{Source, number};
use super::{Digest, Error, Form, What};
use crate::record::{Given, Record, RecordKind};

/// Bytes before the numbers of a shot: its id.
const ID: usize = 8;

/// Numbers of shots that are decoded together at most: a gigabyte of them.
const MOST_NUMBERS: usize = 1 << 27;

/// A record of shots: how it stands in files, and its columns.
pub trait ShotRecord: Debug + Send + Sync {
    /// Its kind.
    fn kind(&self) -> RecordKind;

    /// A number of a shot, as a noun in the singular: `tap`.
    fn number(&self) -> &'static str;

    /// Numbers of a shot.
    fn numbers(&self) -> usize;

    /// Shots that it has.
    fn shots(&self) -> usize;

    /// A record like this of `shots` shots, without anything in it.
    fn blank(&self, shots: usize) -> Box<dyn ShotRecord>;

    /// The record, as receivers take it.
    fn given(self: Box<Self>) -> Given;

    /// Writes what all its shots share into a header. Bytes 24 to 31 are free for it, and those from 48 on.
    fn write_header(&self, header: &mut [u8; HEADER]);

    /// Checks that a header is that of records like this.
    ///
    /// # Errors
    /// Why no record can be like that, or why this one is not.
    fn check_header(&self, header: &[u8; HEADER]) -> Result<(), String>;

    /// Bytes of a shot in a file, behind its id.
    fn length(&self) -> usize;

    /// Appends the numbers of shot number `at` to `bytes`.
    fn write_shot(&self, at: usize, bytes: &mut Vec<u8>);

    /// Takes the numbers of shot number `at` from its `bytes`, whose length is [`ShotRecord::length`].
    fn read_shot(&mut self, at: usize, bytes: &[u8]);

    /// The record of shot number `at` alone.
    fn one(&self, at: usize) -> Given {
        let (mut bytes, mut one) = (Vec::new(), self.blank(1));
        self.write_shot(at, &mut bytes);
        one.read_shot(0, &bytes);
        one.given()
    }

    /// Checks the bytes of a shot.
    ///
    /// # Errors
    /// Why no shot has them.
    fn check_shot(&self, _bytes: &[u8]) -> Result<(), String> {
        Ok(())
    }

    /// How many things are counted in it, as [`RecordKind::counted`] names them.
    fn counted(&self) -> u64;

    /// Its columns, as programs hold them.
    fn columns(self: Box<Self>) -> Vec<RecordColumn>;

    /// A record like this of `shots` shots that has these columns, in the order of [`ShotRecord::columns`] and of the
    /// same kinds. A column of another kind or length is left blank.
    fn of_columns(&self, shots: usize, columns: Vec<RecordValues>) -> Box<dyn ShotRecord>;
}

/// A column of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordColumn {
    /// Its name.
    pub name: &'static str,
    /// True if it has an entry for each number of each shot. Else it has one for each shot.
    pub is_table: bool,
    /// Its entries.
    pub values: RecordValues,
}

/// The entries of a column of a record.
#[derive(Debug, Clone, PartialEq)]
pub enum RecordValues {
    /// One whole number that all shots share.
    Shared(i64),
    /// Whole numbers from 0 to 65 535.
    U16(Vec<u16>),
    /// Whole numbers from 0 to 4 294 967 295.
    U32(Vec<u32>),
    /// Numbers.
    F64(Vec<f64>),
}

/// Declares the records of shots: variant of [`Given`], and the first bytes of its files.
macro_rules! shot_records {
    ($($Kind:ident, $magic:literal;)+) => {
        /// The first bytes of each kind of file, with its name.
        pub(super) const MAGICS: &[(&[u8; 8], &str)] = &[
            (b"MPSHOTS\0", "shots"),
            (b"MPTICKS\0", RecordKind::Ticks.name()),
            (b"MPSAMPL\0", RecordKind::Samples.name()),
            $(($magic, RecordKind::$Kind.name()),)+
        ];

        impl<'a> Record<'a> {
            /// The record, if it consists of records of shots.
            pub fn of_shots(self) -> Option<&'a dyn ShotRecord> {
                match self {
                    $(Self::$Kind(record) => Some(record),)+
                    Self::Ticks(_) | Self::Samples(_) => None,
                }
            }
        }

        impl Given {
            /// The columns of the record, if it consists of records of shots; else the record as it was.
            ///
            /// # Errors
            /// If it does not.
            pub fn into_columns(self) -> Result<Vec<RecordColumn>, Self> {
                match self {
                    $(Self::$Kind(record) => Ok(Box::new(record).columns()),)+
                    other => Err(other),
                }
            }
        }
    };
}

impl Given {
    /// The record, if it consists of records of shots.
    pub fn of_shots(&self) -> Option<&dyn ShotRecord> {
        Record::from(self).of_shots()
    }

    /// How many ticks there are, samples of all channels, or numbers of all shots.
    pub fn len(&self) -> usize {
        match self {
            Self::Ticks(ticks) => ticks.len(),
            Self::Samples(samples) => samples.code.len(),
            record => record.of_shots().map_or(0, |record| record.shots() * record.numbers()),
        }
    }

    /// True if the record is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many things are counted in it: ticks, samples of all channels, or what its kind of record of shots counts.
    pub fn counted(&self) -> u64 {
        match self {
            Self::Ticks(_) | Self::Samples(_) => self.len() as u64,
            record => record.of_shots().map_or(0, ShotRecord::counted),
        }
    }
}

shot_records! {
    Histograms, b"MPHISTO\0";
    Taps, b"MPTAPS\0\0";
    Beats, b"MPBEATS\0";
}

/// The part of the header of a file of records that does not follow from the sensor.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RecordHeader {
    /// The sensor that they are of, if it is known.
    pub digest: Option<Digest>,
    /// Shots in the file, if it is known.
    pub count: Option<u64>,
}

/// Reads the record of one shot after another, in the memory of one of them.
#[derive(Debug)]
pub struct RecordReader<R> {
    source: Source<R>,
    /// A record of no shot.
    blank: Box<dyn ShotRecord>,
    header: RecordHeader,
    read: u64,
    last: Option<u64>,
    bytes: Vec<u8>,
}

impl<R: Read> RecordReader<R> {
    /// Reads the header of the records of a sensor whose own are like `wanted`.
    ///
    /// # Errors
    /// If it cannot be read, is of no version that is known, or if no records, or those of another sensor, are like
    /// that.
    pub fn new(reader: R, wanted: &dyn ShotRecord) -> Result<Self, Error> {
        let mut source = Source::new(reader, What::Record(wanted.kind()))?;
        if source.form == Form::Text {
            let name = source.name();
            return source.refuse(format!("is text: {name} are read in their binary form alone"));
        }
        let bytes = head::binary(&mut source)?;
        if let Err(why) = wanted.check_header(&bytes) {
            return source.refuse(why);
        }
        let header = RecordHeader {
            digest: head::digest(&bytes, 32),
            count: head::known(number!(bytes, 16, u64)),
        };
        let bytes = vec![0; ID + wanted.length()];
        Ok(Self { source, blank: wanted.blank(0), header, read: 0, last: None, bytes })
    }

    /// The header of the file.
    pub fn header(&self) -> &RecordHeader {
        &self.header
    }

    /// Reads on; the absolute id of the next shot, whose record is now in `bytes`.
    fn advance(&mut self) -> Result<Option<u64>, Error> {
        let Self { source, blank, header: RecordHeader { count, .. }, read, last, bytes } = self;
        if !source.record(bytes)? {
            return match *count {
                Some(count) if *read < count => source.refuse(format!(
                    "the file ends after {read} of {count} shots: it is truncated"
                )),
                _ => Ok(None),
            };
        }
        if let Some(count) = count.filter(|count| *read >= *count) {
            return source.refuse(format!("the header says that there are {count} shots only"));
        }
        let shot = number!(bytes, 0, u64);
        if let Some(last) = last.filter(|last| shot <= *last) {
            return source.refuse(format!(
                "the record of shot {shot} comes after that of shot {last}: sort them by shot, and give each shot \
                 once"
            ));
        }
        if let Err(why) = blank.check_shot(&bytes[ID..]) {
            return source.refuse(why);
        }
        *last = Some(shot);
        *read += 1;
        Ok(Some(shot))
    }

    /// The absolute id of the next shot, and its record; `None` behind the last one.
    ///
    /// # Errors
    /// If they cannot be read, do not come after those before them, or if the file ends too early.
    pub fn next_shot(&mut self) -> Result<Option<(u64, Given)>, Error> {
        let Some(shot) = self.advance()? else { return Ok(None) };
        let mut one = self.blank.blank(1);
        one.read_shot(0, &self.bytes[ID..]);
        Ok(Some((shot, one.given())))
    }
}

/// Records of shots under way.
#[derive(Debug)]
pub(super) struct RecordsAtHand<R> {
    reader: RecordReader<R>,
    /// The shot in the reader's bytes, behind those that were asked for.
    next: Option<u64>,
}

impl<R: Read> RecordsAtHand<R> {
    pub fn new(reader: RecordReader<R>) -> Self {
        Self { reader, next: None }
    }

    /// The record of the shots `owned`: blank for a shot without any.
    pub fn of(&mut self, owned: &Range<u64>) -> Result<Given, Error> {
        let blank = &self.reader.blank;
        let shots = (owned.end - owned.start) as usize;
        if shots.saturating_mul(blank.numbers()) > MOST_NUMBERS {
            let number = blank.number();
            return self.reader.source.refuse(format!(
                "more than {MOST_NUMBERS} {number}s belong to shots that are decoded together"
            ));
        }
        let mut found = blank.blank(shots);
        loop {
            if self.next.is_none() {
                self.next = self.reader.advance()?;
            }
            let Some(shot) = self.next.take_if(|shot| *shot < owned.end) else {
                return Ok(found.given());
            };
            if let Some(at) = shot.checked_sub(owned.start) {
                found.read_shot(at as usize, &self.reader.bytes[ID..]);
            }
        }
    }

    /// Reads to the end, so that what is wrong there is not passed over.
    pub fn drain(&mut self) -> Result<(), Error> {
        while self.reader.advance()?.is_some() {}
        Ok(())
    }
}

/// Writes records of shots.
#[derive(Debug)]
pub struct RecordWriter<W> {
    out: W,
    bytes: Vec<u8>,
}

impl<W: Write> RecordWriter<W> {
    /// Writes the header of records like `record`. If it states a number of shots, the caller writes that many.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(mut out: W, record: &dyn ShotRecord, header: &RecordHeader) -> io::Result<Self> {
        let kind = record.kind().name();
        let magic =
            MAGICS.iter().find(|(_, name)| *name == kind).map_or(&[0; 8], |(magic, _)| *magic);
        let mut bytes = head::begun(magic, header.count);
        if let Some(Digest(digest)) = header.digest {
            bytes[32..48].copy_from_slice(&digest);
        }
        record.write_header(&mut bytes);
        out.write_all(&bytes)?;
        Ok(Self::behind(out))
    }

    /// A writer of records behind a header that is written already. A header is as long whatever its count, so that it
    /// may be written again when that is known.
    pub fn behind(out: W) -> Self {
        Self { out, bytes: Vec::new() }
    }

    /// Writes `record`, beginning with the shot with the absolute id `first`.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, record: &dyn ShotRecord, first: u64) -> io::Result<()> {
        for at in 0..record.shots() {
            self.bytes.clear();
            self.bytes.extend(first.saturating_add(at as u64).to_le_bytes());
            record.write_shot(at, &mut self.bytes);
            self.out.write_all(&self.bytes)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Beats, Histograms, Peak, Taps};

    fn records() -> [Box<dyn ShotRecord>; 3] {
        let found = (1..=8).map(|power| Peak { frequency: -power, power: power as u32 }).collect();
        let histograms = Histograms {
            bin_fs: 1000,
            offset_fs: -50,
            bins: 3,
            cycles: vec![9, 8],
            counts: vec![1, 2, 3, 4, 5, 6],
        };
        [
            Box::new(histograms),
            Box::new(Taps { taps: 2, codes: vec![7, 8, 9, 10] }),
            Box::new(Beats { ramps: 2, peaks: 2, found }),
        ]
    }

    /// Every kind of record of shots is in the list above.
    #[test]
    fn records_of_shots_are_listed() {
        let by_shot = RecordKind::ALL.iter().filter(|kind| kind.is_by_shot());
        let listed: Vec<RecordKind> = records().iter().map(|record| record.kind()).collect();
        assert_eq!(by_shot.copied().collect::<Vec<_>>(), listed);
        for record in records() {
            let kind = record.kind();
            assert!(MAGICS.iter().any(|(_, name)| *name == kind.name()), "{kind:?}");
            assert!(record.given().of_shots().is_some_and(|record| record.kind() == kind));
        }
    }

    #[test]
    fn columns_make_the_record_again() {
        for record in records() {
            let (shots, blank) = (record.shots(), record.blank(0));
            assert_eq!((shots, blank.shots(), record.counted() > 0), (2, 0, true));
            let given = record.given();
            let columns = given.clone().into_columns().unwrap();
            let values: Vec<RecordValues> =
                columns.into_iter().map(|column| column.values).collect();
            assert_eq!(blank.of_columns(shots, values.clone()).given(), given);
            // Control: columns of three shots are none of two.
            assert_eq!(blank.of_columns(3, values).given(), blank.blank(3).given());
        }
    }

    #[test]
    fn bytes_make_the_record_again() {
        for record in records() {
            let mut again = record.blank(2);
            for at in 0..2 {
                let mut bytes = Vec::new();
                record.write_shot(at, &mut bytes);
                assert_eq!(bytes.len(), record.length());
                again.read_shot(at, &bytes);
            }
            // Behind the last shot there is no place.
            again.read_shot(2, &vec![1; record.length()]);
            assert_eq!(again.given(), record.given());
        }
    }
}
