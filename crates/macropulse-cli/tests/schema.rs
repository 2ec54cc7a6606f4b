//! Schemas that editors read. They are those of the program, and their limits are those that are checked. A
//! validator that others wrote accepts every ready file and example by them.

#![allow(missing_docs, clippy::unwrap_used)]

use crate::common;
#[path = "schema/scenes.rs"]
mod scenes;

use std::path::{Path, PathBuf};
use std::process::Command;

use common::Desk;
use macropulse::design::{Design, preset_names, schema};
use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn the_schemas_in_the_repository_are_those_of_the_program() {
    let desk = Desk::new();
    for kind in ["sensor", "scene", "environment", "requirements"] {
        let name = format!("schemas/{kind}.json");
        let printed = desk.run(&format!("schema {kind}")).out;
        let kept = std::fs::read_to_string(root().join(&name)).unwrap_or_default();
        assert!(kept == printed, "anew with: macropulse schema {kind} -o {name}");
        desk.run(&format!("schema {kind} -o written.json"));
        assert_eq!(std::fs::read_to_string(desk.path().join("written.json")).unwrap(), printed);
    }
}

#[test]
fn a_validator_of_others_takes_the_ready_files_and_no_slips() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/schema");
    let python = macropulse_testbed::python(&folder.join("requirements.txt")).unwrap();
    let mut validate = Command::new(python);
    validate.arg(folder.join("validate.py")).arg(root());
    let said = macropulse_testbed::call(&mut validate).unwrap();
    assert!(said.contains("files are valid"), "{said}");
}

/// A file printed to start from does not name a schema that lies elsewhere.
#[test]
fn what_is_printed_names_no_schema() {
    let desk = Desk::new();
    for line in ["sensors vlp-16", "scenes wall", "environments night"] {
        let printed = desk.run(line).out;
        assert!(printed.starts_with("# ") && !printed.contains("#:schema"), "{printed}");
    }
}

/// Each limit of a number of the schema is the one in the sentence that refuses what lies beyond it.
#[test]
fn limits_are_those_that_are_checked() {
    let schema = schema();
    let mut tried = 0;
    let mut limits = Vec::new();
    collect(&schema, "", &mut limits);
    for (path, least, most) in limits {
        for value in [least - 1.0 - least.abs(), most + 1.0 + most.abs()] {
            let typed =
                if value.fract() == 0.0 { format!("{value}") } else { format!("{value:e}") };
            // In a sensor that has its table, with nothing but the limit in the way.
            let told = preset_names().find_map(|name| {
                let set = [(path.clone(), typed.clone())];
                let told = Design::open(name, &set).err()?.to_string();
                told.lines().find(|line| line.contains(&format!("{path}: is ")))?;
                told.contains("must lie between").then_some(told)
            });
            let Some(told) = told else { continue };
            tried += 1;
            let between = format!("between {least} and {most}");
            assert!(told.contains(&between), "{path}: {between} in the schema, but: {told}");
        }
    }
    assert!(tried > 60, "{tried} limits were tried");
}

/// The numbers with two limits, by their dotted paths.
fn collect(node: &Value, path: &str, found: &mut Vec<(String, f64, f64)>) {
    let limit = |key: &str| node.get(key).and_then(Value::as_f64);
    if let (Some(least), Some(most)) = (limit("minimum"), limit("maximum")) {
        found.push((path.to_owned(), least, most));
    }
    let Some(Value::Object(properties)) = node.get("properties") else { return };
    for (key, below) in properties {
        let dot = if path.is_empty() { "" } else { "." };
        collect(below, &format!("{path}{dot}{key}"), found);
    }
}
