//! What makes detection events of the signal behind an amplifier: a comparator with a threshold.
//!
//! A pulse of amplitude A is A·exp(−t²/2s²), s the response over √(8·ln 2), and has noise on it whose
//! autocorrelation is exp(−t²/2v²): crossings of a level are then as frequent as the threshold was
//! set for, 1/(2π·v) = 1/(2√3·τ), τ the response \[Rice44\].

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::Deserialize;

use super::LinearSetting;
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

/// What tells the times of pulses on the sum of all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparator {
    /// The moment it tells.
    pub timing: Timing,
    /// It is armed again where the signal is below (1 − hysteresis)·threshold.
    pub hysteresis: f64,
}

/// The fraction of a constant-fraction discriminator.
pub const FRACTION: f64 = 0.5;

/// Its delay, in responses: so it tells a moment 0.88 rms lengths behind the peak, when the threshold
/// has been crossed even by a pulse that just reaches it.
pub const DELAY: f64 = 1.0;

/// The v of the noise, in responses: √3/π.
const MEMORY: f64 = 1.732_050_807_568_877_2 / PI;

/// By how much, on average, the signal about the peak of a pulse at the threshold is higher than at the
/// peak itself, in detected photons: noise that rises there puts the maximum beside it,
/// (noise·s/v)²/(2·threshold) to the first order.
pub(super) fn bump(setting: &LinearSetting) -> f64 {
    (setting.noise * RMS_OF_FWHM / MEMORY).powi(2) / (2.0 * setting.threshold)
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
                let common = libm::exp(-(DELAY / MEMORY).powi(2) / 2.0);
                let variance = 1.0 + FRACTION * FRACTION - 2.0 * FRACTION * common;
                // The slope is as noisy as noise of that memory is steep, 1/v for each part. Of the ratio
                // of a normal variable to 1 + x·g the variance is 1 + 3x² + 15x⁴ times as large.
                let steepness = (1.0 + FRACTION * FRACTION).sqrt() / (MEMORY * setting.response);
                let x = setting.noise * steepness / slope;
                let by_slope = (1.0 + 3.0 * x.powi(2) + 15.0 * x.powi(4)).min(2.0);
                setting.noise * (variance * by_slope).sqrt() / slope
            }
            Timing::LeadingEdge => {
                let before = (2.0 * libm::log(amplitude / setting.threshold)).max(0.0).sqrt();
                // At the very peak there is no slope; noise then tells the moment to within its
                // own memory.
                let steep = setting.threshold * before / rms;
                let memory = MEMORY * setting.response;
                (setting.noise / steep.max(f64::MIN_POSITIVE)).min(memory)
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

    /// Standard deviation, s, of the Gaussian that white noise is smoothed with to have this memory:
    /// v/√2.
    pub fn smoothing(response: f64) -> f64 {
        MEMORY * response / std::f64::consts::SQRT_2
    }
}
