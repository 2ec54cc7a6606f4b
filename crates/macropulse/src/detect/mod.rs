//! Light to detection events: the detectors.
//!
//! A detector is a function of [`Light`]. Its events carry no trace of their cause: whether a mark
//! of the sensor's own, a dark count or an interferer made them cannot be told from here on.

mod baseline;
mod channel;
mod clock;
mod coherent;
mod colour;
mod first_photon;
mod geiger;
mod histogram;
mod jitter;
mod linear;
mod lock_in;
mod marks;
mod noise;
mod photon_counting;
mod sampled;
mod shape;
mod single_stop;
mod waveform;

use std::borrow::Cow;
use std::fmt;
use std::ops::Range;

pub use marks::{Marks, Response};

use macropulse_codec::{Given, Samples, ShotLog};

use channel::{Arrangement, Channel};
use clock::Clock;
use coherent::Mixer;
use geiger::Cells;
use histogram::Accumulator;
use linear::Thresholding;
use lock_in::Demodulator;
use marks::ExactWords;
use photon_counting::Counting;
use sampled::Sampler;
use shape::Shape;
use waveform::Waveform;

use crate::channel::{Light, Operating};
use crate::design::{Design, Detector};
use crate::kernels::{GROUP, Macropulse};
use crate::random::Chance;

/// Detection events: what detectors put out. Sorted by channel, then by time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Detections {
    /// Absolute time of time 0, in ticks of the converters since the first scan began; a whole
    /// number of their clock periods.
    pub epoch: i64,
    /// Time since the epoch, in [`PARTS_OF_TICK`](crate::design::PARTS_OF_TICK).
    pub time: Vec<u32>,
    /// Channel of the detector; empty where the sensor has a single one.
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
    work: Work,
}

/// The kind of output of a detector, with the model that makes it.
#[derive(Debug)]
enum Work {
    /// Detection events.
    Events(Box<dyn Kind>),
    /// Samples.
    Samples(Box<Sampler>),
    /// A record of each shot.
    ByShot(Box<dyn ShotRecorder>),
}

/// A detector at work whose record of a shot is made of the light of that shot alone.
trait ShotRecorder: fmt::Debug + Send + Sync {
    /// The record of the owned shots of `log`, in their order.
    fn record(&self, chance: &Chance, log: &ShotLog, light: &Light) -> Given;
}

/// A kind of detector at work.
trait Kind: fmt::Debug + Send + Sync {
    /// Adds the events of a channel to those found, in the order of time.
    fn add(&self, channel: &Channel, chance: &Chance, found: &mut Detections, memory: &mut Memory);

    /// Returns the macropulses of `light` in the `order` in which they begin to arrive, as [`Channel::order`]
    /// has it. `None` unless every mark of them is certain to make one event in its tick, and nothing else
    /// does.
    fn marks(&self, _order: &[u64], _light: &Light) -> Option<(&ExactWords, Vec<Macropulse>)> {
        None
    }

    /// Returns true if it measures the energy of each pulse.
    fn measures(&self) -> bool {
        false
    }
}

impl<'a> Detectors<'a> {
    /// Returns true if its events have amplitudes.
    pub fn measure(&self) -> bool {
        matches!(&self.work, Work::Events(kind) if kind.measures())
    }

    /// The detectors of `design` where it is `operating`, with the random numbers of `chance`.
    pub fn new(design: &'a Design, operating: &Operating, chance: Chance) -> Self {
        let sunlight = operating.background;
        let by_shot = |recorder| Self { design, chance, shape: None, work: Work::ByShot(recorder) };
        let kind: Box<dyn Kind> = match &design.detector {
            Detector::PhotonCounting(counting) => Box::new(Counting::new(counting, design)),
            Detector::Geiger(geiger) => {
                if let (Some(burst), Some(histogram)) =
                    (design.emission.burst(), design.readout.histogram())
                {
                    let cells = Accumulator::new(geiger, (burst, histogram), design);
                    return by_shot(Box::new(cells));
                }
                Box::new(Cells::new(geiger))
            }
            Detector::Linear(linear) => {
                let setting = linear.setting(sunlight);
                match setting.comparator {
                    Some(comparator) => Box::new(Waveform::new(setting, comparator, design)),
                    None => Box::new(Thresholding::new(setting, design)),
                }
            }
            Detector::LockIn(lock_in) => {
                return by_shot(Box::new(Demodulator::new(lock_in, design)));
            }
            Detector::Coherent(coherent) => {
                return by_shot(Box::new(Mixer::new(coherent, design, sunlight)));
            }
            Detector::SingleStop(firing) => Box::new(firing.setting(sunlight)),
            Detector::Sampled(sampled) => {
                let sampler = Box::new(Sampler::new(sampled, design, sunlight));
                return Self { design, chance, shape: None, work: Work::Samples(sampler) };
            }
        };
        Self { design, chance, shape: Shape::of(design), work: Work::Events(kind) }
    }

