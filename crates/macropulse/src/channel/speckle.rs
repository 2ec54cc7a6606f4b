//! Speckle: the coherent light that a rough surface sends back varies from place to place.
//!
//! The fields of the many points of a spot add up with unknown phases. Behind an aperture that holds M
//! independent cells of that pattern the energy of an echo is gamma distributed about its mean, with the
//! variance mean²/M. M⁻¹ is the mean, over pairs of points of the aperture, of |μ|², the squared coherence of
//! the light there \[Good07\]. For a Gaussian spot of radius w at 1/e², R away, |μ|² = exp(−(π·w·Δ/(λ·R))²)
//! for points Δ apart. Behind a circular aperture of diameter D, with q = (π·w·D/(λ·R))²,
//!
//! M₀ = q / (4·\[1 − exp(−q/2)·(I₀(q/2) + I₁(q/2))\]),
//!
//! 1 for a small aperture, and q/4 = π·w²·A/(λ·R)² for a large one of area A.
//!
//! On a surface tilted by i, points of the spot lie at different depths, and light of the spectral width Δν
//! adds up with fields of fewer of them. For pairs of points Δz apart in depth a share of exp(−4·σ_k²·Δz²) is
//! left, with σ_k = 2π·Δν/(2.355·c), and M is larger by
//!
//! √(1 + 4·(w·σ_k·tan i)²/(1 + q/4)),
//!
//! with a Gaussian in place of the Airy disc along the tilt. This is some 8 % more than the fields of random
//! points add up to, tilted by 45° and 60°. Δν is the line width of the laser combined with the least width
//! of a pulse of length τ, 0.441/τ.
//!
//! All marks of a shot share their cells, because they come within a fraction of a microsecond. In that time
//! a laser keeps its frequency to much less than the width that would tell depths apart, and the beam moves
//! by less than itself. Different shots, and scans, have cells of their own. If a beam is traced in several
//! rays, each ray has its share of the cells. Their sum has the same distribution for any number of rays.
//! Every surface counts as rough, even mirrors and retroreflectors. Glass in front of it takes away cells
//! along with the light.

use std::f64::consts::PI;

use rand_distr::{Distribution, Gamma};

use crate::design::Design;
use crate::random::{Chance, Stage};
use crate::units::{RMS_OF_FWHM, SPEED_OF_LIGHT};

/// Spectral width of a Gaussian pulse times its length, both full widths at half maximum: 2·ln 2/π.
const TIME_BANDWIDTH: f64 = 0.441_271_200_305_303_6;

/// The speckle of the echoes of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Speckle {
    wavelength: f64,
    aperture: f64,
    beam_diameter: f64,
    divergence: f64,
    /// rms width of the light in wave numbers, σ_k, rad/m.
    wave_numbers: f64,
}

impl Speckle {
    /// Returns the speckle of a sensor whose aperture and beam are known, even if it is not simulated. A
    /// laser without a stated line width has that of its pulses. `None` of a detector that follows speckle
    /// itself.
    pub fn of(design: &Design) -> Option<Self> {
        let is_seen = design.light.divergence > 0.0 && !design.detector.model().follows_speckle();
        let budget = design.budget.as_ref().filter(|_| is_seen)?;
        // Light without pulses has a narrow line.
        let pulse = match design.light.pulse {
            0.0 => 0.0,
            pulse => TIME_BANDWIDTH / pulse,
        };
        let width = libm::hypot(design.light.linewidth.unwrap_or(0.0), pulse);
        Some(Self {
            wavelength: design.light.wavelength,
            aperture: budget.aperture,
            beam_diameter: design.light.beam_diameter,
            divergence: design.light.divergence,
            wave_numbers: 2.0 * PI * width * RMS_OF_FWHM / SPEED_OF_LIGHT,
        })
    }

    /// Returns the speckle of a sensor whose file asks for it by the line width of its laser.
    pub fn simulated(design: &Design) -> Option<Self> {
        design.light.linewidth.and_then(|_| Self::of(design))
    }

    /// Returns the number of cells, M, that the aperture holds of an echo from `range` metres, off a surface
    /// that the light meets at an angle with this `cosine`.
    pub fn cells(&self, range: f64, cosine: f64) -> f64 {
        let radius = libm::hypot(self.beam_diameter, self.divergence * range) / 2.0;
        let root = PI * radius * self.aperture / (self.wavelength * range.max(f64::MIN_POSITIVE));
        let q = root * root;
        let tangent = (1.0 / cosine.max(1e-3).powi(2) - 1.0).max(0.0).sqrt();
        let depth = 2.0 * radius * self.wave_numbers * tangent;
        spatial(q) * (1.0 + depth * depth / (1.0 + q / 4.0)).sqrt()
    }

