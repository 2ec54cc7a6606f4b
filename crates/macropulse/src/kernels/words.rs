//! Code words as times, and the marks of many macropulses one behind the other.

use macropulse_codec::level::Level;

use super::train::{STEP, Train, append_train};

/// Code words as the times of their marks, in whatever unit.
#[derive(Debug)]
pub(crate) struct Words {
    /// Times of the marks of all words, each padded to `padded` numbers.
    marks: Vec<u32>,
    padded: usize,
    /// Marks of each word.
    weights: Vec<u32>,
    /// Times of the first and of the last mark of each word that has any: two numbers beside each other
    /// are soon looked up.
    ends: Vec<Option<[u32; 2]>>,
    /// Length of a bit.
    bit: u32,
}

/// A macropulse of a sensor: a code word at every lit bit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Macropulse {
    /// When its first chip arrives.
    pub(crate) start: u32,
    /// Which word it is made of.
    pub(crate) word: u16,
    /// The lit bits; the one sent first is the lowest.
    pub(crate) lit: u32,
}

impl Words {
    /// Words with the marks that each of `words` gives, counted in chips that last `chip`, `length`
    /// of them to a bit. Each has `most` marks at most.
    pub(crate) fn new<'a>(
        words: impl Iterator<Item = &'a [u16]>,
        most: usize,
        (chip, length): (u32, u32),
    ) -> Self {
        let padded = most.next_multiple_of(STEP);
        let (mut marks, mut weights, mut ends) = (Vec::new(), Vec::new(), Vec::new());
        for word in words {
            let kept = &word[..word.len().min(padded)];
            marks.extend(kept.iter().map(|mark| u32::from(*mark) * chip));
            weights.push(kept.len() as u32);
            let first_and_last = kept.first().zip(kept.last());
            ends.push(
                first_and_last.map(|ends| [ends.0, ends.1].map(|end| u32::from(*end) * chip)),
            );
            marks.resize(weights.len() * padded, 0);
        }
        Self { marks, padded, weights, ends, bit: length * chip }
    }

    fn word(&self, word: u16) -> &[u32] {
        &self.marks[usize::from(word) * self.padded..][..self.padded]
    }

    /// The pulse train of `sent`.
    pub(crate) fn train(&self, sent: &Macropulse) -> Train<'_> {
        Train {
            word: self.word(sent.word),
            weight: self.weights[usize::from(sent.word)] as usize,
            bit: self.bit,
            lit: sent.lit,
            start: sent.start,
        }
    }

    /// Marks of `sent`.
    #[inline]
    pub(crate) fn count(&self, sent: &Macropulse) -> usize {
        (sent.lit.count_ones() * self.weights[usize::from(sent.word)]) as usize
    }

    /// When the first and the last mark of `sent` arrive; `None` if it has none.
    #[inline]
    pub(crate) fn ends(&self, sent: &Macropulse) -> Option<[u32; 2]> {
        let [first, last] = self.ends[usize::from(sent.word)]?;
        let (first_bit, last_bit) = (sent.lit.trailing_zeros(), sent.lit.checked_ilog2()?);
        let at = |bit: u32, mark: u32| sent.start.wrapping_add(bit * self.bit + mark);
        Some([at(first_bit, first), at(last_bit, last)])
    }

    /// The bits of `sent` that begin at `time` or before, and the others: those of them that may
    /// have a mark by then, and those that have none.
    pub(crate) fn parted(&self, sent: &Macropulse, time: u32) -> (Macropulse, Macropulse) {
        let since = time.checked_sub(sent.start);
        let begun = since.map_or(0, |since| since / self.bit.max(1) + 1);
        let near = 1_u32.checked_shl(begun).map_or(u32::MAX, |bit| bit - 1);
        (
            Macropulse { lit: sent.lit & near, ..*sent },
            Macropulse { lit: sent.lit & !near, ..*sent },
        )
    }

    /// The most marks within a time shorter than `span` of any macropulse of up to `bits` bits:
    /// reached where they are all lit.
    pub(crate) fn most_within(&self, span: u32, bits: u32) -> usize {
        let (mut most, span) = (0, span.max(1));
        for (word, weight) in self.marks.chunks(self.padded.max(1)).zip(&self.weights) {
            let word = &word[..*weight as usize];
            let marks = || (0..bits).flat_map(|bit| word.iter().map(move |m| m + bit * self.bit));
            let (mut opening, mut within) = (marks().peekable(), 0);
            for mark in marks() {
                within += 1;
                while opening.next_if(|first| mark - first >= span).is_some() {
                    within -= 1;
                }
                most = most.max(within);
            }
        }
        most
    }

    /// Appends the times of the marks of all `sent`, one behind the other.
    pub(crate) fn append(&self, sent: &[Macropulse], times: &mut Vec<u32>) {
        match Level::here() {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => avx512::append_all(self, sent, times),
            _ => sent.iter().for_each(|sent| append_train(&self.train(sent), times)),
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use super::{Macropulse, STEP, Words};
    use std::arch::x86_64::{
        _mm512_add_epi32, _mm512_loadu_si512, _mm512_maskz_compress_epi32, _mm512_mullo_epi32,
        _mm512_set1_epi32, _mm512_setr_epi32, _mm512_storeu_si512,
    };
    use std::mem::MaybeUninit;

    /// Macropulses whose bits are listed together.
    const TOGETHER: usize = 32;

    /// Room for the bits of all of them; sixteen more are written than there are.
    const BITS: usize = TOGETHER * 32 + STEP;

    /// Lit bits of some macropulses, one behind the other.
    struct Bits {
        start: [MaybeUninit<u32>; BITS],
        word: [MaybeUninit<u32>; BITS],
    }

    /// Appends the marks of `sent`, which the processor must have AVX-512 for.
    pub(super) fn append_all(words: &Words, sent: &[Macropulse], times: &mut Vec<u32>) {
        let mut bits =
            Bits { start: [MaybeUninit::uninit(); BITS], word: [MaybeUninit::uninit(); BITS] };
        for some in sent.chunks(TOGETHER) {
            let marks: usize = some.iter().map(|sent| words.count(sent)).sum();
            times.reserve(marks + words.padded);
            let length = times.len() + marks;
            // SAFETY: this is only called where the processor has AVX-512. There is room for the
            // marks and for what the last bit is padded with; `count` has asked for each word.
            unsafe {
                let listed = list(words, some, &mut bits);
                match words.padded / STEP {
                    1 => write::<1>(words, (&bits, listed), times.spare_capacity_mut()),
                    2 => write::<2>(words, (&bits, listed), times.spare_capacity_mut()),
                    _ => write::<0>(words, (&bits, listed), times.spare_capacity_mut()),
                }
                times.set_len(length);
            }
        }
    }

    /// Lists the lit bits of up to [`TOGETHER`] macropulses: how many they are.
    ///
    /// A jump for each bit, and one past the last, would be mispredicted for nearly every macropulse.
    #[target_feature(enable = "avx512f,popcnt")]
    fn list(words: &Words, sent: &[Macropulse], bits: &mut Bits) -> usize {
        let order = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        let starts = _mm512_mullo_epi32(order, _mm512_set1_epi32(words.bit as i32));
        let mut listed = 0;
        for sent in sent.iter().take(TOGETHER) {
            let (mut lit, mut start) = (sent.lit, sent.start);
            while lit != 0 {
                let half = lit as u16;
                let all = _mm512_add_epi32(starts, _mm512_set1_epi32(start as i32));
                let lit_ones = _mm512_maskz_compress_epi32(half, all);
                // SAFETY: at most 32 bits of each macropulse are listed, and there is room for
                // sixteen behind those.
                unsafe {
                    let word = _mm512_set1_epi32(i32::from(sent.word));
                    _mm512_storeu_si512(bits.start.as_mut_ptr().add(listed).cast(), lit_ones);
                    _mm512_storeu_si512(bits.word.as_mut_ptr().add(listed).cast(), word);
                }
                listed += half.count_ones() as usize;
                lit >>= STEP;
                start = start.wrapping_add(words.bit.wrapping_mul(STEP as u32));
            }
        }
        listed
    }

    /// Writes the marks of all bits listed. A bit has `STEPS` times sixteen marks with their padding; if
    /// `STEPS` is 0, the length of the padded words counts.
    ///
    /// # Safety
    /// There must be room for the marks of all bits and the padding of the last, and the words
    /// listed must be there.
    #[target_feature(enable = "avx512f")]
    unsafe fn write<const STEPS: usize>(
        words: &Words,
        (bits, listed): (&Bits, usize),
        places: &mut [MaybeUninit<u32>],
    ) {
        let steps = if STEPS == 0 { words.padded / STEP } else { STEPS };
        let mut place = places.as_mut_ptr();
        for (start, word) in bits.start.iter().zip(&bits.word).take(listed) {
            // SAFETY: the first `listed` bits were listed; the caller guarantees the rest.
            unsafe {
                let start = _mm512_set1_epi32(start.assume_init() as i32);
                let word = word.assume_init() as usize;
                let marks = words.marks.as_ptr().add(word * steps * STEP);
                for step in 0..steps {
                    let times = _mm512_loadu_si512(marks.add(step * STEP).cast());
                    let times = _mm512_add_epi32(times, start);
                    _mm512_storeu_si512(place.add(step * STEP).cast(), times);
                }
                place = place.add(*words.weights.get_unchecked(word) as usize);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
    use proptest::prelude::*;

    const CHIP: u32 = 64;
    const LENGTH: u32 = 300;

    fn words(marks: &[std::collections::BTreeSet<u16>]) -> (Vec<Vec<u16>>, Words) {
        let marks: Vec<Vec<u16>> =
            marks.iter().map(|word| word.iter().copied().collect()).collect();
        let most = marks.iter().map(Vec::len).max().unwrap_or(0);
        let words = Words::new(marks.iter().map(Vec::as_slice), most, (CHIP, LENGTH));
        (marks, words)
    }

    proptest! {
        #[test]
        fn marks_of_all_macropulses_follow_each_other_at_every_level(
            marks in proptest::collection::vec(
                proptest::collection::btree_set(0..LENGTH as u16, 0..60), 1..5,
            ),
            sent in proptest::collection::vec((any::<u32>(), any::<u16>(), any::<u32>()), 0..80),
            short: bool,
            span in 1..40_000_u32,
        ) {
            let (marks, words) = words(&marks);
            let sent: Vec<Macropulse> = sent.iter().map(|&(start, word, lit)| Macropulse {
                start: start >> 16,
                word: word % marks.len() as u16,
                lit: if short { lit & 0x1FFF } else { lit },
            }).collect();
            let mut expected = vec![9];
            for sent in &sent {
                let from = expected.len();
                for bit in (0..32).filter(|bit| sent.lit >> bit & 1 == 1) {
                    let word = &marks[usize::from(sent.word)];
                    let at = sent.start + bit * LENGTH * CHIP;
                    expected.extend(word.iter().map(|mark| at + u32::from(*mark) * CHIP));
                }
                let all = &expected[from..];
                prop_assert_eq!(words.count(sent), all.len());
                let ends = all.first().zip(all.last()).map(|(first, last)| [*first, *last]);
                prop_assert_eq!(words.ends(sent), ends);
                let (near, behind) = words.parted(sent, span);
                prop_assert_eq!(near.lit ^ behind.lit, sent.lit);
                prop_assert!(words.ends(&behind).is_none_or(|[first, _]| first > span));
                prop_assert!(words.ends(&near).is_none_or(|[first, _]| first < span + LENGTH * CHIP));
                let bound = words.most_within(span, 32);
                for (index, first) in all.iter().enumerate() {
                    let within = all[index..].iter().take_while(|mark| **mark - first < span);
                    prop_assert!(within.count() <= bound);
                }
            }
            for (level, times) in at_each_level(|| {
                let mut times = vec![9];
                words.append(&sent, &mut times);
                times
            }) {
                prop_assert_eq!(&times, &expected, "{:?}", level);
            }
        }
    }

    #[test]
    fn the_most_marks_at_once_are_counted_over_the_seam_of_two_bits() {
        let (_, words) = words(&[[0, 10, 299].into(), [5].into()]);
        assert_eq!(words.most_within(CHIP * 10, 1), 1);
        assert_eq!(words.most_within(CHIP * 11, 1), 2);
        assert_eq!(words.most_within(CHIP * 12, 13), 3);
        assert_eq!(words.most_within(CHIP * 12, 1), 2);
    }
}
