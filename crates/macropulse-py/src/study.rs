//! Studies of sensors beside scans: budgets, sweeps, scores.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use macropulse::formats::write_atomically;
use macropulse::points::Outcome;
use macropulse::predict::verdict::Wanted;
use macropulse::score::RangeError;
use macropulse::sim::Watch;
use macropulse_study::budget::{Figures, usual};
use macropulse_study::sweep::{Axis, Job, Metric, Plan, Request, Shard};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString};
use serde_json::{Value, json};

use crate::error::{OrRaise, warned, wrong};
use crate::scan::Scan;
use crate::scene::Scene;
use crate::sensor::{Sensor, named};
use crate::values::{self, Reader, changes, from_json, whole, whole_or_none};
use crate::work;

/// The link budget of a sensor: will it work, how far, and what fails first?
///
/// Everything is closed form.
///
/// Args:
///     sensor: A `Sensor`, the name of a ready one, or a TOML file.
///     environment: Sun and air: the name of a ready one, or a dictionary of keys over it.
///     range_m: Range of the target, m; the rated range of the sensor if left out.
///     reflectance: Reflectance of the target; 1 is white.
///     pd: Probability of a return that is wanted.
///     false_points: False points per shot that are accepted.
///
/// Returns:
///     A dictionary with the keys of `macropulse budget --json`, which end in their units.
///
/// Raises:
///     Error: If the sensor, the environment, or what is wanted cannot be.
#[pyfunction]
#[pyo3(signature = (sensor, environment = None, *, range_m = None, reflectance = None, pd = None,
                    false_points = None))]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn budget<'py>(
    sensor: &Bound<'py, PyAny>,
    environment: Option<&Bound<'py, PyAny>>,
    range_m: Option<f64>,
    reflectance: Option<f64>,
    pd: Option<f64>,
    false_points: Option<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = sensor.py();
    let design = Arc::clone(&Sensor::of(sensor)?.get().design);
    let environment = values::environment(environment)?;
    let usual = usual(&design);
    let limited = |given: Option<f64>, usual: f64, (name, low, high): (&str, f64, f64)| {
        let value = given.unwrap_or(usual);
        match (low..=high).contains(&value) {
            true => Ok(value),
            false => Err(wrong(format!("{name} is {value}; it must be from {low} to {high}"))),
        }
    };
    let wanted = Wanted {
        reflectance: limited(reflectance, usual.reflectance, ("reflectance", 1e-6, 1e6))?,
        range: limited(range_m, usual.range, ("range_m", 1e-6, 1e6))?,
        pd: limited(pd, usual.pd, ("pd", 1e-12, 1.0 - 1e-12))?,
        false_points: limited(false_points, usual.false_points, ("false_points", 1e-12, 1.0))?,
    };
    let told = work::done(py, 0, move |_| {
        Figures::of(&design, environment, wanted).map(|figures| figures.json())
    })?;
    from_json(py, &told.or_raise()?)
}

