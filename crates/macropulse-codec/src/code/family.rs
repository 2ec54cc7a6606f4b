//! Code families: sets of code words that can be told apart when they overlap.

mod chance;
mod congruence;
mod followers;
mod listed;
mod orthogonal;
mod prime;
mod separated;
mod shift_register;
mod sparse;

use std::fmt;
use std::sync::Arc;

use super::{CodeWord, Error};
pub use prime::prime_sequence;
pub use separated::Separated;
pub use sparse::Sparse;

/// A set of code words. A family that exists is valid.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Family {
    /// Prime sequence code over GF(p): `p` words of length p² and weight p. Any two coincide in at most 2 marks at any
    /// lag \[KP16 §2.2\]. Made by [`Family::prime`].
    #[non_exhaustive]
    Prime {
        /// Order of the field, an odd prime up to 251.
        p: u32,
    },
    /// The same in blocks of 2p − 1 chips: any two words coincide in at most one mark \[YK13\].
    /// Made by [`Family::extended_prime`].
    #[non_exhaustive]
    ExtendedPrime {
        /// Order of the field, an odd prime up to 181.
        p: u32,
    },
    /// Quadratic congruence code: p − 1 words of length p² and weight p. A word meets itself in at
    /// most 2 marks when shifted, another one in at most 4 \[TS81\]. Made by
    /// [`Family::quadratic_congruence`].
    #[non_exhaustive]
    QuadraticCongruence {
        /// Order of the field, an odd prime up to 251.
        p: u32,
    },
    /// The same in blocks of 2p − 1 chips: at most 1 and 2 marks. Made by
    /// [`Family::extended_quadratic_congruence`].
    #[non_exhaustive]
    ExtendedQuadraticCongruence {
        /// Order of the field, an odd prime up to 181.
        p: u32,
    },
    /// Optical orthogonal code (n, w, 1): at most one mark, of itself and of others \[CSW89\].
    /// Made by [`Family::orthogonal`].
    #[non_exhaustive]
    Orthogonal {
        /// Chips of a word.
        length: u32,
        /// Marks of a word.
        weight: u32,
        /// Number of words.
        words: u32,
    },
    /// Marks drawn at random for each word. Made by [`Family::sparse`].
    #[non_exhaustive]
    Sparse(Sparse),
    /// Words whose distances between marks all differ. Made by [`Family::separated`].
    #[non_exhaustive]
    Separated {
        /// The request.
        asked: Separated,
        /// The result of the search.
        words: Arc<[CodeWord]>,
    },
    /// Words written out. Made by [`Family::listed`].
    #[non_exhaustive]
    Listed {
        /// One word at least, all of one length.
        words: Arc<[CodeWord]>,
    },
    /// A single word of 2ⁿ − 1 chips, half of them lit, that is dark at every shift to a receiver
    /// that subtracts what falls on its dark chips. Made by [`Family::m_sequence`].
    #[non_exhaustive]
    MSequence {
        /// n, 3 to 15.
        degree: u32,
    },
    /// Gold code: 2ⁿ + 1 words of 2ⁿ − 1 chips, about half of them lit, of three different weights
    /// \[Gold67\]. Made by [`Family::gold`].
    #[non_exhaustive]
    Gold {
        /// n, one of 5, 6, 7, 9, 10, 11.
        degree: u32,
    },
    /// One word of one lit chip: a sensor that is not coded.
    Single,
}

impl Family {
    /// The prime sequence code over GF(`p`).
    ///
    /// # Errors
    /// If `p` is not an odd prime, or greater than 251.
    pub fn prime(p: u32) -> Result<Self, Error> {
        prime::checked(p, prime::LARGEST, "a prime code").map(|p| Self::Prime { p })
    }

    /// The extended prime code over GF(`p`), of length p·(2p − 1).
    ///
    /// # Errors
    /// If `p` is not an odd prime, or greater than 181.
    pub fn extended_prime(p: u32) -> Result<Self, Error> {
        prime::checked(p, prime::LARGEST_EXTENDED, "an extended prime code")
            .map(|p| Self::ExtendedPrime { p })
    }

    /// The quadratic congruence code over GF(`p`).
    ///
    /// # Errors
    /// If `p` is not an odd prime, or greater than 251.
    pub fn quadratic_congruence(p: u32) -> Result<Self, Error> {
        prime::checked(p, prime::LARGEST, "a quadratic congruence code")
            .map(|p| Self::QuadraticCongruence { p })
    }

