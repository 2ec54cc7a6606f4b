//! Some steps of the matched receiver by themselves, for who wants to time or to study them.

use crate::kernels::{self, Counts, NARROW, Pattern, WordTicks};

/// Lags at which [`WordMarks::most`] counts.
pub const LAGS: usize = 64 * NARROW;

/// Lights those of the ascending `ticks` that fit into `words`, and returns their number. The first bit of
/// `words` is tick `origin`, and no tick may be before it.
pub fn lay(words: &mut [u64], origin: i64, ticks: &[u32]) -> usize {
    let end = origin + 64 * words.len() as i64;
    kernels::lay(words, origin, ticks, end)
}

/// True if each of `ticks` is later than the one before it.
pub fn ascends(ticks: &[u32]) -> bool {
    kernels::ascends(ticks)
}

/// Lights, in `lit`, the places at which a mark counts as found: each lit bit of `words` and the `width` − 1
/// places before it. `lit` is as long as `words`. Width is 1 or more.
pub fn widen(words: &[u64], lit: &mut [u64], width: u32) {
    kernels::look_ahead(words, lit, width.saturating_sub(1) as usize);
}

/// The marks of a code word, as bits that are looked at together.
#[derive(Debug, Clone)]
pub struct WordMarks {
    pattern: Pattern,
    ticks: WordTicks,
}

impl WordMarks {
    /// Returns the marks of a word. `marks` ascend, in chips from the beginning of the word, and a chip has
    /// `scale` bits.
    pub fn new(marks: &[u16], scale: u32) -> Self {
        let ticks = WordTicks::new(marks, scale);
        let pattern = Pattern::new(ticks.ticks().iter().map(|mark| *mark as usize), 1);
        Self { pattern, ticks }
    }

    /// Returns the most lit marks of all words together, over common delays of 0 to [`LAGS`] − 1 bits.
    /// Without delay, a word begins at each of the `after` bits behind bit `first` of `words`. Bits beyond
    /// the end are dark. `after` must ascend, and the words must have at most 65 535 marks in all.
    pub fn most(&self, words: &[u64], first: u32, after: &[u32]) -> u32 {
        let mut counts = Counts::<NARROW>::default();
        counts.count(words, first, &self.ticks, after);
        counts.highest([u64::MAX; NARROW]).map_or(0, |(_, count)| count)
    }

    /// Counts the lit marks of one word per entry of `after`, which begins this number of bits behind bit
    /// `first` of `words`. The counts replace those in `found`. Bits beyond the end are dark.
    pub fn found_in_each(&self, words: &[u64], first: u32, after: &[u32], found: &mut Vec<u32>) {
        found.clear();
        found.resize(after.len(), 0);
        kernels::lit_in_each(words, first as usize, after, &self.pattern, found);
    }
}
