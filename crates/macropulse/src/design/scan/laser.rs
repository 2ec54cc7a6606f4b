//! A laser of a turning head: where it points, where its beam begins, and how late its clock starts.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::design::Error;
use crate::design::limits::Check;

/// A laser of a turning head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Laser {
    /// Elevation, rad.
    pub elevation: f64,
    /// Azimuth from that of the head, rad, to the left.
    pub azimuth: f64,
    /// Added to what it measures, m.
    pub range_offset: f64,
    /// Origin of its beam, m: forward along its azimuth, left, up.
    pub origin: [f64; 3],
}

/// A laser as typed: an entry of `scan.spinning.lasers`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Elevation of the beam, degrees.
    #[schemars(range(min = -90, max = 90))]
    elevation_deg: f64,
    /// Azimuth of the beam from that of the head, degrees, positive to the left.
    #[serde(default)]
    #[schemars(range(min = -180, max = 180))]
    azimuth_deg: f64,
    /// Offset added to the range that it measures, mm, because its clock starts too late by it.
    #[serde(default)]
    #[schemars(range(min = -10000, max = 10000))]
    range_offset_mm: f64,
    /// Origin of the beam, mm: forward along its azimuth, left, up.
    #[serde(default)]
    #[schemars(inner(range(min = -1000, max = 1000)))]
    origin_mm: [f64; 3],
}

/// A limit of a laser, in SI units.
pub(super) struct Limit {
    /// Name of the number.
    pub what: &'static str,
    /// Its largest absolute value.
    pub most: f64,
}

/// The limits of what a laser is, the same for a sensor file and for a calibration.
pub(super) const ELEVATION: Limit = Limit { what: "elevation", most: 90.0 };
/// The limit of the azimuth, degrees.
pub(super) const AZIMUTH: Limit = Limit { what: "azimuth", most: 180.0 };
/// The limit of the range offset, m.
pub(super) const RANGE_OFFSET: Limit = Limit { what: "range offset", most: 10.0 };
/// The limit of each coordinate of the origin, m.
pub(super) const ORIGIN: Limit = Limit { what: "origin", most: 1.0 };

/// Lasers of the largest head.
pub(super) const MOST_LASERS: usize = 1024;

impl File {
    /// The laser in SI units; it is number `number` of the list, from 1.
    pub fn check(&self, check: &Check, number: usize) -> Result<Laser, Error> {
        let within = |value: f64, limit: &Limit, unit: (f64, &str)| {
            let (per_unit, unit) = unit;
            let most = limit.most / per_unit;
            if value.abs() <= most {
                return Ok(value * per_unit);
            }
            let message = format!(
                "laser {number}: its {} is {value} {unit}, but must lie between -{most} and {most}",
                limit.what
            );
            check.refuse("scan.spinning.lasers", message)
        };
        let [x, y, z] = self.origin_mm;
        let origin = |value| within(value, &ORIGIN, (1e-3, "mm"));
        Ok(Laser {
            elevation: within(self.elevation_deg, &ELEVATION, (1.0, "degrees"))?.to_radians(),
            azimuth: within(self.azimuth_deg, &AZIMUTH, (1.0, "degrees"))?.to_radians(),
            range_offset: within(self.range_offset_mm, &RANGE_OFFSET, (1e-3, "mm"))?,
            origin: [origin(x)?, origin(y)?, origin(z)?],
        })
    }
}
