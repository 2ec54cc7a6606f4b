//! Shot logs: what was sent when, shot by shot.

use std::io::{self, Read, Write};
use std::ops::Range;

use super::head::{self, Columns, HEADER, Keys};
use super::source::{Source, number};
use super::{Digest, Error, Form, LONGEST_FS, UNKNOWN, VERSION, What};

const MAGIC: &[u8; 8] = b"MPSHOTS\0";

/// Bytes of a record.
const RECORD: usize = 18;

/// Shots are counted up to here: more than any sensor fires in its time.
const MOST_SHOTS: u64 = 1 << 60;

const KEYS: [&str; 7] =
    ["first", "count", "owned_from", "owned_until", "digest", "position_m", "turn"];

const COLUMNS: [&str; 8] =
    ["shot", "fired_fs", "fired_ps", "row", "column", "label", "word", "channel"];

/// The header of a shot log.
#[derive(Debug, Clone, PartialEq)]
pub struct ShotHeader {
    /// Absolute id of the first shot in the file, counted from the first shot of the first scan.
    pub first: u64,
    /// Ids of the shots whose returns are wanted; the others are guard shots. All, if it is not said.
    pub owned: Option<Range<u64>>,
    /// The sensor that they are of, if it is known.
    pub digest: Option<Digest>,
    /// Position of the sensor when the scan began, m.
    pub position: [f64; 3],
    /// The turn that carries directions of the sensor into the world, a unit quaternion w, x, y, z.
    pub turn: [f64; 4],
    /// Shots in the file, if it is known.
    pub count: Option<u64>,
}

impl Default for ShotHeader {
    fn default() -> Self {
        Self {
            first: 0,
            owned: None,
            digest: None,
            position: [0.0; 3],
            turn: [1.0, 0.0, 0.0, 0.0],
            count: None,
        }
    }
}

/// One shot of a log.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Shot {
    /// Absolute time at which its first chip leaves, fs from the beginning of the first scan.
    pub fired_fs: i64,
    /// Row of the pixel, 0 at the top.
    pub row: u16,
    /// Column of the pixel, 0 at the left.
    pub column: u16,
    /// The number the macropulse carries; 0 where shots carry none.
    pub label: u16,
    /// Index of the code word in its family; 0 where shots are not coded.
    pub word: u16,
    /// The detector that listens to it.
    pub channel: u16,
}

/// How many of each there are at a sensor: numbers of shots lie below.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Rows of pixels.
    pub rows: u32,
    /// Columns of pixels.
    pub columns: u32,
    /// Labels that macropulses carry.
    pub labels: u32,
    /// Code words.
    pub words: u32,
    /// Detector channels.
    pub channels: u32,
}

impl Limits {
    /// Why `shot` is none of the sensor's, if it is not.
    fn breach(&self, shot: &Shot) -> Option<String> {
        let all = [
            ("row", shot.row, self.rows, "rows of the sensor"),
            ("column", shot.column, self.columns, "columns of the sensor"),
            ("label", shot.label, self.labels, "labels of the codebook"),
            ("word", shot.word, self.words, "words of the codebook"),
            ("channel", shot.channel, self.channels, "channels of the sensor"),
        ];
        let (name, number, limit, of) =
            all.into_iter().find(|(_, number, limit, _)| u32::from(*number) >= *limit)?;
        Some(format!("{name} {number} is not among the {limit} {of}, which are counted from 0"))
    }
}

/// Reads a shot log shot by shot.
#[derive(Debug)]
pub struct ShotReader<R> {
    source: Source<R>,
    header: ShotHeader,
    limits: Limits,
    columns: Columns,
    read: u64,
    last_fs: i64,
}

impl<R: Read> ShotReader<R> {
    /// Reads the header of a log of a sensor with these `limits`.
    ///
    /// # Errors
    /// If it cannot be read, or is no shot log of a version that is known.
    pub fn new(reader: R, limits: Limits) -> Result<Self, Error> {
        let mut source = Source::new(reader, What::Shots)?;
        let (header, columns) = match source.form {
            Form::Text => read_text(&mut source)?,
            Form::Binary => (read_binary(&mut source)?, Columns::default()),
        };
        if header.first > MOST_SHOTS {
            return source.refuse(format!("first: shot {} is never reached", header.first));
        }
        if header.owned.as_ref().is_some_and(|owned| owned.start > owned.end) {
            return source.refuse("the owned shots end before they begin");
        }
        Ok(Self { source, header, limits, columns, read: 0, last_fs: i64::MIN })
    }