    /// Returns the response to `light` while the sensor listens to the shots of `log`. It is marks alone if
    /// no detection event is anything else, as of a detector that never misses.
    pub fn response(&self, log: &ShotLog, light: &Light, memory: &mut Memory) -> Response<'_> {
        if let Some(first) = log.fired_at_fs.first()
            && self.shape.is_none()
            && light.responses.is_empty()
            && self.design.channels() == 1
            && let Work::Events(kind) = &self.work
        {
            let clock = Clock::new(self.design, *first);
            memory.arrangement.fill(self.design, &clock, log, light);
            if let Some((words, macropulses)) = kind.marks(memory.arrangement.order(), light) {
                let ticks = std::mem::take(&mut memory.times);
                return Response::Marks(Marks { epoch: clock.epoch, words, macropulses, ticks });
            }
        }
        Response::Events(self.detections(log, light, memory))
    }

    /// The samples that converters take of `light` in `span`, absolute ticks, while the shots of `log` are
    /// fired; `None` of detectors that are not sampled.
    pub fn samples(&self, log: &ShotLog, light: &Light, span: &Range<i64>) -> Option<Samples> {
        match &self.work {
            Work::Samples(sampler) => {
                let light = &light.with_responses(log);
                Some(sampler.samples((self.design, &self.chance), (log, light), span))
            }
            _ => None,
        }
    }

    /// The record of the owned shots of `log`, of a detector that makes one of each shot: histograms, taps or
    /// beats. `None` of others.
    pub fn record_by_shot(&self, log: &ShotLog, light: &Light) -> Option<Given> {
        match &self.work {
            Work::ByShot(recorder) => Some(recorder.record(&self.chance, log, light)),
            _ => None,
        }
    }

    /// The events that `light` makes while the sensor listens to the shots of `log`; none of detectors that
    /// are sampled.
    pub fn detections(&self, log: &ShotLog, light: &Light, memory: &mut Memory) -> Detections {
        let (Some(first), Work::Events(kind)) = (log.fired_at_fs.first(), &self.work) else {
            return Detections::default();
        };
        let clock = Clock::new(self.design, *first);
        let light = light.with_responses(log);
        let light = match &self.shape {
            Some(shape) => Cow::Owned(shape.spread(&light)),
            None => light,
        };
        let mut found = Detections {
            epoch: clock.epoch,
            time: std::mem::take(&mut memory.times),
            ..Detections::default()
        };
        found.time.clear();
        let mut arrangement = std::mem::take(&mut memory.arrangement);
        arrangement.fill(self.design, &clock, log, &light);
        let several = self.design.channels() > 1;
        for channel in arrangement.channels(self.design, clock, log, &light) {
            let from = found.time.len();
            kind.add(&channel, &self.chance, &mut found, memory);
            if several {
                found.channel.resize(found.time.len(), channel.number);
                channel.keep_what_is_listened_to(&mut found, from);
            }
        }
        memory.arrangement = arrangement;
        found
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
    arrangement: Arrangement,
    times: Vec<u32>,
    noise: Vec<u32>,
    merged: Vec<u32>,
    earlier: Vec<u32>,
    later: Vec<u32>,
    arrivals: Vec<i64>,
    numbers: Vec<[u32; GROUP]>,
}

impl Memory {
    /// Takes back the times of events, or the ticks that were made of them, for the next band.
    pub fn take_back(&mut self, times: Vec<u32>) {
        self.times = times;
    }
}

