//! The few loops that are worth the widest instructions a processor has. All unsafe code of the
//! library is in this folder.
//!
//! A loop is written once, in plain Rust, and compiled for each [`Level`](macropulse_codec::level::Level);
//! [`on_every_level!`](macropulse_codec::on_every_level) calls the widest version that the processor at hand
//! can run. The plain version is what other processors run and what the tests compare the others with.
//! Compilers turn comparisons into sets of lanes poorly: for these [`wide`] spells out the few operations.
//! Compilers never contract or reassociate floating-point arithmetic of Rust, so that every level gives the
//! same bits.

#![allow(unsafe_code)]
// Lanes of several arrays are walked in step, by their number.
#![allow(clippy::needless_range_loop)]

mod beam;
mod build;
mod delay;
mod link;
mod merge;
mod pack;
mod packet;
#[cfg(test)]
mod packet_tests;
mod philox;
mod ruler;
mod sampled;
mod shapes;
mod single;
mod spacing;
mod train;
mod tree;
mod triangles;
mod waits;
mod whole;
mod wide;
mod words;

pub(crate) use build::Built;
pub(crate) use delay::Amounts;
pub(crate) use link::photons_from;
pub(crate) use merge::{PAD, merge};
pub(crate) use pack::{distinct, keep_below};
pub(crate) use packet::{Lanes, NONE, Packet, Waiting};
pub(crate) use philox::{GROUP, philox};
pub(crate) use ruler::{Ruler, arrivals};
pub(crate) use sampled::{mixed, rounded, smoothed};
pub(crate) use shapes::{CURVED, Form, Frustum, meet, meet_packet, turned};
pub(crate) use spacing::all_apart;
pub(crate) use train::append_train;
pub(crate) use tree::{Bounds, Tree};
pub(crate) use triangles::{Corners, Triangles, cosines, normals};
pub(crate) use waits::{END, Events};
pub(crate) use whole::whole;
pub(crate) use wide::{LANES, fetch};
pub(crate) use words::{Macropulse, Words};
