//! A photodiode with its amplifier, `[detector.photodiode]`, and what stands behind it: a comparator,
//! `[comparator]`, or an analogue-to-digital converter, `[adc]`.

use std::f64::consts::TAU;

use macropulse_codec::decode::{STEPS_OF_TICK, Sampling};
use schemars::JsonSchema;
use serde::Deserialize;

use super::comparator::{ComparatorFile, threshold_over_noise};
use super::sampled::{MOST_REMEMBERED, REACH, remembered};
use super::table::MOST_COUNTS;
use super::{Comparator, Detector, FrontEnd, Linear, Sampled, Table, Timing, Typed};
use crate::design::Error;
use crate::design::budget::Budget;
use crate::design::limits::Check;
use crate::design::readout::AdcFile;

/// Share of all codes that are above the level without light.
const ABOVE: f64 = 0.9;

/// A step of more photons is none that a receiver accepts: a photon would be less than 10⁻⁹ codes.
const COARSEST_STEP: f64 = 1e9;

/// The hysteresis of a sensor that says nothing of it.
const HYSTERESIS: f64 = 0.5;

/// The keys that only samples follow, and no comparator.
pub(in crate::design) const OF_SAMPLES: [&str; 3] = [
    "detector.photodiode.low_cutoff_khz",
    "detector.photodiode.isolation_db",
    "detector.photodiode.recovery_ns",
];

/// `[detector.photodiode]` as typed.
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
    #[schemars(range(min = 0.001, max = 1e6))]
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
    /// With [adc].
    #[schemars(range(min = 0, max = 1e6))]
    low_cutoff_khz: f64,
    /// Dark current that is multiplied, nA.
    #[schemars(range(min = 0, max = 1e6))]
    dark_current_na: f64,
    /// Timing jitter of each mark, ps rms, beside what noise and photons make of it.
    #[schemars(range(min = 0, max = 1e6))]
    jitter_ps: f64,
    /// How much weaker than what is sent the stray light of the sensor's own marks is at its detector, dB.
    /// With [adc].
    #[schemars(range(min = 0, max = 300))]
    isolation_db: Option<f64>,
    /// For how long behind a pulse that was clipped the amplifier stays at its limit, ns. With [adc].
    #[schemars(range(min = 0, max = 1e6))]
    recovery_ns: f64,
}

impl Typed for File {
    fn efficiency(&self) -> Option<f64> {
        Some(self.efficiency)
    }

    fn has_signal(&self) -> bool {
        true
    }

    fn check(&self, table: &Table) -> Result<Detector, Error> {
        let Some(budget) = table.before.budget else {
            return table.refuse(
                "counts its noise in electrons, so the light must be counted as well: take \
                 \"link-budget\" off the list `idealised`",
            );
        };
        let front_end = self.front_end(table)?;
        let jitter = table.jitter(self.jitter_ps)?;
        if let Some(adc) = table.before.adc {
            return self.sampled(table, adc, (budget, front_end, jitter));
        }
        let Some(comparator) = table.before.comparator else {
            let message = "is missing: a photodiode has a [comparator], whose crossings are timed, or an \
                           [adc], which samples";
            return Err(table.check.chain.lacks("comparator", message));
        };
        let path = "comparator.false_alarm_hz";
        let false_alarm = table.check.within(path, comparator.false_alarm_hz, 1e-3, MOST_COUNTS)?;
        if threshold_over_noise(front_end.white_memory(), false_alarm).is_none() {
            let message = format!(
                "is {false_alarm:.3e}, but noise of this bandwidth crosses even its own mean only \
                 {:.3e} times per second",
                1.0 / (TAU * front_end.white_memory())
            );
            return table.check.refuse(path, message);
        }
        Ok(Detector::Linear(Linear {
            sensitivity: table.honest(budget),
            front_end,
            false_alarm,
            jitter,
            comparator: comparator.check(table)?,
        }))
    }
}

