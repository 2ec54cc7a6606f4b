//! Light to edges: the detectors.
//!
//! Edges carry no trace of their cause: whether a mark, a dark count or another lidar made them
//! cannot be told from here on.

mod clock;
mod first_firing;
mod jitter;
mod noise;
mod photon_counting;

pub use first_firing::photons_for;

use clock::Clock;
use photon_counting::Counting;

use crate::channel::Echoes;
use crate::design::{Design, Detector, FirstFiring};
use crate::emit::ShotLog;
use crate::kernels::GROUP;
use crate::random::Chance;

/// What detectors put out: edges in time. Sorted by channel, then by time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Edges {
    /// Absolute time of time 0, in ticks of the converters since the first scan began; a whole
    /// number of their clock periods.
    pub epoch: i64,
    /// Time since the epoch, in [`PARTS_OF_TICK`](crate::design::PARTS_OF_TICK).
    pub time: Vec<u32>,
    /// Detector that fired; empty where the sensor has a single one.
    pub channel: Vec<u16>,
    /// Measured pulse energy in detected photons; empty where the detector gives times only.
    pub amplitude: Vec<f32>,
}

/// The detectors of a sensor in one run, with all that need be worked out only once.
#[derive(Debug)]
pub struct Detectors<'a> {
    design: &'a Design,
    chance: Chance,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Counting(Counting),
    Firing(FirstFiring),
}

impl<'a> Detectors<'a> {
    /// The detectors of `design` with the accidents of `chance`.
    pub fn new(design: &'a Design, chance: Chance) -> Self {
        let kind = match &design.detector {
            Detector::PhotonCounting(counting) => Kind::Counting(Counting::new(counting, design)),
            Detector::FirstFiring(firing) => Kind::Firing(*firing),
        };
        Self { design, chance, kind }
    }

    /// The edges that the `echoes` of the shots in `log` make.
    pub fn edges(&self, log: &ShotLog, echoes: &Echoes, memory: &mut Memory) -> Edges {
        let Some(first) = log.fired_at_fs.first() else { return Edges::default() };
        let clock = Clock::new(self.design, *first);
        match &self.kind {
            Kind::Counting(counting) => {
                let band = photon_counting::Band { clock, design: self.design, log, echoes };
                counting.edges(&band, &self.chance, memory)
            }
            Kind::Firing(firing) => {
                let band = first_firing::Band { clock, design: self.design, log, echoes };
                first_firing::edges(firing, &band, &self.chance)
            }
        }
    }
}

/// Memory that serves band after band: to have it anew costs more than to fill it.
#[derive(Debug, Default)]
pub struct Memory {
    edges: Vec<u32>,
    false_edges: Vec<u32>,
    merged: Vec<u32>,
    earlier: Vec<u32>,
    later: Vec<u32>,
    order: Vec<u64>,
    numbers: Vec<[u32; GROUP]>,
}

impl Memory {
    /// Takes back the times of edges, or the ticks that were made of them, for the next band.
    pub fn take_back(&mut self, times: Vec<u32>) {
        self.edges = times;
    }
}
