//! The receiver's side alone: what it is given of a scan, and what it makes of that.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use macropulse::channel::Operating;
use macropulse::codec::RecordKind;
use macropulse::design::Design;
use macropulse::emit::{Band, bands};
use macropulse::points::{Piece, PointCloud, Scale, Truth};
use macropulse::scene::Scene as Simulated;
use macropulse::sim::{self, Scans};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::dictionaries::{dictionary_of_record, dictionary_of_shots, record_of, shot_log};
use crate::error::{OrRaise, check_scan, warned, wrong};
use crate::files::{StoredScans, recorded_at};
use crate::scan::{About, Scan};
use crate::scene::Scene;
use crate::sensor::Sensor;
use crate::values::whole;
use crate::{values, work};

/// The receiver's input for one scan, band after band: `for shots, ticks in record(...)`, or other records.
#[pyclass(frozen, module = "macropulse")]
pub struct Records {
    design: Arc<Design>,
    scene: Arc<Simulated>,
    seed: u64,
    /// The bands that are left, the next one last.
    left: Mutex<Vec<Band>>,
}

impl Records {
    fn left(&self) -> MutexGuard<'_, Vec<Band>> {
        self.left.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

type Pair<'py> = (Bound<'py, PyDict>, Bound<'py, PyDict>);

#[pymethods]
impl Records {
    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<Pair<'py>>> {
        let next = self.left().pop();
        let Some(band) = next else { return Ok(None) };
        let (design, scene) = (Arc::clone(&self.design), Arc::clone(&self.scene));
        let seed = self.seed;
        let made = work::done(py, 0, move |_| {
            Ok::<_, sim::Error>(Scans::new(&design, &scene, seed)?.record(&band))
        })?;
        let (log, given) = made.or_raise()?;
        Ok(Some((dictionary_of_shots(py, log)?, dictionary_of_record(py, given)?)))
    }

    /// How many bands are left.
    fn __len__(&self) -> usize {
        self.left().len()
    }

    fn __repr__(&self) -> String {
        let (design, scene) = (&self.design.name, &self.scene.name);
        format!("<macropulse.Records of {design} in {scene}: {} bands left>", self.__len__())
    }
}

/// Records one scan as the receiver of a sensor gets it: the log of its shots, and the record of its
/// readout. Nothing of the scene is in it.
///
/// A scan comes in bands of about 3400 shots. Each has guard shots at both ends, whose light overlaps
/// with that of its `owned` ones: they are decoded as well, and their returns dropped.
///
/// Args:
///     sensor: A `Sensor`, the name of a ready one, or a TOML file.
///     scene: A `Scene`, the name of a ready one, or a TOML file.
///     seed: Seed of the random numbers.
///     scan: Number of the scan, from 0.
///
/// Returns:
///     An iterator of pairs as `decode` takes them. Shots have `first` (number of the first one, from the
///     beginning of the first scan), `owned` (from, until: indices), and arrays: `fired_at_fs`, `row`,
///     `column`, `label`, `word` and `channel`. Ticks have `epoch` (absolute time of tick 0, in ticks), and
///     the arrays `tick`, `channel` (empty for a single detector) and `amplitude` (empty where not measured).
///     Samples have `epoch` (absolute time of the first, in ticks), `channel` (the detectors), and the array
///     `code`. It has a row for each detector and a column for each tick; 0 is the level without light.
///     The other records have a row for each shot. Histograms have `bin_fs`, `offset_fs` (time from the
///     firing to the first bin), `cycles` (laser pulses of each shot), and the array `counts`, with a column
///     for each bin. Taps have `codes`, with a column for each tap. Beats have `frequency` (in bins of the
///     spectrum) and `power`, with a column for each peak of each ramp.
///
/// Raises:
///     Error: As `simulate`.
#[pyfunction]
#[pyo3(signature = (sensor, scene, *, seed = 1, scan = 0))]
pub fn record(
    sensor: &Bound<'_, PyAny>,
    scene: &Bound<'_, PyAny>,
    #[pyo3(from_py_with = whole)] seed: u64,
    #[pyo3(from_py_with = whole)] scan: u64,
) -> PyResult<Records> {
    let design = Arc::clone(&Sensor::of(sensor)?.get().design);
    let scene = Arc::clone(&Scene::of(scene)?.get().scene);
    Operating::of(&design, &scene.environment).or_raise()?;
    check_scan(&design, scan)?;
    let mut left: Vec<Band> = bands(&design, scan).collect();
    left.reverse();
    Ok(Records { design, scene, seed, left: Mutex::new(left) })
}

