//! Light that reaches the detectors of a sensor while it measures a band. Every source adds to it, and every
//! detector sees it.
//!
//! Light is pulse trains, background and responses. A **pulse train** is the light of one shot of one lidar
//! along one way: the marks of a macropulse, or of a sub-macropulse. It comes from a surface or straight from
//! an interferer. The **background** is a rate λ(t): light without pulses, such as sunlight, or that of modulated
//! and chirped lidars. A **response** is such a rate after each mark that the sensor sends. A detector is a
//! function of all three and does not know whose light it is.

use macropulse_codec::code::Codebook;

use super::{Response, Varies};
use crate::design::Design;

/// A source of pulse trains: how the marks that a lidar sends follow each other.
#[derive(Debug, Clone, Copy)]
pub struct Transmitter<'a> {
    /// The marks of its macropulses.
    pub codebook: &'a Codebook,
    /// Length of a chip by the clock of the sensor that receives, fs.
    pub chip_fs: f64,
    /// Length of a micropulse (full width at half maximum), s.
    pub pulse: f64,
}

impl<'a> Transmitter<'a> {
    /// The transmitter of `design`, whose clock runs `stretch` times slower than the receiver's.
    pub fn of(design: &'a Design, stretch: f64) -> Self {
        let coding = design.emission.coding();
        Self {
            codebook: &coding.codebook,
            chip_fs: coding.chip_fs as f64 * stretch,
            pulse: design.light.pulse,
        }
    }
}

/// Light that reaches the detectors, before any of it is detected. Truth: the receiver knows nothing of it.
#[derive(Debug, Clone, Default)]
pub struct Light<'a> {
    /// Whose light it is: the sensor itself first, then the interferers.
    pub transmitters: Vec<Transmitter<'a>>,
    /// The pulse trains of all of them, in no particular order.
    pub trains: PulseTrains,
    /// Light without pulses.
    pub background: Background,
    /// Light without pulses that each mark of the sensor itself brings.
    pub responses: Vec<Response>,
}

/// Pulse trains, as columns: one entry for what one shot sends along one way.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PulseTrains {
    /// Index of the transmitter.
    pub transmitter: Vec<u16>,
    /// Channel of the detector that sees it.
    pub channel: Vec<u16>,
    /// Absolute time at which the first chip of the macropulse arrives, or would, fs.
    pub arrives_fs: Vec<i64>,
    /// Mean number of photons per mark; infinite for a detector that never misses.
    pub photons: Vec<f64>,
    /// Label of the macropulse.
    pub label: Vec<u16>,
    /// Code word of the macropulse.
    pub word: Vec<u16>,
    /// First mark that takes this way and the one behind the last, by their place in the list of
    /// the macropulse; [`ALL_MARKS`] where all of them do.
    pub marks: Vec<[u16; 2]>,
    /// How fast the surface approaches, m/s; empty where the light of no sensor shows it. Trains of the sensor
    /// itself come first, and only they have one.
    pub radial_velocity: Vec<f32>,
    /// Number of the shot by its transmitter's own count.
    pub shot: Vec<u64>,
    /// Which of the ways that light of this shot takes: with transmitter and shot the counter of
    /// its random numbers.
    pub way: Vec<u16>,
}

/// Stands in [`PulseTrains::marks`] for a whole macropulse.
pub const ALL_MARKS: [u16; 2] = [0, u16::MAX];

/// One line of [`PulseTrains`]; fields as there.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(missing_docs, reason = "the columns say it")]
pub struct PulseTrain {
    pub transmitter: u16,
    pub channel: u16,
    pub arrives_fs: i64,
    pub photons: f64,
    pub label: u16,
    pub word: u16,
    pub marks: [u16; 2],
    pub shot: u64,
    pub way: u16,
}

impl PulseTrains {
    /// Number of pulse trains.
    pub fn len(&self) -> usize {
        self.arrives_fs.len()
    }

    /// Returns true if there is none.
    pub fn is_empty(&self) -> bool {
        self.arrives_fs.is_empty()
    }

    /// Adds one.
    pub fn push(&mut self, train: PulseTrain) {
        self.transmitter.push(train.transmitter);
        self.channel.push(train.channel);
        self.arrives_fs.push(train.arrives_fs);
        self.photons.push(train.photons);
        self.label.push(train.label);
        self.word.push(train.word);
        self.marks.push(train.marks);
        self.shot.push(train.shot);
        self.way.push(train.way);
    }

