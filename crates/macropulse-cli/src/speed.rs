//! `macropulse speed`: how fast this machine simulates, measured on the code that simulates.

use std::time::{Duration, Instant};

use clap::Args;
use macropulse::design::Design;
use macropulse::emit::{Band, bands};
use macropulse::scene::Scene;
use macropulse::sim::{self, Scans, Tally, Watch};
use macropulse_study::paper::PERFECT;
use serde_json::json;

use crate::fault::Fault;
use crate::options::{Common, Surroundings};
use crate::text::{Columns, print, short};

/// Measure how fast this machine simulates the sensor of the paper
///
/// Takes about half a minute. Stages are measured on one thread, as multiples of the time the
/// sensor itself takes for a scan; scans per second on all threads.
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

/// Scans per second are measured for so long, and over two scans at least.
const LONG_ENOUGH: Duration = Duration::from_secs(4);

/// Of a noisy scan one band in this many is measured.
const SAMPLE: usize = 10;

/// What was measured.
struct Figures {
    rays_per_s: f64,
    generate: f64,
    decode: f64,
    decode_noisy: f64,
    clean_scans_per_s: f64,
    full_scans_per_s: f64,
    threads: usize,
}

pub fn run(options: &Speed, common: &Common) -> Result<(), Fault> {
    let figures = measure(&options.surroundings)?;
    if options.json {
        return print(&format!("{:#}\n", figures.json()));
    }
    if common.quiet { Ok(()) } else { print(&figures.text()) }
}

fn measure(surroundings: &Surroundings) -> Result<Figures, Fault> {
    let sensor = |set: &[(&str, &str)]| {
        let set: Vec<(String, String)> =
            set.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
        Design::open("kim-park-2016", &set)
    };
    let (full, clean) = (sensor(&[])?, sensor(PERFECT)?);
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
        one.install(|| Stages::of(design, scene, every))
    };
    // The first scan finds cold memory.
    on_one_thread(&clean, &street, SAMPLE)?;
    let clear = on_one_thread(&clean, &street, 1)?;
    let noisy = on_one_thread(&noisy, &street, SAMPLE)?;
    let rays = on_one_thread(&clean, &car, 1)?;
    Ok(Figures {
        rays_per_s: 1.0 / (rays.per_shot(&["scene"])),
        generate: clear.times_real_time(&["emit", "channel", "detect", "tdc"]),
        decode: clear.times_real_time(&["decode"]),
        decode_noisy: noisy.times_real_time(&["decode"]),
        clean_scans_per_s: scans_per_s(&clean, &car)?,
        full_scans_per_s: scans_per_s(&full, &car)?,
        threads: rayon::current_num_threads(),
    })
}

/// The stages of a scan and how long they took.
struct Stages {
    tally: Tally,
    /// Seconds that the sensor takes for one shot.
    period: f64,
}

impl Stages {
    /// One band in `every` of a scan of `design` in `scene`.
    fn of(design: &Design, scene: &Scene, every: usize) -> Result<Self, Fault> {
        let part: Vec<Band> = bands(design, 0).step_by(every).collect();
        let tally = sim::scan_part(design, scene, SEED, &part)?.tally;
        Ok(Self { tally, period: design.scan_period() / design.shots_per_scan() as f64 })
    }

    /// Seconds that the `stages` took for one shot.
    fn per_shot(&self, stages: &[&str]) -> f64 {
        let taken = Tally::STAGES.iter().zip(self.tally.seconds);
        let wanted = taken.filter(|(stage, _)| stages.contains(stage));
        wanted.map(|(_, seconds)| seconds).sum::<f64>() / self.tally.shots as f64
    }

    /// The time of the `stages` as a multiple of the sensor's.
    fn times_real_time(&self, stages: &[&str]) -> f64 {
        self.per_shot(stages) / self.period
    }
}

/// Whole scans per second on all threads.
fn scans_per_s(design: &Design, scene: &Scene) -> Result<f64, Fault> {
    let mut scans = Scans::new(design, scene, SEED)?;
    let unwatched = Watch { done: &|_| {}, stop: &|| false };
    let began = Instant::now();
    let mut done = 0;
    while done < 2 || began.elapsed() < LONG_ENOUGH {
        scans.scan(done, &unwatched)?;
        done += 1;
    }
    Ok(done as f64 / began.elapsed().as_secs_f64())
}

impl Figures {
    fn json(&self) -> serde_json::Value {
        json!({
            "rays_per_s": self.rays_per_s,
            "generate_x_real_time": self.generate,
            "decode_x_real_time": self.decode,
            "decode_noisy_x_real_time": self.decode_noisy,
            "clean_scans_per_s": self.clean_scans_per_s,
            "full_scans_per_s": self.full_scans_per_s,
            "threads": self.threads,
        })
    }

    fn text(&self) -> String {
        let two = |figure: f64| {
            let digits = 10_f64.powf(figure.abs().max(1e-9).log10().floor() - 2.0);
            short((figure / digits).round() * digits)
        };
        let multiple = |figure| format!("{} x real time, one thread", two(figure));
        let mut columns = Columns::default();
        columns.push(
            "rays",
            format!("{} million/s, one thread (car-50m)", two(self.rays_per_s / 1e6)),
        );
        columns.push("generate", format!("{} (street, clean)", multiple(self.generate)));
        columns.push("decode", format!("{} (street, clean)", multiple(self.decode)));
        let noise = "street, 20 % missed, 1e9 dark counts/s";
        columns.push("", format!("{} ({noise})", multiple(self.decode_noisy)));
        let threads = self.threads;
        let scans = |figure| format!("{} scans/s, threads: {threads} (car-50m, ", two(figure));
        columns.push("whole", format!("{}clean)", scans(self.clean_scans_per_s)));
        columns.push("", format!("{}kim-park-2016 as declared)", scans(self.full_scans_per_s)));
        format!(
            "kim-park-2016 at 60 scans a second, as this machine simulates it\n\n{}",
            columns.text()
        )
    }
}
