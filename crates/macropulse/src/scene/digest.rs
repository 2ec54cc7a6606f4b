//! What of a scene goes into its digest: all that decides what light meets.

use super::closed_form::{Shape, Solid};
use super::pose::Pose;
use super::raycast::Facet;
use crate::digest::Fnv;

impl Fnv {
    /// Takes in a pose.
    pub(super) fn pose(&mut self, pose: &Pose) {
        let Pose { position: [x, y, z], yaw, pitch, roll } = *pose;
        for value in [x, y, z, yaw, pitch, roll] {
            self.number(value);
        }
    }

    /// Takes in a triangle.
    pub(super) fn facet(&mut self, facet: &Facet) {
        facet.corners.iter().flatten().for_each(|value| self.number(*value));
        self.bytes(&facet.material.to_le_bytes());
        self.bytes(&facet.object.to_le_bytes());
    }

    /// Takes in a shape.
    pub(super) fn solid(&mut self, solid: &Solid) {
        match solid.shape() {
            Shape::Plane { normal } => normal.iter().for_each(|value| self.number(*value)),
            Shape::Sphere { radius } => self.number(radius),
            Shape::Box { half } => half.iter().for_each(|value| self.number(*value)),
        }
        self.pose(&solid.pose());
        self.bytes(&solid.material().to_le_bytes());
        self.bytes(&solid.object().to_le_bytes());
    }
}
