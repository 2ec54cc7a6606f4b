//! Times moved by random amounts that have been tabulated.

use macropulse_codec::level::Level;

/// Amounts in cells of equal probability, each shared by two of them.
///
/// The leading bits of a number choose the cell, whose upper 32 bits are a bound. If the other bits of the
/// number are below it, the amount is the cell's own: its next 16 bits. Otherwise it is the last 16 bits.
#[derive(Debug)]
pub(crate) struct Amounts {
    cells: Vec<u64>,
    /// Leading bits of a number that choose the cell.
    bits: u32,
    short: Option<Box<Short>>,
}

impl Amounts {
    /// The amounts in `cells`, 2 to the power of 1 to 16; `None` of any other number.
    pub(crate) fn new(cells: Vec<u64>) -> Option<Self> {
        let bits = cells.len().checked_ilog2()?;
        let is_table = cells.len().is_power_of_two() && (1..=16).contains(&bits);
        is_table.then(|| Self { bits, short: Short::of(&cells).map(Box::new), cells })
    }

    /// The cells.
    #[cfg(test)]
    pub(crate) fn cells(&self) -> &[u64] {
        &self.cells
    }

    /// Returns the amount that `number` draws.
    #[inline]
    pub(crate) fn drawn(&self, number: u32) -> i32 {
        let cell = self.cells[(number >> (32 - self.bits)) as usize];
        let amounts = cell as u32;
        let is_own = number << self.bits < (cell >> 32) as u32;
        (if is_own { amounts } else { amounts << 16 }) as i32 >> 16
    }

    /// Adds to each of `times` what the number in the same place draws, and tells how often a time
    /// is then below the one before it.
    pub(crate) fn delay(&self, times: &mut [u32], numbers: &[u32]) -> usize {
        #[cfg(target_arch = "x86_64")]
        if Level::here() == Level::Avx512 {
            // SAFETY: the processor has what this level asks for, and there is a cell for each
            // number.
            return unsafe {
                match &self.short {
                    Some(short) => {
                        avx512::delay(times, numbers, self, avx512::Registers::of(short))
                    }
                    None => avx512::delay(times, numbers, self, avx512::Memory::of(self)),
                }
            };
        }
        self.delay_one_by_one(times, numbers, (0, 0))
    }

    /// As [`Amounts::delay`], where the time before the first of these is `before` and `falls` were
    /// counted.
    fn delay_one_by_one(
        &self,
        times: &mut [u32],
        numbers: &[u32],
        (mut before, mut falls): (u32, usize),
    ) -> usize {
        for (time, number) in times.iter_mut().zip(numbers) {
            *time = time.wrapping_add_signed(self.drawn(*number));
            falls += usize::from(*time < before);
            before = *time;
        }
        falls
    }
}

/// Cells of a short table: sixteen registers hold all of them.
const SHORT: usize = 256;

/// A table of [`SHORT`] cells whose own amounts count up from `first`, and whose other ones fit
/// into a byte.
#[derive(Debug)]
struct Short {
    /// The cells. The upper 24 bits are the bound: a number has 24 bits left behind its index. The lower 8
    /// bits are the other amount.
    cells: [u32; SHORT],
    first: i32,
}

impl Short {
    /// The short form of `cells`; `None` where it would draw anything else than they do.
    fn of(cells: &[u64]) -> Option<Self> {
        let first = i32::from((*cells.first()? >> 16) as i16);
        let mut short = Self { cells: [0; SHORT], first };
        if cells.len() != SHORT {
            return None;
        }
        for ((place, cell), counted) in short.cells.iter_mut().zip(cells).zip(first..) {
            let (own, other) = ((cell >> 16) as i16, *cell as i16);
            // 24 bits b are below it if b · 2⁸ is below the bound.
            let bound = ((cell >> 32) as u32).div_ceil(1 << 8);
            let bound = if own == other { 0 } else { bound };
            if bound >= 1 << 24 || (bound > 0 && i32::from(own) != counted) {
                return None;
            }
            *place = bound << 8 | u32::from(i8::try_from(other).ok()? as u8);
        }
        Some(short)
    }
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use super::{Amounts, SHORT, Short};
    use std::arch::x86_64::{
        __m128i, __m512i, _mm_cvtsi32_si128, _mm512_add_epi32, _mm512_alignr_epi32,
        _mm512_castsi512_si256, _mm512_cmplt_epu32_mask, _mm512_extracti64x4_epi64,
        _mm512_i32gather_epi64, _mm512_loadu_si512, _mm512_mask_add_epi32, _mm512_mask_mov_epi32,
        _mm512_mask_slli_epi32, _mm512_movepi32_mask, _mm512_or_si512, _mm512_permutex2var_epi32,
        _mm512_set1_epi32, _mm512_setr_epi32, _mm512_setzero_si512, _mm512_sll_epi32,
        _mm512_slli_epi32, _mm512_srai_epi32, _mm512_srl_epi32, _mm512_srli_epi32,
        _mm512_storeu_si512,
    };

