//! The direction of each shot, looked up instead of computed for every one.

use std::f64::consts::TAU;
use std::sync::Arc;

use macropulse_codec::ShotLog;

/// Directions of the shots of a scan, as unit vectors in the sensor frame (x forward, y left, z up), and the
/// places in it at which the beams begin.
///
/// Column 0 of a lattice is at the left, row 0 at the top. A spinning sensor begins to the rear, turns
/// clockwise seen from above, and goes on turning while its lasers fire one after another. If a pattern is no
/// lattice, the row is a laser and the column counts its shots.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions {
    course: Course,
    /// The origin of the beam of each row, m, in a frame that has turned with its azimuth. Empty if all beams
    /// begin at the origin of the sensor.
    origins: Vec<[f64; 3]>,
}

/// How directions follow from pixels and scans.
#[derive(Debug, Clone, PartialEq)]
enum Course {
    /// Every scan as the one before.
    Lattice { elevations: Table, azimuths: Table },
    /// Each scan goes on where the one before it ended.
    Path(Path),
}

/// Directions one after the other, scan after scan.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Path {
    /// Shots of a scan.
    pub per_scan: u64,
    /// Rows, which take turns.
    pub rows: u64,
    pub way: Way,
}

/// A thin prism that turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prism {
    /// Angle by which it deflects, rad.
    pub deflection: f64,
    /// Turns per second, positive from the left to the top.
    pub turns_per_s: f64,
    /// Direction of the deflection at the beginning, rad from the left towards the top.
    pub phase: f64,
}

/// A swing of a mirror about one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Swing {
    /// Angle of the beam from the middle to either end, rad.
    pub half: f64,
    /// Swings per second, there and back.
    pub hz: f64,
    /// Phase of the sine at the beginning, rad.
    pub phase: f64,
}

impl Swing {
    /// The angle of the beam at time `t`, s: half·sin(2π·f·t + φ).
    fn at(&self, t: f64) -> f64 {
        let swings = self.hz * t;
        self.half * libm::sin(TAU * (swings - swings.floor()) + self.phase)
    }
}

/// The source of the directions of a path.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Way {
    /// A list that begins anew at its end.
    List(Arc<[[f64; 3]]>),
    /// Prisms that turn, and the time between shots, s.
    Prisms([Prism; 2], f64),
    /// Azimuth and elevation of a mirror that swings, and the time between shots, s.
    Mirror([Swing; 2], f64),
}

impl Path {
    /// The direction of shot `number`, counted from the first one of the first scan; before it numbers are
    /// negative.
    #[inline]
    fn at(&self, number: i64) -> [f64; 3] {
        match &self.way {
            Way::List(list) => list[number.rem_euclid(list.len().max(1) as i64) as usize],
            Way::Prisms(prisms, step) => deflected(prisms, number as f64 * step),
            Way::Mirror(swings, step) => {
                let [azimuth, elevation] = swings.map(|swing| swing.at(number as f64 * step));
                let across = libm::cos(elevation);
                [across * libm::cos(azimuth), across * libm::sin(azimuth), libm::sin(elevation)]
            }
        }
    }
}

/// The direction of a beam along x that thin prisms have deflected at time `t`, s: what each of them
/// adds across the beam adds up,
///
/// θ_y + i·θ_z = Σ δ·exp(i·(2π·f·t + φ))
///
/// and θ is the angle from x, in this direction across it \[Mar99\].
fn deflected(prisms: &[Prism; 2], t: f64) -> [f64; 3] {
    let (mut across, mut up) = (0.0, 0.0);
    for Prism { deflection, turns_per_s, phase } in prisms {
        let turns = turns_per_s * t;
        let angle = TAU * (turns - turns.floor()) + phase;
        across += deflection * libm::cos(angle);
        up += deflection * libm::sin(angle);
    }
    let angle = libm::hypot(across, up);
    let share = if angle > 0.0 { libm::sin(angle) / angle } else { 1.0 };
    [libm::cos(angle), share * across, share * up]
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
    /// The directions at these elevations and azimuths, the beam of each row beginning at one of
    /// `origins`, or at the origin where there are none.
    pub(super) fn new(elevations: &Angles, azimuths: &Angles, origins: Vec<[f64; 3]>) -> Self {
        let (elevations, azimuths) = (Table::of(elevations), Table::of(azimuths));
        Self { course: Course::Lattice { elevations, azimuths }, origins }
    }

    /// The directions along a path.
    pub(super) fn along(path: Path) -> Self {
        Self { course: Course::Path(path), origins: Vec::new() }
    }

    /// The unit vector at which the middle of a pixel lies; where each scan goes on where the one
    /// before it ended, that of the first scan.
    #[inline(always)]
    pub fn of(&self, row: u16, column: u16) -> [f64; 3] {
        let (row, column) = (usize::from(row), usize::from(column));
        match &self.course {
            Course::Lattice { elevations, azimuths } => {
                let [sin_e, cos_e] = elevations.at(row, column);
                let [sin_a, cos_a] = azimuths.at(row, column);
                [cos_e * cos_a, cos_e * sin_a, sin_e]
            }
            Course::Path(path) => path.at(column as i64 * path.rows as i64 + row as i64),
        }
    }

    /// The unit vector along which a shot of `log` is sent. Shots before the first scan have numbers that
    /// wrap.
    #[inline(always)]
    pub fn of_shot(&self, log: &ShotLog, shot: usize) -> [f64; 3] {
        let (row, column) = (log.row[shot], log.column[shot]);
        let Course::Path(path) = &self.course else { return self.of(row, column) };
        let (per_scan, rows) = (path.per_scan as i64, path.rows as i64);
        let scan = log.first.wrapping_add(shot as u64).cast_signed().div_euclid(per_scan);
        path.at(scan * per_scan + i64::from(column) * rows + i64::from(row))
    }

    /// Returns true if beams begin elsewhere than at the origin of the sensor.
    pub fn have_origins(&self) -> bool {
        !self.origins.is_empty()
    }

    /// Returns the origin of the beam to a pixel in the sensor frame, m.
    #[inline]
    pub fn origin(&self, row: u16, column: u16) -> [f64; 3] {
        let (row, column) = (usize::from(row), usize::from(column));
        match (&self.course, self.origins.get(row)) {
            (Course::Lattice { azimuths, .. }, Some([x, y, z])) => {
                let [sin_a, cos_a] = azimuths.at(row, column);
                [x * cos_a - y * sin_a, x * sin_a + y * cos_a, *z]
            }
            _ => [0.0; 3],
        }
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
