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

/// Counts of a block of lags, in bit planes: plane p has weight 2^p.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Counts {
    planes: [Block; PLANES],
    /// Planes that can be lit at all.
    used: usize,
    /// Marks that were added, at most what a count can be.
    added: usize,
}

impl Default for Counts {
    fn default() -> Self {
        Self { planes: [[0; BLOCK_WORDS]; PLANES], used: 0, added: 0 }
    }
}

impl Counts {
    /// Nothing counted yet.
    pub(crate) fn clear(&mut self) {
        self.planes[..self.used].fill([0; BLOCK_WORDS]);
        (self.used, self.added) = (0, 0);
    }

    /// Adds, for each lag of the block, how many of the marks are lit: bit `place + first + lag` of
    /// `words` for each of `places`, the lowest bit first. Bits beyond the end are dark. At most
    /// 65535 marks can be added.
    pub(crate) fn add(&mut self, words: &[u64], first: u32, places: &[u32]) {
        let farthest = places.iter().fold(0, |most, &place| place.max(most));
        let reach = (farthest as usize + first as usize) / 64 + BLOCK_WORDS + 1;
        let mut longer = Vec::new();
        let words = if reach <= words.len() {
            words
        } else {
            longer.extend_from_slice(words);
            longer.resize(reach, 0);
            &longer
        };
        self.added += places.len();
        self.used = ((usize::BITS - self.added.leading_zeros()) as usize).min(PLANES);
        match Level::here() {
            // SAFETY: the processor has what this level asks for, every mark lies so that its
            // block ends within the words, and a place fits into 32 bits.
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 if words.len() < 1 << 26 => unsafe {
                avx512::add_within(words, first, places, &mut self.planes[..self.used]);
            },
            _ => add_within(words, first, places, &mut self.planes[..self.used]),
        }
    }

    /// The highest count among the lags of `allowed`, and the first lag that has it; `None` where
    /// none is allowed.
    pub(crate) fn highest(&self, mut allowed: Block) -> Option<(u32, u32)> {
        let mut count = 0;
        for (weight, plane) in self.planes[..self.used].iter().enumerate().rev() {
            let lit = and(allowed, *plane);
            if !is_dark(&lit) {
                allowed = lit;
                count |= 1 << weight;
            }
        }
        let lane = allowed.iter().position(|&lane| lane != 0)?;
        Some((64 * lane as u32 + allowed[lane].trailing_zeros(), count))
    }

    /// One bit for each lag with `least` marks or more.
    pub(crate) fn at_least(&self, least: u32) -> Block {
        if least as usize > self.added {
            return [0; BLOCK_WORDS];
        }
        let mut enough = [u64::MAX; BLOCK_WORDS];
        for (weight, plane) in self.planes[..self.used].iter().enumerate() {
            enough = match least >> weight & 1 == 1 {
                true => and(*plane, enough),
                false => or(*plane, enough),
            };
        }
        enough
    }

    /// The count at `lag`.
    pub(crate) fn at(&self, lag: u32) -> u32 {
        let (lane, bit) = (lag as usize / 64, lag % 64);
        let planes = self.planes[..self.used].iter().enumerate();
        planes.map(|(weight, plane)| ((plane[lane] >> bit & 1) as u32) << weight).sum()
    }
}

/// Whether no bit is lit.
pub(crate) fn is_dark(lanes: &Block) -> bool {
    lanes.iter().fold(0, |any, lane| any | lane) == 0
}

