//! Two ascending rows become one.
//!
//! Sixteen numbers at a time: the lower half of two sorted vectors goes out, the upper half meets
//! the next vector of the row whose next number is the smaller one. Two sorted vectors are
//! separated and sorted by a bitonic network \[Bat68\].

use macropulse_codec::level::Level;

/// Numbers taken at once.
const STEP: usize = 16;

/// A row ends with so many numbers that are larger than any other, so that its end need not be
/// tested for.
pub(crate) const PAD: [u32; 3 * STEP] = [u32::MAX; 3 * STEP];

/// Puts `a` and `b`, which ascend and end with [`PAD`], into `merged`, in order and without the
/// padding, in place of what was there.
pub(crate) fn merge(a: &[u32], b: &[u32], merged: &mut Vec<u32>, from: usize) {
    let all = (a.len() + b.len()).saturating_sub(2 * PAD.len());
    merged.truncate(from);
    merged.reserve(all + STEP);
    match Level::here() {
        // SAFETY: the processor has what this level asks for.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { avx512::append_merged(a, b, all, merged) },
        _ => append_one_by_one(a, b, all, merged),
    }
}

fn append_one_by_one(a: &[u32], b: &[u32], all: usize, merged: &mut Vec<u32>) {
    let (mut i, mut j) = (0, 0);
    merged.extend((0..all).map_while(|_| {
        let (of_a, of_b) = (*a.get(i)?, *b.get(j)?);
        let take_a = of_a <= of_b;
        i += usize::from(take_a);
        j += usize::from(!take_a);
        Some(if take_a { of_a } else { of_b })
    }));
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use super::STEP;
    use std::arch::x86_64::{
        __m512i, _mm512_loadu_si512, _mm512_mask_max_epu32, _mm512_max_epu32, _mm512_min_epu32,
        _mm512_permutexvar_epi32, _mm512_set_epi32, _mm512_set1_epi32, _mm512_shuffle_epi32,
        _mm512_shuffle_i64x2, _mm512_storeu_si512,
    };

    #[target_feature(enable = "avx512f")]
    pub(super) fn append_merged(a: &[u32], b: &[u32], all: usize, merged: &mut Vec<u32>) {
        let mut at = [STEP, STEP];
        let (mut next, mut rest) = (load(a, 0), load(b, 0));
        let places = merged.spare_capacity_mut().as_chunks_mut::<STEP>().0;
        let Some(places) = places.get_mut(..all.div_ceil(STEP)) else { return };
        for place in places {
            let lower;
            (lower, rest) = sorted_halves(next, rest);
            // SAFETY: there is room for sixteen numbers.
            unsafe { _mm512_storeu_si512(place.as_mut_ptr().cast(), lower) };
            // Looked up rather than jumped to: no processor can predict which row is next.
            let is_of_b = usize::from(number(a, at[0]) > number(b, at[1]));
            next = load([a, b][is_of_b], at[is_of_b]);
            at[is_of_b] += STEP;
        }
        let length = merged.len() + all;
        // SAFETY: so many numbers were written one behind the other.
        unsafe { merged.set_len(length) }
    }

    /// The number at `at`; behind the end of a row there are none to come.
    #[inline]
    fn number(row: &[u32], at: usize) -> u32 {
        row.get(at).copied().unwrap_or(u32::MAX)
    }

    /// The numbers from `at` on, as [`number`].
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn load(row: &[u32], at: usize) -> __m512i {
        match row.get(at..).and_then(<[u32]>::first_chunk::<STEP>) {
            // SAFETY: sixteen numbers are there to be read.
            Some(step) => unsafe { _mm512_loadu_si512(step.as_ptr().cast()) },
            None => _mm512_set1_epi32(-1),
        }
    }

    /// The lower and the upper half of two sorted vectors, each sorted.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn sorted_halves(a: __m512i, b: __m512i) -> (__m512i, __m512i) {
        let backwards = _mm512_set_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        let b = _mm512_permutexvar_epi32(backwards, b);
        (sorted(_mm512_min_epu32(a, b)), sorted(_mm512_max_epu32(a, b)))
    }

    /// A bitonic vector, sorted: each step compares what is 8, 4, 2 and 1 apart.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn sorted(v: __m512i) -> __m512i {
        let v = exchanged(v, _mm512_shuffle_i64x2::<0b01_00_11_10>(v, v), 0xFF00);
        let v = exchanged(v, _mm512_shuffle_i64x2::<0b10_11_00_01>(v, v), 0xF0F0);
        let v = exchanged(v, _mm512_shuffle_epi32::<0b01_00_11_10>(v), 0xCCCC);
        exchanged(v, _mm512_shuffle_epi32::<0b10_11_00_01>(v), 0xAAAA)
    }

    /// The larger one of each pair where `upper` says so, else the smaller one.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn exchanged(v: __m512i, other: __m512i, upper: u16) -> __m512i {
        _mm512_mask_max_epu32(_mm512_min_epu32(v, other), upper, v, other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn two_rows_become_one_at_every_level(
            mut a in proptest::collection::vec(0..3000_u32, 0..400),
            mut b in proptest::collection::vec(0..3000_u32, 0..400),
            before in proptest::collection::vec(any::<u32>(), 0..5),
        ) {
            let mut expected = [a.clone(), b.clone()].concat();
            expected.sort_unstable();
            expected.splice(0..0, before.iter().copied());
            for row in [&mut a, &mut b] {
                row.sort_unstable();
                row.extend(PAD);
            }
            for (level, merged) in at_each_level(|| {
                let mut merged = [&before[..], &[1, 2, 3]].concat();
                merge(&a, &b, &mut merged, before.len());
                merged
            }) {
                prop_assert_eq!(&merged, &expected, "{:?}", level);
            }
        }
    }
}
