//! The command line of Macropulse: one file per subcommand.

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod budget;
mod check;
mod codes;
mod completions;
mod convert;
mod decode;
mod design;
mod encode;
mod environments;
mod explain;
mod fault;
mod folder;
mod input;
mod interrupt;
mod kind;
mod man;
mod memory;
mod options;
mod paper;
mod progress;
mod scenes;
mod schema;
mod sensors;
mod simulate;
mod speed;
mod sweep;
mod text;
mod usage;
mod validate;
mod view;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::CompleteEnv;

use fault::Fault;
use options::Common;
use text::complain;

/// The workbench for pulse-coded lidar: design a code, fire it into a 3-D scene, detect it, decode
/// it, get a point cloud.
#[derive(Parser)]
#[command(name = "macropulse", version, max_term_width = 100)]
#[command(after_help = "Example:
  macropulse simulate kim-park-2016-fixed car-30m -o out")]
struct Options {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Command,
}

/// The commands, one file each.
#[derive(Subcommand)]
enum Command {
    Simulate(simulate::Simulate),
    Sweep(sweep::Sweep),
    Paper(paper::Paper),
    Validate(validate::Validate),
    Sensors(sensors::Sensors),
    Scenes(scenes::Scenes),
    Environments(environments::Environments),
    Schema(schema::Schema),
    Check(check::Check),
    Budget(budget::Budget),
    Design(design::Design),
    Codes(codes::Codes),
    Encode(encode::Encode),
    Decode(decode::Decode),
    View(view::View),
    Convert(convert::Convert),
    Speed(speed::Speed),
    Completions(completions::Completions),
    Man(man::Man),
}

fn main() -> ExitCode {
    // A panic of a library at a damaged file is reported as an error of that file.
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |told| {
        if !macropulse::formats::is_contained() {
            usual(told);
        }
    }));
    // A shell that completes a line calls the program once more, with this in its environment.
    CompleteEnv::with_factory(Options::command).var(completions::VARIABLE).complete();
    let words: Vec<OsString> = std::env::args_os().collect();
    let done = match parse(&words) {
        Ok(options) => {
            let ready = interrupt::outlast_limits().and_then(|()| kernels());
            ready.and_then(|()| options.common.use_threads()).and_then(|()| run(&options))
        }
        Err(error) => answer(&error, &words),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            complain(&fault);
            ExitCode::from(fault.exit_code())
        }
    }
}

fn parse(words: &[OsString]) -> Result<Options, clap::Error> {
    // -1 is no option: what wants a number refuses it in its own words.
    let command = Options::command().mut_subcommands(|one| one.allow_negative_numbers(true));
    command.try_get_matches_from(words).and_then(|typed| Options::from_arg_matches(&typed))
}

/// Prints help, or refuses the `words` that are no line of this program.
fn answer(error: &clap::Error, words: &[OsString]) -> Result<(), Fault> {
    let program = Options::command();
    let mut before = words.iter().skip(1).take_while(|word| *word != "--");
    usage::answer(error, before.find_map(|word| program.find_subcommand(word)))
}

/// Refuses a set of instructions that is misspelt or that this machine does not have.
fn kernels() -> Result<(), Fault> {
    macropulse::codec::level::asked_for().map(|_| ()).map_err(Fault::Wrong)
}

fn run(options: &Options) -> Result<(), Fault> {
    let common = &options.common;
    match &options.command {
        Command::Simulate(simulate) => simulate::run(simulate, common),
        Command::Sweep(sweep) => sweep::run(sweep, common),
        Command::Paper(paper) => paper::run(paper, common),
        Command::Validate(validate) => validate::run(validate, common),
        Command::Sensors(sensors) => sensors::run(sensors),
        Command::Scenes(scenes) => scenes::run(scenes),
        Command::Environments(environments) => environments::run(environments),
        Command::Schema(schema) => schema::run(schema),
        Command::Check(check) => check::run(check, common),
        Command::Budget(budget) => budget::run(budget, common),
        Command::Design(design) => design::run(design, common),
        Command::Codes(codes) => codes::run(codes, common),
        Command::Encode(encode) => encode::run(encode, common),
        Command::Decode(decode) => decode::run(decode, common),
        Command::View(view) => view::run(view, common),
        Command::Convert(convert) => convert::run(convert, common),
        Command::Speed(speed) => speed::run(speed, common),
        Command::Completions(completions) => completions::run(completions),
        Command::Man(man) => man::run(man, Options::command()),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use macropulse_fuzz::mutate::Mutator;

    #[test]
    fn the_options_do_not_contradict_each_other() {
        Options::command().debug_assert();
    }

    #[test]
    fn the_help_of_every_command_ends_with_an_example() {
        for command in Options::command().get_subcommands() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains("  macropulse "), "{}", command.get_name());
        }
    }

    /// The examples of the help, changed anyhow: each is understood, or refused in a sentence.
    /// `MACROPULSE_FUZZ_CASES` sets how many.
    #[test]
    fn any_line_is_understood_or_refused() {
        let help = |command: &clap::Command| {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            help.lines()
                .filter_map(|line| line.strip_prefix("  macropulse "))
                .map(|line| line.as_bytes().to_vec())
                .collect::<Vec<_>>()
        };
        let examples: Vec<Vec<u8>> = Options::command().get_subcommands().flat_map(help).collect();
        assert!(examples.len() > 15, "{} examples", examples.len());
        let cases = std::env::var("MACROPULSE_FUZZ_CASES");
        let cases: u32 = cases.map_or(600, |typed| typed.parse().unwrap());
        let mut mutator = Mutator::new(15);
        let (mut understood, mut refused) = (0, 0);
        for _ in 0..cases {
            let line = mutator.next(&examples, 200);
            let line = String::from_utf8_lossy(&line);
            let words = std::iter::once("macropulse").chain(line.split_whitespace());
            let words: Vec<OsString> = words.map(OsString::from).collect();
            match parse(&words) {
                Ok(_) => understood += 1,
                Err(help) if !help.use_stderr() => understood += 1,
                Err(wrong) => {
                    let told = answer(&wrong, &words);
                    assert!(matches!(told, Err(Fault::Wrong(_) | Fault::Told)), "{line}");
                    refused += 1;
                }
            }
        }
        assert!(understood > cases / 20 && refused > cases / 20, "{understood} of {cases}");
    }
}
