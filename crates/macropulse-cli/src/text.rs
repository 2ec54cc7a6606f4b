//! Output: to stdout, with counts and durations one can read, and to stderr. Nothing else in the program
//! writes to either.

use std::io::{ErrorKind, Write, stderr};

use anstyle::AnsiColor;
use macropulse::formats::versioned;
use macropulse_study::text::broken;
pub use macropulse_study::text::{Columns, NO_BREAK, counted, grouped, section, short};

use crate::fault::Fault;

/// Writes to stdout, without signs that a terminal would obey. A reader who has seen enough (`| head`) is no
/// fault.
pub fn print(text: &str) -> Result<(), Fault> {
    print_bytes(harmless(text, |_| char::REPLACEMENT_CHARACTER.to_string()).as_bytes())
}

/// As [`print`], what is no text.
pub fn print_bytes(bytes: &[u8]) -> Result<(), Fault> {
    pour(bytes).map(|_| ())
}

/// As [`print_bytes`]; `false` once the reader has seen enough.
pub fn pour(bytes: &[u8]) -> Result<bool, Fault> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(Fault::unprinted(&error)),
    }
}

/// Writes a line to stderr, in colour where that is a terminal that wants it. It may be closed or full:
/// what is said there is not what was asked for, and its loss ends no run.
pub fn say(line: &str) {
    let _ = writeln!(anstream::stderr(), "{line}");
}

/// Says on stderr the reasons of a `fault`, one sentence each.
pub fn complain(fault: &Fault) {
    fault.sentences().iter().for_each(|sentence| tell(sentence, AnsiColor::Red));
}

/// Says on stderr, as one sentence, that something went otherwise than was asked for: a result
/// without a point, a run that was stopped.
pub fn warn(sentence: &str) {
    tell(sentence, AnsiColor::Yellow);
}

/// A sentence on stderr, with the name of the program before it: on a terminal in colour and broken
/// at its width, elsewhere one line.
fn tell(sentence: &str, colour: AnsiColor) {
    let text = format!("macropulse: {}", one_line(sentence));
    let text = match terminal_size::terminal_size_of(stderr()) {
        Some((terminal_size::Width(width), _)) => broken(&text, usize::from(width)).join("\n  "),
        None => text,
    };
    let rest = text.strip_prefix("macropulse:").unwrap_or(&text);
    let name = colour.on_default().bold();
    // Without colour where stderr is no terminal, or NO_COLOR is set.
    say(&format!("{name}macropulse:{name:#}{rest}"));
}

/// A text in one line: names and files that it repeats may have several, and signs that a terminal
/// would obey.
fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let text = lines.collect::<Vec<_>>().join(" ").replace('\t', " ");
    clipped(harmless(&text, |_| char::REPLACEMENT_CHARACTER.to_string()))
}

/// Most letters of a sentence, at its beginning and at its end: a word of a file may have millions.
const MOST_LETTERS: [usize; 2] = [3000, 1000];

/// A sentence without its middle where that is too long.
fn clipped(text: String) -> String {
    let [head, tail] = MOST_LETTERS;
    let place = |letter: Option<(usize, char)>| letter.map(|(place, _)| place);
    let from = place(text.char_indices().nth(head));
    let to = place(text.char_indices().rev().nth(tail));
    match (from, to) {
        (Some(from), Some(to)) if from < to => format!("{} … {}", &text[..from], &text[to..]),
        _ => text,
    }
}

/// A text in which every sign that a terminal would obey is `replaced`: control characters, and those that
/// turn the direction of what follows them.
pub fn harmless(text: &str, replaced: impl Fn(char) -> String) -> String {
    let is_obeyed = |sign: char| match sign {
        '\n' | '\t' => false,
        '\u{61c}' | '\u{200e}' | '\u{200f}' => true,
        '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => true,
        sign => sign.is_control(),
    };
    let mut harmless = String::with_capacity(text.len());
    for sign in text.chars() {
        match is_obeyed(sign) {
            true => harmless += &replaced(sign),
            false => harmless.push(sign),
        }
    }
    harmless
}

