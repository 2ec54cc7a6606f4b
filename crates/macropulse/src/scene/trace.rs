//! The beam meets the scene: every shot becomes one or more rays, every ray its surfaces.
//!
//! 1. A beam without width is one ray. A beam with a width is a hexagonal set of rays, weighted
//!    by the Gaussian irradiance at their place (docs/physics.md#footprint).
//! 2. A ray that meets glass leaves an echo there and goes on, weakened twice: on its way out and
//!    on its way back. The glass does not bend it.

use super::{Hit, Hits, Ray, Scene};
use crate::design::Design;
use crate::emit::{ShotLog, beam_axes};

/// Panes a ray is followed through.
const PANES: usize = 6;

/// A ray goes on this far behind the pane it has met, m.
const BEHIND: f64 = 1e-4;

/// Light weaker than this fraction of the shot is not followed further.
const FAINTEST: f32 = 1e-4;

impl Scene {
    /// What the shots of `log` meet within the range gate, in the order of the log.
    pub fn trace(&self, design: &Design, log: &ShotLog) -> Hits {
        let footprint = Footprint::of(design);
        let world_from_sensor = self.sensor.world_from_sensor();
        let directions = design.directions();
        let mut hits = Hits::default();
        for shot in 0..log.len() {
            let axis = directions.of(log.row[shot], log.column[shot]);
            for (aim, weight) in footprint.rays(axis) {
                let ray = Ray {
                    origin: self.sensor.position,
                    direction: world_from_sensor.direction(aim),
                };
                self.follow(ray, design.scan.max_range, |hit, transmitted| {
                    hits.shot.push(shot as u32);
                    hits.weight.push(weight * transmitted);
                    hits.range.push(hit.range);
                    hits.cosine.push(cosine(&ray, hit));
                    hits.material.push(hit.material);
                    hits.object.push(hit.object);
                });
            }
        }
        hits
    }

    /// Calls `meet` with every surface along `ray` and the two-way transmission before it.
    fn follow(&self, ray: Ray, farthest: f64, mut meet: impl FnMut(&Hit, f32)) {
        let mut nearest = 0.0;
        let mut transmitted = 1.0_f32;
        for _ in 0..PANES {
            let Some(hit) = self.cast(&ray, nearest, farthest) else { return };
            meet(&hit, transmitted);
            let through = self.materials[usize::from(hit.material)].transmission as f32;
            transmitted *= through * through;
            if transmitted < FAINTEST {
                return;
            }
            nearest = hit.range + BEHIND;
        }
    }
}

fn cosine(ray: &Ray, hit: &Hit) -> f32 {
    let dot: f64 = ray.direction.iter().zip(hit.normal).map(|(d, n)| d * n).sum();
    dot.abs().min(1.0) as f32
}

/// Offsets across the beam, as tangents, and the share of the energy each stands for.
struct Footprint {
    offsets: Vec<([f64; 2], f32)>,
}

impl Footprint {
    /// One ray, or one at the centre and six around it at half the 1/e² angle, or another twelve
    /// at the full 1/e² angle. Irradiance falls as exp(−2θ²/θ₀²).
    fn of(design: &Design) -> Self {
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

    fn rays(&self, axis: [f64; 3]) -> impl Iterator<Item = ([f64; 3], f32)> {
        let (left, up) = beam_axes(axis);
        self.offsets.iter().map(move |&([a, b], weight)| {
            if a == 0.0 && b == 0.0 {
                return (axis, weight);
            }
            let aim: [f64; 3] = std::array::from_fn(|i| axis[i] + a * left[i] + b * up[i]);
            let length = aim.iter().map(|v| v * v).sum::<f64>().sqrt();
            (aim.map(|v| v / length), weight)
        })
    }
}
