//! Votes for code words, added up to macropulses.

use super::level::on_every_level;

/// Lags whose votes are added side by side; so many votes must follow the last place.
pub(crate) const BALLOT: usize = 64;

on_every_level! {
    /// The lag below `lags` with the highest sum of `votes[start + lag]` over all `starts`, the
    /// earliest of several, and the sum; `None` where none reaches `least`.
    pub(crate) fn highest_sum(
        votes: &[u8],
        starts: &[usize],
        lags: usize,
        least: u16,
    ) -> Option<(usize, u16)> {
        let mut best = None;
        let mut wanted = least.max(1);
        for first in (0..lags).step_by(BALLOT) {
            let mut sums = [0_u8; BALLOT];
            for start in starts {
                let place = start + first;
                let Some(votes) = votes.get(place..place + BALLOT) else { continue };
                for lane in 0..BALLOT {
                    sums[lane] = sums[lane].saturating_add(votes[lane]);
                }
            }
            let enough = wanted.min(255) as u8;
            let mut any = 0;
            for sum in sums {
                any |= u8::from(sum >= enough);
            }
            if any == 0 {
                continue;
            }
            for lag in first..lags.min(first + BALLOT) {
                let mut sum = 0;
                for start in starts {
                    sum += u16::from(votes[start + lag]);
                }
                if sum >= wanted {
                    best = Some((lag, sum));
                    wanted = sum + 1;
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_finds_the_earliest_highest_sum(
            votes in proptest::collection::vec(0_u8..60, 1000),
            starts in proptest::collection::btree_set(0_usize..500, 1..13),
            lags in 1_usize..400,
            least in 0_u16..900,
        ) {
            let starts: Vec<usize> = starts.into_iter().collect();
            let sum = |lag: usize| starts.iter().map(|s| u16::from(votes[s + lag])).sum::<u16>();
            let highest = (0..lags).rev().max_by_key(|&lag| sum(lag)).map(|lag| (lag, sum(lag)));
            let expected = highest.filter(|&(_, sum)| sum >= least.max(1));
            for (level, found) in at_each_level(|| highest_sum(&votes, &starts, lags, least)) {
                prop_assert_eq!(found, expected, "{:?}", level);
            }
        }
    }
}
