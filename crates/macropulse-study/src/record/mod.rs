//! Files that a run leaves on the disk: clouds, pictures, and the manifest by which it can be repeated.

mod decoded;
mod explanation;
mod folder;
mod page;

use std::path::{Path, PathBuf};

use crate::view::{Layout, RangePicture};
use macropulse::channel::idealised;
use macropulse::codec::RecordKind;
use macropulse::codec::decode::Reject;
use macropulse::design::Design;
use macropulse::emit::scan_begins_fs;
use macropulse::environment::Environment;
use macropulse::formats::{
    self, Begun, Entries, Format, Manifest, Named, Names, Recording, State, Surroundings,
    write_atomically,
};
use macropulse::names::toml_value;
use macropulse::points::{Outcome, PointCloud, Truth};
use macropulse::predict::unmodelled;
use macropulse::scene::Scene;
use macropulse::score::Score;
use macropulse::sim::Tally;
use serde_json::json;

pub use decoded::Decoded;
pub use explanation::{Pixel, PixelExplanation, explanation_files};
pub use folder::{CloudsAt, Left};
pub use page::{MANIFEST, PAGE, Page, describe, explain, title};

/// How the names of range images in colour end.
pub const COLOUR: &str = "-colour.png";

/// Why what a run leaves could not be written, or read again.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be written, or a cloud not be read.
    #[error(transparent)]
    Formats(#[from] formats::Error),
    /// A picture could not be drawn.
    #[error(transparent)]
    View(#[from] crate::view::Error),
    /// A folder or a manifest could not be read.
    #[error("{}: cannot be read: {cause}", path.display())]
    Unreadable {
        /// The path that cannot be read.
        path: PathBuf,
        /// The error of the operating system.
        cause: std::io::Error,
    },
    /// A manifest is none.
    #[error("{}: is not the manifest of a run: {cause}; name a cloud instead", path.display())]
    Manifest {
        /// The file.
        path: PathBuf,
        /// The error of the JSON reader.
        cause: serde_json::Error,
    },
    /// A folder holds no cloud.
    #[error(
        "{folder}: holds no point cloud that can be read; write one with `macropulse simulate … \
         --format pcd -o {folder}`",
        folder = folder.display()
    )]
    NoCloud {
        /// The folder.
        folder: PathBuf,
    },
}

/// The files of a run of one sensor, written scan by scan.
pub struct Files<'a> {
    folder: PathBuf,
    recording: Recording,
    design: &'a Design,
    objects: Vec<String>,
    materials: Vec<String>,
}

impl<'a> Files<'a> {
    /// The files that go to `folder` in `formats`, of a sensor in a scene, if one is known. Nothing is
    /// written yet.
    pub fn new(
        folder: &Path,
        formats: &[Format],
        (design, scene): (&'a Design, Option<&Scene>),
    ) -> Files<'a> {
        let names = |of: fn(&Scene) -> Vec<String>| scene.map(of).unwrap_or_default();
        Self {
            folder: folder.to_owned(),
            recording: Recording::new(folder, formats),
            design,
            objects: names(|scene| scene.objects.iter().map(|one| one.name.clone()).collect()),
            materials: names(|scene| scene.materials.iter().map(|one| one.name.clone()).collect()),
        }
    }

    /// Writes the files of scan number `cloud.scan` and gives the names of those that are new.
    ///
    /// # Errors
    /// If a file cannot be written; files written before it stay.
    pub fn add(&mut self, cloud: &PointCloud) -> Result<Vec<String>, Error> {
        // Names of what the files do not tell say nothing.
        let names = match cloud.truth == Truth::default() {
            true => Names::default(),
            false => Names { objects: &self.objects, materials: &self.materials },
        };
        let mut files = Vec::new();
        for (format, file) in self.recording.add(cloud, &names)? {
            files.push(file);
            if format == Format::Png {
                // Some grids are too large for a picture in colour; the 16-bit one is there.
                let picture = match colour_picture(cloud, self.design) {
                    Err(crate::view::Error::Size { .. }) => continue,
                    picture => picture?,
                };
                let file = colour_name(cloud.scan);
                write_atomically(&self.folder.join(&file), |out| out.write_all(&picture))?;
                files.push(file);
            }
        }
        Ok(files)
    }

    /// Finishes the files that hold all scans.
    ///
    /// # Errors
    /// If one cannot be written to.
    pub fn finish(self) -> Result<(), Error> {
        Ok(self.recording.finish()?)
    }
}

/// Name of the range image in colour of a scan.
pub fn colour_name(scan: u64) -> String {
    format!("range-{scan:06}{COLOUR}")
}

/// The range image for people, large enough to see something in.
fn colour_picture(cloud: &PointCloud, design: &Design) -> Result<Vec<u8>, crate::view::Error> {
    let zoom = |pixels: usize, wanted: usize| (wanted / pixels.max(1)).clamp(1, 8);
    let even = zoom(cloud.columns, 1024);
    let mut layout = Layout::new(cloud.rows, cloud.columns);
    layout.zoom = [even, even.max(zoom(cloud.rows, 256))];
    let picture = RangePicture {
        layout,
        range: &cloud.image(cloud.pick).spread(&cloud.range, f32::NAN),
        near: design.scan.min_range as f32,
        far: design.scan.max_range as f32,
    };
    picture.png()
}

