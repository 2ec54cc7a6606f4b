//! Scores against what is varied: many small scans, their counts, and a table with intervals.
//!
//! 1. `axis`: a key and its values, as typed; `plan`: every combination of values is a [`Point`],
//!    checked before anything is computed.
//! 2. `job`: one point with one seed. Its counts are one small file named by a hash of all that
//!    decides them, so that jobs can be done in any order, by any machine, and never twice.
//! 3. `metric`: the scores that the counts allow, each with an interval ([`macropulse::score::Estimate`]).
//! 4. `table`, `picture`: what is left when every job is done; `json` tells it to programs.

mod axis;
mod job;
mod json;
mod metric;
mod picture;
mod plan;
mod shard;
mod table;

pub use axis::{Axis, Spread};
pub use job::{Counted, Job};
pub use metric::Metric;
pub use plan::{Plan, Point, Request};
pub use shard::Shard;
pub use table::{FILES, Row, Table};

/// Why a sweep was not made. Each message is one sentence.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Something was asked for that cannot be.
    #[error("{0}")]
    Asked(String),
    /// The sensor is wrong.
    #[error(transparent)]
    Design(#[from] macropulse::design::Error),
    /// The scene is wrong.
    #[error(transparent)]
    Scene(#[from] macropulse::scene::Error),
    /// The sensor cannot be simulated in the environment of the scene.
    #[error(transparent)]
    Operating(#[from] macropulse::channel::Error),
    /// A scan could not be made.
    #[error(transparent)]
    Simulation(#[from] macropulse::sim::Error),
    /// A file could not be written or read.
    #[error(transparent)]
    Formats(#[from] macropulse::formats::Error),
    /// The picture could not be drawn.
    #[error(transparent)]
    View(#[from] crate::view::Error),
}

impl Error {
    fn asked<T>(message: impl Into<String>) -> Result<T, Self> {
        Err(Self::Asked(message.into()))
    }
}
