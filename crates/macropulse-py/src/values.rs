//! Python values as values of sensor and scene files, and back.

use macropulse::design::{WITH, WITHOUT};
use macropulse::environment::Environment;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyMapping, PyString};
use toml::{Table, Value};

use crate::error::{OrRaise, wrong};
use crate::mesh::Mesh;

/// Values within values, at most: a dictionary may hold itself.
const DEEPEST: usize = 32;

/// Meshes that stand in a dictionary: what they are called there, and themselves.
pub type Meshes = Vec<(String, Py<Mesh>)>;

/// Reads values; collects the meshes on the way.
#[derive(Default)]
pub struct Reader {
    /// The meshes met, in their order.
    pub meshes: Meshes,
}

impl Reader {
    /// The dictionary `given`, as the table of a file.
    ///
    /// # Errors
    /// If a key is no text, or a value is none that a file can hold.
    pub fn table(&mut self, given: &Bound<'_, PyAny>, path: &str, deep: usize) -> PyResult<Table> {
        let mut table = Table::new();
        for entry in given.cast::<PyMapping>()?.items()? {
            let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = entry.extract()?;
            let Ok(key) = key.extract::<String>() else {
                let place = if path.is_empty() { "the dictionary" } else { path };
                return Err(wrong(format!("{place}: the key {} is no text", key.repr()?)));
            };
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            let value = self.value(&value, &path, deep)?;
            table.insert(key, value);
        }
        Ok(table)
    }

    /// The value `given` at the dotted `path`: a number, a text, a path, a list, an array, a
    /// dictionary or a mesh.
    ///
    /// # Errors
    /// If it is anything else.
    pub fn value(&mut self, given: &Bound<'_, PyAny>, path: &str, deep: usize) -> PyResult<Value> {
        if deep > DEEPEST {
            return Err(wrong(format!("{path}: goes deeper than {DEEPEST} values within values")));
        }
        if let Ok(mesh) = given.cast::<Mesh>() {
            let name = format!("mesh {} in memory", self.meshes.len() + 1);
            self.meshes.push((name.clone(), mesh.clone().unbind()));
            return Ok(Value::String(name));
        }
        if let Ok(flag) = given.cast::<PyBool>() {
            return Ok(Value::Boolean(flag.is_true()));
        }
        if given.is_instance_of::<PyInt>() {
            let number = given.extract::<i64>();
            return number.map(Value::Integer).map_err(|_| {
                wrong(format!("{path}: {given} is beyond the whole numbers that a file can hold"))
            });
        }
        if let Ok(number) = given.cast::<PyFloat>() {
            return Ok(Value::Float(number.value()));
        }
        if let Ok(text) = given.cast::<PyString>() {
            return Ok(Value::String(text.to_str()?.to_owned()));
        }
        if given.cast::<PyMapping>().is_ok() {
            return self.table(given, path, deep + 1).map(Value::Table);
        }
        // Arrays and numbers of NumPy.
        if given.hasattr("tolist")? {
            return self.value(&given.call_method0("tolist")?, path, deep + 1);
        }
        if given.hasattr("__fspath__")? {
            return self.value(&given.call_method0("__fspath__")?, path, deep + 1);
        }
        if let Ok(elements) = given.try_iter() {
            let elements = elements
                .enumerate()
                .map(|(at, element)| self.value(&element?, &format!("{path}[{at}]"), deep + 1));
            return elements.collect::<PyResult<_>>().map(Value::Array);
        }
        let kind = given.get_type().name()?;
        let remedy = "give a number, a text, a list or a dictionary, or leave the key out";
        Err(wrong(format!("{path}: a value cannot be of type {kind}; {remedy}")))
    }
}

