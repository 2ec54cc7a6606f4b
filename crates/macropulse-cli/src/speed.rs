//! `macropulse speed`: how fast this machine simulates, measured on the code that simulates.

use std::time::{Duration, Instant};

use clap::Args;
use macropulse::design::Design;
use macropulse::emit::{Band, bands};
use macropulse::scene::Scene;
use macropulse::sim::{Scans, Tally, Watch};
use macropulse_study::paper::PERFECT;
use serde_json::json;

use crate::fault::Fault;
use crate::options::{Common, Surroundings};
use crate::text::{Columns, print, print_json, short};

/// Measure how fast this machine simulates the sensor of the paper
///
/// Takes about half a minute. Speed is the time that the sensor takes over that of the program:
/// above 1 is faster than the sensor. Stages are measured in processor time of one thread, whole
/// scans on all threads.
#[derive(Args)]
#[command(after_help = "Example:
  macropulse speed --json")]
pub struct Speed {
    #[command(flatten)]
    surroundings: Surroundings,

    /// Print as JSON
    #[arg(long)]
    json: bool,
}

/// The seed of all measurements.
const SEED: u64 = 1;

/// How thoroughly to measure.
struct Effort {
    /// Interval of the bands that are measured in a clean scan.
    clean: usize,
    /// The same in a noisy scan.
    noisy: usize,
    /// Least time for which each measurement is repeated.
    time: Duration,
    /// Least number of its rounds.
    rounds: u64,
}

const USUAL: Effort = Effort { clean: 1, noisy: 10, time: Duration::from_millis(4_500), rounds: 2 };

/// Measured speeds.
struct Figures {
    rays_per_s: f64,
    generate: f64,
    decode: f64,
    decode_noisy: f64,
    decode_declared: f64,
    clean_scans_per_s: f64,
    full_scans_per_s: f64,
    threads: usize,
}

pub fn run(options: &Speed, common: &Common) -> Result<(), Fault> {
    let figures = measure(&options.surroundings, &USUAL)?;
    if options.json {
        return print_json(vec![figures.json()]);
    }
    if common.quiet { Ok(()) } else { print(&figures.text()) }
}

fn measure(surroundings: &Surroundings, effort: &Effort) -> Result<Figures, Fault> {
    let sensor = |set: &[(&str, &str)]| {
        let set: Vec<(String, String)> =
            set.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
        Design::open("kim-park-2016", &set)
    };
    let (declared, clean) = (sensor(&[])?, sensor(PERFECT)?);
    let noise = [
        ("detector.photon-counting.missed_marks", "0.2"),
        ("detector.photon-counting.dark_counts_hz", "1e9"),
    ];
    let noisy = sensor(&[PERFECT, &noise].concat())?;
    let changes = surroundings.changes();
    let [street, car] = ["street", "car-50m"].map(|name| Scene::open_changed(name, &changes));
    let (street, car) = (street?, car?);
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .map_err(|error| Fault::Ours(format!("cannot start a thread: {error}")))?;
    let on_one_thread = |design: &Design, scene: &Scene, every: usize| {
        one.install(|| Stages::of(design, scene, every, effort))
    };
    let rays = on_one_thread(&clean, &car, effort.clean)?;
    let clear = on_one_thread(&clean, &street, effort.clean)?;
    let noisy = on_one_thread(&noisy, &street, effort.noisy)?;
    let full = on_one_thread(&declared, &street, effort.noisy)?;
    Ok(Figures {
        rays_per_s: 1.0 / rays.seconds(&["scene"]),
        generate: clean.speed(1.0, clear.seconds(&["emit", "channel", "detect", "tdc"])),
        decode: clean.speed(1.0, clear.seconds(&["decode"])),
        decode_noisy: clean.speed(1.0, noisy.seconds(&["decode"])),
        decode_declared: declared.speed(1.0, full.seconds(&["decode"])),
        clean_scans_per_s: scans_per_s(&clean, &car, effort)?,
        full_scans_per_s: scans_per_s(&declared, &car, effort)?,
        threads: rayon::current_num_threads(),
    })
}

/// Seconds of one thread that the stages of a scan took for each shot: the least of several
/// rounds, since whatever else the machine does can only add to them.
struct Stages([f64; Tally::STAGES.len()]);

impl Stages {
    /// One band in `every` of a scan of `design` in `scene`.
    fn of(design: &Design, scene: &Scene, every: usize, effort: &Effort) -> Result<Self, Fault> {
        let part: Vec<Band> = bands(design, 0).step_by(every).collect();
        let mut scans = Scans::new(design, scene, SEED)?;
        let mut least = [f64::INFINITY; Tally::STAGES.len()];
        repeat(effort, |_| {
            let scan = scans.part(&part, &UNWATCHED)?;
            let Some(Tally { seconds, shots, .. }) = scan.map(|scan| &scan.tally) else {
                return Ok(());
            };
            for (least, seconds) in least.iter_mut().zip(seconds) {
                *least = least.min(seconds / *shots as f64);
            }
            Ok(())
        })?;
        Ok(Self(least))
    }

