//! JSON Schema of environments.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde_json::Value;

use super::file::Typed;
use super::{Effect, ready};
use crate::schema;

/// The JSON Schema of an environment, be it a file or the table of a scene, by which editors
/// complete and check it.
pub fn schema() -> Value {
    schema::of::<Typed>("Macropulse environment").to_value()
}

/// An environment in a scene: the name of a ready one, or its keys.
pub(crate) fn in_scene(generator: &mut SchemaGenerator) -> Schema {
    let mut either = Schema::default();
    let choices = [ready_name(generator), generator.subschema_for::<Typed>()];
    either.insert("anyOf".to_owned(), choices.map(Schema::to_value).to_vec().into());
    either
}

/// The name of a ready environment.
pub(super) fn ready_name(_: &mut SchemaGenerator) -> Schema {
    schema::words(ready::names(), false)
}

impl JsonSchema for Effect {
    fn schema_name() -> Cow<'static, str> {
        "Effect".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schema::explained(Self::ALL.map(|effect| (effect.name(), effect.assumption())))
    }
}
