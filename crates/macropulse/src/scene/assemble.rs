//! From a scene file as typed to a scene that can be hit by rays.

mod materials;
mod shapes;

use std::collections::{BTreeMap, HashMap};
use std::ops::{Range, RangeInclusive};
use std::path::Path;
use std::rc::Rc;

use glam::DVec3;

use super::car;
use super::closed_form::{Shape, Solid};
use super::error::Error;
use super::file::{Axis, Ground, ObjectTyped, SceneFile, Source, Unit, object_names};
use super::inside;
use super::interferer;
use super::material::Material;
use super::mesh::Mesh;
use super::meshes::{Meshes, Origin};
use super::motion::{Motion, Moving};
use super::moving::{Mover, MovingShape};
use super::placed::{self, Placed, stand};
use super::pose::Pose;
use super::readers::{self, Reach, Read, WithoutMaterials};
use super::room::Room;
use super::spanned::Spanned;
use super::stand::Stand;
use super::typed::{FARTHEST, is_length};
use super::{Object, Scene};
use crate::digest::Digest;
use crate::environment::Environment;
use crate::names::line_column;

/// The parts of a scene that have been put together so far.
struct Assembly<'a> {
    source: Source<'a>,
    base: &'a Path,
    /// True if meshes may name files anywhere.
    outside: bool,
    room: Room,
    /// Meshes in memory, by name; they go before files.
    given: &'a BTreeMap<String, Mesh>,
    /// Materials the file defines; they go before the library.
    defined: Vec<Material>,
    materials: Vec<Material>,
    objects: Vec<Object>,
    solids: Vec<Solid>,
    placed: Vec<Placed>,
    moving_shapes: Vec<MovingShape>,
    moving: Vec<Moving>,
    notes: Vec<String>,
    warnings: Vec<String>,
    meshes: Meshes,
}

/// Makes the scene that `source` describes, if there is `room` for its meshes; they are looked for
/// among those `given`, and then in `base`.
pub(super) fn scene(
    source: Source<'_>,
    base: &Path,
    given: &BTreeMap<String, Mesh>,
    room: Room,
) -> Result<Scene, Error> {
    let file = source.parse()?;
    if *file.version.get_ref() != 1 {
        let message = format!("version {} is not known; write version = 1", file.version.get_ref());
        return Err(source.fault(file.version.span(), message));
    }
    let mut assembly = Assembly {
        source,
        base,
        outside: file.outside_files,
        room,
        given,
        defined: vec![],
        materials: vec![],
        objects: vec![],
        solids: vec![],
        placed: vec![],
        moving_shapes: vec![],
        moving: vec![],
        notes: vec![],
        warnings: vec![],
        meshes: Meshes::default(),
    };
    assembly.define(&file)?;
    let environment = assembly.environment(&file)?;
    let sensor = assembly.motion("sensor", &file.sensor)?;
    if file.sensor.position_m.is_none() && file.sensor.path.is_none() {
        assembly.notes.push("sensor: no position_m given, it stands at the origin".to_owned());
    }
    if sensor.moves() {
        let note = "sensor: each point is in its frame at the time of the point, not deskewed";
        assembly.notes.push(note.to_owned());
    }
    let stands = sensor.at_start().position;
    if let Some(ground) = &file.ground {
        let height = assembly.ground(ground)?;
        let below = height - stands[2];
        if below > 0.0 {
            let note = format!(
                "sensor: it stands {below:.2} m below the ground; lift it, unless that is meant"
            );
            assembly.notes.push(note);
        }
    }
    for (name, written) in assembly.names(&file)?.into_iter().zip(&file.objects) {
        assembly.add_object(name, written)?;
    }
    let shapes = assembly.solids.len() + assembly.moving_shapes.len();
    if shapes == 0 && assembly.placed.is_empty() {
        assembly.notes.push("the scene is empty: every ray goes to the sky".to_owned());
    }
    let motion = |stand: &Stand| source.motion(stand);
    let (interferers, assumed) =
        interferer::interferers((source, base), &file.interferers, motion)?;
    for interferer in &interferers {
        assembly.enter(&interferer.name, &interferer.motion);
    }
    assembly.notes.extend(assumed);
    let Assembly { materials, objects, solids, placed, moving_shapes, moving, meshes, .. } =
        assembly;
    let (mut notes, warnings) = (assembly.notes, assembly.warnings);
    // The world has triangles of its own: nothing else may hold meshes while it is made.
    drop(meshes);
    let name = file.name.unwrap_or_else(|| source.origin.to_owned());
    let mut surfaces = Digest::new();
    surfaces.all_placed(&placed);
    solids.iter().for_each(|solid| surfaces.solid(solid));
    for MovingShape { solid, motion } in &moving_shapes {
        surfaces.solid(solid);
        surfaces.motion(motion);
    }
    let first: Vec<Solid> = moving_shapes.iter().map(MovingShape::at_first).collect();
    let mut shapes = inside::shapes_around(&solids, stands);
    shapes.extend(inside::shapes_around(&first, stands));
    let meshes: Vec<u16> = placed.iter().map(|placed| placed.object).collect();
    let mut movers: Vec<Mover> = moving_shapes.into_iter().map(Mover::from).collect();
    movers.extend(placed::movers(&placed));
    let world = placed::world(placed, solids, stands).with(movers);
    let meshes = inside::meshes_around(&world, &meshes, stands);
    notes.extend(shapes.iter().chain(&meshes).map(|object| {
        let name = &objects[usize::from(*object)].name;
        format!("sensor: it stands inside {name}; move one of them, unless that is meant")
    }));
    Ok(Scene {
        name,
        text: source.text.to_owned(),
        materials,
        objects,
        sensor,
        moving,
        environment,
        interferers,
        notes,
        warnings,
        world,
        surfaces,
    })
}

