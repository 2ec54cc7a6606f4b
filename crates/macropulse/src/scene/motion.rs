//! Where something is at which time.

use super::pose::Pose;
use super::rotation::Rotation;
use crate::units::s_from_fs;

/// The fastest that a scene file may let anything go, m/s.
pub(super) const FASTEST: f64 = 1e4;

/// The fastest that a scene file may let anything turn, deg/s.
pub(super) const FASTEST_TURN_DEG: f64 = 1e5;

/// A pose that changes evenly: p(t) = p₀ + v·t, yaw(t) = yaw₀ + ω·t, from the beginning of the
/// first scan on. It runs on from scan to scan.
///
/// A ray is cast at the time of its shot. In the flight time of its light, 2 µs at 300 m, a car at
/// 30 m/s moves by 0.06 mm; that is neglected.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Motion {
    /// Position and attitude at time 0.
    pub pose: Pose,
    /// In the world, m/s.
    pub velocity: [f64; 3],
    /// About the vertical axis through the position, rad/s; positive to the left.
    pub turn_rate: f64,
}

impl Motion {
    /// No motion at all.
    pub fn still(pose: Pose) -> Self {
        Self { pose, ..Self::default() }
    }

    /// Whether the pose ever changes.
    pub fn moves(&self) -> bool {
        self.velocity != [0.0; 3] || self.turn_rate != 0.0
    }

    /// The pose at `time_fs`, counted from the beginning of the first scan.
    #[inline]
    pub fn at(&self, time_fs: i64) -> Pose {
        let time = s_from_fs(time_fs);
        let [x, y, z] = self.pose.position;
        let [u, v, w] = self.velocity;
        let position = [x + u * time, y + v * time, z + w * time];
        let rotation = Rotation::about_vertical(self.turn_rate * time).after(self.pose.rotation);
        Pose { position, rotation }
    }

    /// The motion in words.
    pub fn told(&self) -> String {
        let [x, y, z] = self.velocity;
        let turn = self.turn_rate.to_degrees();
        // Beyond a billionth only the conversion to radians and back shows.
        let turn = (turn * 1e9).round() / 1e9;
        format!("moves by ({x}, {y}, {z}) m and turns by {turn} deg in each second")
    }
}

/// Something of a scene that moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Moving {
    /// Name, as the scene file has it; `sensor` for the sensor.
    pub name: String,
    /// How it moves.
    pub motion: Motion,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::FS_PER_S;

    #[test]
    fn a_pose_goes_and_turns_evenly() {
        let pose = Pose::turned([1.0, 2.0, 3.0], [0.5, 0.1, -0.2]);
        let motion = Motion { pose, velocity: [30.0, -2.0, 0.5], turn_rate: 4.0 };
        assert_eq!(motion.at(0), pose);
        let quarter = motion.at(FS_PER_S / 4);
        assert_eq!(quarter.position, [8.5, 1.5, 3.125]);
        let differ = quarter.rotation.angles().into_iter().zip([1.5, 0.1, -0.2]);
        assert!(differ.into_iter().all(|(one, other)| (one - other).abs() < 1e-15 * 4.0));
    }

    #[test]
    fn what_stands_still_stays_where_it_is() {
        let motion = Motion::still(Pose::at([7.0, -1.0, 0.0]));
        assert!(!motion.moves());
        assert_eq!(motion.at(9000 * FS_PER_S), motion.pose);
        assert!(Motion { turn_rate: 1e-9, ..motion }.moves());
    }

    #[test]
    fn a_motion_is_told_in_the_units_it_is_typed_in() {
        let turn_rate = 7_f64.to_radians();
        let motion = Motion { velocity: [30.0, 0.0, -0.5], turn_rate, ..Motion::default() };
        assert_eq!(motion.told(), "moves by (30, 0, -0.5) m and turns by 7 deg in each second");
    }
}
