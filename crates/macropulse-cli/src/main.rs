//! The command line of Macropulse: one file per subcommand.

mod budget;
mod check;
mod codes;
mod completions;
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

use clap::Parser;

use fault::Fault;
use options::{Command, Options};

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
        Command::Speed(speed) => speed::run(speed, common),
        Command::Completions(completions) => completions::run(completions),
    }
}
