//! The surroundings of the sensor: meshes, materials, transforms, ray casting.

mod approach;
mod assemble;
mod batch;
mod builtin;
mod car;
mod change;
mod closed_form;
mod coherence;
mod digest;
mod error;
mod file;
mod footing;
mod hits;
mod illuminated;
mod inside;
mod interferer;
pub mod material;
mod mesh;
mod meshes;
mod motion;
mod moving;
mod path;
mod person;
mod placed;
mod polygon;
mod pose;
mod raycast;
mod readers;
mod rig;
mod room;
mod rotation;
mod schema;
mod spanned;
mod stand;
mod trace;
mod typed;
mod world;

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

pub use builtin::builtin_names;
pub use car::SIZE as CAR_SIZE;
pub use change::{Changes, OF_SCENE, apart};
pub use closed_form::{Shape, Solid};
pub use error::Error;
pub use hits::{CastRays, Hit, Hits, Ray};
pub use illuminated::{Illuminated, LineOfSight};
pub use interferer::Interferer;
pub use material::{Diffuse, Finish, Material, library};
pub use mesh::Mesh;
pub use motion::{Motion, Moving};
pub use path::Waypoints;
pub use pose::{Pose, Transform};
pub use rig::{End, Ends, Mount, Pair, Rig};
pub(crate) use room::PER_TRIANGLE;
pub use room::Room;
pub use rotation::Rotation;
pub use schema::schema;
pub use trace::{SUB_MACROPULSES, Traced};

use crate::digest::Digest;
use crate::environment::Environment;
use crate::kernels::{LANES, Packet, fetch};
use crate::opened;
use coherence::Order;
use file::{Place, Source};
use world::{PacketHits, World};

/// Most rays that are put in order together.
const ORDERED: usize = 1 << 20;

/// Number of places by which directions of lasers that take turns are fetched into the cache ahead: sixteen
/// turns of 64 lasers. It casts a turning head 4 % faster.
const AHEAD: usize = 1024;

/// Everything the light can meet, and where the sensor stands.
///
/// World frame: x forward, y left, z up, metres.
pub struct Scene {
    /// Name, for reports.
    pub name: String,
    /// The TOML text that describes it, with the changes made to it.
    pub text: String,
    /// Materials of surfaces; [`Hit::material`] counts in this list.
    pub materials: Vec<Material>,
    /// Objects that surfaces belong to; [`Hit::object`] counts in this list.
    pub objects: Vec<Object>,
    /// Place and attitude of the sensor, at any time.
    pub sensor: Motion,
    /// All that moves, the sensor included; empty for a scene that stands still.
    pub moving: Vec<Moving>,
    /// Sun and air.
    pub environment: Environment,
    /// The other lidars whose light falls into the scene.
    pub interferers: Vec<Interferer>,
    /// Every assumption made while reading: units, axes, materials. To be shown to the user.
    pub notes: Vec<String>,
    /// Contents of its files that are left out: lines, skins, animations. To be shown to the user.
    pub warnings: Vec<String>,
    world: World,
    /// Digest of the triangles and shapes, in the order of the file.
    surfaces: Digest,
}

/// An object of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Name, as the scene file has it.
    pub name: String,
    /// Set if points on it are counted on their own.
    pub is_target: bool,
}

impl Scene {
    /// The built-in scene of this name, or else the scene file at this path.
    ///
    /// # Errors
    /// If it is neither, or the file is wrong; the message says what to do.
    pub fn open(name_or_file: impl AsRef<Path>) -> Result<Self, Error> {
        Self::open_in(name_or_file.as_ref(), Room::default())
    }

