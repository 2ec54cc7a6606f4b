//! The lines and bytes at the beginning of a file that say what it is.

use std::io::Read;

use super::records::MAGICS;
use super::source::{Source, number};
use super::{Digest, Error, UNKNOWN, VERSION, What};
use crate::record::RecordKind;

/// Bytes of every binary header.
pub const HEADER: usize = 128;

/// The keys in the text of a header, and their values.
pub(super) struct Keys(Vec<(String, String)>);

impl Keys {
    /// Reads `# macropulse NAME 1, key=value, …`; all keys must be `known`.
    pub fn read<R: Read>(source: &mut Source<R>, known: &[&str]) -> Result<Self, Error> {
        let line = source.line()?.unwrap_or_default().to_owned();
        let name = source.name();
        let Some(rest) = line.strip_prefix("# macropulse ") else {
            return source.refuse(format!("does not begin with `# macropulse {name} {VERSION}`"));
        };
        if rest.contains(';') {
            return source.refuse("has semicolons: values stand between commas");
        }
        let mut parts = rest.split(',').map(str::trim);
        let (kind, version) = match parts.next().and_then(|kind| kind.split_once(' ')) {
            Some((kind, version)) => (kind.trim(), version.trim()),
            None => (rest.trim(), ""),
        };
        check_kind(source, kind)?;
        check_version(source, version)?;
        let mut keys: Vec<(String, String)> = Vec::new();
        for part in parts.filter(|part| !part.is_empty()) {
            let Some((key, value)) = part.split_once('=') else {
                return source.refuse(format!("`{part}` is not written as key=value"));
            };
            let (key, value) = (key.trim(), value.trim());
            if !known.contains(&key) {
                let known = known.join(", ");
                return source.refuse(format!("unknown key `{key}`; known are {known}"));
            }
            if keys.iter().any(|(other, _)| other == key) {
                return source.refuse(format!("`{key}` is there twice"));
            }
            keys.push((key.to_owned(), value.to_owned()));
        }
        Ok(Self(keys))
    }

    fn value(&self, key: &str) -> Option<&str> {
        self.0.iter().find(|(other, _)| other == key).map(|(_, value)| value.as_str())
    }

    /// The whole number of `key`, if it is there.
    pub fn number<R: Read, N: std::str::FromStr>(
        &self,
        source: &Source<R>,
        key: &str,
    ) -> Result<Option<N>, Error> {
        let Some(value) = self.value(key) else { return Ok(None) };
        match value.parse() {
            Ok(number) => Ok(Some(number)),
            Err(_) => source.refuse(format!("{key}: `{value}` is no whole number in its range")),
        }
    }

    /// The digest of the sensor, if it is there.
    pub fn digest<R: Read>(&self, source: &Source<R>) -> Result<Option<Digest>, Error> {
        let Some(value) = self.value("digest") else { return Ok(None) };
        match Digest::parse(value) {
            None => source.refuse(format!("digest: `{value}` is not 32 hexadecimal digits")),
            digest => Ok(digest),
        }
    }

    /// Returns the `N` numbers with blanks between them, all finite, if they are there.
    pub fn reals<R: Read, const N: usize>(
        &self,
        source: &Source<R>,
        key: &str,
    ) -> Result<Option<[f64; N]>, Error> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let numbers: Option<Vec<f64>> = value.split_whitespace().map(finite).collect();
        match numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()) {
            None => {
                source.refuse(format!("{key}: `{value}` is not {N} numbers with blanks between"))
            }
            numbers => Ok(numbers),
        }
    }
}

