//! Tracking: the exact maximum about the lags at which the neighbours of a shot were found.

use super::sent::Sent;
use super::{Band, Detection};
use crate::kernels::{BLOCK_WORDS, Block, is_dark};

/// Lags that are counted at once.
pub(super) const BLOCK: i64 = 64 * BLOCK_WORDS as i64;

/// How far from a peak the lags to both sides are seen with it, at least: a peak nearer to an end
/// of its block is looked at again in the middle of one.
const NEAREST_SIDE: i64 = BLOCK / 2 - BLOCK / 8;

/// Where light is faint, a shot is looked for near one that was found so many shots away.
const WIDEST_GAP: usize = 12;

impl Band<'_> {
    /// The lags at which `shot` is to be expected, after its neighbours: on the plane through
    /// three of them, on the lines through two, and at the lag of one, which may be so many shots
    /// away.
    fn expected(&self, shot: usize, gap: usize) -> [Option<i64>; 7] {
        let at = |shot: Option<usize>| Some(self.found.get(shot?)?.as_ref()?.lag);
        let beside = |of: &[Option<u32>], shot: Option<usize>| {
            of.get(shot?).copied().flatten().map(|shot| shot as usize)
        };
        let left_of = |shot| beside(&self.left, shot);
        let over = |shot| beside(&self.above, shot);
        let here = Some(shot);
        let (left, above) = (at(left_of(here)), at(over(here)));
        let across = || Some(2 * left? - at(left_of(left_of(here)))?);
        let back = || Some(2 * at(Some(shot + 1))? - at(Some(shot + 2))?);
        let plane = || Some(left? + above? - at(over(left_of(here)))?);
        let before = || (1..=gap).find_map(|away| at(shot.checked_sub(away)));
        let nearest_left = || left.or_else(before);
        let nearest_right = || (1..=gap).find_map(|away| at(Some(shot + away)));
        let down = || Some(2 * above? - at(over(over(here)))?);
        [across(), nearest_left(), plane(), above, nearest_right(), back(), down()]
    }

    /// The best peak that chance does not give about the lags at which `shot` is to be expected. The
    /// first one at which as many marks are found as is usual is taken.
    pub(super) fn tracked(&mut self, shot: usize, is_faint: bool) -> Option<Detection> {
        let expected = self.expected(shot, if is_faint { WIDEST_GAP } else { 1 });
        if expected.iter().all(Option::is_none) {
            return None;
        }
        let weight = self.sent.weight(shot);
        let (usual, least) = (self.usual.least(weight), self.least_in_gate(shot));
        let mut best: Option<Detection> = None;
        for (index, lag) in expected.iter().enumerate() {
            let Some(lag) = *lag else { continue };
            let mut tried = expected[..index].iter().flatten();
            if tried.any(|other| lag.abs_diff(*other) < BLOCK as u64 / 4) {
                continue;
            }
            // A sidelobe of a peak just outside would show half as many marks as the peak.
            let at_least = if is_faint { least } else { least.max(usual / 2) };
            let Some(peak) = self.climb(shot, lag, at_least) else { continue };
            if best.is_none_or(|best| peak.count > best.count)
                && peak.count >= self.by_chance(shot, peak)
                && !self.is_of_a_later_shot(shot, peak)
            {
                best = Some(peak);
                if peak.count >= usual {
                    break;
                }
            }
        }
        best
    }

    /// The highest peak that can be climbed to from `lag`. `None` where fewer than `at_least`
    /// marks fit anywhere around.
    ///
    /// The sidelobes of a code word reach almost as far as the word is long, and a peak that does
    /// not have all its marks may be one of them: then the blocks to both sides are seen, too,
    /// unless as many marks as usual are there, and marks at both of its ends.
    pub(super) fn climb(&mut self, shot: usize, lag: i64, at_least: u32) -> Option<Detection> {
        const STEPS: usize = 64;
        let weight = self.sent.weight(shot);
        let usual = self.usual.least(weight).max(weight.div_ceil(2));
        let mut best = self.best_in_block(shot, lag).filter(|best| best.count >= at_least)?;
        let mut middle = lag;
        for _ in 0..STEPS {
            if best.lag.abs_diff(middle) > BLOCK as u64 / 8 {
                middle = best.lag;
                best = self.best_in_block(shot, middle)?;
                continue;
            }
            let is_certain = best.count >= usual && self.both_ends_are_lit(shot, best.lag);
            if best.count == weight || is_certain || self.sent.length() <= NEAREST_SIDE {
                break;
            }
            let sides = [middle - BLOCK, middle + BLOCK];
            let sides = sides.map(|side| self.best_in_block(shot, side));
            let higher = sides.into_iter().flatten().find(|side| {
                side.count > best.count || (side.count == best.count && side.lag < best.lag)
            });
            match higher.or_else(|| self.whole_bits_away(shot, best)) {
                Some(side) => best = side,
                None => break,
            }
        }
        Some(best)
    }

    /// The best peak at which more marks of `shot` are found than at `detection`, some of its bits
    /// earlier or later: there, a part of the lit bits falls upon lit bits.
    fn whole_bits_away(&mut self, shot: usize, detection: Detection) -> Option<Detection> {
        let sent = self.sent;
        let (bits, length) = (sent.bits_of_payload(), sent.bit_length());
        let reach = sent.reach();
        let start = sent.fired[shot] + detection.lag;
        let pattern = &sent.bits(shot).pattern;
        let lit = self.field.lit();
        let found: Vec<u32> =
            (-bits..2 * bits).map(|bit| lit.lit_in(start + bit * length, pattern)).collect();
        let mut best = (detection.count, None);
        for away in -bits..=bits {
            let lag = detection.lag + away * length;
            if !reach.contains(&lag) {
                continue;
            }
            let bits = sent.lit_from(shot, 0).map(|bit| (bits + away + bit / length) as usize);
            let count = bits.filter_map(|bit| found.get(bit)).sum();
            if count > best.0 {
                best = (count, Some(lag));
            }
        }
        best.1.and_then(|lag| self.best_in_block(shot, lag))
    }

    /// The highest peak in the [`BLOCK`] around `middle`.
    pub(super) fn best_in_block(&mut self, shot: usize, middle: i64) -> Option<Detection> {
        let allowed = self.count_about(shot, middle)?;
        let (at, count) = self.counts.highest(allowed)?;
        Some(self.detection(middle, (at, count), allowed))
    }

    /// What is found of `shot` at exactly `lag`.
    pub(super) fn found_at(&mut self, shot: usize, lag: i64) -> Option<Detection> {
        let allowed = self.count_about(shot, lag)?;
        let at = (BLOCK / 2) as u32;
        Some(self.detection(lag, (at, self.counts.at(at)), allowed))
    }

    /// Counts the marks found of `shot` in the [`BLOCK`] around lag `middle`; the lags that are looked
    /// at, if there are any.
    fn count_about(&mut self, shot: usize, middle: i64) -> Option<Block> {
        let first = middle - BLOCK / 2;
        let allowed = lags_allowed(self.sent, first)?;
        let places = &mut self.search.places;
        let (words, begin) = self.field.lit().at(self.sent.fired[shot] + first);
        places_of(self.sent, shot, places);
        self.counts.clear();
        self.counts.add(words, begin as u32, places);
        Some(allowed)
    }

    /// The detection with so many marks at a place of the block around `middle`.
    fn detection(&self, middle: i64, (at, count): (u32, u32), allowed: Block) -> Detection {
        let plateau = between(i64::from(at), self.sent.width.into());
        let others = std::array::from_fn(|lane| allowed[lane] & !plateau[lane]);
        let next = self.counts.highest(others).map_or(0, |(_, count)| count);
        let lag = middle - BLOCK / 2 + i64::from(at);
        Detection { lag, count, margin: count.saturating_sub(next) }
    }

    /// Whether marks at both ends of the macropulse of `shot` are found, if it comes after `lag`.
    /// At a sidelobe that far from the peak as the lags beside a block are, those at one of the ends
    /// have nothing to fall upon, and only chance could light them.
    fn both_ends_are_lit(&mut self, shot: usize, lag: i64) -> bool {
        let sent = self.sent;
        let marks = &sent.bits(shot).marks;
        let start = sent.fired[shot] + lag;
        let mut bits = sent.lit_from(shot, start);
        let (Some(first), Some(last)) = (marks.first(), marks.last()) else { return false };
        let Some(first_bit) = bits.next() else { return false };
        let last_bit = bits.last().unwrap_or(first_bit);
        let side = NEAREST_SIDE as u32;
        let begins = &marks[..marks.partition_point(|mark| mark - first < side)];
        let ends = &marks[marks.partition_point(|mark| last - mark >= side)..];
        let density = self.field.density(&sent.light(shot, lag));
        [(first_bit, begins), (last_bit, ends)].into_iter().all(|(bit, marks)| {
            let lit = self.field.lit();
            let found = marks.iter().filter(|mark| lit.has(bit + i64::from(**mark))).count();
            found as u32 >= self.end_thresholds.least(marks.len() as u32, density)
        })
    }
}

