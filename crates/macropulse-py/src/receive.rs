//! The receiver's side alone: what it is given of a scan, and what it makes of that.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use macropulse::channel::Operating;
use macropulse::codec::{
    Beats, Given, Histograms, Peak, RecordKind, Samples, ShotLog, Taps, Ticks,
};
use macropulse::design::Design;
use macropulse::emit::{Band, Shot, bands, shot_of_pixel};
use macropulse::points::{Piece, PointCloud, Scale, Truth};
use macropulse::scene::Scene as Simulated;
use macropulse::sim::{self, Scans};
use macropulse::told;
use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use crate::error::{OrRaise, check_scan, warned, wrong};
use crate::files::{StoredScans, recorded_at};
use crate::scan::{About, Scan};
use crate::scene::Scene;
use crate::sensor::Sensor;
use crate::values::whole;
use crate::{values, work};

/// Shots are numbered up to here: more than any sensor fires in its time.
const MOST_SHOTS: u64 = 1 << 60;

/// Keys of the dictionaries of shots, ticks and other records.
const SHOTS: [&str; 8] =
    ["first", "owned", "fired_at_fs", "row", "column", "label", "word", "channel"];
const TICKS: [&str; 4] = ["epoch", "tick", "channel", "amplitude"];
const SAMPLES: [&str; 3] = ["epoch", "channel", "code"];
const HISTOGRAMS: [&str; 4] = ["bin_fs", "offset_fs", "cycles", "counts"];
const TAPS: [&str; 1] = ["codes"];

/// The columns of beats.
const BEATS: [&str; 2] = ["frequency", "power"];

/// The receiver's input for one scan, band after band: `for shots, ticks in record(...)`, or samples.
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
        let given = match given {
            Given::Ticks(ticks) => told_of_ticks(py, ticks)?,
            Given::Samples(samples) => told_of_samples(py, samples)?,
            Given::Histograms(histograms) => told_of_histograms(py, histograms)?,
            Given::Taps(taps) => told_of_taps(py, taps)?,
            Given::Beats(beats) => told_of_beats(py, &beats)?,
        };
        Ok(Some((told_of_shots(py, log)?, given)))
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

/// Records one scan as the receiver of a sensor gets it: the log of its shots, and the ticks of its
/// converters. A sampled sensor gives samples in place of ticks. Nothing of the scene is in it.
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

