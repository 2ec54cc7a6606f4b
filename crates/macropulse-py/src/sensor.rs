//! Sensors.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use macropulse::design::{Design, preset_names, preset_text};
use macropulse::scene::Scene;
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple, PyType};

use crate::error::{OrRaise, of_file, wrong};
use crate::values::{Reader, changes};
use crate::work;

/// Name of dictionaries in messages.
pub const DICTIONARY: &str = "the dictionary";

/// A lidar: where and when it looks, the light and the code that it sends, its detector, its
/// converters and its receiver; checked when it is made.
///
/// Args:
///     name_or_path: A ready one, as `macropulse.sensors()` lists them, a TOML file, or a `Sensor`.
///     changes: Values that are changed: dotted keys of the sensor file, as
///         `{"scan.raster.rows": 24}`. The keys `"with"` and `"without"` take an effect, or a list
///         of them, off the list of those left out, or put it there.
///
/// Raises:
///     Error: If a name, a key or a value is wrong; the sentence says where, and what to do.
///     OSError: If the file cannot be read.
#[pyclass(frozen, module = "macropulse")]
pub struct Sensor {
    /// As the simulator has it.
    pub design: Arc<Design>,
}

impl Sensor {
    fn made(
        py: Python<'_>,
        make: impl FnOnce() -> Result<Design, macropulse::design::Error> + Send + 'static,
    ) -> PyResult<Self> {
        let design = work::done(py, 0, |_| make())?.or_raise()?;
        Ok(Self { design: Arc::new(design) })
    }

    /// The sensor that an argument names.
    ///
    /// # Errors
    /// If it names none.
    pub fn of<'py>(given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, Self>> {
        match given.cast::<Self>() {
            Ok(sensor) => Ok(sensor.clone()),
            Err(_) => Bound::new(given.py(), Self::new(given, None)?),
        }
    }
}

#[pymethods]
impl Sensor {
    #[new]
    #[pyo3(signature = (name_or_path, changes = None))]
    fn new(name_or_path: &Bound<'_, PyAny>, changes: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let py = name_or_path.py();
        let changes = self::changes(changes, false)?;
        if let Ok(sensor) = name_or_path.cast::<Self>() {
            let design = Arc::clone(&sensor.get().design);
            return match changes.is_empty() {
                true => Ok(Self { design }),
                false => Self::made(py, move || {
                    Design::from_toml(&design.text, &design.name, Path::new(""), &changes)
                }),
            };
        }
        let name = named(name_or_path, ("sensor", "Sensor"))?;
        if preset_text(&name).is_none() {
            check_readable(&name)?;
        }
        Self::made(py, move || Design::open(&name, &changes))
    }

    /// The sensor in the file at `path`, whatever ready ones are called.
    ///
    /// Args:
    ///     path: A TOML file.
    ///     changes: As those of the class.
    #[classmethod]
    #[pyo3(signature = (path, changes = None))]
    fn open(
        _class: &Bound<'_, PyType>,
        path: PathBuf,
        changes: Option<&Bound<'_, PyDict>>,
        py: Python<'_>,
    ) -> PyResult<Self> {
        let changes = self::changes(changes, false)?;
        let text = macropulse::opened::text(&path).map_err(|why| of_file(&path, &why))?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let origin = path.display().to_string();
        Self::made(py, move || Design::from_toml(&text, &origin, &folder, &changes))
    }

    /// The sensor that a dictionary describes, as a sensor file does.
    ///
    /// Args:
    ///     description: Keys as in a sensor file, nested: `{"extends": "peregrine", "name": "mine",
    ///         "scan": {"max_range_m": 40}}`.
    ///     folder: Folder in which files named in `extends` are looked for.
    #[classmethod]
    #[pyo3(signature = (description, folder = None))]
    fn from_dict(
        _class: &Bound<'_, PyType>,
        description: &Bound<'_, PyDict>,
        folder: Option<PathBuf>,
        py: Python<'_>,
    ) -> PyResult<Self> {
        let mut reader = Reader::default();
        let table = reader.table(description, "", 0)?;
        if !reader.meshes.is_empty() {
            return Err(wrong("a mesh is no part of a sensor; it belongs to a scene"));
        }
        let folder = folder.unwrap_or_default();
        Self::made(py, move || Design::from_table(&table, DICTIONARY, &folder, &[]))
    }

    /// The sensor that a text describes, as a sensor file does.
    ///
    /// Args:
    ///     text: TOML.
    ///     folder: Folder in which files named in `extends` are looked for.
    #[classmethod]
    #[pyo3(signature = (text, folder = None))]
    fn from_toml(
        _class: &Bound<'_, PyType>,
        text: String,
        folder: Option<PathBuf>,
        py: Python<'_>,
    ) -> PyResult<Self> {
        let folder = folder.unwrap_or_default();
        Self::made(py, move || Design::from_toml(&text, "the text", &folder, &[]))
    }

    /// The whole sensor as TOML, defaults included: the text of a sensor file.
    fn to_toml(&self) -> String {
        self.design.text.clone()
    }

    /// Short name.
    #[getter]
    fn name(&self) -> &str {
        &self.design.name
    }

    /// One sentence about it.
    #[getter]
    fn summary(&self) -> &str {
        &self.design.summary
    }

