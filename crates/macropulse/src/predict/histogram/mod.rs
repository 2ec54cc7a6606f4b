//! Findings of a receiver of histograms for a target that each pulse of a burst meets.
//!
//! The mean counts of each bin follow from the light of a cycle and the cells. They are Poisson variables,
//! nearly also where cells are blind for a while after a count, as a cell rarely counts twice within a pulse.
//! Histograms are drawn with these means, with numbers of photons that are spread evenly over their
//! distribution. The receiver's own rule says which of them show the target.

mod cells;

use std::sync::Arc;

use macropulse_codec::decode::Method;
use macropulse_codec::decode::histogram::{Decision, Exposed, PileUp, Stretch};
use rand_distr::{Binomial, Distribution, Poisson};

use super::unmodelled::Unmodelled;
use super::way::{Chances, ClosedForm, Incident, Way};
use crate::design::detector::{Geiger, PLENTY};
use crate::design::{Design, Detector};
use crate::random::{Chance, Stage, Stream};
use crate::units::{RMS_OF_FWHM, fs_from_s, range_from_tof, s_from_fs, tof_from_range};

/// Histograms that are drawn: a probability is known to 0.006, one standard deviation, and better where photons are
/// many.
const DRAWN: usize = 2048;

/// Evidence beyond any threshold by more than it varies, standard deviations.
const CERTAIN: f64 = 24.0;

/// Places in a bin over which a precision is the mean.
const PHASES: i64 = 8;

/// Dead times of this number of cycles or more are refused: the cells take long to settle.
const MOST_CYCLES: i64 = 16;

/// Counts of bursts, in histograms, which follow afterpulses.
pub(super) static WAY: Way = Way {
    not_modelled,
    closed_form: |design| Some(Arc::new(Counting::of(design)?)),
    limit_of_light: "it comes after the last bin of the histogram",
    effects: &[(Unmodelled::Afterpulsing, None)],
};

fn not_modelled(design: &Design) -> Option<(String, String)> {
    let Detector::Geiger(geiger) = &design.detector else { return None };
    let what = if geiger.crosstalk > 0.0 {
        "optical crosstalk between cells"
    } else if geiger.dead_fs / design.emission.burst()?.interval_fs >= MOST_CYCLES {
        "a dead time of many cycles"
    } else {
        return None;
    };
    Some((what.to_owned(), "simulate it".to_owned()))
}

/// A sensor that counts in histograms, and its receiver.
#[derive(Debug, Clone)]
struct Counting {
    geiger: Geiger,
    decision: Decision,
    pile_up: PileUp,
    false_alarm: f64,
    bin_fs: i64,
    /// Bins that are recorded, and bins of a cycle.
    bins: usize,
    of_cycle: usize,
    pulses: f64,
    /// rms length of a pulse with the jitter, s.
    rms: f64,
}

/// Mean counts in the bins that are recorded.
struct Means {
    /// As counted.
    counted: Vec<f64>,
    /// Factor of the receiver on each count, and the exposure that it takes the bin to have.
    corrected: Vec<f64>,
    exposure: Vec<f64>,
    /// Counts that the receiver makes of each photon that is detected.
    per_photon: Vec<f64>,
}

impl Counting {
    /// The counting of a sensor with histograms; `None` for others.
    fn of(design: &Design) -> Option<Self> {
        let (Detector::Geiger(geiger), Method::Histogram(method)) =
            (&design.detector, &design.receiver.method)
        else {
            return None;
        };
        let (burst, histogram) = (design.emission.burst()?, design.readout.histogram()?);
        let bin_fs = design.clock.tick_fs;
        let gate_fs = design.receiver.gate_fs();
        Some(Self {
            geiger: *geiger,
            decision: Decision::new(method, (bin_fs, histogram.bins), gate_fs)?,
            pile_up: method.pile_up,
            false_alarm: method.false_alarm,
            bin_fs,
            bins: histogram.bins as usize,
            of_cycle: (burst.interval_fs / bin_fs) as usize,
            pulses: f64::from(burst.pulses),
            rms: libm::hypot(design.light.pulse * RMS_OF_FWHM, design.detector.model().jitter()),
        })
    }
}

