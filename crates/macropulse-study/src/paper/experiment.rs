//! Three lidars, one car, four distances \[KP16 §3\].

use std::path::Path;
use std::time::Instant;

use super::Error;
use super::geometry::{self, Prediction};
use crate::record;
use macropulse::design::Design;
use macropulse::formats::{Format, State, clear_unfinished};
use macropulse::points::{Outcome, PointCloud};
use macropulse::scene::{Ray, Scene};
use macropulse::score::Score;
use macropulse::sim::{self, Tally, Watch};

/// The sensors compared.
pub const SENSORS: [&str; 3] = ["kim-park-2016", "hdl-64e", "peregrine"];

/// Distances of the car's front, m.
pub const DISTANCES: [u32; 4] = [30, 50, 70, 120];

/// One sensor looking at the car at one distance.
#[derive(Debug)]
pub struct Trial {
    /// The sensor.
    pub sensor: &'static str,
    /// Distance of the car's front, m.
    pub distance: u32,
    /// Its points, with truth.
    pub cloud: PointCloud,
    /// How the pixels came out.
    pub score: Score,
    /// Counts of the run.
    pub tally: Tally,
    /// The samples that geometry predicts on the car.
    pub predicted: Prediction,
    /// Samples on the car without a point, by material, most first.
    pub lost: Vec<(String, u64)>,
    /// Rows that have a point on the car.
    pub rows_on_car: usize,
    /// Height above ground of the lowest sample on the car, m; NaN without one.
    pub lowest_sample: f64,
    /// Distance of the two lowest rows at the car, m.
    pub row_apart: f64,
    /// Height of the sensor above the ground, m.
    pub stands: f64,
    /// Depth of the lower edge of the field below the sensor, at the car's front, m.
    pub edge: f64,
    /// Median range error of the points on the car, m; NaN without one.
    pub bias: f64,
    /// Root of their mean squared range error, m; NaN without one.
    pub error: f64,
}

/// The scene with the car so far away, m.
pub(super) fn scene(distance: u32) -> Result<Scene, Error> {
    Ok(Scene::open(format!("car-{distance}m"))?)
}

