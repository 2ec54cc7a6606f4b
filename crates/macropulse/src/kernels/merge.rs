//! Two ascending rows become one.
//!
//! Sixteen numbers are taken at a time. The lower half of two sorted vectors goes out, and the upper half
//! meets the next vector of the row whose next number is the smaller one. Two sorted vectors are separated
//! and sorted by a bitonic network \[Bat68\].
//!
//! Each step waits for the one before it, which leaves a processor idle a quarter of the time. Long rows are
//! cut into parts that are merged side by side. Bisection finds how many numbers of either row come before
//! each part.

use macropulse_codec::level::Level;

/// Numbers taken at once.
const STEP: usize = 16;

/// Numbers at the end of a row that are larger than any other, so that its end need not be tested for.
pub(crate) const PAD: [u32; 3 * STEP] = [u32::MAX; 3 * STEP];

/// Parts of a long row: 4096 numbers take 0.46 to 0.52 ns each, and not 0.62 as in one part; eight parts gain
/// no more (Zen 4, twice, in cache).
const PARTS: usize = 4;

/// Numbers from which on cutting pays: bisection costs what cutting saves with 256 numbers, and leaves a gain
/// of about 10 % with 512.
const LONG: usize = 512;

/// Puts `a` and `b`, which ascend and end with [`PAD`], into `merged`, in order and without the
/// padding, in place of what was there.
pub(crate) fn merge(a: &[u32], b: &[u32], merged: &mut Vec<u32>, from: usize) {
    let all = (a.len() + b.len()).saturating_sub(2 * PAD.len());
    merged.truncate(from);
    merged.reserve(all + PARTS * STEP);
    match Level::here() {
        // SAFETY: the processor has what this level asks for.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 if all < LONG => unsafe { avx512::append::<1>(a, b, all, merged) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { avx512::append::<PARTS>(a, b, all, merged) },
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

/// How many numbers of `a` and how many of `b` are the first `count` of both together.
#[cfg(target_arch = "x86_64")]
fn first(count: usize, a: &[u32], b: &[u32]) -> [usize; 2] {
    let (mut least, mut most) = (count.saturating_sub(b.len()), count.min(a.len()));
    while least < most {
        let of_a = least.midpoint(most);
        match a[of_a] <= b[count - of_a - 1] {
            true => least = of_a + 1,
            false => most = of_a,
        }
    }
    [least, count - least]
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use super::{STEP, first};
    use std::arch::x86_64::{
        __m512i, _mm512_loadu_si512, _mm512_mask_max_epu32, _mm512_max_epu32, _mm512_min_epu32,
        _mm512_permutexvar_epi32, _mm512_set_epi32, _mm512_set1_epi32, _mm512_shuffle_epi32,
        _mm512_shuffle_i64x2, _mm512_storeu_si512,
    };

    /// Appends both rows, `all` numbers, merged in `PARTS` parts.
    #[target_feature(enable = "avx512f")]
    pub(super) fn append<const PARTS: usize>(
        a: &[u32],
        b: &[u32],
        all: usize,
        merged: &mut Vec<u32>,
    ) {
        let steps = all.div_ceil(PARTS * STEP);
        let mut at = [[0; 2]; PARTS];
        let mut next = [_mm512_set1_epi32(-1); PARTS];
        let mut rest = next;
        for part in 0..PARTS {
            let [of_a, of_b] = first((part * steps * STEP).min(all), a, b);
            (next[part], rest[part]) = (load(a, of_a), load(b, of_b));
            at[part] = [of_a + STEP, of_b + STEP];
        }
        let places = merged.spare_capacity_mut().as_chunks_mut::<STEP>().0;
        let Some(places) = places.get_mut(..PARTS * steps) else { return };
        for step in 0..steps {
            for part in 0..PARTS {
                let lower;
                (lower, rest[part]) = sorted_halves(next[part], rest[part]);
                let place = &mut places[part * steps + step];
                // SAFETY: there is room for sixteen numbers.
                unsafe { _mm512_storeu_si512(place.as_mut_ptr().cast(), lower) };
                // Looked up rather than jumped to: no processor can predict which row is next.
                let [of_a, of_b] = at[part];
                let is_of_b = usize::from(number(a, of_a) > number(b, of_b));
                next[part] = load([a, b][is_of_b], at[part][is_of_b]);
                at[part][is_of_b] += STEP;
            }
        }
        let length = merged.len() + all;
        // SAFETY: `all` numbers were written one behind the other.
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
            mut a in proptest::collection::vec(0..3000_u32, 0..1500),
            mut b in proptest::collection::vec(0..3000_u32, 0..1500),
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
