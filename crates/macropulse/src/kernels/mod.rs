//! The few loops that are worth the widest instructions a processor has. All unsafe code of the
//! library is in this folder.
//!
//! A loop is written once, in plain Rust, and compiled for each [`Level`]; [`on_every_level!`]
//! calls the widest version that the processor at hand can run. The plain version is what other
//! processors run and what the tests compare the others with. Compilers never contract or
//! reassociate floating-point arithmetic of Rust, so that every level gives the same bits.

#![allow(unsafe_code)]

mod correlate;
mod delay;
mod level;
mod marks;
mod merge;
mod pack;
mod philox;
mod spacing;
mod train;
mod waits;
mod whole;

pub(crate) use correlate::{LANES, Lanes, PLANES, count_marks, with_marks};
pub(crate) use delay::{delay, drawn};
pub(crate) use marks::{WordTicks, begin_with};
pub(crate) use merge::{PAD, merge};
pub(crate) use pack::{distinct, keep_below};
pub(crate) use philox::{GROUP, philox};
pub(crate) use spacing::all_apart;
pub(crate) use train::{STEP, Train, append_train};
pub(crate) use waits::{END, Events};
pub(crate) use whole::whole;
