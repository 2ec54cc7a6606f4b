//! Ticks: when the converters saw light, tick by tick.

use std::io::{self, Read, Write};

use super::head::{self, Columns, HEADER, Keys};
use super::source::{Source, number};
use super::{Digest, Error, Form, LONGEST_FS, VERSION, What};
use crate::record::RecordKind;
use crate::ticks::Tick;

const MAGIC: &[u8; 8] = b"MPTICKS\0";

/// Flags of a binary header.
const SEVERAL: u32 = 1;
const MEASURED: u32 = 2;

const KEYS: [&str; 3] = ["tick_fs", "count", "digest"];

const COLUMNS: [&str; 3] = ["tick", "channel", "amplitude"];

/// The header of a file of ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TickHeader {
    /// Length of a tick, fs.
    pub tick_fs: i64,
    /// True if each has a detector channel.
    pub several: bool,
    /// True if the energy of each pulse is measured.
    pub measured: bool,
    /// The sensor that they are of, if it is known.
    pub digest: Option<Digest>,
    /// Ticks in the file, if it is known.
    pub count: Option<u64>,
}

/// Reads ticks one by one.
#[derive(Debug)]
pub struct TickReader<R> {
    source: Source<R>,
    header: TickHeader,
    columns: Columns,
    channels: u32,
    read: u64,
    last: Option<Tick>,
}

impl<R: Read> TickReader<R> {
    /// Reads the header of the ticks of a sensor with this number of `channels`, whose ticks last `tick_fs`.
    ///
    /// # Errors
    /// If it cannot be read, is of no version that is known, or of another sensor: ticks of another
    /// length, or without a channel where there are several.
    pub fn new(reader: R, tick_fs: i64, channels: u32) -> Result<Self, Error> {
        let mut source = Source::new(reader, What::Record(RecordKind::Ticks))?;
        let (header, columns) = match source.form {
            Form::Text => read_text(&mut source, tick_fs)?,
            Form::Binary => (read_binary(&mut source)?, Columns::default()),
        };
        if header.tick_fs != tick_fs {
            return source.refuse(format!(
                "ticks of {} fs, where those of the sensor last {tick_fs} fs",
                header.tick_fs
            ));
        }
        if tick_fs < 1 {
            return source.refuse(format!("ticks of {tick_fs} fs, where one lasts 1 fs or more"));
        }
        if channels > 1 && !header.several {
            return source.refuse(format!(
                "the ticks have no channel, and the sensor has {channels} of them"
            ));
        }
        Ok(Self { source, header, columns, channels, read: 0, last: None })
    }

    /// Returns the header of the file.
    pub fn header(&self) -> &TickHeader {
        &self.header
    }

    /// The next tick; `None` behind the last one.
    ///
    /// # Errors
    /// If it cannot be read, does not come after the one before it, has a channel that the sensor
    /// has not, or if the file ends too early.
    pub fn next_tick(&mut self) -> Result<Option<Tick>, Error> {
        let tick = match self.source.form {
            Form::Text => self.text()?,
            Form::Binary => self.binary()?,
        };
        let Some(tick) = tick else {
            return match self.header.count {
                Some(count) if self.read < count => self.source.refuse(format!(
                    "the file ends after {} of {count} ticks: it is truncated",
                    self.read
                )),
                _ => Ok(None),
            };
        };
        if let Some(count) = self.header.count.filter(|count| self.read >= *count) {
            return self.refuse(format!("the header says that there are {count} ticks only"));
        }
        if tick.tick.unsigned_abs() > (LONGEST_FS / self.header.tick_fs).unsigned_abs() {
            let at = tick.tick;
            return self.refuse(format!("tick {at} is more than 9000 s from the first scan"));
        }
        if u32::from(tick.channel) >= self.channels {
            return self.refuse(format!(
                "channel {} is not among the {} of the sensor, which are counted from 0",
                tick.channel, self.channels
            ));
        }
        if !tick.amplitude.is_finite() {
            return self.refuse("the amplitude is no number");
        }
        if let Some(last) = self.last.filter(|last| tick.order() <= last.order()) {
            return self.refuse(out_of_order(&tick, &last));
        }
        (self.last, self.read) = (Some(tick), self.read + 1);
        Ok(Some(tick))
    }

    /// An error about the tick that was read last.
    pub(super) fn refuse<T>(&self, message: impl Into<String>) -> Result<T, Error> {
        self.source.refuse(message)
    }

    fn text(&mut self) -> Result<Option<Tick>, Error> {
        if !self.columns.next_line(&mut self.source)? {
            return Ok(None);
        }
        let tick = self.whole("tick", self.columns.cell(&self.source, 0).unwrap_or_default())?;
        let channel = match self.columns.cell(&self.source, 1) {
            Some(cell) => self.whole("channel", cell)?,
            None => 0,
        };
        let amplitude = match self.columns.cell(&self.source, 2) {
            None => 0.0,
            Some(cell) => match cell.parse() {
                Ok(amplitude) => amplitude,
                Err(_) => return self.refuse(format!("amplitude: `{cell}` is no number")),
            },
        };
        Ok(Some(Tick { tick, channel, amplitude }))
    }

    fn whole<N: std::str::FromStr>(&self, name: &str, cell: &str) -> Result<N, Error> {
        match cell.parse() {
            Ok(number) => Ok(number),
            Err(_) => self.refuse(format!("{name}: `{cell}` is no whole number in its range")),
        }
    }

