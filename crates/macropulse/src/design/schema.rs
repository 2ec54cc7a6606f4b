//! JSON Schema of sensor files: what they may say, and what one must say that extends no other.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde_json::{Map, Value, json};

use super::check::SensorFile;
use super::{ALTERNATIVES, Effect, presets};
use crate::schema;

/// The JSON Schema of a sensor file, by which editors complete and check it.
///
/// A key with a built-in default may be left out of any file. Other keys must be there only in a file that
/// extends no other.
pub fn schema() -> Value {
    let mut sensor = schema::of::<SensorFile>("Macropulse sensor").to_value();
    let defaults = presets::DEFAULTS.parse().unwrap_or_default();
    exactly_one(&mut sensor, "");
    may_be_left_out(&mut sensor, &defaults);
    let needed = taken_needs(&mut sensor);
    let mut extends = schema::words(presets::names(), true);
    extends.insert(
        "description".to_owned(),
        "Ready sensor, or file from the folder of this one, that fills in what this one leaves open."
            .into(),
    );
    let first = ("extends".to_owned(), extends.to_value());
    let rest = sensor["properties"].as_object().cloned().unwrap_or_default();
    sensor["properties"] = std::iter::once(first).chain(rest).collect();
    sensor["if"] = json!({ "required": ["extends"] });
    sensor["else"] = needed;
    sensor
}

/// Demands one of each group of keys that exclude each other, in the table called `name` and in those below
/// it.
fn exactly_one(table: &mut Value, name: &str) {
    let named = ALTERNATIVES.iter().filter(|(group, _)| !group.is_empty() && *group == name);
    let groups = named.map(|(_, kinds)| {
        let kinds: Vec<Value> = kinds.iter().map(|kind| json!({ "required": [kind] })).collect();
        json!({ "oneOf": kinds })
    });
    let groups: Vec<Value> = groups.collect();
    // A table of one variant, as `code.family`, says so itself.
    if !groups.is_empty() && table.get("properties").is_some() {
        table["allOf"] = groups.into();
    }
    for (name, below) in properties(table) {
        exactly_one(below, name);
    }
}

/// Writes `defaults` into the schema of a table. A key with a default may be left out. So may a table, if
/// nothing is left in it that must be there.
fn may_be_left_out(table: &mut Value, defaults: &toml::Table) {
    for (key, default) in defaults {
        let Some(below) = table.pointer_mut(&format!("/properties/{key}")) else { continue };
        let has_needs = match (default, below.get("properties")) {
            (toml::Value::Table(inner), Some(_)) => {
                may_be_left_out(below, inner);
                below.get("required").is_some() || below.get("allOf").is_some()
            }
            _ => {
                below["default"] = json!(default);
                false
            }
        };
        if !has_needs && let Some(Value::Array(required)) = table.get_mut("required") {
            required.retain(|name| name != key);
            if required.is_empty() {
                table.as_object_mut().map(|keywords| keywords.remove("required"));
            }
        }
    }
}

/// Takes out of the schema of a table, and of those in it, what must be there, as a schema of its
/// own. Entries of lists keep theirs: a list is not filled in.
fn taken_needs(table: &mut Value) -> Value {
    let mut needs = Map::new();
    let Some(keywords) = table.as_object_mut() else { return needs.into() };
    if keywords.contains_key("properties") {
        for keyword in ["required", "allOf"] {
            needs.extend(keywords.shift_remove_entry(keyword));
        }
    }
    let mut below = Map::new();
    let mut take = |table: &mut Value| {
        for (key, inner) in properties(table) {
            let needed = taken_needs(inner);
            if needed.as_object().is_some_and(|needed| !needed.is_empty()) {
                below.insert(key.clone(), needed);
            }
        }
    };
    take(table);
    if let Some(Value::Array(variants)) = table.get_mut("oneOf") {
        variants.iter_mut().for_each(take);
    }
    if !below.is_empty() {
        needs.insert("properties".to_owned(), below.into());
    }
    needs.into()
}

/// The schemas of the keys of a table, by their names.
fn properties(table: &mut Value) -> impl Iterator<Item = (&String, &mut Value)> {
    table.get_mut("properties").and_then(Value::as_object_mut).into_iter().flatten()
}

impl JsonSchema for Effect {
    fn schema_name() -> Cow<'static, str> {
        "Effect".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schema::explained(Self::ALL.map(|effect| (effect.name(), effect.assumption())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_a_default_may_be_left_out_and_the_rest_by_what_extends_another() {
        let sensor = schema();
        let needs = |at: &str| sensor.pointer(&format!("/else{at}/required")).cloned();
        let raster = needs("/properties/scan/properties/raster");
        assert_eq!(raster, Some(json!(["rows", "columns", "horizontal_deg", "vertical_deg"])));
        assert_eq!(needs("/properties/receiver"), None);
        assert_eq!(sensor.get("required"), None);
        let one = sensor.pointer("/else/properties/detector/allOf/0/oneOf/1/required");
        assert_eq!(one, Some(&json!(["geiger"])));
        let duty = "/properties/scan/properties/raster/properties/duty/default";
        assert_eq!(sensor.pointer(duty), Some(&json!(1.0)));
    }

    #[test]
    fn what_is_wanted_somewhere_is_told() {
        let sensor = schema();
        for (path, told) in [
            ("scan/properties/max_range_m", "a number from 0.01 to 100000"),
            (
                "scan/properties/raster/properties/mirror",
                "\"uniform\" or \"sinusoidal\" or { polygon = … }",
            ),
            ("light/properties/energy", "\"class-1\" or { shot_nj = … }"),
            ("idealised", "a list, as [ … ]"),
            (
                "scan/properties/spinning/properties/lasers/items/properties/origin_mm",
                "a list of 3 numbers, as [1.0, 2.0, 3.0]",
            ),
            ("code/properties/crc", "{ width = …, polynomial = …, init = … }"),
            ("code/properties/family/oneOf/0/properties/prime", "a whole number, 0 or more"),
        ] {
            let wanted = sensor.pointer(&format!("/properties/{path}")).and_then(schema::wanted);
            assert_eq!(wanted.as_deref(), Some(told), "{path}");
        }
        assert_eq!(schema::homes(&sensor, "max_range_m"), ["scan"]);
        assert!(schema::homes(&sensor, "rows").contains(&"scan.flash".to_owned()));
    }
}