    /// Those of the `stages` together.
    fn seconds(&self, stages: &[&str]) -> f64 {
        let taken = Tally::STAGES.iter().zip(self.0);
        taken.filter(|(stage, _)| stages.contains(stage)).map(|(_, seconds)| seconds).sum()
    }
}

/// Whole scans per second on all threads.
fn scans_per_s(design: &Design, scene: &Scene, effort: &Effort) -> Result<f64, Fault> {
    let mut scans = Scans::new(design, scene, SEED)?;
    let began = Instant::now();
    let done = repeat(effort, |number| scans.scan(number, &UNWATCHED).map(drop))?;
    Ok(done as f64 / began.elapsed().as_secs_f64())
}

const UNWATCHED: Watch<'static> = Watch { done: &|_| {}, stop: &|| false };

/// Does something as often as the effort asks for, and says how often.
fn repeat(
    effort: &Effort,
    mut run: impl FnMut(u64) -> Result<(), macropulse::sim::Error>,
) -> Result<u64, macropulse::sim::Error> {
    let began = Instant::now();
    let mut done = 0;
    while done < effort.rounds || began.elapsed() < effort.time {
        run(done)?;
        done += 1;
    }
    Ok(done)
}

impl Figures {
    fn json(&self) -> serde_json::Value {
        json!({
            "rays_per_s": self.rays_per_s,
            "generate_speed": self.generate,
            "decode_speed": self.decode,
            "decode_noisy_speed": self.decode_noisy,
            "decode_declared_speed": self.decode_declared,
            "clean_scans_per_s": self.clean_scans_per_s,
            "full_scans_per_s": self.full_scans_per_s,
            "threads": self.threads,
        })
    }

    fn text(&self) -> String {
        let three = |figure: f64| {
            let digits = 10_f64.powf(figure.abs().max(1e-9).log10().floor() - 2.0);
            short((figure / digits).round() * digits)
        };
        let mut columns = Columns::default();
        let rays = three(self.rays_per_s / 1e6);
        columns.push("rays", format!("{rays} million/s, one thread (car-50m)"));
        let mut speed = |stage, figure, of| {
            columns.push(stage, format!("speed {}, one thread (street, {of})", three(figure)));
        };
        speed("generate", self.generate, "clean");
        speed("decode", self.decode, "clean");
        speed("", self.decode_noisy, "20 % missed, 1e9 dark counts/s");
        speed("", self.decode_declared, "as declared");
        let mut scans = |stage, figure, of| {
            let (figure, threads) = (three(figure), self.threads);
            columns.push(stage, format!("{figure} scans/s, threads: {threads} (car-50m, {of})"));
        };
        scans("whole", self.clean_scans_per_s, "clean");
        scans("", self.full_scans_per_s, "as declared");
        format!(
            "kim-park-2016 at 60 scans a second, as this machine simulates it\n\n{}\n\
             Speed is the time that the sensor takes over that of the program: above 1 is faster \
             than the sensor.\n",
            columns.text()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_figure_is_measured_and_printed() {
        // One band of a scan, and one whole scan.
        let least = Effort { clean: 1000, noisy: 1000, time: Duration::ZERO, rounds: 1 };
        let figures = measure(&Surroundings::default(), &least).unwrap().json();
        let keys: Vec<&str> = figures.as_object().unwrap().keys().map(String::as_str).collect();
        let expected = [
            "rays_per_s",
            "generate_speed",
            "decode_speed",
            "decode_noisy_speed",
            "decode_declared_speed",
            "clean_scans_per_s",
            "full_scans_per_s",
            "threads",
        ];
        assert_eq!(keys, expected);
        for key in keys {
            let figure = figures[key].as_f64().unwrap();
            assert!(figure.is_finite() && figure > 0.0, "{key}: {figure}");
        }
    }

    #[test]
    fn figures_have_three_digits_and_say_what_they_are_of() {
        let figures = Figures {
            rays_per_s: 61_234_567.0,
            generate: 0.6249,
            decode: 1.5,
            decode_noisy: 0.009_618,
            decode_declared: 0.04,
            clean_scans_per_s: 61.04,
            full_scans_per_s: 5.0,
            threads: 2,
        };
        let text = figures.text().replace(crate::text::NO_BREAK, " ");
        for line in [
            "rays      61.2 million/s, one thread (car-50m)",
            "generate  speed 0.625, one thread (street, clean)",
            "decode    speed 1.5, one thread (street, clean)",
            "speed 0.00962, one thread (street, 20 % missed, 1e9 dark counts/s)",
            "speed 0.04, one thread (street, as declared)",
            "whole     61 scans/s, threads: 2 (car-50m, clean)",
            "5 scans/s, threads: 2 (car-50m, as declared)",
        ] {
            assert!(text.contains(line), "no {line:?} in\n{text}");
        }
    }

    #[test]
    fn measurements_are_repeated_as_often_as_asked() {
        let thrice = Effort { clean: 1, noisy: 1, time: Duration::ZERO, rounds: 3 };
        let mut seen = Vec::new();
        let see = |number| {
            seen.push(number);
            Ok(())
        };
        assert_eq!(repeat(&thrice, see).ok(), Some(3));
        assert_eq!(seen, [0, 1, 2]);
    }
}