fn finite(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

fn check_kind<R: Read>(source: &Source<R>, kind: &str) -> Result<(), Error> {
    let name = source.name();
    if kind == name {
        return Ok(());
    }
    let is_record = RecordKind::ALL.iter().any(|known| known.name() == kind);
    if is_record && source.what != What::Shots {
        return source.refuse(format!(
            "these are {kind}, where the sensor records {name}: is it the one that they were recorded with?"
        ));
    }
    if is_record || kind == "shots" {
        let behind = if source.what == What::Shots { kind } else { name };
        return source.refuse(format!(
            "these are {kind}, where {name} are wanted: the shot log comes first, then the {behind}"
        ));
    }
    source.refuse(format!("`{kind}` are neither shots nor {}", RecordKind::listed("or")))
}

fn check_version<R: Read>(source: &Source<R>, version: &str) -> Result<(), Error> {
    if version == VERSION.to_string() {
        return Ok(());
    }
    let name = source.name();
    source.refuse(format!("version `{version}` of {name}, of which this program reads {VERSION}"))
}

/// In which place of a line each of some columns stands, by the line that names them.
#[derive(Debug, Default)]
pub(super) struct Columns {
    places: Vec<Option<usize>>,
    wide: usize,
}

impl Columns {
    /// Reads the line of names, which must all be `known` and among them the `required` ones.
    pub fn read<R: Read>(
        source: &mut Source<R>,
        known: &[&str],
        required: &[&str],
    ) -> Result<Self, Error> {
        let Some(line) = source.line()?.map(str::to_owned) else {
            return source
                .refuse("behind its first line the file ends: the names of columns are missing");
        };
        let names: Vec<&str> = line.split(',').map(str::trim).collect();
        if line.contains(';') {
            return source.refuse("has semicolons: columns stand between commas");
        }
        if let Some(wrong) = names.iter().find(|name| !known.contains(name)) {
            let known = known.join(", ");
            return source.refuse(format!("unknown column `{wrong}`; known are {known}"));
        }
        let place = |wanted: &str| names.iter().position(|name| *name == wanted);
        if let Some(missing) = required.iter().find(|name| place(name).is_none()) {
            return source.refuse(format!("the column `{missing}` is missing"));
        }
        let twice = |(at, name): (usize, &&str)| place(name) != Some(at);
        if names.iter().enumerate().any(twice) {
            return source.refuse("a column is there twice");
        }
        Ok(Self { places: known.iter().map(|name| place(name)).collect(), wide: names.len() })
    }

    /// True if the known column number `column` is there.
    pub fn has(&self, column: usize) -> bool {
        self.places[column].is_some()
    }

    /// Reads the next line, in which every column has a cell; `false` at the end.
    pub fn next_line<R: Read>(&self, source: &mut Source<R>) -> Result<bool, Error> {
        let count = match source.line()? {
            None => return Ok(false),
            Some(line) => line.split(',').count(),
        };
        if count != self.wide {
            return source
                .refuse(format!("{count} values, where the line of names has {}", self.wide));
        }
        Ok(true)
    }

    /// The cell of the known column number `column` in the line that was read last, if the column is
    /// there.
    pub fn cell<'s, R: Read>(&self, source: &'s Source<R>, column: usize) -> Option<&'s str> {
        source.last_line().split(',').nth(self.places.get(column).copied()??).map(str::trim)
    }
}

/// Reads a binary header, and checks its kind and version.
pub(super) fn binary<R: Read>(source: &mut Source<R>) -> Result<[u8; HEADER], Error> {
    let mut header = [0; HEADER];
    if !source.record(&mut header)? {
        return source.refuse("the header is missing");
    }
    let Some((_, kind)) = MAGICS.iter().find(|(magic, _)| header.starts_with(*magic)) else {
        let records = RecordKind::listed("or");
        return source.refuse(format!("this is no file of Macropulse's shots, {records}"));
    };
    check_kind(source, kind)?;
    check_version(source, &number!(header, 8, u32).to_string())?;
    let length = number!(header, 12, u32);
    if length != HEADER as u32 {
        return source.refuse(format!("a header of {length} bytes, where {HEADER} are written"));
    }
    Ok(header)
}

/// The beginning of a binary header.
pub(super) fn begun(magic: &[u8; 8], count: Option<u64>) -> [u8; HEADER] {
    let mut header = [0; HEADER];
    header[..8].copy_from_slice(magic);
    header[8..12].copy_from_slice(&VERSION.to_le_bytes());
    header[12..16].copy_from_slice(&(HEADER as u32).to_le_bytes());
    header[16..24].copy_from_slice(&count.unwrap_or(UNKNOWN).to_le_bytes());
    header
}

/// A number of a binary header that may not be known.
pub(super) fn known(number: u64) -> Option<u64> {
    (number != UNKNOWN).then_some(number)
}

/// A digest of a binary header; all zero for none.
pub(super) fn digest(header: &[u8; HEADER], at: usize) -> Option<Digest> {
    let bytes = header.get(at..at + 16)?.try_into().ok()?;
    (bytes != [0; 16]).then_some(Digest(bytes))
}
