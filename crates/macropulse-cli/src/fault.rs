//! What can go wrong, whose fault it is, and the exit code that says so.

use std::io;
use std::process::ExitCode;

use anstyle::AnsiColor;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use macropulse::formats::Format;
use macropulse::{channel, design, environment, formats, predict, scene, sim, told};
use macropulse_study::text::broken;
use macropulse_study::{decoding, designs, paper, record, sweep, validate};

use crate::options::Common;
use crate::text::{harmless, say};

/// Why a command did not do what was asked.
#[derive(Debug)]
pub enum Fault {
    /// A file, name or option that was typed wrong.
    Wrong(String),
    /// As `Wrong`, for several reasons at once: a sentence each.
    AllWrong(Vec<String>),
    /// As `Wrong`, and said already.
    Told,
    /// The program, or the machine under it.
    Ours(String),
    /// Ctrl-C.
    Interrupted,
}

impl Fault {
    /// A file that cannot be read, in words of ours.
    pub fn unreadable(name: &str, error: &io::Error) -> Self {
        Self::Wrong(format!("{name}: cannot be read: {}", told::unreadable(error)))
    }

    /// What the `sentence` says could not be written: the name of the place was wrong, or the machine
    /// does not take it.
    pub fn unwritten(sentence: String, error: &io::Error) -> Self {
        match told::is_of_the_machine(error) {
            true => Self::Ours(sentence),
            false => Self::Wrong(sentence),
        }
    }

    /// What could not be written to standard output.
    pub fn unprinted(error: &io::Error) -> Self {
        Self::Ours(format!("cannot write to standard output: {}", told::unwritable(error)))
    }

    /// Says on stderr, in one sentence for each reason, what is to be said, and gives the exit code.
    pub fn report(&self) -> ExitCode {
        match self {
            Self::Wrong(sentence) | Self::Ours(sentence) => complain(sentence),
            Self::AllWrong(sentences) => sentences.iter().for_each(|one| complain(one)),
            Self::Told | Self::Interrupted => {}
        }
        match self {
            Self::Wrong(_) | Self::AllWrong(_) | Self::Told => ExitCode::from(2),
            Self::Ours(_) => ExitCode::from(1),
            Self::Interrupted => ExitCode::from(crate::interrupt::EXIT_CODE),
        }
    }
}

/// What went wrong, as a sentence on stderr.
fn complain(sentence: &str) {
    tell(sentence, AnsiColor::Red);
}

/// What went otherwise than was asked for, as a sentence on stderr: a result without a point, a run
/// that was stopped.
pub fn warn(sentence: &str) {
    tell(sentence, AnsiColor::Yellow);
}

/// What a user should know although all went as asked, as a sentence on stderr, unless it is to be
/// quiet.
pub fn note(sentence: &str, common: &Common) {
    if !common.quiet {
        tell(sentence, AnsiColor::Yellow);
    }
}

/// A sentence on stderr, with the name of the program before it: on a terminal in colour and broken
/// at its width, elsewhere one line.
fn tell(sentence: &str, colour: AnsiColor) {
    let text = format!("macropulse: {}", one_line(sentence));
    let text = match terminal_size::terminal_size_of(io::stderr()) {
        Some((terminal_size::Width(width), _)) => broken(&text, usize::from(width)).join("\n  "),
        None => text,
    };
    let rest = text.strip_prefix("macropulse:").unwrap_or(&text);
    let name = colour.on_default().bold();
    // Without colour where stderr is no terminal, or NO_COLOR is set.
    say(&format!("{name}macropulse:{name:#}{rest}"));
}

/// What is repeated of a name or a file may have lines, and signs that a terminal would obey.
fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let text = lines.collect::<Vec<_>>().join(" ").replace('\t', " ");
    clipped(harmless(&text, |_| char::REPLACEMENT_CHARACTER.to_string()))
}

/// Most letters of a sentence, at its beginning and at its end: a word of a file may have millions.
const MOST_LETTERS: [usize; 2] = [3000, 1000];

/// A sentence of which too long a middle is left out.
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

/// What clap could not make sense of, as one sentence; help and version are no faults.
pub fn usage(error: &clap::Error) -> Result<(), Fault> {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            // Clap knows whether colours are wanted; a reader who has seen enough is no fault.
            let _ = error.print();
            Ok(())
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            say(error.render().to_string().trim_end());
            Err(Fault::Told)
        }
        kind => {
            let sentence = sentence_of(&error.render().to_string());
            let stray = match error.get(ContextKind::InvalidArg) {
                Some(ContextValue::String(stray)) if kind == ErrorKind::UnknownArgument => stray,
                _ if kind == ErrorKind::ArgumentConflict && sentence.contains("--pixel") => {
                    let remedy = "--pixel prints a macropulse, -o writes the log of all shots";
                    return Err(Fault::Wrong(format!("{sentence}; {remedy}")));
                }
                _ if sentence.contains("--output") && sentence.contains("`macropulse convert ") => {
                    let remedy = "the file to write is named with -o, as -o cloud.ply";
                    return Err(Fault::Wrong(format!("{sentence}; {remedy}")));
                }
                _ => return Err(Fault::Wrong(sentence)),
            };
            Err(Fault::Wrong(match remedy(stray, &sentence) {
                Some(remedy) => format!("{sentence}; {remedy}"),
                None => sentence,
            }))
        }
    }
}