/// Runs one trial and writes its cloud, pictures and manifest into `folder`.
pub(super) fn trial(
    design: &Design,
    (sensor, distance): (&'static str, u32),
    seed: u64,
    folder: &Path,
    watch: &Watch,
) -> Result<Trial, Error> {
    let scene = scene(distance)?;
    let began = Instant::now();
    let scan = sim::scan_watched(design, &scene, seed, 0, watch)?.ok_or(Error::Stopped)?;
    let cloud = scan.cloud();
    let elapsed = began.elapsed().as_secs_f64();
    let folder = folder.join(self::folder(sensor, distance));
    std::fs::create_dir_all(&folder)
        .map_err(|source| Error::Folder { path: folder.clone(), source })?;
    clear_unfinished(&folder);
    let formats = [Format::Pcd, Format::Png];
    let writing = Instant::now();
    let mut recorded = record::Files::new(&folder, &formats, (design, Some(&scene)));
    let mut files = recorded.add(&cloud)?;
    recorded.finish()?;
    let mut page = record::Page::new(design, Some(&scene));
    page.add(&cloud);
    files.push(record::PAGE.to_owned());
    let writing = writing.elapsed().as_secs_f64();
    let warnings: Vec<String> =
        scan.tally.where_all_was_lost(design).map(str::to_owned).into_iter().collect();
    let run = record::Run {
        state: State::Finished,
        design,
        scene: &scene,
        seed,
        scans: 1,
        tally: &scan.tally,
        score: &scan.score,
        files: &files,
        warnings: &warnings,
        writing,
        elapsed,
    };
    let manifest = record::manifest(&run);
    page.write(&folder, &manifest.value())?;
    manifest.write(&folder)?;
    let samples = samples_on_car(design, &scene);
    let image = cloud.image(cloud.pick);
    let found = |sample: &Sample| {
        let seen = image.surface(&cloud, sample.pixel);
        matches!(seen.outcome, Outcome::Right | Outcome::Near) && is_target(&scene, seen.object)
    };
    let mut rows: Vec<usize> =
        samples.iter().filter(|s| found(s)).map(|s| s.pixel / cloud.columns).collect();
    rows.dedup();
    let lost = samples.iter().filter(|sample| !found(sample));
    let (bias, error) = range_errors(&cloud, &scene);
    let bottom = design.scan.extent().elevation[0];
    let [_, down] = geometry::pitch(design, bottom);
    Ok(Trial {
        sensor,
        distance,
        lost: by_material(&scene, lost),
        rows_on_car: rows.len(),
        lowest_sample: samples.iter().map(|sample| sample.height).fold(f64::NAN, f64::min),
        predicted: geometry::predict(design, &scene),
        row_apart: libm::tan(down) * f64::from(distance),
        stands: scene.sensor.at_start().position[2],
        edge: libm::tan(-bottom) * f64::from(distance),
        bias,
        error,
        score: scan.score,
        tally: scan.tally,
        cloud,
    })
}

/// Returns the median and the root mean square of the range errors of the points on the car, m. Points on a
/// sidelobe of the code do not move the median.
fn range_errors(cloud: &PointCloud, scene: &Scene) -> (f64, f64) {
    let truth = &cloud.truth.returns;
    let on_car = (0..cloud.range.len()).filter(|&at| {
        matches!(truth.outcome[at], Outcome::Right | Outcome::Near)
            && is_target(scene, truth.object[at])
    });
    let off = |at: usize| f64::from(cloud.range[at]) - f64::from(truth.range[at]);
    let mut errors: Vec<f64> = on_car.map(off).collect();
    errors.sort_by(f64::total_cmp);
    let median = errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN);
    let squares = errors.iter().map(|error| error * error).sum::<f64>();
    (median, (squares / errors.len() as f64).sqrt())
}

/// Name of the folder of a trial.
pub(super) fn folder(sensor: &str, distance: u32) -> String {
    format!("{sensor}-{distance}m")
}

/// A ray that meets the car first.
struct Sample {
    pixel: usize,
    material: u16,
    /// Height of the surface above the ground, m.
    height: f64,
}

fn is_target(scene: &Scene, object: u16) -> bool {
    scene.objects.get(usize::from(object)).is_some_and(|object| object.is_target)
}

/// The rays of the sensor that meet the car first, in the order of the cloud.
fn samples_on_car(design: &Design, scene: &Scene) -> Vec<Sample> {
    let world_from_sensor = scene.sensor.at_start().world_from_sensor();
    let columns = design.scan.columns as usize;
    let sample = |pixel: usize| {
        let aim = design.directions().of((pixel / columns) as u16, (pixel % columns) as u16);
        let ray = Ray {
            origin: scene.sensor.at_start().position,
            direction: world_from_sensor.direction(aim),
        };
        let hit = scene.cast(&ray, design.scan.min_range, design.scan.max_range)?;
        let height = ray.origin[2] + ray.direction[2] * hit.range;
        is_target(scene, hit.object).then_some(Sample { pixel, material: hit.material, height })
    };
    (0..design.shots_per_scan() as usize).filter_map(sample).collect()
}

/// Samples counted by material, most first.
fn by_material<'a>(scene: &Scene, samples: impl Iterator<Item = &'a Sample>) -> Vec<(String, u64)> {
    let mut counts = vec![0_u64; scene.materials.len()];
    samples.for_each(|sample| counts[usize::from(sample.material)] += 1);
    let named = scene.materials.iter().zip(counts).filter(|(_, count)| *count > 0);
    let mut counted: Vec<(String, u64)> =
        named.map(|(material, count)| (material.name.clone(), count)).collect();
    counted.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    counted
}
