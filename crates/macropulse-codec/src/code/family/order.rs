//! In which order words follow each other, where a channel is blind for a time behind each mark that it sends.
//!
//! The echo of a word comes while later words are sent. Where it comes so that two of its marks fall into
//! what a later word makes blind, it is lost; at each shift that befalls some words and not others, as marks
//! lie. An order is looked for in which it befalls few, and at no shift many:
//!
//! Σ over k = 1, 2 and all shifts s of n(k, s)²
//!
//! is to be small, n(k, s) the number of words that are lost to the k-th word behind them at a shift of s
//! chips. The order goes round: the first word follows the last one.

use super::super::CodeWord;
use super::chance::Chance;

/// Where words³·marks²·gap is more than that, the order is left as it is: the search would take a second.
const MOST_WORK: u64 = 1 << 22;

/// Orders that are begun with. Of ten words of three marks in 238 chips one leaves 141 where the words as
/// drawn leave 223, the best of 4 some 110, of 16 and of 40 105.
const BEGUN: u64 = 16;

/// How many words later an echo may come: those of the shots in flight of a channel.
const LATER: [usize; 2] = [1, 2];

/// The `words` in such an order, a channel being blind for `gap` chips behind each of its marks.
pub(super) fn ordered(words: Vec<CodeWord>, gap: u32) -> Vec<CodeWord> {
    let (count, marks) = (words.len(), words.iter().map(CodeWord::weight).max().unwrap_or(0));
    let work = (count as u64).pow(3).saturating_mul((marks * marks) as u64 * u64::from(gap));
    if count < 3 || work > MOST_WORK {
        return words;
    }
    let lost: Vec<Vec<Vec<i32>>> = words
        .iter()
        .map(|echo| words.iter().map(|sent| shifts(echo, sent, gap)).collect())
        .collect();
    let length = words.iter().map(|word| word.length as usize).max().unwrap_or(0);
    let mut search = Search { lost, often: vec![0; 3 * length] };
    let begun = |attempt: u64| {
        let mut order: Vec<usize> = (0..count).collect();
        if attempt > 0 {
            Chance::new(attempt, 0).shuffle(&mut order);
        }
        order
    };
    let best = (0..BEGUN).map(|attempt| search.descend(begun(attempt))).min();
    let Some((_, order)) = best else { return words };
    order.into_iter().map(|word| words[word].clone()).collect()
}

/// The shifts of the `echo` against the word that is `sent` at which two of its marks or more are lost.
fn shifts(echo: &CodeWord, sent: &CodeWord, gap: u32) -> Vec<i32> {
    // Each mark of the echo is lost at the shifts that bring it 0 to `gap` chips behind one that is sent.
    let mut all: Vec<i32> = Vec::new();
    for mark in echo.marks.iter().map(|mark| i32::from(*mark)) {
        let behind = sent.marks.iter().map(|own| i32::from(*own) - mark);
        let mut of_mark: Vec<i32> =
            behind.flat_map(|shift| shift..shift.saturating_add(gap as i32)).collect();
        of_mark.sort_unstable();
        of_mark.dedup();
        all.extend(of_mark);
    }
    all.sort_unstable();
    let twice = all.chunk_by(|one, next| one == next).filter(|same| same.len() > 1);
    twice.map(|same| same[0]).collect()
}

struct Search {
    /// Of each word, and each that may be sent later, at which shifts it is lost.
    lost: Vec<Vec<Vec<i32>>>,
    /// How many words are lost at each shift, from that of a whole word to the left on: room for one count.
    often: Vec<u32>,
}

impl Search {
    /// Exchanges words as long as that makes the sum less; the sum and the order then.
    fn descend(&mut self, mut order: Vec<usize>) -> (u64, Vec<usize>) {
        let mut least = self.sum(&order);
        let mut is_better = true;
        while is_better {
            is_better = false;
            for one in 0..order.len() {
                for other in one + 1..order.len() {
                    order.swap(one, other);
                    let sum = self.sum(&order);
                    if sum < least {
                        (least, is_better) = (sum, true);
                    } else {
                        order.swap(one, other);
                    }
                }
            }
        }
        (least, order)
    }

    fn sum(&mut self, order: &[usize]) -> u64 {
        let Self { lost, often } = self;
        let before = (often.len() / 3) as i32;
        let place = |shift: &i32| (shift + before) as usize;
        let mut sum = 0;
        for later in LATER {
            let follows = |at: usize| order[(at + later) % order.len()];
            let each = || (0..order.len()).flat_map(|at| &lost[order[at]][follows(at)]);
            each().for_each(|shift| {
                let count = &mut often[place(shift)];
                // n² grows by 2n + 1.
                sum += 2 * u64::from(*count) + 1;
                *count += 1;
            });
            each().for_each(|shift| often[place(shift)] = 0);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Family, Separated};
    use super::*;

    /// How many of `words` are lost to the word so many behind them at each shift, counted mark by mark.
    fn lost(words: &[CodeWord], later: usize, gap: i32) -> Vec<usize> {
        let is_lost = |at: usize, shift: i32| {
            let sent = &words[(at + later) % words.len()].marks;
            let is_behind = |mark: &&u16| {
                let place = i32::from(**mark) + shift;
                sent.iter().any(|own| (i32::from(*own)..i32::from(*own) + gap).contains(&place))
            };
            words[at].marks.iter().filter(is_behind).count() > 1
        };
        let of = |shift| (0..words.len()).filter(|at| is_lost(*at, shift)).count();
        (-500..500).map(of).collect()
    }

    /// Control: the same words in other orders lose more.
    #[test]
    fn few_words_are_lost_to_the_next() {
        let separated = Separated { length: 238, weight: 3, words: 10, gap: 20, apart: 5, seed: 1 };
        let words = Family::separated(separated).unwrap().words();
        let sum = |words: &[CodeWord]| -> usize {
            LATER.iter().flat_map(|later| lost(words, *later, 20)).map(|count| count * count).sum()
        };
        assert_eq!(sum(&words), 105);
        assert!(LATER.iter().all(|later| lost(&words, *later, 20).iter().all(|count| *count <= 2)));
        let mut chance = Chance::new(7, 7);
        for _ in 0..20 {
            let mut other = words.clone();
            chance.shuffle(&mut other);
            assert!(sum(&other) >= 105, "{}", sum(&other));
        }
    }

    #[test]
    fn what_would_take_long_or_has_no_order_stays_as_it_is() {
        let word = |mark: u16| CodeWord { length: 300, marks: vec![0, mark] };
        for count in [0, 1, 2, 200] {
            let words: Vec<CodeWord> = (1..=count).map(word).collect();
            assert_eq!(ordered(words.clone(), 20), words);
        }
        let words: Vec<CodeWord> = (1..=5).map(word).collect();
        assert_eq!(ordered(words.clone(), u32::MAX), words);
        assert_eq!(ordered(words.clone(), 0), words);
    }
}
