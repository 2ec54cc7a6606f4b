//! Whole scans of `kim-park-2016`, from rays to scored points: scans per second on one thread and
//! on all. The sensor makes sixty.
#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::time::Instant;

use common::{SEED, conditions};
use macropulse::design::Design;
use macropulse::scene::Scene;
use macropulse::sim::{Scans, Tally, Watch};
use rayon::ThreadPoolBuilder;

/// Scans, of which the fastest counts; no more are begun after so many seconds.
const SCANS: u64 = 40;
const ENOUGH: f64 = 3.0;

fn main() {
    // `cargo test --benches` only asks whether it runs.
    let in_earnest = std::env::args().any(|word| word == "--bench");
    let scans = if in_earnest { SCANS } else { 1 };
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    println!("Scans per second, wall time, and where the time of a scan goes, ms of one thread");
    println!("{:>29} {:>7} {:>8}  {}", "", "threads", "scans/s", Tally::STAGES.join(" "));
    for name in ["car-50m", "street"] {
        let scene = Scene::open(name).unwrap();
        for (condition, keys) in conditions() {
            let design = Design::open("kim-park-2016", &keys).unwrap();
            // One thread as well where the time of a stage is of interest by itself.
            let is_plain = ["as declared", "0 % missed, 0e0/s"].contains(&condition.as_str());
            for threads in [1, all].into_iter().skip(usize::from(!is_plain)) {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let (rate, seconds) = pool.install(|| best(&design, &scene, scans));
                let stages = Tally::STAGES.iter().zip(seconds);
                let stages = stages.map(|(stage, seconds)| {
                    format!("{:>width$.1}", 1e3 * seconds, width = stage.len())
                });
                let stages: Vec<String> = stages.collect();
                println!(
                    "{name:>8} {condition:>20} {threads:>7} {rate:>8.2}  {}",
                    stages.join(" ")
                );
            }
        }
    }
}

/// Scans per second by the fastest of `scans`, and its seconds in each stage.
fn best(design: &Design, scene: &Scene, scans: u64) -> (f64, [f64; Tally::STAGES.len()]) {
    let watch = Watch { done: &|_| {}, stop: &|| false };
    let mut stream = Scans::new(design, scene, SEED).unwrap();
    let mut best = (0.0, [0.0; Tally::STAGES.len()]);
    let all = Instant::now();
    for number in 1..=scans {
        let began = Instant::now();
        let tally = stream.scan(number, &watch).unwrap().unwrap().tally;
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
