//! Words written out, chip by chip.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::super::{CodeWord, Error};

/// Most words of a family: the index of a word has 16 bits.
const MOST_WORDS: u32 = u16::MAX as u32;

/// The words of `length` chips that are lit at `marks`.
pub(super) fn words(length: u32, marks: Vec<Vec<u32>>) -> Result<Arc<[CodeWord]>, Error> {
    super::checked_length(length, 1)?;
    let count = u32::try_from(marks.len()).unwrap_or(u32::MAX);
    if !(1..=MOST_WORDS).contains(&count) {
        return Err(Error::Words { words: count, possible: MOST_WORDS });
    }
    let mut seen = BTreeMap::new();
    let word = |(word, marks): (u32, Vec<u32>)| {
        let Some(&last) = marks.last() else { return Err(Error::Dark { word }) };
        if let Some(pair) = marks.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(Error::MarkOrder { word, before: pair[0], mark: pair[1] });
        }
        if last >= length {
            return Err(Error::MarkBeyond { word, mark: last, last: length - 1 });
        }
        let marks: Vec<u16> = marks.into_iter().map(|mark| mark as u16).collect();
        match seen.insert(marks.clone(), word) {
            Some(one) => Err(Error::SameWords { one, other: word }),
            None => Ok(CodeWord { length, marks }),
        }
    };
    (0..).zip(marks).map(word).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Family;
    use super::*;

    fn family(length: u32, marks: &[&[u32]]) -> Result<Family, Error> {
        Family::listed(length, marks.iter().map(|marks| marks.to_vec()).collect())
    }

    #[test]
    fn words_are_as_written() {
        let family = family(9, &[&[0, 8], &[3], &[0, 1, 2]]).unwrap();
        let words = family.words();
        assert_eq!(
            words.iter().map(|word| &word.marks[..]).collect::<Vec<_>>(),
            [&[0, 8][..], &[3], &[0, 1, 2]]
        );
        assert!(words.iter().all(|word| word.length == 9));
        assert_eq!((family.length(), family.weight(), family.count()), (9, 3, 3));
        assert_eq!(family.to_string(), "list 9, 3");
    }

    #[test]
    fn the_longest_word_and_the_last_chip_may_be_lit() {
        assert!(family(65_535, &[&[65_534]]).is_ok());
        assert!(family(1, &[&[0]]).is_ok());
        let all: Vec<Vec<u32>> = (0..65_535).map(|mark| vec![mark]).collect();
        assert_eq!(Family::listed(65_535, all.clone()).unwrap().count(), 65_535);
        let one_more = all.into_iter().chain([vec![0, 1]]).collect();
        let told = Family::listed(65_535, one_more).unwrap_err().to_string();
        assert_eq!(told, "a family of 65536 words is not possible; use 1 to 65535");
    }

    #[test]
    fn refusals_name_the_word_and_what_is_wrong_with_it() {
        let refusal = |length, marks: &[&[u32]]| family(length, marks).unwrap_err().to_string();
        assert_eq!(refusal(9, &[]), "a family of 0 words is not possible; use 1 to 65535");
        assert!(refusal(0, &[&[0]]).contains("1 to 65535"));
        assert!(refusal(65_536, &[&[0]]).contains("1 to 65535"));
        assert_eq!(
            refusal(9, &[&[0, 4], &[]]),
            "word 1, counted from 0, has no marks: list the chips at which it is lit, or leave it out"
        );
        assert_eq!(
            refusal(9, &[&[0, 9]]),
            "word 0, counted from 0, is lit at chip 9, but its chips are 0 to 8: use longer words"
        );
        assert_eq!(
            refusal(9, &[&[0, 4], &[2, 5, 3]]),
            "word 1, counted from 0, has chip 3 behind chip 5: list each lit chip once, in ascending \
             order"
        );
        assert!(refusal(9, &[&[2, 2]]).contains("has chip 2 behind chip 2"));
        assert_eq!(
            refusal(9, &[&[0, 4], &[1, 4], &[0, 4]]),
            "words 0 and 2, counted from 0, are the same: no receiver can tell them apart"
        );
    }
}
