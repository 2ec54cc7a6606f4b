//! Code words against ticks.

use crate::on_every_level;

/// Ticks that are compared in one go.
const LANES: usize = 16;

/// The marks of a code word in ticks, made as long as whole blocks of ticks are.
#[derive(Debug, Clone)]
pub(crate) struct WordTicks {
    marks: usize,
    ticks: Vec<[u32; LANES]>,
    /// All bits where there is a mark, none in the filling.
    used: Vec<[u32; LANES]>,
}

impl WordTicks {
    /// A word with the given `marks`, `scale` ticks a chip.
    pub(crate) fn new(marks: &[u16], scale: u32) -> Self {
        let (mut ticks, mut used) = (Vec::new(), Vec::new());
        for marks in marks.chunks(LANES) {
            let at = |lane: usize| marks.get(lane).copied();
            let in_lanes = |of: &dyn Fn(Option<u16>) -> u32| std::array::from_fn(|l| of(at(l)));
            ticks.push(in_lanes(&|mark| scale * u32::from(mark.unwrap_or(0))));
            used.push(in_lanes(&|mark| if mark.is_some() { u32::MAX } else { 0 }));
        }
        Self { marks: marks.len(), ticks, used }
    }

    /// Number of marks.
    pub(crate) fn marks(&self) -> usize {
        self.marks
    }

    /// The tick of each mark, in order.
    pub(crate) fn get(&self, mark: usize) -> Option<u32> {
        self.ticks.as_flattened()[..self.marks].get(mark).copied()
    }
}

on_every_level! {
    /// Makes `places` the marks of `word`, begun at `scale` · bit for each of `bits`.
    pub(crate) fn places_of(word: &WordTicks, bits: &[u32], scale: u32, places: &mut Vec<u32>) {
        // The filling of a word is written over by the next one.
        let all = bits.len() * word.marks;
        places.resize(all + word.ticks.len() * LANES, 0);
        let mut rest = &mut places[..];
        for &bit in bits {
            let begin = scale * bit;
            for (block, marks) in rest.as_chunks_mut::<LANES>().0.iter_mut().zip(&word.ticks) {
                *block = marks.map(|mark| begin + mark);
            }
            rest = &mut rest[word.marks..];
        }
        places.truncate(all);
    }
}

on_every_level! {
    /// Whether the first ticks are the marks of `word`, begun at `begun.0 + begun.1 · bit` for
    /// each of `bits`, with no tick between them. `false` where there are too few ticks.
    pub(crate) fn begin_with(
        ticks: &[u32],
        word: &WordTicks,
        bits: &[u32],
        begun: (u32, u32),
    ) -> bool {
        let (start, scale) = begun;
        if ticks.len() < bits.len() * word.marks {
            return false;
        }
        let mut rest = ticks;
        for &bit in bits {
            let begin = start.wrapping_add(scale.wrapping_mul(bit));
            let mut wrong = [0; LANES];
            let mut block = rest;
            for (marks, used) in word.ticks.iter().zip(&word.used) {
                // The filling of the last block reaches beyond the word, and at the end of the
                // list beyond that.
                let ticks = match block.first_chunk::<LANES>() {
                    Some(ticks) => *ticks,
                    None => {
                        let mut ticks = [0; LANES];
                        ticks[..block.len()].copy_from_slice(block);
                        ticks
                    }
                };
                for lane in 0..LANES {
                    wrong[lane] |= (ticks[lane] ^ begin.wrapping_add(marks[lane])) & used[lane];
                }
                block = &block[LANES.min(block.len())..];
            }
            if wrong.iter().fold(0, |any, wrong| any | wrong) != 0 {
                return false;
            }
            rest = &rest[word.marks..];
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
            let bits: Vec<u32> = bits.into_iter().map(|bit| 500 * bit).collect();
            let all = bits.iter().flat_map(|bit| marks.iter().map(move |m| bit + u32::from(*m)));
            let mut ticks: Vec<u32> = all.map(|chip| start + scale * chip).collect();
            if let Some((place, by)) = wrong {
                let place = (place * ticks.len() as f64) as usize;
                ticks[place] += by;
            }
            let last = ticks[ticks.len() - 1];
            ticks.extend((0..more).map(|tick| last + 7 * tick));
            let word = WordTicks::new(&marks, scale);
            for (level, fits) in at_each_level(|| begin_with(&ticks, &word, &bits, (start, scale))) {
                prop_assert_eq!(fits, wrong.is_none(), "{:?}", level);
            }
            let expected: Vec<u32> =
                bits.iter().flat_map(|bit| marks.iter().map(move |m| scale * (bit + u32::from(*m)))).collect();
            let places = at_each_level(|| {
                let mut places = vec![7; more as usize];
                places_of(&word, &bits, scale, &mut places);
                places
            });
            for (level, places) in places {
                prop_assert_eq!(&places, &expected, "{:?}", level);
            }
            let few = &ticks[..marks.len() * bits.len() - 1];
            prop_assert!(!begin_with(few, &word, &bits, (start, scale)));
        }
    }
}
