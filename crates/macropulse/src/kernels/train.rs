//! Trains: the marks of one macropulse, put in a row.
#![allow(clippy::needless_range_loop)]

use super::level::on_every_level;

/// Marks written at once; code words are padded to a multiple of it.
pub(crate) const STEP: usize = 16;

/// Where the marks of a train come from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Train<'a> {
    /// Times of the marks of the code word, padded to a multiple of [`STEP`].
    pub(crate) word: &'a [u32],
    /// Marks of the word, without what it was padded with.
    pub(crate) weight: usize,
    /// Length of a bit.
    pub(crate) bit: u32,
    /// The lit bits; the one sent first is the lowest.
    pub(crate) lit: u32,
    /// When the train begins.
    pub(crate) start: u32,
}

on_every_level! {
    /// Appends the times of all marks of `train`.
    pub(crate) fn append_train(train: Train<'_>, times: &mut Vec<u32>) {
        let padded = train.word.len() / STEP * STEP;
        let (word, weight) = (&train.word[..padded], train.weight.min(padded));
        // Each bit is written with its padding, which the next one overwrites.
        times.reserve(train.lit.count_ones() as usize * weight + padded);
        let spare = times.spare_capacity_mut();
        let (mut lit, mut written) = (train.lit, 0);
        while lit != 0 {
            let start = train.start.wrapping_add(lit.trailing_zeros().wrapping_mul(train.bit));
            let places = &mut spare[written..][..padded];
            for i in 0..padded {
                places[i].write(start.wrapping_add(word[i]));
            }
            written += weight;
            lit &= lit - 1;
        }
        let length = times.len() + written;
        // SAFETY: room for `written` numbers was reserved, and every bit wrote its `weight` ones.
        unsafe { times.set_len(length) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_train_is_the_word_at_every_lit_bit(
            marks in proptest::collection::vec(0..800_u32, 1..70),
            lit in 0..1_u32 << 13,
            (bit, start) in (800..1000_u32, 0..1000_u32),
            before in proptest::collection::vec(any::<u32>(), 0..5),
        ) {
            let mut word = marks.clone();
            word.resize(marks.len().next_multiple_of(STEP), 0);
            let mut expected = before.clone();
            let places = (0..13).filter(|b| lit >> b & 1 == 1).map(|b| start + b * bit);
            expected.extend(places.flat_map(|place| marks.iter().map(move |mark| place + mark)));
            for (level, times) in at_each_level(|| {
                let mut times = before.clone();
                let train = Train { word: &word, weight: marks.len(), bit, lit, start };
                append_train(train, &mut times);
                times
            }) {
                prop_assert_eq!(&times, &expected, "{:?}", level);
            }
        }
    }
}
