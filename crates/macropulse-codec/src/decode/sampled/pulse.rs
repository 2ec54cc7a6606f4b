//! The pulse of a mark: the filter matched to it, what that makes of it, and its edges where it is
//! clipped.

use super::{STEPS_OF_TICK, Sampling};

/// Samples below this share of the highest are left out of the filter. Together they have 10⁻⁴ of the energy
/// of a pulse as smooth as Gauss's.
const LEFT_OUT: f32 = 0.01;

/// Times at which the answer of the filter is looked at, in ticks to both sides of its highest.
const ABOUT: usize = 1;

/// The pulse of one detected photon.
#[derive(Debug, Clone)]
pub(super) struct Pulse {
    /// As in [`Sampling::pulse`].
    fine: Vec<f32>,
    /// The filter: how much each sample counts, from `reach` before the mark to `reach` behind it. It makes
    /// 1 of the pulse of one photon, at the time of its mark.
    pub taps: Vec<f32>,
    /// Half the length of the filter, in ticks.
    pub reach: usize,
    /// The filtered pulse, in steps of 1/[`STEPS_OF_TICK`] tick; the middle is at the time of the mark.
    answer: Vec<f32>,
    /// How late the filtered pulse is if the vertex of the parabola through three samples of it is, ticks;
    /// ascending.
    vertices: Vec<(f64, f64)>,
    /// Ticks before its time, and behind it, at which the pulse is at a share of its highest. They ascend by
    /// −ln of the share, by which edges of pulses are nearly straight.
    edges: [Vec<(f64, f64)>; 2],
}

impl Pulse {
    pub(super) fn new(sampling: &Sampling) -> Self {
        let fine = sampling.pulse.clone();
        let middle = fine.len() / 2;
        let whole = |at: i64| sampled(&fine, middle, at * STEPS_OF_TICK as i64);
        let most = fine.iter().copied().fold(0.0, f32::max);
        let ticks = (middle / STEPS_OF_TICK) as i64;
        let counts = |at: &i64| whole(*at) >= LEFT_OUT * most || whole(-*at) >= LEFT_OUT * most;
        let reach = (0..=ticks).rev().find(counts).unwrap_or(0);
        let shape: Vec<f32> = (-reach..=reach).map(whole).collect();
        let energy: f32 = shape.iter().map(|value| value * value).sum();
        let taps: Vec<f32> = shape.iter().map(|value| value / energy).collect();
        let span = (ticks + reach) * STEPS_OF_TICK as i64;
        let answer_at = |late: i64| {
            let steps = (-reach..=reach).map(|tick| late + tick * STEPS_OF_TICK as i64);
            taps.iter().zip(steps).map(|(tap, step)| tap * sampled(&fine, middle, step)).sum()
        };
        let answer: Vec<f32> = (-span..=span).map(answer_at).collect();
        let edges = edges(&fine);
        let reach = reach as usize;
        let mut pulse = Self { fine, taps, reach, answer, vertices: Vec::new(), edges };
        pulse.vertices = pulse.vertices();
        pulse
    }

    /// The highest of the pulse, in codes.
    pub(super) fn highest(&self) -> f32 {
        self.fine.iter().copied().fold(0.0, f32::max)
    }

    /// Ticks by which a mark may be apart from what is blind and still be told: where no more than a tenth
    /// of the filtered pulse is missing.
    pub(super) fn core(&self) -> usize {
        let middle = self.reach;
        let weight = |at: usize| self.taps[at] * self.taps[at];
        let all: f32 = (0..self.taps.len()).map(weight).sum();
        let missing = |apart: usize| -> f32 {
            let before: f32 = (0..middle - apart).map(weight).sum();
            let behind: f32 = (middle + apart + 1..self.taps.len()).map(weight).sum();
            before.max(behind)
        };
        (0..self.reach).find(|apart| missing(*apart) < 0.1 * all).unwrap_or(self.reach)
    }

    /// Returns the ticks from the time of a mark to the ends of its filtered pulse, at most.
    pub(super) fn span(&self) -> usize {
        self.answer.len() / 2 / STEPS_OF_TICK
    }

    /// Returns the filtered pulse of one photon, this number of `ticks` from the time of its mark.
    pub(super) fn answer(&self, ticks: f64) -> f32 {
        let place = ticks * STEPS_OF_TICK as f64 + (self.answer.len() / 2) as f64;
        let before = place.floor();
        if before < 0.0 || before as usize + 1 >= self.answer.len() {
            return 0.0;
        }
        let (at, share) = (before as usize, (place - before) as f32);
        self.answer[at] + share * (self.answer[at + 1] - self.answer[at])
    }

