//! Ticks laid down as bits, and bits counted.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

use crate::on_every_level;

/// Ticks of a line of the cache, and how far ahead they are asked for: they were last read when their order
/// was checked, and no prefetcher foresees the next few hundred. Without it laying takes half as long again.
const LINE: usize = 16;
const AHEAD: usize = 512;

on_every_level! {
    /// Lights, in `words`, of which the first bit is tick `origin`, those of the sorted `ticks` that
    /// are before `end`, and tells how many these are. None may be before the origin; the words behind
    /// that of the first tick must be dark.
    pub(crate) fn lay(words: &mut [u64], origin: i64, ticks: &[u32], end: i64) -> usize {
        let Some(first) = ticks.first() else { return 0 };
        let until = (end - origin).clamp(0, 64 * words.len() as i64) as u64;
        // The word at hand stays in a register: nothing waits for what was stored.
        let mut at = ((i64::from(*first) - origin) >> 6) as usize;
        let mut bits = words.get(at).copied().unwrap_or(0);
        let mut laid = 0;
        for line in ticks.chunks(LINE) {
            // SAFETY: a hint, which reads nothing.
            #[cfg(target_arch = "x86_64")]
            unsafe {
                _mm_prefetch::<_MM_HINT_T0>(line.as_ptr().wrapping_add(AHEAD).cast());
            }
            for &tick in line {
                let bit = (i64::from(tick) - origin) as u64;
                if bit >= until {
                    return laid;
                }
                let word = (bit >> 6) as usize;
                let before = if word == at { bits } else { 0 };
                bits = before | 1 << (bit & 63);
                at = word;
                words[word] = bits;
                laid += 1;
            }
        }
        laid
    }
}

on_every_level! {
    /// Counts the lit bits of each `length` words.
    pub(crate) fn count_each(words: &[u64], length: usize, counts: &mut [u32]) {
        for (words, count) in words.chunks(length).zip(counts) {
            *count = words.iter().map(|word| u64::from(word.count_ones())).sum::<u64>() as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_lays_and_counts(
            ticks in proptest::collection::btree_set(2000..3000_u32, 0..300),
            again in proptest::collection::btree_set(3000..4000_u32, 0..30),
            origin in 1900..2000_i64,
            end in 2000..5000_i64,
        ) {
            let [ticks, again] = [ticks, again].map(|ticks| ticks.into_iter().collect::<Vec<u32>>());
            let mut expected = vec![0_u64; 20];
            for bit in ticks.iter().chain(&again).map(|tick| i64::from(*tick) - origin) {
                if bit < (64 * 20).min(end - origin) {
                    expected[bit as usize / 64] |= 1 << (bit % 64);
                }
            }
            let laid = at_each_level(|| {
                let mut words = vec![0_u64; 20];
                let laid = lay(&mut words, origin, &ticks, end);
                let laid = laid + lay(&mut words, origin, &again, end);
                let mut counts = [0; 7];
                count_each(&words, 3, &mut counts);
                (counts, words, laid)
            });
            let lit = |words: &[u64]| words.iter().map(|word| word.count_ones()).sum::<u32>();
            let lit: Vec<u32> = expected.chunks(3).map(lit).collect();
            let count = expected.iter().map(|word| word.count_ones() as usize).sum::<usize>();
            for (level, found) in laid {
                prop_assert_eq!(found.2, count, "{:?}", level);
                prop_assert_eq!(&found.0[..], &lit, "{:?}", level);
                prop_assert_eq!(&found.1, &expected, "{:?}", level);
            }
        }
    }
}
