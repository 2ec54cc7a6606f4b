//! A hash of a scene, so that a manifest can say which one it was.

use super::closed_form::{Shape, Solid};
use super::pose::Pose;
use super::raycast::Facet;

/// The 64-bit FNV-1a hash \[FNV\] under way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fnv(u64);

impl Fnv {
    /// The hash of nothing.
    pub(super) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Takes in some bytes.
    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// Takes in a number, to its last bit.
    pub(super) fn number(&mut self, value: f64) {
        self.bytes(&value.to_bits().to_le_bytes());
    }

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

    /// The hash as sixteen hexadecimal digits.
    pub(super) fn text(self) -> String {
        format!("{:016x}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(bytes: &[u8]) -> String {
        let mut hash = Fnv::new();
        hash.bytes(bytes);
        hash.text()
    }

    #[test]
    fn the_published_values_come_out() {
        assert_eq!(of(b""), "cbf29ce484222325");
        assert_eq!(of(b"a"), "af63dc4c8601ec8c");
        assert_eq!(of(b"foobar"), "85944171f73967e8");
    }

    #[test]
    fn one_bit_of_one_number_counts() {
        let hash = |value: f64| {
            let mut hash = Fnv::new();
            hash.number(value);
            hash
        };
        assert_ne!(hash(1.0), hash(1.0 + f64::EPSILON));
        assert_eq!(hash(1.0), hash(1.0));
    }
}
