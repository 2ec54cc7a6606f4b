//! When light came, to a fraction of a tick: from all ticks about the marks of a macropulse.
//!
//! About each of its N marks, ticks are counted by how many ticks k they are late: h_k in all. If
//! the light of all marks is late by θ, with Gaussian jitter σ, an own tick is k late with the
//! probability
//!
//! > P_k(θ) = Φ((k + 1 − θ)/σ) − Φ((k − θ)/σ),
//!
//! rounding down being part of it. Other ticks, of noise and of other shots, light a share d of all places.
//! If another mark of the same macropulse is D ticks away from a share a_D of the marks, its ticks are
//! counted, too. So the counts have the means
//!
//! > λ_k(θ) = N·(d + q·Σ_D a_D·P_{k−D}(θ)), a_0 = 1,
//!
//! with the share q of the marks that are seen. θ is the maximum of the likelihood of such a histogram,
//! ℓ = Σ_k (h_k·ln λ_k − λ_k) \[BC84\]. Fisher's scoring reaches it by steps of
//! Σ_k (h_k/λ_k − 1)·s_k / Σ_k s_k²/λ_k, s_k = N·q·∂P_k/∂θ. Each tick counts so far as it is an own one: by
//! q·P_k·N/λ_k of it. The places of neighbours are known, but nothing is learnt from them. Only some of their
//! ticks are counted, and how many depends on a jitter that is known as its largest value.
//!
//! Ticks of others would draw the mean of the ticks within a window to its middle, and ticks of neighbouring
//! marks would draw it to these. If jitter is below a third of a tick, rounding would draw it to the middle
//! of the tick.

use std::ops::Range;
use std::sync::OnceLock;

use super::{Correlation, Window};
use crate::statistics::{normal_quantile, normal_tail};

/// Steps of the scoring at most. From the fullest places on it takes two or three; more where
/// nearly all ticks are in one place.
const MOST_STEPS: usize = 12;

/// A step shorter than this, in ticks, is the last one. The error left behind it is about its square.
const SHORT: f64 = 1e-2;

/// Least share of places that other ticks are taken to light. A stretch too short to have any does not tell
/// that there can be none, and one tick far off must not outweigh all others.
const FEWEST_OTHERS: f64 = 1e-3;

/// Least information on θ, per square tick, from which a step is made. If all ticks are in one place and the
/// jitter is small, they tell nothing of where in it.
const LEAST_INFORMATION: f64 = 1.0;

/// The knowledge of a receiver about the ticks of a macropulse.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known<'a> {
    /// Standard deviation of the timing of a mark, in ticks; above 0.
    pub sigma: f64,
    /// Number of marks.
    pub marks: f64,
    /// Share of ticks that are lit by others.
    pub others: f64,
    /// How far, in ticks, other marks are from a mark, and from what share of the marks.
    pub neighbours: &'a [(i64, f64)],
}

/// How many ticks late own ticks may be at most if a macropulse is found at the earliest of `width`
/// ticks that hold its marks.
pub(super) fn lateness(width: u32) -> Range<i64> {
    let width = i64::from(width);
    -width - 2..2 * width + 3
}

/// The ticks about the marks of a macropulse, counted by how late they are.
#[derive(Debug, Default)]
pub(super) struct Histogram {
    /// Ticks that are `first`, `first` + 1, … ticks late.
    counts: Vec<u32>,
    first: i64,
    /// Memory for the counts of all places that may be among them, and for what is expected in each place.
    about: Vec<u32>,
    expected: Vec<(f64, f64)>,
}