/// Writes JSON to stdout, each object with the version of its keys: the only one as itself, several
/// as an array.
pub fn print_json(values: Vec<serde_json::Value>) -> Result<(), Fault> {
    let mut values: Vec<_> = values.into_iter().map(versioned).collect();
    let value = if values.len() == 1 { values.remove(0) } else { values.into() };
    // As JSON spells them, so that a program reads the same text.
    let text = harmless(&format!("{value:#}\n"), |sign| format!("\\u{:04x}", u32::from(sign)));
    print_bytes(text.as_bytes())
}

/// The text of a ready file to start from: its first line names a schema beside it, which is not
/// where the text will be.
pub fn to_start_from(toml: &str) -> &str {
    match toml.split_once('\n') {
        Some((first, rest)) if first.starts_with("#:schema ") => rest,
        _ => toml,
    }
}

/// The keys and values of a file in TOML, as JSON.
pub fn values(toml: &str) -> serde_json::Value {
    let table = toml.parse::<toml::Table>().ok();
    table.and_then(|table| serde_json::to_value(table).ok()).unwrap_or_default()
}

/// A duration in the unit that suits it.
pub fn lasted(seconds: f64) -> String {
    match seconds {
        s if s >= 1.0 => format!("{s:.2}{NO_BREAK}s"),
        s if s >= 1e-3 => format!("{:.0}{NO_BREAK}ms", s * 1e3),
        s => format!("{:.0}{NO_BREAK}us", s * 1e6),
    }
}

/// The first sentence of a text.
pub fn first_sentence(text: &str) -> &str {
    text.split_once(". ").map_or(text, |(first, _)| first).trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_is_told_nothing_to_obey() {
        assert_eq!(one_line(" a\u{1b}[31mb\u{7}\tc\n\n d"), "a\u{fffd}[31mb\u{fffd} c d");
    }

    #[test]
    fn a_word_of_millions_of_letters_is_told_by_its_beginning_and_its_end() {
        let told = one_line(&format!("a.obj: line 1 has {}; mend it", "\u{e9}".repeat(1_000_000)));
        assert!(told.starts_with("a.obj: line 1 has \u{e9}") && told.ends_with("\u{e9}; mend it"));
        assert!(told.chars().count() < 4100 && told.contains(" … "));
        let whole = "\u{e9}".repeat(4000);
        assert_eq!(one_line(&whole), whole);
    }

    #[test]
    fn a_schema_is_not_named_where_it_is_not() {
        assert_eq!(to_start_from("#:schema ../s.json\n# A wall.\n"), "# A wall.\n");
        assert_eq!(to_start_from("# A wall.\na = 1\n"), "# A wall.\na = 1\n");
    }

    #[test]
    fn terminal_obeys_nothing_and_json_keeps_its_text() {
        let text = "a\u{1b}[31m\u{202e}b\u{9b}\tc\nd\u{2069}";
        let seen = harmless(text, |_| "?".to_owned());
        assert_eq!(seen, "a?[31m?b?\tc\nd?");
        let json = serde_json::Value::from(text).to_string();
        let told = harmless(&json, |sign| format!("\\u{:04x}", u32::from(sign)));
        assert_eq!(serde_json::from_str::<String>(&told).unwrap(), text);
        assert!(told.is_ascii(), "{told}");
    }

    #[test]
    fn counts_are_grouped_and_durations_have_a_unit() {
        assert_eq!(grouped(407_040).replace(NO_BREAK, " "), "407 040");
        assert_eq!(grouped(99), "99");
        let durations = [1.5, 0.0123, 4.2e-5].map(|s| lasted(s).replace(NO_BREAK, " "));
        assert_eq!(durations, ["1.50 s", "12 ms", "42 us"]);
    }
}
