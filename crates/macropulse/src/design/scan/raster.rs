//! Beams that a mirror leads over the field, line by line: one, or several side by side, each with a band of
//! rows and a detector of its own.

use std::f64::consts::{FRAC_PI_2, PI};

use schemars::JsonSchema;
use serde::Deserialize;

use super::grid::{self, Grid};
use super::model::{Extent, Model, Moment};
use super::polygon::Polygon;
use super::{Directions, Pattern, Typed};
use crate::design::Error;
use crate::design::limits::{Check, Idle};
use crate::design::safety::{Beams, Line, Lines};

/// Line by line.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Its pixels: a line of a beam is a row.
    pub grid: Grid,
    /// Beams that fire at the same moments, with the same number of rows each. The first draws the uppermost
    /// rows, from the top down.
    pub beams: u32,
    /// Motion of the fast axis.
    pub mirror: Mirror,
    /// Fraction of the line time in which shots are fired.
    pub duty: f64,
}

/// How the fast axis of a raster moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mirror {
    /// Constant angular speed, every line in the same direction.
    Uniform,
    /// Resonant: sinusoidal, lines to and fro.
    Sinusoidal,
    /// Facet by facet at constant speed, every line in the same direction.
    Polygon(Polygon),
}

impl Mirror {
    /// When, as a fraction of the line time, the mirror has crossed the fraction `across` of the
    /// line, shots being fired in the fraction `duty` of that time.
    ///
    /// A resonant mirror stands at sin(π·s), s = −½…½ over the line time; only |s| ≤ duty/2 is used.
    pub fn moment(self, duty: f64, across: f64) -> f64 {
        match self {
            Self::Uniform | Self::Polygon(_) => (1.0 - duty) / 2.0 + duty * across,
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
    /// Rows of pixels, which are lines of a beam.
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
    /// Beams side by side, which fire at the same moments. Each draws the same number of rows, one below the
    /// other, and has a detector and converters of its own.
    #[schemars(range(min = 1, max = 1024))]
    beams: u32,
    /// Motion of the fast axis.
    mirror: MirrorFile,
    /// Share of the time of a line in which shots are fired; of a polygon it follows from its facets.
    #[schemars(range(min = 0.01, max = 1))]
    duty: f64,
}

/// `scan.raster.mirror` as typed.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
enum MirrorFile {
    /// Constant angular speed, every line in the same direction.
    Uniform,
    /// Resonant: sinusoidal, lines to and fro.
    Sinusoidal,
    /// Mirrors around an axle that turns at constant speed: a facet draws a line.
    Polygon {
        /// Mirrors around the axle.
        #[schemars(range(min = 2, max = 360))]
        facets: u32,
        /// From corner to corner, mm.
        #[schemars(range(min = 0.01, max = 1e4))]
        diameter_mm: f64,
    },
}

impl File {
    /// The mirror, and the share of the time of a line in which shots are fired, of a field of `horizontal`
    /// radians.
    fn mirror(&self, check: &Check, horizontal: f64) -> Result<(Mirror, f64), Error> {
        let duty = || check.within("scan.raster.duty", self.duty, LEAST_DUTY, 1.0);
        let (facets, diameter_mm) = match self.mirror {
            MirrorFile::Uniform => return Ok((Mirror::Uniform, duty()?)),
            MirrorFile::Sinusoidal => return Ok((Mirror::Sinusoidal, duty()?)),
            MirrorFile::Polygon { facets, diameter_mm } => (facets, diameter_mm),
        };
        let key = |key| format!("scan.raster.mirror.polygon.{key}");
        let facets = check.count(&key("facets"), facets, 2, 360)?;
        let sweep = Polygon::sweep(facets);
        let duty = horizontal / sweep;
        if !(LEAST_DUTY..1.0).contains(&duty) {
            let message = format!(
                "each of {facets} facets sweeps {:.3} degrees, of which the field of {:.3} must be 1 % at \
                 least, and less than all",
                sweep.to_degrees(),
                horizontal.to_degrees()
            );
            return check.refuse(&key("facets"), message);
        }
        let diameter = check.within(&key("diameter_mm"), diameter_mm, 0.01, 1e4)? * 1e-3;
        Ok((Mirror::Polygon(Polygon { facets, diameter }), duty))
    }
}

/// Least share of the time of a line in which shots are fired.
const LEAST_DUTY: f64 = 0.01;

impl Typed for File {
    fn check(&self, check: &Check, _period: f64) -> Result<Pattern, Error> {
        let &Self { rows, columns, horizontal_deg, vertical_deg, .. } = self;
        let grid = grid::Typed { rows, columns, horizontal_deg, vertical_deg };
        let grid = grid.check(check, "raster")?;
        let (mirror, duty) = self.mirror(check, grid.horizontal)?;
        let beams = check.count("scan.raster.beams", self.beams, 1, MOST_BEAMS)?;
        if rows % beams != 0 {
            return check.refuse(
                "scan.raster.beams",
                format!("{beams} beams do not share {rows} rows evenly: use a divisor of the rows"),
            );
        }
        Ok(Pattern::Raster(Raster { grid, beams, mirror, duty }))
    }

    fn idle(&self) -> Option<Idle> {
        matches!(self.mirror, MirrorFile::Polygon { .. }).then_some(Idle {
            key: "scan.raster.duty".to_owned(),
            by: "scan.raster.mirror",
            why: "the facets of a polygon and the field give it",
        })
    }
}

/// Beams at most: more detectors than any receiver has one by one.
const MOST_BEAMS: u32 = 1024;

impl Raster {
    /// Lines that each beam draws in a scan.
    pub fn lines(&self) -> u32 {
        self.grid.rows / self.beams
    }

    /// Line, place along the line, and beam of the shot `order` of a scan: the beams in turn, from the top
    /// down, though they fire at the same moment.
    fn place(&self, order: u64) -> [u64; 3] {
        let (beams, columns) = (u64::from(self.beams), u64::from(self.grid.columns));
        [order / (columns * beams), order / beams % columns, order % beams]
    }

    /// Returns true if the line of this number is drawn from the right to the left.
    fn comes_back(&self, line: u64) -> bool {
        self.is_resonant() && line % 2 == 1
    }

    fn is_resonant(&self) -> bool {
        self.mirror == Mirror::Sinusoidal
    }

    /// Returns true if shots follow each other at equal times, from line to line too.
    fn never_pauses(&self) -> bool {
        !self.is_resonant() && self.duty == 1.0
    }
}

impl Model for Raster {
    fn summary(&self) -> String {
        let beams = match self.beams {
            1 => "one beam".to_owned(),
            beams => format!("{beams} beams"),
        };
        match self.mirror {
            Mirror::Polygon(polygon) => format!("{beams}, polygon of {} facets", polygon.facets),
            Mirror::Uniform | Mirror::Sinusoidal => format!("{beams}, mirror raster"),
        }
    }

    fn size(&self) -> [u32; 2] {
        [self.grid.rows, self.grid.columns]
    }

    fn channels(&self) -> u32 {
        self.beams
    }

    fn channel_of(&self, _order: u64, row: u16) -> u16 {
        row / self.lines() as u16
    }

    fn pixel(&self, order: u64) -> (u16, u16) {
        let columns = u64::from(self.grid.columns);
        let [line, across, beam] = self.place(order);
        let column = if self.comes_back(line) { columns - 1 - across } else { across };
        ((beam * u64::from(self.lines()) + line) as u16, column as u16)
    }

    fn order_of(&self, row: u16, column: u16) -> u64 {
        let (row, column) = (u64::from(row), u64::from(column));
        let columns = u64::from(self.grid.columns);
        let (beam, line) = (row / u64::from(self.lines()), row % u64::from(self.lines()));
        let across = if self.comes_back(line) { columns - 1 - column } else { column };
        (line * columns + across) * u64::from(self.beams) + beam
    }

    fn moment(&self, order: u64, period: f64) -> Moment {
        let beams = u64::from(self.beams);
        if self.never_pauses() {
            return Moment { shots: order / beams * beams, then: 0.0 };
        }
        let [line, across, _] = self.place(order);
        let across = across as f64 / f64::from(self.grid.columns);
        let then = period / f64::from(self.lines()) * self.mirror.moment(self.duty, across);
        Moment { shots: line * self.line(), then }
    }

    fn equal_steps(&self) -> bool {
        self.beams == 1 && self.never_pauses()
    }

    fn line(&self) -> u64 {
        u64::from(self.grid.columns) * u64::from(self.beams)
    }

    fn draws_from_the_left(&self) -> bool {
        self.beams == 1 && !self.is_resonant()
    }

    fn shortest_dwell(&self, pixel_period: f64) -> f64 {
        let pixel_period = pixel_period * f64::from(self.beams);
        match self.mirror {
            Mirror::Uniform | Mirror::Polygon(_) => pixel_period * self.duty,
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
        let [horizontal, vertical] = self.grid.sides();
        Some([horizontal, vertical / f64::from(self.beams)])
    }

    fn follows(&self) -> bool {
        true
    }

    fn beams(&self) -> Beams {
        let step = self.grid.cell()[0];
        let first = (self.grid.horizontal - step) / 2.0;
        let rows = self.grid.elevations().map(|elevation| Line { elevation, first }).collect();
        let comes_back = self.is_resonant();
        Beams::Lines(Lines { rows, step, first, in_turn: self.lines(), comes_back })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Design;

    fn sensor(set: &[(&str, &str)]) -> Result<Design, String> {
        let set: Vec<_> = set.iter().map(|(key, value)| ((*key).into(), (*value).into())).collect();
        Design::open("coded-practical", &set).map_err(|error| error.to_string())
    }

    /// Two lines of two beams with three columns, written out by hand.
    #[test]
    fn beams_side_by_side_draw_their_own_rows() {
        let small = [
            ("scan.raster.rows", "4"),
            ("scan.raster.columns", "3"),
            ("scan.raster.beams", "2"),
            ("scan.raster.mirror", "sinusoidal"),
            ("scan.raster.duty", "0.5"),
        ];
        let design = sensor(&small).unwrap();
        let model = design.scan.model();
        let pixels: Vec<(u16, u16)> = (0..12).map(|order| model.pixel(order)).collect();
        let there = [(0, 0), (2, 0), (0, 1), (2, 1), (0, 2), (2, 2)];
        let back = [(1, 2), (3, 2), (1, 1), (3, 1), (1, 0), (3, 0)];
        assert_eq!(pixels, [there, back].concat());
        for (order, &(row, column)) in pixels.iter().enumerate() {
            assert_eq!(model.order_of(row, column), order as u64);
            assert_eq!(u32::from(model.channel_of(order as u64, row)), u32::from(row) / 2);
        }
        let moment = |order| design.scan.moment(order) * 60.0;
        assert_eq!(moment(0), moment(1));
        // A resonant mirror in half of the time of its line: from a quarter of it on.
        approx::assert_relative_eq!(moment(0), 0.125, max_relative = 1e-9);
        approx::assert_relative_eq!(moment(7), 0.625, max_relative = 1e-9);
    }

    #[test]
    fn shots_of_a_beam_are_as_far_apart_as_its_duty_lets_them() {
        let beams =
            [("scan.raster.beams", "32"), ("scan.raster.duty", "0.36"), ("tdc.converters", "32")];
        let design = sensor(&beams).unwrap();
        // 15 lines of 848 columns, sixty times a second.
        let apart = 0.36 / (60.0 * 15.0 * 848.0);
        approx::assert_relative_eq!(design.scan.shortest_period(), apart, max_relative = 1e-12);
        approx::assert_relative_eq!(
            design.scan.moment(32) - design.scan.moment(0),
            apart,
            max_relative = 1e-9
        );
        let mean = design.scan.channel_period();
        approx::assert_relative_eq!(mean, apart / 0.36, max_relative = 1e-12);
    }

    /// Figures of two polygons from an independent study: 9000 rpm, corners at 61 m/s, 32 beams; 18 000 rpm,
    /// 110 m/s, 16 beams; both use 0.36 of a facet.
    #[test]
    fn a_polygon_turns_as_fast_as_its_lines_need() {
        for (name, turns, tip) in [("coded-32", 150.0, 61.3), ("coded-16", 300.0, 110.3)] {
            let design = Design::open(name, &[]).unwrap();
            let Pattern::Raster(raster) = &design.scan.pattern else { panic!("no raster") };
            let Mirror::Polygon(polygon) = raster.mirror else { panic!("no polygon") };
            let lines = f64::from(raster.lines()) * 60.0;
            approx::assert_relative_eq!(raster.duty, 0.36, max_relative = 1e-12);
            approx::assert_relative_eq!(polygon.turns(lines), turns, max_relative = 1e-12);
            approx::assert_relative_eq!(polygon.tip_speed(lines), tip, max_relative = 1e-3);
        }
    }

    /// The widest light is found once more: rays side by side, reflected by facets that are turned, each from
    /// corner to corner, written out in coordinates.
    #[test]
    fn facets_hold_as_much_light_as_their_formula_says() {
        let is_held = |polygon: &Polygon, turned: f64, y: f64| {
            let (pitch, radius) = (2.0 * PI / f64::from(polygon.facets), polygon.diameter / 2.0);
            let corner = |side: f64| {
                let at = turned + side * pitch / 2.0;
                [radius * at.cos(), radius * at.sin()]
            };
            let ([_, low], [_, high]) = (corner(-1.0), corner(1.0));
            low <= y && y <= high
        };
        for (facets, diameter, field) in [(6, 0.13, 0.754), (4, 0.05, 1.2), (12, 0.2, 0.3)] {
            let polygon = Polygon { facets, diameter };
            let half = polygon.widest(field) / 2.0;
            let holds =
                |y: f64| [-field / 4.0, field / 4.0].iter().all(|&t| is_held(&polygon, t, y));
            assert!([-0.999, 0.999].iter().all(|share| holds(share * half)), "{polygon:?}");
            assert!(![-1.001, 1.001].iter().any(|share| holds(share * half)), "{polygon:?}");
            approx::assert_relative_eq!(
                polygon.least_diameter(field, 2.0 * half),
                diameter,
                max_relative = 1e-12
            );
        }
    }

    #[test]
    fn a_polygon_that_cannot_do_is_refused() {
        let polygon = |facets: u32, diameter_mm: f64| {
            let typed =
                format!("{{ polygon = {{ facets = {facets}, diameter_mm = {diameter_mm} }} }}");
            let set = [("scan.raster.mirror".to_owned(), typed)];
            Design::open("coded-32", &set).map_err(|error| error.to_string())
        };
        // 40 mm / sin(30° − 10.8°) = 121.6 mm.
        assert!(polygon(6, 121.7).is_ok());
        let error = polygon(6, 121.6).unwrap_err();
        assert!(error.contains("the aperture has 40.0: 121.7 or more"), "{error}");
        let error = polygon(17, 900.0).unwrap_err();
        assert!(error.contains("each of 17 facets sweeps 42.353 degrees"), "{error}");
        let error = polygon(1, 130.0).unwrap_err();
        assert!(error.contains("scan.raster.mirror.polygon.facets"), "{error}");
        let set = [("scan.raster.duty".to_owned(), "0.5".to_owned())];
        let error = Design::open("coded-32", &set).unwrap_err().to_string();
        assert!(error.contains("the facets of a polygon and the field give it"), "{error}");
    }

    #[test]
    fn rows_that_beams_cannot_share_are_refused() {
        let error = sensor(&[("scan.raster.beams", "7")]).unwrap_err();
        assert!(error.contains("7 beams do not share 480 rows evenly"), "{error}");
    }
}
