//! The ticks of a band as the matched receiver looks at them: one bit each, so that sixty-four
//! places are looked at in one step, and counted.

use std::ops::Range;

/// Ticks that are turned into bits together, once somebody looks at one of them.
const CHUNK: i64 = 1 << 14;

/// Machine words of a chunk.
const WORDS: usize = CHUNK as usize / 64;

/// Dark ticks before the first and behind the last one, so that blocks may reach beyond a gate.
pub(super) const MARGIN: i64 = 4096;

/// A sorted list of ticks, as a field of bits: lit is where a mark counts as found, which is at
/// a tick and at the `width` − 1 places before it. Bits are made from the list chunk by chunk, as
/// they are needed: where everything is clear nobody asks for any.
#[derive(Debug)]
pub(super) struct Field<'a> {
    ticks: &'a [u32],
    width: usize,
    /// Tick of the first bit.
    origin: i64,
    words: Vec<u64>,
    made: Vec<bool>,
    /// Ticks before each chunk, and before the end.
    before: Vec<u32>,
}

impl<'a> Field<'a> {
    /// The field of `ticks` over `span`, in the memory `words`, whatever is in it.
    pub fn new(ticks: &'a [u32], width: u32, span: Range<i64>, mut words: Vec<u64>) -> Self {
        let origin = span.start - MARGIN;
        let chunks = ((span.end + MARGIN - origin).max(0) / CHUNK + 1) as usize;
        let mut before = Vec::with_capacity(chunks + 1);
        let mut passed = 0;
        for chunk in 0..=chunks as i64 {
            passed += ticks_before(&ticks[passed..], origin + CHUNK * chunk);
            before.push(passed as u32);
        }
        words.resize(words.len().max(chunks * WORDS), 0);
        Self { ticks, width: width as usize, origin, words, made: vec![false; chunks], before }
    }

    /// Makes sure that all bits of `span` are there.
    fn make(&mut self, span: Range<i64>) {
        let chunk = |tick: i64| ((tick - self.origin) / CHUNK).max(0) as usize;
        for chunk in chunk(span.start)..(chunk(span.end - 1) + 1).min(self.made.len()) {
            if !self.made[chunk] {
                self.make_chunk(chunk);
                self.made[chunk] = true;
            }
        }
    }

    fn make_chunk(&mut self, chunk: usize) {
        let start = self.origin + CHUNK * chunk as i64;
        let reach = self.width - 1;
        let mut bits = [0_u64; WORDS + 18];
        for &tick in &self.ticks[self.before[chunk] as usize..] {
            let bit = (i64::from(tick) - start) as usize;
            if bit >= CHUNK as usize + reach {
                break;
            }
            bits[bit / 64] |= 1 << (bit % 64);
        }
        // Each round looks as far ahead again as all rounds before it.
        let mut reached = 0;
        while reached < reach {
            let step = (reached + 1).min(reach - reached);
            let (words, shift) = (step / 64, step % 64);
            for word in 0..bits.len() - words {
                let next = bits.get(word + words + 1).copied().unwrap_or(0);
                bits[word] |= bits[word + words] >> shift | next << 1 << (63 - shift);
            }
            reached += step;
        }
        self.words[chunk * WORDS..][..WORDS].copy_from_slice(&bits[..WORDS]);
    }

    /// The words of the field and the bit at which `tick` lies in them, with all bits of the
    /// `length` ticks from there on.
    pub fn bits(&mut self, tick: i64, length: i64) -> (&[u64], usize) {
        // Blocks are read a word beyond their end.
        self.make(tick..tick + length + 64);
        (&self.words, (tick - self.origin).max(0) as usize)
    }

    /// Gives its memory back.
    pub fn into_words(self) -> Vec<u64> {
        self.words
    }

    /// Number of ticks in `span`.
    pub fn count(&self, span: Range<i64>) -> usize {
        self.before(span.end).saturating_sub(self.before(span.start))
    }

    fn before(&self, tick: i64) -> usize {
        let last = self.before.len() as i64 - 2;
        let chunk = ((tick - self.origin) / CHUNK).clamp(0, last) as usize;
        let within = self.before[chunk] as usize..self.before[chunk + 1] as usize;
        within.start + self.ticks[within].partition_point(|&other| i64::from(other) < tick)
    }

    /// The ticks in `span`.
    pub fn ticks(&self, span: Range<i64>) -> &'a [u32] {
        &self.ticks[self.before(span.start)..self.before(span.end)]
    }

    /// Share of lit places in `span`, were its ticks spread evenly.
    pub fn density(&self, span: Range<i64>) -> f64 {
        self.density_without(span, (0, 0))
    }

    /// Share of lit places in `span`, of which (ticks, places) are left out.
    pub fn density_without(&self, span: Range<i64>, own: (usize, usize)) -> f64 {
        let places = ((span.end - span.start) as usize).saturating_sub(own.1).max(1);
        let ticks = self.count(span).saturating_sub(own.0);
        (self.width as f64 * ticks as f64 / places as f64).min(1.0)
    }
}

/// How many of the sorted `ticks` lie before `end`, which is soon reached.
fn ticks_before(ticks: &[u32], end: i64) -> usize {
    let is_before = |tick: &u32| i64::from(*tick) < end;
    let mut reach = 64;
    while ticks.get(reach).is_some_and(is_before) {
        reach *= 2;
    }
    let reach = reach.min(ticks.len());
    ticks[..reach].partition_point(is_before)
}
