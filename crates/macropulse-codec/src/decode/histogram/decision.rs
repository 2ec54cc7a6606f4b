//! The receiver's decision on one pulse in made-up counts, for forecasts.

use super::chance::Chance;
use super::model::Model;
use super::pile_up::Exposed;
use super::pulse::{Kernel, STEPS};
use super::search::{STRIDE, Search, strongest};
use super::{HistogramMethod, pulse};
use crate::Histograms;

/// Lags to both sides of a pulse at which it may be found, in bins at least.
const BESIDE: usize = 2;

/// How the receiver judges a pulse at a known place, in a stretch of bins about it and one bin that stands for
/// all others.
#[derive(Debug, Clone)]
pub struct Decision {
    kernel: Kernel,
    places: f64,
    false_alarm: f64,
    bin_fs: i64,
    bins: usize,
}

/// The bins about a pulse.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// The first of them.
    pub first: usize,
    /// Share of the pulse in each of them.
    pub shares: Vec<f64>,
    /// The steps at which the receiver looks for it, from the first of these bins on.
    steps: Vec<i64>,
}

impl Decision {
    /// Returns the decisions of `method` in histograms of `bins` bins, each `bin_fs` long, with the gate
    /// `gate_fs`. `None` if its pulse has no kernel in such bins.
    pub fn new(
        method: &HistogramMethod,
        (bin_fs, bins): (i64, u32),
        gate_fs: (i64, i64),
    ) -> Option<Self> {
        let kernel = Kernel::new(&method.pulse, bin_fs)?;
        let (cycles, counts) = (Vec::new(), Vec::new());
        let empty = Histograms { bin_fs, offset_fs: 0, bins, cycles, counts };
        let places = Search::new(&kernel, &empty, gate_fs).places();
        let false_alarm = method.false_alarm;
        Some(Self { kernel, places, false_alarm, bin_fs, bins: bins as usize })
    }

    /// The share of a pulse in each bin, with a time of flight of `tof_fs`.
    pub fn shares(&self, tof_fs: i64) -> Vec<f64> {
        let mut all = vec![0.0; self.bins];
        let (first, shares) = self.kernel.within(self.step(tof_fs), self.bins);
        for (bin, share) in all.iter_mut().skip(first).zip(shares) {
            *bin = *share;
        }
        all
    }

    /// The bins about a pulse with a time of flight of `tof_fs`; `None` if its peak lies in none.
    pub fn stretch(&self, tof_fs: i64) -> Option<Stretch> {
        let begins = self.step(tof_fs);
        let start = begins.div_euclid(STEPS as i64);
        let peak = usize::try_from(start + self.kernel.peak as i64).ok()?;
        if peak >= self.bins {
            return None;
        }
        // Noise moves the highest lag of a pulse by less than √2 of its rms length.
        let beside = BESIDE.max((1.0 / self.kernel.roughness).ceil() as usize) as i64;
        let first = usize::try_from(start - beside).unwrap_or(0);
        let until = start + self.kernel.length as i64 + beside;
        let until = usize::try_from(until).unwrap_or(0).min(self.bins);
        let (reach, shift) = (beside * STEPS as i64, (first * STEPS) as i64);
        let steps = (begins - reach..=begins + reach)
            .filter(|step| step.rem_euclid(STRIDE as i64) == 0)
            .map(|step| step - shift);
        let shares = self.shares(tof_fs)[first..until].to_vec();
        Some(Stretch { first, shares, steps: steps.collect() })
    }

    fn step(&self, tof_fs: i64) -> i64 {
        let lag = pulse::lag(i128::from(tof_fs), self.bin_fs, self.kernel.origin);
        (lag * STEPS as f64).round() as i64
    }

    /// The evidence for a pulse in `stretch`, in standard deviations of a normal variable, and whether the receiver
    /// believes it. `seen` are its bins; all others together have `rest` as their count and their exposure.
    pub fn judge(&self, stretch: &Stretch, mut seen: Exposed, rest: (f64, f64)) -> (f64, bool) {
        // The pulse does not reach the bin that stands for the others.
        for (column, all) in [(&mut seen.count, rest.0), (&mut seen.exposure, rest.1)] {
            column.resize(column.len() + self.kernel.length, 0.0);
            column.push(all);
        }
        let Some(model) = Model::new(&self.kernel, &seen, 0.0) else { return (0.0, false) };
        let Some(step) = strongest(&self.kernel, &model, stretch.steps.iter().copied()) else {
            return (0.0, false);
        };
        let chance = Chance::of(&model, step);
        let margin = chance.margin(&self.kernel, self.places, self.false_alarm);
        (chance.level(), margin.is_some())
    }
}
