//! Scenes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use macropulse::environment;
use macropulse::scene::{self as simulated, builtin_names};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use toml::Table;

use crate::error::{OrRaise, of_file, wrong};
use crate::mesh::Mesh;
use crate::sensor::{DICTIONARY, check_readable, named};
use crate::values::{Meshes, Reader, changes};
use crate::work;

/// The world of the light: objects with materials and poses, the ground, sun and air, other lidars, and the
/// place of the sensor.
///
/// Args:
///     name_or_path: A ready one, as `macropulse.scenes()` lists them, or a TOML file.
///     changes: Changed values, by dotted keys of the scene file. An object is called by its name and a
///         coordinate x, y or z, as `{"object.wall.position_m.x": 30}`. `{"environment": "fog-50m"}`
///         changes sun and air. `{"outside_files": True}` lets meshes name files outside the folder of the
///         scene.
///
/// Raises:
///     Error: If a name, a key or a value is wrong; the sentence says where, and what to do.
///     OSError: If a file cannot be read.
#[pyclass(frozen, module = "macropulse")]
pub struct Scene {
    /// As the simulator has it.
    pub scene: Arc<simulated::Scene>,
    /// Folder of its files.
    folder: PathBuf,
    /// Its meshes in memory, by name.
    meshes: Meshes,
}

impl Scene {
    fn made(
        py: Python<'_>,
        folder: PathBuf,
        make: impl FnOnce() -> Result<simulated::Scene, simulated::Error> + Send + 'static,
    ) -> PyResult<Self> {
        let scene = work::done(py, 0, |_| make())?.or_raise()?;
        Ok(Self { scene: Arc::new(scene), folder, meshes: Vec::new() })
    }

    /// The scene of a table with meshes in memory.
    fn of_table(py: Python<'_>, table: Table, folder: PathBuf, meshes: Meshes) -> PyResult<Self> {
        let in_memory = meshes.iter().map(|(name, mesh)| (name.clone(), mesh.get().mesh.clone()));
        let in_memory: BTreeMap<String, simulated::Mesh> = in_memory.collect();
        let base = folder.clone();
        let made = Self::made(py, folder, move || {
            simulated::Scene::from_table(&table, DICTIONARY, &base, &in_memory)
        })?;
        Ok(Self { meshes, ..made })
    }

