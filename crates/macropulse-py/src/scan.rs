//! Scans: columns, images, files.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use macropulse::design::Design;
use macropulse::names::nearest;
use macropulse::points::{Attribute, Entries, Outcome, PointCloud};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::{PyImportError, PyModuleNotFoundError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;

use crate::columns::lent;
use crate::error::wrong;
use crate::sensor::Sensor;
use crate::values::from_json;
use crate::{files, images, show};

/// The points of one scan, as columns: NumPy arrays with an entry for each return, in the order in
/// which the shots were fired, those of one shot nearest first.
///
/// The arrays lend the memory of the scan: nothing is copied, none can be written to, and each keeps
/// the scan alive. Coordinates are in the frame of the sensor: x forward, y left, z up, metres; where
/// the sensor was then is in `position_m` and `rotation`.
#[pyclass(frozen, module = "macropulse")]
pub struct Scan {
    /// The points.
    pub cloud: PointCloud,
    /// Columns that the cloud does not have as such, each computed when it is first asked for.
    computed: [OnceLock<Entries<'static>>; Attribute::ALL.len()],
    /// The sensor that has measured it.
    sensor: Option<Arc<Design>>,
    /// Names of the scene's objects.
    pub objects: Vec<String>,
    /// Names of the scene's materials.
    pub materials: Vec<String>,
    manifest: Value,
}

/// The description of a scan beside its points.
#[derive(Default)]
pub struct About {
    /// The sensor that has measured it.
    pub sensor: Option<Arc<Design>>,
    /// Names of the scene's objects.
    pub objects: Vec<String>,
    /// Names of the scene's materials.
    pub materials: Vec<String>,
    /// The data needed to repeat and to judge it; null if it was not simulated here.
    pub manifest: Value,
}

impl Scan {
    /// The scan of these points.
    pub fn new(cloud: PointCloud, about: About) -> Self {
        let About { sensor, objects, materials, manifest } = about;
        let computed = std::array::from_fn(|_| OnceLock::new());
        Self { cloud, computed, sensor, objects, materials, manifest }
    }

    /// The attributes that it has.
    fn attributes(&self) -> impl Iterator<Item = Attribute> + '_ {
        Attribute::ALL.into_iter().filter(|attribute| attribute.is_in(&self.cloud))
    }

    /// The attribute called `name`, which it has.
    ///
    /// # Errors
    /// If there is none; the message names the nearest.
    pub fn known(&self, name: &str) -> PyResult<Attribute> {
        match Attribute::named(name) {
            Some(attribute) if attribute.is_in(&self.cloud) => Ok(attribute),
            Some(attribute) => Err(absent(attribute)),
            None => {
                let known: Vec<&str> = self.attributes().map(Attribute::name).collect();
                let hint = nearest(name, known.iter().copied())
                    .map(|near| format!("did you mean `{near}`? "))
                    .unwrap_or_default();
                let known = known.join(", ");
                Err(wrong(format!("there is no column `{name}`; {hint}known are {known}")))
            }
        }
    }

    /// The column of an attribute as an array, which lends the memory of `slf`. For a range that it does
    /// not have stands the distance of the point from the origin.
    ///
    /// # Errors
    /// If it does not have the attribute.
    pub fn array<'py>(slf: &Bound<'py, Self>, attribute: Attribute) -> Array<'py> {
        let Self { cloud, computed, .. } = slf.get();
        let kept = &computed[attribute as usize];
        if let Some(entries) = kept.get() {
            return lent(slf, entries);
        }
        match attribute.entries(cloud) {
            Some(entries) if attribute.is_computed() => {
                lent(slf, kept.get_or_init(|| entries.into_owned()))
            }
            Some(entries) => lent(slf, &entries),
            None if attribute == Attribute::Range => {
                lent(slf, kept.get_or_init(|| Entries::F4(cloud.distances().into_owned().into())))
            }
            None => Err(absent(attribute)),
        }
    }
}

type Array<'py> = PyResult<Bound<'py, PyAny>>;

/// Why a scan does not have an attribute.
fn absent(attribute: Attribute) -> PyErr {
    let name = attribute.name();
    wrong(match attribute.is_true() {
        true => format!(
            "there is no {name}: the scan has no truth beside its points, as one that was decoded or \
             read from a file without it"
        ),
        false => format!("there is no {name}: the file of the scan does not have it"),
    })
}

