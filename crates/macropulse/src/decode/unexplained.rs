//! The ticks nobody has explained yet.

use std::ops::Range;

/// Ticks that are counted together where a rough place is enough.
const CHUNK: i64 = 1 << CHUNK_BITS;
const CHUNK_BITS: u32 = 10;

/// Machine words of a chunk.
const WORDS: usize = CHUNK as usize / 64;

/// The unexplained ticks, one bit each, and how many there are in each [`CHUNK`].
#[derive(Debug)]
pub(super) struct Unexplained {
    /// Tick of the first bit.
    origin: i64,
    /// Only to be looked at in chunks that have had ticks.
    words: Vec<u64>,
    per_chunk: Vec<u32>,
}

impl Unexplained {
    /// Those of `ticks` that lie in `span`, in the memory `words`, whatever is in it.
    pub fn new(ticks: &[u32], span: Range<i64>, mut words: Vec<u64>) -> Self {
        let chunks = ((span.end - span.start).max(0) / CHUNK + 1) as usize;
        words.resize(words.len().max(chunks * WORDS), 0);
        let (origin, mut per_chunk) = (span.start, vec![0; chunks]);
        for &tick in ticks {
            let bit = (i64::from(tick) - origin) as u64;
            let chunk = (bit >> CHUNK_BITS) as usize;
            let Some(lit) = per_chunk.get_mut(chunk) else { continue };
            if *lit == 0 {
                words[chunk * WORDS..][..WORDS].fill(0);
            }
            *lit += 1;
            words[(bit >> 6) as usize] |= 1 << (bit & 63);
        }
        Self { origin, words, per_chunk }
    }

    /// Gives its memory back.
    pub fn into_words(self) -> Vec<u64> {
        self.words
    }

    /// Explains the ticks at each of `places`, and the `width` − 1 behind it.
    pub fn explain(&mut self, places: impl Iterator<Item = i64>, width: u32) {
        for place in places {
            for (word, mask) in self.masks(place, width) {
                let Some(lit) = self.per_chunk.get_mut(word / WORDS) else { continue };
                if *lit > 0 {
                    *lit -= (self.words[word] & mask).count_ones();
                    self.words[word] &= !mask;
                }
            }
        }
    }

    /// At how many of `places`, or of the `width` − 1 ticks behind it, a tick is unexplained.
    pub fn count(&self, places: impl Iterator<Item = i64>, width: u32) -> u16 {
        places.filter(|&place| self.any(place, width)).count() as u16
    }

    /// Whether the tick at `place`, or one of the `width` − 1 behind it, is unexplained.
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

    /// Calls `on_tick` with each unexplained tick of `span`, in order.
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
    fn explained_ticks_are_no_longer_counted() {
        let lit: Vec<u32> = (0..10_000).step_by(10).collect();
        let mut unexplained = Unexplained::new(&lit, 0..10_240, vec![u64::MAX; 500]);
        assert_eq!(unexplained.at_most(0..10_240), 1000);
        unexplained.explain(0..5120, 1);
        unexplained.explain((0..5120).step_by(3), 3);
        // The last three end at 5121.
        assert_eq!(unexplained.at_most(0..5120), 0);
        assert_eq!(unexplained.at_most(5121..10_240), 487);
        // Four chunks hold any 2048 ticks.
        assert!((205..=410).contains(&unexplained.densest(0..10_240, 2048)));
        assert!(!unexplained.any(5110, 10));
        assert!(unexplained.any(5110, 21));
        let mut left = Vec::new();
        unexplained.for_each(5000..5200, |tick| left.push(tick));
        assert_eq!(left, [5130, 5140, 5150, 5160, 5170, 5180, 5190]);
    }
}
