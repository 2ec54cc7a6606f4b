//! The sensor: from a TOML file to a checked [`Design`].
//!
//! 1. `document`: the text, what it extends, and the defaults become one table, and every value
//!    remembers its line and column.
//! 2. Each section is a file of its own here: its keys as typed, their limits, and what they are in
//!    SI units and integers.
//! 3. `check` goes through the sections in their order and tells all that is wrong.
//!
//! A `Design` that exists is valid, and no stage checks it again.

mod band;
mod budget;
mod burst;
mod check;
mod chirp;
mod coding;
mod derived;
pub mod detector;
mod document;
mod effect;
pub mod emission;
mod family;
mod histogram;
mod light;
mod limits;
mod modulation;
mod presets;
pub mod readout;
mod receiver;
mod recorded;
pub mod safety;
mod scan;
mod schema;
mod spectrum;
mod work;

use std::path::Path;
use std::sync::OnceLock;

pub use band::{MOST_SIGMA, PARTS_OF_TICK};
pub use budget::{Budget, CoScanned, Field, solid_angle};
pub use burst::Burst;
pub use chirp::{Chirp, ChirpError};
pub use coding::{Coding, Label};
pub use derived::Derived;
pub use detector::Detector;
pub use document::{WITH, WITHOUT};
pub use effect::Effect;
pub use emission::Emission;
pub use family::family_from_toml;
pub use histogram::Histogram;
pub use light::Light;
pub use modulation::{Modulation, Wave};
pub use presets::{names as preset_names, text as preset_text};
pub use readout::{Clock, Readout, Tdc};
pub use scan::{
    Directions, Extent, Firing, Flash, Gates, Grid, Laser, Mirror, Pattern, Polygon, Raster, Scan,
    Spinning, Steered, Table,
};
pub use schema::schema;
pub use spectrum::{Fidelity, Spectrum};
pub use work::SHOTS_OF_BAND;

use crate::digest::Digest;
use macropulse_codec::decode::Receiver;

/// Keys of a sensor file that exclude each other, by their table. A table that has a name has exactly one of them;
/// the front end tells which one stands at the top of the file, if any.
const ALTERNATIVES: [(&str, &[&str]); 6] = [
    ("", &["comparator", "adc"]),
    ("scan", Pattern::NAMES),
    ("detector", Detector::NAMES),
    ("family", family::FAMILIES),
    ("spinning", &["blocks", "lasers", "calibration"]),
    ("spinning", &["azimuth_step_deg", "cycle_us"]),
];

/// A sensor, checked, in SI units.
#[derive(Debug, Clone)]
pub struct Design {
    /// Short name, as in the file.
    pub name: String,
    /// One sentence.
    pub summary: String,
    /// Directions and times at which the sensor looks.
    pub scan: Scan,
    /// The light it sends.
    pub light: Light,
    /// The light of a shot.
    pub emission: Emission,
    /// Source of the photons; `None` if the detector is declared by its sensitivity.
    pub budget: Option<Budget>,
    /// From light to detection events.
    pub detector: Detector,
    /// The ticks in which the receiver counts.
    pub clock: Clock,
    /// From what the detector puts out to the record.
    pub readout: Readout,
    /// From ticks to returns.
    pub receiver: Receiver,
    /// Range error up to which a return counts as right, m.
    pub right_within: f64,
    /// Effects that are left out.
    pub idealised: Vec<Effect>,
    /// Values taken from the defaults: dotted key and value.
    pub defaults: Vec<(String, String)>,
    /// Remarks for a user that are no errors.
    pub warnings: Vec<String>,
    /// The whole sensor as TOML, defaults included: the same design without the files it extends. A
    /// calibration or a table stays in its file.
    pub text: String,
    /// Made when first asked for.
    directions: OnceLock<Directions>,
}

impl Design {
    /// The sensor called `name_or_file`: a ready one, or a TOML file.
    ///
    /// # Errors
    /// Says in one sentence what is wrong with the name or the file, and where.
    pub fn open(
        name_or_file: impl AsRef<Path>,
        overrides: &[(String, String)],
    ) -> Result<Self, Error> {
        let (text, origin, folder) = document::open(name_or_file.as_ref(), Path::new(""))?;
        Self::from_toml(&text, &origin, &folder, overrides)
    }

    /// True if its receiver measures radial velocities.
    pub fn measures_speed(&self) -> bool {
        self.emission.model().measures_speed()
    }