    fn binary(&mut self) -> Result<Option<Tick>, Error> {
        let TickHeader { several, measured, .. } = self.header;
        let mut record = [0; 14];
        let length = record_length(several, measured);
        if !self.source.record(&mut record[..length])? {
            return Ok(None);
        }
        Ok(Some(Tick {
            tick: number!(record, 0, i64),
            channel: if several { number!(record, 8, u16) } else { 0 },
            amplitude: if measured { number!(record, length - 4, f32) } else { 0.0 },
        }))
    }
}

fn out_of_order(tick: &Tick, last: &Tick) -> String {
    match tick.order() == last.order() {
        true => format!("tick {} is there twice in its channel: keep one of them", tick.tick),
        false => format!(
            "tick {} of channel {} comes after tick {} of channel {}: sort them by tick, and those \
             of one tick by channel",
            tick.tick, tick.channel, last.tick, last.channel
        ),
    }
}

/// Bytes of a record.
fn record_length(several: bool, measured: bool) -> usize {
    8 + 2 * usize::from(several) + 4 * usize::from(measured)
}

fn read_text<R: Read>(
    source: &mut Source<R>,
    tick_fs: i64,
) -> Result<(TickHeader, Columns), Error> {
    let keys = Keys::read(source, &KEYS)?;
    let Some(typed) = keys.number(source, "tick_fs")? else {
        return source.refuse(format!(
            "the first line does not say how long a tick is; write tick_fs={tick_fs} for this sensor"
        ));
    };
    let digest = keys.digest(source)?;
    let columns = Columns::read(source, &COLUMNS, &["tick"])?;
    let (several, measured) = (columns.has(1), columns.has(2));
    let count = keys.number(source, "count")?;
    Ok((TickHeader { tick_fs: typed, several, measured, digest, count }, columns))
}

fn read_binary<R: Read>(source: &mut Source<R>) -> Result<TickHeader, Error> {
    let header = head::binary(source)?;
    let (flags, record) = (number!(header, 48, u32), number!(header, 52, u32));
    if flags & !(SEVERAL | MEASURED) != 0 {
        return source.refuse(format!("unknown flags {flags:#x} in the header"));
    }
    let (several, measured) = (flags & SEVERAL != 0, flags & MEASURED != 0);
    let length = record_length(several, measured);
    if record != length as u32 {
        return source.refuse(format!("records of {record} bytes, where they are of {length}"));
    }
    Ok(TickHeader {
        tick_fs: number!(header, 24, i64),
        several,
        measured,
        digest: head::digest(&header, 32),
        count: head::known(number!(header, 16, u64)),
    })
}

/// Writes ticks one by one.
#[derive(Debug)]
pub struct TickWriter<W> {
    out: W,
    form: Form,
    several: bool,
    measured: bool,
}

impl<W: Write> TickWriter<W> {
    /// Writes the header. If it has a count, this number of ticks must follow.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(mut out: W, form: Form, header: &TickHeader) -> io::Result<Self> {
        match form {
            Form::Text => write_text(&mut out, header)?,
            Form::Binary => out.write_all(&binary_header(header))?,
        }
        Ok(Self::behind(out, form, header))
    }

    /// A writer of ticks behind a header that is written already. A header is as long whatever its
    /// count, so that it may be written again when that is known.
    pub fn behind(out: W, form: Form, header: &TickHeader) -> Self {
        Self { out, form, several: header.several, measured: header.measured }
    }

    /// Writes the next tick.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, tick: &Tick) -> io::Result<()> {
        let Tick { tick, channel, amplitude } = *tick;
        match self.form {
            Form::Text => {
                write!(self.out, "{tick}")?;
                if self.several {
                    write!(self.out, ",{channel}")?;
                }
                if self.measured {
                    write!(self.out, ",{amplitude}")?;
                }
                writeln!(self.out)
            }
            Form::Binary => {
                self.out.write_all(&tick.to_le_bytes())?;
                if self.several {
                    self.out.write_all(&channel.to_le_bytes())?;
                }
                if self.measured {
                    self.out.write_all(&amplitude.to_le_bytes())?;
                }
                Ok(())
            }
        }
    }
}

fn write_text(out: &mut impl Write, header: &TickHeader) -> io::Result<()> {
    write!(out, "# macropulse ticks {VERSION}, tick_fs={}", header.tick_fs)?;
    // As wide as any, so that it may be written before it is known.
    if let Some(count) = header.count {
        write!(out, ", count={count:020}")?;
    }
    if let Some(digest) = header.digest {
        write!(out, ", digest={digest}")?;
    }
    let channel = if header.several { ",channel" } else { "" };
    let amplitude = if header.measured { ",amplitude" } else { "" };
    writeln!(out, "\ntick{channel}{amplitude}")
}

fn binary_header(header: &TickHeader) -> [u8; HEADER] {
    let TickHeader { several, measured, .. } = *header;
    let mut bytes = head::begun(MAGIC, header.count);
    bytes[24..32].copy_from_slice(&header.tick_fs.to_le_bytes());
    if let Some(Digest(digest)) = header.digest {
        bytes[32..48].copy_from_slice(&digest);
    }
    let flags = SEVERAL * u32::from(several) + MEASURED * u32::from(measured);
    bytes[48..52].copy_from_slice(&flags.to_le_bytes());
    bytes[52..56].copy_from_slice(&(record_length(several, measured) as u32).to_le_bytes());
    bytes
}
