//! Surfaces that move: kept apart from those that stand still, each in its own frame, and asked by
//! every ray at the time of its shot.

use std::sync::Arc;

use glam::DVec3;

use super::closed_form::Solid;
use super::hits::{CastRays, Hit, Ray};
use super::motion::Motion;
use super::pose::Pose;
use super::raycast::Facets;

/// The sphere about a mover is widened by this much, and by [`WIDER`] of its radius, m: more than
/// rounding can move a ray aside.
const WIDE: f64 = 0.01;
const WIDER: f64 = 0.001;

/// A body that moves.
pub(super) struct Mover {
    body: Body,
    motion: Motion,
    /// Nothing of the body is farther than this from its position, whichever way it has turned, m;
    /// infinite for a plane.
    reach: f64,
}

/// A body in its own frame.
enum Body {
    Shape(Box<Solid>),
    Mesh { model: Arc<Facets>, object: u16 },
}

/// A shape that stands upright in the frame of its object, and how that moves.
pub(super) struct MovingShape {
    pub solid: Solid,
    pub motion: Motion,
}

impl MovingShape {
    /// The shape where it is when the first scan begins.
    pub(super) fn at_first(&self) -> Solid {
        let Self { solid, motion } = self;
        let first = motion.at_start();
        let place = first.world_from_sensor();
        let pose = Pose { position: place.point(solid.pose().position), ..first };
        Solid::new(solid.shape(), pose, solid.material(), solid.object())
    }
}

impl Mover {
    /// Returns a mesh that moves. All of it lies within `reach` of the origin of its frame, m.
    pub(super) fn mesh((model, reach): (Arc<Facets>, f64), object: u16, motion: Motion) -> Self {
        Self { body: Body::Mesh { model, object }, motion, reach: reach * (1.0 + WIDER) + WIDE }
    }

    /// The mesh, if it is one; several may share it.
    pub(super) fn model(&self) -> Option<&Arc<Facets>> {
        match &self.body {
            Body::Shape(_) => None,
            Body::Mesh { model, .. } => Some(model),
        }
    }

    /// The object that it is of, and how it moves.
    pub(super) fn moves(&self) -> (u16, &Motion) {
        let object = match &self.body {
            Body::Shape(solid) => solid.object(),
            Body::Mesh { object, .. } => *object,
        };
        (object, &self.motion)
    }

    /// Number of triangles that can be hit.
    pub(super) fn triangles(&self) -> usize {
        match &self.body {
            Body::Shape(_) => 0,
            Body::Mesh { model, .. } => model.len(),
        }
    }

    /// Returns the hit of a ray, given in the world, on the body at `time_fs`, with a range in (`nearest`,
    /// `farthest`).
    pub(super) fn cast(
        &self,
        ray: &Ray,
        time_fs: i64,
        (nearest, farthest): (f64, f64),
    ) -> Option<Hit> {
        let pose = self.motion.at(time_fs);
        let direction = DVec3::from(ray.direction);
        let towards = DVec3::from(pose.position) - DVec3::from(ray.origin);
        let along = towards.dot(direction);
        let beside = (towards - along * direction).length_squared();
        let reach = self.reach;
        if beside > reach * reach || along + reach < nearest || along - reach > farthest {
            return None;
        }
        let to_world = pose.world_from_sensor();
        let from_world = to_world.inverse();
        let local = Ray {
            origin: from_world.point(ray.origin),
            direction: from_world.direction(ray.direction),
        };
        // A rigid map keeps ranges.
        let hit = match &self.body {
            Body::Shape(solid) => solid.cast(&local, nearest, farthest)?,
            Body::Mesh { model, object } => {
                Hit { object: *object, ..model.cast(&local, nearest, farthest)? }
            }
        };
        Some(Hit { normal: to_world.direction(hit.normal), ..hit })
    }
}

impl From<MovingShape> for Mover {
    fn from(MovingShape { solid, motion }: MovingShape) -> Self {
        let beside = DVec3::from(solid.pose().position).length();
        let reach = (solid.shape().reach() + beside) * (1.0 + WIDER) + WIDE;
        Self { body: Body::Shape(Box::new(solid)), motion, reach }
    }
}

#[cfg(test)]
mod tests {
    use super::super::closed_form::Shape;
    use super::*;
    use crate::units::FS_PER_S;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn mover(shape: Shape, motion: Motion) -> Mover {
        MovingShape { solid: Solid::new(shape, Pose::default(), 3, 5), motion }.into()
    }

    /// Known answer: at each time a mover is met as a shape that stands where it is then.
    #[test]
    fn a_mover_is_met_where_it_is_at_the_time() {
        let mut chance = ChaCha8Rng::seed_from_u64(41);
        let pose = Pose::turned([20.0, -3.0, 1.0], [0.3, 0.2, -0.4]);
        let motion = Motion::steady(pose, [2.0, 5.0, -1.0], 2.5);
        let shapes = [
            Shape::Box { half: [3.0, 1.0, 0.5] },
            Shape::Sphere { radius: 2.0 },
            Shape::Plane { normal: [0.0, 0.0, 1.0] },
        ];
        let mut met = 0;
        for round in 0..30_000 {
            let shape = shapes[round % 3];
            let time_fs = (chance.random_range(0.0..2.0) * FS_PER_S as f64) as i64;
            let still = Solid::new(shape, motion.at(time_fs), 3, 5);
            let beside = DVec3::from([0; 3].map(|_| chance.random_range(-3.0..3.0)));
            let origin = [0; 3].map(|_| chance.random_range(-9.0..9.0));
            let aim = DVec3::from(motion.at(time_fs).position) + beside - DVec3::from(origin);
            let ray = Ray { origin, direction: aim.normalize().to_array() };
            let [one, other] = [
                mover(shape, motion.clone()).cast(&ray, time_fs, (0.0, 1e3)),
                still.cast(&ray, 0.0, 1e3),
            ];
            assert_eq!(one.is_some(), other.is_some());
            let (Some(one), Some(other)) = (one, other) else { continue };
            met += 1;
            assert!((one.range - other.range).abs() < 1e-9, "{one:?} {other:?}");
            assert!(DVec3::from(one.normal).distance(DVec3::from(other.normal)) < 1e-9);
            assert_eq!((one.material, one.object), (3, 5));
        }
        assert!(met > 15_000, "{met}");
    }

    #[test]
    fn what_lies_outside_the_asked_ranges_is_not_met() {
        let ball = mover(Shape::Sphere { radius: 1.0 }, Motion::Still(Pose::at([10.0, 0.0, 0.0])));
        let ray = Ray { origin: [0.0; 3], direction: [1.0, 0.0, 0.0] };
        let range = |from, to| ball.cast(&ray, 0, (from, to)).map(|hit| hit.range);
        assert_eq!(range(0.0, 100.0), Some(9.0));
        assert_eq!(range(9.5, 100.0), Some(11.0));
        assert_eq!((range(11.5, 100.0), range(0.0, 8.5)), (None, None));
    }
}
