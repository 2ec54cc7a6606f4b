//! Some of the numbers of a row are kept and move up.
//!
//! Compilers know no way to write this with vectors, but AVX-512 has an instruction for it.

use std::ops::Range;

use macropulse_codec::level::Level;

/// Keeps the times in `times[from..]` whose number is below `bound`. The first of them belongs to the first
/// of `numbers`, and so on; there is at least one number per time.
pub(crate) fn keep_below(times: &mut Vec<u32>, from: usize, numbers: &[u32], bound: u32) {
    let Some(asked) = times.get_mut(from..) else { return };
    let kept = match Level::here() {
        // SAFETY: the processor has what this level asks for.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { avx512::keep_below(asked, numbers, bound) },
        _ => keep_below_one_by_one(asked, numbers, bound, (0, 0)),
    };
    times.truncate(from + kept);
}

/// As [`keep_below`], from `at` on, where `kept` are kept already; gives how many are in the end.
fn keep_below_one_by_one(
    times: &mut [u32],
    numbers: &[u32],
    bound: u32,
    (at, mut kept): (usize, usize),
) -> usize {
    for i in at..times.len().min(numbers.len()) {
        times[kept] = times[i];
        kept += usize::from(numbers[i] < bound);
    }
    kept
}

/// Divides `times[from]`, which ascend, by 2 to the power of `shift`, 1 to 31, rounding down, and
/// puts one of each at `kept` and behind; gives where they end. One that equals `last` is left
/// out as well; in the end `last` is the last one. `kept` is not behind the beginning of `from`.
pub(crate) fn distinct(
    times: &mut [u32],
    from: Range<usize>,
    kept: usize,
    shift: u32,
    last: &mut u32,
) -> usize {
    let end = from.end.min(times.len());
    let place = (from.start, kept.min(from.start));
    match Level::here() {
        // SAFETY: the processor has what this level asks for.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { avx512::distinct(&mut times[..end], shift, last, place) },
        _ => distinct_one_by_one(&mut times[..end], shift, last, place),
    }
}

/// As [`distinct`], of all from `at` on.
fn distinct_one_by_one(
    times: &mut [u32],
    shift: u32,
    last: &mut u32,
    (at, mut kept): (usize, usize),
) -> usize {
    for i in at..times.len() {
        let now = times[i] >> (shift & 31);
        times[kept] = now;
        kept += usize::from(now != *last);
        *last = now;
    }
    kept
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use std::arch::x86_64::{
        __m512i, _mm_cvtsi32_si128, _mm512_alignr_epi32, _mm512_cmplt_epu32_mask,
        _mm512_cmpneq_epu32_mask, _mm512_loadu_si512, _mm512_maskz_compress_epi32,
        _mm512_set1_epi32, _mm512_srl_epi32, _mm512_storeu_si512,
    };

    /// Numbers looked at together.
    const STEP: usize = 16;

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn load(numbers: &[u32; STEP]) -> __m512i {
        // SAFETY: sixteen numbers are there to be read.
        unsafe { _mm512_loadu_si512(numbers.as_ptr().cast()) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn store(numbers: &mut [u32; STEP], value: __m512i) {
        // SAFETY: there is room for sixteen numbers.
        unsafe { _mm512_storeu_si512(numbers.as_mut_ptr().cast(), value) }
    }

    /// The kept times never pass those still to be read, so that both may be in one place.
    #[target_feature(enable = "avx512f,popcnt")]
    pub(super) fn keep_below(times: &mut [u32], numbers: &[u32], bound: u32) -> usize {
        let limit = _mm512_set1_epi32(bound as i32);
        let (mut at, mut kept) = (0, 0);
        while let (Some(step), Some(drawn)) =
            (times[at..].first_chunk(), numbers.get(at..).and_then(<[u32]>::first_chunk))
        {
            let value = load(step);
            let mask = _mm512_cmplt_epu32_mask(load(drawn), limit);
            if let Some(place) = times[kept..].first_chunk_mut() {
                store(place, _mm512_maskz_compress_epi32(mask, value));
            }
            kept += mask.count_ones() as usize;
            at += STEP;
        }
        super::keep_below_one_by_one(times, numbers, bound, (at, kept))
    }

    #[target_feature(enable = "avx512f,popcnt")]
    pub(super) fn distinct(
        times: &mut [u32],
        shift: u32,
        last: &mut u32,
        (mut at, mut kept): (usize, usize),
    ) -> usize {
        let by = _mm_cvtsi32_si128(shift as i32);
        let mut before = _mm512_set1_epi32(*last as i32);
        while let Some(step) = times.get(at..).and_then(<[u32]>::first_chunk) {
            let now = _mm512_srl_epi32(load(step), by);
            let mask = _mm512_cmpneq_epu32_mask(now, _mm512_alignr_epi32::<15>(now, before));
            if let Some(place) = times[kept..].first_chunk_mut() {
                store(place, _mm512_maskz_compress_epi32(mask, now));
            }
            kept += mask.count_ones() as usize;
            at += STEP;
            before = now;
        }
        let mut lasts = [0; STEP];
        store(&mut lasts, before);
        *last = lasts[STEP - 1];
        super::distinct_one_by_one(times, shift, last, (at, kept))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn those_with_small_numbers_are_kept_at_every_level(
            pairs in proptest::collection::vec(any::<(u32, u32)>(), 0..200),
            from in 0..3_usize,
            bound: u32,
        ) {
            let times: Vec<u32> = pairs.iter().map(|pair| pair.0).collect();
            let numbers: Vec<u32> = pairs.iter().skip(from).map(|pair| pair.1).collect();
            let mut expected: Vec<u32> = times.iter().take(from).copied().collect();
            let kept = pairs.iter().skip(from).filter(|pair| pair.1 < bound);
            expected.extend(kept.map(|pair| pair.0));
            for (level, kept) in at_each_level(|| {
                let mut kept = times.clone();
                keep_below(&mut kept, from, &numbers, bound);
                kept
            }) {
                prop_assert_eq!(&kept, &expected, "{:?}", level);
            }
        }

        #[test]
        fn one_of_each_is_left_at_every_level(
            mut times in proptest::collection::vec(0..5000_u32, 0..300),
            block in 1..150_usize,
            shift in 1..8_u32,
        ) {
            times.sort_unstable();
            let mut expected: Vec<u32> = times.iter().map(|time| time >> shift).collect();
            expected.dedup();
            for (level, kept) in at_each_level(|| {
                let mut times = times.clone();
                let (mut kept, mut last) = (0, u32::MAX);
                for from in (0..times.len()).step_by(block) {
                    kept = distinct(&mut times, from..from + block, kept, shift, &mut last);
                }
                times.truncate(kept);
                times
            }) {
                prop_assert_eq!(&kept, &expected, "{:?}", level);
            }
        }
    }
}
