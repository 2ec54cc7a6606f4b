//! glTF 2.0: `.glb`, and `.gltf` with buffers beside it or in `data:` URIs.
//!
//! Only what makes a mesh is read: nodes, triangles, positions, material names and colours. Each
//! index in the file is looked up, never trusted.

mod document;

use std::io::Read;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat4, DVec3};

use super::{DAMAGED, luminance, open};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;
use document::{Accessor, Document, Node, Primitive, container};

/// Deeper nesting than this is a cycle or a mistake.
const DEEPEST: usize = 64;

pub(super) fn read(path: &Path) -> Result<Mesh, Error> {
    let mut bytes = Vec::new();
    open(path)?
        .read_to_end(&mut bytes)
        .map_err(|source| Error::Unreadable { path: path.to_owned(), source })?;
    let damaged = |problem: String| Error::mesh(path, problem, DAMAGED);
    let (text, binary) = container(&bytes)
        .ok_or_else(|| damaged("is a glTF container that does not add up".to_owned()))?;
    let document: Document = serde_json::from_slice(text)
        .map_err(|fault| damaged(format!("is no readable glTF ({fault})")))?;
    if let Some(extension) = document.extensions_required.first() {
        return Err(Error::mesh(
            path,
            format!("requires the glTF extension {extension}, which is not read here"),
            "export it without compression and extensions",
        ));
    }
    let buffers = buffers(path, &document, binary)?;
    let mut walk = Walk { document: &document, buffers, mesh: Mesh::default(), budget: 1 << 20 };
    let scene = document.scenes.get(document.scene.unwrap_or(0));
    let roots = scene.map_or(&[][..], |scene| &scene.nodes);
    for root in roots {
        walk.node(*root, DMat4::IDENTITY, 0).map_err(|problem| damaged(problem.to_owned()))?;
    }
    Ok(walk.mesh)
}

