//! Shapes whose intersection with a ray is a formula: walls and grounds of scenes, and the oracle
//! that triangle meshes are tested against.

use glam::DVec3;

use super::hits::{CastRays, Hit, Ray};
use super::pose::{Pose, Transform};
use crate::kernels::{CURVED, Form, Frustum, Lanes, Packet, meet, meet_packet};

/// A shape in its own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// The unbounded plane through the origin with this unit normal.
    Plane {
        /// Unit vector.
        normal: [f64; 3],
    },
    /// A sphere about the origin.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A box about the origin, along the axes.
    Box {
        /// Half its length, width and height, m.
        half: [f64; 3],
    },
    /// A cylinder or a cone about the origin, along z.
    Frustum {
        /// Radii at its lower and at its upper end, m; 0 at the tip of a cone.
        radii: [f64; 2],
        /// Half its height, m.
        half: f64,
    },
    /// A cylinder about the origin, along z, with a half ball at each end.
    Capsule {
        /// Radius, m.
        radius: f64,
        /// Half the height of the cylinder, m.
        half: f64,
    },
    /// An ellipsoid about the origin, along the axes.
    Ellipsoid {
        /// Half its length, width and height, m.
        half: [f64; 3],
    },
}

impl Shape {
    /// The distance of its farthest point from the origin, m; infinite for a plane.
    pub(super) fn reach(&self) -> f64 {
        match *self {
            Self::Plane { .. } => f64::INFINITY,
            Self::Sphere { radius } => radius,
            Self::Box { half } => DVec3::from(half).length(),
            Self::Frustum { radii: [low, high], half } => libm::hypot(low.max(high), half),
            Self::Capsule { radius, half } => radius + half,
            Self::Ellipsoid { half } => DVec3::from(half).max_element(),
        }
    }

    /// How far the shape reaches below the position of `pose`, m; 0 for a plane.
    pub(super) fn depth_below(&self, pose: &Pose) -> f64 {
        match *self {
            Self::Plane { .. } => 0.0,
            Self::Sphere { radius } => radius,
            Self::Box { half } => {
                // The height of each half edge adds up in the lowest corner.
                let turned = pose.world_from_sensor();
                let edge = |axis: usize| turned.direction(DVec3::AXES[axis].to_array())[2].abs();
                (0..3).map(|axis| half[axis] * edge(axis)).sum()
            }
            Self::Frustum { radii: [low, high], half } => {
                // How steep the axis is, and how far the rim of an end reaches below its middle.
                let up = pose.world_from_sensor().direction([0.0, 0.0, 1.0])[2];
                let rim = (1.0 - up * up).max(0.0).sqrt();
                (half * up + low * rim).max(high * rim - half * up)
            }
            Self::Capsule { radius, half } => {
                radius + half * pose.world_from_sensor().direction([0.0, 0.0, 1.0])[2].abs()
            }
            Self::Ellipsoid { half } => {
                (pose.world_from_sensor().rotation().row(2) * DVec3::from(half)).length()
            }
        }
    }

    /// Returns true if a point in the frame of the shape lies inside. Nothing lies inside a plane.
    pub(super) fn holds(&self, point: DVec3) -> bool {
        let beside = libm::hypot(point.x, point.y);
        match *self {
            Self::Plane { .. } => false,
            Self::Sphere { radius } => point.length() < radius,
            Self::Box { half } => point.abs().cmplt(DVec3::from(half)).all(),
            Self::Frustum { radii: [low, high], half } => {
                let share = (point.z / half + 1.0) / 2.0;
                point.z.abs() < half && beside < low + share * (high - low)
            }
            Self::Capsule { radius, half } => {
                libm::hypot(beside, (point.z.abs() - half).max(0.0)) < radius
            }
            Self::Ellipsoid { half } => (point / DVec3::from(half)).length() < 1.0,
        }
    }

