//! Messages about faulty files, in words for whoever typed them: parsers and systems use words of their own.

use std::io;

use crate::names::{line_column, nearest, offset_of_key};

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
        // The words of the system, without its number.
        _ => return error.to_string().split(" (os error").next().unwrap_or_default().to_owned(),
    };
    known.to_owned()
}

/// Returns true if an `error` in writing is that of the machine, and not of whoever typed the name of a
/// place.
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

/// Returns the message for a `word` that is not among those that are `known`.
pub fn unknown(what: &str, word: &str, known: &[&str]) -> String {
    let known: Vec<&str> = known.iter().copied().filter(|name| *name != word).collect();
    match nearest(word, known.iter().copied()) {
        Some(near) => format!("unknown {what} `{word}`; did you mean `{near}`?"),
        None => format!("unknown {what} `{word}`; known are {}", known.join(", ")),
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
    fn files_that_are_not_there_are_told_in_words_of_ours() {
        assert_eq!(unreadable(&io::ErrorKind::NotFound.into()), "there is no such file");
        assert_eq!(unreadable(&io::ErrorKind::IsADirectory.into()), "it is a folder");
    }
}