/// What to do where a scene is named and none is wanted.
const NO_SCENE: &str =
    "it takes one sensor and no scene: sun and air are --environment, the target --reflectance";

/// What to do about a word that stands where none is wanted, which is what the `sentence` says.
fn remedy(stray: &str, sentence: &str) -> Option<&'static str> {
    let is_of = |command: &str| sentence.contains(&format!("`macropulse {command} "));
    match stray {
        "=" => Some("a change is one word, as --set scan.max_range_m=90, or in quotes"),
        _ if Format::parse(stray).is_ok() => {
            Some("several formats are one word, with commas between them, as --format pcd,ply")
        }
        "--sensor" if is_of("budget") || is_of("check") => {
            Some("the sensor stands alone, as in `macropulse budget coded-practical`")
        }
        "--scene" if is_of("budget") => Some(NO_SCENE),
        _ if stray.starts_with('-') => None,
        _ if is_of("decode") => Some("the sensor is named with --sensor"),
        _ if is_of("budget") => Some(NO_SCENE),
        _ if is_of("encode") => {
            Some("it takes one sensor, and a pixel is one word, as --pixel 0,1")
        }
        _ if is_of("view") => {
            Some("one file or folder at a time; that of a run shows all its scans")
        }
        _ if is_of("sensors") || is_of("scenes") || is_of("environments") || is_of("schema") => {
            Some("one at a time")
        }
        _ if is_of("simulate") || is_of("sweep") => {
            Some("the folder for the results is named with -o")
        }
        _ => None,
    }
}

/// What the parsers of numbers say, and what we do.
const NUMBERS: [(&str, &str); 5] = [
    ("invalid digit found in string", "it must be a whole number, 0 or more"),
    ("cannot parse integer from empty string", "it must be a whole number, 0 or more"),
    ("number too large to fit in target type", "it is too large"),
    ("invalid float literal", "it must be a number, without its unit"),
    ("cannot parse float from empty string", "it must be a number"),
];

/// A complaint about a number, in words of ours.
fn of_number(wrong: &str) -> String {
    if let Some((what, limits)) = wrong.split_once(" is not in ")
        && let Some((least, most)) = limits.split_once("..")
    {
        let value = what.rsplit_once(": ").map_or(what, |(_, value)| value);
        let before = what.strip_suffix(value).unwrap_or_default();
        let limits = match most.strip_prefix('=') {
            Some(most) => format!("from {least} to {most}"),
            None => format!("{least} at least"),
        };
        return format!("{before}it must be {limits}");
    }
    let known = NUMBERS.iter().find(|(theirs, _)| wrong.ends_with(theirs));
    known.map_or(wrong.to_owned(), |(theirs, ours)| wrong.replace(theirs, ours))
}

/// Clap writes a paragraph of what is wrong, tips, the usage, and where to find more.
fn sentence_of(rendered: &str) -> String {
    let mut paragraphs = rendered.split("\n\n");
    let wrong = one_line(paragraphs.next().unwrap_or_default());
    let wrong = of_number(wrong.strip_prefix("error: ").unwrap_or(&wrong));
    let rest: Vec<&str> = paragraphs.flat_map(str::lines).map(str::trim).collect();
    let tips = rest.iter().filter_map(|line| line.strip_prefix("tip: "));
    // Nobody means an option as a value.
    let tips = tips.filter(|tip| !tip.starts_with("to pass "));
    let usage = rest.iter().find_map(|line| line.strip_prefix("Usage: "));
    let command = usage.map(|usage| {
        let words = usage.split(' ').take_while(|word| word.starts_with(char::is_lowercase));
        format!("see `{} --help`", words.collect::<Vec<_>>().join(" "))
    });
    let parts = std::iter::once(wrong).chain(tips.map(|tip| (*tip).to_owned())).chain(command);
    parts.collect::<Vec<_>>().join("; ")
}

impl From<design::Error> for Fault {
    fn from(error: design::Error) -> Self {
        Self::AllWrong(error.sentences().collect())
    }
}

impl From<scene::Error> for Fault {
    fn from(error: scene::Error) -> Self {
        Self::Wrong(error.to_string())
    }
}

