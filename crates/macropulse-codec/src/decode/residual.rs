//! The residual: the ticks that are left when those of the macropulses found so far are cancelled.

use std::ops::Range;

use super::field::{CELL, MARGIN};
use crate::kernels::{Pattern, look_ahead, lowest_and_highest_run, put_out};

/// Ticks that are counted together where a rough place is enough.
const CHUNK: i64 = CELL;

/// Machine words of a chunk.
const WORDS: usize = CHUNK as usize / 64;

/// The residual ticks, one bit each, and how many there are in each [`CHUNK`].
#[derive(Debug)]
pub(super) struct Residual {
    /// Tick of the first bit.
    origin: i64,
    /// Only to be looked at in chunks that have had ticks.
    words: Vec<u64>,
    per_chunk: Vec<u32>,
    /// Memory for the ticks of some words.
    were_lit: Vec<u8>,
}

impl Residual {
    /// Those of `ticks` that lie in `span`, in the memory `words`, whatever is in it.
    pub fn new(ticks: &[u32], span: Range<i64>, mut words: Vec<u64>) -> Self {
        let chunks = ((2 * MARGIN + span.end - span.start).max(0) / CHUNK + 1) as usize;
        words.resize(words.len().max(chunks * WORDS), 0);
        let (origin, mut per_chunk) = (span.start - MARGIN, Vec::with_capacity(chunks));
        let mut rest = &ticks[ticks.partition_point(|&tick| i64::from(tick) < origin)..];
        for (chunk, words) in words.chunks_exact_mut(WORDS).enumerate().take(chunks) {
            let start = origin + CHUNK * chunk as i64;
            let lit = rest.iter().take_while(|&&tick| i64::from(tick) < start + CHUNK).count();
            if lit > 0 {
                words.fill(0);
            }
            for &tick in &rest[..lit] {
                let bit = (i64::from(tick) - start) as usize % CHUNK as usize;
                words[bit / 64] |= 1 << (bit % 64);
            }
            per_chunk.push(lit as u32);
            rest = &rest[lit..];
        }
        Self { origin, words, per_chunk, were_lit: Vec::new() }
    }

    /// As many as there are in each chunk, from [`MARGIN`] before `start` on, of which nothing is
    /// known but their number yet, in the memory `words`, whatever is in it.
    pub fn counted(per_chunk: Vec<u32>, start: i64, mut words: Vec<u64>) -> Self {
        words.resize(words.len().max(per_chunk.len() * WORDS), 0);
        Self { origin: start - MARGIN, words, per_chunk, were_lit: Vec::new() }
    }

    /// Makes known which ticks there are, from machine word `first` on.
    pub fn learn(&mut self, first: usize, ticks: &[u64]) {
        self.words[first..first + ticks.len()].copy_from_slice(ticks);
    }

    /// Gives its memory back.
    pub fn into_words(self) -> Vec<u64> {
        self.words
    }

    /// Cancels the ticks of `pattern`, begun at each of `starts`.
    pub fn cancel(&mut self, starts: impl Iterator<Item = i64>, pattern: &Pattern) {
        self.were_lit.resize(pattern.reach(), 0);
        for start in starts {
            let Ok(first) = usize::try_from(start - self.origin) else { continue };
            put_out(&mut self.words, first, pattern, &mut self.were_lit);
            let mut word = first / 64;
            let mut rest = self.were_lit.as_slice();
            while let Some(lit) = self.per_chunk.get_mut(word / WORDS) {
                let (here, behind) = rest.split_at(rest.len().min(WORDS - word % WORDS));
                // The words of a chunk without ticks are anything.
                if *lit > 0 {
                    *lit -= here.iter().map(|&count| u32::from(count)).sum::<u32>();
                }
                if behind.is_empty() {
                    break;
                }
                (word, rest) = (word + here.len(), behind);
            }
        }
    }

    /// At how many of `places`, or of the `width` − 1 ticks behind it, a tick is left.
    pub fn count(&self, places: impl Iterator<Item = i64>, width: u32) -> u16 {
        places.filter(|&place| self.any(place, width)).count() as u16
    }

    /// Whether the tick at `place`, or one of the `width` − 1 behind it, is left.
    pub fn any(&self, place: i64, width: u32) -> bool {
        self.masks(place, width).any(|(word, mask)| {
            self.per_chunk.get(word / WORDS).is_some_and(|lit| *lit > 0)
                && self.words[word] & mask != 0
        })
    }

    /// The words in which the `width` ticks from `place` on lie, and their bits in each.
    fn masks(&self, place: i64, width: u32) -> impl Iterator<Item = (usize, u64)> + use<> {
        let first = place - self.origin;
        let end = first + i64::from(width);
        (first >> 6..=(end - 1) >> 6).map(move |word| {
            let from = (first - 64 * word).max(0);
            let to = (end - 64 * word).min(64);
            (word as usize, (u64::MAX >> (64 - (to - from))) << from)
        })
    }

