//! Bits that are set together, wherever they begin.

use crate::on_every_level;

/// Machine words that are shifted side by side.
const LANES: usize = 8;

/// Bits of a row, as long as whole blocks of words are, one dark word in front.
#[derive(Debug, Clone)]
pub(crate) struct Pattern {
    words: Vec<u64>,
    /// Blocks that hold its bits where it begins with a word.
    blocks: usize,
}

impl Pattern {
    /// The pattern with the given `bits`, each of them `width` bits long.
    pub(crate) fn new(bits: impl Iterator<Item = usize>, width: usize) -> Self {
        let mut words = vec![0];
        for bit in bits.flat_map(|bit| bit..bit + width) {
            let word = 1 + bit / 64;
            words.resize(words.len().max(word + 1), 0);
            words[word] |= 1 << (bit % 64);
        }
        let blocks = (words.len() - 1).div_ceil(LANES);
        // Bits that are shifted out of the last word go into one more.
        words.resize(1 + words.len().div_ceil(LANES) * LANES, 0);
        Self { words, blocks }
    }

    /// The blocks that hold its bits where it begins with a word.
    fn own(&self) -> &[[u64; LANES]] {
        let (blocks, _) = self.words[1..].as_chunks();
        &blocks[..self.blocks]
    }

    /// Words that have bits of the pattern, wherever in the first one of them it begins.
    pub(crate) fn reach(&self) -> usize {
        self.words.len() - 1
    }
}

on_every_level! {
    /// Counts the bits of `pattern` that are lit in `words` at each of its beginnings, which are `after` bits
    /// behind bit `first`, modulo 2⁶⁴. Bits beyond the end are dark.
    pub(crate) fn lit_in_each(
        words: &[u64],
        first: usize,
        after: &[u32],
        pattern: &Pattern,
        counts: &mut [u32],
    ) {
        for (count, after) in counts.iter_mut().zip(after) {
            let mut sums = [0; LANES];
            add_lit(&mut sums, words, first.wrapping_add(*after as usize), pattern);
            *count = sums.iter().sum::<u64>() as u32;
        }
    }
}

on_every_level! {
    /// The sum of what [`lit_in_each`] counts.
    pub(crate) fn lit_in_all(
        words: &[u64],
        first: usize,
        after: &[u32],
        pattern: &Pattern,
    ) -> u32 {
        let mut sums = [0; LANES];
        for after in after {
            add_lit(&mut sums, words, first + *after as usize, pattern);
        }
        sums.iter().sum::<u64>() as u32
    }
}

/// Bits that are summed up together: three planes hold their sum.
const SUMMED: usize = 7;

on_every_level! {
    /// Counts as [`lit_in_all`] does, for `pattern` begun at bit `first`, at the next bit, and so on: one
    /// number for each of the `counts`, fewer than 64.
    ///
    /// Lit bits are summed up once, as bit planes, and the pattern is moved along the sums.
    pub(crate) fn lit_in_row(
        words: &[u64],
        first: usize,
        after: &[u32],
        pattern: &Pattern,
        counts: &mut [u32],
    ) {
        counts.fill(0);
        for after in after.chunks(SUMMED) {
            for block in (0..pattern.reach()).step_by(LANES) {
                let mut planes = [[0; LANES]; 3];
                for after in after {
                    let (begin, shift) = parts(first + *after as usize);
                    let mut carried = begun(words, begin + block, shift);
                    for plane in &mut planes {
                        for lane in 0..LANES {
                            let both = plane[lane] & carried[lane];
                            plane[lane] ^= carried[lane];
                            carried[lane] = both;
                        }
                    }
                }
                for (place, count) in counts.iter_mut().enumerate() {
                    let mask = shifted(&pattern.words[block..], place);
                    let mut sums = [0; LANES];
                    for (weight, plane) in planes.iter().enumerate() {
                        for lane in 0..LANES {
                            sums[lane] += u64::from((plane[lane] & mask[lane]).count_ones()) << weight;
                        }
                    }
                    *count += sums.iter().sum::<u64>() as u32;
                }
            }
        }
    }
}

