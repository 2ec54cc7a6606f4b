//! The sample for measurements: bands spread over a scan of `kim-park-2016`, with their hits and ticks, under
//! detectors of every quality.

use std::hint::black_box;
use std::slice;

use macropulse::channel::{self, Operating, light_of_echoes};
use macropulse::codec::decode::{self, Returns};
use macropulse::codec::{ShotLog, Ticks};
use macropulse::design::Design;
use macropulse::detect::{Detectors, Memory};
use macropulse::emit::{Band, bands};
use macropulse::environment::Environment;
use macropulse::processor::thread_seconds;
use macropulse::random::{Chance, Stage};
use macropulse::scene::{Finish, Hits, Material, Scene};
use macropulse::tdc::{self, Converted, Wanted};
use macropulse::units;
use rand::RngExt;

use crate::Fallible;
use crate::machine::{least_of_rounds, seconds};
use crate::page;

/// Seed of all that is drawn.
pub const SEED: u64 = 20_160_913;

/// Scenes; `random` is a white target for every shot, anywhere in the range gate.
pub const SCENES: [&str; 3] = ["car-50m", "street", "random"];

/// Farther from all surfaces of its shot than this, m, a return is wrong.
const NEAR: f64 = 0.35;

/// A detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Condition {
    /// As the sensor file declares it.
    Declared,
    /// Without jitter, and no light from beyond the gate; of the marks a fraction is `missed`, and
    /// `counts` are dark and background counts per second.
    Noise { missed: f64, counts: f64 },
}

impl Condition {
    /// All marks and nothing else.
    pub const CLEAN: Self = Self::Noise { missed: 0.0, counts: 0.0 };

    const MISSED: [f64; 4] = [0.0, 0.05, 0.2, 0.4];
    const COUNTS: [f64; 4] = [0.0, 1e8, 1e9, 1e10];

    /// All that are measured.
    pub fn all() -> impl Iterator<Item = Self> {
        let noise = |missed| Self::COUNTS.map(|counts| Self::Noise { missed, counts });
        Self::MISSED.into_iter().flat_map(noise).chain([Self::Declared])
    }

    /// The sensor with this detector.
    pub fn design(self) -> Fallible<Design> {
        self.design_to(150.0)
    }

    /// The same with a range gate to `gate` metres.
    pub fn design_to(self, gate: f64) -> Fallible<Design> {
        let Self::Noise { missed, counts } = self else {
            return Ok(Design::open("kim-park-2016", &[])?);
        };
        let keys = [
            ("detector.photon-counting.sensitivity.pd", 1.0),
            ("detector.photon-counting.jitter_ps", 0.0),
            ("detector.photon-counting.missed_marks", missed),
            ("detector.photon-counting.dark_counts_hz", counts),
            ("scan.max_range_m", gate),
            ("scan.light_range_m", gate),
        ];
        let keys = keys.map(|(key, value)| (key.to_owned(), format!("{value:?}")));
        Ok(Design::open("kim-park-2016", &keys)?)
    }

    /// A table of `cell`s, in the order of [`Condition::all`].
    pub fn table(scene: &str, cells: &[String]) -> String {
        let head = [&*format!("`{scene}`, missed"), "no dark counts", "10⁸/s", "10⁹/s", "10¹⁰/s"];
        let missed = Self::MISSED.map(|missed| format!("{:.0} %", 100.0 * missed));
        let names = missed.into_iter().chain(["as declared".to_owned()]);
        let rows = names.zip(cells.chunks(Self::COUNTS.len())).map(|(name, cells)| {
            let mut row = [vec![name], cells.to_vec()].concat();
            row.resize(head.len(), String::new());
            row
        });
        page::table(&head, &rows.collect::<Vec<_>>())
    }
}

/// Bands of a scan and what they meet, seen by one detector.
pub struct Sample {
    /// The sensor.
    pub design: Design,
    operating: Operating,
    finishes: Vec<Finish>,
    bands: Vec<(Band, Hits)>,
}

/// An echo as the scene has it.
pub struct Echo {
    /// Ticks from the epoch to the beginning of its macropulse.
    pub start: usize,
    /// Ticks from there to each of its marks.
    pub marks: Vec<u32>,
    /// Number of its code word.
    pub word: u16,
    /// Its label.
    pub label: u16,
}

