//! The emptiest and the fullest of some cells in a row.

use crate::on_every_level;

on_every_level! {
    /// The lowest and the highest sum of `length` neighbouring cells, where `before` tells the sum
    /// of all cells before each one and, at the end, of all. Where there are fewer, that of all.
    pub(crate) fn lowest_and_highest_run(before: &[u32], length: usize) -> (u32, u32) {
        let length = length.min(before.len().saturating_sub(1));
        let (mut lowest, mut highest) = (u32::MAX, 0);
        for (begun, ended) in before.iter().zip(&before[length..]) {
            let sum = ended.wrapping_sub(*begun);
            lowest = lowest.min(sum);
            highest = highest.max(sum);
        }
        (lowest, highest)
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_finds_the_lowest_and_the_highest_run(
            cells in proptest::collection::vec(0_u32..1000, 1..100),
            length in 1_usize..20,
        ) {
            let mut before = vec![0];
            cells.iter().for_each(|cell| before.push(before[before.len() - 1] + cell));
            let sums = || cells.windows(length).map(|run| run.iter().sum::<u32>());
            let all = cells.iter().sum();
            let expected = (sums().min().unwrap_or(all), sums().max().unwrap_or(all));
            for (level, found) in at_each_level(|| lowest_and_highest_run(&before, length)) {
                prop_assert_eq!(found, expected, "{:?}", level);
            }
        }
    }
}
