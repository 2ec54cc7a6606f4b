//! Random sparse codes: each word has its marks at chips drawn for it.
//!
//! So many words may be drawn that no two shots that can meet share one. Nothing is guaranteed of
//! a word but its weight; words of few marks in many chips hardly ever coincide in more than a
//! handful.

use std::collections::BTreeSet;

use super::super::{CodeWord, Error};
use super::chance::Chance;

/// Most words: their indices, and their number, have 16 bits.
const MOST_WORDS: u32 = u16::MAX as u32;

/// That there are so many chips, marks and words.
pub(super) fn checked(length: u32, weight: u32, words: u32) -> Result<(), Error> {
    super::checked_length(length, weight)?;
    if !(1..=MOST_WORDS).contains(&words) {
        return Err(Error::Words { words, possible: MOST_WORDS });
    }
    Ok(())
}

/// Word number `index`: `weight` of `length` chips, all sets of them equally likely, drawn by the
/// address (seed, index) and not in sequence.
pub(super) fn word(length: u32, weight: u32, seed: u64, index: u32) -> CodeWord {
    let mut chance = Chance::new(seed, index.into());
    // After Floyd [BF87]: no chip is drawn twice, and none is thrown away.
    let mut marks = BTreeSet::new();
    for last in length - weight..length {
        let drawn = chance.below(last + 1) as u16;
        if !marks.insert(drawn) {
            marks.insert(last as u16);
        }
    }
    CodeWord { length, marks: marks.into_iter().collect() }
}

#[cfg(test)]
mod tests {
    use super::super::Family;
    use super::*;

    #[test]
    fn a_word_depends_on_its_address_alone() {
        let words = |words, seed| Family::sparse(1000, 8, words, seed).unwrap().words();
        let (few, many) = (words(3, 5), words(40, 5));
        assert_eq!(few[..], many[..3]);
        assert_ne!(few, words(3, 6));
        let distinct: BTreeSet<_> = many.iter().map(|word| word.marks.clone()).collect();
        assert_eq!(distinct.len(), 40);
        assert!(many.iter().all(|w| w.weight() == 8 && w.marks.is_sorted_by(|a, b| a < b)));
    }

    /// H0: every chip is lit equally often. N = 20 000 words of 4 in 20 chips, seed 9: χ² of 20
    /// counts, each with a share of 1/5 of the words, has 19 degrees of freedom once divided by
    /// 1 − (w − 1)/(n − 1) = 16/19 for marks that exclude each other; α = 10⁻⁴ is χ² < 51.9.
    /// Negative control: without the last chip it is far beyond.
    #[test]
    fn marks_fall_on_every_chip_alike() {
        let words: Vec<CodeWord> = (0..20_000).map(|index| word(20, 4, 9, index)).collect();
        let mut counts = [0_f64; 20];
        words.iter().flat_map(|word| &word.marks).for_each(|&m| counts[usize::from(m)] += 1.0);
        let chi = |counts: &[f64]| {
            let expected = counts.iter().sum::<f64>() / counts.len() as f64;
            let squares = counts.iter().map(|count| (count - expected).powi(2) / expected);
            squares.sum::<f64>() / (16.0 / 19.0)
        };
        assert!(chi(&counts) < 51.9, "{}", chi(&counts));
        counts[19] *= 0.9;
        assert!(chi(&counts) > 51.9);
    }

    #[test]
    fn all_chips_may_be_lit_and_one_too() {
        assert_eq!(word(5, 5, 1, 7).marks, [0, 1, 2, 3, 4]);
        assert_eq!(word(1, 1, 1, 0).marks, [0]);
    }

    #[test]
    fn refusals_name_what_is_possible() {
        let refusal = |length, weight, words| {
            Family::sparse(length, weight, words, 1).unwrap_err().to_string()
        };
        assert!(refusal(70_000, 8, 1).contains("1 to 65535"));
        assert!(refusal(100, 101, 1).contains("101 marks"));
        assert!(refusal(100, 0, 1).contains("0 marks"));
        assert!(refusal(100, 5, 70_000).contains("70000 words"));
        assert!(refusal(100, 5, 0).contains("0 words"));
    }
}
