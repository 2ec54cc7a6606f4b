//! Sequences of linear feedback shift registers: m-sequences and Gold codes. About half of their
//! chips are lit.
//!
//! An m-sequence of degree n runs through all 2ⁿ − 1 states of its register but the dark one. It is
//! one word only: its shifts are the same word later, which no receiver can tell apart that does
//! not know the delay. A Gold code \[Gold67\] is an m-sequence u, another one v that takes every
//! q-th chip of u, q = 5, and u with each shift of v added to it: 2ⁿ + 1 words. For degrees that 4
//! does not divide, u and v are a preferred pair: as ±1, any two words correlate to −t, −1 or t − 2
//! only, t = 2^⌊(n+2)/2⌋ + 1.

use super::super::{CodeWord, Error};

/// Degrees of m-sequences: longer ones have no 16-bit chip indices.
const DEGREES: std::ops::RangeInclusive<u32> = 3..=15;

/// Degrees of Gold codes that have a preferred pair here and words of bearable number.
const GOLD_DEGREES: [u32; 6] = [5, 6, 7, 9, 10, 11];

/// Step in u from one chip of v to the next: 2^k + 1 with k = 2. The greatest common divisor of k and n is 1
/// for an odd n, and 2 for an even one that 4 does not divide.
const DECIMATION: usize = 5;

pub(super) fn checked_degree(degree: u32) -> Result<u32, Error> {
    match DEGREES.contains(&degree) {
        true => Ok(degree),
        false => Err(Error::Degree { code: "an m-sequence", degree, possible: "3 to 15" }),
    }
}

pub(super) fn checked_gold_degree(degree: u32) -> Result<u32, Error> {
    match GOLD_DEGREES.contains(&degree) {
        true => Ok(degree),
        false => {
            Err(Error::Degree { code: "a Gold code", degree, possible: "5, 6, 7, 9, 10 or 11" })
        }
    }
}

/// Chips of a word.
pub(super) fn length(degree: u32) -> u32 {
    (1 << degree) - 1
}

/// The m-sequence, the only word of its family.
pub(super) fn m_sequence(degree: u32) -> CodeWord {
    word(&chips(degree))
}

/// The Gold words: u, v, and u + v, v shifted by 0, 1, 2 … chips.
pub(super) fn gold(degree: u32) -> Vec<CodeWord> {
    let u = chips(degree);
    let length = u.len();
    let v: Vec<bool> = (0..length).map(|chip| u[DECIMATION * chip % length]).collect();
    let sum = |shift: usize| {
        let sum: Vec<bool> = (0..length).map(|chip| u[chip] ^ v[(chip + shift) % length]).collect();
        word(&sum)
    };
    [word(&u), word(&v)].into_iter().chain((0..length).map(sum)).collect()
}

/// Marks of the heaviest Gold word: that of the most negative correlation with all light,
/// N − 2w = −t.
pub(super) fn gold_weight(degree: u32) -> usize {
    let t = (1 << (degree + 2).div_euclid(2)) + 1;
    (length(degree) as usize + t) / 2
}

fn word(chips: &[bool]) -> CodeWord {
    let lit = (0..).zip(chips).filter(|&(_, &lit)| lit);
    CodeWord { length: chips.len() as u32, marks: lit.map(|(chip, _)| chip).collect() }
}

/// The chips of an m-sequence, from the state 1 on.
fn chips(degree: u32) -> Vec<bool> {
    let (taps, length) = (taps(degree), length(degree) as usize);
    let mut state = 1_u32;
    let step = |_| {
        let out = state & 1;
        state = state >> 1 ^ if out == 1 { taps } else { 0 };
        out == 1
    };
    (0..length).map(step).collect()
}

/// The feedback that makes a register of `degree` bits run through all its states: the lowest one
/// there is, found by trying. Bit k stands for x^(degree − 1 − k), the leading term is implied.
fn taps(degree: u32) -> u32 {
    let top = 1 << (degree - 1);
    let is_full = |taps: &u32| {
        let mut state = 1_u32;
        let step = |state: u32| state >> 1 ^ if state & 1 == 1 { *taps } else { 0 };
        (1..length(degree)).all(|_| {
            state = step(state);
            state != 1
        }) && step(state) == 1
    };
    (top..2 * top).find(is_full).unwrap_or(top)
}

#[cfg(test)]
mod tests {
    use super::super::Family;
    use super::*;

    #[test]
    fn degree_3_as_run_by_hand() {
        // The lowest feedback is x³ + x² + 1, bits 101: 001 → 101 → 111 → 110 → 011 → 100 → 010.
        assert_eq!(taps(3), 0b101);
        let word = m_sequence(3);
        assert_eq!((word.length, &word.marks[..]), (7, &[0, 1, 2, 4][..]));
    }

    #[test]
    fn every_register_runs_through_all_its_states() {
        for degree in DEGREES {
            let word = m_sequence(degree);
            assert_eq!(word.length, (1 << degree) - 1);
            assert_eq!(word.weight(), 1 << (degree - 1), "degree {degree}");
            assert_eq!(word.period(), word.length);
        }
    }

    #[test]
    fn gold_words_have_three_weights_and_the_heaviest_is_known() {
        for degree in GOLD_DEGREES {
            let words = gold(degree);
            let mut weights: Vec<usize> = words.iter().map(CodeWord::weight).collect();
            weights.sort_unstable();
            weights.dedup();
            let t = (1 << ((degree + 2) / 2)) + 1;
            let length = length(degree) as usize;
            assert_eq!(weights, [(length - t) / 2 + 1, length.div_ceil(2), (length + t) / 2]);
            assert_eq!(weights[2], gold_weight(degree), "degree {degree}");
            assert_eq!(words.len(), length + 2);
        }
    }

    #[test]
    fn refusals_name_what_is_possible() {
        let refusal = Family::gold(8).unwrap_err().to_string();
        assert_eq!(refusal, "a Gold code of degree 8 is not possible; use 5, 6, 7, 9, 10 or 11");
        let refusal = Family::m_sequence(16).unwrap_err().to_string();
        assert_eq!(refusal, "an m-sequence of degree 16 is not possible; use 3 to 15");
    }
}
