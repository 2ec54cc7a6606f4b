//! Probability that a receiver of samples finds a target that all shots of a channel meet alike, as far as
//! its light does not meet that of others.
//!
//! Behind the matched filter, a mark of n photons is a height n·g(δ) with the noise of the filtered samples
//! and of its own photons. Here δ is the part of a tick by which it is beside a sample. The marks of a word
//! are judged as the receiver does it: none counts much more than the least, and their mean must exceed the
//! threshold. The probability is summed over points that fill the cube of all probabilities evenly.

use macropulse_codec::decode::{self, Sampling};
use macropulse_codec::statistics::{normal_quantile, normal_tail};

use super::own_light::{Blind, SHOTS, own_marks};
use crate::design::Design;
use crate::design::detector::Sampled;
use crate::units::RMS_OF_FWHM;

/// Points of the sum: with 8192 of them the probability differs by less than 0.001.
const POINTS: u32 = 2048;

/// Marks of a word at most: for more the sum takes too much memory.
pub(super) const MOST_MARKS: usize = 64;

/// The lag of a target and those beside it: noise may lift one of them over the threshold.
const LAGS: usize = 3;

/// Expected findings.
pub(super) struct Chances {
    /// Probability of a return.
    pub pd: f64,
    /// Standard deviation of the time of a return, s.
    pub timing: f64,
    /// The mean of the marks over its noise.
    pub snr: f64,
}

/// A mark behind the matched filter; times in ticks.
struct Filtered {
    /// Variance of the noise, photons².
    noise: f64,
    /// Correlation of the noise of samples that are one tick apart, and two.
    correlation: [f64; 2],
    /// Variance that a photon adds, in that of a photon alone.
    of_photon: f64,
    /// Variance of the time of a mark by when its photons came, of one photon.
    by_photon: f64,
    /// rms length of the mark.
    rms: f64,
}

impl Filtered {
    fn of(sampled: &Sampled, sampling: &Sampling, background: f64) -> Self {
        let front_end = &sampled.front_end;
        let taps = sampling.filter();
        let tick = sampled.sample;
        // Codes of one photon.
        let step = sampled.step;
        let covariance = |apart: usize| -> f64 {
            let mut sum = 0.0;
            for (one, weight) in taps.iter().enumerate() {
                for (other, others) in taps.iter().enumerate() {
                    let ticks = (one + apart).abs_diff(other);
                    let rounding = if ticks == 0 { step * step / 12.0 } else { 0.0 };
                    let noise = front_end.covariance(ticks as f64 * tick, background) + rounding;
                    sum += f64::from(*weight) * f64::from(*others) * noise;
                }
            }
            sum / (step * step)
        };
        let noise = covariance(0);
        let correlation = [1, 2].map(|apart| covariance(apart) / noise);
        let square = |time: f64| (time / tick).powi(2);
        // The filter is as long as a mark; a photon behind it, the light of a pulse, and both.
        let photon = square(front_end.mark_rms()) + square(front_end.photon_rms());
        let light = square(front_end.pulse * RMS_OF_FWHM);
        let mark = photon + light;
        let highest = mark / photon;
        Self {
            noise,
            correlation,
            of_photon: highest * (photon / (photon + 2.0 * light)).sqrt(),
            by_photon: highest.powi(3) * light * libm::pow(1.0 + 2.0 * light / photon, -1.5),
            rms: mark.sqrt(),
        }
    }

    /// The receiver's estimates of the level and the standard deviation of its noise, in photons, if
    /// `per_tick` marks to a tick have `photons` each.
    ///
    /// It takes the median of the signal, and the distance from there to the 15.87 % quantile, which are 0
    /// and −1 standard deviations of noise alone. Light that does not stand out raises a quantile z by
    ///
    /// Δ(z) = marks to a tick · ∫ (Φ(z) − Φ(z − s(t))) dt / φ(z),
    ///
    /// s(t) the mark at time t in standard deviations: a ripple of the distribution, to first order.
    fn estimated(&self, photons: f64, per_tick: f64) -> Estimated {
        let sigma = self.noise.sqrt();
        let highest = photons / sigma;
        let kept = normal_tail(highest - Sampling::STANDS_OUT);
        let step = self.rms / 8.0;
        let raised = |z: f64| -> f64 {
            let lower = |step_of: i32| {
                let t = f64::from(step_of) / 8.0;
                normal_tail(-z) - normal_tail(highest * libm::exp(-0.5 * t * t) - z)
            };
            let density = libm::exp(-0.5 * z * z) / std::f64::consts::TAU.sqrt();
            per_tick * kept * step * (-32..=32).map(lower).sum::<f64>() / density
        };
        let (level, low) = (raised(0.0), raised(-1.0));
        Estimated { level: sigma * level, deviation: sigma * (1.0 + level - low) }
    }