#[pymethods]
impl Scan {
    /// All columns by name that the scan has: a simulated one all, with the truth; one that was read
    /// those of its file.
    ///
    /// Returns:
    ///     A dictionary of arrays, as `pandas.DataFrame` and `numpy.savez` take it.
    fn columns<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(slf.py());
        for attribute in slf.get().attributes() {
            columns.set_item(attribute.name(), Self::array(slf, attribute)?)?;
        }
        Ok(columns)
    }

    /// The points, shape (n, 3), m: a copy. They are float32, or float64 where the file of the scan
    /// has more digits, as `x` is.
    fn xyz<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let cloud = &self.cloud;
        let shape = [cloud.returns(), 3];
        if cloud.exact.x.is_empty() {
            let points = cloud.x.iter().zip(&cloud.y).zip(&cloud.z);
            let flat: Vec<f32> = points.flat_map(|((x, y), z)| [*x, *y, *z]).collect();
            return Ok(PyArray1::from_vec(py, flat).reshape(shape)?.into_any());
        }
        let flat: Vec<f64> = (0..cloud.returns()).flat_map(|at| cloud.position(at)).collect();
        Ok(PyArray1::from_vec(py, flat).reshape(shape)?.into_any())
    }

    /// A column as an image, one return of each pixel.
    ///
    /// Args:
    ///     name: Name of a column.
    ///     pick: Which return of a pixel is shown: "first", "strongest" or "last"; as the sensor
    ///         file has it if left out.
    ///
    /// Returns:
    ///     A new array of shape (rows, columns), row 0 at the top. A pixel without a return is NaN in real
    ///     numbers and 0 in whole ones. In columns of the truth it has the value of the first surface along
    ///     its beam. There `outcome` tells the pixels that are empty (0) from those that missed (4).
    #[pyo3(signature = (name = "range", pick = None))]
    fn image<'py>(
        &self,
        name: &str,
        pick: Option<&str>,
        py: Python<'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        images::image(py, self, name, pick)
    }

    /// Number of the scan, from 0.
    #[getter]
    fn number(&self) -> u64 {
        self.cloud.scan
    }

    /// When the scan was taken, ns of Unix time, of a scan whose file tells it; `time_ns` then counts from
    /// it. None of a simulated one.
    #[getter]
    fn stamp_ns(&self) -> Option<u64> {
        self.cloud.stamp_ns
    }

    /// Rows and columns of pixels; (0, 0) for a list without an image.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.cloud.rows, self.cloud.columns)
    }

    /// Position of the sensor in the world when the scan began, m.
    #[getter]
    fn position_m(&self) -> [f64; 3] {
        self.cloud.viewpoint.position
    }

    /// The turn that carries directions of the sensor into the world: a unit quaternion w, x, y, z.
    #[getter]
    fn rotation(&self) -> [f64; 4] {
        self.cloud.viewpoint.turn
    }

    /// The sensor that has measured it; None for a scan that was read from a file.
    #[getter]
    fn sensor(&self) -> Option<Sensor> {
        self.sensor.as_ref().map(|design| Sensor { design: Arc::clone(design) })
    }

    /// Names of the scene's objects, where they are known.
    #[getter]
    fn objects(&self) -> Vec<String> {
        self.objects.clone()
    }

    /// Names of the scene's materials, where they are known.
    #[getter]
    fn materials(&self) -> Vec<String> {
        self.materials.clone()
    }

    /// The data needed to repeat the scan and to judge it, with the keys of `macropulse simulate --json`:
    /// seed, sensor, scene, environment, defaults, omissions, assumptions and counts. None for a scan that
    /// was not simulated here.
    #[getter]
    fn manifest<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &self.manifest)
    }

    /// Outcomes of the pixels, from the manifest: `outcomes`, `right_fraction` and the like. None for a scan
    /// that was not simulated here.
    #[getter]
    fn score<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let own = ["outcomes", "further_outcomes", "right_fraction", "right_within_m"];
        let counts = &self.manifest["counts"];
        let of_target = ["samples_on_target", "points_on_target", "ghosts"];
        let named = own.map(|key| (key, &self.manifest[key])).into_iter();
        from_json(py, &some_of(named.chain(of_target.map(|key| (key, &counts[key])))))
    }

    /// Counts on the way from shots to returns, from the manifest, with the `rejects` and the `converters`.
    /// The seconds of processor time of each stage are in `times_s`. None for a scan that was not simulated
    /// here.
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let counts = self.manifest["counts"].as_object();
        let counts = counts.into_iter().flatten().map(|(key, value)| (key.as_str(), value));
        let others = ["rejects", "converters", "times_s"].map(|key| (key, &self.manifest[key]));
        from_json(py, &some_of(counts.chain(others)))
    }

    /// The scan as a table of pandas, a row for each return.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let pandas = package(slf.py(), "pandas", "to_pandas")?;
        pandas.call_method1("DataFrame", (Self::columns(slf)?,))
    }

    /// The scan as a cloud of Open3D: `open3d.t.geometry.PointCloud` with the attributes
    /// `positions`, `intensity`, `range` and `ring`, as far as the scan has them.
    fn to_open3d<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let open3d = package(py, "open3d", "to_open3d")?;
        let cloud = open3d.getattr("t")?.getattr("geometry")?.call_method0("PointCloud")?;
        let tensor = open3d.getattr("core")?.getattr("Tensor")?;
        let point = cloud.getattr("point")?;
        point.set_item("positions", tensor.call1((slf.get().xyz(py)?,))?)?;
        let columns = [
            (Attribute::Intensity, "float32"),
            (Attribute::Range, "float32"),
            (Attribute::Ring, "int32"),
        ];
        for (attribute, kind) in columns {
            if attribute.is_in(&slf.get().cloud) {
                let column = Self::array(slf, attribute)?.call_method1("astype", (kind,))?;
                let column = column.call_method1("reshape", (-1, 1))?;
                point.set_item(attribute.name(), tensor.call1((column,))?)?;
            }
        }
        Ok(cloud)
    }

    /// Writes the scan to a file, whole or not at all.
    ///
    /// Args:
    ///     path: The file; its ending says the format.
    ///     format: Name of the format, as the program has it behind `--format`, if the ending does
    ///         not say it.
    ///     truth: True to write the truth beside the points.
    #[pyo3(signature = (path, *, format = None, truth = true))]
    fn save(
        slf: &Bound<'_, Self>,
        path: PathBuf,
        format: Option<&str>,
        truth: bool,
    ) -> PyResult<()> {
        files::save(slf, path, (format, truth))
    }

    fn __len__(&self) -> usize {
        self.cloud.returns()
    }

    fn __repr__(&self) -> String {
        let cloud = &self.cloud;
        let sensor = self.sensor.as_ref().map_or(String::new(), |one| format!(" of {}", one.name));
        let image = match cloud.rows * cloud.columns {
            0 => String::new(),
            _ => format!(", {} x {} pixels", cloud.rows, cloud.columns),
        };
        let fold = |(low, high): (f32, f32), range: &f32| (low.min(*range), high.max(*range));
        let ranges = cloud.distances();
        let ranges = ranges.iter().fold((f32::INFINITY, f32::NEG_INFINITY), fold);
        let ranges = match cloud.returns() == 0 {
            true => String::new(),
            false => format!(", {:.2} to {:.2} m", ranges.0, ranges.1),
        };
        format!(
            "<macropulse.Scan {}{sensor}: {} points{image}{ranges}>",
            cloud.scan,
            cloud.returns()
        )
    }

    fn _repr_html_(&self) -> String {
        show::html(&self.cloud, &self.__repr__(), &self.manifest)
    }
}

