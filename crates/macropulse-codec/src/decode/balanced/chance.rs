//! Test whether chance would fit the lit chips to the marks of a macropulse.
//!
//! The light in a gate is light of other shots, and noise. Light of other shots comes in runs as long as a
//! macropulse, and in step with it if shots leave on the chip clock. The density of light at each lag is not
//! known, but the number of lit chips is seen. So that number is taken as given, and only how it falls on
//! marks and dark chips is left to chance. If n of N marks and M dark chips are lit, the number X of lit
//! marks is hypergeometric:
//! P(X ≥ x) = Σ_k≥x C(N, k)·C(M, n − k)/C(N + M, n).
//!
//! 1. n* is the least number of lit chips that may all be marks without being chance: L(n*)·P(X = n*) ≤ α.
//!    L(n) is the number of lags of the gate about which at least n chips are lit, and α the false returns
//!    accepted.
//! 2. X marks and Y dark chips are believed if X − Y ≥ n* and L(n*)·P(X' ≥ X) ≤ α.
//!
//! Each of the L(n*) lags where that can happen is believed by chance with α/L(n*) at most: α in the gate,
//! whatever is in it. A gate where nothing else is lit asks for less than one full of light.

use crate::kernels::Balance;
use crate::statistics::hypergeometric_tail;

/// Limits of the test, and the results known so far for each number of marks.
#[derive(Debug)]
pub(super) struct Chance {
    /// Lags of a gate.
    lags: f64,
    /// False returns accepted in it.
    false_alarm: f64,
    /// Chips of a macropulse.
    chips: u32,
    /// The least balances, by marks: where it is the only lag, and where all lags are as bright; 0 where
    /// not yet known.
    least: Vec<[u32; 2]>,
    /// Lags by lit chips.
    counts: Vec<u32>,
}

impl Chance {
    /// Creates the test for gates of `lags` lags and macropulses of `chips` chips.
    pub fn new(lags: f64, false_alarm: f64, chips: u32) -> Self {
        Self { lags, false_alarm, chips, least: Vec::new(), counts: Vec::new() }
    }

    /// The balance below which `marks` marks are never believed.
    pub fn least(&mut self, marks: u32) -> u32 {
        self.least_of(marks)[0]
    }

    /// Returns true if chance would not leave the balance `peak` of `marks` marks. `lit_about` counts the
    /// lags of the gate by the number of chips lit about them, from a least number on.
    pub fn is_unlikely(
        &mut self,
        marks: u32,
        peak: Balance,
        lit_about: impl FnOnce(u32, &mut Vec<u32>),
    ) -> bool {
        let Ok(score) = u32::try_from(peak.score()) else { return false };
        let dark = self.chips.saturating_sub(marks);
        let chance = hypergeometric_tail((marks, dark), peak.found + peak.stray, peak.found);
        let [alone, at_all] = self.least_of(marks);
        if score < alone || chance > self.false_alarm {
            return false;
        }
        if score >= at_all && self.lags * chance <= self.false_alarm {
            return true;
        }
        lit_about(alone, &mut self.counts);
        // Lags about which `lit` chips or more are lit, for each `lit` from here on.
        let mut lags: u32 = self.counts.iter().sum();
        for (lit, count) in (alone..=score).zip(&self.counts) {
            if f64::from(lags) * self.of_all(marks, lit) <= self.false_alarm {
                return f64::from(lags) * chance <= self.false_alarm;
            }
            lags -= count;
        }
        false
    }

    /// Returns the least balances of `marks` marks.
    fn least_of(&mut self, marks: u32) -> [u32; 2] {
        if self.least.len() <= marks as usize {
            self.least.resize(marks as usize + 1, [0; 2]);
        }
        if self.least[marks as usize][0] == 0 {
            let least = |lags: f64| {
                let enough = |lit: &u32| lags * self.of_all(marks, *lit) <= self.false_alarm;
                (1..=marks).find(enough).unwrap_or(marks + 1)
            };
            self.least[marks as usize] = [1.0, self.lags].map(least);
        }
        self.least[marks as usize]
    }

    /// P(all of `lit` chips are marks).
    fn of_all(&self, marks: u32, lit: u32) -> f64 {
        hypergeometric_tail((marks, self.chips.saturating_sub(marks)), lit, lit)
    }
}
