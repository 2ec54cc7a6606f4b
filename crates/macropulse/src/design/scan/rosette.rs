//! One beam through two thin prisms that turn, as in the lidars with which rosettes came into use:
//! a pattern that hardly repeats.

use schemars::JsonSchema;
use serde::Deserialize;

use super::directions::{Directions, Path, Prism, Way};
use super::model::{Extent, Model, Moment};
use super::table::cell;
use super::{Pattern, Typed};
use crate::design::Error;
use crate::design::limits::Check;
use crate::design::safety::Beams;

/// One beam through two prisms that turn.
#[derive(Debug, Clone, PartialEq)]
pub struct Rosette {
    /// The prisms.
    pub prisms: [Prism; 2],
    /// Shots of a scan.
    pub shots: u32,
    /// Time between shots, s.
    step: f64,
}

/// `[scan.rosette]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Shots per second: 65535 in a scan at most.
    #[schemars(range(min = 1, max = 1e9))]
    shots_per_s: f64,
    /// The two prisms.
    #[schemars(length(equal = 2))]
    prisms: Vec<PrismFile>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PrismFile {
    /// Angle by which it bends the beam, degrees.
    #[schemars(range(min = 0, max = 45))]
    deflection_deg: f64,
    /// Turns per second, positive from the left to the top.
    #[schemars(range(min = -1e5, max = 1e5))]
    turns_per_s: f64,
    /// Direction of its deflection when the first scan begins, degrees from the left.
    #[serde(default)]
    #[schemars(range(min = -360, max = 360))]
    phase_deg: f64,
}

impl Typed for File {
    fn check(&self, check: &Check, period: f64) -> Result<Pattern, Error> {
        let rate = check.within("scan.rosette.shots_per_s", self.shots_per_s, 1.0, 1e9)?;
        let shots = (rate * period).round();
        if !(1.0..=65_535.0).contains(&shots) {
            let message = format!(
                "is {rate}, which are {shots} shots in a scan, but 1 to 65535 are possible: change \
                 scan.scans_per_s"
            );
            return check.refuse("scan.rosette.shots_per_s", message);
        }
        let path = "scan.rosette.prisms";
        let [one, two] = self.prisms.as_slice() else {
            return check.refuse(path, "must be two, as { deflection_deg, turns_per_s }");
        };
        let prism = |typed: &PrismFile| {
            Ok(Prism {
                deflection: check.within(path, typed.deflection_deg, 0.0, 45.0)?.to_radians(),
                turns_per_s: check.within(path, typed.turns_per_s, -1e5, 1e5)?,
                phase: check.within(path, typed.phase_deg, -360.0, 360.0)?.to_radians(),
            })
        };
        let prisms = [prism(one)?, prism(two)?];
        Ok(Pattern::Rosette(Rosette { prisms, shots: shots as u32, step: period / shots }))
    }
}

impl Rosette {
    fn path(&self) -> Path {
        let way = Way::Prisms(self.prisms, self.step);
        Path { per_scan: self.shots.into(), rows: 1, way }
    }

    /// The directions of the first scan, in their order.
    fn first_scan(&self) -> Vec<[f64; 3]> {
        let directions = self.directions();
        (0..self.shots).map(|shot| directions.of(0, shot as u16)).collect()
    }
}

impl Model for Rosette {
    fn summary(&self) -> String {
        "one beam, two prisms that turn".to_owned()
    }

    fn size(&self) -> [u32; 2] {
        [1, self.shots]
    }

    fn channels(&self) -> u32 {
        1
    }

    fn channel_of(&self, _order: u64, _row: u16) -> u16 {
        0
    }

    fn pixel(&self, order: u64) -> (u16, u16) {
        (0, order as u16)
    }

    fn order_of(&self, _row: u16, column: u16) -> u64 {
        column.into()
    }

    fn moment(&self, order: u64, _period: f64) -> Moment {
        Moment { shots: order, then: 0.0 }
    }

    fn equal_steps(&self) -> bool {
        true
    }

    fn line(&self) -> u64 {
        1
    }

    fn draws_from_the_left(&self) -> bool {
        false
    }

    fn shortest_dwell(&self, pixel_period: f64) -> f64 {
        pixel_period
    }

    fn moves_by(&self) -> Option<f64> {
        None
    }

    fn directions(&self) -> Directions {
        Directions::along(self.path())
    }

    fn pixel_at(&self, _azimuth: f64, _elevation: f64) -> Option<(u16, u16)> {
        None
    }

    fn cell(&self) -> [f64; 2] {
        cell(&self.first_scan(), 1)
    }

    /// The square about the disc.
    fn extent(&self) -> Extent {
        let [one, two] = self.prisms.map(|prism| prism.deflection);
        Extent::centred([2.0 * (one + two); 2])
    }

    fn shared_field(&self) -> Option<[f64; 2]> {
        None
    }

    fn follows(&self) -> bool {
        true
    }

    fn beams(&self) -> Beams {
        Beams::Scattered(self.first_scan())
    }

    fn is_lattice(&self) -> bool {
        false
    }
}
