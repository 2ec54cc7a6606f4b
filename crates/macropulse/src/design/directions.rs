//! Where each pixel lies, looked up instead of computed for every shot.

use std::f64::consts::{PI, TAU};

use super::{Firing, Pattern, Scan};

/// Unit vectors in the sensor frame (x forward, y left, z up) at which the pixels of a scan lie.
///
/// Column 0 is at the left, row 0 at the top. A spinning sensor begins to the rear, turns
/// clockwise seen from above, and goes on turning while its lasers fire one after another.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions {
    rows: Vec<Row>,
    /// Sine and cosine of the azimuth, by column, then by turn.
    azimuths: Vec<[f64; 2]>,
    /// Azimuths a column has: one, or one for each laser of a head that turns between them.
    turns: usize,
}

/// What a row decides.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Row {
    /// Sine and cosine of the elevation.
    elevation: [f64; 2],
    /// Which azimuth of its column it has.
    turn: usize,
}

impl Directions {
    /// The directions of `scan`.
    pub(super) fn of_scan(scan: &Scan) -> Self {
        let columns = f64::from(scan.columns);
        let (mut rows, mut azimuths) = (Vec::new(), Vec::new());
        let mut turns = 1;
        match &scan.pattern {
            Pattern::Raster { horizontal, vertical, .. }
            | Pattern::Flash { horizontal, vertical } => {
                for row in 0..scan.rows {
                    let down = (f64::from(row) + 0.5) / f64::from(scan.rows);
                    rows.push(Row { elevation: sine_cosine(vertical * (0.5 - down)), turn: 0 });
                }
                for column in 0..scan.columns {
                    let across = (f64::from(column) + 0.5) / columns;
                    azimuths.push(sine_cosine(horizontal * (0.5 - across)));
                }
            }
            Pattern::Spinning { elevations, order, firing } => {
                let in_turn = *firing == Firing::BlocksInTurn;
                turns = if in_turn { order.len() } else { 1 };
                for (row, elevation) in elevations.iter().enumerate() {
                    let fired = order.iter().position(|&fired| usize::from(fired) == row);
                    let turn = fired.filter(|_| in_turn).unwrap_or(0);
                    rows.push(Row { elevation: sine_cosine(*elevation), turn });
                }
                for column in 0..scan.columns {
                    for turn in 0..turns {
                        let turned = f64::from(column) + turn as f64 / order.len() as f64;
                        azimuths.push(sine_cosine(PI - TAU * (turned / columns)));
                    }
                }
            }
        }
        Self { rows, azimuths, turns }
    }

    /// The unit vector at which the middle of a pixel of the image lies.
    #[inline]
    pub fn of(&self, row: u16, column: u16) -> [f64; 3] {
        let Row { elevation: [sin_e, cos_e], turn } = self.rows[usize::from(row)];
        let [sin_a, cos_a] = self.azimuths[usize::from(column) * self.turns + turn];
        [cos_e * cos_a, cos_e * sin_a, sin_e]
    }
}

impl Scan {
    /// The pixel, row and column, in whose cell the unit vector `direction` of the sensor frame
    /// lies; `None` outside the field of view. A cell reaches half of the way to its neighbours.
    pub fn pixel_at(&self, direction: [f64; 3]) -> Option<(u16, u16)> {
        let [x, y, z] = direction;
        let (azimuth, elevation) = (libm::atan2(y, x), libm::asin(z.clamp(-1.0, 1.0)));
        let columns = f64::from(self.columns);
        match &self.pattern {
            Pattern::Raster { horizontal, vertical, .. }
            | Pattern::Flash { horizontal, vertical } => {
                let cell = |part: f64, count: u32| {
                    let cell = (part * f64::from(count)).floor();
                    (0.0..f64::from(count)).contains(&cell).then_some(cell as u16)
                };
                let row = cell(0.5 - elevation / vertical, self.rows)?;
                Some((row, cell(0.5 - azimuth / horizontal, self.columns)?))
            }
            Pattern::Spinning { elevations, order, firing } => {
                let row = nearest_row(elevations, elevation)?;
                let turn = match firing {
                    Firing::BlocksInTurn => order.iter().position(|&fired| fired == row)?,
                    Firing::Together => 0,
                };
                let turned = (PI - azimuth) / TAU * columns - turn as f64 / order.len() as f64;
                Some((row, turned.round().rem_euclid(columns) as u16))
            }
        }
    }
}

/// The row, of those at `elevations` from the top down, whose cell holds `elevation`. The first
/// and the last one reach as far outwards as inwards; one alone reaches everywhere.
fn nearest_row(elevations: &[f64], elevation: f64) -> Option<u16> {
    let below = elevations.partition_point(|other| *other > elevation);
    let gap = |upper: usize| match (elevations.get(upper), elevations.get(upper + 1)) {
        (Some(upper), Some(lower)) => upper - lower,
        _ => TAU,
    };
    let row = match below.checked_sub(1) {
        None => (elevation <= elevations[0] + gap(0) / 2.0).then_some(0),
        Some(above) if below == elevations.len() => {
            (elevation >= elevations[above] - gap(above.saturating_sub(1)) / 2.0).then_some(above)
        }
        Some(above) => {
            Some(if elevations[above] - elevation < gap(above) / 2.0 { above } else { below })
        }
    };
    row.map(|row| row as u16)
}

