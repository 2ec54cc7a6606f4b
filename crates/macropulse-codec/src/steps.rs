//! Some steps of the matched receiver by themselves, for who wants to time or to study them.

use crate::kernels::{self, Counts, NARROW, Pattern, WordTicks};

/// Lags at which [`WordMarks::most`] counts.
pub const LAGS: usize = 64 * NARROW;

/// Lights, in `words`, of which the first bit is tick `origin`, those of the ascending `ticks` that they have
/// room for, and tells how many these are. None may be before the origin.
pub fn lay(words: &mut [u64], origin: i64, ticks: &[u32]) -> usize {
    let end = origin + 64 * words.len() as i64;
    kernels::lay(words, origin, ticks, end)
}

/// Whether each of `ticks` is later than the one before it.
pub fn ascends(ticks: &[u32]) -> bool {
    kernels::ascends(ticks)
}

/// Lights, in `lit`, the places at which a mark counts as found by one of the lit bits of `words`, as many:
/// each of these and the `width` − 1 places before it. Width is 1 or more.
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
    /// Of a word with the ascending `marks`, chips from its beginning on, with `scale` bits to a chip.
    pub fn new(marks: &[u16], scale: u32) -> Self {
        let ticks = WordTicks::new(marks, scale);
        let pattern = Pattern::new(ticks.ticks().iter().map(|mark| *mark as usize), 1);
        Self { pattern, ticks }
    }

    /// The most marks that are lit in `words` where the word begins so many bits `after` bit `first`, for all of these
    /// together, or up to [`LAGS`] − 1 bits later. Bits beyond the end are dark. What is `after` it ascends, and there
    /// are at most 65 535 marks in all.
    pub fn most(&self, words: &[u64], first: u32, after: &[u32]) -> u32 {
        let mut counts = Counts::<NARROW>::default();
        counts.count(words, first, &self.ticks, after);
        counts.highest([u64::MAX; NARROW]).map_or(0, |(_, count)| count)
    }

    /// Puts into `found` how many of the marks are lit in `words` where the word begins so many bits `after` bit
    /// `first`, for each of these. Bits beyond the end are dark.
    pub fn found_in_each(&self, words: &[u64], first: u32, after: &[u32], found: &mut Vec<u32>) {
        found.clear();
        found.resize(after.len(), 0);
        kernels::lit_in_each(words, first as usize, after, &self.pattern, found);
    }
}
