//! The light nobody has explained yet: who else could have sent it?

use super::{Band, Lock, STAGGER};
use crate::decode::search::Sought;

/// How much must speak for a lag.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Evidence {
    /// Half of the marks, and twice what chance can give: many bright shots on top of each other
    /// are a worse impostor than chance is.
    Overwhelming,
    /// Half of the marks.
    Bright,
    /// As few marks as chance does not give.
    MoreThanChance,
}

impl Band<'_> {
    /// Looks for the shots that have no lag yet: near their neighbours, and for one in `every` of
    /// them in all the unexplained light of the gate.
    pub(super) fn search(&mut self, evidence: Evidence, every: u32) {
        for shot in 0..self.locks.len() {
            if self.locks[shot].is_some() || !self.may_be_lit(shot) {
                continue;
            }
            let lock = match self.predicted(shot, evidence) {
                Some(lock) => Some(lock),
                None if self.is_among(shot, every) => self.believed(shot, evidence),
                None => None,
            };
            if let Some(lock) = lock {
                self.lock(shot, lock);
            }
        }
    }

    fn is_among(&self, shot: usize, every: u32) -> bool {
        let log = self.sent.log;
        let (row, column) = (u32::from(log.row[shot]), u32::from(log.column[shot]));
        (column + STAGGER * row).is_multiple_of(every)
    }

    /// What a search for `shot` finds, if the `evidence` is there.
    fn believed(&mut self, shot: usize, evidence: Evidence) -> Option<Lock> {
        let weight = self.sent.weight(shot);
        let least = match evidence {
            Evidence::Overwhelming | Evidence::Bright => weight.div_ceil(2),
            Evidence::MoreThanChance => 1,
        };
        let lock = self.searched(shot, least).filter(|lock| lock.count >= least)?;
        let by_chance = self.by_chance(shot, lock);
        let needed = match evidence {
            Evidence::Overwhelming => by_chance.max(weight.min(2 * by_chance)),
            Evidence::Bright | Evidence::MoreThanChance => by_chance,
        };
        (lock.count >= needed).then_some(lock)
    }

    /// Gives a predicted shot the lag that unexplained light speaks for, where it fits better.
    pub(super) fn contest(&mut self) {
        for shot in 0..self.locks.len() {
            let Some(lock) = self.locks[shot].filter(|lock| !lock.searched) else { continue };
            // With so many marks in every lit bit nothing else can be meant: what is left over is
            // another surface in the same footprint.
            if 8 * lock.count >= 7 * self.sent.weight(shot) {
                continue;
            }
            let density = self.density_in_gate(shot);
            let by_chance = self.thresholds.least(self.sent.weight(shot), density);
            if !self.is_crowded(shot, lock.count.saturating_sub(by_chance)) {
                continue;
            }
            if let Some(rival) = self.searched(shot, lock.count / 2)
                && rival.count > lock.count
                && rival.count >= self.by_chance(shot, rival)
            {
                self.lock(shot, rival);
            }
        }
    }

    /// Whether there are so many unexplained ticks within one macropulse somewhere in the gate
    /// of `shot` that they could be `marks` of its marks.
    fn is_crowded(&self, shot: usize, marks: u16) -> bool {
        let per_tick = self.marks_per_tick[usize::from(self.sent.log.word[shot])];
        let needed = u32::from(marks).div_ceil(per_tick).max(1);
        let gate = self.sent.gate_and_macropulse(shot);
        self.unexplained.at_most(gate.clone()) >= needed
            && self.unexplained.densest(gate, self.sent.length() as u32) >= needed
    }

    /// The lag at which most marks of `shot` are found, out of all that unexplained ticks speak
    /// for. `None` where these are fewer than `at_least` or chance could as well have put them
    /// there.
    pub(super) fn searched(&mut self, shot: usize, at_least: u16) -> Option<Lock> {
        let (nearest, farthest) = self.sent.gate();
        let weight = self.sent.weight(shot);
        if weight == 0 || farthest < nearest {
            return None;
        }
        let gate = self.sent.gate_and_macropulse(shot);
        let ticks = self.unexplained.at_most(gate.clone()) * self.sent.width;
        let left_over = f64::from(ticks) / (gate.end - gate.start) as f64;
        // Marks under ticks that are explained already are missing here: half are taken to be
        // visible.
        let density = self.density_in_gate(shot);
        let visible = self.thresholds.least(weight, density).div_ceil(2);
        let least = self.thresholds.least(weight, left_over).max(visible).max(at_least);
        if !self.is_crowded(shot, least) {
            return None;
        }
        let scale = self.sent.scale() as usize;
        let word = self.sent.codebook.word(self.sent.log.word[shot]);
        let sought = Sought {
            word: word.marks.iter().map(|&mark| scale * usize::from(mark)).collect(),
            bits: self.sent.bits(shot, true).map(|bit| bit as usize).collect(),
            lags: (farthest - nearest + 1) as usize,
            least,
        };
        let at = (self.sent.fired[shot] + nearest, self.sent.width);
        let found = self.search.best(&self.unexplained, at, &sought)?;
        let best = self.best_near(shot, nearest + found.lag as i64, least)?;
        Some(Lock { searched: true, ..best })
    }
}