    /// As [`Scene::open`], if there is `room` for its meshes.
    fn open_in(path: &Path, room: Room) -> Result<Self, Error> {
        if let Some(name) = path.to_str()
            && let Some(text) = Self::builtin(name)
        {
            return Self::from_toml(text, name, Path::new(""));
        }
        let name = path.display().to_string();
        // A name that looks like a path is meant as one.
        if path.is_file() || path.extension().is_some() || path.components().count() > 1 {
            let (text, base) = text_of(path)?;
            return Self::from_toml_in(&text, &name, base, room);
        }
        Err(Error::UnknownScene {
            nearest: crate::names::nearest(&name, builtin_names()).map(str::to_owned),
            asked: name,
            known: builtin_names().collect::<Vec<_>>().join(", "),
        })
    }

    /// The scene file at `path`; meshes are looked for in its folder.
    ///
    /// # Errors
    /// If the file or one of its meshes cannot be read or is wrong.
    pub fn from_file(path: &Path) -> Result<Self, Error> {
        let (text, base) = text_of(path)?;
        Self::from_toml(&text, &path.display().to_string(), base)
    }

    /// The scene that `text` describes. `origin` is its name in messages; meshes are looked for
    /// in `base`.
    ///
    /// # Errors
    /// If the text or one of the meshes is wrong.
    pub fn from_toml(text: &str, origin: &str, base: &Path) -> Result<Self, Error> {
        Self::from_toml_in(text, origin, base, Room::default())
    }

    /// As [`Scene::from_toml`], if there is `room` for its meshes.
    fn from_toml_in(text: &str, origin: &str, base: &Path, room: Room) -> Result<Self, Error> {
        assemble::scene(Source::typed(text, origin), base, &BTreeMap::new(), room)
    }

    /// The scene that `table` describes, as a scene file does. `origin` is its name in messages,
    /// before the key; meshes are looked for by their names among `meshes`, and then as files in
    /// `base`.
    ///
    /// # Errors
    /// As [`Scene::from_toml`], with the key as the place.
    pub fn from_table(
        table: &toml::Table,
        origin: &str,
        base: &Path,
        meshes: &BTreeMap<String, Mesh>,
    ) -> Result<Self, Error> {
        let text = toml::to_string(table).map_err(|fault| Error::Keyed {
            origin: origin.to_owned(),
            key: String::new(),
            message: fault.to_string(),
        })?;
        let source = Source { text: &text, origin, place: Place::Key };
        assemble::scene(source, base, meshes, Room::default())
    }

