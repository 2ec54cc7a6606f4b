//! The polygon of a candidate: as large as its aperture needs, and as fast as its beams let it turn.

use macropulse::design::Polygon;

use super::candidate::{Candidate, number};
use super::requirements::Requirements;

/// Where a sensor says what polygon leads its beams, if it has one.
pub(super) const POLYGON: &str = "scan.raster.mirror.polygon";

/// Polygons are made in whole steps of this diameter, m.
const STEP: f64 = 1e-3;

impl Requirements {
    /// Whether candidates have a polygon: whether the sensor has one of which all is taken that is not
    /// searched.
    pub(super) fn has_polygon(&self) -> bool {
        self.facets().is_some()
    }

    /// Facets: as many as draw in no larger share of their time than those of the sensor do.
    fn facets(&self) -> Option<u32> {
        let of_sensor = |key: &str| number(&self.template, key);
        let (facets, field) =
            (of_sensor(&format!("{POLYGON}.facets"))?, of_sensor("scan.raster.horizontal_deg")?);
        Some((facets * field / self.wanted.horizontal_deg + 1e-9).floor().clamp(2.0, 360.0) as u32)
    }

    /// The smallest polygon with facets for such an `aperture`, m, and for the beam beside it.
    pub(super) fn polygon(&self, aperture: f64) -> Option<Polygon> {
        let beam = number(&self.template, "light.beam_diameter_mm").unwrap_or(0.0) * 1e-3;
        let of = |diameter| self.facets().map(|facets| Polygon { facets, diameter });
        let least = of(1.0)?.least_diameter(self.horizontal(), aperture.max(beam));
        of((least / STEP).ceil() * STEP)
    }

    fn horizontal(&self) -> f64 {
        self.wanted.horizontal_deg.to_radians()
    }

    /// Lines that each of so many beams draws in a second.
    fn lines(&self, beams: u32) -> f64 {
        f64::from(self.wanted.rows) / f64::from(beams) * self.wanted.scans_per_s
    }

    /// Speed of the corners of its polygon, m/s.
    pub(super) fn tip_speed(&self, candidate: &Candidate) -> Option<f64> {
        let lines = self.lines(candidate.beams);
        self.polygon(candidate.aperture).map(|polygon| polygon.tip_speed(lines))
    }

    /// By what factor the corners of its polygon are too fast; `None` if they are not.
    pub(super) fn too_fast(&self, candidate: &Candidate) -> Option<f64> {
        let most = self.parts.tip_m_per_s?;
        self.tip_speed(candidate).map(|speed| speed / most).filter(|factor| *factor > 1.0)
    }

    /// The largest aperture, m, that is allowed and that a polygon holds whose corners are not too fast, with
    /// so many beams.
    pub(super) fn most_aperture(&self, beams: u32) -> f64 {
        let most = self.parts.aperture_mm[1] * 1e-3;
        let (Some(tip), Some(facets)) = (self.parts.tip_m_per_s, self.facets()) else {
            return most;
        };
        let of = |diameter| Polygon { facets, diameter };
        let largest = tip / of(1.0).tip_speed(self.lines(beams));
        let widest = of((largest / STEP).floor() * STEP).widest(self.horizontal());
        // A little less, so that no rounding asks for the next larger polygon.
        most.min(widest * (1.0 - 1e-9))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn required(parts: &str) -> Result<Requirements, String> {
        let text = format!(
            "version = 1\nname = \"mine\"\n[wanted]\nrows = 480\ncolumns = 848\n\
             horizontal_deg = 43.2\nvertical_deg = 24.3\nscans_per_s = 60.0\nrange_m = 150.0\n\
             clutter_m = 300.0\nreflectance = 0.1\n[parts]\n{parts}"
        );
        Requirements::from_toml(&text, "mine.toml", Path::new(""))
            .map_err(|error| error.to_string())
    }

    /// 40 mm of aperture take 122 mm; 16 beams draw 1800 lines, 300 turns: π·0.122·300 = 115 m/s.
    #[test]
    fn corners_are_as_fast_as_beams_and_aperture_make_them() {
        let required = required("tip_m_per_s = 110.0").unwrap();
        let polygon = required.polygon(0.04).unwrap();
        approx::assert_relative_eq!(polygon.diameter, 0.122, max_relative = 1e-9);
        approx::assert_relative_eq!(
            polygon.tip_speed(required.lines(16)),
            114.98,
            max_relative = 1e-4
        );
        // 110 m/s let 116 mm turn so fast, and they hold 116·sin 19.2° = 38.15 mm.
        let most = required.most_aperture(16);
        approx::assert_relative_eq!(most, 0.03815, max_relative = 1e-3);
        assert_eq!(required.polygon(most).map(|polygon| polygon.diameter), Some(0.116));
        // Half as many lines, and the file's own limit holds.
        assert_eq!(required.most_aperture(32), 0.05);
        // Of a quarter of the field as large a share of the time with four times as many facets.
        let mut narrow = required;
        narrow.wanted.horizontal_deg = 10.8;
        assert_eq!(narrow.polygon(0.04).map(|polygon| polygon.facets), Some(24));
    }

    #[test]
    fn no_speed_is_asked_of_what_has_no_polygon() {
        let error = required("tip_m_per_s = 110.0\nsensor = \"coded-practical\"").unwrap_err();
        assert!(error.contains("parts.sensor"), "{error}");
        let error = required("tip_m_per_s = 0.0").unwrap_err();
        assert!(error.contains("parts.tip_m_per_s"), "{error}");
    }
}
