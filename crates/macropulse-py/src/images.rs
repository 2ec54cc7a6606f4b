//! Columns as images.

use macropulse::points::Pick;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

use crate::columns::{Column, angle};
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
    let column = scan.known(name)?;
    let cloud = &scan.cloud;
    let shape = [cloud.rows, cloud.columns];
    let image = cloud.image(picked(cloud.pick, pick)?);
    if image.is_empty() {
        return Err(wrong("the scan is a list of points without rows and columns of pixels"));
    }
    let surface = |pixel: usize| image.surface(cloud, pixel);
    let pixels = 0..image.len();
    Ok(match (name, column) {
        ("true_range", _) => {
            let values = pixels.map(|pixel| surface(pixel).range).collect();
            PyArray1::from_vec(py, values).reshape(shape)?.into_any()
        }
        ("incidence", _) => {
            let values = pixels.map(|pixel| angle(surface(pixel).cosine)).collect();
            PyArray1::from_vec(py, values).reshape(shape)?.into_any()
        }
        ("object", _) => {
            let values = pixels.map(|pixel| surface(pixel).object).collect();
            PyArray1::from_vec(py, values).reshape(shape)?.into_any()
        }
        ("material", _) => {
            let values = pixels.map(|pixel| surface(pixel).material).collect();
            PyArray1::from_vec(py, values).reshape(shape)?.into_any()
        }
        (_, Column::Outcomes(_)) => {
            let values = pixels.map(|pixel| surface(pixel).outcome as u8).collect();
            PyArray1::from_vec(py, values).reshape(shape)?.into_any()
        }
        (_, Column::F4(entries)) => {
            PyArray1::from_vec(py, image.spread(entries, f32::NAN)).reshape(shape)?.into_any()
        }
        (_, Column::F8(entries)) => {
            PyArray1::from_vec(py, image.spread(entries, f64::NAN)).reshape(shape)?.into_any()
        }
        (_, Column::U1(entries)) => {
            PyArray1::from_vec(py, image.spread(entries, 0)).reshape(shape)?.into_any()
        }
        (_, Column::U2(entries)) => {
            PyArray1::from_vec(py, image.spread(entries, 0)).reshape(shape)?.into_any()
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
