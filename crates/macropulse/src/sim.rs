//! The whole chain from shots to points, as function calls.

mod arrivals;
mod record;

use std::sync::Mutex;
use std::time::Instant;

use rayon::prelude::*;

use crate::channel;
use crate::channel::{Light, Operating, Seen};
use crate::design::Design;
use crate::detect::{Detectors, Memory};
use crate::emit::{Band, bands, scan_begins_fs};
use crate::points::{Piece, PointCloud, Scale, Viewpoint};
use crate::processor::thread_seconds;
use crate::random::Chance;
use crate::scene::{Pose, Scene, Traced};
use crate::score::{self, Score};
use macropulse_codec::decode::{self, MOST_RETURNS, Reject, Returns};
use macropulse_codec::{Given, ShotLog};

pub use arrivals::{Arrival, Arrivals, Stretch};

/// Why there is no scan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The sensor cannot be simulated in the scene.
    #[error(transparent)]
    Operating(#[from] channel::Error),
    /// The receiver cannot decode what the stages before it made: a fault of the simulator.
    #[error("{0}; this is a fault of Macropulse and not of its input: please report it")]
    Decode(#[from] decode::Error),
}

/// One scan, measured.
#[derive(Debug, Clone)]
pub struct Scan {
    /// The points of its bands, with the truth beside them: read in their order, the cloud.
    pub pieces: Vec<Piece>,
    /// How the pixels came out.
    pub score: Score,
    /// Counts of the run.
    pub tally: Tally,
    /// The cloud without its returns and pixels.
    frame: PointCloud,
}

impl Scan {
    /// The points of all bands in one list, with the truth beside them.
    pub fn cloud(&self) -> PointCloud {
        PointCloud::joined(&self.frame, &self.pieces)
    }
}

/// Scan number `number` of the sensor `design` in `scene`, with the random numbers of `seed`.
///
/// The bands of the scan are computed side by side on the threads of the current rayon pool; the
/// result does not depend on how many there are.
///
/// # Errors
/// If the sensor cannot be simulated in the environment of the scene, as [`Operating::of`]; if the
/// receiver refuses what the simulator made, which is a fault of the latter.
pub fn scan(design: &Design, scene: &Scene, seed: u64, number: u64) -> Result<Scan, Error> {
    let bands: Vec<Band> = bands(design, number).collect();
    scan_part(design, scene, seed, &bands)
}

/// As [`scan`], but only the `bands` given, all of one scan; the rest of the cloud stays empty.
///
/// # Errors
/// As [`scan`].
pub fn scan_part(design: &Design, scene: &Scene, seed: u64, bands: &[Band]) -> Result<Scan, Error> {
    let mut scans = Scans::new(design, scene, seed)?;
    // A watch that never says stop lets every band through.
    let unwatched = Watch { done: &|_| {}, stop: &|| false };
    scans.part(bands, &unwatched)?;
    Ok(scans.scan)
}

/// As [`scan`], under a `watch`; `None` if it said stop before the end.
///
/// # Errors
/// As [`scan`].
pub fn scan_watched(
    design: &Design,
    scene: &Scene,
    seed: u64,
    number: u64,
    watch: &Watch,
) -> Result<Option<Scan>, Error> {
    let mut scans = Scans::new(design, scene, seed)?;
    let is_whole = scans.scan(number, watch)?.is_some();
    Ok(is_whole.then_some(scans.scan))
}

/// Follows the progress of scans and may stop them. Called from many threads.
pub struct Watch<'a> {
    /// Called with the number of shots of each finished band.
    pub done: &'a (dyn Fn(u64) + Sync),
    /// Called before each band, to tell whether to stop; bands that are under way are finished.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

/// Scan after scan of one sensor in one scene, in the memory of a single one.
pub struct Scans<'a> {
    design: &'a Design,
    scene: &'a Scene,
    operating: Operating,
    chance: Chance,
    scale: Scale,
    detectors: Detectors<'a>,
    memories: Vec<Memory>,
    scan: Scan,
}

impl<'a> Scans<'a> {
    /// The scans of the sensor `design` in `scene`, with the random numbers of `seed`.
    ///
    /// # Errors
    /// As [`scan`].
    pub fn new(design: &'a Design, scene: &'a Scene, seed: u64) -> Result<Self, Error> {
        let operating = Operating::in_scene(design, scene)?;
        let chance = Chance::new(seed);
        let detectors = Detectors::new(design, &operating, chance);
        let scan = Scan {
            pieces: Vec::new(),
            score: Score::default(),
            tally: Tally::default(),
            frame: PointCloud::empty(design, 0),
        };
        let scale = Scale::of(design, &operating);
        Ok(Self { design, scene, operating, chance, scale, detectors, memories: Vec::new(), scan })
    }

