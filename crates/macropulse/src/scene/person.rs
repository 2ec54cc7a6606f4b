//! A person, standing: balls, rounded poles and ellipsoids in the proportions of an adult.
//!
//! Heights of hip, shoulder and chin, breadths of hip and shoulder, and the length of an arm are shares of
//! the stature \[DC66\]. The thickness of each part is our own choice.

use std::ops::RangeInclusive;

use super::closed_form::Shape;
use super::pose::Pose;

/// Statures that are simulated, m.
pub(super) const HEIGHTS: RangeInclusive<f64> = 0.4..=2.6;

/// A part of a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    pub shape: Shape,
    /// Position of its middle in the frame of the object, m.
    pub at: [f64; 3],
    /// The material of the library it is made of, where the file names none.
    pub material: Option<&'static str>,
}

impl Part {
    /// Returns its pose in the world if the object is at `pose`.
    pub(super) fn pose(&self, pose: &Pose) -> Pose {
        if self.at == [0.0; 3] {
            return *pose;
        }
        Pose { position: pose.world_from_sensor().point(self.at), ..*pose }
    }

    /// How far it reaches below the position of its object at `pose`, m.
    pub(super) fn depth_below(&self, pose: &Pose) -> f64 {
        let above = self.pose(pose).position[2] - pose.position[2];
        self.shape.depth_below(pose) - above
    }
}

/// Shares of the stature.
const HIP: f64 = 0.530;
const SHOULDER: f64 = 0.818;
const CHIN: f64 = 0.870;
/// From shoulder to finger tips: upper arm, forearm, hand.
const ARM: f64 = 0.186 + 0.146 + 0.108;
/// Half of the breadth of hips and shoulders.
const HALF_HIPS: f64 = 0.191 / 2.0;
const HALF_SHOULDERS: f64 = 0.259 / 2.0;

/// The parts of a person of this stature, m, who stands at the origin and looks along x.
pub(super) fn parts(height: f64) -> Vec<Part> {
    let metres = |share: f64| share * height;
    let part = |shape: Shape, [across, up]: [f64; 2], material| Part {
        shape,
        at: [0.0, metres(across), metres(up)],
        material: Some(material),
    };
    // An upright pole of this radius between two heights.
    let pole = |radius: f64, [from, to]: [f64; 2], across: f64, material| {
        let half = metres((to - from) / 2.0 - radius);
        let shape = Shape::Capsule { radius: metres(radius), half };
        part(shape, [across, (from + to) / 2.0], material)
    };
    let egg = |half: [f64; 3], up: f64, material| {
        part(Shape::Ellipsoid { half: half.map(metres) }, [0.0, up], material)
    };
    let leg = |side: f64| pole(0.045, [0.0, HIP], side * (HALF_HIPS - 0.045), CLOTHES);
    let arm = |side: f64| pole(0.03, [SHOULDER - ARM, SHOULDER], side * HALF_SHOULDERS, CLOTHES);
    let trunk = (HIP - 0.04 + SHOULDER) / 2.0;
    vec![
        leg(1.0),
        leg(-1.0),
        egg([0.072, HALF_SHOULDERS, SHOULDER - trunk + 0.01], trunk, CLOTHES),
        arm(1.0),
        arm(-1.0),
        pole(0.035, [SHOULDER - 0.05, CHIN + 0.05], 0.0, SKIN),
        egg([0.058, 0.046, (1.0 - CHIN) / 2.0], (1.0 + CHIN) / 2.0, SKIN),
    ]
}

const CLOTHES: &str = "fabric";
const SKIN: &str = "skin";

#[cfg(test)]
mod tests {
    use super::*;

    /// From the soles to the crown it is the stature, and no part hangs in the air.
    #[test]
    fn a_person_is_as_tall_as_typed_and_of_one_piece() {
        for height in [0.4, 1.13, 1.75, 2.6] {
            let parts = parts(height);
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for part in &parts {
                let half = part.shape.depth_below(&Pose::default());
                low = low.min(part.at[2] - half);
                high = high.max(part.at[2] + half);
            }
            assert!(low.abs() < 1e-12 && (high - height).abs() < 1e-12, "{low} {high}");
            let inside = |point: [f64; 3]| {
                parts.iter().filter(move |part| {
                    let local = [0, 1, 2].map(|axis| point[axis] - part.at[axis]);
                    part.shape.holds(local.into())
                })
            };
            // Trunk and legs, trunk and arms, trunk and neck, neck and head.
            for (across, up) in [(0.05, 0.52), (0.12, 0.70), (0.0, 0.80), (0.0, 0.90)] {
                let shared = inside([0.0, across * height, up * height]).count();
                assert!(shared >= 2, "{across} {up}: {shared}");
            }
            // Between the legs there is air.
            assert_eq!(inside([0.0, 0.0, 0.2 * height]).count(), 0);
        }
    }
}
