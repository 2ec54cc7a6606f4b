//! Counter-based random numbers: Philox4x32-10 \[SMDS11\].
//!
//! Every random number is a function of a counter, its address (seed, stage, index, part), where
//! the index is a shot, a pulse train or a time window. The same shot gets the same numbers on any
//! thread and in any order, and where neighbouring bands overlap, both see the same detection
//! events. Nothing is drawn in sequence, and no stage leaves a state behind.

use std::convert::Infallible;

use rand::rand_core::TryRng;

use crate::kernels::{GROUP, philox};

/// Purposes of random numbers. Each stage has numbers of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Is this mark seen? Indexed by pulse train.
    Marks = 1,
    /// Dark counts and background. Indexed by time window, parts by channel.
    Noise = 2,
    /// The firing of a detector that fires once per shot. Indexed by shot.
    Firing = 3,
    /// How late is a mark that is seen? Indexed by pulse train.
    Jitter = 4,
    /// The photons of the marks of a pulse train, and what a detector makes of each. Indexed by
    /// pulse train.
    Photons = 5,
    /// Which cell a count of the background falls on. Indexed by its time, parts by channel.
    Cell = 6,
    /// How late does a cell answer? Indexed by the time of the photon, parts by channel.
    Answer = 7,
    /// Which cells are blind at the beginning. Indexed by time, parts by channel.
    Blind = 8,
    /// Background that lasts for a stretch of time. Indexed by its address, parts by channel.
    Stretch = 9,
    /// The noise of an amplifier. Indexed by blocks of its samples, parts by channel.
    Amplifier = 10,
    /// How late does a comparator answer? Indexed by the sample at which it does, parts by channel.
    Comparator = 11,
    /// The objects of a scene that is made up. Indexed by row of pixels.
    Scenery = 12,
    /// How bright an echo is with speckle. Indexed by shot and ray.
    Speckle = 13,
    /// The counts of a histogram. Indexed by shot.
    Histogram = 14,
    /// Histograms that a forecast draws. Indexed by nothing.
    Forecast = 15,
    /// The taps of a shot. Indexed by shot.
    LockIn = 16,
    /// The field of each path of a shot in the mode of a coherent receiver. Indexed by shot.
    Field = 17,
    /// The noise of a spectrum. Indexed by shot, parts by ramp.
    Spectrum = 18,
    /// How the phase of a laser wanders during a shot. Indexed by shot.
    Phase = 19,
}

/// The counter at which a run of random numbers begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Address {
    /// Purpose of the numbers.
    pub(crate) stage: Stage,
    /// Index of the shot or window.
    pub(crate) index: u64,
    /// Which part of it, below 2²⁴.
    pub(crate) part: u32,
}

/// All random numbers of one run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chance {
    key: [u32; 2],
}

impl Chance {
    /// The random numbers of `seed`.
    pub fn new(seed: u64) -> Self {
        Self { key: [seed as u32, (seed >> 32) as u32] }
    }

    /// The first `count` numbers, or a few more, at `address`; in `numbers`, in place of what was
    /// there.
    pub(crate) fn draw<'a>(
        &self,
        address: Address,
        count: usize,
        numbers: &'a mut Vec<[u32; GROUP]>,
    ) -> &'a [u32] {
        let groups = count.div_ceil(GROUP);
        if numbers.len() < groups {
            numbers.resize(groups, [0; GROUP]);
        }
        self.fill(address, &mut numbers[..groups]);
        numbers[..groups].as_flattened()
    }

    fn fill(&self, address: Address, groups: &mut [[u32; GROUP]]) {
        let Address { stage, index, part } = address;
        philox(self.key, [stage as u32 | part << 8, index as u32, (index >> 32) as u32], groups);
    }

    /// The numbers at (`stage`, `index`) as a stream without end.
    pub fn at(&self, stage: Stage, index: u64) -> Stream {
        self.stream(Address { stage, index, part: 0 })
    }

    /// The numbers from `address` on, part after part, as a stream without end.
    pub(crate) fn stream(&self, address: Address) -> Stream {
        let mut stream = Stream { chance: *self, address, numbers: [[0; GROUP]], next: 0 };
        stream.fill();
        stream
    }
}

