//! What a detector is set to.

use macropulse_codec::statistics::normal_quantile;

use super::linear::Amplifier;

/// Light to edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Detector {
    /// Every mark is a Bernoulli trial of its own.
    PhotonCounting(PhotonCounting),
    /// Cells that are blind for a while after each count.
    Geiger(Geiger),
    /// An amplified current that crosses a threshold.
    Linear(Linear),
    /// One firing per shot \[KP16 Fig. 7\].
    FirstFiring(FirstFiring),
}

impl Detector {
    /// How much light it gets.
    pub fn sensitivity(&self) -> Sensitivity {
        match self {
            Self::PhotonCounting(counting) => counting.sensitivity,
            Self::Geiger(geiger) => geiger.sensitivity,
            Self::Linear(linear) => linear.sensitivity,
            Self::FirstFiring(firing) => firing.sensitivity,
        }
    }

    /// Standard deviation of its timing, s; of a linear detector at its threshold, where it is
    /// largest.
    pub fn jitter(&self) -> f64 {
        match self {
            Self::PhotonCounting(counting) => counting.jitter,
            Self::Geiger(geiger) => geiger.jitter,
            Self::Linear(linear) => linear.jitter_at_threshold(),
            Self::FirstFiring(firing) => firing.jitter,
        }
    }

    /// Counts of sunlight per second that the file declares; 0 where they follow from optics and
    /// environment.
    pub fn declared_background(&self) -> f64 {
        match self {
            Self::PhotonCounting(counting) => counting.background,
            Self::Geiger(geiger) => geiger.background,
            Self::Linear(_) | Self::FirstFiring(_) => 0.0,
        }
    }
}

/// A detector that counts photons, fast enough for every chip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotonCounting {
    /// Mean photons detected per mark at the reference target.
    pub sensitivity: Sensitivity,
    /// Marks lost for another reason than lack of light, as a fraction.
    pub missed_marks: f64,
    /// Dark counts, 1/s.
    pub dark: f64,
    /// Background counts where the file declares them, 1/s; else 0.
    pub background: f64,
    /// Standard deviation of the timing, s.
    pub jitter: f64,
}

/// Cells in Geiger mode that share the light: each is blind for a while after it has fired.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geiger {
    /// Mean photons detected per mark at the reference target, all cells being armed.
    pub sensitivity: Sensitivity,
    /// Cells; light falls on each of them alike.
    pub cells: u32,
    /// Time for which a cell that has fired is blind, fs.
    pub dead_fs: i64,
    /// Dark counts of all cells together, were they always armed, 1/s.
    pub dark: f64,
    /// Background counts of all cells where the file declares them, 1/s; else 0.
    pub background: f64,
    /// Standard deviation of the timing, s.
    pub jitter: f64,
}

/// A photodiode with an amplifier and a threshold. Its noise, and with it the threshold, depends on
/// the sunlight it sees, too: [`LinearSetting`](crate::channel::LinearSetting).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// Mean photons detected per mark at the reference target.
    pub sensitivity: Sensitivity,
    /// The photodiode and its amplifier.
    pub amplifier: Amplifier,
    /// Crossings of the threshold by noise alone that are accepted, 1/s.
    pub false_alarm: f64,
    /// The threshold over the rms noise that this takes.
    pub threshold_over_noise: f64,
    /// Standard deviation of the timing of the converter's input alone, s.
    pub jitter: f64,
}

impl Linear {
    /// Standard deviation, s, of the time at which a mark crosses the threshold that only just
    /// does: noise over the slope, τ·noise/threshold, with the jitter of the input. It does not
    /// depend on how large the noise is.
    pub fn jitter_at_threshold(&self) -> f64 {
        libm::hypot(self.jitter, self.amplifier.response() / self.threshold_over_noise)
    }
}

/// A detector that fires once, when enough photons of one shot have come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstFiring {
    /// Mean photons detected per shot at the reference target.
    pub sensitivity: Sensitivity,
    /// Photons needed to fire; 1 is a Geiger detector.
    pub firing_photons: u32,
    /// White noise integrated over one pulse, photons rms.
    pub noise_photons: f64,
    /// Firings without a target, 1/s.
    pub false_rate: f64,
    /// Standard deviation of the timing, s.
    pub jitter: f64,
}

/// How much light a detector gets, declared by what it can see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    /// Mean photons detected per mark from a target of `reflectance` at `range`, square on.
    /// Infinite for a detector that never misses.
    pub photons: f64,
    /// Range of the reference target, m.
    pub range: f64,
    /// Reflectance of the reference target.
    pub reflectance: f64,
}

/// Mean photons for which a detector that needs `needed` photons fires with probability `pd`,
/// when white noise of `noise` photons rms is added.
///
/// One photon: n = −ln(1 − pd). More: the sum of Poisson and Gaussian fluctuation reaches the
/// threshold, n − z·√(n + a²) = m with z = Φ⁻¹(pd).
pub(super) fn photons_for(pd: f64, needed: u32, noise: f64) -> f64 {
    if pd >= 1.0 {
        return f64::INFINITY;
    }
    if needed == 1 && noise == 0.0 {
        return -libm::log1p(-pd);
    }
    let (m, z) = (f64::from(needed), normal_quantile(pd));
    // n² − (2m + z²)·n + m² − z²a² = 0
    let half = m + z * z / 2.0;
    let root = (half * half - (m * m - z * z * noise * noise)).max(0.0).sqrt();
    (half + z.signum() * root).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_photon_without_noise_is_the_geiger_law() {
        approx::assert_relative_eq!(photons_for(0.99, 1, 0.0), 4.605_170_186, max_relative = 1e-9);
        assert_eq!(photons_for(1.0, 400, 20.0), f64::INFINITY);
    }
}
