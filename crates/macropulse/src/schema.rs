//! JSON Schema of the files that people type, for editors that complete and check them.
//!
//! A schema follows from the types that read the file: keys, kinds of value, limits and what is said
//! of each are theirs.

mod misfit;
mod read;

use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use schemars::{JsonSchema, Schema, json_schema};
use serde_json::{Map, Value};

pub(crate) use misfit::{Fault, Misfit};
pub(crate) use read::read;
pub use read::{Refusal, read_file, read_text};

/// The schema of files that are read as a `T`, in one piece, called `title`.
pub fn of<T: JsonSchema>(title: &str) -> Schema {
    let mut schema = of_reader::<T>();
    let without_widths = |schema: &mut Schema| drop(schema.remove("format"));
    RecursiveTransform(without_widths).transform(&mut schema);
    schema.insert("title".to_owned(), title.into());
    schema
}

/// As [`of`], with the widths of numbers.
fn of_reader<T: JsonSchema>() -> Schema {
    let mut settings = SchemaSettings::draft07();
    settings.inline_subschemas = true;
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    RecursiveTransform(tidied).transform(&mut schema);
    schema
}

/// A schema of text that is one of `known` words, as far as an editor can know.
pub(crate) fn words<'a>(known: impl IntoIterator<Item = &'a str>, or_other: bool) -> Schema {
    let known: Vec<&str> = known.into_iter().collect();
    match or_other {
        true => {
            json_schema!({ "anyOf": [{ "type": "string", "enum": known }, { "type": "string" }] })
        }
        false => json_schema!({ "type": "string", "enum": known }),
    }
}

/// A schema of words, each with what it means.
pub(crate) fn explained(words: impl IntoIterator<Item = (&'static str, &'static str)>) -> Schema {
    let words = words.into_iter().map(
        |(word, meaning)| json_schema!({ "type": "string", "const": word, "description": meaning }),
    );
    json_schema!({ "oneOf": words.collect::<Vec<_>>() })
}

/// Returns in words what a value with the schema `node` must be: its kind, its limits, its choices.
pub(crate) fn wanted(node: &Value) -> Option<String> {
    if let Some(choices) = choices(node) {
        let choices: Vec<String> = choices.iter().filter_map(choice).collect();
        return Some(choices.join(" or "));
    }
    if let Some(words) = node.get("enum").and_then(Value::as_array) {
        let words: Vec<String> = words.iter().map(Value::to_string).collect();
        return Some(words.join(" or "));
    }
    let number = |what: &str| {
        let limit = |key: &str| node.get(key).and_then(Value::as_f64);
        match (limit("minimum"), limit("maximum")) {
            (Some(least), Some(most)) => format!("{what} from {least} to {most}"),
            (Some(least), None) => format!("{what}, {least} or more"),
            _ => what.to_owned(),
        }
    };
    Some(match node.get("type")?.as_str()? {
        "number" => number("a number"),
        "integer" => number("a whole number"),
        "string" => "text in quotes".to_owned(),
        "boolean" => "true or false".to_owned(),
        "array" if node.get("maxItems") == Some(&3.into()) => {
            "a list of 3 numbers, as [1.0, 2.0, 3.0]".to_owned()
        }
        "array" => "a list, as [ … ]".to_owned(),
        "object" => table(node),
        _ => return None,
    })
}

/// Returns the schemas among which a value must fit one.
fn choices(node: &Value) -> Option<&[Value]> {
    let choices = ["oneOf", "anyOf"].into_iter().find_map(|kind| node.get(kind)?.as_array());
    choices.filter(|_| node.get("properties").is_none()).map(Vec::as_slice)
}

/// One of several things that may stand somewhere.
fn choice(node: &Value) -> Option<String> {
    match node.get("const") {
        Some(word) => Some(word.to_string()),
        None => wanted(node),
    }
}

