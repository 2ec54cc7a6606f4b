//! Whole scans of `kim-park-2016`, from rays to scored points: scans per second on one thread and
//! on all. The sensor makes sixty.
#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::time::Instant;

use common::{SEED, detector};
use macropulse::design::Design;
use macropulse::scene::Scene;
use macropulse::sim::{Scans, Tally, Watch};
use rayon::ThreadPoolBuilder;

/// Scans, of which the fastest counts; no more are begun after so many seconds.
const SCANS: u64 = 40;
const ENOUGH: f64 = 6.0;

fn main() {
    // `cargo test --benches` only asks whether it runs.
    let in_earnest = std::env::args().any(|word| word == "--bench");
    let scans = if in_earnest { SCANS } else { 1 };
    let declared = Design::open("kim-park-2016", &[]).unwrap();
    let clean = Design::open("kim-park-2016", &detector(0.0, 0.0)).unwrap();
    let runs = [
        ("car-50m", "clean", &clean),
        ("car-50m", "declared", &declared),
        ("street", "clean", &clean),
    ];
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    println!("Scans per second, wall time, and where the time of a scan goes, ms of one thread");
    println!("{:>20} {:>7} {:>8}  {}", "", "threads", "scans/s", Tally::STAGES.join(" "));
    for (name, detector, design) in runs {
        let scene = Scene::open(name).unwrap();
        for threads in [1, all] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (rate, seconds) = pool.install(|| best(design, &scene, scans));
            let stages = Tally::STAGES.iter().zip(seconds);
            let stages: Vec<String> = stages
                .map(|(stage, seconds)| format!("{:>width$.1}", 1e3 * seconds, width = stage.len()))
                .collect();
            let name = format!("{name} {detector}");
            println!("{name:>20} {threads:>7} {rate:>8.1}  {}", stages.join(" "));
        }
    }
}

/// Scans per second by the fastest of `scans`, and its seconds in each stage.
fn best(design: &Design, scene: &Scene, scans: u64) -> (f64, [f64; Tally::STAGES.len()]) {
    let watch = Watch { done: &|_| {}, stop: &|| false };
    let mut stream = Scans::new(design, scene, SEED);
    let mut best = (0.0, [0.0; Tally::STAGES.len()]);
    let all = Instant::now();
    for number in 1..=scans {
        let began = Instant::now();
        let tally = stream.scan(number, &watch).unwrap().tally;
        let rate = 1.0 / began.elapsed().as_secs_f64();
        if rate > best.0 {
            best = (rate, tally.seconds);
        }
        if all.elapsed().as_secs_f64() > ENOUGH {
            break;
        }
    }
    best
}
