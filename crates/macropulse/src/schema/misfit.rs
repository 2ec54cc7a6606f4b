//! The first value of a table that does not fit the schema of its reader.

use serde_json::Value as Node;
use toml::{Table, Value};

use super::wanted;
use crate::names::Step;
use crate::told;

/// The place of a fault in a table, and the fault.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Misfit {
    pub steps: Vec<Step>,
    pub fault: Fault,
}

/// A part of a table that does not fit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Fault {
    /// The last step of the place is a key that is not among the known ones.
    UnknownKey { known: Vec<String> },
    /// The table at the place lacks a key.
    MissingKey(String),
    /// The value at the place is wrong: a sentence without its subject.
    Value(String),
}

impl Misfit {
    /// The place as one word, as `object[0].shape`.
    pub fn path(&self) -> String {
        let mut path = String::new();
        for step in &self.steps {
            match step {
                Step::Key(key) if path.is_empty() => path.push_str(key),
                Step::Key(key) => path += &format!(".{key}"),
                Step::Entry(at) => path += &format!("[{at}]"),
            }
        }
        path
    }

    /// The last key of the place.
    pub fn key(&self) -> &str {
        match self.steps.last() {
            Some(Step::Key(key)) => key,
            _ => "",
        }
    }

    /// The fault as a sentence.
    pub fn message(&self) -> String {
        match &self.fault {
            Fault::UnknownKey { known } => {
                let known: Vec<&str> = known.iter().map(String::as_str).collect();
                told::unknown("key", self.key(), &known)
            }
            Fault::MissingKey(key) => format!("the key `{key}` is missing"),
            Fault::Value(message) => message.clone(),
        }
    }
}

/// A walk through a table along a schema.
#[derive(Default)]
pub(super) struct Walk {
    steps: Vec<Step>,
}

impl Walk {
    /// Refuses the first key of a `table`, or value below it, that does not fit the schema `node`,
    /// in the order in which they stand; then keys that are missing.
    fn table(&mut self, node: &Node, table: &Table) -> Result<(), Misfit> {
        let properties = node.get("properties");
        for (key, value) in table {
            let known = properties.and_then(|properties| properties.get(key));
            match known.or(node.get("additionalProperties")) {
                Some(Node::Bool(false)) => return self.unknown_key(key, keys(node)),
                Some(below) => self.below(Step::Key(key.clone()), below, value)?,
                None => {}
            }
        }
        let required = node.get("required").and_then(Node::as_array).into_iter().flatten();
        let mut required = required.filter_map(Node::as_str);
        match required.find(|key| !table.contains_key(*key)) {
            Some(key) => self.refuse(Fault::MissingKey(key.to_owned())),
            None => Ok(()),
        }
    }

    fn below(&mut self, step: Step, node: &Node, value: &Value) -> Result<(), Misfit> {
        self.steps.push(step);
        self.value(node, value)?;
        self.steps.pop();
        Ok(())
    }

    fn refuse(&self, fault: Fault) -> Result<(), Misfit> {
        Err(Misfit { steps: self.steps.clone(), fault })
    }

    fn unknown_key(&mut self, key: &str, known: Vec<&str>) -> Result<(), Misfit> {
        self.steps.push(Step::Key(key.to_owned()));
        self.refuse(Fault::UnknownKey { known: known.into_iter().map(str::to_owned).collect() })
    }

    /// Refuses the first part of a `value` that does not fit the schema `node`.
    pub fn value(&mut self, node: &Node, value: &Value) -> Result<(), Misfit> {
        if let Some(choices) = super::choices(node) {
            return self.choice(node, choices, value);
        }
        let fits = match (node.get("type").and_then(Node::as_str), value) {
            (None, _) => true,
            (Some("object"), Value::Table(table)) => return self.table(node, table),
            (Some("array"), Value::Array(list)) => return self.list(node, list),
            (Some("string"), Value::String(word)) => {
                let words = words(node);
                if !words.is_empty() && !words.contains(&word.as_str()) {
                    return self.refuse(Fault::Value(told::unknown("value", word, &words)));
                }
                true
            }
            (Some("integer"), Value::Integer(number)) => {
                if let Some(most) = most(node).filter(|most| number > most) {
                    let must_be = format!("a whole number from 0 to {most}");
                    return self.refuse(is_but(value, &must_be));
                }
                *number >= 0
                    || node.get("minimum").and_then(Node::as_f64).is_none_or(|min| min < 0.0)
            }
            (Some("boolean"), Value::Boolean(_)) => true,
            (Some("number"), Value::Float(_) | Value::Integer(_)) => true,
            _ => false,
        };
        if fits { Ok(()) } else { self.refuse(is_but(value, &must_be(node))) }
    }

