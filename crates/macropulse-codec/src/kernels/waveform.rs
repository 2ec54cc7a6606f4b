//! Loops over samples: the matched filter, and the least mark of a word at each lag.

use std::ops::Range;

use crate::on_every_level;

/// Lags that are looked at together, so that what is known of them stays close to the processor.
pub(crate) const LAGS: usize = 512;

/// Samples that are filtered together.
const BLOCK: usize = 1024;

/// Lags that are passed by together where none stands out.
const PASSED: usize = 64;

/// Filters `codes` with `taps`, of an odd number. The `rest` is added to the codes unless it is empty. Entry
/// n of `filtered` becomes Σ taps\[k\]·codes\[n + k − r\], r being half of the number of taps. Codes are 0
/// beyond the ends and in the `dark` ranges, which ascend and do not overlap.
pub(crate) fn filter(
    (codes, rest): (&[i16], &[f32]),
    taps: &[f32],
    dark: &[Range<usize>],
    filtered: &mut [f32],
) {
    let reach = taps.len() / 2;
    let mut samples = vec![0.0; BLOCK + 2 * reach];
    for (block, sums) in filtered.chunks_mut(BLOCK).enumerate() {
        // The samples of the block begin with this code, which may be before the first.
        let begin = block * BLOCK;
        let from = begin.saturating_sub(reach);
        let until = (begin + sums.len() + reach).min(codes.len()).max(from);
        samples.fill(0.0);
        let place = |at: usize| at + reach - begin;
        convert(&codes[from..until], &mut samples[place(from)..place(until)]);
        if let Some(rest) = rest.get(from..until) {
            let samples = samples[place(from)..place(until)].iter_mut();
            samples.zip(rest).for_each(|(sample, rest)| *sample += rest);
        }
        let first = dark.partition_point(|dark| dark.end <= from);
        for dark in dark[first..].iter().take_while(|dark| dark.start < until) {
            samples[place(dark.start.max(from))..place(dark.end.min(until))].fill(0.0);
        }
        convolve(&samples, taps, sums);
    }
}

on_every_level! {
    fn convert(codes: &[i16], samples: &mut [f32]) {
        for (sample, code) in samples.iter_mut().zip(codes) {
            *sample = f32::from(*code);
        }
    }
}

on_every_level! {
    /// Entry n of `sums` becomes Σ taps\[k\]·samples\[n + k\].
    fn convolve(samples: &[f32], taps: &[f32], sums: &mut [f32]) {
        sums.fill(0.0);
        for (place, tap) in taps.iter().enumerate() {
            let samples = &samples[place..][..sums.len()];
            for (sum, sample) in sums.iter_mut().zip(samples) {
                *sum += tap * sample;
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
        for (block, least) in least.chunks(PASSED).enumerate() {
            let some = least.iter().fold(0, |some, least| some | u32::from(stands_out(least)));
            if some != 0 {
                let places = (0..least.len()).filter(|at| stands_out(&least[*at]));
                found.extend(places.map(|at| block * PASSED + at));
            }
        }
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
            codes in proptest::collection::vec(any::<i16>(), 0..2300),
            taps in proptest::collection::vec(-1.0..1.0_f32, 1..8),
            dark in (0..2500_usize, 0..300_usize, 0..300_usize, 0..300_usize),
            has_rest in any::<bool>(),
        ) {
            let rest: Vec<f32> = match has_rest {
                true => (0..codes.len()).map(|at| (at % 17) as f32 / 16.0 - 0.5).collect(),
                false => Vec::new(),
            };
            let taps: Vec<f32> = taps.iter().chain(&taps[1..]).copied().collect();
            let reach = taps.len() / 2;
            let first = dark.0.min(codes.len());
            let lengths = [dark.1, dark.2, dark.3];
            let dark = lengths.iter().scan(first, |end, length| {
                let begin = *end;
                *end = (begin + length).min(codes.len());
                Some(begin..*end)
            });
            let dark: Vec<Range<usize>> = dark.step_by(2).collect();
            let sample = |at: usize| match at.checked_sub(reach) {
                Some(at) if at < codes.len() && !dark.iter().any(|dark| dark.contains(&at)) => {
                    f32::from(codes[at]) + rest.get(at).copied().unwrap_or(0.0)
                }
                _ => 0.0,
            };
            let sum = |n: usize| {
                (0..taps.len()).fold(0.0, |sum, k| sum + taps[k] * sample(n + k))
            };
            let expected: Vec<f32> = (0..codes.len()).map(sum).collect();
            for (level, found) in at_each_level(|| {
                let mut filtered = vec![1.0; codes.len()];
                filter((&codes, &rest), &taps, &dark, &mut filtered);
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
