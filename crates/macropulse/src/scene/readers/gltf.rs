//! glTF 2.0: `.glb`, and `.gltf` with buffers beside it or in `data:` URIs \[glTF2\].
//!
//! The crate `gltf` reads the document. It takes a sound file for granted in places, so everything that it
//! may stumble over is checked before it is asked: `document` checks the container and the indices, `buffers`
//! the bytes, and `accessor` the range of each accessor. The sizes that a file asks for are limited before
//! memory is spent on them.
//!
//! The crate keeps the numbers of nodes and colours in single precision: a node 50 km from the
//! origin is placed to 4 mm.

mod accessor;
mod buffers;
mod document;

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::{BufRead as _, Read as _};
use std::path::Path;

use ::gltf::material::AlphaMode;
use ::gltf::mesh::Mode;
use ::gltf::scene::Transform;
use ::gltf::{Document, Material, Node, Primitive, Semantic};
use glam::{DMat4, DQuat, DVec3};

use super::{
    DAMAGED, Reach, Read, counted, luminance, no_surfaces, open, too_many_materials, transparency,
};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;
use crate::scene::room::Room;
use accessor::Buffers;

/// Bytes of the file, or made from them.
type Bytes<'a> = Cow<'a, [u8]>;

/// Most bytes of a file, and most of all its buffers together.
const MOST_BYTES: u64 = 1 << 30;

/// Most vertices, and most triangles, of all nodes together.
const MOST_CORNERS: usize = 1 << 25;

/// Most nodes and surfaces that are visited: many nodes may share a mesh of many.
const MOST_VISITS: usize = 1 << 20;

const TOO_LARGE: &str = "export it in parts or with fewer details";

