//! Shapes whose intersection with a ray is a formula, for one ray or for a packet.

use glam::{DMat3, DVec3};

use super::packet::{Lanes, Packet};
use super::wide::LANES;
use macropulse_codec::on_every_level;

/// Distances at which a line enters and leaves a shape, nearest first; NaN or infinite if it does not. The
/// face stands beside each. A box has the faces 0…5 (twice the axis, one more for the side of larger
/// coordinates), so the ends of a frustum are 4 and 5. A plane is 0, and [`CURVED`] is a face whose normal
/// follows from the place.
pub(crate) type Crossings = [(f64, u32); 2];

/// The face of a shape whose normal follows from the place.
pub(crate) const CURVED: u32 = 6;

/// A shape about the origin of its own frame.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Form {
    /// The unbounded plane with this unit normal.
    Plane([f64; 3]),
    /// A sphere with this radius.
    Sphere(f64),
    /// A box with these half edges, along the axes.
    Box([f64; 3]),
    /// A cylinder or a cone along z, cut square at both ends.
    Frustum(Frustum),
    /// All points within a radius of a piece of the z axis: the radius, and half the length of the piece.
    Capsule([f64; 2]),
    /// An ellipsoid with these half axes, along the axes.
    Ellipsoid([f64; 3]),
}

/// All points no farther from the z axis than `middle` + `slope`·z, and −`half` ≤ z ≤ `half`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frustum {
    pub middle: f64,
    pub slope: f64,
    pub half: f64,
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
    [(closest - square.sqrt(), CURVED), (closest + square.sqrt(), CURVED)]
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

/// The common part of two stretches of a line; if two crossings are equal, that of `ends` wins.
#[inline(always)]
fn both(side: Crossings, ends: Crossings) -> Crossings {
    let enter = if side[0].0 > ends[0].0 { side[0] } else { ends[0] };
    let leave = if side[1].0 < ends[1].0 { side[1] } else { ends[1] };
    // Comparisons with NaN fail: a side that is missed has to be asked for.
    let missed = side[0].0.is_nan() || ends[0].0.is_nan() || enter.0 > leave.0;
    if missed { MISSED } else { [enter, leave] }
}

const MISSED: Crossings = [(f64::NAN, 0), (f64::NAN, 0)];

/// The stretch between the planes z = ±half.
#[inline(always)]
fn slab(start: f64, slope: f64, half: f64) -> Crossings {
    if slope == 0.0 {
        let within = start.abs() <= half;
        return if within { [(f64::NEG_INFINITY, 4), (f64::INFINITY, 5)] } else { MISSED };
    }
    let [low, high] = [(-half - start) / slope, (half - start) / slope];
    if slope > 0.0 { [(low, 4), (high, 5)] } else { [(high, 5), (low, 4)] }
}