    /// The extended quadratic congruence code over GF(`p`), of length p·(2p − 1).
    ///
    /// # Errors
    /// If `p` is not an odd prime, or greater than 181.
    pub fn extended_quadratic_congruence(p: u32) -> Result<Self, Error> {
        prime::checked(p, prime::LARGEST_EXTENDED, "an extended quadratic congruence code")
            .map(|p| Self::ExtendedQuadraticCongruence { p })
    }

    /// An optical orthogonal code of `words` words, or of all that a search finds. Their number is [`Family::count`],
    /// and seldom reaches the Johnson bound ⌊(n − 1)/(w·(w − 1))⌋.
    ///
    /// # Errors
    /// If the bound allows fewer words, or the search finds fewer, or none; if `length` is not 1 to 65535 or `weight`
    /// not 1 to `length`.
    pub fn orthogonal(length: u32, weight: u32, words: Option<u32>) -> Result<Self, Error> {
        let words = orthogonal::found(length, weight, words)?;
        Ok(Self::Orthogonal { length, weight, words })
    }

    /// Words whose marks are drawn at random, each by (seed, index of the word).
    ///
    /// # Errors
    /// If the length or the number of words is not 1 to 65535, or the weight not 1 to the length. If all
    /// words together have more than 2²⁸ marks. If the gap is 0, or so wide that the marks do not fit into
    /// the word.
    pub fn sparse(sparse: Sparse) -> Result<Self, Error> {
        sparse::checked(&sparse)?;
        Ok(Self::Sparse(sparse))
    }

    /// Words whose distances between marks all differ: any two words, and a word and itself shifted, meet in one mark
    /// at most.
    ///
    /// # Errors
    /// If the length is not 1 to 65535, the weight not 1 to 64, the number of words not 1 to 4096, or a search finds
    /// fewer.
    pub fn separated(separated: Separated) -> Result<Self, Error> {
        let words = separated::found(&separated)?.into();
        Ok(Self::Separated { asked: separated, words })
    }

    /// The words of `length` chips that are lit at `marks`: for each word its chips, counted from 0.
    ///
    /// # Errors
    /// If the length or the number of words is not 1 to 65535. If a word has no marks, or they do not ascend,
    /// or one lies beyond the length. If two words are the same.
    pub fn listed(length: u32, marks: Vec<Vec<u32>>) -> Result<Self, Error> {
        listed::words(length, marks).map(|words| Self::Listed { words })
    }

    /// The m-sequence of `degree`. It is one word: its shifts cannot be told from delay.
    ///
    /// # Errors
    /// If `degree` is not 3 to 15.
    pub fn m_sequence(degree: u32) -> Result<Self, Error> {
        shift_register::checked_degree(degree).map(|degree| Self::MSequence { degree })
    }

    /// The Gold code of `degree`.
    ///
    /// # Errors
    /// If `degree` is not 5, 6, 7, 9, 10 or 11.
    pub fn gold(degree: u32) -> Result<Self, Error> {
        shift_register::checked_gold_degree(degree).map(|degree| Self::Gold { degree })
    }

    /// All words, in the order of their index.
    pub fn words(&self) -> Vec<CodeWord> {
        match self {
            &Self::Prime { p } => prime::words(p, p),
            &Self::ExtendedPrime { p } => prime::words(p, 2 * p - 1),
            &Self::QuadraticCongruence { p } => congruence::words(p, p),
            &Self::ExtendedQuadraticCongruence { p } => congruence::words(p, 2 * p - 1),
            &Self::Orthogonal { length, weight, words } => orthogonal::words(length, weight, words),
            Self::Sparse(sparse) => {
                (0..sparse.words).map(|index| sparse::word(sparse, index)).collect()
            }
            Self::Separated { words, .. } | Self::Listed { words } => words.to_vec(),
            &Self::MSequence { degree } => vec![shift_register::m_sequence(degree)],
            &Self::Gold { degree } => shift_register::gold(degree),
            Self::Single => vec![CodeWord { length: 1, marks: vec![0] }],
        }
    }

    /// Chips of a word.
    pub fn length(&self) -> u32 {
        match self {
            &Self::Prime { p } | &Self::QuadraticCongruence { p } => p * p,
            &Self::ExtendedPrime { p } | &Self::ExtendedQuadraticCongruence { p } => {
                p * (2 * p - 1)
            }
            &Self::Orthogonal { length, .. } | &Self::Sparse(Sparse { length, .. }) => length,
            Self::Separated { words, .. } | Self::Listed { words } => {
                words.first().map_or(1, |word| word.length)
            }
            &Self::MSequence { degree } | &Self::Gold { degree } => shift_register::length(degree),
            Self::Single => 1,
        }
    }