    /// The normal, of any length, at a point of a curved face.
    fn curved(&self, point: DVec3) -> DVec3 {
        match *self {
            Self::Frustum { radii: [low, high], half } => {
                // Outward by 1, and up by as much as the side leans in.
                let beside = libm::hypot(point.x, point.y);
                DVec3::new(point.x, point.y, beside * (low - high) / (2.0 * half))
            }
            Self::Capsule { half, .. } => {
                DVec3::new(point.x, point.y, point.z - point.z.clamp(-half, half))
            }
            Self::Ellipsoid { half } => point / (DVec3::from(half) * DVec3::from(half)),
            Self::Sphere { .. } | Self::Plane { .. } | Self::Box { .. } => point,
        }
    }
}

/// A shape that stands in the world, made of something.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    shape: Shape,
    pose: Pose,
    to_world: Transform,
    from_world: Transform,
    /// Normal of each face, in the world.
    normals: [[f64; 3]; 6],
    material: u16,
    object: u16,
}

impl Solid {
    /// `shape` at `pose`; `material` and `object` are indices into the scene's lists.
    pub fn new(shape: Shape, pose: Pose, material: u16, object: u16) -> Self {
        let to_world = pose.world_from_sensor();
        let from_world = to_world.inverse();
        let normals = std::array::from_fn(|face| {
            let outward = DVec3::AXES[face / 2] * if face % 2 == 1 { 1.0 } else { -1.0 };
            to_world.direction(match shape {
                Shape::Plane { normal } => normal,
                _ => outward.to_array(),
            })
        });
        Self { shape, pose, to_world, from_world, normals, material, object }
    }

    /// The shape.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Its pose.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Index into the scene's materials.
    pub fn material(&self) -> u16 {
        self.material
    }

    /// Index into the scene's objects.
    pub fn object(&self) -> u16 {
        self.object
    }
}

impl Solid {
    fn form(&self) -> Form {
        match self.shape {
            Shape::Plane { normal } => Form::Plane(normal),
            Shape::Sphere { radius } => Form::Sphere(radius),
            Shape::Box { half } => Form::Box(half),
            Shape::Frustum { radii: [low, high], half } => {
                let (middle, slope) = ((low + high) / 2.0, (high - low) / (2.0 * half));
                Form::Frustum(Frustum { middle, slope, half })
            }
            Shape::Capsule { radius, half } => Form::Capsule([radius, half]),
            Shape::Ellipsoid { half } => Form::Ellipsoid(half),
        }
    }

    /// Half the size of an upright box about the position that holds the solid; `None` for a
    /// plane, which nothing holds.
    pub(super) fn half_extent(&self) -> Option<DVec3> {
        match self.shape {
            Shape::Plane { .. } => None,
            Shape::Sphere { radius } => Some(DVec3::splat(radius)),
            Shape::Box { half } => Some(self.to_world.rotation().abs() * DVec3::from(half)),
            Shape::Frustum { radii: [low, high], half } => {
                let across = DVec3::new(1.0, 1.0, 0.0) * low.max(high);
                Some(self.along(half).abs() + self.reach_of(across))
            }
            Shape::Capsule { radius, half } => Some(self.along(half).abs() + DVec3::splat(radius)),
            Shape::Ellipsoid { half } => Some(self.reach_of(DVec3::from(half))),
        }
    }

    /// From the middle so far along the z axis of the solid, in the world.
    fn along(&self, distance: f64) -> DVec3 {
        DVec3::from(self.to_world.direction([0.0, 0.0, distance]))
    }

    /// How far an ellipsoid with these half axes, in the frame of the solid, reaches along each axis
    /// of the world.
    fn reach_of(&self, half: DVec3) -> DVec3 {
        let rotation = self.to_world.rotation();
        let axis = |axis: usize| (rotation.row(axis) * half).length();
        DVec3::new(axis(0), axis(1), axis(2))
    }

