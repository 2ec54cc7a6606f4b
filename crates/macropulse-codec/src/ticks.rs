//! Ticks: what time-to-digital converters hand to a receiver.

/// The ticks of one stretch of time, as columns. Sorted by channel, then by tick, no tick twice in
/// a channel.
///
/// A tick is the number of a slot of the converters' time, as long as their resolution; it carries
/// no trace of what made it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ticks {
    /// Absolute time of tick 0, in ticks since the first scan began.
    pub epoch: i64,
    /// Ticks since the epoch.
    pub tick: Vec<u32>,
    /// Detector channel; empty where the sensor has a single one.
    pub channel: Vec<u16>,
    /// Measured pulse energy in detected photons; empty where not measured.
    pub amplitude: Vec<f32>,
}