/// Pulse trains of the sensor itself, each with the number of its shot, in the order of shots.
fn own_by_shot(light: &Light) -> Vec<(u64, usize)> {
    let trains = &light.trains;
    let own = (0..trains.len()).filter(|train| trains.transmitter[*train] == 0);
    let mut own: Vec<_> = own.map(|train| (trains.shot[train], train)).collect();
    own.sort_unstable();
    own
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::{Background, PulseTrain, Response, Transmitter, Varies};
    use crate::units::{FS_PER_S, s_from_fs};

    /// The physical sensor by night with another detector.
    fn night(detector: &str) -> Design {
        let text = format!(
            "version = 1\nextends = \"kim-park-2016-physical\"\nname = \"mine\"\n\
             idealised = [\"detector-bandwidth\", \"inter-chip\", \"mirror-motion\"]\n\
             {detector}\njitter_ps = 0.0\n"
        );
        Design::from_toml(&text, "mine", std::path::Path::new(""), &[]).unwrap()
    }

    const COUNTING: &str = "[detector.photon-counting]\nefficiency = 1.0";
    const CELLS: &str = "[detector.geiger]\nefficiency = 1.0\ncells = 100";
    const LINEAR: &str = "[comparator]\nfalse_alarm_hz = 1.0\n[detector.photodiode]\nefficiency = 1.0\n\
                          bandwidth_mhz = 7e4\namplifier_pa_rthz = 1.0";

    /// Control: marks with a hundred-thousandth of a photon are seen by none.
    #[test]
    fn every_detector_of_a_coded_lidar_sees_the_marks_of_interferers() {
        for detector in [COUNTING, CELLS, LINEAR] {
            let design = night(detector);
            let log = crate::emit::Band { scan: 0, first: 0, shots: 100 }.shot_log(&design);
            let transmitters = vec![Transmitter::of(&design, 1.0), Transmitter::of(&design, 1.001)];
            let light = |photons: f64| {
                let mut light = Light { transmitters: transmitters.clone(), ..Light::default() };
                light.trains.push(PulseTrain {
                    transmitter: 1,
                    channel: 0,
                    arrives_fs: log.fired_at_fs[50],
                    photons,
                    label: 77,
                    word: 5,
                    marks: crate::channel::ALL_MARKS,
                    shot: 7,
                    way: 1,
                });
                light
            };
            let events = |photons: f64| {
                let detectors = Detectors::in_the_dark(&design, Chance::new(1));
                let light = light(photons);
                let mut time = detectors.detections(&log, &light, &mut Memory::default()).time;
                // Photons of one mark come together.
                time.dedup();
                time.len()
            };
            let marks = light(1.0).marks(0).len();
            assert!(marks > 50);
            assert_eq!((events(1e9), events(1e-5)), (marks, 0), "{detector}");
        }
    }

    /// H0: light that lasts for a stretch of time makes the number of counts that its rate says, there and
    /// nowhere else. Mean 4000, seed 9, α = 1e-6 (|z| < 4.9). Control: 10 % more are noticed.
    #[test]
    fn background_of_a_stretch_of_time_is_seen_in_it() {
        for detector in [COUNTING, CELLS] {
            let design = night(detector);
            let log = crate::emit::Band { scan: 0, first: 0, shots: 848 }.shot_log(&design);
            let (from_fs, until_fs) = (5_000_000_000, 15_000_000_000);
            let background = Background {
                channel: vec![0, 0],
                from_fs: vec![from_fs; 2],
                until_fs: vec![until_fs; 2],
                per_s: vec![3e8, 1e8],
                varies: vec![Varies::Not; 2],
                address: vec![0, 1],
                ..Background::default()
            };
            let light = Light { background, ..Light::default() };
            let detectors = Detectors::in_the_dark(&design, Chance::new(9));
            let found = detectors.detections(&log, &light, &mut Memory::default());
            let part = design.clock.tick_fs as f64 / f64::from(crate::design::PARTS_OF_TICK);
            let epoch_fs = found.epoch * design.clock.tick_fs;
            for time in &found.time {
                let fs = epoch_fs + (f64::from(*time) * part) as i64;
                assert!((from_fs - FS_PER_S / 1_000_000_000_000..=until_fs).contains(&fs));
            }
            let z = |mean: f64| (found.time.len() as f64 - mean) / mean.sqrt();
            let mean = 4e8 * s_from_fs(until_fs - from_fs);
            assert!(z(mean).abs() < 4.9, "{detector}: {} events", found.time.len());
            assert!(z(1.1 * mean).abs() > 4.9);
        }
    }

    /// H0: a photon counter counts what the responses of 848 coded shots bring. Mean 12 000 or more, seed 4,
    /// α = 1e-6 (|z| < 4.9). Control: 10 % more are noticed.
    #[test]
    fn a_counter_counts_what_its_shots_bring() {
        let design = night("[detector.photon-counting]\nefficiency = 0.5");
        let log = crate::emit::Band { scan: 0, first: 0, shots: 848 }.shot_log(&design);
        let each = [0.2, 0.1, 0.05, 0.0, 0.02];
        let response = Response { step_fs: 1_000_000, photons: each.to_vec() };
        let light = Light {
            transmitters: vec![Transmitter::of(&design, 1.0)],
            responses: vec![response],
            ..Light::default()
        };
        let marks: usize = (0..log.len())
            .map(|shot| light.transmitters[0].codebook.marks(log.label[shot], log.word[shot]).len())
            .sum();
        let mean = 0.5 * marks as f64 * each.iter().sum::<f64>();
        let detectors = Detectors::in_the_dark(&design, Chance::new(4));
        let found = detectors.detections(&log, &light, &mut Memory::default()).time.len() as f64;
        let z = |mean: f64| (found - mean) / mean.sqrt();
        assert!(mean > 12_000.0 && z(mean).abs() < 4.9, "{found} of {mean}");
        assert!(z(1.1 * mean).abs() > 4.9);
    }
}
