//! How many marks fit, for many lags at once.
//!
//! Every mark gives one bit for each lag. The bits are added the way hardware would: 64 lags side by side in
//! a machine word, the count of each spread over bit planes, carries saved for the next plane. Lags are
//! counted in blocks of four or eight machine words. A shot about where it is expected is seen in the shorter
//! one, and all of a gate is passed in the longer one.

use super::coarse::COARSE;
use super::fold::fold;
use super::marks::{WordTicks, places_of};
#[cfg(target_arch = "x86_64")]
use super::registers;
use crate::on_every_level;

/// Machine words of a block of the lags about one that is expected.
pub(crate) const NARROW: usize = 4;

/// Machine words of a block of lags where many of them are tried.
pub(crate) const WIDE: usize = 8;

/// Planes of a count; a macropulse has at most 65535 marks.
pub(super) const PLANES: usize = 16;

/// The lowest planes, to which marks are added one by one.
pub(super) const LOW: usize = 4;

/// Marks that are added up in registers before anything is carried beyond the lowest planes: fewer take as long.
pub(crate) const SIXTEEN: usize = 16;

/// Counts of a block of 64 · W lags, in bit planes: plane p has weight 2^p. W is [`NARROW`] or
/// [`WIDE`].
#[derive(Debug, Clone)]
pub(crate) struct Counts<const W: usize> {
    planes: [[u64; W]; PLANES],
    /// Planes that can be lit at all, or [`LOW`].
    used: usize,
    /// Marks that were counted, at most what a count can be.
    counted: usize,
    /// Memory for the sums of bits, and for the places of marks.
    sums: Vec<u64>,
    places: Vec<u32>,
}

impl<const W: usize> Default for Counts<W> {
    fn default() -> Self {
        let (sums, places) = (Vec::new(), Vec::new());
        Self { planes: [[0; W]; PLANES], used: LOW, counted: 0, sums, places }
    }
}

impl<const W: usize> Counts<W> {
    /// Counts, for each lag of the block, how many marks of the `word` are lit in each of the `bits`: bit
    /// `first + bit + mark + lag` of `words`, the lowest bit first. Bits beyond the end are dark. Marks and bits
    /// ascend, and there are at most 65535 marks in all.
    pub(crate) fn count(&mut self, words: &[u64], first: u32, word: &WordTicks, bits: &[u32]) {
        self.expect(word.ticks().len() * bits.len());
        let planes = self.planes[..self.used].as_flattened_mut();
        if fold::<W>(words, first, (word.ticks(), bits), &mut self.sums, planes) {
            return;
        }
        let mut places = std::mem::take(&mut self.places);
        places_of(word, bits, &mut places);
        self.count_each(words, first, &places, places.last().copied().unwrap_or(0));
        self.places = places;
    }

    /// Prepares the counts for this number of `marks`.
    fn expect(&mut self, marks: usize) {
        self.counted = marks;
        self.used = planes_for(marks);
    }

    /// Counts, for each lag of the block, how many of the marks are lit: bit `place + first + lag` of
    /// `words` for each of `places`, none of them behind the `farthest`.
    fn count_each(&mut self, words: &[u64], first: u32, places: &[u32], farthest: u32) {
        debug_assert!(places.iter().max().is_none_or(|place| *place <= farthest));
        let mut longer = Vec::new();
        let (words, first) = reached(words, first, farthest as usize + 64 * W, &mut longer);
        self.expect(places.len());
        let planes = self.planes.as_flattened_mut();
        #[cfg(target_arch = "x86_64")]
        if let Some(count) = registers::counter::<W>(self.used)
            && words.len() < 1 << 26
        {
            // SAFETY: the processor has what this level asks for. Every mark lies so that its block ends
            // within the words, a place fits into 32 bits, and there is a plane for each bit of the highest
            // count.
            return unsafe { count(words, first, places, planes) };
        }
        count_within::<W>(words, first, places, &mut planes[..W * self.used]);
    }

