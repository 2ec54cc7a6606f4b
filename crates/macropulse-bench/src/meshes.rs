//! Triangles and rays that are alike for every library.

use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::Path;

use glam::DVec3;
use macropulse::codec::ShotLog;
use macropulse::design::Design;
use macropulse::emit::logs;
use macropulse::scene::Scene;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::Fallible;

/// The corners of a triangle, m.
pub type Corners = [[f32; 3]; 3];

/// A unit vector.
pub type Direction = [f32; 3];

/// Origin of the rays, m.
pub const EYE: [f32; 3] = [0.0, 0.0, 1.5];

/// Triangles of a surface of `rows` by `columns` cells with corners at `point(row, column)`.
fn surface(
    (rows, columns): (u32, u32),
    point: impl Fn(u32, u32) -> DVec3,
) -> impl Iterator<Item = Corners> {
    let cells = (0..rows).flat_map(move |row| (0..columns).map(move |column| (row, column)));
    cells.flat_map(move |(row, column)| {
        let corner = |row, column| point(row, column).as_vec3().to_array();
        let (a, b) = (corner(row, column), corner(row, column + 1));
        let (c, d) = (corner(row + 1, column + 1), corner(row + 1, column));
        [[a, b, c], [a, c, d]]
    })
}

/// The surface `|x|^n + |y|^n + |z|^n = 1`, with `n` = 2 / `bulge`, stretched to `half` and moved
/// to `middle`: 4 · `rows`² triangles.
fn super_ellipsoid(
    rows: u32,
    bulge: f64,
    (half, middle): (DVec3, DVec3),
) -> impl Iterator<Item = Corners> {
    let power = move |value: f64| value.abs().powf(bulge).copysign(value);
    surface((rows, 2 * rows), move |row, column| {
        let up = PI * (f64::from(row) / f64::from(rows) - 0.5);
        let around = TAU * f64::from(column % (2 * rows)) / f64::from(2 * rows);
        let level = if row == 0 || row == rows { 0.0 } else { power(up.cos()) };
        let place =
            DVec3::new(level * power(around.cos()), level * power(around.sin()), power(up.sin()));
        middle + half * place
    })
}

fn ground() -> impl Iterator<Item = Corners> {
    surface((1, 1), |row, column| {
        DVec3::new(1000.0 * f64::from(row) - 500.0, 1000.0 * f64::from(column) - 500.0, 0.0)
    })
}

const CAR: DVec3 = DVec3::new(2.2, 0.9, 0.75);

/// A car of 50 k triangles that begins 11 m ahead, on the ground.
pub fn car() -> Vec<Corners> {
    super_ellipsoid(112, 0.4, (CAR, DVec3::new(13.2, 0.0, 0.85))).chain(ground()).collect()
}

/// A hundred finely meshed cars in two rows, to 279 m: 4.8 million triangles.
pub fn parked() -> Vec<Corners> {
    let parked = (0..100).flat_map(|place| {
        let side = if place % 2 == 0 { 3.5 } else { -3.5 };
        let middle = DVec3::new(8.0 + 2.7 * f64::from(place), side, 0.85);
        super_ellipsoid(110, 0.4, (CAR, middle))
    });
    parked.chain(ground()).collect()
}

/// A closed sphere of 10 m, of 360 000 triangles.
pub fn sphere() -> Vec<Corners> {
    super_ellipsoid(300, 1.0, (DVec3::splat(10.0), DVec3::ZERO)).collect()
}

/// A street of 300 m between houses that stand six deep, whose walls are squares with some relief:
/// 250 k triangles.
pub fn city() -> Vec<Corners> {
    let rows = [-43.0, -27.0, -11.0, 11.0, 27.0, 43.0];
    let places = (0..16).flat_map(|block| rows.map(|y| (f64::from(block), y)));
    let houses = places.flat_map(|(block, y)| {
        let height = 8.0 + 2.5 * ((3.0 * block + y).rem_euclid(7.0));
        house(DVec3::new(20.0 + 18.0 * block, y, 0.0), DVec3::new(15.0, 10.0, height))
    });
    houses.chain(ground()).collect()
}

