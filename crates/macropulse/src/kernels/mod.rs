//! The few loops that are worth the widest instructions a processor has. All unsafe code of the
//! library is in this folder.
//!
//! A loop is written once, in plain Rust, and compiled for each [`Level`]; [`on_every_level!`]
//! calls the widest version that the processor at hand can run. The plain version is what other
//! processors run and what the tests compare the others with. Where comparisons are to become sets
//! of lanes, which compilers do poorly, [`wide`] spells out the few operations. Compilers never contract or
//! reassociate floating-point arithmetic of Rust, so that every level gives the same bits.

#![allow(unsafe_code)]
// Lanes of several arrays are walked in step, by their number.
#![allow(clippy::needless_range_loop)]

mod level;
mod marks;
mod packet;
#[cfg(test)]
mod packet_tests;
mod shapes;
mod tree;
mod triangles;
mod wide;

pub(crate) use marks::matching;
pub(crate) use packet::{Lanes, NONE, Packet, Waiting};
pub(crate) use shapes::{Form, meet, meet_packet, turned};
pub(crate) use tree::Tree;
pub(crate) use triangles::{Corners, Triangles, cosines, normals};
pub(crate) use wide::LANES;
