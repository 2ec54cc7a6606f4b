//! How a receiver that correlates ticks sees a mark, and how well it times it.

use std::f64::consts::PI;

use macropulse_codec::statistics::{binomial, normal_quantile, normal_tail};

use crate::design::Design;
use crate::design::detector::Lit;
use crate::units::{RMS_OF_FWHM, range_from_tof, s_from_fs};

/// Terms of the sum over harmonics of a tick.
const HARMONICS: u32 = 16;

/// Jitter, in ticks, with which hardly any event is farther than a tick from the others: ±½ tick is ±2 σ.
const NARROW: f64 = 0.25;

/// Steps in an rms length of a micropulse that are as good as more: a Gaussian in steps of half of it is as
/// smooth as one without to 10⁻³⁰.
const FINE: f64 = 64.0;

/// Places in half a tick over which an error is averaged.
const PHASES: u32 = 12;

/// Ticks in which the receiver looks for a mark.
pub(super) struct Place {
    /// How long it looks, s.
    pub width: f64,
    /// Share of the events of marks that fall within.
    pub share: f64,
}

impl Place {
    /// That of a receiver, for a mark whose own deviation may be less than that which it looks for.
    pub fn of(design: &Design, mark: &Lit) -> Self {
        let tick = s_from_fs(design.clock.tick_fs);
        let ticks = Self::ticks(design);
        if ticks <= 1.0 {
            return Self { width: tick, share: 1.0 };
        }
        let sigma = Timing::of(design, mark).sigma;
        let half = ticks / 2.0 / (sigma * std::f64::consts::SQRT_2);
        Self { width: ticks * tick, share: libm::erf(half) }
    }

    /// Its length in ticks: one where events are exact, else one more than four deviations, rounded up.
    pub fn ticks(design: &Design) -> f64 {
        design.receiver.window_ticks().into()
    }
}

impl Place {
    /// Probability that a mark is found where it is looked for. Photons of a micropulse that
    /// reaches beyond its chip fall there or not each by itself; else its one event does.
    pub fn seen(&self, design: &Design, mark: &Lit) -> f64 {
        seen_of_share(design, mark)(self.share)
    }
}

/// The same, where some share of the light or of the events falls.
pub(super) fn seen_of_share(design: &Design, mark: &Lit) -> impl Fn(f64) -> f64 {
    let is_apart = design.detector.spread_of(&design.light).is_some();
    let whole = pd_of_share(design, mark, 1.0);
    move |share| if is_apart { pd_of_share(design, mark, share) } else { whole * share }
}

/// Probability that the detector sees anything of a `share` of the photons of a mark.
fn pd_of_share(design: &Design, mark: &Lit, share: f64) -> f64 {
    // Light without end times nothing is nothing.
    let photons = if share > 0.0 { mark.photons * share } else { 0.0 };
    design.detector.model().mark_pd(&Lit { photons, ..*mark })
}

/// Ticks that a mark lights on average, each with the share of the light that falls into it.
pub(super) fn ticks_lit(design: &Design, mark: &Lit) -> f64 {
    let Some(spread) = design.detector.spread_of(&design.light) else {
        return pd_of_share(design, mark, 1.0);
    };
    let width = spread / s_from_fs(design.clock.tick_fs);
    let below = |place: f64| normal_tail(-place / width);
    let share = |tick: f64| below(tick + 0.5) - below(tick - 0.5);
    let pd = |tick: f64| pd_of_share(design, mark, share(tick));
    // In a pulse of many ticks, one tick of every `every` stands for those about it.
    let every = (width / FINE).ceil().max(1.0);
    let farthest = (4.0 * 2_f64.sqrt() * width / every).ceil() as i32;
    (-farthest..=farthest).map(|step| pd(f64::from(step) * every)).sum::<f64>() * every
}

/// Findings of a receiver in a gate.
#[derive(Clone, Copy)]
pub(super) struct Found {
    /// Probability that a mark of the shot is found.
    pub seen: f64,
    /// Probability that it is lit by what is no shot's light.
    pub false_density: f64,
}

/// Findings for shots, the mean over labels.
pub(super) struct Chances {
    /// Probability of a return from a lit shot.
    pub pd: f64,
    /// Expected false returns of one that meets nothing.
    pub false_per_shot: f64,
    /// Share of their marks that is found of shots that give a return; 0 where none does.
    pub found: f64,
    /// The returns that were believed before any neighbour was.
    pub lone: Lone,
}

/// Returns that are believed without a neighbour.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Lone {
    /// Their share of all returns.
    pub share: f64,
    /// Share of their marks that is found.
    pub found: f64,
}

/// Places of the gate at which a macropulse may begin.
pub(super) fn lags(design: &Design) -> f64 {
    let (nearest, farthest) = design.receiver.gate_ticks;
    f64::from(farthest - nearest) + 1.0
}

/// How well a mark is timed.
pub(super) struct Timing {
    /// rms length of a micropulse with the jitter, s.
    pub spread: f64,
    /// Standard deviation of an event, in ticks.
    pub sigma: f64,
    /// Length of a tick, s.
    tick: f64,
    /// Set if the receiver knows of jitter that leaves the events in two ticks.
    undoes_rounding: bool,
}

