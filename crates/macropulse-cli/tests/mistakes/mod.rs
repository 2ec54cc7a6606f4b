//! The mistakes that newcomers make, and what they are told: the place, what is wrong, and what to do.
//!
//! A row is an action and the words that must be in the answer. The exit code of all rows is 2, and nothing
//! is written. The answer is one sentence for each mistake, in no words of the language that the program is
//! written in.

#![allow(missing_docs, clippy::unwrap_used)]

use crate::common;

mod commands;
mod places;
mod recorded;
mod scenarios;
mod scenes;
mod sensors;

use common::{Desk, Ran};

/// An action, and words of the answer.
type Row = (&'static str, &'static [&'static str]);

/// Words of parsers and systems.
const THEIRS: [&str; 12] = [
    "f64",
    "u32",
    "u64",
    "i64",
    "struct ",
    "variant",
    "invalid type",
    "unknown field",
    "os error",
    "entity not found",
    "invalid digit",
    "panicked",
];

/// Runs each line. All of them must be refused with the words of their row.
fn refused<'a>(desk: &Desk, rows: impl IntoIterator<Item = (String, &'a [&'a str])>) {
    let rows = rows.into_iter();
    let wrong: Vec<String> = rows.filter_map(|row| wrong(desk, &row.0, row.1)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

/// Checks a file `mine.toml` of `head` and each text. All of them must be refused.
fn files_refused(desk: &Desk, head: &str, rows: &[Row]) {
    let wrong = rows.iter().filter_map(|(text, words)| {
        let text = format!("{head}{text}\n");
        desk.put("mine.toml", &text);
        Some(format!("{text}{}", wrong(desk, "check mine.toml", words)?))
    });
    let wrong: Vec<String> = wrong.collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

/// Returns the fault of the answer to `line`, if it has one.
fn wrong(desk: &Desk, line: &str, words: &[&str]) -> Option<String> {
    let before = desk.files();
    let Ran { code, out, err } = desk.run(line);
    let is_said = || err.lines().all(|sentence| sentence.starts_with("macropulse: "));
    let missing = words.iter().find(|word| !err.contains(**word));
    let theirs = THEIRS.iter().find(|word| err.contains(**word));
    let why = match (missing, theirs) {
        _ if code != Some(2) || !out.is_empty() => format!("exit code {code:?}, {out}"),
        _ if !(1..=2).contains(&err.lines().count()) || !is_said() => "no sentence".to_owned(),
        (Some(word), _) => format!("does not say {word:?}"),
        (_, Some(word)) => format!("says {word:?}"),
        _ if desk.files() != before => "leaves something behind".to_owned(),
        _ => return None,
    };
    Some(format!("{line}: {why}: {err}"))
}
