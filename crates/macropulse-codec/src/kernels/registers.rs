//! Marks counted in registers, where a processor has them as long as a block of lags or half of one.

use super::correlate::{LOW, NARROW, PLANES, SIXTEEN, WIDE};
use super::level::Level;

/// Planes above the lowest ones: for up to 255 marks few, which stay in registers.
const FEW: usize = 4;
const MANY: usize = PLANES - LOW;

/// Counts the marks at `places` from bit `first` of the words on, into planes.
pub(super) type Counter = unsafe fn(&[u64], u32, &[u32], &mut [u64]);

/// Returns the function that counts in blocks of `W` machine words on this level, into this number of
/// `planes`. `None` if the level has no registers as long as the shorter block.
///
/// # Safety
///
/// For a call, `words`, fewer than 2^26, must reach a block and one word beyond the word in which the bit
/// `first + place` lies, for each of the places. There must be fewer places than 2^`planes`, and all planes
/// must be there.
pub(super) fn counter<const W: usize>(planes: usize) -> Option<Counter> {
    Some(match (Level::here(), planes > LOW + FEW) {
        (Level::Avx512, false) => avx512::count::<W, FEW>,
        (Level::Avx512, true) => avx512::count::<W, MANY>,
        (Level::Avx2, false) => avx2::count::<W, FEW>,
        (Level::Avx2, true) => avx2::count::<W, MANY>,
        (Level::Plain, _) => return None,
    })
}

/// Finds the bits of the words, from bit `first` on, behind which a least number of the marks at `places` is
/// lit.
pub(super) type Enough = unsafe fn(&[u64], u32, &[u32], u32, &mut [u64]);

/// Returns the function that finds them on this level, with counts of this number of `planes`; `None` as
/// above.
///
/// # Safety
///
/// As of the [`counter`], for each block of `W` words of what is told.
pub(super) fn enough<const W: usize>(planes: usize) -> Option<Enough> {
    Some(match (Level::here(), planes > LOW + FEW) {
        (Level::Avx512, false) => avx512::enough::<W, FEW>,
        (Level::Avx512, true) => avx512::enough::<W, MANY>,
        (Level::Avx2, false) => avx2::enough::<FEW>,
        (Level::Avx2, true) => avx2::enough::<MANY>,
        (Level::Plain, _) => return None,
    })
}

/// Names two macros: one sums three bits in each lag, the other two, and both carry to the next plane.
macro_rules! adders {
    ($three:ident, $two:ident, $sum:ident, $carry:ident, $and:ident, $xor:ident) => {
        macro_rules! $three {
            ($a:expr, $b:expr, $c:expr) => {{
                let (a, b, c) = ($a, $b, $c);
                ($sum(a, b, c), $carry(a, b, c))
            }};
        }
        macro_rules! $two {
            ($a:expr, $b:expr) => {{
                let (a, b) = ($a, $b);
                ($xor(a, b), $and(a, b))
            }};
        }
    };
}
pub(super) use adders;

