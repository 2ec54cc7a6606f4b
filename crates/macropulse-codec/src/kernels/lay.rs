//! Ticks laid down as bits, bits counted, and counts summed up.

use crate::on_every_level;

/// Ticks that are passed at once where it is asked how many there are.
const STEP: usize = 64;

/// How many of the sorted `ticks` are before `end`. Read one behind the other, as a prefetcher foresees.
fn before(ticks: &[u32], end: i64) -> usize {
    let is_before = |tick: &u32| i64::from(*tick) < end;
    let mut count = 0;
    while ticks.get(count + STEP - 1).is_some_and(is_before) {
        count += STEP;
    }
    let rest = &ticks[count..];
    count + rest[..rest.len().min(STEP)].partition_point(is_before)
}

on_every_level! {
    /// Lights those of the sorted `ticks` that are before `end`, in `words`, and tells how many these are.
    /// The first bit of `words` is tick `origin`. No tick may be before it.
    pub(crate) fn lay(words: &mut [u64], origin: i64, ticks: &[u32], end: i64) -> usize {
        let count = before(ticks, end.min(origin + 64 * words.len() as i64));
        let ticks = &ticks[..count];
        let mut light = |tick: u32| {
            let bit = (i64::from(tick) - origin) as u64;
            words[(bit >> 6) as usize] |= 1 << (bit & 63);
        };
        // Four stretches side by side: a word that was changed just now is waited for.
        let quarter = count / 4;
        let (first, rest) = ticks.split_at(quarter);
        let (second, rest) = rest.split_at(quarter);
        let (third, rest) = rest.split_at(quarter);
        let (fourth, rest) = rest.split_at(quarter);
        for (((a, b), c), d) in first.iter().zip(second).zip(third).zip(fourth) {
            light(*a);
            light(*b);
            light(*c);
            light(*d);
        }
        rest.iter().for_each(|tick| light(*tick));
        count
    }
}

on_every_level! {
    /// How many of `words` are dark before the first one that is not; all where none is lit.
    pub(crate) fn dark_before(words: &[u64]) -> usize {
        const TOGETHER: usize = 16;
        let (blocks, _) = words.as_chunks::<TOGETHER>();
        let is_dark = |block: &&[u64; TOGETHER]| block.iter().fold(0, |any, word| any | word) == 0;
        let dark = TOGETHER * blocks.iter().take_while(is_dark).count();
        dark + words[dark..].iter().take_while(|word| **word == 0).count()
    }
}

on_every_level! {
    /// One bit for each of up to 64 `gaps`: whether bit `gap` of `ahead` is lit; of those from 64 on it is
    /// not known, and told that it is.
    pub(crate) fn lit_after(gaps: &[u8], ahead: u64) -> u64 {
        gaps.iter().zip(0..64).fold(0, |lit, (gap, at)| {
            let may_be = ahead >> (gap & 63) | u64::from(gap >> 6);
            lit | (may_be & 1) << at
        })
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

on_every_level! {
    /// Makes each of `sums` the sum of `together` of the `numbers`, from the same place on.
    pub(crate) fn sum_along(numbers: &[u32], together: usize, sums: &mut [u32]) {
        sums.fill(0);
        for away in 0..together {
            let later = numbers.get(away..).unwrap_or_default();
            for (sum, number) in sums.iter_mut().zip(later) {
                *sum += number;
            }
        }
    }
}

on_every_level! {
    /// The least of the `numbers`, the most, and their sum; `u32::MAX` and 0 where there are none.
    pub(crate) fn least_most_and_sum(numbers: &[u32]) -> (u32, u32, u64) {
        let (mut least, mut most, mut sum) = (u32::MAX, 0, 0);
        for number in numbers {
            least = least.min(*number);
            most = most.max(*number);
            sum += u64::from(*number);
        }
        (least, most, sum)
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_finds_what_is_lit(
            words in proptest::collection::vec(0..40_u64, 0..70),
            gaps in proptest::collection::vec(0..70_u8, 0..65),
            ahead in any::<u64>(),
        ) {
            let words: Vec<u64> = words.into_iter().map(|word| word.saturating_sub(38) << 40).collect();
            let expected = words.iter().position(|word| *word != 0).unwrap_or(words.len());
            for (level, dark) in at_each_level(|| dark_before(&words)) {
                prop_assert_eq!(dark, expected, "{:?}", level);
            }
            let is_lit = |gap: u8| gap > 63 || ahead >> gap & 1 == 1;
            for (level, lit) in at_each_level(|| lit_after(&gaps, ahead)) {
                for at in 0..64 {
                    let expected = gaps.get(at).is_some_and(|gap| is_lit(*gap));
                    prop_assert_eq!(lit >> at & 1 == 1, expected, "{:?} {}", level, at);
                }
            }
        }

        #[test]
        fn every_level_sums_up(
            numbers in proptest::collection::vec(0..1_000_000_u32, 0..60),
            together in 0..9_usize,
        ) {
            let some = |from: usize| numbers.iter().skip(from).take(together).sum::<u32>();
            let expected: Vec<u32> = (0..numbers.len() + 2).map(some).collect();
            let summed = at_each_level(|| {
                let mut sums = vec![7; numbers.len() + 2];
                sum_along(&numbers, together, &mut sums);
                (sums, least_most_and_sum(&numbers))
            });
            let least = numbers.iter().copied().min().unwrap_or(u32::MAX);
            let most = numbers.iter().copied().max().unwrap_or(0);
            let sum = numbers.iter().map(|number| u64::from(*number)).sum::<u64>();
            for (level, (sums, of_all)) in summed {
                prop_assert_eq!(&sums, &expected, "{:?}", level);
                prop_assert_eq!(of_all, (least, most, sum), "{:?}", level);
            }
        }

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
