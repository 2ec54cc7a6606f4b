//! Codes: the marks of a shot, families of words, and how alike these are.

use std::sync::Arc;

use macropulse::codec::code::correlation::periodic;
use macropulse::design::family_from_toml;
use macropulse::predict::comparison::Comparison;
use macropulse_study::codes::told;
use macropulse_study::sent::Macropulse;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::error::{OrRaise, wrong};
use crate::sensor::Sensor;
use crate::values::{from_json, whole};
use crate::work;

/// The macropulse that is sent to a pixel, mark by mark.
///
/// Args:
///     sensor: A `Sensor`, the name of a ready one, or a TOML file.
///     row: Row of the pixel, 0 at the top.
///     column: Column of the pixel, 0 at the left.
///     scan: Number of the scan, from 0.
///
/// Returns:
///     A dictionary with the keys of `macropulse encode --json`; `marks`, the lit chips counted from
///     0, is an array.
///
/// Raises:
///     Error: If the sensor has no such pixel or scan.
#[pyfunction]
#[pyo3(signature = (sensor, row, column, *, scan = 0))]
pub fn encode<'py>(
    sensor: &Bound<'py, PyAny>,
    row: i64,
    column: i64,
    #[pyo3(from_py_with = whole)] scan: u64,
) -> PyResult<Bound<'py, PyAny>> {
    let py = sensor.py();
    let design = Arc::clone(&Sensor::of(sensor)?.get().design);
    let sent = Macropulse::to(&design, scan, (row, column)).or_raise()?;
    let told = from_json(py, &sent.json())?;
    told.set_item("marks", PyArray1::from_slice(py, sent.marks))?;
    Ok(told)
}

/// Compares code families: how alike their words are, and what that costs when many send at once.
///
/// Args:
///     families: As behind `code.family` in a sensor file: `"prime=29"`, `"gold=7"`,
///         `"sparse={length=841, weight=29, words=64, seed=1}"`.
///
/// Returns:
///     A dictionary for each, with the keys of `families` in `macropulse codes --json`. Its `matrix`, shape
///     (n, n) of the words compared, has the highest periodic cross-correlation of each with each other one,
///     and on the diagonal the highest sidelobe.
///
/// Raises:
///     Error: If there is no such family.
#[pyfunction]
#[pyo3(signature = (*families))]
pub fn codes<'py>(py: Python<'py>, families: Vec<String>) -> PyResult<Bound<'py, PyList>> {
    if families.is_empty() {
        return Err(wrong("no family is named; name one at least, as \"prime=29\" or \"gold=7\""));
    }
    let compared = work::done(py, 0, move |_| {
        // All of them are read before the first is compared.
        let families = families.iter().map(|text| family_from_toml(text));
        let families = families.collect::<Result<Vec<_>, _>>()?;
        Ok::<_, macropulse::design::Error>(families.into_iter().map(Comparison::of).collect())
    })?;
    let compared: Vec<Comparison> = compared.or_raise()?;
    let told = compared.iter().map(|of| {
        let told = from_json(py, &told(of))?;
        let matrix = PyArray1::from_slice(py, &of.matrix).reshape([of.compared, of.compared])?;
        told.set_item("matrix", matrix)?;
        Ok(told)
    });
    PyList::new(py, told.collect::<PyResult<Vec<_>>>()?)
}

/// Most chips of all words together that are written out.
const MOST_CHIPS: usize = 1 << 28;

/// The words of a code family, chip by chip.
///
/// Args:
///     family: As behind `code.family` in a sensor file, `"prime=29"` say.
///
/// Returns:
///     An array of shape (words, chips), 1 where a chip is lit and 0 where it is dark.
///
/// Raises:
///     Error: If there is no such family, or its words are too many to be written out.
#[pyfunction]
pub fn code_words<'py>(py: Python<'py>, family: &str) -> PyResult<Bound<'py, PyArray2<u8>>> {
    let family = family_from_toml(family).or_raise()?;
    let (words, chips) = (family.count(), family.length() as usize);
    if words.saturating_mul(chips) > MOST_CHIPS {
        return Err(wrong(format!(
            "{family} has {words} words of {chips} chips; {MOST_CHIPS} chips together are written \
             out at most"
        )));
    }
    let mut lit = vec![0; words * chips];
    for (word, lit) in family.words().iter().zip(lit.chunks_mut(chips)) {
        word.marks.iter().for_each(|mark| lit[*mark as usize] = 1);
    }
    PyArray1::from_vec(py, lit).reshape([words, chips])
}

/// The periodic correlation of two words of a code family against lag.
///
/// Args:
///     family: As behind `code.family` in a sensor file, `"prime=29"` say.
///     word: Number of a word, from 0.
///     other: Number of another word, or of the same for its autocorrelation.
///
/// Returns:
///     An array with an entry for each lag: how many marks coincide.
///
/// Raises:
///     Error: If there is no such family or word.
#[pyfunction]
pub fn correlation<'py>(
    py: Python<'py>,
    family: &str,
    #[pyo3(from_py_with = whole)] word: usize,
    #[pyo3(from_py_with = whole)] other: usize,
) -> PyResult<Bound<'py, PyArray1<u16>>> {
    let family = family_from_toml(family).or_raise()?;
    let words = family.words();
    let known = |number: usize| {
        words.get(number).ok_or_else(|| {
            wrong(format!("word {number}: the words of {family} are 0 to {}", words.len() - 1))
        })
    };
    Ok(PyArray1::from_vec(py, periodic(known(word)?, known(other)?)))
}
