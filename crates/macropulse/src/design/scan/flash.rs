//! Every direction lit at once, a detector for each.

use schemars::JsonSchema;
use serde::Deserialize;

use super::grid::{self, Grid};
use super::model::{Extent, Model, Moment};
use super::{Directions, Pattern, Typed};
use crate::design::Error;
use crate::design::limits::{Check, Idle};
use crate::design::safety::Beams;

/// Detectors of the largest flash: their numbers are 16 bits wide.
const MOST_DETECTORS: u32 = 1 << 16;

/// Every direction at once.
#[derive(Debug, Clone, PartialEq)]
pub struct Flash {
    /// Its pixels, each with a detector.
    pub grid: Grid,
}

/// `[scan.flash]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Rows of pixels, each with a detector: 65536 in all at most.
    #[schemars(range(min = 1, max = 16384))]
    rows: u32,
    /// Pixels of a row.
    #[schemars(range(min = 1, max = 32768))]
    columns: u32,
    /// Full field from left to right, degrees.
    #[schemars(range(min = 0.001, max = 360))]
    horizontal_deg: f64,
    /// Full field from top to bottom, degrees.
    #[schemars(range(min = 0.001, max = 180))]
    vertical_deg: f64,
}

impl Typed for File {
    fn check(&self, check: &Check, _period: f64) -> Result<Pattern, Error> {
        let &Self { rows, columns, horizontal_deg, vertical_deg } = self;
        let grid = grid::Typed { rows, columns, horizontal_deg, vertical_deg };
        let grid = grid.check(check, "flash")?;
        if grid.rows * grid.columns > MOST_DETECTORS {
            let message = format!("has more than {MOST_DETECTORS} detectors");
            return check.refuse("scan.flash", message);
        }
        Ok(Pattern::Flash(Flash { grid }))
    }

    fn idle(&self) -> Option<Idle> {
        Some(Idle {
            key: "light.divergence_mrad".to_owned(),
            by: "scan.flash",
            why: "each pixel gathers the light of its cell, which a flood lights evenly",
        })
    }
}

impl Model for Flash {
    fn summary(&self) -> String {
        format!("one flash, {} detectors", self.channels())
    }

    fn size(&self) -> [u32; 2] {
        [self.grid.rows, self.grid.columns]
    }

    fn channels(&self) -> u32 {
        self.grid.rows * self.grid.columns
    }

    fn channel_of(&self, order: u64, _row: u16) -> u16 {
        order as u16
    }

    fn pixel(&self, order: u64) -> (u16, u16) {
        let columns = u64::from(self.grid.columns);
        ((order / columns) as u16, (order % columns) as u16)
    }

    fn order_of(&self, row: u16, column: u16) -> u64 {
        u64::from(row) * u64::from(self.grid.columns) + u64::from(column)
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
        self.grid.directions()
    }

    fn pixel_at(&self, azimuth: f64, elevation: f64) -> Option<(u16, u16)> {
        self.grid.cell_at(azimuth, elevation)
    }

    fn cell(&self) -> [f64; 2] {
        self.grid.cell()
    }

    fn flooded_cell(&self) -> Option<[f64; 2]> {
        Some(self.cell())
    }

    fn extent(&self) -> Extent {
        self.grid.extent()
    }

    fn shared_field(&self) -> Option<[f64; 2]> {
        None
    }

    fn follows(&self) -> bool {
        false
    }

    fn beams(&self) -> Beams {
        Beams::Flood(self.grid.sides())
    }
}
