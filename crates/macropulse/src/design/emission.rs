//! The light of a shot: the list of its kinds, and the questions that each of them answers.

use super::{Burst, Chirp, Coding, Modulation};

/// The light that a shot sends.
#[derive(Debug, Clone, PartialEq)]
pub enum Emission {
    /// One macropulse: the pulses ("marks") of a code word, a single one where shots are not coded.
    Marks(Coding),
    /// A single pulse again and again.
    Burst(Burst),
    /// Light whose power is modulated.
    Modulated(Modulation),
    /// Light whose frequency is modulated.
    Chirped(Chirp),
}

/// The light of a shot of any kind.
pub trait Model {
    /// The code words, or the single pulse, that are sent once or repeatedly; of light without pulses its beginning.
    fn coding(&self) -> &Coding;

    /// Time from the beginning of a shot's first chip to the end of its last one, fs.
    fn length_fs(&self) -> i64;

    /// The stretches in which light without pulses shines; `None` of pulses.
    fn exposures(&self) -> Option<Exposures> {
        None
    }

    /// Parts of a shot that are recorded one by one.
    fn recorded_parts(&self) -> u32 {
        1
    }

    /// The largest share of a shot's energy that is sent within `seconds`, taking all of its marks
    /// together: 1 of a macropulse.
    fn share_within(&self, _seconds: f64) -> f64 {
        1.0
    }

    /// How long a shot occupies its detector. `None` of a macropulse, which shares it with others.
    fn occupancy(&self) -> Option<Occupancy> {
        None
    }

    /// Time, s, after which echoes of the same shot look alike again; `None` if its code words decide that, or
    /// if they never do.
    fn repeats_after(&self) -> Option<f64> {
        None
    }

    /// The event at the end of the unambiguous range, or its bound: a clause for people.
    fn ambiguity(&self) -> &'static str {
        "by the detector alone: shots carry no code"
    }

    /// True if the motion of a surface changes the record of its echo.
    fn sees_motion(&self) -> bool {
        false
    }

    /// True if a speed can be told from the record of a shot.
    fn measures_speed(&self) -> bool {
        false
    }

    /// Gives `add` the numbers that decide what is sent, beside those of the code words.
    fn numbers(&self, _add: &mut dyn FnMut(&[u64])) {}

    /// Describes light other than a single macropulse line by line, for people. `number` writes numbers.
    fn description(&self, _number: fn(f64) -> String) -> Vec<String> {
        Vec::new()
    }
}

/// Stretches of equal length in which light without pulses shines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exposures {
    /// Their number.
    pub count: u32,
    /// How long each lasts, fs.
    pub each_fs: i64,
}

/// The time for which a shot has its detector to itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Occupancy {
    /// How long it is, fs.
    pub fs: i64,
    /// The table of the sensor file that decides it.
    pub table: &'static str,
    /// The part of it beside the light itself: a clause with a blank before it, or nothing.
    pub with: &'static str,
    /// How to shorten it.
    pub remedy: &'static str,
}

impl Emission {
    /// The model of its kind.
    pub fn model(&self) -> &dyn Model {
        match self {
            Self::Marks(coding) => coding,
            Self::Burst(burst) => burst,
            Self::Modulated(modulation) => modulation,
            Self::Chirped(chirp) => chirp,
        }
    }

    /// As [`Model::coding`].
    pub fn coding(&self) -> &Coding {
        self.model().coding()
    }

    /// The burst, if it is one.
    pub fn burst(&self) -> Option<&Burst> {
        match self {
            Self::Burst(burst) => Some(burst),
            _ => None,
        }
    }

    /// The modulation, if the power of its light is modulated.
    pub fn modulation(&self) -> Option<&Modulation> {
        match self {
            Self::Modulated(modulation) => Some(modulation),
            _ => None,
        }
    }

    /// True if it sends pulses.
    pub fn is_pulsed(&self) -> bool {
        self.model().exposures().is_none()
    }

    /// True if shots carry a code.
    pub fn is_coded(&self) -> bool {
        self.coding().label.is_some()
    }

    /// As [`Model::length_fs`].
    pub fn length_fs(&self) -> i64 {
        self.model().length_fs()
    }

    /// Moments at which shots are fired are multiples of this, fs.
    pub fn grid_fs(&self) -> i64 {
        self.coding().chip_fs
    }

    /// Pulses of a shot, the mean over its labels and words; 1 of light without pulses.
    pub fn mean_pulses(&self) -> f64 {
        let repeats = self.burst().map_or(1, |burst| burst.pulses);
        self.coding().codebook.mean_weight() * f64::from(repeats)
    }

    /// Parts of a shot that are sent one by one, the mean over its labels and words: pulses, exposures, or the whole shot.
    pub fn mean_parts(&self) -> f64 {
        let exposures = self.model().exposures();
        exposures.map_or_else(|| self.mean_pulses(), |exposures| f64::from(exposures.count))
    }

    /// How long a part lasts, fs, where it is not a pulse.
    pub fn part_fs(&self) -> Option<i64> {
        self.model().exposures().map(|exposures| exposures.each_fs)
    }
}