impl Timing {
    pub fn of(design: &Design, mark: &Lit) -> Self {
        let (detector, light) = (design.detector.model(), &design.light);
        let tick = s_from_fs(design.clock.tick_fs);
        let jitter = detector.mark_jitter(mark);
        let spread = libm::hypot(light.pulse * RMS_OF_FWHM, jitter);
        let sigma = libm::hypot(detector.mark_displacement(mark, light), jitter);
        let known = design.receiver.method.correlation().map(|known| known.jitter_ticks);
        let undoes_rounding = known.is_some_and(|known| known > 0.05 && known < NARROW);
        Self { spread, sigma: sigma / tick, tick, undoes_rounding }
    }

    /// Standard deviation, m, of the range from `marks` events.
    ///
    /// Events are rounded down to ticks, and jitter σ (in ticks) dithers them. In the mean of k of
    /// them the part B = Σ_m exp(−4π²m²σ²)/(2π²m²) of the variance 1/12 of rounding is common to all,
    /// and the rest is averaged with the jitter: B + (σ² + 1/12 − B)/k \[WKL96\]. A coded receiver that
    /// knows of jitter far below a tick undoes the rounding, see [`beside_an_edge`].
    pub fn precision(&self, marks: f64) -> f64 {
        let variance = match self.undoes_rounding {
            true => beside_an_edge(self.sigma, marks),
            false => self.of_mean(marks),
        };
        range_from_tof(self.tick * variance.sqrt())
    }

    /// Variance of the mean of `marks` events, square ticks.
    fn of_mean(&self, marks: f64) -> f64 {
        let harmonic = |m: u32| {
            let m = f64::from(m) * PI;
            libm::exp(-4.0 * (m * self.sigma).powi(2)) / (2.0 * m * m)
        };
        // The rest beyond the harmonics that are summed, if they do not die out by themselves.
        let common: f64 = match self.sigma {
            0.0 => 1.0 / 12.0,
            _ => (1..=HARMONICS).map(harmonic).sum(),
        };
        let own = self.sigma.powi(2) + 1.0 / 12.0 - common;
        common + own.max(0.0) / marks
    }
}

/// Variance of the time told by `marks` events of jitter `sigma`, square ticks, where it is so small
/// that they fall into two neighbouring ticks.
///
/// Light that is x before the end of a tick, x ≤ ½, has n ~ Bin(k, Φ(−x/σ)) of its k events behind
/// it. The receiver takes it to be −σ·Φ⁻¹(n/k) before that end, ½ at most; the middle of the tick
/// where all are in one. The square of the error is averaged over n and x.
fn beside_an_edge(sigma: f64, marks: f64) -> f64 {
    let all = (marks.round() as usize).max(1);
    let told = |behind: usize| match behind {
        0 => 0.5,
        _ if behind == all => -0.5,
        _ => (-sigma * normal_quantile(behind as f64 / all as f64)).clamp(-0.5, 0.5),
    };
    let told: Vec<f64> = (0..=all).map(told).collect();
    let square = |phase: u32| -> f64 {
        let before = (f64::from(phase) + 0.5) / f64::from(PHASES) / 2.0;
        let chances = binomial(all, normal_tail(before / sigma));
        chances.iter().zip(&told).map(|(chance, told)| chance * (told - before).powi(2)).sum()
    };
    (0..PHASES).map(square).sum::<f64>() / f64::from(PHASES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::tof_from_range;
    use approx::assert_relative_eq;

    #[test]
    fn rounding_alone_has_the_variance_of_a_twelfth() {
        let undoes_rounding = false;
        let timing =
            |sigma| Timing { spread: 0.0, sigma, tick: tof_from_range(1.0), undoes_rounding };
        let rounding = 12_f64.sqrt().recip();
        assert_relative_eq!(timing(0.0).precision(100.0), rounding, max_relative = 1e-12);
        assert_relative_eq!(timing(1e-3).precision(1e9), rounding, max_relative = 0.02);
        // Jitter of many ticks is averaged, and rounding with it.
        let wide = (100.0 + 1.0 / 12.0_f64).sqrt() / 10.0;
        assert_relative_eq!(timing(10.0).precision(100.0), wide, max_relative = 1e-12);
    }

    /// Simulated: k = 174 events at random phases, the maximum of the likelihood, 600 times: 0.155,
    /// 0.068 and 0.031 ticks at σ = 0.06, 0.12 and 0.2, each known to 3 %; of 58 to 319 events.
    #[test]
    fn rounding_is_undone_by_a_little_jitter() {
        for (sigma, simulated) in [(0.06, 0.155), (0.12, 0.068), (0.2, 0.031)] {
            let found = beside_an_edge(sigma, 174.0).sqrt();
            assert!((found / simulated - 1.0).abs() < 0.06, "{sigma}: {found}");
        }
        assert!(beside_an_edge(0.2, 1.0) > beside_an_edge(0.2, 10.0));
    }
}
