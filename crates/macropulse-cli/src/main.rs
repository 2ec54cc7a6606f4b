//! The command line of Macropulse: one file per subcommand.

mod budget;
mod check;
mod codes;
mod completions;
mod convert;
mod encode;
mod environments;
mod fault;
mod folder;
mod interrupt;
mod kind;
mod options;
mod paper;
mod progress;
mod scenes;
mod sensors;
mod simulate;
mod speed;
mod sweep;
mod text;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use fault::Fault;
use options::Common;

/// The workbench for pulse-coded lidar: design a code, fire it into a 3-D scene, detect it, decode
/// it, get a point cloud.
#[derive(Parser)]
#[command(name = "macropulse", version, max_term_width = 100)]
#[command(after_help = "Example:
  macropulse simulate --sensor kim-park-2016-fixed --scene car-30m -o out")]
struct Options {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Command,
}

/// What there is to do; one file each.
#[derive(Subcommand)]
enum Command {
    Simulate(simulate::Simulate),
    Sweep(sweep::Sweep),
    Paper(paper::Paper),
    Sensors(sensors::Sensors),
    Scenes(scenes::Scenes),
    Environments(environments::Environments),
    Check(check::Check),
    Budget(budget::Budget),
    Codes(codes::Codes),
    Encode(encode::Encode),
    Convert(convert::Convert),
    Speed(speed::Speed),
    Completions(completions::Completions),
}

fn main() -> ExitCode {
    let done = match Options::try_parse() {
        Ok(options) => {
            kernels().and_then(|()| options.common.use_threads()).and_then(|()| run(&options))
        }
        Err(usage) => fault::usage(&usage),
    };
    done.map_or_else(|fault| fault.report(), |()| ExitCode::SUCCESS)
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
        Command::Sensors(sensors) => sensors::run(sensors),
        Command::Scenes(scenes) => scenes::run(scenes),
        Command::Environments(environments) => environments::run(environments),
        Command::Check(check) => check::run(check, common),
        Command::Budget(budget) => budget::run(budget, common),
        Command::Codes(codes) => codes::run(codes, common),
        Command::Encode(encode) => encode::run(encode),
        Command::Convert(convert) => convert::run(convert, common),
        Command::Speed(speed) => speed::run(speed, common),
        Command::Completions(completions) => completions::run(completions, Options::command()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
