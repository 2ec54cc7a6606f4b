//! Detection events from the signal behind an amplifier: a comparator with a threshold, `[comparator]`.
//!
//! A pulse of amplitude A is A·exp(−t²/2s²), s the response over √(8·ln 2). The noise on it is taken to have
//! the autocorrelation exp(−t²/2v²), v its memory. It crosses the threshold, TNR times its rms,
//! exp(−TNR²/2)/(2π·v) times per second \[Rice44\]. White noise behind the amplifier has just that
//! autocorrelation.

use std::f64::consts::{PI, SQRT_2};

use schemars::JsonSchema;
use serde::Deserialize;

use crate::units::RMS_OF_FWHM;

/// Which moment of a pulse a comparator tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Timing {
    /// That at which the signal a delay ago is [`FRACTION`] of what it is now, less what this is late
    /// of a pulse: the same for every amplitude.
    ConstantFraction,
    /// That at which it crosses the threshold: the earlier, the stronger the pulse.
    LeadingEdge,
}

/// `[comparator]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::design) struct ComparatorFile {
    /// Crossings by noise per second: sets the threshold.
    #[schemars(range(min = 0.001, max = 1e12))]
    pub false_alarm_hz: f64,
    /// Which moment of a pulse the comparator tells; not where the list `idealised` names
    /// `inter-chip`.
    pub timing: Option<Timing>,
    /// The comparator is armed again where the signal has fallen below 1 less this, times the
    /// threshold; not where the list `idealised` names `inter-chip`.
    #[schemars(range(min = 0, max = 0.99))]
    pub hysteresis: Option<f64>,
}

/// The threshold over the rms noise, TNR, that noise of `memory` v, s, crosses `rate` times per second:
/// rate = exp(−TNR²/2)/(2π·v) \[Rice44\]. `None` where the rate is higher than any threshold has.
pub fn threshold_over_noise(memory: f64, rate: f64) -> Option<f64> {
    let share = 2.0 * PI * memory * rate;
    (share <= 1.0).then(|| SQRT_2 * (-libm::log(share)).sqrt())
}

/// A comparator that times pulses on the summed signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparator {
    /// The moment it tells.
    pub timing: Timing,
    /// It is armed again where the signal is below (1 − hysteresis)·threshold.
    pub hysteresis: f64,
}

/// Setting of a photodiode with a comparator, for the light it sees. Amplitudes are in detected photons: in
/// electrons before multiplication.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearSetting {
    /// Amplitude that makes an event.
    pub threshold: f64,
    /// Noise without a mark, rms.
    pub noise: f64,
    /// Excess noise factor of the multiplication.
    pub excess: f64,
    /// Full width at half maximum of a mark behind the amplifier, s.
    pub response: f64,
    /// Memory of the noise, s, as [`FrontEnd::memory`](super::FrontEnd::memory).
    pub memory: f64,
    /// Crossings of the threshold by noise alone, 1/s.
    pub false_rate: f64,
    /// Standard deviation of the timing of the converter's input alone, s.
    pub jitter: f64,
    /// As [`Linear::comparator`](super::Linear::comparator).
    pub comparator: Option<Comparator>,
}

/// The fraction of a constant-fraction discriminator.
pub const FRACTION: f64 = 0.5;

/// Its delay, in responses: so it tells a moment 0.88 rms lengths behind the peak, when the threshold
/// has been crossed even by a pulse that just reaches it.
pub const DELAY: f64 = 1.0;

/// Mean height of the signal about the peak of a pulse at the threshold, above the peak itself, in detected
/// photons. Noise that rises there puts the maximum beside the peak, (noise·s/v)²/(2·threshold) higher to the
/// first order.
pub(super) fn bump(setting: &LinearSetting) -> f64 {
    let steep = setting.noise * RMS_OF_FWHM * setting.response / setting.memory;
    steep.powi(2) / (2.0 * setting.threshold)
}

