//! Poses over time.

use super::path::Waypoints;
use super::pose::Pose;
use super::rotation::Rotation;
use crate::units::s_from_fs;

/// The fastest that a scene file may let anything go, m/s.
pub(super) const FASTEST: f64 = 1e4;

/// The fastest that a scene file may let anything turn, deg/s.
pub(super) const FASTEST_TURN_DEG: f64 = 1e5;

/// A pose over time, counted from the beginning of the first scan. It runs on from scan to scan.
///
/// A ray is cast at the time of its shot. In the flight time of its light, 2 µs at 300 m, a car at
/// 30 m/s moves by 0.06 mm; that is neglected.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// None at all.
    Still(Pose),
    /// Steady: p(t) = p₀ + v·t, and a turn by ω·t about the vertical through the position.
    Steady {
        /// Position and attitude at time 0.
        pose: Pose,
        /// In the world, m/s.
        velocity: [f64; 3],
        /// rad/s; positive to the left.
        turn_rate: f64,
    },
    /// Along a table of poses.
    Path(Waypoints),
}

impl Motion {
    /// From `pose` on at a steady `velocity`, m/s, and `turn_rate`, rad/s; still if both are zero.
    pub fn steady(pose: Pose, velocity: [f64; 3], turn_rate: f64) -> Self {
        match velocity == [0.0; 3] && turn_rate == 0.0 {
            true => Self::Still(pose),
            false => Self::Steady { pose, velocity, turn_rate },
        }
    }

    /// Returns true if the pose ever changes.
    pub fn moves(&self) -> bool {
        !matches!(self, Self::Still(_))
    }

    /// The pose when the first scan begins.
    pub fn at_start(&self) -> Pose {
        self.at(0)
    }

    /// The pose at `time_fs`, counted from the beginning of the first scan.
    #[inline]
    pub fn at(&self, time_fs: i64) -> Pose {
        match self {
            Self::Still(pose) => *pose,
            Self::Steady { pose, velocity, turn_rate } => {
                let time = s_from_fs(time_fs);
                let position = [0, 1, 2].map(|axis| pose.position[axis] + velocity[axis] * time);
                let turn = Rotation::about_vertical(turn_rate * time);
                Pose { position, rotation: turn.after(pose.rotation) }
            }
            Self::Path(path) => path.at(time_fs),
        }
    }

    /// The same motion with each pose of it `placed` elsewhere.
    pub(super) fn placed(&self, mut placed: impl FnMut(&Pose) -> [f64; 3]) -> Self {
        let mut place = |pose: &Pose| Pose { position: placed(pose), ..*pose };
        match self {
            Self::Still(pose) => Self::Still(place(pose)),
            Self::Steady { pose, velocity, turn_rate } => {
                let (velocity, turn_rate) = (*velocity, *turn_rate);
                Self::Steady { pose: place(pose), velocity, turn_rate }
            }
            Self::Path(path) => {
                let poses = path.poses().map(|(time_fs, pose)| (time_fs, place(&pose)));
                Self::Path(Waypoints::through(&poses.collect::<Vec<_>>()))
            }
        }
    }

    /// The motion in words.
    pub fn told(&self) -> String {
        match self {
            Self::Still(_) => "stands still".to_owned(),
            Self::Steady { velocity: [x, y, z], turn_rate, .. } => {
                let turn = turn_rate.to_degrees();
                // Beyond a billionth only the conversion to radians and back shows.
                let turn = (turn * 1e9).round() / 1e9;
                format!("moves by ({x}, {y}, {z}) m and turns by {turn} deg in each second")
            }
            Self::Path(path) => {
                let mut times = path.poses().map(|(time_fs, _)| s_from_fs(time_fs));
                let (count, first) = (times.len(), times.next().unwrap_or_default());
                let last = times.next_back().unwrap_or(first);
                format!("follows a path of {count} poses from {first} to {last} s")
            }
        }
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
        let motion = Motion::steady(pose, [30.0, -2.0, 0.5], 4.0);
        assert_eq!((motion.at(0), motion.at_start()), (pose, pose));
        let quarter = motion.at(FS_PER_S / 4);
        assert_eq!(quarter.position, [8.5, 1.5, 3.125]);
        let differ = quarter.rotation.angles().into_iter().zip([1.5, 0.1, -0.2]);
        assert!(differ.into_iter().all(|(one, other)| (one - other).abs() < 1e-15 * 4.0));
    }

    #[test]
    fn what_stands_still_stays_where_it_is() {
        let pose = Pose::at([7.0, -1.0, 0.0]);
        let motion = Motion::steady(pose, [0.0; 3], 0.0);
        assert!(!motion.moves());
        assert_eq!(motion.at(9000 * FS_PER_S), pose);
        assert!(Motion::steady(pose, [0.0; 3], 1e-9).moves());
    }

    #[test]
    fn a_motion_is_told_in_the_units_it_is_typed_in() {
        let motion = Motion::steady(Pose::default(), [30.0, 0.0, -0.5], 7_f64.to_radians());
        assert_eq!(motion.told(), "moves by (30, 0, -0.5) m and turns by 7 deg in each second");
        let path =
            Waypoints::through(&[(0, Pose::default()), (3 * FS_PER_S / 2, Pose::at([1.0; 3]))]);
        assert_eq!(Motion::Path(path).told(), "follows a path of 2 poses from 0 to 1.5 s");
    }

    #[test]
    fn every_pose_of_a_motion_is_placed() {
        let up = |pose: &Pose| [0, 1, 2].map(|axis| pose.position[axis] + 3.0);
        let poses = [0.0, 1.0].map(|x| (x as i64 * FS_PER_S, Pose::at([x, 0.0, 0.0])));
        let pose = Pose::default();
        for (motion, later) in [
            (Motion::Still(pose), [0.0, 0.0, 0.0]),
            (Motion::steady(pose, [2.0, 0.0, 0.0], 0.0), [2.0, 0.0, 0.0]),
            (Motion::Path(Waypoints::through(&poses)), [1.0, 0.0, 0.0]),
        ] {
            let raised = motion.placed(up).at(FS_PER_S);
            assert_eq!(raised.position, later.map(|axis: f64| axis + 3.0));
        }
    }
}