impl From<environment::Error> for Fault {
    fn from(error: environment::Error) -> Self {
        Self::Wrong(error.to_string())
    }
}

impl From<channel::Error> for Fault {
    fn from(error: channel::Error) -> Self {
        Self::Wrong(error.to_string())
    }
}

impl From<predict::Error> for Fault {
    fn from(error: predict::Error) -> Self {
        Self::Wrong(error.to_string())
    }
}

impl From<sim::Error> for Fault {
    fn from(error: sim::Error) -> Self {
        match error {
            sim::Error::Operating(error) => error.into(),
            sim::Error::Decode(_) => Self::Ours(error.to_string()),
        }
    }
}

impl From<formats::Error> for Fault {
    fn from(error: formats::Error) -> Self {
        match error {
            formats::Error::Uneven { .. } => Self::Ours(error.to_string()),
            formats::Error::Write { ref cause, .. } => Self::unwritten(error.to_string(), cause),
            _ => Self::Wrong(error.to_string()),
        }
    }
}

impl From<record::Error> for Fault {
    fn from(error: record::Error) -> Self {
        match error {
            record::Error::Formats(error) => error.into(),
            record::Error::View(error) => Self::Ours(error.to_string()),
            record::Error::Unreadable { path, cause } => {
                Self::unreadable(&path.display().to_string(), &cause)
            }
            wrong => Self::Wrong(wrong.to_string()),
        }
    }
}

impl From<decoding::Error> for Fault {
    fn from(error: decoding::Error) -> Self {
        match error {
            decoding::Error::Unreadable { name, cause } => Self::unreadable(&name, &cause),
            wrong => Self::Wrong(wrong.to_string()),
        }
    }
}

impl From<validate::Error> for Fault {
    fn from(error: validate::Error) -> Self {
        match error {
            validate::Error::Stopped => Self::Interrupted,
            validate::Error::Formats(error) => error.into(),
            other => Self::Ours(other.to_string()),
        }
    }
}

impl From<sweep::Error> for Fault {
    fn from(error: sweep::Error) -> Self {
        match error {
            sweep::Error::Formats(error) => error.into(),
            sweep::Error::View(error) => Self::Ours(error.to_string()),
            sweep::Error::Simulation(error) => error.into(),
            wrong => Self::Wrong(wrong.to_string()),
        }
    }
}

impl From<designs::Error> for Fault {
    fn from(error: designs::Error) -> Self {
        match error {
            designs::Error::Formats(error) => error.into(),
            designs::Error::View(error) => Self::Ours(error.to_string()),
            designs::Error::Simulation(error) => error.into(),
            wrong => Self::Wrong(wrong.to_string()),
        }
    }
}

impl From<paper::Error> for Fault {
    fn from(error: paper::Error) -> Self {
        match error {
            paper::Error::Stopped => Self::Interrupted,
            paper::Error::Folder { ref source, .. } => Self::unwritten(error.to_string(), source),
            paper::Error::Record(error) => error.into(),
            paper::Error::Formats(error) => error.into(),
            ours => Self::Ours(ours.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_paragraph_of_clap_becomes_a_sentence() {
        let rendered = "error: unexpected argument '--sead' found\n\n  tip: a similar argument \
                        exists: '--seed'\n\nUsage: macropulse simulate --seed <SEED>\n\nFor more \
                        information, try '--help'.\n";
        assert_eq!(
            sentence_of(rendered),
            "unexpected argument '--sead' found; a similar argument exists: '--seed'; \
             see `macropulse simulate --help`"
        );
    }

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
    fn numbers_are_asked_for_in_words_of_ours() {
        for (theirs, ours) in [
            (
                "invalid value 'a' for '--seed <N>': invalid digit found in string",
                "'--seed <N>': it must be a whole number, 0 or more",
            ),
            (
                "invalid value '0' for '--seeds <N>': 0 is not in 1..=10000",
                "'--seeds <N>': it must be from 1 to 10000",
            ),
            (
                "invalid value '0' for '--shots <N>': 0 is not in 1..18446744073709551615",
                "'--shots <N>': it must be 1 at least",
            ),
            ("unexpected argument 'x' found", "unexpected argument 'x' found"),
        ] {
            assert!(of_number(theirs).ends_with(ours), "{}", of_number(theirs));
        }
    }

    #[test]
    fn what_is_missing_is_named_in_the_sentence() {
        let rendered = "error: the following required arguments were not provided:\n  --sensor \
                        <NAME>\n\nUsage: macropulse encode --sensor <NAME>\n";
        assert_eq!(
            sentence_of(rendered),
            "the following required arguments were not provided: --sensor <NAME>; \
             see `macropulse encode --help`"
        );
    }
}