    /// The TOML text of a built-in scene.
    pub fn builtin(name: &str) -> Option<&'static str> {
        builtin::text(name)
    }

    /// The names of the built-in scenes.
    pub fn builtin_names() -> impl Iterator<Item = &'static str> {
        builtin_names()
    }

    /// The nearest surface on `ray`, given in the world, with a range in (`nearest`, `farthest`),
    /// when the first scan begins.
    pub fn cast(&self, ray: &Ray, nearest: f64, farthest: f64) -> Option<Hit> {
        self.world.cast(ray, nearest, farthest)
    }

    /// As [`Scene::cast`], at `time_fs` from the beginning of the first scan, with a range within
    /// the limits `between`.
    pub fn cast_at(&self, ray: &Ray, time_fs: i64, between: (f64, f64)) -> Option<Hit> {
        self.world.cast_at(ray, time_fs, between)
    }

    /// How far the nearest surface lies on each of many rays from one place in the world, given by unit
    /// vectors, m; infinite where there is none before `farthest`. Several times as fast as [`Scene::cast`],
    /// with the same ranges. It is fastest if neighbours in the list point nearly the same way, for rays that
    /// do not are put in order first.
    pub fn cast_all(&self, origin: [f64; 3], directions: &[[f64; 3]], farthest: f64) -> Vec<f64> {
        let mut ranges = vec![f64::INFINITY; directions.len()];
        let from = (origin, farthest);
        for (ranges, directions) in ranges.chunks_mut(ORDERED).zip(directions.chunks(ORDERED)) {
            let of = |index: &u32| directions[*index as usize];
            match coherence::order(directions) {
                Order::AsTheyCome => self.cast_in_turn(
                    from,
                    (0..directions.len() as u32).zip(directions.iter().copied()),
                    ranges,
                ),
                Order::ByLaser(order) => {
                    let rays = order.iter().map(|index| {
                        fetch(directions, *index as usize + AHEAD);
                        (*index, of(index))
                    });
                    self.cast_in_turn(from, rays, ranges);
                }
                Order::AlongCurve(order) => {
                    // Fetched from all over at once: many are waited for together.
                    let directions: Vec<[f64; 3]> = order.iter().map(of).collect();
                    self.cast_in_turn(from, order.into_iter().zip(directions), ranges)
                }
            }
        }
        ranges
    }

    /// Casts rays, each with the index of its range, and writes down the ranges of those that meet a surface.
    fn cast_in_turn(
        &self,
        (origin, farthest): ([f64; 3], f64),
        mut rays: impl ExactSizeIterator<Item = (u32, [f64; 3])>,
        ranges: &mut [f64],
    ) {
        let (mut packet, mut hits) = (Packet::from(origin), PacketHits::default());
        let mut indices = [0; LANES];
        while rays.len() > 0 {
            let count = rays.len().min(LANES);
            packet.range = [f64::NAN; LANES];
            for (lane, (at, (index, direction))) in
                indices.iter_mut().zip(rays.by_ref()).enumerate()
            {
                packet.set(lane, direction, farthest);
                *at = index as usize;
            }
            self.world.cast_packet_at(&mut packet, &[0; LANES], &mut hits);
            for lane in (0..count).filter(|lane| hits.is_hit(&packet, *lane)) {
                ranges[indices[lane]] = packet.range[lane];
            }
        }
    }

    /// Number of triangles; closed-form shapes have none.
    pub fn triangles(&self) -> usize {
        self.world.triangles()
    }

    /// How many triangles are in memory, those of a mesh that stands in many places once, and how many
    /// shapes and places of meshes.
    pub fn kept(&self) -> (usize, usize) {
        self.world.kept()
    }

    /// Its materials as light of `wavelength` metres sees them.
    pub fn finishes(&self, wavelength: f64) -> Vec<Finish> {
        self.materials.iter().map(|material| material.at(wavelength)).collect()
    }

    /// A hash of everything that decides what light meets, and which light there is beside that
    /// of the sensor: surfaces, materials, sensor pose, motion, other lidars.
    /// The same on every machine and run.
    pub fn digest(&self) -> String {
        let mut hash = self.surfaces.clone();
        for material in &self.materials {
            hash.bytes(material.name.as_bytes());
            let Material { diffuse, specular, gloss, retro, transmission, .. } = *material;
            hash.diffuse(diffuse);
            for value in [specular, gloss, retro, transmission] {
                hash.number(value);
            }
        }
        for object in &self.objects {
            hash.bytes(object.name.as_bytes());
            hash.bytes(&[u8::from(object.is_target)]);
        }
        hash.motion(&self.sensor);
        hash.environment(&self.environment);
        self.interferers.iter().for_each(|interferer| hash.interferer(interferer));
        hash.text()
    }
}

/// The text of the scene file at `path`, and the folder in which its meshes are looked for.
fn text_of(path: &Path) -> Result<(String, &Path), Error> {
    let text =
        opened::text(path).map_err(|source| Error::Unreadable { path: path.to_owned(), source })?;
    Ok((text, path.parent().unwrap_or(Path::new(""))))
}

impl fmt::Debug for Scene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scene")
            .field("name", &self.name)
            .field("materials", &self.materials)
            .field("objects", &self.objects)
            .field("sensor", &self.sensor)
            .field("moving", &self.moving)
            .field("environment", &self.environment)
            .field("interferers", &self.interferers)
            .field("notes", &self.notes)
            .field("warnings", &self.warnings)
            .field("triangles", &self.triangles())
            .finish_non_exhaustive()
    }
}
