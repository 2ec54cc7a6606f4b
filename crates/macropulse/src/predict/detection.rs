//! What becomes of one mark: light to edges to ticks, in closed form.

use macropulse_codec::statistics::{erlang_b, normal_tail, poisson};

use crate::channel::{LinearSetting, Operating};
use crate::design::{Design, Detector, FirstFiring, Geiger, Tdc};

/// Terms of a Poisson sum that are less than this share of all are left out.
const NEGLIGIBLE: f64 = 1e-15;

/// From so many photons on, their number passes for a normal variable.
const MANY: f64 = 1e4;

/// Probability that a mark of which `photons` are detected on average makes an edge of the sensor
/// `design` where it is `operating`, and where nothing else keeps the detector busy but `edges_per_s` false counts that fall on it.
///
/// * counting: (1 − m)·(1 − exp(−n)), m the marks lost for other reasons;
/// * Geiger: 1 − exp(−n·a), a the share of cells that are armed, [`armed`];
/// * linear: Σ_k Poisson(k; n)·Q((threshold − k)/√(k·(F − 1) + noise²)), see [`crossing`];
/// * first firing: [`firing`].
pub fn mark_pd(design: &Design, operating: &Operating, photons: f64, edges_per_s: f64) -> f64 {
    match &design.detector {
        Detector::PhotonCounting(counting) => {
            -(1.0 - counting.missed_marks) * libm::expm1(-photons)
        }
        Detector::Geiger(geiger) => -libm::expm1(-photons * armed(geiger, edges_per_s)),
        Detector::Linear(linear) => {
            let setting = operating.linear;
            let setting =
                setting.unwrap_or_else(|| LinearSetting::of(linear, operating.background));
            crossing(&setting, photons)
        }
        Detector::FirstFiring(firing_) => firing(firing_, photons),
    }
}

/// Share of the cells that are armed at any moment, 1/(1 + r·τ/N): each of N cells is blind for
/// the dead time τ after each of its firings, and r photons per second fall on all of them.
pub fn armed(geiger: &Geiger, edges_per_s: f64) -> f64 {
    let each = edges_per_s / f64::from(geiger.cells);
    1.0 / (1.0 + each * crate::units::s_from_fs(geiger.dead_fs))
}

/// Probability that a mark of which `photons` are detected on average crosses the threshold of a
/// linear detector, summed over the photons k that come:
/// Σ_k e^(−n)·n^k/k! · Q((threshold − k)/√(k·(F − 1) + noise²)). No photon, no edge.
///
/// With so much noise of the amplifier that the photons' own does not matter it is the
/// ½·erfc((TNR − SNR)/√2) of textbooks.
pub fn crossing(linear: &LinearSetting, photons: f64) -> f64 {
    let LinearSetting { threshold, noise, excess, .. } = *linear;
    let above = |count: f64, variance: f64| normal_tail((threshold - count) / variance.sqrt());
    if photons > MANY {
        return above(photons, photons * excess + noise * noise);
    }
    let mut sum = 0.0;
    let mut k = 1.0;
    loop {
        let share = poisson(photons, k);
        sum += share * above(k, k * (excess - 1.0) + noise * noise);
        if k > photons && share < NEGLIGIBLE {
            return sum;
        }
        k += 1.0;
    }
}

/// Probability that a detector which needs m photons fires at a mark of which n are detected on
/// average, with a photons rms of noise: 1 − exp(−n) for m = 1 without noise, else
/// Q((m − n)/√(n + a²)).
pub fn firing(detector: &FirstFiring, photons: f64) -> f64 {
    let (needed, noise) = (f64::from(detector.firing_photons), detector.noise_photons);
    if detector.firing_photons == 1 && noise == 0.0 {
        return -libm::expm1(-photons);
    }
    normal_tail((needed - photons) / (photons + noise * noise).sqrt())
}

/// Share of edges that find all converters of the bank busy, where `edges_per_s` come at random
/// and each keeps one busy for the dead time: Erlang's B \[Erl17\].
pub fn bank_loss(tdc: &Tdc, edges_per_s: f64) -> f64 {
    let offered = edges_per_s * crate::units::s_from_fs(tdc.dead_fs);
    erlang_b(offered, tdc.converters)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn linear(threshold: f64, noise: f64, excess: f64) -> LinearSetting {
        LinearSetting { threshold, noise, excess, response: 1e-9, false_rate: 0.0, jitter: 0.0 }
    }

    /// TNR 9.78 dB: SNR of 9.8, 12, 13, 14 and 16 dB give 0.50, 0.816, 0.917, 0.973 and 0.9994.
    #[test]
    fn a_noisy_amplifier_has_the_curve_of_the_textbook() {
        let noise = 1000.0;
        let db = |db: f64| 10_f64.powf(db / 20.0);
        for (snr, pd) in [(9.776, 0.5), (12.0, 0.816), (13.0, 0.917), (14.0, 0.973), (16.0, 0.9994)]
        {
            let found = crossing(&linear(db(9.776) * noise, noise, 1.0), db(snr) * noise);
            assert!((found - pd).abs() < 2e-3, "SNR {snr} dB: {found}");
        }
    }

    /// With neither noise nor excess noise an edge takes as many photons as the threshold says.
    #[test]
    fn without_noise_it_is_the_tail_of_poisson() {
        let found = crossing(&linear(2.5, 1e-9, 1.0), 2.0);
        assert_relative_eq!(found, 1.0 - (-2.0_f64).exp() * 5.0, max_relative = 1e-9);
    }

    #[test]
    fn sum_and_normal_approximation_meet() {
        let detector = linear(MANY, 300.0, 4.0);
        let (below, above) = (crossing(&detector, MANY), crossing(&detector, MANY * (1.0 + 1e-9)));
        assert!((below - above).abs() < 2e-3, "{below}, {above}");
    }
}
