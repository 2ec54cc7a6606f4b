//! Code words against ticks.

use super::level::Level;
use crate::on_every_level;

/// Ticks that are compared in one go.
const LANES: usize = 16;

/// The marks of a code word in ticks.
#[derive(Debug, Clone)]
pub(crate) struct WordTicks {
    /// How many there are.
    marks: usize,
    /// They, and a filling up to whole blocks.
    ticks: Vec<u32>,
}

impl WordTicks {
    /// A word with the given `marks`, `scale` ticks a chip.
    pub(crate) fn new(marks: &[u16], scale: u32) -> Self {
        let mut ticks: Vec<u32> = marks.iter().map(|mark| scale * u32::from(*mark)).collect();
        ticks.resize(marks.len().next_multiple_of(LANES), 0);
        Self { marks: marks.len(), ticks }
    }

    /// The ticks from its start to each mark.
    pub(crate) fn ticks(&self) -> &[u32] {
        &self.ticks[..self.marks]
    }
}

on_every_level! {
    /// Makes `places` the marks of `word`, begun at each of `bits`.
    pub(crate) fn places_of(word: &WordTicks, bits: &[u32], places: &mut Vec<u32>) {
        // The filling of a word is written over by the next one.
        let all = bits.len() * word.marks;
        places.resize(all + word.ticks.len(), 0);
        let mut rest = &mut places[..];
        let (blocks, _) = word.ticks.as_chunks::<LANES>();
        for bit in bits {
            for (block, marks) in rest.as_chunks_mut::<LANES>().0.iter_mut().zip(blocks) {
                *block = marks.map(|mark| bit + mark);
            }
            rest = &mut rest[word.marks..];
        }
        places.truncate(all);
    }
}

/// True if the first ticks are the marks of `word`, begun at each of the `bits` behind `start`, with no tick
/// between them. `false` if there are too few ticks.
pub(crate) fn begin_with(ticks: &[u32], word: &WordTicks, bits: &[u32], start: u32) -> bool {
    let marks = &word.ticks[..word.marks];
    let Some(ticks) = ticks.get(..bits.len() * marks.len()) else { return false };
    // If another macropulse overlaps, the last tick shows it.
    let (Some(tick), Some(bit), Some(mark)) = (ticks.last(), bits.last(), marks.last()) else {
        return true;
    };
    if *tick != start.wrapping_add(*bit).wrapping_add(*mark) {
        return false;
    }
    match Level::here() {
        // SAFETY: the processor has what this level asks for, and there is a tick for each mark of each bit.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { avx512::are_marks(ticks, marks, bits, start) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { avx2::are_marks(ticks, marks, bits, start) },
        _ => are_marks(ticks, marks, bits, start),
    }
}

on_every_level! {
    /// The same, with one tick for each mark of each bit.
    fn are_marks(ticks: &[u32], marks: &[u32], bits: &[u32], start: u32) -> bool {
        bits.iter().zip(ticks.chunks_exact(marks.len().max(1))).all(|(bit, ticks)| {
            let begin = start.wrapping_add(*bit);
            let pairs = ticks.iter().zip(marks);
            pairs.fold(0, |wrong, (tick, mark)| wrong | tick ^ begin.wrapping_add(*mark)) == 0
        })
    }
}

/// The same, half a block in one instruction.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::LANES;
    use std::arch::x86_64::*;

    /// Marks that are compared at once.
    const HALF: usize = LANES / 2;

    /// # Safety
    ///
    /// The processor must have AVX2, and there must be one of `ticks` for each mark in all bits.
    #[target_feature(enable = "avx2")]
    pub(super) unsafe fn are_marks(ticks: &[u32], marks: &[u32], bits: &[u32], start: u32) -> bool {
        let Some(last) = marks.len().checked_sub(HALF) else {
            return super::are_marks(ticks, marks, bits, start);
        };
        let mut wrong = _mm256_setzero_si256();
        for (index, bit) in bits.iter().enumerate() {
            let begin = _mm256_set1_epi32(start.wrapping_add(*bit) as i32);
            let mut first = 0;
            // The last marks are compared together with some of those before them.
            while first < marks.len() {
                let from = first.min(last);
                // SAFETY: there is a tick for each mark of each bit, and no mark behind the last one is read.
                let (mark, tick) = unsafe {
                    let tick = ticks.as_ptr().add(index * marks.len() + from);
                    (
                        _mm256_loadu_si256(marks.as_ptr().add(from).cast()),
                        _mm256_loadu_si256(tick.cast()),
                    )
                };
                let different = _mm256_xor_si256(tick, _mm256_add_epi32(begin, mark));
                wrong = _mm256_or_si256(wrong, different);
                first += HALF;
            }
        }
        _mm256_testz_si256(wrong, wrong) == 1
    }
}

