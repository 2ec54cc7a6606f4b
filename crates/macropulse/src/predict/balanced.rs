//! Closed form of the balanced receiver's findings in ticks.
//!
//! It takes the number of lit chips about each lag as given, and leaves to chance how many of them are marks
//! (`balanced::chance` of the codec). X marks and Y dark chips out of N and M are believed if X − Y ≥ n* and
//! L(n*)·P(X' ≥ X) ≤ α. X' is hypergeometric, L(n) the number of lags about which at least n chips are lit,
//! and n* the least n with L(n)·P(X' = n) ≤ α.
//!
//! Here L(n) is its mean. Shots leave on the chip clock, so those that meet the same range light the same
//! few phases of it: L(n) = Σ_φ L_φ·P(Bin(N + M, d_φ) ≥ n), d_φ the share of places lit in a phase, and the
//! lags about the shot's own light, where there is no other. How many phases that are depends on where
//! in a tick the light comes. Shots that meet the same range do not overlap, so that noise alone falls on
//! a macropulse's own dark chips.

use std::collections::BTreeMap;

use macropulse_codec::decode::Correlation;
use macropulse_codec::statistics::{binomial, hypergeometric_tail, normal_tail};

use super::matched::{Chances, Found, Lone, Place, lags};
use crate::design::Design;
use crate::units::s_from_fs;

/// The findings for shots, by the number of marks of their labels; all of them come back after `tof` seconds.
pub(super) fn chances(
    design: &Design,
    correlation: &Correlation,
    weights: &BTreeMap<usize, usize>,
    found: &Found,
    tof: f64,
) -> Chances {
    let labels: usize = weights.values().sum();
    let late = (tof / s_from_fs(design.clock.tick_fs)).fract();
    let gate = Gate::of(design, correlation, (weights, found), late);
    let (mut pd, mut by_chance, mut share_found) = (0.0, 0.0, 0.0);
    for (&marks, &count) in weights {
        let share = count as f64 / labels as f64;
        let mut threshold = gate.threshold(marks);
        let of_lit = binomial(marks, found.seen);
        let shares: Vec<f64> =
            (0..).zip(&of_lit).map(|(k, chance)| f64::from(k) / marks as f64 * chance).collect();
        pd += share * threshold.passed(&beyond(&of_lit), found.false_density);
        share_found += share * threshold.passed(&beyond(&shares), found.false_density);
        // In an empty gate a lag may be lit by other shots as well as by noise.
        let of_nothing = gate.phases.iter().map(|phase| {
            phase.lags * threshold.passed(&beyond(&binomial(marks, phase.density)), phase.density)
        });
        by_chance += share * of_nothing.sum::<f64>().min(1.0);
    }
    let found = if pd > 0.0 { share_found / pd } else { 0.0 };
    Chances { pd, false_per_shot: by_chance, found, lone: Lone::default() }
}

/// Numbers of lit dark chips that are less likely than this are left out.
const NEGLIGIBLE: f64 = 1e-9;

/// Lags that are as bright as each other.
struct Phase {
    /// How many.
    lags: f64,
    /// Share of the places of their chips that are lit.
    density: f64,
}

/// The quantities behind the threshold.
struct Gate {
    /// Chips of a macropulse.
    chips: usize,
    /// False returns accepted.
    false_alarm: f64,
    phases: Vec<Phase>,
    /// Number of lags about which at least n chips are lit, by n.
    as_lit: Vec<f64>,
}

impl Gate {
    /// The gate of a shot while all shots meet the same range; their light comes `late` in a tick, a share
    /// of it.
    fn of(
        design: &Design,
        correlation: &Correlation,
        (weights, found): (&BTreeMap<usize, usize>, &Found),
        late: f64,
    ) -> Self {
        let chips = design.emission.coding().codebook.chips() as usize;
        let width = Place::ticks(design) as i32;
        let phases = phases(design, correlation, (weights, found), (width, late));
        // Farther chips than the first and the last lit one may be passed by without loss.
        let own = |lit: usize| f64::from(width) * (1.0 + 2.0 * chips as f64 / (lit as f64 + 1.0));
        let mut as_lit: Vec<f64> = (0..=chips).map(own).collect();
        for phase in &phases {
            let tails = beyond(&binomial(chips, phase.density));
            as_lit.iter_mut().zip(&tails).for_each(|(sum, tail)| *sum += phase.lags * tail);
        }
        Self { chips, false_alarm: correlation.false_alarm, phases, as_lit }
    }

    /// The threshold for a label of this number of `marks`.
    fn threshold(&self, marks: usize) -> Threshold {
        let words = (marks as u32, self.chips.saturating_sub(marks) as u32);
        let all = |lit: usize| hypergeometric_tail(words, lit as u32, lit as u32);
        let enough = |lit: &usize| self.as_lit[*lit] * all(*lit) <= self.false_alarm;
        let balance = (1..=marks).find(enough).unwrap_or(marks + 1);
        let chance = self.false_alarm / self.as_lit[balance.min(self.chips)];
        Threshold { words, balance, chance, least: Vec::new() }
    }
}