    /// Returns the header of the file.
    pub fn header(&self) -> &ShotHeader {
        &self.header
    }

    /// The next shot; `None` behind the last one.
    ///
    /// # Errors
    /// If it cannot be read, is fired before the one before it, is none of the sensor's, or if the
    /// file ends too early.
    pub fn next_shot(&mut self) -> Result<Option<Shot>, Error> {
        let shot = match self.source.form {
            Form::Text => self.text()?,
            Form::Binary => self.binary()?,
        };
        let Some(shot) = shot else {
            return match self.header.count {
                Some(count) if self.read < count => self.source.refuse(format!(
                    "the file ends after {} of {count} shots: it is truncated",
                    self.read
                )),
                _ => Ok(None),
            };
        };
        if let Some(count) = self.header.count.filter(|count| self.read >= *count) {
            return self.refuse(format!("the header says that there are {count} shots only"));
        }
        if shot.fired_fs.unsigned_abs() > LONGEST_FS.unsigned_abs() {
            return self.refuse("is fired more than 9000 s from the beginning of the first scan");
        }
        if shot.fired_fs < self.last_fs {
            return self.refuse(format!(
                "is fired at {} fs, before the one before it at {} fs: sort the shots by time",
                shot.fired_fs, self.last_fs
            ));
        }
        if let Some(breach) = self.limits.breach(&shot) {
            return self.refuse(breach);
        }
        (self.last_fs, self.read) = (shot.fired_fs, self.read + 1);
        Ok(Some(shot))
    }

    /// An error about the shot that was read last.
    pub(super) fn refuse<T>(&self, message: impl std::fmt::Display) -> Result<T, Error> {
        let id = self.header.first.saturating_add(self.read);
        self.source.refuse(format!("shot {id}: {message}"))
    }

    fn text(&mut self) -> Result<Option<Shot>, Error> {
        if !self.columns.next_line(&mut self.source)? {
            return Ok(None);
        }
        let id = self.header.first.saturating_add(self.read);
        let [typed, fs, ps] = [0, 1, 2].map(|column| self.columns.cell(&self.source, column));
        if typed.is_some_and(|typed| typed.parse() != Ok(id)) {
            let typed = typed.unwrap_or_default();
            return self.source.refuse(format!("shot {typed} stands where shot {id} should"));
        }
        let fired_fs = match fs {
            Some(fs) => self.whole::<i64>("fired_fs", fs)?,
            None => self.whole::<i64>("fired_ps", ps.unwrap_or_default())?.saturating_mul(1000),
        };
        let small = |column: usize| match self.columns.cell(&self.source, column) {
            None => Ok(0),
            Some(cell) => self.whole::<u16>(COLUMNS[column], cell),
        };
        let [row, column, label, word, channel] =
            [small(3)?, small(4)?, small(5)?, small(6)?, small(7)?];
        Ok(Some(Shot { fired_fs, row, column, label, word, channel }))
    }

    fn whole<N: std::str::FromStr>(&self, name: &str, cell: &str) -> Result<N, Error> {
        match cell.parse() {
            Ok(number) => Ok(number),
            Err(_) => self.refuse(format!("{name}: `{cell}` is no whole number in its range")),
        }
    }

    fn binary(&mut self) -> Result<Option<Shot>, Error> {
        let mut record = [0; RECORD];
        if !self.source.record(&mut record)? {
            return Ok(None);
        }
        let small = |place: usize| number!(record, 8 + 2 * place, u16);
        Ok(Some(Shot {
            fired_fs: number!(record, 0, i64),
            row: small(0),
            column: small(1),
            label: small(2),
            word: small(3),
            channel: small(4),
        }))
    }
}

fn read_text<R: Read>(source: &mut Source<R>) -> Result<(ShotHeader, Columns), Error> {
    let keys = Keys::read(source, &KEYS)?;
    let first = keys.number(source, "first")?.unwrap_or(0);
    let (from, until) = (keys.number(source, "owned_from")?, keys.number(source, "owned_until")?);
    let header = ShotHeader {
        first,
        owned: (from.is_some() || until.is_some())
            .then(|| from.unwrap_or(first)..until.unwrap_or(u64::MAX)),
        digest: keys.digest(source)?,
        position: keys.reals(source, "position_m")?.unwrap_or_default(),
        turn: keys.reals(source, "turn")?.unwrap_or(ShotHeader::default().turn),
        count: keys.number(source, "count")?,
    };
    let columns = Columns::read(source, &COLUMNS, &["row", "column"])?;
    match (columns.has(1), columns.has(2)) {
        (true, false) | (false, true) => Ok((header, columns)),
        (false, false) => source.refuse("the column `fired_fs`, or else `fired_ps`, is missing"),
        (true, true) => source.refuse("`fired_fs` and `fired_ps` say the same: leave one out"),
    }
}

