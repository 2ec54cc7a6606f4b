//! The parts of a glTF document that make a mesh, named as its specification names them
//! \[glTF2\].

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    #[serde(default)]
    pub extensions_required: Vec<String>,
    pub scene: Option<usize>,
    #[serde(default)]
    pub scenes: Vec<Scene>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub meshes: Vec<Surfaces>,
    #[serde(default)]
    pub materials: Vec<Material>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default)]
    pub buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub nodes: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Node {
    #[serde(default)]
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    pub matrix: Option<[f64; 16]>,
    #[serde(default)]
    pub translation: [f64; 3],
    /// A unit quaternion, x y z w.
    #[serde(default = "no_rotation")]
    pub rotation: [f64; 4],
    #[serde(default = "no_scale")]
    pub scale: [f64; 3],
}

fn no_rotation() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

fn no_scale() -> [f64; 3] {
    [1.0; 3]
}

/// A `mesh`.
#[derive(Debug, Deserialize)]
pub(super) struct Surfaces {
    pub primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    pub attributes: BTreeMap<String, usize>,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    #[serde(default = "triangles")]
    pub mode: u32,
}

fn triangles() -> u32 {
    4
}

#[derive(Debug, Deserialize)]
pub(super) struct Material {
    #[serde(default)]
    pub name: String,
    #[serde(default, rename = "pbrMetallicRoughness")]
    pub colour: Colour,
}

#[derive(Debug, Deserialize)]
pub(super) struct Colour {
    #[serde(default = "white", rename = "baseColorFactor")]
    pub factor: [f64; 4],
    #[serde(rename = "baseColorTexture")]
    pub texture: Option<IgnoredAny>,
}

impl Default for Colour {
    fn default() -> Self {
        Self { factor: white(), texture: None }
    }
}

fn white() -> [f64; 4] {
    [1.0; 4]
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    pub count: usize,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: usize,
}

/// JSON and binary part of a file: those of a `.glb`, or all of it and nothing. `None` if the
/// lengths in a container do not add up.
pub(super) fn container(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    if !bytes.starts_with(b"glTF") {
        return Some((bytes, &[]));
    }
    let (text, rest) = chunk(bytes.get(12..)?, b"JSON")?;
    match rest.is_empty() {
        true => Some((text, &[])),
        false => Some((text, chunk(rest, b"BIN\0")?.0)),
    }
}

/// The chunk of this kind at the start of `bytes`, and what follows it.
fn chunk<'a>(bytes: &'a [u8], kind: &[u8; 4]) -> Option<(&'a [u8], &'a [u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let (own, rest) = rest.split_first_chunk::<4>()?;
    if own != kind {
        return None;
    }
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_container_is_split_into_its_parts() {
        let file = b"glTF\x02\0\0\0\0\0\0\0\x02\0\0\0JSON{}\x03\0\0\0BIN\0abc";
        assert_eq!(container(file), Some((b"{}".as_slice(), b"abc".as_slice())));
        assert_eq!(container(&file[..22]), Some((b"{}".as_slice(), b"".as_slice())));
    }

    #[test]
    fn plain_text_is_all_json() {
        assert_eq!(container(b"{}"), Some((b"{}".as_slice(), b"".as_slice())));
    }

    #[test]
    fn a_container_that_is_cut_short_is_refused() {
        let file = b"glTF\x02\0\0\0\0\0\0\0\x02\0\0\0JSON{}\x03\0\0\0BIN\0ab";
        assert_eq!(container(file), None);
        assert_eq!(container(&file[..14]), None);
    }
}