/// Defines counts in a register of `$lanes` lanes. Its arguments are how that is stored, how a block from a
/// bit of the words on is read, and how three bits are summed in each lag, and carried.
macro_rules! counter {
    (
        $features:literal, $name:ident, $lanes:ident, $dark:ident, $lit:ident,
        $store:ident, $cut:ident, $sum:ident, $carry:ident, $and:ident, $or:ident, $xor:ident
    ) => {
        /// Counts the marks for the lags of one register, and puts a plane of the counts into every `W`th
        /// word of `out` and those behind it. If it `TELLS`, each bit of `out` is a lag, and becomes lit if
        /// there are `least` marks.
        ///
        /// # Safety
        ///
        /// The processor must have the features. `words`, fewer than 2^26, must reach a register and one word
        /// beyond the word in which the bit `first + place` lies, for each of `places`, in the last register,
        /// too. There must be fewer places than 16 · 2^`HIGH`. `out` must have `HIGH` planes more than
        /// [`LOW`], or whole registers.
        #[target_feature(enable = $features)]
        unsafe fn $name<const W: usize, const HIGH: usize, const TELLS: bool>(
            words: &[u64],
            first: u32,
            places: &[u32],
            least: u32,
            out: &mut [u64],
        ) {
            let blocks = if TELLS { out.len() / $lanes } else { 1 };
            let farthest = places.iter().map(|place| first.wrapping_add(*place)).max().unwrap_or(0);
            debug_assert!(farthest as usize / 64 + $lanes * blocks < words.len());
            for block in 0..blocks {
                let words = &words[$lanes * block..];
                let [mut ones, mut twos, mut fours, mut eights] = [$dark(); LOW];
                let mut high = [$dark(); HIGH];
                adders!(add, add_two, $sum, $carry, $and, $xor);
                macro_rules! bits {
                    ($place:expr) => {{
                        let bit = first.wrapping_add($place);
                        // SAFETY: the caller answers for the places.
                        unsafe { $cut(words.as_ptr(), bit) }
                    }};
                }
                // The blocks of eight marks are added, and one is carried to the fourth plane.
                macro_rules! eight_from {
                    ($first:literal, $block:ident) => {{
                        let (sum, a) = add!(ones, $block!($first), $block!($first + 1));
                        let (sum, b) = add!(sum, $block!($first + 2), $block!($first + 3));
                        let (sum_of_twos, c) = add!(twos, a, b);
                        let (sum, a) = add!(sum, $block!($first + 4), $block!($first + 5));
                        let (sum, b) = add!(sum, $block!($first + 6), $block!($first + 7));
                        ones = sum;
                        let (sum, d) = add!(sum_of_twos, a, b);
                        twos = sum;
                        let (sum, carried) = add!(fours, c, d);
                        fours = sum;
                        carried
                    }};
                }
                macro_rules! sixteen_from {
                    ($block:ident) => {{
                        let a = eight_from!(0, $block);
                        let b = eight_from!(8, $block);
                        let mut carried;
                        (eights, carried) = add!(eights, a, b);
                        for plane in &mut high {
                            (*plane, carried) = add_two!(*plane, carried);
                        }
                    }};
                }
                let (whole, rest) = places.as_chunks::<SIXTEEN>();
                for places in whole {
                    macro_rules! block {
                        ($at:expr) => {
                            bits!(places[$at])
                        };
                    }
                    sixteen_from!(block);
                }
                if !rest.is_empty() {
                    macro_rules! block_or_dark {
                        ($at:expr) => {
                            match rest.get($at) {
                                Some(place) => bits!(*place),
                                None => $dark(),
                            }
                        };
                    }
                    sixteen_from!(block_or_dark);
                }
                let planes = [ones, twos, fours, eights].into_iter().chain(high);
                if TELLS {
                    let mut all = $lit(-1);
                    for (weight, plane) in planes.enumerate() {
                        all = match least >> weight & 1 == 1 {
                            true => $and(plane, all),
                            false => $or(plane, all),
                        };
                    }
                    // SAFETY: a block is as long as a register.
                    unsafe { $store(out.as_mut_ptr().add($lanes * block).cast(), all) };
                } else {
                    for (place, plane) in out.chunks_mut(W).zip(planes) {
                        // SAFETY: a plane is as long as a register.
                        unsafe { $store(place.as_mut_ptr().cast(), plane) };
                    }
                }
            }
        }
    };
}

/// A block is one register, and one instruction cuts it out of two.
pub(super) mod avx512 {
    use super::{LOW, NARROW, SIXTEEN, WIDE};
    use std::arch::x86_64::*;

    /// # Safety
    ///
    /// As of the counters for each width.
    #[target_feature(enable = "avx512f,avx512vl,avx512vbmi2")]
    pub(super) unsafe fn count<const W: usize, const HIGH: usize>(
        words: &[u64],
        first: u32,
        places: &[u32],
        planes: &mut [u64],
    ) {
        match W {
            // SAFETY: the caller answers for it.
            NARROW => unsafe { narrow::<W, HIGH, false>(words, first, places, 0, planes) },
            // SAFETY: as above.
            _ => unsafe { wide::<W, HIGH, false>(words, first, places, 0, planes) },
        }
    }

    /// # Safety
    ///
    /// As of the counters for each width.
    #[target_feature(enable = "avx512f,avx512vl,avx512vbmi2")]
    pub(super) unsafe fn enough<const W: usize, const HIGH: usize>(
        words: &[u64],
        first: u32,
        places: &[u32],
        least: u32,
        enough: &mut [u64],
    ) {
        match W {
            // SAFETY: the caller answers for it.
            NARROW => unsafe { narrow::<W, HIGH, true>(words, first, places, least, enough) },
            // SAFETY: as above.
            _ => unsafe { wide::<W, HIGH, true>(words, first, places, least, enough) },
        }
    }

    macro_rules! on_registers {
        (
            $kind:ident, $cut:ident, $sum:ident, $carry:ident, $load:ident, $by:ident, $at:ident,
            $logic:ident
        ) => {
            /// # Safety
            ///
            /// From the word of `bit` on there must be a register and one word.
            #[inline]
            #[target_feature(enable = "avx512f,avx512vl,avx512vbmi2")]
            pub(in super::super) unsafe fn $cut(words: *const u64, bit: u32) -> $kind {
                // SAFETY: the caller answers for the words.
                let (low, high) = unsafe {
                    let low = words.add(bit as usize / 64);
                    ($load(low.cast()), $load(low.add(1).cast()))
                };
                // Only the six lowest bits of the count matter.
                $by(low, high, $at(i64::from(bit)))
            }

            #[inline]
            #[target_feature(enable = "avx512f,avx512vl,avx512vbmi2")]
            pub(in super::super) fn $sum(a: $kind, b: $kind, c: $kind) -> $kind {
                $logic::<0x96>(a, b, c)
            }

            #[inline]
            #[target_feature(enable = "avx512f,avx512vl,avx512vbmi2")]
            pub(in super::super) fn $carry(a: $kind, b: $kind, c: $kind) -> $kind {
                $logic::<0xE8>(a, b, c)
            }
        };
    }