fn read_binary<R: Read>(source: &mut Source<R>) -> Result<ShotHeader, Error> {
    let header = head::binary(source)?;
    let from = number!(header, 32, u64);
    let until = number!(header, 40, u64);
    let real = |place: usize| number!(header, 64 + 8 * place, f64);
    let [position, turn] = [0..3, 3..7].map(|places| places.map(real).collect::<Vec<f64>>());
    if position.iter().chain(&turn).any(|number| !number.is_finite()) {
        return source.refuse("the pose in the header is no number");
    }
    let turn = <[f64; 4]>::try_from(turn).unwrap_or_default();
    Ok(ShotHeader {
        first: number!(header, 24, u64),
        owned: (from != UNKNOWN).then_some(from..until),
        digest: head::digest(&header, 48),
        position: position.try_into().unwrap_or_default(),
        // All zero where nobody knows.
        turn: if turn == [0.0; 4] { ShotHeader::default().turn } else { turn },
        count: head::known(number!(header, 16, u64)),
    })
}

/// Writes a shot log shot by shot.
#[derive(Debug)]
pub struct ShotWriter<W> {
    out: W,
    form: Form,
    next: u64,
}

impl<W: Write> ShotWriter<W> {
    /// Writes the header. If it has a count, the file must hold this number of shots.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(mut out: W, form: Form, header: &ShotHeader) -> io::Result<Self> {
        match form {
            Form::Text => write_text(&mut out, header)?,
            Form::Binary => out.write_all(&binary_header(header))?,
        }
        Ok(Self { out, form, next: header.first })
    }

    /// Writes the next shot.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, shot: &Shot) -> io::Result<()> {
        let Shot { fired_fs, row, column, label, word, channel } = *shot;
        let id = self.next;
        self.next = id.wrapping_add(1);
        match self.form {
            Form::Text => {
                writeln!(self.out, "{id},{fired_fs},{row},{column},{label},{word},{channel}")
            }
            Form::Binary => {
                let mut record = [0; RECORD];
                record[..8].copy_from_slice(&fired_fs.to_le_bytes());
                let numbers = [row, column, label, word, channel];
                for (place, number) in record[8..].chunks_exact_mut(2).zip(numbers) {
                    place.copy_from_slice(&number.to_le_bytes());
                }
                self.out.write_all(&record)
            }
        }
    }
}

fn write_text(out: &mut impl Write, header: &ShotHeader) -> io::Result<()> {
    write!(out, "# macropulse shots {VERSION}, first={}", header.first)?;
    if let Some(count) = header.count {
        write!(out, ", count={count}")?;
    }
    if let Some(owned) = &header.owned {
        write!(out, ", owned_from={}, owned_until={}", owned.start, owned.end)?;
    }
    if let Some(digest) = header.digest {
        write!(out, ", digest={digest}")?;
    }
    let [x, y, z] = header.position;
    let [w, i, j, k] = header.turn;
    writeln!(out, ", position_m={x} {y} {z}, turn={w} {i} {j} {k}")?;
    writeln!(out, "shot,fired_fs,row,column,label,word,channel")
}

fn binary_header(header: &ShotHeader) -> [u8; HEADER] {
    let mut bytes = head::begun(MAGIC, header.count);
    let owned = header.owned.clone().unwrap_or(UNKNOWN..UNKNOWN);
    for (at, number) in [(24, header.first), (32, owned.start), (40, owned.end)] {
        bytes[at..at + 8].copy_from_slice(&number.to_le_bytes());
    }
    if let Some(Digest(digest)) = header.digest {
        bytes[48..64].copy_from_slice(&digest);
    }
    let pose = header.position.iter().chain(&header.turn);
    for (place, number) in bytes[64..120].chunks_exact_mut(8).zip(pose) {
        place.copy_from_slice(&number.to_le_bytes());
    }
    bytes
}
