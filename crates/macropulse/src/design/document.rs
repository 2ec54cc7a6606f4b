//! Sensor files as typed: a chain of TOML documents, each one filling in what those before it
//! left open, and the place in the text where every value came from.

use std::path::{Path, PathBuf};

use toml::Table;

use super::presets;
use super::{Effect, Error};
use crate::names::{line_column, offset_of_key, toml_value};
use crate::{opened, told};

/// Origin of values that are changed on the command line.
const SET: &str = "--set";

/// A sensor file may extend another, but not without end.
const LONGEST_CHAIN: usize = 16;

/// The key of a change that takes an effect off the list `idealised`.
pub const WITH: &str = "with";

/// The key of a change that puts an effect on the list `idealised`.
pub const WITHOUT: &str = "without";

/// The key of the effects left out.
const IDEALISED: &str = "idealised";

/// Key that a file does not take from the one it extends: a sentence about that one.
const PROSE: &str = "summary";

/// Keys that exclude each other: the name of their table, which is empty for the top of the file, and the keys.
/// Naming another than the parent does replaces what the parent has there instead of adding to it.
pub(super) type Alternatives = [(&'static str, &'static [&'static str])];

/// One TOML text with its origin.
#[derive(Debug, Clone)]
struct Document {
    /// File name, preset name or `--set`, as shown in errors.
    origin: String,
    text: String,
    table: Table,
    /// Folder of the files that it names.
    folder: PathBuf,
}

/// The documents behind a sensor, the strongest first: `--set`, the file, what it extends, and
/// the defaults last.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    documents: Vec<Document>,
    /// The chain of files, merged into one.
    pub merged: Table,
    /// Set if effects were switched on the command line.
    is_switched: bool,
}

/// Place at which a key was typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Typed {
    /// On the command line.
    Set,
    /// In the file that was asked for, not in one that it extends.
    File,
}

/// The origin of what is typed on the command line.
const OVERRIDES: &str = "--set";

impl Chain {
    /// Reads `text` and everything it extends. `folder` is where relative names start.
    pub fn read(
        text: &str,
        origin: &str,
        folder: &Path,
        overrides: &[(String, String)],
        alternatives: &Alternatives,
    ) -> Result<Self, Error> {
        Self::of(Document::parse(text, origin, folder)?, folder, overrides, alternatives)
    }

    /// As [`Chain::read`], of a `table` that was not typed as text: its values have no line.
    pub fn of_table(
        table: &Table,
        origin: &str,
        folder: &Path,
        overrides: &[(String, String)],
        alternatives: &Alternatives,
    ) -> Result<Self, Error> {
        let (origin, table) = (origin.to_owned(), table.clone());
        let first = Document { origin, text: String::new(), table, folder: folder.to_owned() };
        Self::of(first, folder, overrides, alternatives)
    }

    fn of(
        first: Document,
        folder: &Path,
        overrides: &[(String, String)],
        alternatives: &Alternatives,
    ) -> Result<Self, Error> {
        let mut documents = Vec::new();
        let switches = |key: &str| [WITH, WITHOUT].contains(&key);
        let (switched, overrides): (Vec<_>, Vec<_>) =
            overrides.iter().cloned().partition(|(key, _)| switches(key));
        if !overrides.is_empty() {
            documents.push(document_of_overrides(&overrides)?);
        }
        let mut folder = folder.to_path_buf();
        documents.push(first);
        while let Some(parent) = documents.last().and_then(|d| d.table.get("extends")) {
            let path = "extends";
            let Some(parent) = parent.as_str().map(str::to_owned) else {
                return Err(place(&documents, path).error("must be the name of a sensor or file"));
            };
            if documents.len() > LONGEST_CHAIN {
                return Err(place(&documents, path).error("goes round in a circle"));
            }
            let (text, origin, next_folder) =
                open(Path::new(&parent), &folder).map_err(|error| {
                    place(&documents, path).error(format!("{parent}: {}", error.message))
                })?;
            folder = next_folder;
            documents.push(Document::parse(&text, &origin, &folder)?);
        }
        let mut merged = Table::new();
        let own = documents.iter().position(|document| document.origin != SET).unwrap_or(0);
        for (number, document) in documents.iter().enumerate() {
            let mut table = document.table.clone();
            if number > own {
                table.remove(PROSE);
            }
            fill_in(&mut merged, table, "", alternatives);
        }
        if let Some(parent) = documents[own].table.get("extends").and_then(toml::Value::as_str) {
            let said = format!("extends {parent}");
            merged.entry(PROSE).or_insert(said.into());
        }
        let defaults = Document::parse(presets::DEFAULTS, "built-in defaults", Path::new(""))?;
        let fitting = only_for_what_is_there(&defaults.table, &merged, alternatives);
        fill_in(&mut merged, fitting, "", alternatives);
        merged.remove("extends");
        documents.push(defaults);
        let mut chain = Self { documents, merged, is_switched: !switched.is_empty() };
        for (key, effect) in &switched {
            chain.switch(key == WITHOUT, effect);
        }
        Ok(chain)
    }

    /// Puts an effect on the list of those left out, or takes it off.
    fn switch(&mut self, out: bool, effect: &str) {
        let Some(list) = self.merged.get_mut(IDEALISED).and_then(toml::Value::as_array_mut) else {
            return;
        };
        list.retain(|name| name.as_str() != Some(effect));
        // A name that is no effect is refused with the list.
        if out || !Effect::ALL.iter().any(|known| known.name() == effect) {
            list.push(effect.into());
        }
    }

    /// An error about the value at the dotted `path`, pointing at the document that gave it.
    pub fn error(&self, path: &str, message: impl Into<String>) -> Error {
        place(&self.documents, path).error(message)
    }

    /// An error about what is not there at the dotted `path`: of the documents that were typed.
    pub fn lacks(&self, path: &str, message: &str) -> Error {
        let typed = &self.documents[..self.documents.len() - 1];
        let extends = typed.iter().any(|document| document.table.contains_key("extends"));
        let remedy = match extends {
            true => "",
            false => "; extends = \"NAME\" takes what is left open from a ready sensor",
        };
        place(typed, path).error(format!("{message}{remedy}"))
    }

    /// The file called `name` at the dotted `path`: beside the document that says so.
    pub fn beside(&self, path: &str, name: &str) -> PathBuf {
        let says = |document: &&Document| value_at(&document.table, path).is_some();
        let document = self.documents.iter().find(says);
        document.map_or_else(|| PathBuf::from(name), |document| document.folder.join(name))
    }

    /// The place at which the key at the dotted `path` was typed, if it was: with `--set`, or in the file
    /// itself. A person who switches an effect has typed the list of them.
    pub fn typed(&self, path: &str) -> Option<Typed> {
        if self.is_switched && path == IDEALISED {
            return Some(Typed::Set);
        }
        let mut documents = self.documents.iter();
        let first = documents.next()?;
        let set = (first.origin == OVERRIDES).then_some(first);
        if set.is_some_and(|set| value_at(&set.table, path).is_some()) {
            return Some(Typed::Set);
        }
        let file = if set.is_some() { documents.next()? } else { first };
        value_at(&file.table, path).map(|_| Typed::File)
    }

    /// The same chain without the keys at the dotted `paths`, as far as it is read as one.
    pub fn without(mut self, paths: &[String]) -> Self {
        for path in paths {
            let (mut table, mut key) = (Some(&mut self.merged), path.as_str());
            while let Some((outer, inner)) = key.split_once('.') {
                table = table.and_then(|table| table.get_mut(outer)?.as_table_mut());
                key = inner;
            }
            table.and_then(|table| table.remove(key));
        }
        self
    }

    /// Dotted paths of the values that were left out, with the default taken.
    pub fn defaults_used(&self) -> Vec<(String, String)> {
        let written = &self.documents[..self.documents.len() - 1];
        let mut used = Vec::new();
        leaves(&self.merged, String::new(), &mut |path, value| {
            let is_written = written.iter().any(|d| value_at(&d.table, path).is_some());
            if !is_written && path != PROSE {
                used.push((path.to_owned(), value.to_string()));
            }
        });
        used
    }

    /// The merged document as TOML, from which the same sensor can be built without the chain.
    pub fn text(&self) -> String {
        toml::to_string(&self.merged).unwrap_or_default()
    }
}

impl Document {
    fn parse(text: &str, origin: &str, folder: &Path) -> Result<Self, Error> {
        let table: Table = text.parse().map_err(|error: toml::de::Error| Error {
            origin: origin.to_owned(),
            line_column: error.span().map(|span| line_column(text, span.start)),
            path: String::new(),
            message: told::syntax(text, &error),
            others: Vec::new(),
        })?;
        let (origin, text) = (origin.to_owned(), text.to_owned());
        Ok(Self { origin, text, table, folder: folder.to_owned() })
    }
}

/// Text, origin and folder of a sensor named in `extends` or on the command line.
pub(super) fn open(name_or_file: &Path, folder: &Path) -> Result<(String, String, PathBuf), Error> {
    let name = name_or_file.display().to_string();
    if let Some(text) = name_or_file.to_str().and_then(presets::text) {
        return Ok((text.to_owned(), name, PathBuf::new()));
    }
    let path = folder.join(name_or_file);
    if !name.ends_with(".toml") && !path.exists() {
        return Err(Error::whole(&name, presets::unknown(&name)));
    }
    let text = opened::text(&path).map_err(|error| Error::whole(&name, not_read(&name, &error)))?;
    let next = path.parent().map(Path::to_path_buf).unwrap_or_default();
    Ok((text, path.display().to_string(), next))
}

/// Why a sensor file is not read, and how the ready sensor is named that may be meant.
fn not_read(name: &str, error: &std::io::Error) -> String {
    let why = told::unreadable(error);
    let ready =
        Path::new(name).file_stem().and_then(|stem| presets::text(stem.to_str()?).map(|_| stem));
    match ready {
        Some(stem) => format!(
            "cannot be read: {why}; the ready sensor is called `{}`, without .toml",
            stem.display()
        ),
        None => format!("cannot be read: {why}"),
    }
}

/// Parts of a dotted key at most.
const DEEPEST: usize = 16;

/// Letters that are shown of a key that has more of them.
const SHOWN: usize = 40;

/// `--set a.b=1` as a document. A value that is not TOML is taken as text.
fn document_of_overrides(overrides: &[(String, String)]) -> Result<Document, Error> {
    let mut table = Table::new();
    for (path, typed) in overrides {
        if path.split('.').count() > DEEPEST {
            let begin: String = path.chars().take(SHOWN).collect();
            let message = format!(
                "`{begin}…`: the key has more than {DEEPEST} parts, and no key of a sensor has as many"
            );
            return Err(Error::whole(SET, message));
        }
        let value = toml_value(typed);
        let mut at = &mut table;
        let mut keys = path.split('.').peekable();
        while let Some(key) = keys.next() {
            if keys.peek().is_none() {
                at.insert(key.to_owned(), value.clone());
                break;
            }
            let below = at.entry(key).or_insert_with(|| toml::Value::Table(Table::new()));
            let Some(next) = below.as_table_mut() else {
                return Err(Error::whole(SET, format!("`{path}`: `{key}` is set twice")));
            };
            at = next;
        }
    }
    Ok(Document { origin: SET.to_owned(), text: String::new(), table, folder: PathBuf::new() })
}

/// Adds to `strong`, the table called `name`, what only `weak` has.
fn fill_in(strong: &mut Table, mut weak: Table, name: &str, alternatives: &Alternatives) {
    for (_, kinds) in alternatives.iter().filter(|(table, _)| *table == name) {
        // Only the kind of a family is kept, be it misspelt.
        if name == "family" || kinds.iter().any(|kind| strong.contains_key(*kind)) {
            weak.retain(|kind, _| strong.contains_key(kind) || !kinds.contains(&kind));
        }
    }
    for (key, value) in weak {
        match (strong.get_mut(&key), value) {
            (None, value) => {
                strong.insert(key, value);
            }
            (Some(toml::Value::Table(inner)), toml::Value::Table(below)) => {
                fill_in(inner, below, &key, alternatives);
            }
            (Some(_), _) => {}
        }
    }
}

/// The defaults without the tables that the sensor does not have: no code, another kind of scan.
fn only_for_what_is_there(defaults: &Table, sensor: &Table, alternatives: &Alternatives) -> Table {
    let mut kept = defaults.clone();
    kept.retain(|key, _| match key {
        "code" => sensor.contains_key("code"),
        "safety" => ["optics", "safety"].iter().any(|key| sensor.contains_key(*key)),
        _ => true,
    });
    for &(group, kinds) in alternatives {
        if let Some(toml::Value::Table(inner)) = kept.get_mut(group) {
            let chosen = sensor.get(group).and_then(toml::Value::as_table);
            inner.retain(|key, _| {
                !kinds.contains(&key) || chosen.is_some_and(|c| c.contains_key(key))
            });
        }
    }
    kept
}

fn value_at<'a>(table: &'a Table, path: &str) -> Option<&'a toml::Value> {
    let mut keys = path.split('.');
    let mut value = table.get(keys.next()?)?;
    for key in keys {
        value = value.get(key)?;
    }
    Some(value)
}

