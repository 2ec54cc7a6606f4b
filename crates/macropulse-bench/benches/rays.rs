//! Rays per second, beside two other libraries on the same triangles and rays.
//!
//! `cargo bench --bench rays` runs each pair under criterion, and at the end prints ratios from
//! interleaved runs and the number of rays that leak out of a closed sphere. `STREET=1` adds five
//! million triangles. All on one thread.
#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::f64::consts::{PI, TAU};
use std::fs;
use std::hint::black_box;
use std::time::{Duration, Instant};

use common::clock;
use criterion::{Criterion, Throughput};
use glam::{DVec3, Vec3A};
use macropulse::scene::{Ray, Scene};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::triangle::Triangle;
use parry3d::math::Vector;
use parry3d::query::{Ray as ParryRay, RayCast};
use parry3d::shape::TriMesh;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Corners = [[f64; 3]; 3];

/// Where the rays start, m.
const EYE: [f64; 3] = [0.0, 0.0, 1.5];

/// The surface `x⁵ᐟ² + y⁵ᐟ² + z⁵ᐟ² = 1`, stretched to `half` and moved to `middle`; 4 · `rows`²
/// triangles.
fn super_ellipsoid(rows: u32, half: DVec3, middle: DVec3) -> impl Iterator<Item = Corners> {
    let power = |value: f64| value.abs().powf(0.4).copysign(value);
    let point = move |row: u32, column: u32| {
        let up = PI * (f64::from(row) / f64::from(rows) - 0.5);
        let around = TAU * f64::from(column % (2 * rows)) / f64::from(2 * rows);
        let level = if row == 0 || row == rows { 0.0 } else { power(up.cos()) };
        let place =
            DVec3::new(level * power(around.cos()), level * power(around.sin()), power(up.sin()));
        (middle + half * place).to_array()
    };
    (0..rows).flat_map(move |row| {
        (0..2 * rows).flat_map(move |column| {
            let (a, b) = (point(row, column), point(row, column + 1));
            let (c, d) = (point(row + 1, column + 1), point(row + 1, column));
            [[a, b, c], [a, c, d]]
        })
    })
}

fn ground(half: f64) -> [Corners; 2] {
    let corner = |x: f64, y: f64| [x * half, y * half, 0.0];
    let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    [[a, b, c], [a, c, d]]
}

/// A car that begins 11 m ahead, on the ground.
fn car(rows: u32) -> Vec<Corners> {
    let (half, middle) = (DVec3::new(2.2, 0.9, 0.75), DVec3::new(13.2, 0.0, 0.85));
    super_ellipsoid(rows, half, middle).chain(ground(500.0)).collect()
}

/// A hundred finely meshed cars in two rows, to 279 m.
fn street() -> Vec<Corners> {
    let parked = (0..100).flat_map(|place| {
        let side = if place % 2 == 0 { 3.5 } else { -3.5 };
        let middle = DVec3::new(8.0 + 2.7 * f64::from(place), side, 0.85);
        super_ellipsoid(110, DVec3::new(2.2, 0.9, 0.75), middle)
    });
    parked.chain(ground(500.0)).collect()
}

/// 848 × 480 directions, row by row, 36° by 20°.
fn directions() -> Vec<[f64; 3]> {
    let pixel = |row: u32, column: u32| {
        let azimuth = (0.5 - (f64::from(column) + 0.5) / 848.0) * 36.0_f64.to_radians();
        let elevation = (0.5 - (f64::from(row) + 0.5) / 480.0) * 20.0_f64.to_radians();
        let level = elevation.cos();
        [level * azimuth.cos(), level * azimuth.sin(), elevation.sin()]
    };
    (0..480).flat_map(|row| (0..848).map(move |column| pixel(row, column))).collect()
}

/// Each direction and six around it at 0.4 mrad; of every seventh, so that there are as many.
fn seven_each(all: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let around = |axis: &[f64; 3]| {
        let axis = DVec3::from(*axis);
        let left = DVec3::Z.cross(axis).normalize();
        let up = axis.cross(left);
        let spoke = move |index: u32| {
            let (sin, cos) = (TAU * f64::from(index) / 6.0).sin_cos();
            (axis + 4e-4 * (cos * left + sin * up)).normalize().to_array()
        };
        std::iter::once(axis.to_array()).chain((0..6).map(spoke))
    };
    let rows = all.chunks(848).step_by(7);
    rows.flatten().flat_map(around).collect()
}

