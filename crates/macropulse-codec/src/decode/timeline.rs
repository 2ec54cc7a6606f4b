//! Ticks as one bit each, so that sixty-four places are looked at in one step.

use std::ops::Range;

use crate::kernels::{
    Pattern, are_lit, count_each, dark_before, lay, light_up, lit_in, lit_in_all, lit_in_any,
    lit_in_each, lit_in_row, look_ahead, put_out,
};

/// A stretch of time in which every tick is one bit: lit or dark. Outside of it all is dark.
#[derive(Debug, Clone, Default)]
pub(super) struct Timeline {
    /// Absolute tick of the first bit.
    origin: i64,
    words: Vec<u64>,
}

/// Machine words that are asked one after another for something lit, before many are at once: where macropulses
/// overlap it is mostly there.
const NEAR: usize = 4;

/// Places that a pattern is moved along at once.
const ROW: usize = 63;

impl Timeline {
    /// The tick of the first bit.
    pub fn origin(&self) -> i64 {
        self.origin
    }

    /// The tick behind the last bit.
    pub fn end(&self) -> i64 {
        self.origin + 64 * self.words.len() as i64
    }

    /// Makes it dark, `length` ticks long from `origin` on.
    pub fn clear_all(&mut self, origin: i64, length: i64) {
        self.origin = origin;
        self.words.clear();
        self.words.resize((length.max(0) / 64 + 1) as usize, 0);
    }

    /// Lets it begin at `origin`, `length` ticks long; which of these are lit is not told.
    pub fn begin(&mut self, origin: i64, length: i64) {
        self.origin = origin;
        self.words.resize((length.max(0) / 64 + 1) as usize, 0);
        self.forget_from(0);
    }

    /// In tests lights what is not told from machine word `word` on, as nothing may depend on it.
    fn forget_from(&mut self, word: usize) {
        if cfg!(test) {
            self.words[word..].fill(u64::MAX);
        }
    }

    /// Makes it the `words` that begin at `origin`, with the `reach` ticks before each lit one.
    pub fn look_ahead(&mut self, origin: i64, words: &[u64], reach: usize) {
        self.origin = origin;
        self.words.resize(words.len(), 0);
        look_ahead(words, &mut self.words, reach);
    }

    /// Lets it begin at `origin`, whole machine words later; what is behind where it ended so far is
    /// not told.
    pub fn slide(&mut self, origin: i64) {
        let moved = (((origin - self.origin) / 64) as usize).min(self.words.len());
        self.words.copy_within(moved.., 0);
        self.forget_from(self.words.len() - moved);
        self.origin = origin;
    }

    /// Lights those of the sorted `ticks` that are before `end`, and tells how many these are. None may
    /// be before the beginning, and all from the first one on must be dark.
    fn lay(&mut self, ticks: &[u32], end: i64) -> usize {
        lay(&mut self.words, self.origin, ticks, end)
    }

    /// Makes `span`, whole machine words, dark, and lights those of the sorted `ticks` that are before
    /// its end; tells how many these are. None may be before its beginning.
    pub fn lay_anew(&mut self, ticks: &[u32], span: Range<i64>) -> usize {
        let end = span.end;
        self.words_mut(&span).fill(0);
        self.lay(ticks, end)
    }

    /// The first tick of `span` that is lit.
    pub fn next_lit(&self, span: Range<i64>) -> Option<i64> {
        let first = (span.start - self.origin).max(0);
        let last = (span.end - self.origin).min(64 * self.words.len() as i64);
        if first >= last {
            return None;
        }
        if last - first <= 64 {
            let bits = self.from(self.origin + first) & u64::MAX >> (64 - (last - first));
            let lit = self.origin + first + i64::from(bits.trailing_zeros());
            return (bits != 0).then_some(lit);
        }
        let (word, end) = ((first / 64) as usize, (last as usize).div_ceil(64));
        let words = &self.words[word..end];
        let head = words[0] & u64::MAX << (first & 63);
        let (near, far) = words[1..].split_at(NEAR.min(words.len() - 1));
        let is_lit = |word: &u64| *word != 0;
        let dark = || near.iter().position(is_lit).unwrap_or_else(|| near.len() + dark_before(far));
        let lit = if head == 0 { 1 + dark() } else { 0 };
        let bits = if lit == 0 { head } else { *words.get(lit)? };
        let bit = 64 * (word + lit) as i64 + i64::from(bits.trailing_zeros());
        (bit < last).then_some(self.origin + bit)
    }

