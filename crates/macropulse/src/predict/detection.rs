//! What becomes of one mark: light to edges to ticks, in closed form.

use macropulse_codec::statistics::{erlang_b, normal_tail, poisson};

use crate::channel::{FirstFiringSetting, LinearSetting, Operating};
use crate::design::{Design, Detector, Geiger, Tdc};

/// Terms of a Poisson sum that are less than this share of all are left out.
const NEGLIGIBLE: f64 = 1e-15;

/// From so many photons on, their number passes for a normal variable.
const MANY: f64 = 1e4;

/// Probability that a mark of which `photons` are detected on average makes an edge of the sensor
/// `design` where it is `operating`, and where nothing else keeps the detector busy but `edges_per_s` false counts that fall on it.
///
/// * counting: (1 − m)·(1 − exp(−n)), m the marks lost for other reasons;
/// * Geiger: 1 − (1 − a·(1 − exp(−n/N)))^N, a the share of the N cells that are armed, [`armed`]:
///   an armed cell fires if one photon of those that fall on it is detected;
/// * linear: Σ_k Poisson(k; n)·Q((threshold − k)/√(k·(F − 1) + noise²)), see [`crossing`];
/// * first firing: [`firing`].
pub fn mark_pd(design: &Design, operating: &Operating, photons: f64, edges_per_s: f64) -> f64 {
    match &design.detector {
        Detector::PhotonCounting(counting) => {
            -(1.0 - counting.missed_marks) * libm::expm1(-photons)
        }
        Detector::Geiger(geiger) => any_cell(geiger, armed(geiger, edges_per_s), photons),
        Detector::Linear(linear) => {
            let setting = operating.linear;
            let setting =
                setting.unwrap_or_else(|| LinearSetting::of(linear, operating.background));
            crossing(&setting, photons)
        }
        Detector::FirstFiring(detector) => {
            let pulse = design.light.pulse;
            let setting = operating.first_firing;
            let of = || FirstFiringSetting::of(detector, operating.background, pulse);
            firing(&setting.unwrap_or_else(of), photons)
        }
    }
}

/// Share of the cells that are armed at any moment, 1/(1 + r·τ/N): each of N cells is blind for
/// the dead time τ after each of its firings, and r photons per second fall on all of them.
pub fn armed(geiger: &Geiger, edges_per_s: f64) -> f64 {
    let each = edges_per_s / f64::from(geiger.cells);
    1.0 / (1.0 + each * crate::units::s_from_fs(geiger.dead_fs))
}

/// Probability that any of the cells fires at a mark of which `photons` are detected on average,
/// where each is armed with probability `armed`, independently of the others.
fn any_cell(geiger: &Geiger, armed: f64, photons: f64) -> f64 {
    let cells = f64::from(geiger.cells);
    let fires = -armed * libm::expm1(-photons / cells);
    -libm::expm1(cells * libm::log1p(-fires))
}

/// The first firing of cells in Geiger mode, for a receiver that takes it for the echo.
pub struct FirstOfCells {
    /// Probability that the cells have been silent since the gate opened.
    pub silent: f64,
    /// Probability that they have been and that one fires at the echo.
    pub seen: f64,
}

impl FirstOfCells {
    /// Of an echo of `photons` detected, `since` seconds after the gate opened, where `counts_per_s`
    /// false counts fall on the cells, of which the share `armed` is armed.
    ///
    /// In steady light the age A of a cell's last firing has P(A > t) = 1 − r·a·t up to the dead
    /// time τ and a·exp(−r·(t − τ)) beyond, r the counts per cell and second; a cell is armed when
    /// A > τ. So with T since the gate opened N cells are silent with q = P(A > T)^N, and each of
    /// them is armed with h = P(A > max(T, τ))/P(A > T): seen = q·(1 − (1 − h·(1 − exp(−n/N)))^N).
    pub fn of(
        geiger: &Geiger,
        armed: f64,
        counts_per_s: f64,
        (since, photons): (f64, f64),
    ) -> Self {
        let cells = f64::from(geiger.cells);
        let each = counts_per_s / cells;
        let dead = crate::units::s_from_fs(geiger.dead_fs);
        let long_ago = armed * libm::exp(-each * (since - dead).max(0.0));
        let older = if since < dead { 1.0 - each * armed * since } else { long_ago };
        let silent = libm::pow(older.clamp(0.0, 1.0), cells);
        let armed = if older > 0.0 { (long_ago / older).min(1.0) } else { 0.0 };
        Self { silent, seen: silent * any_cell(geiger, armed, photons) }
    }
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
pub fn firing(detector: &FirstFiringSetting, photons: f64) -> f64 {
    let (needed, noise) = (f64::from(detector.needed), detector.noise);
    if detector.needed == 1 && noise == 0.0 {
        return -libm::expm1(-photons);
    }
    normal_tail((needed - photons) / (photons + noise * noise).sqrt())
}

/// Share of edges that find all converters of a detector's `share` of the bank busy, where `edges_per_s` come at
/// random and each keeps one busy for the dead time: Erlang's B \[Erl17\].
pub fn bank_loss(share: &Tdc, edges_per_s: f64) -> f64 {
    let offered = edges_per_s * crate::units::s_from_fs(share.dead_fs);
    erlang_b(offered, share.converters)
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
