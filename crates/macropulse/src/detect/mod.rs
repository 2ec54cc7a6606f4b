//! Light to edges: the detectors.
//!
//! Edges carry no trace of their cause: whether a mark, a dark count or another lidar made them
//! cannot be told from here on.

mod first_firing;
mod photon_counting;

pub use first_firing::photons_for;

use crate::channel::Echoes;
use crate::design::{Design, Detector};
use crate::emit::ShotLog;
use crate::random::Chance;

/// What detectors put out: edges in time. Sorted by channel, then by time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Edges {
    /// Absolute time, fs.
    pub time_fs: Vec<i64>,
    /// Detector that fired; empty where the sensor has a single one.
    pub channel: Vec<u16>,
    /// Measured pulse energy in detected photons; empty where the detector gives times only.
    pub amplitude: Vec<f32>,
}

/// The edges that the `echoes` of the shots in `log` make in the sensor's detectors.
pub fn edges(design: &Design, log: &ShotLog, echoes: &Echoes, chance: &Chance) -> Edges {
    match design.detector {
        Detector::PhotonCounting(counting) => {
            photon_counting::edges(&counting, design, log, echoes, chance)
        }
        Detector::FirstFiring(firing) => first_firing::edges(&firing, design, log, echoes, chance),
    }
}
