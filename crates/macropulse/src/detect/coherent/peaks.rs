//! The peaks of a spectrum, and how they are measured.

use std::f64::consts::PI;
use std::ops::Range;

use macropulse_codec::Peak;
use macropulse_codec::decode::beat::SpectralWindow;
use rustfft::num_complex::Complex64;

/// Bins to both sides of a peak by which its frequency is measured.
pub(super) const NEAR: i64 = 16;

/// A part of a spectrum: the fields of its bins, in which noise has the mean power 1. Phases are counted from the middle of
/// the ramp.
#[derive(Debug, Clone)]
pub(super) struct Bins {
    /// Number of the first one.
    pub first: i64,
    pub fields: Vec<Complex64>,
    /// The window over the ramp.
    pub window: SpectralWindow,
}

impl Bins {
    /// The same behind a `window`, which takes the outermost bin at both ends.
    pub fn behind(self, window: SpectralWindow) -> Self {
        let [own, beside] = window.weights();
        let around = |near: &[Complex64]| near[1] * own + (near[0] + near[2]) * beside;
        let fields = self.fields.windows(3).map(around).collect();
        Self { first: self.first + 1, fields, window }
    }

    /// Adds the peaks among the bins `within` that have at least this power to `found`.
    pub fn peaks(&self, within: &Range<i64>, least: f64, found: &mut Vec<Peak>) {
        for bin in within.clone() {
            let Some(at) = usize::try_from(bin - self.first).ok() else { continue };
            let power = |at: usize| self.fields.get(at).map_or(0.0, Complex64::norm_sqr);
            let own = power(at);
            let is_peak =
                own >= least && own > at.checked_sub(1).map_or(0.0, power) && own >= power(at + 1);
            if is_peak {
                found.push(Peak::of(bin as f64 + self.aside(at), own));
            }
        }
    }

    /// How far from the middle of bin number `at` of these the beat is, −½ to ½.
    ///
    /// The spectrum between the bins is X(u) = Σ X_j·sinc(u − j) = sin(πu)/π·Σ (−1)ʲ·X_j/(u − j), summed over
    /// the near bins. Behind a window nothing is missing of it, and the beat is where it is highest. Without
    /// one the fields of a beat at u are sinc(u − j), and the most likely u has the highest
    /// |X(u)|²/Σ sinc²(u − j).
    fn aside(&self, at: usize) -> f64 {
        let from = at.saturating_sub(NEAR as usize);
        let to = (at + NEAR as usize + 1).min(self.fields.len());
        let around: Vec<(f64, Complex64)> = (from..to)
            .map(|j| (j as f64 - at as f64, self.fields[j]))
            .map(|(j, field)| (j, if j.rem_euclid(2.0) == 0.0 { field } else { -field }))
            .collect();
        let power = |u: f64| {
            let (mut sum, mut squares) = (Complex64::default(), 0.0);
            for (j, field) in &around {
                let weight = 1.0 / (u - j);
                sum += field * weight;
                squares += weight * weight;
            }
            match self.window {
                SpectralWindow::None => sum.norm_sqr() / squares,
                // The section does not meet 0 itself, where this is a limit.
                SpectralWindow::Hann => sum.norm_sqr() * (libm::sin(PI * u) / PI).powi(2),
            }
        };
        // The golden section of the interval, to 10⁻⁶ of a bin.
        let (mut low, mut high) = (-0.5, 0.5);
        let mut inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
        let mut powers = inner.map(power);
        while high - low > 1e-6 {
            if powers[0] > powers[1] {
                (high, inner[1], powers[1]) = (inner[1], inner[0], powers[0]);
                inner[0] = high - GOLDEN * (high - low);
                powers[0] = power(inner[0]);
            } else {
                (low, inner[0], powers[0]) = (inner[0], inner[1], powers[1]);
                inner[1] = low + GOLDEN * (high - low);
                powers[1] = power(inner[1]);
            }
        }
        (low + high) / 2.0
    }
}

/// 2/(1 + √5).
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The strongest `count` of the peaks `found`, filled up to that number.
pub(super) fn strongest(mut found: Vec<Peak>, count: usize) -> Vec<Peak> {
    // Equal powers keep their order by frequency, so that the record does not depend on how they were found.
    found.sort_by_key(|peak| (std::cmp::Reverse(peak.power), peak.frequency));
    found.resize(count, Peak::EMPTY);
    found
}
