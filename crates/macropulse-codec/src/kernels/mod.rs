//! The few loops of the receivers that are worth the widest instructions a processor has. All
//! unsafe code of this crate is in this folder.
//!
//! A loop is written once, in plain Rust, and compiled for each [`level::Level`];
//! [`on_every_level!`](crate::on_every_level) calls the widest version that the processor at hand
//! can run. The plain version is what other processors run and what the tests compare the others
//! with. Compilers never contract or reassociate floating-point arithmetic of Rust, so that every
//! level gives the same bits.

#![allow(unsafe_code)]
// Lanes of several arrays are walked in step, by their number.
#![allow(clippy::needless_range_loop)]

mod ascend;
mod balance;
mod coarse;
mod correlate;
mod fold;
mod lay;
pub mod level;
mod marks;
mod pattern;
#[cfg(target_arch = "x86_64")]
mod registers;
mod waveform;

pub(crate) use ascend::ascends;
pub(crate) use balance::{Balance, Chips, best_balance};
pub(crate) use coarse::{COARSE, coarse, in_pictures};
pub(crate) use correlate::{
    Counts, NARROW, SIXTEEN, WIDE, and, any_behind, is_dark, or, with_enough,
};
pub(crate) use lay::{count_each, dark_before, lay, least_most_and_sum, lit_after, sum_along};
pub(crate) use marks::{WordTicks, begin_with, places_of};
pub(crate) use pattern::{
    Pattern, are_lit, light_up, lit_in, lit_in_all, lit_in_any, lit_in_each, lit_in_row,
    look_ahead, put_out,
};
pub(crate) use waveform::{LAGS, filter, lower, standing_out};