impl Histogram {
    /// Makes it that of a macropulse which is found at the earliest of `width` ticks that hold its marks.
    /// `count` is given a delay in ticks, and counts to fill in: of ticks with that delay, of those one tick
    /// later, and so on.
    ///
    /// Ticks are counted 2 σ and half a tick to both sides of the fullest places. Both sides are equally
    /// long, so that a jitter smaller than the known one draws to neither. Strong light may light places
    /// farther away. As long as the last places have a quarter of the ticks of the fullest one, more are
    /// counted.
    pub fn count(&mut self, width: u32, sigma: f64, count: impl Fn(i64, &mut [u32])) {
        let Self { counts, about, .. } = self;
        let reach = (2.0 * sigma + 0.5).ceil() as usize;
        let places = width as usize;
        about.resize(places + 2 * reach, 0);
        count(-(reach as i64), about);
        let together = (1 + 2 * sigma.round() as usize).min(places);
        let sum = |window: &[u32]| window.iter().sum::<u32>();
        let windows = about[reach..reach + places].windows(together).enumerate().rev();
        let fullest = windows.max_by_key(|(_, window)| sum(window)).map_or(0, |(begin, _)| begin);
        let middle = fullest + together / 2;
        counts.clear();
        counts.extend_from_slice(&about[middle..=middle + 2 * reach]);
        let (mut first, farthest) = (middle as i64 - reach as i64, lateness(width));
        let mut end = (middle + reach) as i64 + 1;
        let counted = |place: i64| {
            let mut one = [0];
            count(place, &mut one);
            one[0]
        };
        while first > farthest.start && end < farthest.end {
            let highest = counts.iter().copied().max().unwrap_or(0);
            let at_ends = [counts.first(), counts.last()].into_iter().flatten().max();
            if at_ends.is_none_or(|at_end| 4 * at_end <= highest) {
                break;
            }
            first -= 1;
            counts.insert(0, counted(first));
            counts.push(counted(end));
            end += 1;
        }
        self.first = first;
    }

    /// How late the marks are, in ticks: the maximum of the likelihood. In the middle of the fullest tick where
    /// they tell no more.
    pub fn late_by(&mut self, known: &Known) -> f64 {
        let Self { counts, first, expected, .. } = self;
        let first = *first;
        let others = known.marks * known.others.clamp(FEWEST_OTHERS, 1.0);
        let mut late = fullest(counts, first, known);
        let all: u32 = counts.iter().sum();
        let own = f64::from(all) - others * counts.len() as f64;
        expected.resize(counts.len(), (0.0, 0.0));
        for _ in 0..MOST_STEPS {
            expect(expected, first as f64 - late, known);
            // One mark at least was found, and none is seen twice.
            let seen: f64 = expected.iter().map(|(probability, _)| probability).sum();
            let share = (own / seen.max(1e-3)).clamp(1.0, known.marks);
            let (mut score, mut information) = (0.0, 0.0);
            for ((probability, slope), count) in expected.iter().zip(&*counts) {
                let (mean, slope) = (others + share * probability, share * slope);
                let weight = slope / mean;
                score += (f64::from(*count) - mean) * weight;
                information += slope * weight;
            }
            if information < LEAST_INFORMATION {
                break;
            }
            let farthest = known.sigma.max(0.25);
            let step = (score / information).clamp(-farthest, farthest);
            late += step;
            if step.abs() < SHORT {
                break;
            }
        }
        late.clamp(first as f64, (first + counts.len() as i64) as f64)
    }
}

/// The `width` ticks in which a receiver looks for what a mark makes, if its light is `late` ticks behind
/// the beginning of the first.
pub(super) fn window(correlation: &Correlation, width: u32, late: f64) -> Window {
    let (sigma, photons_apart) = (correlation.jitter(), correlation.photons_apart);
    let coverage = match width {
        // Jitter that hardly leaves a tick.
        1 => 1.0,
        _ => coverage(f64::from(width), late, sigma),
    };
    Window { coverage, photons_apart }
}

/// The share of events that `width` ticks hold if they come `late` ticks behind the beginning of the
/// first, give or take `sigma`.
fn coverage(width: f64, late: f64, sigma: f64) -> f64 {
    let table = normal_table();
    let [to_begin, to_end] = [0.0, width].map(|edge| normal(table, (edge - late) / sigma).0);
    (to_end - to_begin).max(f64::MIN_POSITIVE)
}

