//! The experiment of \[KP16\], from presets to report: every table and figure made again from data,
//! every claim confirmed or refuted.

mod claim;
mod claims;
mod conclusion;
mod experiment;
mod geometry;
mod lidars;
pub mod measured;
mod pictures;
mod receivers;
mod report;
mod side_by_side;
mod side_by_side_page;
mod tables;
mod walls;

use std::path::{Path, PathBuf};

use rayon::prelude::*;

pub use claim::{Claim, Verdict, listing};
pub use claims::{COMPARED_M, NOT_MEASURED, RECOGNISED, judge, judge_on_paper};
pub use experiment::{DISTANCES, SENSORS, Trial};
pub use geometry::{Prediction, predict};
pub use lidars::{AMCW, FMCW, LIDARS, Lidar, PULSED};
pub use measured::{Measured, OnPaper};
pub use receivers::{Comparison, PERFECT};
pub use side_by_side::Side;
pub use walls::Wall;

use macropulse::design::Design;
use macropulse::environment::Environment;
use macropulse::formats::write_atomically;
use macropulse::sim::Watch;

/// Why the experiment could not be run or written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A folder could not be made.
    #[error("cannot make the folder {}: {source}; choose another one with -o", path.display(), source = macropulse::told::unwritable(source))]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// It was asked to stop.
    #[error("stopped before the end")]
    Stopped,
    /// The claims were asked of a sensor that is not built as that of the paper.
    #[error(
        "the claims are judged on a raster with a prime code, and one with a link budget beside it"
    )]
    Sensor,
    /// A ready sensor was refused.
    #[error(transparent)]
    Design(#[from] macropulse::design::Error),
    /// A ready scene was refused.
    #[error(transparent)]
    Scene(#[from] macropulse::scene::Error),
    /// A ready sensor cannot work in a ready environment.
    #[error(transparent)]
    Operating(#[from] macropulse::channel::Error),
    /// There is no forecast of a ready sensor.
    #[error(transparent)]
    Forecast(#[from] macropulse::predict::Error),
    /// A scan could not be made.
    #[error(transparent)]
    Simulation(#[from] macropulse::sim::Error),
    /// A ready environment was refused.
    #[error(transparent)]
    Environment(#[from] macropulse::environment::Error),
    /// A code was refused.
    #[error(transparent)]
    Code(macropulse::codec::code::Error),
    /// A result could not be written.
    #[error(transparent)]
    Record(#[from] crate::record::Error),
    /// A file could not be written.
    #[error(transparent)]
    Formats(#[from] macropulse::formats::Error),
    /// A picture could not be drawn.
    #[error(transparent)]
    View(#[from] crate::view::Error),
}

/// Everything that was measured.
#[derive(Debug)]
pub struct Findings {
    /// The sensors, in the order of [`SENSORS`].
    pub designs: Vec<Design>,
    /// Sun and air of all scenes.
    pub environment: Environment,
    /// Every sensor at every distance.
    pub trials: Vec<Trial>,
    /// The receivers compared.
    pub comparisons: Vec<Comparison>,
    /// The five lidars in one scene.
    pub sides: Vec<Side>,
    /// Numbers by which the claims are judged.
    pub measured: Measured,
    /// Claims of the paper, with their verdicts.
    pub claims: Vec<Claim>,
}

/// Files that [`run`] writes beside the folders of its trials.
pub const FILES: [&str; 5] =
    ["points.csv", "lidars.csv", "claims.json", "claims.md", crate::record::PAGE];

/// The folder of each trial of [`run`].
pub fn folders() -> Vec<String> {
    let each = |sensor| DISTANCES.map(|distance| experiment::folder(sensor, distance));
    SENSORS.into_iter().flat_map(each).collect()
}

/// Shots that [`run`] tells its watch of.
///
/// # Errors
/// None of the ready sensors is refused, unless the program is broken.
pub fn shots() -> Result<u64, Error> {
    let trials: u64 = designs()?.iter().map(Design::shots_per_scan).sum();
    Ok(trials * DISTANCES.len() as u64 + receivers::shots()? + side_by_side::shots()?)
}

fn designs() -> Result<Vec<Design>, Error> {
    SENSORS.iter().map(|name| Ok(Design::open(name, &[])?)).collect()
}

/// Runs the whole experiment and writes into `folder`: one folder per sensor and distance,
/// `points.csv`, `lidars.csv`, `claims.json`, `claims.md`, and `index.html` last.
///
/// # Errors
/// If something cannot be written, or the watch says stop.
pub fn run(folder: &Path, seed: u64, watch: &Watch) -> Result<Findings, Error> {
    let designs = designs()?;
    let sensors: Vec<_> = designs.iter().zip(SENSORS).collect();
    let trials = sensors.par_iter().flat_map(|(design, sensor)| {
        DISTANCES.par_iter().map(move |&distance| {
            experiment::trial(design, (sensor, distance), seed, folder, watch)
        })
    });
    let trials = trials.collect::<Result<Vec<_>, Error>>()?;
    let comparisons = receivers::compare(seed, watch)?;
    let walls = walls::near_and_far(&designs, seed)?;
    let (sides, methods) = side_by_side::measure(seed, watch)?;
    let measured = Measured::of(&designs[0], &trials, &comparisons, walls, methods)?;
    let claims = judge(&measured);
    let environment = experiment::scene(DISTANCES[0])?.environment;
    let findings = Findings { designs, environment, trials, comparisons, sides, measured, claims };
    let [points, lidars, claims, list, page] = FILES.map(|file| folder.join(file));
    write_atomically(&points, |out| {
        out.write_all(tables::points_csv(&findings.trials).as_bytes())
    })?;
    write_atomically(&lidars, |out| {
        out.write_all(side_by_side_page::csv(&findings.measured.methods).as_bytes())
    })?;
    write_atomically(&claims, |out| {
        serde_json::to_writer_pretty(&mut *out, &findings.claims)?;
        out.write_all(b"\n")
    })?;
    write_atomically(&list, |out| out.write_all(listing(&findings.claims).as_bytes()))?;
    let html = report::page(&findings, seed)?.html();
    write_atomically(&page, |out| out.write_all(html.as_bytes()))?;
    Ok(findings)
}
