//! What the sensor is: from a TOML file to a checked [`Design`].
//!
//! 1. `document`: the text, what it extends, and the defaults become one table, and every value
//!    remembers its line and column.
//! 2. `file`: the table is read as typed keys.
//! 3. `check`: every limit is tested once; what is left is SI units and integers.
//!
//! A `Design` that exists is valid, and nobody downstream checks it again.

mod band;
mod budget;
mod check;
mod derived;
pub mod detectors;
mod directions;
mod document;
mod effect;
mod family;
mod file;
mod moments;
mod presets;
pub mod safety;

use std::path::Path;
use std::sync::OnceLock;

pub use band::{MOST_SIGMA, PARTS_OF_TICK};
pub use budget::{Budget, Field, Trailing, solid_angle};
pub use derived::Derived;
pub use detectors::Detector;
pub use directions::Directions;
pub use document::{WITH, WITHOUT};
pub use effect::Effect;
pub use family::family_from_toml;
pub use file::{Firing, Label, Mirror};
pub use presets::{names as preset_names, text as preset_text};

use crate::digest::Digest;
use macropulse_codec::code::Codebook;
use macropulse_codec::decode::Receiver;

/// A sensor, checked, in SI units.
#[derive(Debug, Clone)]
pub struct Design {
    /// Short name, as in the file.
    pub name: String,
    /// One sentence.
    pub summary: String,
    /// Where and when the sensor looks.
    pub scan: Scan,
    /// The light it sends.
    pub light: Light,
    /// The language its shots speak; a single mark where they are not coded.
    pub coding: Coding,
    /// Where the photons come from; `None` where the detector is declared by its sensitivity.
    pub budget: Option<Budget>,
    /// From light to detection events.
    pub detector: Detector,
    /// From detection events to ticks.
    pub tdc: Tdc,
    /// From ticks to returns.
    pub receiver: Receiver,
    /// Range error up to which a return counts as right, m.
    pub right_within: f64,
    /// Effects that are left out.
    pub idealised: Vec<Effect>,
    /// Values nobody wrote: dotted key and value.
    pub defaults: Vec<(String, String)>,
    /// What a user should know although it is no error.
    pub warnings: Vec<String>,
    /// The whole sensor as TOML, defaults included: the same design without the files it came from.
    pub text: String,
    /// Made when first asked for.
    directions: OnceLock<Directions>,
}

/// Where and when the sensor looks.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Rows of the range image.
    pub rows: u32,
    /// Columns of the range image.
    pub columns: u32,
    /// Scans in 1000 s: an integer, so that shot times are exact fractions.
    pub rate_millihertz: u64,
    /// Nearest range accepted, m.
    pub min_range: f64,
    /// Range the sensor is declared to reach, m.
    pub reach: f64,
    /// Farthest range accepted, m: the end of the range gate, at or beyond the reach.
    pub max_range: f64,
    /// Range to which the light of a shot is followed, m: beyond the gate, because what returns
    /// from there arrives in the gates of later shots.
    pub light_range: f64,
    /// Whether the mirror moves on during a macropulse.
    pub moves: bool,
    /// How directions follow each other.
    pub pattern: Pattern,
}

/// How directions follow each other.
#[derive(Debug, Clone, PartialEq)]
pub enum Pattern {
    /// One beam, line by line.
    Raster {
        /// Full horizontal field, rad.
        horizontal: f64,
        /// Full vertical field, rad.
        vertical: f64,
        /// Motion of the fast axis.
        mirror: Mirror,
        /// Fraction of the line time in which shots are fired.
        duty: f64,
    },
    /// Fixed elevations on a turning head.
    Spinning {
        /// Elevation of each row, rad, from the top.
        elevations: Vec<f64>,
        /// Rows in the order in which they fire.
        order: Vec<u16>,
        /// When they fire.
        firing: Firing,
    },
    /// Every direction at once.
    Flash {
        /// Full horizontal field, rad.
        horizontal: f64,
        /// Full vertical field, rad.
        vertical: f64,
    },
}

/// The light a sensor sends.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// Wavelength, m.
    pub wavelength: f64,
    /// Beam diameter at the sensor (1/e²), m.
    pub beam_diameter: f64,
    /// Full divergence (1/e²), rad; zero where the footprint is idealised away.
    pub divergence: f64,
    /// Rays that sample the footprint: 1, 7 or 19.
    pub footprint_rays: u32,
    /// Length of one micropulse (full width at half maximum), s.
    pub pulse: f64,
    /// Its rms length, s, where its light is followed into neighbouring chips; `None` where it is
    /// taken to stay in its own.
    pub spread: Option<f64>,
}