/// How far, in ticks, other marks are from each of the ascending `marks`, at most `reach`, and from
/// what share of the marks. Both ways, as a mark is as far behind another as that is before it; the nearest first.
pub(super) fn neighbours(marks: &[i64], reach: i64) -> Vec<(i64, f64)> {
    let mut found: Vec<(i64, f64)> = Vec::new();
    for (index, mark) in marks.iter().enumerate() {
        let behind = marks[index + 1..].iter().map(|other| other - mark);
        for distance in behind.take_while(|distance| *distance <= reach) {
            match found.iter_mut().find(|(known, _)| *known == distance) {
                Some((_, count)) => *count += 1.0,
                None => found.push((distance, 1.0)),
            }
        }
    }
    found.sort_unstable_by_key(|(distance, _)| *distance);
    let all = marks.len().max(1) as f64;
    found
        .iter()
        .flat_map(|&(distance, count)| [-distance, distance].map(|d| (d, count / all)))
        .collect()
}

/// The mean of the ticks about the time at which most of them are within ±σ, or in two places side by side; each counts
/// at its middle.
///
/// If jitter is small, they are on both sides of the end of one tick, with a share s behind it. Then the
/// light is late by that end and σ·Φ⁻¹(s) more. If they are on one side alone, their distance from the end is
/// unknown, and the middle of the tick is a fair place.
fn fullest(counts: &[u32], first: i64, known: &Known) -> f64 {
    let together = (2 + 2 * known.sigma.round() as usize).min(counts.len().max(1));
    let sum = |window: &[u32]| window.iter().map(|count| u64::from(*count)).sum::<u64>();
    let windows = counts.windows(together).enumerate().rev();
    let Some((begin, window)) = windows.max_by_key(|(_, window)| sum(window)) else {
        return first as f64;
    };
    let begin = first as f64 + begin as f64;
    let others = known.marks * known.others;
    if let &[before, behind] = window {
        let [before, behind] = [before, behind].map(|count| f64::from(count) - others);
        if before >= 0.5 && behind >= 0.5 {
            let beyond = known.sigma * normal_quantile(behind / (before + behind));
            return begin + 1.0 + beyond.clamp(-0.5, 0.5);
        }
        return begin + if before > behind { 0.5 } else { 1.5 };
    }
    let moment: u64 = (0..).zip(window).map(|(place, count)| place * u64::from(*count)).sum();
    begin + moment as f64 / sum(window).max(1) as f64 + 0.5
}

/// Ticks of a mark and of its neighbours expected in each place, Σ_D a_D·P, and the derivative of its own with its
/// delay. The first place begins `begins` ticks after the light of the mark.
fn expect(expected: &mut [(f64, f64)], begins: f64, known: &Known) {
    expected.fill((0.0, 0.0));
    let of_mark = std::iter::once((0, 1.0));
    let (table, per_tick) = (normal_table(), known.sigma.recip());
    // The nearest neighbours are the first ones.
    let reach = FARTHEST * known.sigma + begins.abs() + expected.len() as f64;
    let is_near = |(distance, _): &(i64, f64)| distance.unsigned_abs() as f64 <= reach;
    let neighbours = known.neighbours.iter().copied().take_while(is_near);
    for (distance, share) in of_mark.chain(neighbours) {
        let from = begins - distance as f64;
        let end = from + expected.len() as f64;
        if from * per_tick > FARTHEST || end * per_tick < -FARTHEST {
            continue;
        }
        let mut edge = normal(table, from * per_tick);
        for (place, expected) in (1..).zip(&mut *expected) {
            let next = normal(table, (from + f64::from(place)) * per_tick);
            expected.0 += share * (next.0 - edge.0);
            if distance == 0 {
                expected.1 = (edge.1 - next.1) * per_tick;
            }
            edge = next;
        }
    }
}

/// Steps of the table of the normal distribution to a standard deviation, and how many of these it
/// goes to both sides.
const STEPS: f64 = 64.0;
const FARTHEST: f64 = 6.0;

