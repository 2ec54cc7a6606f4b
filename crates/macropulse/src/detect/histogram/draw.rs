//! How many counts each bin of a histogram has.
//!
//! SPAD cells of a pixel share its light evenly. There are three cases:
//!
//! - If cells count without dead time, the counts of a bin are a Poisson variable.
//! - If they count once a cycle, a cell that has not yet counted does so in bin i with probability
//!   1 − exp(−λᵢ/N). Here λᵢ is the mean detections of all N cells. Bin by bin this is a binomial variable of
//!   the cells that are left; together it is one multinomial.
//! - With a dead time, afterpulses or crosstalk the cells are followed from count to count.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rand::RngExt;
use rand_distr::{Binomial, Distribution, Exp1, Poisson};

use crate::design::detector::{Arming, Geiger};
use crate::random::Stream;

/// Runs of bins with the same light are drawn together from this length on.
const LONG: usize = 8;

/// This many detections for each cell make every armed one count, but for one in 10⁷.
const FLOOD: f64 = 16.0;

/// The cells of a pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cells {
    number: u32,
    dead_fs: i64,
    arming: Arming,
    /// Probability that a count leaves an afterpulse, and its mean delay, fs.
    afterpulse: (f64, f64),
    /// Probability that a count makes another cell count.
    crosstalk: f64,
    /// Length of a cycle, fs.
    cycle_fs: i64,
    bin_fs: i64,
    /// Bins that are recorded.
    bins: usize,
}

impl Cells {
    pub fn new(geiger: &Geiger, cycle_fs: i64, bin_fs: i64, bins: u32) -> Self {
        Self {
            number: geiger.cells,
            dead_fs: geiger.dead_fs,
            arming: geiger.arming,
            afterpulse: (geiger.afterpulsing, geiger.afterpulse_fs as f64),
            crosstalk: geiger.crosstalk,
            cycle_fs,
            bin_fs,
            bins: bins as usize,
        }
    }

    /// Detections in a bin beyond which no more of them change a count: each cell counts once, or once a dead time.
    fn most_in_bin(&self) -> f64 {
        let counts = match self.arming {
            Arming::OncePerPulse => 1.0,
            Arming::FreeRunning => 1.0 + self.bin_fs as f64 / self.dead_fs as f64,
        };
        FLOOD * counts * f64::from(self.number)
    }

    /// Returns true if a cell depends on earlier cycles or on other cells.
    fn have_state(&self) -> bool {
        let is_blind = self.dead_fs > 0 && self.arming == Arming::FreeRunning;
        is_blind || self.afterpulse.0 > 0.0 || self.crosstalk > 0.0
    }

    /// Bins of a cycle whose light must be known: those recorded, or all of them where a count blinds a cell for
    /// what follows.
    pub fn bins_of_cycle(&self) -> usize {
        match self.have_state() {
            true => (self.cycle_fs / self.bin_fs) as usize,
            false => self.bins,
        }
    }

    /// Adds the counts of one histogram to `counts`. The light is given by runs of cycles: how many, and the mean
    /// detections in each bin of one of them, `steady` where no pulse comes.
    pub fn count(
        &self,
        lit: impl Iterator<Item = (u32, Vec<f64>)>,
        steady: f64,
        stream: &mut Stream,
        counts: &mut Vec<u32>,
    ) {
        let from = counts.len();
        counts.resize(from + self.bins, 0);
        let counts = &mut counts[from..];
        if self.have_state() {
            return self.follow(lit, stream, counts);
        }
        for (cycles, rates) in lit {
            let trials = u64::from(cycles) * u64::from(self.number);
            match self.arming {
                Arming::FreeRunning => {
                    independent(f64::from(cycles), (&rates, steady), stream, counts);
                }
                Arming::OncePerPulse => {
                    let share = 1.0 / f64::from(self.number);
                    first_of_each((trials, share), (&rates, steady), stream, counts);
                }
            }
        }
    }

    /// Follows the cells from count to count. Detections of cells that are always armed come at random; one that
    /// falls on a cell that is not armed makes no count.
    fn follow(
        &self,
        lit: impl Iterator<Item = (u32, Vec<f64>)>,
        stream: &mut Stream,
        counts: &mut [u32],
    ) {
        let mut state = State { armed_at: vec![0; self.number as usize], later: BinaryHeap::new() };
        let (mut first, most) = (0_i64, self.most_in_bin());
        for (cycles, mut rates) in lit {
            rates.iter_mut().for_each(|rate| *rate = rate.min(most));
            let sums: Vec<f64> = rates
                .iter()
                .scan(0.0, |sum, rate| {
                    *sum += rate;
                    Some(*sum)
                })
                .collect();
            let of_cycle = sums.last().copied().unwrap_or(0.0);
            let end = first + i64::from(cycles);
            let (mut cycle, mut at) = (first, 0.0);
            while of_cycle > 0.0 && cycle < end {
                let step: f64 = Exp1.sample(stream);
                at += step;
                let whole = (at / of_cycle).floor();
                cycle = cycle.saturating_add(whole as i64);
                at = (at - whole * of_cycle).max(0.0);
                if cycle >= end {
                    break;
                }
                let bin = sums.partition_point(|sum| *sum <= at).min(sums.len() - 1);
                let within = (at - (sums[bin] - rates[bin])) / rates[bin].max(f64::MIN_POSITIVE);
                let bin_fs = self.bin_fs as f64;
                let since_fs = ((bin as f64 + within.clamp(0.0, 1.0)) * bin_fs) as i64;
                let time_fs = cycle * self.cycle_fs + since_fs;
                self.release(&mut state, time_fs, stream, counts);
                let cell = stream.random_range(0..self.number);
                self.fire(&mut state, (time_fs, cell), stream, counts);
            }
            first = end;
            self.release(&mut state, first * self.cycle_fs, stream, counts);
        }
    }

