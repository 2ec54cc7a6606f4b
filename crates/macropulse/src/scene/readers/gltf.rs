//! glTF 2.0: `.glb`, and `.gltf` with buffers beside it or in `data:` URIs \[glTF2\].
//!
//! The crate `gltf` reads the document. It takes a sound file for granted in places, so everything
//! that it may stumble over is checked before it is asked: `document` checks the container and the
//! indices, `buffers` the bytes, and `Walk` the range of each accessor. What a file may ask for is
//! bounded before memory is spent on it.
//!
//! The crate keeps the numbers of nodes and colours in single precision: a node 50 km from the
//! origin is placed to 4 mm.

mod buffers;
mod document;

use std::borrow::Cow;
use std::io::Read;
use std::path::Path;

use ::gltf::accessor::{DataType, Dimensions};
use ::gltf::mesh::Mode;
use ::gltf::scene::Transform;
use ::gltf::{Accessor, Material, Node, Primitive, Semantic};
use glam::{DMat4, DQuat, DVec3};

use super::{DAMAGED, luminance, open};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;

/// Bytes of the file, or made from them.
type Bytes<'a> = Cow<'a, [u8]>;

/// Most bytes of a file, and most of all its buffers together.
const MOST_BYTES: u64 = 1 << 30;

/// Most vertices, and most triangles, of all nodes together.
const MOST_CORNERS: usize = 1 << 25;

/// Deeper nesting than this is a cycle or a mistake.
const DEEPEST: usize = 64;

/// Most nodes and surfaces that are visited: a graph that is no tree would never end.
const MOST_VISITS: usize = 1 << 20;

const TOO_LARGE: &str = "export it in parts or with fewer details";

/// Reads the default scene of the glTF file at `path`, or its first, as one mesh in the axes of
/// the file, m.
pub(super) fn read(path: &Path) -> Result<Mesh, Error> {
    let bytes = whole(path)?;
    let damaged = |problem: String| Error::mesh(path, problem, DAMAGED);
    let [text, binary] = document::container(&bytes).map_err(damaged)?;
    let document = document::document(path, &text)?;
    let buffers = buffers::buffers(path, &document, binary)?;
    let mesh = Mesh::default();
    let mut walk = Walk { buffers, mesh, visits: MOST_VISITS, limits: [MOST_CORNERS; 2] };
    let scene = document.default_scene().or_else(|| document.scenes().next());
    for root in scene.iter().flat_map(|scene| scene.nodes()) {
        walk.node(&root, DMat4::IDENTITY, 0).map_err(|fault| match fault {
            Fault::Damaged(problem) => damaged(problem.to_owned()),
            Fault::TooLarge => Error::mesh(
                path,
                format!("holds more than {MOST_CORNERS} vertices or triangles"),
                TOO_LARGE,
            ),
        })?;
    }
    Ok(walk.mesh)
}

/// The bytes of a file that is not too large.
fn whole(path: &Path) -> Result<Vec<u8>, Error> {
    let unreadable = |source| Error::Unreadable { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    // One byte more than allowed tells that there are more.
    open(path)?.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(Error::mesh(path, "is larger than 1 GiB", TOO_LARGE));
    }
    Ok(bytes)
}

/// What is wrong, where something is.
enum Fault {
    Damaged(&'static str),
    TooLarge,
}

type Checked<T> = Result<T, Fault>;

fn damaged<T>(problem: &'static str) -> Checked<T> {
    Err(Fault::Damaged(problem))
}

/// The walk down the nodes.
struct Walk<'a> {
    buffers: Vec<Bytes<'a>>,
    mesh: Mesh,
    /// Nodes and surfaces that may still be visited.
    visits: usize,
    /// Vertices and triangles that the mesh may have.
    limits: [usize; 2],
}

