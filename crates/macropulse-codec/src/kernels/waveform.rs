//! Loops over samples: the matched filter, and the least mark of a word at each lag.

use crate::on_every_level;

/// Lags that are looked at together, so that what is known of them stays close to the processor.
pub(crate) const LAGS: usize = 512;

/// Samples that are filtered together.
const BLOCK: usize = 1024;

/// Lags that are passed by together where none stands out.
const PASSED: usize = 32;

on_every_level! {
    /// Filters `samples`, of which there are `taps.len() − 1` more: entry n of `filtered` becomes
    /// Σ taps\[k\]·samples\[n + k\].
    pub(crate) fn filter(samples: &[f32], taps: &[f32], filtered: &mut [f32]) {
        for (block, sums) in filtered.chunks_mut(BLOCK).enumerate() {
            sums.fill(0.0);
            for (place, tap) in (block * BLOCK..).zip(taps) {
                let samples = &samples[place..][..sums.len()];
                for (sum, sample) in sums.iter_mut().zip(samples) {
                    *sum += tap * sample;
                }
            }
        }
    }
}

on_every_level! {
    /// Lowers each entry of `least` to that of `mark` where it is above.
    pub(crate) fn lower(least: &mut [f32], mark: &[f32]) {
        for (least, mark) in least.iter_mut().zip(mark) {
            *least = if *mark < *least { *mark } else { *least };
        }
    }
}

on_every_level! {
    /// Adds to `found` where `least` is `bound` or more, and not infinite; ascending.
    pub(crate) fn standing_out(least: &[f32], bound: f32, found: &mut Vec<usize>) {
        let stands_out = |least: &f32| (*least >= bound) & (*least < f32::INFINITY);
        let mut blocks = least.chunks_exact(PASSED);
        for (block, least) in blocks.by_ref().enumerate() {
            let mut some = [0_u32; PASSED];
            for (some, least) in some.iter_mut().zip(least) {
                *some = u32::from(stands_out(least));
            }
            if some.iter().sum::<u32>() > 0 {
                let places = (0..PASSED).filter(|at| some[*at] > 0);
                found.extend(places.map(|at| block * PASSED + at));
            }
        }
        let last = blocks.remainder();
        let places = (0..last.len()).filter(|at| stands_out(&last[*at]));
        found.extend(places.map(|at| least.len() - last.len() + at));
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    fn signal() -> impl Strategy<Value = Vec<f32>> {
        let value = prop_oneof![6 => -40.0..200.0_f32, 1 => Just(f32::INFINITY)];
        proptest::collection::vec(value, LAGS)
    }

    proptest! {
        #[test]
        fn every_level_filters_alike(
            samples in proptest::collection::vec(-2048.0..2048.0_f32, 1100..1300),
            taps in proptest::collection::vec(-1.0..1.0_f32, 1..12),
        ) {
            let count = samples.len() + 1 - taps.len();
            let expected: Vec<f32> = (0..count)
                .map(|n| taps.iter().zip(&samples[n..]).fold(0.0, |sum, (tap, s)| sum + tap * s))
                .collect();
            for (level, found) in at_each_level(|| {
                let mut filtered = vec![1.0; count];
                filter(&samples, &taps, &mut filtered);
                filtered
            }) {
                prop_assert_eq!(&found, &expected, "{:?}", level);
            }
        }

        #[test]
        fn every_level_finds_where_all_marks_stand_out(
            marks in [signal(), signal(), signal()],
            count in 1..=LAGS,
            bound in -30.0..100.0_f32,
        ) {
            let least = |lag: usize| marks.iter().map(|mark| mark[lag]).fold(f32::INFINITY, f32::min);
            let expected: Vec<usize> = (0..count)
                .filter(|lag| least(*lag) >= bound && least(*lag).is_finite())
                .collect();
            for (level, found) in at_each_level(|| {
                let (mut least, mut found) = (vec![f32::INFINITY; count], Vec::new());
                marks.iter().for_each(|mark| lower(&mut least, &mark[..count]));
                standing_out(&least, bound, &mut found);
                found
            }) {
                prop_assert_eq!(&found, &expected, "{:?}", level);
            }
        }
    }
}
