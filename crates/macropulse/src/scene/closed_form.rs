//! Shapes whose intersection with a ray is a formula: walls and grounds of scenes, and the oracle
//! that triangle meshes are tested against.

use glam::DVec3;

use super::hits::{CastRays, Hit, Ray};
use super::pose::{Pose, Transform};

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
}

impl Shape {
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
    material: u16,
    object: u16,
}

impl Solid {
    /// `shape` at `pose`; `material` and `object` are indices into the scene's lists.
    pub fn new(shape: Shape, pose: Pose, material: u16, object: u16) -> Self {
        let to_world = pose.world_from_sensor();
        Self { shape, pose, to_world, from_world: to_world.inverse(), material, object }
    }

    /// The shape.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Where it stands.
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

impl CastRays for Solid {
    fn cast(&self, ray: &Ray, nearest: f64, farthest: f64) -> Option<Hit> {
        let origin = DVec3::from(self.from_world.point(ray.origin));
        let along = DVec3::from(self.from_world.direction(ray.direction));
        let crossings = match self.shape {
            Shape::Plane { normal } => plane(origin, along, DVec3::from(normal)),
            Shape::Sphere { radius } => sphere(origin, along, radius),
            Shape::Box { half } => cuboid(origin, along, DVec3::from(half)),
        };
        // Crossings come nearest first; comparisons are false for NaN.
        let (range, normal) =
            crossings.into_iter().flatten().find(|(t, _)| *t > nearest && *t < farthest)?;
        let normal = self.to_world.direction(normal.to_array());
        Some(Hit { range, normal, material: self.material, object: self.object })
    }
}

/// Where a line enters and where it leaves, each as distance and outward normal.
type Crossings = [Option<(f64, DVec3)>; 2];

/// `t = −n·o / n·d`.
fn plane(origin: DVec3, along: DVec3, normal: DVec3) -> Crossings {
    [Some((-normal.dot(origin) / normal.dot(along), normal)), None]
}

/// Half chord `h = √(r² − |o − (o·d) d|²)` about the point of closest approach: no cancellation,
/// however far the sphere is.
fn sphere(origin: DVec3, along: DVec3, radius: f64) -> Crossings {
    let closest = -origin.dot(along);
    let square = radius * radius - (origin + along * closest).length_squared();
    if square.is_nan() || square < 0.0 {
        return [None, None];
    }
    [closest - square.sqrt(), closest + square.sqrt()]
        .map(|t| Some((t, (origin + along * t) / radius)))
}

/// The latest entry and the earliest exit of three slabs.
fn cuboid(origin: DVec3, along: DVec3, half: DVec3) -> Crossings {
    let (mut enter, mut leave) = ((f64::NEG_INFINITY, DVec3::ZERO), (f64::INFINITY, DVec3::ZERO));
    for axis in 0..3 {
        if along[axis] == 0.0 {
            if origin[axis].abs() > half[axis] {
                return [None, None];
            }
            continue;
        }
        let outward = DVec3::AXES[axis] * along[axis].signum();
        let near = (-half[axis] * along[axis].signum() - origin[axis]) / along[axis];
        let far = (half[axis] * along[axis].signum() - origin[axis]) / along[axis];
        if near > enter.0 {
            enter = (near, -outward);
        }
        if far < leave.0 {
            leave = (far, outward);
        }
    }
    if enter.0 <= leave.0 { [Some(enter), Some(leave)] } else { [None, None] }
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