impl ClosedForm for Counting {
    fn false_alarm(&self) -> f64 {
        self.false_alarm
    }

    /// Cells that count once a pulse miss an echo behind too much light.
    fn can_be_blinded(&self) -> bool {
        true
    }

    /// A target whose light comes after the last bin is never found.
    fn chances(&self, incident: &Incident) -> Chances {
        let &Incident { range, photons, falling, .. } = incident;
        let tof_fs = fs_from_s(tof_from_range(range));
        let of_shot = (photons * self.pulses).max(f64::MIN_POSITIVE);
        let bound = range_from_tof(self.rms) / of_shot.sqrt();
        let Some(stretch) = self.decision.stretch(tof_fs) else {
            return Chances { bound, ..Chances::default() };
        };
        let photons = photons.min(PLENTY);
        let means = self.means(&self.decision.shares(tof_fs), photons, falling);
        let at = stretch.first..stretch.first + stretch.shares.len();
        let sums = |column: &[f64]| {
            let all: f64 = column.iter().sum();
            all - column[at.clone()].iter().sum::<f64>()
        };
        let scaled: Vec<f64> =
            means.counted.iter().zip(&means.corrected).map(|(count, by)| count * by).collect();
        let rest = (sums(&scaled), sums(&means.exposure));
        let exposed = |count: Vec<f64>| Exposed {
            count,
            exposure: means.exposure[at.clone()].to_vec(),
            is_exhausted: false,
        };
        let (level, _) = self.decision.judge(&stretch, exposed(scaled[at.clone()].to_vec()), rest);
        let drawn = (level < CERTAIN).then(|| {
            let counted = &means.counted[at.clone()];
            let corrected = &means.corrected[at.clone()];
            let mut stream = Chance::new(0).at(Stage::Forecast, 0);
            let found = totals(counted.iter().sum()).filter(|total| {
                let counts = shared(*total, counted, &mut stream);
                let counts = counts.iter().zip(corrected).map(|(count, by)| count * by).collect();
                let rest = (poisson(rest.0, &mut stream), rest.1);
                self.decision.judge(&stretch, exposed(counts), rest).1
            });
            found.count() as f64 / DRAWN as f64
        });
        let precision = self.precision(&means, &stretch, tof_fs, (photons, falling));
        // √(2Λ) of the mean counts, Λ the logarithm of the likelihood ratio.
        Chances { pd: drawn.unwrap_or(1.0), snr: level, precision, bound }
    }
}

impl Counting {
    /// Mean counts for a pulse with these `shares` of its `photons`.
    fn means(&self, shares: &[f64], photons: f64, falling: f64) -> Means {
        let steady = falling * s_from_fs(self.bin_fs);
        let mut rates = vec![steady; self.of_cycle];
        for (rate, share) in rates.iter_mut().zip(shares) {
            *rate += photons * share;
        }
        let of_cycle = cells::counts(&self.geiger, &rates, self.bin_fs);
        let counted: Vec<f64> =
            of_cycle.iter().take(self.bins).map(|count| count * self.pulses).collect();
        let trials = self.pulses * f64::from(self.geiger.cells);
        let (mut exposure, mut corrected) = (vec![1.0; self.bins], vec![1.0; self.bins]);
        if self.pile_up == PileUp::Coates {
            let mut left = trials;
            for (bin, count) in counted.iter().enumerate() {
                exposure[bin] = left / trials;
                // As the receiver does, which takes half a cycle as left.
                let share = (count / left).min(1.0 - 0.5 / left).max(0.0);
                if share > 0.0 {
                    corrected[bin] = -libm::log1p(-share) / share;
                }
                left = (left - count).max(f64::MIN_POSITIVE);
            }
        }
        let per_photon = counted
            .iter()
            .zip(&corrected)
            .zip(&rates)
            .map(|((count, by), rate)| if *rate > 0.0 { count * by / rate } else { 0.0 })
            .collect();
        Means { counted, corrected, exposure, per_photon }
    }

