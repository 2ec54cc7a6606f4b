//! Rotations in space.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DMat3, DQuat, DVec3};

/// A pitch so near ±90° that yaw and roll turn about one axis, as the sine or cosine of half of what is
/// left.
const UPRIGHT: f64 = 1e-12;

/// Printed angles have this many steps in a degree: beyond them only the conversion to radians shows.
const STEPS: f64 = 1e9;

/// A rotation, as a unit quaternion.
///
/// Angles are right-handed: yaw turns x towards y (to the left), pitch turns z towards x (**positive
/// looks down**), roll turns y towards z. They apply in the order roll, pitch, yaw:
/// `R = Rz(yaw) Ry(pitch) Rx(roll)`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Rotation(DQuat);

impl Rotation {
    /// The rotation by yaw, pitch and roll, rad.
    pub fn from_angles(angles: [f64; 3]) -> Self {
        let [(sy, cy), (sp, cp), (sr, cr)] = angles.map(|angle| libm::sincos(angle / 2.0));
        Self(DQuat::from_xyzw(
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ))
    }

    /// Yaw, pitch and roll, rad: yaw and roll from −π to π, pitch from −π/2 to π/2. Roll is 0 where pitch is ±π/2.
    ///
    /// With half angles y, p, r the quaternion (w, x, y, z) has
    ///
    /// w − y = √2·cos(p + π/4)·cos(y + r), x + z = √2·cos(p + π/4)·sin(y + r),
    /// w + y = √2·sin(p + π/4)·cos(y − r), z − x = √2·sin(p + π/4)·sin(y − r)
    ///
    /// and so no angle comes from a sine near 1, where little would be left of it.
    pub fn angles(&self) -> [f64; 3] {
        let [w, x, y, z] = self.quaternion();
        let (near, far) = (libm::hypot(x + z, w - y), libm::hypot(z - x, w + y));
        let pitch = 2.0 * libm::atan2(far, near) - FRAC_PI_2;
        let (sum, difference) = (libm::atan2(x + z, w - y), libm::atan2(z - x, w + y));
        let (sum, difference) = match (near < UPRIGHT, far < UPRIGHT) {
            (true, _) => (difference, difference),
            (_, true) => (sum, sum),
            _ => (sum, difference),
        };
        [wrapped(sum + difference), pitch, wrapped(sum - difference)]
    }

    /// [`Rotation::angles`] in degrees, to be printed: rounded to a billionth.
    pub fn angles_deg(&self) -> [f64; 3] {
        // Added to, a zero has no sign to be printed.
        self.angles().map(|angle| (angle.to_degrees() * STEPS).round() / STEPS + 0.0)
    }

    /// The rotation by `angle` rad about the vertical, positive to the left.
    #[inline]
    pub fn about_vertical(angle: f64) -> Self {
        let (sin, cos) = libm::sincos(angle / 2.0);
        Self(DQuat::from_xyzw(0.0, 0.0, sin, cos))
    }

    /// This rotation after the rotation `first`.
    #[inline]
    pub fn after(self, first: Self) -> Self {
        Self(self.0 * first.0)
    }

    /// The unit quaternion w, x, y, z.
    pub fn quaternion(&self) -> [f64; 4] {
        let DQuat { x, y, z, w } = self.0;
        [w, x, y, z]
    }

    /// Returns the turn about one axis that carries this rotation over to `other` the shorter way. The axis
    /// is in the frame of this rotation; the angle, rad, is from 0 to π.
    pub(super) fn way_to(self, other: Self) -> Turn {
        let between = self.0.conjugate() * other.0;
        let (across, along) = (between.xyz().length(), between.w);
        let half = libm::atan2(across, along.abs());
        let sign = if along < 0.0 { -1.0 } else { 1.0 };
        let axis = between.xyz().try_normalize().unwrap_or(DVec3::ZERO) * sign;
        Turn { axis, angle: 2.0 * half }
    }

    /// This rotation after `turn` in its own frame.
    #[inline]
    pub(super) fn turned(self, turn: &Turn, share: f64) -> Self {
        let (sin, cos) = libm::sincos(turn.angle * share / 2.0);
        let [x, y, z] = (turn.axis * sin).to_array();
        Self(self.0 * DQuat::from_xyzw(x, y, z, cos))
    }

