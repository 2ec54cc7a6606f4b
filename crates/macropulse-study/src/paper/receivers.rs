//! The three receivers side by side, with and without missed marks.

use super::Error;
use macropulse::codec::decode::ReceiverKind;
use macropulse::design::Design;
use macropulse::emit::{Band, short_bands};
use macropulse::points::Outcome;
use macropulse::scene::Scene;
use macropulse::score::Score;
use macropulse::sim::{self, Watch};

/// The receivers compared.
pub(super) const RECEIVERS: [ReceiverKind; 3] =
    [ReceiverKind::Literal, ReceiverKind::Blind, ReceiverKind::Matched];

/// Detectors under which they are compared: a name, and the keys that make it.
const DETECTORS: [(&str, &[(&str, &str)]); 3] = [
    ("perfect detector", PERFECT),
    (
        "20 % of the marks missed",
        &[
            PERFECT[0],
            PERFECT[1],
            PERFECT[2],
            PERFECT[3],
            ("detector.photon-counting.missed_marks", "0.2"),
        ],
    ),
    ("detector as declared", &[]),
];

/// The keys of a detector that sees every mark of every echo, and nothing else. It would see the
/// ground as far as the horizon as well as anything near, so no light from beyond the gate of
/// 150 m is followed.
pub const PERFECT: &[(&str, &str)] = &[
    ("detector.photon-counting.sensitivity.pd", "1.0"),
    ("detector.photon-counting.dark_counts_hz", "0.0"),
    ("detector.photon-counting.jitter_ps", "0.0"),
    ("scan.light_range_m", "150.0"),
];

/// Rows compared: those from the horizon down, with the car and the road.
const ROWS: std::ops::Range<u64> = 252..324;

/// One receiver under one condition.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// The sensor.
    pub sensor: &'static str,
    /// The detector, named by its losses.
    pub detector: &'static str,
    /// The receiver.
    pub receiver: &'static str,
    /// How the pixels came out.
    pub score: Score,
}

impl Comparison {
    /// Share of the pixels with an echo that came out as `outcome`; of missed ones those that
    /// had any light.
    pub fn share(&self, outcome: Outcome) -> f64 {
        let count = self.score.count(outcome);
        let count = if outcome == Outcome::Missed { count - self.score.dark } else { count };
        count as f64 / self.score.with_echo() as f64
    }
}

const COMPARED: [&str; 2] = ["kim-park-2016", "kim-park-2016-fixed"];

fn part(design: &Design) -> Vec<Band> {
    let row = |band: &Band| band.first / u64::from(design.scan.columns);
    short_bands(design, 0).filter(|band| ROWS.contains(&row(band))).collect()
}

/// Shots of the whole comparison.
pub(super) fn shots() -> Result<u64, Error> {
    let runs = (DETECTORS.len() * RECEIVERS.len()) as u64;
    let mut shots = 0;
    for sensor in COMPARED {
        let design = Design::open(sensor, &[])?;
        shots += runs * part(&design).iter().map(|band| band.shots).sum::<u64>();
    }
    Ok(shots)
}

/// All receivers under all conditions, on the road and the car at 50 m.
pub(super) fn compare(seed: u64, watch: &Watch) -> Result<Vec<Comparison>, Error> {
    let scene = Scene::open("car-50m")?;
    let mut rows = Vec::new();
    for sensor in COMPARED {
        for (detector, keys) in DETECTORS {
            for receiver in RECEIVERS.map(ReceiverKind::name) {
                if (watch.stop)() {
                    return Err(Error::Stopped);
                }
                let set: Vec<(String, String)> = keys
                    .iter()
                    .chain(&[("receiver.kind", receiver)])
                    .map(|(key, value)| ((*key).to_owned(), (*value).to_owned()))
                    .collect();
                let design = Design::open(sensor, &set)?;
                let part = part(&design);
                let score = sim::scan_part(&design, &scene, seed, &part)?.score;
                (watch.done)(part.iter().map(|band| band.shots).sum());
                rows.push(Comparison { sensor, detector, receiver, score });
            }
        }
    }
    Ok(rows)
}
