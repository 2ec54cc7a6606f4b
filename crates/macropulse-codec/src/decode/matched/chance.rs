//! Chance: the density of its light, and the number of marks that it may light.

use super::Band;
use super::acquire::BLOCK;
use super::sent::Sent;
use crate::decode::belief::{self, Prior, Surroundings};
use crate::decode::threshold::{Fewest, Thresholds, fewest};

/// Probability below which missing marks, or light denser than elsewhere, are not put down to chance.
pub(super) const BY_CHANCE: f64 = 1e-3;

/// A normal variable exceeds it as often as that.
pub(super) const HARDLY_EVER: f64 = 3.0902;

/// Probability with which chance may light an end of a macropulse where there is none. An end of `street` has
/// three or four marks, and two of them are then enough. At 1e-3 it takes three, which one end in five lacks
/// if one mark in five is missed. Both find the same shots.
const AT_AN_END: f64 = 1e-2;

/// The share of blocks in which chance may light as much of a code word as is asked for. There all marks are counted,
/// a few hundred: in so few blocks that adds two to each, of at least sixteen.
const IN_VAIN: f64 = 0.01;

/// The fewest marks that chance does not reach, and what else it hardly ever does.
#[derive(Debug)]
pub(super) struct Chance {
    /// At any lag of a gate, and at one where a neighbour leads to expect light.
    pub in_gate: Fewest,
    pub expected: Fewest,
    /// In a single place.
    pub once: Thresholds,
    /// At an end of a macropulse.
    pub at_end: Thresholds,
    /// At any place of a code word in the pictures that a block of lags is met by.
    pub in_words: Thresholds,
}

impl Chance {
    /// The chances for the shots `sent`. Tables `known` from a band before are kept if they are for the same number of
    /// places.
    pub fn new(sent: &Sent, known: Option<Self>) -> Self {
        let (gate, bits) = (sent.gate(), sent.bits_of_payload() as f64);
        let threshold = belief::threshold(sent.correlation.false_alarm);
        let middle = i64::midpoint(gate.start, gate.end);
        let needed = [&[][..], &[middle]]
            .map(|beside: &[i64]| threshold - Prior::new(gate.clone(), beside).at(middle));
        let new = Self {
            in_gate: Fewest::new(needed[0]),
            expected: Fewest::new(needed[1]),
            once: Thresholds::new(1.0, BY_CHANCE),
            at_end: Thresholds::new(1.0, AT_AN_END),
            // Eight lags are met by two bits of each code word.
            in_words: Thresholds::new(2.0 * BLOCK as f64 * bits, IN_VAIN),
        };
        // The rest follows from the same false alarms and bits.
        let is_as_new =
            |known: &Self| known.in_gate.is_as(&new.in_gate) && known.in_words.is_as(&new.in_words);
        known.filter(is_as_new).unwrap_or(new)
    }

    /// Fewest ticks in which a shot may be believed to be: those of the lightest one, alone in its gate. Ticks are
    /// counted `cell` by cell.
    pub fn fewest_ticks(&mut self, sent: &Sent, cell: i64) -> usize {
        let Some(weight) = sent.lightest() else { return 1 };
        // No stretch of cells about a gate is longer.
        let gate = sent.gate();
        let longest = gate.end - gate.start + sent.length() + 2 * cell;
        let density = f64::from(sent.width) / longest as f64;
        sent.ticks_of_any(self.expected.least(weight, density)).max(1) as usize
    }
}

impl Band<'_> {
    /// Ticks about the gate of `shot`, in which marks may be that come from within it, and the share of
    /// places that each of them lights.
    fn in_gate(&self, shot: usize) -> (u32, f64) {
        let (gate, fired) = (self.sent.gate(), self.sent.fired[shot]);
        let span = fired + gate.start..fired + gate.end + self.sent.length();
        let (ticks, places) = self.field.ticks_about(&span);
        (ticks, f64::from(self.sent.width) / places.max(1) as f64)
    }

    /// Share of places in the gate of `shot` that ticks light, without `count` of its marks. One tick is added, so that
    /// few ticks do not claim more darkness than can be known.
    pub(super) fn density_in_gate(&self, shot: usize, count: u32) -> f64 {
        let (ticks, share) = self.in_gate(shot);
        (f64::from(ticks.saturating_sub(self.sent.ticks_at_most(shot, count)) + 1) * share).min(1.0)
    }

    /// The light about `shot` at `lag` without `marks` of its own. Ticks that other returns explain count, too.
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

    /// The fewest marks of `shot` that chance does not reach in what they leave of the light of its
    /// gate.
    pub(super) fn least_in_gate(&mut self, shot: usize) -> u32 {
        let (ticks, share) = self.in_gate(shot);
        let weight = self.sent.weight(shot);
        fewest(weight, |count| {
            let own = self.sent.ticks_at_most(shot, count);
            let density = f64::from(ticks.saturating_sub(own) + 1) * share;
            self.chance.in_gate.least(weight, density.min(1.0)) <= count
        })
    }
}