/// The receiver's input for a band.
pub type Given = (ShotLog, Ticks);

impl Sample {
    /// One band in `every` of a scan of `scene`, where there is neither air nor sunlight. It is
    /// the second scan: its first band has guard shots before it.
    pub fn of(design: Design, scene: &str, every: usize) -> Fallible<Self> {
        Self::of_scan(design, scene, every, 1)
    }

    /// The same of scan number `scan`.
    pub fn of_scan(design: Design, scene: &str, every: usize, scan: u64) -> Fallible<Self> {
        let bands = bands(&design, scan).step_by(every);
        let (finishes, bands) = if scene == "random" {
            let met = |band: Band| (band, anywhere(&design, &band.shot_log(&design)));
            (
                vec![Material::matt("white", 1.0).at(design.light.wavelength)],
                bands.map(met).collect(),
            )
        } else {
            let scene = Scene::open(scene)?;
            let met = |band: Band| (band, scene.trace(&design, &band.shot_log(&design)).middle);
            let bands = bands.map(met).collect();
            (scene.finishes(design.light.wavelength), bands)
        };
        let operating = Operating::of(&design, &Environment::vacuum_dark())?;
        Ok(Self { design, operating, finishes, bands })
    }

    /// Number of shots whose returns are wanted.
    pub fn shots(&self) -> f64 {
        self.bands.iter().map(|(band, _)| band.shots as f64).sum()
    }

    /// The speed for a time of `seconds`.
    pub fn speed(&self, seconds: f64) -> f64 {
        self.design.speed(self.shots(), seconds)
    }

    /// The detectors: a run makes them once.
    pub fn detectors(&self) -> Detectors<'_> {
        Detectors::new(&self.design, &self.operating, Chance::new(SEED))
    }

    /// From shot log to ticks, band by band.
    pub fn ticks(&self, detectors: &Detectors, mut done: impl FnMut(&mut Memory, Given)) {
        let (mut memory, mut known_busy) = (Memory::default(), 0);
        for (band, hits) in &self.bands {
            let log = band.shot_log(&self.design);
            let mut light = light_of_echoes(&self.design, &log, []);
            let surfaces = (&self.operating.link, &*self.finishes);
            channel::echoes(&mut light.trains, surfaces, &log, hits, None);
            let response = detectors.response(&log, &light, &mut memory);
            let span = band.ticks(&self.design).0;
            let wanted = Wanted { known_busy, from: span.start };
            let Converted { mut ticks, peak_busy, .. } = tdc::ticks(&self.design, response, wanted);
            ticks.keep(&span);
            // As in a whole scan, the number of busy converters is known for the bands before, and no shot
            // has only a part of its light there.
            known_busy = peak_busy;
            done(&mut memory, (self.design.cut().known(&log), ticks));
        }
    }

    /// The echoes from within the range gate, band by band, in the order of their arrival.
    pub fn echoes(&self) -> Vec<Vec<Echo>> {
        let Design { receiver, emission, scan, clock, .. } = &self.design;
        let scale = receiver.method.ticks_per_chip().unwrap_or(1);
        let of_band = |(band, hits): &(Band, Hits)| {
            let log = band.shot_log(&self.design);
            let epoch = self.design.cut().epoch(log.fired_at_fs[0]);
            let all = hits.shot.iter().zip(&hits.range);
            let within = all.filter(|(_, range)| **range <= scan.max_range);
            let echo = |(shot, range): (&u32, &f64)| {
                let shot = *shot as usize;
                let arrives =
                    log.fired_at_fs[shot] + units::fs_from_s(units::tof_from_range(*range));
                let (label, word) = (log.label[shot], log.word[shot]);
                let marks = emission.coding().codebook.marks(label, word);
                let start = arrives.div_euclid(clock.tick_fs) - epoch;
                let marks = marks.iter().map(|mark| scale * u32::from(*mark)).collect();
                Echo { start: start.max(0) as usize, marks, word, label }
            };
            let mut echoes: Vec<Echo> = within.map(echo).collect();
            echoes.sort_by_key(|echo| echo.start);
            echoes
        };
        self.bands.iter().map(of_band).collect()
    }

    /// The receiver's input.
    pub fn given(&self) -> Vec<Given> {
        let mut given = Vec::new();
        self.ticks(&self.detectors(), |_, band| given.push(band));
        given
    }

    /// The receiver's returns.
    pub fn decode(&self, given: &[Given]) -> Result<Vec<Returns>, decode::Error> {
        let Design { receiver, emission, .. } = &self.design;
        given
            .iter()
            .map(|(log, ticks)| receiver.decode(&emission.coding().codebook, log, ticks))
            .collect()
    }

    /// The same, and the seconds of this thread that it takes.
    pub fn decode_timed(&self, given: &[Given]) -> Result<(Vec<Returns>, f64), decode::Error> {
        let began = thread_seconds();
        let returns = self.decode(given)?;
        Ok((returns, thread_seconds() - began))
    }

    /// Returns the least seconds to decode each band as soon as its ticks are there, as in a whole scan. If
    /// the ticks were made long ago, a clean band takes longer, as they have to be fetched from memory.
    pub fn decoding_seconds(&self) -> f64 {
        let detectors = self.detectors();
        least_of_rounds(|| {
            let mut sum = 0.0;
            self.ticks(&detectors, |memory, given| {
                sum += seconds(|| drop(black_box(self.decode(slice::from_ref(&given)))));
                memory.take_back(given.1.tick);
            });
            sum
        })
    }

    /// How it did.
    pub fn score(&self, given: &[Given], returns: &[Returns]) -> Score {
        let mut score = Score::default();
        for (((band, hits), (log, _)), returns) in self.bands.iter().zip(given).zip(returns) {
            let unknown = (log.first - band.shot_log(&self.design).first) as usize;
            score.add(&self.design, (log, unknown), (hits, returns));
        }
        score
    }
}

