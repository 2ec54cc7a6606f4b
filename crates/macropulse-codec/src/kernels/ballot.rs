//! Votes for code words, added up to macropulses.

use crate::on_every_level;

/// Lags whose votes are added side by side; so many votes must follow the last place.
pub(crate) const BALLOT: usize = 64;

on_every_level! {
    /// Casts a vote for each place at which a code word would begin that has a mark at `tick`:
    /// `ballot` says how many for the places from `tick` on.
    pub(crate) fn vote(votes: &mut [u8], tick: usize, ballot: &[[u8; BALLOT]]) {
        let places = votes.get_mut(tick..).unwrap_or_default();
        for (places, ballot) in places.as_chunks_mut::<BALLOT>().0.iter_mut().zip(ballot) {
            for lane in 0..BALLOT {
                // A place has no more votes than a word has marks, of which there are few.
                places[lane] = places[lane].wrapping_add(ballot[lane]);
            }
        }
    }
}

on_every_level! {
    /// Appends the places with `least` votes or more, which is 1 to 128, to `elected`, in order.
    /// `votes` are those of whole [`BALLOT`]s from place `first` on. `false`, and not all of them,
    /// where more than `seats` are elected then.
    pub(crate) fn elect(
        votes: &[u8],
        first: usize,
        least: u8,
        elected: &mut Vec<u32>,
        seats: usize,
    ) -> bool {
        let least = least.clamp(1, 128);
        for (block, votes) in votes.as_chunks::<BALLOT>().0.iter().enumerate() {
            let mut any = 0;
            for lane in 0..BALLOT {
                any |= u8::from(votes[lane] >= least);
            }
            if any == 0 {
                continue;
            }
            for (part, votes) in votes.as_chunks::<8>().0.iter().enumerate() {
                // The highest bit of each byte says whether it is large enough.
                let votes = u64::from_le_bytes(*votes);
                let (ones, highest) = (0x0101_0101_0101_0101, 0x8080_8080_8080_8080);
                let with_rest = (votes & !highest) + ones * u64::from(128 - least);
                let mut enough = (with_rest | votes) & highest;
                while enough != 0 {
                    let lane = 8 * part + enough.trailing_zeros() as usize / 8;
                    elected.push((first + block * BALLOT + lane) as u32);
                    enough &= enough - 1;
                }
            }
            if elected.len() > seats {
                return false;
            }
        }
        true
    }
}

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
        fn every_level_casts_votes_and_elects(
            votes in proptest::collection::vec(prop_oneof![0_u8..4, any::<u8>()], 640),
            ballot in proptest::collection::vec(0_u8..3, 2 * BALLOT),
            tick in 0..700_usize,
            least in 1..=128_u8,
            seats in 0..200_usize,
        ) {
            let mut after = votes.clone();
            for (place, votes) in after.iter_mut().enumerate().skip(tick).take(2 * BALLOT) {
                *votes = votes.wrapping_add(ballot[place - tick]);
            }
            let ballot: Vec<[u8; BALLOT]> = ballot.as_chunks().0.to_vec();
            let cast = at_each_level(|| {
                let mut votes = votes.clone();
                vote(&mut votes, tick, &ballot);
                votes
            });
            for (level, votes) in cast {
                let whole = tick + (640_usize.saturating_sub(tick)) / BALLOT * BALLOT;
                prop_assert_eq!(&votes[..whole.min(640)], &after[..whole.min(640)], "{:?}", level);
            }
            let enough = (0..640).filter(|&place| votes[place as usize] >= least);
            let enough: Vec<u32> = enough.collect();
            let elections = at_each_level(|| {
                let mut elected = Vec::new();
                let all = elect(&votes[..320], 0, least, &mut elected, seats)
                    && elect(&votes[320..], 320, least, &mut elected, seats);
                (all, elected)
            });
            for (level, (all, elected)) in elections {
                prop_assert_eq!(all, enough.len() <= seats, "{:?}", level);
                prop_assert_eq!(&elected[..], &enough[..elected.len()]);
                prop_assert!(!all || elected.len() == enough.len());
            }
        }

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
