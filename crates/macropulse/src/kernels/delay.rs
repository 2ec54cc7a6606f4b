//! Times moved by random amounts that have been tabulated.

use macropulse_codec::level::Level;

/// Adds to each of `times` what the number in the same place draws from `cells`, of which there
/// are 2 to the power of `bits`, 1 to 16, and tells how often a time is then below the one before
/// it.
///
/// The leading bits of a number choose the cell, the others whether they are below its bound, the
/// upper 32 bits; then the next 16 bits are the amount, else the last 16.
pub(crate) fn delay(times: &mut [u32], numbers: &[u32], cells: &[u64], bits: u32) -> usize {
    match Level::here() {
        // SAFETY: the processor has what this level asks for, and there is a cell for each number.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 if (1..=16).contains(&bits) && cells.len() == 1 << bits => unsafe {
            avx512::delay(times, numbers, cells, bits)
        },
        _ => delay_one_by_one(times, numbers, (cells, bits), (0, 0)),
    }
}

/// As [`delay`], where the time before the first of these is `before` and `falls` were counted.
fn delay_one_by_one(
    times: &mut [u32],
    numbers: &[u32],
    (cells, bits): (&[u64], u32),
    (mut before, mut falls): (u32, usize),
) -> usize {
    for (time, number) in times.iter_mut().zip(numbers) {
        *time = time.wrapping_add_signed(drawn(*number, cells, bits));
        falls += usize::from(*time < before);
        before = *time;
    }
    falls
}

/// What `number` draws from `cells`, as [`delay`] does.
#[inline(always)]
pub(crate) fn drawn(number: u32, cells: &[u64], bits: u32) -> i32 {
    let cell = cells[(number >> (32 - bits)) as usize];
    let amounts = cell as u32;
    let is_own = number << bits < (cell >> 32) as u32;
    (if is_own { amounts } else { amounts << 16 }) as i32 >> 16
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use std::arch::x86_64::{
        __m512i, _mm_cvtsi32_si128, _mm512_add_epi32, _mm512_alignr_epi32, _mm512_castsi512_si256,
        _mm512_cmplt_epu32_mask, _mm512_extracti64x4_epi64, _mm512_i32gather_epi64,
        _mm512_loadu_si512, _mm512_mask_slli_epi32, _mm512_permutex2var_epi32, _mm512_setr_epi32,
        _mm512_setzero_si512, _mm512_sll_epi32, _mm512_srai_epi32, _mm512_srl_epi32,
        _mm512_storeu_si512,
    };

    const STEP: usize = 16;

    /// # Safety
    /// There must be 2 to the power of `bits` cells, `bits` from 1 to 31.
    #[target_feature(enable = "avx512f,popcnt")]
    pub(super) unsafe fn delay(
        times: &mut [u32],
        numbers: &[u32],
        cells: &[u64],
        bits: u32,
    ) -> usize {
        let index_by = _mm_cvtsi32_si128(32 - bits as i32);
        let place_by = _mm_cvtsi32_si128(bits as i32);
        let lower = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
        let upper = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
        let (mut before, mut falls) = (_mm512_setzero_si512(), 0);
        let mut done = 0;
        let steps = times.as_chunks_mut::<STEP>().0.iter_mut();
        for (step, numbers) in steps.zip(numbers.as_chunks::<STEP>().0) {
            // SAFETY: sixteen numbers are there to be read.
            let number = unsafe { _mm512_loadu_si512(numbers.as_ptr().cast()) };
            let index = _mm512_srl_epi32(number, index_by);
            // SAFETY: an index of `bits` bits is that of a cell.
            let (first, second): (__m512i, __m512i) = unsafe {
                (
                    _mm512_i32gather_epi64::<8>(
                        _mm512_castsi512_si256(index),
                        cells.as_ptr().cast(),
                    ),
                    _mm512_i32gather_epi64::<8>(
                        _mm512_extracti64x4_epi64::<1>(index),
                        cells.as_ptr().cast(),
                    ),
                )
            };
            let amounts = _mm512_permutex2var_epi32(first, lower, second);
            let bounds = _mm512_permutex2var_epi32(first, upper, second);
            let is_own = _mm512_cmplt_epu32_mask(_mm512_sll_epi32(number, place_by), bounds);
            let amount =
                _mm512_srai_epi32::<16>(_mm512_mask_slli_epi32::<16>(amounts, !is_own, amounts));
            // SAFETY: sixteen times are there to be read and written.
            let now = unsafe {
                let now = _mm512_add_epi32(_mm512_loadu_si512(step.as_ptr().cast()), amount);
                _mm512_storeu_si512(step.as_mut_ptr().cast(), now);
                now
            };
            let shifted = _mm512_alignr_epi32::<15>(now, before);
            falls += _mm512_cmplt_epu32_mask(now, shifted).count_ones() as usize;
            before = now;
            done += STEP;
        }
        let last = done.checked_sub(1).map_or(0, |last| times[last]);
        let (rest, numbers) = (&mut times[done..], &numbers[done..]);
        super::delay_one_by_one(rest, numbers, (cells, bits), (last, falls))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn times_move_by_one_of_two_amounts_at_every_level(
            table in proptest::collection::vec(any::<(u32, i16, i16)>(), 16),
            pairs in proptest::collection::vec((100_000..1_000_000_u32, any::<u32>()), 0..100),
        ) {
            let cells: Vec<u64> = table
                .iter()
                .map(|(bound, own, other)| {
                    u64::from(*bound) << 32 | u64::from(*own as u16) << 16 | u64::from(*other as u16)
                })
                .collect();
            let (times, numbers): (Vec<u32>, Vec<u32>) = pairs.iter().copied().unzip();
            let expected: Vec<u32> = pairs
                .iter()
                .map(|(time, number)| {
                    let (bound, own, other) = table[(number >> 28) as usize];
                    time.wrapping_add_signed(i32::from(if number << 4 < bound { own } else { other }))
                })
                .collect();
            let falls = expected.windows(2).filter(|pair| pair[1] < pair[0]).count();
            for (level, found) in at_each_level(|| {
                let mut times = times.clone();
                (delay(&mut times, &numbers, &cells, 4), times)
            }) {
                prop_assert_eq!(&found, &(falls, expected.clone()), "{:?}", level);
            }
        }
    }
}
