//! How many marks fit, for many lags at once.
//!
//! Every mark gives one bit for each lag. The bits are added the way hardware would: 64 lags
//! side by side in a machine word, the count of each spread over bit planes, carries saved for
//! the next plane.

use super::level::on_every_level;

/// Machine words of one block of lags.
pub(crate) const LANES: usize = 8;

/// One bit for each of 64 · [`LANES`] lags.
pub(crate) type Lanes = [u64; LANES];

/// Planes of a count; a macropulse has at most 65535 marks.
pub(crate) const PLANES: usize = 16;

/// Marks that are added in one go.
const EIGHT: usize = 8;

on_every_level! {
    /// Counts into `planes`, plane p of weight 2^p, for each lag of a block how many of the marks
    /// are lit: bit `first + lag + scale · mark` of `words`, the lowest bit first. Bits beyond
    /// the end are dark. `planes` must be dark before.
    pub(crate) fn count_marks(
        words: &[u64],
        first: usize,
        marks: (&[u16], usize),
        planes: &mut [Lanes; PLANES],
    ) {
        let (marks, scale) = marks;
        let used = ((usize::BITS - marks.len().leading_zeros()) as usize).min(PLANES);
        let mut low = [[0; LANES]; 3];
        let mut eights = marks.chunks_exact(EIGHT);
        for eight in &mut eights {
            let mut bits = [[0; LANES]; EIGHT];
            for (bits, mark) in bits.iter_mut().zip(eight) {
                *bits = read(words, first + scale * usize::from(*mark));
            }
            let mut carried = add_eight(&mut low, &bits);
            for plane in &mut planes[3..used.max(3)] {
                carried = half_add(plane, &carried);
            }
        }
        planes[..3].copy_from_slice(&low);
        for mark in eights.remainder() {
            let mut carried = read(words, first + scale * usize::from(*mark));
            for plane in &mut planes[..used] {
                carried = half_add(plane, &carried);
            }
        }
    }
}

/// Adds eight bits to the planes of weight one, two and four; what is carried to the plane of
/// weight eight. Seven adders take eight bits in and give one bit out, so that most of the work
/// stays in the three lowest planes.
#[inline(always)]
fn add_eight(low: &mut [Lanes; 3], bits: &[Lanes; EIGHT]) -> Lanes {
    // Plain loops over the lanes, one thing at a time: compilers turn these into vectors.
    let [ones, twos, fours] = low;
    let mut eights = [0; LANES];
    for lane in 0..LANES {
        let a = add(&mut ones[lane], bits[0][lane], bits[1][lane]);
        let b = add(&mut ones[lane], bits[2][lane], bits[3][lane]);
        let c = add(&mut twos[lane], a, b);
        let a = add(&mut ones[lane], bits[4][lane], bits[5][lane]);
        let b = add(&mut ones[lane], bits[6][lane], bits[7][lane]);
        let d = add(&mut twos[lane], a, b);
        eights[lane] = add(&mut fours[lane], c, d);
    }
    eights
}

/// Adds two bits to `sum`, in each of 64 lags; what is carried to the next plane.
#[inline(always)]
fn add(sum: &mut u64, a: u64, b: u64) -> u64 {
    let half = *sum ^ a;
    let carried = (*sum & a) | (half & b);
    *sum = half ^ b;
    carried
}

/// Adds one bit to `plane`; what is carried to the next one.
#[inline(always)]
fn half_add(plane: &mut Lanes, bits: &Lanes) -> Lanes {
    let mut carried = [0; LANES];
    for lane in 0..LANES {
        carried[lane] = plane[lane] & bits[lane];
        plane[lane] ^= bits[lane];
    }
    carried
}

/// The block of bits that begins with bit `first`.
#[inline(always)]
fn read(words: &[u64], first: usize) -> Lanes {
    let (word, shift) = (first / 64, first % 64);
    let mut lanes = [0; LANES];
    match words.get(word..word + LANES + 1).and_then(<[u64]>::first_chunk::<{ LANES + 1 }>) {
        Some(words) => {
            for lane in 0..LANES {
                // Two shifts, because a shift by 64 does not give 0.
                lanes[lane] = words[lane] >> shift | words[lane + 1] << 1 << (63 - shift);
            }
        }
        None => {
            let at = |word: usize| words.get(word).copied().unwrap_or(0);
            for (lane, bits) in lanes.iter_mut().enumerate() {
                *bits = at(word + lane) >> shift | at(word + lane + 1) << 1 << (63 - shift);
            }
        }
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
            marks in proptest::collection::vec(0..4000_u16, 0..400),
            first in 0..7000_usize,
            scale in 1..3_usize,
        ) {
            let mut words = vec![0_u64; 100];
            lit.iter().for_each(|bit| words[bit / 64] |= 1 << (bit % 64));
            let is_lit = |bit: usize| words.get(bit / 64).is_some_and(|w| w >> (bit % 64) & 1 == 1);
            let expected: Vec<usize> = (0..64 * LANES)
                .map(|lag| {
                    let place = |&&mark: &&u16| is_lit(first + lag + scale * usize::from(mark));
                    marks.iter().filter(place).count()
                })
                .collect();
            let counted = at_each_level(|| {
                let mut planes = [[0; LANES]; PLANES];
                count_marks(&words, first, (&marks, scale), &mut planes);
                planes
            });
            for (level, planes) in counted {
                let at = |lag: usize| {
                    let bit = |plane: &Lanes| (plane[lag / 64] >> (lag % 64) & 1) as usize;
                    planes.iter().enumerate().map(|(p, plane)| bit(plane) << p).sum::<usize>()
                };
                let counts: Vec<usize> = (0..64 * LANES).map(at).collect();
                prop_assert_eq!(&counts, &expected, "{:?}", level);
            }
        }
    }
}
