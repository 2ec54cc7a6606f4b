//! Help with misspelt names, places in texts, and values typed on a command line.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Returns the name in `known` that `typed` was probably meant to be, if any is near enough. Near names are a
/// few letters apart, or one is the beginning of the other, as `yaw` and `yaw_degrees` of `yaw_deg`. Capitals
/// do not matter.
pub fn nearest<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let typed = typed.to_lowercase();
    known
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(&typed, name), name))
        .filter(|(distance, name)| {
            // A short word has few letters left if some are changed.
            let most = match name.chars().count() {
                0..=2 => 0,
                3 | 4 => 1,
                count => 1 + count / 3,
            };
            *distance <= most
                || (name.len() > 3 && typed.starts_with(name))
                || (typed.len() > 2 && name.starts_with(&typed))
        })
        .min()
        .map(|(_, name)| name)
}

/// Line and column, both from 1, of the byte at `offset` of `text`.
pub(crate) fn line_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    (line, column)
}

/// A step from a value to one below it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Step {
    /// To the value of a key of a table.
    Key(String),
    /// To an entry of a list.
    Entry(usize),
}

/// Bytes, in a TOML `text`, of the value to which the `steps` lead, or of its key.
pub(crate) fn span_of(text: &str, steps: &[Step], of_key: bool) -> Option<Range<usize>> {
    let root = DeTable::parse(text).ok()?;
    let (mut value, mut span) = (None::<&Spanned<DeValue>>, 0..0);
    for step in steps {
        let below = match step {
            Step::Key(key) => {
                let table = match value {
                    None => root.get_ref(),
                    Some(value) => value.get_ref().as_table()?,
                };
                let (name, below) = table.iter().find(|(name, _)| name.get_ref() == key)?;
                span = if of_key { name.span() } else { below.span() };
                below
            }
            Step::Entry(at) => {
                let below = value?.get_ref().as_array()?.get(*at)?;
                span = below.span();
                below
            }
        };
        value = Some(below);
    }
    Some(span)
}

/// Byte offset, in a TOML `text`, of the key at the dotted `path`.
pub(crate) fn offset_of_key(text: &str, path: &str) -> Option<usize> {
    let steps: Vec<Step> = path.split('.').map(|key| Step::Key(key.to_owned())).collect();
    span_of(text, &steps, true).map(|span| span.start)
}

/// The key, or the element of a list, that stands around the byte at `offset` of a TOML `text`, as
/// `object[1].position_m`; `None` if none does.
pub(crate) fn key_at(text: &str, offset: usize) -> Option<String> {
    let root = DeTable::parse(text).ok()?;
    let mut path = String::new();
    within_table(root.get_ref(), offset, &mut path);
    (!path.is_empty()).then_some(path)
}

fn within_table(table: &DeTable, offset: usize, path: &mut String) {
    // A table with a header spans no more than that: what lies in it is asked for first.
    for (name, value) in table.iter() {
        let before = path.len();
        path.push_str(if path.is_empty() { "" } else { "." });
        path.push_str(name.get_ref());
        let inside = path.len();
        within(value.get_ref(), offset, path);
        let is_here = |span: std::ops::Range<usize>| (span.start..=span.end).contains(&offset);
        if path.len() > inside || is_here(name.span()) || is_here(value.span()) {
            return;
        }
        path.truncate(before);
    }
}

fn within(value: &DeValue, offset: usize, path: &mut String) {
    match value {
        DeValue::Table(inner) => within_table(inner, offset, path),
        DeValue::Array(list) => {
            for (at, element) in list.iter().enumerate() {
                let before = path.len();
                path.push_str(&format!("[{at}]"));
                let inside = path.len();
                within(element.get_ref(), offset, path);
                let is_table = element.get_ref().is_table();
                let span = element.span();
                if path.len() > inside || (is_table && (span.start..=span.end).contains(&offset)) {
                    return;
                }
                path.truncate(before);
            }
        }
        _ => {}
    }
}

/// The value that `typed` is as TOML; what is not TOML is taken as text.
pub fn toml_value(typed: &str) -> toml::Value {
    let parsed = format!("v = {typed}").parse::<toml::Table>().ok();
    let value = parsed.and_then(|mut parsed| parsed.remove("v"));
    value.unwrap_or_else(|| toml::Value::String(typed.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::{key_at, line_column, nearest};

    #[test]
    fn lines_and_columns_count_from_one() {
        assert_eq!(line_column("a\nbcd", 0), (1, 1));
        assert_eq!(line_column("a\nbcd", 4), (2, 3));
        assert_eq!(line_column("a\n", 99), (2, 1));
    }

    #[test]
    fn a_place_is_named_by_its_key() {
        let text = "version = 1\n[sensor]\nyaw_deg = 3\n[[object]]\nname = \"a\"\n[[object]]\n\
                    position_m = [1.0, 2.0]\nshape = { box = { size_m = [1, 1, 1] } }\n";
        let key = |found: &str| key_at(text, text.find(found).unwrap());
        for (found, wanted) in [
            ("version", "version"),
            ("3", "sensor.yaw_deg"),
            ("name", "object[0].name"),
            ("1.0", "object[1].position_m"),
            ("position_m", "object[1].position_m"),
            ("size_m", "object[1].shape.box.size_m"),
            ("[[object]]", "object[0]"),
        ] {
            assert_eq!(key(found).as_deref(), Some(wanted));
        }
        assert_eq!((key_at("", 0), key_at("a = ", 0)), (None, None));
    }

    #[test]
    fn a_slip_is_understood_and_nonsense_is_not() {
        let known = ["hdl-64e", "peregrine"];
        assert_eq!(nearest("hdl64e", known), Some("hdl-64e"));
        assert_eq!(nearest("perigrine", known), Some("peregrine"));
        assert_eq!(nearest("banana", known), None);
        assert_eq!(nearest("yaw_degrees", ["scale", "yaw_deg"]), Some("yaw_deg"));
        assert_eq!(nearest("yaw", ["car", "yaw_deg"]), Some("yaw_deg"));
        assert_eq!(nearest("Z", ["x", "z"]), Some("z"));
        assert_eq!((nearest("xyz", ["laz"]), nearest("w", ["x"])), (None, None));
    }
}