    /// The unit normal in the world where a ray has met `face` at `range`.
    #[inline(always)]
    fn normal(&self, ray: &Ray, (range, face): (f64, u32)) -> [f64; 3] {
        if face != CURVED {
            return self.normals[face as usize];
        }
        let origin = DVec3::from(self.from_world.point(ray.origin));
        let along = DVec3::from(self.from_world.direction(ray.direction));
        let point = origin + along * range;
        let normal = match self.shape {
            Shape::Sphere { radius } => point / radius,
            // The tip of a cone looks up.
            shape => shape.curved(point).normalize_or(DVec3::Z),
        };
        self.to_world.direction(normal.to_array())
    }

    /// The hit of a ray that has met `face` at `range`.
    #[inline(always)]
    pub(super) fn hit(&self, ray: &Ray, (range, face): (f64, u32)) -> Hit {
        let normal = self.normal(ray, (range, face));
        Hit { range, normal, material: self.material, object: self.object }
    }

    /// Returns the ranges at which the rays of `packet` meet the solid before `limit`, and its faces; NaN for
    /// rays that do not.
    pub(super) fn meet_packet(
        &self,
        packet: &Packet,
        limit: &Lanes<f64>,
    ) -> (Lanes<f64>, Lanes<u32>) {
        let origin = DVec3::from(self.from_world.point(packet.origin));
        meet_packet(&self.form(), self.from_world.rotation(), origin, packet, limit)
    }
}

impl CastRays for Solid {
    fn cast(&self, ray: &Ray, nearest: f64, farthest: f64) -> Option<Hit> {
        let origin = DVec3::from(self.from_world.point(ray.origin));
        let along = DVec3::from(self.from_world.direction(ray.direction));
        let met = meet(&self.form(), (origin, along), (nearest, farthest))?;
        Some(self.hit(ray, met))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cast(shape: Shape, position: [f64; 3], direction: [f64; 3]) -> Option<Hit> {
        let ray = Ray { origin: [0.0; 3], direction };
        Solid::new(shape, Pose::at(position), 3, 5).cast(&ray, 0.0, 1e3)
    }

    #[test]
    fn each_shape_is_met_where_it_stands() {
        let x = [1.0, 0.0, 0.0];
        let hit = cast(Shape::Plane { normal: [-1.0, 0.0, 0.0] }, [50.0, 0.0, 0.0], x).unwrap();
        assert_eq!(hit, Hit { range: 50.0, normal: [-1.0, 0.0, 0.0], material: 3, object: 5 });
        let hit = cast(Shape::Sphere { radius: 2.0 }, [50.0, 0.0, 0.0], x).unwrap();
        assert_eq!((hit.range, hit.normal), (48.0, [-1.0, 0.0, 0.0]));
        let hit = cast(Shape::Box { half: [1.0, 2.0, 3.0] }, [50.0, 1.5, 0.0], x).unwrap();
        assert_eq!((hit.range, hit.normal), (49.0, [-1.0, 0.0, 0.0]));
    }

    #[test]
    fn from_inside_the_far_side_is_met() {
        let x = [1.0, 0.0, 0.0];
        assert_eq!(cast(Shape::Sphere { radius: 2.0 }, [0.5, 0.0, 0.0], x).unwrap().range, 2.5);
        assert_eq!(cast(Shape::Box { half: [1.0; 3] }, [0.0; 3], x).unwrap().range, 1.0);
    }

    #[test]
    fn what_is_beside_behind_or_parallel_is_missed() {
        let x = [1.0, 0.0, 0.0];
        let sphere = Shape::Sphere { radius: 2.0 };
        assert_eq!(cast(sphere, [50.0, 2.1, 0.0], x), None);
        assert_eq!(cast(sphere, [-50.0, 0.0, 0.0], x), None);
        assert_eq!(cast(Shape::Box { half: [1.0; 3] }, [50.0, 1.1, 0.0], x), None);
        assert_eq!(cast(Shape::Plane { normal: [0.0, 0.0, 1.0] }, [0.0, 0.0, -2.0], x), None);
        assert_eq!(cast(sphere, [50.0, 0.0, 0.0], [f64::NAN; 3]), None);
    }
}
