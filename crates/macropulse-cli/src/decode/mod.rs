//! `macropulse decode`: points out of recorded shots and their record, without a scene.

mod input;
mod run;
mod summary;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use macropulse::channel::Operating;
use macropulse::formats::Format;
use macropulse_study::record::{MANIFEST, PAGE, Pixel, explanation_files};

use crate::completions;
use crate::explain;
use crate::fault::Fault;
use crate::folder::{Folder, Outputs};
use crate::input::STREAM;
use crate::interrupt::Interrupt;
use crate::options::{self, Common, Surroundings};
use crate::simulate::formats::Formats;
use crate::simulate::scenario::files_of_scan;
use crate::text::{print, print_json};
use run::{Run, Setting, Sink};

/// Decode recorded shots and their record, as ticks, into points
///
/// They come from `simulate --format ticks`, `samples` or `histograms`, from `encode`, or from hardware: docs/formats.md
/// says how they are written. The points are those that `simulate` gives, to the byte. A folder gets manifest.json
/// and a page to look at them, index.html, as well.
#[derive(Args)]
#[command(after_help = "Examples:
  macropulse simulate kim-park-2016-fixed car-30m --format ticks,pcd -o out
  macropulse decode --sensor kim-park-2016-fixed out/shots-000000.mps out/ticks-000000.mpt -o again
  macropulse decode --sensor coded-32 out/shots-000000.mps out/samples-000000.mpw -o again
  macropulse decode --sensor mine.toml shots.csv - --format none -o - < ticks.csv
  macropulse decode --sensor mine.toml shots.csv ticks.csv --explain 240,424")]
pub struct Decode {
    /// The shot log, or `-` for stdin
    #[arg(value_name = "SHOTS")]
    shots: PathBuf,

    /// The ticks, or of a sampled sensor the samples; `-` for stdin: points leave as soon as they are
    /// decided
    #[arg(value_name = "RECORD")]
    record: PathBuf,

    /// Ready sensor or TOML file, as the shots were fired by
    #[arg(long, value_name = "NAME-or-FILE", add = ArgValueCompleter::new(completions::sensors))]
    sensor: OsString,

    #[command(flatten)]
    surroundings: Surroundings,

    #[command(flatten)]
    changes: options::Changes,

    /// Folder for the results, made if need be; `-` writes the points to stdout as lines of CSV
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,

    #[arg(
        long,
        value_name = "LIST",
        help = "Formats to write, as of `simulate` [default: pcd,png]"
    )]
    format: Option<Formats>,

    /// Write no page: no index.html to look at the clouds with
    #[arg(long)]
    no_page: bool,

    /// Say why the shot to this pixel was decided as it was; repeatable
    #[arg(long = "explain", value_name = "ROW,COLUMN", value_parser = explain::pixel)]
    explain: Vec<Pixel>,

    /// Print what was counted as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(options: &Decode, common: &Common) -> Result<(), Fault> {
    let changes = options.changes.apart(&options.surroundings)?;
    let design = crate::input::design(&options.sensor, &changes.of_sensor)?;
    let environment = Surroundings::alone(&changes)?;
    let operating = Operating::of(&design, &environment)?;
    explain::check(&design, &options.explain)?;
    let formats = options.formats()?;
    let sink = match options.output.as_deref() {
        None => Sink::Nothing,
        Some(path) if path == Path::new(STREAM) => Sink::Lines,
        Some(path) => {
            let formats = formats.0;
            let has_files = !formats.is_empty() || !options.explain.is_empty();
            let has_page = has_files && !options.no_page;
            let outputs = options.outputs(&formats, has_page);
            Sink::Folder(Folder::claim_alone(path, outputs)?, formats, has_page)
        }
    };
    if matches!(sink, Sink::Lines) && (options.json || !options.explain.is_empty()) {
        return Err(Fault::Wrong(
            "-o - writes the points to stdout: --json and --explain have no place there; write to \
             a folder with -o DIR"
                .to_owned(),
        ));
    }
    let (decoding, names) = input::open(&options.shots, &options.record, &design)?;
    let interrupt = Interrupt::listen()?;
    let setting = Setting { design: &design, environment: &environment, operating: &operating };
    let run = Run::new(setting, names, options.explain.clone());
    let run = run.through(decoding, sink, (common, &interrupt))?;
    if options.json {
        print_json(vec![run.json()])?;
    } else if !common.quiet && !run.is_streamed {
        print(&run.text())?;
    }
    if interrupt.is_raised() { Err(Fault::Interrupted) } else { Ok(()) }
}

impl Decode {
    /// The files of a run that ends with the recording, after however many scans.
    fn outputs(&self, formats: &[Format], has_page: bool) -> Outputs {
        let (formats, pixels) = (formats.to_vec(), self.explain.clone());
        let fixed = [Some(MANIFEST), has_page.then_some(PAGE)];
        let outputs = Outputs::of_scans(fixed.into_iter().flatten(), move |scan| {
            let explained = pixels.iter().flat_map(|pixel| explanation_files(scan, *pixel));
            files_of_scan(&formats, scan).chain(explained).collect()
        });
        outputs.beside(&[self.shots.as_path(), &self.record, Path::new(&self.sensor)])
    }

    fn formats(&self) -> Result<Formats, Fault> {
        let formats = self.format.clone().unwrap_or_default();
        match formats.1.is_none() {
            true => Ok(formats),
            false => Err(Fault::Wrong(
                "--format: ticks and samples are what `decode` reads; ask for formats of points"
                    .to_owned(),
            )),
        }
    }
}