/// How shots are told apart.
#[derive(Debug, Clone)]
pub struct Coding {
    /// Marks of every label and word.
    pub codebook: Codebook,
    /// Length of a chip, fs; of the whole shot where it is not coded.
    pub chip_fs: i64,
    /// Which number a macropulse carries; `None` where shots are not coded.
    pub label: Option<Label>,
    /// The word of pixel `n` of a scan is `first_word + n mod word_modulus`.
    pub first_word: u32,
    /// See `first_word`.
    pub word_modulus: u32,
}

impl Coding {
    /// The number that a shot to `column` carries; 0 where it carries none.
    pub fn label_of(&self, column: u16) -> u16 {
        match self.label {
            Some(Label::Column) => column,
            Some(Label::None) | None => 0,
        }
    }
}

/// The bank of time-to-digital converters.
#[derive(Debug, Clone, PartialEq)]
pub struct Tdc {
    /// Converters in the bank (for all detectors together).
    pub converters: u32,
    /// Length of a tick, fs.
    pub tick_fs: i64,
    /// Period of the counter of whole clock ticks, fs.
    pub clock_fs: i64,
    /// Time for which a converter is busy with one event, fs.
    pub dead_fs: i64,
}

impl Design {
    /// The sensor called `name_or_file`: a ready one, or a TOML file.
    ///
    /// # Errors
    /// Says in one sentence what is wrong with the name or the file, and where.
    pub fn open(name_or_file: &str, overrides: &[(String, String)]) -> Result<Self, Error> {
        let (text, origin, folder) = document::open(name_or_file, Path::new(""))?;
        Self::from_toml(&text, &origin, &folder, overrides)
    }

    /// The sensor written in `text`. `origin` stands in error messages for the file name,
    /// `folder` is where files named in `extends` are looked for.
    ///
    /// # Errors
    /// As [`Design::open`].
    pub fn from_toml(
        text: &str,
        origin: &str,
        folder: &Path,
        overrides: &[(String, String)],
    ) -> Result<Self, Error> {
        check::design(&document::Chain::read(text, origin, folder, overrides)?)
    }

    /// Whether shots carry a code.
    pub fn is_coded(&self) -> bool {
        self.coding.label.is_some()
    }

    /// Number of separate detectors.
    pub fn channels(&self) -> u32 {
        self.scan.channels()
    }

    /// Converters of the bank that each detector has.
    pub fn converters_per_channel(&self) -> u32 {
        self.tdc.converters / self.channels()
    }

    /// Shots in one scan.
    pub fn shots_per_scan(&self) -> u64 {
        u64::from(self.scan.rows) * u64::from(self.scan.columns)
    }

    /// Where its pixels lie.
    pub fn directions(&self) -> &Directions {
        self.directions.get_or_init(|| Directions::of_scan(&self.scan))
    }

    /// Duration of one scan, s.
    pub fn scan_period(&self) -> f64 {
        self.scan.period()
    }

    /// A hash of everything the sensor file says, defaults included.
    pub fn digest(&self) -> String {
        let mut hash = Digest::new();
        hash.bytes(self.text.as_bytes());
        hash.text()
    }

    /// What follows from the file, for people to read.
    pub fn derived(&self) -> Derived {
        Derived::of(self)
    }
}

/// Somebody wrote a wrong sensor file: where, and what to do. Where several things are wrong that
/// do not follow from each other it says all of them, one to a line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{}", self.sentences().collect::<Vec<_>>().join("\n"))]
pub struct Error {
    origin: String,
    line_column: Option<(usize, usize)>,
    path: String,
    message: String,
    /// Further faults, each on its own.
    others: Vec<Error>,
}

impl Error {
    /// An error about a file as a whole.
    fn whole(origin: &str, message: impl Into<String>) -> Self {
        Self {
            origin: origin.to_owned(),
            line_column: None,
            path: String::new(),
            message: message.into(),
            others: Vec::new(),
        }
    }

    /// All of `faults` as one error; `None` where there is none.
    fn all(faults: Vec<Self>) -> Option<Self> {
        let mut faults = faults.into_iter();
        let first = faults.next()?;
        Some(Self { others: faults.collect(), ..first })
    }

    /// What is wrong: a sentence with its place for each fault, in the order of the file's
    /// sections.
    pub fn sentences(&self) -> impl Iterator<Item = String> {
        std::iter::once(self).chain(&self.others).map(Self::sentence)
    }

    fn sentence(&self) -> String {
        format!("{}{}{}", self.place(), self.key(), self.message)
    }

    fn place(&self) -> String {
        match self.line_column {
            Some((line, column)) => format!("{}:{line}:{column}: ", self.origin),
            None => format!("{}: ", self.origin),
        }
    }

    fn key(&self) -> String {
        if self.path.is_empty() { String::new() } else { format!("{}: ", self.path) }
    }
}