    /// The highest count among the lags of `allowed`, and the first lag that has it; `None` where
    /// none is allowed.
    pub(crate) fn highest(&self, allowed: [u64; W]) -> Option<(u32, u32)> {
        let planes = self.planes[..self.used].as_flattened();
        match W {
            NARROW => highest_narrow(planes, &allowed),
            _ => highest_wide(planes, &allowed),
        }
    }

    /// One bit for each lag with `least` marks or more.
    pub(crate) fn at_least(&self, least: u32) -> [u64; W] {
        if least as usize > self.counted {
            return [0; W];
        }
        let mut enough = [u64::MAX; W];
        for (weight, plane) in self.planes[..self.used].iter().enumerate() {
            enough = match least >> weight & 1 == 1 {
                true => and(*plane, enough),
                false => or(*plane, enough),
            };
        }
        enough
    }

    /// The count at `lag`.
    #[cfg(test)]
    fn at(&self, lag: u32) -> u32 {
        let (lane, bit) = (lag as usize / 64, lag % 64);
        let planes = self.planes[..self.used].iter().enumerate();
        planes.map(|(weight, plane)| ((plane[lane] >> bit & 1) as u32) << weight).sum()
    }
}

/// Finds the lags at which `least` of the marks at the `places` are lit, from bit `first` on. `enough` is
/// some blocks of W machine words, and has one bit for each lag. No mark is behind the `farthest`.
pub(crate) fn with_enough<const W: usize>(
    words: &[u64],
    first: u32,
    (places, farthest): (&[u32], u32),
    least: u32,
    enough: &mut [u64],
) {
    let mut longer = Vec::new();
    let reach = farthest as usize + 64 * enough.len();
    let (words, first) = reached(words, first, reach, &mut longer);
    if least as usize > places.len() {
        return enough.fill(0);
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(tell) = registers::enough::<W>(planes_for(places.len()))
        && words.len() < 1 << 26
    {
        // SAFETY: as in `count_each`; and the words reach to the end of the last block of `enough`, and one farther.
        return unsafe { tell(words, first, places, least, enough) };
    }
    let mut counts = Counts::<W>::default();
    for (block, enough) in enough.chunks_exact_mut(W).enumerate() {
        counts.count_each(words, first + 64 * (W * block) as u32, places, farthest);
        enough.copy_from_slice(&counts.at_least(least));
    }
}

/// Returns the `words` from that of bit `first` on, and the place of this bit in them. They hold all words
/// that are read if blocks end `farther` bits later. If `words` end before that, they are copied to `longer`
/// memory, and dark ones follow.
pub(super) fn reached<'a>(
    words: &'a [u64],
    first: u32,
    farther: usize,
    longer: &'a mut Vec<u64>,
) -> (&'a [u64], u32) {
    // Nothing before the first lag is looked at.
    let words = words.get(first as usize / 64..).unwrap_or_default();
    let first = first % 64;
    let reach = (farther + first as usize) / 64 + 1;
    if reach <= words.len() {
        return (words, first);
    }
    longer.extend_from_slice(words);
    longer.resize(reach, 0);
    (longer, first)
}

/// Returns the number of planes that counts of `marks` marks need.
pub(super) fn planes_for(marks: usize) -> usize {
    ((usize::BITS - marks.leading_zeros()) as usize).clamp(LOW, PLANES)
}

/// True if no bit is lit.
#[inline(always)]
pub(crate) fn is_dark<const W: usize>(lanes: &[u64; W]) -> bool {
    lanes.iter().fold(0, |any, lane| any | lane) == 0
}

on_every_level! {
    /// Returns the bits that are lit in any of some blocks of [`WIDE`] words of a picture. These blocks hold
    /// the eight ticks that are `behind` ticks later than bit `first` of it, for each of `behind`. Blocks
    /// that do not end within the words are dark.
    pub(crate) fn any_behind(words: &[u64], first: usize, behind: &[u32]) -> [u64; WIDE] {
        let mut any = [0; WIDE];
        for &behind in behind {
            for bit in [behind / COARSE as u32, behind.div_ceil(COARSE as u32)] {
                any = or(any, read(words, first + bit as usize));
            }
        }
        any
    }
}

