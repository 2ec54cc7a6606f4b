//! Where something stands and how it is turned.
//!
//! World frame: x forward, y left, z up, right-handed, metres (REP-103). Angles are right-handed
//! too: yaw turns x towards y (to the left), pitch turns z towards x (**positive looks down**),
//! roll turns y towards z. They apply in the order roll, pitch, yaw: `R = Rz(yaw) Ry(pitch) Rx(roll)`.

use glam::{DMat3, DVec3};

/// Position and attitude of a sensor or an object in the world.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pose {
    /// Position in the world, m.
    pub position: [f64; 3],
    /// Turn about the vertical, rad; positive to the left.
    pub yaw: f64,
    /// Turn about the left axis, rad; positive looks down.
    pub pitch: f64,
    /// Turn about the forward axis, rad; positive lifts the left side.
    pub roll: f64,
}

impl Pose {
    /// Standing at `position`, facing along x, level.
    pub fn at(position: [f64; 3]) -> Self {
        Self { position, ..Self::default() }
    }

    /// The map that carries the local frame of this pose into the world.
    pub fn world_from_sensor(&self) -> Transform {
        let (sy, cy) = libm::sincos(self.yaw);
        let (sp, cp) = libm::sincos(self.pitch);
        let (sr, cr) = libm::sincos(self.roll);
        let rotation = DMat3::from_cols(
            DVec3::new(cy * cp, sy * cp, -sp),
            DVec3::new(cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr),
            DVec3::new(cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr),
        );
        Transform { rotation, translation: DVec3::from(self.position) }
    }

    /// The turn of [`Pose::world_from_sensor`] as a unit quaternion w, x, y, z.
    pub fn quaternion(&self) -> [f64; 4] {
        let (sy, cy) = libm::sincos(self.yaw / 2.0);
        let (sp, cp) = libm::sincos(self.pitch / 2.0);
        let (sr, cr) = libm::sincos(self.roll / 2.0);
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
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
        let forward = |pose: Pose| pose.world_from_sensor().direction([1.0, 0.0, 0.0]);
        assert!(close(forward(Pose { yaw: FRAC_PI_2, ..Pose::default() }), [0.0, 1.0, 0.0]));
        assert!(close(forward(Pose { pitch: FRAC_PI_2, ..Pose::default() }), [0.0, 0.0, -1.0]));
        let roll = Pose { roll: FRAC_PI_2, ..Pose::default() }.world_from_sensor();
        assert!(close(roll.direction([0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]));
    }

    #[test]
    fn the_way_there_and_back_ends_where_it_began() {
        let pose = Pose { position: [3.0, -2.0, 500_000.0], yaw: 0.3, pitch: -1.2, roll: 2.9 };
        let point = [7.0, 1.0, -4.0];
        let back = pose.sensor_from_world().point(pose.world_from_sensor().point(point));
        assert!(DVec3::from(back).distance(DVec3::from(point)) < 1e-9);
    }

    #[test]
    fn the_quaternion_turns_as_the_map_does() {
        let pose = Pose { yaw: 0.7, pitch: -0.4, roll: 2.1, ..Pose::default() };
        let [w, x, y, z] = pose.quaternion();
        let turn = glam::DQuat::from_xyzw(x, y, z, w);
        for axis in DVec3::AXES {
            let turned = pose.world_from_sensor().direction(axis.to_array());
            assert!(close((turn * axis).to_array(), turned));
        }
        assert_eq!(Pose::at([1.0; 3]).quaternion(), [1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn a_resting_pose_moves_nothing() {
        assert_eq!(Pose::default().world_from_sensor().point([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
    }
}
