//! What reaches the aperture.

/// Echoes of a band of shots, as columns, ordered by shot. Truth: the light itself, before any
/// detector.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Echoes {
    /// Index of the shot in the band's log.
    pub shot: Vec<u32>,
    /// Absolute time at which the first chip of the macropulse arrives, fs.
    pub arrival_fs: Vec<i64>,
    /// Mean number of photons detected per mark.
    pub photons: Vec<f32>,
}
