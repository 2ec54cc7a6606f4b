//! What leaves the sensor: which pixel when, with which code, in which direction.

mod band;
mod pattern;
mod shot_log;

pub use band::{Band, bands};
pub use pattern::{beam_axes, direction};
pub use shot_log::ShotLog;
