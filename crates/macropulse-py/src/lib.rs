//! The simulator as a module of Python, `macropulse`.
//!
//! Each file is a class or the functions of one subject. Here is nothing but the list of them: what
//! Python sees of the library, and how its columns become arrays, errors exceptions, and Ctrl-C an
//! end.

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod codes;
mod columns;
mod dictionaries;
mod error;
mod files;
mod images;
mod mesh;
mod receive;
mod scan;
mod scene;
mod sensor;
mod show;
mod simulate;
mod study;
mod values;
mod work;

use pyo3::prelude::*;

/// The compiled half of the package; `macropulse` has all of its names.
#[pymodule]
mod _native {
    use super::*;

    #[pymodule_export]
    use super::codes::{code_words, codes, correlation, encode};
    #[pymodule_export]
    use super::error::{Error, Fault};
    #[pymodule_export]
    use super::files::{StoredScans, load, load_scans};
    #[pymodule_export]
    use super::mesh::Mesh;
    #[pymodule_export]
    use super::receive::{Records, decode, decode_scans, record};
    #[pymodule_export]
    use super::scan::Scan;
    #[pymodule_export]
    use super::scene::{Scene, environments, scenes};
    #[pymodule_export]
    use super::sensor::{Sensor, sensors};
    #[pymodule_export]
    use super::simulate::{Scans, scans, simulate};
    #[pymodule_export]
    use super::study::{budget, score, sweep};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("OUTCOMES", pyo3::types::PyTuple::new(module.py(), scan::outcomes())?)?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        columns::add_properties(module.py())?;
        // Refuses a set of instructions that is misspelt or that this machine does not have.
        macropulse::codec::level::asked_for().map(|_| ()).map_err(error::wrong)
    }
}
