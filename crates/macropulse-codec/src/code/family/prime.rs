//! Prime codes: in block j the chip i·j mod p is lit.

use super::super::{CodeWord, Error};

/// The largest prime whose square still has 16-bit chip indices.
pub(super) const LARGEST: u32 = 251;

/// The largest prime p for which p·(2p − 1) chips have 16-bit indices.
pub(super) const LARGEST_EXTENDED: u32 = 181;

/// The prime sequence `s_ij = i·j mod p`, for j = 0 … p−1 \[KP16 Table 1\].
pub fn prime_sequence(p: u32, i: u32) -> Vec<u32> {
    (0..p).map(|j| ((u64::from(i) * u64::from(j)) % u64::from(p)) as u32).collect()
}

/// The code word of a sequence with one element per block of `block` chips: in block j the chip
/// s_j is lit, so the marks are `s_j + block·j` \[KP16 eq. 2\].
pub(super) fn one_mark_per_block(sequence: &[u32], block: u32) -> CodeWord {
    let marks = (0..).zip(sequence).map(|(j, s)| (s + block * j) as u16).collect();
    CodeWord { length: block * sequence.len() as u32, marks }
}

/// The words of order `p` in blocks of `block` chips, from i = 0 on.
pub(super) fn words(p: u32, block: u32) -> Vec<CodeWord> {
    (0..p).map(|i| one_mark_per_block(&prime_sequence(p, i), block)).collect()
}

/// That `p` is an odd prime, not above `largest`; what is made of it is called `code`.
pub(super) fn checked(p: u32, largest: u32, code: &'static str) -> Result<u32, Error> {
    if p > largest {
        return Err(Error::PrimeTooLarge { code, p, largest });
    }
    if !is_odd_prime(p) {
        return Err(Error::NotOddPrime { p, nearest: nearest_odd_primes(p, largest) });
    }
    Ok(p)
}

fn is_odd_prime(n: u32) -> bool {
    n >= 3
        && !n.is_multiple_of(2)
        && (3..).step_by(2).take_while(|d| d * d <= n).all(|d| !n.is_multiple_of(d))
}

/// Names the odd primes on either side of `n`, which is not above `largest`.
fn nearest_odd_primes(n: u32, largest: u32) -> String {
    let below = (3..n).rev().find(|&p| is_odd_prime(p));
    let above = (n..=largest).find(|&p| is_odd_prime(p));
    match (below, above) {
        (Some(below), Some(above)) => format!("the nearest are {below} and {above}"),
        (Some(only), None) | (None, Some(only)) => format!("the nearest is {only}"),
        (None, None) => String::from("the smallest is 3"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Family;
    use super::*;

    #[test]
    fn gf_5_as_written_out_by_hand() {
        assert_eq!(prime_sequence(5, 2), [0, 2, 4, 1, 3]);
        let word = &Family::prime(5).unwrap().words()[2];
        assert_eq!(word.length, 25);
        assert_eq!(word.marks, [0, 7, 14, 16, 23]);
        let extended = &Family::extended_prime(5).unwrap().words()[2];
        assert_eq!(extended.length, 45);
        assert_eq!(extended.marks, [0, 11, 22, 28, 39]);
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
    fn the_largest_primes_still_fit_their_chip_indices() {
        for family in [Family::prime(LARGEST), Family::extended_prime(LARGEST_EXTENDED)] {
            let family = family.unwrap();
            assert!(family.length() < 1 << 16);
            let words = family.words();
            assert!(words.iter().all(|word| word.marks.is_sorted_by(|a, b| a < b)));
        }
        let words = Family::prime(251).unwrap().words();
        assert_eq!(words[250].marks.last(), Some(&(250 * 251 + 1)));
    }

    #[test]
    fn only_c0_is_periodic() {
        let periods: Vec<_> =
            Family::prime(7).unwrap().words().iter().map(CodeWord::period).collect();
        assert_eq!(periods, [7, 49, 49, 49, 49, 49, 49]);
        assert_eq!(Family::Single.words()[0].period(), 1);
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
        let refusal = Family::extended_prime(191).unwrap_err().to_string();
        assert!(refusal.starts_with("an extended prime code of order 191 is too long"));
    }
}