fn told_of_shots(py: Python<'_>, log: ShotLog) -> PyResult<Bound<'_, PyDict>> {
    let told = PyDict::new(py);
    told.set_item("first", log.first)?;
    told.set_item("owned", (log.owned.start, log.owned.end))?;
    told.set_item("fired_at_fs", PyArray1::from_vec(py, log.fired_at_fs))?;
    told.set_item("row", PyArray1::from_vec(py, log.row))?;
    told.set_item("column", PyArray1::from_vec(py, log.column))?;
    told.set_item("label", PyArray1::from_vec(py, log.label))?;
    told.set_item("word", PyArray1::from_vec(py, log.word))?;
    told.set_item("channel", PyArray1::from_vec(py, log.channel))?;
    Ok(told)
}

fn told_of_ticks(py: Python<'_>, ticks: Ticks) -> PyResult<Bound<'_, PyDict>> {
    let told = PyDict::new(py);
    told.set_item("epoch", ticks.epoch)?;
    told.set_item("tick", PyArray1::from_vec(py, ticks.tick))?;
    told.set_item("channel", PyArray1::from_vec(py, ticks.channel))?;
    told.set_item("amplitude", PyArray1::from_vec(py, ticks.amplitude))?;
    Ok(told)
}

fn told_of_samples(py: Python<'_>, samples: Samples) -> PyResult<Bound<'_, PyDict>> {
    let told = PyDict::new(py);
    let shape = [samples.channel.len(), samples.per_channel()];
    told.set_item("epoch", samples.epoch)?;
    told.set_item("channel", PyArray1::from_vec(py, samples.channel))?;
    told.set_item("code", PyArray1::from_vec(py, samples.code).reshape(shape)?)?;
    Ok(told)
}

fn told_of_histograms(py: Python<'_>, histograms: Histograms) -> PyResult<Bound<'_, PyDict>> {
    let told = PyDict::new(py);
    let shape = [histograms.len(), histograms.bins as usize];
    told.set_item("bin_fs", histograms.bin_fs)?;
    told.set_item("offset_fs", histograms.offset_fs)?;
    told.set_item("cycles", PyArray1::from_vec(py, histograms.cycles))?;
    told.set_item("counts", PyArray1::from_vec(py, histograms.counts).reshape(shape)?)?;
    Ok(told)
}

fn told_of_taps(py: Python<'_>, taps: Taps) -> PyResult<Bound<'_, PyDict>> {
    let told = PyDict::new(py);
    let each = taps.taps.max(1) as usize;
    let shape = [taps.codes.len() / each, each];
    told.set_item("codes", PyArray1::from_vec(py, taps.codes).reshape(shape)?)?;
    Ok(told)
}

fn told_of_beats<'py>(py: Python<'py>, beats: &Beats) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    let each = (beats.ramps * beats.peaks).max(1) as usize;
    let shape = [beats.found.len() / each, each];
    let frequency: Vec<f64> = beats.found.iter().map(|peak| peak.bins()).collect();
    let power: Vec<f64> = beats.found.iter().map(|peak| peak.power()).collect();
    for (key, column) in BEATS.into_iter().zip([frequency, power]) {
        told.set_item(key, PyArray1::from_vec(py, column).reshape(shape)?)?;
    }
    Ok(told)
}

/// Decodes ticks, samples, histograms, taps or beats, from a simulation or from hardware, with no scene: out of arrays, or out
/// of files as `macropulse decode` does.
///
/// Args:
///     sensor: A `Sensor`, the name of a ready one, or a TOML file: its code, timing and receiver.
///     shots: The log of its shots: a dictionary as `record` gives it, or the path of a shot log, text or
///         binary, as `simulate --format ticks` writes it. A dictionary has at least `fired_at_fs`, `row` and
///         `column`. Without `label` or `word`, these are the ones that the sensor would send. Without
///         `owned`, the returns of all shots are wanted. Without `first` or `channel`, these are 0.
///     ticks: A dictionary as `record` gives it, or a path if `shots` is one. Ticks have at least `tick`,
///         ascending; without `epoch` it is 0. Those of several detectors are sorted by `channel` first. A
///         sampled sensor takes samples, with at least `code`; without `channel` its rows are all detectors
///         in their order.
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
    check_keys(shots, "shots", &SHOTS)?;
    let log = shot_log(&design, shots)?;
    let given = match design.records() {
        RecordKind::Samples => Given::Samples(samples_of(&design, ticks)?),
        RecordKind::Ticks => Given::Ticks(ticks_of(&design, ticks)?),
        RecordKind::Histograms => Given::Histograms(histograms_of(&design, ticks)?),
        RecordKind::Taps => Given::Taps(taps_of(&design, ticks)?),
        RecordKind::Beats => Given::Beats(beats_of(&design, ticks)?),
    };
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
        _ => Err(wrong(
            "shots and ticks, samples, histograms, taps or beats: give two dictionaries of columns, or the paths of two files",
        )),
    }
}

/// The ticks that a dictionary holds.
fn ticks_of(design: &Design, given: &Bound<'_, PyDict>) -> PyResult<Ticks> {
    if given.contains("code")? {
        return Err(wrong(format!(
            "ticks: has a column `code`, and {} records ticks; is it the sensor that the samples are of?",
            design.name
        )));
    }
    check_keys(given, "ticks", &TICKS)?;
    let ticks = Ticks {
        epoch: entry(given, ("ticks", "epoch", "a whole number, of ticks"), || 0)?,
        tick: column(given, ("ticks", "tick"), None)?,
        channel: column(given, ("ticks", "channel"), Some(Vec::new()))?,
        amplitude: column(given, ("ticks", "amplitude"), Some(Vec::new()))?,
    };
    check_below(design, ("ticks", "channel"), &ticks.channel, design.channels())?;
    Ok(ticks)
}

/// The samples that a dictionary holds.
fn samples_of(design: &Design, given: &Bound<'_, PyDict>) -> PyResult<Samples> {
    if given.contains("tick")? {
        return Err(wrong(format!(
            "samples: has a column `tick`, and {} is sampled; is it the sensor that the ticks are of?",
            design.name
        )));
    }
    check_keys(given, "samples", &SAMPLES)?;
    let Some(code) = given.get_item("code")? else {
        return Err(wrong("samples: there is no column `code`"));
    };
    let typed = given.py().import("numpy")?.call_method1("asarray", (&code,))?;
    let shape: Vec<usize> = typed.getattr("shape")?.extract()?;
    let rows = match shape[..] {
        [_] => 1,
        [rows, _] => rows,
        _ => {
            return Err(wrong(format!(
                "samples: `code` has {} dimensions; give it a row for each channel and a column for each \
                 tick",
                shape.len()
            )));
        }
    };
    let flat = PyDict::new(given.py());
    flat.set_item("code", typed.call_method0("ravel")?)?;
    let all = (0..=u16::MAX).take(rows).collect();
    let channel: Vec<u16> = column(given, ("samples", "channel"), Some(all))?;
    if channel.len() != rows {
        let count = channel.len();
        return Err(wrong(format!(
            "samples: `code` has {rows} rows for {count} channels; give it a row for each"
        )));
    }
    check_below(design, ("samples", "channel"), &channel, design.channels())?;
    Ok(Samples {
        epoch: entry(given, ("samples", "epoch", "a whole number, of ticks"), || 0)?,
        channel,
        code: column(&flat, ("samples", "code"), None)?,
    })
}

/// The log that a dictionary holds, all of whose pixels are the sensor's.
fn shot_log(design: &Design, shots: &Bound<'_, PyDict>) -> PyResult<ShotLog> {
    let row: Vec<u16> = column(shots, ("shots", "row"), None)?;
    let columns: Vec<u16> = column(shots, ("shots", "column"), None)?;
    check_below(design, ("shots", "row"), &row, design.scan.rows)?;
    check_below(design, ("shots", "column"), &columns, design.scan.columns)?;
    let sent = row
        .iter()
        .zip(&columns)
        .map(|(row, column)| shot_of_pixel(design, 0, u32::from(*row), u32::from(*column)));
    let sent: Vec<Shot> = sent.flatten().collect();
    let first: u64 = entry(shots, ("shots", "first", "a whole number, 0 or more"), || 0)?;
    if first > MOST_SHOTS {
        return Err(wrong(format!("shots: first is {first}; it must be {MOST_SHOTS} at most")));
    }
    let owned = ("shots", "owned", "two whole numbers, from and until, as (0, 3400)");
    let owned: (usize, usize) = entry(shots, owned, || (0, row.len()))?;
    let channel: Vec<u16> = column(shots, ("shots", "channel"), Some(vec![0; row.len()]))?;
    check_below(design, ("shots", "channel"), &channel, design.channels())?;
    Ok(ShotLog {
        first,
        fired_at_fs: column(shots, ("shots", "fired_at_fs"), None)?,
        label: column(shots, ("shots", "label"), Some(sent.iter().map(|s| s.label).collect()))?,
        word: column(shots, ("shots", "word"), Some(sent.iter().map(|s| s.word).collect()))?,
        channel,
        owned: owned.0..owned.1,
        row,
        column: columns,
    })
}

/// Refuses a column that has a number beyond those of the sensor, which are below `end`.
fn check_below(
    design: &Design,
    (what, name): (&str, &str),
    entries: &[u16],
    end: u32,
) -> PyResult<()> {
    let Some(beyond) = entries.iter().find(|entry| u32::from(**entry) >= end) else {
        return Ok(());
    };
    let (sensor, last) = (&design.name, end.saturating_sub(1));
    Err(wrong(format!(
        "{what}: {name} has {beyond}, and {sensor} has 0 to {last}; is it the sensor that they were \
         recorded with?"
    )))
}

/// A single value of a dictionary; `wanted` says what it must be.
fn entry<'py, T: for<'a> FromPyObject<'a, 'py>>(
    given: &Bound<'py, PyDict>,
    (what, key, wanted): (&str, &str, &str),
    otherwise: impl FnOnce() -> T,
) -> PyResult<T> {
    match given.get_item(key)? {
        None => Ok(otherwise()),
        Some(value) => value
            .extract()
            .map_err(|_| wrong(format!("{what}: {key} is {value}; it must be {wanted}"))),
    }
}

/// Refuses a key of a dictionary that is none of those `known`: a misspelt one would be passed over.
fn check_keys(given: &Bound<'_, PyDict>, what: &str, known: &[&str]) -> PyResult<()> {
    for key in given.keys() {
        let key = key.str()?.to_string();
        if !known.contains(&key.as_str()) {
            return Err(wrong(format!("{what}: {}", told::unknown("column", &key, known))));
        }
    }
    Ok(())
}

/// A kind of number that columns have, in words.
trait Number: Element + Copy {
    const WORDS: &'static str;
    const IS_WHOLE: bool = true;
}

impl Number for u16 {
    const WORDS: &'static str = "whole numbers from 0 to 65535";
}

impl Number for i16 {
    const WORDS: &'static str = "whole numbers from -32768 to 32767";
}

impl Number for u32 {
    const WORDS: &'static str = "whole numbers from 0 to 4294967295";
}

impl Number for i64 {
    const WORDS: &'static str = "whole numbers";
}

impl Number for f32 {
    const WORDS: &'static str = "finite numbers";
    const IS_WHOLE: bool = false;
}

impl Number for f64 {
    const WORDS: &'static str = "finite numbers";
    const IS_WHOLE: bool = false;
}

/// A column of a dictionary, copied; whole numbers that do not fit are refused, not cut.
fn column<T: Number>(
    given: &Bound<'_, PyDict>,
    (what, key): (&str, &str),
    otherwise: Option<Vec<T>>,
) -> PyResult<Vec<T>> {
    let py = given.py();
    let Some(value) = given.get_item(key)? else {
        return otherwise.ok_or_else(|| wrong(format!("{what}: there is no column `{key}`")));
    };
    let refused = |found: String| {
        let wanted = T::WORDS;
        wrong(format!("{what}: the column `{key}` must be {wanted}, in a list or array; {found}"))
    };
    let numpy = py.import("numpy")?;
    let typed = numpy
        .call_method1("asarray", (&value,))
        .map_err(|_| refused("its entries are lists".into()))?;
    if typed.getattr("ndim")?.extract::<usize>()? != 1 {
        return Err(refused(format!("its shape is {}", typed.getattr("shape")?)));
    }
    if typed.len()? == 0 {
        return Ok(Vec::new());
    }
    let kind: String = typed.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["i", "u", "f"].contains(&kind.as_str()) {
        return Err(refused(format!("its first entry is {}", typed.get_item(0)?.repr()?)));
    }
    let fits = quietly(&numpy, || typed.call_method1("astype", (numpy::dtype::<T>(py),)))?;
    let is_same = match T::IS_WHOLE {
        true => numpy.call_method1("equal", (&typed, &fits))?,
        false => numpy.call_method1("isfinite", (&fits,))?,
    };
    let first = is_same.call_method0("argmin")?;
    if !is_same.get_item(&first)?.is_truthy()? {
        let entry = typed.get_item(&first)?;
        return Err(refused(format!("entry {first} is {entry}")));
    }
    let array: PyReadonlyArray1<'_, T> = fits.extract()?;
    Ok(array.as_array().to_vec())
}

/// Returns the result of `made`, without NumPy's warning that a number does not fit. The caller checks that.
fn quietly<'py, T>(
    numpy: &Bound<'py, PyModule>,
    made: impl FnOnce() -> PyResult<T>,
) -> PyResult<T> {
    let py = numpy.py();
    let options = [("invalid", "ignore"), ("over", "ignore")].into_py_dict(py)?;
    let quiet = numpy.call_method("errstate", (), Some(&options))?;
    quiet.call_method0("__enter__")?;
    let outcome = made();
    quiet.call_method1("__exit__", (py.None(), py.None(), py.None()))?;
    outcome
}