/// Varies one or two keys of a sensor or scene and counts how well it does, with 95 % intervals.
///
/// Every value is measured with several seeds. Each of these scans leaves a small file in
/// `folder`/jobs; what is there is not measured again, so that the same call goes on where it was
/// stopped. When nothing is missing, sweep.csv, sweep.svg, sweep.png and manifest.json are written.
///
/// Args:
///     sensor: A `Sensor`, the name of a ready one, or a TOML file; or a list of these, which is
///         varied like a key.
///     scene: A `Scene`, the name of a ready one, or a TOML file.
///     vary: Keys and their values: `{"detector.photon-counting.missed_marks": [0.0, 0.1, 0.2]}`;
///         keys of the scene stand behind `scene:`. Values may be a list, an array, or a text as
///         the program takes it: `"50..200:7"` seven in equal steps, `"1e6..1e10:log9"` nine in
///         equal ratios.
///     folder: Folder for the results, made if need be.
///     changes: Changed values of all sensors and of the scene.
///     score: Names of scores, a list or a text, as `macropulse sweep --help` lists them.
///     seeds: Scans of each value, with a seed each.
///     seed: The first seed.
///     shots: Only about this number of shots of each scan, in whole bands, evenly over it.
///     shard: Only every n-th scan from the i-th: `"i/n"`, for several machines on one folder.
///     dry: Measure nothing: only check what is asked for, claim the folder, and say what is missing.
///     threads: Threads to compute with; 0 is one per core.
///
/// Returns:
///     A dictionary with the keys of `macropulse sweep --json`: `rows`, or `missing` and
///     `missing_shards` where scans are missing.
///
/// Raises:
///     Error: If a key, a value or a name is wrong, or the folder holds something else.
#[pyfunction]
#[pyo3(signature = (sensor, scene, vary = None, *, folder, changes = None,
                    score = Names::of("pd,wrong,precision"),
                    seeds = 8, seed = 1, shots = None, shard = "1/1", dry = false, threads = 0),
       text_signature = "(sensor, scene, vary=None, *, folder, changes=None, \
                         score=('pd', 'wrong', 'precision'), seeds=8, seed=1, shots=None, \
                         shard='1/1', dry=False, threads=0)")]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn sweep<'py>(
    sensor: &Bound<'py, PyAny>,
    scene: &Bound<'py, PyAny>,
    vary: Option<&Bound<'py, PyDict>>,
    folder: PathBuf,
    changes: Option<&Bound<'py, PyDict>>,
    score: Names,
    #[pyo3(from_py_with = whole)] seeds: u64,
    #[pyo3(from_py_with = whole)] seed: u64,
    #[pyo3(from_py_with = whole_or_none)] shots: Option<u64>,
    shard: &str,
    dry: bool,
    #[pyo3(from_py_with = whole)] threads: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let py = sensor.py();
    if !(1..=10_000).contains(&seeds) {
        return Err(wrong(format!("seeds is {seeds}; it must be from 1 to 10000")));
    }
    let metrics = Metric::parse(&score.listed()).or_raise()?;
    let shard: Shard = shard.parse().or_raise()?;
    let mut files = Vec::new();
    let sensors = match sensor.cast::<PyList>() {
        Ok(list) => list.iter().map(|one| sensor_named(&one, &folder, &mut files)).collect(),
        Err(_) => sensor_named(sensor, &folder, &mut files).map(|one| vec![one]),
    }?;
    let vary = vary.into_iter().flatten().map(|(key, values)| axis(&key, &values));
    let request = Request {
        sensors,
        scene: scene_named(scene, &folder, &mut files)?,
        set: self::changes(changes, false)?,
        vary: vary.collect::<PyResult<_>>()?,
        seeds: seed..seed.saturating_add(seeds),
        shots,
    };
    let told = work::done(py, threads, move |stop| {
        for (path, text) in &files {
            if let Some(folder) = path.parent() {
                let _ = std::fs::create_dir_all(folder);
            }
            write_atomically(path, |out| out.write_all(text.as_bytes()))?;
        }
        let plan = Plan::of(&request)?;
        plan.check_folder(&folder)?;
        plan.claim_folder(&folder)?;
        let missing = plan.missing(&folder).into_iter();
        let todo: Vec<Job> =
            missing.filter(|(job, _)| !dry && shard.has(*job)).map(|(_, job)| job).collect();
        let watch = Watch { done: &|_| {}, stop: &|| stop.is_raised() };
        plan.work(&folder, &todo, &watch)?;
        let missing: Vec<usize> = plan.missing(&folder).iter().map(|(job, _)| *job).collect();
        Ok::<_, macropulse_study::sweep::Error>(match missing.is_empty() {
            true => {
                let table = plan.finish(&folder, &metrics)?;
                (plan.json(&table), table.empty())
            }
            false => (plan.json_of_missing(&missing, shard), None),
        })
    })?;
    let (told, empty) = told.or_raise()?;
    if let Some(empty) = empty {
        warned(py, empty)?;
    }
    from_json(py, &told)
}

/// Names: one, several in one text with commas between them, or a list of texts.
#[derive(FromPyObject)]
pub enum Names {
    #[pyo3(annotation = "a text")]
    Text(String),
    #[pyo3(annotation = "a list of texts")]
    List(Vec<String>),
}

impl Names {
    fn of(text: &str) -> Self {
        Self::Text(text.to_owned())
    }

    /// All of them, with commas between them.
    fn listed(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::List(list) => list.join(","),
        }
    }
}

