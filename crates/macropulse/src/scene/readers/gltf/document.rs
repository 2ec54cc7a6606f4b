//! The container of a glTF file and its document, checked before the crate `gltf` relies on them.

use std::collections::HashMap;
use std::path::Path;

use ::gltf::json::validation::{Checked, Error as Fault, Validate};
use ::gltf::json::{Path as Place, Root};
use ::gltf::{Document, Glb, Semantic};
use serde::Deserialize;
use serde::de::IgnoredAny;

use super::super::DAMAGED;
use super::{Bytes, TOO_LARGE};
use crate::scene::error::Error;

/// Most objects, lists and values that a document may have: each takes some hundred bytes of
/// memory at most, however short its text.
const MOST_VALUES: usize = 1 << 22;

/// An extension by which places may be whole numbers.
pub(super) const QUANTISED: &str = "KHR_mesh_quantization";

/// An extension by which light goes through a material.
pub(super) const TRANSMISSION: &str = "KHR_materials_transmission";

/// Beginnings of the names of extensions that do not change where a surface is: they are about looks,
/// light, or what is known of things.
const HARMLESS: [&str; 10] = [
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_xmp",
    POINTERS,
    "EXT_mesh_features",
    "EXT_structural_metadata",
];

/// Extensions by which there is more of a surface, or another one, than the file says without.
const SHAPES: [&str; 4] = [
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "EXT_mesh_gpu_instancing",
];

/// Returns true if an extension adds something to the shape that is not read here.
pub(super) fn adds_shape(name: &str) -> bool {
    SHAPES.contains(&name)
}

fn is_harmless(name: &str) -> bool {
    name == QUANTISED || HARMLESS.iter().any(|begins| name.starts_with(begins))
}

/// Returns true if a file with this beginning may be a glTF: a container, or text that is an object or still
/// blank.
pub(super) fn may_begin(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    bytes.starts_with(b"glTF") || text.is_empty() || text.starts_with(b"{")
}

/// Returns true if the bytes are a container of glTF 1.0.
pub(super) fn is_old_container(bytes: &[u8]) -> bool {
    bytes.starts_with(b"glTF\x01\0\0\0")
}

/// JSON and binary part of a file: those of a `.glb`, or all of it and nothing.
///
/// # Errors
/// If the lengths in a container do not add up.
pub(super) fn container(bytes: &[u8]) -> Result<[Bytes<'_>; 2], String> {
    const HEADER: usize = 12;
    if !bytes.starts_with(b"glTF") {
        return Ok([bytes.into(), Bytes::default()]);
    }
    let refused = |why: &str| format!("is a glTF container that does not add up ({why})");
    // The crate takes the header from this length without asking whether it is as long.
    let length = bytes.get(8..HEADER).and_then(|length| length.try_into().ok());
    let length = length.map_or(0, |length| u32::from_le_bytes(length) as usize);
    if !(HEADER..=bytes.len()).contains(&length) {
        return Err(refused("its length is not that of the file"));
    }
    let parts = Glb::from_slice(bytes).map_err(|fault| refused(&fault.to_string()))?;
    Ok([parts.json, parts.bin.unwrap_or_default()])
}

/// The document that `text` describes, of the file at `path`. Every index in it leads somewhere.
///
/// # Errors
/// If it is no glTF, needs an extension, is too large, or an index or a value in it is wrong.
pub(super) fn document(path: &Path, text: &[u8]) -> Result<Document, Error> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let values = text.iter().filter(|byte| matches!(byte, b'{' | b'[' | b',')).count();
    if values > MOST_VALUES {
        let problem = format!("describes more than {MOST_VALUES} values");
        return Err(Error::mesh(path, problem, TOO_LARGE));
    }
    let damaged = |problem: String| Error::mesh(path, problem, DAMAGED);
    let stilled = stilled(text);
    let text = stilled.as_deref().unwrap_or(text);
    let root: Root = ::gltf::json::deserialize::from_slice(text).map_err(|fault| {
        match is_of_version_1(text) {
            true => version_1(path),
            false => damaged(format!("is no readable glTF ({fault})")),
        }
    })?;
    if let Some(extension) = root.extensions_required.iter().find(|name| !is_harmless(name)) {
        return Err(Error::mesh(
            path,
            format!("requires the glTF extension {extension}, which is not read here"),
            "export it without compression and extensions",
        ));
    }
    check(&root).map_err(damaged)?;
    check_nodes(&root).map_err(damaged)?;
    if root.buffers.len() > MOST_BUFFERS {
        let problem = format!("has {} buffers, more than {MOST_BUFFERS}", root.buffers.len());
        return Err(Error::mesh(path, problem, "export it with all data in one buffer"));
    }
    Ok(Document::from_json_without_validation(root))
}

/// Returns true if `text` is a document of glTF 1.0, in which meshes have names in place of numbers.
fn is_of_version_1(text: &[u8]) -> bool {
    #[derive(Deserialize)]
    struct Old {
        #[serde(rename = "meshes")]
        _meshes: HashMap<String, IgnoredAny>,
    }
    ::gltf::json::deserialize::from_slice::<Old>(text).is_ok()
}

/// Refuses the file at `path`, which is glTF 1.0.
pub(super) fn version_1(path: &Path) -> Error {
    let remedy = "convert it to glTF 2.0, as gltf-pipeline does";
    Error::mesh(path, "is glTF 1.0, and glTF 2.0 is read", remedy)
}

/// An extension by which an animation may change anything, also what is no node.
const POINTERS: &str = "KHR_animation_pointer";

