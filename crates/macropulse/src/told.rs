//! What is said of a file that is wrong, in words for whoever typed it: parsers and systems say it in
//! theirs.

use std::io;

use serde::de::DeserializeOwned;

use crate::names::{key_at, line_column, nearest, offset_of_key};

/// What the TOML `text` of a file called `origin` says, as a `T`.
///
/// # Errors
/// Where it is wrong, and how, in one sentence.
pub fn typed<T: DeserializeOwned>(text: &str, origin: &str) -> Result<T, String> {
    toml::from_str(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start);
        let (line, column) = line_column(text, start);
        match text.parse::<toml::Table>() {
            Err(fault) => format!("{origin}:{line}:{column}: {}", syntax(text, &fault)),
            Ok(_) => {
                let key = key_at(text, start).map_or_else(String::new, |key| format!("{key}: "));
                format!("{origin}:{line}:{column}: {key}{}", wrong(error.message(), None))
            }
        }
    })
}

/// A sentence about the value at the dotted `path` of the TOML `text` of a file called `origin`.
pub fn at(text: &str, origin: &str, path: &str, message: &str) -> String {
    match offset_of_key(text, path).map(|offset| line_column(text, offset)) {
        Some((line, column)) => format!("{origin}:{line}:{column}: {path}: {message}"),
        None => format!("{origin}: {path}: {message}"),
    }
}

/// Why a file cannot be read.
pub fn unreadable(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".to_owned(),
        io::ErrorKind::IsADirectory => "it is a folder".to_owned(),
        io::ErrorKind::NotADirectory => "a part of its path is a file, not a folder".to_owned(),
        io::ErrorKind::InvalidData => "it is not text in UTF-8".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        _ => error.to_string(),
    }
}

/// Why a file or folder cannot be written, or standard output.
pub fn unwritable(error: &io::Error) -> String {
    let known = match error.kind() {
        io::ErrorKind::NotFound => "there is no such file or folder",
        io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => "a file is in the way",
        io::ErrorKind::IsADirectory => "a folder is in the way",
        io::ErrorKind::PermissionDenied => "permission denied",
        io::ErrorKind::ReadOnlyFilesystem => "nothing can be written to this file system",
        io::ErrorKind::StorageFull => "the disk is full",
        io::ErrorKind::QuotaExceeded => "your share of the disk is used up",
        io::ErrorKind::FileTooLarge => "a file may not be as large as this here",
        // What the system says, without its number.
        _ => return error.to_string().split(" (os error").next().unwrap_or_default().to_owned(),
    };
    known.to_owned()
}

/// Whether an `error` in writing is that of the machine, and not of whoever typed the name of a place.
pub fn is_of_the_machine(error: &io::Error) -> bool {
    !matches!(
        error.kind(),
        io::ErrorKind::NotFound
            | io::ErrorKind::NotADirectory
            | io::ErrorKind::AlreadyExists
            | io::ErrorKind::IsADirectory
            | io::ErrorKind::InvalidFilename
            | io::ErrorKind::InvalidInput
    )
}

/// Why `text` is not TOML.
pub fn syntax(text: &str, error: &toml::de::Error) -> String {
    let said = error.message();
    let (before, behind) = error
        .span()
        .and_then(|span| text.split_at_checked(span.start))
        .map_or(("", ""), |(before, behind)| (before, behind.lines().next().unwrap_or_default()));
    let is_behind_a_digit = before.ends_with(|c: char| c.is_ascii_digit());
    let remedy = match said {
        _ if is_behind_a_digit && behind.starts_with(',') => {
            "a number is written with a point, as 0.5"
        }
        _ if said.starts_with("string values must be quoted") => match behind.chars().next() {
            Some('0'..='9' | '+' | '-' | '.') => {
                "a number stands alone, without a unit, which is part of the name of its key"
            }
            _ => "text stands in quotes, as \"street\"",
        },
        _ if said.starts_with("duplicate key") => {
            "this key or table is there twice; put into one what belongs together"
        }
        _ if text.trim_start().starts_with('{') => {
            "it looks like JSON; a line of TOML says KEY = VALUE"
        }
        _ if said.starts_with("key with no value") => "a line says KEY = VALUE",
        _ => said,
    };
    format!("is not TOML: {remedy}")
}

/// What is wrong with a value that TOML allows and the file does not, from what the parser `said`;
/// `wanted` tells what must stand there, if it is known.
pub fn wrong(said: &str, wanted: Option<&str>) -> String {
    let quoted: Vec<&str> = said.split('`').skip(1).step_by(2).collect();
    if let Some(rest) = said.strip_prefix("unexpected keys in table: ")
        && let Some((wrong, known)) = rest.split_once(", available keys: ")
    {
        let wrong = wrong.split(", ").next().unwrap_or(wrong);
        return unknown("key", wrong, &known.split(", ").collect::<Vec<_>>());
    }
    match (&quoted[..], said) {
        ([wrong, known @ ..], _) if said.starts_with("unknown field") => {
            return unknown("key", wrong, known);
        }
        ([wrong, known @ ..], _) if said.starts_with("unknown variant") => {
            return unknown("value", wrong, known);
        }
        ([key, ..], _) if said.starts_with("missing field") => {
            return format!("the key `{key}` is missing");
        }
        _ => {}
    }
    let (found, expected) = said.rsplit_once(", expected ").unwrap_or((said, ""));
    let Some(must_be) = wanted.map(str::to_owned).or_else(|| kind(expected)) else {
        return said.to_owned();
    };
    if let Some(length) = found.strip_prefix("invalid length ") {
        let of = if length == "1" { "entry" } else { "entries" };
        return format!("has {length} {of}, but must be {must_be}");
    }
    let found = found.split_once(": ").map_or("", |(_, found)| found);
    match is(found) {
        None => format!("must be {must_be}"),
        Some(is) => format!("is {is}, but must be {must_be}{}", remedy(found, &must_be)),
    }
}

