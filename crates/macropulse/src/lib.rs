//! Macropulse, the workbench for pulse-coded lidar: design a code, fire it into a 3-D scene,
//! detect it, decode it, get a point cloud.
//!
//! ```
//! use macropulse::{design::Design, points::Outcome, scene::Scene, sim};
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let fewer = [("scan.raster.rows".to_owned(), "24".to_owned())];
//!     let design = Design::open("kim-park-2016-fixed", &fewer)?;
//!     let scene = Scene::open("street")?;
//!     let scan = sim::scan(&design, &scene, 1, 0)?;
//!     let right = scan.score.count(Outcome::Right);
//!     println!("{} points, {right} of them right", scan.cloud().returns());
//!     assert!(scan.score.right_fraction() > 0.99);
//!     Ok(())
//! }
//! ```
//!
//! The modules in the order in which light travels:

#![cfg_attr(test, allow(missing_docs))]
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod environment;
pub mod design;
pub mod emit;
pub mod scene;
pub mod channel;
pub mod detect;
pub mod tdc;
pub mod points;
pub mod score;
pub mod formats;

/// The language of both ends of the link, and the receivers.
pub use macropulse_codec as codec;

pub mod sim;
pub mod memory;

pub mod predict;
pub mod random;
pub mod units;
pub mod names;
pub mod told;
pub mod opened;
pub mod machine;
pub mod digest;
pub mod processor;
pub mod schema;
mod kernels;
