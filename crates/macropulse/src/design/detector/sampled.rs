//! A sampled detector: a photodiode with an amplifier and an analogue-to-digital converter (ADC).
//!
//! Nothing in it decides: what it hands over are codes, and whether a mark is there is the receiver's
//! question. What stands here as the probability of a mark is that of one mark by itself.

use std::f64::consts::TAU;

use macropulse_codec::decode::{Coupling, STEPS_OF_TICK, Sampling};
use macropulse_codec::statistics::normal_tail;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    Awaited, Detector, FirstEvent, Follows, FrontEnd, Idle, Lit, Model, Noise, Sensitivity, Table,
    Typed,
};
use crate::design::{Error, Light};
use crate::units::{FS_PER_S, fs_from_s};

/// Marks that stand alone are called found where they are so many deviations of the noise high.
const FOUND: f64 = 5.0;

/// Share of all codes that are above the level without light.
const ABOVE: f64 = 0.9;

/// Ticks of a block: at the beginning of each the baseline is worked out anew from the blocks before it, so
/// that it is the same in whichever band the block is worked out. Of 4096, adding up the blocks costs
/// nothing beside the samples, and what is worked out too much is a few microseconds.
pub const BASELINE_BLOCK: i64 = 4096;

/// What the baseline forgets is less than this share of a step of the converter.
const FORGOTTEN: f64 = 1.0 / 16.0;

/// A baseline that remembers more ticks would take more time to be found than the light it is of.
const MOST_REMEMBERED: f64 = 16_777_216.0;

/// Light shows where it is so many deviations of the noise high.
const SHOWS: f64 = 4.0;

/// A step of more photons is none that a receiver accepts: a photon would be less than 10⁻⁹ codes.
const COARSEST_STEP: f64 = 1e9;

/// A pulse is told to the receiver to so many of its rms lengths: there it is 4·10⁻⁶ of its height.
const REACH: f64 = 5.0;

/// `[detector.sampled]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Detections per photon.
    #[schemars(range(min = 1e-6, max = 1))]
    efficiency: f64,
    /// Gain of the photodiode: 1 where it multiplies nothing.
    #[schemars(range(min = 1, max = 1e6))]
    gain: f64,
    /// Ratio of the ionisation rates of the photodiode, which its excess noise follows from.
    #[schemars(range(min = 0, max = 1))]
    ionisation_ratio: f64,
    /// Electrical bandwidth at 3 dB, MHz.
    #[schemars(range(min = 0.001, max = 1e9))]
    bandwidth_mhz: f64,
    /// White noise at the input of the amplifier, pA/√Hz.
    #[schemars(range(min = 0, max = 1e6))]
    amplifier_pa_rthz: f64,
    /// Noise of the amplifier's input voltage, nV/√Hz, which the capacitance turns into current.
    #[schemars(range(min = 0, max = 1e6))]
    voltage_noise_nv_rthz: f64,
    /// Capacitance of the photodiode and the amplifier's input, pF.
    #[schemars(range(min = 0, max = 1e6))]
    capacitance_pf: f64,
    /// Low-frequency cutoff of the amplifier (3 dB) where it is coupled by a capacitor, kHz: behind strong
    /// light the baseline lies below zero and comes back with 1/(2π·cutoff). 0 where pulses do not move it.
    #[schemars(range(min = 0, max = 1e6))]
    low_cutoff_khz: f64,
    /// Dark current that is multiplied, nA.
    #[schemars(range(min = 0, max = 1e6))]
    dark_current_na: f64,
    /// Timing jitter of each mark, ps rms, beside what noise and photons make of it.
    #[schemars(range(min = 0, max = 1e6))]
    jitter_ps: f64,
    /// How much weaker than what is sent the stray light of the sensor's own marks is at its detector, dB.
    #[schemars(range(min = 0, max = 300))]
    isolation_db: f64,
    /// For how long behind a pulse that was clipped the amplifier stays at its limit, ns.
    #[schemars(range(min = 0, max = 1e6))]
    recovery_ns: f64,
    /// From sample to sample, ps: a whole number of femtoseconds; the tick of this sensor.
    #[schemars(range(min = 0.001, max = 1e9))]
    pub sample_ps: f64,
    /// Bits of a code, the level without light at a tenth of the range.
    #[schemars(range(min = 4, max = 15))]
    bits: u32,
    /// One step of a code, in the height of a mark of so many detected photons.
    #[schemars(range(min = 1e-6, max = 1e9))]
    step_photons: f64,
}

/// A photodiode with an amplifier and an analogue-to-digital converter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampled {
    /// Mean photons detected per mark at the reference target.
    pub sensitivity: Sensitivity,
    /// What comes before the converter.
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