fn buffers(path: &Path, document: &Document, binary: &[u8]) -> Result<Vec<Vec<u8>>, Error> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut buffers = Vec::new();
    for (index, buffer) in document.buffers.iter().enumerate() {
        let bytes = match buffer.uri.as_deref() {
            None => binary.to_vec(),
            Some(uri) => match uri.strip_prefix("data:") {
                Some(inline) => inline
                    .split_once(";base64,")
                    .and_then(|(_, text)| STANDARD.decode(text).ok())
                    .unwrap_or_default(),
                None => {
                    let beside = folder.join(uri.replace("%20", " "));
                    std::fs::read(&beside)
                        .map_err(|source| Error::Unreadable { path: beside, source })?
                }
            },
        };
        if bytes.len() < buffer.byte_length {
            return Err(Error::mesh(path, format!("its buffer {index} is incomplete"), DAMAGED));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// What is wrong, where something is.
type Checked<T> = Result<T, &'static str>;

/// The walk down the nodes.
struct Walk<'a> {
    document: &'a Document,
    buffers: Vec<Vec<u8>>,
    mesh: Mesh,
    /// Nodes that may still be visited: a graph that is no tree would never end.
    budget: usize,
}

impl Walk<'_> {
    fn node(&mut self, index: usize, parent: DMat4, depth: usize) -> Checked<()> {
        let node = self.document.nodes.get(index).ok_or("names a node that is not there")?;
        self.budget = self.budget.saturating_sub(1);
        if depth > DEEPEST || self.budget == 0 {
            return Err("has nodes that contain each other");
        }
        let place = parent * placement(node);
        if let Some(mesh) = node.mesh {
            let mesh = self.document.meshes.get(mesh).ok_or("names a mesh that is not there")?;
            for primitive in &mesh.primitives {
                self.primitive(primitive, place)?;
            }
        }
        for child in &node.children {
            self.node(*child, place, depth + 1)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, place: DMat4) -> Checked<()> {
        const TRIANGLES: u32 = 4;
        const STRIP: u32 = 5;
        const FAN: u32 = 6;
        if !(TRIANGLES..=FAN).contains(&primitive.mode) {
            return Ok(());
        }
        let positions =
            primitive.attributes.get("POSITION").ok_or("has a surface without positions")?;
        let positions = self.positions(*positions)?;
        let shift = u32::try_from(self.mesh.vertices.len()).map_err(|_| "has too many vertices")?;
        let corners: Vec<u32> = match primitive.indices {
            Some(accessor) => self.indices(accessor)?,
            None => (0..positions.len() as u32).collect(),
        };
        // A corner beyond the positions of its own surface must not reach into another's.
        if corners.iter().any(|corner| *corner as usize >= positions.len()) {
            return Err("has a triangle with a corner that is not there");
        }
        let corners: Vec<u32> =
            corners.into_iter().map(|corner| corner.saturating_add(shift)).collect();
        let place = |position: [f64; 3]| place.transform_point3(DVec3::from(position)).to_array();
        self.mesh.vertices.extend(positions.into_iter().map(place));
        let material = self.material(primitive.material)?;
        match primitive.mode {
            STRIP => corners.windows(3).for_each(|three| self.mesh.polygon(three, material)),
            FAN => self.mesh.polygon(&corners, material),
            _ => corners.chunks_exact(3).for_each(|three| self.mesh.polygon(three, material)),
        }
        Ok(())
    }

    fn material(&mut self, index: Option<usize>) -> Checked<u16> {
        let Some(index) = index else { return Ok(self.mesh.material("")) };
        let own = self.document.materials.get(index).ok_or("names a material that is not there")?;
        let material = self.mesh.material(&own.name);
        // A texture hides the colour factor; without one the factor is the colour.
        if own.colour.texture.is_none() {
            let [red, green, blue, _] = own.colour.factor;
            self.mesh.diffuse_guesses[material as usize] = Some(luminance([red, green, blue]));
        }
        Ok(material)
    }

    fn positions(&self, index: usize) -> Checked<Vec<[f64; 3]>> {
        let accessor = self.accessor(index)?;
        const FLOAT: u32 = 5126;
        if (accessor.component_type, accessor.shape.as_str()) != (FLOAT, "VEC3") {
            return Err("has positions that are not three floats");
        }
        let position = |bytes: &[u8]| {
            let (numbers, _) = bytes.as_chunks::<4>();
            [0, 1, 2].map(|axis| {
                numbers.get(axis).map_or(f64::NAN, |n| f64::from(f32::from_le_bytes(*n)))
            })
        };
        Ok(self.elements(accessor, 12)?.map(position).collect())
    }

    fn indices(&self, index: usize) -> Checked<Vec<u32>> {
        let accessor = self.accessor(index)?;
        let size = match (accessor.component_type, accessor.shape.as_str()) {
            (5121, "SCALAR") => 1,
            (5123, "SCALAR") => 2,
            (5125, "SCALAR") => 4,
            _ => return Err("has indices that are not unsigned integers"),
        };
        let number =
            |bytes: &[u8]| bytes.iter().rev().fold(0, |sum: u32, byte| sum << 8 | u32::from(*byte));
        Ok(self.elements(accessor, size)?.map(number).collect())
    }

    fn accessor(&self, index: usize) -> Checked<&Accessor> {
        let accessor =
            self.document.accessors.get(index).ok_or("names an accessor that is not there")?;
        match accessor.sparse {
            Some(_) => Err("uses sparse accessors, which are not read here"),
            None => Ok(accessor),
        }
    }

    /// The bytes of each element of an accessor, `size` at a time.
    fn elements(&self, accessor: &Accessor, size: usize) -> Checked<impl Iterator<Item = &[u8]>> {
        const BEYOND: &str = "has an accessor that reaches beyond its buffer";
        let view = accessor.buffer_view.and_then(|view| self.document.buffer_views.get(view));
        let view = view.ok_or("has an accessor without a buffer")?;
        let buffer = self.buffers.get(view.buffer).ok_or(BEYOND)?;
        let end = view.byte_offset.checked_add(view.byte_length).ok_or(BEYOND)?;
        let bytes = buffer.get(view.byte_offset..end).ok_or(BEYOND)?;
        let bytes = bytes.get(accessor.byte_offset..).ok_or(BEYOND)?;
        let stride = view.byte_stride.unwrap_or(size).max(size);
        let fits = match accessor.count.checked_sub(1) {
            None => true,
            Some(steps) => steps
                .checked_mul(stride)
                .and_then(|span| span.checked_add(size))
                .is_some_and(|span| span <= bytes.len()),
        };
        if !fits {
            return Err(BEYOND);
        }
        Ok(bytes.chunks(stride).take(accessor.count).map(move |element| &element[..size]))
    }
}

/// The transform of a node: a matrix by columns, or scale, then rotation, then translation.
fn placement(node: &Node) -> DMat4 {
    match &node.matrix {
        Some(columns) => DMat4::from_cols_array(columns),
        None => DMat4::from_scale_rotation_translation(
            DVec3::from(node.scale),
            glam::DQuat::from_array(node.rotation),
            DVec3::from(node.translation),
        ),
    }
}
