//! The light of a shot: a macropulse, a burst of equal pulses, `[burst]`, or light whose power or frequency
//! is modulated.

use schemars::JsonSchema;
use serde::Deserialize;

use super::limits::Check;
use super::{Chirp, Clock, Coding, Error, Modulation};
use crate::units::{fs_from_s, s_from_fs};

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

/// Equal pulses at a fixed interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Burst {
    /// The pulse, as a code word of one mark.
    pub pulse: Coding,
    /// Pulses of a shot.
    pub pulses: u32,
    /// Time from pulse to pulse, fs: a whole number of ticks.
    pub interval_fs: i64,
}

impl Emission {
    /// The code words, or the single pulse, that are sent once or repeatedly; of light without pulses its beginning.
    pub fn coding(&self) -> &Coding {
        match self {
            Self::Marks(coding) => coding,
            Self::Burst(burst) => &burst.pulse,
            Self::Modulated(modulation) => &modulation.shot,
            Self::Chirped(chirp) => &chirp.shot,
        }
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

    /// The chirp, if the frequency of its light is modulated.
    pub fn chirp(&self) -> Option<&Chirp> {
        match self {
            Self::Chirped(chirp) => Some(chirp),
            _ => None,
        }
    }

    /// True if it sends pulses.
    pub fn is_pulsed(&self) -> bool {
        matches!(self, Self::Marks(_) | Self::Burst(_))
    }

    /// True if shots carry a code.
    pub fn is_coded(&self) -> bool {
        self.coding().label.is_some()
    }

    /// Time from the beginning of a shot's first chip to the end of its last one, fs.
    pub fn length_fs(&self) -> i64 {
        match self {
            Self::Modulated(modulation) => return modulation.length_fs(),
            Self::Chirped(chirp) => return chirp.length_fs(),
            Self::Marks(_) | Self::Burst(_) => {}
        }
        let coding = self.coding();
        let word = i64::from(coding.codebook.chips()) * coding.chip_fs;
        let repeated =
            self.burst().map_or(0, |burst| i64::from(burst.pulses - 1) * burst.interval_fs);
        repeated + word
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
        self.modulation().map_or_else(|| self.mean_pulses(), |it| f64::from(it.taps()))
    }

    /// How long a part lasts, fs, where it is not a pulse.
    pub fn part_fs(&self) -> Option<i64> {
        match self {
            Self::Marks(_) | Self::Burst(_) => None,
            Self::Modulated(modulation) => Some(modulation.exposure_fs),
            Self::Chirped(chirp) => Some(chirp.length_fs()),
        }
    }

    /// The largest share of a shot's energy that is sent within `seconds`, taking all of its marks
    /// together: 1 of a macropulse.
    pub fn share_within(&self, seconds: f64) -> f64 {
        match self {
            Self::Marks(_) => 1.0,
            Self::Burst(burst) => {
                let within = fs_from_s(seconds) / burst.interval_fs + 1;
                (within as f64 / f64::from(burst.pulses)).min(1.0)
            }
            Self::Modulated(modulation) => modulation.share_within(seconds),
            Self::Chirped(chirp) => (seconds / s_from_fs(chirp.length_fs())).min(1.0),
        }
    }
}

/// `[burst]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct BurstFile {
    /// Pulses of a shot.
    #[schemars(range(min = 1, max = 16777216))]
    pulses: u32,
    /// Time from pulse to pulse, ns: a whole number of ticks.
    #[schemars(range(min = 0.001, max = 1e6))]
    interval_ns: f64,
}

impl Check<'_> {
    /// The burst of `pulse`.
    pub(super) fn burst(
        &self,
        file: &BurstFile,
        pulse: Coding,
        clock: Clock,
    ) -> Result<Burst, Error> {
        let key = "burst.interval_ns";
        let interval_fs =
            self.whole_fs(key, self.within(key, file.interval_ns, 1e-3, 1e6)? * 1e3)?;
        if interval_fs % clock.tick_fs != 0 {
            return self.refuse(key, "must be a whole number of ticks, of which a bin is one");
        }
        let pulses = self.count("burst.pulses", file.pulses, 1, 1 << 24)?;
        Ok(Burst { pulse, pulses, interval_fs })
    }
}
