//! Edges to ticks.

/// What the time-to-digital converters hand to the decoder: integers. Sorted by channel, then by
/// tick, no tick twice in a channel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ticks {
    /// Absolute time of tick 0, in ticks since the first scan began.
    pub epoch: i64,
    /// Ticks since the epoch.
    pub tick: Vec<u32>,
    /// Detector; empty where the sensor has a single one.
    pub channel: Vec<u16>,
    /// Measured pulse energy in detected photons; empty where not measured.
    pub amplitude: Vec<f32>,
    /// Most converters busy at once.
    pub peak_busy: u32,
    /// Edges that found every converter busy.
    pub lost: u64,
    /// Edges that fell into the tick of another one.
    pub merged: u64,
}
