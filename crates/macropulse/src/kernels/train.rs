//! Pulse trains: the marks of one macropulse, one after the other.

use std::mem::MaybeUninit;

use macropulse_codec::level::Level;

/// Marks written at once; code words are padded to a multiple of it.
pub(crate) const STEP: usize = 16;

/// The origin of the marks of a pulse train.
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
    /// When the pulse train begins.
    pub(crate) start: u32,
}

/// Appends the times of all marks of `train`.
pub(crate) fn append_train(train: &Train, times: &mut Vec<u32>) {
    let word = train.word.as_chunks::<STEP>().0;
    let weight = train.weight.min(STEP * word.len());
    let bits = train.lit.count_ones() as usize;
    // Each bit is written with its padding, which the next one overwrites.
    times.reserve(bits * weight + STEP * word.len());
    let places = times.spare_capacity_mut();
    let is_written = match Level::here() {
        // SAFETY: the processor has what this level asks for.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { avx512::write(train, (word, weight), places) },
        _ => write(train, (word, weight), places),
    };
    if is_written {
        let length = times.len() + bits * weight;
        // SAFETY: room for that was reserved, and every bit has written its `weight` marks.
        unsafe { times.set_len(length) }
    }
}

/// Writes the bits one behind the other; false where they have no room.
fn write(
    train: &Train,
    (word, weight): (&[[u32; STEP]], usize),
    places: &mut [MaybeUninit<u32>],
) -> bool {
    let (mut lit, mut written) = (train.lit, 0);
    while lit != 0 {
        let start = train.start.wrapping_add(lit.trailing_zeros().wrapping_mul(train.bit));
        let Some(places) = places.get_mut(written..written + STEP * word.len()) else {
            return false;
        };
        for (place, mark) in places.iter_mut().zip(word.as_flattened()) {
            place.write(start.wrapping_add(*mark));
        }
        written += weight;
        lit &= lit - 1;
    }
    true
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use super::{STEP, Train};
    use std::arch::x86_64::{
        _mm512_add_epi32, _mm512_loadu_si512, _mm512_set1_epi32, _mm512_storeu_si512,
    };
    use std::mem::MaybeUninit;

    /// As [`super::write`]. Left to itself, the compiler asks more of each bit than it writes.
    #[target_feature(enable = "avx512f,bmi1,bmi2,lzcnt,popcnt")]
    pub(super) fn write(
        train: &Train,
        (word, weight): (&[[u32; STEP]], usize),
        places: &mut [MaybeUninit<u32>],
    ) -> bool {
        let bits = train.lit.count_ones() as usize;
        if places.len() < bits.saturating_sub(1) * weight + STEP * word.len() {
            return false;
        }
        let (mut lit, mut place) = (train.lit, places.as_mut_ptr());
        while lit != 0 {
            let start = train.start.wrapping_add(lit.trailing_zeros().wrapping_mul(train.bit));
            let start = _mm512_set1_epi32(start as i32);
            for (step, marks) in word.iter().enumerate() {
                // SAFETY: sixteen marks are there to be read. The last bit ends where the room
                // does that was asked for above, and the others end before that.
                unsafe {
                    let marks = _mm512_loadu_si512(marks.as_ptr().cast());
                    let place = place.add(STEP * step);
                    _mm512_storeu_si512(place.cast(), _mm512_add_epi32(marks, start));
                }
            }
            lit &= lit - 1;
            // SAFETY: as above.
            place = unsafe { place.add(weight) };
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
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
                append_train(&train, &mut times);
                times
            }) {
                prop_assert_eq!(&times, &expected, "{:?}", level);
            }
        }
    }
}