/// Puts into `places` the ticks from the start of the macropulse of `shot` to each of its marks.
pub(super) fn places_of(sent: &Sent, shot: usize, places: &mut Vec<u32>) {
    let marks = &sent.bits(shot).marks;
    places.clear();
    for bit in sent.lit_from(shot, 0) {
        places.extend(marks.iter().map(|mark| bit as u32 + mark));
    }
}

/// The lags at which light is looked for among those of the block that begins with lag `first`; `None` if there
/// are none.
pub(super) fn lags_allowed(sent: &Sent, first: i64) -> Option<Block> {
    let reach = sent.reach();
    let allowed = below(reach.start - first, [u64::MAX; BLOCK_WORDS], false);
    let allowed = below(reach.end - first, allowed, true);
    (!is_dark(&allowed)).then_some(allowed)
}

/// Those of `lags` that are below `end`, or those that are not.
pub(super) fn below(end: i64, lags: Block, wanted: bool) -> Block {
    std::array::from_fn(|lane| {
        let below = match (end - 64 * lane as i64).clamp(0, 64) {
            64 => u64::MAX,
            bits => (1 << bits) - 1,
        };
        lags[lane] & if wanted { below } else { !below }
    })
}

/// The lags of a block that are no farther than `plateau` from lag `at` of it.
fn between(at: i64, plateau: i64) -> Block {
    let from = below(at - plateau, [u64::MAX; BLOCK_WORDS], false);
    below(at + plateau + 1, from, true)
}