impl ComparatorFile {
    /// The comparator; `None` where every mark is judged alone.
    fn check(&self, table: &Table) -> Result<Option<Comparator>, Error> {
        if table.before.light.spread.is_none() {
            return Ok(None);
        }
        let hysteresis = self.hysteresis.unwrap_or(HYSTERESIS);
        Ok(Some(Comparator {
            timing: self.timing.unwrap_or(Timing::ConstantFraction),
            hysteresis: table.check.within("comparator.hysteresis", hysteresis, 0.0, 0.99)?,
        }))
    }
}

impl File {
    fn front_end(&self, table: &Table) -> Result<FrontEnd, Error> {
        let within = |key, value, most| table.within(key, value, 0.0, most);
        Ok(FrontEnd {
            gain: table.within("gain", self.gain, 1.0, 1e6)?,
            ionisation: within("ionisation_ratio", self.ionisation_ratio, 1.0)?,
            bandwidth: table.within("bandwidth_mhz", self.bandwidth_mhz, 1e-3, 1e6)? * 1e6,
            current_noise: within("amplifier_pa_rthz", self.amplifier_pa_rthz, 1e6)? * 1e-12,
            voltage_noise: within("voltage_noise_nv_rthz", self.voltage_noise_nv_rthz, 1e6)? * 1e-9,
            capacitance: within("capacitance_pf", self.capacitance_pf, 1e6)? * 1e-12,
            dark_current: within("dark_current_na", self.dark_current_na, 1e6)? * 1e-9,
            pulse: table.before.light.pulse,
        })
    }

    /// The detector that samples with this `adc`.
    fn sampled(
        &self,
        table: &Table,
        adc: &AdcFile,
        (budget, front_end, jitter): (&Budget, FrontEnd, f64),
    ) -> Result<Detector, Error> {
        if table.before.light.spread.is_none() {
            return table.check.refuse(
                "adc",
                "samples the sum of all pulses, so none can be judged alone: take \"inter-chip\" off \
                 the list `idealised`",
            );
        }
        let check = table.check;
        let sample = adc.sample(check, &front_end)?;
        let bits = check.count("adc.bits", adc.bits, 4, 15)?;
        let codes = f64::from(1 << bits);
        let Some(isolation) = self.isolation_db else {
            return Err(check.chain.lacks(OF_SAMPLES[1], "missing field `isolation_db`"));
        };
        let isolation = table.within("isolation_db", isolation, 0.0, 300.0)?;
        let mark = budget.energy / table.before.emission.mean_pulses();
        let detected = mark / budget.photon_energy() * budget.efficiency;
        Ok(Detector::Sampled(Sampled {
            sensitivity: table.honest(budget),
            front_end,
            jitter,
            stray: detected * libm::pow(10.0, -isolation / 10.0),
            recovery: self.recovery(table, sample)?,
            sample,
            codes: ((-(1.0 - ABOVE) * codes) as i16, (ABOVE * codes) as i16),
            step: check.within("adc.step_photons", adc.step_photons, 1e-6, COARSEST_STEP)?,
            low_cutoff: self.low_cutoff(table, &front_end, (sample, codes))?,
        }))
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

    /// The low cutoff as an angular frequency, 1/s, of a converter with this number of `codes`.
    ///
    /// A cutoff of a hundredth of the bandwidth takes 2 % away from the signal right behind a mark. With
    /// more, the pulse would no longer be the one that the receiver knows. Nor does the receiver know a
    /// baseline that comes back within a sample.
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

impl AdcFile {
    /// From sample to sample, s. The receiver knows a mark to [`REACH`] rms lengths, in [`STEPS_OF_TICK`]
    /// steps a sample. It takes no more than [`Sampling::MOST_ENTRIES`] of these steps.
    fn sample(&self, check: &Check, front_end: &FrontEnd) -> Result<f64, Error> {
        let sample = check.within("adc.sample_ps", self.sample_ps, 1e-3, 1e9)? * 1e-12;
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
        check.refuse("adc.sample_ps", message)
    }
}
