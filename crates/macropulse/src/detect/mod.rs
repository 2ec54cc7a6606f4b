//! Light to edges: the detectors.
//!
//! Edges carry no trace of their cause: whether a mark, a dark count or another lidar made them
//! cannot be told from here on.

mod clock;
mod first_firing;
mod geiger;
mod jitter;
mod linear;
mod noise;
mod others;
mod photon_counting;
mod shape;

use std::ops::{Range, RangeInclusive};

use clock::Clock;
use geiger::Cells;
use linear::Thresholding;
use photon_counting::Counting;
use shape::Shape;

use crate::channel::{Echoes, LinearSetting, Operating, PARTS};
use crate::design::{Design, Detector, FirstFiring};
use crate::kernels::GROUP;
use crate::random::{Chance, Stage, Stream};
use macropulse_codec::ShotLog;

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
    shape: Option<Shape>,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Counting(Counting),
    Cells(Cells),
    Thresholding(Thresholding),
    Firing(FirstFiring),
}

/// Bits of the number of a way of foreign light.
const WAY_BITS: u32 = 13;

/// What the detectors are given of a band.
struct Band<'a> {
    clock: Clock,
    design: &'a Design,
    log: &'a ShotLog,
    echoes: &'a Echoes,
}

impl Band<'_> {
    /// Calls `visit` with every shot that has echoes, and with where they are.
    fn each_shot_with_echoes(&self, mut visit: impl FnMut(usize, Range<usize>)) {
        let mut first = 0;
        for echoes in self.echoes.shot.chunk_by(|one, next| one == next) {
            visit(echoes[0] as usize, first..first + echoes.len());
            first += echoes.len();
        }
    }

    /// When the marks of an echo, or of the part it is of, arrive, fs.
    fn marks(&self, echo: usize) -> impl Iterator<Item = i64> {
        let shot = self.echoes.shot[echo] as usize;
        let begins = self.log.fired_at_fs[shot] + self.echoes.delay_fs[echo];
        let coding = &self.design.coding;
        let marks = coding.codebook.marks(self.log.label[shot], self.log.word[shot]);
        let marks = match self.echoes.part.get(echo) {
            None => marks,
            Some(part) => {
                let begins = |part: u8| {
                    let chip = u32::from(part) * coding.codebook.chips() / u32::from(PARTS);
                    marks.partition_point(|mark| u32::from(*mark) < chip)
                };
                &marks[begins(*part)..begins(part + 1)]
            }
        };
        marks.iter().map(move |mark| begins + i64::from(*mark) * coding.chip_fs)
    }

    /// The marks of other lidars within the band: for each of their shots and ways of light, the
    /// stream of its chance, the photons of a mark, and when the marks arrive, fs.
    fn each_foreign(&self, chance: &Chance, mut visit: impl FnMut(Stream, f64, &[i64])) {
        let foreign = &self.echoes.foreign;
        let span = self.span();
        let mut arrivals = Vec::new();
        for entry in 0..foreign.len() {
            let begins = foreign.arrives_fs[entry];
            let arrives = foreign.marks_of(entry).iter().map(|mark| begins + mark);
            arrivals.clear();
            arrivals.extend(arrives.filter(|arrives| span.contains(&self.clock.time(*arrives))));
            let address = foreign.shot[entry] << WAY_BITS | u64::from(foreign.way[entry]);
            visit(chance.at(Stage::OtherPhotons, address), foreign.photons[entry], &arrivals);
        }
    }

    /// The time in which light of the band can arrive, in parts of a tick.
    fn span(&self) -> RangeInclusive<i64> {
        let fired = &self.log.fired_at_fs;
        let (first, last) = (fired.first().unwrap_or(&0), fired.last().unwrap_or(&0));
        self.clock.time(*first)..=self.clock.time(last + self.design.reach_fs())
    }
}

impl<'a> Detectors<'a> {
    /// The detectors of `design` where it is `operating`, with the accidents of `chance`.
    pub fn new(design: &'a Design, operating: &Operating, chance: Chance) -> Self {
        let false_rate = operating.false_rate;
        let kind = match &design.detector {
            Detector::PhotonCounting(counting) => {
                Kind::Counting(Counting::new(counting, false_rate, design))
            }
            Detector::Geiger(geiger) => Kind::Cells(Cells::new(geiger, false_rate, design)),
            Detector::Linear(linear) => {
                let setting = operating.linear;
                let setting =
                    setting.unwrap_or_else(|| LinearSetting::of(linear, operating.background));
                Kind::Thresholding(Thresholding::new(setting, design))
            }
            Detector::FirstFiring(firing) => Kind::Firing(*firing),
        };
        Self { design, chance, shape: Shape::of(design), kind }
    }

    /// The edges that the `echoes` of the shots in `log` make, and the foreign light among them.
    pub fn edges(&self, log: &ShotLog, echoes: &Echoes, memory: &mut Memory) -> Edges {
        let Some(first) = log.fired_at_fs.first() else { return Edges::default() };
        let clock = Clock::new(self.design, *first);
        let spread = self.shape.as_ref().map(|shape| shape.spread(echoes));
        let echoes = spread.as_ref().unwrap_or(echoes);
        let band = Band { clock, design: self.design, log, echoes };
        match &self.kind {
            Kind::Counting(counting) => counting.edges(&band, &self.chance, memory),
            Kind::Cells(cells) => cells.edges(&band, &self.chance, memory),
            Kind::Thresholding(linear) => linear.edges(&band, &self.chance, memory),
            Kind::Firing(firing) => first_firing::edges(firing, &band, &self.chance),
        }
    }
}

#[cfg(test)]
impl<'a> Detectors<'a> {
    /// The detectors of `design` where there is neither air nor sunlight.
    pub fn in_the_dark(design: &'a Design, chance: Chance) -> Self {
        Self::new(design, &Operating::in_the_dark(design), chance)
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
    foreign: Vec<u32>,
    offsets: Vec<i64>,
}

impl Memory {
    /// Takes back the times of edges, or the ticks that were made of them, for the next band.
    pub fn take_back(&mut self, times: Vec<u32>) {
        self.edges = times;
    }
}
