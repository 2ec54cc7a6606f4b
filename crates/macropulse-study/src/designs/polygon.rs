//! The polygon of a candidate: its facets, as large as its aperture needs, as fast as its beams ask for.

use macropulse::design::Polygon;

use super::keys::number;
use super::requirements::Requirements;

/// Key of the polygon that leads the beams of a sensor, if it has one.
pub(super) const POLYGON: &str = "scan.raster.mirror.polygon";

/// Polygons are made in whole steps of this diameter, m.
const STEP: f64 = 1e-3;

/// More facets than this are not tried.
const MOST_FACETS: u32 = 360;

impl Requirements {
    /// Tells if candidates have a polygon: if the sensor has one that the requirements name.
    pub(super) fn has_polygon(&self) -> bool {
        number(&self.template, &format!("{POLYGON}.facets")).is_some()
    }

    /// Facets of the sensor's polygon, for the field wanted: the number that draws in no larger share of the
    /// time.
    pub(super) fn usual_facets(&self) -> Option<u32> {
        let of_sensor = |key: &str| number(&self.template, key);
        let (facets, field) =
            (of_sensor(&format!("{POLYGON}.facets"))?, of_sensor("scan.raster.horizontal_deg")?);
        let scaled = (facets * field / self.wanted.horizontal_deg + 1e-9).floor();
        Some(scaled.clamp(2.0, f64::from(MOST_FACETS)) as u32)
    }

    /// Mirrors for this number of `beams`, the one with the most facets first: it leaves a channel the most
    /// time. Each holds the least aperture without being too large or too fast. One `None` if the sensor has
    /// no polygon; empty if every polygon is too large or too fast.
    pub(super) fn mirrors(&self, beams: u32) -> Vec<Option<u32>> {
        if !self.has_polygon() {
            return vec![None];
        }
        let least = self.parts.aperture_mm[0] * 1e-3;
        let holds = |facets: &u32| self.most_aperture(beams, Some(*facets)) >= least;
        self.facets().into_iter().rev().filter(holds).map(Some).collect()
    }

    /// Numbers of facets to try, ascending: those of the file, or all whose facets sweep more than the field.
    pub(super) fn facets(&self) -> Vec<u32> {
        let sweeps = |facets: &u32| Polygon::sweep(*facets) > self.horizontal();
        match self.parts.facets.is_empty() {
            true => (2..=MOST_FACETS).take_while(sweeps).collect(),
            false => self.parts.facets.clone(),
        }
    }

    /// Share of the time in which a polygon with `facets` facets draws.
    pub(super) fn duty(&self, facets: u32) -> f64 {
        self.horizontal() / Polygon::sweep(facets)
    }

    /// The smallest polygon with `facets` facets for this `aperture`, m, and for the beam beside it.
    pub(super) fn polygon(&self, aperture: f64, facets: u32) -> Polygon {
        let beam = number(&self.template, "light.beam_diameter_mm").unwrap_or(0.0) * 1e-3;
        let of = |diameter| Polygon { facets, diameter };
        let least = of(1.0).least_diameter(self.horizontal(), aperture.max(beam));
        of((least / STEP).ceil() * STEP)
    }

    pub(super) fn horizontal(&self) -> f64 {
        self.wanted.horizontal_deg.to_radians()
    }

    /// Lines that each of `beams` beams draws in a second.
    pub(super) fn lines(&self, beams: f64) -> f64 {
        f64::from(self.wanted.rows) / beams * self.wanted.scans_per_s
    }

    /// The largest aperture, m, that is allowed and that fits a polygon neither too fast nor too large, with
    /// this number of beams and facets.
    pub(super) fn most_aperture(&self, beams: u32, facets: Option<u32>) -> f64 {
        let most = self.parts.aperture_mm[1] * 1e-3;
        let Some(facets) = facets else { return most };
        let of = |diameter| Polygon { facets, diameter };
        let per_metre = of(1.0).tip_speed(self.lines(f64::from(beams)));
        let by_speed = self.parts.tip_m_per_s.map_or(f64::INFINITY, |tip| tip / per_metre);
        let largest = by_speed.min(self.parts.polygon_mm * 1e-3);
        let widest = of((largest / STEP + 1e-9).floor() * STEP).widest(self.horizontal());
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
        let polygon = required.polygon(0.04, 6);
        approx::assert_relative_eq!(polygon.diameter, 0.122, max_relative = 1e-9);
        approx::assert_relative_eq!(
            polygon.tip_speed(required.lines(16.0)),
            114.98,
            max_relative = 1e-4
        );
        // 110 m/s let 116 mm turn so fast, and they hold 116·sin 19.2° = 38.15 mm.
        let most = required.most_aperture(16, Some(6));
        approx::assert_relative_eq!(most, 0.03815, max_relative = 1e-3);
        assert_eq!(required.polygon(most, 6).diameter, 0.116);
        // With half the lines, the file's own limit holds.
        assert_eq!(required.most_aperture(32, Some(6)), 0.05);
        // A quarter of the field is drawn in the same share of the time with four times the facets.
        let mut narrow = required;
        narrow.wanted.horizontal_deg = 10.8;
        assert_eq!(narrow.usual_facets(), Some(24));
    }

    /// As worked out with NumPy from duty = φ·n/4π, D = w/sin(π/n − φ/4) and v = π·D·L/n: 80 beams that wait behind 12
    /// facets fire every 2358 ns, which is more than light takes to 300 m and back (2001 ns), behind 6 facets every
    /// 1179 ns. A lens of 23.5 mm takes 321 mm then, whose corners move at 30.3 m/s.
    #[test]
    fn more_facets_leave_a_channel_more_time_and_take_a_larger_mirror() {
        let required = required("polygon_mm = 400.0").unwrap();
        let period = |facets| required.shortest_period(80, Some(facets)) * 1e9;
        approx::assert_relative_eq!(period(12), 2358.49, max_relative = 1e-5);
        approx::assert_relative_eq!(period(6), 1179.25, max_relative = 1e-5);
        let polygon = required.polygon(0.0235, 12);
        approx::assert_relative_eq!(polygon.diameter, 0.321, max_relative = 1e-9);
        let speed = polygon.tip_speed(required.lines(80.0));
        approx::assert_relative_eq!(speed, 30.254, max_relative = 1e-4);
        // Sixteen facets sweep 45°, seventeen 42.4°: less than the field.
        assert_eq!(required.facets().last(), Some(&16));
        // 5 mm behind 16 facets take 638 mm, behind 15 they take 239 mm.
        assert_eq!(required.mirrors(80).first(), Some(&Some(15)));
    }

    #[test]
    fn facets_that_sweep_less_than_the_field_are_refused() {
        let error = required("facets = [6, 17]").unwrap_err();
        assert!(error.contains("parts.facets") && error.contains("17"), "{error}");
        let error = required("facets = [6]\nsensor = \"coded-practical\"").unwrap_err();
        assert!(error.contains("parts."), "{error}");
    }

    #[test]
    fn no_speed_is_asked_of_what_has_no_polygon() {
        let error = required("tip_m_per_s = 110.0\nsensor = \"coded-practical\"").unwrap_err();
        assert!(error.contains("parts.sensor"), "{error}");
        let error = required("tip_m_per_s = 0.0").unwrap_err();
        assert!(error.contains("parts.tip_m_per_s"), "{error}");
    }
}
