//! How close the marks of a code word are to each other: a tick may be one of several.

use crate::code::CodeWord;

/// Most marks in any `chips` chips of `word`, or of two in a row.
pub(super) fn crowding(word: &CodeWord, chips: u32) -> u32 {
    let once = word.marks.iter().map(|&mark| u32::from(mark));
    let marks: Vec<u32> = once.clone().chain(once.map(|mark| mark + word.length)).collect();
    let within = |first: usize| {
        marks[first..].iter().take_while(|&&mark| mark < marks[first] + chips).count() as u32
    };
    (0..word.marks.len()).map(within).max().unwrap_or(1)
}

/// Marks of `word` less than `chips` chips behind another one, be it of the same word before.
pub(super) fn shared(word: &CodeWord, chips: u32) -> u32 {
    let marks = word.marks.iter().map(|&mark| u32::from(mark));
    let before = word.marks.last().map(|&mark| u32::from(mark).wrapping_sub(word.length));
    let pairs = before.into_iter().chain(marks.clone()).zip(marks);
    pairs.filter(|(before, mark)| mark.wrapping_sub(*before) < chips).count() as u32
}

/// Marks of `word` less than `chips` chips from another one, be it of the same word before or behind.
pub(super) fn crowded(word: &CodeWord, chips: u32) -> Vec<u16> {
    let marks = &word.marks;
    let is_near = |one: u16, next: u16, between: u32| {
        (u32::from(next) + between).wrapping_sub(u32::from(one)) < chips
    };
    let last = marks.len().wrapping_sub(1);
    let is_crowded = |at: &usize| {
        let before = match at {
            0 => is_near(marks[last], marks[0], word.length),
            at => is_near(marks[at - 1], marks[*at], 0),
        };
        let behind = match *at == last {
            true => is_near(marks[last], marks[0], word.length),
            false => is_near(marks[*at], marks[at + 1], 0),
        };
        before || behind
    };
    (0..marks.len()).filter(is_crowded).map(|at| marks[at]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_near_others_are_crowded_also_those_of_the_next_word() {
        let word = CodeWord { length: 20, marks: vec![0, 5, 6, 8, 19] };
        assert!(crowded(&word, 1).is_empty());
        assert_eq!(crowded(&word, 2), [0, 5, 6, 19]);
        assert_eq!(crowded(&word, 3), [0, 5, 6, 8, 19]);
        assert!(crowded(&CodeWord { length: 20, marks: vec![7] }, 20).is_empty());
        assert_eq!(crowded(&CodeWord { length: 20, marks: vec![7] }, 21), [7]);
        assert!(crowded(&CodeWord { length: 20, marks: vec![] }, 5).is_empty());
    }

    #[test]
    fn a_tick_counts_for_all_marks_it_may_be() {
        let word = CodeWord { length: 20, marks: vec![0, 5, 6, 8, 19] };
        assert_eq!([1, 2, 3, 4, 8, 9].map(|chips| crowding(&word, chips)), [1, 2, 2, 3, 4, 4]);
        assert_eq!(crowding(&CodeWord { length: 20, marks: vec![] }, 5), 1);
    }
}
