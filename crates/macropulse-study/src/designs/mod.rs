//! Lidars that meet requirements. Closed forms assess all that could be built of the parts allowed, and the
//! best of them are simulated. A frontier tells up to where waiting for echoes is better than a code.

mod ablation;
mod bill;
mod candidate;
mod closed;
mod files;
mod frontier;
mod in_flight;
mod json;
mod keys;
mod listing;
mod mirrors;
mod page;
mod parts;
mod polygon;
mod requirements;
mod scenery;
mod search;
mod trial;
mod words;

pub use ablation::Ablation;
pub use bill::{Bill, Converter};
pub use candidate::Candidate;
pub use closed::{Assessed, Worst};
pub use files::{PAGE, make_room};
pub use frontier::{CHANNELS, Frontier, Row};
pub use in_flight::InFlight;
pub use mirrors::{Mirror, Side};
pub use parts::Part;
pub use requirements::{Parts, Requirements, Wanted, schema};
pub use scenery::Scenery;
pub use search::{Best, Found, Search, Skipped};
pub use trial::{Counts, Trial};

/// Why no lidar was searched for. Each message is one sentence.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Something was asked for that cannot be.
    #[error("{0}")]
    Asked(String),
    /// A candidate is no sensor.
    #[error(transparent)]
    Design(#[from] macropulse::design::Error),
    /// There is no forecast of a candidate.
    #[error(transparent)]
    Forecast(#[from] macropulse::predict::Error),
    /// A scan could not be made.
    #[error(transparent)]
    Simulation(#[from] macropulse::sim::Error),
    /// A scene could not be made.
    #[error(transparent)]
    Scene(#[from] macropulse::scene::Error),
    /// A file could not be written or read.
    #[error(transparent)]
    Formats(#[from] macropulse::formats::Error),
    /// A picture could not be drawn.
    #[error(transparent)]
    View(#[from] crate::view::Error),
}

/// Reason why a candidate does not meet the requirements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// It would have to wait longer for an echo than it has.
    Time,
    /// Its marks are smeared on a surface aslant.
    Slant,
    /// Eyes allow too little light for the largest aperture.
    Light,
    /// Its polygon would be too large, or the corners too fast.
    Mirror,
    /// Simulated, it misses too many targets.
    Missed,
    /// It is forecast to miss too many targets at the worst range up to the one wanted, where own light hides marks.
    Worst,
    /// Simulated, it finds too much where nothing is.
    False,
    /// Simulated, too many of its points are somewhere else.
    Wrong,
    /// Simulated, its ranges spread too far.
    Precision,
}
