//! Poses: where something stands and how it is turned.
//!
//! World frame: x forward, y left, z up, right-handed, metres (REP-103).

use glam::{DMat3, DVec3};

use super::rotation::Rotation;

/// Position and attitude of a sensor or an object in the world.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pose {
    /// Position in the world, m.
    pub position: [f64; 3],
    /// How it is turned.
    pub rotation: Rotation,
}

impl Pose {
    /// Standing at `position`, facing along x, level.
    pub fn at(position: [f64; 3]) -> Self {
        Self { position, ..Self::default() }
    }

    /// Standing at `position`, m, turned by yaw, pitch and roll, rad ([`Rotation::from_angles`]).
    pub fn turned(position: [f64; 3], angles: [f64; 3]) -> Self {
        Self { position, rotation: Rotation::from_angles(angles) }
    }

    /// The map that carries the local frame of this pose into the world.
    pub fn world_from_sensor(&self) -> Transform {
        let rotation = self.rotation.matrix();
        Transform { rotation, translation: DVec3::from(self.position) }
    }

    /// The map that carries the world into the local frame of this pose; inverse of
    /// [`Pose::world_from_sensor`].
    pub fn sensor_from_world(&self) -> Transform {
        self.world_from_sensor().inverse()
    }
}

/// A rigid map: a rotation followed by a shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform {
    rotation: DMat3,
    translation: DVec3,
}

impl Transform {
    /// Carries a point over.
    #[inline]
    pub fn point(&self, point: [f64; 3]) -> [f64; 3] {
        (self.rotation * DVec3::from(point) + self.translation).to_array()
    }

    /// Carries a direction over: turned, not shifted.
    #[inline]
    pub fn direction(&self, direction: [f64; 3]) -> [f64; 3] {
        (self.rotation * DVec3::from(direction)).to_array()
    }

    /// The turn alone.
    pub(super) fn rotation(&self) -> &DMat3 {
        &self.rotation
    }

    /// The same map, shifted by `by` afterwards.
    pub(super) fn shifted(self, by: [f64; 3]) -> Self {
        Self { translation: self.translation + DVec3::from(by), ..self }
    }

    /// The map back.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, translation: -(rotation * self.translation) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn close(a: [f64; 3], b: [f64; 3]) -> bool {
        DVec3::from(a).distance(DVec3::from(b)) < 1e-12
    }

    #[test]
    fn each_angle_turns_the_way_it_says() {
        let carried = |angles, direction| {
            Pose::turned([0.0; 3], angles).world_from_sensor().direction(direction)
        };
        let (forward, left) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert!(close(carried([FRAC_PI_2, 0.0, 0.0], forward), left));
        assert!(close(carried([0.0, FRAC_PI_2, 0.0], forward), [0.0, 0.0, -1.0]));
        assert!(close(carried([0.0, 0.0, FRAC_PI_2], left), [0.0, 0.0, 1.0]));
    }

    #[test]
    fn the_way_there_and_back_ends_where_it_began() {
        let pose = Pose::turned([3.0, -2.0, 500_000.0], [0.3, -1.2, 2.9]);
        let point = [7.0, 1.0, -4.0];
        let back = pose.sensor_from_world().point(pose.world_from_sensor().point(point));
        assert!(DVec3::from(back).distance(DVec3::from(point)) < 1e-9);
    }

    #[test]
    fn a_resting_pose_moves_nothing() {
        assert_eq!(Pose::default().world_from_sensor().point([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
    }
}
