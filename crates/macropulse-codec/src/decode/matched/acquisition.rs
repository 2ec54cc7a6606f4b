//! Acquisition: the shots that have no lag yet are looked for in the residual.

use super::{ACQUISITION_GRID, Band, Detection, STAGGER};
use crate::decode::search::Sought;
use crate::kernels::Marks;

/// How many marks must be found before a lag is believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Evidence {
    /// Half of the marks, and twice what chance can give: where many bright shots
    /// overlap, they pass for a faint one more easily than chance does.
    Overwhelming,
    /// Half of the marks.
    Bright,
    /// As few marks as chance does not give.
    MoreThanChance,
}

/// So much less often faint light is searched for far from any that was found.
const RARER: u32 = 4;

/// So few ticks are searched so soon that no shot needs to be left out.
const FEW_TICKS: u32 = 64;

/// The emptiest of so many macropulses side by side tells how much light is everywhere.
const MANY: i64 = 16;

impl Band<'_> {
    /// Looks for the shots that have no lag yet: near their neighbours, and for one in `every` of
    /// them in the residual of the whole gate. Tells how many were found.
    pub(super) fn search(&mut self, evidence: Evidence, every: u32) -> usize {
        let mut found = 0;
        for shot in 0..self.detections.len() {
            if self.detections[shot].is_some() || !self.may_be_lit(shot) {
                continue;
            }
            let detection = match self.predicted(shot, evidence) {
                Some(detection) => Some(detection),
                None if self.is_among(shot, every * self.rarer(shot, evidence)) => {
                    self.believed(shot, evidence)
                }
                None => None,
            };
            if let Some(detection) = detection {
                self.keep(shot, detection);
                found += 1;
            }
        }
        found
    }

    /// By how much less often `shot` is searched for where light is faint and none of the shots
    /// around was found.
    fn rarer(&self, shot: usize, evidence: Evidence) -> u32 {
        let around = ACQUISITION_GRID as usize;
        let above = self.above[shot].map(|shot| shot as usize);
        let neighbours = [shot.checked_sub(around), Some(shot + around), above];
        let is_found = |shot: usize| self.detections.get(shot).is_some_and(Option::is_some);
        match evidence {
            Evidence::Overwhelming | Evidence::Bright => 1,
            Evidence::MoreThanChance if self.sent.is_thorough() => 1,
            Evidence::MoreThanChance if neighbours.into_iter().flatten().any(is_found) => 1,
            Evidence::MoreThanChance => RARER,
        }
    }

    pub(super) fn is_among(&self, shot: usize, every: u32) -> bool {
        let log = self.sent.log;
        let (row, column) = (u32::from(log.row[shot]), u32::from(log.column[shot]));
        let residual = || self.field.residual_counts().at_most(self.sent.gate_and_macropulse(shot));
        (column + STAGGER * row).is_multiple_of(every) || residual() < FEW_TICKS
    }

    /// What a search for `shot` finds, if the `evidence` is there.
    fn believed(&mut self, shot: usize, evidence: Evidence) -> Option<Detection> {
        let weight = self.sent.weight(shot);
        let least = match evidence {
            Evidence::Overwhelming | Evidence::Bright => weight.div_ceil(2),
            Evidence::MoreThanChance => 1,
        };
        let detection = self.searched(shot, least).filter(|detection| detection.count >= least)?;
        let by_chance = self.by_chance(shot, detection);
        let needed = match evidence {
            Evidence::Overwhelming => by_chance.max(weight.min(2 * by_chance)),
            Evidence::Bright | Evidence::MoreThanChance => by_chance,
        };
        (detection.count >= needed).then_some(detection)
    }

    /// Whether the residual in the gate of `shot` has so many ticks, close enough together, that
    /// they could be `marks` of its marks: within one macropulse, besides those that are
    /// everywhere, and for one of its lit bits within one code word.
    pub(super) fn is_crowded(&self, shot: usize, marks: u16) -> bool {
        let sent = self.sent;
        let per_tick = self.marks_per_tick(shot).unwrap_or(1);
        let bits = sent.lit_bits(shot).len() as u32;
        let gate = sent.gate_and_macropulse(shot);
        let needed = |bits: u32| u32::from(marks).div_ceil(bits).div_ceil(per_tick).max(1);
        let gate_length = gate.end - gate.start;
        let runs = self.field.residual_counts().runs(gate);
        if runs.at_most() < needed(1) {
            return false;
        }
        let length = sent.length() as u32;
        let (emptiest, fullest) = runs.emptiest_and_fullest(length + sent.width);
        // In a short gate it may be full everywhere of light that is sought.
        let is_long = gate_length > MANY * sent.length() && !sent.is_thorough();
        let everywhere = if is_long { emptiest } else { 0 };
        if fullest - everywhere < needed(1) {
            return false;
        }
        let word = length / sent.bits_of_payload() as u32;
        runs.emptiest_and_fullest(word + sent.width).1 >= needed(bits)
    }

    /// The peak near the lag with most marks in the residual, see [`Band::residual_lag`].
    pub(super) fn searched(&mut self, shot: usize, at_least: u16) -> Option<Detection> {
        let lag = self.residual_lag(shot, at_least)?;
        self.best_near(shot, lag, at_least)
    }

    /// The lag at which most marks of `shot` are in the residual. `None` where these are fewer than
    /// `at_least` or chance could as well have put them there.
    pub(super) fn residual_lag(&mut self, shot: usize, at_least: u16) -> Option<i64> {
        // The residual only ever gets less.
        if self.known_empty[shot] <= at_least {
            return None;
        }
        let weight = self.sent.weight(shot);
        if weight == 0 || self.sent.gate().1 < self.sent.gate().0 {
            return None;
        }
        let gate = self.sent.gate_and_macropulse(shot);
        let ticks = self.field.residual_counts().at_most(gate.clone()) * self.sent.width;
        let residual_density = f64::from(ticks) / (gate.end - gate.start) as f64;
        // Marks under ticks that are cancelled already are missing here: half are taken to be
        // visible.
        let density = self.density_in_gate(shot);
        let visible = self.thresholds.least(weight, density).div_ceil(2);
        let least = self.thresholds.least(weight, residual_density).max(visible).max(at_least);
        // What does not stand out today may do so when more is cancelled.
        if !self.is_crowded(shot, least) {
            return None;
        }
        let found = self.best_residual_lag(shot, least);
        if found.is_none() {
            self.known_empty[shot] = at_least;
        }
        found
    }

    /// The lag at which most marks of `shot` are in the residual, if `least` are.
    pub(super) fn best_residual_lag(&mut self, shot: usize, least: u16) -> Option<i64> {
        let sent = self.sent;
        let (nearest, farthest) = sent.gate();
        let word = sent.codebook.word(sent.log.word[shot]);
        let scale = sent.scale() as usize;
        self.bits.clear();
        self.bits.extend(sent.lit_bits(shot).iter().map(|&bit| scale * bit as usize));
        let density = self.density_in_gate(shot);
        let sought = Sought {
            word: Marks { word: &word.marks, bits: &[0], scale },
            pattern: sent.pattern(shot),
            bits: &self.bits,
            lags: (farthest - nearest + 1) as usize,
            least,
            stands_out: self.word_thresholds.least(word.marks.len() as u16, density),
        };
        let first = sent.fired[shot] + nearest;
        let residual = self.field.residual(sent.gate_and_macropulse(shot));
        let found = self.search.best(residual, (first, sent.width), &sought);
        found.map(|found| nearest + found.lag as i64)
    }
}