impl Comparator {
    /// How late, s, after the peak of a pulse the constant fraction is, whatever the amplitude:
    /// d/2 + s²·ln f/d with the delay d and the fraction f.
    pub fn late(response: f64) -> f64 {
        let (delay, rms) = (DELAY * response, RMS_OF_FWHM * response);
        delay / 2.0 + rms * rms * libm::log(FRACTION) / delay
    }

    /// Standard deviation, s, of the moment told of a pulse of `amplitude`, by the noise over the slope.
    pub(super) fn error(&self, setting: &LinearSetting, amplitude: f64) -> f64 {
        let rms = RMS_OF_FWHM * setting.response;
        match self.timing {
            Timing::ConstantFraction => {
                // At this moment, in s after the peak, the pulse and what it was a delay ago.
                let now = Self::late(setting.response) / rms;
                let ago = now - DELAY / RMS_OF_FWHM;
                let pulse = |at: f64| libm::exp(-at * at / 2.0);
                let slope = (-ago * pulse(ago) + FRACTION * now * pulse(now)) * amplitude / rms;
                let common = libm::exp(-(DELAY * setting.response / setting.memory).powi(2) / 2.0);
                let variance = 1.0 + FRACTION * FRACTION - 2.0 * FRACTION * common;
                // The slope is as noisy as noise of that memory is steep, 1/v for each part. The ratio of a
                // normal variable to 1 + x·g has a variance that is 1 + 3x² + 15x⁴ times as large.
                let steepness = (1.0 + FRACTION * FRACTION).sqrt() / setting.memory;
                let x = setting.noise * steepness / slope;
                let by_slope = (1.0 + 3.0 * x.powi(2) + 15.0 * x.powi(4)).min(2.0);
                setting.noise * (variance * by_slope).sqrt() / slope
            }
            Timing::LeadingEdge => {
                let before = (2.0 * libm::log(amplitude / setting.threshold)).max(0.0).sqrt();
                // At the very peak there is no slope; noise then tells the moment to within its
                // own memory.
                let steep = setting.threshold * before / rms;
                (setting.noise / steep.max(f64::MIN_POSITIVE)).min(setting.memory)
            }
        }
    }

    /// How much earlier, s, than the peak of a pulse of `amplitude` the moment is, as far as that
    /// depends on the amplitude: s·√(2·ln(A/threshold)) of a leading edge.
    pub(super) fn walk(&self, setting: &LinearSetting, amplitude: f64) -> f64 {
        match self.timing {
            Timing::ConstantFraction => 0.0,
            Timing::LeadingEdge => {
                let over = (amplitude / setting.threshold).max(1.0);
                -RMS_OF_FWHM * setting.response * (2.0 * libm::log(over)).sqrt()
            }
        }
    }

    /// The least time, s, from one pulse to the next, both of `amplitude`, at which the signal between
    /// them falls so far that the comparator is armed again: s·√(8·ln(2A/release)).
    pub fn apart(&self, setting: &LinearSetting, amplitude: f64) -> f64 {
        let release = (1.0 - self.hysteresis) * setting.threshold;
        let dip = libm::log((2.0 * amplitude / release).max(1.0));
        RMS_OF_FWHM * setting.response * (8.0 * dip).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pfa 0.5 within 1 µs behind a matched filter of 5 ns, v = √3/π times as long: 20·log10 TNR = 9.776 dB.
    #[test]
    fn the_threshold_of_half_a_false_alarm_per_microsecond() {
        let memory = 3_f64.sqrt() / PI * 5e-9;
        let tnr = threshold_over_noise(memory, 0.5 / 1e-6).unwrap();
        approx::assert_relative_eq!(20.0 * tnr.log10(), 9.776, max_relative = 1e-4);
        assert_eq!(threshold_over_noise(memory, 1.0 / (2.0 * PI * memory) * 1.001), None);
    }
}
