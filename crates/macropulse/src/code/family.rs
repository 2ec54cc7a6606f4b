//! Code families: sets of code words that can be told apart when they overlap.

use super::Error;

/// The largest prime whose square still has 16-bit chip indices.
const LARGEST_PRIME: u32 = 251;

/// A set of code words. A family that exists is valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Family {
    /// Prime sequence code over GF(p): `p` words of length p² and weight p, any two of which
    /// coincide in at most 2 marks at any lag \[KP16 §2.2\]. Made by [`Family::prime`].
    #[non_exhaustive]
    Prime {
        /// Order of the field, an odd prime up to 251.
        p: u32,
    },
    /// One word of one lit chip: a sensor that is not coded.
    Single,
}

impl Family {
    /// The prime sequence code over GF(`p`).
    ///
    /// # Errors
    /// Where `p` is not an odd prime, or greater than 251.
    pub fn prime(p: u32) -> Result<Self, Error> {
        if p > LARGEST_PRIME {
            return Err(Error::PrimeTooLarge { p });
        }
        if !is_odd_prime(p) {
            return Err(Error::NotOddPrime { p, nearest: nearest_odd_primes(p) });
        }
        Ok(Self::Prime { p })
    }

    /// All words, in the order of their index.
    pub fn words(&self) -> Vec<CodeWord> {
        match *self {
            Self::Prime { p } => (0..p).map(|i| prime_word(p, i)).collect(),
            Self::Single => vec![CodeWord { length: 1, marks: vec![0] }],
        }
    }

    /// Chips of a word.
    pub fn length(&self) -> u32 {
        match *self {
            Self::Prime { p } => p * p,
            Self::Single => 1,
        }
    }

    /// Marks of a word; the same for every word of a family.
    pub fn weight(&self) -> usize {
        match *self {
            Self::Prime { p } => p as usize,
            Self::Single => 1,
        }
    }

    /// Number of words.
    pub fn count(&self) -> usize {
        match *self {
            Self::Prime { p } => p as usize,
            Self::Single => 1,
        }
    }
}

/// One word of a family: which of its chips are lit.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct CodeWord {
    /// Number of chips.
    pub length: u32,
    /// Indices of the lit chips, ascending, each below `length`.
    pub marks: Vec<u16>,
}

impl CodeWord {
    /// Number of marks.
    pub fn weight(&self) -> usize {
        self.marks.len()
    }

    /// The smallest cyclic shift, in chips, that maps the word to itself; `length` where only a
    /// full turn does.
    ///
    /// A word whose period is shorter than its length, as C0 of every prime code, cannot time an
    /// echo: it looks the same one period later.
    pub fn period(&self) -> u32 {
        (1..self.length)
            .filter(|shift| self.length.is_multiple_of(*shift))
            .find(|&shift| self.is_unchanged_by(shift))
            .unwrap_or(self.length)
    }

    fn is_unchanged_by(&self, shift: u32) -> bool {
        self.marks.iter().all(|&mark| {
            let moved = (u32::from(mark) + shift) % self.length;
            self.marks.binary_search_by_key(&moved, |&other| u32::from(other)).is_ok()
        })
    }
}

/// The prime sequence `s_ij = i·j mod p`, for j = 0 … p−1 \[KP16 Table 1\].
pub fn prime_sequence(p: u32, i: u32) -> Vec<u32> {
    (0..p).map(|j| ((u64::from(i) * u64::from(j)) % u64::from(p)) as u32).collect()
}

/// The code word of the prime sequence `i`: in block j of p chips the chip s_ij is lit, so the
/// marks are `s_ij + p·j` \[KP16 eq. 2\].
fn prime_word(p: u32, i: u32) -> CodeWord {
    let marks = (0..p).zip(prime_sequence(p, i)).map(|(j, s)| (s + p * j) as u16).collect();
    CodeWord { length: p * p, marks }
}

fn is_odd_prime(n: u32) -> bool {
    n >= 3
        && !n.is_multiple_of(2)
        && (3..).step_by(2).take_while(|d| d * d <= n).all(|d| !n.is_multiple_of(d))
}

/// Names the odd primes on either side of `n`, which is not above the largest possible one.
fn nearest_odd_primes(n: u32) -> String {
    let below = (3..n).rev().find(|&p| is_odd_prime(p));
    let above = (n..=LARGEST_PRIME).find(|&p| is_odd_prime(p));
    match (below, above) {
        (Some(below), Some(above)) => format!("the nearest are {below} and {above}"),
        (Some(only), None) | (None, Some(only)) => format!("the nearest is {only}"),
        (None, None) => String::from("the smallest is 3"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gf_5_as_written_out_by_hand() {
        assert_eq!(prime_sequence(5, 2), [0, 2, 4, 1, 3]);
        let word = &Family::prime(5).unwrap().words()[2];
        assert_eq!(word.length, 25);
        assert_eq!(word.marks, [0, 7, 14, 16, 23]);
    }

    #[test]
    fn the_paper_has_29_words_of_841_chips_and_29_marks() {
        let family = Family::prime(29).unwrap();
        assert_eq!((family.length(), family.weight(), family.count()), (841, 29, 29));
        let words = family.words();
        assert_eq!(words.len(), 29);
        assert!(words.iter().all(|word| word.length == 841 && word.weight() == 29));
    }

    #[test]
    fn the_largest_prime_still_fits_its_chip_indices() {
        let words = Family::prime(251).unwrap().words();
        assert_eq!(words[250].marks.last(), Some(&(250 * 251 + 1)));
        assert!(words.iter().all(|word| word.marks.is_sorted_by(|a, b| a < b)));
    }

    #[test]
    fn only_c0_is_periodic() {
        let periods: Vec<_> =
            Family::prime(7).unwrap().words().iter().map(CodeWord::period).collect();
        assert_eq!(periods, [7, 49, 49, 49, 49, 49, 49]);
        assert_eq!(Family::Single.words()[0].period(), 1);
    }

    #[test]
    fn an_uncoded_sensor_has_one_word_of_one_mark() {
        assert_eq!(Family::Single.words(), [CodeWord { length: 1, marks: vec![0] }]);
        let family = Family::Single;
        assert_eq!((family.length(), family.weight(), family.count()), (1, 1, 1));
    }

    #[test]
    fn refusals_name_the_way_out() {
        let refusal = |p| Family::prime(p).unwrap_err().to_string();
        assert_eq!(refusal(28), "28 is not an odd prime; the nearest are 23 and 29");
        assert_eq!(refusal(2), "2 is not an odd prime; the nearest is 3");
        assert_eq!(refusal(0), "0 is not an odd prime; the nearest is 3");
        assert_eq!(refusal(9), "9 is not an odd prime; the nearest are 7 and 11");
        assert_eq!(
            refusal(257),
            "a prime code of order 257 is too long; the largest possible prime is 251"
        );
    }
}
