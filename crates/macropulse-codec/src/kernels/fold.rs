//! Marks counted where a code word is sent in several bits: the bits are summed first.
//!
//! A macropulse with B lit bits and W marks in a code word has B·W marks to count for each lag. For mark m at
//! lag l, the B bits are looked at m + l ticks behind their beginnings. The same places serve every other
//! mark and lag with the same m + l. So they are summed once for each m + l, in bit planes, and W of these
//! sums are added up for a lag.

use super::correlate::{WIDE, planes_for, reached};
use super::level::Level;

/// Planes of the sums: for fewer than 16 bits.
const SUMS: usize = 4;

/// Planes of each of the counts that are added up: for fewer than 64 marks of a word.
const OF_WORD: usize = 6;

/// Counts the marks of the `word` in each of the `bits`, from bit `first` of the `words` on, for the lags of
/// `W` machine words. Marks and bits ascend, and places beyond the end are dark. There must be one of the
/// `planes` for each bit of the highest count; `sums` is memory. Returns false, without counts, if this would
/// take longer than to count one mark after another, or if it cannot be done.
pub(super) fn fold<const W: usize>(
    words: &[u64],
    first: u32,
    (word, bits): (&[u32], &[u32]),
    sums: &mut Vec<u64>,
    planes: &mut [u64],
) -> bool {
    let (Some(mark), Some(bit)) = (word.last(), bits.last()) else { return false };
    let Some(fold) = folder::<W>().filter(|_| is_shorter::<W>(word, bits)) else { return false };
    // Whole registers, and one word more than a block behind the last mark.
    let length = (*mark as usize / 64 + W + 1).next_multiple_of(WIDE);
    let mut longer = Vec::new();
    let reach = *bit as usize + 64 * (length + WIDE);
    let (words, first) = reached(words, first, reach, &mut longer);
    if words.len() >= 1 << 26 {
        return false;
    }
    assert_eq!(planes.len(), W * planes_for(word.len() * bits.len()));
    sums.resize(SUMS * length, 0);
    // SAFETY: the processor has what this level asks for. The words reach a plane of sums and a register
    // beyond each bit, and a plane of sums a block and one word beyond each mark. Bits and marks are as few
    // as `is_shorter` asks for, and there is a plane for each bit of the highest count.
    unsafe { fold(words, first, (word, bits), sums, planes) };
    true
}

/// True if fewer blocks of lags are added up than there are marks. The sums need the blocks of the word and
/// of the lags for each bit. Adding them up needs one block for each plane of the sums and each mark of the
/// word. For `kim-park-2016` it is true with three bits and more.
fn is_shorter<const W: usize>(word: &[u32], bits: &[u32]) -> bool {
    let longest = word.last().map_or(0, |last| *last as usize / (64 * W));
    let planes = (usize::BITS - bits.len().leading_zeros()) as usize;
    let folded = bits.len() * (longest + 2) + planes * word.len();
    (2..=SUMS).contains(&planes) && word.len() < 1 << OF_WORD && folded < bits.len() * word.len()
}

/// Does what [`fold`] does, if it can.
type Folder = unsafe fn(&[u64], u32, (&[u32], &[u32]), &mut [u64], &mut [u64]);

/// Returns the function that does it in blocks of `W` machine words on this level; `None` if that has no
/// registers as long as the shorter block.
fn folder<const W: usize>() -> Option<Folder> {
    match (Level::here(), W) {
        #[cfg(target_arch = "x86_64")]
        (Level::Avx512, super::correlate::NARROW) => Some(avx512::narrow::<W>),
        #[cfg(target_arch = "x86_64")]
        (Level::Avx512, _) => Some(avx512::wide::<W>),
        #[cfg(target_arch = "x86_64")]
        (Level::Avx2, _) => Some(avx2::narrow::<W>),
        _ => None,
    }
}

