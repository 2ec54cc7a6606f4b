//! The beam meets the scene: every shot becomes one or more rays, every ray its surfaces.
//!
//! 1. A beam without width is one ray. A beam with a width is a hexagonal set of rays, weighted
//!    by the Gaussian irradiance at their place. A pixel of a flash gathers the light of its cell evenly
//!    (docs/physics.md#footprint).
//! 2. If the mirror moves during a macropulse, the macropulse is cut into sub-macropulses that leave in
//!    different directions: each has rays of its own (docs/physics.md#mirror-motion).
//! 3. A ray that meets glass leaves an echo there and goes on, weakened twice: on its way out and
//!    on its way back. The glass does not bend it.
//! 4. If beams begin beside the origin of the sensor, so do their rays.
//! 5. If something moves, all rays of a shot are cast at the time at which it is fired.

use super::batch::Batch;
use super::coherence;
use super::{Hits, Scene};
use crate::design::Design;
use crate::emit::beam_axes;
use macropulse_codec::ShotLog;

impl Scene {
    /// Returns the hits of the shots of `log` when they are fired, as far as light is followed, in the order
    /// of the log. Ranges are counted from the position of the sensor at that time.
    pub fn trace(&self, design: &Design, log: &ShotLog) -> Traced {
        let directions = design.directions();
        let along = |shot: usize| directions.of_shot(log, shot);
        let mut middle = self.trace_along(design, log, along);
        if design.emission.model().sees_motion() {
            middle.radial_velocity = self.radial_velocities(design, log, &middle);
        }
        if !design.scan.moves {
            return Traced { middle, sub_macropulses: Vec::new() };
        }
        let mirror = Mirror { design, log };
        let hits = |sub| self.trace_along(design, log, |shot| mirror.axis(shot, sub));
        Traced { middle, sub_macropulses: (0..SUB_MACROPULSES).map(hits).collect() }
    }

    fn trace_along(
        &self,
        design: &Design,
        log: &ShotLog,
        axis: impl Fn(usize) -> [f64; 3],
    ) -> Hits {
        let footprint = Footprint::of(design);
        // If the sensor moves, each shot has a place of its own, and no neighbours.
        let apart = design.directions().have_origins();
        let by_row = !self.sensor.moves()
            && (footprint.offsets.len() > 1 || self.world.is_fine() || apart)
            && !coherence::are_in_rows(&log.row);
        self.trace_with((design, log), &footprint, axis, by_row)
    }

    /// Returns the hits of all shots, in the order of the log. The shots are cast row by row if `by_row`,
    /// otherwise as they come.
    #[inline(always)]
    fn trace_with(
        &self,
        (design, log): (&Design, &ShotLog),
        footprint: &Footprint,
        axis: impl Fn(usize) -> [f64; 3],
        by_row: bool,
    ) -> Hits {
        let order = if by_row { coherence::order_of_rows(&log.row) } else { Vec::new() };
        let mut batch = Batch::new(self, design.scan.light_range);
        let directions = design.directions();
        for place in 0..log.len() {
            let shot = order.get(place).map_or(place, |shot| *shot as usize);
            batch.leave_at(log.fired_at_fs[shot]);
            if directions.have_origins() {
                batch.begin_at(directions.origin(log.row[shot], log.column[shot]));
            }
            footprint.rays(axis(shot), |aim, weight| batch.add(shot as u32, weight, aim));
        }
        let hits = batch.finish();
        if by_row { hits.by_shot(log.len()) } else { hits }
    }
}

/// Hits of the shots of a log.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Traced {
    /// Hits in the direction of each pixel. If the mirror stands still for a macropulse, its light comes from
    /// them. If it moves, they are the truth to judge points by.
    pub middle: Hits,
    /// Hits of each of the [`SUB_MACROPULSES`] in the order in which they are sent; empty if the mirror
    /// stands still.
    pub sub_macropulses: Vec<Hits>,
}

/// Sub-macropulses of a macropulse: equal parts of it in time that leave in directions of their own
/// where the mirror moves.
pub const SUB_MACROPULSES: u8 = 8;

/// Direction of the beam while the mirror moves on.
struct Mirror<'a> {
    design: &'a Design,
    log: &'a ShotLog,
}

impl Mirror<'_> {
    /// The direction in which the middle of sub-macropulse `sub` of `shot` leaves. The middle of the macropulse
    /// leaves towards the pixel; from there to the next pixel of the line the mirror takes the time
    /// from shot to shot.
    fn axis(&self, shot: usize, sub: u8) -> [f64; 3] {
        let log = self.log;
        let directions = self.design.directions();
        let of = |shot: usize| directions.of(log.row[shot], log.column[shot]);
        let axis = of(shot);
        let in_line = |other: &usize| *other < log.len() && log.row[*other] == log.row[shot];
        // Beams side by side fire in turn. The last pixel of a line moves on as it came.
        let beams = self.design.channels() as usize;
        let next = Some(shot + beams).filter(in_line);
        let before = shot.checked_sub(beams).filter(in_line);
        let Some(other) = next.or(before) else { return axis };
        let macropulse = self.design.emission.length_fs();
        let apart = log.fired_at_fs[other] - log.fired_at_fs[shot];
        let after = (f64::from(sub) + 0.5) / f64::from(SUB_MACROPULSES) - 0.5;
        let pixels = after * macropulse as f64 / apart as f64;
        let there = of(other);
        let aim = [0, 1, 2].map(|i| axis[i] + pixels * (there[i] - axis[i]));
        let length = aim.iter().map(|along| along * along).sum::<f64>().sqrt();
        aim.map(|along| along / length)
    }
}

