//! The search for the place in a histogram where another pulse would explain most of the rest.

use super::model::Model;
use super::pulse::{self, Kernel, STEPS};
use crate::Histograms;

/// Steps from lag to lag that is looked at: between them half a bin, so that a pulse as short as a bin
/// is not missed.
pub(super) const STRIDE: usize = STEPS / 2;

/// The lags that are looked at: those at which the peak of the pulse lies in the histogram. Light from
/// beyond the gate is found too, so that its tail is not taken for a surface within.
#[derive(Debug, Clone)]
pub(super) struct Search<'a> {
    pub kernel: &'a Kernel,
    /// The first lag of the gate and the last one, in bins.
    gate: (f64, f64),
    bins: usize,
}

impl<'a> Search<'a> {
    /// The search of `histograms` for light in `gate_fs`.
    pub fn new(kernel: &'a Kernel, histograms: &Histograms, gate_fs: (i64, i64)) -> Self {
        let (bins, bin_fs) = (histograms.bins as usize, histograms.bin_fs);
        let lag = |gate_fs: i64| {
            let after_fs = i128::from(gate_fs) - i128::from(histograms.offset_fs);
            pulse::lag(after_fs, bin_fs, kernel.origin)
        };
        let peak = kernel.peak as f64;
        let gate = (lag(gate_fs.0).max(-peak), lag(gate_fs.1).min(bins as f64 - 1.0 - peak));
        Self { kernel, gate, bins }
    }

    /// True if a lag is in the gate.
    pub fn is_in_gate(&self, lag: f64) -> bool {
        (self.gate.0..=self.gate.1).contains(&lag)
    }

    /// Lags in the gate, a bin apart.
    pub fn places(&self) -> f64 {
        (self.gate.1 - self.gate.0 + 1.0).max(1.0)
    }

    /// The steps that are looked at.
    pub fn steps(&self) -> impl Iterator<Item = i64> + Clone + use<> {
        let first = -((self.kernel.peak * STEPS) as i64);
        (first..first + (self.bins * STEPS) as i64).step_by(STRIDE)
    }
}

/// The one of `steps` at which the matched filter of what `model` leaves over is highest, in its own
/// standard deviations:
///
/// > z(s) = Σ p_i(s)·(n_i − λ_i)·e_i/v_i / √(Σ p_i(s)²·e_i²/v_i),
///
/// n being counts, λ what is expected, v its variance, e the exposure and p the pulse. `None` if it is
/// nowhere above 0.
pub(super) fn strongest(
    kernel: &Kernel,
    model: &Model,
    steps: impl Iterator<Item = i64>,
) -> Option<i64> {
    let bins = model.expected.len();
    let mut excess = Vec::with_capacity(bins);
    let mut weight = Vec::with_capacity(bins);
    for at in 0..bins {
        let (exposure, variance) = (model.exposed.exposure[at], model.variance[at]);
        let per = if variance > 0.0 { exposure / variance } else { 0.0 };
        excess.push((model.exposed.count[at] - model.expected[at]) * per);
        weight.push(per * exposure);
    }
    let (mut best, mut highest) = (None, 0.0);
    for step in steps {
        let (first, shares) = kernel.within(step, bins);
        let bins = first..first + shares.len();
        let (mut sum, mut square) = (0.0, 0.0);
        for ((share, excess), weight) in shares.iter().zip(&excess[bins.clone()]).zip(&weight[bins])
        {
            sum += share * excess;
            square += share * share * weight;
        }
        let score = if square > 0.0 { sum / square.sqrt() } else { 0.0 };
        if score > highest {
            (best, highest) = (Some(step), score);
        }
    }
    best
}
