//! Shots and records as dictionaries of columns, to Python and back.

use macropulse::codec::files::{RecordColumn, RecordValues, ShotRecord};
use macropulse::codec::{Given, RecordKind, Samples, ShotLog, Ticks};
use macropulse::design::Design;
use macropulse::emit::{Shot, shot_of_pixel};
use macropulse::told;
use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use crate::error::wrong;

/// Shots are numbered up to here: more than any sensor fires in its time.
const MOST_SHOTS: u64 = 1 << 60;

/// Keys of the dictionaries of shots, ticks and other records.
const SHOTS: [&str; 8] =
    ["first", "owned", "fired_at_fs", "row", "column", "label", "word", "channel"];
const TICKS: [&str; 4] = ["epoch", "tick", "channel", "amplitude"];
const SAMPLES: [&str; 3] = ["epoch", "channel", "code"];

/// The columns of a record.
pub fn dictionary_of_record(py: Python<'_>, record: Given) -> PyResult<Bound<'_, PyDict>> {
    let shots = record.of_shots().map_or(0, ShotRecord::shots);
    match record {
        Given::Ticks(ticks) => dictionary_of_ticks(py, ticks),
        Given::Samples(samples) => dictionary_of_samples(py, samples),
        record => {
            let columns = PyDict::new(py);
            for column in record.into_columns().unwrap_or_default() {
                set_column(&columns, column, shots)?;
            }
            Ok(columns)
        }
    }
}

/// Adds a column of a record of `shots` shots.
fn set_column(columns: &Bound<'_, PyDict>, column: RecordColumn, shots: usize) -> PyResult<()> {
    let rows = column.is_table.then_some(shots);
    match column.values {
        RecordValues::Shared(value) => columns.set_item(column.name, value),
        RecordValues::U16(values) => set_values(columns, column.name, values, rows),
        RecordValues::U32(values) => set_values(columns, column.name, values, rows),
        RecordValues::F64(values) => set_values(columns, column.name, values, rows),
    }
}

/// Adds an array to a dictionary: a table if its number of `rows` is given.
fn set_values<T: Element>(
    columns: &Bound<'_, PyDict>,
    name: &str,
    values: Vec<T>,
    rows: Option<usize>,
) -> PyResult<()> {
    let shape = rows.map(|rows| [rows, values.len() / rows.max(1)]);
    let array = PyArray1::from_vec(columns.py(), values);
    match shape {
        Some(shape) => columns.set_item(name, array.reshape(shape)?),
        None => columns.set_item(name, array),
    }
}

/// The columns of a log.
pub fn dictionary_of_shots(py: Python<'_>, log: ShotLog) -> PyResult<Bound<'_, PyDict>> {
    let columns = PyDict::new(py);
    columns.set_item("first", log.first)?;
    columns.set_item("owned", (log.owned.start, log.owned.end))?;
    columns.set_item("fired_at_fs", PyArray1::from_vec(py, log.fired_at_fs))?;
    columns.set_item("row", PyArray1::from_vec(py, log.row))?;
    columns.set_item("column", PyArray1::from_vec(py, log.column))?;
    columns.set_item("label", PyArray1::from_vec(py, log.label))?;
    columns.set_item("word", PyArray1::from_vec(py, log.word))?;
    columns.set_item("channel", PyArray1::from_vec(py, log.channel))?;
    Ok(columns)
}

fn dictionary_of_ticks(py: Python<'_>, ticks: Ticks) -> PyResult<Bound<'_, PyDict>> {
    let columns = PyDict::new(py);
    columns.set_item("epoch", ticks.epoch)?;
    columns.set_item("tick", PyArray1::from_vec(py, ticks.tick))?;
    columns.set_item("channel", PyArray1::from_vec(py, ticks.channel))?;
    columns.set_item("amplitude", PyArray1::from_vec(py, ticks.amplitude))?;
    Ok(columns)
}

fn dictionary_of_samples(py: Python<'_>, samples: Samples) -> PyResult<Bound<'_, PyDict>> {
    let columns = PyDict::new(py);
    let shape = [samples.channel.len(), samples.per_channel()];
    columns.set_item("epoch", samples.epoch)?;
    columns.set_item("channel", PyArray1::from_vec(py, samples.channel))?;
    columns.set_item("code", PyArray1::from_vec(py, samples.code).reshape(shape)?)?;
    Ok(columns)
}

/// The record of a sensor that a dictionary holds.
///
/// # Errors
/// If columns are missing, unknown, of unequal length, or of another sensor.
pub fn record_of(design: &Design, given: &Bound<'_, PyDict>) -> PyResult<Given> {
    if let Some(blank) = design.blank_record() {
        return record_of_shots(design, blank, given);
    }
    Ok(match design.records() {
        RecordKind::Samples => Given::Samples(samples_of(design, given)?),
        _ => Given::Ticks(ticks_of(design, given)?),
    })
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
///
/// # Errors
/// As [`record_of`].
pub fn shot_log(design: &Design, shots: &Bound<'_, PyDict>) -> PyResult<ShotLog> {
    check_keys(shots, "shots", &SHOTS)?;
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

/// The record of shots that a dictionary holds, with the columns that a `blank` one of the sensor has. One that is
/// missing is as in the blank for every shot, unless it is a table.
fn record_of_shots(design: &Design, blank: Given, given: &Bound<'_, PyDict>) -> PyResult<Given> {
    let what = design.records().name();
    let Some(like) = blank.of_shots().map(|record| record.blank(0)) else { return Ok(blank) };
    let (number, numbers, name) = (like.number(), like.numbers(), &design.name);
    let columns = blank.into_columns().unwrap_or_default();
    let known: Vec<&str> = columns.iter().map(|column| column.name).collect();
    check_keys(given, what, &known)?;
    let mut rows: Option<usize> = None;
    for column in columns.iter().filter(|column| column.is_table) {
        let [shots, wide] = shape_of(given, what, column.name, number)?;
        if wide != numbers {
            let key = column.name;
            return Err(wrong(format!(
                "{what}: `{key}` has {wide} columns, and {name} has {numbers} {number}s"
            )));
        }
        if let Some(others) = rows.filter(|others| *others != shots) {
            let key = column.name;
            return Err(wrong(format!(
                "{what}: `{key}` has {shots} rows, and the column before it {others}"
            )));
        }
        rows = Some(shots);
    }
    let shots = rows.unwrap_or_default();
    let mut values = Vec::new();
    for RecordColumn { name: key, is_table, values: of_blank } in columns {
        values.push(match of_blank {
            RecordValues::Shared(own) => {
                let found: i64 = entry(given, (what, key, "a whole number"), || own)?;
                if found != own {
                    return Err(wrong(format!("{what}: {key} is {found}, and {own} of {name}")));
                }
                RecordValues::Shared(own)
            }
            RecordValues::U16(one) => {
                RecordValues::U16(read(given, (what, key), is_table, &one, shots)?)
            }
            RecordValues::U32(one) => {
                RecordValues::U32(read(given, (what, key), is_table, &one, shots)?)
            }
            RecordValues::F64(one) => {
                RecordValues::F64(read(given, (what, key), is_table, &one, shots)?)
            }
        });
    }
    Ok(like.of_columns(shots, values).given())
}

/// The column of `shots` shots that a dictionary holds, row by row where it is a table; where it is missing, `one` for
/// each shot.
fn read<T: Number>(
    given: &Bound<'_, PyDict>,
    (what, key): (&str, &str),
    is_table: bool,
    one: &[T],
    shots: usize,
) -> PyResult<Vec<T>> {
    if !is_table {
        let found = column(given, (what, key), Some(one.repeat(shots)))?;
        if found.len() != shots {
            let length = found.len();
            return Err(wrong(format!("{what}: `{key}` has {length} entries for {shots} shots")));
        }
        return Ok(found);
    }
    let Some(table) = given.get_item(key)? else {
        return Err(wrong(format!("{what}: there is no column `{key}`")));
    };
    let typed = given.py().import("numpy")?.call_method1("asarray", (&table,))?;
    let flat = PyDict::new(given.py());
    flat.set_item(key, typed.call_method0("ravel")?)?;
    column(&flat, (what, key), None)
}

/// The shape of the column `key` of a dictionary, which has a row for each shot and a column for each `number`.
fn shape_of(
    given: &Bound<'_, PyDict>,
    what: &str,
    key: &str,
    number: &str,
) -> PyResult<[usize; 2]> {
    let Some(table) = given.get_item(key)? else {
        return Err(wrong(format!("{what}: there is no column `{key}`")));
    };
    let typed = given.py().import("numpy")?.call_method1("asarray", (&table,))?;
    let shape: Vec<usize> = typed.getattr("shape")?.extract()?;
    let [rows, columns] = shape[..] else {
        return Err(wrong(format!(
            "{what}: `{key}` has {} dimensions; give it a row for each shot and a column for each {number}",
            shape.len()
        )));
    };
    Ok([rows, columns])
}
