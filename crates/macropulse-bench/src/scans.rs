//! Whole scans, from rays to scored points, and the memory of many.

use std::time::Instant;

use macropulse::scene::Scene;
use macropulse::sim::{self, Scans, Tally, Watch};
use rayon::ThreadPoolBuilder;

use crate::Fallible;
use crate::page::{self, three};
use crate::sample::{Condition, SEED};

/// Scans are made for so long, s, and two at least.
const ENOUGH: f64 = 4.0;

/// Scenes that are scanned whole, and their detectors.
const WHOLE: [(&str, Condition); 4] = [
    ("car-50m", Condition::CLEAN),
    ("car-50m", Condition::Declared),
    ("street", Condition::CLEAN),
    ("street", Condition::Declared),
];

const UNWATCHED: Watch<'static> = Watch { done: &|_| {}, stop: &|| false };

/// Scans of one scene with one detector.
struct Measured {
    scene: &'static str,
    condition: Condition,
    /// Scans per second of wall time with one thread and with two.
    per_second: [f64; 2],
    /// Processor time of each stage in a scan, s, with one thread.
    stages: [f64; Tally::STAGES.len()],
}

/// All of them.
pub struct WholeScans(Vec<Measured>);

/// Measures them.
pub fn measure() -> Fallible<WholeScans> {
    let mut all = Vec::new();
    for (scene, condition) in WHOLE {
        let (one, stages) = run(scene, condition, 1)?;
        let (two, _) = run(scene, condition, 2)?;
        all.push(Measured { scene, condition, per_second: [one, two], stages });
    }
    Ok(WholeScans(all))
}

/// Returns the scans per second on `threads` threads, and the seconds of a scan in each stage.
fn run(
    scene: &str,
    condition: Condition,
    threads: usize,
) -> Fallible<(f64, [f64; Tally::STAGES.len()])> {
    let (design, scene) = (condition.design()?, Scene::open(scene)?);
    let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
    let mut scans = Scans::new(&design, &scene, SEED)?;
    let (mut seconds, mut number) = ([0.0; Tally::STAGES.len()], 0);
    let measured = pool.install(|| {
        // The first scan finds cold memory.
        scans.scan(0, &UNWATCHED)?;
        let began = Instant::now();
        while number < 2 || began.elapsed().as_secs_f64() < ENOUGH {
            number += 1;
            let taken = scans.scan(number, &UNWATCHED)?.map_or(seconds, |scan| scan.tally.seconds);
            seconds.iter_mut().zip(taken).for_each(|(sum, more)| *sum += more);
        }
        let scans = number as f64;
        Ok::<_, sim::Error>((scans / began.elapsed().as_secs_f64(), seconds.map(|sum| sum / scans)))
    });
    Ok(measured?)
}

/// Returns the name of a row.
fn name(scene: &str, condition: Condition) -> String {
    let condition = if condition == Condition::Declared { "declared" } else { "clean" };
    format!("`{scene}` {condition}")
}

impl WholeScans {
    /// Scans per second with two threads.
    pub fn on_two_threads(&self, scene: &str, condition: Condition) -> Option<f64> {
        let is_it = |one: &&Measured| one.scene == scene && one.condition == condition;
        self.0.iter().find(is_it).map(|one| one.per_second[1])
    }

    /// The table.
    pub fn text(&self) -> String {
        let head = [&["scene", "one thread", "two threads"][..], &Tally::STAGES].concat();
        let rows = self.0.iter().map(|one| {
            let name = name(one.scene, one.condition);
            let rates = one.per_second.iter().map(|rate| three(*rate));
            let stages = one.stages.iter().map(|seconds| three(1e3 * seconds));
            std::iter::once(name).chain(rates).chain(stages).collect()
        });
        format!(
            "Scans per second of wall time; and of one thread the milliseconds that each stage \
             takes of a scan.\n\n{}",
            page::table(&head, &rows.collect::<Vec<_>>())
        )
    }
}

/// Returns the table of scans per second, with the number of threads doubled from row to row, up to all there
/// are.
pub fn on_threads() -> Fallible<String> {
    const ROUNDS: usize = 2;
    let all = std::thread::available_parallelism()?.get();
    let doubled = std::iter::successors(Some(1), |count| Some(2 * count));
    let counts: Vec<usize> = doubled.take_while(|count| *count <= all).collect();
    let mut rows = Vec::new();
    for (scene, condition) in WHOLE {
        let mut rates = vec![0.0_f64; counts.len()];
        // By turns, so that what else the machine does slows all of them down.
        for _ in 0..ROUNDS {
            for (rate, count) in rates.iter_mut().zip(&counts) {
                *rate = rate.max(run(scene, condition, *count)?.0);
            }
        }
        let rates = rates.iter().map(|rate| three(*rate));
        rows.push(std::iter::once(name(scene, condition)).chain(rates).collect());
    }
    let named =
        |count: &usize| format!("{count} {}", if *count == 1 { "thread" } else { "threads" });
    let head: Vec<String> =
        std::iter::once("scene".to_owned()).chain(counts.iter().map(named)).collect();
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    Ok(format!("Scans per second of wall time.\n\n{}", page::table(&head, &rows)))
}

/// Makes sixty clean scans of the car, for a process whose memory is looked at afterwards.
pub fn sixty() -> Fallible<()> {
    let (design, scene) = (Condition::CLEAN.design()?, Scene::open("car-50m")?);
    let mut scans = Scans::new(&design, &scene, SEED)?;
    for number in 0..60 {
        scans.scan(number, &UNWATCHED)?;
    }
    Ok(())
}