on_every_level! {
    /// Counts the bits of `pattern` that are lit in `words` at any of its beginnings, which are `after` bits
    /// behind bit `first`, modulo 2⁶⁴. Bits beyond the end are dark.
    pub(crate) fn lit_in_any(words: &[u64], first: usize, after: &[u32], pattern: &Pattern) -> u32 {
        let mut sums = [0; LANES];
        for (block, mask) in pattern.own().iter().enumerate() {
            let mut any = [0; LANES];
            for after in after {
                let (begin, shift) = parts(first.wrapping_add(*after as usize));
                let lit = begun(words, begin + block * LANES, shift);
                for lane in 0..LANES {
                    any[lane] |= lit[lane];
                }
            }
            for lane in 0..LANES {
                sums[lane] += u64::from((any[lane] & mask[lane]).count_ones());
            }
        }
        sums.iter().sum::<u64>() as u32
    }
}

/// Adds to `sums` how many bits of `pattern`, begun at bit `first`, are lit in `words`, by their place
/// in a block.
#[inline(always)]
fn add_lit(sums: &mut [u64; LANES], words: &[u64], first: usize, pattern: &Pattern) {
    let (begin, shift) = parts(first);
    for (block, mask) in pattern.own().iter().enumerate() {
        let words = begun(words, begin + block * LANES, shift);
        for lane in 0..LANES {
            sums[lane] += u64::from((words[lane] & mask[lane]).count_ones());
        }
    }
}

/// A block of `words` from bit `shift` of word `first` on, dark beyond their end.
#[inline(always)]
fn begun(words: &[u64], first: usize, shift: usize) -> [u64; LANES] {
    let words = words.get(first..).unwrap_or_default();
    let last;
    let words = match words.first_chunk::<{ LANES + 1 }>() {
        Some(words) => words,
        None => {
            last = at_end(words);
            &last
        }
    };
    let mut lanes = [0; LANES];
    for lane in 0..LANES {
        // Two shifts, because a shift by 64 does not give 0.
        lanes[lane] = words[lane] >> shift | words[lane + 1] << 1 << (63 ^ shift);
    }
    lanes
}

/// The last `words`, and dark ones.
#[cold]
fn at_end(words: &[u64]) -> [u64; LANES + 1] {
    let mut last = [0; LANES + 1];
    last[..words.len()].copy_from_slice(words);
    last
}

/// The word that `bit` is in, and its place there.
#[inline(always)]
fn parts(bit: usize) -> (usize, usize) {
    (bit / 64, bit % 64)
}

/// Counts the bits of `pattern`, begun at bit `first`, that are lit in `words`. Bits beyond the end are dark.
pub(crate) fn lit_in(words: &[u64], first: usize, pattern: &Pattern) -> u32 {
    lit_in_all(words, first, &[0], pattern)
}

on_every_level! {
    /// True if all bits of `pattern` are lit in `words` at all of its beginnings, which are `after` bits
    /// behind bit `first`, modulo 2⁶⁴. Bits beyond the end are dark.
    pub(crate) fn are_lit(words: &[u64], first: usize, after: &[u32], pattern: &Pattern) -> bool {
        // A closure would not be compiled for the level.
        for after in after {
            let (begin, shift) = parts(first.wrapping_add(*after as usize));
            let mut dark = 0;
            for (block, mask) in pattern.own().iter().enumerate() {
                let words = begun(words, begin + block * LANES, shift);
                for lane in 0..LANES {
                    dark |= mask[lane] & !words[lane];
                }
            }
            if dark != 0 {
                return false;
            }
        }
        true
    }
}

on_every_level! {
    /// Puts out the bits of `pattern` in `words` at all of its beginnings, which are `after` bits behind bit
    /// `first`, modulo 2⁶⁴. Bits beyond the end are left away.
    pub(crate) fn put_out(words: &mut [u64], first: usize, after: &[u32], pattern: &Pattern) {
        for after in after {
            under(words, first.wrapping_add(*after as usize), pattern, |word, mask| *word &= !mask);
        }
    }
}

