//! Words with all distances between marks different: optical orthogonal codes \[CSW89\] of words in time, not
//! in a circle, for detectors that cannot tell one chip from the next.
//!
//! Let D be the distances from each mark of a word to each later one, of all words together. Every one of
//! them is `gap` chips or more, and any two are `apart` chips or more from each other. If two marks of one
//! word met two of another, or of itself shifted, two distances would be the same. So no more than one mark
//! meets another, even of pulses that are up to `apart` chips long. A channel is taken to be blind for a
//! `gap` behind each mark that it sends. An echo loses two marks to that at no range, if there is room, and
//! else at few ([`super::followers`]).

use std::sync::{Mutex, PoisonError};

use super::super::{CodeWord, Error};
use super::{chance::Chance, followers};

/// Words drawn at random, with all distances between marks different.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Separated {
    /// Chips of a word, 1 to 65535: the marks lie within.
    pub length: u32,
    /// Marks of a word, 1 to 64.
    pub weight: u32,
    /// Number of words, 1 to 4096.
    pub words: u32,
    /// Least distance between marks of a word, in chips.
    pub gap: u32,
    /// Least difference between any two of the distances, in chips.
    pub apart: u32,
    /// Up to how many words later an echo of a word may come, 0 to 16: the shots of a channel in flight.
    pub later: u32,
    /// Seed of the words.
    pub seed: u64,
}

/// More marks have 2000 distances or more, which hardly fit into any word.
const MOST_MARKS: u32 = 64;

/// More words of three marks do not fit into the longest word.
const MOST_WORDS: u32 = 4096;

/// More words behind each other have no room.
const MOST_LATER: u32 = 16;

/// Places looked at at most, for each mark that there is: half a second.
const MOST_LOOKED_AT: u64 = 1 << 25;

/// Number of times that a word is begun anew if the last marks find no room, and that the family is. With 3
/// marks in 238 chips, 20 and 5 apart, two beginnings in three find ten words, and one in five finds eleven.
/// With this number of beginnings, four seeds of twenty find twelve, and none finds thirteen.
const TRIES: u32 = 32;

/// The families that were drawn last, the last one at the end. A search of designs asks for the same one hundreds of times,
/// and drawing it takes longer than all else that is made of a code.
static KNOWN: Mutex<Vec<(Separated, Found)>> = Mutex::new(Vec::new());

/// Families in [`KNOWN`] at most.
const MOST_KNOWN: usize = 16;

type Found = Result<Vec<CodeWord>, Error>;

/// Returns all the words that were asked for.
pub(super) fn found(family: &Separated) -> Found {
    let known = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, found)) = known().iter().find(|(known, _)| known == family) {
        return found.clone();
    }
    let found = found_anew(family);
    let mut known = known();
    if known.len() == MOST_KNOWN {
        drop(known.remove(0));
    }
    known.push((*family, found.clone()));
    found
}

fn found_anew(family: &Separated) -> Found {
    let &Separated { length, weight, words, gap, apart, later, .. } = family;
    super::checked_length(length, weight)?;
    if weight > MOST_MARKS {
        return Err(Error::Weight { weight, length: length.min(MOST_MARKS) });
    }
    if !(1..=MOST_WORDS).contains(&words) {
        return Err(Error::Words { words, possible: MOST_WORDS });
    }
    let (mut most, mut left) = (0, MOST_LOOKED_AT);
    if later > MOST_LATER {
        return Err(Error::Later { later, possible: MOST_LATER });
    }
    // All distances must lie apart; if there is no room for them, more tries do not help.
    let distances = u64::from(words) * u64::from(weight) * u64::from(weight - 1) / 2;
    let room = u64::from(length.saturating_sub(gap)) / u64::from(apart.max(1)) + 1;
    for attempt in 0..if distances <= room { TRIES } else { 0 } {
        let all = drawn(family, attempt, &mut left);
        if all.len() == words as usize {
            // Behind those with which families are begun.
            let mut chance = Chance::new(family.seed, TRIES.into());
            return Ok(followers::redrawn(family, all, &mut chance));
        }
        most = most.max(all.len() as u32);
    }
    Err(Error::Crowded { words, weight, length, gap, apart, found: most })
}

/// Words one after another, as long as there is room for another one.
fn drawn(family: &Separated, attempt: u32, left: &mut u64) -> Vec<CodeWord> {
    let mut taken = vec![false; family.length as usize];
    let mut chance = Chance::new(family.seed, attempt.into());
    let mut words = Vec::new();
    while words.len() < family.words as usize {
        let Some((marks, now)) =
            (0..TRIES).find_map(|_| word(family, taken.clone(), (&mut chance, left)))
        else {
            return words;
        };
        taken = now;
        words.push(CodeWord { length: family.length, marks });
    }
    words
}

impl Separated {
    /// Marks a `distance`, and what is nearer to it than `apart`, as `taken`.
    pub(super) fn take(&self, taken: &mut [bool], distance: usize) {
        let apart = self.apart.max(1) as usize;
        let end = (distance + apart).min(taken.len());
        taken[(distance + 1).saturating_sub(apart)..end].fill(true);
    }
}