/// The same triangles, three times.
struct Libraries {
    name: String,
    scene: Scene,
    obvhs: Bvh2,
    ordered: Vec<Triangle>,
    parry: TriMesh,
}

impl Libraries {
    fn new(name: &str, triangles: &[Corners]) -> Self {
        let began = Instant::now();
        let scene = scene(triangles);
        println!("{name}: {} triangles, loaded in {:.2?}", scene.triangles(), began.elapsed());
        let vertex = |[x, y, z]: [f64; 3]| Vec3A::new(x as f32, y as f32, z as f32);
        let narrow: Vec<Triangle> = triangles
            .iter()
            .map(|[a, b, c]| Triangle { v0: vertex(*a), v1: vertex(*b), v2: vertex(*c) })
            .collect();
        let plan = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        let obvhs = build_bvh2_from_tris(&narrow, plan, &mut Duration::default());
        let ordered = obvhs.primitive_indices.iter().map(|i| narrow[*i as usize]).collect();
        let vertices = triangles.iter().flatten();
        let vertices = vertices.map(|[x, y, z]| Vector::new(*x as f32, *y as f32, *z as f32));
        let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
        let parry = TriMesh::new(vertices.collect(), indices.collect()).unwrap();
        Self { name: name.to_owned(), scene, obvhs, ordered, parry }
    }

    fn packets(&self, rays: &[[f64; 3]]) -> usize {
        let ranges = self.scene.cast_all(EYE, rays, 1e4);
        ranges.iter().filter(|range| range.is_finite()).count()
    }

    fn one_by_one(&self, rays: &[[f64; 3]]) -> usize {
        let ray = |direction: &[f64; 3]| Ray { origin: EYE, direction: *direction };
        rays.iter().filter(|direction| self.scene.cast(&ray(direction), 0.0, 1e4).is_some()).count()
    }

    fn obvhs(&self, rays: &[[f64; 3]]) -> usize {
        let is_hit = |[x, y, z]: &&[f64; 3]| {
            let direction = Vec3A::new(*x as f32, *y as f32, *z as f32);
            let ray = ObvhsRay::new_inf(Vec3A::new(0.0, 0.0, EYE[2] as f32), direction);
            let mut hit = RayHit::none();
            self.obvhs.ray_traverse(ray, &mut hit, |ray, leaf| self.ordered[leaf].intersect(ray))
        };
        rays.iter().filter(is_hit).count()
    }

    fn parry(&self, rays: &[[f64; 3]]) -> usize {
        let is_hit = |[x, y, z]: &&[f64; 3]| {
            let start = Vector::new(0.0, 0.0, EYE[2] as f32);
            let ray = ParryRay::new(start, Vector::new(*x as f32, *y as f32, *z as f32));
            self.parry.cast_local_ray(&ray, 1e4, false).is_some()
        };
        rays.iter().filter(is_hit).count()
    }
}

fn scene(triangles: &[Corners]) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let mut stl = vec![0; 80];
    stl.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        stl.extend([0; 12]);
        corners.iter().flatten().for_each(|value| stl.extend((*value as f32).to_le_bytes()));
        stl.extend([0; 2]);
    }
    fs::write(folder.path().join("mesh.stl"), stl).unwrap();
    let [x, y, z] = EYE;
    let text = format!(
        "version = 1\n[sensor]\nposition_m = [{x}, {y}, {z}]\n\
         [[object]]\nmesh = \"mesh.stl\"\nunit = \"m\"\nmaterial = \"brick\"\n"
    );
    Scene::from_toml(&text, "bench", folder.path()).unwrap()
}

