//! The columns of a cloud, as arrays that lend its memory.

#![allow(unsafe_code)]

use std::borrow::Cow;

use macropulse::points::{Outcome, PointCloud};
use numpy::ndarray::ArrayView1;
use numpy::{Element, PyArray1, PyArrayMethods};
use pyo3::prelude::*;

use crate::scan::Scan;

/// What follows from the columns and is asked for as one; made when first asked for.
pub struct Computed {
    /// What is to be known of each return, as bits.
    pub flags: Vec<u8>,
    /// Angle of incidence, rad; NaN where there is no surface. Empty without the truth.
    pub incidence: Vec<f32>,
    /// Distance of each point from the origin, m; empty where the cloud has ranges.
    pub distance: Vec<f32>,
}

impl Computed {
    /// Of all returns of `cloud`.
    pub fn of(cloud: &PointCloud) -> Self {
        let cosines = &cloud.truth.returns.cosine;
        Self {
            flags: (0..cloud.returns()).map(|at| cloud.flags(at)).collect(),
            incidence: cosines.iter().copied().map(angle).collect(),
            distance: match cloud.distances() {
                Cow::Borrowed(_) => Vec::new(),
                Cow::Owned(distances) => distances,
            },
        }
    }
}

/// The angle of incidence of which this is the cosine, rad, as files have it.
pub fn angle(cosine: f32) -> f32 {
    libm::acos(f64::from(cosine).clamp(0.0, 1.0)) as f32
}

/// Names of the columns of a measurement.
pub const MEASURED: [&str; 16] = [
    "x",
    "y",
    "z",
    "intensity",
    "range",
    "time_ns",
    "row",
    "column",
    "ring",
    "peak",
    "marks",
    "margin",
    "return_number",
    "number_of_returns",
    "flags",
    "photons",
];

/// Names of the columns of the truth beside it.
pub const TRUE: [&str; 5] = ["true_range", "object", "material", "incidence", "outcome"];

/// A column that a scan has.
pub enum Column<'a> {
    /// Real numbers of four bytes.
    F4(&'a [f32]),
    /// Real numbers of eight bytes.
    F8(&'a [f64]),
    /// Whole numbers of one byte.
    U1(&'a [u8]),
    /// Whole numbers of two bytes.
    U2(&'a [u16]),
    /// How returns came out: a byte each.
    Outcomes(&'a [Outcome]),
}

impl Scan {
    /// The column called `name`; `None` if there is none of this name, or the scan does not have it.
    pub fn column(&self, name: &str) -> Option<Column<'_>> {
        let (cloud, truth) = (&self.cloud, &self.cloud.truth.returns);
        let has_truth = self.has_truth();
        let column = match name {
            "x" => Column::length(&cloud.x, &cloud.exact.x),
            "y" => Column::length(&cloud.y, &cloud.exact.y),
            "z" => Column::length(&cloud.z, &cloud.exact.z),
            "intensity" => Column::F4(&cloud.intensity),
            "range" => Column::length(&cloud.range, &cloud.exact.range),
            "time_ns" => Column::F8(&cloud.time_ns),
            "row" | "ring" => Column::U2(&cloud.row),
            "column" => Column::U2(&cloud.column),
            "peak" => Column::U2(&cloud.peak),
            "marks" => Column::U2(&cloud.marks),
            "margin" => Column::U2(&cloud.margin),
            "return_number" => Column::U1(&cloud.return_number),
            "number_of_returns" => Column::U1(&cloud.number_of_returns),
            "flags" if cloud.has(cloud.marks.len()) || cloud.has(cloud.saturated.len()) => {
                Column::U1(&self.computed().flags)
            }
            "photons" => Column::F4(&cloud.photons),
            "true_range" if has_truth => Column::F4(&truth.range),
            "object" if has_truth => Column::U2(&truth.object),
            "material" if has_truth => Column::U2(&truth.material),
            "incidence" if has_truth => Column::F4(&self.computed().incidence),
            "outcome" if has_truth => Column::Outcomes(&truth.outcome),
            _ => return None,
        };
        Some(column).filter(|column| cloud.has(column.len()))
    }
}

impl<'a> Column<'a> {
    /// A length: the exact column where there is one.
    fn length(single: &'a [f32], exact: &'a [f64]) -> Self {
        match exact.is_empty() {
            true => Self::F4(single),
            false => Self::F8(exact),
        }
    }

    fn len(&self) -> usize {
        match self {
            Self::F4(entries) => entries.len(),
            Self::F8(entries) => entries.len(),
            Self::U1(entries) => entries.len(),
            Self::U2(entries) => entries.len(),
            Self::Outcomes(entries) => entries.len(),
        }
    }
}

/// An array over the `column` of `scan`, which cannot be written to and keeps the scan alive.
pub fn lent<'py>(scan: &Bound<'py, Scan>, column: &Column<'_>) -> PyResult<Bound<'py, PyAny>> {
    Ok(match *column {
        Column::F4(entries) => over(scan, entries)?.into_any(),
        Column::F8(entries) => over(scan, entries)?.into_any(),
        Column::U1(entries) => over(scan, entries)?.into_any(),
        Column::U2(entries) => over(scan, entries)?.into_any(),
        Column::Outcomes(entries) => {
            // SAFETY: `Outcome` is `repr(u8)`, so each entry is one initialised byte with no more
            // alignment than that, and the new slice lives no longer than the old one.
            let bytes =
                unsafe { std::slice::from_raw_parts(entries.as_ptr().cast::<u8>(), entries.len()) };
            over(scan, bytes)?.into_any()
        }
    })
}

/// An array over `entries`, which belong to `scan`.
fn over<'py, T: Element>(
    scan: &Bound<'py, Scan>,
    entries: &[T],
) -> PyResult<Bound<'py, PyArray1<T>>> {
    // SAFETY: all callers give a column of `scan` itself. Its class is frozen: its columns are never
    // written to, moved or freed before the scan is, which the array holds a reference to, as its
    // base, for as long as it lives. The array is marked as not to be written to before anyone sees
    // it, and as it does not own its memory, NumPy does not let that mark be taken away.
    let array =
        unsafe { PyArray1::borrow_from_array(&ArrayView1::from(entries), scan.clone().into_any()) };
    array.try_readwrite().map_err(|why| crate::error::fault(&why))?.make_nonwriteable();
    Ok(array)
}