    /// How late a filtered pulse is, in ticks from the middle one of three samples of it that ascend to it
    /// and fall behind it, or nearly so.
    ///
    /// The vertex of the parabola through them is at the time of the mark only if the pulse is a parabola. So
    /// the time that a vertex stands for is read off the pulse itself.
    pub(super) fn late(&self, samples: [f32; 3]) -> f64 {
        let Some(vertex) = vertex(samples.map(f64::from)) else { return 0.0 };
        interpolate(&self.vertices, vertex)
    }

    /// The vertices of the parabolas through samples of the filtered pulse, and how late it is.
    fn vertices(&self) -> Vec<(f64, f64)> {
        let middle = (self.answer.len() / 2) as i64;
        let highest = (0..self.answer.len()).fold(0, |highest, at| {
            if self.answer[at] > self.answer[highest] { at } else { highest }
        });
        let apart = (middle - highest as i64) as f64 / STEPS_OF_TICK as f64;
        let steps = (ABOUT * STEPS_OF_TICK) as i64;
        let about = (-steps..=steps).map(|step| apart + step as f64 / STEPS_OF_TICK as f64);
        let mut ascending: Vec<(f64, f64)> = Vec::new();
        for late in about {
            let samples = [-1.0, 0.0, 1.0].map(|tick| f64::from(self.answer(tick - late)));
            let Some(vertex) = vertex(samples).filter(|vertex| vertex.abs() <= 1.0) else {
                continue;
            };
            if ascending.last().is_none_or(|(before, _)| vertex > *before) {
                ascending.push((vertex, late));
            }
        }
        ascending
    }

    /// When a pulse came that `rises` through a code at a tick and `falls` through another one at a later
    /// tick, and how many photons it had.
    ///
    /// A pulse of n photons is at a code c as long before its time as the pulse of one photon is at c/n, and
    /// correspondingly behind. Both together are the longer the more photons there are: n is found by
    /// halving.
    pub(super) fn between(&self, rises: Crossing, falls: Crossing) -> (f64, f64) {
        let highest = f64::from(self.highest());
        let [rising, falling] =
            [rises, falls].map(|edge| libm::log(f64::from(edge.code.max(1.0)) / highest));
        let rise = |photons: f64| interpolate(&self.edges[0], photons - rising);
        let fall = |photons: f64| interpolate(&self.edges[1], photons - falling);
        // Logarithms of the number of photons.
        let (mut few, mut many) = (rising.max(falling), MOST_PHOTONS);
        for _ in 0..HALVINGS {
            let middle = (few + many) / 2.0;
            match rise(middle) + fall(middle) < falls.tick - rises.tick {
                true => few = middle,
                false => many = middle,
            }
        }
        let photons = (few + many) / 2.0;
        (rises.tick + rise(photons), libm::exp(photons))
    }
}

/// A point at which a pulse goes through a code.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    pub code: f32,
    pub tick: f64,
}

/// Logarithm of more photons than any mark has.
const MOST_PHOTONS: f64 = 41.0;

/// How often the logarithm of the number of photons is bounded by halves: to a ten-thousandth.
const HALVINGS: usize = 20;

/// Returns the pulse at this `step` from its middle; 0 beyond its ends.
fn sampled(fine: &[f32], middle: usize, step: i64) -> f32 {
    usize::try_from(middle as i64 + step).ok().and_then(|at| fine.get(at)).copied().unwrap_or(0.0)
}

/// Returns the place at which the parabola through three samples, a tick apart, is highest; `None` if there
/// is none.
fn vertex([before, here, behind]: [f64; 3]) -> Option<f64> {
    let bent = before - 2.0 * here + behind;
    (bent < 0.0).then(|| 0.5 * (before - behind) / bent)
}

/// Returns the edges of a pulse, before and behind its middle. Each has pairs of −ln of a share of its
/// highest, ascending, and the ticks to the middle there, until the pulse rises again or ends.
fn edges(fine: &[f32]) -> [Vec<(f64, f64)>; 2] {
    let middle = fine.len() / 2;
    let highest = (0..fine.len()).fold(0, |most, at| if fine[at] > fine[most] { at } else { most });
    let most = f64::from(fine[highest]);
    let edge = |places: &mut dyn Iterator<Item = usize>, sign: f64| {
        let mut ascending: Vec<(f64, f64)> = Vec::new();
        for at in places {
            let share = f64::from(fine[at]) / most;
            let fallen = -libm::log(share);
            if share <= 0.0 || ascending.last().is_some_and(|(last, _)| fallen <= *last) {
                break;
            }
            ascending.push((fallen, sign * (at as f64 - middle as f64) / STEPS_OF_TICK as f64));
        }
        ascending
    };
    [edge(&mut (0..=highest).rev(), -1.0), edge(&mut (highest..fine.len()), 1.0)]
}