/// The column `key` of a dictionary, which has a row for each shot and a column for each `item`: how many of both, and
/// its entries behind each other.
fn by_shot<T: Number>(
    given: &Bound<'_, PyDict>,
    (what, key, item): (&str, &str, &str),
) -> PyResult<([usize; 2], Vec<T>)> {
    let Some(table) = given.get_item(key)? else {
        return Err(wrong(format!("{what}: there is no column `{key}`")));
    };
    let typed = given.py().import("numpy")?.call_method1("asarray", (&table,))?;
    let shape: Vec<usize> = typed.getattr("shape")?.extract()?;
    let [rows, columns] = shape[..] else {
        return Err(wrong(format!(
            "{what}: `{key}` has {} dimensions; give it a row for each shot and a column for each {item}",
            shape.len()
        )));
    };
    let flat = PyDict::new(given.py());
    flat.set_item(key, typed.call_method0("ravel")?)?;
    Ok(([rows, columns], column(&flat, (what, key), None)?))
}

/// The taps that a dictionary holds.
fn taps_of(design: &Design, given: &Bound<'_, PyDict>) -> PyResult<Taps> {
    check_keys(given, "taps", &TAPS)?;
    let ([_, taps], codes) = by_shot(given, ("taps", "codes", "tap"))?;
    let wanted = design.tap_header().map_or(0, |header| header.taps);
    if taps != wanted as usize {
        let name = &design.name;
        return Err(wrong(format!(
            "taps: `codes` has {taps} columns, and {name} has {wanted} taps"
        )));
    }
    Ok(Taps { taps: wanted, codes })
}

