//! `macropulse simulate`: sensors in a scene, scan by scan.

pub mod formats;
pub mod recorded;
mod run;
pub mod scenario;
pub mod summary;

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use clap_complete::engine::ArgValueCompleter;
use macropulse::codec::decode::ReceiverKind;
use macropulse::memory::Estimate;
use macropulse::scene::{Changes, Room};
use macropulse_study::record::Pixel;

use crate::completions;
use crate::explain;
use crate::fault::Fault;
use crate::folder::Folder;
use crate::interrupt::Interrupt;
use crate::kind::Kind;
use crate::memory::MemoryLimit;
use crate::options::{self, Common, Surroundings};
use crate::text::{print, print_json};
pub use formats::Formats;
use run::Run;
use scenario::Scenario;

/// Scan a scene and write point clouds, range images and a manifest
///
/// Which sensor, in which scene, and how long, is said by a scenario file or by options; options
/// win over the file.
#[derive(Args)]
#[command(after_help = "Examples:
  macropulse simulate kim-park-2016-fixed car-30m -o out
  macropulse simulate hdl-64e street --scans 5 --format ply,csv --truth -o out
  macropulse simulate hdl-64e street --environment fog-50m -o out
  macropulse simulate --sensor hdl-64e --sensor peregrine --scene street -o out
  macropulse simulate crossing.toml -o out

