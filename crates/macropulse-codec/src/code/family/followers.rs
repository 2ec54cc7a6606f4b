//! Words that follow each other, where a channel is blind for a time behind each mark that it sends.
//!
//! An echo of a word comes while its own marks or later words are sent. It loses two marks at once at some
//! shift if a distance between two of them differs by less than `gap` from one between two marks that are
//! sent. The least distance `gap` stands here for the time for which the channel is blind. The number of such
//! shifts of the echo, in chips, is
//!
//! E = Σ over words i, k = 0 … `later`, and distances d of word i and d' of word i + k: max(0, gap − |d − d'|).
//!
//! Words are drawn anew, one at a time, as long as E is more than 0; what makes it greater is left. The words go
//! round: the first follows the last.

use super::super::CodeWord;
use super::chance::Chance;
use super::separated::{Separated, word};

/// Work at most, 40 ms: places looked at for marks, and pairs of distances compared. With 10 words of 3 marks
/// that keep 20 chips to two followers, all are found in 360 chips by seven seeds of ten, in 400 by nine.
const MOST_WORK: u64 = 1 << 23;

/// The `words` of `family`, some of them drawn anew so that an echo loses two marks at fewer shifts.
pub(super) fn redrawn(
    family: &Separated,
    words: Vec<CodeWord>,
    chance: &mut Chance,
) -> Vec<CodeWord> {
    let count = words.len();
    let Some(marks) = words.first().map(|word| word.weight() as u64) else { return words };
    let pairs = (marks * marks.saturating_sub(1) / 2).pow(2) * (2 * u64::from(family.later) + 1);
    let mut left = MOST_WORK;
    let mut turns = Turns { family, words: words.iter().map(distances).collect() };
    let mut words = words;
    let Some(rest) = left.checked_sub(pairs.saturating_mul(count as u64)) else { return words };
    left = rest;
    let mut all = turns.all();
    while all > 0 {
        let Some(rest) = left.checked_sub(2 * pairs + count as u64) else { break };
        left = rest;
        let at = chance.below(count as u32) as usize;
        let before = turns.of(at);
        if before == 0 {
            continue;
        }
        let taken = taken_by_others(family, &turns.words, at);
        let Some((marks, _)) = word(family, taken, (chance, &mut left)) else { continue };
        let new = CodeWord { length: family.length, marks };
        let old = std::mem::replace(&mut turns.words[at], distances(&new));
        let after = turns.of(at);
        if after > before {
            turns.words[at] = old;
        } else {
            all -= before - after;
            words[at] = new;
        }
    }
    words
}

/// Distances between the marks of a word.
fn distances(word: &CodeWord) -> Vec<u32> {
    let from = |(at, mark): (usize, &u16)| {
        let mark = *mark;
        word.marks[at + 1..].iter().map(move |later| u32::from(later - mark))
    };
    word.marks.iter().enumerate().flat_map(from).collect()
}

/// The distances that no word at place `at` may have: those of all others, and what is nearer than `apart`.
fn taken_by_others(family: &Separated, words: &[Vec<u32>], at: usize) -> Vec<bool> {
    let mut taken = vec![false; family.length as usize];
    let others = words.iter().enumerate().filter(|(other, _)| *other != at);
    for distance in others.flat_map(|(_, word)| word) {
        family.take(&mut taken, *distance as usize);
    }
    taken
}

/// Words in their turns, as distances between marks.
struct Turns<'a> {
    family: &'a Separated,
    words: Vec<Vec<u32>>,
}

