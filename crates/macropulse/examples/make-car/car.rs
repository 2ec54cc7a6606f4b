//! The drawing of the car: a mid-size saloon, 4.70 m long, 1.82 m wide, 1.42 m high.
//!
//! The body is a loft: half a cross-section at each of some sixty stations along the car, mirrored. While it
//! is drawn, lengths along the car are measured from the front backwards (`s`). The finished mesh stands on
//! the plane z = 0, centred in x and y, and **looks along +x**.

use std::error::Error;

use super::mesh::Mesh;
use super::parts::{self, Sheet};

/// Length, width and height of the car, m. The mesh has exactly this bounding box.
pub const SIZE: [f64; 3] = [4.70, 1.82, 1.42];

/// Material of the body.
pub const PAINT: &str = "paint-white";
/// Material of its windows.
pub const GLASS: &str = "glass";
/// Material of its dark parts.
pub const TRIM: &str = "plastic-black";

/// Distance of the axles from the front, m.
pub const AXLES: [f64; 2] = [0.93, 3.66];
/// Radius of the tyres, m.
pub const WHEEL_RADIUS: f64 = 0.325;
const ARCH_RADIUS: f64 = 0.385;
/// The hole in the body through which one looks into the cabin: from, to, and rows from the
/// centre line.
const CABIN: [f64; 2] = [1.55, 3.62];
const DECK_ROWS: usize = 6;
const CABIN_ROWS: usize = 5;
const FLOOR: f64 = 0.38;

/// Height of the upper edge of the body (bonnet, window sill, boot lid).
const DECK: &[(f64, f64)] = &[
    (0.00, 0.600),
    (0.05, 0.665),
    (0.15, 0.715),
    (0.45, 0.790),
    (0.90, 0.865),
    (1.35, 0.925),
    (2.20, 0.950),
    (3.40, 0.985),
    (4.10, 1.030),
    (4.50, 1.050),
    (4.62, 1.035),
    (4.70, 0.960),
];

/// Height of the lower edge, arches aside.
const SILL: &[(f64, f64)] = &[
    (0.00, 0.270),
    (0.06, 0.200),
    (0.25, 0.170),
    (0.60, 0.165),
    (4.10, 0.165),
    (4.45, 0.220),
    (4.64, 0.270),
    (4.70, 0.330),
];

/// Half width seen from above.
const PLAN: &[(f64, f64)] = &[
    (0.00, 0.560),
    (0.03, 0.655),
    (0.08, 0.735),
    (0.16, 0.795),
    (0.30, 0.850),
    (0.55, 0.888),
    (0.95, 0.902),
    (2.30, 0.905),
    (3.70, 0.905),
    (4.15, 0.885),
    (4.45, 0.845),
    (4.60, 0.795),
    (4.67, 0.740),
    (4.70, 0.640),
];

/// Side seen from the front: share of the half width by height.
const FLANK: &[(f64, f64)] =
    &[(0.16, 0.950), (0.30, 0.985), (0.50, 1.000), (0.66, 0.995), (0.76, 0.985), (1.05, 0.930)];

/// Outline of windscreen, roof and rear window in side view.
const CANOPY: &[(f64, f64)] = &[
    (1.28, 0.910),
    (1.60, 1.105),
    (1.95, 1.300),
    (2.20, 1.385),
    (2.55, 1.420),
    (2.95, 1.412),
    (3.30, 1.365),
    (3.70, 1.235),
    (4.20, 1.030),
];

/// Half width of the canopy where it stands on the body, and at the edge of the roof.
const CANOPY_FOOT: &[(f64, f64)] = &[(1.28, 0.730), (1.80, 0.795), (3.20, 0.800), (4.20, 0.700)];
const CANOPY_EDGE: &[(f64, f64)] =
    &[(1.28, 0.725), (1.95, 0.630), (2.60, 0.600), (3.30, 0.595), (4.20, 0.690)];

/// The mesh of the car.
///
/// # Errors
/// If the body cannot be read back as a scene, to lay lamps and plates on it.
pub fn mesh() -> Result<Mesh, Box<dyn Error>> {
    let mut mesh = Mesh::default();
    body(&mut mesh);
    canopy(&mut mesh);
    parts::wheels(&mut mesh);
    parts::cabin(&mut mesh);
    parts::mirrors(&mut mesh);
    parts::fittings(&mut mesh)?;
    fit(&mut mesh);
    Ok(mesh)
}

/// Stretches the drawing, by less than a per cent, to the exact size, and turns it round.
fn fit(mesh: &mut Mesh) {
    let Some((low, high)) = mesh.bounds() else { return };
    for vertex in &mut mesh.vertices {
        let share: [f64; 3] =
            std::array::from_fn(|axis| (vertex[axis] - low[axis]) / (high[axis] - low[axis]));
        *vertex = [
            SIZE[0] * (0.5 - share[0]),
            // Turning the car round turns its left too, so that it is no mirror image.
            SIZE[1] * (0.5 - share[1]),
            SIZE[2] * share[2],
        ];
    }
}

