//! The best lag of a shot, of all lags.
//!
//! Every lag is counted: 512 of them at once, as [`Counts`] does. The evidence itself is worked out mark by mark,
//! which takes a thousand times as long. So lags are passed by that have too few marks for it, whatever else there
//! is about them. Two bounds say how many are too few, both for the least light that any lag of a block has about
//! itself. They are asked of groups of blocks first:
//!
//! * E(k, n) grows where n gets smaller, so E(k, k) bounds it for any number of claimed marks;
//! * one more lit mark is evidence for light, so that with c claimed marks E(k, N − c) stays below E(k + c, N). Marks
//!   that are lit or claimed are counted together.

use std::collections::HashMap;
use std::ops::Range;

use super::residual::{Gate, Residual, Sums, first_bits};
use crate::decode::belief::{Marks, Prior, evidence};
use crate::decode::matched::track::below;
use crate::decode::threshold::fewest;
use crate::kernels::{Counts, WIDE, and, is_dark};

/// Lags that are counted at once.
pub(super) const BLOCK: i64 = 64 * WIDE as i64;

/// A lag of a shot and what speaks for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::decode::matched) struct Peak {
    pub lag: i64,
    /// Its marks that no return claims.
    pub marks: Marks,
    /// Their evidence, in nats.
    pub evidence: f64,
    /// The logarithm of the posterior odds, evidence + ln prior.
    pub odds: f64,
}

impl Peak {
    /// The same with another prior.
    pub fn with(self, prior: &Prior) -> Self {
        Self { odds: self.evidence + prior.at(self.lag), ..self }
    }

    /// The one of `peaks` with the highest odds.
    pub fn best(peaks: impl Iterator<Item = Self>) -> Option<Self> {
        peaks.reduce(|one, other| if other.exceeds(&one) { other } else { one })
    }

    /// True if it has higher odds than `other`, or equal odds and is nearer.
    fn exceeds(&self, other: &Self) -> bool {
        self.odds > other.odds || self.odds == other.odds && self.lag < other.lag
    }
}

/// Memory kept from search to search.
#[derive(Default)]
pub(super) struct Search {
    lit: Counts<WIDE>,
    open: Counts<WIDE>,
    sums: Sums,
    /// Fewest marks, by what is asked for; and what was asked last.
    known: HashMap<Asked, Fewest>,
    last: Option<(Asked, Fewest)>,
}

/// A question about some lags of a shot: how many marks give the evidence?
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Asked {
    /// The evidence, in whole nats.
    nats: i32,
    /// The least light about any of the lags.
    light: Light,
    /// All marks of the shot.
    weight: u32,
    /// The gate of the shot: [`Gate::key`].
    gate: (u32, u64),
}

/// The least light about any of some lags.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Light {
    /// Fewest ticks that are left there.
    ticks: u32,
    /// Fewest places that are neither claimed nor about marks of the shot.
    places: u32,
}

/// Thresholds that are remembered at most.
const MOST_KNOWN: usize = 1 << 16;

/// Fewest marks that can give the evidence asked for.
#[derive(Debug, Clone, Copy)]
struct Fewest {
    lit: u32,
    lit_or_claimed: u32,
}

/// Lags of a shot that are asked about.
#[derive(Debug, Clone)]
pub(super) struct Question<'p> {
    pub shot: usize,
    pub lags: Range<i64>,
    pub prior: &'p Prior,
    /// The least odds that are of interest.
    pub least: f64,
}

impl Search {
    /// The lag with the highest posterior odds, of several the nearest, if it has the least odds asked for.
    pub fn best(&mut self, residual: &Residual, question: &Question) -> Option<Peak> {
        let mut best: Option<Peak> = None;
        self.scan(residual, question, |peak| {
            if best.is_none_or(|best| peak.exceeds(&best)) {
                best = Some(peak);
            }
            peak.odds
        });
        best
    }

    /// Returns the lags with odds within `below` nats of the highest, and with the least odds asked for. They
    /// are found soonest if `likely` is one of them.
    pub fn near_best(
        &mut self,
        residual: &Residual,
        question: &Question,
        (likely, below): (i64, f64),
    ) -> Vec<Peak> {
        let Question { shot, prior, least, .. } = *question;
        let first = residual.peak(&residual.gate(shot), likely, prior);
        let mut least = least.max(first.odds - below);
        let mut all: Vec<Peak> = Vec::new();
        self.scan(residual, &Question { least, ..question.clone() }, |peak| {
            all.push(peak);
            least = least.max(peak.odds - below);
            least
        });
        all.retain(|peak| peak.odds >= least);
        all
    }

