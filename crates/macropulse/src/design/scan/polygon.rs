//! A polygon: a prism with mirrors for sides, which turns at a constant speed and draws a line with each.

use std::f64::consts::PI;

/// A prism whose sides, its facets, are mirrors.
///
/// The light comes and goes in a plane with the axle and is led out of its way by twice the angle by which
/// the polygon turns. It is as wide as the receiver's aperture. A facet must hold all of it for the time in
/// which shots are fired; the rest of a facet's turn is lost to a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polygon {
    /// Mirrors around the axle.
    pub facets: u32,
    /// From corner to corner, through the axle, m.
    pub diameter: f64,
}

impl Polygon {
    /// The field, radians, that light would sweep while one of n `facets` passes: 4π/n.
    pub fn sweep(facets: u32) -> f64 {
        4.0 * PI / f64::from(facets)
    }

    /// Width of a facet, m: D·sin(π/n).
    pub fn facet(&self) -> f64 {
        self.diameter * libm::sin(PI / f64::from(self.facets))
    }

    /// Returns the width, m, of the widest light that meets the facet entirely, at both ends of a line that
    /// covers `horizontal` radians: D·sin(π/n − φ/4).
    ///
    /// At the ends the polygon is turned by θ = φ/4. Light towards the axle meets the facet, whose middle is
    /// r = D/2·cos(π/n) from the axle, at r·tan θ from that middle, and is 1/cos θ as wide there. With half
    /// of the facet, D/2·sin(π/n), for both, the width is D·(sin(π/n)·cos θ − cos(π/n)·sin θ).
    pub fn widest(&self, horizontal: f64) -> f64 {
        self.diameter * self.per_diameter(horizontal)
    }

    /// The least diameter, m, that holds light so wide, m, at both ends of a line.
    pub fn least_diameter(&self, horizontal: f64, width: f64) -> f64 {
        width / self.per_diameter(horizontal)
    }

    fn per_diameter(&self, horizontal: f64) -> f64 {
        libm::sin(PI / f64::from(self.facets) - horizontal / 4.0)
    }

    /// Returns the turns per second that draw `lines` a second.
    pub fn turns(&self, lines: f64) -> f64 {
        lines / f64::from(self.facets)
    }

    /// Returns the speed of its corners, m/s, at `lines` a second.
    pub fn tip_speed(&self, lines: f64) -> f64 {
        PI * self.diameter * self.turns(lines)
    }
}
