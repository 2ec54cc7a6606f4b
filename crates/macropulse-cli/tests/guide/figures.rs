//! The figures of a page against those of commands.
//!
//! A comment on the page says where they come from:
//!
//! ```text
//! <!-- figures
//! street = cat out/manifest.json
//! Of `street` {.right_fraction:.2 %} are right, {.outcomes.wrong} are wrong
//! -->
//! ```
//!
//! A line `name = command` is a command that prints JSON, run there. Any other line is a part of the page
//! with places for figures: filled in, it must stand on the page exactly once. Braces hold the path to a
//! figure: keys and numbers in lists with points between, behind the name of a command or nothing for the
//! last one. A sum of figures, as `{.outcomes.right + .outcomes.near}`, or a difference is possible too. The
//! format stands behind a colon: `.2` with two decimals; `.2 %` in per cent, rounded down as the program
//! does, so that 100 % is all; `.1 mm` in millimetres, `.1 MB` in megabytes; `.1e` as 4.1·10⁻⁷. Without a
//! format the figure is a whole number or a text.

use std::collections::HashMap;

use serde_json::Value;

use crate::desk::Desk;
use crate::page::{Held, Page, one_blank};

/// JSON that the commands of a page have printed so far, by the names that the page gives them.
#[derive(Default)]
pub struct Sources {
    told: HashMap<String, Value>,
    /// The name of the last one.
    last: String,
    /// Lines that have been found on the page.
    found: Vec<String>,
}

impl Sources {
    /// Runs the commands of a comment and looks for its lines on the page.
    ///
    /// # Errors
    /// All that is not so.
    pub fn hold(&mut self, held: &Held, page: &Page, desk: &Desk) -> Result<(), String> {
        let mut wrong = Vec::new();
        for line in &held.lines {
            let outcome = match command(line) {
                Some((name, command)) => desk.json(command).map(|told| self.know(name, told)),
                None => self.filled(line).and_then(|line| {
                    once(&line, &page.words)?;
                    self.found.push(line);
                    Ok(())
                }),
            };
            wrong.extend(outcome.err());
        }
        if wrong.is_empty() { Ok(()) } else { Err(wrong.join("\n")) }
    }

    /// That the numbers in a row of a table have been found.
    ///
    /// # Errors
    /// That they have not.
    pub fn cover(&self, row: &str) -> Result<(), String> {
        let plain: String = row.split('`').step_by(2).collect();
        let is_figure =
            |word: &str| word.trim_start_matches('(').starts_with(|c: char| c.is_ascii_digit());
        let has_none = !plain.split_whitespace().any(is_figure);
        match has_none || self.found.iter().any(|found| row.contains(found) || found.contains(row))
        {
            true => Ok(()),
            false => {
                Err(format!("no comment says where the figures of this row are from:\n    {row}"))
            }
        }
    }

    fn know(&mut self, name: &str, told: Value) {
        self.told.insert(name.to_owned(), told);
        name.clone_into(&mut self.last);
    }

    /// A line with its figures.
    fn filled(&self, line: &str) -> Result<String, String> {
        let mut pieces = line.split('{');
        let mut filled = pieces.next().unwrap_or_default().to_owned();
        for piece in pieces {
            let (place, after) =
                piece.split_once('}').ok_or(format!("`{line}`: a `}}` is missing"))?;
            let (pointers, form) = place.split_once(':').unwrap_or((place, ""));
            filled
                .push_str(&self.figure(pointers, form).map_err(|why| format!("`{line}`: {why}"))?);
            filled.push_str(after);
        }
        if filled == line { Err(format!("`{line}` has no figure")) } else { Ok(one_blank(&filled)) }
    }

