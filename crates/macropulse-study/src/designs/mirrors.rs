//! The mirror of each lidar: channels against the size and the speed of a polygon.

use macropulse::units::tof_from_range;

use super::in_flight::InFlight;
use super::requirements::Requirements;
use super::trial::Trial;

/// A polygon, and the needs of each lidar behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mirror {
    /// Facets.
    pub facets: u32,
    /// Share of the time in which they draw: φ·n/4π.
    pub duty: f64,
    /// Coded, waiting for all that answers, and with single pulses in flight.
    pub sides: [Option<Side>; 3],
}

/// Needs of a lidar behind a polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// Fewest channels that leave it its time between shots. This is a rational number; the number of rows
    /// asks for its next divisor.
    pub channels: f64,
    /// Diameter of the polygon that holds its aperture, m.
    pub diameter: f64,
    /// Speed of its corners, m/s.
    pub tip_speed: f64,
}

/// Every number of facets with the lidars that do, as far as the polygon of one of them is not too large; empty where
/// there is no polygon.
pub(super) fn mirrors(
    required: &Requirements,
    best: [Option<&Trial>; 2],
    in_flight: Option<&InFlight>,
) -> Vec<Mirror> {
    if !required.has_polygon() {
        return Vec::new();
    }
    let of = |trial: &Trial| {
        let it = &trial.candidate;
        let period = match it.waits() {
            true => tof_from_range(required.wanted.clutter_m),
            false => required.shortest_period(it.beams, it.facets),
        };
        (it.aperture, period)
    };
    let [coded, waiting] = best.map(|best| best.map(of));
    let flying = in_flight.map(|it| (it.candidate.aperture, it.least_period));
    let side = |facets: u32, needs: Option<(f64, f64)>| {
        needs.map(|(aperture, period)| {
            let channels = period / required.shortest_period(1, Some(facets));
            let polygon = required.polygon(aperture, facets);
            let tip_speed = polygon.tip_speed(required.lines(channels));
            Side { channels, diameter: polygon.diameter, tip_speed }
        })
    };
    let of_facets = |facets: u32| Mirror {
        facets,
        duty: required.duty(facets),
        sides: [coded, waiting, flying].map(|needs| side(facets, needs)),
    };
    let most = required.parts.polygon_mm * 1e-3;
    let fits = |mirror: &Mirror| mirror.sides.iter().flatten().any(|side| side.diameter <= most);
    required.facets().into_iter().map(of_facets).filter(fits).collect()
}
