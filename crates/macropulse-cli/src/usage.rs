//! Mistakes of the command line, each as one sentence with its remedy.

use std::error::Error as _;
use std::num::{IntErrorKind, ParseFloatError, ParseIntError};

use clap::Command;
use clap::error::{ContextKind, ErrorKind};
use macropulse::formats::Format;

use crate::fault::Fault;
use crate::text::say;

/// Prints help or the version where those are asked for.
///
/// # Errors
/// The mistake that `error` stands for; `command` is the subcommand that was named, if one was.
pub fn answer(error: &clap::Error, command: Option<&Command>) -> Result<(), Fault> {
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
        _ => Err(Fault::Wrong(Mistake { error, command }.sentence())),
    }
}

/// An error of the parser in a line that names a `command`.
struct Mistake<'a> {
    error: &'a clap::Error,
    command: Option<&'a Command>,
}

impl Mistake<'_> {
    /// One entry of the error, or nothing.
    fn get(&self, kind: ContextKind) -> String {
        self.error.get(kind).map(ToString::to_string).unwrap_or_default()
    }

    fn command(&self) -> &str {
        self.command.map_or("", Command::get_name)
    }

    /// The fault, the nearest name, the page of help, and the remedy.
    fn sentence(&self) -> String {
        let near = [
            ("subcommand", ContextKind::SuggestedSubcommand),
            ("argument", ContextKind::SuggestedArg),
            ("value", ContextKind::SuggestedValue),
        ];
        let near = near.map(|(what, kind)| (what, self.get(kind)));
        let near = near.iter().filter(|(_, name)| !name.is_empty());
        let near = near.map(|(what, name)| format!("a similar {what} exists: '{name}'"));
        let help = self.error.get(ContextKind::Usage).map(|_| match self.command() {
            "" => "see `macropulse --help`".to_owned(),
            command => format!("see `macropulse {command} --help`"),
        });
        let remedy = self.remedy().map(str::to_owned);
        let parts = std::iter::once(self.fault()).chain(near).chain(help).chain(remedy);
        parts.collect::<Vec<_>>().join("; ")
    }

    fn fault(&self) -> String {
        let argument = self.get(ContextKind::InvalidArg);
        let value = self.get(ContextKind::InvalidValue);
        match self.error.kind() {
            ErrorKind::UnknownArgument => format!("unexpected argument '{argument}' found"),
            ErrorKind::InvalidSubcommand => {
                format!("unrecognized subcommand '{}'", self.get(ContextKind::InvalidSubcommand))
            }
            ErrorKind::MissingRequiredArgument => {
                format!("the following required arguments were not provided: {argument}")
            }
            ErrorKind::ArgumentConflict => match self.get(ContextKind::PriorArg) {
                prior if prior == argument => {
                    format!("the argument '{argument}' cannot be used multiple times")
                }
                prior => format!("the argument '{argument}' cannot be used with '{prior}'"),
            },
            ErrorKind::ValueValidation => {
                format!("invalid value '{value}' for '{argument}': {}", self.cause())
            }
            ErrorKind::InvalidValue => {
                let fault = match value.is_empty() {
                    true => format!("a value is required for '{argument}' but none was supplied"),
                    false => format!("invalid value '{value}' for '{argument}'"),
                };
                match self.get(ContextKind::ValidValue) {
                    known if known.is_empty() => fault,
                    known => format!("{fault} [possible values: {known}]"),
                }
            }
            ErrorKind::TooManyValues => {
                format!("unexpected value '{value}' for '{argument}' found; no more were expected")
            }
            kind => kind.to_string(),
        }
    }

    /// The reason for which a value is refused.
    fn cause(&self) -> String {
        let Some(cause) = self.error.source() else { return String::new() };
        let number = cause.downcast_ref::<ParseIntError>().map(ParseIntError::kind);
        match number {
            Some(IntErrorKind::PosOverflow) => "it is too large".to_owned(),
            Some(IntErrorKind::Zero) => "it must be a whole number, 1 at least".to_owned(),
            Some(_) => "it must be a whole number, 0 or more".to_owned(),
            None if cause.is::<ParseFloatError>() => {
                "it must be a number, without its unit".to_owned()
            }
            None => cause.to_string(),
        }
    }

    /// The remedy of a mistake that is often made.
    fn remedy(&self) -> Option<&'static str> {
        let argument = self.get(ContextKind::InvalidArg);
        match self.error.kind() {
            ErrorKind::UnknownArgument => self.remedy_of_stray(&argument),
            ErrorKind::ArgumentConflict
                if [&argument, &self.get(ContextKind::PriorArg)]
                    .iter()
                    .any(|one| one.starts_with("--pixel")) =>
            {
                Some("--pixel prints a macropulse, -o writes the log of all shots")
            }
            ErrorKind::MissingRequiredArgument
                if self.command() == "convert" && argument.contains("--output") =>
            {
                Some("the file to write is named with -o, as -o cloud.ply")
            }
            _ => None,
        }
    }

    /// The remedy of a `stray` word, which stands where none is wanted.
    fn remedy_of_stray(&self, stray: &str) -> Option<&'static str> {
        let is_option_of = |command: &Command| {
            let mut names = command.get_arguments().filter_map(clap::Arg::get_long);
            names.any(|name| stray.strip_prefix("--") == Some(name))
        };
        match (self.command(), stray) {
            (_, "=") => Some("a change is one word, as --set scan.max_range_m=90, or in quotes"),
            _ if Format::parse(stray).is_ok() => {
                Some("several formats are one word, with commas between them, as --format pcd,ply")
            }
            ("budget" | "check", "--sensor") => {
                Some("the sensor stands alone, as in `macropulse budget coded-practical`")
            }
            ("budget", "--scene") => Some(NO_SCENE),
            _ if self.command.is_some_and(is_option_of) => Some("it stands behind the command"),
            _ if stray.starts_with('-') => None,
            ("", _) => Some("no -- stands before the command"),
            ("decode", _) => Some("the sensor is named with --sensor"),
            ("budget", _) => Some(NO_SCENE),
            ("encode", _) => Some("it takes one sensor, and a pixel is one word, as --pixel 0,1"),
            ("view", _) => Some("one file or folder at a time; that of a run shows all its scans"),
            ("sensors" | "scenes" | "environments" | "schema", _) => Some("one at a time"),
            ("simulate" | "sweep", _) => Some("the folder for the results is named with -o"),
            _ => None,
        }
    }
}

