//! Acquisition of a shot: the lag with most marks, over the whole gate.
//!
//! Every tick of the residual votes: one that is a mark of the code word says where the word began.
//! A macropulse of B lit bits with k marks found has k/B or more of them in one of its code words.
//! No lag with `least` marks is overlooked where every place with `least`/B votes is looked at, and
//! the votes at all lit bits added up.
//!
//! Where ticks are dense, and so many marks of a word stand out among them, the marks are counted
//! for blocks of places instead, those with too few ticks left out.

use std::ops::Range;

use super::correlator::BLOCK;
use super::residual::Residual;
use crate::kernels::{BALLOT, Marks, Pattern, elect, highest_sum, lit_in, vote, with_marks};

/// What is looked for: a macropulse, taken apart.
#[derive(Debug)]
pub(super) struct Sought<'a> {
    /// The code word.
    pub word: Marks<'a>,
    /// The same as bits.
    pub pattern: &'a Pattern,
    /// Ticks from the start of the macropulse to each lit bit.
    pub bits: &'a [usize],
    /// Number of lags tried.
    pub lags: usize,
    /// Fewest marks that are of interest.
    pub least: u16,
    /// Marks of a code word that hardly any place has by chance.
    pub stands_out: u16,
}

impl Sought<'_> {
    /// Places at which a code word may begin.
    fn places(&self) -> usize {
        self.lags + self.bits.last().copied().unwrap_or(0)
    }

    /// Ticks of a code word.
    fn reach(&self) -> usize {
        self.word.last() + 1
    }

    /// Fewest marks in one of its code words, at least: else there are fewer than `least` in all.
    fn in_one_word(&self) -> u16 {
        self.least.div_ceil(self.bits.len().max(1) as u16)
    }

    /// The lag with most marks, the earliest of several, of those at which a code word begins at
    /// one of the places `elected`. `marks` tells how many marks a place has.
    fn best_of(&self, elected: &[u32], marks: impl Fn(usize) -> u16) -> Option<Candidate> {
        let mut best = Candidate { lag: usize::MAX, count: self.least };
        for &place in elected {
            for bit in self.bits {
                let Some(lag) = (place as usize).checked_sub(*bit) else { break };
                if lag >= self.lags {
                    continue;
                }
                let count = self.bits.iter().map(|other| marks(lag + other)).sum();
                if count > best.count || (count == best.count && lag < best.lag) {
                    best = Candidate { lag, count };
                }
            }
        }
        (best.lag != usize::MAX).then_some(best)
    }
}

/// A lag and how many marks were found at it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Candidate {
    pub lag: usize,
    pub count: u16,
}

/// Memory kept from shot to shot.
#[derive(Debug, Default)]
pub(super) struct Search {
    /// Votes for each place at which a code word may begin, from one word before the first tick.
    votes: Vec<u8>,
    /// The votes of one tick.
    ballot: Vec<[u8; BALLOT]>,
    /// Where there are votes.
    touched: Vec<Range<usize>>,
    /// Places with enough votes.
    elected: Vec<u32>,
    /// Places at which a mark counts as found in the residual.
    lit: Vec<u64>,
    /// Blocks of places with enough ticks.
    blocks: Vec<i64>,
}

/// What it takes to count the marks of a word in a block of places, in votes.
const VOTES_PER_BLOCK: usize = 64;

/// Votes that a place has room for.
const MOST_VOTES: usize = u8::MAX as usize;

/// If more than one in so many places is elected, all of them are looked at in order.
const FEW: usize = 256;

impl Search {
    /// The lag, in ticks from `first`, at which most marks of `sought` are in the residual;
    /// the earliest of several. A mark also counts if one of the `width` − 1 next ticks is lit.
    /// `None` where no lag has `least` of them.
    pub fn best(
        &mut self,
        residual: &Residual,
        at: (i64, u32),
        sought: &Sought,
    ) -> Option<Candidate> {
        let (first, width) = at;
        if sought.bits.is_empty() || sought.word.len() == 0 {
            return None;
        }
        let needed = sought.in_one_word();
        let span = first..first + (sought.places() + sought.reach()) as i64 + i64::from(width);
        let votes = (residual.at_most(span) * width) as usize * sought.word.len();
        let uncounted = sought.word.len() > MOST_VOTES;
        if needed >= sought.stands_out || uncounted {
            self.choose_blocks(residual, at, sought);
            if VOTES_PER_BLOCK * self.blocks.len() < votes || uncounted {
                return self.by_words(residual, at, sought);
            }
        }
        self.by_votes(residual, at, sought)
    }

    /// The blocks of places where the residual has enough ticks for a code word.
    fn choose_blocks(&mut self, residual: &Residual, at: (i64, u32), sought: &Sought) {
        let ((first, width), places) = (at, sought.places() as i64);
        let length = BLOCK + sought.reach() as i64 + i64::from(width);
        let runs = residual.runs(first..first + places + length);
        let needed = u32::from(sought.in_one_word());
        let enough = |block: &i64| {
            let start = first + block;
            runs.at_most_in(start..start + length) * width >= needed
        };
        self.blocks.clear();
        self.blocks.extend((0..places).step_by(BLOCK as usize).filter(enough));
    }

    fn by_words(
        &mut self,
        residual: &Residual,
        at: (i64, u32),
        sought: &Sought,
    ) -> Option<Candidate> {
        if self.blocks.is_empty() {
            return None;
        }
        let (first, width) = at;
        let length = (sought.places() + sought.reach()) as i64 + 2 * BLOCK;
        let begin = residual.lit(first..first + length, width, &mut self.lit);
        self.elected.clear();
        for &block in &self.blocks {
            let place = begin + block as usize;
            let lit = with_marks(&self.lit, place, sought.word, sought.in_one_word());
            for (lane, mut lit) in lit.into_iter().enumerate() {
                while lit != 0 {
                    self.elected.push(block as u32 + 64 * lane as u32 + lit.trailing_zeros());
                    lit &= lit - 1;
                }
            }
        }
        let marks = |place| lit_in(&self.lit, begin + place, sought.pattern) as u16;
        sought.best_of(&self.elected, marks)
    }

