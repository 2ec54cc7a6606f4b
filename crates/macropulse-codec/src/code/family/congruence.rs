//! Quadratic congruence codes: in block k the chip a·k·(k+1)/2 mod p is lit.
//!
//! The distance of neighbouring marks grows by the same step from block to block, so no two distances are the
//! same. Shifted against itself, a word meets itself in two marks at most, a prime word in p − 1.

use super::super::CodeWord;
use super::prime::one_mark_per_block;

/// The sequence `s_k = a·k·(k+1)/2 mod p`, for k = 0 … p−1 \[TS81\].
fn sequence(p: u32, a: u32) -> Vec<u32> {
    let (p, a) = (u64::from(p), u64::from(a));
    (0..p).map(|k| (a * (k * (k + 1) / 2) % p) as u32).collect()
}

/// The words of order `p` in blocks of `block` chips, from a = 1 on.
pub(super) fn words(p: u32, block: u32) -> Vec<CodeWord> {
    (1..p).map(|a| one_mark_per_block(&sequence(p, a), block)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Family;

    #[test]
    fn order_5_as_written_out_by_hand() {
        // Triangular numbers 0, 1, 3, 6, 10; twice that mod 5 is 0, 2, 1, 2, 0.
        let words = Family::quadratic_congruence(5).unwrap().words();
        assert_eq!(words.len(), 4);
        assert_eq!(words[0].marks, [0, 6, 13, 16, 20]);
        assert_eq!(words[1].marks, [0, 7, 11, 17, 20]);
        let extended = Family::extended_quadratic_congruence(5).unwrap().words();
        assert_eq!((extended[1].length, &extended[1].marks[..]), (45, &[0, 11, 19, 29, 36][..]));
    }

    #[test]
    fn there_is_no_word_of_a_0() {
        let family = Family::quadratic_congruence(29).unwrap();
        assert_eq!((family.length(), family.weight(), family.count()), (841, 29, 28));
        assert!(family.words().iter().all(|word| word.period() == 841));
        assert!(Family::quadratic_congruence(9).is_err());
    }
}
