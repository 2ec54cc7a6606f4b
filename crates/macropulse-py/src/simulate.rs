//! From shots to points: one scan, or one after the other.

use std::sync::Arc;

use macropulse::channel::Operating;
use macropulse::design::Design;
use macropulse::emit::most_scans;
use macropulse::formats::State;
use macropulse::scene::Scene as Simulated;
use macropulse::score::Score;
use macropulse::sim::{self, Tally, Watch};
use macropulse_study::record::{self, Run, manifest};
use pyo3::prelude::*;
use serde_json::Value;

use crate::error::{Fault, OrRaise, check_scan, warned, wrong};
use crate::scan::{About, Scan};
use crate::scene::Scene;
use crate::sensor::Sensor;
use crate::values::whole;
use crate::work;

/// A sensor in a scene.
#[derive(Clone)]
struct Stage {
    design: Arc<Design>,
    scene: Arc<Simulated>,
    seed: u64,
    threads: usize,
}

impl Stage {
    fn of(
        sensor: &Bound<'_, PyAny>,
        scene: &Bound<'_, PyAny>,
        (seed, threads): (u64, usize),
    ) -> PyResult<Self> {
        let design = Arc::clone(&Sensor::of(sensor)?.get().design);
        let scene = Arc::clone(&Scene::of(scene)?.get().scene);
        Operating::of(&design, &scene.environment).or_raise()?;
        Ok(Self { design, scene, seed, threads })
    }

    /// Scan number `number`; a signal stops it after the bands under way.
    fn scan(&self, py: Python<'_>, number: u64) -> PyResult<Scan> {
        check_scan(&self.design, number)?;
        let this = self.clone();
        let made = work::done(py, self.threads, move |stop| {
            let watch = Watch { done: &|_| {}, stop: &|| stop.is_raised() };
            sim::scan_watched(&this.design, &this.scene, this.seed, number, &watch)
                .map(|scan| scan.map(|scan| (scan.cloud(), scan.score, scan.tally)))
        })?;
        let Some((cloud, score, tally)) = made.or_raise()? else {
            return Err(Fault::new_err("the scan was stopped, and by no signal"));
        };
        if let Some(reason) = tally.where_all_was_lost(&self.design) {
            warned(py, format!("{}: not a single point: {reason}", self.design.name))?;
        }
        let scene = &self.scene;
        Ok(Scan::new(
            cloud,
            About {
                sensor: Some(Arc::clone(&self.design)),
                objects: scene.objects.iter().map(|object| object.name.clone()).collect(),
                materials: scene.materials.iter().map(|one| one.name.clone()).collect(),
                manifest: self.manifest(number, &score, &tally),
            },
        ))
    }

    /// Returns the manifest that the program writes of a run of this scan.
    fn manifest(&self, number: u64, score: &Score, tally: &Tally) -> Value {
        let warnings = record::warnings(&self.design, &self.scene);
        let run = Run {
            state: State::Finished,
            design: &self.design,
            scene: &self.scene,
            seed: self.seed,
            scans: 1,
            tally,
            score,
            files: &[],
            warnings: &warnings,
            writing: 0.0,
            elapsed: 0.0,
        };
        let mut manifest = manifest(&run).value();
        // These entries are of a run and its files alone.
        if let Some(entries) = manifest.as_object_mut() {
            entries.retain(|key, _| !["scans", "files"].contains(&key.as_str()));
            entries.insert("scan".to_owned(), number.into());
        }
        if let Some(times) = manifest["times_s"].as_object_mut() {
            times.retain(|stage, _| Tally::STAGES.contains(&stage.as_str()));
        }
        manifest
    }
}

/// Simulates one scan of a sensor in a scene.
///
/// Other threads of Python run meanwhile, and Ctrl-C ends it within some lines of the scan. The same
/// seed gives the same points, on any number of threads.
///
/// Args:
///     sensor: A `Sensor`, the name of a ready one, or a TOML file.
///     scene: A `Scene`, the name of a ready one, or a TOML file.
///     seed: Seed of the random numbers.
///     scan: Number of the scan, from 0: of what moves it tells the time.
///     threads: Threads to compute with; 0 is one per core.
///
/// Returns:
///     The points, with the truth beside them. A scan without a point comes with a warning that says
///     which stage has lost the last light.
///
/// Raises:
///     Error: If the sensor, the scene, or both together cannot be.
///
/// Example:
///     >>> scan = macropulse.simulate("kim-park-2016", macropulse.Scene.car(30.0), seed=1)
///     >>> scan.x, scan.intensity, scan.ring, scan.time_ns
#[pyfunction]
#[pyo3(signature = (sensor, scene, *, seed = 1, scan = 0, threads = 0))]
pub fn simulate(
    sensor: &Bound<'_, PyAny>,
    scene: &Bound<'_, PyAny>,
    #[pyo3(from_py_with = whole)] seed: u64,
    #[pyo3(from_py_with = whole)] scan: u64,
    #[pyo3(from_py_with = whole)] threads: usize,
) -> PyResult<Scan> {
    Stage::of(sensor, scene, (seed, threads))?.scan(sensor.py(), scan)
}

/// Scans one after the other, each simulated when it is asked for: `for scan in scans(...)`.
#[pyclass(frozen, module = "macropulse")]
pub struct Scans {
    stage: Stage,
    /// The next scan, and the one behind the last.
    left: std::sync::Mutex<std::ops::Range<u64>>,
}

impl Scans {
    fn left(&self) -> std::sync::MutexGuard<'_, std::ops::Range<u64>> {
        self.left.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

#[pymethods]
impl Scans {
    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Scan>> {
        let next = self.left().next();
        next.map(|number| self.stage.scan(py, number)).transpose()
    }

    /// How many are left.
    fn __len__(&self) -> usize {
        let left = self.left();
        left.end.saturating_sub(left.start) as usize
    }

    fn __repr__(&self) -> String {
        let Stage { design, scene, seed, .. } = &self.stage;
        let left = self.__len__();
        format!("<macropulse.Scans of {} in {}: {left} left, seed {seed}>", design.name, scene.name)
    }
}

/// Simulates scan after scan, in the memory of one.
///
/// Args:
///     sensor: A `Sensor`, the name of a ready one, or a TOML file.
///     scene: A `Scene`, the name of a ready one, or a TOML file.
///     n: How many scans.
///     seed: Seed of the random numbers of all of them.
///     first: Number of the first scan.
///     threads: Threads to compute with; 0 is one per core.
///
/// Returns:
///     An iterator of `Scan`; `len` says how many are left.
///
/// Raises:
///     Error: As `simulate`; and if the clock of the sensor does not count as far.
#[pyfunction]
#[pyo3(signature = (sensor, scene, n, *, seed = 1, first = 0, threads = 0))]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn scans(
    sensor: &Bound<'_, PyAny>,
    scene: &Bound<'_, PyAny>,
    #[pyo3(from_py_with = whole)] n: u64,
    #[pyo3(from_py_with = whole)] seed: u64,
    #[pyo3(from_py_with = whole)] first: u64,
    #[pyo3(from_py_with = whole)] threads: usize,
) -> PyResult<Scans> {
    let stage = Stage::of(sensor, scene, (seed, threads))?;
    let end = first.saturating_add(n);
    let most = most_scans(&stage.design);
    if end > most {
        return Err(wrong(format!(
            "{n} scans from number {first} on last longer than the 2.5 h that the clock of {} \
             counts; its last one has number {}",
            stage.design.name,
            most.saturating_sub(1)
        )));
    }
    Ok(Scans { stage, left: std::sync::Mutex::new(first..end) })
}
