//! How many marks fit, for many lags at once.
//!
//! Every mark gives one bit for each lag. The bits are added the way hardware would: 64 lags
//! side by side in a machine word, the count of each spread over bit planes, carries saved for
//! the next plane.

use super::level::Level;
use crate::on_every_level;

/// Machine words of one block of lags.
pub(crate) const BLOCK_WORDS: usize = 8;

/// One bit for each of 64 · [`BLOCK_WORDS`] lags.
pub(crate) type Block = [u64; BLOCK_WORDS];

/// Planes of a count; a macropulse has at most 65535 marks.
pub(crate) const PLANES: usize = 16;

/// The marks of a macropulse: those of one code word, at each of its lit bits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Marks<'a> {
    /// The marks of the code word, in ascending chips.
    pub word: &'a [u16],
    /// The first chip of each lit bit, ascending.
    pub bits: &'a [u32],
    /// Ticks per chip.
    pub scale: usize,
}

impl Marks<'_> {
    /// Number of marks.
    pub(crate) fn len(&self) -> usize {
        self.bits.len() * self.word.len()
    }

    /// Ticks from the start of the macropulse to its last mark.
    pub(crate) fn last(&self) -> usize {
        let bit = self.bits.last().copied().unwrap_or(0) as usize;
        self.scale * (bit + usize::from(self.word.last().copied().unwrap_or(0)))
    }

    /// Planes that a count of them may light.
    pub(crate) fn planes(&self) -> usize {
        ((usize::BITS - self.len().leading_zeros()) as usize).min(PLANES)
    }
}

/// Counts into `planes`, plane p of weight 2^p, for each lag of a block how many of the marks are
/// lit: bit `first + lag + mark` of `words`, the lowest bit first. Bits beyond the end are dark.
/// Planes that cannot be lit are left as they are.
pub(crate) fn count_marks(words: &[u64], first: usize, marks: Marks, planes: &mut [Block; PLANES]) {
    let reach = (first + marks.last()) / 64 + BLOCK_WORDS + 1;
    let mut longer = Vec::new();
    let words = if reach <= words.len() {
        words
    } else {
        longer.extend_from_slice(words);
        longer.resize(reach, 0);
        &longer
    };
    match Level::here() {
        // SAFETY: the processor has what this level asks for, the last mark ends within the
        // words, and a place fits into 32 bits.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 if words.len() < 1 << 26 => unsafe {
            avx512::count_within(words, first, marks, planes);
        },
        _ => count_within(words, first, marks, planes),
    }
}