    /// Standard deviation of the range, m: the Cramér–Rao bound of the time of a pulse in bins, I = Σ λ'ᵢ²/λᵢ
    /// \[Kay93\]. It is no more than that of a photon, or of a time that is known to lie in a bin. The
    /// variance is the mean over places in a bin.
    fn precision(
        &self,
        means: &Means,
        stretch: &Stretch,
        tof_fs: i64,
        (photons, falling): (f64, f64),
    ) -> f64 {
        let steady = falling * s_from_fs(self.bin_fs);
        let step = self.bin_fs / PHASES;
        let variance = |phase: i64| {
            let middle = tof_fs + (phase - PHASES / 2) * step;
            let [before, here, behind] =
                [middle - step, middle, middle + step].map(|at| self.decision.shares(at));
            let bins = stretch.first..stretch.first + stretch.shares.len();
            let information = bins.map(|bin| {
                let mean = steady + photons * here[bin];
                // By bins.
                let slope = photons * (behind[bin] - before[bin]) * PHASES as f64 / 2.0;
                let by = means.per_photon[bin];
                if mean > 0.0 { by * slope * slope / mean } else { 0.0 }
            });
            let spread = spread(&here[stretch.first..stretch.first + stretch.shares.len()]);
            (1.0 / information.sum::<f64>()).min(spread.max(1.0 / 12.0))
        };
        let mean = (0..PHASES).map(variance).sum::<f64>() / PHASES as f64;
        range_from_tof(s_from_fs(self.bin_fs)) * mean.sqrt()
    }
}

/// Variance of the place of a photon with these shares of bins, in squares of a bin.
fn spread(shares: &[f64]) -> f64 {
    let moment = |power: i32| -> f64 {
        shares.iter().enumerate().map(|(bin, share)| share * (bin as f64).powi(power)).sum()
    };
    let all = moment(0).max(f64::MIN_POSITIVE);
    moment(2) / all - (moment(1) / all).powi(2)
}

/// Numbers of photons that are spread evenly over the Poisson distribution of this `mean`, in their order.
fn totals(mean: f64) -> impl Iterator<Item = u64> {
    let first = (mean - 10.0 * mean.sqrt() - 10.0).max(0.0).floor();
    let mut total = first as u64;
    let mut probability = macropulse_codec::statistics::poisson(mean, first);
    let mut up_to = probability;
    (0..DRAWN).map(move |point| {
        let place = (point as f64 + 0.5) / DRAWN as f64;
        while up_to < place && probability > 0.0 {
            total += 1;
            probability *= mean / total as f64;
            up_to += probability;
        }
        total
    })
}

/// Spreads `total` photons over the bins, each with a probability in proportion to the mean of a bin.
fn shared(total: u64, means: &[f64], stream: &mut Stream) -> Vec<f64> {
    let (mut left, mut of_left) = (total, means.iter().sum::<f64>());
    let mut each = Vec::with_capacity(means.len());
    for mean in means {
        let share = if of_left > 0.0 { (mean / of_left).clamp(0.0, 1.0) } else { 0.0 };
        let here = Binomial::new(left, share).map_or(0, |law| law.sample(stream));
        left -= here;
        of_left -= mean;
        each.push(here as f64);
    }
    each
}

fn poisson(mean: f64, stream: &mut Stream) -> f64 {
    Poisson::new(mean).map_or(0.0, |law| law.sample(stream))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Mean and variance are those of the distribution; control: not those of one with a tenth more.
    #[test]
    fn totals_are_spread_as_the_poisson_distribution_is() {
        for mean in [0.3, 4.0, 250.0, 1e5] {
            let all: Vec<f64> = totals(mean).map(|total| total as f64).collect();
            let found = all.iter().sum::<f64>() / all.len() as f64;
            let spread =
                all.iter().map(|one| (one - found).powi(2)).sum::<f64>() / all.len() as f64;
            assert_relative_eq!(found, mean, max_relative = 5e-3);
            assert_relative_eq!(spread, mean, max_relative = 2e-2);
            assert!((spread - 1.1 * mean).abs() > 0.05 * mean);
        }
    }
}
