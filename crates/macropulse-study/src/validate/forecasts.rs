//! Forecasts compared with simulations. Walls stand all around a ready sensor. Their reflectances are such
//! that one shot in ten, half of them, four in five, and nearly all should be seen.

use macropulse::codec::decode::Method;
use macropulse::design::Design;
use macropulse::emit::{Band, short_bands};
use macropulse::environment::Environment;
use macropulse::points::{Outcome, PointCloud};
use macropulse::predict::{Forecast, Forecaster};
use macropulse::scene::Scene;
use macropulse::score::NEAR;
use macropulse::sim::{Scans, Watch};

use super::Error;

/// Shots that are looked at of each place, or a few more: a share is known to 0.0035 then, one
/// standard deviation.
pub const SHOTS: u64 = 20_000;

/// The sensors that are tried.
pub const SENSORS: [&str; 16] = [
    "kim-park-2016",
    "kim-park-2016-fixed",
    "coded-32",
    "coded-16",
    "coded-practical",
    "coded-360",
    "bipolar-gold",
    "hdl-64e",
    "vlp-16",
    "peregrine",
    "spad-flash",
    "spad-spinning",
    "itof-camera",
    "kinect-v2",
    "amcw-scanner",
    "fmcw-1550",
];

/// The ready environment around them.
const ENVIRONMENT: &str = "night";

/// The walls stand at this part of the range of the sensor.
const PART: f64 = 0.7;

/// Number of places within a tick at which walls stand, or one for each band if there are fewer bands.
const PHASES: usize = 4;

/// Probabilities of detection at which a forecast is tried.
const WANTED: [f64; 4] = [0.1, 0.5, 0.8, 0.95];

/// Accepted errors of a probability: absolute, and in standard deviations of the result. An error within its
/// change with [`LIGHT_WITHIN`] is accepted, too.
const PD_WITHIN: (f64, f64) = (0.02, 3.0);

/// Share by which the light of a forecast may be too high or too low: a tenth of a decibel. If neighbours
/// help each other, a little more light finds many more shots.
const LIGHT_WITHIN: f64 = 0.02;

/// A precision may be off by such a share of what was found.
const PRECISION_WITHIN: f64 = 0.2;

/// Accepted errors of the share of points on a sidelobe: absolute, and in standard deviations of the result.
const ASIDE_WITHIN: (f64, f64) = (0.002, 3.0);

/// A point that is not right lies on a sidelobe from this number of standard deviations on. One in 500
/// million normal errors is that large.
const BESIDE: f64 = 6.0;

/// Nearly all returns lie within this number of standard deviations to both sides.
const WHOLE: f64 = 3.0;

/// Standard deviations of fewer points are not compared: of 1000 they are known to 2 %.
const FEWEST_POINTS: u64 = 1000;

/// A forecast, and what came of it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Place {
    /// The ready sensor.
    pub sensor: String,
    /// Reflectance of a wall square on.
    pub reflectance: f64,
    /// How far away it stands, m.
    pub range_m: f64,
    /// Shots with light.
    pub shots: u64,
    /// Probability of detection, forecast and found.
    pub pd: [f64; 2],
    /// The same, forecast for 2 % less light, and for 2 % more.
    pub pd_between: [f64; 2],
    /// Standard deviation of the range, forecast and found, m; not found of few points.
    pub precision_m: (Option<f64>, Option<f64>),
    /// Share of the points on a sidelobe of their own macropulse, forecast and found; where there is such a
    /// forecast.
    pub aside: Option<[f64; 2]>,
    /// Points with light; `aside` is a share of them.
    pub points: usize,
    /// False and wrong points per shot, forecast and found.
    pub false_per_shot: [f64; 2],
}

impl Place {
    /// Tells if the probability is as forecast.
    pub fn pd_holds(&self) -> bool {
        let [forecast, found] = self.pd;
        let [least, most] = self.pd_between;
        let deviation = (forecast * (1.0 - forecast) / self.shots.max(1) as f64).sqrt();
        (forecast - found).abs() <= PD_WITHIN.0.max(PD_WITHIN.1 * deviation)
            || (least..=most).contains(&found)
    }

    /// Tells if all results are as forecast.
    pub fn holds(&self) -> bool {
        let aside = self.aside_holds() != Some(false);
        self.pd_holds() && self.precision_holds() != Some(false) && aside
    }

    /// Tells if the share of points on a sidelobe is as forecast; `None` without such a forecast.
    pub fn aside_holds(&self) -> Option<bool> {
        let [forecast, found] = self.aside?;
        let deviation = (forecast * (1.0 - forecast) / self.points.max(1) as f64).sqrt();
        Some((forecast - found).abs() <= ASIDE_WITHIN.0.max(ASIDE_WITHIN.1 * deviation))
    }

    /// Tells if the precision is as forecast; `None` if it was not found, or is so large that returns are
    /// lost beyond what counts as seen.
    pub fn precision_holds(&self) -> Option<bool> {
        let (forecast, found) = self.precision_m;
        let (forecast, found) = forecast.zip(found)?;
        (WHOLE * forecast < NEAR).then(|| (forecast - found).abs() <= PRECISION_WITHIN * found)
    }
}