/// A table, with what must be in it or the first of what may be.
fn table(node: &Value) -> String {
    let keys = node.get("properties").and_then(Value::as_object);
    let required = node.get("required").and_then(Value::as_array);
    let required = required.map(|keys| keys.iter().filter_map(Value::as_str).collect::<Vec<_>>());
    let first = || keys.into_iter().flat_map(|keys| keys.keys().map(String::as_str)).take(3);
    let named = required.unwrap_or_else(|| first().collect());
    match named[..] {
        [] => "a table, as {}".to_owned(),
        _ => format!(
            "{{ {} }}",
            named.iter().map(|key| format!("{key} = …")).collect::<Vec<_>>().join(", ")
        ),
    }
}

/// The tables in which a file of this `schema` may have the `key`, with a dot between their names;
/// those that are entries of a list are left out.
pub(crate) fn homes(schema: &Value, key: &str) -> Vec<String> {
    let mut found = Vec::new();
    homes_below(schema, key, "", &mut found);
    found
}

fn homes_below(node: &Value, key: &str, path: &str, found: &mut Vec<String>) {
    let Some(Value::Object(properties)) = node.get("properties") else { return };
    if properties.contains_key(key) && !path.is_empty() {
        found.push(path.to_owned());
    }
    for (name, below) in properties {
        let dot = if path.is_empty() { "" } else { "." };
        homes_below(below, key, &format!("{path}{dot}{name}"), found);
    }
}

/// Removes what Rust says and TOML or its editors do not know: absence as a value, lines of comments.
fn tidied(schema: &mut Schema) {
    let Some(keywords) = schema.as_object_mut() else { return };
    if keywords.get("default").is_some_and(Value::is_null) {
        keywords.remove("default");
    }
    if let Some(Value::Array(types)) = keywords.get_mut("type") {
        types.retain(|one| one != "null");
        if let [only] = &types[..] {
            let only = only.clone();
            keywords.insert("type".to_owned(), only);
        }
    }
    if let Some(Value::Array(words)) = keywords.get_mut("enum") {
        words.retain(|one| !one.is_null());
    }
    unwrap_optional(keywords);
    if let Some(Value::String(said)) = keywords.get_mut("description") {
        let lines: Vec<&str> = said.lines().map(str::trim).collect();
        *said = lines.join(" ").replace("\\[", "[").replace("\\]", "]");
    }
}

/// `anyOf` a schema and nothing is that schema.
fn unwrap_optional(keywords: &mut Map<String, Value>) {
    let Some(Value::Array(choices)) = keywords.get_mut("anyOf") else { return };
    choices.retain(|one| one.get("type").is_none_or(|kind| kind != "null"));
    if let [Value::Object(only)] = &choices[..] {
        let only = only.clone();
        keywords.remove("anyOf");
        for (keyword, value) in only {
            keywords.entry(keyword).or_insert(value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;
    use serde_json::json;

    /// A file of the tests.
    #[derive(Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "read by the schema alone")]
    struct File {
        /// Length, m,
        /// as in \[KP16\].
        #[schemars(range(min = 0, max = 2))]
        length_m: Option<f64>,
        inner: Option<Inner>,
    }

    #[derive(Deserialize, JsonSchema)]
    #[expect(dead_code, reason = "read by the schema alone")]
    struct Inner {
        count: u32,
    }

    #[test]
    fn a_schema_speaks_of_toml() {
        let schema = of::<File>("A file");
        let length = json!({
            "description": "Length, m, as in [KP16].", "type": "number", "minimum": 0, "maximum": 2
        });
        assert_eq!(schema.pointer("/properties/length_m"), Some(&length));
        assert_eq!(schema.pointer("/properties/inner/type"), Some(&"object".into()));
        assert_eq!(schema.get("additionalProperties"), Some(&false.into()));
        assert_eq!((schema.get("title"), schema.get("required")), (Some(&"A file".into()), None));
    }

    #[test]
    fn words_are_closed_or_open() {
        let open = words(["a"], true);
        assert_eq!(open.pointer("/anyOf/1"), Some(&json!({ "type": "string" })));
        assert_eq!(words(["a"], false).get("enum"), Some(&json!(["a"])));
    }
}
