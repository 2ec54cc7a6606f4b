//! Files that are read along their schema: the reader decides, and the schema says what is wrong.

use std::ops::Range;

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

use super::misfit::{Fault, Misfit, Walk};
use crate::names::{line_column, span_of};
use crate::told;

/// Reads a `table` as a `T`.
///
/// # Errors
/// The first place that does not fit.
pub(crate) fn read<T: DeserializeOwned + JsonSchema>(table: &Table) -> Result<T, Misfit> {
    Value::Table(table.clone())
        .try_into()
        .map_err(|error: toml::de::Error| misfit::<T>(table, error.message()))
}

/// Returns the first place of a `table` that does not fit a `T`. If the schema finds none, the fault is what
/// the reader `said`.
fn misfit<T: JsonSchema>(table: &Table, said: &str) -> Misfit {
    let table = Value::Table(table.clone());
    let checked = Walk::default().value(super::of_reader::<T>().as_value(), &table);
    checked
        .err()
        .unwrap_or_else(|| Misfit { steps: Vec::new(), fault: Fault::Value(said.to_owned()) })
}

/// The fault of a text.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// Bytes of the text.
    pub span: Range<usize>,
    /// The key or the element of a list, as `object[0].shape`; empty for the text as a whole.
    pub path: String,
    /// The fault in one sentence.
    pub message: String,
}

/// Reads a TOML `text` as a `T`.
///
/// # Errors
/// Its first fault: it is no TOML, or something in it does not fit.
pub fn read_text<T: DeserializeOwned + JsonSchema>(text: &str) -> Result<T, Refusal> {
    toml::from_str(text).map_err(|error| match text.parse::<Table>() {
        Err(error) => Refusal {
            span: error.span().unwrap_or(0..0),
            path: String::new(),
            message: told::syntax(text, &error),
        },
        Ok(table) => {
            let misfit = misfit::<T>(&table, error.message());
            let of_key = matches!(misfit.fault, Fault::UnknownKey { .. });
            let span = match misfit.steps.is_empty() {
                true => 0..0,
                false => span_of(text, &misfit.steps, of_key).unwrap_or(0..0),
            };
            Refusal { span, path: misfit.path(), message: misfit.message() }
        }
    })
}

/// Reads the TOML `text` of a file called `origin` as a `T`.
///
/// # Errors
/// The place and the kind of its first fault, in one sentence.
pub fn read_file<T: DeserializeOwned + JsonSchema>(text: &str, origin: &str) -> Result<T, String> {
    read_text(text).map_err(|Refusal { span, path, message }| {
        let (line, column) = line_column(text, span.start);
        let key = if path.is_empty() { path } else { format!("{path}: ") };
        format!("{origin}:{line}:{column}: {key}{message}")
    })
}