    /// The machine words of `span`, which begins and ends with one.
    pub fn words(&self, span: &Range<i64>) -> &[u64] {
        &self.words[self.places(span)]
    }

    /// The same, to be changed.
    pub fn words_mut(&mut self, span: &Range<i64>) -> &mut [u64] {
        let places = self.places(span);
        &mut self.words[places]
    }

    /// The machine words of `span`.
    fn places(&self, span: &Range<i64>) -> Range<usize> {
        let word = |tick: i64| (((tick - self.origin) / 64).max(0) as usize).min(self.words.len());
        word(span.start)..word(span.end)
    }

    /// All machine words, and the bit of `tick` in them; bit 0 for a tick before the beginning.
    pub fn at(&self, tick: i64) -> (&[u64], usize) {
        (&self.words, (tick - self.origin).max(0) as usize)
    }

    /// Darkens the ticks of `pattern` at each of its beginnings, which are `after` ticks behind `tick`, ascending.
    /// Beginnings before the timeline are left out.
    pub fn put_out(&mut self, tick: i64, after: &[u32], pattern: &Pattern) {
        let (first, after) = self.begun(tick, after);
        put_out(&mut self.words, first, after, pattern);
    }

    /// Darkens what is not lit in `other`, in a `span` of whole machine words that both have.
    pub fn keep_lit_in(&mut self, other: &Self, span: &Range<i64>) {
        let lit = other.words(span);
        self.words_mut(span).iter_mut().zip(lit).for_each(|(word, lit)| *word &= lit);
    }

    /// True if all ticks of `pattern` are lit at each of its beginnings, which are `after` ticks behind `tick`,
    /// ascending.
    pub fn are_lit(&self, tick: i64, after: &[u32], pattern: &Pattern) -> bool {
        let (first, begun) = self.begun(tick, after);
        begun.len() == after.len() && are_lit(&self.words, first, begun, pattern)
    }

    /// Lights the same ticks as [`Self::put_out`] darkens.
    pub fn light_up(&mut self, tick: i64, after: &[u32], pattern: &Pattern) {
        let (first, after) = self.begun(tick, after);
        light_up(&mut self.words, first, after, pattern);
    }

