//! One beam that is steered along a path, scan after scan: by prisms that turn, or by a mirror that swings.

use super::directions::{Directions, Path, Way};
use super::model::{Extent, Model, Moment};
use super::table::cell;
use crate::design::Error;
use crate::design::limits::Check;
use crate::design::safety::Beams;

/// One beam that is steered along a path.
#[derive(Debug, Clone, PartialEq)]
pub struct Steered {
    pub(super) way: Way,
    /// Shots of a scan.
    pub(super) shots: u32,
    /// Width and height of the field, rad.
    pub(super) sides: [f64; 2],
}

/// Shots of a scan of `period` seconds at `rate` shots a second, the value of `key`.
///
/// # Errors
/// If a scan has no shot, or too many to number.
pub(super) fn shots_of(check: &Check, key: &str, rate: f64, period: f64) -> Result<u32, Error> {
    let rate = check.within(key, rate, 1.0, 1e9)?;
    let shots = (rate * period).round();
    match (1.0..=65_535.0).contains(&shots) {
        true => Ok(shots as u32),
        false => check.refuse(
            key,
            format!(
                "is {rate}, which are {shots} shots in a scan, but 1 to 65535 are possible: change \
                 scan.scans_per_s"
            ),
        ),
    }
}

impl Steered {
    /// The directions of the first scan, in their order.
    fn first_scan(&self) -> Vec<[f64; 3]> {
        let directions = self.directions();
        (0..self.shots).map(|shot| directions.of(0, shot as u16)).collect()
    }
}

impl Model for Steered {
    fn summary(&self) -> String {
        match self.way {
            Way::Mirror(..) => "one beam, a mirror that swings about two axes",
            _ => "one beam, two prisms that turn",
        }
        .to_owned()
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
        Directions::along(Path { per_scan: self.shots.into(), rows: 1, way: self.way.clone() })
    }

    fn pixel_at(&self, _azimuth: f64, _elevation: f64) -> Option<(u16, u16)> {
        None
    }

    fn cell(&self) -> [f64; 2] {
        cell(&self.first_scan(), 1)
    }

    fn extent(&self) -> Extent {
        Extent::centred(self.sides)
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
