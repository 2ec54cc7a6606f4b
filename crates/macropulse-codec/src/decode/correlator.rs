//! The peak among the lags of a block.

use std::ops::Range;

use crate::kernels::{BLOCK_WORDS, Block, Marks, PLANES, count_marks};

/// Lags that are counted at once.
pub(super) const BLOCK: i64 = 64 * BLOCK_WORDS as i64;

/// Where most marks fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Peak {
    /// The place, in ticks from where the search began.
    pub at: i64,
    /// Marks that fit there.
    pub count: u16,
    /// Marks that fit at the best other place, the peak's own plateau apart.
    pub next: u16,
}

/// The counts of a block of lags, in bit planes.
#[derive(Debug, Default)]
pub(super) struct Counts {
    planes: [Block; PLANES],
    /// Planes that can be lit at all.
    used: usize,
}

impl Counts {
    /// Counts, for each of [`BLOCK`] places from bit `first` of `words` on, how many of the `marks`
    /// are lit.
    pub fn count(&mut self, words: &[u64], first: usize, marks: Marks) {
        self.used = marks.planes();
        count_marks(words, first, marks, &mut self.planes);
    }

    /// The highest count among the places of `allowed`, as offsets into the block, and the first
    /// place that has it; and the best one farther than `plateau` ticks from it.
    pub fn peak(&self, allowed: Range<i64>, plateau: i64) -> Option<Peak> {
        let allowed = between(allowed);
        let (at, count) = self.highest(allowed)?;
        let own = between(at - plateau..at + plateau + 1);
        let others = std::array::from_fn(|lane| allowed[lane] & !own[lane]);
        let next = self.highest(others).map_or(0, |(_, count)| count);
        Some(Peak { at, count, next })
    }

    fn highest(&self, mut places: Block) -> Option<(i64, u16)> {
        if is_dark(&places) {
            return None;
        }
        let mut count = 0;
        for (weight, plane) in self.planes[..self.used].iter().enumerate().rev() {
            let lit: Block = std::array::from_fn(|lane| places[lane] & plane[lane]);
            if !is_dark(&lit) {
                places = lit;
                count |= 1 << weight;
            }
        }
        let lane = places.iter().position(|&lane| lane != 0)?;
        Some((64 * lane as i64 + i64::from(places[lane].trailing_zeros()), count))
    }
}

fn is_dark(lanes: &Block) -> bool {
    lanes.iter().fold(0, |any, lane| any | lane) == 0
}

/// The offsets of `range` that lie in a block, one bit each.
fn between(range: Range<i64>) -> Block {
    std::array::from_fn(|lane| {
        let below = |end: i64| match (end - 64 * lane as i64).clamp(0, 64) {
            64 => u64::MAX,
            bits => (1 << bits) - 1,
        };
        below(range.end) & !below(range.start)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};
    use std::collections::BTreeSet;

    fn words(lit: impl Iterator<Item = usize>) -> Vec<u64> {
        let mut words = vec![0; 200];
        lit.for_each(|bit| words[bit / 64] |= 1 << (bit % 64));
        words
    }

    #[test]
    fn the_peak_is_the_highest_of_all_counts() {
        let mut chance = ChaCha8Rng::seed_from_u64(1);
        for marks in [0, 1, 7, 8, 9, 63, 64, 180, 319] {
            let lit: Vec<usize> =
                (0..3000).map(|_| (chance.next_u32() % 12_000) as usize).collect();
            let words = words(lit.iter().copied());
            let marks = (0..marks).map(|_| (chance.next_u32() % 10_000) as u16);
            let marks: Vec<u16> = marks.collect::<BTreeSet<u16>>().into_iter().collect();
            for first in [0, 41, 1000, 11_900, 20_000] {
                let counts: Vec<usize> = (first..first + BLOCK as usize)
                    .map(|at| {
                        marks
                            .iter()
                            .filter(|&&mark| lit.contains(&(at + usize::from(mark))))
                            .count()
                    })
                    .collect();
                let highest = counts.iter().copied().max().unwrap();
                let at = counts.iter().position(|&count| count == highest).unwrap();
                let others = counts.iter().enumerate().filter(|(other, _)| other.abs_diff(at) > 3);
                let next = others.map(|(_, &count)| count).max().unwrap() as u16;
                let expected = Peak { at: at as i64, count: highest as u16, next };
                let mut found = Counts::default();
                found.count(&words, first, Marks { word: &marks, bits: &[0], scale: 1 });
                assert_eq!(found.peak(0..BLOCK, 3), Some(expected));
            }
        }
    }

    #[test]
    fn places_that_are_not_allowed_are_not_found() {
        let one = Marks { word: &[0], bits: &[0], scale: 1 };
        let mut counts = Counts::default();
        counts.count(&words([100, 300].into_iter()), 0, one);
        let expected = Peak { at: 300, count: 1, next: 0 };
        assert_eq!(counts.peak(101..BLOCK, 0), Some(expected));
        assert_eq!(counts.peak(7..7, 0), None);
        assert_eq!(counts.peak(600..700, 0), None);
    }
}
