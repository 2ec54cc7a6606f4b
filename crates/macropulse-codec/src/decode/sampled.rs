//! The receiver of samples.

use super::{Receiver, Returns};
use crate::code::Codebook;
use crate::{Samples, ShotLog};

/// Steps of a tick in which [`Sampling::pulse`] is given.
pub const STEPS_OF_TICK: usize = 16;

/// What a receiver knows of the signal that is sampled.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampling {
    /// What a mark of one detected photon adds to the codes, in steps of 1/[`STEPS_OF_TICK`] tick; the
    /// entry in the middle, of an odd number, is at the time of the mark.
    pub pulse: Vec<f32>,
    /// Excess noise factor F of the multiplication: n photons vary by F·n.
    pub excess: f64,
    /// The highest code: a sample that has it is clipped.
    pub full_scale: i16,
    /// For how many ticks from a mark of its own that is fired on the channel is blind with stray light.
    pub blank_ticks: u32,
    /// For how many ticks behind a clipped sample the signal is not that of the light.
    pub recovery_ticks: u32,
    /// Marks of a word that must be neither blanked nor clipped otherwise, to decide by them.
    pub least_marks: u16,
}

/// The returns of the owned shots of `log`, of what was checked.
pub(super) fn decode(
    _receiver: &Receiver,
    _codebook: &Codebook,
    (_log, _samples): (&ShotLog, &Samples),
) -> Returns {
    Returns::default()
}
