//! A grid of equal cells about the forward direction.

use super::directions::{Angles, Directions};
use super::model::Extent;
use crate::design::Error;
use crate::design::limits::Check;

/// Rows and columns of equal cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Rows, from the top.
    pub rows: u32,
    /// Columns, from the left.
    pub columns: u32,
    /// Full horizontal field, rad.
    pub horizontal: f64,
    /// Full vertical field, rad.
    pub vertical: f64,
}

/// A grid as typed among the keys of a pattern.
pub(super) struct Typed {
    pub rows: u32,
    pub columns: u32,
    pub horizontal_deg: f64,
    pub vertical_deg: f64,
}

impl Typed {
    /// The grid, where the pattern is called `name` in a sensor file.
    pub fn check(&self, check: &Check, name: &str) -> Result<Grid, Error> {
        let path = |key: &str| format!("scan.{name}.{key}");
        let side = |key: &str, typed, most| {
            check.within(&path(key), typed, 1e-3, most).map(f64::to_radians)
        };
        Ok(Grid {
            rows: check.count(&path("rows"), self.rows, 1, 1 << 14)?,
            columns: check.count(&path("columns"), self.columns, 1, 1 << 15)?,
            horizontal: side("horizontal_deg", self.horizontal_deg, 360.0)?,
            vertical: side("vertical_deg", self.vertical_deg, 180.0)?,
        })
    }
}

impl Grid {
    /// Returns the directions of the middles of its cells.
    pub(super) fn directions(&self) -> Directions {
        let azimuths = Angles::by_column(middles(self.horizontal, self.columns));
        Directions::new(&Angles::by_row(self.elevations()), &azimuths, Vec::new())
    }

    /// Elevations of its rows, rad.
    pub(super) fn elevations(&self) -> impl Iterator<Item = f64> {
        middles(self.vertical, self.rows)
    }

    /// Row and column of the cell in which a direction lies, rad; `None` outside.
    pub(super) fn cell_at(&self, azimuth: f64, elevation: f64) -> Option<(u16, u16)> {
        let row = cell_at(elevation, self.vertical, self.rows)?;
        Some((row, cell_at(azimuth, self.horizontal, self.columns)?))
    }

    /// Width and height of a cell, rad.
    pub(super) fn cell(&self) -> [f64; 2] {
        [self.horizontal / f64::from(self.columns), self.vertical / f64::from(self.rows)]
    }

    /// Width and height of all, rad.
    pub(super) fn sides(&self) -> [f64; 2] {
        [self.horizontal, self.vertical]
    }

    /// All of it.
    pub(super) fn extent(&self) -> Extent {
        Extent::centred(self.sides())
    }
}

/// Middles, rad, of `cells` equal cells of a `field` about the forward direction, from the left to
/// the right or from the top down.
fn middles(field: f64, cells: u32) -> impl Iterator<Item = f64> {
    (0..cells).map(move |cell| field * (0.5 - (f64::from(cell) + 0.5) / f64::from(cells)))
}

/// The cell, of `cells` equal ones of a `field`, in which the direction `angle` lies, rad.
fn cell_at(angle: f64, field: f64, cells: u32) -> Option<u16> {
    let cell = ((0.5 - angle / field) * f64::from(cells)).floor();
    (0.0..f64::from(cells)).contains(&cell).then_some(cell as u16)
}
