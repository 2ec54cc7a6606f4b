//! The columns of a cloud, as arrays that lend its memory.

#![allow(unsafe_code)]

use macropulse::points::{Attribute, Entries};
use numpy::ndarray::ArrayView1;
use numpy::{Element, PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyCFunction, PyDict, PyTuple};

use crate::scan::Scan;

/// Gives the class `Scan` a property for each attribute: its column as an array.
pub fn add_properties(py: Python<'_>) -> PyResult<()> {
    let property = py.import("builtins")?.getattr("property")?;
    for attribute in Attribute::ALL {
        let get = move |given: &Bound<'_, PyTuple>, _: Option<&Bound<'_, PyDict>>| {
            let scan = given.get_item(0)?;
            Scan::array(scan.cast::<Scan>()?, attribute).map(Bound::unbind)
        };
        let get = PyCFunction::new_closure(py, None, None, get)?;
        let property = property.call1((get, py.None(), py.None(), attribute.about()))?;
        py.get_type::<Scan>().setattr(attribute.name(), property)?;
    }
    Ok(())
}

/// An array over the `entries` of a column of `scan`, which cannot be written to and keeps the scan
/// alive.
pub fn lent<'py>(scan: &Bound<'py, Scan>, entries: &Entries<'_>) -> PyResult<Bound<'py, PyAny>> {
    Ok(match entries {
        Entries::F4(entries) => over(scan, entries)?.into_any(),
        Entries::F8(entries) => over(scan, entries)?.into_any(),
        Entries::U1(entries) => over(scan, entries)?.into_any(),
        Entries::U2(entries) => over(scan, entries)?.into_any(),
    })
}

/// An array over `entries`, which belong to `scan`.
fn over<'py, T: Element>(
    scan: &Bound<'py, Scan>,
    entries: &[T],
) -> PyResult<Bound<'py, PyArray1<T>>> {
    // SAFETY: all callers give a column of `scan` itself. Its class is frozen: its columns are never written
    // to, moved or freed before the scan is. The array holds a reference to the scan, as its base, for as
    // long as it lives. The array is marked as read-only before anyone sees it. As it does not own its
    // memory, NumPy does not let that mark be taken away.
    let array =
        unsafe { PyArray1::borrow_from_array(&ArrayView1::from(entries), scan.clone().into_any()) };
    array.try_readwrite().map_err(|why| crate::error::fault(&why))?.make_nonwriteable();
    Ok(array)
}
