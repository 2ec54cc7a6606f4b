//! `macropulse design`: which lidar does what is required?

use std::path::PathBuf;

use clap::Args;
use macropulse::sim::Watch;
use macropulse_study::designs::{PAGE, Requirements, Search, make_room};

use crate::fault::Fault;
use crate::folder::{Folder, Outputs};
use crate::interrupt::Interrupt;
use crate::options::Common;
use crate::progress::Progress;
use crate::text::{print, print_json, warn};

/// Find lidars that do what is required, coded and waiting, and where each of them wins
///
/// Every combination of photodiode, marks and beams that is allowed is worked out in closed form: the energy
/// that eyes allow, the best pulse, the least aperture. Among those that close, the ones with the fewest
/// beams are simulated: on a target all around, and on a field of tiles at unrelated ranges. Counts stay in
/// DIR/trials, so the same command goes on where it was stopped.
#[derive(Args)]
#[command(after_help = "Example:
  macropulse design docs/examples/requirements.toml -o lidars
and open lidars/index.html; lidars/coded.toml is a sensor for simulate, budget and sweep")]
pub struct Design {
    /// TOML file of the requirements and of the parts that may be used
    #[arg(value_name = "REQUIREMENTS")]
    requirements: PathBuf,

    /// Folder for the results, made if need be
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// Print all that was found as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(options: &Design, common: &Common) -> Result<(), Fault> {
    let required = Requirements::open(&options.requirements)?;
    // The search itself knows which results it has written, and replaces no others.
    let mut folder = Folder::claim_alone(&options.output, Outputs::named([] as [&str; 0]))?;
    let interrupt = Interrupt::listen()?;
    folder.make()?;
    // Counts stay there for the next time, however this one ends.
    folder.keep();
    make_room(&options.output)?;
    let progress = Progress::of(common, "design", required.most_shots());
    let watch = Watch { done: &|shots| progress.add(shots), stop: &|| interrupt.is_raised() };
    let search = Search { required, folder: &options.output, seed: options.seed, watch: &watch };
    let Some(found) = search.run()? else {
        warn("the search is not at its end; the same command goes on from here");
        return Err(Fault::Interrupted);
    };
    progress.finish();
    interrupt.undisturbed(|| found.write(&options.output))?;
    if options.json {
        return print_json(vec![found.json()]);
    }
    if common.quiet {
        return Ok(());
    }
    print(&found.text())?;
    print(&format!("\nopen {}\n", options.output.join(PAGE).display()))
}
