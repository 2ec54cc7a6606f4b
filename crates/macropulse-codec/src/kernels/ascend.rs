//! A test that numbers ascend.

use super::level::Level;
use crate::on_every_level;

/// Numbers after which it is asked whether any was out of order.
const TOGETHER: usize = 1 << 12;

/// True if each of `numbers` is greater than the one before it.
pub(crate) fn ascends(numbers: &[u32]) -> bool {
    match Level::here() {
        // SAFETY: the processor has what this level asks for.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { avx512::ascends(numbers) },
        _ => plainly(numbers),
    }
}

on_every_level! {
    /// The same.
    fn plainly(numbers: &[u32]) -> bool {
        let later = numbers.get(1..).unwrap_or_default();
        // No early end within: a loop that may stop anywhere is not made wide.
        numbers.chunks(TOGETHER).zip(later.chunks(TOGETHER)).all(|(before, after)| {
            let pairs = before.iter().zip(after);
            pairs.fold(0, |falls, (before, after)| falls | u32::from(after <= before)) == 0
        })
    }
}

/// The same, each number read once: what is before a block is moved up out of the block before it.
#[cfg(target_arch = "x86_64")]
mod avx512 {
    use std::arch::x86_64::*;

    /// Numbers of a block.
    const LANES: usize = 16;

    /// # Safety
    ///
    /// The processor must have AVX-512 F.
    #[target_feature(enable = "avx512f")]
    pub(super) unsafe fn ascends(numbers: &[u32]) -> bool {
        // SAFETY: any bits are numbers.
        let (head, blocks, tail) = unsafe { numbers.align_to::<__m512i>() };
        let Some((first, rest)) = blocks.split_first() else { return super::plainly(numbers) };
        // With the number beside them, by which they hang together with the blocks.
        let (head, tail) = (&numbers[..=head.len()], &numbers[numbers.len() - tail.len() - 1..]);
        let falls = |block: __m512i, before: __m512i| {
            let earlier = _mm512_alignr_epi32::<{ LANES as i32 - 1 }>(block, before);
            _mm512_cmple_epu32_mask(block, earlier)
        };
        // Nothing is before the first number of all.
        let (mut before, mut any) = (*first, falls(*first, *first) & !1);
        for together in rest.chunks(super::TOGETHER / LANES) {
            for block in together {
                any |= falls(*block, before);
                before = *block;
            }
            if any != 0 {
                return false;
            }
        }
        any == 0 && super::plainly(head) && super::plainly(tail)
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn one_number_out_of_order_is_noticed_at_every_level(
            steps in proptest::collection::vec(1..200_000_u32, 0..10_000),
            wrong in proptest::option::of((0.0..1.0_f64, 0..3_u32)),
        ) {
            let mut sum = 0_u32;
            let mut numbers: Vec<u32> = steps
                .iter()
                .map(|step| {
                    sum += step;
                    sum
                })
                .collect();
            if let Some((place, lower)) = wrong
                && numbers.len() > 1
            {
                let place = 1 + (place * (numbers.len() - 1) as f64) as usize;
                numbers[place] = numbers[place - 1].saturating_sub(lower);
            }
            let expected = numbers.is_sorted_by(|before, after| before < after);
            for (level, found) in at_each_level(|| ascends(&numbers)) {
                prop_assert_eq!(found, expected, "{:?}", level);
            }
        }
    }

    #[test]
    fn none_and_one_and_the_ends_of_what_can_be_counted_ascend() {
        assert!(ascends(&[]) && ascends(&[7]) && ascends(&[0, u32::MAX]));
        assert!(!ascends(&[7, 7]) && !ascends(&[u32::MAX, 0]));
    }
}
