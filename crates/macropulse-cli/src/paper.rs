//! `macropulse paper`: the whole experiment of \[KP16\].

use std::path::{Path, PathBuf};

use clap::Args;
use macropulse::formats::is_of_scan;
use macropulse::sim::Watch;
use macropulse_study::paper::measured::Reach;
use macropulse_study::paper::{self, Findings, Verdict};
use macropulse_study::record::{MANIFEST, PAGE};
use serde_json::json;

use crate::fault::Fault;
use crate::folder::{Folder, Outputs};
use crate::interrupt::Interrupt;
use crate::options::Common;
use crate::progress::Progress;
use crate::text::{Columns, print, print_json};

/// Repeat the experiment of Kim & Park (2016): three lidars, four distances, every claim checked
#[derive(Args)]
#[command(after_help = "Example:
  macropulse paper -o paper
and open paper/index.html")]
pub struct Paper {
    /// Folder for clouds, images, tables and the report
    #[arg(short, long, value_name = "DIR", default_value = "paper")]
    output: PathBuf,

    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// Print counts and claims as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(options: &Paper, common: &Common) -> Result<(), Fault> {
    let mut folder = Folder::claim_alone(&options.output, outputs())?;
    let interrupt = Interrupt::listen()?;
    folder.make()?;
    let progress = Progress::of(common, "paper", paper::shots()?);
    let watch = Watch { done: &|shots| progress.add(shots), stop: &|| interrupt.is_raised() };
    let findings = paper::run(folder.path(), options.seed, &watch)?;
    folder.keep();
    progress.finish();
    if options.json {
        print_json(vec![json(&findings)])?;
    } else if !common.quiet {
        print(&text(&findings))?;
        print(&format!("\nopen {}\n", folder.path().join("index.html").display()))?;
    }
    Ok(())
}

/// The report and its tables, and the files of a run in the folder of each trial.
fn outputs() -> Outputs {
    let folders = paper::folders();
    let known = folders.clone();
    let is_written = move |path: &Path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let parent = path.parent().unwrap_or(Path::new(""));
        match known.iter().any(|folder| Path::new(folder) == parent) {
            true => is_of_scan(&name) || name == MANIFEST || name == PAGE,
            false => paper::FILES.iter().any(|file| Path::new(file) == path),
        }
    };
    Outputs::of(is_written).within(folders)
}

fn json(findings: &Findings) -> serde_json::Value {
    let points: Vec<_> = findings
        .trials
        .iter()
        .map(|trial| {
            json!({
                "sensor": trial.sensor,
                "distance_m": trial.distance,
                "samples": trial.score.samples_on_target,
                "points": trial.score.points_on_target,
                "predicted": trial.predicted.samples,
                "low": trial.predicted.low,
                "high": trial.predicted.high,
            })
        })
        .collect();
    let methods = &findings.measured.methods;
    json!({
        "points": points,
        "lidars": methods.lidars.iter().map(reach).collect::<Vec<_>>(),
        "fmcw_by_linewidth": methods.lines.iter().map(line).collect::<Vec<_>>(),
        "claims": findings.claims,
    })
}

/// A lidar before walls at growing distance. Numbers that are not there are `null`.
fn reach(reach: &Reach) -> serde_json::Value {
    let places = reach.places.iter().map(|place| {
        let forecast = reach.forecast(place.range);
        json!({
            "range_m": place.range,
            "shots": place.shots,
            "pd": place.pd[0],
            "pd_interval": [place.pd[1], place.pd[2]],
            "precision_m": place.precision,
            "pd_forecast": forecast.map(|[pd, _]| pd),
            "precision_forecast_m": forecast.map(|[_, precision]| precision),
        })
    });
    let [half, low, high] = reach.half();
    json!({
        "lidar": reach.lidar,
        "half_m": half,
        "half_interval_m": [low, high],
        "half_forecast_m": reach.half_forecast(),
        "places": places.collect::<Vec<_>>(),
    })
}

/// The FMCW lidar with a laser of this line.
fn line((hz, found): &(f64, Reach)) -> serde_json::Value {
    let mut value = reach(found);
    value["linewidth_khz"] = json!(hz * 1e-3);
    value
}

fn text(findings: &Findings) -> String {
    let mut counts = Columns::default();
    for trial in &findings.trials {
        counts.push(
            format!("{} at {} m", trial.sensor, trial.distance),
            format!(
                "{} points of {} samples on the car; geometry says {:.0} to {:.0}",
                trial.score.points_on_target,
                trial.score.samples_on_target,
                trial.predicted.low,
                trial.predicted.high
            ),
        );
    }
    let mut verdicts = Columns::default();
    for verdict in
        [Verdict::Holds, Verdict::Partly, Verdict::Fails, Verdict::Unsaid, Verdict::Assumed]
    {
        let ids: Vec<&str> =
            findings.claims.iter().filter(|c| c.verdict == verdict).map(|c| c.id).collect();
        verdicts.push(format!("{} {}", ids.len(), verdict.name()), ids.join(", "));
    }
    format!("{}\nclaims of the paper\n{}", counts.text(), verdicts.text())
}