    fn list(&mut self, node: &Node, list: &[Value]) -> Result<(), Misfit> {
        let length = |key: &str| node.get(key).and_then(Node::as_u64);
        let exactly = length("minItems").filter(|least| length("maxItems") == Some(*least));
        if exactly.is_some_and(|exactly| exactly != list.len() as u64) {
            let (count, must_be) = (list.len(), must_be(node));
            let entries = if count == 1 { "entry" } else { "entries" };
            let message = format!("has {count} {entries}, but must be {must_be}");
            return self.refuse(Fault::Value(message));
        }
        let Some(items) = node.get("items") else { return Ok(()) };
        for (at, value) in list.iter().enumerate() {
            self.below(Step::Entry(at), items, value)?;
        }
        Ok(())
    }

    /// Checks a value that may be one of several `choices`: words, and tables with one key each.
    fn choice(&mut self, node: &Node, choices: &[Node], value: &Value) -> Result<(), Misfit> {
        let tables = choices.iter().filter(|choice| choice.get("type") == Some(&"object".into()));
        let tables: Vec<&Node> = tables.collect();
        let variants = tables.iter().filter(|table| keys(table).len() == 1);
        let variants: Vec<(&str, &Node)> =
            variants.flat_map(|table| keys(table).into_iter().map(|key| (key, *table))).collect();
        let names = variants.iter().map(|(name, _)| *name);
        let words: Vec<&str> = choices.iter().flat_map(words).collect();
        match value {
            Value::Table(table) if tables.len() > variants.len() => {
                let whole = tables.iter().find(|table| keys(table).len() != 1);
                whole.map_or(Ok(()), |whole| self.table(whole, table))
            }
            Value::Table(table) if !variants.is_empty() => {
                let known = |key: &String| variants.iter().find(|(name, _)| name == key);
                match (table.len(), table.keys().next(), table.keys().find_map(known)) {
                    (1, _, Some((_, variant))) => self.table(variant, table),
                    (1, Some(key), None) if !words.contains(&key.as_str()) => {
                        self.unknown_key(key, names.collect())
                    }
                    (1, ..) => self.refuse(Fault::Value(format!("must be {}", must_be(node)))),
                    (count, _, known) => {
                        let example =
                            known.map_or_else(|| must_be(node), |(_, table)| must_be(table));
                        self.refuse(Fault::Value(format!(
                            "has {count} keys, but must have exactly one, as {example}"
                        )))
                    }
                }
            }
            _ if choices.iter().any(|choice| Self::default().value(choice, value).is_ok()) => {
                Ok(())
            }
            Value::String(word) if names.clone().any(|name| name == word) => {
                self.refuse(Fault::Value(format!("must be {}", must_be(node))))
            }
            Value::String(word) if !(words.is_empty() && variants.is_empty()) => {
                let known: Vec<&str> = words.into_iter().chain(names).collect();
                self.refuse(Fault::Value(told::unknown("value", word, &known)))
            }
            _ => self.refuse(is_but(value, &must_be(node))),
        }
    }
}

/// The keys of a table of this schema.
fn keys(node: &Node) -> Vec<&str> {
    let properties = node.get("properties").and_then(Node::as_object).into_iter();
    properties.flat_map(|properties| properties.keys().map(String::as_str)).collect()
}

/// The words that text of this schema may be; none if it may be any.
fn words(node: &Node) -> Vec<&str> {
    let several = node.get("enum").and_then(Node::as_array).into_iter().flatten();
    several.chain(node.get("const")).filter_map(Node::as_str).collect()
}

/// The largest whole number that the reader holds.
fn most(node: &Node) -> Option<i64> {
    match node.get("format")?.as_str()? {
        "uint8" => Some(u8::MAX.into()),
        "uint16" => Some(u16::MAX.into()),
        "uint32" => Some(u32::MAX.into()),
        _ => None,
    }
}

fn must_be(node: &Node) -> String {
    wanted(node).unwrap_or_else(|| "of another kind".to_owned())
}

/// The fault of a value of a wrong kind.
fn is_but(value: &Value, must_be: &str) -> Fault {
    let is = match value {
        Value::String(text) => format!("the text {text:?}"),
        Value::Table(_) => "a table".to_owned(),
        Value::Array(_) => "a list".to_owned(),
        Value::Datetime(_) => "a date".to_owned(),
        number => number.to_string(),
    };
    let is_for_a_number =
        ["a number", "a whole number"].iter().any(|kind| must_be.starts_with(kind));
    let remedy = match value {
        Value::String(text) if is_for_a_number && text.parse::<f64>().is_ok() => {
            ": take the quotes away"
        }
        Value::String(text)
            if is_for_a_number && text.starts_with(|c: char| c.is_ascii_digit()) =>
        {
            ": write it alone, as the name of the key says its unit"
        }
        _ => "",
    };
    Fault::Value(format!("is {is}, but must be {must_be}{remedy}"))
}