/// Longest sides of meshes, m, that are no sign of another unit.
const USUAL_SIZES: RangeInclusive<f64> = 0.02..=1000.0;

impl Assembly<'_> {
    /// Sun and air; those of a clear day where the file names none.
    fn environment(&mut self, file: &SceneFile) -> Result<Environment, Error> {
        let Some(typed) = &file.environment else {
            let assumed = Environment::default();
            let (name, conditions) = (&assumed.name, assumed.conditions());
            self.notes.push(format!("environment: none given, {name} is assumed: {conditions}"));
            return Ok(assumed);
        };
        Environment::read(typed.get_ref()).map_err(|error| {
            let key = format!("environment.{}", error.key);
            self.source.fault_at_key(&key, typed.span(), error.to_string())
        })
    }

    /// Adds the ground; gives its height, m.
    fn ground(&mut self, ground: &Ground) -> Result<f64, Error> {
        let material = self.material_typed(&ground.material)?;
        let spans = [
            ground.velocity_m_s.as_ref().map(|typed| typed.span()),
            ground.turn_rate_deg_s.as_ref().map(|typed| typed.span()),
            ground.path.as_ref().map(|typed| typed.span()),
        ];
        if let Some(span) = spans.into_iter().flatten().next() {
            let message = "the ground cannot move; let the sensor and the objects move over it";
            return Err(self.source.fault(span, message));
        }
        let height = ground.z_m.as_ref().map_or(Ok(0.0), |z| self.source.coordinate(z, "z_m"))?;
        let object = self.object("ground".to_owned(), false, 0..0)?;
        let shape = Shape::Plane { normal: [0.0, 0.0, 1.0] };
        self.solids.push(Solid::new(shape, Pose::at([0.0, 0.0, height]), material, object));
        Ok(height)
    }

    /// Returns the names of the objects of the file; refuses two of one name.
    fn names(&self, file: &SceneFile) -> Result<Vec<String>, Error> {
        let typed: Vec<Option<&Spanned<String>>> =
            file.objects.iter().map(|object| object.get_ref().name.as_ref()).collect();
        let ground = file.ground.as_ref().map(|ground| ("ground", ground.material.span()));
        let mut taken: HashMap<&str, Range<usize>> = ground.into_iter().collect();
        for name in typed.iter().flatten() {
            if name.get_ref().trim().is_empty() {
                let message = "an object has an empty name; give it one, or leave `name` out";
                return Err(self.source.fault(name.span(), message.to_owned()));
            }
            if let Some(first) = taken.insert(name.get_ref(), name.span()) {
                let (line, column) = line_column(self.source.text, first.start);
                let message = format!(
                    "another object is called {:?} at line {line}, column {column}; give one of \
                     them another name",
                    name.get_ref()
                );
                return Err(self.source.fault(name.span(), message));
            }
        }
        let typed: Vec<Option<&str>> =
            typed.iter().map(|name| name.map(|name| name.get_ref().as_str())).collect();
        Ok(object_names(&typed))
    }

    fn add_object(&mut self, name: String, spanned: &Spanned<ObjectTyped>) -> Result<(), Error> {
        let written = spanned.get_ref();
        let kinds = [written.mesh.is_some(), written.car.is_some(), written.shape.is_some()];
        if kinds.iter().filter(|given| **given).count() != 1 {
            let message = format!("{name} needs exactly one of `mesh`, `car` and `shape`");
            return Err(self.source.fault(spanned.span(), message));
        }
        let mut stands = vec![written.stand()];
        stands.extend(written.copies.iter().cloned());
        let mut motions = Vec::with_capacity(stands.len());
        for (copy, stand) in stands.iter().enumerate() {
            let called = match copy {
                0 => name.clone(),
                _ => format!("{name}, copy {copy}"),
            };
            motions.push(self.motion(&called, stand)?);
        }
        let object = self.object(name.clone(), written.target, spanned.span())?;
        if let Some(shape) = &written.shape {
            self.source.refuse_mesh_keys(written)?;
            return self.add_shape((&name, object), (written, shape), &motions);
        }
        let origin = self.mesh_origin(&name, written)?;
        let (given, reach) = (self.given, Reach { scene: self.base, outside: self.outside });
        let room = self.room.beside(self.meshes.triangles());
        let known = self.meshes.of(&origin, || read(&origin, given, (reach, room)))?;
        let mesh = Rc::clone(&known.mesh);
        self.warnings.extend(known.left_out.iter().map(|said| format!("{name}: {said}")));
        if let Some(path) = written.mesh.as_ref().filter(|_| !reaches_no_farther(&mesh)) {
            let message = format!(
                "{name}: its mesh reaches farther than {FARTHEST:e} m from its origin; give it another \
                 `unit` or `scale`, or export it again"
            );
            return Err(self.source.fault(path.span(), message));
        }
        if origin != Origin::Car {
            let ([x, y, z], count) = (known.size, mesh.triangles.len());
            self.notes.push(format!(
                "{name}: {count} triangles, {x:.2} m long, {y:.2} m wide, {z:.2} m high"
            ));
            let (longest, is_typed) = (x.max(y).max(z), written.unit.is_some());
            if !is_typed && written.scale.is_none() && !USUAL_SIZES.contains(&longest) {
                self.notes.push(format!(
                    "{name}: hardly anything is {longest} m long; say with `unit` what its mesh is \
                     drawn in, as unit = \"mm\""
                ));
            }
        }
        let mut at = Vec::new();
        let mut moving = Vec::new();
        for motion in motions {
            let mut place = |pose: &Pose| stand(&mut known.footing, pose, written.rest_on_ground);
            match &motion {
                Motion::Still(pose) => at.push(place(pose)),
                _ => moving.push(motion.placed(|pose| place(pose).point([0.0; 3]))),
            }
        }
        let material_indices = self.material_indices(&name, written, &mesh)?;
        self.placed.push(Placed { mesh, material_indices, at, moving, object });
        Ok(())
    }

    /// Returns the origin of the mesh of an object.
    fn mesh_origin(&mut self, name: &str, written: &ObjectTyped) -> Result<Origin, Error> {
        let Some(path) = &written.mesh else {
            self.source.refuse_mesh_keys(written)?;
            return Ok(Origin::Car);
        };
        let without = match written.material {
            Some(_) => WithoutMaterials::Fine,
            None => WithoutMaterials::Refused,
        };
        let called = path.get_ref();
        let is_given = self.given.contains_key(called);
        let path = self.base.join(called);
        let metres = self.metres_per_unit(name, written)?;
        let is_gltf = !is_given && readers::is_gltf(&path);
        let (up, forward) = self.axes(name, written, is_gltf)?;
        if is_given {
            return Ok(Origin::Given { name: called.clone(), metres, up, forward });
        }
        Ok(Origin::File { path, without, metres, up, forward })
    }

    fn metres_per_unit(&mut self, name: &str, written: &ObjectTyped) -> Result<f64, Error> {
        let scale = match &written.scale {
            Some(scale) => self.source.positive(scale, "scale")?,
            None => 1.0,
        };
        if written.unit.is_none() && written.scale.is_none() {
            self.notes.push(format!("{name}: no unit given, its lengths are read as metres"));
        }
        let unit = written.unit.as_ref().map_or(Unit::M, |unit| *unit.get_ref());
        Ok(scale * unit.metres())
    }

    /// Up and forward of a mesh, as unit vectors in its own axes.
    fn axes(
        &mut self,
        name: &str,
        written: &ObjectTyped,
        gltf: bool,
    ) -> Result<(DVec3, DVec3), Error> {
        // glTF 2.0 declares y up and z forward; the other formats declare nothing.
        let usual = if gltf { (Axis::Y, Axis::Z) } else { (Axis::Z, Axis::X) };
        let up = written.up.as_ref().map_or(usual.0, |axis| *axis.get_ref());
        let across = |axis: Axis| DVec3::from(axis.vector()).dot(DVec3::from(up.vector())) == 0.0;
        let fallback = [usual.1, Axis::X, Axis::Z].into_iter().find(|axis| across(*axis));
        let forward = match &written.forward {
            Some(typed) if !across(*typed.get_ref()) => {
                let message = "`forward` and `up` lie on the same axis; name two different ones";
                return Err(self.source.fault(typed.span(), message));
            }
            Some(typed) => *typed.get_ref(),
            None => fallback.unwrap_or(Axis::X),
        };
        let why = if gltf { "as glTF has it" } else { "assumed" };
        for (given, key, axis) in
            [(written.up.is_some(), "up", up), (written.forward.is_some(), "forward", forward)]
        {
            if !given {
                self.notes.push(format!("{name}: {key} is its {} axis, {why}", axis.word()));
            }
        }
        Ok((DVec3::from(up.vector()), DVec3::from(forward.vector())))
    }

    /// Returns the pose and motion of the thing called `name`; enters it among the moving things.
    fn motion(&mut self, name: &str, stand: &Stand) -> Result<Motion, Error> {
        let motion = self.source.motion(stand)?;
        self.enter(name, &motion);
        Ok(motion)
    }

    /// Enters the thing called `name` among the moving things, if it moves.
    fn enter(&mut self, name: &str, motion: &Motion) {
        if motion.moves() {
            self.notes.push(format!("{name}: {}", motion.told()));
            self.moving.push(Moving { name: name.to_owned(), motion: motion.clone() });
        }
    }

    fn object(&mut self, name: String, is_target: bool, at: Range<usize>) -> Result<u16, Error> {
        let index = u16::try_from(self.objects.len())
            .map_err(|_| self.source.fault(at, "a scene holds at most 65 536 objects"))?;
        self.objects.push(Object { name, is_target });
        Ok(index)
    }
}

/// Returns true if all of a mesh lies where coordinates may be.
fn reaches_no_farther(mesh: &Mesh) -> bool {
    let ends = mesh.bounds().into_iter().flat_map(|(low, high)| [low, high]);
    ends.flatten().all(is_length)
}

/// The mesh of this origin, as its file has it, or as it is `given`.
fn read(
    origin: &Origin,
    given: &BTreeMap<String, Mesh>,
    within: (Reach<'_>, Room),
) -> Result<Read, Error> {
    match origin {
        Origin::Car => car::mesh().map(Read::from),
        Origin::Given { name, .. } => {
            let mesh = given.get(name).cloned().unwrap_or_default();
            mesh.checked(Path::new(name)).map(Read::from)
        }
        Origin::File { path, without, .. } => readers::read(path, *without, within),
    }
}