/// Tries the forecasts of the ready `sensor` by night, at 70 % of its range.
///
/// # Errors
/// If the sensor cannot be simulated there.
pub fn places(sensor: &str, seed: u64, watch: &Watch) -> Result<Vec<Place>, Error> {
    let ready = Design::open(sensor, &[])?;
    let design = match ready.receiver.method {
        // The forecast tells what is there to be found.
        Method::Matched(..) => {
            Design::open(sensor, &[("receiver.effort".into(), "\"thorough\"".into())])?
        }
        _ => ready,
    };
    let around = Environment::named(ENVIRONMENT)?;
    let forecaster = Forecaster::new(&design, &around)?;
    let range = PART * design.scan.max_range;
    let mut places = Vec::new();
    for wanted in WANTED {
        let Some(reflectance) = reflectance(&forecaster, wanted, range) else { continue };
        let mut shots = 0;
        let few = |band: &Band| {
            let is_enough = shots >= SHOTS;
            shots += band.shots;
            !is_enough
        };
        let part: Vec<Band> = short_bands(&design, 0).take_while(few).collect();
        let phases = PHASES.min(part.len());
        let step = design.derived().tick_range / phases as f64;
        let ranges: Vec<f64> = (0..phases).map(|phase| range + phase as f64 * step).collect();
        let with_light = |factor: f64| {
            let forecaster = forecaster.with_light(factor);
            let forecasts: Vec<Forecast> =
                ranges.iter().map(|at| forecaster.forecast(reflectance, *at)).collect();
            Expected::of(&forecasts)
        };
        let forecast = with_light(1.0);
        let pd_between = [1.0 - LIGHT_WITHIN, 1.0 + LIGHT_WITHIN].map(|light| with_light(light).pd);
        let (mut counts, mut lit, mut errors) = ([0; Outcome::ALL.len()], 0, Vec::new());
        for (phase, at) in ranges.iter().enumerate() {
            let part: Vec<Band> = part.iter().skip(phase).step_by(phases).copied().collect();
            let scene = room(reflectance, *at)?;
            let mut scans = Scans::new(&design, &scene, seed)?;
            let scan = scans.part(&part, watch)?.ok_or(Error::Stopped)?;
            for (count, outcome) in counts.iter_mut().zip(Outcome::ALL) {
                *count += scan.score.count(outcome);
            }
            lit += scan.score.with_echo();
            errors.extend(errors_of(&scan.cloud()));
        }
        let of = |outcome: Outcome| counts[outcome as usize];
        let share = |count: u64| count as f64 / lit.max(1) as f64;
        // A normal error is no sidelobe.
        let beside = forecast.precision.map_or(f64::INFINITY, |sigma| BESIDE * sigma);
        let beside = match design.receiver.method {
            Method::Matched(..) => beside.max(design.right_within),
            _ => f64::INFINITY,
        };
        let peak: Vec<f64> = errors.iter().copied().filter(|error| error.abs() <= beside).collect();
        let aside = (errors.len() - peak.len()) as f64 / errors.len().max(1) as f64;
        places.push(Place {
            sensor: sensor.to_owned(),
            reflectance,
            range_m: range,
            shots: lit,
            pd: [forecast.pd, share(of(Outcome::Right) + of(Outcome::Near))],
            pd_between,
            precision_m: (forecast.precision, deviation(&peak)),
            aside: forecast.aside.map(|forecast| [forecast, aside]),
            points: errors.len(),
            false_per_shot: [
                forecast.false_per_shot,
                share(of(Outcome::Wrong) + of(Outcome::False)),
            ],
        });
    }
    Ok(places)
}

/// The mean of what is to be expected at several ranges.
struct Expected {
    pd: f64,
    false_per_shot: f64,
    precision: Option<f64>,
    aside: Option<f64>,
}

impl Expected {
    fn of(forecasts: &[Forecast]) -> Self {
        let count = forecasts.len().max(1) as f64;
        let mean = |of: &dyn Fn(&Forecast) -> f64| forecasts.iter().map(of).sum::<f64>() / count;
        let all = |of: &dyn Fn(&Forecast) -> Option<f64>| {
            forecasts.iter().map(of).sum::<Option<f64>>().map(|sum| sum / count)
        };
        Self {
            pd: mean(&|forecast| forecast.pd),
            false_per_shot: mean(&|forecast| forecast.false_per_shot),
            precision: all(&|forecast| Some(forecast.precision?.powi(2))).map(f64::sqrt),
            aside: all(&|forecast| Some(forecast.aside?.share)),
        }
    }
}

/// The least reflectance, up to white, that is seen with probability `wanted` at `range`.
fn reflectance(forecaster: &Forecaster, wanted: f64, range: f64) -> Option<f64> {
    let pd = |reflectance: f64| forecaster.forecast(reflectance, range).pd;
    let (mut low, mut high) = (1e-4, 1.0);
    if pd(high) < wanted {
        return None;
    }
    for _ in 0..40 {
        let middle = f64::sqrt(low * high);
        if pd(middle) < wanted { low = middle } else { high = middle }
    }
    Some(high)
}

/// A hollow sphere about the sensor, so that every shot meets it square on.
fn room(reflectance: f64, range: f64) -> Result<Scene, Error> {
    let text = format!(
        "version = 1\nenvironment = \"{ENVIRONMENT}\"\n[[material]]\nname = \"paint\"\n\
         diffuse = {reflectance}\n[[object]]\nshape.sphere.radius_m = {range}\n\
         material = \"paint\"\n"
    );
    Ok(Scene::from_toml(&text, "room", std::path::Path::new(""))?)
}

/// The range errors of right and near points, m.
fn errors_of(cloud: &PointCloud) -> Vec<f64> {
    let truth = &cloud.truth.returns;
    let answers = (0..cloud.range.len())
        .filter(|&at| matches!(truth.outcome[at], Outcome::Right | Outcome::Near));
    answers.map(|at| f64::from(cloud.range[at]) - f64::from(truth.range[at])).collect()
}

/// Their standard deviation; `None` of few.
fn deviation(errors: &[f64]) -> Option<f64> {
    let count = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / count;
    let squares: f64 = errors.iter().map(|error| (error - mean).powi(2)).sum();
    (errors.len() as u64 >= FEWEST_POINTS).then(|| (squares / (count - 1.0)).sqrt())
}
