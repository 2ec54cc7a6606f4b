//! Ticks as one bit each, so that sixty-four places are looked at in one step.

use std::ops::Range;

/// A stretch of time in which every tick is one bit: lit or dark. Outside of it all is dark.
#[derive(Debug, Clone)]
pub(super) struct Timeline {
    /// Absolute tick of the first bit.
    origin: i64,
    words: Vec<u64>,
}

impl Timeline {
    /// The ticks of `lit` that lie in `span`.
    pub fn new(span: Range<i64>, lit: impl IntoIterator<Item = i64>) -> Self {
        let words = (span.end - span.start).max(0) as usize / 64 + 1;
        let mut timeline = Self { origin: span.start, words: vec![0; words] };
        for tick in lit {
            if let Some((word, bit)) = timeline.place(tick) {
                timeline.words[word] |= bit;
            }
        }
        timeline
    }

    fn place(&self, tick: i64) -> Option<(usize, u64)> {
        let bit = (tick - self.origin) as u64;
        let word = (bit >> 6) as usize;
        (word < self.words.len()).then_some((word, 1 << (bit & 63)))
    }

    /// Whether `tick` is lit.
    pub fn has(&self, tick: i64) -> bool {
        self.place(tick).is_some_and(|(word, bit)| self.words[word] & bit != 0)
    }

    /// Darkens `tick`; the index of its word if it was lit.
    fn darken(&mut self, tick: i64) -> Option<usize> {
        let (word, bit) = self.place(tick)?;
        let was_lit = self.words[word] & bit != 0;
        self.words[word] &= !bit;
        was_lit.then_some(word)
    }

    /// Darkens `tick`.
    pub fn clear(&mut self, tick: i64) {
        self.darken(tick);
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

    /// `N` times 64 ticks from `tick` on: words and the bit of the first one at which to begin.
    /// `None` where they are not all inside.
    pub fn block<const N: usize>(&self, tick: i64) -> Option<(&[u64; N], u32)> {
        let bit = tick - self.origin;
        let words = self.words.get(usize::try_from(bit >> 6).ok()?..)?;
        Some((words.first_chunk()?, (bit & 63) as u32))
    }

    /// The timeline in which a tick is lit if one of the `before` ticks before it, itself or one
    /// of the `after` ticks behind it is lit here.
    pub fn dilated(&self, before: u32, after: u32) -> Self {
        // Each round looks as far ahead again as all rounds before it.
        let mut dilated = self.clone();
        let (mut reached, reach) = (0, i64::from(before) + i64::from(after));
        while reached < reach {
            let step = (reached + 1).min(reach - reached);
            let words = (0..dilated.words.len()).map(|word| {
                dilated.words[word] | dilated.from(dilated.origin + 64 * word as i64 + step)
            });
            dilated.words = words.collect();
            reached += step;
        }
        // So far a tick sees only what comes after it.
        dilated.origin += i64::from(before);
        dilated
    }

    /// Lit ticks in each run of [`CHUNK`] ticks.
    pub fn per_chunk(&self) -> Vec<u32> {
        let chunks = self.words.chunks(CHUNK_WORDS);
        chunks.map(|words| words.iter().map(|word| word.count_ones()).sum()).collect()
    }
}

/// Ticks that are counted together where a rough place is enough.
pub(super) const CHUNK: i64 = 1024;

const CHUNK_WORDS: usize = CHUNK as usize / 64;

/// How many ticks are lit in a stretch of time, to the nearest [`CHUNK`].
#[derive(Debug)]
pub(super) struct Density {
    origin: i64,
    /// Lit ticks before each chunk, and before the end.
    before: Vec<u32>,
}

impl Density {
    /// The density of `timeline`.
    pub fn new(timeline: &Timeline) -> Self {
        let mut before = vec![0];
        let mut total = 0;
        for lit in timeline.per_chunk() {
            total += lit;
            before.push(total);
        }
        Self { origin: timeline.origin, before }
    }

    /// Share of lit ticks in `span`, counted in whole chunks.
    pub fn over(&self, span: Range<i64>) -> f64 {
        self.without(span, (0, 0))
    }

