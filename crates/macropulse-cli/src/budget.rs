//! `macropulse budget`: will it work, how far, and what fails first?

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use macropulse::formats::write_atomically;
use macropulse::predict::verdict::Wanted;
use macropulse_study::budget::{Figures, USUAL_FALSE_POINTS, USUAL_PD, USUAL_REFLECTANCE, usual};

use crate::fault::Fault;
use crate::folder::{Folder, Outputs};
use crate::options::{Changes, Common, Surroundings};
use crate::text::{print, print_json};
use crate::{completions, input};

/// Name of the page.
const PAGE: &str = "budget.html";

/// Work out the link budget of a sensor: photons, Pd, false points, precision, eye safety
///
/// Everything is closed form; the tests hold that simulation agrees. Says what fails first, by
/// what factor, and what would be needed; in the environment named, by default a clear day, and in
/// the same at night.
#[derive(Args)]
#[command(after_help = "Examples:
  macropulse budget kim-park-2016-physical -o out
  macropulse budget coded-practical --environment overcast --set environment.visibility_km=2")]
pub struct Budget {
    /// Ready sensor or TOML file, - for standard input
    #[arg(value_name = "SENSOR", add = ArgValueCompleter::new(completions::sensors))]
    sensor: OsString,

    #[command(flatten)]
    surroundings: Surroundings,

    #[command(flatten)]
    changes: Changes,

    /// Range of the target, m; the rated range of the sensor if not given
    #[arg(long, value_name = "M", value_parser = positive)]
    range: Option<f64>,

    /// Reflectance of the target; 1 is white
    #[arg(long, value_name = "SHARE", default_value_t = USUAL_REFLECTANCE, value_parser = positive)]
    reflectance: f64,

    /// Probability of a return that is wanted
    #[arg(long, value_name = "SHARE", default_value_t = USUAL_PD, value_parser = share)]
    pd: f64,

    /// False points per shot that are accepted
    #[arg(long, value_name = "SHARE", default_value_t = USUAL_FALSE_POINTS, value_parser = share)]
    false_points: f64,

    /// Folder for budget.html, with the curves; without it only the text is printed
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,

    /// Print as JSON
    #[arg(long)]
    json: bool,
}

fn positive(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(value) if (1e-6..=1e6).contains(&value) => Ok(value),
        _ => Err("must be a number between 0.000001 and 1000000".to_owned()),
    }
}

fn share(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(value) if (1e-12..1.0).contains(&value) => Ok(value),
        _ => Err("must be a number between 0 and 1, as 0.9".to_owned()),
    }
}

pub fn run(options: &Budget, common: &Common) -> Result<(), Fault> {
    let changes = options.changes.apart(&options.surroundings)?;
    let design = input::design(&options.sensor, &changes.of_sensor)?;
    let environment = Surroundings::alone(&changes)?;
    let wanted = Wanted {
        reflectance: options.reflectance,
        range: options.range.unwrap_or(usual(&design).range),
        pd: options.pd,
        false_points: options.false_points,
    };
    let figures = Figures::of(&design, environment, wanted)?;
    if let Some(output) = &options.output {
        let mut folder = Folder::claim(output, Outputs::named([PAGE]))?;
        folder.make()?;
        let html = figures.page().html();
        write_atomically(&folder.path().join(PAGE), |out| out.write_all(html.as_bytes()))?;
        folder.keep();
    }
    if options.json {
        return print_json(vec![figures.json()]);
    }
    if common.quiet {
        return Ok(());
    }
    print(&figures.text())?;
    match &options.output {
        Some(output) => print(&format!("\n  curves      {}\n", output.join(PAGE).display())),
        None => Ok(()),
    }
}
