//! The five lidars in one scene, and before walls at growing distance.

use rayon::prelude::*;

use super::Error;
use super::lidars::{FMCW, LIDARS, Lidar, named};
use super::measured::{Methods, Place, Reach};
use super::walls;
use macropulse::design::Design;
use macropulse::emit::{Band, bands};
use macropulse::points::{Outcome, PointCloud};
use macropulse::predict::Forecaster;
use macropulse::scene::Scene;
use macropulse::score::{Estimate, RangeError, Score};
use macropulse::sim::{Scans, Watch, scan_watched};

/// The scene of the range images.
pub(super) const SCENE: &str = "street";

/// Distances of the walls, m.
pub(super) const RANGES: [f64; 9] = [5.0, 10.0, 20.0, 35.0, 50.0, 70.0, 100.0, 140.0, 200.0];

/// Reflectance of the walls.
pub(super) const REFLECTANCE: f64 = 0.1;

/// Sun and air before the walls.
const ENVIRONMENT: &str = "clear-day";

/// Shots at each wall: a share of a half is known to 0.022, one standard deviation.
pub(super) const SHOTS: u64 = 512;

/// Steps of a forecast from each wall to the next.
const BETWEEN: u32 = 4;

/// Widths of the line of the FMCW laser, kHz. The first is that of the ready sensor.
const LINES_KHZ: [f64; 4] = [10.0, 100.0, 1000.0, 10_000.0];

/// One lidar of the five.
#[derive(Debug)]
pub struct Side {
    /// The lidar.
    pub lidar: &'static Lidar,
    /// Its sensor.
    pub design: Design,
    /// Its points in the scene, with truth.
    pub cloud: PointCloud,
    /// How the pixels of the scene came out.
    pub score: Score,
    /// Standard deviation of the range of its right points there, m; NaN of fewer than two.
    pub precision: f64,
    /// Why there is no forecast of it; `None` if there is one.
    pub unforecast: Option<String>,
}

/// Shots of all scans and walls.
pub(super) fn shots() -> Result<u64, Error> {
    let images = LIDARS.iter().map(|lidar| Ok(lidar.design(&[])?.shots_per_scan()));
    let images: u64 = images.sum::<Result<u64, Error>>()?;
    let walls = (LIDARS.len() + LINES_KHZ.len() - 1) * RANGES.len();
    Ok(images + walls as u64 * SHOTS)
}

/// Measures all of them.
pub(super) fn measure(seed: u64, watch: &Watch) -> Result<(Vec<Side>, Methods), Error> {
    let scene = Scene::open(SCENE)?;
    let each = LIDARS.par_iter().map(|lidar| one(lidar, &scene, seed, watch));
    let (sides, lidars): (Vec<Side>, Vec<Reach>) =
        each.collect::<Result<Vec<_>, Error>>()?.into_iter().unzip();
    let chirped = lidars.iter().find(|reach| reach.lidar == FMCW).cloned();
    let broader = LINES_KHZ[1..].par_iter().map(|&khz| {
        let line = format!("{khz:?}");
        let design = named(FMCW).design(&[("chirp.linewidth_khz", &line)])?;
        Ok((khz * 1e3, reach(FMCW, &design, seed, watch)?))
    });
    let broader = broader.collect::<Result<Vec<_>, Error>>()?;
    let first = chirped.map(|reach| (LINES_KHZ[0] * 1e3, reach));
    let lines = first.into_iter().chain(broader).collect();
    Ok((sides, Methods { lidars, lines }))
}

fn one(
    lidar: &'static Lidar,
    scene: &Scene,
    seed: u64,
    watch: &Watch,
) -> Result<(Side, Reach), Error> {
    let design = lidar.design(&[])?;
    let scan = scan_watched(&design, scene, seed, 0, watch)?.ok_or(Error::Stopped)?;
    let unforecast = Forecaster::new(&design, &scene.environment).err();
    let unforecast = unforecast.map(|why| why.to_string());
    let reach = reach(lidar.name, &design, seed, watch)?;
    let cloud = scan.cloud();
    let precision = RangeError::of(&cloud).deviation.unwrap_or(f64::NAN);
    Ok((Side { lidar, design, cloud, score: scan.score, precision, unforecast }, reach))
}

/// Pd and precision as forecast, at the walls and between them: range, Pd, precision.
fn curve(forecaster: &Forecaster) -> Vec<[f64; 3]> {
    let between = RANGES.windows(2).flat_map(|pair| {
        let part = |step: u32| f64::from(step) / f64::from(BETWEEN);
        (0..BETWEEN).map(move |step| pair[0] * libm::pow(pair[1] / pair[0], part(step)))
    });
    let forecast = |range: f64| {
        let it = forecaster.forecast(REFLECTANCE, range);
        [range, it.pd, it.precision.unwrap_or(f64::NAN)]
    };
    between.chain(RANGES.last().copied()).map(forecast).collect()
}

/// The bands of the first `shots` of a scan.
pub(super) fn first_shots(design: &Design, shots: u64) -> Vec<Band> {
    let begun = bands(design, 0).take_while(|band| band.first < shots);
    begun.map(|band| Band { shots: band.shots.min(shots - band.first), ..band }).collect()
}

/// One lidar before all walls.
fn reach(lidar: &'static str, design: &Design, seed: u64, watch: &Watch) -> Result<Reach, Error> {
    let bands = first_shots(design, SHOTS);
    let place = |&range: &f64| -> Result<Place, Error> {
        let scene = walls::around((range, REFLECTANCE), ENVIRONMENT)?;
        let mut scans = Scans::new(design, &scene, seed)?;
        let unheard = Watch { done: &|_| {}, stop: watch.stop };
        let scan = scans.part(&bands, &unheard)?.ok_or(Error::Stopped)?;
        let score = &scan.score;
        (watch.done)(SHOTS);
        let seen = score.count(Outcome::Right) + score.count(Outcome::Near);
        let pd = Estimate::of_rate(&[[seen, score.with_echo()]]);
        let spread = RangeError::of_spread(&scan.cloud(), design.right_within);
        Ok(Place {
            range,
            shots: score.with_echo(),
            seen,
            pd: [pd.value, pd.low, pd.high],
            precision: spread.deviation.unwrap_or(f64::NAN),
            points: spread.count,
        })
    };
    let places = RANGES.par_iter().map(place).collect::<Result<Vec<_>, Error>>()?;
    let sky = walls::around((RANGES[0], REFLECTANCE), ENVIRONMENT)?.environment;
    let curve = Forecaster::new(design, &sky).map_or_else(|_| Vec::new(), |it| curve(&it));
    Ok(Reach { lidar, places, curve })
}
