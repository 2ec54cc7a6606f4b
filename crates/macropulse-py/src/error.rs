//! Errors as exceptions, in the sentences of the program.

use std::error::Error as StdError;
use std::io;
use std::path::Path;

use macropulse::{channel, codec, design, emit, environment, formats, predict, scene, sim};
use macropulse_study::{decoding, record, sent, sweep, view};
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyUserWarning, PyValueError};
use pyo3::prelude::*;

pyo3::create_exception!(
    macropulse,
    Error,
    PyValueError,
    "Something that was asked for cannot be: the sentence says where, and what to do about it."
);

pyo3::create_exception!(
    macropulse,
    Fault,
    PyRuntimeError,
    "A fault of Macropulse and not of what it was given: please report it."
);

/// Origin of a change in the messages of the program, stripped here: Python has no `--set`.
const SET: &str = "--set: ";

/// An error of the library as an exception.
pub trait Raise {
    /// The exception.
    fn raise(self) -> PyErr;
}

/// As [`Raise::raise`] of an error.
pub trait OrRaise<T> {
    /// Returns the value, or else the exception.
    ///
    /// # Errors
    /// The exception of the error.
    fn or_raise(self) -> PyResult<T>;
}

impl<T, E: Raise> OrRaise<T> for Result<T, E> {
    fn or_raise(self) -> PyResult<T> {
        self.map_err(Raise::raise)
    }
}

/// Returns the exception for a request that cannot be met.
pub fn wrong(sentence: impl Into<String>) -> PyErr {
    Error::new_err(sentence.into())
}

/// Warns of something that a user should know although nothing went wrong. The warning names the line that
/// called us.
///
/// # Errors
/// The exception that Python turns warnings into, if it does.
pub fn warned(py: Python<'_>, told: impl Into<String>) -> PyResult<()> {
    let category = py.get_type::<PyUserWarning>();
    py.import("warnings")?.call_method1("warn", (told.into(), category, 2)).map(|_| ())
}

/// A fault of ours.
pub fn fault(why: &dyn StdError) -> PyErr {
    Fault::new_err(why.to_string())
}

/// The world would not give or take the file at `path`: the exception that Python has for that.
pub fn of_file(path: &Path, why: &io::Error) -> PyErr {
    let path = path.display().to_string();
    match why.raw_os_error() {
        Some(number) => {
            let said = why.to_string();
            let said = said.split(" (os error").next().unwrap_or(&said).to_owned();
            PyOSError::new_err((number, said, path))
        }
        None => match number(why.kind()) {
            Some((number, said)) => PyOSError::new_err((number, said, path)),
            None => PyOSError::new_err(format!("{path}: {why}")),
        },
    }
}

/// The number that systems have for a kind of error, by which Python chooses its exception, and what
/// they say of it; for errors that came without.
fn number(kind: io::ErrorKind) -> Option<(i32, &'static str)> {
    match kind {
        io::ErrorKind::NotFound => Some((2, "No such file or directory")),
        io::ErrorKind::PermissionDenied => Some((13, "Permission denied")),
        io::ErrorKind::NotADirectory => Some((20, "Not a directory")),
        io::ErrorKind::IsADirectory => Some((21, "Is a directory")),
        io::ErrorKind::StorageFull => Some((28, "No space left on device")),
        _ => None,
    }
}

impl Raise for design::Error {
    fn raise(self) -> PyErr {
        let plain = |one: String| one.strip_prefix(SET).map_or(one.clone(), str::to_owned);
        wrong(self.sentences().map(plain).collect::<Vec<_>>().join("\n"))
    }
}

impl Raise for scene::Error {
    fn raise(self) -> PyErr {
        match &self {
            Self::Unreadable { path, source } => of_file(path, source),
            _ => wrong(self.to_string()),
        }
    }
}

impl Raise for environment::Error {
    fn raise(self) -> PyErr {
        wrong(self.to_string())
    }
}

impl Raise for channel::Error {
    fn raise(self) -> PyErr {
        wrong(self.to_string())
    }
}

impl Raise for predict::Error {
    fn raise(self) -> PyErr {
        wrong(self.to_string())
    }
}

impl Raise for sim::Error {
    fn raise(self) -> PyErr {
        match self {
            Self::Operating(error) => error.raise(),
            Self::Decode(_) => fault(&self),
        }
    }
}

impl Raise for codec::decode::Error {
    fn raise(self) -> PyErr {
        wrong(self.to_string())
    }
}

impl Raise for codec::code::Error {
    fn raise(self) -> PyErr {
        wrong(self.to_string())
    }
}

impl Raise for formats::Error {
    fn raise(self) -> PyErr {
        match &self {
            Self::Write { path, cause } | Self::Read { path, cause } => of_file(path, cause),
            _ => wrong(self.to_string()),
        }
    }
}

impl Raise for view::Error {
    fn raise(self) -> PyErr {
        fault(&self)
    }
}

impl Raise for record::Error {
    fn raise(self) -> PyErr {
        match self {
            Self::Formats(error) => error.raise(),
            Self::View(error) => error.raise(),
            Self::Unreadable { path, cause } => of_file(&path, &cause),
            Self::Manifest { .. } | Self::NoCloud { .. } => wrong(self.to_string()),
        }
    }
}

impl Raise for decoding::Error {
    fn raise(self) -> PyErr {
        match &self {
            Self::Unreadable { name, cause } => of_file(Path::new(name), cause),
            _ => wrong(self.to_string()),
        }
    }
}

impl Raise for sent::Error {
    fn raise(self) -> PyErr {
        wrong(self.to_string())
    }
}

impl Raise for sweep::Error {
    fn raise(self) -> PyErr {
        match self {
            Self::Design(error) => error.raise(),
            Self::Scene(error) => error.raise(),
            Self::Operating(error) => error.raise(),
            Self::Simulation(error) => error.raise(),
            Self::Formats(error) => error.raise(),
            Self::View(error) => error.raise(),
            Self::Asked(sentence) => wrong(sentence.replacen(SET, "", 1)),
        }
    }
}

/// Refuses a scan that the clock of the sensor does not count to.
///
/// # Errors
/// The sentence, if it is beyond the last.
pub fn check_scan(design: &design::Design, scan: u64) -> PyResult<()> {
    let last = emit::most_scans(design).saturating_sub(1);
    match scan > last {
        true => {
            Err(wrong(format!("scan {scan}: scans of {} are numbered 0 to {last}", design.name)))
        }
        false => Ok(()),
    }
}
