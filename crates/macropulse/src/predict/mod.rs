//! Closed form: what theory says a simulation will measure.

pub mod comparison;
mod balanced;
mod beat;
mod belief;
mod best_lag;
pub mod converters;
mod forecast;
mod histogram;
pub mod interference;
pub mod link;
mod matched;
pub mod multiple_access;
mod own_light;
mod phase;
pub mod ranging;
mod sampled;
mod sidelobes;
pub mod unmodelled;
pub mod verdict;
mod way;

pub use forecast::{Error, Forecast, Forecaster};
pub use own_light::{Blind, OwnLight, stray_room};
pub use sampled::deepest_baseline;
pub use sidelobes::Aside;