    fn figure(&self, pointers: &str, form: &str) -> Result<String, String> {
        let (mut sum, mut sign) = (0.0, 1.0);
        for word in pointers.split_whitespace() {
            match word {
                "+" => sign = 1.0,
                "-" => sign = -1.0,
                pointer => match self.at(pointer)? {
                    Value::String(text) if pointer == pointers && form.is_empty() => {
                        return Ok(text.clone());
                    }
                    value => {
                        let number = value.as_f64().ok_or(format!("`{pointer}` is no number"))?;
                        sum += sign * number;
                    }
                },
            }
        }
        written(sum, form).ok_or(format!("{sum} cannot be written as `{form}`"))
    }

    fn at(&self, pointer: &str) -> Result<&Value, String> {
        let mut keys = pointer.split('.');
        let name = keys.next().filter(|name| !name.is_empty()).unwrap_or(&self.last);
        let mut value = self.told.get(name).ok_or(format!("there is no command `{name}`"))?;
        for key in keys {
            let inside = match key.parse::<usize>() {
                Ok(index) if value.is_array() => value.get(index),
                _ => value.get(key),
            };
            value = inside.ok_or(format!("`{pointer}`: there is no `{key}`"))?;
        }
        Ok(value)
    }
}

/// The name and command of a line `name = command`.
fn command(line: &str) -> Option<(&str, &str)> {
    let (name, command) = line.split_once(" = ")?;
    let is_name = name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_');
    is_name.then_some((name, command))
}

/// `number` in the form told at the head of this file.
fn written(number: f64, form: &str) -> Option<String> {
    if let Some(decimals) = form.strip_prefix('.').and_then(|form| form.strip_suffix('e')) {
        let decimals: usize = decimals.parse().ok()?;
        if number == 0.0 {
            return Some("0".into());
        }
        let text = format!("{number:.decimals$e}");
        let (digits, power) = text.split_once('e')?;
        let raised = power.chars().map(|sign| match sign {
            '-' => Some('⁻'),
            digit => "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit.to_digit(10)? as usize),
        });
        return Some(format!("{digits}·10{}", raised.collect::<Option<String>>()?));
    }
    let (decimals, unit) = form.split_once(' ').unwrap_or((form, ""));
    let decimals = match decimals.strip_prefix('.') {
        Some(digits) => digits.parse().ok()?,
        None if form.is_empty() && number.fract() == 0.0 => 0,
        None => return None,
    };
    let number = match unit {
        "" => number,
        "%" => {
            let steps = 10_f64.powi(2 + decimals as i32);
            // A whole number of steps stays one.
            (number * steps + 1e-6).floor() / steps * 100.0
        }
        "mm" => number * 1e3,
        "MB" => number * 1e-6,
        _ => return None,
    };
    let text = grouped(&format!("{number:.decimals$}"));
    Some(if unit.is_empty() { text } else { format!("{text} {unit}") })
}

/// Thousands apart, as the program prints them: 4 096.
fn grouped(text: &str) -> String {
    let whole = text.find('.').unwrap_or(text.len());
    let first = text.find(|c: char| c.is_ascii_digit()).unwrap_or(whole);
    let apart = |k: usize| k > first && k < whole && (whole - k).is_multiple_of(3);
    let place = |(k, c): (usize, char)| [apart(k).then_some(' '), Some(c)];
    text.chars().enumerate().flat_map(place).flatten().collect()
}

/// That `line` stands in `words` once.
fn once(line: &str, words: &str) -> Result<(), String> {
    match words.matches(line).count() {
        1 => Ok(()),
        0 => Err(format!("the page does not say what is found:\n    {line}")),
        n => Err(format!("the page says this {n} times, say more of what is meant:\n    {line}")),
    }
}

/// That what a page shows of an output was `printed`: piece by piece, `…` being whatever is left out.
/// Line ends and columns do not count, nor do durations and speeds.
///
/// # Errors
/// The first piece that was not printed, and all that was.
pub fn shown(text: &str, printed: &str) -> Result<(), String> {
    let all = steady(printed);
    let mut rest = all.as_str();
    for piece in text.split('…') {
        let piece = steady(piece);
        let Some(at) = rest.find(&piece) else {
            return Err(format!("not printed, or not in this order: {piece}\nbut\n{printed}"));
        };
        rest = &rest[at + piece.len()..];
    }
    Ok(())
}

