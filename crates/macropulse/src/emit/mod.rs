//! The light that leaves the sensor: its pixel, time, code and direction.

mod band;
mod clock;
mod times;
mod shot;

pub use band::{Band, bands, logs, short_bands, shots_of_scan};
pub use clock::Clock;
pub use shot::{Shot, most_scans, shot_at, shot_of_pixel};
pub use times::{beam_axes, scan_begins_fs};