/// Offsets across the beam, as tangents, and the share of the energy each stands for. The first is its axis.
pub(super) struct Footprint {
    offsets: Vec<([f64; 2], f32)>,
    /// True if offsets to the left are of azimuth, which the cosine of the elevation makes narrower.
    is_cell: bool,
}

impl Footprint {
    /// The rays of a beam are one at the centre, six around it at half the 1/e² angle, and another twelve at the
    /// full 1/e² angle. Irradiance falls as exp(−2θ²/θ₀²). Those of a pixel of a flash are the middles of 3 × 3 or
    /// 5 × 5 equal parts of its cell.
    pub(super) fn of(design: &Design) -> Self {
        let count = design.light.footprint_rays;
        match design.scan.model().flooded_cell() {
            Some(cell) if count > 1 => Self::of_cell(cell, count),
            _ => Self::of_beam(design),
        }
    }

    fn of_cell([width, height]: [f64; 2], count: u32) -> Self {
        let side = count.isqrt();
        let weight = 1.0 / count as f32;
        let part = |at: u32| (f64::from(at) + 0.5) / f64::from(side) - 0.5;
        let offset = |at: u32| ([width * part(at % side), height * part(at / side)], weight);
        let mut offsets: Vec<_> = (0..count).map(offset).collect();
        offsets.swap(0, count as usize / 2);
        Self { offsets, is_cell: true }
    }

    fn of_beam(design: &Design) -> Self {
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
        Self { offsets, is_cell: false }
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
        let [x, y, z] = axis;
        let across = if self.is_cell { libm::hypot(x, y) } else { 1.0 };
        for &([a, b], weight) in around {
            let a = across * a;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Shots of a turning head meet the same laser by laser, with one ray or with seven, and are told
    /// in the order in which they are fired.
    #[test]
    fn shots_meet_the_same_in_whatever_order_they_are_cast() {
        let design = Design::open("hdl-64e", &[]).unwrap();
        let scene = Scene::open("street").unwrap();
        let log = crate::emit::Band { scan: 0, first: 64 * 2000, shots: 1000 }.shot_log(&design);
        assert!(!coherence::are_in_rows(&log.row));
        let axis = |shot: usize| design.directions().of(log.row[shot], log.column[shot]);
        let around = (0..7).map(|ray| ([1e-3 * f64::from(ray), -5e-4 * f64::from(ray)], 0.125));
        for offsets in [vec![([0.0, 0.0], 1.0)], around.collect()] {
            let footprint = Footprint { offsets, is_cell: false };
            let [as_they_come, by_row] = [false, true]
                .map(|by_row| scene.trace_with((&design, &log), &footprint, axis, by_row));
            assert!(by_row.shot.len() > 900 * footprint.offsets.len());
            assert_eq!(by_row, as_they_come);
        }
    }

    /// The rays of the nine pixels of a flash are the pixels of a flash with 15 rows and columns.
    #[test]
    fn a_pixel_of_a_flash_gathers_the_light_of_its_cell() {
        let rays_of = |set: &[(&str, &str)]| {
            let set: Vec<_> = set.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
            let design = Design::open("tmf8820", &set).unwrap();
            let (footprint, directions) = (Footprint::of(&design), design.directions());
            let mut rays = Vec::new();
            for row in 0..design.scan.rows as u16 {
                for column in 0..design.scan.columns as u16 {
                    let mut total = 0.0;
                    footprint.rays(directions.of(row, column), |ray, weight| {
                        rays.push(ray);
                        total += weight;
                    });
                    approx::assert_relative_eq!(total, 1.0, max_relative = 1e-6);
                }
            }
            rays
        };
        let cells = rays_of(&[]);
        let pixels = rays_of(&[
            ("scan.flash.rows", "15"),
            ("scan.flash.columns", "15"),
            ("without", "footprint"),
        ]);
        assert_eq!((cells.len(), pixels.len()), (225, 225));
        let apart = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>();
        for pixel in &pixels {
            let nearest = cells.iter().map(|cell| apart(cell, pixel).sqrt()).fold(1.0, f64::min);
            // A twentieth of the angle from ray to ray, because cells of 11 degrees are not flat.
            assert!(nearest < 0.05 * 0.0372, "{pixel:?}: {nearest}");
        }
    }

    /// The mirror moves by 0.67 pixel during a macropulse of the paper. An edge that crosses a pixel is met
    /// by some of its sub-macropulses, in the order in which they are sent.
    #[test]
    fn the_parts_of_a_macropulse_sweep_two_thirds_of_a_pixel() {
        let design = Design::open("kim-park-2016-physical", &[]).unwrap();
        let log = crate::emit::Band { scan: 0, first: 0, shots: 848 }.shot_log(&design);
        let mirror = Mirror { design: &design, log: &log };
        let pitch = (43.2_f64 / 848.0).to_radians();
        let shot = log.owned.start + 400;
        let [first, last] = [0, SUB_MACROPULSES - 1].map(|sub| mirror.axis(shot, sub));
        let angle =
            |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
        let swept =
            angle(first, last) * f64::from(SUB_MACROPULSES) / f64::from(SUB_MACROPULSES - 1);
        approx::assert_relative_eq!(swept / pitch, 0.6675, max_relative = 0.03);
        let pixel = design.directions().of(log.row[shot], log.column[shot]);
        approx::assert_relative_eq!(angle(first, pixel), angle(last, pixel), max_relative = 0.01);
        let next = design.directions().of(log.row[shot + 1], log.column[shot + 1]);
        assert!(angle(last, next) < angle(first, next), "it moves towards the next pixel");
        // The last pixel of a line has none after it.
        let end = log.owned.end - 1;
        assert!(angle(mirror.axis(end, 0), mirror.axis(end, SUB_MACROPULSES - 1)) > 0.5 * pitch);
    }
}