/// The lags of the gate, by the share of their chips that is lit. These are the phases of the chip clock at
/// which light in step arrives, `late` in a tick, and all others, where there is noise. A mark is looked for
/// in `width` ticks.
fn phases(
    design: &Design,
    correlation: &Correlation,
    (weights, found): (&BTreeMap<usize, usize>, &Found),
    (width, late): (i32, f64),
) -> Vec<Phase> {
    let scale = correlation.ticks_per_chip as i32;
    let codebook = &design.emission.coding().codebook;
    // The receiver looks beyond the gate by a macropulse.
    let lags = lags(design) + f64::from(codebook.chips() * correlation.ticks_per_chip);
    let sigma = correlation.jitter_ticks.max(f64::MIN_POSITIVE);
    let marks: usize = weights.iter().map(|(marks, count)| marks * count).sum();
    let mean = marks as f64 / weights.values().sum::<usize>() as f64;
    let chip = s_from_fs(design.emission.coding().chip_fs);
    let seen = found.seen * (mean * chip / design.scan.shortest_period()).min(1.0);
    let farthest = (4.0 * sigma).ceil() as i32;
    let mut dark: BTreeMap<i32, f64> = BTreeMap::new();
    for first in 1 - width - farthest..=farthest {
        let before = |end: i32| normal_tail((late - f64::from(end)) / sigma);
        let share = before(first + width) - before(first);
        *dark.entry(first.rem_euclid(scale)).or_insert(1.0) *= 1.0 - seen * share;
    }
    let of_one = lags / f64::from(scale);
    let of_noise = of_one * f64::from(scale - dark.len() as i32);
    let in_step = dark
        .values()
        .map(|dark| Phase { lags: of_one, density: 1.0 - dark * (1.0 - found.false_density) });
    let noise = Phase { lags: of_noise, density: found.false_density };
    in_step.chain([noise]).collect()
}

/// The conditions for belief in a label with a given number of marks.
struct Threshold {
    /// Marks and dark chips.
    words: (u32, u32),
    /// The least balance.
    balance: usize,
    /// Largest accepted probability that chance leaves this number of marks at one lag.
    chance: f64,
    /// The fewest marks, by lit dark chips; as far as they are known.
    least: Vec<usize>,
}

impl Threshold {
    /// The sum, over lit dark chips that are lit with probability `density` each, of the entry of `tails` at
    /// the fewest marks that are believed.
    fn passed(&mut self, tails: &[f64], density: f64) -> f64 {
        let mut sum = 0.0;
        for (stray, chance) in binomial(self.words.1 as usize, density).into_iter().enumerate() {
            let most = tails.get(self.balance + stray).copied().unwrap_or(0.0);
            if most <= 0.0 {
                break;
            }
            if chance >= NEGLIGIBLE && chance * most > f64::MIN_POSITIVE {
                sum += chance * tails.get(self.least(stray)).copied().unwrap_or(0.0);
            }
        }
        sum
    }

    /// The fewest marks that are believed beside `stray` lit dark chips; more than there are if none will do.
    fn least(&mut self, stray: usize) -> usize {
        while self.least.len() <= stray {
            let stray = self.least.len();
            // More lit dark chips need more marks.
            let before = self.least.last().map_or(self.balance, |least| least + 1);
            let from = before.max(self.balance + stray);
            let is_rare = |found: &usize| {
                let lit = (found + stray) as u32;
                hypergeometric_tail(self.words, lit, *found as u32) <= self.chance
            };
            let most = self.words.0 as usize;
            self.least.push((from..=most).find(is_rare).unwrap_or(most + 1));
        }
        self.least[stray]
    }
}

/// P(at least k) of the probabilities of each k.
fn beyond(chances: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut tails: Vec<f64> = chances
        .iter()
        .rev()
        .map(|chance| {
            sum += chance;
            sum
        })
        .collect();
    tails.reverse();
    tails
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand, for 64 marks among 127 chips: Π_i<n (64 − i)/(127 − i) is 2.65e-11 at n = 29.
    #[test]
    fn the_least_balance_is_that_of_fractions() {
        let all =
            |lit: u32| (0..lit).map(|i| f64::from(64 - i) / f64::from(127 - i)).product::<f64>();
        for least in [20_usize, 29, 40] {
            let lags = 1e-6 / all(least as u32) * 0.999;
            let gate =
                Gate { chips: 127, false_alarm: 1e-6, phases: Vec::new(), as_lit: vec![lags; 128] };
            let mut threshold = gate.threshold(64);
            assert_eq!((threshold.balance, threshold.least(0)), (least, least));
            // One dark chip: one mark more to keep the balance, and one more for what it may be.
            assert!((least + 1..least + 4).contains(&threshold.least(1)), "{least}");
        }
    }

    /// Light on the chip clock lies in some phases, which together hold all that is there.
    #[test]
    fn light_in_step_lies_in_few_phases() {
        let design = Design::open("bipolar-gold", &[]).unwrap();
        let correlation = design.receiver.method.correlation().unwrap();
        let found = Found { seen: 0.4, false_density: 1e-6 };
        // Light in the middle of a tick lies in the windows that begin at either of two ticks. Light at the
        // edge of a tick lies in the window that begins at the tick before it, and half of it in the windows
        // one earlier and one later.
        for (late, expected) in [(0.5, [0.4, 0.4, 0.0]), (0.0, [0.4, 0.2, 0.2])] {
            let phases =
                phases(&design, correlation, (&BTreeMap::from([(64, 1)]), &found), (2, late));
            let lags: f64 = phases.iter().map(|phase| phase.lags).sum();
            // 149.5 m and a macropulse of 2.5 ps ticks.
            assert!((lags / 415_200.0 - 1.0).abs() < 1e-4, "{lags}");
            let mut bright: Vec<f64> = phases.iter().map(|phase| phase.density).collect();
            bright.sort_by(|one, other| other.total_cmp(one));
            for (bright, expected) in bright.iter().zip(expected) {
                assert!((bright - 0.5 * expected).abs() < 0.005, "{late}: {bright}");
            }
        }
    }
}
