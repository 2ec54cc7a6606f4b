//! Shapes whose intersection with a ray is a formula, for one ray or for a packet.

use glam::{DMat3, DVec3};

use super::packet::{Lanes, Packet};
use super::wide::LANES;
use macropulse_codec::on_every_level;

/// Where a line enters a shape and where it leaves, as distances, nearest first; NaN or infinite
/// if it does not. Beside each the face: 0…5 of a box (twice the axis, one more for the side of
/// larger coordinates), anything for other shapes.
pub(crate) type Crossings = [(f64, u32); 2];

/// A shape about the origin of its own frame.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Form {
    /// The unbounded plane with this unit normal.
    Plane([f64; 3]),
    /// A sphere with this radius.
    Sphere(f64),
    /// A box with these half edges, along the axes.
    Box([f64; 3]),
}

/// `t = −n·o / n·d`.
#[inline(always)]
fn plane(origin: DVec3, along: DVec3, normal: DVec3) -> Crossings {
    let range = -normal.dot(origin) / normal.dot(along);
    [(range, 0), (range, 0)]
}

/// Half chord `h = √(r² − |o − (o·d) d|²)` about the point of closest approach: no cancellation,
/// however far the sphere is.
#[inline(always)]
fn sphere(origin: DVec3, along: DVec3, radius: f64) -> Crossings {
    let closest = -origin.dot(along);
    let square = radius * radius - (origin + along * closest).length_squared();
    // The root of what is below zero is NaN.
    [(closest - square.sqrt(), 0), (closest + square.sqrt(), 0)]
}

/// The latest entry and the earliest exit of three slabs.
#[inline(always)]
fn cuboid(origin: DVec3, along: DVec3, half: DVec3) -> Crossings {
    let (mut enter, mut leave) = ((f64::NEG_INFINITY, 0), (f64::INFINITY, 0));
    for axis in 0..3 {
        let (start, slope, half) = (origin[axis], along[axis], half[axis]);
        let side = half.copysign(slope);
        let face = 2 * axis as u32;
        let ahead = u32::from(slope > 0.0);
        let level = slope == 0.0;
        // Along the slab: within it for ever, or never.
        let within = start.abs() <= half;
        let apart = if within { f64::NEG_INFINITY } else { f64::INFINITY };
        let near = if level { apart } else { (-side - start) / slope };
        let far = if level { -apart } else { (side - start) / slope };
        enter = if near > enter.0 { (near, face + 1 - ahead) } else { enter };
        leave = if far < leave.0 { (far, face + ahead) } else { leave };
    }
    let missed = enter.0 > leave.0;
    [
        (if missed { f64::NAN } else { enter.0 }, enter.1),
        (if missed { f64::NAN } else { leave.0 }, leave.1),
    ]
}

#[inline(always)]
fn crossings(form: &Form, origin: DVec3, along: DVec3) -> Crossings {
    match *form {
        Form::Plane(normal) => plane(origin, along, DVec3::from(normal)),
        Form::Sphere(radius) => sphere(origin, along, radius),
        Form::Box(half) => cuboid(origin, along, DVec3::from(half)),
    }
}

/// The nearest crossing with a range in (`nearest`, `farthest`); the range is NaN if there is none.
#[inline(always)]
fn first([enter, leave]: Crossings, nearest: f64, farthest: f64) -> (f64, u32) {
    let within = |range: f64| (range > nearest) & (range < farthest);
    if within(enter.0) {
        enter
    } else if within(leave.0) {
        leave
    } else {
        (f64::NAN, 0)
    }
}

/// Where one ray, in the frame of the shape, meets it.
pub(crate) fn meet(
    form: &Form,
    (origin, along): (DVec3, DVec3),
    (nearest, farthest): (f64, f64),
) -> Option<(f64, u32)> {
    let met = first(crossings(form, origin, along), nearest, farthest);
    (!met.0.is_nan()).then_some(met)
}

on_every_level! {
    /// Where the rays of a packet meet a shape before `limit`; NaN for those that do not.
    /// `origin` is that of the packet and `turn` carries its directions into the frame of the
    /// shape.
    pub(crate) fn meet_packet(
        form: &Form,
        turn: &DMat3,
        origin: DVec3,
        packet: &Packet,
        limit: &Lanes<f64>,
    ) -> (Lanes<f64>, Lanes<u32>) {
        let mut met = ([0.0; LANES], [0; LANES]);
        let [x, y, z] = &packet.direction;
        let nearest = &packet.nearest;
        // One loop for each form, so that no lane has to ask which it is.
        macro_rules! each {
            ($crossings:expr) => {
                for lane in 0..LANES {
                    let along = *turn * DVec3::new(x[lane], y[lane], z[lane]);
                    let (range, face) = first($crossings(along), nearest[lane], limit[lane]);
                    met.0[lane] = range;
                    met.1[lane] = face;
                }
            };
        }
        match *form {
            Form::Plane(normal) => each!(|along| plane(origin, along, DVec3::from(normal))),
            Form::Sphere(radius) => each!(|along| sphere(origin, along, radius)),
            Form::Box(half) => each!(|along| cuboid(origin, along, DVec3::from(half))),
        }
        met
    }
}

on_every_level! {
    /// The directions of a packet, turned.
    pub(crate) fn turned(turn: &DMat3, direction: &[Lanes<f64>; 3]) -> [Lanes<f64>; 3] {
        let [x, y, z] = direction;
        let mut result = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let along = *turn * DVec3::new(x[lane], y[lane], z[lane]);
            result[0][lane] = along.x;
            result[1][lane] = along.y;
            result[2][lane] = along.z;
        }
        result
    }
}
