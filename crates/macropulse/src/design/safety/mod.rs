//! Eye safety: our reading of IEC 60825-1:2014, class 1 \[IEC60825\]. Not a certification. Every assumption is a parameter, or printed by [`ASSUMED`].
//!
//! It has three steps:
//!
//! 1. The [`Class1`] limits at a wavelength.
//! 2. The times and energies of the shots of one scan that cross the eye where most light does
//!    ([`Exposure`]).
//! 3. The energy that the limits leave to a shot ([`limits`]).

mod beams;
mod class1;
mod crossing;
mod energies;
mod exposure;
mod scattered;
mod share;
mod worst;

pub(crate) use beams::{Line, Lines};
pub use class1::{Class1, Condition, TELESCOPE};
pub(crate) use crossing::Beams;
pub(super) use crossing::{Sender, exposure};
pub use exposure::{
    Crossing, Crossings, Exposure, Limit, Rule, limits, strictest, strictest_of_each,
};

/// The assumptions of the limits, for people to read.
pub const ASSUMED: &str = "IEC 60825-1:2014 class 1, a point source unless safety.extended_source, through the aperture at \
    safety.distance_mm (condition 3), or 2 m away through 50 mm or, above 1400 nm, seven times the \
    aperture (condition 1), where most light crosses it; every shot as bright as the brightest word of \
    its label; groups of shots within T_i counted as repeated exposures if safety.count_lines; a \
    scan that stops is taken to switch the laser off. Our reading, not a certification";

#[cfg(test)]
mod brute;
#[cfg(test)]
mod tests;