impl Typed for File {
    fn efficiency(&self) -> Option<f64> {
        Some(self.efficiency)
    }

    fn idle(&self) -> Idle {
        Idle::NONE
    }

    fn follows(&self) -> Follows {
        Follows { bandwidth: true, neighbouring_chips: true }
    }

    fn is_single_stop(&self) -> bool {
        false
    }

    fn sample_ps(&self) -> Option<f64> {
        Some(self.sample_ps)
    }

    fn check(&self, table: &Table) -> Result<Detector, Error> {
        let Some(budget) = table.before.budget else {
            return table.refuse(
                "counts its noise in electrons, so the light must be counted as well: take \
                 \"link-budget\" off the list `idealised`",
            );
        };
        if table.before.light.spread.is_none() {
            return table.refuse(
                "samples the sum of all pulses, so none can be judged alone: take \"inter-chip\" off \
                 the list `idealised`",
            );
        }
        let within = |key, value, most| table.within(key, value, 0.0, most);
        let front_end = FrontEnd {
            gain: table.within("gain", self.gain, 1.0, 1e6)?,
            ionisation: within("ionisation_ratio", self.ionisation_ratio, 1.0)?,
            bandwidth: table.within("bandwidth_mhz", self.bandwidth_mhz, 1e-3, 1e9)? * 1e6,
            current_noise: within("amplifier_pa_rthz", self.amplifier_pa_rthz, 1e6)? * 1e-12,
            voltage_noise: within("voltage_noise_nv_rthz", self.voltage_noise_nv_rthz, 1e6)? * 1e-9,
            capacitance: within("capacitance_pf", self.capacitance_pf, 1e6)? * 1e-12,
            dark_current: within("dark_current_na", self.dark_current_na, 1e6)? * 1e-9,
            pulse: table.before.light.pulse,
        };
        let sample = self.sample(table, &front_end)?;
        let bits = table.count("bits", self.bits, 4, 15)?;
        let codes = f64::from(1 << bits);
        let low_cutoff = self.low_cutoff(table, &front_end, (sample, codes))?;
        let isolation = within("isolation_db", self.isolation_db, 300.0)?;
        let mark = budget.energy / table.before.emission.mean_pulses();
        let detected = mark / budget.photon_energy() * budget.efficiency;
        Ok(Detector::Sampled(Sampled {
            sensitivity: table.honest(budget),
            front_end,
            jitter: table.jitter(self.jitter_ps)?,
            stray: detected * libm::pow(10.0, -isolation / 10.0),
            recovery: self.recovery(table, sample)?,
            sample,
            codes: ((-(1.0 - ABOVE) * codes) as i16, (ABOVE * codes) as i16),
            step: table.within("step_photons", self.step_photons, 1e-6, COARSEST_STEP)?,
            low_cutoff,
        }))
    }
}

impl File {
    /// From sample to sample, s. The receiver is told of a mark to [`REACH`] rms lengths, in [`STEPS_OF_TICK`]
    /// steps a sample, of which it takes no more than [`Sampling::MOST_ENTRIES`].
    fn sample(&self, table: &Table, front_end: &FrontEnd) -> Result<f64, Error> {
        let sample = table.within("sample_ps", self.sample_ps, 1e-3, 1e9)? * 1e-12;
        let rms = front_end.mark_rms();
        let entries_by_rms = 2.0 * REACH * STEPS_OF_TICK as f64;
        let shortest = rms * entries_by_rms / (Sampling::MOST_ENTRIES - 3) as f64;
        let (does_not_fit, remedy) = match () {
            () if sample > 1.5 * rms => {
                ("long", format!("{:.0} ps at most, or less bandwidth", 1.5e12 * rms))
            }
            () if sample < shortest => (
                "short",
                format!("{:.3} ps or more, shorter pulses or more bandwidth", shortest * 1e12),
            ),
            () => return Ok(sample),
        };
        let message = format!(
            "is {} ps, too {does_not_fit} for a mark that is {:.0} ps long (rms) behind the amplifier: \
             take {remedy}",
            self.sample_ps,
            rms * 1e12
        );
        table.refuse_key("sample_ps", message)
    }

    /// How long behind a clipped pulse the signal stays at its limit, s.
    fn recovery(&self, table: &Table, sample: f64) -> Result<f64, Error> {
        let recovery = table.within("recovery_ns", self.recovery_ns, 0.0, 1e6)? * 1e-9;
        let most = MOST_REMEMBERED * sample;
        if recovery <= most {
            return Ok(recovery);
        }
        let message = format!(
            "is {} ns, more than {MOST_REMEMBERED} samples: take {:.1} ns at most, or longer samples",
            self.recovery_ns,
            (most * 1e10).floor() * 0.1
        );
        table.refuse_key("recovery_ns", message)
    }

