//! The label of a return, judged by the rule of [`belief`].
//!
//! [`belief`] decides. This module counts the marks in each bit of a return, and the light about it.
//!
//! A shortcut comes first. The label fits if three things hold: each lit bit has more marks than speak for a dark one;
//! the lit bits have about equally many; and too few ticks are left for any dark bit to be lit.

use std::f64::consts::LN_2;

use libm::log;

use super::track::WIDEST_GAP;
use super::{Band, Detection, NEIGHBOURS};
use crate::decode::belief::{self, Marks, Prior};
use crate::decode::field::Source;

impl Band<'_> {
    /// The lags at which neighbours lead to expect `shot`: on the lines through them, midway between the nearest two, at
    /// those of the shots before it, and at that of the next one. Where few shots before were found, more behind count.
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

    /// Whether `detection` lies outside the gate, and its light is that of a later shot from within. It is if a later shot
    /// has the same macropulse, as near light is likelier than far light, or if the label of `shot` is contradicted.
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

    /// Whether another label explains the light of `shot` at `detection` better than its own. Marks of lit bits are counted
    /// in all light, as other returns may explain some of them. Marks of dark bits are counted in the light that no
    /// return explains.
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
        // A label that leaves out the emptier bits gains about half of χ², and is taken only if it gains ln 2 a bit.
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

/// The fewest marks that make a bit likelier lit than dark. It has `marks` marks, n. A lit bit shows each of them with the
/// probability q, `share`, a dark one with d, `density`. Both are equally likely with k marks for which
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