/// The same, a block in one instruction.
#[cfg(target_arch = "x86_64")]
mod avx512 {
    use super::LANES;
    use std::arch::x86_64::*;

    /// Blocks that are compared in each pass over the bits: words have two, rarely more.
    const BLOCKS: usize = 2;

    /// Distance, in ticks, at which ticks are fetched ahead: three macropulses of `kim-park-2016`. The last
    /// one of each is asked for before all others, which no prefetcher foresees. With 384 and with 768 a
    /// clean band takes equally long, with 200 or none a sixteenth more.
    const AHEAD: usize = 512;

    /// # Safety
    ///
    /// The processor must have AVX-512 F, and there must be one of `ticks` for each mark in all bits.
    #[target_feature(enable = "avx512f")]
    pub(super) unsafe fn are_marks(ticks: &[u32], marks: &[u32], bits: &[u32], start: u32) -> bool {
        let start = _mm512_set1_epi32(start as i32);
        for (pass, of_pass) in marks.chunks(BLOCKS * LANES).enumerate() {
            let used: [__mmask16; BLOCKS] = std::array::from_fn(|block| {
                let left = of_pass.len().saturating_sub(block * LANES).min(LANES);
                ((1_u32 << left) - 1) as u16
            });
            // SAFETY: no more is read than the pass has.
            let expected = std::array::from_fn::<_, BLOCKS, _>(|block| unsafe {
                let first = of_pass.as_ptr().wrapping_add(block * LANES);
                _mm512_add_epi32(start, _mm512_maskz_loadu_epi32(used[block], first.cast()))
            });
            let mut wrong = [_mm512_setzero_si512(); BLOCKS];
            for (index, bit) in bits.iter().enumerate() {
                let begin = _mm512_set1_epi32(*bit as i32);
                let of_bit =
                    ticks.as_ptr().wrapping_add(index * marks.len() + pass * BLOCKS * LANES);
                for block in 0..BLOCKS {
                    let first = of_bit.wrapping_add(block * LANES);
                    // SAFETY: there is a tick for each mark of each bit, and no more is read; what is fetched
                    // need not be there.
                    let found = unsafe {
                        _mm_prefetch::<_MM_HINT_T0>(first.wrapping_add(AHEAD).cast());
                        _mm512_maskz_loadu_epi32(used[block], first.cast())
                    };
                    let mark = _mm512_add_epi32(begin, expected[block]);
                    // Wrong already, or not the same in both.
                    const OR_DIFFERENT: i32 = 0b1111_0110;
                    wrong[block] =
                        _mm512_ternarylogic_epi32::<OR_DIFFERENT>(wrong[block], found, mark);
                }
            }
            let of_block =
                |block: usize| _mm512_mask_test_epi32_mask(used[block], wrong[block], wrong[block]);
            if (0..BLOCKS).fold(0, |any, block| any | of_block(block)) != 0 {
                return false;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn one_wrong_tick_is_noticed_at_every_level(
            marks in proptest::collection::btree_set(0_u16..500, 1..40),
            bits in proptest::collection::btree_set(0_u32..13, 1..13),
            start in 0..1_000_000_u32,
            scale in 1..20_u32,
            wrong in proptest::option::of((0.0..1.0_f64, 1..1000_u32)),
            more in 0..20_u32,
        ) {
            let marks: Vec<u16> = marks.into_iter().collect();
            let bits: Vec<u32> = bits.into_iter().map(|bit| 500 * scale * bit).collect();
            let expected: Vec<u32> =
                bits.iter().flat_map(|bit| marks.iter().map(move |m| bit + scale * u32::from(*m))).collect();
            let mut ticks: Vec<u32> = expected.iter().map(|tick| start + tick).collect();
            if let Some((place, by)) = wrong {
                let place = (place * ticks.len() as f64) as usize;
                ticks[place] += by;
            }
            let last = ticks[ticks.len() - 1];
            ticks.extend((0..more).map(|tick| last + 7 * tick));
            let word = WordTicks::new(&marks, scale);
            for (level, fits) in at_each_level(|| begin_with(&ticks, &word, &bits, start)) {
                prop_assert_eq!(fits, wrong.is_none(), "{:?}", level);
            }
            let places = at_each_level(|| {
                let mut places = vec![7; more as usize];
                places_of(&word, &bits, &mut places);
                places
            });
            for (level, places) in places {
                prop_assert_eq!(&places, &expected, "{:?}", level);
            }
            let few = &ticks[..marks.len() * bits.len() - 1];
            prop_assert!(!begin_with(few, &word, &bits, start));
        }
    }
}
