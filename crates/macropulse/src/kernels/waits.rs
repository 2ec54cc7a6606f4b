//! A Poisson process on a line: the times of events that do not depend on each other.
//!
//! The waits between its events are exponential, −ln u with u uniform; the sums of them are the
//! times, in order.
#![allow(clippy::needless_range_loop)]

use super::philox::GROUP;
use macropulse_codec::level::Level;
use macropulse_codec::on_every_level;

/// End of the line. Waits are cut off there, so that the sum of sixteen stays in 32 bits.
pub(crate) const END: u32 = 1 << 27;

/// Waits summed together.
const STEP: usize = 16;

/// Events on a line that lasts from 0 to [`END`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Events {
    /// Mean wait for the next one.
    pub(crate) mean: f32,
    /// The times found are divided by 2 to the power of this, 0 to 31.
    pub(crate) shift: u32,
    /// Added to the divided times.
    pub(crate) start: u32,
}

impl Events {
    /// Appends to `times` the events that follow one at `after`, one per uniform number. Returns the time of
    /// the last one before it is divided; if that is [`END`] or later, it and others like it have been left
    /// out.
    pub(crate) fn append(&self, numbers: &[u32; GROUP], after: u32, times: &mut Vec<u32>) -> u32 {
        let mut waits = [0; GROUP];
        waits_for(numbers, self.mean, &mut waits);
        let (last, summed) = match Level::here() {
            // SAFETY: the processor has what this level asks for.
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => unsafe { avx512::sum_up(&mut waits, after, self) },
            _ => sum_up(&mut waits, after, self),
        };
        // Dividing has left an END that is a whole number of steps where it was.
        let end = END >> self.shift;
        let is_within = |time: &u32| time.wrapping_sub(self.start) < end;
        let left = match last < END {
            true => summed,
            false => waits[..summed].partition_point(is_within),
        };
        times.extend_from_slice(&waits[..left]);
        last
    }
}

on_every_level! {
    fn waits_for(numbers: &[u32; GROUP], mean: f32, waits: &mut [u32; GROUP]) {
        for i in 0..GROUP {
            waits[i] = wait_for(numbers[i], mean);
        }
    }
}

/// Puts the times of events in place of the waits for them, until the line ends. Returns the time of the last
/// one before it is divided, and the number of events.
fn sum_up(waits: &mut [u32; GROUP], after: u32, events: &Events) -> (u32, usize) {
    let (mut last, mut summed) = (after, 0);
    while summed < GROUP && last < END {
        for i in summed..summed + STEP {
            last += waits[i];
            waits[i] = (last >> events.shift).wrapping_add(events.start);
        }
        summed += STEP;
    }
    (last, summed)
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use super::{END, Events, GROUP, STEP};
    use std::arch::x86_64::{
        __m512i, _mm_cvtsi32_si128, _mm_cvtsi128_si32, _mm512_add_epi32, _mm512_alignr_epi32,
        _mm512_castsi512_si128, _mm512_loadu_si512, _mm512_permutexvar_epi32, _mm512_set1_epi32,
        _mm512_setzero_si512, _mm512_srl_epi32, _mm512_storeu_si512,
    };

    /// As [`super::sum_up`]: each becomes the sum of two, then of four, eight, sixteen.
    #[target_feature(enable = "avx512f")]
    pub(super) fn sum_up(waits: &mut [u32; GROUP], after: u32, events: &Events) -> (u32, usize) {
        let (start, shift) =
            (_mm512_set1_epi32(events.start as i32), _mm_cvtsi32_si128(events.shift as i32));
        let mut before = _mm512_set1_epi32(after as i32);
        let (mut last, mut summed) = (after, 0);
        for step in waits.as_chunks_mut::<STEP>().0 {
            if last >= END {
                break;
            }
            // SAFETY: sixteen numbers are there to be read.
            let mut sums = unsafe { _mm512_loadu_si512(step.as_ptr().cast()) };
            sums = _mm512_add_epi32(sums, moved_up::<15>(sums));
            sums = _mm512_add_epi32(sums, moved_up::<14>(sums));
            sums = _mm512_add_epi32(sums, moved_up::<12>(sums));
            sums = _mm512_add_epi32(sums, moved_up::<8>(sums));
            sums = _mm512_add_epi32(sums, before);
            before = _mm512_permutexvar_epi32(_mm512_set1_epi32(15), sums);
            last = _mm_cvtsi128_si32(_mm512_castsi512_si128(before)) as u32;
            let times = _mm512_add_epi32(_mm512_srl_epi32(sums, shift), start);
            // SAFETY: there is room for sixteen numbers.
            unsafe { _mm512_storeu_si512(step.as_mut_ptr().cast(), times) };
            summed += STEP;
        }
        (last, summed)
    }

    /// All numbers 16 − `BY` places further up, with zeros below.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn moved_up<const BY: i32>(numbers: __m512i) -> __m512i {
        _mm512_alignr_epi32::<BY>(numbers, _mm512_setzero_si512())
    }
}

/// −`mean`·ln u, rounded down, for the u that `number` stands for.
#[inline(always)]
fn wait_for(number: u32, mean: f32) -> u32 {
    let u = (number as f32 + 0.5) * (1.0 / 4_294_967_296.0);
    let wait = (-mean * ln(u)).max(0.0).min(END as f32);
    // SAFETY: a number from 0 to END; minimum and maximum are numbers even of what is none.
    unsafe { wait.to_int_unchecked::<i32>() as u32 }
}

/// Natural logarithm of a positive normal number, to a few units of the last place.
///
/// x = 2ᵏ·m with m within √½ … √2, and ln m = 2·artanh s with s = (m − 1)/(m + 1).
#[inline(always)]
fn ln(x: f32) -> f32 {
    const SQRT_HALF: u32 = 0x3F35_04F3;
    let shifted = x.to_bits().wrapping_sub(SQRT_HALF);
    let k = (shifted as i32 >> 23) as f32;
    let m = f32::from_bits((shifted & 0x007F_FFFF) + SQRT_HALF);
    let s = (m - 1.0) / (m + 1.0);
    let square = s * s;
    let series = square * (1.0 / 3.0 + square * (1.0 / 5.0 + square * (1.0 / 7.0 + square / 9.0)));
    k * std::f32::consts::LN_2 + 2.0 * (s + s * series)
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
    use proptest::prelude::*;

    #[test]
    fn the_logarithm_is_right_to_seven_digits() {
        for i in 1..100_000_u32 {
            let x = i as f32 * 1e-5;
            let exact = f64::from(x).ln();
            approx::assert_abs_diff_eq!(f64::from(ln(x)), exact, epsilon = 1.2e-7 * (1.0 - exact));
        }
        assert_eq!(ln(1.0), 0.0);
    }

    proptest! {
        #[test]
        fn events_are_the_sums_of_waits_at_every_level(
            numbers: [u32; GROUP],
            mean in 1e4_f32..1e8,
            after in 0..END,
            shift in 0..8_u32,
            start: u32,
        ) {
            let mut last = after;
            let mut expected = vec![7];
            for step in numbers.chunks(STEP) {
                for number in step {
                    last += wait_for(*number, mean);
                    if last < END {
                        expected.push((last >> shift).wrapping_add(start));
                    }
                }
                if last >= END {
                    break;
                }
            }
            for (level, found) in at_each_level(|| {
                let mut times = vec![7];
                let last = Events { mean, shift, start }.append(&numbers, after, &mut times);
                (times, last)
            }) {
                prop_assert_eq!(&found, &(expected.clone(), last), "{:?}", level);
            }
        }
    }
}