    /// Puts into `lit` the places of `span` that are residual ticks, or up to `width` − 1 before
    /// one, and tells which bit of it is the first of them.
    pub fn lit(&self, span: Range<i64>, width: u32, lit: &mut Vec<u64>) -> usize {
        let chunks = self.chunk_of(span.start)..self.chunk_of(span.end + CHUNK - 1);
        lit.clear();
        for chunk in chunks.clone() {
            match self.per_chunk[chunk] {
                0 => lit.extend([0; WORDS]),
                _ => lit.extend(&self.words[chunk * WORDS..][..WORDS]),
            }
        }
        look_ahead(lit, width as usize - 1);
        (span.start - self.origin - CHUNK * chunks.start as i64) as usize
    }

    /// Calls `on_tick` with each residual tick of `span`, in order.
    pub fn for_each(&self, span: Range<i64>, mut on_tick: impl FnMut(i64)) {
        let mut chunk = self.chunk_of(span.start);
        while chunk < self.per_chunk.len() {
            let first = self.origin + CHUNK * chunk as i64;
            if first >= span.end {
                break;
            }
            let words = &self.words[chunk * WORDS..][..WORDS];
            for (index, &word) in words.iter().enumerate().filter(|_| self.per_chunk[chunk] > 0) {
                let mut lit = word;
                while lit != 0 {
                    let tick = first + 64 * index as i64 + i64::from(lit.trailing_zeros());
                    if span.contains(&tick) {
                        on_tick(tick);
                    }
                    lit &= lit - 1;
                }
            }
            chunk += 1;
        }
    }

    fn chunk_of(&self, tick: i64) -> usize {
        (tick - self.origin).div_euclid(CHUNK).clamp(0, self.per_chunk.len() as i64) as usize
    }

    /// The chunks that touch `span`.
    fn chunks(&self, span: Range<i64>) -> &[u32] {
        let from = self.chunk_of(span.start);
        &self.per_chunk[from..self.chunk_of(span.end + CHUNK - 1).max(from)]
    }

    /// No fewer than the ticks in `span`, not many more.
    pub fn at_most(&self, span: Range<i64>) -> u32 {
        self.chunks(span).iter().sum()
    }

    /// The ticks in `span`, to be counted in runs.
    pub fn runs(&self, span: Range<i64>) -> Runs {
        let first = self.origin + CHUNK * self.chunk_of(span.start) as i64;
        let chunks = self.chunks(span);
        let mut sum = 0;
        let mut before = Vec::with_capacity(chunks.len() + 1);
        before.push(0);
        before.extend(chunks.iter().map(|lit| {
            sum += lit;
            sum
        }));
        Runs { first, before }
    }
}

/// How many ticks there are before each chunk, and before the end.
#[derive(Debug)]
pub(super) struct Runs {
    /// The first tick that is counted.
    first: i64,
    before: Vec<u32>,
}

impl Runs {
    /// No fewer than there are in all, not many more.
    pub fn at_most(&self) -> u32 {
        self.before.last().copied().unwrap_or(0)
    }

    /// No fewer than there are in `span`, not many more.
    pub fn at_most_in(&self, span: Range<i64>) -> u32 {
        let last = self.before.len() as i64 - 1;
        let from = ((span.start - self.first) / CHUNK).clamp(0, last);
        let to = ((span.end - self.first + CHUNK - 1) / CHUNK).clamp(from, last);
        self.before[to as usize] - self.before[from as usize]
    }

    /// For runs of `length` ticks, wherever they begin: about how many are in the emptiest, and no
    /// fewer than in the fullest.
    pub fn emptiest_and_fullest(&self, length: u32) -> (u32, u32) {
        lowest_and_highest_run(&self.before, (i64::from(length) / CHUNK + 2) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cancelled_ticks_are_no_longer_counted() {
        let lit: Vec<u32> = (0..10_000).step_by(10).collect();
        let mut residual = Residual::new(&lit, 0..10_240, vec![u64::MAX; 500]);
        assert_eq!(residual.at_most(0..10_240), 1000);
        residual.cancel([0, 2560].into_iter(), &Pattern::new((0..2560).step_by(3), 3));
        // The last three end at 5121.
        assert_eq!(residual.at_most(0..5120), 0);
        assert_eq!(residual.at_most(5121..10_240), 487);
        // Four chunks hold any 2048 ticks.
        let (emptiest, fullest) = residual.runs(0..10_240).emptiest_and_fullest(2048);
        assert!((205..=410).contains(&fullest) && emptiest == 0, "{emptiest} {fullest}");
        assert!(!residual.any(5110, 10));
        assert!(residual.any(5110, 21));
        let mut left = Vec::new();
        residual.for_each(5000..5200, |tick| left.push(tick));
        assert_eq!(left, [5130, 5140, 5150, 5160, 5170, 5180, 5190]);
    }
}