/// Returns the stations at which the body has a cross-section: evenly spaced, and closer around the arches
/// and at the ends.
fn stations() -> Vec<f64> {
    let mut at: Vec<f64> = (0..=47).map(|step| f64::from(step) * 0.1).collect();
    at.extend([0.015, 0.03, 0.05, 0.08, 0.12, 0.16, 4.55, 4.62, 4.65, 4.67, 4.685]);
    at.extend(CABIN);
    at.retain(|s| AXLES.iter().all(|axle| (s - axle).abs() > ARCH_RADIUS + 0.01));
    for axle in AXLES {
        for step in 0..=16 {
            let angle = std::f64::consts::PI * f64::from(step) / 16.0;
            at.push(axle - ARCH_RADIUS * libm::cos(angle));
        }
        at.extend([axle - ARCH_RADIUS - 0.004, axle + ARCH_RADIUS + 0.004]);
    }
    at.sort_by(f64::total_cmp);
    at.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    at
}

/// Height of the lower edge of the flank, arches included.
fn lower_edge(s: f64) -> f64 {
    let arch = AXLES
        .iter()
        .map(|axle| ARCH_RADIUS * ARCH_RADIUS - (s - axle) * (s - axle))
        .find(|square| *square >= -1e-9)
        .map(|square| WHEEL_RADIUS + square.max(0.0).sqrt());
    arch.unwrap_or_else(|| smooth(SILL, s))
}

/// Half width of the flank at a height.
fn flank(s: f64, z: f64) -> f64 {
    smooth(PLAN, s) * smooth(FLANK, z)
}

