//! The beam meets the scene: every shot becomes one or more rays, every ray its surfaces.
//!
//! 1. A beam without width is one ray. A beam with a width is a hexagonal set of rays, weighted
//!    by the Gaussian irradiance at their place (docs/physics.md#footprint).
//! 2. A ray that meets glass leaves an echo there and goes on, weakened twice: on its way out and
//!    on its way back. The glass does not bend it.

use super::batch::Batch;
use super::{Hits, Scene};
use crate::design::Design;
use crate::emit::{ShotLog, beam_axes};

impl Scene {
    /// What the shots of `log` meet within the range gate, in the order of the log.
    pub fn trace(&self, design: &Design, log: &ShotLog) -> Hits {
        let footprint = Footprint::of(design);
        let directions = design.directions();
        let mut batch = Batch::new(self, design.scan.max_range);
        for shot in 0..log.len() {
            let axis = directions.of(log.row[shot], log.column[shot]);
            footprint.rays(axis, |aim, weight| {
                batch.add(shot as u32, weight, aim);
            });
        }
        batch.finish()
    }
}

/// Offsets across the beam, as tangents, and the share of the energy each stands for.
pub(super) struct Footprint {
    offsets: Vec<([f64; 2], f32)>,
}

impl Footprint {
    /// One ray, or one at the centre and six around it at half the 1/e² angle, or another twelve
    /// at the full 1/e² angle. Irradiance falls as exp(−2θ²/θ₀²).
    pub(super) fn of(design: &Design) -> Self {
        let edge = design.light.divergence / 2.0;
        let rings = match design.light.footprint_rays {
            1 => 0,
            7 => 1,
            _ => 2,
        };
        let mut offsets = vec![([0.0, 0.0], 1.0)];
        for ring in 1..=rings {
            let radius = f64::from(ring) / f64::from(rings.max(2));
            let weight = libm::exp(-2.0 * radius * radius) as f32;
            for spoke in 0..6 * ring {
                let angle = std::f64::consts::TAU * f64::from(spoke) / f64::from(6 * ring);
                let (sin, cos) = (libm::sin(angle), libm::cos(angle));
                offsets.push(([edge * radius * cos, edge * radius * sin], weight));
            }
        }
        let total: f32 = offsets.iter().map(|(_, weight)| weight).sum();
        offsets.iter_mut().for_each(|(_, weight)| *weight /= total);
        Self { offsets }
    }

    /// Calls `cast` with the direction of each ray and its share of the energy.
    #[inline]
    pub(super) fn rays(&self, axis: [f64; 3], mut cast: impl FnMut([f64; 3], f32)) {
        let [(_, centre), around @ ..] = self.offsets.as_slice() else { return };
        cast(axis, *centre);
        if around.is_empty() {
            return;
        }
        let (left, up) = beam_axes(axis);
        for &([a, b], weight) in around {
            let [x, y, z] = axis;
            let aim = [
                x + a * left[0] + b * up[0],
                y + a * left[1] + b * up[1],
                z + a * left[2] + b * up[2],
            ];
            let length = (aim[0] * aim[0] + aim[1] * aim[1] + aim[2] * aim[2]).sqrt();
            cast([aim[0] / length, aim[1] / length, aim[2] / length], weight);
        }
    }
}