/// Defines a [`Folder`] in registers of `$lanes` lanes, with what [`super::registers`] has for them: it sums,
/// then adds up.
#[cfg(target_arch = "x86_64")]
macro_rules! folder {
    (
        $features:literal, $fold:ident, $sums:ident, $over_word:ident, $lanes:ident, $dark:ident,
        $store:ident, $cut:ident, $sum:ident, $carry:ident, $and:ident, $xor:ident
    ) => {
        /// # Safety
        ///
        /// As of the two functions that it calls, for two bits and more.
        #[target_feature(enable = $features)]
        pub(super) unsafe fn $fold<const W: usize>(
            words: &[u64],
            first: u32,
            (word, bits): (&[u32], &[u32]),
            sums: &mut [u64],
            planes: &mut [u64],
        ) {
            // SAFETY: the caller answers for it.
            unsafe {
                $sums(words, first, bits, sums);
                match bits.len().ilog2() {
                    1 => $over_word::<W, 2>(sums, word, planes),
                    2 => $over_word::<W, 3>(sums, word, planes),
                    _ => $over_word::<W, SUMS>(sums, word, planes),
                }
            }
        }

        /// Sums, for each place of a code word and of a block of lags, the light at each of the `bits` behind
        /// it, into [`SUMS`] planes.
        ///
        /// # Safety
        ///
        /// The processor must have the features, and a plane must be whole registers. `words`, fewer than
        /// 2^26, must reach a plane and a register beyond the word in which each of the bits lies. There must
        /// be fewer bits than 2^[`SUMS`].
        #[target_feature(enable = $features)]
        unsafe fn $sums(words: &[u64], first: u32, bits: &[u32], planes: &mut [u64]) {
            adders!(add, add_two, $sum, $carry, $and, $xor);
            let length = planes.len() / SUMS;
            let farthest = bits.iter().map(|bit| first.wrapping_add(*bit)).max().unwrap_or(0);
            debug_assert!(farthest as usize / 64 + length < words.len());
            let (threes, rest) = bits.as_chunks::<3>();
            for block in (0..length).step_by($lanes) {
                let words = &words[block..];
                macro_rules! bits {
                    ($bit:expr) => {{
                        let bit = first.wrapping_add($bit);
                        // SAFETY: the caller answers for the bits.
                        unsafe { $cut(words.as_ptr(), bit) }
                    }};
                }
                let mut sums = [$dark(); SUMS];
                for [a, b, c] in threes {
                    let (sum, twos) = add!(bits!(*a), bits!(*b), bits!(*c));
                    let mut carried;
                    (sums[0], carried) = add_two!(sums[0], sum);
                    (sums[1], carried) = add!(sums[1], twos, carried);
                    (sums[2], carried) = add_two!(sums[2], carried);
                    sums[3] = $xor(sums[3], carried);
                }
                for bit in rest {
                    let mut carried = bits!(*bit);
                    for plane in 0..SUMS {
                        (sums[plane], carried) = add_two!(sums[plane], carried);
                    }
                }
                for plane in 0..SUMS {
                    let place = &mut planes[length * plane + block..];
                    // SAFETY: a plane is whole registers.
                    unsafe { $store(place.as_mut_ptr().cast(), sums[plane]) };
                }
            }
        }

        /// Adds up the `sums` over the marks of a `word`, for the lags of `W` machine words, into planes.
        /// `USED` planes of the sums are lit.
        ///
        /// # Safety
        ///
        /// The processor must have the features. A plane of `sums` must reach a register and one word beyond
        /// the word in which each mark lies for the last lags. There must be fewer marks than 2^[`OF_WORD`].
        #[target_feature(enable = $features)]
        unsafe fn $over_word<const W: usize, const USED: usize>(
            sums: &[u64],
            word: &[u32],
            planes: &mut [u64],
        ) {
            adders!(add, add_two, $sum, $carry, $and, $xor);
            let length = sums.len() / SUMS;
            let farthest = word.iter().copied().max().unwrap_or(0);
            debug_assert!(farthest as usize / 64 + W < length);
            let (sevens, rest) = word.as_chunks::<7>();
            for block in (0..W).step_by($lanes) {
                let mut counts = [[$dark(); OF_WORD]; USED];
                macro_rules! sums {
                    ($weight:ident, $mark:expr) => {{
                        // SAFETY: the caller answers for the marks.
                        unsafe { $cut(sums.as_ptr().add(length * $weight + block), $mark) }
                    }};
                }
                for [a, b, c, d, e, f, g] in sevens {
                    for weight in 0..USED {
                        let counts = &mut counts[weight];
                        let (sum, x) =
                            add!(sums!(weight, *a), sums!(weight, *b), sums!(weight, *c));
                        let (sum, y) = add!(sum, sums!(weight, *d), sums!(weight, *e));
                        let (sum, z) = add!(sum, sums!(weight, *f), sums!(weight, *g));
                        let (twos, fours) = add!(x, y, z);
                        let mut carried;
                        (counts[0], carried) = add_two!(counts[0], sum);
                        (counts[1], carried) = add!(counts[1], twos, carried);
                        (counts[2], carried) = add!(counts[2], fours, carried);
                        for plane in 3..OF_WORD {
                            (counts[plane], carried) = add_two!(counts[plane], carried);
                        }
                    }
                }
                for mark in rest {
                    for weight in 0..USED {
                        let mut carried = sums!(weight, *mark);
                        for plane in 0..OF_WORD {
                            (counts[weight][plane], carried) =
                                add_two!(counts[weight][plane], carried);
                        }
                    }
                }
                let mut total = [$dark(); SUMS + OF_WORD];
                for weight in 0..USED {
                    let mut carried = $dark();
                    for plane in 0..OF_WORD {
                        let before = total[weight + plane];
                        (total[weight + plane], carried) =
                            add!(before, counts[weight][plane], carried);
                    }
                    total[weight + OF_WORD] = carried;
                }
                for plane in 0..planes.len() / W {
                    let place = &mut planes[W * plane + block..];
                    // SAFETY: a plane is whole registers.
                    unsafe { $store(place.as_mut_ptr().cast(), total[plane]) };
                }
            }
        }
    };
}

