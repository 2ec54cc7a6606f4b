//! `macropulse sweep`: scores against what is varied.

mod summary;

use std::num::NonZeroU64;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use macropulse::scene;
use macropulse::sim::Watch;
use macropulse_study::sweep::{Axis, Error, FILES, Job, Metric, Plan, Request, Shard};

use crate::completions;
use crate::fault::Fault;
use crate::folder::{Outputs, refuse_no_folder};
use crate::input::STREAM;
use crate::interrupt::Interrupt;
use crate::kind;
use crate::memory::MemoryLimit;
use crate::options::{Changes, Common, Outside, Surroundings, whole};
use crate::progress::Progress;
use crate::text::{NO_BREAK, counted, print, warn};

/// Vary a key of a sensor and draw how well it does, with 95 % intervals
///
/// Every value is measured with several seeds; each of these scans leaves a small file in DIR/jobs. A scan
/// with a file is not measured again, so the same command goes on where it was stopped. When nothing is
/// missing, a page, index.html, and sweep.csv, sweep.svg, sweep.png and manifest.json are written.
#[derive(Args)]
#[command(after_help = after_help())]
pub struct Sweep {
    /// Ready sensor or TOML file
    #[arg(value_name = "SENSOR", conflicts_with = "sensors", required_unless_present = "sensors")]
    #[arg(add = ArgValueCompleter::new(completions::sensors))]
    sensor: Option<String>,

    /// Ready scene or TOML file
    #[arg(value_name = "SCENE", conflicts_with_all = ["named_scene", "sensors"])]
    #[arg(required_unless_present = "named_scene")]
    #[arg(add = ArgValueCompleter::new(completions::scenes))]
    scene: Option<String>,

    /// Several sensors, with commas between them; along x, or a curve each if a key is varied too
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    sensors: Vec<String>,

    /// Another way to name the scene
    #[arg(long = "scene", value_name = "NAME-or-FILE", id = "named_scene")]
    #[arg(add = ArgValueCompleter::new(completions::scenes))]
    named_scene: Option<String>,

    /// Key and values: 0,0.1,0.2 a list, 50..200:7 seven in equal steps, 1e6..1e10:log9 nine in
    /// equal ratios; given twice, the second key makes a curve for each of its values
    #[arg(long, value_name = "KEY=VALUES")]
    vary: Vec<Axis>,

    #[command(flatten)]
    surroundings: Surroundings,

    #[command(flatten)]
    memory: MemoryLimit,

    #[command(flatten)]
    changes: Changes,

    #[command(flatten)]
    outside: Outside,

    /// Scores, with commas between them
    #[arg(long, value_name = "LIST", default_value = "pd,wrong,precision")]
    score: Scores,

    /// Scans of each value, with a seed each
    #[arg(long, value_name = "N", default_value_t = 8)]
    #[arg(value_parser = whole(1..=10_000_u64))]
    seeds: u64,

    /// First seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    #[arg(value_parser = whole(0..=1_u64 << 62))]
    seed: u64,

    /// Measure only about N shots of each scan, in whole bands, evenly over it
    #[arg(long, value_name = "N")]
    shots: Option<NonZeroU64>,

    /// Do only every n-th scan from the i-th: for several machines on one sweep
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,

    /// Folder for the results, made if need be
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Print the table as JSON
    #[arg(long)]
    json: bool,
}

/// The scores asked for.
#[derive(Clone)]
struct Scores(Vec<Metric>);

impl FromStr for Scores {
    type Err = Error;

    fn from_str(typed: &str) -> Result<Self, Error> {
        Metric::parse(typed).map(Self)
    }
}

fn after_help() -> String {
    let scores =
        Metric::ALL.map(|metric| format!("  {:<10} {}\n", metric.name(), metric.meaning()));
    format!(
        "Scores:\n{}
A key of the scene stands behind scene:, an object by its name, as scene:object.wall.position_m.x;
sun and air are environment.visibility_km and the like.

Examples:
  macropulse sweep kim-park-2016-fixed wall --shots 20000 -o out \\
    --vary detector.photon-counting.missed_marks=0,0.1,0.2,0.4 --score pd,wrong,precision
  macropulse sweep peregrine wall --vary scene:object.wall.position_m.x=10..70:13 -o far
  macropulse sweep hdl-64e street --vary environment.visibility_km=0.05..5:log7 -o fog
  macropulse sweep --sensors kim-park-2016,kim-park-2016-fixed,hdl-64e --scene car-50m -o cars
  macropulse sweep mine.toml street --vary tdc.converters=8..512:log7 --shard 1/2 -o tdc",
        scores.concat()
    )
}

