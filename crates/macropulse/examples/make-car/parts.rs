//! The parts of the car that are not sheet metal: wheels, cabin, mirrors, lamps, plates.
//!
//! Drawn, like the body, with `s` counted from the front backwards.

use std::error::Error;
use std::f64::consts::TAU;

use glam::DVec3;
use macropulse::scene::{Ray, Scene};

use super::car::{AXLES, PAINT, TRIM, WHEEL_RADIUS};
use super::mesh::Mesh;

const RUBBER: &str = "rubber";
const RIM: &str = "metal";
const SEAT: &str = "fabric";
const PLATE: &str = "number-plate";

/// A grid of points: lines of equal length.
pub struct Sheet<'a> {
    /// The lines, all with the same number of points.
    pub points: &'a [Vec<[f64; 3]>],
}

impl Sheet<'_> {
    /// Adds the cells to which `made_of`, asked by line and place in it, gives a material.
    pub fn add<'n>(&self, mesh: &mut Mesh, made_of: impl Fn(usize, usize) -> Option<&'n str>) {
        let across = self.points.first().map_or(0, Vec::len) as u32;
        let start = mesh.vertices.len() as u32;
        mesh.vertices.extend(self.points.iter().flatten());
        for line in 0..self.points.len().saturating_sub(1) as u32 {
            for place in 0..across.saturating_sub(1) {
                let Some(name) = made_of(line as usize, place as usize) else { continue };
                let material = mesh.material(name);
                let corner = start + line * across + place;
                mesh.polygon(&[corner, corner + 1, corner + across + 1, corner + across], material);
            }
        }
    }

    /// The same on both sides of the car.
    pub fn add_mirrored<'n>(
        &self,
        mesh: &mut Mesh,
        made_of: impl Fn(usize, usize) -> Option<&'n str>,
    ) {
        self.add(mesh, &made_of);
        let mirrored: Vec<Vec<[f64; 3]>> = self
            .points
            .iter()
            .map(|line| line.iter().map(|[x, y, z]| [*x, -y, *z]).collect())
            .collect();
        Sheet { points: &mirrored }.add(mesh, &made_of);
    }
}

/// Outline of a wheel: radius, and distance inwards from its outer face.
const WHEEL: &[(f64, f64, &str)] = &[
    (0.000, 0.030, RIM),
    (0.045, 0.028, RIM),
    (0.060, 0.040, RIM),
    (0.190, 0.030, RIM),
    (0.215, 0.010, RIM),
    (0.222, 0.008, RUBBER),
    (0.250, 0.000, RUBBER),
    (0.290, 0.003, RUBBER),
    (0.315, 0.022, RUBBER),
    (WHEEL_RADIUS, 0.045, RUBBER),
    (WHEEL_RADIUS, 0.170, RUBBER),
    (0.315, 0.200, RUBBER),
    (0.230, 0.215, RUBBER),
    (0.000, 0.200, TRIM),
];

/// Four wheels, their outer faces inside the flanks.
pub fn wheels(mesh: &mut Mesh) {
    const STEPS: u32 = 60;
    for axle in AXLES {
        let lines: Vec<Vec<[f64; 3]>> = (0..=STEPS)
            .map(|step| {
                // The first line points straight down, so that the tyre rests on the ground exactly.
                let angle = TAU * f64::from(step % STEPS) / f64::from(STEPS);
                let (sin, cos) = libm::sincos(angle);
                let spoke = (step % 12) < 7;
                WHEEL
                    .iter()
                    .map(|&(radius, depth, _)| {
                        let sunk = if !spoke && (0.05..0.2).contains(&radius) { 0.05 } else { 0.0 };
                        [axle + radius * sin, 0.875 - depth - sunk, WHEEL_RADIUS - radius * cos]
                    })
                    .collect()
            })
            .collect();
        Sheet { points: &lines }.add_mirrored(mesh, |line, place| {
            let gap = line % 12 >= 6 && (1..4).contains(&place);
            Some(if gap { TRIM } else { WHEEL[place].2 })
        });
    }
}

/// A block: from one corner to the opposite one.
fn block(mesh: &mut Mesh, low: [f64; 3], high: [f64; 3], material: &str) {
    let start = mesh.vertices.len() as u32;
    for corner in 0..8 {
        mesh.vertices.push(std::array::from_fn(|axis| {
            if corner >> axis & 1 == 1 { high[axis] } else { low[axis] }
        }));
    }
    let material = mesh.material(material);
    for face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    {
        mesh.polygon(&face.map(|corner| start + corner), material);
    }
}

/// Dashboard, seats, and the chassis between the wheels.
pub fn cabin(mesh: &mut Mesh) {
    block(mesh, [1.56, -0.62, 0.60], [1.85, 0.62, 0.90], TRIM);
    for side in [-0.36, 0.36] {
        let (right, left) = (side - 0.24, side + 0.24);
        block(mesh, [2.15, right, 0.42], [2.62, left, 0.58], SEAT);
        block(mesh, [2.60, right, 0.45], [2.74, left, 1.04], SEAT);
        block(mesh, [2.63, side - 0.12, 1.07], [2.71, side + 0.12, 1.22], SEAT);
    }
    block(mesh, [3.05, -0.62, 0.42], [3.45, 0.62, 0.58], SEAT);
    block(mesh, [3.42, -0.62, 0.45], [3.56, 0.62, 1.02], SEAT);
    // Blocks that close the arches towards the middle.
    for axle in AXLES {
        block(mesh, [axle - 0.45, -0.62, 0.20], [axle + 0.45, 0.62, 0.73], TRIM);
    }
}

