//! How much of a beam passes a round aperture.

use std::f64::consts::PI;

/// Places at which the share is worked out.
const PLACES: usize = 128;
/// Parts into which an aperture is cut, even.
const PARTS: usize = 64;
/// Beyond this many radii of the beam from the rim of the aperture there is no light: 3e-4 of it.
const REACH: f64 = 2.0;

/// The share of a Gaussian beam that passes a round aperture, by the distance between their middles.
///
/// With w, the radius of the beam at 1/e², σ = w/2 and a, that of the aperture, at a distance r:
/// ∫ exp(−(x − r)²/2σ²)/(σ√2π) · erf(√(a² − x²)/(σ√2)) dx over −a…a; in the middle it is
/// 1 − exp(−2a²/w²).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Share {
    radius: f64,
    /// Radius of the beam.
    beam: f64,
    /// Start of the table, and the distance between its places; 0 for a beam without width.
    first: f64,
    step: f64,
    table: Vec<f64>,
}

impl Share {
    /// Tabulates the share of a beam of radius `beam` through an aperture of radius `radius`, m.
    pub fn new(radius: f64, beam: f64) -> Self {
        if beam < 1e-6 * radius {
            return Self { radius, beam, first: 0.0, step: 0.0, table: Vec::new() };
        }
        let first = (radius - REACH * beam).max(0.0);
        let step = (radius + REACH * beam - first) / (PLACES - 1) as f64;
        let table = (0..PLACES).map(|place| passed(radius, beam, first + place as f64 * step));
        Self { radius, beam, first, step, table: table.collect() }
    }

    /// How far apart, m, places are at which different light passes: the radius of the aperture, and half that
    /// of a beam.
    pub fn width(&self) -> f64 {
        self.radius + self.beam / 2.0
    }

    /// Beyond this distance, m, nothing passes.
    pub fn reach(&self) -> f64 {
        match self.table.len() {
            // A hair more, so that what lies on the rim counts.
            0 => self.radius * (1.0 + 1e-9),
            places => self.first + self.step * (places - 1) as f64,
        }
    }

    /// The share that passes at `distance` metres.
    #[inline]
    pub fn at(&self, distance: f64) -> f64 {
        if distance > self.reach() {
            return 0.0;
        }
        let [Some(&first), Some(&last)] = [self.table.first(), self.table.last()] else {
            return 1.0;
        };
        let place = (distance - self.first) / self.step;
        if place <= 0.0 {
            // If the table does not begin in the middle, the beam passes whole before it.
            return if self.first > 0.0 { 1.0 } else { first };
        }
        let before = place as usize;
        let part = place - before as f64;
        match (self.table.get(before), self.table.get(before + 1)) {
            (Some(before), Some(after)) => before + part * (after - before),
            _ => last,
        }
    }
}

/// The integral, by Simpson's rule over u with x = a·sin u, which is smooth at the rim.
fn passed(a: f64, beam: f64, distance: f64) -> f64 {
    let sigma = beam / 2.0;
    let bound = |x: f64| libm::asin((x / a).clamp(-1.0, 1.0));
    let (from, to) = (bound(distance - 6.0 * sigma), bound(distance + 6.0 * sigma));
    let width = (to - from) / PARTS as f64;
    let sum: f64 = (0..=PARTS)
        .map(|part| {
            let u = from + part as f64 * width;
            let (x, chord) = (a * libm::sin(u), a * libm::cos(u));
            let off = (x - distance) / sigma;
            let across = libm::erf(chord / (sigma * std::f64::consts::SQRT_2));
            let weight = match part {
                0 | PARTS => 1.0,
                odd if odd % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight * libm::exp(-off * off / 2.0) * across * chord
        })
        .sum();
    sum * width / 3.0 / (sigma * libm::sqrt(2.0 * PI))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_beam_in_the_middle_passes_by_the_closed_form() {
        for (radius, beam) in [(3.5e-3, 0.6e-3), (3.5e-3, 3e-3), (0.5e-3, 5e-3), (1.75e-3, 5e-3)] {
            let closed = 1.0 - libm::exp(-2.0 * (radius / beam) * (radius / beam));
            assert_relative_eq!(Share::new(radius, beam).at(0.0), closed, max_relative = 1e-4);
        }
    }

    #[test]
    fn a_beam_without_width_passes_or_does_not() {
        let share = Share::new(3.5e-3, 0.0);
        assert_eq!([share.at(0.0), share.at(3.5e-3), share.at(3.6e-3)], [1.0, 1.0, 0.0]);
        let narrow = Share::new(3.5e-3, 0.1e-3);
        assert_relative_eq!(narrow.at(3.5e-3), 0.5, max_relative = 0.02);
        assert_eq!(narrow.at(4.5e-3), 0.0);
    }

    /// However wide the beam: beams side by side everywhere bring as much light as there is on the
    /// area of the aperture.
    #[test]
    fn all_places_together_make_up_the_aperture() {
        for (radius, beam) in [(3.5e-3, 0.5e-3), (1.75e-3, 5e-3), (1e-3, 1e-3)] {
            let share = Share::new(radius, beam);
            let step = share.reach() / 2000.0;
            let ring = |n: u32| {
                let r = (f64::from(n) + 0.5) * step;
                share.at(r) * 2.0 * PI * r * step
            };
            let all: f64 = (0..2000).map(ring).sum();
            assert_relative_eq!(all, PI * radius * radius, max_relative = 5e-3);
        }
    }
}