    /// Scan number `number`, in place of the one before it; `None` if the `watch` said stop before
    /// its end.
    ///
    /// # Errors
    /// If the receiver refuses what the simulator made.
    pub fn scan(&mut self, number: u64, watch: &Watch) -> Result<Option<&Scan>, Error> {
        let bands: Vec<Band> = bands(self.design, number).collect();
        self.part(&bands, watch)
    }

    /// As [`Scans::scan`], but only the `bands` given, all of one scan; the rest of the cloud
    /// stays empty.
    ///
    /// # Errors
    /// As [`Scans::scan`].
    pub fn part(&mut self, bands: &[Band], watch: &Watch) -> Result<Option<&Scan>, Error> {
        self.part_kept(bands, watch, &|_| {})
    }

    /// As [`Scans::scan`], and what the receiver was given of each band goes to `keep`, from many
    /// threads, nearly in the order of the bands.
    ///
    /// # Errors
    /// As [`Scans::scan`].
    pub fn scan_kept(
        &mut self,
        number: u64,
        watch: &Watch,
        keep: &(dyn Fn(&Record) + Sync),
    ) -> Result<Option<&Scan>, Error> {
        let bands: Vec<Band> = bands(self.design, number).collect();
        self.part_kept(&bands, watch, keep)
    }

    /// Set if ticks come with amplitudes.
    pub fn measure(&self) -> bool {
        self.detectors.measure()
    }

    /// The receiver's input for a band.
    pub fn record(&self, band: &Band) -> (ShotLog, Given) {
        let Self { design, scene, operating, chance, detectors, .. } = self;
        let seen = Seen { design, scene, operating, chance: *chance };
        record::of(&Setup { seen, detectors }, band)
    }

    /// The light and noise at the detector in a stretch of the time of a band: truth, for people who ask why;
    /// the receiver is not given it.
    pub fn arrivals(&self, band: &Band, stretch: &Stretch) -> Arrivals {
        let Self { design, scene, operating, chance, detectors, .. } = self;
        let setup = Setup { seen: Seen { design, scene, operating, chance: *chance }, detectors };
        arrivals::arrivals(&setup, band, stretch)
    }

    fn part_kept(
        &mut self,
        bands: &[Band],
        watch: &Watch,
        keep: &(dyn Fn(&Record) + Sync),
    ) -> Result<Option<&Scan>, Error> {
        let Self { design, scene, operating, chance, scale, detectors, memories, scan } = self;
        let setup = Setup { seen: Seen { design, scene, operating, chance: *chance }, detectors };
        let number = bands.first().map_or(0, |band| band.scan);
        scan.frame.scan = number;
        scan.frame.viewpoint = viewpoint(&scene.sensor.at(scan_begins_fs(design, number)));
        scan.pieces.resize_with(bands.len(), Piece::default);
        memories.resize_with(rayon::current_num_threads(), Memory::default);
        // Each thread takes the next band when it is done with the one before.
        let left = Mutex::new(bands.iter().zip(&mut scan.pieces));
        let next = || left.lock().ok()?.next();
        let threads = memories.par_iter_mut().with_max_len(1).map(|memory| {
            let mut counted = (Score::default(), Tally::default());
            let (began, computed) = (Instant::now(), thread_seconds());
            while !(watch.stop)()
                && let Some((band, piece)) = next()
            {
                let known = counted.1.peak_busy;
                let measured = measure(&setup, memory, (band, known))?;
                let log = &measured.log;
                keep(&Record { band, log, given: (&measured.given).into() });
                let (score, tally, given) = measured.judged(&setup.seen, scale, piece);
                if let Given::Ticks(ticks) = given {
                    memory.take_back(ticks.tick);
                }
                counted.0.add(&score);
                counted.1.add(&tally);
                (watch.done)(band.shots);
            }
            let on_processor = (thread_seconds() - computed) / began.elapsed().as_secs_f64();
            if on_processor.is_finite() {
                counted.1.seconds.iter_mut().for_each(|seconds| *seconds *= on_processor);
            }
            Ok(counted)
        });
        let counts = threads.collect::<Result<Vec<(Score, Tally)>, Error>>()?;
        let is_whole = next().is_none();
        (scan.score, scan.tally) = Default::default();
        for (score, tally) in &counts {
            scan.score.add(score);
            scan.tally.add(tally);
        }
        Ok(is_whole.then_some(scan))
    }
}

