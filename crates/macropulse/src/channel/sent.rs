//! The light of a shot of another lidar, by the clock of the sensor that receives it.

use macropulse_codec::decode::beat::Ramp;

use super::Varies;
use crate::design::emission::Model;
use crate::design::{Chirp, Design, Emission, Modulation};
use crate::scene::Mount;
use crate::units::{frequency_from_wavelength, s_from_fs};

/// The light of a shot of another lidar.
pub(super) enum Sent {
    /// A macropulse, or the pulses of a burst one after another.
    Pulses {
        /// Their number.
        count: u64,
        /// Time from one to the next, fs.
        interval_fs: f64,
    },
    /// Light without pulses, part by part.
    Parts(Vec<Part>),
}

/// A part of a shot of light without pulses: the exposure of a tap, or a ramp.
pub(super) struct Part {
    /// When it begins, fs after the shot.
    pub from_fs: i64,
    /// When it ends.
    pub until_fs: i64,
    /// Its photons per second for each photon of the shot.
    pub per_s: f64,
    pub varies: Varies,
}

impl Sent {
    /// The light of each shot of `other`. Frequencies are relative to the middle one of `ours`.
    pub fn by(other: &Mount<'_>, ours: &Design) -> Self {
        let stretch = other.begins.stretch();
        match &other.design.emission {
            Emission::Marks(_) => Self::Pulses { count: 1, interval_fs: 0.0 },
            Emission::Burst(burst) => Self::Pulses {
                count: burst.pulses.into(),
                interval_fs: burst.interval_fs as f64 * stretch,
            },
            Emission::Modulated(modulation) => Self::Parts(exposures(modulation, stretch)),
            Emission::Chirped(chirp) => {
                let [its, own] = [other.design, ours]
                    .map(|design| frequency_from_wavelength(design.light.wavelength));
                Self::Parts(ramps(chirp, its - own, stretch))
            }
        }
    }
}

/// `time_fs` of a clock whose units last longer by the factor `stretch`.
fn by_ours(time_fs: i64, stretch: f64) -> i64 {
    (time_fs as f64 * stretch) as i64
}

/// The exposures of a shot.
fn exposures(modulation: &Modulation, stretch: f64) -> Vec<Part> {
    let taps = modulation.taps();
    let lasts = s_from_fs(modulation.exposure_fs) * f64::from(taps) * stretch;
    let exposure = |tap: u32| {
        let begins_fs = modulation.begins_fs(tap);
        let hz = modulation.hz[(tap / modulation.phases) as usize] / stretch;
        Part {
            from_fs: by_ours(begins_fs, stretch),
            until_fs: by_ours(begins_fs + modulation.exposure_fs, stretch),
            per_s: lasts.recip(),
            varies: Varies::Power { hz, phase: 0.0, wave: modulation.wave },
        }
    };
    (0..taps).map(exposure).collect()
}

/// The ramps of a shot, each with the time before it that is not recorded. The middle frequency is `apart` Hz above that
/// of the receiver.
fn ramps(chirp: &Chirp, apart: f64, stretch: f64) -> Vec<Part> {
    let per_s = (s_from_fs(chirp.length_fs()) * stretch).recip();
    let part = |(number, ramp): (usize, Ramp)| {
        let recorded_fs = chirp.begins_fs(number);
        let rises = ramp.bandwidth / ramp.seconds;
        let before = rises * s_from_fs(chirp.settle_fs);
        let varies = Varies::Frequency {
            hz: apart - ramp.bandwidth / 2.0 - before,
            per_s: rises / stretch,
            linewidth: chirp.linewidth,
        };
        Part {
            from_fs: by_ours(recorded_fs - chirp.settle_fs, stretch),
            until_fs: by_ours(recorded_fs + chirp.recorded_fs(number), stretch),
            per_s,
            varies,
        }
    };
    chirp.ramps().into_iter().enumerate().map(part).collect()
}
