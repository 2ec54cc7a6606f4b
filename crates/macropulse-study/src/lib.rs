//! Uses of the simulator: the experiment of Kim & Park (2016), sweeps, records of runs, link budgets, and the
//! pictures, charts and pages that show them.

#![cfg_attr(test, allow(missing_docs))]
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod budget;
pub mod codes;
pub mod decoding;
pub mod designs;
pub mod paper;
pub mod record;
pub mod sent;
pub mod sweep;
pub mod text;
pub mod validate;
pub mod view;
