//! What the beam meets.

mod hits;

pub use hits::{CastRays, Hit, Hits, Ray};
