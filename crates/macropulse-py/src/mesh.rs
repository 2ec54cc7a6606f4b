//! Triangle meshes in memory.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::error::wrong;

/// A triangle mesh in memory: corners and triangles as NumPy has them.
///
/// It stands as the `mesh` of an object in `Scene.from_dict`, in place of the name of a file, with
/// the same keys beside it: `unit` (metres if none is given), `up`, `forward`, `position_m`,
/// `yaw_deg`, `material`.
///
/// Args:
///     vertices: Corners, shape (n, 3), in the unit and the axes of the mesh.
///     triangles: Indices of corners, shape (m, 3), from 0.
///     material_of_triangle: For each triangle the index of its material, shape (m,); all are of
///         one material if this is left out.
///     materials: Names of these materials: those of the library or of the scene, or names that the
///         object's `materials` stands for.
#[pyclass(frozen, module = "macropulse")]
pub struct Mesh {
    /// As the simulator has it.
    pub mesh: macropulse::scene::Mesh,
}

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (vertices, triangles, material_of_triangle = None, materials = None))]
    fn new(
        vertices: &Bound<'_, PyAny>,
        triangles: &Bound<'_, PyAny>,
        material_of_triangle: Option<&Bound<'_, PyAny>>,
        materials: Option<Vec<String>>,
    ) -> PyResult<Self> {
        let py = vertices.py();
        let given = py.import("numpy")?.call_method1("asarray", (vertices,))?;
        if !["i", "u", "f"].contains(&kind(&given)?.as_str()) {
            let kind = given.getattr("dtype")?;
            return Err(wrong(format!("vertices are of type {kind}; they must be numbers")));
        }
        let given = as_array(&given, "float64")?;
        let vertices: PyReadonlyArray2<f64> = given.extract().map_err(|_| {
            wrong(format!("vertices has shape {}; it must be (n, 3)", shape(&given)))
        })?;
        let vertices = vertices.as_array();
        if vertices.ncols() != 3 {
            return Err(wrong(format!("vertices has shape {}; it must be (n, 3)", shape(&given))));
        }
        let given = py.import("numpy")?.call_method1("asarray", (triangles,))?;
        if !["i", "u"].contains(&kind(&given)?.as_str()) {
            let kind = given.getattr("dtype")?;
            return Err(wrong(format!("triangles are of type {kind}; they must be whole numbers")));
        }
        let given = as_array(&given, "int64")?;
        let triangles: PyReadonlyArray2<i64> = given.extract().map_err(|_| {
            wrong(format!("triangles has shape {}; it must be (m, 3)", shape(&given)))
        })?;
        let triangles = triangles.as_array();
        if triangles.ncols() != 3 {
            let remedy = match triangles.ncols() {
                4 => ": cut each quadrangle into two triangles",
                _ => "",
            };
            let shape = shape(&given);
            return Err(wrong(format!("triangles has shape {shape}; it must be (m, 3){remedy}")));
        }
        let count = vertices.nrows();
        let from_one = triangles.iter().min() == Some(&1)
            && triangles.iter().max().is_some_and(|most| usize::try_from(*most) == Ok(count));
        let corner = |index: &i64| {
            u32::try_from(*index).ok().filter(|index| (*index as usize) < count).ok_or_else(|| {
                wrong(format!(
                    "triangles names the corner {index}, but there are {count}, from 0{}",
                    if from_one { ": these are counted from 1, so take 1 from each" } else { "" }
                ))
            })
        };
        let triangles = triangles
            .rows()
            .into_iter()
            .map(|row| Ok([corner(&row[0])?, corner(&row[1])?, corner(&row[2])?]))
            .collect::<PyResult<Vec<[u32; 3]>>>()?;
        let vertices = vertices.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect();
        let mut mesh = macropulse::scene::Mesh::new(vertices, triangles);
        if let Some(names) = materials {
            mesh.diffuse_guesses = vec![None; names.len()];
            mesh.material_names = names;
        }
        if let Some(given) = material_of_triangle {
            let given = as_array(given, "int64")?;
            let given: PyReadonlyArray1<i64> = given.extract()?;
            let indices = given.as_array();
            let index = |one: &i64| u16::try_from(*one).map_err(|_| no_material(*one, &mesh));
            mesh.material_of_triangle = indices.iter().map(index).collect::<PyResult<_>>()?;
        }
        let (given, needed) = (mesh.material_of_triangle.len(), mesh.triangles.len());
        if given != needed {
            return Err(wrong(format!(
                "material_of_triangle has {given} entries; it needs one of each of {needed} \
                 triangles"
            )));
        }
        let names = mesh.material_names.len();
        if let Some(one) = mesh.material_of_triangle.iter().find(|one| usize::from(**one) >= names)
        {
            return Err(no_material(i64::from(*one), &mesh));
        }
        Ok(Self { mesh })
    }

    /// Corners, shape (n, 3): a copy.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let flat: Vec<f64> = self.mesh.vertices.as_flattened().to_vec();
        PyArray1::from_vec(py, flat).reshape([self.mesh.vertices.len(), 3])
    }

    /// Indices of corners, shape (m, 3): a copy.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let flat: Vec<u32> = self.mesh.triangles.as_flattened().to_vec();
        PyArray1::from_vec(py, flat).reshape([self.mesh.triangles.len(), 3])
    }

    /// Names of its materials; one of them empty where none was given.
    #[getter]
    fn materials(&self) -> Vec<String> {
        self.mesh.material_names.clone()
    }

    /// For each triangle the index of its material, shape (m,): a copy.
    #[getter]
    fn material_of_triangle<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u16>> {
        PyArray1::from_slice(py, &self.mesh.material_of_triangle)
    }

    fn __repr__(&self) -> String {
        let (corners, triangles) = (self.mesh.vertices.len(), self.mesh.triangles.len());
        let size = self.mesh.bounds().map_or(String::new(), |(low, high)| {
            let [x, y, z] = [0, 1, 2].map(|axis| high[axis] - low[axis]);
            format!(", {x:.3} x {y:.3} x {z:.3}")
        });
        format!("<macropulse.Mesh: {triangles} triangles, {corners} corners{size}>")
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let arrays = (
            this.vertices(py)?,
            this.triangles(py)?,
            this.material_of_triangle(py),
            this.materials(),
        );
        Ok((slf.get_type().into_any(), arrays.into_pyobject(py)?))
    }
}

/// Returns `given` as an array of numbers of this kind.
fn as_array<'py>(given: &Bound<'py, PyAny>, kind: &str) -> PyResult<Bound<'py, PyAny>> {
    given.py().import("numpy")?.call_method1("asarray", (given, kind))
}

/// The material that a triangle names is none of its mesh.
fn no_material(index: i64, mesh: &macropulse::scene::Mesh) -> PyErr {
    let names = mesh.material_names.len();
    wrong(format!(
        "material_of_triangle names the material {index}, but `materials` has {names}, from 0"
    ))
}

/// The kind of the elements of an array, as a letter: that of NumPy.
fn kind(array: &Bound<'_, PyAny>) -> PyResult<String> {
    array.getattr("dtype")?.getattr("kind")?.extract()
}

fn shape(array: &Bound<'_, PyAny>) -> String {
    array.getattr("shape").map_or_else(|_| "?".to_owned(), |shape| shape.to_string())
}