    /// Draws the energy of the echo of ray `ray` of shot `shot`, relative to its mean. The ray has this
    /// `share` of the beam.
    pub(super) fn factor(
        &self,
        chance: &Chance,
        (shot, ray): (u64, u64),
        (range, cosine, share): (f64, f64, f64),
    ) -> f64 {
        let cells = self.cells(range, cosine) * share;
        let mut stream = chance.at(Stage::Speckle, ray << 48 | shot & ((1 << 48) - 1));
        Gamma::new(cells, 1.0 / cells).map_or(1.0, |gamma| gamma.sample(&mut stream))
    }
}

/// M₀ of q.
fn spatial(q: f64) -> f64 {
    // The next term is 10⁻⁷ of it.
    if q < 1e-3 {
        return 1.0 + q / 4.0;
    }
    q / (4.0 * (1.0 - sum_of_bessels(q / 2.0)))
}

/// Returns exp(−x)·(I₀(x) + I₁(x)). Up to x = 50 it is the integral ∫ exp(x·(cos θ − 1))·(1 + cos θ) dθ/π
/// from 0 to π, which 64 steps give to within 10⁻¹². Beyond, it is the first terms of the series in 1/x.
fn sum_of_bessels(x: f64) -> f64 {
    if x > 50.0 {
        let series = 2.0 - (1.0 / 4.0 + (6.0 / 128.0 + 90.0 / 3072.0 / x) / x) / x;
        return series / (2.0 * PI * x).sqrt();
    }
    const STEPS: u32 = 64;
    let value = |step: u32| {
        let cosine = libm::cos(PI * f64::from(step) / f64::from(STEPS));
        libm::exp(x * (cosine - 1.0)) * (1.0 + cosine)
    };
    let ends = (value(0) + value(STEPS)) / 2.0;
    (ends + (1..STEPS).map(value).sum::<f64>()) / f64::from(STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The integral over pairs of points of a circular aperture, (16/π)·∫ β·\[acos β − β·√(1 − β²)\]·exp(−q·β²) dβ.
    #[test]
    fn cells_are_those_of_the_integral_over_the_aperture() {
        for q in [1e-4, 0.01, 1.0, 30.0, 99.0, 101.0, 1e4] {
            let steps = 200_000;
            let sum: f64 = (0..steps)
                .map(|step| {
                    let beta = (f64::from(step) + 0.5) / f64::from(steps);
                    let overlap = beta.acos() - beta * (1.0 - beta * beta).sqrt();
                    beta * overlap * (-q * beta * beta).exp() / f64::from(steps)
                })
                .sum();
            assert_relative_eq!(spatial(q), PI / 16.0 / sum, max_relative = 1e-5);
        }
    }

    fn of(set: &[(&str, &str)]) -> Speckle {
        let set: Vec<(String, String)> =
            set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        Speckle::simulated(&Design::open("coded-32", &set).unwrap()).unwrap()
    }

    /// At 150 m the spot is 105 mm wide: q = (π·0.0525·0.04/(1.55e-6·150))² = 806, M₀ = q/4/(1 − 1.128/√q).
    #[test]
    fn a_wide_aperture_holds_hundreds_of_cells() {
        let cells = of(&[("light.linewidth_ghz", "0")]).cells(150.0, 1.0);
        assert_relative_eq!(cells, 209.8, max_relative = 0.01);
    }

    /// On a tilted surface a broad line makes more of them; square on it makes none.
    #[test]
    fn a_broad_line_has_fewer_cells_in_step() {
        let [narrow, broad] = ["0", "1000"].map(|width| of(&[("light.linewidth_ghz", width)]));
        assert_eq!(narrow.cells(100.0, 1.0), broad.cells(100.0, 1.0));
        assert_relative_eq!(
            narrow.cells(100.0, 0.7),
            narrow.cells(100.0, 1.0),
            max_relative = 1e-2
        );
        assert!(broad.cells(100.0, 0.7) > 10.0 * narrow.cells(100.0, 0.7));
    }

    /// H0: mean 1 and variance 1/M, of an echo in one ray and of one in seven. N = 40 000, seed 3; bounds are
    /// five standard errors. Control: half the number of cells has twice the variance.
    #[test]
    fn rays_add_up_to_one_echo() {
        let it = of(&[("light.linewidth_ghz", "0"), ("optics.aperture_mm", "6")]);
        let cells = it.cells(149.0, 1.0);
        let chance = Chance::new(3);
        for rays in [1, 7] {
            let share = 1.0 / rays as f64;
            let echo = |shot: u64| -> f64 {
                let ray = |ray| share * it.factor(&chance, (shot, ray), (149.0, 1.0, share));
                (0..rays).map(ray).sum()
            };
            let count = 40_000.0;
            let all: Vec<f64> = (0..40_000).map(echo).collect();
            let mean = all.iter().sum::<f64>() / count;
            let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count * cells;
            assert!((mean - 1.0).abs() < 5.0 / (count * cells).sqrt(), "{rays}: {mean}");
            let error = ((2.0 + 6.0 / cells) / count).sqrt();
            assert!((variance - 1.0).abs() < 5.0 * error, "{rays}: {variance}");
            assert!((2.0 * variance - 1.0).abs() > 5.0 * error);
        }
    }
}
