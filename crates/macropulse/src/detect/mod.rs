//! Light to edges.

/// What detectors put out: edges in time, with no trace of their cause. Sorted by channel, then
/// by time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Edges {
    /// Absolute time, fs.
    pub time_fs: Vec<i64>,
    /// Detector that fired; empty where the sensor has a single one.
    pub channel: Vec<u16>,
    /// Measured pulse energy in detected photons; empty where the detector gives times only.
    pub amplitude: Vec<f32>,
}