    /// Marks of the heaviest word; the same for every word of all families but Gold codes and words
    /// written out.
    pub fn weight(&self) -> usize {
        match self {
            Self::Prime { p }
            | Self::ExtendedPrime { p }
            | Self::QuadraticCongruence { p }
            | Self::ExtendedQuadraticCongruence { p } => *p as usize,
            Self::Orthogonal { weight, .. } | Self::Sparse(Sparse { weight, .. }) => {
                *weight as usize
            }
            Self::Separated { words, .. } | Self::Listed { words } => {
                words.iter().map(CodeWord::weight).max().unwrap_or(0)
            }
            Self::MSequence { degree } => 1 << (degree - 1),
            &Self::Gold { degree } => shift_register::gold_weight(degree),
            Self::Single => 1,
        }
    }

    /// Number of words.
    pub fn count(&self) -> usize {
        match self {
            Self::Prime { p } | Self::ExtendedPrime { p } => *p as usize,
            Self::QuadraticCongruence { p } | Self::ExtendedQuadraticCongruence { p } => {
                *p as usize - 1
            }
            Self::Orthogonal { words, .. } | Self::Sparse(Sparse { words, .. }) => *words as usize,
            Self::Separated { words, .. } | Self::Listed { words } => words.len(),
            Self::Gold { degree } => (1 << degree) + 1,
            Self::MSequence { .. } | Self::Single => 1,
        }
    }
}

impl fmt::Display for Family {
    /// Its name and its numbers, as in `prime 29`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Prime { p } => write!(f, "prime {p}"),
            Self::ExtendedPrime { p } => write!(f, "extended prime {p}"),
            Self::QuadraticCongruence { p } => write!(f, "quadratic congruence {p}"),
            Self::ExtendedQuadraticCongruence { p } => {
                write!(f, "extended quadratic congruence {p}")
            }
            Self::Orthogonal { length, weight, .. } => write!(f, "orthogonal {length}, {weight}"),
            Self::Sparse(Sparse { length, weight, gap: 1, .. }) => {
                write!(f, "sparse {length}, {weight}")
            }
            Self::Sparse(Sparse { length, weight, gap, .. }) => {
                write!(f, "sparse {length}, {weight}, {gap} apart")
            }
            Self::Separated { asked: Separated { length, weight, gap, apart, .. }, .. } => {
                write!(f, "separated {length}, {weight}, {gap} and {apart} apart")
            }
            Self::Listed { .. } => write!(f, "list {}, {}", self.length(), self.weight()),
            Self::MSequence { degree } => write!(f, "m-sequence {degree}"),
            Self::Gold { degree } => write!(f, "Gold {degree}"),
            Self::Single => write!(f, "single mark"),
        }
    }
}

/// Checks the length of a word and its number of marks.
fn checked_length(length: u32, weight: u32) -> Result<(), Error> {
    if !(1..=u32::from(u16::MAX)).contains(&length) {
        return Err(Error::WordLength { length });
    }
    if !(1..=length).contains(&weight) {
        return Err(Error::Weight { weight, length });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_uncoded_sensor_has_one_word_of_one_mark() {
        assert_eq!(Family::Single.words(), [CodeWord { length: 1, marks: vec![0] }]);
        let family = Family::Single;
        assert_eq!((family.length(), family.weight(), family.count()), (1, 1, 1));
    }

    #[test]
    fn what_a_family_says_of_its_words_is_true_of_them() {
        let families = [
            Family::prime(7),
            Family::extended_prime(7),
            Family::quadratic_congruence(7),
            Family::extended_quadratic_congruence(7),
            Family::orthogonal(63, 3, None),
            Family::sparse(Sparse { length: 100, weight: 6, words: 9, gap: 5, seed: 1 }),
            Family::separated(Separated {
                length: 100,
                weight: 3,
                words: 5,
                gap: 4,
                apart: 3,
                later: 2,
                seed: 1,
            }),
            Family::listed(9, vec![vec![0, 8], vec![3], vec![0, 1, 2]]),
            Family::m_sequence(5),
            Family::gold(5),
        ];
        for family in families.map(Result::unwrap) {
            let words = family.words();
            assert_eq!(words.len(), family.count(), "{family:?}");
            assert_eq!(words.iter().map(CodeWord::weight).max(), Some(family.weight()));
            for word in &words {
                assert_eq!(word.length, family.length(), "{family:?}");
                assert!(word.marks.is_sorted_by(|a, b| a < b), "{family:?}");
                assert!(word.marks.iter().all(|&mark| u32::from(mark) < word.length));
            }
        }
    }
}
