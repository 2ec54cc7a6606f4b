//! `macropulse completions`: what the shell needs to complete commands and options.

use clap::Args;
use clap_complete::Shell;

use crate::fault::Fault;

/// Print the completions for a shell
#[derive(Args)]
#[command(after_help = "Example:
  macropulse completions bash > ~/.local/share/bash-completion/completions/macropulse")]
pub struct Completions {
    /// The shell
    shell: Shell,
}

/// Prints the completions of `command`.
pub fn run(options: &Completions, mut command: clap::Command) -> Result<(), Fault> {
    let mut script = Vec::new();
    clap_complete::generate(options.shell, &mut command, "macropulse", &mut script);
    crate::text::print(&String::from_utf8_lossy(&script))
}