/// The common stretch of the slab and of the points within the side, x² + y² ≤ (m + k·z)² with m + k·z ≥ 0.
/// First o is moved to the point of the line nearest to the middle, so that nothing cancels however far the
/// shape is. A point lies within the side if
///
/// a·t² + 2b·t + c ≤ 0, a = d_x² + d_y² − k²·d_z², b = o_x·d_x + o_y·d_y − k·d_z·R, c = o_x² + o_y² − R²
///
/// with R = m + k·o_z. If a < 0, the line runs more steeply than the side, and one of the two nappes of the
/// cone counts.
#[inline(always)]
fn frustum(origin: DVec3, along: DVec3, shape: &Frustum) -> Crossings {
    let Frustum { middle, slope, half } = *shape;
    let closest = -origin.dot(along);
    let o = origin + along * closest;
    let radius = middle + slope * o.z;
    let widens = slope * along.z;
    let a = along.x * along.x + along.y * along.y - widens * widens;
    let b = o.x * along.x + o.y * along.y - widens * radius;
    let c = o.x * o.x + o.y * o.y - radius * radius;
    let square = b * b - a * c;
    let side = if a == 0.0 && b == 0.0 {
        // Along the axis of a cylinder: within it for ever, or never.
        if c <= 0.0 { (f64::NEG_INFINITY, f64::INFINITY) } else { (f64::NAN, f64::NAN) }
    } else {
        let far = -(b + square.sqrt().copysign(b));
        let (one, other) = (far / a, c / far);
        // If a is 0, one of them is infinite, on the side on which the line stays within.
        match (a > 0.0, widens > 0.0) {
            (true, _) => (one.min(other), one.max(other)),
            (false, true) if a == 0.0 => (other, f64::INFINITY),
            (false, false) if a == 0.0 => (f64::NEG_INFINITY, other),
            (false, true) => (one.max(other), f64::INFINITY),
            (false, false) => (f64::NEG_INFINITY, one.min(other)),
        }
    };
    let side = if square < 0.0 { (f64::NAN, f64::NAN) } else { side };
    let ends = slab(o.z, along.z, half);
    let met = both([(side.0, CURVED), (side.1, CURVED)], ends);
    [(met[0].0 + closest, met[0].1), (met[1].0 + closest, met[1].1)]
}

/// The first entry and the last exit of a cylinder and of the balls at its ends: together they are
/// convex.
#[inline(always)]
fn capsule(origin: DVec3, along: DVec3, [radius, half]: [f64; 2]) -> Crossings {
    let end = DVec3::new(0.0, 0.0, half);
    let tube = frustum(origin, along, &Frustum { middle: radius, slope: 0.0, half });
    let balls = [sphere(origin - end, along, radius), sphere(origin + end, along, radius)];
    // Least and greatest of numbers leave NaN out.
    let enter = tube[0].0.min(balls[0][0].0).min(balls[1][0].0);
    let leave = tube[1].0.max(balls[0][1].0).max(balls[1][1].0);
    [(enter, CURVED), (leave, CURVED)]
}

/// The ball of radius 1 that it becomes when each axis is measured by its half.
#[inline(always)]
fn ellipsoid(origin: DVec3, along: DVec3, half: DVec3) -> Crossings {
    let (o, d) = (origin / half, along / half);
    let length = d.length_squared();
    let closest = -o.dot(d) / length;
    let square = 1.0 - (o + d * closest).length_squared();
    let chord = (square / length).sqrt();
    [(closest - chord, CURVED), (closest + chord, CURVED)]
}

#[inline(always)]
fn crossings(form: &Form, origin: DVec3, along: DVec3) -> Crossings {
    match *form {
        Form::Plane(normal) => plane(origin, along, DVec3::from(normal)),
        Form::Sphere(radius) => sphere(origin, along, radius),
        Form::Box(half) => cuboid(origin, along, DVec3::from(half)),
        Form::Frustum(shape) => frustum(origin, along, &shape),
        Form::Capsule(shape) => capsule(origin, along, shape),
        Form::Ellipsoid(half) => ellipsoid(origin, along, DVec3::from(half)),
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

/// Returns the range at which one ray, in the frame of the shape, meets it, and the face.
pub(crate) fn meet(
    form: &Form,
    (origin, along): (DVec3, DVec3),
    (nearest, farthest): (f64, f64),
) -> Option<(f64, u32)> {
    let met = first(crossings(form, origin, along), nearest, farthest);
    (!met.0.is_nan()).then_some(met)
}

on_every_level! {
    /// Returns the ranges at which the rays of a packet meet a shape before `limit`, and the faces; NaN for
    /// rays that do not. `origin` is that of the packet and `turn` carries its directions into the frame of
    /// the shape.
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
            Form::Frustum(shape) => each!(|along| frustum(origin, along, &shape)),
            Form::Capsule(shape) => each!(|along| capsule(origin, along, shape)),
            Form::Ellipsoid(half) => each!(|along| ellipsoid(origin, along, DVec3::from(half))),
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
