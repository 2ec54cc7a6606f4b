//! The label of a return, and the prior of its lags, by the rule of [`belief`].
//!
//! What decides is written in [`belief`]. Here its numbers are counted in the light at hand, with a shortcut: a label fits if
//! each lit bit speaks for its being lit and has about as many marks as the others, and no dark bit has enough ticks to
//! speak for its being lit.

use std::f64::consts::LN_2;

use libm::log;

use super::track::WIDEST_GAP;
use super::{Band, Detection, NEIGHBOURS};
use crate::decode::belief::{self, Marks, Prior, Surroundings};
use crate::decode::field::Source;

impl Band<'_> {
    /// All light about `shot` at `lag` but so many of its marks.
    pub(super) fn light_about(&self, shot: usize, lag: i64, marks: u32) -> Surroundings {
        let sent = self.sent;
        let (ticks, length) = self.field.ticks_about(&sent.light(shot, lag));
        let trials = length as f64 / f64::from(sent.width) - f64::from(sent.weight(shot));
        let places = trials.max(1.0);
        Surroundings {
            lit: f64::from(ticks.saturating_sub(marks)).min(places),
            places,
            density: self.density_in_gate(shot, marks).min(0.5),
        }
    }

    /// Whether a surface of `shot` was found at exactly `lag`.
    pub(super) fn is_found_at(&self, shot: usize, lag: i64) -> bool {
        let further = self.further.iter().filter(|(other, _)| *other == shot);
        let mut found = self.found[shot].iter().chain(further.map(|(_, found)| found));
        found.any(|found| found.lag == lag)
    }

    /// The lags at which `shot` is to be expected: on the lines through its neighbours, midway between the next ones, and
    /// at the lags of those before and the next one behind; of more behind where few are before.
    pub(super) fn expected_lags(&self, shot: usize) -> Vec<i64> {
        let lag = |shot: usize| Some(self.found.get(shot)?.as_ref()?.lag);
        let before = (0..shot).rev().take(WIDEST_GAP).filter_map(lag);
        let before: Vec<i64> = before.take(NEIGHBOURS).collect();
        let most = if before.len() < NEIGHBOURS { NEIGHBOURS } else { 1 };
        let behind = (shot + 1..).take(WIDEST_GAP).filter_map(lag);
        let behind: Vec<i64> = behind.take(most).collect();
        let sides = before.first().zip(behind.first());
        let middle = sides.map(|(before, behind)| i64::midpoint(*before, *behind));
        let lines = [0, 2, 3].into_iter().filter_map(|way| self.expected(shot, 1, way));
        lines.chain(middle).chain(before).chain(behind).collect()
    }

    /// The prior of the lags of `shot`.
    pub(super) fn prior(&self, shot: usize) -> Prior {
        Prior::new(self.sent.reach(), &self.expected_lags(shot))
    }

    /// Whether light of `shot` that seems to come from beyond the gate is rather that of a later shot from within: light is
    /// rather near than far. It is if that has the same macropulse, or if its label is contradicted.
    pub(super) fn is_of_a_later_shot(&mut self, shot: usize, detection: Detection) -> bool {
        let (sent, gate) = (self.sent, self.sent.gate());
        if gate.contains(&detection.lag) {
            return false;
        }
        let (start, log) = (sent.fired[shot] + detection.lag, sent.log);
        let macropulse = |shot: usize| (log.word[shot], log.label[shot]);
        let mut others = sent.that_begin_in(&(start..start + 1), &gate);
        let is_alike = others.any(|other| {
            let from_within = gate.contains(&(start - sent.fired[other]));
            other > shot && from_within && macropulse(other) == macropulse(shot)
        });
        is_alike || self.is_mislabelled(shot, detection)
    }

    /// Whether the label of `shot` at `detection` is contradicted. Lit bits are counted in all light, as others may
    /// claim marks of some of them; dark ones in what no return explains.
    pub(super) fn is_mislabelled(&mut self, shot: usize, detection: Detection) -> bool {
        let sent = self.sent;
        if sent.bits_of_payload() == 1 {
            return false;
        }
        let light = sent.light(shot, detection.lag);
        let (weight, in_word) = (sent.weight(shot), sent.in_word(shot));
        let around = self.light_about(shot, detection.lag, detection.count);
        let share = f64::from(detection.count) / f64::from(weight);
        let fewest = fewest_of_lit_bit(in_word, share, around.lit / around.places);
        let (pattern, lit_bits) = (&sent.bits(shot).pattern, sent.lit_bits(shot));
        let found = &mut self.found_in_bits;
        self.field.lit().lit_in_each(light.start, lit_bits, pattern, found);
        let marks = |lit: &u32| Marks { lit: *lit, of: in_word };
        let lit: Vec<Marks> = found.iter().map(marks).collect();
        let mean = share * f64::from(in_word);
        let squares: f64 = found.iter().map(|found| (f64::from(*found) - mean).powi(2)).sum();
        // Half of χ² is about what another label gains that is free to leave out the emptier bits.
        let most = 2.0 * LN_2 * (sent.bits_of_payload() - 1) as f64 * mean * (1.0 - share);
        let is_even = found.iter().all(|found| *found >= fewest) && squares <= most;
        // To widen what is left takes longer than to see that too few ticks are left for any bit.
        let together = self.field.stretch(sent.bit_length() + i64::from(sent.width));
        let left = self.field.most_left(&light, together);
        found.clear();
        found.resize(sent.dark_bits(shot).len(), 0);
        if left >= sent.ticks_in_bit(shot, fewest) {
            let residual = self.field.lit_in(Source::Residual, &light, &mut self.residual);
            residual.lit_in_each(light.start, sent.dark_bits(shot), pattern, found);
        }
        if is_even && found.iter().all(|found| *found < fewest) {
            return false;
        }
        let dark: Vec<Marks> = found.iter().map(marks).collect();
        let expected = self.prior(shot).expected(detection.lag);
        belief::contradiction(&lit, &dark, &around, expected) > 0.0
    }
}

/// Fewest of so many `marks` of a bit that speak for its being lit, where a `share` of the marks of a lit bit is found
/// and chance lights each with `density`: the likelihoods are the same with k marks where
///
/// > k·ln(q/d) + (n − k)·ln((1 − q)/(1 − d)) = 0.
fn fewest_of_lit_bit(marks: u32, share: f64, density: f64) -> u32 {
    // Neither is known so well.
    let (share, density) = (share.min(0.999), density + 1e-4);
    if share <= density {
        return marks;
    }
    let (seen, missed) = (log(share / density), log((1.0 - share) / (1.0 - density)));
    (-missed * f64::from(marks) / (seen - missed)) as u32 + 1
}
