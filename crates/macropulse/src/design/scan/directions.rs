//! Where each pixel lies, looked up instead of computed for every shot.

/// Unit vectors in the sensor frame (x forward, y left, z up) at which the pixels of a scan lie.
///
/// Column 0 is at the left, row 0 at the top. A spinning sensor begins to the rear, turns
/// clockwise seen from above, and goes on turning while its lasers fire one after another.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions {
    elevations: Table,
    azimuths: Table,
}

/// An angle of each pixel, rad: that of `row` and `column` is number
/// row · `per_row` + column · `per_column` of `angles`.
pub(super) struct Angles {
    pub angles: Vec<f64>,
    pub per_row: usize,
    pub per_column: usize,
}

impl Angles {
    /// An angle for each row.
    pub fn by_row(angles: impl Iterator<Item = f64>) -> Self {
        Self { angles: angles.collect(), per_row: 1, per_column: 0 }
    }

    /// An angle for each column.
    pub fn by_column(angles: impl Iterator<Item = f64>) -> Self {
        Self { angles: angles.collect(), per_row: 0, per_column: 1 }
    }
}

/// Sines and cosines of [`Angles`].
#[derive(Debug, Clone, PartialEq)]
struct Table {
    sine_cosine: Vec<[f64; 2]>,
    per_row: usize,
    per_column: usize,
}

impl Table {
    fn of(angles: &Angles) -> Self {
        let sine_cosine = |angle: &f64| [libm::sin(*angle), libm::cos(*angle)];
        let Angles { angles, per_row, per_column } = angles;
        let sine_cosine = angles.iter().map(sine_cosine).collect();
        Self { sine_cosine, per_row: *per_row, per_column: *per_column }
    }

    #[inline]
    fn at(&self, row: usize, column: usize) -> [f64; 2] {
        self.sine_cosine[row * self.per_row + column * self.per_column]
    }
}

impl Directions {
    /// The directions at these elevations and azimuths.
    pub(super) fn new(elevations: &Angles, azimuths: &Angles) -> Self {
        Self { elevations: Table::of(elevations), azimuths: Table::of(azimuths) }
    }

    /// The unit vector at which the middle of a pixel of the image lies.
    #[inline]
    pub fn of(&self, row: u16, column: u16) -> [f64; 3] {
        let (row, column) = (usize::from(row), usize::from(column));
        let [sin_e, cos_e] = self.elevations.at(row, column);
        let [sin_a, cos_a] = self.azimuths.at(row, column);
        [cos_e * cos_a, cos_e * sin_a, sin_e]
    }
}

#[cfg(test)]
mod tests {
    use crate::design::{Design, Pattern};
    use std::f64::consts::{PI, TAU};

    /// A pattern and what its file says.
    struct Case {
        name: &'static str,
        design: Design,
        typed: Typed,
    }

    #[derive(Clone, Copy)]
    enum Typed {
        /// Degrees across and down.
        Grid([f64; 2]),
        /// Two blocks of 32 lasers fire in turn, or all together.
        Head { in_turn: bool },
    }

    fn cases() -> [Case; 4] {
        let together = [("scan.spinning.firing".to_owned(), "together".to_owned())];
        [
            ("kim-park-2016", &[][..], Typed::Grid([43.2, 24.3])),
            ("hdl-64e", &[], Typed::Head { in_turn: true }),
            ("hdl-64e", &together, Typed::Head { in_turn: false }),
            ("peregrine", &[], Typed::Grid([30.0, 7.5])),
        ]
        .map(|(name, set, typed)| Case {
            name,
            design: Design::open(name, set).unwrap(),
            typed,
        })
    }

    /// The formula, one pixel at a time.
    fn formula(design: &Design, typed: Typed, [row, column]: [u16; 2]) -> [f64; 3] {
        let (rows, columns) = (f64::from(design.scan.rows), f64::from(design.scan.columns));
        let (azimuth, elevation) = match (typed, &design.scan.pattern) {
            (Typed::Head { in_turn }, Pattern::Spinning(head)) => {
                let turn = if in_turn { 2 * (row % 32) + row / 32 } else { 0 };
                let turned = (f64::from(column) + f64::from(turn) / 64.0) / columns;
                (PI - TAU * turned, head.elevations[usize::from(row)])
            }
            (Typed::Grid(degrees), _) => {
                let [horizontal, vertical] = degrees.map(f64::to_radians);
                let across = (f64::from(column) + 0.5) / columns;
                let down = (f64::from(row) + 0.5) / rows;
                (horizontal * (0.5 - across), vertical * (0.5 - down))
            }
            _ => panic!("no head"),
        };
        let (sin_a, cos_a) = (libm::sin(azimuth), libm::cos(azimuth));
        let (sin_e, cos_e) = (libm::sin(elevation), libm::cos(elevation));
        [cos_e * cos_a, cos_e * sin_a, sin_e]
    }

    #[test]
    fn every_pixel_has_the_direction_of_the_formula_to_the_last_bit() {
        for Case { name, design, typed } in cases() {
            for row in 0..design.scan.rows as u16 {
                // Every column of a large image would take long.
                for column in (0..design.scan.columns as u16).step_by(7) {
                    let table = design.directions().of(row, column);
                    let expected = formula(&design, typed, [row, column]);
                    assert_eq!(table, expected, "{name}: {row}, {column}");
                }
            }
        }
    }

    #[test]
    fn every_pixel_is_found_where_it_lies() {
        for Case { name, design, .. } in cases() {
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
