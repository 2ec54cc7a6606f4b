//! `macropulse completions`: what the shell needs to complete commands, options, and the names of
//! sensors, scenes and environments.

use std::ffi::OsStr;

use clap::{Args, ValueEnum};
use clap_complete::Shell;
use clap_complete::engine::{CompletionCandidate, PathCompleter, ValueCompleter};
use clap_complete::env::Shells;
use macropulse::design::preset_names;
use macropulse::environment;
use macropulse::scene::Scene;

use crate::fault::Fault;

/// By this a shell tells the program, which it calls for it, that a line is to be completed.
pub const VARIABLE: &str = "MACROPULSE_COMPLETE";

/// Print the completions for a shell
#[derive(Args)]
#[command(after_help = "Examples:
  macropulse completions bash > ~/.local/share/bash-completion/completions/macropulse
  source <(macropulse completions zsh)")]
pub struct Completions {
    /// The shell
    shell: Shell,
}

/// Prints the completions: a script by which the shell asks the program itself.
pub fn run(options: &Completions) -> Result<(), Fault> {
    let name = options.shell.to_possible_value();
    let name = name.as_ref().map_or("", |value| value.get_name());
    let shells = Shells::builtins();
    let Some(shell) = shells.completer(name) else {
        return Err(Fault::Wrong(format!("{name}: there are no completions for this shell")));
    };
    let program = "macropulse";
    let mut script = Vec::new();
    shell
        .write_registration(VARIABLE, program, program, program, &mut script)
        .map_err(|error| Fault::Ours(format!("no completions: {error}")))?;
    crate::text::print(&String::from_utf8_lossy(&script))
}

/// Ready sensors, and files.
pub fn sensors(typed: &OsStr) -> Vec<CompletionCandidate> {
    named(typed, preset_names())
}

/// Ready scenes, and files.
pub fn scenes(typed: &OsStr) -> Vec<CompletionCandidate> {
    named(typed, Scene::builtin_names())
}

/// Ready sensors and scenes, and files.
pub fn both(typed: &OsStr) -> Vec<CompletionCandidate> {
    named(typed, preset_names().chain(Scene::builtin_names()))
}

/// Ready environments.
pub fn environments(typed: &OsStr) -> Vec<CompletionCandidate> {
    beginning(typed, environment::names()).collect()
}

fn named<'a>(typed: &OsStr, names: impl Iterator<Item = &'a str>) -> Vec<CompletionCandidate> {
    beginning(typed, names).chain(PathCompleter::any().complete(typed)).collect()
}

fn beginning<'a>(
    typed: &OsStr,
    names: impl Iterator<Item = &'a str>,
) -> impl Iterator<Item = CompletionCandidate> {
    let typed = typed.to_string_lossy().into_owned();
    names.filter(move |name| name.starts_with(&typed)).map(CompletionCandidate::new)
}