/// The pose of a sensor as clouds have it.
fn viewpoint(pose: &Pose) -> Viewpoint {
    Viewpoint { position: pose.position, turn: pose.rotation.quaternion() }
}

/// The receiver's input for a band.
#[derive(Debug, Clone, Copy)]
pub struct Record<'a> {
    /// The band.
    pub band: &'a Band,
    /// Its shots, guard shots included.
    pub log: &'a ShotLog,
    /// All ticks, samples or histograms, that belong to it ([`Band::ticks`]).
    pub given: macropulse_codec::Record<'a>,
}

/// A band that was measured: the receiver's side, and the truth to judge it by.
struct Measured<'a> {
    log: ShotLog,
    traced: Traced,
    light: Light<'a>,
    given: Given,
    returns: Returns,
    tally: Tally,
}

impl Measured<'_> {
    /// Makes the returns of a band the points of `piece`, and counts; and what was given back.
    fn judged(mut self, seen: &Seen, scale: &Scale, piece: &mut Piece) -> (Score, Tally, Given) {
        let Seen { design, scene, .. } = *seen;
        let began = Instant::now();
        piece.fill(design, scale, &self.log, &self.returns);
        let mut score = score::judge(piece, design, scene, &self.log, &self.traced);
        score.ghosts = score::ghosts(piece, design, &self.log, &self.light);
        self.tally.seconds[POINTS] += began.elapsed().as_secs_f64();
        (score, self.tally, self.given)
    }

    /// Counts what the owned shots of the band met and gave.
    fn count(&mut self, design: &Design) {
        let Self { log, traced, light, returns, tally, .. } = self;
        tally.shots = log.owned.len() as u64;
        tally.surfaces = surfaces(design, log, traced);
        let owned = log.first + log.owned.start as u64..log.first + log.owned.end as u64;
        for (transmitter, shot) in light.trains.transmitter.iter().zip(&light.trains.shot) {
            match transmitter {
                0 => tally.echoes += u64::from(owned.contains(shot)),
                _ => tally.interferer_shots += 1,
            }
        }
        tally.interferer_shots += light.background.len() as u64;
        tally.returns = returns.shot.len() as u64;
        for number in &returns.number {
            tally.by_number[usize::from(number - 1)] += 1;
        }
        tally.rejects = returns.rejects;
    }
}

/// Surfaces that the owned shots of `log` met within the range gate.
fn surfaces(design: &Design, log: &ShotLog, traced: &Traced) -> u64 {
    let hits = &traced.middle;
    let gates = design.scan.gates();
    let before = |shot: usize| hits.shot.partition_point(|other| (*other as usize) < shot);
    let met = before(log.owned.start)..before(log.owned.end);
    let ranges = hits.range[met.clone()].iter();
    let met = match gates.of_all() {
        Some(gate) => ranges.filter(|range| gate.contains(range)).count(),
        None => {
            let surfaces = hits.shot[met].iter().zip(ranges);
            let gate = |shot: u32| gates.of(log.row[shot as usize]);
            surfaces.filter(|(shot, range)| gate(**shot).contains(range)).count()
        }
    };
    met as u64
}

/// The common parts of all bands of a run.
struct Setup<'a> {
    seen: Seen<'a>,
    detectors: &'a Detectors<'a>,
}

/// Measures a band of a scan; `known` tells the number of converters that were busy at once.
fn measure<'a>(
    setup: &Setup<'a>,
    memory: &mut Memory,
    (band, known): (&Band, u32),
) -> Result<Measured<'a>, Error> {
    let Setup { seen: Seen { design, scene, .. }, .. } = *setup;
    let mut stages = Stages::begin();
    let log = stages.done(EMIT, band.shot_log(design));
    let traced = stages.done(SCENE, scene.trace(design, &log));
    let light = stages.done(CHANNEL, channel::light(&setup.seen, &log, &traced));
    let record::Recorded { given, mut tally } =
        record::recorded(setup, memory, (band, &log, &light), known, &mut stages);
    let returns = stages.done(DECODE, receive(design, &log, &given)?);
    tally.seconds = stages.seconds;
    let mut measured = Measured { log, traced, light, given, returns, tally };
    measured.count(design);
    Ok(measured)
}

/// The returns of the receiver of `design` from the record `given` of the shots of `log`.
///
/// # Errors
/// As [`Receiver::decode`](macropulse_codec::decode::Receiver::decode).
fn receive(design: &Design, log: &ShotLog, given: &Given) -> Result<Returns, decode::Error> {
    let known = design.known(log);
    let mut returns = design.receive(&known, given)?;
    let unknown = (known.first - log.first) as u32;
    returns.shot.iter_mut().for_each(|shot| *shot += unknown);
    Ok(returns)
}

