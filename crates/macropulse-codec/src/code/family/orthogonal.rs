//! Optical orthogonal codes (n, w, 1): any two words coincide in one mark at most, whatever the
//! shift, and so does a word with itself \[CSW89\].
//!
//! That is so if every distance between two marks of a word, taken both ways around its n chips,
//! occurs once in the whole family. A word uses w·(w − 1) of the n − 1 distances there are: hence
//! the Johnson bound ⌊(n − 1)/(w·(w − 1))⌋ on the number of words.
//!
//! The words are found by search: mark by mark the next chip is taken whose distances are all free,
//! going back where there is none. A round goes through the chips in one order until no further
//! word is found; the best of some rounds is kept. That reaches the bound where marks are few, and
//! else about nine tenths of it.

use super::super::{CodeWord, Error};
use super::chance::Chance;

/// Orders of the chips that are tried, the first one ascending.
const ROUNDS: u64 = 24;

/// Chips that are tried in a round before it is given up.
const STEPS: u32 = 1 << 19;

/// Number of words that exist at most.
pub(super) fn johnson_bound(length: u32, weight: u32) -> u32 {
    length.saturating_sub(1) / (weight * weight.saturating_sub(1)).max(1)
}

/// Returns the number of words that the search finds, asked for `wanted` or, without that, for all there may
/// be.
///
/// # Errors
/// If there cannot be that many words, or the search finds fewer than `wanted`, or none.
pub(super) fn found(length: u32, weight: u32, wanted: Option<u32>) -> Result<u32, Error> {
    super::checked_length(length, weight)?;
    // A single mark has no distances, and every word of it is the same one.
    let bound = if weight == 1 { 1 } else { johnson_bound(length, weight) };
    let asked = wanted.unwrap_or(bound.max(1));
    if asked == 0 || asked > bound {
        return Err(Error::JohnsonBound { words: asked, length, weight, bound });
    }
    let found = words(length, weight, asked).len() as u32;
    if found == 0 || wanted.is_some_and(|wanted| found < wanted) {
        return Err(Error::NotFound { words: asked, length, weight, found });
    }
    Ok(found)
}

/// Returns the words that the search finds, `wanted` at most.
pub(super) fn words(length: u32, weight: u32, wanted: u32) -> Vec<CodeWord> {
    let mut best: Vec<Vec<u32>> = Vec::new();
    for round in 0..ROUNDS {
        let found = Round::new(length, round).run(weight as usize, wanted as usize);
        if found.len() > best.len() {
            best = found;
        }
        if best.len() >= wanted as usize {
            break;
        }
    }
    let word = |marks: Vec<u32>| CodeWord {
        length,
        marks: marks.into_iter().map(|mark| mark as u16).collect(),
    };
    best.into_iter().map(word).collect()
}

struct Round {
    length: u32,
    /// The chips after the first one, in the order in which they are tried.
    order: Vec<u32>,
    /// Which distances are taken.
    taken: Vec<bool>,
    steps: u32,
}

impl Round {
    fn new(length: u32, round: u64) -> Self {
        let mut order: Vec<u32> = (1..length).collect();
        if round > 0 {
            Chance::new(round, 0).shuffle(&mut order);
        }
        Self { length, order, taken: vec![false; length as usize], steps: STEPS }
    }

    fn run(mut self, weight: usize, wanted: usize) -> Vec<Vec<u32>> {
        let mut found = Vec::new();
        let mut marks = vec![0];
        while found.len() < wanted && self.complete(&mut marks, (weight, 0)) {
            let mut word = std::mem::replace(&mut marks, vec![0]);
            word.sort_unstable();
            found.push(word);
        }
        found
    }

    /// Adds marks until there are `weight`, those from place `from` of the order on.
    fn complete(&mut self, marks: &mut Vec<u32>, (weight, from): (usize, usize)) -> bool {
        if marks.len() == weight {
            return true;
        }
        for place in from..self.order.len() {
            if self.steps == 0 {
                return false;
            }
            self.steps -= 1;
            let chip = self.order[place];
            let Some(added) = self.take(marks, chip) else { continue };
            marks.push(chip);
            if self.complete(marks, (weight, place + 1)) {
                return true;
            }
            marks.pop();
            self.give_back(marks, (chip, added));
        }
        false
    }

    /// Takes the distances from `chip` to all `marks`, and tells to how many; `None`, and nothing
    /// taken, where one is not free.
    fn take(&mut self, marks: &[u32], chip: u32) -> Option<usize> {
        for (added, &mark) in marks.iter().enumerate() {
            let [there, back] = self.distances(mark, chip);
            // Half way round both are one, and it occurs twice.
            if self.taken[there] || there == back {
                self.give_back(marks, (chip, added));
                return None;
            }
            (self.taken[there], self.taken[back]) = (true, true);
        }
        Some(marks.len())
    }

    fn give_back(&mut self, marks: &[u32], (chip, added): (u32, usize)) {
        for &mark in &marks[..added] {
            for distance in self.distances(mark, chip) {
                self.taken[distance] = false;
            }
        }
    }

    fn distances(&self, mark: u32, chip: u32) -> [usize; 2] {
        let there = mark.abs_diff(chip);
        [there as usize, (self.length - there) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::super::Family;
    use super::*;

    #[test]
    fn the_plane_of_order_2_and_a_pair_of_13_chips() {
        let words = Family::orthogonal(7, 3, None).unwrap().words();
        assert_eq!(words.len(), 1);
        assert_eq!(words[0].marks, [0, 1, 3]);
        // {0, 1, 3} leaves nothing for another word, others do.
        assert_eq!(Family::orthogonal(13, 3, None).unwrap().count(), 2);
    }

    #[test]
    fn what_the_search_reaches_is_stated() {
        let reached = [(31, 3), (63, 3), (101, 4), (341, 5), (1000, 5)]
            .map(|(n, w)| (Family::orthogonal(n, w, None).unwrap().count(), johnson_bound(n, w)));
        assert_eq!(reached, [(5, 5), (10, 10), (7, 8), (15, 17), (45, 49)]);
    }

    #[test]
    fn as_many_words_as_asked_for_and_no_more() {
        let few = Family::orthogonal(1000, 5, Some(4)).unwrap();
        assert_eq!((few.count(), few.words().len()), (4, 4));
    }

    #[test]
    fn refusals_name_the_bound() {
        let refusal = |n, w, words| Family::orthogonal(n, w, words).unwrap_err().to_string();
        assert_eq!(
            refusal(1000, 5, Some(50)),
            "50 words of 5 marks in 1000 chips cannot be orthogonal; there are 49 at most \
             (Johnson bound): use longer words or fewer marks"
        );
        assert!(refusal(12, 4, None).contains("0 at most"));
        assert!(refusal(341, 5, Some(17)).contains("the search finds 15"));
        assert!(refusal(1000, 5, Some(0)).contains("0 words"));
        assert!(refusal(10, 11, None).contains("11 marks"));
    }
}
