//! Pictures of a timeline with one bit for every eight of its own.

use super::level::Level;
use crate::on_every_level;

/// Bits of a timeline that one bit of its picture stands for.
pub(crate) const COARSE: usize = 8;

/// Makes bit i of `picture` tell whether any of the bits `shift` + 8·i … `shift` + 8·i + 7 of `words`
/// is lit. Bits beyond the end are dark.
///
/// # Panics
/// If `shift` is 64 or more.
pub(crate) fn coarse(words: &[u64], shift: usize, picture: &mut [u64]) {
    assert!(shift < 64);
    // A picture word is made of eight words, and the beginning of the next one.
    let whole = (words.len().saturating_sub(1) / COARSE).min(picture.len());
    let (inner, rest) = picture.split_at_mut(whole);
    match Level::here() {
        // SAFETY: the processor has what this level asks for, and there is a word behind the last
        // eight.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { avx512::coarse_within(words, shift, inner) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { avx2::coarse_within(words, shift, inner) },
        _ => plain(words, shift, inner),
    }
    let behind = &words[COARSE * whole..];
    for (index, out) in rest.iter_mut().enumerate() {
        let from = (COARSE * index).min(behind.len());
        let mut last = [0; COARSE + 1];
        let there = &behind[from..behind.len().min(from + COARSE + 1)];
        last[..there.len()].copy_from_slice(there);
        plain(&last, shift, std::slice::from_mut(out));
    }
}

on_every_level! {
    /// Makes `places` those of the `ticks` in pictures that follow one another every `stride` bits, each
    /// made a tick later.
    pub(crate) fn in_pictures(ticks: &[u32], stride: u32, places: &mut Vec<u32>) {
        places.resize(ticks.len(), 0);
        for (place, tick) in places.iter_mut().zip(ticks) {
            *place = tick % COARSE as u32 * stride + tick / COARSE as u32;
        }
    }
}

fn plain(words: &[u64], shift: usize, picture: &mut [u64]) {
    for (words, out) in words.windows(COARSE + 1).step_by(COARSE).zip(picture) {
        *out = 0;
        for lane in 0..COARSE {
            let bits = words[lane] >> shift | words[lane + 1] << 1 << (63 ^ shift);
            // The lowest bit of each byte that has any, gathered into the highest byte.
            let mut any = bits | bits >> 4;
            any |= any >> 2;
            any = (any | any >> 1) & 0x0101_0101_0101_0101;
            *out |= any.wrapping_mul(0x0102_0408_1020_4080) >> 56 << (8 * lane);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::COARSE;
    use std::arch::x86_64::{
        _mm_cvtsi64_si128, _mm256_cmpeq_epi8, _mm256_loadu_si256, _mm256_movemask_epi8,
        _mm256_or_si256, _mm256_setzero_si256, _mm256_sll_epi64, _mm256_srl_epi64,
    };

    /// # Safety
    ///
    /// The processor must have AVX2, and `words` must be one more than eight for each word of the picture.
    #[target_feature(enable = "avx2")]
    pub(super) unsafe fn coarse_within(words: &[u64], shift: usize, picture: &mut [u64]) {
        // A shift by 64 gives 0.
        let back = _mm_cvtsi64_si128(64 - shift as i64);
        let shift = _mm_cvtsi64_si128(shift as i64);
        for (index, out) in picture.iter_mut().enumerate() {
            let dark_bytes = |word: usize| {
                // SAFETY: the caller answers for the words.
                let (low, high) = unsafe {
                    let low = words.as_ptr().add(word);
                    (_mm256_loadu_si256(low.cast()), _mm256_loadu_si256(low.add(1).cast()))
                };
                let bits =
                    _mm256_or_si256(_mm256_srl_epi64(low, shift), _mm256_sll_epi64(high, back));
                let dark = _mm256_cmpeq_epi8(bits, _mm256_setzero_si256());
                _mm256_movemask_epi8(dark) as u32
            };
            let half = COARSE / 2;
            let [low, high] = [0, half].map(|word| u64::from(dark_bytes(COARSE * index + word)));
            *out = !(low | high << 32);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use super::COARSE;
    use std::arch::x86_64::{
        _mm512_loadu_si512, _mm512_set1_epi64, _mm512_shrdv_epi64, _mm512_test_epi8_mask,
    };

    /// # Safety
    ///
    /// The processor must have AVX-512 F, BW and VBMI2, and `words` must be one more than eight for
    /// each word of the picture.
    #[target_feature(enable = "avx512f,avx512bw,avx512vbmi2")]
    pub(super) unsafe fn coarse_within(words: &[u64], shift: usize, picture: &mut [u64]) {
        let shift = _mm512_set1_epi64(shift as i64);
        for (index, out) in picture.iter_mut().enumerate() {
            // SAFETY: the caller answers for the words.
            let (low, high) = unsafe {
                let low = words.as_ptr().add(COARSE * index);
                (_mm512_loadu_si512(low.cast()), _mm512_loadu_si512(low.add(1).cast()))
            };
            let bits = _mm512_shrdv_epi64(low, high, shift);
            *out = _mm512_test_epi8_mask(bits, bits);
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
        fn every_level_makes_the_picture(
            words in proptest::collection::vec(any::<(u64, u64, u64)>(), 0..50),
            shift in 0..64_usize,
            length in 0..8_usize,
        ) {
            let words: Vec<u64> = words.into_iter().map(|(a, b, c)| a & b & c).collect();
            let is_lit = |bit: usize| words.get(bit / 64).is_some_and(|w| w >> (bit % 64) & 1 == 1);
            let expected: Vec<bool> = (0..64 * length)
                .map(|cell| (0..COARSE).any(|bit| is_lit(shift + COARSE * cell + bit)))
                .collect();
            let pictures = at_each_level(|| {
                let mut picture = vec![u64::MAX; length];
                coarse(&words, shift, &mut picture);
                picture
            });
            for (level, picture) in pictures.clone() {
                let bit = |cell: usize| picture[cell / 64] >> (cell % 64) & 1 == 1;
                let found: Vec<bool> = (0..64 * length).map(bit).collect();
                prop_assert_eq!(&found, &expected, "{:?}", level);
            }
        }
    }
}