/// The stages of a band, as places in [`Tally::STAGES`].
const EMIT: usize = 0;
const SCENE: usize = 1;
const CHANNEL: usize = 2;
const DETECT: usize = 3;
const READOUT: usize = 4;
const DECODE: usize = 5;
const POINTS: usize = 6;

/// Takes the time of each stage, by the wall clock: to ask for the processor time of a thread after each stage takes a
/// thirtieth of a clean scan.
struct Stages {
    began: Instant,
    seconds: [f64; POINTS + 1],
}

impl Stages {
    fn begin() -> Self {
        Self { began: Instant::now(), seconds: [0.0; POINTS + 1] }
    }

    /// Counts the time since the end of the stage before as that of `stage`, whose `result` is there.
    fn done<T>(&mut self, stage: usize, result: T) -> T {
        let ended = Instant::now();
        self.seconds[stage] += (ended - self.began).as_secs_f64();
        self.began = ended;
        result
    }
}

/// Counts of a run, stage by stage. Those of interferers, detection events and ticks include the
/// guard shots of the bands; the others are of owned shots alone.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tally {
    /// Shots fired.
    pub shots: u64,
    /// Surfaces met.
    pub surfaces: u64,
    /// Echoes with any light.
    pub echoes: u64,
    /// Shots of interferers whose light arrives, each way on its own.
    pub interferer_shots: u64,
    /// Detection events.
    pub detections: u64,
    /// Things counted in the records that reached the receiver, as
    /// [`RecordKind::counted`](macropulse_codec::RecordKind::counted) names them.
    pub recorded: u64,
    /// Detection events that fell into the tick of another one.
    pub merged: u64,
    /// Detection events that found every converter busy.
    pub lost: u64,
    /// Most converters busy at once.
    pub peak_busy: u32,
    /// Returns decoded.
    pub returns: u64,
    /// The returns by their number in their shot: the first ones, the second ones, and so on.
    pub by_number: [u64; MOST_RETURNS as usize],
    /// Rejects by kind, in the order of [`Reject::ALL`].
    pub rejects: [u64; Reject::ALL.len()],
    /// Seconds of processor time spent in each of [`Tally::STAGES`], summed over threads. The sum of all
    /// stages is the time of the processor. Their shares of it are their shares of the wall clock.
    pub seconds: [f64; POINTS + 1],
}

impl Tally {
    /// The stages whose time is taken.
    pub const STAGES: [&str; POINTS + 1] =
        ["emit", "scene", "channel", "detect", "tdc", "decode", "points"];

    /// The sum over several bands or scans; of the busiest moment the maximum.
    pub fn add(&mut self, other: &Self) {
        let sums = [
            (&mut self.shots, other.shots),
            (&mut self.surfaces, other.surfaces),
            (&mut self.echoes, other.echoes),
            (&mut self.interferer_shots, other.interferer_shots),
            (&mut self.detections, other.detections),
            (&mut self.recorded, other.recorded),
            (&mut self.merged, other.merged),
            (&mut self.lost, other.lost),
            (&mut self.returns, other.returns),
        ];
        sums.into_iter().for_each(|(sum, more)| *sum += more);
        self.peak_busy = self.peak_busy.max(other.peak_busy);
        self.by_number.iter_mut().zip(other.by_number).for_each(|(sum, more)| *sum += more);
        self.rejects.iter_mut().zip(other.rejects).for_each(|(sum, more)| *sum += more);
        self.seconds.iter_mut().zip(other.seconds).for_each(|(sum, more)| *sum += more);
    }

    /// The first stage of a run of `design` after which nothing was left, said as a sentence; `None` if there are
    /// returns.
    pub fn where_all_was_lost(&self, design: &Design) -> Option<&'static str> {
        match self {
            _ if self.returns > 0 => None,
            _ if self.surfaces == 0 => Some(
                "no ray met a surface within the range gate: check where the sensor stands, which way it looks, and its max_range_m",
            ),
            _ if self.echoes == 0 => Some(
                "every surface met is black at this wavelength, or no longer in the field of the \
                 receiver when its light comes",
            ),
            _ if self.recorded > 0 => Some(design.readout.model().why_nothing_is_found()),
            _ if self.detections == 0 => {
                Some("the detector saw none of the echoes: too little light for its sensitivity")
            }
            _ => Some("every detection event found all converters busy"),
        }
    }
}