#[cfg(test)]
mod tests {
    use schemars::JsonSchema;
    use serde::Deserialize;

    use super::super::read;

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "read by the schema alone")]
    struct File {
        length_m: Option<f64>,
        #[schemars(range(min = 1, max = 9))]
        count: Option<u32>,
        small: Option<u16>,
        place_m: Option<[f64; 3]>,
        names: Option<Vec<String>>,
        is_it: Option<bool>,
        part: Option<Part>,
        shape: Option<Shape>,
        mirror: Option<Mirror>,
    }

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "read by the schema alone")]
    struct Part {
        width: u32,
        height: u32,
    }

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case", deny_unknown_fields)]
    #[expect(dead_code, reason = "read by the schema alone")]
    enum Shape {
        Prime(u32),
        List { marks: Vec<Vec<u32>> },
    }

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    #[expect(dead_code, reason = "read by the schema alone")]
    enum Mirror {
        /// As time passes.
        Uniform,
        /// To and fro.
        Sinusoidal,
        /// Round and round.
        Polygon(Part),
    }

    /// The place and the fault of a text.
    fn told(text: &str) -> (String, String) {
        let misfit = read::<File>(&text.parse().unwrap()).unwrap_err();
        (misfit.path(), misfit.message())
    }

    #[test]
    fn a_fault_has_a_place_and_says_what_is_wanted() {
        for (text, place, said) in [
            ("lenght_m = 1", "lenght_m", "unknown key `lenght_m`; did you mean `length_m`?"),
            ("part.depth = 1", "part.depth", "unknown key `depth`; known are width, height"),
            ("part.width = 1", "part", "the key `height` is missing"),
            (
                "length_m = \"90\"",
                "length_m",
                "is the text \"90\", but must be a number: take the quotes away",
            ),
            (
                "length_m = \"90m\"",
                "length_m",
                "is the text \"90m\", but must be a number: write it alone, as the name of the key says its unit",
            ),
            ("count = 1.5", "count", "is 1.5, but must be a whole number from 1 to 9"),
            ("count = -1", "count", "is -1, but must be a whole number from 1 to 9"),
            ("small = 65536", "small", "is 65536, but must be a whole number from 0 to 65535"),
            (
                "place_m = [1]",
                "place_m",
                "has 1 entry, but must be a list of 3 numbers, as [1.0, 2.0, 3.0]",
            ),
            ("names = \"a\"", "names", "is the text \"a\", but must be a list, as [ … ]"),
            ("names = [\"a\", 3]", "names[1]", "is 3, but must be text in quotes"),
            ("is_it = 1", "is_it", "is 1, but must be true or false"),
            ("part = 3", "part", "is 3, but must be { width = …, height = … }"),
            ("shape = \"prime\"", "shape", "must be { prime = … } or { list = … }"),
            ("shape = \"prim\"", "shape", "unknown value `prim`; did you mean `prime`?"),
            ("shape.primes = 3", "shape.primes", "unknown key `primes`; did you mean `prime`?"),
            (
                "shape = { list = { marks = [] }, prime = 3 }",
                "shape",
                "has 2 keys, but must have exactly one, as { list = … }",
            ),
            (
                "shape.list.marks = [[0], [-5]]",
                "shape.list.marks[1][0]",
                "is -5, but must be a whole number, 0 or more",
            ),
            (
                "mirror = \"galvo\"",
                "mirror",
                "unknown value `galvo`; known are uniform, sinusoidal, polygon",
            ),
            (
                "mirror = 3",
                "mirror",
                "is 3, but must be \"uniform\" or \"sinusoidal\" or { polygon = … }",
            ),
            ("mirror.polygon.width = 3", "mirror.polygon", "the key `height` is missing"),
        ] {
            assert_eq!(told(text), (place.to_owned(), said.to_owned()), "{text}");
        }
    }

    /// The control: good files are read.
    #[test]
    fn what_fits_is_read() {
        let text = "length_m = 3\nplace_m = [1, 2.0, 3]\nnames = []\nmirror = \"uniform\"\n\
                    shape.list.marks = [[0]]\npart = { width = 1, height = 2 }\n";
        let file: File = read(&text.parse().unwrap()).unwrap();
        assert_eq!(file.length_m, Some(3.0));
    }
}
