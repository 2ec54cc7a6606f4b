//! JSON Schema of scene files.

use schemars::{Schema, SchemaGenerator, json_schema};
use serde_json::Value;

use super::file::SceneFile;
use super::{material, motion};
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

/// Length, width and height, m.
pub(super) fn size(_: &mut SchemaGenerator) -> Schema {
    three(json_schema!({ "type": "number", "exclusiveMinimum": 0 }))
}

/// A velocity in the world, m/s; as fast as [`motion::FASTEST`] at most, whichever way.
pub(super) fn velocity(_: &mut SchemaGenerator) -> Schema {
    let fastest = motion::FASTEST;
    three(json_schema!({ "type": "number", "minimum": -fastest, "maximum": fastest }))
}

/// A list of three.
fn three(each: Schema) -> Schema {
    json_schema!({ "type": "array", "items": each, "minItems": 3, "maxItems": 3 })
}
