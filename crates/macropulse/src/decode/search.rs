//! The lag of a shot when nothing is known of it: every tick votes.
//!
//! A tick that is a mark of the code word says where the word began. The votes for the code words
//! at the lit bits of the payload, added up, are the marks of the macropulse.
//!
//! Where ticks are dense there are too many of them to vote. A macropulse of B lit bits with k
//! marks found has k/B or more of them in one of its code words: if so many stand out, no lag with
//! `least` marks is overlooked where every place with `least`/B marks of a word is looked at.

use super::unexplained::Unexplained;
use crate::kernels::{BALLOT, BLOCK_WORDS, highest_sum, with_marks};

/// What is looked for: a macropulse, taken apart.
#[derive(Debug)]
pub(super) struct Sought {
    /// Ticks from the start of the code word to each mark.
    pub word: Vec<usize>,
    /// Ticks from the start of the macropulse to each lit bit.
    pub bits: Vec<usize>,
    /// Number of lags tried.
    pub lags: usize,
    /// Fewest marks that are of interest.
    pub least: u16,
}

impl Sought {
    /// Places at which a code word may begin.
    pub fn places(&self) -> usize {
        self.lags + self.bits.last().copied().unwrap_or(0)
    }

    /// The lag with most marks, the earliest of several, of those at which a code word begins that
    /// was `elected`, by place. `marks` tells how many marks a place has at most, and `count` how
    /// many a lag has.
    fn best_of(
        &self,
        elected: impl Iterator<Item = usize>,
        marks: impl Fn(usize) -> u16,
        count: impl Fn(usize) -> u16,
    ) -> Option<Candidate> {
        let needed = self.in_one_word();
        let mut best = Candidate { lag: usize::MAX, count: self.least };
        for place in elected {
            for bit in &self.bits {
                let Some(lag) = place.checked_sub(*bit).filter(|lag| *lag < self.lags) else {
                    continue;
                };
                let mut seen_before = false;
                let mut most = 0;
                for other in &self.bits {
                    let marks = marks(lag + other);
                    seen_before |= other < bit && marks >= needed;
                    most += marks;
                }
                if seen_before || most < best.count {
                    continue;
                }
                let count = count(lag);
                if count > best.count || (count == best.count && lag < best.lag) {
                    best = Candidate { lag, count };
                }
            }
        }
        (best.lag != usize::MAX).then_some(best)
    }

    /// Marks that are unexplained if the macropulse begins at `start`.
    fn count(&self, unexplained: &Unexplained, start: i64, width: u32) -> u16 {
        let starts = self.bits.iter().map(|&bit| start + bit as i64);
        starts.map(|start| self.count_word(unexplained, start, width)).sum()
    }

    /// Marks that are unexplained if the code word begins at `start`.
    fn count_word(&self, unexplained: &Unexplained, start: i64, width: u32) -> u16 {
        unexplained.count(self.word.iter().map(|&mark| start + mark as i64), width)
    }

    /// Fewest marks in one of its code words, at least: else there are fewer than `least` in all.
    pub fn in_one_word(&self) -> u16 {
        self.least.div_ceil(self.bits.len().max(1) as u16)
    }
}

/// As [`Search::best`], where a code word with so many marks stands out among all ticks: then
/// code words are looked for in blocks of lags, however many ticks there are, and only where one
/// is found are its unexplained marks counted. `all` is the field of all ticks, the bit in it at
/// which the search begins, and the marks of the word and ticks per chip.
pub(super) fn among_words(
    all: (&[u64], usize, (&[u16], usize)),
    unexplained: &Unexplained,
    at: (i64, u32),
    sought: &Sought,
) -> Option<Candidate> {
    let ((words, begin, marks), (first, width)) = (all, at);
    let (needed, reach) = (sought.in_one_word(), sought.word.last()? + 64 * BLOCK_WORDS);
    // Where code words begin, and how many of their marks are unexplained.
    let mut elected: Vec<(usize, u16)> = Vec::new();
    for block in (0..sought.places()).step_by(64 * BLOCK_WORDS) {
        let start = first + block as i64;
        if unexplained.at_most(start..start + reach as i64 + i64::from(width)) * width
            < u32::from(needed)
        {
            continue;
        }
        let lit = with_marks(words, begin + block, marks, needed);
        for (lane, mut lit) in lit.into_iter().enumerate() {
            while lit != 0 {
                let place = block + 64 * lane + lit.trailing_zeros() as usize;
                lit &= lit - 1;
                // Most of what stands out is explained.
                let found = sought.count_word(unexplained, first + place as i64, width);
                if found >= needed {
                    elected.push((place, found));
                }
            }
        }
    }
    let marks = |place: usize| {
        let known = elected.binary_search_by_key(&place, |word| word.0);
        known.map_or(needed - 1, |at| elected[at].1)
    };
    let count = |lag| sought.count(unexplained, first + lag as i64, width);
    sought.best_of(elected.iter().map(|word| word.0), marks, count)
}

