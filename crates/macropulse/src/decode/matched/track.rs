//! Shots whose neighbours have been found are looked for where their neighbours are.

use super::leftover::Evidence;
use super::{Band, Lock};
use crate::decode::correlator::{BLOCK, Counts, Peak};

/// Where light is faint, a shot is looked for near one that was found so many shots away.
const WIDEST_GAP: usize = 12;

impl Band<'_> {
    /// Goes from each shot that was found back to those before it.
    pub(super) fn track_back(&mut self, evidence: Evidence) {
        for shot in (0..self.locks.len()).rev() {
            if self.locks[shot].is_none()
                && self.may_be_lit(shot)
                && let Some(lock) = self.predicted(shot, evidence)
            {
                self.lock(shot, lock);
            }
        }
    }

    /// The lags at which `shot` is to be expected, after its neighbours: on the plane through
    /// three of them, on the lines through two, and at the lag of one. Where light is faint, gaps
    /// are looked across.
    fn expected(&self, shot: usize, evidence: Evidence) -> [Option<i64>; 6] {
        let at = |shot: Option<usize>| Some(self.locks.get(shot?)?.as_ref()?.lag);
        let over = |shot: Option<usize>| {
            self.above.get(shot?).copied().flatten().map(|shot| shot as usize)
        };
        let before = shot.checked_sub(1);
        let (left, above) = (at(before), at(over(Some(shot))));
        let plane = || Some(left? + above? - at(over(before))?);
        let across = || Some(2 * left? - at(shot.checked_sub(2))?);
        let down = || Some(2 * above? - at(over(over(Some(shot))))?);
        let gap = if evidence == Evidence::MoreThanChance { WIDEST_GAP } else { 1 };
        let nearest_left = || (1..=gap).find_map(|away| at(shot.checked_sub(away)));
        let nearest_right = || (1..=gap).find_map(|away| at(Some(shot + away)));
        [plane(), across(), down(), nearest_left(), above, nearest_right()]
    }

    /// The lag of `shot` if it lies where its neighbours say and the `evidence` is there.
    pub(super) fn predicted(&mut self, shot: usize, evidence: Evidence) -> Option<Lock> {
        let weight = self.sent.weight(shot);
        if weight == 0 {
            return None;
        }
        let expected = self.expected(shot, evidence);
        if expected.iter().all(Option::is_none) {
            return None;
        }
        let density = self.density_in_gate(shot);
        let by_chance = self.thresholds.least(weight, density);
        let least = match evidence {
            Evidence::MoreThanChance => by_chance,
            Evidence::Overwhelming | Evidence::Bright => weight.div_ceil(2).min(2 * by_chance),
        };
        for (index, lag) in expected.iter().enumerate() {
            let Some(lag) = *lag else { continue };
            let mut tried = expected[..index].iter().flatten();
            if tried.any(|other| lag.abs_diff(*other) < BLOCK as u64 / 4) {
                continue;
            }
            // The flank of a peak just outside would show half as many marks as the peak.
            let lock = self.best_near(shot, lag, least.div_ceil(2));
            if lock.is_some_and(|lock| self.is_certain(shot, lock, evidence)) {
                return lock;
            }
        }
        None
    }

    /// The highest peak that can be climbed to from `lag`. `None` where fewer than `at_least`
    /// marks fit anywhere around.
    ///
    /// The sidelobes of a code word reach almost as far as the word is long, and a peak that does
    /// not have all its marks may be one of them: then the blocks to both sides are seen, too.
    pub(super) fn best_near(&mut self, shot: usize, lag: i64, at_least: u16) -> Option<Lock> {
        const STEPS: usize = 64;
        let weight = self.sent.weight(shot);
        let mut best = self.best_in_block(shot, lag).filter(|best| best.count >= at_least)?;
        let mut middle = lag;
        for _ in 0..STEPS {
            if best.lag.abs_diff(middle) > BLOCK as u64 / 8 {
                middle = best.lag;
                best = self.best_in_block(shot, middle)?;
                continue;
            }
            if best.count == weight {
                break;
            }
            let sides = [middle - BLOCK, middle + BLOCK];
            let sides = sides.map(|side| match self.may_be_higher(shot, side, best.count) {
                true => self.best_in_block(shot, side),
                false => None,
            });
            let higher = sides.into_iter().flatten().find(|side| {
                side.count > best.count || (side.count == best.count && side.lag < best.lag)
            });
            match higher {
                Some(side) => best = side,
                None => break,
            }
        }
        Some(best)
    }

    /// The highest peak in the [`BLOCK`] around `middle`.
    fn best_in_block(&mut self, shot: usize, middle: i64) -> Option<Lock> {
        let peak = self.peak_in_block(shot, middle, self.sent.marks(shot))?;
        let (lag, margin) = (middle - BLOCK / 2 + peak.at, peak.count - peak.next);
        Some(Lock { lag, count: peak.count, margin, searched: false })
    }

    /// The highest peak in the [`BLOCK`] around `middle`, of some of the marks of `shot`.
    fn peak_in_block(&mut self, shot: usize, middle: i64, marks: &[u16]) -> Option<Peak> {
        let (nearest, farthest) = self.sent.gate();
        let first = middle - BLOCK / 2;
        let allowed = nearest - first..farthest + 1 - first;
        if allowed.end <= 0 || allowed.start >= BLOCK {
            return None;
        }
        let start = self.sent.fired[shot] + first;
        let (words, bit) = self.field.bits(start, BLOCK + self.sent.length());
        let counts = Counts::new(words, bit, (marks, self.sent.scale() as usize));
        counts.peak(allowed, self.sent.width.into())
    }

    /// Whether a peak of more than `count` marks may lie in the [`BLOCK`] around `middle`: one
    /// mark in three is asked. Of the marks of a higher peak as large a share is lit; a tenth less
    /// is allowed for luck.
    fn may_be_higher(&mut self, shot: usize, middle: i64, count: u16) -> bool {
        let mut some = std::mem::take(&mut self.some_marks);
        some.clear();
        some.extend(self.sent.marks(shot).iter().step_by(3));
        let peak = self.peak_in_block(shot, middle, &some);
        let (asked, all) = (some.len() as u32, u32::from(self.sent.weight(shot)));
        self.some_marks = some;
        peak.is_some_and(|peak| 10 * u32::from(peak.count) * all >= 9 * u32::from(count) * asked)
    }

    /// Whether chance does not reach `lock`; and, unless faint light is looked for, whether it can
    /// be no sidelobe and no other shot: half of the marks were found, or twice what chance can
    /// give, and no lit bit is much darker than the others.
    fn is_certain(&mut self, shot: usize, lock: Lock, evidence: Evidence) -> bool {
        let weight = self.sent.weight(shot);
        if lock.count == weight {
            return true;
        }
        let by_chance = self.by_chance(shot, lock);
        if evidence == Evidence::MoreThanChance {
            // Many bright shots on top of each other are a worse impostor than chance is.
            let start = self.sent.fired[shot] + lock.lag;
            let places = self.sent.places(shot).map(|mark| start + mark);
            return lock.count >= by_chance
                && 4 * self.unexplained.count(places, self.sent.width) >= 3 * lock.count;
        }
        if lock.count < by_chance || lock.count < weight.div_ceil(2).min(2 * by_chance) {
            return false;
        }
        let lit = self.sent.lit_bits(shot).len() as u32;
        // Not so many marks are missing altogether.
        let in_word = self.sent.word(shot).marks() as u32;
        if u32::from(weight - lock.count) + u32::from(lock.count).div_ceil(3 * lit) < in_word {
            return true;
        }
        let mut lit_bits = self.sent.bits(shot, true);
        lit_bits.all(|bit| {
            let found = self.found_in_bit(shot, lock.lag + bit);
            3 * u32::from(found) * lit >= u32::from(lock.count)
        })
    }

    /// Marks of the code word of `shot` that are found if it begins at `lag`.
    pub(super) fn found_in_bit(&mut self, shot: usize, lag: i64) -> u16 {
        let word = self.sent.codebook.word(self.sent.log.word[shot]);
        let scale = self.sent.scale();
        let start = self.sent.fired[shot] + lag;
        let (words, first) = self.field.bits(start, scale * i64::from(word.length));
        let is_lit = |mark: u16| {
            let bit = first + scale as usize * usize::from(mark);
            words.get(bit / 64).is_some_and(|word| word >> (bit % 64) & 1 == 1)
        };
        word.marks.iter().filter(|&&mark| is_lit(mark)).count() as u16
    }
}
