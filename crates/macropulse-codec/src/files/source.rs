//! Bytes and lines of a file, with the place where they stand.

use std::io::{BufRead, BufReader, ErrorKind, Read};

use super::{Error, Form, Place, What};
use crate::record::RecordKind;

/// No line is longer, bytes.
const LONGEST_LINE: u64 = 4096;

/// The mark of the byte order of UTF-8.
const MARK: [u8; 3] = [0xef, 0xbb, 0xbf];

/// Bytes asked for at once.
const BLOCK: usize = 1 << 16;

/// A file under way; only a block of it is kept.
#[derive(Debug)]
pub(super) struct Source<R> {
    bytes: BufReader<R>,
    pub form: Form,
    pub what: What,
    /// Place of the record that was read last.
    place: Place,
    /// Bytes read so far; in text, lines.
    passed: u64,
    line: Vec<u8>,
}

impl<R: Read> Source<R> {
    /// The file of `reader`, whose form its first byte tells.
    pub fn new(reader: R, what: What) -> Result<Self, Error> {
        let mut bytes = BufReader::with_capacity(BLOCK, reader);
        let mut first = first_byte(&mut bytes).map_err(|cause| Error::Read { what, cause })?;
        // Some programs put a mark of the byte order before text.
        if first == Some(MARK[0]) && bytes.buffer().starts_with(&MARK) {
            bytes.consume(MARK.len());
            first = first_byte(&mut bytes).map_err(|cause| Error::Read { what, cause })?;
        }
        let (form, place) = match first {
            Some(b'#') => (Form::Text, Place::Line(1)),
            _ => (Form::Binary, Place::Byte(0)),
        };
        let source = Self { bytes, form, what, place, passed: 0, line: Vec::new() };
        match first {
            Some(b'#' | b'M') => Ok(source),
            Some(_) if !matches!(what, What::Shots | What::Record(RecordKind::Ticks)) => {
                let name = source.name();
                source.refuse(format!("this is no file of Macropulse's {name}"))
            }
            Some(_) => source.refuse(format!(
                "neither text that begins with `# macropulse {}` nor its binary form",
                source.name()
            )),
            None => source.refuse("the file is empty: not even its header is there"),
        }
    }

    /// Returns the kind of its records, as its header names it.
    pub fn name(&self) -> &'static str {
        match self.what {
            What::Shots => "shots",
            What::Record(kind) => kind.name(),
        }
    }

    /// An error about what was read last.
    pub fn refuse<T>(&self, message: impl Into<String>) -> Result<T, Error> {
        Err(Error::Content { what: self.what, place: self.place, message: message.into() })
    }

    /// Returns an error about the place `behind` bytes behind the beginning of what was read last.
    pub fn refuse_behind<T>(&self, behind: u64, message: String) -> Result<T, Error> {
        let place = match self.place {
            Place::Byte(byte) => Place::Byte(byte + behind),
            line => line,
        };
        Err(Error::Content { what: self.what, place, message })
    }

    /// The next line that is not blank, without its end and the blanks around it; `None` behind the
    /// last one.
    pub fn line(&mut self) -> Result<Option<&str>, Error> {
        loop {
            self.line.clear();
            let mut limited = (&mut self.bytes).take(LONGEST_LINE + 1);
            let read = limited.read_until(b'\n', &mut self.line);
            let read = read.map_err(|cause| Error::Read { what: self.what, cause })? as u64;
            if read == 0 {
                return Ok(None);
            }
            self.passed += 1;
            self.place = Place::Line(self.passed);
            if read > LONGEST_LINE {
                return self.refuse(format!("the line is longer than {LONGEST_LINE} bytes"));
            }
            if self.line.iter().any(|byte| !byte.is_ascii_whitespace()) {
                break;
            }
        }
        match std::str::from_utf8(&self.line) {
            Ok(line) => Ok(Some(line.trim())),
            Err(_) => Err(Error::Content {
                what: self.what,
                place: self.place,
                message: "the line is no text".to_owned(),
            }),
        }
    }

    /// The line that was read last, as [`Source::line`] gave it.
    pub fn last_line(&self) -> &str {
        std::str::from_utf8(&self.line).map_or("", str::trim)
    }

    /// Fills `record`; `false` where the file ends before it.
    pub fn record(&mut self, record: &mut [u8]) -> Result<bool, Error> {
        self.place = Place::Byte(self.passed);
        let mut filled = 0;
        while filled < record.len() {
            match self.bytes.read(&mut record[filled..]) {
                Ok(0) if filled == 0 => return Ok(false),
                Ok(0) => {
                    let whole = record.len();
                    return self.refuse(format!(
                        "the file ends {filled} bytes into a record of {whole}: it is truncated"
                    ));
                }
                Ok(read) => filled += read,
                Err(cause) if cause.kind() == ErrorKind::Interrupted => {}
                Err(cause) => return Err(Error::Read { what: self.what, cause }),
            }
        }
        self.passed += record.len() as u64;
        Ok(true)
    }
}

/// The first byte, which stays to be read.
fn first_byte(bytes: &mut impl BufRead) -> std::io::Result<Option<u8>> {
    loop {
        match bytes.fill_buf() {
            Ok(block) => return Ok(block.first().copied()),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// The little-endian number at place `at` of `record`; 0 where it is not whole.
macro_rules! number {
    ($record:expr, $at:expr, $kind:ty) => {{
        let bytes = $record.get($at..$at + size_of::<$kind>());
        bytes
            .and_then(|bytes| bytes.try_into().ok())
            .map_or_else(Default::default, <$kind>::from_le_bytes)
    }};
}
pub(super) use number;