/// Half a cross-section of the body, from the centre of the floor round to the centre of the
/// deck.
fn section(s: f64) -> Vec<[f64; 3]> {
    let low = lower_edge(s);
    let deck = smooth(DECK, s);
    let shoulder = deck - 0.085;
    let foot = flank(s, low);
    let mut half =
        vec![[s, 0.0, low], [s, 0.55 * foot, low], [s, foot - 0.025, low], [s, foot, low + 0.02]];
    for step in 1..=9 {
        let z = low + 0.02 + (shoulder - low - 0.02) * f64::from(step) / 9.0;
        half.push([s, flank(s, z), z]);
    }
    // The shoulder: a quarter round from the flank to the deck.
    let (side, rim) = (flank(s, shoulder), flank(s, shoulder) - 0.105);
    for step in 1..=5 {
        let t = f64::from(step) / 5.0;
        let (from, corner, to) = ((1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t);
        half.push([
            s,
            from * side + corner * (side - 0.012) + to * rim,
            from * shoulder + (corner + to) * deck,
        ]);
    }
    for step in 1..=DECK_ROWS {
        let share = 1.0 - step as f64 / DECK_ROWS as f64;
        half.push([s, rim * share, deck + 0.028 * (1.0 - share * share)]);
    }
    half
}

fn body(mesh: &mut Mesh) {
    let sections: Vec<Vec<[f64; 3]>> = stations().into_iter().map(section).collect();
    let rows = sections[0].len();
    let open = rows - 1 - CABIN_ROWS;
    let over_cabin = |station: usize, row: usize| {
        let s = sections[station][0][0];
        row >= open && s > CABIN[0] - 1e-9 && s < CABIN[1] - 1e-9
    };
    let sheet = Sheet { points: &sections };
    sheet.add_mirrored(mesh, |station, row| match row {
        _ if over_cabin(station, row) => None,
        0..=2 => Some(TRIM),
        3 => Some(TRIM),
        _ => Some(PAINT),
    });
    // The tub below the hole.
    let inside: Vec<&Vec<[f64; 3]>> = sections
        .iter()
        .filter(|half| half[0][0] > CABIN[0] - 1e-9 && half[0][0] < CABIN[1] + 1e-9)
        .collect();
    let drop = |point: [f64; 3]| [point[0], point[1], FLOOR];
    let walls: Vec<Vec<[f64; 3]>> = inside
        .iter()
        .map(|half| vec![half[open], drop(half[open]), drop(half[rows - 1])])
        .collect();
    Sheet { points: &walls }.add_mirrored(mesh, |_, _| Some(TRIM));
    for half in [inside.first(), inside.last()].into_iter().flatten() {
        let bulkhead: Vec<Vec<[f64; 3]>> =
            half[open..].iter().map(|point| vec![*point, drop(*point)]).collect();
        Sheet { points: &bulkhead }.add_mirrored(mesh, |_, _| Some(TRIM));
    }
    // Both ends are flat: strips from one flank to the other.
    for half in [sections.first(), sections.last()].into_iter().flatten() {
        let strips: Vec<Vec<[f64; 3]>> =
            half.iter().map(|point| vec![*point, [point[0], 0.0, point[2]]]).collect();
        Sheet { points: &strips }
            .add_mirrored(mesh, |row, _| Some(if row < 4 { TRIM } else { PAINT }));
    }
}

const SIDE_ROWS: usize = 6;
const EDGE_ROWS: usize = 4;
const TOP_ROWS: usize = 8;

/// Half a cross-section of the canopy at `s`, from its foot round to the centre of the roof.
fn canopy_section(s: f64) -> Vec<[f64; 3]> {
    let foot_z = smooth(DECK, s) - 0.015;
    let top = smooth(CANOPY, s).max(foot_z);
    let foot = smooth(CANOPY_FOOT, s);
    let height = top - foot_z;
    // The side leans in; the edge of the roof lies a little below its centre.
    let edge = foot + (smooth(CANOPY_EDGE, s) - foot) * (height / 0.45).min(1.0);
    let drop = 0.045 * (height / 0.45).clamp(0.0, 1.0);
    let round = (0.30 * height).min(0.07);
    let edge_z = top - drop;
    let at_side = |z: f64| {
        let share = if height > 1e-6 { (z - foot_z) / height } else { 0.0 };
        foot + (edge - foot) * share + 0.02 * share * (1.0 - share)
    };
    // Glass and screens are bowed: the middle stands further forward, or back, than the edge.
    let bow = smooth(&[(1.28, 0.13), (2.20, 0.05), (2.7, 0.0), (3.3, -0.04), (4.2, -0.12)], s);
    let place = |y: f64, z: f64| {
        let across = (y / foot).clamp(0.0, 1.0);
        [s + bow * (across * across - 0.5), y, z]
    };
    let mut half = Vec::new();
    let side_top = edge_z - round;
    // Rows: sill, glass, frame. The frame has a constant height, so that the pillar follows the screen.
    let sill = foot_z + 0.035_f64.min(0.2 * height);
    let frame = side_top - 0.012_f64.min(0.2 * height);
    for z in [
        foot_z,
        sill,
        sill + (frame - sill) / 3.0,
        sill + (frame - sill) * 2.0 / 3.0,
        frame,
        side_top,
    ] {
        half.push(place(at_side(z), z));
    }
    for step in 1..=EDGE_ROWS {
        let t = step as f64 / EDGE_ROWS as f64;
        let (from, corner, to) = ((1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t);
        let (y0, y1, y2) = (at_side(side_top), at_side(edge_z), at_side(edge_z) - 0.09);
        half.push(place(
            from * y0 + corner * y1 + to * y2,
            from * side_top + corner * edge_z + to * (edge_z + 0.2 * drop),
        ));
    }
    let (rim, rim_z) = (at_side(edge_z) - 0.09, edge_z + 0.2 * drop);
    for step in 1..=TOP_ROWS {
        let share = 1.0 - step as f64 / TOP_ROWS as f64;
        half.push(place(rim * share, rim_z + (top - rim_z) * (1.0 - share * share)));
    }
    half
}

fn canopy(mesh: &mut Mesh) {
    let mut at: Vec<f64> = (0..=58).map(|step| 1.28 + 2.92 * f64::from(step) / 58.0).collect();
    let pillars = [2.66, 2.76];
    let screens = [2.06, 3.34];
    at.extend(pillars);
    at.extend(screens);
    at.sort_by(f64::total_cmp);
    let sections: Vec<Vec<[f64; 3]>> = at.iter().map(|s| canopy_section(*s)).collect();
    Sheet { points: &sections }.add_mirrored(mesh, |station, row| {
        let s = at[station];
        let side = row < SIDE_ROWS - 1;
        let window = (1..SIDE_ROWS - 2).contains(&row)
            && (1.62..3.86).contains(&s)
            && !(pillars[0]..pillars[1] - 1e-9).contains(&s);
        let screen = !side
            && row >= SIDE_ROWS - 1 + EDGE_ROWS
            && (s < screens[0] - 1e-9 && s > 1.31 || s >= screens[1] - 1e-9 && s < 4.12);
        Some(match (window, screen) {
            (false, false) if side && row >= 1 && (1.62..3.86).contains(&s) => TRIM,
            (false, false) => PAINT,
            _ => GLASS,
        })
    });
}

/// A monotone cubic through `knots` (abscissa ascending) \[FB84\]; constant beyond its ends.
pub fn smooth(knots: &[(f64, f64)], x: f64) -> f64 {
    let last = knots.len() - 1;
    let index = knots.partition_point(|knot| knot.0 <= x);
    if index == 0 {
        return knots[0].1;
    }
    if index > last {
        return knots[last].1;
    }
    let slope = |i: usize| (knots[i + 1].1 - knots[i].1) / (knots[i + 1].0 - knots[i].0);
    // Harmonic mean of the neighbours where they agree in sign: no overshoot.
    let tangent = |i: usize| match i {
        0 => slope(0),
        i if i == last => slope(last - 1),
        i if slope(i - 1) * slope(i) <= 0.0 => 0.0,
        i => 2.0 * slope(i - 1) * slope(i) / (slope(i - 1) + slope(i)),
    };
    let (left, right) = (knots[index - 1], knots[index]);
    let span = right.0 - left.0;
    let t = (x - left.0) / span;
    let (t2, t3) = (t * t, t * t * t);
    left.1 * (2.0 * t3 - 3.0 * t2 + 1.0)
        + span * tangent(index - 1) * (t3 - 2.0 * t2 + t)
        + right.1 * (3.0 * t2 - 2.0 * t3)
        + span * tangent(index) * (t3 - t2)
}
