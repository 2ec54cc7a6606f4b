//! What falls on the marks of a macropulse less what falls on its dark chips.

use std::ops::Range;

use super::level::on_every_level;

/// The chips of a macropulse, one bit each.
#[derive(Debug, Clone, Default)]
pub(crate) struct Chips {
    /// Lit ones, the first chip in the lowest bit.
    marks: Vec<u64>,
    /// All there are.
    all: Vec<u64>,
}

impl Chips {
    /// Makes it `chips` long, lit at `marks`.
    pub(crate) fn set(&mut self, chips: usize, marks: &[u16]) {
        self.marks.clear();
        self.marks.resize(chips.div_ceil(64), 0);
        for &mark in marks {
            self.marks[usize::from(mark) / 64] |= 1 << (mark % 64);
        }
        self.all.clear();
        self.all.resize(chips / 64, u64::MAX);
        if !chips.is_multiple_of(64) {
            self.all.push((1 << (chips % 64)) - 1);
        }
    }

    /// Machine words that a macropulse may touch, wherever it begins.
    pub(crate) fn reach(&self) -> usize {
        self.all.len() + 1
    }
}

/// What is lit at one place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Balance {
    /// The place, a bit.
    pub place: usize,
    /// Marks that are lit.
    pub found: u32,
    /// Dark chips that are lit.
    pub stray: u32,
}

impl Balance {
    /// Lit marks less lit dark chips.
    pub(crate) fn score(self) -> i32 {
        self.found as i32 - self.stray as i32
    }
}

on_every_level! {
    /// Of the `places` at which a macropulse of these `chips` may begin in `words`, the one with
    /// the highest score, the earliest of several; `None` where none has `least`. What reaches
    /// beyond the end is dark.
    pub(crate) fn best_balance(
        words: &[u64],
        places: Range<usize>,
        chips: &Chips,
        least: i32,
    ) -> Option<Balance> {
        let mut wanted = least;
        let mut best = None;
        for place in places {
            let (begin, shift) = (place / 64, place % 64);
            let at = |word: usize| words.get(begin + word).copied().unwrap_or(0);
            let (mut found, mut lit, mut next) = (0, 0, at(0));
            for word in 0..chips.all.len() {
                let here = next;
                next = at(word + 1);
                // Two shifts, because a shift by 64 does not give 0.
                let seen = here >> shift | next << 1 << (63 ^ shift);
                found += (seen & chips.marks[word]).count_ones();
                lit += (seen & chips.all[word]).count_ones();
            }
            let score = 2 * found as i32 - lit as i32;
            if score >= wanted {
                best = Some(Balance { place, found, stray: lit - found });
                wanted = score + 1;
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_finds_the_earliest_highest_score(
            marks in proptest::collection::btree_set(0_u16..150, 0..80),
            lit in proptest::collection::btree_set(0_usize..640, 0..400),
            places in (0_usize..500, 0_usize..200),
            chips in 150_usize..200,
            least in -20_i32..20,
        ) {
            let mut words = vec![0_u64; 10];
            lit.iter().for_each(|bit| words[bit / 64] |= 1 << (bit % 64));
            let mut shape = Chips::default();
            shape.set(chips, &marks.iter().copied().collect::<Vec<_>>());
            let score = |place: usize| -> i32 {
                let seen = (0..chips).filter(|chip| lit.contains(&(place + chip)));
                seen.map(|chip| if marks.contains(&(chip as u16)) { 1 } else { -1 }).sum()
            };
            let range = places.0..places.0 + places.1;
            let highest = range.clone().rev().max_by_key(|&place| score(place));
            let expected = highest.filter(|&place| score(place) >= least);
            for (level, found) in at_each_level(|| best_balance(&words, range.clone(), &shape, least)) {
                prop_assert_eq!(found.map(|found| found.place), expected, "{:?}", level);
                if let Some(found) = found {
                    prop_assert_eq!(found.score(), score(found.place));
                }
            }
        }
    }
}
