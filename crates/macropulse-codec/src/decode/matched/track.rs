//! Tracking: the exact maximum about the lags at which the neighbours of a shot were found.

use super::pace::LONGEST_PAUSE;
use super::{Band, Detection};
use crate::kernels::{COARSE, NARROW, and, is_dark, or, places_of, with_enough};

/// Lags that are counted at once.
pub(super) const BLOCK: i64 = 64 * NARROW as i64;

/// Blocks to each side of a peak in which a higher one is looked for: the number that the picture bounds at once. With
/// the one of the peak they hold all sidelobes of words of up to 892 ticks. In `car-50m` as declared 3 blocks find 122
/// of 190 824 shots more than 1. Without any, one shot in 200 is lost even in good light.
const SIDES: i64 = (COARSE as i64 - 1) / 2;

/// The lags to both sides of a peak that are always seen with it.
pub(super) const NEAREST_SIDE: i64 = BLOCK / 2 - OFF;

/// A peak farther than this from the middle of its block is looked at again in the middle of one. At an
/// eighth of that one shot in three of `street` is counted twice. At twice that fewer lags are seen to both
/// sides, so that fewer marks at the ends of a macropulse tell that it is no sidelobe. A noisy scan then
/// takes a seventh longer.
const OFF: i64 = BLOCK / 8;

/// In faint light a shot is looked for near one that was found at most this number of shots away. It is the
/// longest pause between two searches, so that none between is out of reach. In a room where one shot in ten
/// can be found, 12 find 7 % of 1884 shots, 24 find 15 %, and this value half. If half can be found, 12 lose
/// 336 of 9670 shots, both others 100.
pub(super) const WIDEST_GAP: usize = LONGEST_PAUSE as usize;

/// Ways in which the lag of a shot is to be expected.
pub(super) const WAYS: usize = 5;

