//! Walls at one distance in all directions: points enough to tell how error and detection change
//! with range.

use std::path::Path;

use super::Error;
use super::experiment::{DISTANCES, SENSORS};
use macropulse::design::Design;
use macropulse::emit::{Band, short_bands};
use macropulse::points::Outcome;
use macropulse::scene::Scene;
use macropulse::score::Score;
use macropulse::sim;

/// Shots of each sensor at a wall, about: a part of a scan, or several scans. Errors in range are then
/// known to 0.5 %.
const SHOTS: u64 = 20_000;

/// Detection and range error of a sensor at a wall that is square on in all directions.
#[derive(Debug, Clone)]
pub struct Wall {
    /// The sensor.
    pub sensor: &'static str,
    /// Distance of the wall, m.
    pub distance: f64,
    /// Share of the shots with light that gave a right or near point.
    pub seen: f64,
    /// Right and near points.
    pub points: u64,
    /// Root of their mean squared range error, m; NaN without one.
    pub error: f64,
}

/// A wall of the diffuse reflectance `diffuse` at `distance` metres in all directions, in a ready `environment`.
pub(super) fn around((distance, diffuse): (f64, f64), environment: &str) -> Result<Scene, Error> {
    let text = format!(
        "version = 1\nenvironment = \"{environment}\"\n[[material]]\nname = \"paint\"\n\
         diffuse = {diffuse:?}\n[[object]]\nshape.sphere.radius_m = {distance:?}\n\
         material = \"paint\"\n"
    );
    Ok(Scene::from_toml(&text, "wall", Path::new(""))?)
}

impl Wall {
    /// A wall of the diffuse reflectance `diffuse`, in a ready `environment`, at which about `shots` are
    /// fired.
    pub(super) fn of(
        (sensor, design): (&'static str, &Design),
        (distance, diffuse): (f64, f64),
        environment: &str,
        (shots, seed): (u64, u64),
    ) -> Result<Self, Error> {
        let scene = around((distance, diffuse), environment)?;
        let every = (design.shots_per_scan() / shots).max(1);
        let (mut score, mut squares) = (Score::default(), Vec::new());
        for number in 0..shots.div_ceil(design.shots_per_scan()) {
            let bands: Vec<Band> = short_bands(design, number).step_by(every as usize).collect();
            let scan = sim::scan_part(design, &scene, seed, &bands)?;
            let cloud = scan.cloud();
            let truth = &cloud.truth.returns;
            let is_seen = |at: &usize| matches!(truth.outcome[*at], Outcome::Right | Outcome::Near);
            let off = |at: usize| f64::from(cloud.range[at]) - f64::from(truth.range[at]);
            squares.extend((0..cloud.returns()).filter(is_seen).map(|at| off(at).powi(2)));
            score.add(&scan.score);
        }
        let points = score.count(Outcome::Right) + score.count(Outcome::Near);
        Ok(Self {
            sensor,
            distance,
            seen: points as f64 / score.with_echo() as f64,
            points,
            error: (squares.iter().sum::<f64>() / squares.len() as f64).sqrt(),
        })
    }
}

/// Every sensor before a wall of 50 % by day, at the nearest distance of the car and at the farthest
/// that it is rated for.
pub(super) fn near_and_far(designs: &[Design], seed: u64) -> Result<Vec<[Wall; 2]>, Error> {
    let pair = |(design, sensor): (&Design, &'static str)| {
        let reached = DISTANCES.into_iter().rfind(|d| f64::from(*d) <= design.scan.rated_range);
        let wall = |distance: u32| {
            Wall::of((sensor, design), (f64::from(distance), 0.5), "clear-day", (SHOTS, seed))
        };
        Ok([wall(DISTANCES[0])?, wall(reached.unwrap_or(DISTANCES[0]))?])
    };
    designs.iter().zip(SENSORS).map(pair).collect()
}