on_every_level! {
    /// [`count_marks`] where no block reaches beyond the end.
    fn count_within(words: &[u64], first: usize, marks: Marks, planes: &mut [Block; PLANES]) {
        let used = marks.planes();
        planes[..used].fill([0; BLOCK_WORDS]);
        let [mut ones, mut twos, mut fours] = [[0; BLOCK_WORDS]; 3];
        let (mut eight, mut filled) = ([0; 8], 0);
        for &bit in marks.bits {
            for &mark in marks.word {
                eight[filled] = first + marks.scale * (bit as usize + usize::from(mark));
                filled += 1;
                if filled < eight.len() {
                    continue;
                }
                filled = 0;
                // Seven adders take eight bits in and carry one out, so that most of the work
                // stays in the three lowest planes. A closure would not be compiled for the level.
                macro_rules! bits {
                    ($index:literal) => {
                        read(words, eight[$index])
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
        }
        for (plane, sum) in planes[..used].iter_mut().zip([ones, twos, fours]) {
            *plane = sum;
        }
        for place in &eight[..filled] {
            let mut carried = read(words, *place);
            for plane in &mut planes[..used] {
                (*plane, carried) = (xor(*plane, carried), and(*plane, carried));
            }
        }
    }
}

/// The same where a block is one register, and one instruction cuts it out of two.
#[cfg(target_arch = "x86_64")]
mod avx512 {
    use super::{BLOCK_WORDS, Block, Marks, PLANES};
    use std::arch::x86_64::{
        __m512i, _mm512_and_si512, _mm512_loadu_si512, _mm512_set1_epi64, _mm512_setzero_si512,
        _mm512_shrdv_epi64, _mm512_storeu_si512, _mm512_ternarylogic_epi64, _mm512_xor_si512,
    };

    /// Marks that are added up before anything is carried beyond the fourth plane.
    const SIXTEEN: usize = 16;

    /// Marks whose places are worked out together, and how many of one code word.
    const GROUP: usize = 256;
    const PART: usize = 64;

    /// The four lowest planes, and all of them.
    struct Sums {
        low: [__m512i; 4],
        all: [__m512i; PLANES],
        used: usize,
    }

    /// # Safety
    ///
    /// The processor must have AVX-512 F and VBMI2, and `words`, fewer than 2^26, must reach
    /// [`BLOCK_WORDS`] + 1 words beyond the one in which the last mark lies at the first lag.
    #[target_feature(enable = "avx512f,avx512vbmi2")]
    pub(super) unsafe fn count_within(
        words: &[u64],
        first: usize,
        marks: Marks,
        planes: &mut [Block; PLANES],
    ) {
        let dark = _mm512_setzero_si512();
        let mut sums = Sums { low: [dark; 4], all: [dark; PLANES], used: marks.planes() };
        // Where each mark is, worked out beforehand: compilers would otherwise do it in registers
        // from which it takes long to get it out again.
        let (mut places, mut filled) = ([0; GROUP], 0);
        for &bit in marks.bits {
            let start = (first + marks.scale * bit as usize) as u32;
            for word in marks.word.chunks(PART) {
                if filled + word.len() > GROUP {
                    // SAFETY: no mark lies behind the last one.
                    unsafe { add_all(words, &places[..filled], &mut sums) };
                    filled = 0;
                }
                for (place, &mark) in places[filled..].iter_mut().zip(word) {
                    *place = start + marks.scale as u32 * u32::from(mark);
                }
                filled += word.len();
            }
        }
        // SAFETY: as above.
        unsafe { add_all(words, &places[..filled], &mut sums) };
        sums.all[..4].copy_from_slice(&sums.low);
        for (plane, sum) in planes.iter_mut().zip(&sums.all[..sums.used]) {
            // SAFETY: a plane is as long as a register.
            unsafe { _mm512_storeu_si512(plane.as_mut_ptr().cast(), *sum) };
        }
    }

    /// Adds the blocks at `places`.
    ///
    /// # Safety
    ///
    /// As of [`count_within`], for each place.
    #[inline]
    #[target_feature(enable = "avx512f,avx512vbmi2")]
    unsafe fn add_all(words: &[u64], places: &[u32], sums: &mut Sums) {
        let dark = _mm512_setzero_si512();
        let [mut ones, mut twos, mut fours, mut eights] = sums.low;
        for places in places.chunks(SIXTEEN) {
            macro_rules! bits {
                ($index:expr) => {
                    match places.get($index) {
                        // SAFETY: the caller answers for the places.
                        Some(place) => unsafe { read(words, *place as usize) },
                        None => dark,
                    }
                };
            }
            macro_rules! eight_from {
                ($index:literal) => {{
                    let (sum, a) = add(ones, bits!($index), bits!($index + 1));
                    let (sum, b) = add(sum, bits!($index + 2), bits!($index + 3));
                    let (sum_of_twos, c) = add(twos, a, b);
                    let (sum, a) = add(sum, bits!($index + 4), bits!($index + 5));
                    let (sum, b) = add(sum, bits!($index + 6), bits!($index + 7));
                    ones = sum;
                    let (sum, d) = add(sum_of_twos, a, b);
                    twos = sum;
                    let (sum, carried) = add(fours, c, d);
                    fours = sum;
                    carried
                }};
            }
            let (a, b) = (eight_from!(0), eight_from!(8));
            let mut carried;
            (eights, carried) = add(eights, a, b);
            for sum in &mut sums.all[4..sums.used.max(4)] {
                let both = _mm512_and_si512(*sum, carried);
                (*sum, carried) = (_mm512_xor_si512(*sum, carried), both);
            }
        }
        sums.low = [ones, twos, fours, eights];
    }

    /// The block that begins with bit `first`.
    ///
    /// # Safety
    ///
    /// There must be [`BLOCK_WORDS`] + 1 words from the one with that bit on.
    #[inline]
    #[target_feature(enable = "avx512f,avx512vbmi2")]
    unsafe fn read(words: &[u64], first: usize) -> __m512i {
        let (word, shift) = (first / 64, first % 64);
        debug_assert!(word + BLOCK_WORDS < words.len());
        // SAFETY: the caller answers for the words.
        let (low, high) = unsafe {
            let low = words.as_ptr().add(word);
            (_mm512_loadu_si512(low.cast()), _mm512_loadu_si512(low.add(1).cast()))
        };
        _mm512_shrdv_epi64(low, high, _mm512_set1_epi64(shift as i64))
    }

    /// The sum of three bits, in each lag, and what is carried to the next plane.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn add(a: __m512i, b: __m512i, c: __m512i) -> (__m512i, __m512i) {
        const ODD: i32 = 0x96;
        const MOST: i32 = 0xE8;
        let sum = _mm512_ternarylogic_epi64::<ODD>(a, b, c);
        (sum, _mm512_ternarylogic_epi64::<MOST>(a, b, c))
    }
}

/// One bit for each lag of a block that has `least` or more of the marks, counted as by
/// [`count_marks`].
pub(crate) fn with_marks(words: &[u64], first: usize, marks: Marks, least: u16) -> Block {
    let mut planes = [[0; BLOCK_WORDS]; PLANES];
    count_marks(words, first, marks, &mut planes);
    let used = marks.planes().max((u16::BITS - least.leading_zeros()) as usize);
    let mut enough = [u64::MAX; BLOCK_WORDS];
    for (weight, plane) in planes.iter().enumerate().take(used) {
        enough = if least >> weight & 1 == 1 { and(*plane, enough) } else { or(*plane, enough) };
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
        lanes[lane] = words[lane] >> shift | words[lane + 1] << 1 << (63 ^ shift);
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
            word in proptest::collection::btree_set(0..1000_u16, 0..100),
            bits in proptest::collection::btree_set(0..4_u32, 0..4),
            first in 0..7000_usize,
            scale in 1..3_usize,
            least in 0..200_u16,
        ) {
            let word: Vec<u16> = word.into_iter().collect();
            let bits: Vec<u32> = bits.into_iter().map(|bit| 1000 * bit).collect();
            let marks = Marks { word: &word, bits: &bits, scale };
            let mut words = vec![0_u64; 100];
            lit.iter().for_each(|bit| words[bit / 64] |= 1 << (bit % 64));
            let is_lit = |bit: usize| words.get(bit / 64).is_some_and(|w| w >> (bit % 64) & 1 == 1);
            let expected: Vec<usize> = (0..64 * BLOCK_WORDS)
                .map(|lag| {
                    let all = bits.iter().flat_map(|bit| word.iter().map(move |m| bit + u32::from(*m)));
                    all.filter(|mark| is_lit(first + lag + scale * *mark as usize)).count()
                })
                .collect();
            let counted = at_each_level(|| {
                let mut planes = [[0; BLOCK_WORDS]; PLANES];
                count_marks(&words, first, marks, &mut planes);
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
            for (level, lit) in at_each_level(|| with_marks(&words, first, marks, least)) {
                let is_lit = |lag: &usize| lit[lag / 64] >> (lag % 64) & 1 == 1;
                let lags: Vec<usize> = (0..64 * BLOCK_WORDS).filter(is_lit).collect();
                let enough = |lag: &usize| expected[*lag] >= usize::from(least);
                let expected: Vec<usize> = (0..64 * BLOCK_WORDS).filter(enough).collect();
                prop_assert_eq!(lags, expected, "{:?}", level);
            }
        }
    }
}