/// Decodes a record, from a simulation or from hardware, with no scene: out of arrays, or out of files as
/// `macropulse decode` does.
///
/// Args:
///     sensor: A `Sensor`, the name of a ready one, or a TOML file: its code, timing and receiver.
///     shots: The log of its shots: a dictionary as `record` gives it, or the path of a shot log, text or
///         binary, as `simulate --format ticks` writes it. A dictionary has at least `fired_at_fs`, `row` and
///         `column`. Without `label` or `word`, these are the ones that the sensor would send. Without
///         `owned`, the returns of all shots are wanted. Without `first` or `channel`, these are 0.
///     ticks: A dictionary as `record` gives it, or a path if `shots` is one. Ticks have at least `tick`,
///         ascending; without `epoch` it is 0. Those of several detectors are sorted by `channel` first.
///         Samples have at least `code`; without `channel` its rows are all detectors in their order.
///     environment: Sun and air, for the `intensity` of the points.
///
/// Returns:
///     The points of the owned shots, without any truth. Files hold a single scan; of several,
///     `decode_scans` gives one after the other.
///
/// Raises:
///     Error: If columns are missing, out of order, of unequal length, or of another sensor; of a
///         file with the line or the byte.
///     OSError: If a file cannot be read.
///
/// Example:
///     >>> for shots, ticks in macropulse.record("peregrine", "wall"):
///     ...     band = macropulse.decode("peregrine", shots, ticks)
///     >>> scan = macropulse.decode("peregrine", "out/shots-000000.mps", "out/ticks-000000.mpt")
#[pyfunction]
#[pyo3(signature = (sensor, shots, ticks, *, environment = None))]
pub fn decode(
    sensor: &Bound<'_, PyAny>,
    shots: &Bound<'_, PyAny>,
    ticks: &Bound<'_, PyAny>,
    environment: Option<&Bound<'_, PyAny>>,
) -> PyResult<Scan> {
    let py = sensor.py();
    let (design, operating) = receiver(sensor, environment)?;
    let (Ok(shots), Ok(ticks)) = (shots.cast::<PyDict>(), ticks.cast::<PyDict>()) else {
        let several = "iterate over them: `for scan in macropulse.decode_scans(...)`";
        return recorded_at(py, (design, operating), paths(shots, ticks)?)?.only(py, several);
    };
    for (column, recorded) in [("tick", "ticks"), ("code", "samples")] {
        if shots.contains(column)? && ticks.contains("row")? {
            return Err(wrong(format!(
                "shots: has a column `{column}`; the shots come first, then the {recorded}"
            )));
        }
    }
    let log = shot_log(&design, shots)?;
    let given = record_of(&design, ticks)?;
    if given.is_empty() {
        let recorded = design.records().name();
        warned(py, format!("not a single point: there are no {recorded}"))?;
    } else if log.row.is_empty() {
        warned(py, "not a single point: there are no shots")?;
    }
    let receiver = Arc::clone(&design);
    let cloud = work::done(py, 0, move |_| {
        let design = &*receiver;
        let returns = design.receive(&log, &given)?;
        let piece = Piece::of(design, &Scale::of(design, &operating), &log, &returns);
        let frame = PointCloud::empty(design, piece.points.scan);
        let cloud = PointCloud::joined(&frame, &[piece]);
        // There is no truth to stand beside it.
        Ok::<_, macropulse::codec::decode::Error>(PointCloud { truth: Truth::default(), ..cloud })
    })?;
    Ok(Scan::new(cloud.or_raise()?, About { sensor: Some(design), ..About::default() }))
}

/// Decodes scan after scan out of files, in the memory of one, as `macropulse decode` does.
///
/// Args:
///     sensor: A `Sensor`, the name of a ready one, or a TOML file: its code, timing and receiver.
///     shots: Path of a shot log, text or binary.
///     ticks: Path of the ticks, text or binary; of a sampled sensor that of the samples.
///     environment: Sun and air, for the `intensity` of the points.
///
/// Returns:
///     An iterator of `Scan`, without any truth.
///
/// Raises:
///     Error: If a file is of another sensor, or something in it cannot be: with the line or the byte. An
///         error behind a scan is raised when the reading gets there.
///     OSError: If a file cannot be read.
#[pyfunction]
#[pyo3(signature = (sensor, shots, ticks, *, environment = None))]
pub fn decode_scans(
    sensor: &Bound<'_, PyAny>,
    shots: PathBuf,
    ticks: PathBuf,
    environment: Option<&Bound<'_, PyAny>>,
) -> PyResult<StoredScans> {
    recorded_at(sensor.py(), receiver(sensor, environment)?, [shots, ticks])
}

/// The sensor that an argument names, in sun and air.
fn receiver(
    sensor: &Bound<'_, PyAny>,
    environment: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Arc<Design>, Operating)> {
    let design = Arc::clone(&Sensor::of(sensor)?.get().design);
    let operating = Operating::of(&design, &values::environment(environment)?).or_raise()?;
    Ok((design, operating))
}

fn paths(shots: &Bound<'_, PyAny>, ticks: &Bound<'_, PyAny>) -> PyResult<[PathBuf; 2]> {
    match (shots.extract(), ticks.extract()) {
        (Ok(shots), Ok(ticks)) => Ok([shots, ticks]),
        _ => Err(wrong(format!(
            "shots and {}: give two dictionaries of columns, or the paths of two files",
            RecordKind::listed("or")
        ))),
    }
}