/// The remedy where a scene is named and none is wanted.
const NO_SCENE: &str =
    "it takes one sensor and no scene: sun and air are --environment, the target --reflectance";

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::num::NonZeroU64;

    use clap::{Arg, ArgAction, value_parser};

    use super::*;

    /// The answer to a line of a program with one command.
    fn sentence(line: &str) -> String {
        let number = |name: &'static str| Arg::new(name).long(name).value_name("N");
        let command = Command::new("encode")
            .arg(number("seed").value_parser(value_parser!(u64)))
            .arg(number("shots").value_parser(value_parser!(NonZeroU64)))
            .arg(number("wall").value_parser(value_parser!(f64)).allow_negative_numbers(true))
            .arg(Arg::new("sensor").long("sensor").value_name("NAME").required(true))
            .arg(Arg::new("form").long("form").value_parser(["ticks", "ticks-csv"]))
            .arg(Arg::new("json").long("json").action(ArgAction::SetTrue).conflicts_with("form"));
        let program = Command::new("macropulse").subcommand(command.clone());
        let words = format!("macropulse {line}");
        let error = program.try_get_matches_from(words.split(' ')).unwrap_err();
        let named = line.contains("encode").then_some(&command);
        Mistake { error: &error, command: named }.sentence()
    }

    #[test]
    fn a_mistake_is_one_sentence() {
        for (line, wanted) in [
            (
                "encode --sensor a --sead 1",
                "unexpected argument '--sead' found; a similar argument exists: '--seed'; see \
                 `macropulse encode --help`",
            ),
            (
                "encode",
                "the following required arguments were not provided: --sensor <NAME>; see \
                 `macropulse encode --help`",
            ),
            (
                "encod",
                "unrecognized subcommand 'encod'; a similar subcommand exists: 'encode'; see \
                 `macropulse --help`",
            ),
            (
                "--seed 1 encode",
                "unexpected argument '--seed' found; see `macropulse encode --help`; it stands \
                 behind the command",
            ),
            (
                "encode --sensor a --seed -1",
                "unexpected argument '-1' found; see `macropulse encode --help`",
            ),
            (
                "encode --sensor a --sensor b",
                "the argument '--sensor <NAME>' cannot be used multiple times; see `macropulse \
                 encode --help`",
            ),
            (
                "encode --sensor a --json --form ticks",
                "the argument '--json' cannot be used with '--form <form>'; see `macropulse encode \
                 --help`",
            ),
            (
                "encode --sensor a --form tick",
                "invalid value 'tick' for '--form <form>' [possible values: ticks, ticks-csv]; a \
                 similar value exists: 'ticks'",
            ),
            ("encode --sensor", "a value is required for '--sensor <NAME>' but none was supplied"),
        ] {
            assert_eq!(sentence(line), wanted, "{line}");
        }
    }

    #[test]
    fn a_number_is_asked_for_by_its_kind() {
        for (typed, wanted) in [
            ("--seed=a", "it must be a whole number, 0 or more"),
            ("--seed=99999999999999999999", "it is too large"),
            ("--shots=0", "it must be a whole number, 1 at least"),
            ("--wall=3m", "it must be a number, without its unit"),
        ] {
            let said = sentence(&format!("encode --sensor a {typed}"));
            assert!(said.starts_with("invalid value '") && said.ends_with(wanted), "{said}");
        }
    }
}
