//! What leaves the sensor.

mod shot_log;

pub use shot_log::ShotLog;