/// A word with marks at places drawn among all that are possible, and the distances that are `taken` then.
pub(super) fn word(
    family: &Separated,
    mut taken: Vec<bool>,
    (chance, left): (&mut Chance, &mut u64),
) -> Option<(Vec<u16>, Vec<bool>)> {
    let [gap, apart] = [family.gap, family.apart].map(|chips| chips.max(1) as usize);
    let mut marks = vec![0_usize];
    let mut distances = Vec::new();
    while marks.len() < family.weight as usize {
        *left = left.checked_sub(taken.len() as u64 * marks.len() as u64)?;
        let fits = |place: &usize| {
            distances.clear();
            let all = marks.iter().map(|mark| place.abs_diff(*mark));
            let free = all.take_while(|distance| *distance >= gap && !taken[*distance]);
            distances.extend(free);
            distances.len() == marks.len() && {
                distances.sort_unstable();
                distances.windows(2).all(|pair| pair[1] - pair[0] >= apart)
            }
        };
        let possible: Vec<usize> = (1..taken.len()).filter(fits).collect();
        let place = *possible.get(chance.below(possible.len() as u32) as usize)?;
        for mark in &marks {
            family.take(&mut taken, place.abs_diff(*mark));
        }
        marks.push(place);
    }
    marks.sort_unstable();
    Some((marks.into_iter().map(|mark| mark as u16).collect(), taken))
}

#[cfg(test)]
mod tests {
    use super::super::Family;
    use super::*;

    const D2: Separated =
        Separated { length: 238, weight: 3, words: 10, gap: 20, apart: 5, later: 2, seed: 1 };

    /// All distances between marks of all words, counted here pair by pair.
    fn distances(words: &[CodeWord]) -> Vec<u16> {
        let mut all = Vec::new();
        for word in words {
            for (index, mark) in word.marks.iter().enumerate() {
                all.extend(word.marks[index + 1..].iter().map(|later| later - mark));
            }
        }
        all.sort_unstable();
        all
    }

    #[test]
    fn all_distances_are_as_far_apart_as_asked() {
        for seed in 0..8 {
            let of = |length, weight, words, gap, apart| Separated {
                length,
                weight,
                words,
                gap,
                apart,
                later: 2,
                seed,
            };
            for family in [
                Separated { seed, ..D2 },
                of(400, 4, 8, 3, 2),
                of(50, 3, 4, 1, 1),
                of(30, 1, 3, 9, 9),
                of(1000, 8, 1, 10, 3),
            ] {
                let words = found(&family).unwrap();
                assert_eq!(words.len(), family.words as usize);
                assert!(words.iter().all(|word| word.weight() == family.weight as usize));
                assert!(words.iter().all(|word| word.marks[0] == 0));
                let all = distances(&words);
                assert!(all.iter().all(|distance| u32::from(*distance) >= family.gap));
                let is_apart = |pair: &[u16]| u32::from(pair[1] - pair[0]) >= family.apart;
                assert!(all.windows(2).all(is_apart), "{family:?}: {all:?}");
                assert!(all.iter().all(|distance| u32::from(*distance) < family.length));
            }
        }
    }

    /// Shifted by any number of chips, no word has two marks within two chips of marks of another word, or
    /// of its own; words drawn without regard of distances have.
    #[test]
    fn pulses_of_two_words_meet_once_at_most() {
        let meet_twice = |words: &[CodeWord]| {
            let mut often = 0;
            for (one, a) in words.iter().enumerate() {
                for (other, b) in words.iter().enumerate() {
                    for shift in -240_i32..=240 {
                        let near = |mark: &u16| {
                            b.marks.iter().any(|theirs| {
                                (i32::from(*mark) + shift - i32::from(*theirs)).abs() <= 1
                            })
                        };
                        let met = a.marks.iter().filter(|mark| near(mark)).count();
                        often += u32::from(met > 1 && (one != other || shift.abs() > 1));
                    }
                }
            }
            often
        };
        assert_eq!(meet_twice(&found(&D2).unwrap()), 0);
        let sparse = super::super::Sparse { length: 238, weight: 3, words: 10, gap: 20, seed: 1 };
        assert!(meet_twice(&Family::sparse(sparse).unwrap().words()) > 0);
    }

    #[test]
    fn what_has_no_room_is_refused_soon() {
        let told = |family: Separated| found(&family).unwrap_err().to_string();
        let crowded = told(Separated { words: 40, ..D2 });
        assert!(crowded.contains("of 40 words of 3 marks in 238 chips"), "{crowded}");
        assert!(told(Separated { weight: 65, ..D2 }).contains("65 marks"));
        assert!(told(Separated { words: 5000, ..D2 }).contains("5000 words"));
        assert!(told(Separated { gap: 300, ..D2 }).contains("0 of 10"));
        // There is just room for the distances of 14 words: they are searched for, and not found.
        assert!(told(Separated { words: 14, ..D2 }).contains("of 14 words"));
    }
}