    /// Detections per photon that reaches the detector. A sensor that declares its sensitivity leaves this open:
    /// 1, and the photons that reach its detector stand for those that it detects.
    pub fn efficiency(&self) -> f64 {
        self.budget.as_ref().map_or(1.0, |budget| budget.efficiency)
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
        check::design(&document::Chain::read(text, origin, folder, overrides, &ALTERNATIVES)?)
    }

    /// The sensor that `table` describes, as a sensor file does. `origin` stands in error messages
    /// before the key, `folder` is where files named in `extends` are looked for.
    ///
    /// # Errors
    /// As [`Design::open`], with the key as the place.
    pub fn from_table(
        table: &toml::Table,
        origin: &str,
        folder: &Path,
        overrides: &[(String, String)],
    ) -> Result<Self, Error> {
        check::design(&document::Chain::of_table(table, origin, folder, overrides, &ALTERNATIVES)?)
    }

    /// True if shots carry a code.
    pub fn is_coded(&self) -> bool {
        self.emission.is_coded()
    }

    /// Number of separate detectors.
    pub fn channels(&self) -> u32 {
        self.scan.channels()
    }

    /// The time-to-digital converters of each detector; `None` where events are not timed.
    pub fn bank(&self) -> Option<Tdc> {
        self.readout.tdc().map(|tdc| tdc.share(self.channels()))
    }

    /// Shots in one scan.
    pub fn shots_per_scan(&self) -> u64 {
        self.scan.shots()
    }

    /// Directions of its pixels.
    pub fn directions(&self) -> &Directions {
        self.directions.get_or_init(|| self.scan.model().directions())
    }

    /// The limits of laser class 1 for a shot. They are empty if no rule fits the wavelength or the scan, or
    /// if the detector is declared by its sensitivity. If eye safety is idealised, they are worked out when
    /// first asked for.
    pub fn eye_limits(&self) -> &[safety::Limit] {
        let Self { scan, light, emission, .. } = self;
        self.budget.as_ref().map_or(&[], |budget| budget.limits(scan, light, emission))
    }

    /// Duration of one scan, s.
    pub fn scan_period(&self) -> f64 {
        self.scan.period()
    }

    /// Speed at which `shots` of its shots, or what follows from them, took `seconds`: the time
    /// that the sensor takes for them over that. Above 1 is faster than the sensor.
    pub fn speed(&self, shots: f64, seconds: f64) -> f64 {
        shots / self.shots_per_scan() as f64 * self.scan_period() / seconds
    }

    /// A hash of everything the sensor file says, defaults and the files it names included.
    pub fn digest(&self) -> String {
        let mut hash = Digest::new();
        hash.bytes(self.text.as_bytes());
        if let Some(file) = self.scan.model().file_digest() {
            hash.bytes(file.as_bytes());
        }
        hash.text()
    }

    /// Figures that follow from the file, for people to read.
    pub fn derived(&self) -> Derived {
        Derived::of(self)
    }
}

/// A sensor file is wrong: where, and what to do. If several things are wrong that do not follow from each
/// other, it says all of them, one to a line.
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

    /// A sentence with its place for each fault, in the order of the file's sections.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_the_sensor_that_its_text_is() {
        let text = "extends = \"peregrine\"\nname = \"mine\"\nscan.max_range_m = 40\n";
        let table: toml::Table = text.parse().unwrap();
        let made = Design::from_table(&table, "a dictionary", Path::new(""), &[]).unwrap();
        let read = Design::from_toml(text, "mine.toml", Path::new(""), &[]).unwrap();
        assert_eq!((made.digest(), made.scan.rated_range), (read.digest(), 40.0));
        let set = [("scan.max_range_m".to_owned(), "30".to_owned())];
        let set = Design::from_table(&table, "a dictionary", Path::new(""), &set).unwrap();
        assert_eq!(set.scan.rated_range, 30.0);
    }

    #[test]
    fn what_is_wrong_in_a_table_is_named_by_its_key() {
        let text = "extends = \"peregrine\"\nscan.max_rnage_m = 40\n";
        let told = Design::from_table(&text.parse().unwrap(), "a dictionary", Path::new(""), &[]);
        assert_eq!(
            told.unwrap_err().to_string(),
            "a dictionary: scan.max_rnage_m: unknown key `max_rnage_m`; did you mean `max_range_m`?"
        );
    }

    #[test]
    fn speed_is_the_time_of_the_sensor_over_ours() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let (shots, period) = (design.shots_per_scan() as f64, design.scan_period());
        assert_eq!(design.speed(shots, period), 1.0);
        assert_eq!(design.speed(shots, 4.0 * period), 0.25);
        assert_eq!(design.speed(3.0 * shots, period), 3.0);
    }
}