    /// The low cutoff as an angular frequency, 1/s, of a converter with so many `codes`.
    ///
    /// As a hundredth of the bandwidth it takes 2 % away from what follows a mark at once; more, and the pulse
    /// would no longer be the one that the receiver knows. Nor does it know a baseline that comes back within a
    /// sample.
    fn low_cutoff(
        &self,
        table: &Table,
        front_end: &FrontEnd,
        (sample, codes): (f64, f64),
    ) -> Result<f64, Error> {
        let key = "low_cutoff_khz";
        let cutoff = table.within(key, self.low_cutoff_khz, 0.0, 1e6)? * 1e3;
        if cutoff == 0.0 {
            return Ok(0.0);
        }
        let highest = (front_end.bandwidth / 100.0).min(1.0 / (TAU * sample));
        let lowest = remembered(codes) / (TAU * MOST_REMEMBERED * sample);
        if cutoff > highest || cutoff < lowest {
            let message = format!(
                "is {}, but must be 0 or lie between {:.3} and {:.0}: below, the baseline remembers more \
                 than {MOST_REMEMBERED} samples, and 0 leaves it where it is; above a hundredth of the \
                 bandwidth, or where it comes back within a sample, pulses are no longer those of \
                 `bandwidth_mhz`",
                self.low_cutoff_khz,
                lowest * 1e-3,
                highest * 1e-3
            );
            return table.refuse_key(key, message);
        }
        Ok(TAU * cutoff)
    }
}

/// Time constants after which all of a range of so many `codes` is forgotten.
fn remembered(codes: f64) -> f64 {
    libm::log(codes / FORGOTTEN)
}

impl Sampled {
    /// rms noise without light of any lidar, in detected photons.
    pub fn rms_noise(&self, background: f64) -> f64 {
        self.front_end.covariance(0.0, background).sqrt()
    }

    /// What the amplifier puts out while it is at its limit, in detected photons: the whole range of the
    /// converter, so that what is clipped is told as such until the baseline lies as far below zero as the
    /// lowest code does.
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

    /// Time, s, from the beginning of a clipped pulse or of a shorter one of `photons` behind the amplifier to
    /// where it ends, times how high it is: what it takes from the baseline is that times `low_cutoff`.
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

    /// Time, s, before and behind a mark of stray light in which it shows above the noise: s·√(2·ln(n/v)), with the rms
    /// length s of the mark, its n photons, and v, four deviations of the noise.
    pub fn stray_shows(&self, background: f64) -> f64 {
        let over = (self.stray / (SHOWS * self.rms_noise(background))).max(1.0);
        self.front_end.mark_rms() * (2.0 * libm::log(over)).sqrt()
    }

    /// The brightest stray light of a mark, in detected photons, that is over `time` seconds behind it: it no longer
    /// shows above the noise in the dark, nor holds the amplifier at its limit because it was clipped.
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

    /// What the receiver knows of it, which listens again `blank` seconds after a mark of its own and
    /// `recovery` seconds behind a clipped sample, and decides by `least_marks` or more.
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

    /// Standard deviation, s, of the time of a mark of `photons`: the jitter of its own, the noise over
    /// the slope, s·σ/n with the rms length s of the pulse, and the photons that came in its length,
    /// s_p·√(F/n).
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

    fn declared_background(&self) -> f64 {
        0.0
    }

    /// Of a mark that is only just found by itself.
    fn jitter(&self) -> f64 {
        self.timing(FOUND * self.rms_noise(0.0).max(1.0), 0.0)
    }

    fn resolution(&self, _: &Light) -> f64 {
        self.jitter()
    }

    fn response(&self) -> f64 {
        self.front_end.mark_rms() / crate::units::RMS_OF_FWHM
    }

    fn memory_fs(&self) -> i64 {
        0
    }

    /// The baseline, with the block in which a band begins and one for pulses that are not over there, and
    /// before that a clipped pulse that may still hold the amplifier.
    fn settles_fs(&self) -> i64 {
        let baseline_fs = match self.remembered_blocks() {
            0 => 0,
            blocks => (blocks + 2) * BASELINE_BLOCK * fs_from_s(self.sample),
        };
        baseline_fs + fs_from_s(self.lingers())
    }

    fn refusal(&self, _: f64) -> Option<String> {
        None
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

    fn mark_displacement(&self, _: &Lit, _: &Light) -> f64 {
        0.0
    }

    fn ready_share(&self, _: f64) -> f64 {
        1.0
    }

    fn first_event(&self, awaited: &Awaited) -> FirstEvent {
        FirstEvent::without_memory(awaited)
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