fn sine_cosine(angle: f64) -> [f64; 2] {
    [libm::sin(angle), libm::cos(angle)]
}

#[cfg(test)]
mod tests {
    use crate::design::{Design, Firing, Pattern};
    use std::f64::consts::{PI, TAU};

    /// The formula, one pixel at a time.
    fn formula(design: &Design, row: u16, column: u16) -> [f64; 3] {
        let (rows, columns) = (f64::from(design.scan.rows), f64::from(design.scan.columns));
        let across = (f64::from(column) + 0.5) / columns;
        let down = (f64::from(row) + 0.5) / rows;
        let (azimuth, elevation) = match &design.scan.pattern {
            Pattern::Raster { horizontal, vertical, .. }
            | Pattern::Flash { horizontal, vertical } => {
                (horizontal * (0.5 - across), vertical * (0.5 - down))
            }
            Pattern::Spinning { elevations, order, firing } => {
                let turn = match firing {
                    Firing::BlocksInTurn => order.iter().position(|&r| r == row).unwrap(),
                    Firing::Together => 0,
                };
                let turned = (f64::from(column) + turn as f64 / order.len() as f64) / columns;
                (PI - TAU * turned, elevations[usize::from(row)])
            }
        };
        let (sin_a, cos_a) = (libm::sin(azimuth), libm::cos(azimuth));
        let (sin_e, cos_e) = (libm::sin(elevation), libm::cos(elevation));
        [cos_e * cos_a, cos_e * sin_a, sin_e]
    }

    /// A sensor of every pattern, with its name.
    fn of_every_pattern() -> [(&'static str, Design); 4] {
        let together = [("scan.spinning.firing".to_owned(), "together".to_owned())];
        let sensors = [
            ("kim-park-2016", &[][..]),
            ("hdl-64e", &[]),
            ("hdl-64e", &together),
            ("peregrine", &[]),
        ];
        sensors.map(|(name, set)| (name, Design::open(name, set).unwrap()))
    }

    #[test]
    fn every_pixel_has_the_direction_of_the_formula_to_the_last_bit() {
        for (name, design) in of_every_pattern() {
            for row in 0..design.scan.rows as u16 {
                // Every column of a large image would take long.
                for column in (0..design.scan.columns as u16).step_by(7) {
                    let table = design.directions().of(row, column);
                    assert_eq!(table, formula(&design, row, column), "{name}: {row}, {column}");
                }
            }
        }
    }

    #[test]
    fn every_pixel_is_found_where_it_lies() {
        for (name, design) in of_every_pattern() {
            for row in 0..design.scan.rows as u16 {
                for column in (0..design.scan.columns as u16).step_by(11) {
                    let found = design.scan.pixel_at(design.directions().of(row, column));
                    assert_eq!(found, Some((row, column)), "{name}");
                }
            }
        }
    }

    #[test]
    fn outside_the_field_there_is_no_pixel() {
        let seen = |name: &str, azimuth: f64, elevation: f64| {
            let [a, e] = [azimuth, elevation].map(f64::to_radians);
            let direction = [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()];
            Design::open(name, &[]).unwrap().scan.pixel_at(direction)
        };
        assert_eq!(seen("peregrine", 14.99, 3.74), Some((0, 0)));
        assert_eq!(seen("peregrine", 15.01, 0.0), None);
        assert_eq!(seen("peregrine", 0.0, -3.76), None);
        // Behind a staring sensor, too, and above and below a spinning one.
        assert_eq!(seen("kim-park-2016", 180.0, 0.0), None);
        assert_eq!(seen("hdl-64e", 77.0, 2.16).map(|pixel| pixel.0), Some(0));
        assert_eq!(seen("hdl-64e", 77.0, 2.17), None);
        assert_eq!(seen("hdl-64e", 77.0, -24.5).map(|pixel| pixel.0), Some(63));
        assert_eq!(seen("hdl-64e", 77.0, -24.6), None);
    }

    #[test]
    fn directions_are_unit_vectors_left_to_right_and_top_down() {
        for name in ["kim-park-2016", "hdl-64e", "peregrine"] {
            let design = Design::open(name, &[]).unwrap();
            let (row, column) = (design.scan.rows as u16 - 1, design.scan.columns as u16 / 2 + 3);
            let d = design.directions().of(row, column);
            approx::assert_relative_eq!(d.iter().map(|v| v * v).sum::<f64>(), 1.0, epsilon = 1e-12);
            assert!(d[0] > 0.0 && d[1] < 0.0 && d[2] < 0.0, "{name}: {d:?}");
        }
    }
}
