//! What the balanced receiver makes of ticks, in closed form.
//!
//! It believes the highest balance of L lags, marks found less dark chips lit, if chance would not
//! give so much at any: the least s with L·P(X − Y ≥ s) ≤ α, X ~ Bin(N, d) of the marks and
//! Y ~ Bin(M, d) of the dark chips. d is the share of places in the gate that are lit, or that of the
//! dark chips of the very macropulse, one more of each, whichever is more. Shots that meet the same
//! range do not overlap, so that noise alone falls on its dark chips.

use std::collections::BTreeMap;

use macropulse_codec::statistics::binomial;

use super::matched::{Chances, Found, lags};
use crate::design::Design;

/// What comes of shots by the marks of labels, of which so many have so many.
pub(super) fn chances(design: &Design, weights: &BTreeMap<usize, usize>, found: &Found) -> Chances {
    let chips = design.coding.codebook.chips() as usize;
    let labels: usize = weights.values().sum();
    let (mut pd, mut by_chance, mut share_found) = (0.0, 0.0, 0.0);
    for (&marks, &count) in weights {
        let dark = chips.saturating_sub(marks);
        let gate = Gate { lags: lags(design), false_alarm: design.receiver.false_alarm };
        let share = count as f64 / labels as f64;
        let dark_lit = binomial(dark, found.false_density);
        let of_lit = binomial(marks, found.seen);
        let lit = beyond(&of_lit);
        let shares: Vec<f64> =
            (0..).zip(&of_lit).map(|(k, chance)| f64::from(k) / marks as f64 * chance).collect();
        let lit_shares = beyond(&shares);
        let reach = beyond(&binomial(marks, found.density));
        let at = |tails: &[f64], least: usize| tails.get(least).copied().unwrap_or(0.0);
        let (mut seen, mut seen_share) = (0.0, 0.0);
        for (stray, chance) in dark_lit.iter().enumerate() {
            if *chance < NEGLIGIBLE {
                continue;
            }
            let on_dark = (stray as f64 + 1.0) / (dark as f64 + 1.0);
            let least = gate.least_balance((marks, dark), found.density.max(on_dark).min(1.0));
            seen += chance * at(&lit, least + stray);
            seen_share += chance * at(&lit_shares, least + stray);
        }
        // Where nothing is, a place of the gate may be lit by other shots as well as by noise.
        let least = gate.least_balance((marks, dark), found.density);
        let reached = |(stray, chance): (usize, &f64)| chance * at(&reach, least + stray);
        let reached: f64 = binomial(dark, found.density).iter().enumerate().map(reached).sum();
        pd += share * seen;
        share_found += share * seen_share;
        by_chance += share * (gate.lags * reached).min(1.0);
    }
    let found = if pd > 0.0 { share_found / pd } else { 0.0 };
    Chances { pd, false_per_shot: by_chance, found }
}

/// So many lit dark chips are left out as are less likely than this.
const NEGLIGIBLE: f64 = 1e-9;

/// What the threshold depends on beside the light.
struct Gate {
    lags: f64,
    /// False returns accepted.
    false_alarm: f64,
}

impl Gate {
    /// The least balance of so many marks and dark chips that is believed where places are lit with
    /// probability `density`; one more than there are marks if none will do.
    fn least_balance(&self, (marks, dark): (usize, usize), density: f64) -> usize {
        let (found, stray) = (beyond(&binomial(marks, density)), binomial(dark, density));
        let tail = |least: usize| -> f64 {
            stray.iter().zip(found.iter().skip(least)).map(|(stray, found)| stray * found).sum()
        };
        (1..=marks).find(|least| self.lags * tail(*least) <= self.false_alarm).unwrap_or(marks + 1)
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

    /// Two coins against one, as counted by hand: X − Y ≥ 2 in one case of eight, ≥ 1 in four.
    #[test]
    fn the_least_balance_is_that_of_coins() {
        let least = |lags| Gate { lags, false_alarm: 1.0 }.least_balance((2, 1), 0.5);
        assert_eq!([1.9, 2.1, 7.9, 8.1].map(least), [1, 2, 2, 3]);
    }
}