/// The entries that there are, as an object; null if there is none.
fn some_of<'a>(entries: impl Iterator<Item = (&'a str, &'a Value)>) -> Value {
    let known = entries.filter(|(_, value)| !value.is_null());
    let known: serde_json::Map<String, Value> =
        known.map(|(key, value)| (key.to_owned(), value.clone())).collect();
    if known.is_empty() { Value::Null } else { Value::Object(known) }
}

/// A package that not everybody has.
fn package<'py>(py: Python<'py>, name: &str, why: &str) -> PyResult<Bound<'py, PyModule>> {
    py.import(name).map_err(|cause| {
        let is_missing = cause.is_instance_of::<PyModuleNotFoundError>(py)
            && cause
                .value(py)
                .getattr("name")
                .is_ok_and(|missing| missing.eq(name).unwrap_or(false));
        let error = PyImportError::new_err(match is_missing {
            true => format!("{why} needs the package {name}: pip install {name}"),
            false => format!("{why}: the package {name} is there, but cannot be imported: {cause}"),
        });
        error.set_cause(py, Some(cause));
        error
    })
}

/// Returns the names of the outcomes, in the order of the numbers of `Scan.outcome`.
pub fn outcomes() -> Vec<&'static str> {
    Outcome::ALL.iter().map(|outcome| outcome.name()).collect()
}
