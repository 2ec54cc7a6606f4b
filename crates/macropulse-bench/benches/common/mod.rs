//! What several benchmarks need: bands of a scan with what they meet, detectors of a given
//! quality, and the time of one thread.
// Every benchmark is a program of its own, and uses only a part of this.
#![allow(dead_code)]

use std::time::{SystemTime, UNIX_EPOCH};

use macropulse::channel::{self, Operating, light_of_echoes};
use macropulse::codec::ShotLog;
use macropulse::codec::Ticks;
use macropulse::design::Design;
use macropulse::detect::{Detectors, Memory};
use macropulse::emit::{Band, bands};
use macropulse::environment::Environment;
use macropulse::random::{Chance, Stage};
use macropulse::scene::{Hits, Material, Scene};
use macropulse::tdc;
use rand::RngExt;

/// Seed of all that is drawn.
pub const SEED: u64 = 20_160_913;

/// Fractions of the marks that are missed.
const MISSED: [f64; 4] = [0.0, 0.05, 0.2, 0.4];

/// Dark and background counts per second.
const FALSE: [f64; 4] = [0.0, 1e8, 1e9, 1e10];

/// Name and keys of each condition: the detector as declared, and without jitter all that miss so
/// many marks and add so many dark and background counts.
pub fn conditions() -> impl Iterator<Item = (String, Vec<(String, String)>)> {
    let both = MISSED.into_iter().flat_map(|missed| FALSE.map(|rate| (missed, rate)));
    let all = both.map(|(missed, rate)| {
        (format!("{:.0} % missed, {rate:.0e}/s", 100.0 * missed), detector(missed, rate))
    });
    std::iter::once(("as declared".to_owned(), Vec::new())).chain(all)
}

/// What bands of a scan meet.
pub struct Met {
    materials: Vec<Material>,
    /// The bands, and what their shots met.
    pub bands: Vec<(Band, Hits)>,
}

impl Met {
    fn by(
        design: &Design,
        bands: &[Band],
        materials: Vec<Material>,
        hits: impl Fn(&ShotLog) -> Hits,
    ) -> Self {
        let bands = bands.iter().map(|band| (*band, hits(&band.shot_log(design)))).collect();
        Self { materials, bands }
    }

    /// What `bands` meet in the ready scene `name`; `None` if there is no such scene.
    pub fn in_scene(design: &Design, bands: &[Band], name: &str) -> Option<Self> {
        let scene = Scene::open(name).ok()?;
        Some(Self::by(design, bands, scene.materials.clone(), |log| {
            scene.trace(design, log).middle
        }))
    }

    /// One white target for every shot, anywhere in the gate: as much overlap as there can be.
    pub fn anywhere(design: &Design, bands: &[Band]) -> Self {
        Self::by(design, bands, vec![Material::matt("white", 1.0)], |log| {
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
            }
        })
    }

    /// The ticks of one of the bands, and its shots.
    pub fn ticks(
        &self,
        design: &Design,
        (band, hits): &(Band, Hits),
        (detectors, memory): (&Detectors, &mut Memory),
    ) -> (ShotLog, Ticks) {
        let log = band.shot_log(design);
        let mut light = light_of_echoes(design, &log, []);
        channel::echoes(&mut light.trains, (&operating(design).link, &self.materials), &log, hits);
        let converted = tdc::ticks(design, detectors.detections(&log, &light, memory), 0);
        (log, converted.ticks)
    }
}

/// A sensor where there is neither air nor sunlight.
#[allow(clippy::unwrap_used)]
fn operating(design: &Design) -> Operating {
    Operating::of(design, &Environment::vacuum_dark()).unwrap()
}

/// Its detectors.
pub fn detectors(design: &Design) -> Detectors<'_> {
    Detectors::new(design, &operating(design), Chance::new(SEED))
}

/// `count` bands spread evenly over a scan, or all of them. It is the second scan: its first band
/// has guard shots before it.
pub fn spread(design: &Design, count: usize) -> Vec<Band> {
    let all: Vec<Band> = bands(design, 1).collect();
    let count = count.min(all.len());
    (0..count).map(|n| all[n * all.len() / count]).collect()
}

/// The keys that make the detector of `kim-park-2016` see marks without jitter, but for a fraction
/// `missed` of them, and dark and background counts at `rate` per second.
pub fn detector(missed: f64, rate: f64) -> Vec<(String, String)> {
    let set = [
        ("sensitivity.pd", 1.0),
        ("jitter_ps", 0.0),
        ("missed_marks", missed),
        ("dark_counts_hz", rate),
    ];
    let key = |(key, value)| (format!("detector.photon-counting.{key}"), format!("{value:?}"));
    set.map(key).to_vec()
}

/// Time for which this thread was on a processor, s; on other systems than Linux, any time.
pub fn clock() -> f64 {
    // The counter is brought up to date when the thread is put aside.
    std::thread::yield_now();
    let spent = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let spent = spent.and_then(|text| text.split(' ').next()?.parse::<u64>().ok());
    let since = || SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64());
    spent.map_or_else(since, |ns| ns as f64 * 1e-9)
}
