//! A photodiode with an amplifier and an analogue-to-digital converter (ADC).
//!
//! Nothing in it decides: it hands over codes, and whether a mark is there is the receiver's question. The
//! probability of a mark is here that of one mark by itself.

use std::f64::consts::TAU;

use macropulse_codec::decode::{self, Correlation, Coupling, Method, STEPS_OF_TICK, Sampling};
use macropulse_codec::statistics::normal_tail;

use super::{Detector, FrontEnd, Lit, Model, Noise, Sensitivity};
use crate::design::limits::Check;
use crate::design::receiver::{Inputs, ReceiverFile};
use crate::design::{Error, Light};
use crate::units::{FS_PER_S, fs_from_s};

/// A mark that stands alone is called found if it is this number of deviations of the noise high.
const FOUND: f64 = 5.0;

/// Ticks of a block. At the beginning of each the baseline is worked out anew from the blocks before it, so
/// that it is the same in every band with this block. With 4096, adding up the blocks costs nothing beside
/// the samples, and only a few microseconds are worked out in excess.
pub const BASELINE_BLOCK: i64 = 4096;

/// The baseline forgets light until less than this share of a step of the converter is left.
const FORGOTTEN: f64 = 1.0 / 16.0;

/// A baseline that remembers more ticks would take more time to be found than the light it is of.
pub(super) const MOST_REMEMBERED: f64 = 16_777_216.0;

/// Light shows if it is this number of deviations of the noise high.
const SHOWS: f64 = 4.0;

/// The receiver knows a pulse to this number of its rms lengths: there it is 4·10⁻⁶ of its height.
pub(super) const REACH: f64 = 5.0;

/// Marks by which a receiver decides at least if its file does not say: one alone may be that of any shot.
const LEAST_MARKS: u32 = 2;

/// A photodiode with an amplifier and an analogue-to-digital converter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampled {
    /// Mean photons detected per mark at the reference target.
    pub sensitivity: Sensitivity,
    /// The photodiode and its amplifier.
    pub front_end: FrontEnd,
    /// Standard deviation of the time of each mark, s.
    pub jitter: f64,
    /// Photons of each own mark that are detected as stray light.
    pub stray: f64,
    /// For how long behind a clipped pulse the signal stays at its limit, s.
    pub recovery: f64,
    /// From sample to sample, s.
    pub sample: f64,
    /// Lowest and highest code.
    pub codes: (i16, i16),
    /// A step of a code, in detected photons.
    pub step: f64,
    /// Angular frequency below which the coupling lets nothing through, 1/s; 0 where pulses do not move the
    /// baseline.
    pub low_cutoff: f64,
}

/// Time constants after which all of a range of this number of `codes` is forgotten.
pub(super) fn remembered(codes: f64) -> f64 {
    libm::log(codes / FORGOTTEN)
}

impl Check<'_> {
    /// How a receiver decodes samples; `None` without the detector that it has to know. Its lengths and its
    /// rate of false alarms are those of a `correlation`.
    pub(in crate::design) fn of_samples(
        &self,
        file: &ReceiverFile,
        inputs: &Inputs,
        correlation: &Correlation,
    ) -> Result<Option<Method>, Error> {
        let Some(Detector::Sampled(sampled)) = inputs.detector else { return Ok(None) };
        let lightest = inputs.emission.coding().codebook.lightest_word() as u32;
        let least = match file.least_marks {
            Some(typed) => self.count("receiver.least_marks", typed, 1, lightest)?,
            None => LEAST_MARKS.min(lightest),
        };
        let ns =
            |key, value| -> Result<f64, Error> { Ok(self.within(key, value, 0.0, 1e6)? * 1e-9) };
        let blank = ns("receiver.blank_ns", file.blank_ns)?;
        let recovery = ns("receiver.recovery_ns", file.recovery_ns)?;
        let &Correlation { ticks_per_chip, light_ticks, false_alarm, .. } = correlation;
        let sampling = sampled.sampling((blank, recovery), least as u16);
        Ok(Some(Method::Sampled(decode::Sampled {
            ticks_per_chip,
            light_ticks,
            false_alarm,
            sampling,
        })))
    }
}

impl Sampled {
    /// rms noise without light of any lidar, in detected photons.
    pub fn rms_noise(&self, background: f64) -> f64 {
        self.front_end.noise(background)
    }

    /// Output of the amplifier at its limit, in detected photons: the whole range of the converter. A clipped
    /// signal thus reads as clipped until the baseline lies as far below zero as the lowest code does.
    pub fn limit(&self) -> f64 {
        f64::from(i32::from(self.codes.1) - i32::from(self.codes.0)) * self.step
    }

    /// How far below zero the converter tells anything, in detected photons.
    pub fn below_zero(&self) -> f64 {
        -f64::from(self.codes.0) * self.step
    }

    /// Blocks of [`BASELINE_BLOCK`] ticks after which the baseline has forgotten what light there was; 0 where
    /// light does not move it.
    pub fn remembered_blocks(&self) -> i64 {
        if self.low_cutoff == 0.0 {
            return 0;
        }
        let codes = f64::from(i32::from(self.codes.1) - i32::from(self.codes.0));
        let ticks = remembered(codes) / (self.low_cutoff * self.sample);
        libm::ceil(ticks / BASELINE_BLOCK as f64) as i64
    }

    /// Length, s, of a pulse of `photons` behind the amplifier, clipped or not, times its height. The pulse
    /// takes this times `low_cutoff` from the baseline.
    pub fn charge(&self, photons: f64) -> f64 {
        let rms = self.front_end.mark_rms();
        let full = f64::from(self.codes.1) * self.step;
        match photons < full {
            true => photons * rms * TAU.sqrt(),
            false => {
                let clipped = 2.0 * rms * (2.0 * libm::log(photons / full)).sqrt() + self.recovery;
                self.limit() * clipped
            }
        }
    }