/// Returns the name of a sensor for a sweep: its own, or the path of a file that the sweep keeps in its
/// folder.
fn sensor_named(
    given: &Bound<'_, PyAny>,
    folder: &Path,
    files: &mut Vec<(PathBuf, String)>,
) -> PyResult<String> {
    let Ok(sensor) = given.cast::<Sensor>() else { return named(given, ("sensor", "Sensor")) };
    let design = &sensor.get().design;
    let plain = design.name.replace(|c: char| !c.is_alphanumeric() && !"-_".contains(c), "-");
    let path = folder.join(format!("sensor-{plain}-{}.toml", &design.digest()[..8]));
    let name = path.display().to_string();
    files.push((path, design.text.clone()));
    Ok(name)
}

/// Returns the name of a scene for a sweep: its own, or the path of a file as above.
fn scene_named(
    given: &Bound<'_, PyAny>,
    folder: &Path,
    files: &mut Vec<(PathBuf, String)>,
) -> PyResult<String> {
    let Ok(scene) = given.cast::<Scene>() else { return named(given, ("scene", "Scene")) };
    if !scene.get().is_self_contained() {
        return Err(wrong(
            "a sweep keeps its scene as a file, and this one has meshes; write them to files \
             beside a scene file, and name that",
        ));
    }
    let text = scene.get().scene.text.clone();
    let path = folder.join(format!("scene-{}.toml", &scene.get().scene.digest()[..8]));
    let name = path.display().to_string();
    files.push((path, text));
    Ok(name)
}

/// A key with its values.
fn axis(key: &Bound<'_, PyAny>, values: &Bound<'_, PyAny>) -> PyResult<Axis> {
    let Ok(key) = key.extract::<String>() else {
        return Err(wrong(format!("vary: the key {} is no text", key.repr()?)));
    };
    if let Ok(typed) = values.cast::<PyString>() {
        return format!("{key}={typed}").parse().or_raise();
    }
    let toml::Value::Array(list) = Reader::default().value(values, &key, 0)? else {
        return Err(wrong(format!(
            "{key}: several values are wanted: a list, or a text as 50..200:7"
        )));
    };
    let texts: Vec<String> = list.iter().map(ToString::to_string).collect();
    format!("{key}={}", texts.join(",")).parse().or_raise()
}

/// How a scan came out, against the truth beside its points: that of a simulation, or of a file that
/// was written with it.
///
/// Args:
///     scan: A `Scan` with the truth.
///
/// Returns:
///     A dictionary: `outcomes` of the pixels, `further_outcomes` of second and later returns, and
///     `right_fraction` of the pixels with a surface in the gate, edges left out. The range error of the
///     right points has `count`, `mean_m` and `deviation_m`.
///
/// Raises:
///     Error: If the scan has no truth.
#[pyfunction]
pub fn score<'py>(scan: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let Ok(scan) = scan.cast::<Scan>() else {
        let kind = scan.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "scan: a macropulse.Scan is wanted, not of type {kind}; `macropulse.load(path)` reads one, \
             and of several each is judged by itself: `[macropulse.score(scan) for scan in scans]`"
        )));
    };
    let this = scan.get();
    if !this.cloud.has_truth() {
        return Err(wrong(
            "the scan has no truth to be judged by; simulate it, or write its file with truth=True",
        ));
    }
    let cloud = &this.cloud;
    let image = cloud.image(cloud.pick);
    let (mut pixels, mut further) = ([0_u64; Outcome::ALL.len()], [0_u64; Outcome::ALL.len()]);
    for pixel in 0..image.len() {
        pixels[image.surface(cloud, pixel).outcome as usize] += 1;
    }
    for (outcome, number) in cloud.truth.returns.outcome.iter().zip(&cloud.return_number) {
        further[*outcome as usize] += u64::from(*number > 1);
    }
    let named = |counts: [u64; Outcome::ALL.len()]| {
        let named = Outcome::ALL.iter().map(|one| one.name().to_owned());
        Value::Object(named.zip(counts.map(Value::from)).collect())
    };
    let met = [Outcome::Right, Outcome::Near, Outcome::Wrong, Outcome::Missed];
    let met: u64 = met.iter().map(|outcome| pixels[*outcome as usize]).sum();
    let error = RangeError::of(cloud);
    let told = json!({
        "outcomes": named(pixels),
        "further_outcomes": named(further),
        "right_fraction": pixels[Outcome::Right as usize] as f64 / met as f64,
        "count": error.count,
        "mean_m": error.mean,
        "deviation_m": error.deviation,
    });
    from_json(scan.py(), &told)
}