    /// Visits the lags with the least odds asked for. A visit tells which odds are of interest from then on.
    fn scan(
        &mut self,
        residual: &Residual,
        question: &Question,
        mut visit: impl FnMut(Peak) -> f64,
    ) {
        let &Question { shot, ref lags, prior, mut least } = question;
        let (sent, gate) = (residual.sent, residual.gate(shot));
        let lags = lags.start.max(prior.lags().start)..lags.end.min(prior.lags().end);
        if gate.ticks == 0 {
            return;
        }
        let (first, last) = (sent.fired[shot] + lags.start, sent.fired[shot] + lags.end);
        residual.sum_up(&(first..last + sent.takes_up()), &mut self.sums);
        let coarse = gate.coarse();
        let in_group = (sent.takes_up() / 2 / BLOCK).max(1) * BLOCK;
        for group in lags.clone().step_by(in_group as usize) {
            let group = group..(group + in_group).min(lags.end);
            if self.bound((residual, &coarse), &group, least - prior.most(&group)).is_none() {
                continue;
            }
            for first in group.clone().step_by(BLOCK as usize) {
                let block = first..(first + BLOCK).min(group.end);
                let start = sent.fired[shot] + first;
                let most = prior.most(&block);
                let bound = self.bound((residual, &coarse), &block, least - most);
                let Some((mut fewest, light)) = bound else { continue };
                let (lit, at) = residual.lit().at(start);
                self.lit.count(lit, at as u32, sent.word(shot), sent.lit_bits(shot));
                let mut hits = below(block.end - first, [u64::MAX; WIDE], true);
                hits = and(hits, self.lit.at_least(fewest.lit));
                if is_dark(&hits) {
                    continue;
                }
                let (open, at) = residual.open().at(start);
                self.open.count(open, at as u32, sent.word(shot), sent.lit_bits(shot));
                loop {
                    hits = and(hits, self.lit.at_least(fewest.lit));
                    hits = and(hits, self.open.at_least(fewest.lit_or_claimed));
                    let Some((at, _)) = self.lit.highest(hits) else { break };
                    hits[at as usize / 64] &= !(1 << (at % 64));
                    let lag = first + i64::from(at);
                    let peak = residual.peak(&gate, lag, prior);
                    if peak.odds >= least {
                        let before = least;
                        least = visit(peak);
                        if least > before {
                            fewest = self.fewest((residual, &coarse), least - most, light);
                        }
                    }
                }
            }
        }
    }

    /// Returns the fewest marks that give this evidence in `nats` at any of the `lags`, and the least light
    /// about any of them. `None` if the shot cannot have this number of marks there.
    fn bound(
        &mut self,
        (residual, gate): (&Residual, &Gate),
        lags: &Range<i64>,
        nats: f64,
    ) -> Option<(Fewest, Light)> {
        let (sent, shot) = (residual.sent, gate.shot);
        let (start, last) = (sent.fired[shot] + lags.start, sent.fired[shot] + lags.end - 1);
        let span = start..last + sent.takes_up();
        let of_any = self.sums.ticks(&span);
        let light = Light {
            ticks: self.sums.ticks_within(&(last..start + sent.takes_up())),
            places: residual.fewest_places(shot, self.sums.claimed(&span)),
        };
        let fewest = self.fewest((residual, gate), nats, light);
        let may_be = of_any >= fewest.lit && fewest.lit <= sent.weight(shot);
        may_be.then_some((fewest, light))
    }

    /// Returns the fewest marks of a shot that give this evidence in `nats`, in this `light` or more.
    ///
    /// The evidence grows with the places. But no more of them are lit than there are, so it falls with them
    /// if all are lit.
    fn fewest(&mut self, (residual, gate): (&Residual, &Gate), nats: f64, light: Light) -> Fewest {
        let weight = residual.sent.weight(gate.shot);
        // Coarse numbers, so that many questions are the same.
        let nats = nats.floor() as i32;
        let nats = if nats > 0 { first_bits(nats as u32, 4) as i32 } else { nats };
        let [ticks, places] = [light.ticks, light.places].map(|number| first_bits(number, 2));
        let asked = Asked { nats, light: Light { ticks, places }, weight, gate: gate.key() };
        if let Some((_, fewest)) = self.last.filter(|(last, _)| *last == asked) {
            return fewest;
        }
        if let Some(fewest) = self.known.get(&asked) {
            self.last = Some((asked, *fewest));
            return *fewest;
        }
        let all = residual.sent.takes_up() as u32;
        let of = |of: &dyn Fn(u32) -> u32| {
            fewest(weight, |lit| {
                let own = residual.sent.ticks_at_most(gate.shot, lit);
                let beside = ticks.saturating_sub(own);
                let marks = Marks { lit, of: of(lit) };
                [all, places].into_iter().any(|places| {
                    let around = residual.surroundings(beside, places.into(), gate.without(own));
                    evidence(marks, &around) >= f64::from(nats)
                })
            })
        };
        let fewest = Fewest { lit: of(&|lit| lit), lit_or_claimed: of(&|_| weight) };
        if self.known.len() == MOST_KNOWN {
            self.known.clear();
        }
        self.known.insert(asked, fewest);
        fewest
    }
}