fn histograms_of(design: &Design, given: &Bound<'_, PyDict>) -> PyResult<Histograms> {
    check_keys(given, "histograms", &HISTOGRAMS)?;
    let ([rows, bins], counts) = by_shot(given, ("histograms", "counts", "bin"))?;
    let tick_fs = design.clock.tick_fs;
    let bin_fs: i64 =
        entry(given, ("histograms", "bin_fs", "a whole number, of femtoseconds"), || tick_fs)?;
    if bin_fs != tick_fs {
        return Err(wrong(format!(
            "histograms: bins of {bin_fs} fs, but those of {} are {tick_fs} fs wide",
            design.name
        )));
    }
    let pulses = design.emission.burst().map_or(1, |burst| burst.pulses);
    Ok(Histograms {
        bin_fs,
        offset_fs: entry(
            given,
            ("histograms", "offset_fs", "a whole number, of femtoseconds"),
            || 0,
        )?,
        bins: bins as u32,
        cycles: column(given, ("histograms", "cycles"), Some(vec![pulses; rows]))?,
        counts,
    })
}

/// The beats that a dictionary holds.
fn beats_of(design: &Design, given: &Bound<'_, PyDict>) -> PyResult<Beats> {
    check_keys(given, "beats", &BEATS)?;
    let ([shots, places], frequency): ([usize; 2], Vec<f64>) =
        by_shot(given, ("beats", "frequency", "place for a peak"))?;
    let (shape, power): ([usize; 2], Vec<f64>) =
        by_shot(given, ("beats", "power", "place for a peak"))?;
    let (ramps, peaks) = design.beat_header().map_or((0, 0), |it| (it.ramps, it.peaks));
    if places != (ramps * peaks) as usize {
        let name = &design.name;
        return Err(wrong(format!(
            "beats: `frequency` has {places} columns, and {name} has {ramps} ramps with {peaks} peaks each"
        )));
    }
    if shape != [shots, places] {
        return Err(wrong(format!(
            "beats: `power` has the shape {shape:?}, and `frequency` has {:?}",
            [shots, places]
        )));
    }
    let found = frequency.into_iter().zip(power).map(|(bins, power)| Peak::of(bins, power));
    Ok(Beats { ramps, peaks, found: found.collect() })
}
