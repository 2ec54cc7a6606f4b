//! Shots whose neighbours have been found are looked for where their neighbours are.

use super::acquisition::Evidence;
use super::{Band, Detection};
use crate::decode::correlator::BLOCK;
use crate::kernels::{Marks, lit_in};

/// How far from a peak the sides of its block are, at least.
const NEAREST_SIDE: i64 = BLOCK / 2 - BLOCK / 8;

/// Where light is faint, a shot is looked for near one that was found so many shots away.
const WIDEST_GAP: usize = 12;

impl Band<'_> {
    /// Goes from each shot that was found back to those before it.
    pub(super) fn track_back(&mut self, evidence: Evidence) {
        for shot in (0..self.detections.len()).rev() {
            if self.detections[shot].is_none()
                && self.may_be_lit(shot)
                && let Some(detection) = self.predicted(shot, evidence)
            {
                self.keep(shot, detection);
            }
        }
    }

    /// The lags at which `shot` is to be expected, after its neighbours: on the plane through
    /// three of them, on the lines through two, and at the lag of one. Where light is faint, gaps
    /// are looked across.
    fn expected(&self, shot: usize, evidence: Evidence) -> [Option<i64>; 6] {
        let at = |shot: Option<usize>| Some(self.detections.get(shot?)?.as_ref()?.lag);
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
    pub(super) fn predicted(&mut self, shot: usize, evidence: Evidence) -> Option<Detection> {
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
            let detection = self.best_near(shot, lag, least.div_ceil(2));
            if detection.is_some_and(|detection| self.is_certain(shot, detection, evidence)) {
                return detection;
            }
        }
        None
    }

    /// The highest peak that can be climbed to from `lag`. `None` where fewer than `at_least`
    /// marks fit anywhere around.
    ///
    /// The sidelobes of a code word reach almost as far as the word is long, and a peak that does
    /// not have all its marks may be one of them: then the blocks to both sides are seen, too,
    /// unless it is bright and its first and last marks are there.
    pub(super) fn best_near(&mut self, shot: usize, lag: i64, at_least: u16) -> Option<Detection> {
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
            let is_bright = 2 * best.count >= weight;
            if best.count == weight || is_bright && self.both_ends_are_lit(shot, best.lag) {
                break;
            }
            let sides = [middle - BLOCK, middle + BLOCK];
            let sides = sides.map(|side| self.best_in_block(shot, side));
            let higher = sides.into_iter().flatten().find(|side| {
                side.count > best.count || (side.count == best.count && side.lag < best.lag)
            });
            match higher {
                Some(side) => best = side,
                None if is_bright => break,
                None => match self.whole_bits_away(shot, best) {
                    Some(lag) => (middle, best) = (lag, self.best_in_block(shot, lag)?),
                    None => break,
                },
            }
        }
        Some(best)
    }

    /// The lag at which more marks of `shot` are found than at `detection`, some of its bits
    /// earlier or later: there, a part of the lit bits falls upon lit bits. Several such lags: the
    /// best.
    fn whole_bits_away(&mut self, shot: usize, detection: Detection) -> Option<i64> {
        let bits = self.sent.bits_of_payload();
        let length = self.sent.length() / bits;
        let (nearest, farthest) = self.sent.gate();
        let found: Vec<u16> = (-bits..2 * bits)
            .map(|bit| self.found_in_bit(shot, detection.lag + bit * length))
            .collect();
        let mut best = None;
        for away in -bits..=bits {
            let lag = detection.lag + away * length;
            if !(nearest..=farthest).contains(&lag) {
                continue;
            }
            let lit = self.sent.bits(shot, true).map(|bit| (bits + away + bit / length) as usize);
            let count: u16 = lit.filter_map(|bit| found.get(bit)).sum();
            if count > best.map_or(detection.count, |(count, _)| count) {
                best = Some((count, lag));
            }
        }
        best.map(|(_, lag)| lag)
    }

    /// The highest peak in the [`BLOCK`] around `middle`.
    fn best_in_block(&mut self, shot: usize, middle: i64) -> Option<Detection> {
        let (nearest, farthest) = self.sent.gate();
        let first = middle - BLOCK / 2;
        let allowed = nearest - first..farthest + 1 - first;
        if allowed.end <= 0 || allowed.start >= BLOCK {
            return None;
        }
        let word = self.sent.codebook.word(self.sent.log.word[shot]);
        let (bits, scale) = (self.sent.lit_bits(shot), self.sent.scale() as usize);
        let start = self.sent.fired[shot] + first;
        let (words, bit) = self.field.bits(start, BLOCK + self.sent.length());
        self.counts.count(words, bit, Marks { word: &word.marks, bits, scale });
        let peak = self.counts.peak(allowed, self.sent.width.into())?;
        let (lag, margin) = (first + peak.at, peak.count - peak.next);
        Some(Detection { lag, count: peak.count, margin })
    }

    /// Whether marks at both ends of the macropulse of `shot` are found, if it comes after `lag`.
    /// At a sidelobe that far from the peak as the sides of a block are, those at one of the ends
    /// have nothing to fall upon, and only chance could light them.
    fn both_ends_are_lit(&mut self, shot: usize, lag: i64) -> bool {
        let (scale, bits) = (self.sent.scale(), self.sent.lit_bits(shot));
        let marks = &self.sent.codebook.word(self.sent.log.word[shot]).marks;
        let (Some(&first), Some(&last)) = (marks.first(), marks.last()) else { return false };
        let (Some(&first_bit), Some(&last_bit)) = (bits.first(), bits.last()) else { return false };
        let chips = (NEAREST_SIDE / scale) as u16;
        let begins = &marks[..marks.partition_point(|&mark| mark - first < chips)];
        let ends = &marks[marks.partition_point(|&mark| last - mark >= chips)..];
        let start = self.sent.fired[shot] + lag;
        let density = self.field.density(start..start + self.sent.length());
        let (words, place) = self.field.bits(start, self.sent.length());
        [(first_bit, begins), (last_bit, ends)].into_iter().all(|(bit, marks)| {
            let places =
                marks.iter().map(|&mark| scale as usize * (bit as usize + usize::from(mark)));
            let places = places.map(|mark| place + mark);
            let found = places.filter(|place| words[place / 64] >> (place % 64) & 1 == 1).count();
            found as u16 >= self.end_thresholds.least(marks.len() as u16, density)
        })
    }

    /// Whether chance does not reach `detection`; and, unless faint light is looked for, whether it
    /// can be no sidelobe and no other shot: half of the marks were found, or twice what chance can
    /// give, and no lit bit is much darker than the others.
    pub(super) fn is_certain(
        &mut self,
        shot: usize,
        detection: Detection,
        evidence: Evidence,
    ) -> bool {
        let weight = self.sent.weight(shot);
        if detection.count == weight {
            return true;
        }
        let by_chance = self.by_chance(shot, detection);
        if evidence == Evidence::MoreThanChance {
            return detection.count >= by_chance && self.is_mostly_residual(shot, detection);
        }
        if detection.count < by_chance || detection.count < weight.div_ceil(2).min(2 * by_chance) {
            return false;
        }
        let lit = self.sent.lit_bits(shot).len() as u32;
        // Not so many marks are missing altogether.
        let in_word = self.sent.word(shot).marks() as u32;
        if u32::from(weight - detection.count) + u32::from(detection.count).div_ceil(3 * lit)
            < in_word
        {
            return true;
        }
        let mut lit_bits = self.sent.bits(shot, true);
        lit_bits.all(|bit| {
            let found = self.found_in_bit(shot, detection.lag + bit);
            3 * u32::from(found) * lit >= u32::from(detection.count)
        })
    }

    /// Whether three in four of the marks found at `detection` are in the residual. Where many
    /// bright shots overlap, they pass for a faint one more easily than chance does.
    pub(super) fn is_mostly_residual(&mut self, shot: usize, detection: Detection) -> bool {
        let start = self.sent.fired[shot] + detection.lag;
        let places = self.sent.places(shot).map(|mark| start + mark);
        let end = start + self.sent.length() + i64::from(self.sent.width);
        let residual = self.field.residual(start..end);
        4 * residual.count(places, self.sent.width) >= 3 * detection.count
    }

    /// Marks of the code word of `shot` that are found if it begins at `lag`.
    pub(super) fn found_in_bit(&mut self, shot: usize, lag: i64) -> u16 {
        let pattern = self.sent.pattern(shot);
        let start = self.sent.fired[shot] + lag;
        let (words, first) = self.field.bits(start, 64 * pattern.reach() as i64);
        lit_in(words, first, pattern) as u16
    }
}
