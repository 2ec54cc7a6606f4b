//! Macropulse, the workbench for pulse-coded lidar: design a code, fire it into a 3-D scene,
//! detect it, decode it, get a point cloud.
//!
//! The modules in the order in which light travels:

#![cfg_attr(test, allow(missing_docs))]

pub mod design;
pub mod code;
pub mod emit;
pub mod scene;
pub mod channel;
pub mod detect;
pub mod tdc;
pub mod decode;
pub mod points;
pub mod score;
pub mod formats;
pub mod view;

pub mod sim;
pub mod record;
pub mod paper;

pub mod predict;
pub mod random;
pub mod units;
pub mod names;
mod digest;
