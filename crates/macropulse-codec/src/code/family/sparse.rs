//! Random sparse codes: each word has its marks at chips drawn for it.
//!
//! Enough words can be drawn for no two shots that can meet to share one. Nothing is guaranteed of a word but
//! its weight. Words of few marks in many chips hardly ever coincide in more than a handful.

use std::collections::BTreeSet;

use super::super::codebook::MOST_MARKS;
use super::super::{CodeWord, Error};
use super::chance::Chance;

/// Most words: their indices, and their number, have 16 bits.
const MOST_WORDS: u32 = u16::MAX as u32;

/// Words drawn at random.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Sparse {
    /// Chips of a word, 1 to 65535.
    pub length: u32,
    /// Marks of a word, 1 to `length`.
    pub weight: u32,
    /// Number of words, 1 to 65535.
    pub words: u32,
    /// Least distance from each mark to the next, in chips; 1 leaves them as they fall.
    pub gap: u32,
    /// Seed of the words.
    pub seed: u64,
}

impl Sparse {
    /// Chips that the gaps leave to draw from: behind each mark but the last, gap − 1 are taken.
    /// `None` if there are not enough for its marks.
    fn free(&self) -> Option<u32> {
        let taken = self.gap.saturating_sub(1).checked_mul(self.weight.saturating_sub(1))?;
        self.length.checked_sub(taken).filter(|free| *free >= self.weight)
    }
}

/// Checks the numbers of chips, marks and words, and the gap.
pub(super) fn checked(sparse: &Sparse) -> Result<(), Error> {
    let &Sparse { length, weight, words, gap, .. } = sparse;
    super::checked_length(length, weight)?;
    if gap == 0 || sparse.free().is_none() {
        let widest = (length - weight).checked_div(weight - 1).map_or(length, |more| more + 1);
        return Err(Error::Gap { gap, weight, length, widest });
    }
    let possible = MOST_WORDS.min(MOST_MARKS as u32 / weight);
    if !(1..=possible).contains(&words) {
        return Err(Error::Words { words, possible });
    }
    Ok(())
}

/// Word number `index`, all sets of marks with such gaps equally likely, drawn by the address
/// (seed, index) and not in sequence.
pub(super) fn word(sparse: &Sparse, index: u32) -> CodeWord {
    let &Sparse { length, weight, gap, seed, .. } = sparse;
    let free = sparse.free().unwrap_or(length).max(weight);
    let mut chance = Chance::new(seed, index.into());
    // After Floyd [BF87]: no chip is drawn twice, and none is thrown away.
    let mut marks = BTreeSet::new();
    for last in free - weight..free {
        let drawn = chance.below(last + 1) as u16;
        if !marks.insert(drawn) {
            marks.insert(last as u16);
        }
    }
    // The chips that the gaps take are put back behind each mark.
    let apart = |(before, mark): (u32, u16)| mark + (before * (gap - 1)) as u16;
    CodeWord { length, marks: (0..).zip(marks).map(apart).collect() }
}

#[cfg(test)]
mod tests {
    use super::super::Family;
    use super::*;

    fn family(length: u32, weight: u32, words: u32, seed: u64) -> Result<Family, Error> {
        Family::sparse(Sparse { length, weight, words, gap: 1, seed })
    }

    /// H0: with gaps, too, every set of marks is drawn equally often. With 3 marks at least 2 apart, 7 chips
    /// leave the 10 sets of 3 in 5. N = 20 000, seed 3: χ² has 9 degrees of freedom, α = 10⁻⁴ is 33.7.
    /// Negative control: one of the ten sets is drawn twice as often.
    #[test]
    fn marks_keep_their_gap_and_all_sets_are_alike() {
        let sparse = Sparse { length: 7, weight: 3, words: 20_000, gap: 2, seed: 3 };
        let mut counts = std::collections::BTreeMap::new();
        for word in Family::sparse(sparse).unwrap().words() {
            assert!(word.marks.windows(2).all(|pair| pair[1] - pair[0] >= 2), "{:?}", word.marks);
            assert!(word.marks.iter().all(|mark| *mark < 7));
            *counts.entry(word.marks).or_insert(0.0) += 1.0;
        }
        assert_eq!(counts.len(), 10);
        let chi = |counts: &[f64]| -> f64 {
            let expected = counts.iter().sum::<f64>() / counts.len() as f64;
            counts.iter().map(|count| (count - expected).powi(2) / expected).sum()
        };
        let mut counts: Vec<f64> = counts.into_values().collect();
        assert!(chi(&counts) < 33.7, "{}", chi(&counts));
        counts[0] *= 2.0;
        assert!(chi(&counts) > 33.7);
    }

    #[test]
    fn a_word_depends_on_its_address_alone() {
        let words = |words, seed| family(1000, 8, words, seed).unwrap().words();
        let (few, many) = (words(3, 5), words(40, 5));
        assert_eq!(few[..], many[..3]);
        assert_ne!(few, words(3, 6));
        let distinct: BTreeSet<_> = many.iter().map(|word| word.marks.clone()).collect();
        assert_eq!(distinct.len(), 40);
        assert!(many.iter().all(|w| w.weight() == 8 && w.marks.is_sorted_by(|a, b| a < b)));
    }

    /// H0: every chip is lit equally often. N = 20 000 words of 4 in 20 chips, seed 9. Each of the 20 counts
    /// has a share of 1/5 of the words. As marks exclude each other, χ² has 19 degrees of freedom once
    /// divided by 1 − (w − 1)/(n − 1) = 16/19. α = 10⁻⁴ is χ² < 51.9. Negative control: with a tenth of the
    /// last chip's marks missing it is beyond.
    #[test]
    fn marks_fall_on_every_chip_alike() {
        let sparse = Sparse { length: 20, weight: 4, words: 20_000, gap: 1, seed: 9 };
        let words: Vec<CodeWord> = (0..20_000).map(|index| word(&sparse, index)).collect();
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
        let all = |length, weight, gap| Sparse { length, weight, words: 8, gap, seed: 1 };
        assert_eq!(word(&all(5, 5, 1), 7).marks, [0, 1, 2, 3, 4]);
        assert_eq!(word(&all(1, 1, 9), 0).marks, [0]);
        assert_eq!(word(&all(9, 5, 2), 7).marks, [0, 2, 4, 6, 8]);
    }

    #[test]
    fn refusals_name_what_is_possible() {
        let refusal =
            |length, weight, words| family(length, weight, words, 1).unwrap_err().to_string();
        let wide = Sparse { length: 20, weight: 5, words: 3, gap: 6, seed: 1 };
        let told = Family::sparse(wide).unwrap_err().to_string();
        assert!(
            told.contains("5 marks that are 6 chips apart") && told.contains("1 to 4"),
            "{told}"
        );
        assert!(Family::sparse(Sparse { gap: 4, ..wide }).is_ok());
        assert!(Family::sparse(Sparse { gap: 0, ..wide }).is_err());
        assert!(refusal(70_000, 8, 1).contains("1 to 65535"));
        assert!(refusal(100, 101, 1).contains("101 marks"));
        assert!(refusal(100, 0, 1).contains("0 marks"));
        assert!(refusal(100, 5, 70_000).contains("70000 words"));
        assert!(refusal(100, 5, 0).contains("0 words"));
    }
}
