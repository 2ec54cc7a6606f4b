//! How many marks fit, for many lags at once.
//!
//! Every mark gives one bit for each lag. The bits are added the way hardware would: 64 lags
//! side by side in a machine word, the count of each spread over bit planes, carries saved for
//! the next plane.

use super::level::on_every_level;

/// Machine words of one block of lags.
pub(crate) const BLOCK_WORDS: usize = 8;

/// One bit for each of 64 · [`BLOCK_WORDS`] lags.
pub(crate) type Block = [u64; BLOCK_WORDS];

/// Planes of a count; a macropulse has at most 65535 marks.
pub(crate) const PLANES: usize = 16;

/// Counts into `planes`, plane p of weight 2^p, for each lag of a block how many of the marks are
/// lit: bit `first + lag + scale · mark` of `words`, the lowest bit first. Bits beyond the end are
/// dark. `marks` ascend; `planes` must be dark before.
pub(crate) fn count_marks(
    words: &[u64],
    first: usize,
    marks: (&[u16], usize),
    planes: &mut [Block; PLANES],
) {
    let last = marks.0.last().map_or(0, |&mark| marks.1 * usize::from(mark));
    let reach = (first + last) / 64 + BLOCK_WORDS + 1;
    if reach <= words.len() {
        count_within(words, first, marks, planes);
    } else {
        let mut longer = words.to_vec();
        longer.resize(reach, 0);
        count_within(&longer, first, marks, planes);
    }
}

on_every_level! {
    /// [`count_marks`] where no block reaches beyond the end.
    fn count_within(
        words: &[u64],
        first: usize,
        marks: (&[u16], usize),
        planes: &mut [Block; PLANES],
    ) {
        let (marks, scale) = marks;
        let used = ((usize::BITS - marks.len().leading_zeros()) as usize).min(PLANES);
        let (mut ones, mut twos, mut fours) = ([0; BLOCK_WORDS], [0; BLOCK_WORDS], [0; BLOCK_WORDS]);
        let mut eights = marks.chunks_exact(8);
        for eight in &mut eights {
            // Seven adders take eight bits in and carry one out, so that most of the work stays
            // in the three lowest planes.
            // A closure would not be compiled for the level.
            macro_rules! bits {
                ($index:literal) => {
                    read(words, first + scale * usize::from(eight[$index]))
                };
            }
            let (sum, a) = add(ones, bits!(0), bits!(1));
            let (sum, mut b) = add(sum, bits!(2), bits!(3));
            let (sum_of_twos, c) = add(twos, a, b);
            let (sum, a) = add(sum, bits!(4), bits!(5));
            (ones, b) = add(sum, bits!(6), bits!(7));
            let d;
            (twos, d) = add(sum_of_twos, a, b);
            let mut carried;
            (fours, carried) = add(fours, c, d);
            for plane in &mut planes[3..used.max(3)] {
                (*plane, carried) = (xor(*plane, carried), and(*plane, carried));
            }
        }
        planes[..3].copy_from_slice(&[ones, twos, fours]);
        for mark in eights.remainder() {
            let mut carried = read(words, first + scale * usize::from(*mark));
            for plane in &mut planes[..used] {
                (*plane, carried) = (xor(*plane, carried), and(*plane, carried));
            }
        }
    }
}

/// One bit for each lag of a block that has `least` or more of the marks, counted as by
/// [`count_marks`].
pub(crate) fn with_marks(words: &[u64], first: usize, marks: (&[u16], usize), least: u16) -> Block {
    let mut planes = [[0; BLOCK_WORDS]; PLANES];
    count_marks(words, first, marks, &mut planes);
    let used = (usize::BITS - marks.0.len().leading_zeros()).max(16 - least.leading_zeros());
    let mut enough = [u64::MAX; BLOCK_WORDS];
    for (weight, plane) in planes.into_iter().enumerate().take(used as usize) {
        enough = if least >> weight & 1 == 1 { and(plane, enough) } else { or(plane, enough) };
    }
    enough
}

// Whole lanes in, whole lanes out: compilers keep these in one register.

macro_rules! on_lanes {
    ($name:ident, $sign:tt) => {
        #[inline(always)]
        fn $name(mut a: Block, b: Block) -> Block {
            for lane in 0..BLOCK_WORDS {
                a[lane] $sign b[lane];
            }
            a
        }
    };
}

on_lanes!(xor, ^=);
on_lanes!(and, &=);
on_lanes!(or, |=);

/// The sum of three bits, in each lag, and what is carried to the next plane.
#[inline(always)]
fn add(a: Block, b: Block, c: Block) -> (Block, Block) {
    (xor(xor(a, b), c), or(and(a, b), and(c, or(a, b))))
}

/// The block of bits that begins with bit `first`.
#[inline(always)]
fn read(words: &[u64], first: usize) -> Block {
    let (word, shift) = (first / 64, first % 64);
    let mut lanes = [0; BLOCK_WORDS];
    let Some(words) = words.get(word..word + BLOCK_WORDS + 1) else { return lanes };
    for lane in 0..BLOCK_WORDS {
        // Two shifts, because a shift by 64 does not give 0.
        lanes[lane] = words[lane] >> shift | words[lane + 1] << 1 << (63 - shift);
    }
    lanes
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_counts_what_is_lit(
            lit in proptest::collection::vec(0..6000_usize, 0..3000),
            marks in proptest::collection::btree_set(0..4000_u16, 0..400),
            first in 0..7000_usize,
            scale in 1..3_usize,
            least in 0..200_u16,
        ) {
            let marks: Vec<u16> = marks.into_iter().collect();
            let mut words = vec![0_u64; 100];
            lit.iter().for_each(|bit| words[bit / 64] |= 1 << (bit % 64));
            let is_lit = |bit: usize| words.get(bit / 64).is_some_and(|w| w >> (bit % 64) & 1 == 1);
            let expected: Vec<usize> = (0..64 * BLOCK_WORDS)
                .map(|lag| {
                    let place = |&&mark: &&u16| is_lit(first + lag + scale * usize::from(mark));
                    marks.iter().filter(place).count()
                })
                .collect();
            let counted = at_each_level(|| {
                let mut planes = [[0; BLOCK_WORDS]; PLANES];
                count_marks(&words, first, (&marks, scale), &mut planes);
                planes
            });
            for (level, planes) in counted {
                let at = |lag: usize| {
                    let bit = |plane: &Block| (plane[lag / 64] >> (lag % 64) & 1) as usize;
                    planes.iter().enumerate().map(|(p, plane)| bit(plane) << p).sum::<usize>()
                };
                let counts: Vec<usize> = (0..64 * BLOCK_WORDS).map(at).collect();
                prop_assert_eq!(&counts, &expected, "{:?}", level);
            }
            for (level, lit) in at_each_level(|| with_marks(&words, first, (&marks, scale), least)) {
                let is_lit = |lag: &usize| lit[lag / 64] >> (lag % 64) & 1 == 1;
                let lags: Vec<usize> = (0..64 * BLOCK_WORDS).filter(is_lit).collect();
                let enough = |lag: &usize| expected[*lag] >= usize::from(least);
                let expected: Vec<usize> = (0..64 * BLOCK_WORDS).filter(enough).collect();
                prop_assert_eq!(lags, expected, "{:?}", level);
            }
        }
    }
}
