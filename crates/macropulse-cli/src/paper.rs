//! `macropulse paper`: the whole experiment of \[KP16\].

use std::path::{Path, PathBuf};

use clap::Args;

use crate::fault::Fault;
use crate::options::Common;

/// Repeat the experiment of Kim & Park (2016): three lidars, four distances, every claim checked
#[derive(Args)]
#[command(after_help = "Example:
  macropulse paper -o paper")]
pub struct Paper {
    /// Folder for clouds, images, tables and the report
    #[arg(short, long, value_name = "DIR", default_value = "paper")]
    output: PathBuf,

    /// Seed of all chance
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

pub fn run(options: &Paper, _common: &Common) -> Result<(), Fault> {
    experiment(&options.output, options.seed)
}

fn experiment(_output: &Path, _seed: u64) -> Result<(), Fault> {
    Err(Fault::Ours("this build does not contain the experiment of the paper".to_owned()))
}