/// The second of the pairs at `x` of the first, which ascend; that of the last pair beyond it.
fn interpolate(ascending: &[(f64, f64)], x: f64) -> f64 {
    let after = ascending.partition_point(|(known, _)| *known < x);
    let (Some(last), Some(next)) = (ascending.get(after.wrapping_sub(1)), ascending.get(after))
    else {
        return ascending.get(after).or(ascending.last()).map_or(0.0, |(_, value)| *value);
    };
    last.1 + (x - last.0) / (next.0 - last.0) * (next.1 - last.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pulse of 10 codes a photon, of deviation 1 tick, that falls off more slowly behind.
    fn pulse() -> Pulse {
        let at = |step: i32| {
            let ticks = f64::from(step) / 16.0;
            let deviation: f64 = if ticks > 0.0 { 1.2 } else { 1.0 };
            (10.0 * (-(ticks / deviation).powi(2) / 2.0).exp()) as f32
        };
        Pulse::new(&Sampling {
            pulse: (-160..=160).map(at).collect(),
            excess: 1.0,
            full_scale: 100,
            blank_ticks: 0,
            held_ticks: 0,
            recovery_ticks: 0,
            least_marks: 1,
            coupling: None,
        })
    }

    #[test]
    fn the_filter_makes_one_of_one_photon() {
        let pulse = pulse();
        // exp(−3²/2) = 1.1 % before, exp(−(3/1.2)²/2) = 4.4 % behind.
        assert_eq!((pulse.reach, pulse.taps.len(), pulse.core()), (3, 7, 1));
        approx::assert_relative_eq!(pulse.answer(0.0), 1.0, max_relative = 1e-6);
        assert!(pulse.answer(1.0) < 0.9 && pulse.answer(-30.0) == 0.0 && pulse.answer(1e9) == 0.0);
    }

    #[test]
    fn how_late_a_pulse_is_follows_from_three_samples() {
        let pulse = pulse();
        for late in [-0.5, -0.21, 0.0, 0.3, 0.5] {
            let samples = [-1.0, 0.0, 1.0].map(|tick| 500.0 * pulse.answer(tick - late));
            assert!((pulse.late(samples) - late).abs() < 2e-3, "{late}: {}", pulse.late(samples));
        }
        assert_eq!(pulse.late([1.0, 1.0, 1.0]), 0.0);
        assert_eq!(pulse.late([f32::INFINITY; 3]), 0.0);
    }

    /// Samples of the pulse at every phase, clipped at 100 codes. Its two edges tell the time and the number
    /// of photons, whatever codes they are sampled at.
    #[test]
    fn how_late_a_clipped_pulse_is_follows_from_its_edges() {
        let pulse = pulse();
        for (photons, phase) in [(15.0, 0.0), (100.0, 0.4), (1e4, 0.71), (1e6, 0.99)] {
            let middle = (pulse.fine.len() / 2) as f64;
            let at = |ticks: f64| {
                let step = middle + (ticks - phase) * 16.0;
                let (before, share) = (step.floor(), (step - step.floor()) as f32);
                let value = |step: f64| pulse.fine.get(step as usize).copied().unwrap_or(0.0);
                photons as f32 * ((1.0 - share) * value(before) + share * value(before + 1.0))
            };
            let clipped: Vec<i32> = (-9..=9).filter(|tick| at(f64::from(*tick)) >= 100.0).collect();
            let beside = [clipped[0] - 1, clipped[clipped.len() - 1] + 1].map(f64::from);
            let [rises, falls] = beside.map(|tick| Crossing { code: at(tick), tick });
            let (late, told) = pulse.between(rises, falls);
            assert!((late - phase).abs() < 0.02, "{photons}: {late} for {phase}");
            assert!((told / photons).ln().abs() < 0.1, "{told} for {photons}");
        }
    }

    #[test]
    fn between_pairs_it_is_interpolated_and_beyond_them_held() {
        let pairs = [(0.0, 1.0), (2.0, 5.0)];
        assert_eq!(
            [-1.0, 0.0, 0.5, 2.0, 9.0].map(|x| interpolate(&pairs, x)),
            [1.0, 1.0, 2.0, 5.0, 5.0]
        );
        assert_eq!(interpolate(&[], 1.0), 0.0);
    }
}