on_every_level! {
    /// Lights the bits in `words` that [`put_out`] puts out.
    pub(crate) fn light_up(words: &mut [u64], first: usize, after: &[u32], pattern: &Pattern) {
        for after in after {
            under(words, first.wrapping_add(*after as usize), pattern, |word, mask| *word |= mask);
        }
    }
}

/// Does `to_word` with each of the `words` under `pattern`, begun at bit `first`, and its bits.
#[inline(always)]
fn under(words: &mut [u64], first: usize, pattern: &Pattern, to_word: impl Fn(&mut u64, u64)) {
    let (begin, shift) = parts(first);
    for block in (0..pattern.reach()).step_by(LANES) {
        let mask = shifted(&pattern.words[block..], shift);
        let words = words.get_mut(begin + block..).unwrap_or_default();
        match words.first_chunk_mut::<LANES>() {
            Some(words) => {
                for lane in 0..LANES {
                    to_word(&mut words[lane], mask[lane]);
                }
            }
            None => words.iter_mut().zip(mask).for_each(|(word, mask)| to_word(word, mask)),
        }
    }
}

on_every_level! {
    /// Copies `words` to `ahead`, which has their length, and lights the `reach` bits before each lit one,
    /// too.
    pub(crate) fn look_ahead(words: &[u64], ahead: &mut [u64], reach: usize) {
        let Some((last, before)) = ahead.split_last_mut().filter(|_| reach > 0) else {
            ahead.copy_from_slice(words);
            return;
        };
        for (ahead, pair) in before.iter_mut().zip(words.windows(2)) {
            *ahead = pair[0] | pair[0] >> 1 | pair[1] << 63;
        }
        *last = words.last().map_or(0, |word| word | word >> 1);
        // Each round looks as far ahead again as all rounds before it.
        let (words, mut reached) = (ahead, 1);
        while reached < reach {
            let step = (reached + 1).min(reach - reached);
            let (skip, shift) = (step / 64, step % 64);
            for word in 0..words.len().saturating_sub(skip + 1) {
                let (here, next) = (words[word + skip], words[word + skip + 1]);
                words[word] |= here >> shift | next << 1 << (63 ^ shift);
            }
            if let Some(word) = words.len().checked_sub(skip + 1) {
                words[word] |= words[word + skip] >> shift;
            }
            reached += step;
        }
    }
}

