//! `macropulse man`: the manual pages.

use std::path::PathBuf;

use clap::Args;

use crate::fault::Fault;
use crate::folder::{Folder, Outputs};
use crate::text::print;

/// Write the manual pages, one for the program and one for each command
#[derive(Args)]
#[command(after_help = "Examples:
  macropulse man -o ~/.local/share/man/man1
  macropulse man simulate | man -l -")]
pub struct Man {
    /// Command whose page is printed; all pages are written without it
    #[arg(value_name = "COMMAND", conflicts_with = "output", required_unless_present = "output")]
    command: Option<String>,

    /// Folder for the pages, made if need be
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub fn run(options: &Man, mut program: clap::Command) -> Result<(), Fault> {
    program.build();
    if let Some(name) = &options.command {
        let of_program = name == program.get_name();
        let page = if of_program { Some(&program) } else { program.find_subcommand(name) };
        let Some(page) = page else {
            let known: Vec<&str> = program.get_subcommands().map(|one| one.get_name()).collect();
            let known = known.join(", ");
            return Err(Fault::Wrong(format!("{name}: no such command; there are {known}")));
        };
        return print(&String::from_utf8_lossy(&rendered(page)?));
    }
    let Some(output) = &options.output else { return Ok(()) };
    let name =
        |page: &clap::Command| format!("{}.1", page.get_display_name().unwrap_or(page.get_name()));
    let pages: Vec<_> = std::iter::once(&program).chain(program.get_subcommands()).collect();
    let mut folder = Folder::claim(output, Outputs::named(pages.iter().map(|page| name(page))))?;
    folder.make()?;
    for page in pages {
        let path = folder.path().join(name(page));
        let text = rendered(page)?;
        macropulse::formats::write_atomically(&path, |out| out.write_all(&text))?;
    }
    folder.keep();
    Ok(())
}

fn rendered(page: &clap::Command) -> Result<Vec<u8>, Fault> {
    let mut text = Vec::new();
    let page = clap_mangen::Man::new(page.clone());
    page.render(&mut text).map_err(|error| Fault::Ours(format!("no manual page: {error}")))?;
    Ok(text)
}
