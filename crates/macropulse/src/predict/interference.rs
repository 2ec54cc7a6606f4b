//! Effects of other lidars on a receiver, in simple cases.

use crate::units::{range_from_tof, tof_from_range};

/// Detection events per second that another lidar makes in a detector that counts photons: r·m·k·(1 − e⁻ⁿ).
///
/// The light of r shots per second arrives, each of m `marks` on average with n `photons` per mark. The
/// detector keeps the fraction k, `kept`, of the events (docs/physics.md#photon-counting).
pub fn events_per_second(shots_per_second: f64, marks: f64, photons: f64, kept: f64) -> f64 {
    shots_per_second * marks * kept * -libm::expm1(-photons)
}

/// Chance that a shot of a sensor that takes the first light after `min_range` gets a ghost before
/// the echo of a surface at `range`, m: min(1, f·(t(range) − t(min_range))).
///
/// The other lidar sends single micropulses f times a second, bright enough to be always seen, in
/// no step with our own; t is the two-way time of flight.
pub fn ghost_of_single_pulses(shots_per_second: f64, min_range: f64, range: f64) -> f64 {
    let open = tof_from_range(range) - tof_from_range(min_range);
    (shots_per_second * open).clamp(0.0, 1.0)
}

/// Distance, m, by which the ghosts of an identical lidar that fires in step come nearer with every scan of
/// `period` seconds. Its clock runs fast by the fraction `drift`, and the distance is the range of
/// drift·period.
pub fn walk_per_scan(drift: f64, period: f64) -> f64 {
    range_from_tof(drift * period)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ghosts_walk_50_metres_in_a_sixtieth_of_a_second_at_20_millionths() {
        let walk = walk_per_scan(20e-6, 1.0 / 60.0);
        approx::assert_relative_eq!(walk, 49.965, max_relative = 1e-4);
        assert_eq!(walk_per_scan(-20e-6, 1.0 / 60.0), -walk);
    }

    #[test]
    fn chances_end_at_one() {
        approx::assert_relative_eq!(
            ghost_of_single_pulses(1e6, 0.0, 15.0),
            0.100_069,
            epsilon = 1e-6
        );
        assert_eq!(ghost_of_single_pulses(1e9, 0.0, 15.0), 1.0);
        assert_eq!(ghost_of_single_pulses(1e9, 15.0, 10.0), 0.0);
    }

    #[test]
    fn strong_light_makes_an_event_of_every_mark() {
        assert_eq!(events_per_second(1e6, 180.0, f64::INFINITY, 1.0), 1.8e8);
        approx::assert_relative_eq!(
            events_per_second(1e6, 1.0, 1e-9, 0.5),
            5e-4,
            max_relative = 1e-8
        );
    }
}