/// What is measured, by name.
type Way = (&'static str, fn(&Libraries, &[[f64; 3]]) -> usize);

const WAYS: [Way; 4] = [
    ("packets", Libraries::packets),
    ("one by one", Libraries::one_by_one),
    ("obvhs", Libraries::obvhs),
    ("parry3d", Libraries::parry),
];

/// Millions of rays per second: the best of several rounds, the ways taking turns.
fn rates(libraries: &Libraries, rays: &[[f64; 3]]) -> [f64; WAYS.len()] {
    let mut best = [0.0_f64; WAYS.len()];
    for _ in 0..9 {
        for ((_, way), best) in WAYS.iter().zip(&mut best) {
            let began = clock();
            black_box(way(libraries, rays));
            *best = best.max(rays.len() as f64 * 1e-6 / (clock() - began));
        }
    }
    best
}

/// Rays out of `count` that leave a sphere of 360 000 triangles, of which some are `missing`.
fn leaks(count: usize, missing: usize) -> usize {
    let mut triangles: Vec<Corners> = sphere(300);
    // From the middle: those at the end are slivers about the pole.
    triangles.drain(180_000..180_000 + missing);
    let scene = scene(&triangles);
    let mut chance = ChaCha8Rng::seed_from_u64(1);
    let mut inside = || {
        loop {
            let point = DVec3::from([0; 3].map(|_| chance.random_range(-1.0..1.0)));
            if (1e-3..1.0).contains(&point.length_squared()) {
                return point;
            }
        }
    };
    let mut leaked = 0;
    for _ in 0..count / 160 {
        let origin = (inside() * 9.9).to_array();
        let rays: Vec<[f64; 3]> = (0..160).map(|_| inside().normalize().to_array()).collect();
        let ranges = scene.cast_all(origin, &rays, 1e9);
        leaked += ranges.iter().filter(|range| range.is_infinite()).count();
    }
    leaked
}

/// A closed sphere of 10 m.
fn sphere(rows: u32) -> Vec<Corners> {
    let point = |row: u32, column: u32| {
        let polar = PI * f64::from(row) / f64::from(rows);
        let around = TAU * f64::from(column % (2 * rows)) / f64::from(2 * rows);
        let ring = if row == 0 || row == rows { 0.0 } else { polar.sin() };
        [10.0 * ring * around.cos(), 10.0 * ring * around.sin(), 10.0 * polar.cos()]
    };
    let cell = |row: u32, column: u32| {
        let (a, b) = (point(row, column), point(row, column + 1));
        let (c, d) = (point(row + 1, column + 1), point(row + 1, column));
        [[a, b, c], [a, c, d]]
    };
    (0..rows).flat_map(|row| (0..2 * rows).flat_map(move |column| cell(row, column))).collect()
}

fn main() {
    // `cargo test --benches` only asks whether it runs.
    let in_earnest = std::env::args().any(|word| word == "--bench");
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    let mut scenes = vec![("car 12 k", car(55)), ("car 50 k", car(112)), ("car 200 k", car(224))];
    if std::env::var_os("STREET").is_some() {
        scenes.push(("street 4.8 M", street()));
    }
    if !in_earnest {
        scenes.truncate(1);
    }
    let coherent = directions();
    let seven = seven_each(&coherent);
    let mut shuffled = coherent.clone();
    shuffled.shuffle(&mut ChaCha8Rng::seed_from_u64(2));
    let patterns = [("rows", &coherent), ("seven each", &seven), ("shuffled", &shuffled)];
    let mut table = vec![];
    for (name, triangles) in scenes {
        let libraries = Libraries::new(name, &triangles);
        drop(triangles);
        for (pattern, rays) in patterns {
            let mut group = criterion.benchmark_group(format!("{} {pattern}", libraries.name));
            group.throughput(Throughput::Elements(rays.len() as u64));
            for (way, cast) in WAYS {
                group.bench_function(way, |bencher| bencher.iter(|| cast(&libraries, rays)));
            }
            group.finish();
            if in_earnest {
                table.push((format!("{} {pattern}", libraries.name), rates(&libraries, rays)));
            }
        }
    }
    if !in_earnest {
        return;
    }
    println!(
        "\nMillions of rays per second of one thread; in brackets what packets are times that"
    );
    for (name, rates) in table {
        let each = WAYS
            .iter()
            .zip(rates)
            .map(|((way, _), rate)| format!("{way} {rate:5.1} ({:4.2})", rates[0] / rate));
        println!("{name:>22}: {}", each.collect::<Vec<_>>().join("   "));
    }
    println!("Rays that leak out of a sphere: {} of 20 million", leaks(20_000_000, 0));
    println!("... of which one triangle is missing: {} of 20 million", leaks(20_000_000, 1));
}
