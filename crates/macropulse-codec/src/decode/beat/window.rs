//! Windows of spectra.

use std::f64::consts::PI;

use serde::Deserialize;

use crate::Peak;

/// The window that a ramp is weighted with before its spectrum is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum SpectralWindow {
    /// None: the most signal, and strong beats that leak far into other bins.
    None,
    /// (1 + cos(2πt/T))/2 about the middle of the ramp. A strong beat leaks into a few bins only. A third of
    /// the signal is lost to the noise, and a beat is measured 1.53 times less precisely.
    Hann,
}

impl SpectralWindow {
    /// Returns the factors in the windowed bin, a sum over bins without a window: that of the bin itself, and
    /// that of each of its two neighbours. Noise of the power 1 keeps it.
    ///
    /// Phases are counted from the middle of the ramp.
    pub fn weights(self) -> [f64; 2] {
        match self {
            Self::None => [1.0, 0.0],
            // ½ and ¼, over √(½² + 2·¼²).
            Self::Hann => [0.5, 0.25].map(|weight: f64| weight / 0.375_f64.sqrt()),
        }
    }

    /// The amplitude of a beat in a bin that is `bins` away from its frequency, 1 being that of a ramp without a window
    /// on its bin.
    pub fn amplitude(self, bins: f64) -> f64 {
        let [own, beside] = self.weights();
        let beside = match beside {
            0.0 => 0.0,
            weight => weight * (sinc(bins - 1.0) + sinc(bins + 1.0)),
        };
        own * sinc(bins) + beside
    }

    /// Photons of a ramp that make this peak, as far as they can be told from noise.
    pub(super) fn signal(self, peak: Peak) -> f64 {
        let aside = peak.bins() - peak.bins().round();
        (peak.power() - 1.0).max(0.0) / self.amplitude(aside).powi(2)
    }
}

/// sin(πx)/(πx), the spectrum of a beat that is recorded for a time.
pub fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { libm::sin(PI * x) / (PI * x) }
}
