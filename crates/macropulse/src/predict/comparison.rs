//! How well the words of a code family can be told apart, in figures.

use super::multiple_access::{Hits, MultipleAccess};
use macropulse_codec::code::correlation::{
    aperiodic, aperiodic_sidelobe, periodic, periodic_sidelobe,
};
use macropulse_codec::code::{CodeWord, Family};

/// Most steps of a comparison: of larger families only the first words are compared.
const MOST_STEPS: usize = 1 << 27;

/// The figures of a family, counted over its words.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Which family.
    pub family: Family,
    /// Fewest and most marks of a word.
    pub marks: (usize, usize),
    /// How many words were compared, the first ones: all, unless there are too many.
    pub compared: usize,
    /// Highest autocorrelation off the peak: of a word that repeats without end, and of one on
    /// its own.
    pub sidelobes: (u16, u16),
    /// Highest cross-correlation of two words, periodic and aperiodic.
    pub crosses: (u16, u16),
    /// Mean and variance of the periodic cross-correlation, all pairs and lags alike; NaN for a
    /// single word.
    pub spread: (f64, f64),
    /// For each word and each other one, row by row, the highest periodic cross-correlation; on
    /// the diagonal the highest sidelobe.
    pub matrix: Vec<u16>,
    access: MultipleAccess,
}

impl Comparison {
    /// Compares the words of `family`, each with every other one at every lag.
    pub fn of(family: Family) -> Self {
        let mut words = family.words();
        let marks = words.iter().map(CodeWord::weight);
        let marks = (marks.clone().min().unwrap_or(0), marks.max().unwrap_or(0));
        let steps = marks.1.pow(2) + family.length() as usize;
        words.truncate((MOST_STEPS / steps).isqrt().max(2));
        let compared = words.len();
        let (mut matrix, mut counts) = (vec![0; compared * compared], Vec::new());
        let (mut sidelobes, mut crosses) = ((0, 0), (0, 0));
        for (i, a) in words.iter().enumerate() {
            let own = periodic_sidelobe(a).map_or(0, |lobe| lobe.height);
            matrix[i * compared + i] = own;
            let alone = aperiodic_sidelobe(a).map_or(0, |lobe| lobe.height);
            sidelobes = (own.max(sidelobes.0), alone.max(sidelobes.1));
            for (j, b) in words[..i].iter().enumerate() {
                let mut highest = 0;
                for met in periodic(a, b) {
                    highest = highest.max(met);
                    let met = usize::from(met);
                    counts.resize(counts.len().max(met + 1), 0_u64);
                    counts[met] += 1;
                }
                (matrix[i * compared + j], matrix[j * compared + i]) = (highest, highest);
                crosses = (highest.max(crosses.0), aperiodic(a, b).max().max(crosses.1));
            }
        }
        let access = MultipleAccess::new(marks.0, 1, Hits::of_counts(&counts));
        Self {
            family,
            marks,
            compared,
            sidelobes,
            crosses,
            spread: spread(&counts),
            matrix,
            access,
        }
    }

    /// `users` of the family at once; `None` if it has fewer words. If words differ in weight, the one
    /// received is the lightest.
    pub fn users(&self, users: u32) -> Option<MultipleAccess> {
        (users as usize <= self.family.count()).then(|| self.access.with_users(users))
    }

    /// Most other users that cannot cause an error, whatever they send: see
    /// [`MultipleAccess::harmless_interferers`]. `None` where there are no others.
    pub fn harmless_interferers(&self) -> Option<u32> {
        self.access.harmless_interferers()
    }
}

/// Mean and variance of values, from the number of each.
fn spread(counts: &[u64]) -> (f64, f64) {
    let all = counts.iter().sum::<u64>() as f64;
    let moment = |power: i32| {
        let terms =
            (0..).zip(counts).map(|(met, &count)| f64::from(met).powi(power) * count as f64);
        terms.sum::<f64>() / all
    };
    (moment(1), moment(2) - moment(1).powi(2))
}

#[cfg(test)]
mod tests {
    use super::super::multiple_access::{Words, bit_error_soft};
    use super::*;
    use macropulse_codec::code::Sparse;
    use macropulse_codec::code::correlation::CrossCorrelation;

    #[test]
    fn the_paper_in_figures() {
        let family = Family::prime(29).unwrap();
        let found = Comparison::of(family.clone());
        let cross = CrossCorrelation::of(&family.words());
        assert_eq!((found.marks, found.compared), ((29, 29), 29));
        assert_eq!((found.sidelobes, found.crosses), ((29, 28), (2, 2)));
        approx::assert_relative_eq!(found.spread.0, cross.periodic.mean(), max_relative = 1e-12);
        approx::assert_relative_eq!(found.spread.1, cross.periodic.variance(), max_relative = 1e-9);
        assert_eq!(found.harmless_interferers(), Some(14));
        let closed = MultipleAccess::prime(29, 25, Words::All).unwrap();
        let counted = bit_error_soft(&found.users(25).unwrap());
        approx::assert_relative_eq!(counted, bit_error_soft(&closed), max_relative = 1e-9);
        assert!(found.users(30).is_none());
    }

    #[test]
    fn the_matrix_has_sidelobes_on_its_diagonal_and_is_even() {
        let found = Comparison::of(Family::prime(5).unwrap());
        let row = |i: usize| &found.matrix[5 * i..5 * i + 5];
        assert_eq!([row(0), row(1)], [&[5, 1, 1, 1, 1], &[1, 4, 2, 2, 2]]);
        assert!((0..25).all(|at| found.matrix[at] == found.matrix[at % 5 * 5 + at / 5]));
    }

    #[test]
    fn of_a_large_family_the_first_words_are_compared() {
        let found = Comparison::of(
            Family::sparse(Sparse { length: 10_933, weight: 32, words: 4096, gap: 1, seed: 1 })
                .unwrap(),
        );
        assert_eq!((found.compared, found.matrix.len()), (105, 105 * 105));
        assert!(found.users(4096).is_some());
    }

    #[test]
    fn a_single_word_meets_no_other() {
        let found = Comparison::of(Family::m_sequence(7).unwrap());
        assert_eq!((found.compared, found.crosses, found.matrix.len()), (1, (0, 0), 1));
        assert!(found.spread.0.is_nan() && found.users(2).is_none());
        assert_eq!(found.harmless_interferers(), None);
    }
}