impl Walk<'_> {
    fn visit(&mut self) -> Checked<()> {
        self.visits = self.visits.saturating_sub(1);
        if self.visits == 0 { damaged("has nodes that contain each other") } else { Ok(()) }
    }

    fn node(&mut self, node: &Node, parent: DMat4, depth: usize) -> Checked<()> {
        self.visit()?;
        if depth > DEEPEST {
            return damaged("has nodes that contain each other");
        }
        let place = parent * placement(node);
        for primitive in node.mesh().iter().flat_map(|mesh| mesh.primitives()) {
            self.visit()?;
            self.primitive(&primitive, place)?;
        }
        for child in node.children() {
            self.node(&child, place, depth + 1)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, place: DMat4) -> Checked<()> {
        let mode = primitive.mode();
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(());
        }
        let Some(positions) = primitive.get(&Semantic::Positions) else {
            return damaged("has a surface without positions");
        };
        let count = positions.count();
        let corners = primitive.indices().map_or(count, |indices| indices.count());
        let triangles = if mode == Mode::Triangles { corners / 3 } else { corners };
        let fits = |have: usize, more: usize, most| have.saturating_add(more) <= most;
        if !fits(self.mesh.vertices.len(), count, self.limits[0])
            || !fits(self.mesh.triangles.len(), triangles, self.limits[1])
        {
            return Err(Fault::TooLarge);
        }
        if (positions.data_type(), positions.dimensions()) != (DataType::F32, Dimensions::Vec3) {
            return damaged("has positions that are not three floats");
        }
        let (first, corners) = (self.mesh.vertices.len(), self.corners(primitive, count)?);
        if count > 0 {
            self.check(&positions)?;
            let read = primitive.reader(|buffer| self.buffers.get(buffer.index()).map(|b| &b[..]));
            let Some(positions) = read.read_positions() else { return damaged(BEYOND) };
            let place = |at: [f32; 3]| place.transform_point3(DVec3::from(at.map(f64::from)));
            self.mesh.vertices.extend(positions.map(|at| place(at).to_array()));
        }
        let corners: Vec<u32> = corners.into_iter().map(|corner| corner + first as u32).collect();
        let material = self.material(&primitive.material());
        match mode {
            Mode::TriangleStrip => {
                corners.windows(3).for_each(|three| self.mesh.polygon(three, material));
            }
            Mode::TriangleFan => self.mesh.polygon(&corners, material),
            _ => corners.chunks_exact(3).for_each(|three| self.mesh.polygon(three, material)),
        }
        Ok(())
    }

    /// The corners of a surface of `count` vertices, in order, each below `count`.
    fn corners(&self, primitive: &Primitive, count: usize) -> Checked<Vec<u32>> {
        let Some(indices) = primitive.indices() else { return Ok((0..count as u32).collect()) };
        let unsigned = matches!(indices.data_type(), DataType::U8 | DataType::U16 | DataType::U32);
        if !unsigned || indices.dimensions() != Dimensions::Scalar {
            return damaged("has indices that are not unsigned integers");
        }
        if indices.count() == 0 {
            return Ok(Vec::new());
        }
        self.check(&indices)?;
        let read = primitive.reader(|buffer| self.buffers.get(buffer.index()).map(|b| &b[..]));
        let Some(indices) = read.read_indices() else { return damaged(BEYOND) };
        let corners: Vec<u32> = indices.into_u32().collect();
        // A corner beyond the positions of its own surface must not reach into another's.
        if corners.iter().any(|corner| *corner as usize >= count) {
            return damaged("has a triangle with a corner that is not there");
        }
        Ok(corners)
    }

    /// Refuses an accessor, of at least one element, that its buffer does not hold. The crate
    /// adds these numbers up unchecked and takes the types for granted.
    fn check(&self, accessor: &Accessor) -> Checked<()> {
        if accessor.sparse().is_some() {
            return damaged("uses sparse accessors, which are not read here");
        }
        let Some(view) = accessor.view() else {
            return damaged("has an accessor without a buffer");
        };
        let stride = view.stride().unwrap_or(accessor.size());
        if stride < accessor.size() {
            return damaged("has an accessor whose elements overlap");
        }
        let steps = accessor.count().checked_sub(1).and_then(|steps| steps.checked_mul(stride));
        let end = steps
            .and_then(|steps| steps.checked_add(accessor.size()))
            .and_then(|length| length.checked_add(accessor.offset()));
        let view_end = view.offset().checked_add(view.length());
        let buffer = self.buffers.get(view.buffer().index()).map_or(0, |buffer| buffer.len());
        match (end, view_end) {
            (Some(end), Some(view_end)) if end <= view.length() && view_end <= buffer => Ok(()),
            _ => damaged(BEYOND),
        }
    }

    fn material(&mut self, own: &Material) -> u16 {
        let material = self.mesh.material(own.name().unwrap_or_default());
        let colour = own.pbr_metallic_roughness();
        // A texture hides the colour factor; without one the factor is the colour.
        if own.index().is_some() && colour.base_color_texture().is_none() {
            let [red, green, blue, _] = colour.base_color_factor().map(f64::from);
            self.mesh.diffuse_guesses[usize::from(material)] = Some(luminance([red, green, blue]));
        }
        material
    }
}

const BEYOND: &str = "has an accessor that reaches beyond its buffer";

/// The transform of a node: a matrix by columns, or scale, then rotation, then translation.
fn placement(node: &Node) -> DMat4 {
    match node.transform() {
        Transform::Matrix { matrix } => {
            DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)))
        }
        Transform::Decomposed { translation, rotation, scale } => {
            DMat4::from_scale_rotation_translation(
                DVec3::from(scale.map(f64::from)),
                DQuat::from_array(rotation.map(f64::from)),
                DVec3::from(translation.map(f64::from)),
            )
        }
    }
}
