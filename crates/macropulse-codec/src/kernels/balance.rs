//! Light on the marks of a macropulse less light on its dark chips.

use std::ops::Range;

use crate::on_every_level;

/// Places that are looked at side by side.
const LANES: usize = 64;

/// The chips of a macropulse, one bit each.
#[derive(Debug, Clone, Default)]
pub(crate) struct Chips {
    /// Dark ones, the first chip in the lowest bit.
    dark: Vec<u64>,
    /// All there are.
    all: Vec<u64>,
    /// Number of dark ones.
    darkness: u32,
}

impl Chips {
    /// Makes it `chips` long, lit at `marks`.
    pub(crate) fn set(&mut self, chips: usize, marks: &[u16]) {
        self.all.clear();
        self.all.resize(chips / 64, u64::MAX);
        if !chips.is_multiple_of(64) {
            self.all.push((1 << (chips % 64)) - 1);
        }
        self.dark.clone_from(&self.all);
        for &mark in marks {
            self.dark[usize::from(mark) / 64] &= !(1 << (mark % 64));
        }
        self.darkness = self.dark.iter().map(|word| word.count_ones()).sum();
    }

    /// Machine words that a macropulse may touch, wherever it begins in the first one.
    pub(crate) fn reach(&self) -> usize {
        self.all.len() + 1
    }
}

/// Lit marks and lit dark chips of a macropulse at one place.
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
    /// Returns the one of the `places` with the highest score, at which a macropulse of these `chips` may
    /// begin in `words`; the earliest of several. `None` if none has `least`. Bits beyond the end are dark.
    pub(crate) fn best_balance(
        words: &[u64],
        places: Range<usize>,
        chips: &Chips,
        least: i32,
    ) -> Option<Balance> {
        // Marks that are lit and dark chips that are not: the score, and all dark chips.
        let darkness = chips.darkness as i32;
        let mut wanted = i64::from(least) + i64::from(darkness);
        let mut best = None;
        for begin in places.start / LANES..places.end.div_ceil(LANES) {
            let at = |word: usize| words.get(begin + word).copied().unwrap_or(0);
            let (mut agreed, mut next) = ([0_u64; LANES], at(0));
            for (word, (dark, all)) in chips.dark.iter().zip(&chips.all).enumerate() {
                let here = next;
                next = at(word + 1);
                for lane in 0..LANES {
                    // Two shifts, because a shift by 64 does not give 0.
                    let seen = here >> lane | next << 1 << (63 ^ lane);
                    agreed[lane] += u64::from(((seen ^ dark) & all).count_ones());
                }
            }
            let mut highest = 0;
            for lane in 0..LANES {
                highest = highest.max(agreed[lane]);
            }
            if (highest as i64) < wanted {
                continue;
            }
            for (place, &agreed) in (LANES * begin..).zip(&agreed) {
                if places.contains(&place) && agreed as i64 >= wanted {
                    wanted = agreed as i64 + 1;
                    best = Some((place, agreed as i32 - darkness));
                }
            }
        }
        best.map(|(place, score)| {
            let stray = lit_in(words, place, &chips.dark);
            Balance { place, found: (score + stray as i32) as u32, stray }
        })
    }
}

/// How many bits of `pattern`, begun at bit `first`, are lit in `words`.
#[inline(always)]
fn lit_in(words: &[u64], first: usize, pattern: &[u64]) -> u32 {
    let (begin, shift) = (first / 64, first % 64);
    let at = |word: usize| words.get(begin + word).copied().unwrap_or(0);
    let seen = |word: usize| at(word) >> shift | at(word + 1) << 1 << (63 ^ shift);
    (0..).zip(pattern).map(|(word, pattern)| (seen(word) & pattern).count_ones()).sum()
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
