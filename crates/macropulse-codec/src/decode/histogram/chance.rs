//! How rarely the background would look like a pulse.

use libm::{exp, log, log1p};

use super::model::Model;
use super::pulse::Kernel;
use crate::statistics::normal_quantile;

/// Halvings of the interval in which the likeliest share of a pulse lies.
const HALVINGS: usize = 48;

/// The evidence for a pulse at one lag, against a model without it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Chance {
    /// The photons of greatest likelihood.
    pub photons: f64,
    /// Logarithm of the likelihood with the pulse over that without it.
    evidence: f64,
    /// Probability of as much evidence at this lag where there is no pulse, over e^(−evidence).
    share: f64,
}

/// A bin that the pulse meets.
struct Bin {
    count: f64,
    /// Share of all counts that the model without the pulse expects here.
    expected: f64,
    /// Share of the counts of the pulse over that.
    ratio: f64,
}

impl Chance {
    /// A pulse at `step` beside `model`.
    ///
    /// Given their number N, counts fall into bins with the probabilities q_i of the model, or with
    /// (1 − f)·q_i + f·p_i if a share f of them is of the pulse. The evidence is
    ///
    /// > Λ = Σ n_i·w_i, w_i = ln(1 − f + f·p_i/q_i),
    ///
    /// a sum over N independent counts. By Chernoff's bound no more than e^(−Λ) of all histograms without a
    /// pulse reach it. The tail is below that bound by the share d/((1 − e^(−d))·σ·√(2π)) \[BR60\]. Here σ²
    /// is the variance of Λ with the pulse, and d the largest step by which a count raises Λ. For many counts
    /// this is the normal tail, for few that of the binomial distribution. The brightness of the background
    /// need not be known, as N is given.
    ///
    /// Counts of a bin whose variance is v times its mean weigh 1/v.
    pub fn of(model: &Model, step: i64) -> Self {
        let Model { exposed, expected, variance, .. } = model;
        let weight = |at: usize| if variance[at] > 0.0 { expected[at] / variance[at] } else { 0.0 };
        let weighed = |of: &[f64]| -> f64 {
            of.iter().enumerate().map(|(at, count)| count * weight(at)).sum()
        };
        let (all, all_expected) = (weighed(&exposed.count), weighed(expected));
        let (first, shares) = model.kernel.within(step, expected.len());
        let seen = |(at, share): (usize, &f64)| share * exposed.exposure[at] * weight(at);
        let all_seen: f64 = (first..).zip(shares).map(seen).sum();
        let mut bins = Vec::with_capacity(shares.len());
        for (at, share) in (first..).zip(shares) {
            let of_pulse = seen((at, share)) / all_seen;
            let expected = expected[at] * weight(at) / all_expected;
            if of_pulse > 0.0 && expected > 0.0 {
                let count = exposed.count[at] * weight(at);
                bins.push(Bin { count, expected, ratio: of_pulse / expected });
            }
        }
        let share = likeliest(&bins, all);
        let elsewhere = log1p(-share);
        let mut evidence = all * elsewhere;
        let (mut mean, mut square, mut largest) = (0.0, 0.0, 0.0_f64);
        for Bin { count, expected, ratio } in bins {
            // The weight of a count here over that of one elsewhere.
            let more = log1p(share * ratio / (1.0 - share));
            let probability = expected * (1.0 - share + share * ratio);
            evidence += count * more;
            mean += probability * more;
            square += probability * more * more;
            largest = largest.max(more);
        }
        let spread = (std::f64::consts::TAU * all * (square - mean * mean)).sqrt();
        let prefactor = largest / ((1.0 - exp(-largest)) * spread);
        let photons = share * all / all_seen;
        Self { photons, evidence, share: if prefactor < 1.0 { prefactor } else { 1.0 } }
    }

    /// The evidence in standard deviations of a normal variable, √(2Λ); 0 where there is none.
    pub fn level(&self) -> f64 {
        (2.0 * self.evidence).max(0.0).sqrt()
    }

    /// Whole standard deviations beyond the threshold at which `false_alarm` returns of a histogram are
    /// false; `None` below it.
    ///
    /// The gate has `places` bins. The filter rises through a level x as often as x·r/√(2π) independent lags
    /// per bin exceed it \[Rice44\]. Here r is the roughness of the pulse, and x = √(2Λ). At most two lags
    /// per bin count, as no more are looked at.
    pub fn margin(&self, kernel: &Kernel, places: f64, false_alarm: f64) -> Option<u16> {
        // Evidence that is no number is none.
        if !(self.evidence > 0.0 && self.photons.is_finite()) {
            return None;
        }
        let level = self.level();
        let rises = level * kernel.roughness / std::f64::consts::TAU.sqrt();
        let lags = places * rises.min(2.0);
        if log(lags * self.share) - self.evidence > log(false_alarm) {
            return None;
        }
        let threshold = -normal_quantile((false_alarm / lags).min(0.5));
        Some((level - threshold).max(0.0) as u16)
    }
}

/// Returns the share f of `all` counts that a pulse most likely has; 0 if there is no excess. It is the zero
/// of Σ n_i·(r_i − 1)/(1 − f + f·r_i), which falls with f. Here r_i is the ratio of a bin, and 0 outside the
/// pulse.
fn likeliest(bins: &[Bin], all: f64) -> f64 {
    let inside: f64 = bins.iter().map(|bin| bin.count).sum();
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let share = f64::midpoint(low, high);
        let rest = 1.0 - share;
        let gain = |bin: &Bin| bin.count * (bin.ratio - 1.0) / (rest + share * bin.ratio);
        let slope = bins.iter().map(gain).sum::<f64>() - (all - inside).max(0.0) / rest;
        if slope > 0.0 { low = share } else { high = share }
    }
    low
}