/// One white target for every shot, anywhere in the gate: as much overlap as there can be.
fn anywhere(design: &Design, log: &ShotLog) -> Hits {
    let range = |shot: u32| {
        let mut chance = Chance::new(SEED).at(Stage::Firing, log.first + u64::from(shot));
        chance.random_range(design.scan.min_range..design.scan.max_range)
    };
    let shots = log.len();
    Hits {
        shot: (0..shots as u32).collect(),
        weight: vec![1.0; shots],
        range: (0..shots as u32).map(range).collect(),
        cosine: vec![1.0; shots],
        material: vec![0; shots],
        object: vec![0; shots],
        ..Hits::default()
    }
}

/// How shots came out.
#[derive(Debug, Default, Clone, Copy)]
pub struct Score {
    /// Shots with an echo from within the gate.
    pub echoes: usize,
    /// Those of them found as near to a surface of theirs as the sensor file asks for, 1.5 mm.
    pub right: usize,
    /// Returns farther than 0.35 m from every surface of their shot.
    pub wrong: usize,
}

impl Score {
    /// Adds the owned shots of `log`; `hits` begins with those of `unknown` shots that the receiver does not
    /// know.
    fn add(
        &mut self,
        design: &Design,
        (log, unknown): (&ShotLog, usize),
        (hits, returns): (&Hits, &Returns),
    ) {
        let gate = design.scan.min_range..=design.scan.max_range;
        for shot in log.owned.clone() {
            let met = shot + unknown;
            let own = hits.shot.partition_point(|&other| (other as usize) < met)
                ..hits.shot.partition_point(|&other| other as usize <= met);
            let ranges = hits.range[own].iter().filter(|range| gate.contains(range));
            let marks = design.emission.coding().codebook.marks(log.label[shot], log.word[shot]);
            let has_echo = ranges.clone().next().is_some() && !marks.is_empty();
            self.echoes += usize::from(has_echo);
            let Ok(at) = returns.shot.binary_search(&(shot as u32)) else { continue };
            let measured = units::range_from_tof(returns.tof[at]);
            let off = ranges.map(|range| (range - measured).abs()).fold(f64::INFINITY, f64::min);
            self.right += usize::from(off <= design.right_within);
            self.wrong += usize::from(off > NEAR);
        }
    }

    /// The shots right, in per cent of those with an echo.
    pub fn percent(&self) -> f64 {
        100.0 * self.right as f64 / self.echoes as f64
    }
}
