//! glTF 2.0: `.glb`, and `.gltf` with buffers beside it or in `data:` URIs.

use std::io::Read;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat4, DVec3};
use gltf::buffer::Source;
use gltf::mesh::Mode;
use gltf::{Document, Gltf, Node};

use super::{DAMAGED, luminance, open};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;

/// Deeper nesting than this is a cycle or a mistake.
const DEEPEST: usize = 256;

pub(super) fn read(path: &Path) -> Result<Mesh, Error> {
    let mut bytes = Vec::new();
    open(path)?
        .read_to_end(&mut bytes)
        .map_err(|source| Error::Unreadable { path: path.to_owned(), source })?;
    let Gltf { document, blob } = Gltf::from_slice(&bytes)
        .map_err(|fault| Error::mesh(path, format!("is no readable glTF ({fault})"), DAMAGED))?;
    if let Some(extension) = document.extensions_required().next() {
        return Err(Error::mesh(
            path,
            format!("requires the glTF extension {extension}, which is not read here"),
            "export it without compression and extensions",
        ));
    }
    let buffers = buffers(path, &document, blob)?;
    let mut nest = Nest { path, buffers, mesh: Mesh::default() };
    let scene = document.default_scene().or_else(|| document.scenes().next());
    for node in scene.iter().flat_map(|scene| scene.nodes()) {
        nest.node(&node, DMat4::IDENTITY, 0)?;
    }
    Ok(nest.mesh)
}

fn buffers(
    path: &Path,
    document: &Document,
    mut blob: Option<Vec<u8>>,
) -> Result<Vec<Vec<u8>>, Error> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut buffers = Vec::new();
    for buffer in document.buffers() {
        let bytes = match buffer.source() {
            Source::Bin => blob.take(),
            Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(inline) => {
                    inline.split_once(";base64,").and_then(|(_, text)| STANDARD.decode(text).ok())
                }
                None => {
                    let beside = folder.join(uri.replace("%20", " "));
                    let bytes = std::fs::read(&beside);
                    Some(bytes.map_err(|source| Error::Unreadable { path: beside, source })?)
                }
            },
        };
        match bytes {
            Some(bytes) if bytes.len() >= buffer.length() => buffers.push(bytes),
            _ => {
                let problem = format!("its buffer {} is incomplete", buffer.index());
                return Err(Error::mesh(path, problem, DAMAGED));
            }
        }
    }
    Ok(buffers)
}

/// The walk down the nodes.
struct Nest<'a> {
    path: &'a Path,
    buffers: Vec<Vec<u8>>,
    mesh: Mesh,
}

impl Nest<'_> {
    fn node(&mut self, node: &Node<'_>, parent: DMat4, depth: usize) -> Result<(), Error> {
        if depth > DEEPEST {
            let problem = format!("its nodes nest deeper than {DEEPEST}");
            return Err(Error::mesh(self.path, problem, DAMAGED));
        }
        let own = node.transform().matrix().map(|column| column.map(f64::from));
        let place = parent * DMat4::from_cols_array_2d(&own);
        for primitive in node.mesh().iter().flat_map(|mesh| mesh.primitives()) {
            self.primitive(&primitive, place)?;
        }
        for child in node.children() {
            self.node(&child, place, depth + 1)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &gltf::Primitive<'_>, place: DMat4) -> Result<(), Error> {
        if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(());
        }
        let damaged = |problem: &str| Err(Error::mesh(self.path, problem, DAMAGED));
        // The accessors are checked first: their iterators index the buffers unasked.
        for accessor in primitive.indices().into_iter().chain(primitive.attributes().map(|a| a.1)) {
            let fits = accessor.view().is_none_or(|view| {
                let stride = view.stride().unwrap_or(accessor.size());
                let span = accessor.count().saturating_sub(1).saturating_mul(stride);
                let end = accessor.offset().saturating_add(span).saturating_add(accessor.size());
                let buffer = self.buffers.get(view.buffer().index());
                end <= view.length()
                    && buffer
                        .is_some_and(|b| view.offset().saturating_add(view.length()) <= b.len())
            });
            if !fits {
                return damaged("an accessor reaches beyond its buffer");
            }
            if accessor.sparse().is_some() {
                return Err(Error::mesh(
                    self.path,
                    "uses sparse accessors, which are not read here",
                    "export it without morph targets",
                ));
            }
        }
        let reader = primitive.reader(|buffer| self.buffers.get(buffer.index()).map(Vec::as_slice));
        let Some(positions) = reader.read_positions() else {
            return damaged("a primitive has no positions");
        };
        let positions: Vec<[f32; 3]> = positions.collect();
        let indices: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..positions.len() as u32).collect(),
        };
        let shift = self.mesh.vertices.len() as u32;
        self.mesh.vertices.extend(positions.iter().map(|position| {
            place.transform_point3(DVec3::from(position.map(f64::from))).to_array()
        }));
        let own = primitive.material();
        let material = self.mesh.material(own.name().unwrap_or(""));
        let [red, green, blue, _] = own.pbr_metallic_roughness().base_color_factor().map(f64::from);
        // A texture hides the colour factor; without one the factor is the colour.
        let textured = own.pbr_metallic_roughness().base_color_texture().is_some();
        if own.index().is_some() && !textured {
            self.mesh.diffuse_guesses[material as usize] = Some(luminance([red, green, blue]));
        }
        let corners: Vec<u32> = indices.iter().map(|index| shift.saturating_add(*index)).collect();
        match primitive.mode() {
            Mode::TriangleStrip => {
                corners.windows(3).for_each(|three| self.mesh.polygon(three, material));
            }
            Mode::TriangleFan => self.mesh.polygon(&corners, material),
            _ => corners.chunks_exact(3).for_each(|three| self.mesh.polygon(three, material)),
        }
        Ok(())
    }
}
