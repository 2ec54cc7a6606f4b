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

/// Chips from the mark before to each mark of `word`; to its first one from the last of the same word before.
fn gaps(word: &CodeWord) -> Vec<u32> {
    let marks = word.marks.iter().map(|&mark| u32::from(mark));
    let before = word.marks.last().map(|&mark| u32::from(mark).wrapping_sub(word.length));
    let before = before.into_iter().chain(marks.clone());
    before.zip(marks).map(|(before, mark)| mark.wrapping_sub(before)).collect()
}

/// Marks of `word` less than `chips` chips behind another one, be it of the same word before.
pub(super) fn shared(word: &CodeWord, chips: u32) -> u32 {
    gaps(word).iter().filter(|gap| **gap < chips).count() as u32
}

/// Marks of `word` less than `chips` chips from another one, be it of the same word before or behind.
pub(super) fn crowded(word: &CodeWord, chips: u32) -> Vec<u16> {
    let before = gaps(word);
    let behind = before.iter().cycle().skip(1);
    let nearest = before.iter().zip(behind).map(|(before, behind)| before.min(behind));
    let marks = word.marks.iter().zip(nearest).filter(|(_, gap)| **gap < chips);
    marks.map(|(mark, _)| *mark).collect()
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
