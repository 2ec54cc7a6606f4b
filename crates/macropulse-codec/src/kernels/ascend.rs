//! Whether numbers ascend.

use crate::on_every_level;

/// Numbers after which it is asked whether any was out of order.
const TOGETHER: usize = 1 << 12;

on_every_level! {
    /// Whether each of `numbers` is greater than the one before it.
    pub(crate) fn ascends(numbers: &[u32]) -> bool {
        let later = numbers.get(1..).unwrap_or_default();
        // No early end within: a loop that may stop anywhere is not made wide.
        numbers.chunks(TOGETHER).zip(later.chunks(TOGETHER)).all(|(before, after)| {
            let pairs = before.iter().zip(after);
            pairs.fold(0, |falls, (before, after)| falls | u32::from(after <= before)) == 0
        })
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
