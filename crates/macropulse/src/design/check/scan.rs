//! Where and when the sensor looks.

use super::Check;
use crate::design::file::{ScanFile, SpinningFile};
use crate::design::{Error, Pattern, Scan};

/// Pixels of the largest range image: a scan of it takes some 4 GB.
const MOST_PIXELS: u64 = 1 << 25;

/// Light is followed to so many times the end of the range gate, unless the file says how far: to
/// all second-time-around returns that fall into the gate of the shot fired one gate later. From
/// twice the range a surface brings a quarter of the light at most.
const LIGHT_BEYOND_GATE: f64 = 2.0;

impl Check<'_> {
    pub(super) fn scan(&self, file: &ScanFile, moves: bool) -> Result<Scan, Error> {
        let rate = self.within("scan.scans_per_s", file.scans_per_s, 1e-3, 1e5)?;
        let rated_range = self.within("scan.max_range_m", file.max_range_m, 0.01, 1e5)?;
        let beyond = self.within("scan.gate_beyond_m", file.gate_beyond_m, 0.0, 1e5)?;
        let max_range = rated_range + beyond;
        let light_range = match file.light_range_m {
            Some(typed) => self.within("scan.light_range_m", typed, max_range, 1e5)?,
            None => LIGHT_BEYOND_GATE * max_range,
        };
        let min_range = self.within("scan.min_range_m", file.min_range_m, 0.0, max_range)?;
        let pixels = |kind: &str, rows, columns| -> Result<(u32, u32), Error> {
            Ok((
                self.count(&format!("scan.{kind}.rows"), rows, 1, 1 << 14)?,
                self.count(&format!("scan.{kind}.columns"), columns, 1, 1 << 15)?,
            ))
        };
        let field = |kind: &str, horizontal, vertical| -> Result<(f64, f64), Error> {
            Ok((
                self.within(&format!("scan.{kind}.horizontal_deg"), horizontal, 1e-3, 360.0)?
                    .to_radians(),
                self.within(&format!("scan.{kind}.vertical_deg"), vertical, 1e-3, 180.0)?
                    .to_radians(),
            ))
        };
        let (rows, columns, pattern) = match (&file.raster, &file.spinning, &file.flash) {
            (Some(raster), None, None) => {
                let (rows, columns) = pixels("raster", raster.rows, raster.columns)?;
                let (horizontal, vertical) =
                    field("raster", raster.horizontal_deg, raster.vertical_deg)?;
                let duty = self.within("scan.raster.duty", raster.duty, 0.01, 1.0)?;
                let mirror = raster.mirror;
                (rows, columns, Pattern::Raster { horizontal, vertical, mirror, duty })
            }
            (None, Some(spinning), None) => self.spinning(spinning)?,
            (None, None, Some(flash)) => {
                let (rows, columns) = pixels("flash", flash.rows, flash.columns)?;
                if rows * columns > 65_536 {
                    return self.refuse("scan.flash", "has more than 65536 detectors");
                }
                let (horizontal, vertical) =
                    field("flash", flash.horizontal_deg, flash.vertical_deg)?;
                (rows, columns, Pattern::Flash { horizontal, vertical })
            }
            _ => {
                return self.refuse(
                    "scan",
                    "needs exactly one of [scan.raster], [scan.spinning], [scan.flash]",
                );
            }
        };
        if moves && !matches!(pattern, Pattern::Raster { .. }) {
            return self.refuse(
                "idealised",
                "the motion of the beam is modelled for a raster alone: add \"mirror-motion\" to \
                 this list",
            );
        }
        if u64::from(rows) * u64::from(columns) > MOST_PIXELS {
            let message = format!("{rows} x {columns} pixels are more than {MOST_PIXELS}");
            return self.refuse("scan", message);
        }
        let rate_millihertz = (rate * 1e3).round() as u64;
        Ok(Scan {
            rows,
            columns,
            rate_millihertz,
            min_range,
            rated_range,
            max_range,
            light_range,
            moves,
            pattern,
        })
    }

    fn spinning(&self, file: &SpinningFile) -> Result<(u32, u32, Pattern), Error> {
        let path = "scan.spinning.azimuth_step_deg";
        let step = self.within(path, file.azimuth_step_deg, 0.012, 90.0)?;
        let path = "scan.spinning.blocks";
        let mut elevations = Vec::new();
        let mut turns: Vec<(u32, usize)> = Vec::new();
        for block in &file.blocks {
            for laser in 0..self.count(path, block.lasers, 1, 1024)? {
                let elevation = block.first_deg + f64::from(laser) * block.step_deg;
                turns.push((laser, elevations.len()));
                elevations.push(self.within(path, elevation, -90.0, 90.0)?.to_radians());
            }
        }
        if elevations.is_empty() {
            return self.refuse(path, "names no laser");
        }
        if !elevations.is_sorted_by(|above, below| above > below) {
            return self.refuse(path, "must list the elevations from the top down");
        }
        turns.sort_unstable();
        let order = turns.into_iter().map(|(_, row)| row as u16).collect();
        let rows = elevations.len() as u32;
        let columns = (360.0 / step).round() as u32;
        Ok((rows, columns, Pattern::Spinning { elevations, order, firing: file.firing }))
    }
}