/// Reads the default scene of the glTF file at `path`, or its first, as one mesh in the axes of
/// the file, m.
pub(super) fn read(path: &Path, (reach, room): (Reach<'_>, Room)) -> Result<Read, Error> {
    let bytes = whole(path)?;
    let damaged = |problem: String| Error::mesh(path, problem, DAMAGED);
    if document::is_old_container(&bytes) {
        return Err(document::version_1(path));
    }
    let [text, binary] = document::container(&bytes).map_err(damaged)?;
    let document = document::document(path, &text)?;
    let bytes = buffers::buffers((path, reach), &document, binary)?;
    let quantised = document.extensions_used().any(|name| name == document::QUANTISED);
    let mut walk = Walk {
        buffers: Buffers { bytes, quantised },
        mesh: Mesh::default(),
        materials: HashMap::new(),
        visits: MOST_VISITS,
        limits: [MOST_CORNERS; 2],
        room: (room, path),
        told: Told::default(),
    };
    walk.all(&document).map_err(|fault| match fault {
        Fault::Damaged(problem) => damaged(problem.into_owned()),
        Fault::Materials => too_many_materials(path),
        Fault::NoRoom(error) => error,
        Fault::TooLarge(what) => Error::mesh(path, format!("holds more than {what}"), TOO_LARGE),
    })?;
    Ok(Read { left_out: walk.told.left_out(&document), mesh: walk.mesh })
}

/// The bytes of a file that is not too large.
fn whole(path: &Path) -> Result<Vec<u8>, Error> {
    let unreadable = |source| Error::Unreadable { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    let mut file = open(path)?;
    let begins = file.fill_buf().map_err(unreadable)?;
    // A file that is no glTF shows it by its beginning, which is all that is read. Otherwise one byte more
    // than allowed is read, if there is one: it shows that the file is too large.
    let most = match document::may_begin(begins) {
        true => MOST_BYTES + 1,
        false => begins.len() as u64,
    };
    file.take(most).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(Error::mesh(path, "is larger than 1 GiB", TOO_LARGE));
    }
    Ok(bytes)
}

/// A reason to refuse the file.
enum Fault {
    Damaged(Cow<'static, str>),
    Materials,
    NoRoom(Error),
    TooLarge(String),
}

type Checked<T> = Result<T, Fault>;

fn damaged<T>(problem: &'static str) -> Checked<T> {
    Err(Fault::Damaged(problem.into()))
}

/// Things met on the walk that are no surfaces, or more than surfaces.
#[derive(Default)]
struct Told {
    lines: usize,
    points: usize,
    has_skins: bool,
    has_targets: bool,
    /// A sentence for each material.
    transparent: Vec<String>,
}

impl Told {
    /// Returns a sentence on each thing in the `document` that is left out.
    fn left_out(self, document: &Document) -> Vec<String> {
        let mut said = Vec::new();
        if document.scenes().len() > 1 {
            said.push(format!("of its {} scenes one is read", document.scenes().len()));
        }
        said.extend(no_surfaces(self.lines, self.points));
        if self.has_skins {
            said.push("its skins are left out: it stands as modelled, not in a pose".to_owned());
        }
        match document.animations().len() {
            0 => {}
            1 => said.push("its animation is left out: it stands as the file begins".to_owned()),
            some => said.push(format!(
                "its {} are left out: it stands as the file begins",
                counted(some, "animation")
            )),
        }
        if self.has_targets {
            said.push("its morph targets are left out, as if their weights were 0".to_owned());
        }
        said.extend(self.transparent);
        if document.extensions_used().any(|name| name == document::TRANSMISSION) {
            said.push("light goes through some of its materials, which is left out".to_owned());
        }
        let names = document.extensions_used().filter(|name| document::adds_shape(name));
        said.extend(names.map(|name| format!("what its extension {name} adds is left out")));
        said
    }
}

/// The walk down the nodes.
struct Walk<'a> {
    buffers: Buffers<'a>,
    mesh: Mesh,
    /// Materials of the mesh by their number in the document; that of none has none.
    materials: HashMap<Option<usize>, u16>,
    /// Nodes and surfaces that may still be visited.
    visits: usize,
    /// Vertices and triangles that the mesh may have.
    limits: [usize; 2],
    /// Room for vertices and triangles, and the path of the file.
    room: (Room, &'a Path),
    told: Told,
}

impl Walk<'_> {
    fn visit(&mut self) -> Checked<()> {
        self.visits = self.visits.saturating_sub(1);
        match self.visits {
            0 => Err(Fault::TooLarge(format!("{MOST_VISITS} nodes and surfaces"))),
            _ => Ok(()),
        }
    }

    /// Visits every node of the scene, parents before children. A node with more than one parent is refused,
    /// as the format demands. So no node is visited twice, and the walk ends.
    fn all(&mut self, document: &Document) -> Checked<()> {
        let scene = document.default_scene().or_else(|| document.scenes().next());
        let mut is_met = vec![false; document.nodes().len()];
        let mut ahead: Vec<(Node, DMat4)> = Vec::new();
        let mut meet = |node: &Node| match is_met.get_mut(node.index()) {
            Some(is_met) if !*is_met => {
                *is_met = true;
                Ok(())
            }
            _ => {
                let problem = format!("has node {} with more than one parent", node.index());
                Err(Fault::Damaged(problem.into()))
            }
        };
        for root in scene.iter().flat_map(|scene| scene.nodes()) {
            meet(&root)?;
            ahead.push((root, DMat4::IDENTITY));
        }
        ahead.reverse();
        while let Some((node, parent)) = ahead.pop() {
            self.visit()?;
            let place = parent * placement(&node);
            self.told.has_skins |= node.skin().is_some();
            for primitive in node.mesh().iter().flat_map(|mesh| mesh.primitives()) {
                self.visit()?;
                self.primitive(&primitive, place)?;
            }
            let behind = ahead.len();
            for child in node.children() {
                meet(&child)?;
                ahead.push((child, place));
            }
            // The first child comes next.
            ahead[behind..].reverse();
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, place: DMat4) -> Checked<()> {
        let mode = primitive.mode();
        let Some(positions) = primitive.get(&Semantic::Positions) else {
            return damaged("has a surface without positions");
        };
        let count = positions.count();
        let corners = primitive.indices().map_or(count, |indices| indices.count());
        match mode {
            Mode::Points => self.told.points = self.told.points.saturating_add(corners),
            Mode::Lines => self.told.lines = self.told.lines.saturating_add(corners / 2),
            Mode::LineLoop | Mode::LineStrip => self.told.lines = self.told.lines.saturating_add(1),
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan => {
                return self.surface(primitive, place, (count, corners));
            }
        }
        Ok(())
    }

    /// Adds a surface with these numbers of vertices and corners.
    fn surface(
        &mut self,
        primitive: &Primitive,
        place: DMat4,
        (count, corners): (usize, usize),
    ) -> Checked<()> {
        let mode = primitive.mode();
        let triangles = if mode == Mode::Triangles { corners / 3 } else { corners };
        let fits = |have: usize, more: usize, most| have.saturating_add(more) <= most;
        if !fits(self.mesh.vertices.len(), count, self.limits[0])
            || !fits(self.mesh.triangles.len(), triangles, self.limits[1])
        {
            return Err(Fault::TooLarge(format!("{MOST_CORNERS} vertices or triangles")));
        }
        let (room, path) = self.room;
        let size = (self.mesh.vertices.len() + count, self.mesh.triangles.len() + triangles);
        room.check(size, path).map_err(Fault::NoRoom)?;
        self.told.has_targets |= primitive.morph_targets().len() > 0;
        let Some(positions) = primitive.get(&Semantic::Positions) else { return Ok(()) };
        let places = self.buffers.places(&positions)?;
        let first = self.mesh.vertices.len() as u32;
        let corners = match primitive.indices() {
            Some(indices) => self.buffers.indices(&indices)?,
            None => (0..count as u32).collect(),
        };
        // A corner beyond the positions of its own surface must not reach into another's.
        if corners.iter().any(|corner| *corner as usize >= count) {
            return damaged("has a triangle with a corner that is not there");
        }
        let corners: Vec<u32> = corners.into_iter().map(|corner| corner + first).collect();
        let places =
            places.into_iter().map(|at| place.transform_point3(DVec3::from(at)).to_array());
        self.mesh.vertices.extend(places);
        let material = self.material(&primitive.material())?;
        match mode {
            Mode::TriangleStrip => {
                corners.windows(3).for_each(|three| self.mesh.fan(three, material));
            }
            Mode::TriangleFan => self.mesh.fan(&corners, material),
            _ => corners.chunks_exact(3).for_each(|three| self.mesh.fan(three, material)),
        }
        Ok(())
    }

    /// The material of the mesh for one of the document; those without a name are called by their
    /// number.
    fn material(&mut self, own: &Material) -> Checked<u16> {
        if let Some(known) = self.materials.get(&own.index()) {
            return Ok(*known);
        }
        let name = match (own.name().filter(|name| !name.is_empty()), own.index()) {
            (Some(name), _) => name.to_owned(),
            (None, Some(number)) => format!("material {number}"),
            (None, None) => String::new(),
        };
        let colour = own.pbr_metallic_roughness();
        // A texture hides the colour factor; without one the factor is the colour.
        let is_seen = own.index().is_some() && colour.base_color_texture().is_none();
        let guess = is_seen.then(|| {
            let [red, green, blue, _] = colour.base_color_factor().map(f64::from);
            luminance([red, green, blue])
        });
        let covers = colour.base_color_factor()[3] >= 1.0 && colour.base_color_texture().is_none();
        if own.alpha_mode() != AlphaMode::Opaque && !covers {
            self.told.transparent.push(transparency(&name));
        }
        let new = self.mesh.add_material(&name, guess).ok_or(Fault::Materials)?;
        self.materials.insert(own.index(), new);
        Ok(new)
    }
}

/// The transform of a node: a matrix by columns, or scale, then rotation, then translation. A
/// rotation is brought to length 1, from which rounding or carelessness may lead it; one of length 0
/// is none.
fn placement(node: &Node) -> DMat4 {
    match node.transform() {
        Transform::Matrix { matrix } => {
            DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)))
        }
        Transform::Decomposed { translation, rotation, scale } => {
            let rotation = DQuat::from_array(rotation.map(f64::from));
            let length = rotation.length();
            DMat4::from_scale_rotation_translation(
                DVec3::from(scale.map(f64::from)),
                if length > 0.0 { rotation / length } else { DQuat::IDENTITY },
                DVec3::from(translation.map(f64::from)),
            )
        }
    }
}
