//! Every direction lit at once, a detector for each.

use serde::Deserialize;

use super::directions::{Angles, Directions};
use super::model::{Extent, Model, Moment, cell_at, middles};
use super::{Pattern, Sides, Typed};
use crate::design::Error;
use crate::design::limits::Check;
use crate::design::safety::Beams;

/// Detectors of the largest flash: their numbers are 16 bits wide.
const MOST_DETECTORS: u32 = 1 << 16;

/// Every direction at once.
#[derive(Debug, Clone, PartialEq)]
pub struct Flash {
    /// Rows of the image, from the top.
    pub rows: u32,
    /// Columns of the image, from the left.
    pub columns: u32,
    /// Full horizontal field, rad.
    pub horizontal: f64,
    /// Full vertical field, rad.
    pub vertical: f64,
}

/// `[scan.flash]` as typed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    rows: u32,
    columns: u32,
    horizontal_deg: f64,
    vertical_deg: f64,
}

impl Typed for File {
    fn check(&self, check: &Check) -> Result<Pattern, Error> {
        let [rows, columns] = check.pixels("flash", [self.rows, self.columns])?;
        if rows * columns > MOST_DETECTORS {
            let message = format!("has more than {MOST_DETECTORS} detectors");
            return check.refuse("scan.flash", message);
        }
        let sides = Sides { horizontal_deg: self.horizontal_deg, vertical_deg: self.vertical_deg };
        let [horizontal, vertical] = check.sides("flash", &sides)?;
        Ok(Pattern::Flash(Flash { rows, columns, horizontal, vertical }))
    }
}

impl Model for Flash {
    fn summary(&self) -> String {
        format!("one flash, {} detectors", self.channels())
    }

    fn size(&self) -> [u32; 2] {
        [self.rows, self.columns]
    }

    fn channels(&self) -> u32 {
        self.rows * self.columns
    }

    fn channel_of(&self, order: u64, _row: u16) -> u16 {
        order as u16
    }

    fn pixel(&self, order: u64) -> (u16, u16) {
        let columns = u64::from(self.columns);
        ((order / columns) as u16, (order % columns) as u16)
    }

    fn order_of(&self, row: u16, column: u16) -> u64 {
        u64::from(row) * u64::from(self.columns) + u64::from(column)
    }

    fn moment(&self, _order: u64, _period: f64) -> Moment {
        Moment { shots: 0, then: 0.0 }
    }

    fn equal_steps(&self) -> bool {
        false
    }

    fn line(&self) -> u64 {
        self.channels().into()
    }

    fn draws_from_the_left(&self) -> bool {
        false
    }

    fn shortest_dwell(&self, pixel_period: f64) -> f64 {
        pixel_period * f64::from(self.channels())
    }

    fn moves_by(&self) -> Option<f64> {
        None
    }

    fn directions(&self) -> Directions {
        let elevations = Angles::by_row(middles(self.vertical, self.rows));
        Directions::new(&elevations, &Angles::by_column(middles(self.horizontal, self.columns)))
    }

    fn pixel_at(&self, azimuth: f64, elevation: f64) -> Option<(u16, u16)> {
        let row = cell_at(elevation, self.vertical, self.rows)?;
        Some((row, cell_at(azimuth, self.horizontal, self.columns)?))
    }

    fn cell(&self) -> [f64; 2] {
        [self.horizontal / f64::from(self.columns), self.vertical / f64::from(self.rows)]
    }

    fn extent(&self) -> Extent {
        Extent::centred([self.horizontal, self.vertical])
    }

    fn shared_field(&self) -> Option<[f64; 2]> {
        None
    }

    fn follows(&self) -> bool {
        false
    }

    fn beams(&self) -> Beams {
        Beams::Flood([self.horizontal, self.vertical])
    }
}