/// Two mirrors, which reach the full width.
pub fn mirrors(mesh: &mut Mesh) {
    let ring = |s: f64, grow: f64| -> Vec<[f64; 3]> {
        let (y, z, half_y, half_z) = (0.83, 0.985, 0.080 * grow, 0.060 * grow);
        (0..=16)
            .map(|step| {
                let (sin, cos) = libm::sincos(TAU * f64::from(step % 16) / 16.0);
                // A squared-off ellipse.
                let fat = |v: f64| v.signum() * v.abs().sqrt();
                [s, y + half_y * fat(cos), z + half_z * fat(sin)]
            })
            .collect()
    };
    let lines = [
        ring(1.60, 0.0),
        ring(1.60, 0.7),
        ring(1.625, 0.95),
        ring(1.70, 1.0),
        ring(1.72, 0.95),
        ring(1.72, 0.0),
    ];
    Sheet { points: &lines }
        .add_mirrored(mesh, |line, _| Some(if line < 3 { PAINT } else { "chrome" }));
}

/// Outline of something laid on the body, as seen along the car: a quadrilateral (y, z) in order.
type Outline = [(f64, f64); 4];

/// Lamps, grille, intake and plates: thin patches that follow the sheet metal.
///
/// # Errors
/// If the body cannot be read back as a scene, or an outline misses it.
pub fn fittings(mesh: &mut Mesh) -> Result<(), Box<dyn Error>> {
    let body = solid(mesh)?;
    let left = |outline: Outline| outline;
    let right = |outline: Outline| outline.map(|(y, z)| (-y, z));
    let headlamp = [(0.50, 0.575), (0.78, 0.620), (0.80, 0.695), (0.50, 0.650)];
    let intake = [(0.56, 0.29), (0.74, 0.30), (0.72, 0.37), (0.56, 0.36)];
    let tail_lamp = [(0.44, 0.80), (0.775, 0.80), (0.765, 0.92), (0.44, 0.90)];
    for side in [left, right] {
        lay(mesh, &body, Face::Front, side(headlamp), "headlamp")?;
        lay(mesh, &body, Face::Front, side(intake), TRIM)?;
        lay(mesh, &body, Face::Rear, side(tail_lamp), "tail-lamp")?;
    }
    let grille = [(-0.44, 0.50), (0.44, 0.50), (0.47, 0.63), (-0.47, 0.63)];
    lay(mesh, &body, Face::Front, grille, TRIM)?;
    let lower = [(-0.50, 0.285), (0.50, 0.285), (0.44, 0.38), (-0.44, 0.38)];
    lay(mesh, &body, Face::Front, lower, TRIM)?;
    let apron = [(-0.60, 0.36), (0.60, 0.36), (0.55, 0.46), (-0.55, 0.46)];
    lay(mesh, &body, Face::Rear, apron, TRIM)?;
    plate(mesh, Face::Front, (-0.012, 0.43));
    plate(mesh, Face::Rear, (4.712, 0.72));
    Ok(())
}

/// Which end of the car.
#[derive(Clone, Copy, PartialEq)]
enum Face {
    Front,
    Rear,
}

/// A European plate, 520 mm by 110 mm.
fn plate(mesh: &mut Mesh, face: Face, (s, z): (f64, f64)) {
    let depth = if face == Face::Front { 0.012 } else { -0.012 };
    let (a, b) = (s.min(s + depth), s.max(s + depth));
    block(mesh, [a, -0.26, z - 0.055], [b, 0.26, z + 0.055], PLATE);
}

/// The body as a scene of its own, in the frame of the drawing.
fn solid(mesh: &Mesh) -> Result<Scene, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("body.ply"), mesh.ply())?;
    let text = "version = 1\n[[object]]\nmesh = \"body.ply\"\nmaterial = \"white\"\n";
    Ok(Scene::from_toml(text, "body", folder.path())?)
}

/// Lays a patch of the given outline on the body, a few millimetres proud of it.
fn lay(
    mesh: &mut Mesh,
    body: &Scene,
    face: Face,
    outline: Outline,
    material: &str,
) -> Result<(), Box<dyn Error>> {
    const PROUD: f64 = 0.006;
    // Finer across than up: the corners of the car bend away across.
    const STEPS: [u32; 2] = [18, 5];
    let (start, toward) = if face == Face::Front { (-1.0, 1.0) } else { (5.7, -1.0) };
    let [a, b, c, d] = outline.map(|(y, z)| DVec3::new(0.0, y, z));
    let point = |i: u32, j: u32| -> Option<[f64; 3]> {
        let [u, v] = [f64::from(i) / f64::from(STEPS[0]), f64::from(j) / f64::from(STEPS[1])];
        let place = a.lerp(b, u).lerp(d.lerp(c, u), v);
        let ray = Ray { origin: [start, place.y, place.z], direction: [toward, 0.0, 0.0] };
        let hit = body.cast(&ray, 0.0, 3.0)?;
        let outward = DVec3::from(hit.normal) * (-toward * hit.normal[0]).signum();
        Some((DVec3::from(ray.origin) + DVec3::X * toward * hit.range + outward * PROUD).to_array())
    };
    let line = |i: u32| (0..=STEPS[1]).map(|j| point(i, j)).collect::<Option<Vec<_>>>();
    let lines = (0..=STEPS[0]).map(line).collect::<Option<Vec<_>>>();
    let lines = lines.ok_or_else(|| format!("the outline of a {material} misses the body"))?;
    Sheet { points: &lines }.add(mesh, |_, _| Some(material));
    Ok(())
}