impl Band<'_> {
    /// Returns the lag at which `shot` is to be expected after its neighbours, in one of [`WAYS`]. These are
    /// the line through two of them, the plane through three, and the lag of one, which may be `gap` shots
    /// away.
    pub(super) fn expected(&self, shot: usize, gap: usize, way: usize) -> Option<i64> {
        let at = |shot: Option<usize>| Some(self.found.get(shot?)?.as_ref()?.lag);
        let beside = |of: &[Option<u32>], shot: Option<usize>| {
            of.get(shot?).copied().flatten().map(|shot| shot as usize)
        };
        let left_of = |shot| beside(&self.left, shot);
        let over = |shot| beside(&self.above, shot);
        let here = Some(shot);
        let left = || at(left_of(here));
        let above = || at(over(here));
        match way {
            0 => Some(2 * left()? - at(left_of(left_of(here)))?),
            1 => left().or_else(|| (1..=gap).find_map(|away| at(shot.checked_sub(away)))),
            2 => Some(left()? + above()? - at(over(left_of(here)))?),
            3 => above(),
            _ => (1..=gap).find_map(|away| at(Some(shot + away))),
        }
    }

    /// The best peak beyond chance about the lags at which neighbours, at most `gap` shots away, predict `shot`. The
    /// first one with the usual number of marks is taken.
    pub(super) fn tracked(&mut self, shot: usize, gap: usize) -> Option<Detection> {
        let weight = self.sent.weight(shot);
        let usual = self.usual.least(weight);
        let mut least = 0;
        let mut best: Option<Detection> = None;
        let mut tried = [i64::MIN; WAYS];
        for way in 0..WAYS {
            let Some(lag) = self.expected(shot, gap, way) else { continue };
            if tried[..way].iter().any(|other| lag.abs_diff(*other) < OFF as u64) {
                continue;
            }
            tried[way] = lag;
            if least == 0 {
                // Fewer are nowhere believed.
                let density = match gap {
                    1 => self.density_in_gate(shot, weight),
                    _ => {
                        let gate = self.sent.gate();
                        self.leftover().density(shot, &gate)
                    }
                };
                least = self.chance.expected.least(weight, density);
            }
            let Some(peak) = self.climb(shot, lag, least) else { continue };
            let Some(peak) = self.told_from_chance(shot, peak) else { continue };
            if best.is_none_or(|best| peak.count > best.count)
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

    /// The highest peak that can be climbed to from `lag`. `None` if fewer than `at_least` marks fit everywhere around.
    ///
    /// The sidelobes of a code word reach almost as far as the word is long, and a peak that lacks marks may be one of
    /// them. Then the blocks to both sides are counted, too, unless the usual number of marks is there, with marks at
    /// both ends.
    pub(super) fn climb(&mut self, shot: usize, lag: i64, at_least: u32) -> Option<Detection> {
        const STEPS: usize = 64;
        let weight = self.sent.weight(shot);
        let usual = self.usual.least(weight).max(weight.div_ceil(2));
        let mut best = self.best_in_block(shot, lag).filter(|best| best.count >= at_least)?;
        let mut middle = lag;
        for _ in 0..STEPS {
            if best.lag.abs_diff(middle) > OFF as u64 {
                middle = best.lag;
                best = self.best_in_block(shot, middle)?;
                continue;
            }
            let is_whole = best.count == weight;
            if is_whole || best.count >= usual && self.both_ends_are_lit(shot, best.lag) {
                break;
            }
            let higher = self.whole_bits_away(shot, best);
            let Some(higher) = higher.or_else(|| self.beside(shot, middle, best)) else { break };
            best = higher;
        }
        Some(best)
    }

    /// The highest of the peaks in the blocks to both sides of that around `middle`, if it has more marks of `shot`
    /// than `detection`, or the same number earlier.
    pub(super) fn beside(
        &mut self,
        shot: usize,
        middle: i64,
        detection: Detection,
    ) -> Option<Detection> {
        let word = self.sent.bit_length();
        let sides = (1..=SIDES).take_while(|side| side * BLOCK - BLOCK / 2 < word);
        let sides = sides.flat_map(|side| [middle - side * BLOCK, middle + side * BLOCK]);
        let (bounds, first) =
            self.bounds(shot, middle - BLOCK / 2 - SIDES * BLOCK, detection.count);
        let may_hold = |side: &i64| may_hold(bounds, side - BLOCK / 2 - first);
        let of = |peak: &Detection| (peak.count, std::cmp::Reverse(peak.lag));
        let peaks = sides.filter(may_hold).filter_map(|side| self.best_in_block(shot, side));
        peaks.max_by_key(of).filter(|peak| of(peak) > of(&detection))
    }

    /// Leaves out those of the blocks around `middles` in which nowhere `least` marks of `shot` are found, as far as the
    /// picture tells; sorts the others.
    pub(super) fn leave_out_fewer(&mut self, shot: usize, middles: &mut Vec<i64>, least: u32) {
        middles.sort_unstable();
        let mut seen: Option<([u64; NARROW], i64)> = None;
        middles.retain(|middle| {
            let begin = middle - BLOCK / 2;
            let is_seen =
                |(_, first): &([u64; NARROW], i64)| begin + BLOCK <= first + BLOCK * COARSE as i64;
            let (bounds, first) =
                seen.filter(is_seen).unwrap_or_else(|| self.bounds(shot, begin, least));
            seen = Some((bounds, first));
            may_hold(bounds, begin - first)
        });
    }

    /// Returns bits for groups of eight lags, lit if `least` marks of `shot` may be found at any of the
    /// eight; and the first lag, which is about `lag`.
    ///
    /// One bit of the picture covers the sixteen ticks on which a mark may fall at any of the lags. So it shows at
    /// least the marks that are found at any of them.
    fn bounds(&mut self, shot: usize, lag: i64, least: u32) -> ([u64; NARROW], i64) {
        self.lay_out(shot);
        let (fired, seen_at_once) = (self.sent.fired[shot], BLOCK * COARSE as i64);
        let from = fired + lag;
        let to = from + seen_at_once + self.sent.length();
        let (picture, origin) = self.field.picture(from, to);
        let bit = (from - origin).div_euclid(COARSE as i64).max(0);
        self.in_picture.clear();
        self.in_picture.extend(self.marks.iter().map(|mark| mark / COARSE as u32));
        let farthest = self.in_picture.last().copied().unwrap_or(0);
        let (mut enough, marks) = ([0; NARROW], (&*self.in_picture, farthest));
        with_enough::<NARROW>(picture, bit as u32, marks, least, &mut enough);
        (enough, origin + COARSE as i64 * bit - fired)
    }

    /// Returns the best peak at which more marks of `shot` are found than at `detection`, some of its bits
    /// earlier or later. There, a part of the lit bits falls upon lit bits.
    fn whole_bits_away(&mut self, shot: usize, detection: Detection) -> Option<Detection> {
        let sent = self.sent;
        let (bits, length) = (sent.bits_of_payload(), sent.bit_length());
        if bits == 1 {
            return None;
        }
        let mut words = std::mem::take(&mut self.words);
        self.words_about(shot, sent.fired[shot] + detection.lag, &mut words.found);
        sent.in_bits(shot, &words.found, &mut words.sums);
        let reach = sent.reach();
        let lags = (-bits..).zip(&words.sums);
        let lags = lags.map(|(away, count)| (*count, detection.lag + away * length));
        let higher = lags.filter(|(count, lag)| *count > detection.count && reach.contains(lag));
        let highest = higher.max_by_key(|(count, lag)| (*count, -lag));
        self.words = words;
        self.best_in_block(shot, highest?.1)
    }

    /// Counts the marks of the word of `shot` at the place of each bit about tick `start`, into `found`. The
    /// places go from the length of a payload before it to twice that length behind it.
    fn words_about(&self, shot: usize, start: i64, found: &mut Vec<u32>) {
        let (bits, length) = (self.sent.bits_of_payload(), self.sent.bit_length());
        let (after, pattern) = (self.sent.bits_about(), &self.sent.bits(shot).pattern);
        self.field.lit().lit_in_each(start - bits * length, after, pattern, found);
    }

    /// The highest peak in the [`BLOCK`] around `middle`.
    pub(super) fn best_in_block(&mut self, shot: usize, middle: i64) -> Option<Detection> {
        self.best_of(shot, middle, [u64::MAX; NARROW])
    }

    /// The detection of `shot` at exactly `lag`.
    pub(super) fn found_at(&mut self, shot: usize, lag: i64) -> Option<Detection> {
        let mut only = [0; NARROW];
        only[NARROW / 2] = 1;
        self.best_of(shot, lag, only)
    }

    /// Has the marks of `shot` at hand.
    pub(super) fn lay_out(&mut self, shot: usize) {
        if self.marks_of != Some(shot) {
            places_of(self.sent.word(shot), self.sent.lit_bits(shot), &mut self.marks);
            self.marks_of = Some(shot);
        }
    }

    /// The highest peak among the `wanted` lags of the block around `middle`.
    fn best_of(&mut self, shot: usize, middle: i64, wanted: [u64; NARROW]) -> Option<Detection> {
        let (first, reach) = (middle - BLOCK / 2, self.sent.reach());
        let allowed = below(reach.start - first, [u64::MAX; NARROW], false);
        let allowed = below(reach.end - first, allowed, true);
        if is_dark(&allowed) {
            return None;
        }
        let sent = self.sent;
        let (words, begin) = self.field.lit().at(sent.fired[shot] + first);
        self.counts.count(words, begin as u32, sent.word(shot), sent.lit_bits(shot));
        let (at, count) = self.counts.highest(and(allowed, wanted))?;
        let (at, width) = (i64::from(at), i64::from(self.sent.width));
        let before = below(at - width, allowed, true);
        let behind = below(at + width + 1, allowed, false);
        let next = self.counts.highest(or(before, behind)).map_or(0, |(_, count)| count);
        let margin = count.saturating_sub(next);
        Some(Detection { margin, ..Detection::at(first + at, count) })
    }

    /// True if marks at both ends of the macropulse of `shot` are found at `lag`. At a sidelobe beyond the block of the
    /// peak, those at one of the ends have no light to fall upon, and only chance could light them.
    fn both_ends_are_lit(&mut self, shot: usize, lag: i64) -> bool {
        let sent = self.sent;
        let (start, bits) = (sent.fired[shot] + lag, sent.lit_bits(shot));
        let (Some(first), Some(last)) = (bits.first(), bits.last()) else { return false };
        let density = self.field.density_without(&sent.light(shot, lag), 0, 0);
        [first, last].into_iter().zip(&sent.bits(shot).ends).all(|(bit, (marks, pattern))| {
            let found = self.field.lit().lit_in(start + i64::from(*bit), pattern);
            found >= self.chance.at_end.least(*marks, density)
        })
    }
}

/// True if `bounds`, bits for groups of eight lags, are lit for any of the lags of a block that begins at `begin`.
fn may_hold(bounds: [u64; NARROW], begin: i64) -> bool {
    let group = begin / COARSE as i64;
    let among = below(group + BLOCK / COARSE as i64 + 1, bounds, true);
    !is_dark(&below(group, among, false))
}

/// Which of the `lags` are lit, ascending.
pub(super) fn lit<const W: usize>(lags: [u64; W]) -> impl Iterator<Item = i64> {
    (0..).step_by(64).zip(lags).flat_map(|(first, mut lags)| {
        std::iter::from_fn(move || {
            let next = (lags != 0).then(|| first + i64::from(lags.trailing_zeros()));
            lags &= lags.wrapping_sub(1);
            next
        })
    })
}

/// Those of `lags` that are below `end`, or those that are not.
pub(super) fn below<const W: usize>(end: i64, lags: [u64; W], wanted: bool) -> [u64; W] {
    std::array::from_fn(|lane| {
        let below = match (end - 64 * lane as i64).clamp(0, 64) {
            64 => u64::MAX,
            bits => (1 << bits) - 1,
        };
        lags[lane] & if wanted { below } else { !below }
    })
}
