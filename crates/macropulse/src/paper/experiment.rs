//! Three lidars, one car, four distances \[KP16 §3\].

use std::path::Path;
use std::time::Instant;

use super::Error;
use super::geometry::{self, Prediction};
use crate::design::Design;
use crate::formats::Format;
use crate::points::{NO_OBJECT, Outcome, PointCloud};
use crate::record;
use crate::scene::Scene;
use crate::score::Score;
use crate::sim::{self, Tally, Watch};

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
    /// What was counted on the way.
    pub tally: Tally,
    /// The samples that geometry predicts on the car.
    pub predicted: Prediction,
    /// Samples on the car without a point, by material, most first.
    pub lost: Vec<(String, u64)>,
    /// Rows that have a point on the car.
    pub rows_on_car: usize,
    /// Height above ground of the lowest sample on the car, m; NaN without one.
    pub lowest_sample: f64,
}

/// Runs one trial and writes its cloud, pictures and manifest into `folder`.
pub(super) fn trial(
    design: &Design,
    (sensor, distance): (&'static str, u32),
    seed: u64,
    folder: &Path,
    watch: &Watch,
) -> Result<Trial, Error> {
    let scene = Scene::open(&format!("car-{distance}m"))?;
    let began = Instant::now();
    let scan = sim::scan_watched(design, &scene, seed, 0, watch).ok_or(Error::Stopped)?;
    let elapsed = began.elapsed().as_secs_f64();
    let folder = folder.join(format!("{sensor}-{distance}m"));
    std::fs::create_dir_all(&folder)
        .map_err(|source| Error::Folder { path: folder.clone(), source })?;
    let formats = [Format::Pcd, Format::Png];
    let writing = Instant::now();
    let files = record::write_scan(&folder, &formats, &scan.cloud, (design, &scene))?;
    let writing = writing.elapsed().as_secs_f64();
    let warnings: Vec<String> =
        scan.tally.where_all_was_lost().map(str::to_owned).into_iter().collect();
    let run = record::Run {
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
    record::manifest(&run).write(&folder)?;
    let on_car = |pixel: usize| {
        let object = scan.cloud.truth.object[pixel];
        object != NO_OBJECT && scene.objects[usize::from(object)].is_target
    };
    let found =
        |pixel: usize| matches!(scan.cloud.truth.outcome[pixel], Outcome::Right | Outcome::Near);
    let pixels = || (0..scan.cloud.range.len()).filter(|&pixel| on_car(pixel));
    let mut rows: Vec<usize> =
        pixels().filter(|&p| found(p)).map(|p| p / scan.cloud.columns).collect();
    rows.dedup();
    let lowest_sample =
        pixels().map(|p| height(design, &scene, &scan.cloud, p)).fold(f64::NAN, f64::min);
    Ok(Trial {
        sensor,
        distance,
        lost: lost_by_material(&scene, &scan.cloud, pixels().filter(|&p| !found(p))),
        rows_on_car: rows.len(),
        lowest_sample,
        predicted: geometry::predict(design, &scene),
        score: scan.score,
        tally: scan.tally,
        cloud: scan.cloud,
    })
}

/// Height above ground of the surface that the pixel's ray meets, m.
fn height(design: &Design, scene: &Scene, cloud: &PointCloud, pixel: usize) -> f64 {
    let (row, column) = ((pixel / cloud.columns) as u16, (pixel % cloud.columns) as u16);
    let [_, _, up] =
        scene.sensor.world_from_sensor().direction(crate::emit::direction(design, row, column));
    scene.sensor.position[2] + up * f64::from(cloud.truth.range[pixel])
}

fn lost_by_material(
    scene: &Scene,
    cloud: &PointCloud,
    pixels: impl Iterator<Item = usize>,
) -> Vec<(String, u64)> {
    let mut counts = vec![0_u64; scene.materials.len()];
    for pixel in pixels {
        counts[usize::from(cloud.truth.material[pixel])] += 1;
    }
    let mut lost: Vec<(String, u64)> = scene
        .materials
        .iter()
        .zip(counts)
        .filter(|(_, count)| *count > 0)
        .map(|(material, count)| (material.name.clone(), count))
        .collect();
    lost.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    lost
}