    /// The scene that an argument names.
    ///
    /// # Errors
    /// If it names none.
    pub fn of<'py>(given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, Self>> {
        match given.cast::<Self>() {
            Ok(scene) => Ok(scene.clone()),
            Err(_) => Bound::new(given.py(), Self::new(given, None)?),
        }
    }

    /// True if its text says everything, in any folder: it names no meshes and no other lidars.
    pub fn is_self_contained(&self) -> bool {
        let table: Table = self.scene.text.parse().unwrap_or_default();
        let objects = table.get("object").and_then(toml::Value::as_array);
        let has_mesh = objects.into_iter().flatten().any(|object| object.get("mesh").is_some());
        !has_mesh && !table.contains_key("interferers")
    }
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (name_or_path, changes = None))]
    fn new(name_or_path: &Bound<'_, PyAny>, changes: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let py = name_or_path.py();
        if name_or_path.is_instance_of::<Self>() {
            return Err(pyo3::exceptions::PyTypeError::new_err(
                "a scene is changed where it is opened: give its name or path to macropulse.Scene, with \
                 all changes",
            ));
        }
        let name = named(name_or_path, ("scene", "Scene"))?;
        let changes = self::changes(changes, true)?;
        let folder = match simulated::Scene::builtin(&name) {
            Some(_) => PathBuf::new(),
            None => {
                check_readable(&name)?;
                Path::new(&name).parent().unwrap_or(Path::new("")).to_path_buf()
            }
        };
        Self::made(py, folder, move || simulated::Scene::open_changed(&name, &changes))
    }

    /// The scene in the file at `path`, whatever ready ones are called.
    ///
    /// Args:
    ///     path: A TOML file; meshes are looked for in its folder.
    #[classmethod]
    fn open(_class: &Bound<'_, PyType>, path: PathBuf, py: Python<'_>) -> PyResult<Self> {
        let text = macropulse::opened::text(&path).map_err(|why| of_file(&path, &why))?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let (origin, base) = (path.display().to_string(), folder.clone());
        Self::made(py, folder, move || simulated::Scene::from_toml(&text, &origin, &base))
    }

    /// The scene that a dictionary describes, as a scene file does.
    ///
    /// Args:
    ///     description: Keys as in a scene file, nested. The `mesh` of an object may be a
    ///         `macropulse.Mesh`. Without `version` it is 1.
    ///     folder: Folder in which meshes in files are looked for.
    #[classmethod]
    #[pyo3(signature = (description, folder = None))]
    fn from_dict(
        _class: &Bound<'_, PyType>,
        description: &Bound<'_, PyDict>,
        folder: Option<PathBuf>,
        py: Python<'_>,
    ) -> PyResult<Self> {
        let mut reader = Reader::default();
        let mut table = reader.table(description, "", 0)?;
        table.entry("version").or_insert(1.into());
        Self::of_table(py, table, folder.unwrap_or_default(), reader.meshes)
    }

    /// The scene that a text describes, as a scene file does.
    ///
    /// Args:
    ///     text: TOML.
    ///     folder: Folder in which meshes in files are looked for.
    #[classmethod]
    #[pyo3(signature = (text, folder = None))]
    fn from_toml(
        _class: &Bound<'_, PyType>,
        text: String,
        folder: Option<PathBuf>,
        py: Python<'_>,
    ) -> PyResult<Self> {
        let folder = folder.unwrap_or_default();
        let base = folder.clone();
        Self::made(py, folder, move || simulated::Scene::from_toml(&text, "the text", &base))
    }

    /// A scene of one object: a mesh before the sensor, which stands at the origin.
    ///
    /// Args:
    ///     vertices: Corners, shape (n, 3), m: x forward, y left, z up.
    ///     triangles: Indices of corners, shape (m, 3), from 0.
    ///     material: Name of a material of the library.
    ///     position_m: Position of the origin of the mesh, m.
    ///     yaw_deg: How far it is turned to the left, degrees.
    ///     ground: Material of the ground, 1.7 m below the sensor; none if left out.
    ///     environment: Sun and air: a ready one, as `macropulse.environments()` lists them.
    #[classmethod]
    #[pyo3(signature = (vertices, triangles, *, material = "grey50", position_m = [0.0; 3],
                        yaw_deg = 0.0, ground = None, environment = "clear-day"))]
    #[expect(clippy::too_many_arguments, reason = "Python names them")]
    fn from_mesh(
        class: &Bound<'_, PyType>,
        vertices: &Bound<'_, PyAny>,
        triangles: &Bound<'_, PyAny>,
        material: &str,
        position_m: [f64; 3],
        yaw_deg: f64,
        ground: Option<&str>,
        environment: &str,
    ) -> PyResult<Self> {
        let py = class.py();
        let mesh = py.get_type::<Mesh>().call1((vertices, triangles))?;
        let mut object = Table::new();
        object.insert("name".to_owned(), "mesh".into());
        object.insert("mesh".to_owned(), "mesh in memory".into());
        object.insert("unit".to_owned(), "m".into());
        object.insert("up".to_owned(), "z".into());
        object.insert("forward".to_owned(), "x".into());
        object.insert("material".to_owned(), material.into());
        object.insert("position_m".to_owned(), position_m.to_vec().into());
        object.insert("yaw_deg".to_owned(), yaw_deg.into());
        object.insert("target".to_owned(), true.into());
        let mut table = Table::new();
        table.insert("version".to_owned(), 1.into());
        table.insert("name".to_owned(), "mesh".into());
        table.insert("environment".to_owned(), environment.into());
        if let Some(ground) = ground {
            let mut below = Table::new();
            below.insert("material".to_owned(), ground.into());
            below.insert("z_m".to_owned(), (-1.7).into());
            table.insert("ground".to_owned(), below.into());
        }
        let mut sensor = Table::new();
        sensor.insert("position_m".to_owned(), vec![0.0; 3].into());
        table.insert("sensor".to_owned(), sensor.into());
        table.insert("object".to_owned(), vec![object].into());
        let mesh = mesh.cast_into::<Mesh>()?.unbind();
        Self::of_table(py, table, PathBuf::new(), vec![("mesh in memory".to_owned(), mesh)])
    }

    /// The car of the paper, so far away.
    ///
    /// Args:
    ///     range_m: From the sensor to the side of the car that is nearest, m.
    ///     environment: Sun and air: a ready one; that of the ready scenes of cars if left out.
    #[classmethod]
    #[pyo3(signature = (range_m, *, environment = None))]
    fn car(
        _class: &Bound<'_, PyType>,
        range_m: f64,
        environment: Option<&str>,
        py: Python<'_>,
    ) -> PyResult<Self> {
        if !(1.0..=10_000.0).contains(&range_m) {
            return Err(wrong(format!("range_m is {range_m}; it must be from 1 to 10000")));
        }
        let half = simulated::CAR_SIZE[0] / 2.0;
        let mut changes = vec![
            ("name".to_owned(), format!("\"car-{range_m}m\"")),
            ("object.car.position_m.x".to_owned(), format!("{:?}", range_m + half)),
        ];
        changes.extend(environment.map(|name| ("environment".to_owned(), format!("{name:?}"))));
        Self::made(py, PathBuf::new(), move || simulated::Scene::open_changed("car-30m", &changes))
    }

    /// The TOML text that describes it, with the changes made to it. Meshes in memory stand there by
    /// names that only this object knows.
    fn to_toml(&self) -> String {
        self.scene.text.clone()
    }

    /// Name.
    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    /// Names of its objects; `Scan.object` counts in this list.
    #[getter]
    fn objects(&self) -> Vec<String> {
        self.scene.objects.iter().map(|object| object.name.clone()).collect()
    }

    /// Names of its materials; `Scan.material` counts in this list.
    #[getter]
    fn materials(&self) -> Vec<String> {
        self.scene.materials.iter().map(|material| material.name.clone()).collect()
    }

    /// Number of triangles; shapes have none.
    #[getter]
    fn triangles(&self) -> usize {
        self.scene.triangles()
    }

    /// Sun and air, in words.
    #[getter]
    fn environment(&self) -> String {
        let environment = &self.scene.environment;
        format!("{}: {}", environment.name, environment.conditions())
    }

    /// Everything that was assumed while it was read: units, axes, materials.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.scene.notes.clone()
    }

    /// Content of its files that is left out: lines, skins, animations.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.scene.warnings.clone()
    }

    /// A hash of everything that decides what light meets.
    #[getter]
    fn digest(&self) -> String {
        self.scene.digest()
    }

    fn __repr__(&self) -> String {
        let names: Vec<&str> = self.scene.objects.iter().map(|one| one.name.as_str()).collect();
        let listed = match names.as_slice() {
            few if few.len() <= 4 => few.join(", "),
            [first, second, third, rest @ ..] => {
                format!("{first}, {second}, {third} and {} more", rest.len())
            }
            _ => String::new(),
        };
        format!(
            "<macropulse.Scene {}: {listed}; {} triangles, {}>",
            self.scene.name,
            self.scene.triangles(),
            self.scene.environment.name,
        )
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let folder = this.folder.display().to_string();
        let meshes = PyDict::new(py);
        for (name, mesh) in &this.meshes {
            meshes.set_item(name, mesh)?;
        }
        let make = slf.get_type().getattr("_restore")?;
        Ok((make, (this.to_toml(), folder, meshes).into_pyobject(py)?))
    }

    /// Returns the scene that `pickle` has kept.
    #[classmethod]
    #[pyo3(name = "_restore")]
    fn restore(
        class: &Bound<'_, PyType>,
        text: &str,
        folder: PathBuf,
        meshes: &Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let meshes = meshes
            .iter()
            .map(|(name, mesh)| Ok((name.extract()?, mesh.cast_into::<Mesh>()?.unbind())));
        let meshes = meshes.collect::<PyResult<Meshes>>()?;
        let table = text.parse::<Table>().map_err(|why| wrong(why.message().to_owned()))?;
        Self::of_table(class.py(), table, folder, meshes)
    }
}

/// Names of the ready scenes.
///
/// Returns:
///     Names that `Scene` and every function that takes a scene know.
#[pyfunction]
pub fn scenes() -> Vec<&'static str> {
    builtin_names().collect()
}

/// Names of the ready environments: sun and air.
///
/// Returns:
///     Names that the key `environment` of a scene knows.
#[pyfunction]
pub fn environments() -> Vec<&'static str> {
    environment::names().collect()
}
