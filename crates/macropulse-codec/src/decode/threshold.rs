//! How many marks must be found together before a return is believed.

use super::belief::{Marks, evidence_at};
use crate::statistics::binomial_tail;

/// Returns the fewest marks that chance does not reach: the smallest k with L · P(Bin(N, d) ≥ k) ≤ α. L is
/// the number of `lags` tried, N the number of `marks`, d the `density` of lit places and α the false alarms
/// accepted. The result is N + 1 if no k will do.
pub(super) fn least_marks(lags: f64, marks: u32, density: f64, false_alarm: f64) -> u32 {
    fewest(marks, |least| {
        lags * binomial_tail(marks as usize, density, least as usize) <= false_alarm
    })
}

/// The fewest of `marks` that are enough, where more are enough, too; one more than there are if none are.
pub(super) fn fewest(marks: u32, mut is_enough: impl FnMut(u32) -> bool) -> u32 {
    let (mut low, mut high) = (1, marks + 1);
    while low < high {
        let middle = low.midpoint(high);
        match is_enough(middle) {
            true => high = middle,
            false => low = middle + 1,
        }
    }
    low
}

/// [`least_marks`] for fixed lags and false alarms, remembered.
#[derive(Debug, Clone)]
pub(super) struct Thresholds {
    lags: f64,
    false_alarm: f64,
    /// By marks.
    known: Vec<Option<Box<Known>>>,
}

/// Thresholds known for a number of marks.
#[derive(Debug, Clone)]
struct Known {
    /// By step of density; 0 where not yet known.
    at_step: [u32; STEPS],
    /// By number of marks, the density up to which they are enough; NaN if not yet known.
    enough_to: Vec<f64>,
}

/// Steps of density, eight to an octave: the exponent and the first three bits of the fraction of
/// a double. The first one is taken for everything below.
const STEPS: usize = 8 * 24;
const STEP_BITS: u32 = 49;
const FIRST_STEP: u64 = (0x3FF_u64 << 3) - (STEPS as u64 - 1);

impl Thresholds {
    /// For `lags` tried places and `false_alarm` false answers accepted among them.
    pub fn new(lags: f64, false_alarm: f64) -> Self {
        Self { lags, false_alarm, known: Vec::new() }
    }

    /// True if it gives the same thresholds as `other`.
    pub fn is_as(&self, other: &Self) -> bool {
        (self.lags, self.false_alarm) == (other.lags, other.false_alarm)
    }

    /// The fewest of `marks` to believe at `density`.
    pub fn least(&mut self, marks: u32, density: f64) -> u32 {
        if density <= 0.0 {
            return 1;
        }
        let (lags, false_alarm) = (self.lags, self.false_alarm);
        let above = (density.min(1.0).to_bits() + (1 << STEP_BITS) - 1) >> STEP_BITS;
        let step = above.saturating_sub(FIRST_STEP).min(STEPS as u64 - 1);
        if self.known.len() <= marks as usize {
            self.known.resize(marks as usize + 1, None);
        }
        let nothing = || {
            Box::new(Known { at_step: [0; STEPS], enough_to: vec![f64::NAN; marks as usize + 1] })
        };
        let known = self.known[marks as usize].get_or_insert_with(nothing);
        let at_step = &mut known.at_step[step as usize];
        if *at_step == 0 {
            let density = f64::from_bits((FIRST_STEP + step) << STEP_BITS);
            *at_step = least_marks(lags, marks, density, false_alarm);
        }
        let mut least = *at_step;
        // At the end of the step this number is needed; here fewer may do.
        while least > 1 {
            let enough_to = &mut known.enough_to[least as usize - 1];
            if enough_to.is_nan() {
                *enough_to = highest_density((lags, false_alarm), marks, least - 1);
            }
            if density > *enough_to {
                break;
            }
            least -= 1;
        }
        least
    }
}

/// The fewest of some marks whose evidence against chance of a known density reaches a number of nats, remembered.
#[derive(Debug, Clone)]
pub(super) struct Fewest {
    needed: f64,
    /// By marks and step of density; 0 where not yet known.
    known: Vec<Option<Box<[u32; STEPS]>>>,
}

impl Fewest {
    /// Thresholds for evidence of `needed` nats.
    pub fn new(needed: f64) -> Self {
        Self { needed, known: Vec::new() }
    }

    /// True if it gives the same thresholds as `other`.
    pub fn is_as(&self, other: &Self) -> bool {
        self.needed == other.needed
    }

    /// The fewest of `marks` at `density`, which is rounded down to an eighth of an octave; one more than there are if
    /// none are enough.
    pub fn least(&mut self, marks: u32, density: f64) -> u32 {
        let step = (density.clamp(0.0, 1.0).to_bits() >> STEP_BITS).saturating_sub(FIRST_STEP);
        let step = step.min(STEPS as u64 - 1);
        if self.known.len() <= marks as usize {
            self.known.resize(marks as usize + 1, None);
        }
        let known = self.known[marks as usize].get_or_insert_with(|| Box::new([0; STEPS]));
        let least = &mut known[step as usize];
        if *least == 0 {
            let density = f64::from_bits((FIRST_STEP + step) << STEP_BITS);
            *least = fewest_with_evidence(marks, density, self.needed);
        }
        *least
    }
}

/// Returns the fewest of `marks` whose evidence against chance of this `density` reaches the nats `needed`;
/// one more than there are if none do.
fn fewest_with_evidence(marks: u32, density: f64, needed: f64) -> u32 {
    fewest(marks, |lit| evidence_at(Marks { lit, of: marks }, density) >= needed)
}

/// The highest density d at which `least` of `marks` are enough, L · P(Bin(N, d) ≥ k) ≤ α.
fn highest_density((lags, false_alarm): (f64, f64), marks: u32, least: u32) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    loop {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            return low;
        }
        let chance = binomial_tail(marks as usize, middle, least as usize);
        if lags * chance <= false_alarm { low = middle } else { high = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_denser_sky_asks_for_more_marks() {
        // Share of marks asked for at 400 000 lags and one false alarm in 1000 gates.
        let table = [
            (0.0025, [0.12, 0.05, 0.04]),
            (0.011, [0.17, 0.09, 0.07]),
            (0.036, [0.26, 0.15, 0.13]),
            (0.11, [0.43, 0.28, 0.25]),
            (0.24, [0.62, 0.45, 0.42]),
            (0.58, [0.93, 0.79, 0.77]),
        ];
        for (density, shares) in table {
            for (marks, share) in [58_u32, 174, 232].into_iter().zip(shares) {
                let least = least_marks(4e5, marks, density, 1e-3);
                let found = f64::from(least) / f64::from(marks);
                assert!((found - share).abs() < 0.012, "{density} {marks}: {found} not {share}");
            }
        }
    }

    #[test]
    fn what_chance_always_reaches_is_never_believed() {
        assert_eq!(least_marks(4e5, 58, 1.0, 1e-3), 59);
        assert_eq!(least_marks(4e5, 58, 0.99, 1e-3), 59);
        assert_eq!(Thresholds::new(4e5, 1e-3).least(58, 0.0), 1);
    }

    #[test]
    fn a_remembered_threshold_is_that_of_its_density() {
        let mut thresholds = Thresholds::new(4e5, 1e-3);
        for step in 0..400 {
            let density = 1e-6 * 1.035_f64.powi(step);
            for marks in [29, 174] {
                let exact = least_marks(4e5, marks, density, 1e-3);
                assert_eq!(thresholds.least(marks, density), exact, "{density} {marks}");
            }
        }
    }
}