    /// The afterpulses that are due before `time_fs`.
    fn release(&self, state: &mut State, time_fs: i64, stream: &mut Stream, counts: &mut [u32]) {
        while let Some(Reverse(due)) = state.later.peek().copied() {
            if due.0 > time_fs {
                return;
            }
            state.later.pop();
            self.fire(state, due, stream, counts);
        }
    }

    /// A detection in a cell at a time, fs since the first pulse, with the crosstalk that follows from it.
    fn fire(
        &self,
        state: &mut State,
        (time_fs, cell): (i64, u32),
        stream: &mut Stream,
        counts: &mut [u32],
    ) {
        let mut next = Some(cell);
        while let Some(cell) = next.take() {
            let armed_at = &mut state.armed_at[cell as usize];
            if *armed_at > time_fs {
                return;
            }
            *armed_at = match self.arming {
                Arming::FreeRunning => time_fs + self.dead_fs,
                Arming::OncePerPulse => {
                    let next = time_fs - time_fs.rem_euclid(self.cycle_fs) + self.cycle_fs;
                    next.max(time_fs + self.dead_fs)
                }
            };
            let bin = (time_fs.rem_euclid(self.cycle_fs) / self.bin_fs) as usize;
            if let Some(count) = counts.get_mut(bin) {
                *count = count.saturating_add(1);
            }
            let (chance, mean_fs) = self.afterpulse;
            if chance > 0.0 && stream.fraction() < chance {
                let delay: f64 = Exp1.sample(stream);
                let due = time_fs.saturating_add((delay * mean_fs) as i64);
                state.later.push(Reverse((due, cell)));
            }
            if self.number > 1 && self.crosstalk > 0.0 && stream.fraction() < self.crosstalk {
                let other = stream.random_range(0..self.number - 1);
                next = Some(other + u32::from(other >= cell));
            }
        }
    }
}

/// The cells while they are followed.
struct State {
    /// When each is armed again, fs.
    armed_at: Vec<i64>,
    /// Afterpulses to come: when, and in which cell.
    later: BinaryHeap<Reverse<(i64, u32)>>,
}

/// Runs of bins with the `steady` rate, and single bins with another: their first bin, and how many.
fn runs(rates: &[f64], steady: f64) -> impl Iterator<Item = (usize, usize)> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let rest = rates.get(at..).filter(|rest| !rest.is_empty())?;
        let alike = rest.iter().take_while(|rate| **rate == steady).count().max(1);
        let first = at;
        at += alike;
        Some((first, alike))
    })
}

/// Counts of cells that are always armed: Poisson in each bin.
fn independent(
    cycles: f64,
    (rates, steady): (&[f64], f64),
    stream: &mut Stream,
    counts: &mut [u32],
) {
    for (first, bins) in runs(rates, steady) {
        let mean = cycles * rates[first];
        let counts = &mut counts[first..first + bins];
        if bins >= LONG && mean < 1.0 {
            // The total is drawn first; each count then chooses a bin at random.
            let total = poisson(mean * bins as f64, stream);
            for _ in 0..total {
                counts[stream.random_range(0..bins)] += 1;
            }
        } else {
            for count in counts {
                *count = count.saturating_add(poisson(mean, stream) as u32);
            }
        }
    }
}

fn poisson(mean: f64, stream: &mut Stream) -> u64 {
    Poisson::new(mean).map_or(0, |law| {
        let drawn: f64 = law.sample(stream);
        drawn as u64
    })
}

/// Adds the first counts of `trials`, cells in cycles. Each of them gets this `share` of the light.
fn first_of_each(
    (trials, share): (u64, f64),
    (rates, steady): (&[f64], f64),
    stream: &mut Stream,
    counts: &mut [u32],
) {
    let mut left = trials;
    let binomial = |left: u64, detections: f64, stream: &mut Stream| {
        Binomial::new(left, -libm::expm1(-detections)).map_or(0, |law| law.sample(stream))
    };
    for (first, bins) in runs(rates, steady) {
        let each = rates[first] * share;
        let counts = &mut counts[first..first + bins];
        if bins >= LONG && left as f64 * each < 1.0 {
            let total = binomial(left, each * bins as f64, stream);
            left -= total;
            // When within the run the first detection of a cell comes that has one: exponential, cut off.
            let end = -libm::expm1(-each * bins as f64);
            for _ in 0..total {
                let since = -libm::log1p(-end * stream.fraction()) / each;
                counts[(since as usize).min(bins - 1)] += 1;
            }
        } else {
            for count in counts {
                let here = binomial(left, each, stream);
                left -= here;
                *count = count.saturating_add(here as u32);
            }
        }
    }
}

#[cfg(test)]
mod tests;
