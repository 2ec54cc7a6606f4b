//! How many marks fit, for many lags at once.
//!
//! Every mark gives one bit for each lag. The bits are added the way hardware would: 64 lags
//! side by side in a machine word, the count of each spread over bit planes, carries saved for
//! the next plane.

use std::ops::Range;

use super::timeline::Timeline;

/// Machine words of one block.
const LANES: usize = 8;

/// Lags that are counted at once.
pub(super) const BLOCK: i64 = 64 * LANES as i64;

/// Planes of a count; a macropulse has at most 65535 marks.
const PLANES: usize = 16;

type Lanes = [u64; LANES];

/// Where most marks fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Peak {
    /// The place, in ticks from where the search began.
    pub at: i64,
    /// Marks that fit there.
    pub count: u16,
    /// Marks that fit at the best other place, the peak's own plateau apart.
    pub next: u16,
}

/// The counts of a block of lags, in bit planes.
#[derive(Debug)]
pub(super) struct Counts {
    planes: [Lanes; PLANES],
    /// Planes that can be lit at all.
    used: usize,
}

impl Counts {
    /// For each of [`BLOCK`] places from `first` on: how many of the `marks`, counted in ticks
    /// from that place, are lit in `timeline`.
    pub fn new(timeline: &Timeline, first: i64, marks: impl ExactSizeIterator<Item = i64>) -> Self {
        let used = (usize::BITS - marks.len().leading_zeros()) as usize;
        let mut counts = Self { planes: [[0; LANES]; PLANES], used: used.min(PLANES) };
        let mut low = [[0; LANES]; 3];
        let mut places = marks.map(|mark| first + mark);
        while places.len() >= EIGHT {
            let ticks = std::array::from_fn(|_| places.next().unwrap_or(first));
            let eights = add_eight(&mut low, timeline, ticks);
            counts.carry(3, eights);
        }
        counts.planes[..3].copy_from_slice(&low);
        for tick in places {
            let mut bits = [0; LANES];
            read(timeline, tick, &mut bits);
            counts.carry(0, bits);
        }
        counts
    }

    /// Adds one bit to the planes from `plane` on.
    fn carry(&mut self, plane: usize, mut bits: Lanes) {
        for plane in &mut self.planes[plane..self.used.max(plane)] {
            for lane in 0..LANES {
                let carried = plane[lane] & bits[lane];
                plane[lane] ^= bits[lane];
                bits[lane] = carried;
            }
        }
    }

    /// The highest count among the places of `allowed`, as offsets into the block, and the first
    /// place that has it; and the best one farther than `plateau` ticks from it.
    pub fn peak(&self, allowed: Range<i64>, plateau: i64) -> Option<Peak> {
        let allowed = between(allowed);
        let (at, count) = self.highest(allowed)?;
        let own = between(at - plateau..at + plateau + 1);
        let others = std::array::from_fn(|lane| allowed[lane] & !own[lane]);
        let next = self.highest(others).map_or(0, |(_, count)| count);
        Some(Peak { at, count, next })
    }

    fn highest(&self, mut places: Lanes) -> Option<(i64, u16)> {
        if is_dark(&places) {
            return None;
        }
        let mut count = 0;
        for (weight, plane) in self.planes[..self.used].iter().enumerate().rev() {
            let lit: Lanes = std::array::from_fn(|lane| places[lane] & plane[lane]);
            if !is_dark(&lit) {
                places = lit;
                count |= 1 << weight;
            }
        }
        let lane = places.iter().position(|&lane| lane != 0)?;
        Some((64 * lane as i64 + i64::from(places[lane].trailing_zeros()), count))
    }
}

/// Marks that are added in one go.
const EIGHT: usize = 8;