    /// The bit of `tick`, modulo 2⁶⁴, and those of `after`, ascending, that do not lie before the timeline.
    fn begun<'b>(&self, tick: i64, after: &'b [u32]) -> (usize, &'b [u32]) {
        let first = tick - self.origin;
        if first >= 0 {
            return (first as usize, after);
        }
        let before = after.partition_point(|after| first + i64::from(*after) < 0);
        (first as usize, &after[before..])
    }

    fn place(&self, tick: i64) -> Option<(usize, u64)> {
        let bit = (tick - self.origin) as u64;
        let word = (bit >> 6) as usize;
        (word < self.words.len()).then_some((word, 1 << (bit & 63)))
    }

    /// True if `tick` is lit.
    pub fn has(&self, tick: i64) -> bool {
        self.place(tick).is_some_and(|(word, bit)| self.words[word] & bit != 0)
    }

    /// How many ticks of `span` are lit.
    pub fn count(&self, span: Range<i64>) -> u32 {
        let first = (span.start - self.origin).max(0) as usize;
        let last = (span.end - self.origin).clamp(0, 64 * self.words.len() as i64) as usize;
        if first >= last {
            return 0;
        }
        let words = &self.words[first / 64..last.div_ceil(64)];
        let mut count = [0];
        count_each(words, words.len(), &mut count);
        let before = words[0] & !(u64::MAX << (first % 64));
        let behind = words[words.len() - 1] & !(u64::MAX >> ((64 - last % 64) % 64));
        count[0] - before.count_ones() - behind.count_ones()
    }

    /// Darkens `tick`.
    pub fn clear(&mut self, tick: i64) {
        if let Some((word, bit)) = self.place(tick) {
            self.words[word] &= !bit;
        }
    }

    /// How many ticks of `pattern` are lit if it begins at `tick`; none if that is before all.
    pub fn lit_in(&self, tick: i64, pattern: &Pattern) -> u32 {
        let bit = usize::try_from(tick - self.origin);
        bit.map_or(0, |bit| lit_in(&self.words, bit, pattern))
    }

    /// The same for all of its beginnings together, which are `after` ticks behind `tick`.
    pub fn lit_in_all(&self, tick: i64, after: &[u32], pattern: &Pattern) -> u32 {
        let first = usize::try_from(tick - self.origin);
        first.map_or(0, |first| lit_in_all(&self.words, first, after, pattern))
    }

    /// The same of it begun at `tick`, at the next tick, and so on: one number for each of the `counts`.
    pub fn lit_in_row(&self, tick: i64, after: &[u32], pattern: &Pattern, counts: &mut [u32]) {
        let before = ((self.origin - tick).max(0) as usize).min(counts.len());
        let (before_all, counts) = counts.split_at_mut(before);
        before_all.fill(0);
        let first = (tick - self.origin).max(0) as usize;
        for (some, counts) in (0..).zip(counts.chunks_mut(ROW)) {
            lit_in_row(&self.words, first + ROW * some, after, pattern, counts);
        }
    }

    /// The number of ticks of `pattern` that are lit for at least one of its beginnings, which are `after` ticks behind
    /// `tick`.
    pub fn lit_in_any(&self, tick: i64, after: &[u32], pattern: &Pattern) -> u32 {
        lit_in_any(&self.words, (tick - self.origin) as usize, after, pattern)
    }

    /// As [`Self::lit_in`] for each of its beginnings, which are `after` ticks behind `tick`; put into `counts`.
    pub fn lit_in_each(&self, tick: i64, after: &[u32], pattern: &Pattern, counts: &mut Vec<u32>) {
        counts.clear();
        counts.resize(after.len(), 0);
        lit_in_each(&self.words, (tick - self.origin) as usize, after, pattern, counts);
    }

    /// Sixty-four ticks from `tick` on, the first one in the lowest bit.
    pub fn from(&self, tick: i64) -> u64 {
        let bit = tick - self.origin;
        let word = |index: i64| {
            usize::try_from(index)
                .ok()
                .and_then(|index| self.words.get(index))
                .copied()
                .unwrap_or(0)
        };
        let (index, shift) = (bit >> 6, bit & 63);
        // Two shifts, because a shift by 64 does not give 0.
        word(index) >> shift | word(index + 1) << 1 << (63 - shift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_places_is_each_of_them_also_before_the_beginning() {
        let mut timeline = Timeline::default();
        timeline.clear_all(-100, 400);
        let ticks: Vec<u32> = (0..60).map(|tick| tick * tick % 251).collect();
        let ticks: std::collections::BTreeSet<u32> = ticks.into_iter().collect();
        timeline.lay(&ticks.into_iter().collect::<Vec<u32>>(), 300);
        let (pattern, after) = (Pattern::new([0, 3, 64, 70].into_iter(), 1), [0, 5, 90]);
        for tick in [-400, -103, -101, -100, -7, 40] {
            // More than are counted at once.
            let mut row = [7; 150];
            timeline.lit_in_row(tick, &after, &pattern, &mut row);
            let each: Vec<u32> = (tick..tick + 150)
                .map(|tick| timeline.lit_in_all(tick, &after, &pattern))
                .collect();
            assert_eq!(row[..], each, "from {tick}");
        }
    }

    #[test]
    fn a_tick_is_where_it_was_put_and_nothing_is_outside() {
        let mut timeline = Timeline::default();
        timeline.clear_all(-100, 200);
        assert_eq!(timeline.lay(&[0, 5, 63, 5000], 100), 3);
        let lit: Vec<i64> = (-300..300).filter(|&tick| timeline.has(tick)).collect();
        assert_eq!(lit, [0, 5, 63]);
        for tick in [-300, -101, -100, -64, -37, -1, 0, 63, 99, 400] {
            let expected =
                (0..64).fold(0, |word, bit| word | u64::from(timeline.has(tick + bit)) << bit);
            assert_eq!(timeline.from(tick), expected, "from {tick}");
            for end in
                [tick - 1, tick, tick + 1, tick + 5, tick + 63, tick + 64, tick + 65, tick + 300]
            {
                let next = (tick..end).find(|tick| timeline.has(*tick));
                assert_eq!(timeline.next_lit(tick..end), next, "from {tick} to {end}");
            }
        }
    }
}