on_every_level! {
    /// [`Counts::highest`] of blocks of [`NARROW`].
    fn highest_narrow(planes: &[u64], allowed: &[u64]) -> Option<(u32, u32)> {
        highest_of::<NARROW>(planes, allowed)
    }
}

on_every_level! {
    /// [`Counts::highest`] of blocks of [`WIDE`].
    fn highest_wide(planes: &[u64], allowed: &[u64]) -> Option<(u32, u32)> {
        highest_of::<WIDE>(planes, allowed)
    }
}

#[inline(always)]
fn highest_of<const W: usize>(planes: &[u64], allowed: &[u64]) -> Option<(u32, u32)> {
    let mut allowed = *allowed.first_chunk::<W>()?;
    let (planes, _) = planes.as_chunks::<W>();
    let mut count = 0;
    for (weight, plane) in planes.iter().enumerate().rev() {
        let lit = and(allowed, *plane);
        if !is_dark(&lit) {
            allowed = lit;
            count |= 1 << weight;
        }
    }
    let lane = allowed.iter().position(|&lane| lane != 0)?;
    Some((64 * lane as u32 + allowed[lane].trailing_zeros(), count))
}

/// [`Counts::count_each`] where no block reaches beyond the end.
fn count_within<const W: usize>(words: &[u64], first: u32, places: &[u32], planes: &mut [u64]) {
    let (planes, _) = planes.as_chunks_mut::<W>();
    planes.fill([0; W]);
    let (mut ones, mut twos, mut fours) = ([0; W], [0; W], [0; W]);
    let whole = places.chunks_exact(8);
    let rest = whole.remainder();
    for eight in whole {
        // Seven adders take eight bits in and carry one out, so that most of the work stays in the
        // three lowest planes. A closure would not be compiled for the level.
        macro_rules! bits {
            ($index:literal) => {
                read::<W>(words, (eight[$index] + first) as usize)
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
        let mut carried = read::<W>(words, (place + first) as usize);
        for plane in planes.iter_mut() {
            (*plane, carried) = (xor(*plane, carried), and(*plane, carried));
        }
    }
}

// Whole lanes in, whole lanes out: compilers keep these in registers.

macro_rules! on_lanes {
    ($name:ident, $sign:tt) => {
        #[inline(always)]
        pub(crate) fn $name<const W: usize>(mut a: [u64; W], b: [u64; W]) -> [u64; W] {
            for lane in 0..W {
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
fn add<const W: usize>(a: [u64; W], b: [u64; W], c: [u64; W]) -> ([u64; W], [u64; W]) {
    (xor(xor(a, b), c), or(and(a, b), and(c, xor(a, b))))
}

/// The block of bits that begins with bit `first`; dark where it does not end within the words.
#[inline(always)]
fn read<const W: usize>(words: &[u64], first: usize) -> [u64; W] {
    let (word, shift) = (first / 64, first % 64);
    let mut lanes = [0; W];
    let Some(words) = words.get(word..word + W + 1) else { return lanes };
    for lane in 0..W {
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
        fn every_level_tells_what_is_lit_behind_any_of_some_bits(
            words in proptest::collection::vec(any::<(u64, u64, u64)>(), 0..40),
            behind in proptest::collection::vec(0..12_000_u32, 0..12),
            first in 0..1000_usize,
        ) {
            let words: Vec<u64> = words.into_iter().map(|(a, b, c)| a & b & c).collect();
            let is_lit = |bit: usize| words[bit / 64] >> (bit % 64) & 1 == 1;
            // Eight ticks behind a place in the picture lie in one or two others.
            let places = behind.iter().flat_map(|&ticks| [ticks / 8, ticks.div_ceil(8)]);
            let places: Vec<usize> = places
                .map(|place| first + place as usize)
                .filter(|place| place / 64 + WIDE < words.len())
                .collect();
            let lag = |lag: usize| places.iter().any(|place| is_lit(place + lag));
            for (level, any) in at_each_level(|| any_behind(&words, first, &behind)) {
                for bit in 0..64 * WIDE {
                    prop_assert_eq!(any[bit / 64] >> (bit % 64) & 1 == 1, lag(bit), "{:?}", level);
                }
            }
        }

        #[test]
        fn every_level_counts_what_is_lit(
            lit in proptest::collection::vec(0..6000_usize, 0..3000),
            places in proptest::collection::vec(0..6500_u32, 0..300),
            first in 0..1000_u32,
            least in 0..200_u32,
            allowed in any::<[u64; WIDE]>(),
        ) {
            counts_what_is_lit::<WIDE>(&lit, &places, (first, least), allowed)?;
            let [a, b, c, d, ..] = allowed;
            counts_what_is_lit::<NARROW>(&lit, &places, (first, least), [a, b, c, d])?;
        }

        #[test]
        fn every_level_counts_what_is_lit_in_each_bit(
            lit in proptest::collection::vec(0..6000_usize, 0..3000),
            word in proptest::collection::btree_set(0..900_u16, 0..70),
            bits in proptest::collection::btree_set(0..6000_u32, 0..18),
            first in 0..1000_u32,
        ) {
            let bits: Vec<u32> = bits.into_iter().collect();
            let marks = WordTicks::new(&word.into_iter().collect::<Vec<u16>>(), 1);
            counts_what_is_lit_in_each_bit::<WIDE>(&lit, &marks, &bits, first)?;
            counts_what_is_lit_in_each_bit::<NARROW>(&lit, &marks, &bits, first)?;
        }
    }

    fn counts_what_is_lit_in_each_bit<const W: usize>(
        lit: &[usize],
        word: &WordTicks,
        bits: &[u32],
        first: u32,
    ) -> Result<(), TestCaseError> {
        let mut words = vec![0_u64; 100];
        lit.iter().for_each(|bit| words[bit / 64] |= 1 << (bit % 64));
        let is_lit =
            |bit: u32| words.get(bit as usize / 64).is_some_and(|word| word >> (bit % 64) & 1 == 1);
        let marks = bits.iter().flat_map(|bit| word.ticks().iter().map(move |mark| bit + mark));
        let found = |lag| marks.clone().filter(|mark| is_lit(first + lag + mark)).count() as u32;
        let expected: Vec<u32> = (0..64 * W as u32).map(found).collect();
        let counted = at_each_level(|| {
            let mut counts = Counts::<W>::default();
            // Earlier counts are forgotten.
            counts.count(&words, 0, &WordTicks::new(&[0, 7, 9, 800], 1), &[0, 1, 2, 500, 900]);
            counts.count(&words, first, word, bits);
            counts
        });
        for (level, counts) in counted {
            let found: Vec<u32> = (0..expected.len() as u32).map(|lag| counts.at(lag)).collect();
            prop_assert_eq!(&found, &expected, "{:?}", level);
        }
        Ok(())
    }

    fn counts_what_is_lit<const W: usize>(
        lit: &[usize],
        places: &[u32],
        (first, least): (u32, u32),
        allowed: [u64; W],
    ) -> Result<(), TestCaseError> {
        let mut words = vec![0_u64; 100];
        lit.iter().for_each(|bit| words[bit / 64] |= 1 << (bit % 64));
        let is_lit = |bit: usize| words.get(bit / 64).is_some_and(|w| w >> (bit % 64) & 1 == 1);
        let found = |lag| {
            let is_lit = |place: &&u32| is_lit((first + lag + **place) as usize);
            places.iter().filter(is_lit).count() as u32
        };
        let expected: Vec<u32> = (0..64 * W as u32).map(found).collect();
        let counted = at_each_level(|| {
            let mut counts = Counts::<W>::default();
            // Earlier counts are forgotten.
            counts.count_each(&words, 0, &[7; 20], 6500);
            counts.count_each(&words, first, places, 6500);
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
        }
        let told = at_each_level(|| {
            let mut told = vec![7; 3 * W];
            with_enough::<W>(&words, first, (places, 6500), least, &mut told);
            told
        });
        for (level, told) in told {
            for lag in 0..3 * 64 * W as u32 {
                let is_told = told[lag as usize / 64] >> (lag % 64) & 1 == 1;
                prop_assert_eq!(is_told, found(lag) >= least, "{:?}", level);
            }
        }
        Ok(())
    }
}
