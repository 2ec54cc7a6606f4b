//! When, within a scan, each pixel is lit.

use std::f64::consts::{FRAC_PI_2, PI};

use super::{Firing, Mirror, Pattern, Scan};

impl Mirror {
    /// When, as a fraction of the line time, the mirror has crossed the fraction `across` of the
    /// line, shots being fired in the fraction `duty` of that time.
    ///
    /// A resonant mirror stands at sin(π·s), s = −½…½ over the line time; only |s| ≤ duty/2 is used.
    pub fn moment(self, duty: f64, across: f64) -> f64 {
        match self {
            Self::Uniform => (1.0 - duty) / 2.0 + duty * across,
            Self::Sinusoidal => {
                let edge = libm::sin(FRAC_PI_2 * duty);
                0.5 + libm::asin((2.0 * across - 1.0) * edge) / PI
            }
        }
    }
}

impl Scan {
    /// Number of separate detectors: one behind a single beam, one for each laser of a turning
    /// head, one for each pixel of a flash.
    pub fn channels(&self) -> u32 {
        match &self.pattern {
            Pattern::Raster { .. } => 1,
            Pattern::Spinning { elevations, .. } => elevations.len() as u32,
            Pattern::Flash { .. } => self.rows * self.columns,
        }
    }

    /// Mean time between shots of the same detector, s.
    pub fn channel_period(&self) -> f64 {
        let shots = f64::from(self.rows) * f64::from(self.columns);
        self.period() / shots * f64::from(self.channels())
    }

    /// Duration of one scan, s.
    pub fn period(&self) -> f64 {
        1000.0 / self.rate_millihertz as f64
    }

    /// Seconds from the beginning of a scan until the pixel at `row` and `column` is lit, `turn`
    /// being the place of its row in the order in which rows fire. The chip clock, for which a shot
    /// waits, is left out.
    pub(super) fn moment(&self, [row, column]: [u32; 2], turn: usize) -> f64 {
        let columns = f64::from(self.columns);
        let passed = match &self.pattern {
            Pattern::Raster { mirror, duty, .. } => {
                let back = *mirror == Mirror::Sinusoidal && row % 2 == 1;
                let across = if back { self.columns - 1 - column } else { column };
                let line = f64::from(row) + mirror.moment(*duty, f64::from(across) / columns);
                line / f64::from(self.rows)
            }
            Pattern::Spinning { order, firing, .. } => {
                let turned = match firing {
                    Firing::BlocksInTurn => turn as f64 / order.len() as f64,
                    Firing::Together => 0.0,
                };
                (f64::from(column) + turned) / columns
            }
            Pattern::Flash { .. } => 0.0,
        };
        passed * self.period()
    }
}