/// The whole number, 0 or more, that an argument is.
///
/// # Errors
/// If it is negative or too large; `TypeError` if it is no whole number.
pub fn whole<N>(given: &Bound<'_, PyAny>) -> PyResult<N>
where
    N: TryFrom<u64>,
{
    let number = given.extract::<u64>().map_err(|error| {
        match error.is_instance_of::<PyOverflowError>(given.py()) {
            true => is_not_counted(given),
            false => error,
        }
    })?;
    N::try_from(number).map_err(|_| is_not_counted(given))
}

/// [`whole`], or None.
///
/// # Errors
/// As there.
pub fn whole_or_none(given: &Bound<'_, PyAny>) -> PyResult<Option<u64>> {
    if given.is_none() { Ok(None) } else { whole(given).map(Some) }
}

fn is_not_counted(given: &Bound<'_, PyAny>) -> PyErr {
    let most = u64::MAX;
    wrong(format!("{given}: seeds, scans, shots and threads are whole numbers from 0 to {most}"))
}

/// The sun and air that an argument names, the usual ones where it is left out: the name of a ready
/// environment, or a dictionary of keys over it.
///
/// # Errors
/// If there is none of this name, or a key or a value is wrong.
pub fn environment(given: Option<&Bound<'_, PyAny>>) -> PyResult<Environment> {
    let Some(given) = given else { return Ok(Environment::default()) };
    let value = Reader::default().value(given, "environment", 0)?;
    Environment::read(&value).or_raise()
}

/// Changes of a sensor or scene: dotted keys and values, as the program takes them behind `--set`, `--with`
/// and `--without`. A dictionary of a sensor becomes a dotted key for each of its values. A dictionary of a
/// scene stays a table: its key begins with `scene:` or `environment`, or all keys are `of_scene`.
///
/// # Errors
/// As [`Reader::value`]; and if a mesh is among the values.
pub fn changes(
    given: Option<&Bound<'_, PyDict>>,
    of_scene: bool,
) -> PyResult<Vec<(String, String)>> {
    let mut reader = Reader::default();
    let mut changes = Vec::new();
    for (key, value) in given.into_iter().flatten() {
        let Ok(key) = key.extract::<String>() else {
            return Err(wrong(format!("changes: the key {} is no text", key.repr()?)));
        };
        let value = reader.value(&value, &key, 0)?;
        let is_whole = of_scene || ["scene:", "environment"].iter().any(|one| key.starts_with(one));
        change(key, value, is_whole, &mut changes);
    }
    match reader.meshes.first() {
        None => Ok(changes),
        Some(_) => {
            Err(wrong("a mesh cannot stand among changes; give it to Scene.from_dict instead"))
        }
    }
}

/// Adds the change of `key` to `value`, which `is_whole` if it is a table.
fn change(key: String, value: Value, is_whole: bool, changes: &mut Vec<(String, String)>) {
    let is_switch = [WITH, WITHOUT].contains(&key.rsplit('.').next().unwrap_or_default());
    match value {
        Value::Table(table) if !is_whole => {
            for (inner, value) in table {
                change(format!("{key}.{inner}"), value, is_whole, changes);
            }
        }
        Value::Array(effects) if is_switch => {
            changes.extend(effects.iter().map(|effect| (key.clone(), plain(effect))));
        }
        effect if is_switch => changes.push((key, plain(&effect))),
        value => changes.push((key, value.to_string())),
    }
}

/// A text without its quotation marks.
fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// Converts JSON that a program prints into Python objects: `null` is `None`.
///
/// # Errors
/// If Python has no memory left.
pub fn from_json<'py>(py: Python<'py>, value: &serde_json::Value) -> PyResult<Bound<'py, PyAny>> {
    use serde_json::Value as Json;
    match value {
        Json::Null => Ok(py.None().into_bound(py)),
        Json::Bool(flag) => flag.into_bound_py_any(py),
        Json::Number(number) => match (number.as_u64(), number.as_i64()) {
            (Some(whole), _) => whole.into_bound_py_any(py),
            (_, Some(whole)) => whole.into_bound_py_any(py),
            _ => number.as_f64().into_bound_py_any(py),
        },
        Json::String(text) => text.into_bound_py_any(py),
        Json::Array(list) => {
            let list: Vec<_> =
                list.iter().map(|one| from_json(py, one)).collect::<PyResult<_>>()?;
            PyList::new(py, list)?.into_bound_py_any(py)
        }
        Json::Object(entries) => {
            let dictionary = PyDict::new(py);
            for (key, value) in entries {
                dictionary.set_item(key, from_json(py, value)?)?;
            }
            dictionary.into_bound_py_any(py)
        }
    }
}