impl Turns<'_> {
    /// Shifts at which two marks are lost of one to the other.
    fn overlap(&self, one: &[u32], other: &[u32]) -> u64 {
        let of = |(d, other): (&u32, &u32)| self.family.gap.saturating_sub(d.abs_diff(*other));
        let pairs = one.iter().flat_map(|d| other.iter().map(move |other| (d, other)));
        pairs.map(of).map(u64::from).sum()
    }

    /// The same of a word to itself, but for the shift at which it is itself.
    fn own(&self, at: usize) -> u64 {
        let word = &self.words[at];
        (0..word.len()).map(|d| self.overlap(&word[d..=d], &word[d + 1..])).sum()
    }

    /// The same of a word to each of the `later` words behind it, but not to itself.
    fn behind(&self, at: usize) -> u64 {
        let follower = |later: usize| (at + later) % self.words.len();
        let others = (1..=self.family.later as usize).map(follower).filter(|other| *other != at);
        others.map(|other| self.overlap(&self.words[at], &self.words[other])).sum()
    }

    /// All that a word at place `at` takes part in.
    fn of(&self, at: usize) -> u64 {
        let count = self.words.len();
        let before = |later: usize| (at + count - later % count) % count;
        let others = (1..=self.family.later as usize).map(before).filter(|other| *other != at);
        let ahead: u64 =
            others.map(|other| self.overlap(&self.words[other], &self.words[at])).sum();
        self.own(at) + self.behind(at) + ahead
    }

    fn all(&self) -> u64 {
        (0..self.words.len()).map(|at| self.own(at) + self.behind(at)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Family;
    use super::*;

    /// Counts the shifts, in chips, of all `words` together at which an echo loses two marks to its own word
    /// or to one sent up to `later` words after it. Zero is best.
    fn counted(family: &Separated, words: &[CodeWord]) -> u64 {
        Turns { family, words: words.iter().map(distances).collect() }.all()
    }

    const WORDS: Separated =
        Separated { length: 360, weight: 3, words: 10, gap: 20, apart: 5, later: 2, seed: 1 };

    /// Counts, mark by mark, the shifts of all words together at which two marks fall behind marks of the
    /// word `later` places on. If `later` is 0, they fall behind other marks of their own word.
    fn lost(words: &[CodeWord], later: usize, gap: i32) -> usize {
        let is_lost = |at: usize, shift: i32| {
            let sent = &words[(at + later) % words.len()].marks;
            let is_behind = |mark: &&u16| {
                let place = i32::from(**mark) + shift;
                sent.iter().any(|own| (i32::from(*own)..i32::from(*own) + gap).contains(&place))
            };
            words[at].marks.iter().filter(is_behind).count() > 1
        };
        // An echo behind its own word by less than `gap` is lost mark by mark.
        let shifts = if later == 0 { gap..500 } else { -500..500 };
        shifts.map(|shift| (0..words.len()).filter(|at| is_lost(*at, shift)).count()).sum()
    }

    /// Control: to the word behind those that were asked for, echoes are lost, and so they are where nothing is
    /// asked of those that follow.
    #[test]
    fn no_echo_loses_two_marks_to_what_is_sent() {
        let words = Family::separated(WORDS).unwrap().words();
        assert_eq!(counted(&WORDS, &words), 0);
        for later in 0..=2 {
            assert_eq!(lost(&words, later, 20), 0);
        }
        assert!(lost(&words, 3, 20) > 0);
        let alone = Family::separated(Separated { later: 0, ..WORDS }).unwrap().words();
        assert_eq!(lost(&alone, 0, 20), 0);
        assert!(lost(&alone, 1, 20) > 0 && lost(&alone, 2, 20) > 0);
    }

    /// With too little room, few echoes are lost. Control: the same words in another order lose more.
    #[test]
    fn in_short_words_few_are_lost() {
        for seed in 1..6 {
            let family = Separated { length: 238, seed, ..WORDS };
            let words = Family::separated(family).unwrap().words();
            let count = |words: &[CodeWord]| (0..=2).map(|k| lost(words, k, 20)).sum::<usize>();
            assert!(count(&words) < 130, "{seed}: {}", count(&words));
            let mut shuffled = words.clone();
            Chance::new(seed, 0).shuffle(&mut shuffled);
            assert!(count(&shuffled) > count(&words));
        }
    }

    #[test]
    fn what_would_take_long_or_follows_itself_is_as_it_was_drawn() {
        let one = Separated { words: 1, weight: 1, ..WORDS };
        assert_eq!(Family::separated(one).unwrap().words()[0].marks, [0]);
        let two = Separated { words: 2, ..WORDS };
        assert_eq!(counted(&two, &Family::separated(two).unwrap().words()), 0);
        let heavy = Separated {
            length: 20_000,
            weight: 24,
            words: 4,
            gap: 9,
            apart: 1,
            later: 16,
            seed: 1,
        };
        assert!(counted(&heavy, &Family::separated(heavy).unwrap().words()) > 0);
    }
}