impl Sweep {
    fn request(&self) -> Result<Request, Fault> {
        let sensors: Vec<String> = self.sensor.iter().chain(&self.sensors).cloned().collect();
        let scene = self.scene.as_ref().or(self.named_scene.as_ref()).cloned().unwrap_or_default();
        if sensors.iter().chain([&scene]).any(|name| name == STREAM) {
            return Err(Fault::Wrong(
                "- is no name for a sweep, which goes on later with the same command: write the \
                 sensor or scene into a file"
                    .to_owned(),
            ));
        }
        if let [sensor] = &sensors[..] {
            kind::in_order("sweep", sensor.as_ref(), scene.as_ref())?;
        }
        let mut set = self.changes.all(&self.surroundings)?;
        let outside = self.outside.changes().into_iter();
        set.extend(outside.map(|(key, value)| (format!("{}{key}", scene::OF_SCENE), value)));
        Ok(Request {
            sensors,
            scene,
            set,
            vary: self.vary.clone(),
            seeds: self.seed..self.seed + self.seeds,
            shots: self.shots.map(NonZeroU64::get),
        })
    }
}

pub fn run(options: &Sweep, common: &Common) -> Result<(), Fault> {
    refuse_no_folder(&options.output)?;
    let plan = Plan::within(&options.request()?, options.memory.room())?;
    let folder = options.output.as_path();
    plan.check_folder(folder)?;
    Outputs::named(FILES).check(folder)?;
    let seed = options.seed;
    for job in plan.jobs().filter(|job| job.seed == seed) {
        let (sensor, scene) = (&job.point.sensor.name, &job.point.scene.name);
        options.memory.allow(&format!("{sensor} in {scene}"), &job.memory()?)?;
    }
    let interrupt = Interrupt::listen()?;
    plan.claim_folder(folder)?;
    let shard = options.shard.unwrap_or(Shard::WHOLE);
    let done = work(&plan, folder, shard, (common, &interrupt))?;
    let missing: Vec<usize> = plan.missing(folder).iter().map(|(job, _)| *job).collect();
    if !done {
        let (left, all) = (missing.len(), counted(plan.count() as u64, "scan"));
        let told = format!("{left} of {all} are missing; the same command goes on from here");
        warn(&told.replace(NO_BREAK, " "));
        return Err(Fault::Interrupted);
    }
    let told = match missing.as_slice() {
        [] => {
            let scores = &options.score.0;
            let table = interrupt.undisturbed(|| plan.finish(folder, scores))?;
            table.empty().iter().for_each(|sentence| warn(sentence));
            match options.json {
                true => summary::json(&plan, &table),
                false => summary::text(&plan, &table, folder),
            }
        }
        missing if options.json => summary::json_of_missing(&plan, missing, shard),
        missing => summary::text_of_missing(&plan, missing, shard),
    };
    if options.json || !common.quiet { print(&told) } else { Ok(()) }
}

/// Does what is missing of the `shard`; whether to the end.
fn work(
    plan: &Plan,
    folder: &Path,
    shard: Shard,
    (common, interrupt): (&Common, &Interrupt),
) -> Result<bool, Fault> {
    let missing = plan.missing(folder).into_iter();
    let todo: Vec<Job> = missing.filter(|(job, _)| shard.has(*job)).map(|(_, job)| job).collect();
    let progress = Progress::of(common, "sweep", todo.iter().map(|job| job.point.shots).sum());
    let watch = Watch { done: &|shots| progress.add(shots), stop: &|| interrupt.is_raised() };
    let done = plan.work(folder, &todo, &watch)?;
    progress.finish();
    Ok(done)
}