/// What is said of a `word` that is not among those that are `known`.
pub fn unknown(what: &str, word: &str, known: &[&str]) -> String {
    let known: Vec<&str> = known.iter().copied().filter(|name| *name != word).collect();
    match nearest(word, known.iter().copied()) {
        Some(near) => format!("unknown {what} `{word}`; did you mean `{near}`?"),
        None => format!("unknown {what} `{word}`; known are {}", known.join(", ")),
    }
}

/// What a parser found, as people call it; `None` where its words say nothing.
fn is(found: &str) -> Option<String> {
    let number = |kind: &str| Some(found.strip_prefix(kind)?.trim_matches('`').to_owned());
    if let Some(text) = found.strip_prefix("string ") {
        return Some(format!("the text {text}"));
    }
    ["floating point ", "integer ", "boolean "].into_iter().find_map(number).or(match found {
        "map" => Some("a table".to_owned()),
        "sequence" => Some("a list".to_owned()),
        _ => None,
    })
}

/// What a parser wanted, as people call it.
fn kind(expected: &str) -> Option<String> {
    let kind = match expected {
        "f64" | "f32" => "a number",
        "u8" => "a whole number from 0 to 255",
        "u16" => "a whole number from 0 to 65535",
        "u32" => "a whole number from 0 to 4294967295",
        "u64" | "usize" => "a whole number, 0 or more",
        "i8" | "i16" | "i32" | "i64" => "a whole number",
        "a string" => "text in quotes",
        "a boolean" => "true or false",
        "a sequence" => "a list, as [ … ]",
        "a map" => "a table, as { key = value }",
        "an array of length 3" => "a list of 3 numbers, as [1.0, 2.0, 3.0]",
        _ if expected.starts_with("struct ") => "a table, as { key = value }",
        _ => return None,
    };
    Some(kind.to_owned())
}

/// What to do about a number in quotes.
fn remedy(found: &str, must_be: &str) -> &'static str {
    let Some(text) = found.strip_prefix("string ").map(|text| text.trim_matches('"')) else {
        return "";
    };
    let is_for_a_number =
        ["a number", "a whole number"].iter().any(|kind| must_be.starts_with(kind));
    match is_for_a_number {
        true if text.parse::<f64>().is_ok() => ": take the quotes away",
        true if text.starts_with(|c: char| c.is_ascii_digit()) => {
            ": write it alone, as the name of the key says its unit"
        }
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn not_toml(text: &str) -> String {
        syntax(text, &text.parse::<toml::Table>().unwrap_err())
    }

    #[test]
    fn what_is_not_toml_is_told_with_what_to_write() {
        for (text, told) in [
            ("name = mine", "text stands in quotes"),
            ("a = 90 m", "a number stands alone, without a unit"),
            ("a = 0,5", "a number is written with a point"),
            ("a = 1\na = 2", "there twice"),
            ("[a]\n[a]", "there twice"),
            ("name: mine", "KEY = VALUE"),
            ("{ \"name\": 1 }", "it looks like JSON"),
        ] {
            let said = not_toml(text);
            assert!(said.starts_with("is not TOML: ") && said.contains(told), "{text}: {said}");
        }
    }

    #[test]
    fn no_type_of_rust_is_named() {
        for (said, told) in [
            (
                "invalid type: string \"90\", expected f64",
                "is the text \"90\", but must be a number: take the quotes away",
            ),
            (
                "invalid type: string \"90m\", expected f64",
                "is the text \"90m\", but must be a number: write it alone, as the name of the key says its unit",
            ),
            (
                "invalid type: floating point `1.5`, expected u32",
                "is 1.5, but must be a whole number from 0 to 4294967295",
            ),
            (
                "invalid type: integer `3`, expected struct Crc",
                "is 3, but must be a table, as { key = value }",
            ),
            (
                "invalid length 1, expected an array of length 3",
                "has 1 entry, but must be a list of 3 numbers, as [1.0, 2.0, 3.0]",
            ),
            ("missing field `a`", "the key `a` is missing"),
            (
                "unknown field `nmae`, expected `name` or `b`",
                "unknown key `nmae`; did you mean `name`?",
            ),
            (
                "unknown variant `z`, expected one of `m`, `cm`",
                "unknown value `z`; known are m, cm",
            ),
            (
                "unexpected keys in table: size, available keys: size_m",
                "unknown key `size`; did you mean `size_m`?",
            ),
            ("anything else", "anything else"),
        ] {
            assert_eq!(wrong(said, None), told);
        }
        let told = wrong("invalid type: unit variant, expected newtype variant", Some("{ a = … }"));
        assert_eq!(told, "must be { a = … }");
    }

    #[test]
    fn files_that_are_not_there_are_told_in_words_of_ours() {
        assert_eq!(unreadable(&io::ErrorKind::NotFound.into()), "there is no such file");
        assert_eq!(unreadable(&io::ErrorKind::IsADirectory.into()), "it is a folder");
    }
}
