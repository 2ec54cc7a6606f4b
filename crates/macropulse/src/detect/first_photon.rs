//! The first photon of a micropulse that is longer than the detector's own.
//!
//! A detector that counts photons answers a mark with one event. If the micropulse is as short as its own,
//! the event comes with the mark. If it is longer, as that of an interferer may be, the event comes with the
//! first photon. If n photons are spread over a Gaussian of rms length σ, the first comes at σ·Φ⁻¹(Λ/n). Here
//! Λ is drawn from the unit exponential below n.

use macropulse_codec::statistics::normal_quantile;

use crate::design::detector::PLENTY;
use crate::units::{FS_PER_S, RMS_OF_FWHM};

/// When the first photon of a long micropulse is seen.
pub(super) struct FirstPhoton {
    photons: f64,
    rms_fs: f64,
}

impl FirstPhoton {
    /// Returns the first photon of micropulses of length `pulse` s with `photons` each, at a detector whose
    /// own micropulses have the length `own` s. `None` if they are no longer than its own.
    pub fn of(photons: f64, pulse: f64, own: f64) -> Option<Self> {
        let rms_fs = pulse * RMS_OF_FWHM * FS_PER_S as f64;
        (pulse > own).then_some(Self { photons: photons.min(PLENTY), rms_fs })
    }

    /// After the middle, fs, where a number below `bound` has said that there is one.
    pub fn late_fs(&self, number: u32, bound: u64) -> i64 {
        // Evenly drawn among those below the bound: seen with 1 − exp(−Λ) of all.
        let share = (f64::from(number) + 0.5) / bound as f64;
        let until = -libm::log1p(share * libm::expm1(-self.photons));
        (self.rms_fs * normal_quantile(until / self.photons)).round() as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// H0: of n photons spread over a Gaussian the first one, if there is one, comes before the
    /// middle with probability (1 − e^(−n/2)) / (1 − e^(−n)). N = 65 536 numbers evenly spread, so
    /// that the share is exact to a few of them.
    #[test]
    fn the_first_photon_comes_early_in_strong_light() {
        let own = 2.5e-12;
        for photons in [0.01, 1.0, 30.0] {
            let first = FirstPhoton::of(photons, 5e-9, own).unwrap();
            let bound = (-libm::expm1(-photons) * 4_294_967_296.0) as u64;
            let number = |i: u64| (bound * i / 65_536) as u32;
            let early = (0..65_536).filter(|i| first.late_fs(number(*i), bound) < 0).count();
            let share = early as f64 / 65_536.0;
            let expected = libm::expm1(-photons / 2.0) / libm::expm1(-photons);
            assert!((share - expected).abs() < 1e-4, "{photons}: {share}, not {expected}");
        }
        // A micropulse as short as its own has no length to it.
        assert!(FirstPhoton::of(1.0, 2.5e-12, own).is_none());
        let blinding = FirstPhoton::of(f64::INFINITY, 5e-9, own).unwrap();
        assert!((-20_000_000..-10_000_000).contains(&blinding.late_fs(1 << 31, 1 << 32)));
    }
}