/// A document with such animations as if they did nothing: the crate takes each for one of a node.
/// `None` where there are none.
fn stilled(text: &[u8]) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(text).ok().filter(|text| text.contains(POINTERS))?;
    let mut document: serde_json::Value = serde_json::from_str(text).ok()?;
    let animations = document.get_mut("animations")?.as_array_mut()?;
    animations.fill(serde_json::json!({ "channels": [], "samplers": [] }));
    serde_json::to_vec(&document).ok()
}

/// Most buffers of a document; each may be a file to open.
const MOST_BUFFERS: usize = 4096;

/// Refuses nodes with several parents: they would be there once for each way that leads to them, and the ways
/// may double from level to level. Trees remain, and cycles that no scene leads to.
fn check_nodes(root: &Root) -> Result<(), String> {
    let mut has_parent = vec![false; root.nodes.len()];
    for (index, node) in root.nodes.iter().enumerate() {
        for child in node.children.iter().flatten() {
            let known = has_parent.get_mut(child.value());
            if known.is_none_or(|known| std::mem::replace(known, true)) {
                return Err(format!("names in node {index} a child that has another parent"));
            }
        }
    }
    let mut of_scenes = root.scenes.iter().flat_map(|scene| &scene.nodes);
    match of_scenes.find(|node| has_parent.get(node.value()).copied().unwrap_or(true)) {
        Some(node) => Err(format!("names in a scene node {}, which is a child", node.value())),
        None => Ok(()),
    }
}

/// Refuses indices that lead nowhere and values that mean nothing. Missing values are left to the code that
/// needs them: many files lack the bounds of their positions.
fn check(root: &Root) -> Result<(), String> {
    // The check of the crate itself looks these accessors up unchecked, and panics.
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let positions =
        primitives.filter_map(|one| one.attributes.get(&Checked::Valid(Semantic::Positions)));
    if positions.into_iter().any(|index| root.accessors.get(index.value()).is_none()) {
        return Err("names an accessor that is not there".to_owned());
    }
    let mut problem = None;
    root.validate(root, Place::new, &mut |place, fault| {
        let place = place();
        // A stride is checked against the elements it parts; some write 0 where there is none.
        // Extensions have been looked at.
        let is_looked_at = matches!(fault, Fault::Missing | Fault::Unsupported);
        if problem.is_some() || is_looked_at || place.as_str().ends_with("byteStride") {
            return;
        }
        problem = Some(match fault {
            Fault::IndexOutOfBounds => format!("names at {place} what is not there"),
            _ => format!("has at {place} what is no value for it"),
        });
    });
    problem.map_or(Ok(()), Err)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> String {
        document(Path::new("a.gltf"), text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn a_container_is_split_into_its_parts() {
        let file = b"glTF\x02\0\0\0\x21\0\0\0\x02\0\0\0JSON{}\x03\0\0\0BIN\0abc";
        let [text, binary] = container(file).unwrap();
        assert_eq!((&*text, &*binary), (b"{}".as_slice(), b"abc".as_slice()));
        let file = b"glTF\x02\0\0\0\x16\0\0\0\x02\0\0\0JSON{}";
        let [text, binary] = container(file).unwrap();
        assert_eq!((&*text, &*binary), (b"{}".as_slice(), b"".as_slice()));
    }

    #[test]
    fn a_file_may_be_told_by_its_beginning() {
        for bytes in [&b"glTF\x02"[..], b"{}", b"\xef\xbb\xbf\r\n {", b" ", b""] {
            assert!(may_begin(bytes), "{bytes:?}");
        }
        for bytes in [&b"\0\0"[..], b"solid", b"\xff\xfe{\0"] {
            assert!(!may_begin(bytes), "{bytes:?}");
        }
    }

    #[test]
    fn plain_text_is_all_json() {
        assert_eq!(&*container(b"{}").unwrap()[0], b"{}");
    }

    #[test]
    fn a_container_that_does_not_add_up_is_refused() {
        let file = b"glTF\x02\0\0\0\x21\0\0\0\x02\0\0\0JSON{}\x03\0\0\0BIN\0ab";
        assert!(container(file).is_err());
        assert!(container(&file[..14]).is_err());
        // Lengths that the header alone exceeds, or that nothing could hold.
        for length in [0, 11, u32::MAX] {
            let mut file = file.to_vec();
            file[8..12].copy_from_slice(&length.to_le_bytes());
            assert!(container(&file).unwrap_err().contains("does not add up"));
        }
    }

    #[test]
    fn indices_that_lead_nowhere_are_refused_before_they_are_followed() {
        let asset = r#""asset":{"version":"2.0"}"#;
        let mesh = |keys: &str| format!(r#"{{{asset},"meshes":[{{"primitives":[{{{keys}}}]}}]}}"#);
        assert!(told(&mesh(r#""attributes":{"POSITION":7}"#)).contains("an accessor that is not"));
        let message = told(&mesh(r#""attributes":{},"material":2"#));
        assert!(message.contains("names at meshes[0].primitives[0].material what is"), "{message}");
        let message = told(&mesh(r#""attributes":{},"mode":99"#));
        assert!(message.contains("primitives[0].mode what is no value"), "{message}");
        let bare = document(Path::new("a.gltf"), mesh(r#""attributes":{}"#).as_bytes());
        assert!(bare.is_ok(), "what is missing is told by those who need it");
    }

    #[test]
    fn a_document_of_too_many_values_is_refused_unread() {
        let text = format!(r#"{{"nodes":[{}"#, "{},".repeat(MOST_VALUES / 2 + 1));
        assert!(told(&text).contains("describes more than 4194304 values; export it in parts"));
    }
}
