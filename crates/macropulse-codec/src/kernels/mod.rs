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

mod balance;
mod ballot;
mod correlate;
pub mod level;
mod marks;
mod pattern;
mod runs;

pub(crate) use balance::{Balance, Chips, best_balance};
pub(crate) use ballot::{BALLOT, elect, highest_sum, vote};
pub(crate) use correlate::{BLOCK_WORDS, Block, Marks, PLANES, count_marks, with_marks};
pub(crate) use marks::{WordTicks, begin_with};
pub(crate) use pattern::{Pattern, lit_in, look_ahead, put_out};
pub(crate) use runs::lowest_and_highest_run;