/// Four walls and a roof, each of 16 × 16 squares.
fn house(foot: DVec3, size: DVec3) -> impl Iterator<Item = Corners> {
    let (x, y) = (DVec3::X * size.x / 2.0, DVec3::Y * size.y / 2.0);
    let (up, top) = (DVec3::Z * size.z, foot + DVec3::Z * size.z);
    let sides = [
        (foot - x - y, 2.0 * y, up),
        (foot + x - y, 2.0 * y, up),
        (foot - x - y, 2.0 * x, up),
        (foot - x + y, 2.0 * x, up),
        (top - x - y, 2.0 * x, 2.0 * y),
    ];
    sides.into_iter().flat_map(|(corner, along, across)| {
        let out = along.cross(across).normalize();
        surface((16, 16), move |row, column| {
            let inside = row % 16 != 0 && column % 16 != 0;
            let relief = if inside { 0.1 * f64::from((row + column) % 2) } else { 0.0 };
            corner + along * (f64::from(row) / 16.0) + across * (f64::from(column) / 16.0)
                - relief * out
        })
    })
}

/// 848 × 480 directions, row by row, 36° by 20°.
pub fn in_rows() -> Vec<Direction> {
    let pixel = |row: u32, column: u32| {
        let azimuth = (0.5 - (f64::from(column) + 0.5) / 848.0) * 36.0_f64.to_radians();
        let elevation = (0.5 - (f64::from(row) + 0.5) / 480.0) * 20.0_f64.to_radians();
        let level = elevation.cos();
        DVec3::new(level * azimuth.cos(), level * azimuth.sin(), elevation.sin())
    };
    let all = (0..480).flat_map(|row| (0..848).map(move |column| pixel(row, column)));
    all.map(|direction| direction.as_vec3().to_array()).collect()
}

/// The same in an order without any.
pub fn shuffled() -> Vec<Direction> {
    let mut all = in_rows();
    all.shuffle(&mut ChaCha8Rng::seed_from_u64(2));
    all
}

/// Returns the directions of a scan of `hdl-64e`, in the order of its shots and laser by laser. Its 64 lasers
/// fire in turn while the head turns, so that each shot is of another laser than the one before.
pub fn of_a_turning_head() -> Fallible<[Vec<Direction>; 2]> {
    let design = Design::open("hdl-64e", &[])?;
    let directions = design.directions();
    let of_log = |log: ShotLog| {
        let direction = |shot| DVec3::from(directions.of_shot(&log, shot)).as_vec3().to_array();
        (0..log.len()).map(|shot| (log.row[shot], direction(shot))).collect::<Vec<_>>()
    };
    let shots = logs(&design, 0..design.shots_per_scan()).flat_map(of_log);
    let mut shots: Vec<(u16, Direction)> = shots.collect();
    let in_turn = shots.iter().map(|(_, direction)| *direction).collect();
    shots.sort_by_key(|(laser, _)| *laser);
    Ok([in_turn, shots.into_iter().map(|(_, direction)| direction).collect()])
}

/// Writes `triangles` to `mesh.stl` in the `folder`, and a scene of them to `scene.toml`.
pub fn write(triangles: &[Corners], folder: &Path) -> Fallible<()> {
    let mut stl = vec![0; 80];
    stl.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        stl.extend([0; 12]);
        corners.iter().flatten().for_each(|value| stl.extend(value.to_le_bytes()));
        stl.extend([0; 2]);
    }
    fs::write(folder.join("mesh.stl"), stl)?;
    let [x, y, z] = EYE;
    let text = format!(
        "version = 1\nname = \"bench\"\n[sensor]\nposition_m = [{x:?}, {y:?}, {z:?}]\n\
         [[object]]\nname = \"mesh\"\nmesh = \"mesh.stl\"\nunit = \"m\"\nmaterial = \"brick\"\n"
    );
    Ok(fs::write(folder.join("scene.toml"), text)?)
}

/// The scene that [`write()`] has written.
pub fn open(folder: &Path) -> Fallible<Scene> {
    Ok(Scene::from_file(&folder.join("scene.toml"))?)
}