/// The block of words behind the first one of `pattern`, `shift` bits later.
#[inline(always)]
fn shifted(pattern: &[u64], shift: usize) -> [u64; LANES] {
    let mut lanes = [0; LANES];
    let Some(words) = pattern.first_chunk::<{ LANES + 1 }>() else { return lanes };
    for lane in 0..LANES {
        // Two shifts, because a shift by 64 does not give 0.
        lanes[lane] = words[lane + 1] << shift | words[lane] >> 1 >> (63 ^ shift);
    }
    lanes
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn every_level_looks_ahead(
            lit in proptest::collection::btree_set(0..640_usize, 0..20),
            reach in 0..200_usize,
        ) {
            let lit_at = |places: &mut dyn Iterator<Item = usize>| {
                let mut words = vec![0_u64; 10];
                places.for_each(|bit| words[bit / 64] |= 1 << (bit % 64));
                words
            };
            let before = |bit: &usize| bit.saturating_sub(reach)..=*bit;
            let expected = lit_at(&mut lit.iter().flat_map(before));
            let seen = at_each_level(|| {
                let mut ahead = vec![7; 10];
                look_ahead(&lit_at(&mut lit.iter().copied()), &mut ahead, reach);
                ahead
            });
            for (level, words) in seen {
                prop_assert_eq!(&words, &expected, "{:?}", level);
            }
        }

        #[test]
        fn every_level_counts_puts_out_and_lights_the_bits_of_a_pattern(
            bits in proptest::collection::btree_set(0..900_usize, 0..40),
            width in 1..5_usize,
            lit in proptest::collection::btree_set(0..1500_usize, 0..600),
            first in 0..1600_usize,
        ) {
            let pattern = Pattern::new(bits.iter().copied(), width);
            let within: BTreeSet<usize> = bits.iter().flat_map(|b| first + b..first + b + width).collect();
            let pattern_bits = within.len() as u32;
            let mut words = vec![0_u64; 1500_usize.div_ceil(64)];
            lit.iter().for_each(|bit| words[bit / 64] |= 1 << (bit % 64));
            let count = lit.intersection(&within).count() as u32;
            let mut left = vec![0_u64; words.len()];
            lit.difference(&within).for_each(|bit| left[bit / 64] |= 1 << (bit % 64));
            for (level, found) in at_each_level(|| lit_in(&words, first, &pattern)) {
                prop_assert_eq!(found, count, "{:?}", level);
            }
            let after = [0, 70, 700];
            let each = at_each_level(|| {
                let mut counts = [0; 3];
                lit_in_each(&words, first, &after, &pattern, &mut counts);
                (counts, lit_in_all(&words, first, &after, &pattern))
            });
            let begins = after.map(|after| first + after as usize);
            let is_lit = |bit: &&usize| {
                begins.iter().any(|begin| lit.contains(&(begin + **bit)))
            };
            let of_pattern: BTreeSet<usize> = bits.iter().flat_map(|b| *b..b + width).collect();
            let expected = of_pattern.iter().filter(is_lit).count() as u32;
            for (level, any) in at_each_level(|| lit_in_any(&words, first, &after, &pattern)) {
                prop_assert_eq!(any, expected, "{:?}", level);
            }
            let mut full = words.clone();
            light_up(&mut full, first, &after, &pattern);
            let is_all = first + 700 + bits.last().map_or(0, |last| last + width) <= 64 * words.len();
            for words in [&words, &full] {
                let expected = after.iter().map(|after| {
                    lit_in(words, first + *after as usize, &pattern)
                });
                let expected = expected.sum::<u32>() == 3 * pattern_bits;
                for (level, all) in at_each_level(|| are_lit(words, first, &after, &pattern)) {
                    prop_assert_eq!(all, expected, "{:?}", level);
                }
            }
            prop_assert!(!is_all || are_lit(&full, first, &after, &pattern));
            let row = at_each_level(|| {
                let mut counts = [7; 40];
                lit_in_row(&words, first, &[0, 70, 70, 71, 72, 130, 131, 700], &pattern, &mut counts);
                counts
            });
            for (level, counts) in row {
                for (place, count) in counts.into_iter().enumerate() {
                    let after = [0, 70, 70, 71, 72, 130, 131, 700];
                    let expected = lit_in_all(&words, first + place, &after, &pattern);
                    prop_assert_eq!(count, expected, "{:?}, {}", level, place);
                }
            }
            for (level, (counts, all)) in each {
                let one_by_one = after.map(|after| lit_in(&words, first + after as usize, &pattern));
                prop_assert_eq!(counts, one_by_one, "{:?}", level);
                prop_assert_eq!(all, one_by_one.iter().sum::<u32>(), "{:?}", level);
            }
            let put_out = at_each_level(|| {
                let mut rest = words.clone();
                put_out(&mut rest, first, &[0], &pattern);
                let mut without = words.clone();
                put_out(&mut without, first, &after, &pattern);
                let mut in_turn = words.clone();
                after.iter().for_each(|after| put_out(&mut in_turn, first + *after as usize, &[0], &pattern));
                assert_eq!(without, in_turn);
                rest
            });
            let mut more = words.clone();
            within.iter().for_each(|bit| {
                if let Some(word) = more.get_mut(bit / 64) {
                    *word |= 1 << (bit % 64);
                }
            });
            let lit_up = at_each_level(|| {
                let mut more = words.clone();
                light_up(&mut more, first, &[0], &pattern);
                more
            });
            for ((level, rest), (_, all)) in put_out.into_iter().zip(lit_up) {
                prop_assert_eq!(&rest, &left, "{:?}", level);
                prop_assert_eq!(&all, &more, "{:?}", level);
            }
        }
    }
}