    /// Share of lit ticks in `span`, of which (lit, all) ticks are left out.
    pub fn without(&self, span: Range<i64>, own: (u32, u32)) -> f64 {
        let last = self.before.len() as i64 - 1;
        let from = ((span.start - self.origin).div_euclid(CHUNK)).clamp(0, last);
        let to = ((span.end - self.origin + CHUNK - 1).div_euclid(CHUNK)).clamp(from, last);
        let lit = self.before[to as usize] - self.before[from as usize];
        let all = ((to - from).max(1) * CHUNK - i64::from(own.1)).max(1);
        f64::from(lit.saturating_sub(own.0)) / all as f64
    }
}

/// The ticks nobody has explained yet.
#[derive(Debug)]
pub(super) struct Unexplained {
    timeline: Timeline,
    per_chunk: Vec<u32>,
}

impl Unexplained {
    /// All ticks of `timeline`.
    pub fn new(timeline: Timeline) -> Self {
        let per_chunk = timeline.per_chunk();
        Self { timeline, per_chunk }
    }

    /// Explains the ticks in `span`.
    pub fn explain(&mut self, span: Range<i64>) {
        for tick in span {
            if let Some(word) = self.timeline.darken(tick) {
                self.per_chunk[word / CHUNK_WORDS] -= 1;
            }
        }
    }

    /// What is unexplained.
    pub fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// The chunks that touch `span`.
    fn chunks(&self, span: Range<i64>) -> &[u32] {
        let end = self.per_chunk.len() as i64;
        let from = (span.start - self.timeline.origin).div_euclid(CHUNK).clamp(0, end);
        let to = (span.end - self.timeline.origin + CHUNK - 1).div_euclid(CHUNK).clamp(from, end);
        &self.per_chunk[from as usize..to as usize]
    }

    /// No fewer than the ticks in `span`, not many more.
    pub fn at_most(&self, span: Range<i64>) -> u32 {
        self.chunks(span).iter().sum()
    }

    /// No fewer than the ticks in any run of `length` ticks that ends in `span`.
    pub fn densest(&self, span: Range<i64>, length: u32) -> u32 {
        let chunks = self.chunks(span);
        let width = (i64::from(length) / CHUNK + 2) as usize;
        let (mut sum, mut most) = (0, 0);
        for (index, lit) in chunks.iter().enumerate() {
            sum += lit;
            if index >= width {
                sum -= chunks[index - width];
            }
            most = most.max(sum);
        }
        most
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_is_where_it_was_put_and_nothing_is_outside() {
        let timeline = Timeline::new(-100..100, [-100, -37, 0, 63, 5000, -101]);
        let lit: Vec<i64> = (-300..300).filter(|&tick| timeline.has(tick)).collect();
        assert_eq!(lit, [-100, -37, 0, 63]);
        for tick in [-300, -101, -100, -64, -37, -1, 0, 63, 99, 400] {
            let expected =
                (0..64).fold(0, |word, bit| word | u64::from(timeline.has(tick + bit)) << bit);
            assert_eq!(timeline.from(tick), expected, "from {tick}");
        }
    }

    #[test]
    fn a_dilated_tick_reaches_both_ways() {
        let timeline = Timeline::new(0..400, [64, 130, 300]);
        for (before, after) in [(0, 0), (1, 2), (2, 0), (0, 1), (7, 4), (70, 70)] {
            let dilated = timeline.dilated(before, after);
            for tick in 71..329 {
                let around = tick - i64::from(before)..=tick + i64::from(after);
                let lit = around.clone().any(|tick| timeline.has(tick));
                assert_eq!(dilated.has(tick), lit, "{tick} in {around:?}");
            }
        }
    }

    #[test]
    fn explained_ticks_are_no_longer_counted() {
        let lit = || (0..10_000).step_by(10);
        let mut unexplained = Unexplained::new(Timeline::new(0..10_240, lit()));
        assert_eq!(unexplained.at_most(0..10_240), 1000);
        unexplained.explain(0..5120);
        unexplained.explain(0..5120);
        assert_eq!(unexplained.at_most(0..5120), 0);
        assert_eq!(unexplained.at_most(5120..10_240), 488);
        // Four chunks hold any 2048 ticks.
        assert!((205..=410).contains(&unexplained.densest(0..10_240, 2048)));
        assert!(!unexplained.timeline().has(5110));
    }

    #[test]
    fn own_ticks_are_left_out_of_the_density() {
        let density = Density::new(&Timeline::new(0..1024, [3, 30, 300]));
        assert_eq!(density.without(0..1024, (2, 24)), 1.0 / 1000.0);
        assert_eq!(density.without(0..1024, (9, 2000)), 0.0);
    }

    #[test]
    fn density_is_lit_ticks_over_time() {
        let timeline = Timeline::new(0..102_400, (0..102_400).step_by(100));
        let density = Density::new(&timeline);
        approx::assert_abs_diff_eq!(density.over(20_480..81_920), 0.01, epsilon = 1e-4);
        assert_eq!(density.over(-5000..-2000), 0.0);
    }
}