    /// The matrix of the rotation.
    #[inline]
    pub(super) fn matrix(&self) -> DMat3 {
        DMat3::from_quat(self.0)
    }
}

/// A turn about one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Turn {
    /// Unit vector; zero where there is no turn.
    axis: DVec3,
    /// rad, from 0 to π.
    pub angle: f64,
}

/// `angle` from −π to π.
fn wrapped(angle: f64) -> f64 {
    match angle {
        _ if angle > PI => angle - TAU,
        _ if angle < -PI => angle + TAU,
        _ => angle,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// R = Rz(yaw) Ry(pitch) Rx(roll), by the angles themselves.
    fn by_angles([yaw, pitch, roll]: [f64; 3]) -> DMat3 {
        DMat3::from_rotation_z(yaw) * DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll)
    }

    #[test]
    fn angles_turn_in_the_order_roll_pitch_yaw() {
        let mut chance = ChaCha8Rng::seed_from_u64(7);
        for _ in 0..1000 {
            let angles = [0; 3].map(|_| chance.random_range(-7.0..7.0));
            let rotation = Rotation::from_angles(angles);
            assert!(rotation.matrix().abs_diff_eq(by_angles(angles), 1e-15 * 8.0));
            assert!(rotation.matrix().abs_diff_eq(by_angles(rotation.angles()), 1e-14));
        }
    }

    #[test]
    fn angles_come_back_and_straight_down_has_no_roll() {
        for angles in [[0.3, -1.2, 2.9], [-3.1, 1.5, -0.01], [0.0; 3], [PI, 0.0, 0.0]] {
            let back = Rotation::from_angles(angles).angles();
            assert!(angles.iter().zip(back).all(|(one, other)| (one - other).abs() < 1e-14));
        }
        for down in [-FRAC_PI_2, FRAC_PI_2] {
            let rotation = Rotation::from_angles([0.7, down, 0.4]);
            let [_, pitch, roll] = rotation.angles();
            assert!((pitch - down).abs() < 1e-12 && roll == 0.0);
            assert!(rotation.matrix().abs_diff_eq(by_angles(rotation.angles()), 1e-12));
        }
        for degrees in [1.0, 30.0, -123.4, 180.0] {
            let rotation = Rotation::from_angles([f64::to_radians(degrees), 0.0, 0.0]);
            assert_eq!(rotation.angles_deg(), [degrees, 0.0, 0.0]);
            assert!(
                rotation.angles_deg().iter().all(|angle| *angle != 0.0 || angle.is_sign_positive())
            );
        }
        let around = Rotation::from_angles([270_f64.to_radians(), 0.0, 0.0]);
        assert!((around.angles_deg()[0] + 90.0).abs() < 1e-9);
    }

    #[test]
    fn the_quaternion_turns_as_the_matrix_does() {
        let rotation = Rotation::from_angles([0.7, -0.4, 2.1]);
        let [w, x, y, z] = rotation.quaternion();
        let turn = DQuat::from_xyzw(x, y, z, w);
        for axis in DVec3::AXES {
            assert!((turn * axis).abs_diff_eq(rotation.matrix() * axis, 1e-15));
        }
        assert_eq!(Rotation::default().quaternion(), [1.0, 0.0, 0.0, 0.0]);
    }

    /// Known answer: a turn about one axis is as far along as the share of its angle; of two ways round
    /// the shorter one is taken.
    #[test]
    fn a_turn_goes_the_shorter_way_evenly() {
        let axis = DVec3::new(1.0, -2.0, 0.5).normalize();
        let first = Rotation::from_angles([0.4, 0.3, -0.9]);
        let by = |angle| Rotation(first.0 * DQuat::from_axis_angle(axis, angle));
        for (angle, shorter) in [(1.2, 1.2), (4.0, 4.0 - TAU), (0.0, 0.0)] {
            let way = first.way_to(by(angle));
            assert!((way.angle - shorter.abs()).abs() < 1e-15 * 8.0);
            for share in [0.0, 0.25, 0.7, 1.0] {
                let there = first.turned(&way, share).matrix();
                assert!(there.abs_diff_eq(by(share * shorter).matrix(), 1e-14));
            }
        }
    }
}
