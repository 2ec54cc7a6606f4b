//! The memory that a run takes, estimated before it is spent.
//!
//! The parts that grow are counted: code words, triangles, pixels and, for the band on each thread, its
//! shots, its ticks and their events. Factors stand for the bytes that each of them takes at once; they are
//! measured. `docs/hardening.md` has the estimates beside the memory that runs have taken.

use crate::channel::{Error, Operating};
use crate::design::{Design, Effect, Readout};
use crate::emit::bands;
use crate::environment::Environment;
use crate::scene::{PER_TRIANGLE, Scene};
use crate::units::s_from_fs;

/// The program itself, its threads and what they hold ready, bytes. The pages of its file are 15 to 21 MB of
/// it: the system decides how many it maps at once.
const PROGRAM: u64 = 24_000_000;

/// Bytes of a shape, or of a copy of a mesh.
const PER_COPY: u64 = 512;

/// Bytes of a mark of the codebook, with the receiver's tables.
const PER_MARK: u64 = 4;

/// Bytes of a pixel of a scan, with its return and the truth.
const PER_PIXEL: u64 = 60;

/// Bytes of the same pixel while it is written: as one list, and in the form of a page or format.
const PER_WRITTEN: u64 = 130;

/// Bytes of a shot of a band: log, hits, pulse trains.
const PER_SHOT: f64 = 400.0;

/// Bytes of the same shot if the mirror moves during a macropulse, and the hits of its parts are kept.
const PER_MOVING_SHOT: f64 = 6_000.0;

/// Bytes of a mark that is detected: its time, and its tick.
const PER_MARK_SEEN: f64 = 20.0;

/// Bytes of a detection event without light of lidars: its time, before and after it is merged with others,
/// and its tick.
const PER_NOISE: f64 = 40.0;

/// Bytes of a sample of a channel: its code, and the same once more while it is written.
const PER_SAMPLE: f64 = 4.0;

/// Bytes of a sample of the one channel that is simulated or decoded: its signal and noise, the filtered
/// signal, what hides it, and its weight.
const PER_SAMPLE_AT_WORK: f64 = 40.0;

/// The memory of a run, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Estimate {
    /// The program and the sensor: above all its codebook.
    pub sensor: u64,
    /// The surfaces of the scene.
    pub scene: u64,
    /// The points of a scan.
    pub scan: u64,
    /// Their form while they are written.
    pub written: u64,
    /// The bands under way, one on each thread: what one takes.
    pub band: u64,
}

impl Estimate {
    /// The memory of scans of `design` where the light is that of `environment`; without a scene.
    ///
    /// # Errors
    /// As [`Operating::of`].
    pub fn of(design: &Design, environment: &Environment) -> Result<Self, Error> {
        let operating = Operating::of(design, environment)?;
        let codebook = &design.emission.coding().codebook;
        let in_words: usize = codebook.weights().map(|(_, most)| most).sum();
        let marks = in_words as u64 * codebook.words() as u64;
        // Few shots meet a second surface, and hardly any a third one.
        let second = u64::from(design.receiver.returns > 1);
        let returns = design.shots_per_scan() * (2 + second) / 2;
        Ok(Self {
            sensor: PROGRAM + PER_MARK * marks,
            scene: 0,
            scan: returns * PER_PIXEL,
            written: returns * PER_WRITTEN,
            band: band(design, &operating),
        })
    }

    /// The same in `scene`.
    ///
    /// # Errors
    /// As [`Operating::in_scene`].
    pub fn in_scene(design: &Design, scene: &Scene) -> Result<Self, Error> {
        Operating::in_scene(design, scene)?;
        Ok(Self { scene: of_scene(scene), ..Self::of(design, &scene.environment)? })
    }

    /// The same of a run that writes nothing.
    pub fn unwritten(self) -> Self {
        Self { written: 0, ..self }
    }

    /// The sum of all parts, with this number of `threads`.
    pub fn total(&self, threads: usize) -> u64 {
        let bands = self.band.saturating_mul(threads as u64);
        let parts = [self.sensor, self.scene, self.scan, self.written, bands];
        parts.into_iter().fold(0, u64::saturating_add)
    }
}

/// The memory of the surfaces of a scene, bytes.
pub fn of_scene(scene: &Scene) -> u64 {
    let (triangles, copies) = scene.kept();
    PER_TRIANGLE * triangles as u64 + PER_COPY * copies as u64
}

/// The memory that a band takes while it is computed.
fn band(design: &Design, operating: &Operating) -> u64 {
    // Not in the first scan: that has no shots before it.
    let Some(band) = bands(design, 1).next() else { return 0 };
    let cut = design.cut();
    let (seen, _) = band.ticks(design);
    let tick = s_from_fs(design.clock.tick_fs);
    let before = s_from_fs((cut.history_fs - cut.lead_fs).max(0));
    let lasts = (seen.end - seen.start) as f64 * tick + before;
    let shots = (lasts / design.derived().pixel_period).max(band.shots as f64);
    let per_shot = match design.idealised.contains(&Effect::MirrorMotion) {
        true => PER_SHOT,
        false => PER_MOVING_SHOT,
    };
    let marks = shots * design.emission.mean_pulses();
    // A slot of the converters' time is lit or not: noise beyond that is not kept.
    let channels = f64::from(design.channels());
    let noise = (operating.false_rate * lasts).min(lasts / tick) * channels;
    let events = marks * PER_MARK_SEEN + noise * PER_NOISE;
    let recorded = match design.readout.model().bytes_of_part() {
        Some(bytes) => {
            let parts = f64::from(design.emission.model().recorded_parts());
            band.shots as f64 * parts * bytes
        }
        None if matches!(design.readout, Readout::Adc) => {
            events + lasts / tick * (channels * PER_SAMPLE + PER_SAMPLE_AT_WORK)
        }
        None => events,
    };
    (shots * per_shot + recorded) as u64
}
