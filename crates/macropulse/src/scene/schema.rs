//! JSON Schema of scene files.

use schemars::{Schema, SchemaGenerator, json_schema};
use serde_json::Value;

use super::file::SceneFile;
use super::material;
use crate::{design, schema};

pub(super) use crate::environment::in_scene as environment;

/// The JSON Schema of a scene file, by which editors complete and check it.
pub fn schema() -> Value {
    schema::of::<SceneFile>("Macropulse scene").to_value()
}

/// The name of a ready sensor, or a file.
pub(super) fn sensor(_: &mut SchemaGenerator) -> Schema {
    schema::words(design::preset_names(), true)
}

/// A material of the library, or one that the scene defines.
pub(super) fn material(_: &mut SchemaGenerator) -> Schema {
    let library: Vec<String> = material::library().map(|material| material.name).collect();
    schema::words(library.iter().map(String::as_str), true)
}

/// Materials by what they are called in a mesh.
pub(super) fn materials(generator: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": "object", "additionalProperties": material(generator) })
}
