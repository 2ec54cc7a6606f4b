//! Rays per second, beside other libraries on the same triangles and rays; what it takes to load
//! them; and rays that leak out of a closed surface.

use std::fs;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use glam::{DVec3, Vec3A};
use macropulse::processor::thread_seconds;
use macropulse::scene::{Ray, Scene};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::triangle::Triangle;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::Fallible;
use crate::machine::printed;
use crate::meshes::{self, Corners, Direction, EYE};
use crate::page::{self, three};
use crate::peers::{self, Figures, LOADS, Peer};

/// The orders in which rays are cast: pixels, then the lasers of a turning head.
const ORDERS: [&str; 4] = ["rows", "shuffled", "lasers in turn", "laser by laser"];

/// The mesh whose loading is measured.
pub const LARGEST: &str = "4.8 M parked cars";

/// The mesh on which rays are held against Embree's.
pub const CITY: &str = "250 k city";

/// A mesh by name, and what makes it.
type Maker = (&'static str, fn() -> Vec<Corners>);

const MESHES: [Maker; 3] =
    [("50 k car", meshes::car), (CITY, meshes::city), (LARGEST, meshes::parked)];

/// Farthest that rays look, m.
const FARTHEST: f64 = 1e4;

/// Rays at one mesh.
struct Mesh {
    name: &'static str,
    /// By order and way, millions per second.
    rates: [[f64; WAYS.len()]; ORDERS.len()],
    embree: Option<Figures>,
    open3d: Option<Figures>,
    /// Processor time to load it, s, and the most memory of the program that does, bytes.
    load: (f64, f64),
}

/// All that was measured of rays.
pub struct Rays {
    meshes: Vec<Mesh>,
    /// Why there is no Embree, and no Open3D.
    pub no_embree: Option<String>,
    no_open3d: Option<String>,
    /// Rays out of [`LEAKED_OF`] that leak out of a closed sphere, and out of one that lacks a
    /// triangle.
    pub leaks: [usize; 2],
}

/// Rays cast from inside the sphere.
pub const LEAKED_OF: usize = 20_000_000;

/// The same triangles, twice.
struct Libraries {
    scene: Scene,
    obvhs: Bvh2,
    ordered: Vec<Triangle>,
}

impl Libraries {
    fn new(scene: Scene, triangles: &[Corners]) -> Self {
        let vertex = |corner: [f32; 3]| Vec3A::from(corner);
        let triangle =
            |[a, b, c]: &Corners| Triangle { v0: vertex(*a), v1: vertex(*b), v2: vertex(*c) };
        let narrow: Vec<Triangle> = triangles.iter().map(triangle).collect();
        let plan = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        let obvhs = build_bvh2_from_tris(&narrow, plan, &mut Duration::default());
        let ordered = obvhs.primitive_indices.iter().map(|i| narrow[*i as usize]).collect();
        Self { scene, obvhs, ordered }
    }

    fn packets(&self, rays: &Directions) -> usize {
        let ranges = self.scene.cast_all(EYE.map(f64::from), &rays.wide, FARTHEST);
        ranges.iter().filter(|range| range.is_finite()).count()
    }

    fn one_by_one(&self, rays: &Directions) -> usize {
        let ray = |direction: &[f64; 3]| Ray { origin: EYE.map(f64::from), direction: *direction };
        let is_hit =
            |direction: &&[f64; 3]| self.scene.cast(&ray(direction), 0.0, FARTHEST).is_some();
        rays.wide.iter().filter(is_hit).count()
    }

    fn obvhs(&self, rays: &Directions) -> usize {
        let is_hit = |direction: &&Direction| {
            let ray = ObvhsRay::new_inf(Vec3A::from(EYE), Vec3A::from(**direction));
            let mut hit = RayHit::none();
            self.obvhs.ray_traverse(ray, &mut hit, |ray, leaf| self.ordered[leaf].intersect(ray))
        };
        rays.narrow.iter().filter(is_hit).count()
    }
}

/// The same directions as each library takes them.
struct Directions {
    narrow: Vec<Direction>,
    wide: Vec<[f64; 3]>,
}

impl Directions {
    fn new(narrow: Vec<Direction>) -> Self {
        let wide =
            |direction: &Direction| DVec3::from(direction.map(f64::from)).normalize().to_array();
        Self { wide: narrow.iter().map(wide).collect(), narrow }
    }
}

/// A way to cast rays: its name, and the function that counts the hits.
type Way = (&'static str, fn(&Libraries, &Directions) -> usize);

const WAYS: [Way; 3] = [
    ("packets", Libraries::packets),
    ("one by one", Libraries::one_by_one),
    ("obvhs", Libraries::obvhs),
];

/// Returns millions of rays per second: the best of several rounds of each way, one after another as in the
/// program for Embree. All ways, and the other libraries that found `hits`, must hit the same number of rays,
/// but for a few that touch an edge.
fn rates(
    libraries: &Libraries,
    rays: &Directions,
    hits: impl Iterator<Item = usize>,
) -> Fallible<[f64; 3]> {
    let mut best = [0.0_f64; WAYS.len()];
    let first = libraries.packets(rays);
    let few = rays.wide.len() / 10_000;
    let is_as_first = |name: &str, found: usize| match found.abs_diff(first) <= few {
        true => Ok(()),
        false => Err(format!("{name}: {found} hits instead of {first}")),
    };
    for hits in hits {
        is_as_first("another library", hits)?;
    }
    for ((name, way), best) in WAYS.iter().zip(&mut best) {
        for _ in 0..9 {
            let began = thread_seconds();
            let found = black_box(way(libraries, rays));
            *best = best.max(1e-6 * rays.wide.len() as f64 / (thread_seconds() - began));
            is_as_first(name, found)?;
        }
    }
    Ok(best)
}

/// Measures them.
pub fn measure() -> Fallible<Rays> {
    let folder = tempfile::tempdir()?;
    let (embree, open3d) = (Peer::embree(folder.path()), Peer::open3d(folder.path()));
    let [in_turn, by_laser] = meshes::of_a_turning_head()?;
    let orders = [meshes::in_rows(), meshes::shuffled(), in_turn, by_laser].map(Directions::new);
    let narrow = orders.each_ref().map(|rays| &*rays.narrow);
    let files = peers::write(&narrow, folder.path())?;
    let mut measured = Vec::new();
    for (name, make) in MESHES {
        let triangles = make();
        meshes::write(&triangles, folder.path())?;
        let figures = |peer: &Result<Peer, String>| {
            peer.as_ref().ok().map(|peer| peer.run(folder.path(), &files)).transpose()
        };
        let (embree, open3d) = (figures(&embree)?, figures(&open3d)?);
        let load = load_apart(folder.path())?;
        let libraries = Libraries::new(meshes::open(folder.path())?, &triangles);
        let mut by_order = [[0.0; WAYS.len()]; ORDERS.len()];
        for (number, (rays, found)) in orders.iter().zip(&mut by_order).enumerate() {
            let peers = [&embree, &open3d].into_iter().flatten();
            *found =
                rates(&libraries, rays, peers.filter_map(|peer| peer.hits.get(number).copied()))?;
        }
        measured.push(Mesh { name, rates: by_order, embree, open3d, load });
    }
    let leaks = [leaks(folder.path(), 0)?, leaks(folder.path(), 1)?];
    Ok(Rays { meshes: measured, no_embree: embree.err(), no_open3d: open3d.err(), leaks })
}

/// Loads the scene in `folder` in processes of their own, and says what that took at least.
fn load_apart(folder: &Path) -> Fallible<(f64, f64)> {
    let mut least = (f64::INFINITY, f64::INFINITY);
    for _ in 0..LOADS {
        let text = printed(Command::new(std::env::current_exe()?).arg("load").arg(folder))?;
        let (seconds, peak) = text.trim().split_once(' ').ok_or("loading a mesh failed")?;
        least = (least.0.min(seconds.parse()?), least.1.min(peak.parse()?));
    }
    Ok(least)
}

/// Loads the scene in `folder`, and returns the line that the process prints.
pub fn load(folder: &Path) -> Fallible<String> {
    let began = thread_seconds();
    let scene = meshes::open(folder)?;
    let seconds = thread_seconds() - began;
    drop(black_box(scene));
    Ok(format!("{seconds} {}", peak()))
}

/// Most memory of this process so far, bytes; 0 where the system does not say.
pub fn peak() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kibibytes = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    1024.0 * kibibytes.unwrap_or_default()
}

/// Counts the rays that leave a sphere from which `missing` triangles were taken.
fn leaks(folder: &Path, missing: usize) -> Fallible<usize> {
    let mut triangles = meshes::sphere();
    // From the middle: those at the end are slivers about the pole.
    triangles.drain(180_000..180_000 + missing);
    meshes::write(&triangles, folder)?;
    let scene = meshes::open(folder)?;
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
    for _ in 0..LEAKED_OF / 160 {
        let origin = (inside() * 9.9).to_array();
        let rays: Vec<[f64; 3]> = (0..160).map(|_| inside().normalize().to_array()).collect();
        let ranges = scene.cast_all(origin, &rays, 1e9);
        leaked += ranges.iter().filter(|range| range.is_infinite()).count();
    }
    Ok(leaked)
}

impl Rays {
    fn mesh(&self, name: &str) -> Option<&Mesh> {
        self.meshes.iter().find(|mesh| mesh.name == name)
    }

    /// The rate of packets over that of Embree's fastest way, at the city in this order.
    pub fn beside_embree(&self, order: &str) -> Option<f64> {
        let order = ORDERS.iter().position(|other| *other == order)?;
        let city = self.mesh(CITY)?;
        let fastest = city.embree.as_ref()?.rates.get(order)?.iter().copied().fold(0.0, f64::max);
        Some(city.rates[order][0] / fastest)
    }

    /// Time and memory to load the largest mesh, over Embree's.
    pub fn load_beside_embree(&self) -> Option<[f64; 2]> {
        let mesh = self.mesh(LARGEST)?;
        let embree = mesh.embree.as_ref()?;
        Some([mesh.load.0 / embree.load_s, mesh.load.1 / embree.peak])
    }

    /// The tables.
    pub fn text(&self) -> String {
        let (mut rays, mut loads) = (Vec::new(), Vec::new());
        for mesh in &self.meshes {
            for (number, order) in ORDERS.iter().enumerate() {
                let ours = mesh.rates[number].iter().map(|rate| three(*rate));
                let name = format!("{}, {order}", mesh.name);
                let mut row: Vec<String> = std::iter::once(name).chain(ours).collect();
                for (peer, ways) in [(&mesh.embree, 3), (&mesh.open3d, 1)] {
                    let rates = peer.as_ref().and_then(|peer| peer.rates.get(number));
                    let none = || vec!["–".to_owned(); ways];
                    row.extend(rates.map_or_else(none, |rates| {
                        rates.iter().map(|rate| three(*rate)).collect()
                    }));
                }
                rays.push(row);
            }
            let theirs = [&mesh.embree, &mesh.open3d].map(|peer| {
                let peer = peer.as_ref();
                peer.map(|peer| (peer.load_s, peer.peak))
            });
            let shown = |load: Option<(f64, f64)>| match load {
                Some((seconds, peak)) => [three(seconds), three(1e-6 * peak)],
                None => ["–", "–"].map(str::to_owned),
            };
            let cells = std::iter::once(Some(mesh.load)).chain(theirs).flat_map(shown);
            loads.push(std::iter::once(mesh.name.to_owned()).chain(cells).collect());
        }
        let ways = ["Embree, one by one", "16 at once", "16 at once, coherent", "Open3D"];
        let head = ["triangles, order"].into_iter().chain(WAYS.map(|(name, _)| name)).chain(ways);
        let rays = page::table(&head.collect::<Vec<_>>(), &rays);
        let head = ["triangles", "s", "MB", "Embree, s", "MB", "Open3D, s", "MB"];
        let loads = page::table(&head, &loads);
        let [closed, open] = self.leaks;
        let lacking = [&self.no_embree, &self.no_open3d].into_iter().flatten();
        let lacking: String = lacking.map(|why| format!(" {why}.")).collect();
        format!(
            "Millions of rays per second.{}\n\n{rays}\nTo load the same STL file and build what \
             rays are cast against; most memory of the program that does.\n\n{loads}\n\
             From inside a closed sphere of 360 000 triangles, {closed} of {} million rays get out; \
             with one triangle missing, {open}.",
            lacking,
            LEAKED_OF / 1_000_000
        )
    }
}