    const STEP: usize = 16;

    /// A table in which sixteen amounts at a time are looked up.
    pub(super) trait Table: Copy {
        /// Returns the amount that each number draws.
        ///
        /// # Safety
        /// The processor must have AVX-512, and what the table was made of must still be there.
        unsafe fn drawn(self, number: __m512i) -> __m512i;
    }

    /// # Safety
    /// The processor must have AVX-512, and the `table` be that of `amounts`.
    #[target_feature(enable = "avx512f,avx512dq,popcnt")]
    pub(super) unsafe fn delay(
        times: &mut [u32],
        numbers: &[u32],
        amounts: &Amounts,
        table: impl Table,
    ) -> usize {
        let (mut before, mut falls) = (_mm512_setzero_si512(), 0);
        let mut done = 0;
        let steps = times.as_chunks_mut::<STEP>().0.iter_mut();
        for (step, numbers) in steps.zip(numbers.as_chunks::<STEP>().0) {
            // SAFETY: sixteen numbers are there to be read, and sixteen times to be read and
            // written.
            let now = unsafe {
                let amount = table.drawn(_mm512_loadu_si512(numbers.as_ptr().cast()));
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
        amounts.delay_one_by_one(&mut times[done..], &numbers[done..], (last, falls))
    }

    /// A short table in sixteen registers.
    #[derive(Clone, Copy)]
    pub(super) struct Registers {
        cells: [__m512i; SHORT / STEP],
        first: __m512i,
    }

    impl Registers {
        #[target_feature(enable = "avx512f")]
        pub(super) fn of(short: &Short) -> Self {
            let mut registers = [_mm512_setzero_si512(); SHORT / STEP];
            for (register, cells) in registers.iter_mut().zip(short.cells.as_chunks::<STEP>().0) {
                // SAFETY: sixteen numbers are there to be read.
                *register = unsafe { _mm512_loadu_si512(cells.as_ptr().cast()) };
            }
            Self { cells: registers, first: _mm512_set1_epi32(short.first) }
        }
    }

    impl Table for Registers {
        /// Two registers at a time are looked at by the lower five bits of the index of a cell; the
        /// other three choose among the eight that this gives.
        #[inline(always)]
        unsafe fn drawn(self, number: __m512i) -> __m512i {
            // SAFETY: the processor has AVX-512.
            unsafe {
                let index = _mm512_srli_epi32::<24>(number);
                let [bit_5, bit_6, bit_7] = [
                    _mm512_movepi32_mask(_mm512_slli_epi32::<2>(number)),
                    _mm512_movepi32_mask(_mm512_slli_epi32::<1>(number)),
                    _mm512_movepi32_mask(number),
                ];
                let mut looked_at = [number; SHORT / STEP / 2];
                for at in 0..SHORT / STEP / 2 {
                    let [lower, upper] = [self.cells[2 * at], self.cells[2 * at + 1]];
                    looked_at[at] = _mm512_permutex2var_epi32(lower, index, upper);
                }
                for (bit, apart) in [(bit_5, 1), (bit_6, 2), (bit_7, 4)] {
                    for at in (0..SHORT / STEP / 2).step_by(2 * apart) {
                        looked_at[at] =
                            _mm512_mask_mov_epi32(looked_at[at], bit, looked_at[at + apart]);
                    }
                }
                let cell = looked_at[0];
                // With all the lower bits set only the upper ones decide.
                let rest = _mm512_or_si512(_mm512_slli_epi32::<8>(number), _mm512_set1_epi32(0xFF));
                let is_own = _mm512_cmplt_epu32_mask(rest, cell);
                let other = _mm512_srai_epi32::<24>(_mm512_slli_epi32::<24>(cell));
                _mm512_mask_add_epi32(other, is_own, index, self.first)
            }
        }
    }

    /// A table in memory.
    #[derive(Clone, Copy)]
    pub(super) struct Memory {
        cells: *const u64,
        index_by: __m128i,
        place_by: __m128i,
    }

    impl Memory {
        pub(super) fn of(amounts: &Amounts) -> Self {
            let bits = amounts.bits as i32;
            // SAFETY: any processor of this target can.
            let [index_by, place_by] =
                unsafe { [_mm_cvtsi32_si128(32 - bits), _mm_cvtsi32_si128(bits)] };
            Self { cells: amounts.cells.as_ptr(), index_by, place_by }
        }
    }

    impl Table for Memory {
        #[inline(always)]
        unsafe fn drawn(self, number: __m512i) -> __m512i {
            // SAFETY: the processor has AVX-512, and the table has a cell for each index.
            unsafe {
                let lower =
                    _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
                let upper =
                    _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
                let index = _mm512_srl_epi32(number, self.index_by);
                let cells = self.cells.cast();
                let first = _mm512_i32gather_epi64::<8>(_mm512_castsi512_si256(index), cells);
                let second =
                    _mm512_i32gather_epi64::<8>(_mm512_extracti64x4_epi64::<1>(index), cells);
                let amounts = _mm512_permutex2var_epi32(first, lower, second);
                let bounds = _mm512_permutex2var_epi32(first, upper, second);
                let is_own =
                    _mm512_cmplt_epu32_mask(_mm512_sll_epi32(number, self.place_by), bounds);
                _mm512_srai_epi32::<16>(_mm512_mask_slli_epi32::<16>(amounts, !is_own, amounts))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
    use proptest::prelude::*;

    /// A cell with `bound` own amounts out of 2³².
    fn cell(bound: u32, own: i16, other: i16) -> u64 {
        u64::from(bound) << 32 | u64::from(own as u16) << 16 | u64::from(other as u16)
    }

    /// Times moved by what their numbers draw from a `table` of bounds, own and other amounts, on
    /// every level, against the table itself.
    fn check(table: &[(u32, i16, i16)], pairs: &[(u32, u32)]) -> Result<(), TestCaseError> {
        let bits = table.len().ilog2();
        let cells = table.iter().map(|&(bound, own, other)| cell(bound, own, other)).collect();
        let amounts = Amounts::new(cells).unwrap();
        let (times, numbers): (Vec<u32>, Vec<u32>) = pairs.iter().copied().unzip();
        let expected: Vec<u32> = pairs
            .iter()
            .map(|(time, number)| {
                let (bound, own, other) = table[(number >> (32 - bits)) as usize];
                time.wrapping_add_signed(i32::from(if number << bits < bound {
                    own
                } else {
                    other
                }))
            })
            .collect();
        let falls = expected.windows(2).filter(|pair| pair[1] < pair[0]).count();
        for (level, found) in at_each_level(|| {
            let mut times = times.clone();
            (amounts.delay(&mut times, &numbers), times)
        }) {
            prop_assert_eq!(&found, &(falls, expected.clone()), "{:?}", level);
        }
        Ok(())
    }

    #[test]
    fn only_tables_that_draw_the_same_are_short() {
        let counted = |i: i16| cell(0x8000_0000, i - 100, 3);
        let short = |cells: &[u64]| Short::of(cells).is_some();
        let mut cells: Vec<u64> = (0..256).map(counted).collect();
        assert!(short(&cells) && !short(&cells[..128]));
        for (odd, is_short) in [
            (cell(u32::MAX, 7, 7), true),
            (cell(0, 7, -128), true),
            (cell(1, -95, 127), true),
            (cell(1, 7, 3), false),
            (cell(u32::MAX, -95, 3), false),
            (cell(0, 0, 128), false),
        ] {
            cells[5] = odd;
            assert_eq!(short(&cells), is_short, "{odd:x}");
        }
        assert!(Amounts::new(vec![0; 3]).is_none() && Amounts::new(vec![]).is_none());
    }

    proptest! {
        #[test]
        fn times_move_by_one_of_two_amounts_at_every_level(
            table in proptest::collection::vec(any::<(u32, i16, i16)>(), 16),
            pairs in proptest::collection::vec((100_000..1_000_000_u32, any::<u32>()), 0..100),
        ) {
            check(&table, &pairs)?;
        }

        /// Bounds at which a number with all its bits, and not only 24 of them, would decide.
        #[test]
        fn times_move_by_a_short_table_at_every_level(
            first in -300..300_i16,
            table in proptest::collection::vec((0..1_u32 << 24, -1..2_i32, any::<i8>()), 256),
            pairs in proptest::collection::vec(
                (100_000..1_000_000_u32, any::<u8>(), -2..2_i32), 0..100,
            ),
        ) {
            let bound = |bits: u32, off: i32| (bits << 8).saturating_add_signed(off);
            let table: Vec<(u32, i16, i16)> = (first..)
                .zip(&table)
                .map(|(own, &(bits, off, other))| (bound(bits, off), own, i16::from(other)))
                .collect();
            let number = |index: u8, near: i32| {
                let bits = (table[usize::from(index)].0 >> 8).wrapping_add_signed(near) & 0xFF_FFFF;
                u32::from(index) << 24 | bits
            };
            let pairs: Vec<(u32, u32)> =
                pairs.iter().map(|&(time, index, near)| (time, number(index, near))).collect();
            check(&table, &pairs)?;
        }
    }
}