    /// Rows and columns of pixels.
    #[getter]
    fn shape(&self) -> (u32, u32) {
        (self.design.scan.rows, self.design.scan.columns)
    }

    /// Shots of one scan.
    #[getter]
    fn shots_per_scan(&self) -> u64 {
        self.design.shots_per_scan()
    }

    /// Duration of one scan, s.
    #[getter]
    fn scan_period_s(&self) -> f64 {
        self.design.scan_period()
    }

    /// Nearest and farthest range that the receiver accepts, m.
    #[getter]
    fn range_gate_m(&self) -> (f64, f64) {
        (self.design.scan.min_range, self.design.scan.max_range)
    }

    /// Length of a tick of its converters, fs.
    #[getter]
    fn tick_fs(&self) -> i64 {
        self.design.clock.tick_fs
    }

    /// True if its shots carry a code.
    #[getter]
    fn is_coded(&self) -> bool {
        self.design.is_coded()
    }

    /// Effects that it leaves out.
    #[getter]
    fn idealised(&self) -> Vec<&'static str> {
        self.design.idealised.iter().map(|effect| effect.name()).collect()
    }

    /// Values that its file leaves open: dotted keys, and the defaults taken, as TOML.
    #[getter]
    fn defaults<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let defaults = PyDict::new(py);
        for (key, value) in &self.design.defaults {
            defaults.set_item(key, value)?;
        }
        Ok(defaults)
    }

    /// Facts about it that should be known although they are no errors.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.design.warnings.clone()
    }

    /// A hash of everything that its file says, defaults included.
    #[getter]
    fn digest(&self) -> String {
        self.design.digest()
    }

    /// Viewing directions of its pixels: unit vectors in the frame of the sensor (x forward, y left, z up),
    /// shape (rows, columns, 3).
    fn directions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (rows, columns) = (self.design.scan.rows as usize, self.design.scan.columns as usize);
        let directions = self.design.directions();
        let pixels = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let flat: Vec<f64> =
            pixels.flat_map(|(row, column)| directions.of(row as u16, column as u16)).collect();
        PyArray1::from_vec(py, flat).reshape([rows, columns, 3])
    }

    fn __repr__(&self) -> String {
        let design = &*self.design;
        let (rows, columns) = (design.scan.rows, design.scan.columns);
        let code = match design.is_coded() {
            true => design.emission.coding().codebook.family().to_string(),
            false => "one mark a shot".to_owned(),
        };
        let receiver = design.receiver.method.kind().name();
        let (near, far) = (design.scan.min_range, design.scan.max_range);
        format!(
            "<macropulse.Sensor {}: {rows} x {columns} pixels in {:.4} s, {code}, {receiver} \
             receiver, {near} to {far} m>",
            design.name,
            design.scan_period(),
        )
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.design.text == other.design.text
    }

    fn __hash__(&self) -> u64 {
        self.design
            .text
            .bytes()
            .fold(0, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let make = slf.get_type().getattr("from_toml")?;
        Ok((make, PyTuple::new(slf.py(), [slf.get().to_toml()])?))
    }
}

/// The name or path in an argument.
///
/// # Errors
/// `TypeError` if it is neither.
pub fn named(given: &Bound<'_, PyAny>, (what, class): (&str, &str)) -> PyResult<String> {
    if let Ok(text) = given.cast::<PyString>() {
        let text = text.to_str()?;
        let other = match what {
            "sensor" => Scene::builtin(text).map(|_| "scene"),
            _ => preset_text(text).map(|_| "sensor"),
        };
        return match other {
            Some(other) => Err(wrong(format!(
                "{text}: is a {other}, where a {what} is wanted; the sensor comes first, then the \
                 scene"
            ))),
            None => Ok(text.to_owned()),
        };
    }
    given.extract::<PathBuf>().map(|path| path.display().to_string()).map_err(|_| {
        let kind = given.get_type().name().map_or_else(|_| "?".to_owned(), |name| name.to_string());
        pyo3::exceptions::PyTypeError::new_err(format!(
            "a {what} is a name, a path or a macropulse.{class}, not of type {kind}; a dictionary \
             goes to macropulse.{class}.from_dict"
        ))
    })
}

/// Refuses what looks like a path and cannot be read, as Python does.
///
/// # Errors
/// `OSError`, mostly `FileNotFoundError`.
pub fn check_readable(name: &str) -> PyResult<()> {
    let path = Path::new(name);
    let looks_like_one = path.extension().is_some() || path.components().count() > 1;
    if !looks_like_one && !path.exists() {
        return Ok(());
    }
    fs::metadata(path)
        .and_then(|found| match () {
            () if found.is_dir() => Err(std::io::Error::from_raw_os_error(IS_A_FOLDER)),
            () if found.is_file() => fs::File::open(path).map(|_| ()),
            // To open a pipe is to wait for whoever writes to it.
            () => Ok(()),
        })
        .map_err(|why| of_file(path, &why))
}

/// The number that systems have for what is a folder and should not be.
const IS_A_FOLDER: i32 = 21;

/// Names of the ready sensors.
///
/// Returns:
///     Names that `Sensor` and every function that takes a sensor know.
#[pyfunction]
pub fn sensors() -> Vec<&'static str> {
    preset_names().collect()
}