/// Adds the blocks at eight `ticks` to the planes of weight one, two and four; what is carried to
/// the plane of weight eight. Seven adders take eight bits in and give one bit out, so that most
/// of the work stays in the three lowest planes.
fn add_eight(low: &mut [Lanes; 3], timeline: &Timeline, ticks: [i64; EIGHT]) -> Lanes {
    // Plain loops over the lanes, one thing at a time: compilers turn these into vectors.
    let mut bits = [[0; LANES]; EIGHT];
    for (bits, tick) in bits.iter_mut().zip(ticks) {
        read(timeline, tick, bits);
    }
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

/// Reads [`BLOCK`] ticks from `tick` on.
#[inline(always)]
fn read(timeline: &Timeline, tick: i64, lanes: &mut Lanes) {
    match timeline.block::<{ LANES + 1 }>(tick) {
        Some((words, shift)) => {
            for lane in 0..LANES {
                // Two shifts, because a shift by 64 does not give 0.
                lanes[lane] = words[lane] >> shift | words[lane + 1] << 1 << (63 - shift);
            }
        }
        None => read_at_edge(timeline, tick, lanes),
    }
}

#[cold]
fn read_at_edge(timeline: &Timeline, tick: i64, lanes: &mut Lanes) {
    for (lane, bits) in lanes.iter_mut().enumerate() {
        *bits = timeline.from(tick + 64 * lane as i64);
    }
}

/// Adds two bits to `sum`, in each of 64 lags; what is carried to the next plane.
#[inline(always)]
fn add(sum: &mut u64, a: u64, b: u64) -> u64 {
    let half = *sum ^ a;
    let carried = (*sum & a) | (half & b);
    *sum = half ^ b;
    carried
}

fn is_dark(lanes: &Lanes) -> bool {
    lanes.iter().fold(0, |any, lane| any | lane) == 0
}

/// The offsets of `range` that lie in a block, one bit each.
fn between(range: Range<i64>) -> Lanes {
    std::array::from_fn(|lane| {
        let below = |end: i64| match (end - 64 * lane as i64).clamp(0, 64) {
            64 => u64::MAX,
            bits => (1 << bits) - 1,
        };
        below(range.end) & !below(range.start)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    /// Every count by itself.
    fn counted(timeline: &Timeline, first: i64, marks: &[i64]) -> Vec<u16> {
        let at = |place| marks.iter().filter(|&&mark| timeline.has(place + mark)).count() as u16;
        (first..first + BLOCK).map(at).collect()
    }

    #[test]
    fn the_peak_is_the_highest_of_all_counts() {
        let mut chance = ChaCha8Rng::seed_from_u64(1);
        for marks in [0, 1, 7, 8, 9, 63, 64, 180, 319] {
            let lit = (0..3000).map(|_| (chance.next_u32() % 12_000) as i64);
            let timeline = Timeline::new(0..12_000, lit);
            let marks: Vec<i64> = (0..marks).map(|_| (chance.next_u32() % 10_000) as i64).collect();
            for first in [-700, -3, 0, 41, 11_900, 20_000] {
                let counts = counted(&timeline, first, &marks);
                let highest = counts.iter().copied().max().unwrap();
                let at = counts.iter().position(|&count| count == highest).unwrap();
                let others = counts.iter().enumerate().filter(|(other, _)| other.abs_diff(at) > 3);
                let next = others.map(|(_, &count)| count).max().unwrap();
                let found = Counts::new(&timeline, first, marks.iter().copied());
                let expected = Peak { at: at as i64, count: highest, next };
                assert_eq!(found.peak(0..BLOCK, 3), Some(expected));
            }
        }
    }

    #[test]
    fn places_that_are_not_allowed_are_not_found() {
        let timeline = Timeline::new(0..600, [100, 300]);
        let counts = Counts::new(&timeline, 0, [0].into_iter());
        let expected = Peak { at: 300, count: 1, next: 0 };
        assert_eq!(counts.peak(101..BLOCK, 0), Some(expected));
        assert_eq!(counts.peak(7..7, 0), None);
        assert_eq!(counts.peak(600..700, 0), None);
    }
}
