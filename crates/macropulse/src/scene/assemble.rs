//! From a scene file as typed to a scene that can be hit by rays.

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;
use std::rc::Rc;

use glam::DVec3;
use toml::Spanned;

use super::car;
use super::closed_form::{Shape, Solid};
use super::error::Error;
use super::file::{
    Axis, Ground, ObjectTyped, SceneFile, ShapeTyped, Source, Stand, Unit, object_names,
};
use super::inside;
use super::interferer;
use super::material::{self, Material, plain};
use super::mesh::Mesh;
use super::placed::{self, Placed, stand};
use super::pose::Pose;
use super::readers::{self, WithoutMaterials};
use super::{Object, Scene};
use crate::digest::Digest;
use crate::environment::Environment;
use crate::names::line_column;

/// What has been put together so far.
struct Assembly<'a> {
    source: Source<'a>,
    base: &'a Path,
    /// Materials the file defines; they go before the library.
    defined: Vec<Material>,
    materials: Vec<Material>,
    objects: Vec<Object>,
    solids: Vec<Solid>,
    placed: Vec<Placed>,
    notes: Vec<String>,
    /// The mesh of the car, once there is one.
    car: Option<Rc<Mesh>>,
}

/// Makes the scene that `source` describes; meshes are looked for in `base`.
pub(super) fn scene(source: Source<'_>, base: &Path) -> Result<Scene, Error> {
    let file = source.parse()?;
    if *file.version.get_ref() != 1 {
        let message = format!("version {} is not known; write version = 1", file.version.get_ref());
        return Err(source.fault(file.version.span(), message));
    }
    let mut assembly = Assembly {
        source,
        base,
        defined: vec![],
        materials: vec![],
        objects: vec![],
        solids: vec![],
        placed: vec![],
        notes: vec![],
        car: None,
    };
    assembly.define(&file)?;
    let environment = assembly.environment(&file)?;
    let sensor = assembly.pose(&file.sensor)?;
    if file.sensor.position_m.is_none() {
        assembly.notes.push("sensor: no position_m given, it stands at the origin".to_owned());
    }
    if let Some(ground) = &file.ground {
        let height = assembly.ground(ground)?;
        let below = height - sensor.position[2];
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
    if assembly.solids.is_empty() && assembly.placed.is_empty() {
        assembly.notes.push("the scene is empty: every ray goes to the sky".to_owned());
    }
    let pose = |stand: &Stand| assembly.pose(stand);
    let (interferers, assumed) = interferer::interferers((source, base), &file.interferers, pose)?;
    assembly.notes.extend(assumed);
    let Assembly { materials, objects, solids, placed, mut notes, .. } = assembly;
    let name = file.name.unwrap_or_else(|| source.origin.to_owned());
    let mut surfaces = Digest::new();
    placed.iter().for_each(|placed| surfaces.placed(placed));
    solids.iter().for_each(|solid| surfaces.solid(solid));
    let shapes = inside::shapes_around(&solids, sensor.position);
    let meshes: Vec<u16> = placed.iter().map(|placed| placed.object).collect();
    let world = placed::world(placed, solids, sensor.position);
    let meshes = inside::meshes_around(&world, &meshes, sensor.position);
    notes.extend(shapes.iter().chain(&meshes).map(|object| {
        let name = &objects[usize::from(*object)].name;
        format!("sensor: it stands inside {name}; move one of them, unless that is meant")
    }));
    Ok(Scene { name, materials, objects, sensor, environment, interferers, notes, world, surfaces })
}

impl Assembly<'_> {
    fn define(&mut self, file: &SceneFile) -> Result<(), Error> {
        for typed in &file.materials {
            let defined = typed.get_ref();
            // A name of the library overrides that entry and keeps what is not typed.
            let mut made =
                material::named(&defined.name).unwrap_or_else(|| Material::matt("", 0.0));
            if made.name.is_empty() && defined.diffuse.is_none() {
                let message = format!(
                    "material {:?} is not in the library, so it needs at least `diffuse`",
                    defined.name
                );
                return Err(self.source.fault(typed.span(), message));
            }
            made.name = plain(&defined.name);
            let fields = [
                (&defined.diffuse, &mut made.diffuse, "diffuse", 1.0),
                (&defined.specular, &mut made.specular, "specular", 1e4),
                (&defined.gloss, &mut made.gloss, "gloss", 1e6),
                (&defined.retro, &mut made.retro, "retro", 1e5),
                (&defined.transmission, &mut made.transmission, "transmission", 1.0),
            ];
            for (typed, field, key, most) in fields {
                let Some(typed) = typed else { continue };
                let value = *typed.get_ref();
                if !(0.0..=most).contains(&value) {
                    let message = format!("{key} is {value}; it must be from 0 to {most}");
                    return Err(self.source.fault(typed.span(), message));
                }
                *field = value;
            }
            self.defined.retain(|known| known.name != made.name);
            self.defined.push(made);
        }
        Ok(())
    }

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
        let height = ground.z_m.as_ref().map_or(Ok(0.0), |z| self.finite(z, "z_m"))?;
        let object = self.object("ground".to_owned(), false, 0..0)?;
        let shape = Shape::Plane { normal: [0.0, 0.0, 1.0] };
        self.solids.push(Solid::new(shape, Pose::at([0.0, 0.0, height]), material, object));
        Ok(height)
    }

    /// What the objects of the file are called; refuses two of one name.
    fn names(&self, file: &SceneFile) -> Result<Vec<String>, Error> {
        let typed: Vec<Option<&Spanned<String>>> =
            file.objects.iter().map(|object| object.get_ref().name.as_ref()).collect();
        let ground = file.ground.as_ref().map(|ground| ("ground", ground.material.span()));
        let mut taken: HashMap<&str, Range<usize>> = ground.into_iter().collect();
        for name in typed.iter().flatten() {
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
            let message = "an object needs exactly one of `mesh`, `car` and `shape`";
            return Err(self.source.fault(spanned.span(), message));
        }
        let mut stands = vec![written.stand()];
        stands.extend(written.copies.iter().cloned());
        let poses = stands.iter().map(|stand| self.pose(stand)).collect::<Result<Vec<_>, _>>()?;
        let object = self.object(name.clone(), written.target, spanned.span())?;
        if let Some(shape) = &written.shape {
            self.refuse_mesh_keys(written)?;
            let material = match &written.material {
                Some(typed) => self.material_typed(typed)?,
                None => self.unnamed(&name),
            };
            for mut pose in poses {
                let shape = self.shape(shape)?;
                if written.rest_on_ground {
                    pose.position[2] += shape.depth_below(&pose);
                }
                self.solids.push(Solid::new(shape, pose, material, object));
            }
            return Ok(());
        }
        let mesh = self.mesh(&name, written)?;
        let material_indices = self.material_indices(&name, written, &mesh)?;
        let stand = |pose: &Pose| stand(&mesh, pose, written.rest_on_ground);
        let at = poses.iter().map(stand).collect();
        self.placed.push(Placed { mesh, material_indices, at, object });
        Ok(())
    }

    /// The mesh of an object in metres, x forward, z up.
    fn mesh(&mut self, name: &str, written: &ObjectTyped) -> Result<Rc<Mesh>, Error> {
        let Some(path) = &written.mesh else {
            self.refuse_mesh_keys(written)?;
            let car = match self.car.take() {
                Some(car) => car,
                None => Rc::new(car::mesh()?),
            };
            return Ok(Rc::clone(self.car.insert(car)));
        };
        let without = match written.material {
            Some(_) => WithoutMaterials::Fine,
            None => WithoutMaterials::Refused,
        };
        let path = self.base.join(path.get_ref());
        let mut mesh = readers::read(&path, without)?;
        let gltf = readers::is_gltf(&path);
        let metres = self.metres_per_unit(name, written)?;
        let (up, forward) = self.axes(name, written, gltf)?;
        let left = up.cross(forward);
        for vertex in &mut mesh.vertices {
            let place = DVec3::from(*vertex) * metres;
            *vertex = [place.dot(forward), place.dot(left), place.dot(up)];
        }
        if let Some((low, high)) = mesh.bounds() {
            let [x, y, z] = [0, 1, 2].map(|axis| high[axis] - low[axis]);
            let count = mesh.triangles.len();
            self.notes.push(format!(
                "{name}: {count} triangles, {x:.2} m long, {y:.2} m wide, {z:.2} m high"
            ));
        }
        Ok(Rc::new(mesh))
    }

    fn metres_per_unit(&mut self, name: &str, written: &ObjectTyped) -> Result<f64, Error> {
        let scale = match &written.scale {
            Some(scale) => self.positive(scale, "scale")?,
            None => 1.0,
        };
        if written.unit.is_none() && written.scale.is_none() {
            self.notes.push(format!("{name}: no unit given, its lengths are read as metres"));
        }
        Ok(scale * written.unit.unwrap_or(Unit::M).metres())
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

    /// For each material of the mesh, the index of the one it stands for in the scene.
    fn material_indices(
        &mut self,
        name: &str,
        written: &ObjectTyped,
        mesh: &Mesh,
    ) -> Result<Vec<u16>, Error> {
        for (wanted, typed) in &written.materials {
            if !mesh.material_names.contains(wanted) {
                let own: Vec<&str> = mesh
                    .material_names
                    .iter()
                    .map(String::as_str)
                    .filter(|n| !n.is_empty())
                    .collect();
                let message = if own.is_empty() {
                    format!(
                        "the mesh of {name} names no materials; give all of it `material = \"…\"`"
                    )
                } else {
                    format!(
                        "the mesh of {name} has no material {wanted:?}; it has {}",
                        own.join(", ")
                    )
                };
                return Err(self.source.fault(typed.span(), message));
            }
        }
        let mut indices = Vec::with_capacity(mesh.material_names.len());
        for (own, guess) in mesh.material_names.iter().zip(&mesh.diffuse_guesses) {
            let known = self.known(own);
            indices.push(match (written.materials.get(own), &written.material, known, guess) {
                (Some(typed), ..) | (None, Some(typed), ..) => self.material_typed(typed)?,
                (None, None, Some(known), _) => self.enlist(known),
                (None, None, None, Some(diffuse)) => {
                    self.notes.push(format!(
                        "{name}: material {own:?} is not in the library, its visible colour is \
                         taken as a diffuse reflectance of {diffuse:.2}"
                    ));
                    self.enlist(Material::matt(&format!("{name}/{}", plain(own)), *diffuse))
                }
                (None, None, None, None) => self.unnamed(&format!("{name}, {own:?}")),
            });
        }
        Ok(indices)
    }

    fn shape(&self, typed: &Spanned<ShapeTyped>) -> Result<Shape, Error> {
        let fault = |message: &str| Err(self.source.fault(typed.span(), message));
        match *typed.get_ref() {
            ShapeTyped::Plane { normal } => match DVec3::from(normal).try_normalize() {
                Some(normal) => Ok(Shape::Plane { normal: normal.to_array() }),
                None => fault("`normal` must be a finite direction, not zero"),
            },
            ShapeTyped::Sphere { radius_m: radius } => match radius > 0.0 && radius.is_finite() {
                true => Ok(Shape::Sphere { radius }),
                false => fault("`radius_m` must be finite and above zero"),
            },
            ShapeTyped::Box { size_m } => match size_m.iter().all(|s| *s > 0.0 && s.is_finite()) {
                true => Ok(Shape::Box { half: size_m.map(|side| side / 2.0) }),
                false => fault("each of `size_m` must be finite and above zero"),
            },
        }
    }

    /// Keys that mean something only for the mesh of a file.
    fn refuse_mesh_keys(&self, written: &ObjectTyped) -> Result<(), Error> {
        let spans: [(Option<Range<usize>>, &str); 3] = [
            (written.scale.as_ref().map(Spanned::span), "scale"),
            (written.up.as_ref().map(Spanned::span), "up"),
            (written.forward.as_ref().map(Spanned::span), "forward"),
        ];
        for (span, key) in spans {
            if let Some(span) = span {
                let message = format!("`{key}` belongs to objects with a `mesh`; remove it here");
                return Err(self.source.fault(span, message));
            }
        }
        Ok(())
    }

    fn pose(&self, stand: &Stand) -> Result<Pose, Error> {
        let mut pose = Pose::default();
        if let Some(position) = &stand.position_m {
            if position.get_ref().iter().any(|value| !value.is_finite()) {
                let message = "position_m must be three finite numbers";
                return Err(self.source.fault(position.span(), message));
            }
            pose.position = *position.get_ref();
        }
        let angle = |typed: &Option<Spanned<f64>>, key: &str| match typed {
            Some(typed) => Ok(self.finite(typed, key)?.to_radians()),
            None => Ok(0.0),
        };
        pose.yaw = angle(&stand.yaw_deg, "yaw_deg")?;
        pose.pitch = angle(&stand.pitch_deg, "pitch_deg")?;
        pose.roll = angle(&stand.roll_deg, "roll_deg")?;
        Ok(pose)
    }

    fn finite(&self, typed: &Spanned<f64>, key: &str) -> Result<f64, Error> {
        let value = *typed.get_ref();
        match value.is_finite() {
            true => Ok(value),
            false => Err(self.source.fault(typed.span(), format!("{key} must be a finite number"))),
        }
    }

    fn positive(&self, typed: &Spanned<f64>, key: &str) -> Result<f64, Error> {
        let value = self.finite(typed, key)?;
        match value > 0.0 {
            true => Ok(value),
            false => {
                let message = format!("{key} is {value}; it must be above zero");
                Err(self.source.fault(typed.span(), message))
            }
        }
    }

    fn object(&mut self, name: String, is_target: bool, at: Range<usize>) -> Result<u16, Error> {
        let index = u16::try_from(self.objects.len())
            .map_err(|_| self.source.fault(at, "a scene holds at most 65 536 objects"))?;
        self.objects.push(Object { name, is_target });
        Ok(index)
    }

    /// The material of this name: as the file defines it, else from the library.
    fn known(&self, name: &str) -> Option<Material> {
        let wanted = plain(name);
        let defined = self.defined.iter().find(|known| known.name == wanted).cloned();
        defined.or_else(|| material::named(name))
    }

    fn material_typed(&mut self, typed: &Spanned<String>) -> Result<u16, Error> {
        let name = typed.get_ref();
        if let Some(known) = self.known(name) {
            return Ok(self.enlist(known));
        }
        let library: Vec<Material> =
            self.defined.iter().cloned().chain(material::library()).collect();
        let names = || library.iter().map(|known| known.name.as_str());
        let message = match crate::names::nearest(&plain(name), names()) {
            Some(near) => format!("there is no material {name:?}; did you mean {near:?}?"),
            None => format!(
                "there is no material {name:?}; define it as [[material]] or use one of {}",
                names().collect::<Vec<_>>().join(", ")
            ),
        };
        Err(self.source.fault(typed.span(), message))
    }

    fn unnamed(&mut self, whose: &str) -> u16 {
        let material =
            self.known(material::UNNAMED).unwrap_or_else(|| Material::matt(material::UNNAMED, 0.3));
        self.notes.push(format!(
            "{whose}: no known material, diffuse reflectance {} is assumed",
            material.diffuse
        ));
        self.enlist(material)
    }

    /// The index of `material` in the scene, which it enters if it is new there.
    fn enlist(&mut self, material: Material) -> u16 {
        let index = self.materials.iter().position(|known| known.name == material.name);
        let index = index.unwrap_or_else(|| {
            self.materials.push(material);
            self.materials.len() - 1
        });
        u16::try_from(index).unwrap_or(u16::MAX)
    }
}
