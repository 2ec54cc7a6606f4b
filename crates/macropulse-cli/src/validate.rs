//! `macropulse validate`: what is published and what is forecast, beside what is computed.

use std::path::PathBuf;

use clap::Args;
use macropulse::sim::Watch;
use macropulse_study::validate::{self, Findings, SENSORS};

use crate::fault::Fault;
use crate::folder::{Folder, Outputs};
use crate::interrupt::Interrupt;
use crate::options::Common;
use crate::text::{Columns, print, print_json};

/// Compare Macropulse with published figures, and its forecasts with its simulations
///
/// Exit code 1 if a published figure is not met.
#[derive(Args)]
#[command(after_help = "Example:
  macropulse validate -o validation
and open validation/index.html")]
pub struct Validate {
    /// Folder for the report
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,

    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(options: &Validate, common: &Common) -> Result<(), Fault> {
    let folder =
        options.output.as_deref().map(|path| Folder::claim(path, Outputs::named(validate::FILES)));
    let mut folder = folder.transpose()?;
    let interrupt = Interrupt::listen()?;
    let watch = Watch { done: &|_| {}, stop: &|| interrupt.is_raised() };
    let findings = validate::run(options.seed, &watch)?;
    if let Some(folder) = &mut folder {
        folder.make()?;
        validate::write(&findings, folder.path())?;
        folder.keep();
    }
    if options.json {
        print_json(vec![serde_json::to_value(&findings).unwrap_or_default()])?;
    } else if !common.quiet {
        print(&text(&findings))?;
        if let Some(folder) = &folder {
            print(&format!("\nopen {}\n", folder.path().join("index.html").display()))?;
        }
    }
    match findings.figures_that_fail() {
        0 => Ok(()),
        some => Err(Fault::Ours(format!("{some} published figures are not met"))),
    }
}

fn text(findings: &Findings) -> String {
    let mut columns = Columns::default();
    let met = findings.published.len() - findings.figures_that_fail();
    columns.push("published", format!("{met} of {} figures are met", findings.published.len()));
    for figure in findings.published.iter().filter(|figure| !figure.holds()) {
        columns.push(
            "  fails",
            format!(
                "{}: {}, published {} [{}]",
                figure.what, figure.ours, figure.published, figure.source
            ),
        );
    }
    let held = findings.forecasts.len() - findings.forecasts_that_fail();
    columns.push("forecasts", format!("{held} of {} hold", findings.forecasts.len()));
    for sensor in SENSORS {
        let of_sensor = || findings.forecasts.iter().filter(|place| place.sensor == sensor);
        let held = of_sensor().filter(|place| place.holds()).count();
        columns.push(format!("  {sensor}"), format!("{held} of {}", of_sensor().count()));
    }
    columns.text()
}