/// A block is one register.
#[cfg(target_arch = "x86_64")]
mod avx512 {
    use super::super::correlate::{NARROW, WIDE};
    use super::super::registers::adders;
    use super::super::registers::avx512::{
        carry_narrow, carry_wide, cut_narrow, cut_wide, sum_narrow, sum_wide,
    };
    use super::{OF_WORD, SUMS};
    use std::arch::x86_64::*;

    folder!(
        "avx512f,avx512vl,avx512vbmi2",
        narrow,
        sums_narrow,
        narrow_over_word,
        NARROW,
        _mm256_setzero_si256,
        _mm256_storeu_si256,
        cut_narrow,
        sum_narrow,
        carry_narrow,
        _mm256_and_si256,
        _mm256_xor_si256
    );
    folder!(
        "avx512f,avx512vl,avx512vbmi2",
        wide,
        sums_wide,
        wide_over_word,
        WIDE,
        _mm512_setzero_si512,
        _mm512_storeu_si512,
        cut_wide,
        sum_wide,
        carry_wide,
        _mm512_and_si512,
        _mm512_xor_si512
    );
}

/// A register is half as long as the longer block.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::super::correlate::NARROW;
    use super::super::registers::adders;
    use super::super::registers::avx2::{carry, cut, sum};
    use super::{OF_WORD, SUMS};
    use std::arch::x86_64::*;

    folder!(
        "avx2,bmi1,bmi2,lzcnt,popcnt",
        narrow,
        sums_narrow,
        narrow_over_word,
        NARROW,
        _mm256_setzero_si256,
        _mm256_storeu_si256,
        cut,
        sum,
        carry,
        _mm256_and_si256,
        _mm256_xor_si256
    );
}
