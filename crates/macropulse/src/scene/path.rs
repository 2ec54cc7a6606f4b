//! A table of poses, and what is between them.

use super::pose::Pose;
use super::rotation::Turn;

/// Poses at ascending times.
///
/// From each pose to the next it goes straight on at one speed. It turns about one axis at one rate, the
/// shorter way. With s, the share of the time between both poses that has passed,
///
/// p = p₀ + s·(p₁ − p₀), q = q₀·(q₀⁻¹·q₁)ˢ \[Sho85\]
///
/// Before the first pose and after the last one it stands still.
#[derive(Debug, Clone, PartialEq)]
pub struct Waypoints(Vec<Waypoint>);

/// A pose of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Waypoint {
    time_fs: i64,
    pose: Pose,
    /// To the next one.
    turn: Turn,
}

impl Waypoints {
    /// Through these poses at ascending times, fs from the beginning of the first scan; one of them at least.
    pub(super) fn through(poses: &[(i64, Pose)]) -> Self {
        let next = poses.iter().skip(1).chain(poses.last());
        let waypoint = |(&(time_fs, pose), (_, next)): (&(i64, Pose), &(i64, Pose))| Waypoint {
            time_fs,
            pose,
            turn: pose.rotation.way_to(next.rotation),
        };
        Self(poses.iter().zip(next).map(waypoint).collect())
    }

    /// Its poses and their times, fs from the beginning of the first scan.
    pub fn poses(&self) -> impl DoubleEndedIterator<Item = (i64, Pose)> + ExactSizeIterator {
        self.0.iter().map(|waypoint| (waypoint.time_fs, waypoint.pose))
    }

    /// The pose at `time_fs`.
    pub(super) fn at(&self, time_fs: i64) -> Pose {
        let behind = self.0.partition_point(|waypoint| waypoint.time_fs <= time_fs);
        match (behind.checked_sub(1).map(|before| &self.0[before]), self.0.get(behind)) {
            (Some(last), Some(next)) => {
                let share = (time_fs - last.time_fs) as f64 / (next.time_fs - last.time_fs) as f64;
                let (from, to) = (last.pose.position, next.pose.position);
                let position = [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]));
                Pose { position, rotation: last.pose.rotation.turned(&last.turn, share) }
            }
            (Some(only), None) | (None, Some(only)) => only.pose,
            (None, None) => Pose::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::rotation::Rotation;
    use super::*;
    use crate::units::FS_PER_S;
    use glam::DVec3;

    fn seconds(time: f64) -> i64 {
        (time * FS_PER_S as f64).round() as i64
    }

    /// Returns the position of `path` at `time`, s, and the direction in which it looks.
    fn state(path: &Waypoints, time: f64) -> (DVec3, DVec3) {
        let pose = path.at(seconds(time));
        let ahead = pose.world_from_sensor().direction([1.0, 0.0, 0.0]);
        (DVec3::from(pose.position), DVec3::from(ahead))
    }

    /// Known answer: where velocity and turn are steady, a path through poses of that motion is that motion.
    #[test]
    fn a_path_through_steady_motion_is_exact() {
        let start = Rotation::from_angles([0.4, 0.2, -1.1]);
        let at = |time: f64| Pose {
            position: [3.0 + 20.0 * time, -4.0 * time, 2.0 + 0.5 * time],
            rotation: Rotation::about_vertical(1.7 * time).after(start),
        };
        let path = Waypoints::through(&[0.0, 0.5, 1.75, 2.0].map(|time| (seconds(time), at(time))));
        for step in 0..=200 {
            let time = 0.01 * f64::from(step);
            let (position, ahead) = state(&path, time);
            let exact = at(time);
            assert!(position.distance(DVec3::from(exact.position)) < 1e-12);
            let exact = exact.world_from_sensor().direction([1.0, 0.0, 0.0]);
            assert!(ahead.distance(DVec3::from(exact)) < 1e-14);
        }
    }

    /// A banked turn on a circle of r = 30 m at ω = 0.5 rad/s, pitched and rolled throughout. A chord over
    /// the time T leaves the arc by r·(1 − cos(ω·T/2)) at most. Steps of a quarter of the length make this 16
    /// times smaller. The attitude, about the vertical, is exact.
    #[test]
    fn a_path_around_a_curve_leaves_it_by_the_sagitta() {
        let (radius, rate) = (30.0, 0.5);
        let banked = Rotation::from_angles([0.0, 0.05, 0.3]);
        let at = |time: f64| {
            let (sin, cos) = libm::sincos(rate * time);
            Pose {
                position: [radius * sin, radius * (1.0 - cos), 1.5],
                rotation: Rotation::about_vertical(rate * time).after(banked),
            }
        };
        let off = |period: f64| {
            let count = (4.0 / period).round() as usize;
            let poses = (0..=count).map(|step| step as f64 * period);
            let path = Waypoints::through(
                &poses.map(|time| (seconds(time), at(time))).collect::<Vec<_>>(),
            );
            (0..4000).map(|step| f64::from(step) * 1e-3).fold(0.0, |most: f64, time| {
                let (position, ahead) = state(&path, time);
                let exact = at(time);
                let exact_ahead = exact.world_from_sensor().direction([1.0, 0.0, 0.0]);
                assert!(ahead.distance(DVec3::from(exact_ahead)) < 1e-13);
                most.max(position.distance(DVec3::from(exact.position)))
            })
        };
        for period in [0.8, 0.2] {
            let sagitta = radius * (1.0 - libm::cos(rate * period / 2.0));
            let most = off(period);
            assert!(most <= sagitta * (1.0 + 1e-9) && most > 0.999 * sagitta, "{most} {sagitta}");
        }
    }

    #[test]
    fn before_and_after_it_stands_still() {
        let (first, last) = (Pose::at([1.0, 0.0, 0.0]), Pose::turned([2.0, 0.0, 0.0], [1.0; 3]));
        let path = Waypoints::through(&[(seconds(1.0), first), (seconds(2.0), last)]);
        assert_eq!((path.at(seconds(-5.0)), path.at(seconds(1.0))), (first, first));
        assert_eq!((path.at(seconds(2.0)), path.at(seconds(99.0))), (last, last));
        assert_ne!(path.at(seconds(1.5)), first);
    }
}
