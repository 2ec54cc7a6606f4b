//! Faults of commands: what went wrong, whose fault it is, and the exit code that says so.

use std::io;
use std::slice;

use macropulse::{channel, design, environment, formats, predict, scene, sim, told};
use macropulse_study::{decoding, designs, paper, record, sweep, validate};

/// The exit code that a shell expects of a program ended by Ctrl-C.
pub const INTERRUPTED: u8 = 130;

/// Why a command did not do what was asked.
#[derive(Debug)]
pub enum Fault {
    /// A file, name or option that was typed wrong.
    Wrong(String),
    /// As `Wrong`, for several reasons at once: a sentence each.
    AllWrong(Vec<String>),
    /// As `Wrong`, and said already.
    Told,
    /// The program, or the machine under it.
    Ours(String),
    /// Ctrl-C.
    Interrupted,
}

impl Fault {
    /// A file that cannot be read, in words of ours.
    pub fn unreadable(name: &str, error: &io::Error) -> Self {
        Self::Wrong(format!("{name}: cannot be read: {}", told::unreadable(error)))
    }

    /// Fault of a write that failed, as the `sentence` says: the name of the place was wrong, or the machine
    /// does not take it.
    pub fn unwritten(sentence: String, error: &io::Error) -> Self {
        match told::is_of_the_machine(error) {
            true => Self::Ours(sentence),
            false => Self::Wrong(sentence),
        }
    }

    /// Fault of a write to standard output that failed.
    pub fn unprinted(error: &io::Error) -> Self {
        Self::Ours(format!("cannot write to standard output: {}", told::unwritable(error)))
    }

    /// The reasons, one sentence each.
    pub fn sentences(&self) -> &[String] {
        match self {
            Self::Wrong(sentence) | Self::Ours(sentence) => slice::from_ref(sentence),
            Self::AllWrong(sentences) => sentences,
            Self::Told | Self::Interrupted => &[],
        }
    }

    /// The exit code of the program.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Wrong(_) | Self::AllWrong(_) | Self::Told => 2,
            Self::Ours(_) => 1,
            Self::Interrupted => INTERRUPTED,
        }
    }
}

impl From<design::Error> for Fault {
    fn from(error: design::Error) -> Self {
        Self::AllWrong(error.sentences().collect())
    }
}

/// Errors that are mistakes in files, names and options alone.
macro_rules! mistakes {
    ($($error:ty),+) => {$(
        impl From<$error> for Fault {
            fn from(error: $error) -> Self {
                Self::Wrong(error.to_string())
            }
        }
    )+};
}

mistakes!(
    scene::Error,
    environment::Error,
    channel::Error,
    predict::Error,
    macropulse::codec::decode::Error
);

impl From<sim::Error> for Fault {
    fn from(error: sim::Error) -> Self {
        match error {
            sim::Error::Operating(error) => error.into(),
            sim::Error::Decode(_) => Self::Ours(error.to_string()),
        }
    }
}

impl From<formats::Error> for Fault {
    fn from(error: formats::Error) -> Self {
        match error {
            formats::Error::Uneven { .. } => Self::Ours(error.to_string()),
            formats::Error::Write { ref cause, .. } => Self::unwritten(error.to_string(), cause),
            _ => Self::Wrong(error.to_string()),
        }
    }
}

impl From<record::Error> for Fault {
    fn from(error: record::Error) -> Self {
        match error {
            record::Error::Formats(error) => error.into(),
            record::Error::View(error) => Self::Ours(error.to_string()),
            record::Error::Unreadable { path, cause } => {
                Self::unreadable(&path.display().to_string(), &cause)
            }
            wrong => Self::Wrong(wrong.to_string()),
        }
    }
}

impl From<decoding::Error> for Fault {
    fn from(error: decoding::Error) -> Self {
        match error {
            decoding::Error::Unreadable { name, cause } => Self::unreadable(&name, &cause),
            wrong => Self::Wrong(wrong.to_string()),
        }
    }
}

impl From<validate::Error> for Fault {
    fn from(error: validate::Error) -> Self {
        match error {
            validate::Error::Stopped => Self::Interrupted,
            validate::Error::Formats(error) => error.into(),
            other => Self::Ours(other.to_string()),
        }
    }
}

impl From<sweep::Error> for Fault {
    fn from(error: sweep::Error) -> Self {
        match error {
            sweep::Error::Formats(error) => error.into(),
            sweep::Error::View(error) => Self::Ours(error.to_string()),
            sweep::Error::Simulation(error) => error.into(),
            wrong => Self::Wrong(wrong.to_string()),
        }
    }
}

impl From<designs::Error> for Fault {
    fn from(error: designs::Error) -> Self {
        match error {
            designs::Error::Formats(error) => error.into(),
            designs::Error::View(error) => Self::Ours(error.to_string()),
            designs::Error::Simulation(error) => error.into(),
            wrong => Self::Wrong(wrong.to_string()),
        }
    }
}

impl From<paper::Error> for Fault {
    fn from(error: paper::Error) -> Self {
        match error {
            paper::Error::Stopped => Self::Interrupted,
            paper::Error::Folder { ref source, .. } => Self::unwritten(error.to_string(), source),
            paper::Error::Record(error) => error.into(),
            paper::Error::Formats(error) => error.into(),
            ours => Self::Ours(ours.to_string()),
        }
    }
}