A scenario file:
  version = 1
  sensors = [\"kim-park-2016-fixed\", \"hdl-64e\"]   # or sensor = \"mine.toml\"
  scene = \"street\"
  scans = 5
  seed = 7
  formats = [\"pcd\", \"png\"]
  truth = true")]
pub struct Simulate {
    /// Ready sensor or TOML file, - for standard input; or, alone, a scenario file
    #[arg(value_name = "SENSOR", conflicts_with = "sensors", required_unless_present = "sensors")]
    #[arg(add = ArgValueCompleter::new(completions::sensors))]
    sensor: Option<OsString>,

    /// Ready scene or TOML file, - for standard input
    #[arg(value_name = "SCENE", conflicts_with_all = ["named_scene", "sensors"])]
    #[arg(add = ArgValueCompleter::new(completions::scenes))]
    scene: Option<OsString>,

    /// Another way to name a sensor; repeatable, each of several gets a folder of its own
    #[arg(long = "sensor", value_name = "NAME-or-FILE", requires = "named_scene")]
    #[arg(add = ArgValueCompleter::new(completions::sensors))]
    sensors: Vec<OsString>,

    /// Another way to name the scene
    #[arg(long = "scene", value_name = "NAME-or-FILE", id = "named_scene")]
    #[arg(add = ArgValueCompleter::new(completions::scenes))]
    named_scene: Option<OsString>,

    #[command(flatten)]
    surroundings: Surroundings,

    #[command(flatten)]
    changes: options::Changes,

    #[command(flatten)]
    outside: options::Outside,

    #[command(flatten)]
    memory: MemoryLimit,

    /// Receiver that decodes the macropulses: short for --set receiver.kind=…
    #[arg(long, value_name = "KIND", value_parser = receivers())]
    receiver: Option<String>,

    /// Folder for the results, made if need be; files of the same name are replaced
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,

    /// Number of scans [default: 1]
    #[arg(long, value_name = "N")]
    scans: Option<u64>,

    /// Seed of the random numbers; the same seed gives the same bytes [default: 1]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    #[arg(long, value_name = "LIST", help = Formats::help())]
    format: Option<Formats>,

    /// Write no page: no index.html to look at the clouds with
    #[arg(long)]
    no_page: bool,

    /// Write the truth beside each point: range, object, material, incidence, outcome
    #[arg(long)]
    truth: bool,

    /// Say why the shot to this pixel was decided as it was, in the first scan; repeatable
    #[arg(long = "explain", value_name = "ROW,COLUMN", value_parser = explain::pixel)]
    explain: Vec<Pixel>,

    /// Print what was counted as JSON: an object, or an array of them for several sensors
    #[arg(long)]
    json: bool,
}

/// The names of all receivers.
fn receivers() -> PossibleValuesParser {
    let named = |kind: &ReceiverKind| {
        PossibleValue::new(kind.name()).help(kind.summary().trim_end_matches('.'))
    };
    ReceiverKind::ALL.iter().map(named).into()
}

impl Simulate {
    /// Returns the scenario to be simulated, all of it checked.
    fn scenario(&self) -> Result<Scenario, Fault> {
        let mut changes = self.changes.apart(&self.surroundings)?;
        changes.of_scene.extend(self.outside.changes());
        if let Some(kind) = &self.receiver {
            changes.of_sensor.push(("receiver.kind".to_owned(), kind.clone()));
        }
        let scene = self.scene.as_ref().or(self.named_scene.as_ref());
        let room = self.memory.room();
        let mut scenario = match (&self.sensor, scene) {
            (Some(alone), None) => open(alone, &changes, room)?,
            (sensor, scene) => {
                let sensors: Vec<OsString> = sensor.iter().chain(&self.sensors).cloned().collect();
                let scene = scene.map_or(OsStr::new(""), OsString::as_os_str);
                Scenario::of(&sensors, scene, &changes, room)?
            }
        };
        if let Some(formats) = &self.format {
            scenario.formats.clone_from(&formats.0);
            scenario.records.clone_from(&formats.1);
        }
        for design in &scenario.designs {
            let asked = scenario.records.of(design);
            asked.map_err(|sentence| Fault::Wrong(format!("--format: {sentence}")))?;
        }
        scenario.scans = self.scans.unwrap_or(scenario.scans);
        scenario::check_scans(scenario.scans, &scenario.designs)
            .map_err(|sentence| Fault::Wrong(format!("--scans: {sentence}")))?;
        scenario.seed = self.seed.unwrap_or(scenario.seed);
        scenario.truth |= self.truth;
        scenario.explain.clone_from(&self.explain);
        let has_files = !scenario.writes_nothing() || !self.explain.is_empty();
        scenario.has_page = has_files && !self.no_page;
        scenario.designs.iter().try_for_each(|design| explain::check(design, &self.explain))?;
        for design in &scenario.designs {
            let estimate = Estimate::in_scene(design, &scenario.scene).map_err(Fault::from)?;
            let is_written = self.output.is_some();
            let estimate = if is_written { estimate } else { estimate.unwritten() };
            self.memory.allow(&format!("{} in {}", design.name, scenario.scene.name), &estimate)?;
        }
        Ok(scenario)
    }

    /// A folder for each sensor, proven to be writable; none where nothing is to be written.
    fn folders(&self, scenario: &Scenario) -> Result<Vec<Option<Folder>>, Fault> {
        let Some(output) = &self.output else {
            if scenario.writes_nothing() {
                return Ok(scenario.designs.iter().map(|_| None).collect());
            }
            let remedy = "say where the results go with -o DIR, or write none with --format none";
            return Err(Fault::Wrong(remedy.to_owned()));
        };
        let paths = match scenario.designs.as_slice() {
            [_] => vec![output.clone()],
            several => subfolders(output, several.iter().map(|design| design.name.as_str())),
        };
        let folders = paths
            .iter()
            .zip(&scenario.designs)
            .map(|(path, design)| Folder::claim_alone(path, scenario.outputs(design)).map(Some));
        folders.collect()
    }
}

pub fn run(options: &Simulate, common: &Common) -> Result<(), Fault> {
    let scenario = options.scenario()?;
    let folders = options.folders(&scenario)?;
    let interrupt = Interrupt::listen()?;
    let mut runs = Vec::new();
    for (design, folder) in scenario.designs.iter().zip(folders) {
        runs.push(Run::of(design, &scenario, folder, (common, &interrupt))?);
        if interrupt.is_raised() {
            break;
        }
    }
    if options.json {
        print_json(runs.iter().map(Run::json).collect())?;
    } else if !common.quiet {
        let texts: Vec<String> = runs.iter().map(|run| run.text(common.verbose)).collect();
        print(&texts.join("\n"))?;
    }
    if interrupt.is_raised() { Err(Fault::Interrupted) } else { Ok(()) }
}

/// The scenario called `name`; a sensor or a scene in its place is a slip worth a hint.
fn open(name: &OsStr, changes: &Changes, room: Room) -> Result<Scenario, Fault> {
    let called = name.display();
    match Kind::of(name)? {
        Kind::Scenario => Scenario::open(name, changes, room),
        Kind::Sensor => Err(Fault::Wrong(format!(
            "{called}: is a sensor; name a scene behind it, as in `macropulse simulate {called} street`"
        ))),
        Kind::Scene => Err(Fault::Wrong(format!(
            "{called}: is a scene; name a sensor before it, as in `macropulse simulate hdl-64e {called}`"
        ))),
    }
}

/// A folder below `output` for each name; characters that mean something in a path are replaced,
/// and names that come twice are numbered.
fn subfolders<'a>(output: &Path, names: impl Iterator<Item = &'a str>) -> Vec<PathBuf> {
    let mut taken: Vec<String> = Vec::new();
    for name in names {
        let plain = name.replace(|c: char| !c.is_alphanumeric() && !"-_".contains(c), "-");
        let numbered = (2..).map(|n| format!("{plain}-{n}"));
        let free = std::iter::once(plain.clone()).chain(numbered).find(|n| !taken.contains(n));
        taken.extend(free);
    }
    taken.iter().map(|name| output.join(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_of_one_name_do_not_share_a_folder() {
        let folders = subfolders(Path::new("out"), ["a", "../b", "a", "a"].into_iter());
        let wanted = ["out/a", "out/---b", "out/a-2", "out/a-3"].map(PathBuf::from);
        assert_eq!(folders, wanted);
    }
}