fn leaves(table: &Table, path: String, visit: &mut impl FnMut(&str, &toml::Value)) {
    for (key, value) in table {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        match value {
            toml::Value::Table(inner) => leaves(inner, path, visit),
            value => visit(&path, value),
        }
    }
}

struct Place {
    origin: String,
    line_column: Option<(usize, usize)>,
    path: String,
}

impl Place {
    fn error(self, message: impl Into<String>) -> Error {
        Error {
            origin: self.origin,
            line_column: self.line_column,
            path: self.path,
            message: message.into(),
            others: Vec::new(),
        }
    }
}

/// The place of `path` in the strongest document that mentions it; of its nearest ancestor when
/// none does, because what is missing has no place of its own.
fn place(documents: &[Document], path: &str) -> Place {
    let mut wanted = path;
    loop {
        for document in documents {
            if value_at(&document.table, wanted).is_some() {
                return Place {
                    origin: document.origin.clone(),
                    line_column: offset_of_key(&document.text, wanted)
                        .map(|at| line_column(&document.text, at)),
                    path: path.to_owned(),
                };
            }
        }
        match wanted.rsplit_once('.') {
            Some((ancestor, _)) => wanted = ancestor,
            None => break,
        }
    }
    let first = documents.iter().find(|d| d.origin != SET);
    Place {
        origin: first.map(|d| d.origin.clone()).unwrap_or_default(),
        line_column: None,
        path: path.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::ALTERNATIVES;

    fn chain(text: &str) -> Chain {
        Chain::read(text, "mine.toml", Path::new(""), &[], &ALTERNATIVES).unwrap()
    }

    #[test]
    fn the_child_wins_and_the_parent_fills_in() {
        let chain = chain("extends = \"kim-park-2016\"\n[scan]\nmax_range_m = 90.0\n");
        assert_eq!(value_at(&chain.merged, "scan.max_range_m").unwrap().as_float(), Some(90.0));
        assert_eq!(value_at(&chain.merged, "scan.raster.rows").unwrap().as_integer(), Some(480));
    }

    /// A sentence about the parent is not one about the child.
    #[test]
    fn prose_is_not_inherited() {
        let of = |text: &str| value_at(&chain(text).merged, "summary").cloned();
        let said = of("extends = \"kim-park-2016\"\n").unwrap();
        assert_eq!(said.as_str(), Some("extends kim-park-2016"));
        let said = of("extends = \"hdl-64e\"\nsummary = \"mine\"\n").unwrap();
        assert_eq!(said.as_str(), Some("mine"));
        assert_eq!(of("version = 1\n"), None);
        let used = chain("extends = \"kim-park-2016\"\n").defaults_used();
        assert!(used.iter().all(|(key, _)| key != "summary"));
    }

    #[test]
    fn effects_are_switched_on_top_of_what_is_written() {
        let change = |key: &str, effect: &str| (key.to_owned(), effect.to_owned());
        let set = [change(WITH, "footprint"), change(WITHOUT, "inter-chip")];
        let text = "extends = \"kim-park-2016-physical\"\nidealised = [\"footprint\"]";
        let chain = Chain::read(text, "mine.toml", Path::new(""), &set, &ALTERNATIVES).unwrap();
        let list = value_at(&chain.merged, "idealised").unwrap().as_array().unwrap();
        assert_eq!(
            list.iter().filter_map(|name| name.as_str()).collect::<Vec<_>>(),
            ["inter-chip"]
        );
    }

    #[test]
    fn another_code_family_replaces_the_parents() {
        let chain = chain("extends = \"kim-park-2016\"\n[code]\nfamily = { gold = 7 }\n");
        let family = value_at(&chain.merged, "code.family").unwrap().as_table().unwrap();
        assert_eq!(family.keys().collect::<Vec<_>>(), ["gold"]);
    }

    #[test]
    fn another_kind_of_scan_replaces_the_parents() {
        let chain = chain("extends = \"kim-park-2016\"\n[scan.flash]\nrows = 2\n");
        assert!(value_at(&chain.merged, "scan.raster").is_none());
    }

    #[test]
    fn errors_point_at_the_document_that_said_it() {
        let chain = chain("extends = \"kim-park-2016\"\n[scan]\nmax_range_m = 90.0\n");
        let error = chain.error("scan.max_range_m", "too far");
        assert_eq!(error.to_string(), "mine.toml:3:1: scan.max_range_m: too far");
        assert!(chain.error("tdc.bits", "x").to_string().starts_with("kim-park-2016:"));
    }

    #[test]
    fn overrides_are_strongest() {
        let set = [("scan.max_range_m".to_owned(), "12".to_owned())];
        let chain =
            Chain::read("extends = \"hdl-64e\"", "mine.toml", Path::new(""), &set, &ALTERNATIVES)
                .unwrap();
        assert_eq!(value_at(&chain.merged, "scan.max_range_m").unwrap().as_integer(), Some(12));
    }

    #[test]
    fn a_key_of_ten_thousand_parts_is_refused() {
        let set = |parts: usize| {
            let key = vec!["a"; parts].join(".");
            Chain::read(
                "extends = \"hdl-64e\"",
                "m.toml",
                Path::new(""),
                &[(key, "1".to_owned())],
                &ALTERNATIVES,
            )
        };
        assert!(set(DEEPEST).is_ok());
        let told = set(10_000).unwrap_err().to_string();
        assert!(told.starts_with("--set: `a.a.a") && told.contains("more than 16 parts"), "{told}");
        assert!(told.len() < 200, "{told}");
    }

    #[test]
    fn circles_and_unknown_parents_are_refused() {
        let unknown =
            Chain::read("extends = \"kim-prak-2016\"", "m.toml", Path::new(""), &[], &ALTERNATIVES);
        assert!(unknown.unwrap_err().to_string().contains("did you mean `kim-park-2016`"));
    }
}
