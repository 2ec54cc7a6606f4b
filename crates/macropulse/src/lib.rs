//! Macropulse, the workbench for pulse-coded lidar.
//!
//! The modules in the order in which light travels:
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
pub mod predict;
pub mod random;
pub mod units;
