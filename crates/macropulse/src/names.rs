//! Help with misspelt names, places in texts, and values typed on a command line.

use toml::de::DeTable;

/// The one of `known` that `typed` was probably meant to be, if any is near enough: a few letters
/// apart, or the beginning of it, as `yaw_deg` is of `yaw_degrees`.
pub fn nearest<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(typed, name), name))
        .min()
        .filter(|(distance, name)| {
            // Words written out, as `yaw_degrees`, are far from what they mean but begin with it.
            *distance <= 1 + name.chars().count().max(3) / 3
                || (name.len() > 3 && typed.starts_with(name))
        })
        .map(|(_, name)| name)
}

/// Line and column, both from 1, of the byte at `offset` of `text`.
pub(crate) fn line_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    (line, column)
}

/// Byte offset, in a TOML `text`, of the key at the dotted `path`.
pub(crate) fn offset_of_key(text: &str, path: &str) -> Option<usize> {
    let root = DeTable::parse(text).ok()?;
    let mut table = root.get_ref();
    let mut keys = path.split('.').peekable();
    while let Some(key) = keys.next() {
        let (name, value) = table.iter().find(|(name, _)| name.get_ref().as_ref() == key)?;
        if keys.peek().is_none() {
            return Some(name.span().start);
        }
        table = value.get_ref().as_table()?;
    }
    None
}

/// The value that `typed` is as TOML; what is not TOML is taken as text.
pub fn toml_value(typed: &str) -> toml::Value {
    let parsed = format!("v = {typed}").parse::<toml::Table>().ok();
    let value = parsed.and_then(|mut parsed| parsed.remove("v"));
    value.unwrap_or_else(|| toml::Value::String(typed.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::{line_column, nearest};

    #[test]
    fn lines_and_columns_count_from_one() {
        assert_eq!(line_column("a\nbcd", 0), (1, 1));
        assert_eq!(line_column("a\nbcd", 4), (2, 3));
        assert_eq!(line_column("a\n", 99), (2, 1));
    }

    #[test]
    fn a_slip_is_understood_and_nonsense_is_not() {
        let known = ["hdl-64e", "peregrine"];
        assert_eq!(nearest("hdl64e", known), Some("hdl-64e"));
        assert_eq!(nearest("perigrine", known), Some("peregrine"));
        assert_eq!(nearest("banana", known), None);
        assert_eq!(nearest("yaw_degrees", ["scale", "yaw_deg"]), Some("yaw_deg"));
    }
}