/// The numbers at one address, one after the other.
#[derive(Debug, Clone)]
pub struct Stream {
    chance: Chance,
    address: Address,
    numbers: [[u32; GROUP]; 1],
    next: usize,
}

impl Stream {
    /// The next number, between 0 and 1.
    pub fn fraction(&mut self) -> f64 {
        let Ok(number) = self.try_next_u32();
        (f64::from(number) + 0.5) / 4_294_967_296.0
    }

    fn fill(&mut self) {
        self.chance.fill(self.address, &mut self.numbers);
        self.next = 0;
        self.address.part += 1;
    }
}

impl TryRng for Stream {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        if self.next == GROUP {
            self.fill();
        }
        let number = self.numbers[0][self.next];
        self.next += 1;
        Ok(number)
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        let low = u64::from(self.try_next_u32()?);
        Ok(low | u64::from(self.try_next_u32()?) << 32)
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        for four in bytes.chunks_mut(4) {
            four.copy_from_slice(&self.try_next_u32()?.to_le_bytes()[..four.len()]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rand_core::Rng;

    #[test]
    fn an_address_gives_the_same_numbers_whatever_happened_between() {
        let chance = Chance::new(7);
        let first = chance.at(Stage::Marks, 12).next_u64();
        let _ = chance.at(Stage::Noise, 12).next_u64();
        assert_eq!(chance.at(Stage::Marks, 12).next_u64(), first);
    }

    #[test]
    fn addresses_differ_in_each_part() {
        let numbers = |seed, stage, index, part| {
            let mut numbers = Vec::new();
            Chance::new(seed).draw(Address { stage, index, part }, 100, &mut numbers).to_vec()
        };
        let owned = numbers(7, Stage::Marks, 12, 0);
        let others = [
            numbers(8, Stage::Marks, 12, 0),
            numbers(7 | 1 << 40, Stage::Marks, 12, 0),
            numbers(7, Stage::Firing, 12, 0),
            numbers(7, Stage::Marks, 13, 0),
            numbers(7, Stage::Marks, 12 | 1 << 40, 0),
            numbers(7, Stage::Marks, 12, 1),
        ];
        for other in others {
            // Hardly one in a hundred numbers of 32 bits that are drawn at random is the same.
            assert!(owned.iter().zip(&other).filter(|(a, b)| a == b).count() < 2);
        }
    }

    #[test]
    fn a_stream_goes_on_where_a_group_ends() {
        let mut stream = Chance::new(7).at(Stage::Firing, 3);
        let numbers: Vec<u32> = (0..3 * GROUP).map(|_| stream.next_u32()).collect();
        let mut different = numbers.clone();
        different.sort_unstable();
        different.dedup();
        assert_eq!(different.len(), numbers.len());
    }

    /// H0: bits are fair. N = 2²⁰ numbers, seed 1, α = 1e-6 for each bit (|z| < 4.9).
    #[test]
    fn every_bit_is_set_half_of_the_time() {
        let mut numbers = Vec::new();
        let address = Address { stage: Stage::Marks, index: 1, part: 0 };
        let numbers = Chance::new(1).draw(address, 1 << 20, &mut numbers);
        let z = |of: &dyn Fn(u32) -> bool| {
            let set = numbers.iter().filter(|number| of(**number)).count() as f64;
            (set - (1 << 19) as f64) / 512.0
        };
        for bit in 0..32 {
            assert!(z(&|number| number >> bit & 1 == 1).abs() < 4.9, "bit {bit}");
        }
        // Negative control: a coin that falls on one side one time in a hundred too often.
        assert!(z(&|number| number < 0x8147_AE14).abs() > 4.9);
    }
}