    fn by_votes(
        &mut self,
        residual: &Residual,
        at: (i64, u32),
        sought: &Sought,
    ) -> Option<Candidate> {
        let ((first, width), reach, places) = (at, sought.reach(), sought.places());
        self.votes.resize(self.votes.len().max(places + 2 * reach + 3 * BALLOT), 0);
        self.ballot.clear();
        self.ballot.resize(reach / BALLOT + 1, [0; BALLOT]);
        for &mark in sought.word.word {
            let offset = reach - sought.word.scale * usize::from(mark);
            self.ballot[offset / BALLOT][offset % BALLOT] += 1;
        }
        let length = self.ballot.len() * BALLOT;
        self.touched.clear();
        for_each_tick(residual, (first, places + reach), width, |tick| {
            vote(&mut self.votes, tick, &self.ballot);
            match self.touched.last_mut() {
                Some(last) if tick <= last.end => last.end = tick + length,
                _ => self.touched.push(tick..tick + length),
            }
        });
        let best = self.elected(sought);
        for touched in &self.touched {
            self.votes[touched.clone()].fill(0);
        }
        best
    }

    /// The lag with most votes.
    fn elected(&mut self, sought: &Sought) -> Option<Candidate> {
        let (reach, needed) = (sought.reach(), sought.in_one_word().min(128) as u8);
        let votes = &self.votes[reach..];
        self.elected.clear();
        let few = self.touched.iter().all(|touched| {
            // Nothing can begin before the first place.
            let places = touched.start.saturating_sub(reach)..touched.end.saturating_sub(reach);
            let end = places.start + places.len().next_multiple_of(BALLOT);
            let votes = votes.get(places.start..end).unwrap_or_default();
            elect(votes, places.start, needed, &mut self.elected, sought.places() / FEW)
        });
        if few {
            return sought.best_of(&self.elected, |place| u16::from(votes[place]));
        }
        let best = highest_sum(votes, sought.bits, sought.lags, sought.least);
        best.map(|(lag, count)| Candidate { lag, count })
    }
}

/// Calls `on_tick` with every place, counted from `stretch.0`, at which a mark would count as
/// found.
fn for_each_tick(
    residual: &Residual,
    stretch: (i64, usize),
    width: u32,
    mut on_tick: impl FnMut(usize),
) {
    let (first, length) = (stretch.0, stretch.1 as i64);
    let late = i64::from(width) - 1;
    let mut next = 0;
    residual.for_each(first..first + length + late, |tick| {
        let place = tick - first;
        for place in next.max(place - late)..=place.min(length - 1) {
            on_tick(place as usize);
        }
        next = place + 1;
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    const WORD: [u16; 5] = [0, 6, 12, 18, 19];

    fn pattern() -> Pattern {
        Pattern::new(WORD.into_iter().map(usize::from), 1)
    }

    fn sought(pattern: &Pattern, least: u16) -> Sought<'_> {
        let word = Marks { word: &WORD, bits: &[0], scale: 1 };
        Sought { word, pattern, bits: &[0, 50, 75], lags: 900, least, stands_out: 6 }
    }

    /// Every lag by itself.
    fn exhaustive(residual: &Residual, first: i64, width: i64) -> Candidate {
        let pattern = pattern();
        let Sought { bits, lags, .. } = sought(&pattern, 1);
        let count = |lag: usize| {
            let starts = bits.iter().map(|bit| first + (lag + bit) as i64);
            let places =
                starts.flat_map(|start| WORD.iter().map(move |&mark| start + i64::from(mark)));
            places.filter(|&place| residual.any(place, width as u32)).count()
        };
        let lag = (0..lags).rev().max_by_key(|&lag| count(lag)).unwrap();
        Candidate { lag, count: count(lag) as u16 }
    }

    #[test]
    fn the_best_lag_is_that_of_an_exhaustive_search() {
        let mut chance = ChaCha8Rng::seed_from_u64(2);
        let (mut search, pattern) = (Search::default(), pattern());
        for lit in [0, 3, 30, 300] {
            for width in [1, 2, 4] {
                let lit: Vec<u32> = (0..lit).map(|_| chance.next_u32() % 1050).collect();
                let residual = Residual::new(&lit, -50..1100, vec![]);
                let expected = exhaustive(&residual, -7, i64::from(width));
                for least in 1..=15 {
                    let (at, sought) = ((-7, width), sought(&pattern, least));
                    let expected = Some(expected).filter(|expected| expected.count >= least);
                    let found = search.best(&residual, at, &sought);
                    assert_eq!(found, expected, "{least} of 15, width {width}");
                    search.choose_blocks(&residual, at, &sought);
                    let found = search.by_words(&residual, at, &sought);
                    assert_eq!(found, expected, "{least} of 15 by words, width {width}");
                }
            }
        }
    }

    #[test]
    fn a_shot_without_light_is_not_found() {
        let residual = Residual::new(&[], 0..1000, vec![]);
        let pattern = pattern();
        let dark = Sought { bits: &[], ..sought(&pattern, 1) };
        assert_eq!(Search::default().best(&residual, (0, 1), &dark), None);
        assert_eq!(Search::default().best(&residual, (0, 1), &sought(&pattern, 1)), None);
    }
}