    on_registers!(
        __m256i,
        cut_narrow,
        sum_narrow,
        carry_narrow,
        _mm256_loadu_si256,
        _mm256_shrdv_epi64,
        _mm256_set1_epi64x,
        _mm256_ternarylogic_epi64
    );
    on_registers!(
        __m512i,
        cut_wide,
        sum_wide,
        carry_wide,
        _mm512_loadu_si512,
        _mm512_shrdv_epi64,
        _mm512_set1_epi64,
        _mm512_ternarylogic_epi64
    );
    counter!(
        "avx512f,avx512vl,avx512vbmi2",
        narrow,
        NARROW,
        _mm256_setzero_si256,
        _mm256_set1_epi64x,
        _mm256_storeu_si256,
        cut_narrow,
        sum_narrow,
        carry_narrow,
        _mm256_and_si256,
        _mm256_or_si256,
        _mm256_xor_si256
    );
    counter!(
        "avx512f,avx512vl,avx512vbmi2",
        wide,
        WIDE,
        _mm512_setzero_si512,
        _mm512_set1_epi64,
        _mm512_storeu_si512,
        cut_wide,
        sum_wide,
        carry_wide,
        _mm512_and_si512,
        _mm512_or_si512,
        _mm512_xor_si512
    );
}

/// A register is half as long as the longer block.
pub(super) mod avx2 {
    use super::{LOW, NARROW, SIXTEEN};
    use std::arch::x86_64::*;

    /// # Safety
    ///
    /// As of the counter.
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub(super) unsafe fn count<const W: usize, const HIGH: usize>(
        words: &[u64],
        first: u32,
        places: &[u32],
        planes: &mut [u64],
    ) {
        for half in (0..W).step_by(NARROW) {
            // SAFETY: the caller answers for it.
            unsafe {
                narrow::<W, HIGH, false>(&words[half..], first, places, 0, &mut planes[half..]);
            }
        }
    }

    /// # Safety
    ///
    /// As of the counter.
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub(super) unsafe fn enough<const HIGH: usize>(
        words: &[u64],
        first: u32,
        places: &[u32],
        least: u32,
        enough: &mut [u64],
    ) {
        // SAFETY: the caller answers for it.
        unsafe { narrow::<NARROW, HIGH, true>(words, first, places, least, enough) }
    }

    /// Shifts for a block that begins a number of bits behind the beginning of a byte: to the right, and to
    /// the left in the bytes behind that one. Each is in the lower half of a register.
    static RIGHT: [u64; 9] = [0, 1, 2, 3, 4, 5, 6, 7, 0];
    static LEFT: [u64; 9] = [8, 7, 6, 5, 4, 3, 2, 1, 0];

    /// # Safety
    ///
    /// From the word of `bit` on there must be a register and one word.
    #[inline]
    #[target_feature(enable = "avx2")]
    pub(in super::super) unsafe fn cut(words: *const u64, bit: u32) -> __m256i {
        let behind = (bit & 7) as usize;
        // SAFETY: the caller answers for the words, and the tables are a half register longer.
        unsafe {
            let low = words.cast::<u8>().add(bit as usize / 8);
            let (low, high) =
                (_mm256_loadu_si256(low.cast()), _mm256_loadu_si256(low.add(1).cast()));
            let right = _mm_loadu_si128(RIGHT.as_ptr().add(behind).cast());
            let left = _mm_loadu_si128(LEFT.as_ptr().add(behind).cast());
            _mm256_or_si256(_mm256_srl_epi64(low, right), _mm256_sll_epi64(high, left))
        }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    pub(in super::super) fn sum(a: __m256i, b: __m256i, c: __m256i) -> __m256i {
        _mm256_xor_si256(_mm256_xor_si256(a, b), c)
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    pub(in super::super) fn carry(a: __m256i, b: __m256i, c: __m256i) -> __m256i {
        // The sum has the last of these, too.
        _mm256_or_si256(_mm256_and_si256(a, b), _mm256_and_si256(c, _mm256_xor_si256(a, b)))
    }

    counter!(
        "avx2,bmi1,bmi2,lzcnt,popcnt",
        narrow,
        NARROW,
        _mm256_setzero_si256,
        _mm256_set1_epi64x,
        _mm256_storeu_si256,
        cut,
        sum,
        carry,
        _mm256_and_si256,
        _mm256_or_si256,
        _mm256_xor_si256
    );
}