    /// Standard deviation of the time of a mark of this number of `photons`, ticks.
    fn timing(&self, photons: f64, excess: f64) -> f64 {
        let square = self.rms * self.rms;
        let steepness = photons / square * libm::exp(-0.5 / square);
        // The variance of half the difference of the samples on both sides.
        let slope = self.noise * (1.0 - self.correlation[1]) / 2.0;
        (slope / steepness.powi(2) + excess * self.by_photon / photons).sqrt()
    }
}

/// Noise as the receiver estimates it, photons.
#[derive(Debug, Clone, Copy)]
struct Estimated {
    level: f64,
    deviation: f64,
}

/// When the channels of `design` are blind with what they send, under `background` detections per second: stray
/// light shows where it stands out of the noise.
pub(super) fn blind(sampled: &Sampled, sampling: &Sampling, background: f64) -> Option<Blind> {
    Blind::of(sampling, sampled.stray_shows(background) / sampled.sample)
}

/// The findings of the receiver of `design` for marks of `photons` each, under `background` detections per
/// second. `told` lists the numbers of visible marks of some shots.
pub(super) fn chances(
    (design, sampled, settings): (&Design, &Sampled, &decode::Sampled),
    points: &[Points],
    background: f64,
    photons: f64,
    told: &[usize],
) -> Chances {
    let decode::Sampled { false_alarm, sampling, .. } = settings;
    let filtered = Filtered::of(sampled, sampling, background);
    let (nearest, farthest) = design.receiver.gate_ticks;
    let lags = f64::from(farthest - nearest) + 1.0;
    let threshold = -normal_quantile(false_alarm / lags);
    let weight = design.emission.coding().codebook.max_weight();
    let per_tick = weight as f64 * sampled.sample / design.scan.shortest_period();
    let estimated = filtered.estimated(photons, per_tick);
    let by_count: Vec<Seen> = (0..=weight)
        .map(|count| {
            let more = if count < weight { Sampling::MORE_IF_MISSING } else { 0.0 };
            let fewest = fewest(sampling, weight);
            let rule = Rule { threshold: threshold + more, count, weight, fewest, estimated };
            match count < fewest {
                true => Seen::default(),
                false => rule.seen(&filtered, &points[count], (photons, sampling.excess)),
            }
        })
        .collect();
    let mean = |of: &dyn Fn(usize) -> f64| {
        told.iter().map(|count| of(*count)).sum::<f64>() / told.len().max(1) as f64
    };
    let count = mean(&|count| count as f64).max(1.0);
    let seen = |count: usize| by_count.get(count).copied().unwrap_or_default();
    let pd = mean(&|count| seen(count).share);
    let height = mean(&|count| seen(count).share * seen(count).height) / pd.max(f64::MIN_POSITIVE);
    let timing = filtered.timing(height.max(f64::MIN_POSITIVE), sampling.excess) * sampled.sample;
    Chances {
        pd,
        timing: libm::hypot(timing, sampled.jitter) / count.sqrt(),
        snr: photons * count.sqrt() / filtered.noise.sqrt(),
    }
}

/// The least number of marks by which the receiver decides, for words of `weight` marks.
fn fewest(sampling: &Sampling, weight: usize) -> usize {
    usize::from(sampling.least_marks).min(weight)
}

/// The points of the sum for one number of marks: the delay of the light, ticks, and the normal deviates of
/// the noise of each mark at each lag.
#[derive(Debug, Clone)]
pub(super) struct Points {
    late: Vec<f64>,
    deviates: Vec<[f64; LAGS]>,
}

impl Points {
    /// For each number of marks that may count of the words of `design`; empty where none is enough.
    pub(super) fn of(design: &Design, sampling: &Sampling) -> Vec<Self> {
        let weight = design.emission.coding().codebook.max_weight();
        let points = |count: usize| {
            let mut points = Self { late: Vec::new(), deviates: Vec::new() };
            let enough = count >= fewest(sampling, weight);
            for point in 0..if enough { POINTS } else { 0 } {
                let mut axes = Axes::new(LAGS * count + 1, point);
                points.late.push(axes.next() - 0.5);
                let deviates = || [0; LAGS].map(|_| -normal_quantile(axes.next()));
                points.deviates.extend(std::iter::repeat_with(deviates).take(count));
            }
            points
        };
        (0..=weight).map(points).collect()
    }
}

/// Findings over all words.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    share: f64,
    /// Mean height of the marks of those.
    height: f64,
}

/// How many marks of a word must pass for how many.
struct Rule {
    /// Standard deviations of the sum that must be reached.
    threshold: f64,
    /// Marks that count, of how many.
    count: usize,
    weight: usize,
    /// Marks that must count.
    fewest: usize,
    estimated: Estimated,
}

