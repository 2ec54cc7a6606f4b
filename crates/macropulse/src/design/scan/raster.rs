//! One beam that a mirror leads over the field, line by line.

use std::f64::consts::{FRAC_PI_2, PI};

use schemars::JsonSchema;
use serde::Deserialize;

use super::grid::{self, Grid};
use super::model::{Extent, Model, Moment};
use super::{Directions, Pattern, Typed};
use crate::design::Error;
use crate::design::limits::Check;
use crate::design::safety::{Beams, Line, Lines};

/// One beam, line by line.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Its pixels: a line is a row.
    pub grid: Grid,
    /// Motion of the fast axis.
    pub mirror: Mirror,
    /// Fraction of the line time in which shots are fired.
    pub duty: f64,
}

/// How the fast axis of a raster moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Mirror {
    /// Constant angular speed, every line in the same direction.
    Uniform,
    /// Resonant: sinusoidal, lines to and fro.
    Sinusoidal,
}

impl Mirror {
    /// When, as a fraction of the line time, the mirror has crossed the fraction `across` of the
    /// line, shots being fired in the fraction `duty` of that time.
    ///
    /// A resonant mirror stands at sin(π·s), s = −½…½ over the line time; only |s| ≤ duty/2 is used.
    pub fn moment(self, duty: f64, across: f64) -> f64 {
        match self {
            Self::Uniform => (1.0 - duty) / 2.0 + duty * across,
            Self::Sinusoidal => {
                let end = libm::sin(FRAC_PI_2 * duty);
                0.5 + libm::asin((2.0 * across - 1.0) * end) / PI
            }
        }
    }
}

/// `[scan.raster]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Rows of pixels, which are lines of the beam.
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
    /// Motion of the fast axis.
    mirror: Mirror,
    /// Share of the time of a line in which shots are fired.
    #[schemars(range(min = 0.01, max = 1))]
    duty: f64,
}

impl Typed for File {
    fn check(&self, check: &Check, _period: f64) -> Result<Pattern, Error> {
        let &Self { rows, columns, horizontal_deg, vertical_deg, mirror, .. } = self;
        let grid = grid::Typed { rows, columns, horizontal_deg, vertical_deg };
        let grid = grid.check(check, "raster")?;
        let duty = check.within("scan.raster.duty", self.duty, 0.01, 1.0)?;
        Ok(Pattern::Raster(Raster { grid, mirror, duty }))
    }
}

impl Raster {
    /// Whether the line of this number is drawn from the right to the left.
    fn comes_back(&self, line: u64) -> bool {
        self.mirror == Mirror::Sinusoidal && line % 2 == 1
    }
}

impl Model for Raster {
    fn summary(&self) -> String {
        "one beam, mirror raster".to_owned()
    }

    fn size(&self) -> [u32; 2] {
        [self.grid.rows, self.grid.columns]
    }

    fn channels(&self) -> u32 {
        1
    }

    fn channel_of(&self, _order: u64, _row: u16) -> u16 {
        0
    }

    fn pixel(&self, order: u64) -> (u16, u16) {
        let columns = u64::from(self.grid.columns);
        let (line, across) = (order / columns, order % columns);
        let column = if self.comes_back(line) { columns - 1 - across } else { across };
        (line as u16, column as u16)
    }

    fn order_of(&self, row: u16, column: u16) -> u64 {
        let (line, columns) = (u64::from(row), u64::from(self.grid.columns));
        let column = u64::from(column);
        line * columns + if self.comes_back(line) { columns - 1 - column } else { column }
    }

    fn moment(&self, order: u64, period: f64) -> Moment {
        if self.equal_steps() {
            return Moment { shots: order, then: 0.0 };
        }
        let columns = u64::from(self.grid.columns);
        let across = (order % columns) as f64 / columns as f64;
        let line = period / f64::from(self.grid.rows);
        let then = line * self.mirror.moment(self.duty, across);
        Moment { shots: order / columns * columns, then }
    }

    fn equal_steps(&self) -> bool {
        self.mirror == Mirror::Uniform && self.duty == 1.0
    }

    fn line(&self) -> u64 {
        self.grid.columns.into()
    }

    fn draws_from_the_left(&self) -> bool {
        self.mirror == Mirror::Uniform
    }

    fn shortest_dwell(&self, pixel_period: f64) -> f64 {
        match self.mirror {
            Mirror::Uniform => pixel_period * self.duty,
            Mirror::Sinusoidal => {
                // Position sin(π·s) for s in ±duty/2 of the line time, scaled to ±1 at the ends.
                let columns = f64::from(self.grid.columns);
                let end = (FRAC_PI_2 * self.duty).sin();
                pixel_period * columns * 2.0 / PI * (end / columns).asin()
            }
        }
    }

    fn moves_by(&self) -> Option<f64> {
        Some(self.grid.cell()[0])
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

    fn extent(&self) -> Extent {
        self.grid.extent()
    }

    fn shared_field(&self) -> Option<[f64; 2]> {
        Some(self.grid.sides())
    }

    fn follows(&self) -> bool {
        true
    }

    fn beams(&self) -> Beams {
        let step = self.grid.cell()[0];
        let first = (self.grid.horizontal - step) / 2.0;
        let rows = self.grid.elevations().map(|elevation| Line { elevation, first }).collect();
        Beams::Lines(Lines { rows, step, first, one_by_one: true })
    }
}
