//! What every command understands.

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::fault::Fault;
use crate::{
    budget, check, codes, completions, encode, paper, scenes, sensors, simulate, speed, sweep,
};

/// The workbench for pulse-coded lidar: design a code, fire it into a 3-D scene, detect it, decode
/// it, get a point cloud.
#[derive(Parser)]
#[command(name = "macropulse", version, max_term_width = 100)]
#[command(after_help = "Example:
  macropulse simulate --sensor kim-park-2016-fixed --scene car-30m -o out")]
pub struct Options {
    #[command(flatten)]
    pub common: Common,
    #[command(subcommand)]
    pub command: Command,
}

/// One file each.
#[derive(Subcommand)]
pub enum Command {
    Simulate(simulate::Simulate),
    Sweep(sweep::Sweep),
    Paper(paper::Paper),
    Sensors(sensors::Sensors),
    Scenes(scenes::Scenes),
    Check(check::Check),
    Budget(budget::Budget),
    Codes(codes::Codes),
    Encode(encode::Encode),
    Speed(speed::Speed),
    Completions(completions::Completions),
}

/// Options of every command.
#[derive(Args)]
#[command(next_help_heading = "Everywhere")]
pub struct Common {
    /// Print nothing but what went wrong, and what --json asks for
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,

    /// Print also which defaults were used and what was assumed
    #[arg(short, long, global = true)]
    pub verbose: bool,

    /// Threads to compute with; 0 is one per core. The results do not depend on it
    #[arg(short = 'j', long, global = true, value_name = "N", default_value_t = 0)]
    #[arg(value_parser = clap::value_parser!(u16).range(0..=1024))]
    pub threads: u16,

    /// How progress is shown on stderr
    #[arg(long, global = true, value_name = "HOW", default_value = "auto")]
    pub progress: ProgressKind,
}

/// How progress is shown.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProgressKind {
    /// A bar on a terminal, plain lines elsewhere
    Auto,
    /// One JSON object per line
    Json,
    /// Not at all
    None,
}

impl Common {
    /// Lets rayon use as many threads as asked for.
    pub fn use_threads(&self) -> Result<(), Fault> {
        rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(self.threads))
            .build_global()
            .map_err(|error| Fault::Ours(format!("cannot start the threads: {error}")))
    }
}

/// A sensor, and what is changed of it.
#[derive(Args)]
pub struct Changes {
    /// Change one value of the sensor, as scan.max_range_m=90; repeatable
    #[arg(long, value_name = "KEY=VALUE", value_parser = change)]
    pub set: Vec<(String, String)>,
}

fn change(typed: &str) -> Result<(String, String), String> {
    match typed.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() && !value.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("write it as key=value, as in --set scan.max_range_m=90".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_options_do_not_contradict_each_other() {
        Options::command().debug_assert();
    }

    #[test]
    fn a_change_has_a_key_and_a_value() {
        assert_eq!(change("a.b = 1"), Ok(("a.b".to_owned(), "1".to_owned())));
        assert_eq!(change("a=b=c"), Ok(("a".to_owned(), "b=c".to_owned())));
        assert!(change("a").is_err() && change("=1").is_err() && change("a=").is_err());
    }

    #[test]
    fn the_help_of_every_command_ends_with_an_example() {
        for command in Options::command().get_subcommands() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains("  macropulse "), "{}", command.get_name());
        }
    }
}