/// A lag and how many marks were found at it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Candidate {
    pub lag: usize,
    pub count: u16,
}

/// The ballot, kept from shot to shot.
#[derive(Debug, Default)]
pub(super) struct Search {
    /// Votes for each place at which a code word may begin, from one word before the first tick.
    votes: Vec<u8>,
}

impl Search {
    /// The lag, in ticks from `first`, at which most marks of `sought` are unexplained; the
    /// earliest of several. A mark also counts if one of the `width` − 1 next ticks is lit.
    /// `None` where no lag has `least` of them.
    pub fn best(
        &mut self,
        unexplained: &Unexplained,
        at: (i64, u32),
        sought: &Sought,
    ) -> Option<Candidate> {
        let (first, width) = at;
        let reach = sought.word.last()? + 1;
        let places = sought.places();
        self.votes.resize(self.votes.len().max(places + 2 * reach + BALLOT), 0);
        let offsets: Vec<usize> = sought.word.iter().map(|mark| reach - mark).collect();

        let mut ticks = 0;
        for_each_tick(unexplained, (first, places + reach), width, |tick| {
            ticks += 1;
            let ballot = &mut self.votes[tick..=tick + reach];
            // A place has no more votes than the word has marks, of which there are few.
            offsets.iter().for_each(|&offset| ballot[offset] = ballot[offset].wrapping_add(1));
        });
        let starts: Vec<usize> = sought.bits.iter().map(|bit| reach + bit).collect();
        let best = highest_sum(&self.votes, &starts, sought.lags, sought.least);
        // Few ticks: taking every vote back is less work than wiping the whole ballot.
        if ticks * sought.word.len() * 16 < places {
            for_each_tick(unexplained, (first, places + reach), width, |tick| {
                offsets.iter().for_each(|offset| self.votes[tick + offset] = 0);
            });
        } else {
            self.votes.fill(0);
        }
        best.map(|(lag, count)| Candidate { lag, count })
    }
}

/// Calls `on_tick` with every place, counted from `stretch.0`, at which a mark would count as found.
fn for_each_tick(
    unexplained: &Unexplained,
    stretch: (i64, usize),
    width: u32,
    mut on_tick: impl FnMut(usize),
) {
    let (first, length) = (stretch.0, stretch.1 as i64);
    let late = i64::from(width) - 1;
    let mut next = 0;
    unexplained.for_each(first..first + length + late, |tick| {
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

    fn sought(least: u16) -> Sought {
        Sought { word: vec![0, 6, 12, 18, 19], bits: vec![0, 50, 75], lags: 900, least }
    }

    /// Every lag by itself.
    fn exhaustive(unexplained: &Unexplained, first: i64, width: i64) -> Candidate {
        let Sought { word, bits, lags, .. } = sought(1);
        let count = |lag: usize| {
            let starts = bits.iter().map(|bit| first + (lag + bit) as i64);
            let places = starts.flat_map(|start| word.iter().map(move |&mark| start + mark as i64));
            places.filter(|&place| unexplained.any(place, width as u32)).count()
        };
        let lag = (0..lags).rev().max_by_key(|&lag| count(lag)).unwrap();
        Candidate { lag, count: count(lag) as u16 }
    }

    #[test]
    fn the_best_lag_is_that_of_an_exhaustive_search() {
        let mut chance = ChaCha8Rng::seed_from_u64(2);
        let mut search = Search::default();
        for lit in [0, 3, 30, 300] {
            for width in [1, 2, 4] {
                let lit: Vec<u32> = (0..lit).map(|_| chance.next_u32() % 1050).collect();
                let unexplained = Unexplained::new(&lit, -50..1100, vec![]);
                let expected = exhaustive(&unexplained, -7, i64::from(width));
                let mut words = vec![0; 40];
                for place in 0..1200 {
                    if unexplained.any(place - 7, width) {
                        words[place as usize / 64] |= 1 << (place % 64);
                    }
                }
                for least in 1..=15 {
                    let (at, sought) = ((-7, width), sought(least));
                    let expected = Some(expected).filter(|expected| expected.count >= least);
                    let found = search.best(&unexplained, at, &sought);
                    assert_eq!(found, expected, "{least} of 15, width {width}");
                    let all = (words.as_slice(), 0, (&[0, 6, 12, 18, 19][..], 1));
                    let found = among_words(all, &unexplained, at, &sought);
                    assert_eq!(found, expected, "{least} of 15 by words, width {width}");
                }
            }
        }
    }

    #[test]
    fn a_shot_without_light_is_not_found() {
        let unexplained = Unexplained::new(&[], 0..1000, vec![]);
        let dark = Sought { word: vec![0], bits: vec![], lags: 900, least: 1 };
        assert_eq!(Search::default().best(&unexplained, (0, 1), &dark), None);
        assert_eq!(Search::default().best(&unexplained, (0, 1), &sought(1)), None);
    }
}
