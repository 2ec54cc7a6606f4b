//! Same seed, same bytes, whatever the number of threads.
#![allow(clippy::unwrap_used)]

use macropulse::design::Design;
use macropulse::emit::{Band, bands, short_bands};
use macropulse::formats::{Format, Names, write_cloud};
use macropulse::points::{Attribute, PointCloud, Truth};
use macropulse::scene::Scene;
use macropulse::sim::{self, Scan, Tally};

const SEED: u64 = 20_160_913;

/// The bands measured: all of them, the first ones, or those of the road close by, nine lines for each one
/// counted.
#[derive(Clone, Copy)]
enum Part {
    Whole,
    First(usize),
    Road(u64),
}

/// One scan of the car at 50 m on a pool of `threads` threads.
fn scan(sensor: &str, part: Part, (seed, threads): (u64, usize)) -> Scan {
    let (sensor, keys) = sensor.split_once(' ').unwrap_or((sensor, ""));
    let keys = keys.split_once('=').map(|(key, value)| (key.to_owned(), value.to_owned()));
    let design = Design::open(sensor, keys.as_slice()).unwrap();
    let scene = Scene::open("car-50m").unwrap();
    let chosen: Vec<Band> = match part {
        Part::Whole => bands(&design, 0).collect(),
        Part::First(count) => short_bands(&design, 0).take(count).collect(),
        Part::Road(count) => {
            let lines = 360..360 + 9 * count;
            short_bands(&design, 0).filter(|band| lines.contains(&(band.first / 848))).collect()
        }
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| sim::scan_part(&design, &scene, seed, &chosen).unwrap())
}

fn pcd(cloud: &PointCloud) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.pcd");
    write_cloud(Format::Pcd, cloud, &Names { objects: &[], materials: &[] }, &path).unwrap();
    std::fs::read(path).unwrap()
}

/// Every column of the cloud, as bits: NaN equals itself, and 0 is not −0.
fn bits(cloud: &PointCloud) -> Vec<Vec<u64>> {
    let PointCloud { scan, rows, columns, viewpoint, returns_per_shot, pick, .. } = cloud;
    let Truth { returns, pixels, .. } = &cloud.truth;
    let attributes = Attribute::ALL.into_iter().filter_map(|attribute| attribute.entries(cloud));
    let of_returns = attributes
        .map(|entries| (0..cloud.returns()).map(|at| entries.number(at).to_bits()).collect());
    let reals = [&returns.cosine, &pixels.range, &pixels.cosine];
    let counts = [&pixels.object, &pixels.material];
    let shape = vec![*scan, *rows as u64, *columns as u64, *returns_per_shot as u64, *pick as u64];
    let seen_from = viewpoint.position.iter().chain(&viewpoint.turn).map(|value| value.to_bits());
    [shape, seen_from.collect(), cloud.fired_ns.iter().map(|time| time.to_bits()).collect()]
        .into_iter()
        .chain(of_returns)
        .chain(reals.map(|column| column.iter().map(|value| u64::from(value.to_bits())).collect()))
        .chain(counts.map(|column| column.iter().map(|&value| u64::from(value)).collect()))
        .chain([pixels.outcome.iter().map(|&outcome| outcome as u64).collect()])
        .collect()
}

/// Everything counted; only the seconds may differ.
fn counted(scan: &Scan) -> Tally {
    Tally { seconds: Default::default(), ..scan.tally }
}

fn assert_same_on_any_pool(sensor: &str, part: Part) {
    let alone = scan(sensor, part, (SEED, 1));
    assert!(alone.tally.returns > 30, "{sensor}: {:?}", alone.tally);
    for threads in [2, 3] {
        let shared = scan(sensor, part, (SEED, threads));
        assert_eq!(bits(&alone.cloud()), bits(&shared.cloud()), "{sensor}, {threads} threads");
        assert_eq!(alone.score, shared.score, "{sensor}, {threads} threads");
        assert_eq!(counted(&alone), counted(&shared), "{sensor}, {threads} threads");
        assert!(pcd(&alone.cloud()) == pcd(&shared.cloud()), "{sensor}, {threads} threads: PCD");
    }
    let other = scan(sensor, part, (SEED + 1, 2));
    assert_ne!(bits(&alone.cloud()), bits(&other.cloud()), "{sensor}: the seed has no effect");
    assert!(pcd(&alone.cloud()) != pcd(&other.cloud()), "{sensor}: the seed has no effect on PCD");
}

#[test]
fn bands_of_the_coded_sensor() {
    assert_same_on_any_pool("kim-park-2016", Part::Road(2));
}

#[test]
fn bands_of_the_coded_sensor_with_several_returns() {
    assert_same_on_any_pool("kim-park-2016 receiver.returns=3", Part::Road(2));
}

/// One whose baseline remembers light of long before a band.
#[test]
fn the_sampled_sensor_behind_a_capacitor() {
    let key = "coded-32 detector.photodiode.low_cutoff_khz=20.0";
    assert_same_on_any_pool(key, Part::First(2));
}

#[test]
fn the_spinning_sensor() {
    assert_same_on_any_pool("hdl-64e", Part::Whole);
}

#[test]
fn the_flash() {
    assert_same_on_any_pool("peregrine", Part::Whole);
}

/// A band comes out the same alone as among others: guard shots draw what their neighbours draw.
#[test]
fn a_band_alone_and_among_its_neighbours() {
    let both = scan("kim-park-2016", Part::Road(2), (SEED, 2)).cloud();
    let one = scan("kim-park-2016", Part::Road(1), (SEED, 1)).cloud();
    let [one, both] =
        [one, both].map(|cloud| cloud.image(cloud.pick).spread(&cloud.range, f32::NAN));
    let returns = (0..one.len()).filter(|&pixel| !one[pixel].is_nan());
    let mut compared = 0;
    for pixel in returns {
        assert_eq!(one[pixel].to_bits(), both[pixel].to_bits(), "pixel {pixel}");
        compared += 1;
    }
    assert!(compared > 5000, "{compared}");
}