/// A run of one sensor in one scene.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// The sensor.
    pub design: &'a Design,
    /// The scene.
    pub scene: &'a Scene,
    /// Seed of the random numbers.
    pub seed: u64,
    /// How far it has come.
    pub state: State,
    /// Scans that are complete.
    pub scans: u64,
    /// Counts of the run, stage by stage.
    pub tally: &'a Tally,
    /// How the pixels came out.
    pub score: &'a Score,
    /// Names of the files written.
    pub files: &'a [String],
    /// Remarks beyond those of the scene.
    pub warnings: &'a [String],
    /// Time spent writing files, s.
    pub writing: f64,
    /// Wall-clock time, s.
    pub elapsed: f64,
}

/// The manifest of a run.
pub fn manifest(run: &Run) -> Manifest {
    let Run { design, scene, tally, score, .. } = *run;
    let mut manifest = Manifest {
        state: run.state,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: run.seed,
        sensor: named(design),
        scene: Named { name: scene.name.clone(), digest: scene.digest() },
        environment: surroundings(&scene.environment),
        defaults: defaults(design),
        idealised: idealised(design, &scene.environment)
            .iter()
            .map(|effect| effect.name.to_owned())
            .collect(),
        not_modelled: not_modelled(design, &scene.environment),
        assumed: scene.notes.clone(),
        warnings: run.warnings.to_vec(),
        right_fraction: Some(score.right_fraction()).filter(|fraction| fraction.is_finite()),
        right_within_m: design.right_within,
        scans: (0..run.scans).map(|scan| begun(design, scene, scan)).collect(),
        files: run.files.to_vec(),
        ..Manifest::default()
    };
    for (name, count) in [
        ("scans", run.scans),
        ("shots", tally.shots),
        ("surfaces", tally.surfaces),
        ("echoes", tally.echoes),
    ] {
        manifest.counts.push(name, count);
    }
    let record = design.records();
    if record == RecordKind::Ticks {
        manifest.counts.push("detections", tally.detections);
    }
    manifest.counts.push(format!("{}s", record.counted()), tally.recorded);
    manifest.counts.push("returns", tally.returns);
    for number in 1..=design.receiver.returns {
        let count = tally.by_number[usize::from(number) - 1];
        if design.receiver.returns > 1 {
            manifest.counts.push(format!("returns_{number}"), count);
        }
    }
    manifest.counts.push("samples_on_target", score.samples_on_target);
    manifest.counts.push("points_on_target", score.points_on_target);
    if !scene.interferers.is_empty() {
        manifest.counts.push("interferer_shots", tally.interferer_shots);
        manifest.counts.push("ghosts", score.ghosts);
    }
    for (kind, count) in Reject::ALL.into_iter().zip(tally.rejects) {
        manifest.rejects.push(kind.name(), count);
    }
    if design.bank().is_some() {
        manifest.converters.push("peak_busy", u64::from(tally.peak_busy));
        manifest.converters.push("lost", tally.lost);
        manifest.converters.push("merged", tally.merged);
    }
    for outcome in Outcome::ALL {
        manifest.outcomes.push(outcome.name(), score.count(outcome));
        if design.receiver.returns > 1 {
            manifest.further_outcomes.push(outcome.name(), score.count_further(outcome));
        }
    }
    for (stage, seconds) in Tally::STAGES.into_iter().zip(tally.seconds) {
        manifest.times_s.push(stage, seconds);
    }
    manifest.times_s.push("write", run.writing);
    manifest.times_s.push("elapsed", run.elapsed);
    manifest
}

/// Effects that are not modelled for a sensor in an environment, as manifests have them. Empty if the sensor
/// cannot be simulated.
pub fn not_modelled(design: &Design, environment: &Environment) -> Entries<serde_json::Value> {
    let mut entries = Entries::default();
    for left in unmodelled::of(design, environment).unwrap_or_default() {
        let effect = left.effect;
        entries.push(effect.name(), json!({ "assumed": effect.assumption(), "size": left.size }));
    }
    entries
}

/// Warnings to read before a sensor runs in a scene: those of the sensor, of the scene, and of the air.
pub fn warnings(design: &Design, scene: &Scene) -> Vec<String> {
    let of_air = unmodelled::warnings(design, &scene.environment);
    [&design.warnings[..], &scene.warnings, &of_air].concat()
}

/// A sensor as manifests have it.
pub fn named(design: &Design) -> Named {
    Named { name: design.name.clone(), digest: design.digest() }
}

/// Sun and air as manifests have them.
pub fn surroundings(environment: &Environment) -> Surroundings {
    Surroundings { name: environment.name.clone(), conditions: environment.conditions() }
}

/// Values for the keys that the file of a sensor leaves open.
pub fn defaults(design: &Design) -> Entries<serde_json::Value> {
    let value = |typed: &str| serde_json::to_value(toml_value(typed)).unwrap_or_default();
    let defaults = design.defaults.iter();
    Entries(defaults.map(|(key, typed)| (key.clone(), value(typed))).collect())
}

fn begun(design: &Design, scene: &Scene, scan: u64) -> Begun {
    let start_fs = scan_begins_fs(design, scan);
    let pose = scene.sensor.at(start_fs);
    let [yaw_deg, pitch_deg, roll_deg] = pose.rotation.angles_deg();
    Begun {
        scan,
        start_ns: start_fs as f64 * 1e-6,
        position_m: pose.position,
        yaw_deg,
        pitch_deg,
        roll_deg,
    }
}
