//! The codec of Macropulse: what both ends of a pulse-coded lidar link speak, and the receivers.
//!
//! A transmitter fires **shots**; each sends a **macropulse**, the marks of a code word laid out on chips. A
//! receiver finds the delay of every shot from the **shot log** of what was sent when, and from one record:
//!
//! * the **ticks** at which its converters saw light,
//! * the **samples** of the signal,
//! * **histograms** of photons,
//! * **taps** of amplitude-modulated light,
//! * or **beats** of frequency-modulated light.
//!
//! Nothing here knows a scene, light, a file system or a thread pool.
//!
//! * [`code`]: families of code words, payloads, the marks of every macropulse; counts chips only.
//! * [`ShotLog`], and [`Ticks`], [`Samples`], [`Histograms`], [`Taps`] or [`Beats`]: the input of a receiver,
//!   as columns; [`Cut`]: how they are cut out of a stream.
//! * [`files`]: shot logs and ticks as text and as bytes, the other records as bytes.
//! * [`decode`]: the receivers, from records to returns.
//! * [`statistics`]: the distributions that thresholds and forecasts are derived from.
//! * [`level`]: which instructions the wide loops use; [`steps`]: two of these loops by themselves.

#![cfg_attr(test, allow(missing_docs))]
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod code;
pub mod decode;
pub mod files;
pub mod statistics;
pub mod steps;
pub mod time;

mod beats;
mod cut;
mod histograms;
mod kernels;
mod record;
mod samples;
mod shot_log;
mod taps;
mod ticks;

pub use beats::{Beats, Peak};
pub use cut::Cut;
pub use histograms::Histograms;
pub use kernels::level;
pub use record::{Given, Record, RecordKind};
pub use samples::Samples;
pub use shot_log::ShotLog;
pub use taps::Taps;
pub use ticks::{Tick, Ticks};
