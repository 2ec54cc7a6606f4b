//! `macropulse check`: is it right, and what follows from it?

mod scene;
mod sensor;

use std::ffi::{OsStr, OsString};

use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use macropulse::formats::versioned;
use macropulse::memory::Estimate;
use macropulse::predict::unmodelled;
use macropulse::scene as scenes;
use macropulse_study::record::surroundings;
use serde_json::{Value, json};

use crate::completions;
use crate::fault::Fault;
use crate::input;
use crate::kind::Kind;
use crate::memory::{self, MemoryLimit, told};
use crate::options::{Changes, Common, Outside, Surroundings};
use crate::simulate::scenario::Scenario;
use crate::text::{Columns, complain, counted, print, print_json};

/// Check sensors, scenes and scenarios, and print what follows from them
///
/// Prints derived quantities, every default used, every idealisation with what it assumes, what is
/// not modelled and how large it is, and warnings. The content of a file tells which of the three it
/// is.
#[derive(Args)]
#[command(after_help = "Example:
  macropulse check kim-park-2016 mine.toml")]
pub struct Check {
    /// Ready sensors or scenes, or TOML files, - for standard input
    #[arg(required = true, value_name = "NAME-or-FILE")]
    #[arg(add = ArgValueCompleter::new(completions::both))]
    files: Vec<OsString>,

    #[command(flatten)]
    surroundings: Surroundings,

    #[command(flatten)]
    changes: Changes,

    #[command(flatten)]
    outside: Outside,

    #[command(flatten)]
    memory: MemoryLimit,

    /// Print as JSON: an object, or an array of them for several files
    #[arg(long)]
    json: bool,
}

pub fn run(options: &Check, common: &Common) -> Result<(), Fault> {
    let changes = options.changes.apart(&options.surroundings)?;
    let mut reports = Vec::new();
    let mut wrong = false;
    for file in &options.files {
        match Report::of(file, &changes, options) {
            Ok(report) => reports.push(report),
            Err(fault) => {
                complain(&fault);
                wrong = true;
            }
        }
    }
    if options.json {
        // A file that is wrong is missing from the list, but a list it stays.
        let mut values = reports.into_iter().map(|report| report.json).collect::<Vec<Value>>();
        if options.files.len() > 1 {
            print_json(vec![values.into_iter().map(versioned).collect()])?;
        } else if let Some(value) = values.pop() {
            print_json(vec![value])?;
        }
    } else if !common.quiet && !reports.is_empty() {
        let texts: Vec<String> = reports.into_iter().map(|report| report.text).collect();
        print(&texts.join("\n"))?;
    }
    if wrong { Err(Fault::Told) } else { Ok(()) }
}

/// Report on a file without faults.
struct Report {
    text: String,
    json: Value,
}

impl Report {
    fn of(name: &OsStr, changes: &scenes::Changes, options: &Check) -> Result<Self, Fault> {
        let memory = &options.memory;
        // A sensor beside the scenes has no use for it, and is checked all the same.
        let mut of_scenes = changes.clone();
        of_scenes.of_scene.extend(options.outside.changes());
        match Kind::of(name)? {
            Kind::Sensor => {
                let environment = Surroundings::alone(changes)?;
                sensor::report(&input::design(name, &changes.of_sensor)?, &environment, memory)
            }
            Kind::Scene => {
                scene::report(&input::scene(name, &of_scenes.of_scene, memory.room())?, memory)
            }
            Kind::Scenario => {
                let read = Scenario::open(name, &of_scenes, memory.room())?;
                scenario(&name.to_string_lossy(), &read, memory)
            }
        }
    }
}

/// A scenario with what it names, in short.
fn scenario(name: &str, scenario: &Scenario, memory: &MemoryLimit) -> Result<Report, Fault> {
    let mut most = Estimate::default();
    for design in &scenario.designs {
        let estimate = Estimate::in_scene(design, &scenario.scene)?;
        memory.allow_alone(&format!("{} in {}", design.name, scenario.scene.name), &estimate)?;
        if estimate.total(1) > most.total(1) {
            most = estimate;
        }
    }
    let sensors: Vec<&str> = scenario.designs.iter().map(|design| design.name.as_str()).collect();
    let formats: Vec<&str> = scenario.formats.iter().map(|format| format.name()).collect();
    let mut columns = Columns::default();
    columns.push("sensors", sensors.join(", "));
    columns.push("scene", scenario.scene.name.clone());
    let environment = &scenario.scene.environment;
    let conditions = environment.conditions();
    columns.push("environment", format!("{}: {conditions}", environment.name));
    columns.push("length", counted(scenario.scans, "scan"));
    columns.push("seed", scenario.seed.to_string());
    columns
        .push("formats", if formats.is_empty() { "none".to_owned() } else { formats.join(", ") });
    columns.push("memory", estimated(&most));
    columns.push("truth", if scenario.truth { "written" } else { "not written" });
    let warnings: Vec<String> = scenario
        .designs
        .iter()
        .flat_map(|design| design.warnings.iter().map(|w| format!("{}: {w}", design.name)))
        .chain(scenario.scene.warnings.iter().cloned())
        .chain(scenario.designs.iter().flat_map(|design| unmodelled::warnings(design, environment)))
        .collect();
    columns.push_list("warnings", warnings.iter().cloned());
    columns.push_list("assumed", scenario.scene.notes.iter().cloned());
    Ok(Report {
        text: format!("{name}: a scenario\n\n{}", columns.text()),
        json: json!({
            "kind": "scenario",
            "name": name,
            "sensors": sensors,
            "scene": scenario.scene.name,
            "environment": surroundings(environment),
            "scans": scenario.scans,
            "seed": scenario.seed,
            "formats": formats,
            "truth": scenario.truth,
            "warnings": warnings,
            "assumed": scenario.scene.notes,
            "memory": memory::json(&most),
        }),
    })
}

/// Returns the memory that a run is estimated to take, for people.
fn estimated(estimate: &Estimate) -> String {
    let threads = rayon::current_num_threads() as u64;
    let (all, each) = (told(estimate.total(threads as usize)), told(estimate.band));
    format!("about {all} with {}, {each} for each", counted(threads, "thread"))
}
