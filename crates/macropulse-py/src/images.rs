//! Columns as images.

use macropulse::points::{Entries, Pick};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

use crate::error::wrong;
use crate::scan::Scan;

/// The column of `scan` called `name` as a new array of rows and columns, one return of each pixel.
///
/// # Errors
/// If there is no such column or pick, or the scan has no pixels.
pub fn image<'py>(
    py: Python<'py>,
    scan: &Scan,
    name: &str,
    pick: Option<&str>,
) -> PyResult<Bound<'py, PyAny>> {
    let attribute = scan.known(name)?;
    let cloud = &scan.cloud;
    let image = cloud.image(picked(cloud.pick, pick)?);
    if image.is_empty() {
        return Err(wrong("the scan is a list of points without rows and columns of pixels"));
    }
    let shape = [cloud.rows, cloud.columns];
    Ok(match attribute.image(cloud, &image) {
        Entries::F4(values) => {
            PyArray1::from_vec(py, values.into_owned()).reshape(shape)?.into_any()
        }
        Entries::F8(values) => {
            PyArray1::from_vec(py, values.into_owned()).reshape(shape)?.into_any()
        }
        Entries::U1(values) => {
            PyArray1::from_vec(py, values.into_owned()).reshape(shape)?.into_any()
        }
        Entries::U2(values) => {
            PyArray1::from_vec(py, values.into_owned()).reshape(shape)?.into_any()
        }
    })
}

/// Which return of a pixel is shown.
fn picked(usual: Pick, pick: Option<&str>) -> PyResult<Pick> {
    match pick {
        None => Ok(usual),
        Some("first") => Ok(Pick::First),
        Some("strongest") => Ok(Pick::Strongest),
        Some("last") => Ok(Pick::Last),
        Some(other) => Err(wrong(format!(
            "pick is {other:?}; it must be \"first\", \"strongest\" or \"last\""
        ))),
    }
}