/// Φ and φ of the standard normal distribution: a table, as they are asked for some dozen times a
/// shot.
fn normal_table() -> &'static [(f64, f64)] {
    static TABLE: OnceLock<Vec<(f64, f64)>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let steps = (2.0 * FARTHEST * STEPS) as u32;
        let of = |step| {
            let x = f64::from(step) / STEPS - FARTHEST;
            (normal_tail(-x), libm::exp(-x * x / 2.0) / std::f64::consts::TAU.sqrt())
        };
        (0..=steps + 1).map(of).collect()
    })
}

/// Φ(x) and φ(x) of the standard normal distribution, to 10⁻⁵.
fn normal(table: &[(f64, f64)], x: f64) -> (f64, f64) {
    let place = (x.clamp(-FARTHEST, FARTHEST) + FARTHEST) * STEPS;
    let index = place as usize;
    let part = place - index as f64;
    let Some(&[(low, thin), (high, thick)]) =
        table.get(index..index + 2).and_then(|two| two.first_chunk())
    else {
        return (0.0, 0.0);
    };
    (low + part * (high - low), thin + part * (thick - thin))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    /// Chance, as a test needs it.
    struct Chance(ChaCha8Rng);

    impl Chance {
        fn even(&mut self) -> f64 {
            (f64::from(self.0.next_u32()) + 0.5) / 4_294_967_296.0
        }

        fn normal(&mut self) -> f64 {
            crate::statistics::normal_quantile(self.even())
        }
    }

    /// Properties of light.
    #[derive(Debug, Clone, Copy)]
    struct Sky {
        sigma: f64,
        /// Share of marks seen.
        seen: f64,
        /// Share of places that others light.
        others: f64,
    }

    /// The ticks about `marks` that are `late`, counted as by a receiver, and its window.
    fn counted(marks: &[i64], late: f64, sky: Sky, chance: &mut Chance) -> (Histogram, u32) {
        let end = marks[marks.len() - 1] + 200;
        let mut lit = vec![false; end as usize + 200];
        for mark in marks {
            if chance.even() < sky.seen {
                let at = *mark as f64 + 100.0 + late + sky.sigma * chance.normal();
                lit[at.floor() as usize] = true;
            }
        }
        lit.iter_mut().for_each(|lit| *lit |= chance.even() < sky.others);
        // As a receiver finds it, which knows about where: the earliest start with most marks within
        // its window.
        let width = 1 + (4.0 * sky.sigma).ceil() as i64;
        let is_lit = |from: i64, to: i64| (from..to).any(|tick| lit[(100 + tick) as usize]);
        let found = |start: i64| {
            marks.iter().filter(|mark| is_lit(*mark + start, *mark + start + width)).count()
        };
        let start = (-4..6).rev().max_by_key(|start| found(*start)).unwrap();
        let count = |place: i64, counts: &mut [u32]| {
            for (place, count) in (place..).zip(counts) {
                let lit = marks.iter().filter(|mark| lit[(100 + *mark + start + place) as usize]);
                *count = lit.count() as u32;
            }
        };
        let mut histogram = Histogram::default();
        histogram.count(width as u32, sky.sigma, count);
        histogram.first += start;
        (histogram, width as u32)
    }

    /// The mean error of macropulses of `marks`, and its standard error, at each of ten phases of a tick; by the
    /// estimator, and by the mean of all ticks counted.
    fn errors(marks: &[i64], sky: Sky, seed: u64) -> Vec<[(f64, f64); 2]> {
        const MACROPULSES: usize = 400;
        let mut chance = Chance(ChaCha8Rng::seed_from_u64(seed));
        let of_phase = |phase: u32| {
            let late = 2.0 + f64::from(phase) / 10.0;
            let mut sums = [(0.0, 0.0); 2];
            for _ in 0..MACROPULSES {
                let (mut histogram, width) = counted(marks, late, sky, &mut chance);
                let known = Known {
                    sigma: sky.sigma,
                    marks: marks.len() as f64,
                    others: sky.others,
                    neighbours: &neighbours(marks, 3 * i64::from(width) + 5),
                };
                let Histogram { counts, first, .. } = &histogram;
                let all: u32 = counts.iter().sum();
                let moments = (*first..).zip(counts).map(|(k, count)| k as f64 * f64::from(*count));
                let mean = moments.sum::<f64>() / f64::from(all.max(1)) + 0.5;
                for (sum, found) in sums.iter_mut().zip([histogram.late_by(&known), mean]) {
                    let error = found - late;
                    *sum = (sum.0 + error, sum.1 + error * error);
                }
            }
            let n = MACROPULSES as f64;
            sums.map(|(sum, squares)| {
                let mean = sum / n;
                (mean, ((squares / n - mean * mean) / n).sqrt())
            })
        };
        (0..10).map(of_phase).collect()
    }

    /// Eight marks, three of them in neighbouring chips of four ticks; and a long word.
    fn words() -> [Vec<i64>; 2] {
        let crowded = [0, 4, 8, 40, 44, 72, 100, 128].to_vec();
        let long = (0..116).map(|mark| 29 * mark + mark * mark % 29).collect();
        [crowded, long]
    }

    /// H0: the mean error is no more than a tenth of a tick. N = 400 macropulses at each of ten phases
    /// of a tick, seed 7; rejected at |mean| > 0.1 + 4.1 standard errors, α = 2e-3 over all 60 means.
    /// Control: the mean of all ticks that are counted is rejected.
    #[test]
    fn light_is_timed_without_bias() {
        let skies = [
            Sky { sigma: 0.2, seen: 0.9, others: 0.002 },
            Sky { sigma: 0.8, seen: 0.9, others: 0.002 },
            Sky { sigma: 0.8, seen: 0.7, others: 0.01 },
        ];
        let mut worst = [0.0_f64; 2];
        for (word, marks) in words().iter().enumerate() {
            for sky in skies {
                let found = errors(marks, sky, 7);
                for (phase, both) in found.iter().enumerate() {
                    let excess = both.map(|(mean, error)| (mean.abs() - 0.1) / error);
                    assert!(excess[0] < 4.1, "word {word}, {sky:?}, phase {phase}: {both:?}");
                    worst[1] = worst[1].max(excess[1]);
                }
            }
        }
        assert!(worst[1] > 4.1, "the control was not rejected: {worst:?}");
    }

    #[test]
    fn one_place_alone_is_its_middle() {
        let known = Known { sigma: 0.1, marks: 100.0, others: 0.0, neighbours: &[] };
        let late_by = |counts: &[u32], first, known: &Known| {
            Histogram { counts: counts.to_vec(), first, ..Default::default() }.late_by(known)
        };
        for sigma in [0.06, 0.1, 0.2] {
            let late = late_by(&[0, 0, 97, 0, 0], -1, &Known { sigma, ..known });
            assert!((late - 1.5).abs() < 0.01, "{sigma}: {late}");
        }
        // Equal numbers before the end of a tick and behind it: on its end.
        assert!((late_by(&[0, 50, 50, 0], 0, &known) - 2.0).abs() < 1e-3);
        assert!(late_by(&[0; 4], 3, &known).is_finite());
    }

    #[test]
    fn a_window_of_two_sigma_to_both_sides_holds_19_of_20_marks() {
        assert!((coverage(4.0, 2.0, 1.0) - 0.9545).abs() < 1e-4);
        assert!((coverage(4.0, 4.0, 1.0) - 0.5).abs() < 1e-4);
    }

    #[test]
    fn neighbours_are_counted_both_ways() {
        let found = neighbours(&[0, 4, 8, 40], 10);
        assert_eq!(found, [(-4, 0.5), (4, 0.5), (-8, 0.25), (8, 0.25)]);
        assert!(neighbours(&[0, 29, 58], 10).is_empty());
    }

    #[test]
    fn the_table_is_the_normal_distribution() {
        for x in [-9.0, -3.3, -1.0, -0.007, 0.0, 0.5, 2.22, 5.99, 7.0] {
            let (below, density) = normal(normal_table(), x);
            assert!((below - normal_tail(-x)).abs() < 1e-5, "{x}");
            let expected = libm::exp(-x * x / 2.0) / std::f64::consts::TAU.sqrt();
            assert!((density - expected).abs() < 2e-5, "{x}");
        }
    }
}