impl Rule {
    fn seen(&self, filtered: &Filtered, points: &Points, (photons, excess): (f64, f64)) -> Seen {
        let deviation =
            |photons: f64| (filtered.noise + excess * filtered.of_photon * photons.max(0.0)).sqrt();
        // The sum that this number of marks must reach.
        let Estimated { level, deviation: estimated } = self.estimated;
        let needed = |threshold: f64, count: usize| threshold * estimated * (count as f64).sqrt();
        let all = needed(self.threshold, self.count);
        let others = needed(self.threshold + Sampling::MORE_IF_MISSING, self.count.max(1) - 1);
        let above = Sampling::most_above_least(self.count, self.weight);
        let [one, two] = filtered.correlation;
        let rest = (1.0 - one * one).max(0.0).sqrt();
        let mixed = if rest > 0.0 { (one - one * two) / rest } else { 0.0 };
        let last = (1.0 - two * two - mixed * mixed).max(0.0).sqrt();
        let mut heights = vec![[0.0; LAGS]; self.count];
        let found = points.late.iter().enumerate().filter_map(|(point, late)| {
            let means = [-1.0, 0.0, 1.0]
                .map(|lag: f64| photons * libm::exp(-0.5 * ((late + lag) / filtered.rms).powi(2)));
            let deviates = &points.deviates[point * self.count..][..self.count];
            for (heights, &[a, b, c]) in heights.iter_mut().zip(deviates) {
                let noise = [a, one * a + rest * b, two * a + mixed * b + last * c];
                for ((height, mean), noise) in heights.iter_mut().zip(means).zip(noise) {
                    *height = mean + deviation(mean) * noise - level;
                }
            }
            let is_found = (0..LAGS).any(|lag| {
                let heights = heights.iter().map(|heights| heights[lag]);
                let least = heights.clone().fold(f64::INFINITY, f64::min);
                let most = heights.clone().fold(f64::NEG_INFINITY, f64::max);
                let cap = least + above * deviation(least);
                let far = least + Sampling::FAR_ABOVE_LEAST * deviation(least);
                let sum = heights.map(|height| height.min(cap)).sum::<f64>();
                match most > far && self.count > self.fewest {
                    true => sum - most.min(cap) >= others,
                    false => sum >= all,
                }
            });
            let sum: f64 = heights.iter().map(|heights| heights[1]).sum();
            is_found.then_some(sum / self.count as f64)
        });
        let (count, sum) =
            found.fold((0.0, 0.0), |(count, sum), height| (count + 1.0, sum + height));
        Seen { share: count / f64::from(POINTS), height: sum / f64::max(count, 1.0) }
    }
}

/// The coordinates of a point that with others fills a cube evenly: the parts behind the point of multiples
/// of powers of the root of xᵈ⁺¹ = x + 1.
struct Axes {
    step: f64,
    power: f64,
    point: f64,
}

impl Axes {
    fn new(axes: usize, point: u32) -> Self {
        let mut root: f64 = 1.5;
        for _ in 0..32 {
            root = libm::pow(1.0 + root, 1.0 / (axes as f64 + 1.0));
        }
        Self { step: 1.0 / root, power: 1.0, point: f64::from(point) + 1.0 }
    }

    fn next(&mut self) -> f64 {
        self.power *= self.step;
        let part = 0.5 + self.point * self.power;
        (part - part.floor()).clamp(1e-9, 1.0 - 1e-9)
    }
}

/// The deepest point below zero to which the sensor's own marks pull the baseline of an amplifier coupled by
/// a capacitor, in detected photons. 0 if light does not move it.
///
/// Behind each mark it lies ω·Q lower, Q its [charge](Sampled::charge) after it was clipped, and comes back
/// with exp(−ω·t). The words follow each other along a line for as long as the baseline remembers.
pub fn deepest_baseline(design: &Design, sampled: &Sampled) -> f64 {
    if sampled.low_cutoff == 0.0 {
        return 0.0;
    }
    let step = sampled.low_cutoff * sampled.charge(sampled.stray);
    let remembered = REMEMBERED / (sampled.low_cutoff * design.scan.shortest_period());
    let shots = SHOTS.max(remembered.ceil().min(MOST_SHOTS) as usize);
    let (mut deepest, mut baseline, mut before) = (0.0_f64, 0.0, 0);
    for mark in (0..shots).flat_map(|shot| own_marks(design, shot)) {
        let apart = (mark - before) as f64 * sampled.sample;
        baseline = baseline * libm::exp(-sampled.low_cutoff * apart) + step;
        (deepest, before) = (deepest.max(baseline), mark);
    }
    deepest
}

/// Time constants after which less than a hundredth of what a mark did to the baseline is left.
const REMEMBERED: f64 = 5.0;

/// Most shots that are followed, whatever the baseline remembers: if it remembers more, each does next to
/// nothing to it.
const MOST_SHOTS: f64 = 1e5;