on_every_level! {
    /// [`Counts::add`] where no block reaches beyond the end.
    fn add_within(words: &[u64], first: u32, places: &[u32], planes: &mut [Block]) {
        let low = |plane: usize| planes.get(plane).copied().unwrap_or_default();
        let (mut ones, mut twos, mut fours) = (low(0), low(1), low(2));
        let whole = places.chunks_exact(8);
        let rest = whole.remainder();
        for eight in whole {
            // Seven adders take eight bits in and carry one out, so that most of the work stays in
            // the three lowest planes. A closure would not be compiled for the level.
            macro_rules! bits {
                ($index:literal) => {
                    read(words, (eight[$index] + first) as usize)
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
            for plane in planes.iter_mut().skip(3) {
                (*plane, carried) = (xor(*plane, carried), and(*plane, carried));
            }
        }
        for (plane, sum) in planes.iter_mut().zip([ones, twos, fours]) {
            *plane = sum;
        }
        for place in rest {
            let mut carried = read(words, (place + first) as usize);
            for plane in planes.iter_mut() {
                (*plane, carried) = (xor(*plane, carried), and(*plane, carried));
            }
        }
    }
}

/// The same where a block is one register, and one instruction cuts it out of two.
#[cfg(target_arch = "x86_64")]
mod avx512 {
    use super::{BLOCK_WORDS, Block, PLANES};
    use std::arch::x86_64::{
        __m512i, _mm512_and_si512, _mm512_loadu_si512, _mm512_set1_epi64, _mm512_setzero_si512,
        _mm512_shrdv_epi64, _mm512_storeu_si512, _mm512_ternarylogic_epi64, _mm512_xor_si512,
    };

    /// Marks that are added up before anything is carried beyond the fourth plane.
    const SIXTEEN: usize = 16;

    /// # Safety
    ///
    /// The processor must have AVX-512 F and VBMI2, and `words`, fewer than 2^26, must reach
    /// [`BLOCK_WORDS`] + 1 words beyond the one in which the bit `first + place` lies, for each of
    /// `places`.
    #[target_feature(enable = "avx512f,avx512vbmi2")]
    pub(super) unsafe fn add_within(
        words: &[u64],
        first: u32,
        places: &[u32],
        planes: &mut [Block],
    ) {
        let dark = _mm512_setzero_si512();
        let mut all = [dark; PLANES];
        for (sum, plane) in all.iter_mut().zip(&*planes) {
            // SAFETY: a plane is as long as a register.
            *sum = unsafe { _mm512_loadu_si512(plane.as_ptr().cast()) };
        }
        let [mut ones, mut twos, mut fours, mut eights, ..] = all;
        let (whole, rest) = places.as_chunks::<SIXTEEN>();
        for places in whole {
            macro_rules! bits {
                ($index:expr) => {
                    // SAFETY: the caller answers for the places.
                    unsafe { read(words, first.wrapping_add(places[$index])) }
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
            for sum in &mut all[4..planes.len().max(4)] {
                let both = _mm512_and_si512(*sum, carried);
                (*sum, carried) = (_mm512_xor_si512(*sum, carried), both);
            }
        }
        for place in rest {
            // SAFETY: the caller answers for the places.
            let mut carried = unsafe { read(words, first.wrapping_add(*place)) };
            for sum in [&mut ones, &mut twos, &mut fours, &mut eights] {
                let both = _mm512_and_si512(*sum, carried);
                (*sum, carried) = (_mm512_xor_si512(*sum, carried), both);
            }
            for sum in &mut all[4..planes.len().max(4)] {
                let both = _mm512_and_si512(*sum, carried);
                (*sum, carried) = (_mm512_xor_si512(*sum, carried), both);
            }
        }
        all[..4].copy_from_slice(&[ones, twos, fours, eights]);
        for (plane, sum) in planes.iter_mut().zip(&all) {
            // SAFETY: a plane is as long as a register.
            unsafe { _mm512_storeu_si512(plane.as_mut_ptr().cast(), *sum) };
        }
    }

    /// The block that begins with bit `first`.
    ///
    /// # Safety
    ///
    /// There must be [`BLOCK_WORDS`] + 1 words from the one with that bit on.
    #[inline]
    #[target_feature(enable = "avx512f,avx512vbmi2")]
    unsafe fn read(words: &[u64], first: u32) -> __m512i {
        let word = first as usize / 64;
        debug_assert!(word + BLOCK_WORDS < words.len());
        // SAFETY: the caller answers for the words.
        let (low, high) = unsafe {
            let low = words.as_ptr().add(word);
            (_mm512_loadu_si512(low.cast()), _mm512_loadu_si512(low.add(1).cast()))
        };
        // Only the six lowest bits of the count matter.
        _mm512_shrdv_epi64(low, high, _mm512_set1_epi64(i64::from(first)))
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
            places in proptest::collection::vec(0..6500_u32, 0..300),
            then in proptest::collection::vec(0..6500_u32, 0..40),
            first in 0..1000_u32,
            least in 0..200_u32,
            allowed in any::<[u64; BLOCK_WORDS]>(),
        ) {
            let mut words = vec![0_u64; 100];
            lit.iter().for_each(|bit| words[bit / 64] |= 1 << (bit % 64));
            let is_lit = |bit: usize| words.get(bit / 64).is_some_and(|w| w >> (bit % 64) & 1 == 1);
            let expected: Vec<u32> = (0..64 * BLOCK_WORDS as u32)
                .map(|lag| {
                    let all = places.iter().chain(&then);
                    all.filter(|place| is_lit((first + lag + *place) as usize)).count() as u32
                })
                .collect();
            let counted = at_each_level(|| {
                let mut counts = Counts::default();
                counts.add(&words, first, &places);
                counts.add(&words, first, &then);
                counts
            });
            let is_allowed = |lag: &usize| allowed[lag / 64] >> (lag % 64) & 1 == 1;
            let highest = (0..expected.len()).filter(is_allowed).rev().max_by_key(|lag| expected[*lag]);
            for (level, counts) in counted {
                let found: Vec<u32> = (0..expected.len() as u32).map(|lag| counts.at(lag)).collect();
                prop_assert_eq!(&found, &expected, "{:?}", level);
                let enough = counts.at_least(least);
                for (lag, count) in expected.iter().enumerate() {
                    prop_assert_eq!(enough[lag / 64] >> (lag % 64) & 1 == 1, *count >= least);
                }
                let expected = highest.map(|lag| (lag as u32, expected[lag]));
                prop_assert_eq!(counts.highest(allowed), expected);
                let mut again = counts;
                again.clear();
                prop_assert_eq!(again.highest(allowed).map(|(_, count)| count), highest.map(|_| 0));
            }
        }
    }
}