    /// Time, s, before and behind a mark of stray light in which it shows above the noise: s·√(2·ln(n/v)).
    /// The mark has n photons and the rms length s, and v is four deviations of the noise.
    pub fn stray_shows(&self, background: f64) -> f64 {
        let over = (self.stray / (SHOWS * self.rms_noise(background))).max(1.0);
        self.front_end.mark_rms() * (2.0 * libm::log(over)).sqrt()
    }

    /// The brightest stray light of a mark, in detected photons, that is over `time` seconds behind it. By
    /// then it no longer shows above the noise in the dark, nor holds the amplifier at its limit because it
    /// was clipped.
    pub fn most_stray(&self, time: f64) -> f64 {
        let rms = self.front_end.mark_rms();
        let falls_to =
            |level: f64, time: f64| level * libm::exp(0.5 * (time.max(0.0) / rms).powi(2));
        let shown = falls_to(SHOWS * self.rms_noise(0.0).max(self.step), time);
        let held = f64::from(self.held_ticks()) * self.sample;
        shown.min(falls_to(f64::from(self.codes.1) * self.step, time - held))
    }

    /// Whole ticks of `time` seconds, rounded up.
    fn ticks(&self, time: f64) -> u32 {
        libm::ceil(time / self.sample * (1.0 - 1e-12)) as u32
    }

    /// For how long, s, a pulse may hold the amplifier at its limit.
    pub fn lingers(&self) -> f64 {
        self.recovery + 16.0 * self.front_end.mark_rms()
    }

    /// For how many ticks behind a clipped pulse the signal stays at its limit.
    pub fn held_ticks(&self) -> u32 {
        self.ticks(self.recovery)
    }

    /// Description of the detector for a receiver. The receiver listens again `blank` seconds after a mark of
    /// its own and `recovery` seconds behind a clipped sample. It decides by `least_marks` or more.
    pub fn sampling(&self, (blank, recovery): (f64, f64), least_marks: u16) -> Sampling {
        let rms = self.front_end.mark_rms() / self.sample * STEPS_OF_TICK as f64;
        let half = libm::ceil(REACH * rms) as i32;
        let height = |step: i32| libm::exp(-0.5 * (f64::from(step) / rms).powi(2)) / self.step;
        Sampling {
            pulse: (-half..=half).map(|step| height(step) as f32).collect(),
            excess: self.front_end.excess(),
            full_scale: self.codes.1,
            blank_ticks: self.ticks(blank),
            held_ticks: self.held_ticks(),
            recovery_ticks: self.ticks(recovery),
            least_marks,
            coupling: (self.low_cutoff > 0.0).then(|| Coupling {
                low_cutoff: self.low_cutoff * self.sample,
                limit: self.limit() / self.step,
            }),
        }
    }

    /// Standard deviation, s, of the time of a mark of `photons`, from three parts. They are the jitter of
    /// its own, the noise over the slope, and the photons that came in its length. The noise adds s·σ/n with
    /// the rms length s of the pulse, and the photons add s_p·√(F/n).
    fn timing(&self, photons: f64, background: f64) -> f64 {
        let by_noise = self.front_end.mark_rms() * self.rms_noise(background) / photons;
        let length = self.front_end.pulse * crate::units::RMS_OF_FWHM;
        let by_photons = length * (self.front_end.excess() / photons).sqrt();
        libm::hypot(self.jitter, libm::hypot(by_noise, by_photons))
    }
}

impl Model for Sampled {
    fn sensitivity(&self) -> Sensitivity {
        self.sensitivity
    }

    /// Jitter of a mark that is only just found by itself.
    fn jitter(&self) -> f64 {
        self.timing(FOUND * self.rms_noise(0.0).max(1.0), 0.0)
    }

    fn resolution(&self, _: &Light) -> f64 {
        self.jitter()
    }

    fn response(&self) -> f64 {
        self.front_end.response()
    }

    /// The memory of the baseline, with the block in which a band begins and one for pulses that are not over
    /// there. Before that comes a clipped pulse that may still hold the amplifier.
    fn settles_fs(&self) -> i64 {
        let baseline_fs = match self.remembered_blocks() {
            0 => 0,
            blocks => (blocks + 2) * BASELINE_BLOCK * fs_from_s(self.sample),
        };
        baseline_fs + fs_from_s(self.lingers())
    }

    /// It makes no events.
    fn false_rate(&self, _: f64) -> f64 {
        0.0
    }

    fn noise(&self, background: f64) -> Option<Noise> {
        let rms = self.rms_noise(background);
        Some(Noise { rms, threshold: FOUND * rms, excess: self.front_end.excess() })
    }

    fn mark_pd(&self, lit: &Lit) -> f64 {
        let rms = self.rms_noise(lit.background);
        let spread = libm::hypot(rms, (self.front_end.excess() * lit.photons).sqrt());
        normal_tail((FOUND * rms - lit.photons) / spread)
    }

    fn mark_jitter(&self, lit: &Lit) -> f64 {
        self.timing(lit.photons.max(FOUND * self.rms_noise(lit.background)), lit.background)
    }

    fn summary(&self) -> String {
        format!(
            "sampled every {} ps in {} steps of {} photons; noise {:.1} photons in the dark; {}",
            fs_from_s(self.sample) as f64 / (FS_PER_S as f64 * 1e-12),
            i32::from(self.codes.1) - i32::from(self.codes.0),
            self.step,
            self.rms_noise(0.0),
            self.sensitivity.summary(),
        )
    }

    fn in_sunlight(&self) -> &'static str {
        "which are noise to it"
    }
}