/// Words with one blank between, and `#` for the numbers of durations and speeds.
fn steady(text: &str) -> String {
    let mut words: Vec<&str> = text.split_whitespace().collect();
    let bare = |word: &str| word.trim_matches(['(', ')', ',', ';', '.']).to_owned();
    for k in 1..words.len() {
        let is_number = |word: &str| bare(word).starts_with(|c: char| c.is_ascii_digit());
        if ["s", "ms", "us"].contains(&bare(words[k]).as_str()) && is_number(words[k - 1]) {
            (words[k - 1], words[k]) = ("#", "s");
        } else if bare(words[k - 1]) == "speed" && is_number(words[k]) {
            words[k] = "#";
        }
    }
    words.join(" ")
}

#[test]
fn numbers_are_written_as_on_the_pages() {
    for (number, form, text) in [
        (289_198.0, "", "289 198"),
        (-1234.0, "", "-1 234"),
        (-123.0, "", "-123"),
        (99.0, "", "99"),
        (0.99999, ".2 %", "99.99 %"),
        (0.29, ".0 %", "29 %"),
        (0.002_46, ".1 mm", "2.5 mm"),
        (1234.5678, ".3", "1 234.568"),
        (4.04e-7, ".0e", "4·10⁻⁷"),
        (4.684e-17, ".1e", "4.7·10⁻¹⁷"),
        (0.0, ".1e", "0"),
    ] {
        assert_eq!(written(number, form).as_deref(), Some(text));
    }
    for (number, form) in [(0.5, ""), (1.0, ".x"), (1.0, ".1 km"), (1.0, "3")] {
        assert_eq!(written(number, form), None, "{number} {form}");
    }
}

#[test]
fn figures_are_filled_in() {
    let told =
        serde_json::json!({ "right": 0.5, "list": [{ "n": 3 }, { "n": 2000 }], "word": "yes" });
    let mut sources = Sources::default();
    sources.know("a", told);
    for line in [
        "| {a.word} |  {a.list.0.n + a.list.1.n} | {a.right:.1 %} |",
        "| {.word} | {.list.1.n - .list.0.n + .list.0.n + .list.0.n} | {.right:.1 %} |",
    ] {
        assert_eq!(sources.filled(line).as_deref(), Ok("| yes | 2 003 | 50.0 % |"));
    }
    for line in ["no figure", "{a.list.7.n}", "{b.right:.1}", "{a.right", "{a.list:.1}"] {
        assert!(sources.filled(line).is_err(), "{line}");
    }
    assert!(once("a b", "a b").is_ok() && once("a b", "a c").is_err() && once("a", "a a").is_err());
    sources.found.push("b | 5 m |".to_owned());
    assert!(sources.cover("| b | 5 m |").is_ok() && sources.cover("| c | `7` |").is_ok());
    assert!(sources.cover("| b | 6 m |").is_err());
    assert_eq!(command("a_1 = cat a = b"), Some(("a_1", "cat a = b")));
    assert_eq!(command("| x = y |"), None);
}

#[test]
fn output_is_held_but_for_times() {
    let printed =
        "1 scan, 0.02 s (speed 1.7938)\n  shots   4 096\n  rejects 3\n  time  emit 84 us,\n  12 ms";
    shown("1 scan, 1.5 s (speed 1/7)\n shots 4 096\n…\n time emit 3 ms, 1 ms\n", printed).unwrap();
    for wrong in ["2 scan", "shots 4 097", "rejects 3 … shots", "time emit"] {
        let outcome = shown(wrong, printed);
        assert_eq!(outcome.is_err(), wrong != "time emit", "{wrong}");
    }
}
