//! Differences between the returns of a quick receiver and a thorough one.

use std::collections::{BTreeMap, BTreeSet};

use macropulse::codec::decode::{Effort, Method, Returns};

use crate::Fallible;
use crate::page::{self, grouped, three};
use crate::sample::{Condition, SCENES, Sample};

/// Interval of the decoded bands, as a thorough receiver takes minutes for a scan in dense noise.
const SOME: usize = 24;

/// All bands. Echoes as faint as sensors declare them are in a few bands only, which a sample may leave out.
const ALL: usize = 1;

/// Number of scans. Shots that are found otherwise come in runs: one scan of `street` as declared has from 23
/// to 44 of them, with five seeds.
const SCANS: u64 = 4;

/// The detectors, and their names: without noise, in some, in faint light, and in dense noise; and which bands
/// are decoded where there are surfaces.
const DETECTORS: [(&str, Condition, usize); 6] = [
    ("clean", Condition::CLEAN, SOME),
    ("20 % missed, 10⁹ counts/s", Condition::Noise { missed: 0.2, counts: 1e9 }, SOME),
    ("40 % missed", Condition::Noise { missed: 0.4, counts: 0.0 }, SOME),
    ("10¹⁰ counts/s", Condition::Noise { missed: 0.0, counts: 1e10 }, SOME),
    ("20 % missed, 10¹⁰ counts/s", Condition::Noise { missed: 0.2, counts: 1e10 }, SOME),
    ("as declared", Condition::Declared, ALL),
];

/// Measurements of all scenes and detectors.
pub struct Efforts(Vec<Row>);

struct Row {
    scene: &'static str,
    detector: &'static str,
    shots: f64,
    /// Shots with different ranges.
    differ: usize,
    /// Seconds that the thorough one takes, and the quick one.
    took: [f64; 2],
}

impl Row {
    /// Adds what both find in a `sample`.
    fn add(&mut self, mut sample: Sample) -> Fallible<()> {
        let given = sample.given();
        let mut decode = |effort| -> Fallible<(Vec<Returns>, f64)> {
            if let Method::Matched(_, set_to) = &mut sample.design.receiver.method {
                *set_to = effort;
            }
            Ok(sample.decode_timed(&given)?)
        };
        let (thorough, long) = decode(Effort::Thorough)?;
        let (quick, short) = decode(Effort::Quick)?;
        let pairs = quick.iter().zip(&thorough);
        let tick = sample.design.receiver.tick_fs as f64 * 1e-15;
        self.differ += pairs.map(|(quick, thorough)| differ(tick, quick, thorough)).sum::<usize>();
        self.shots += sample.shots();
        self.took = [self.took[0] + long, self.took[1] + short];
        Ok(())
    }
}

/// Measures it.
pub fn measure() -> Fallible<Efforts> {
    let mut rows = Vec::new();
    for scene in SCENES {
        for (detector, condition, every) in DETECTORS {
            let every = if has_surfaces(scene) { every } else { SOME };
            let mut row = Row { scene, detector, shots: 0.0, differ: 0, took: [0.0; 2] };
            for scan in 1..=SCANS {
                row.add(Sample::of_scan(condition.design()?, scene, every, scan)?)?;
            }
            rows.push(row);
        }
    }
    Ok(Efforts(rows))
}

/// Returns true if neighbouring shots of a scene see the same surfaces.
fn has_surfaces(scene: &str) -> bool {
    scene != "random"
}

/// How many shots are found otherwise: the number of their ranges differs, or a range by a `tick` or more.
fn differ(tick: f64, one: &Returns, other: &Returns) -> usize {
    let of_shots = |returns: &Returns| {
        let mut ranges: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
        for (shot, tof) in returns.shot.iter().zip(&returns.tof) {
            ranges.entry(*shot).or_default().push(*tof);
        }
        ranges
    };
    let (one, other) = (of_shots(one), of_shots(other));
    let is_near = |(one, other): (&f64, &f64)| (one - other).abs() < tick;
    let is_same = |shot: &&u32| {
        one.get(shot).zip(other.get(shot)).is_some_and(|(one, other)| {
            one.len() == other.len() && one.iter().zip(other).all(is_near)
        })
    };
    let shots: BTreeSet<&u32> = one.keys().chain(other.keys()).collect();
    shots.iter().filter(|shot| !is_same(shot)).count()
}

impl Efforts {
    /// The largest share of the shots that is found otherwise under any detector in a scene with surfaces.
    pub fn most(&self) -> f64 {
        let with_surfaces = self.0.iter().filter(|row| has_surfaces(row.scene));
        with_surfaces.map(|row| row.differ as f64 / row.shots).fold(0.0, f64::max)
    }

    /// The table.
    pub fn text(&self) -> String {
        let row = |row: &Row| {
            vec![
                format!("`{}`, {}", row.scene, row.detector),
                grouped(row.shots),
                grouped(row.differ as f64),
                format!("{} ×", three(row.took[0] / row.took[1])),
            ]
        };
        let head = ["decoding", "shots", "found otherwise", "thorough takes"];
        page::table(&head, &self.0.iter().map(row).collect::<Vec<_>>())
    }
}