    /// Returns the counter of the random numbers of pulse train `index`.
    pub fn address(&self, index: usize) -> u64 {
        address((self.transmitter[index], self.way[index]), self.shot[index])
    }

    /// The pulse train at `index`.
    pub fn at(&self, index: usize) -> PulseTrain {
        PulseTrain {
            transmitter: self.transmitter[index],
            channel: self.channel[index],
            arrives_fs: self.arrives_fs[index],
            photons: self.photons[index],
            label: self.label[index],
            word: self.word[index],
            marks: self.marks[index],
            shot: self.shot[index],
            way: self.way[index],
        }
    }
}

/// Returns the counter of the random numbers of light that `shot` sends along one way. It holds the way in the
/// highest bits, then the transmitter, and the shot, modulo 2⁴⁰.
pub(super) fn address((transmitter, way): (u16, u16), shot: u64) -> u64 {
    u64::from(way) << 48 | u64::from(transmitter) << 40 | shot & ((1 << 40) - 1)
}

impl Light<'_> {
    /// The marks of pulse train `index`, in chips from its first one.
    pub fn marks(&self, index: usize) -> &[u16] {
        let trains = &self.trains;
        let codebook = self.transmitters[usize::from(trains.transmitter[index])].codebook;
        let marks = codebook.marks(trains.label[index], trains.word[index]);
        let [first, end] = trains.marks[index].map(usize::from);
        &marks[first.min(marks.len())..end.min(marks.len())]
    }

    /// When the marks of pulse train `index` arrive, fs, ascending.
    pub fn arrivals_fs(&self, index: usize) -> impl Iterator<Item = i64> {
        let chip_fs = self.transmitters[usize::from(self.trains.transmitter[index])].chip_fs;
        let begins = self.trains.arrives_fs[index];
        self.marks(index).iter().map(move |mark| begins + (f64::from(*mark) * chip_fs) as i64)
    }
}

/// Light without pulses: a rate λ(t) for each channel.
///
/// `steady` holds in every channel at any time. The other columns add to it, one entry for a stretch of time
/// in one channel. Stretches may overlap: their rates add up.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Background {
    /// Photons per second in each channel, all the time.
    pub steady: f64,
    /// Channel of a stretch.
    pub channel: Vec<u16>,
    /// Absolute time at which it begins, fs.
    pub from_fs: Vec<i64>,
    /// Absolute time at which it ends, fs.
    pub until_fs: Vec<i64>,
    /// Mean photons per second meanwhile.
    pub per_s: Vec<f64>,
    /// How its light varies meanwhile.
    pub varies: Vec<Varies>,
    /// The counter of its random numbers, which no other stretch of the channel has.
    pub address: Vec<u64>,
}

/// One line of the columns of [`Background`]; fields as there.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(missing_docs, reason = "the columns say it")]
pub struct Stretch {
    pub channel: u16,
    pub from_fs: i64,
    pub until_fs: i64,
    pub per_s: f64,
    pub varies: Varies,
    pub address: u64,
}

impl Background {
    /// Number of stretches.
    pub fn len(&self) -> usize {
        self.per_s.len()
    }

    /// Returns true if there is none.
    pub fn is_empty(&self) -> bool {
        self.per_s.is_empty()
    }

    /// Adds one.
    pub fn push(&mut self, stretch: Stretch) {
        self.channel.push(stretch.channel);
        self.from_fs.push(stretch.from_fs);
        self.until_fs.push(stretch.until_fs);
        self.per_s.push(stretch.per_s);
        self.varies.push(stretch.varies);
        self.address.push(stretch.address);
    }

    /// The stretches by channel, then by their ends.
    pub fn by_channel(&self) -> Vec<Stretch> {
        let mut stretches: Vec<Stretch> = (0..self.len()).map(|index| self.at(index)).collect();
        stretches.sort_by_key(|stretch| (stretch.channel, stretch.until_fs));
        stretches
    }

    /// The stretch at `index`.
    pub fn at(&self, index: usize) -> Stretch {
        Stretch {
            channel: self.channel[index],
            from_fs: self.from_fs[index],
            until_fs: self.until_fs[index],
            per_s: self.per_s[index],
            varies: self.varies[index],
            address: self.address[index],
        }
    }
}
