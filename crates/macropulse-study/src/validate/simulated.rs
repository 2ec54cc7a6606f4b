//! Published figures that only a simulation has: counts of a detector with a dead time, and how often
//! the beam of one turning head crosses what another looks at.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use macropulse::channel::{Echo, Operating, light_of_echoes};
use macropulse::codec::ShotLog;
use macropulse::design::Design;
use macropulse::detect::{Detectors, Memory};
use macropulse::emit::Clock;
use macropulse::environment::Environment;
use macropulse::random::Chance;
use macropulse::units::{range_from_tof, s_from_fs};

use super::Error;
use super::published::{Figure, Figures, Within};

/// Everything of this file.
///
/// # Errors
/// None of its sensors is refused, unless the program is broken.
pub(super) fn simulated() -> Result<Vec<Figure>, Error> {
    let mut all = dead_times()?;
    all.extend(turning_heads()?);
    Ok(all)
}

/// Photons of a pulse, counts published without noise and with it, and three standard deviations of each sum.
/// The published counts are single runs. Their deviations come from thirty runs that were drawn apart in
/// NumPy.
const COUNTED: [(f64, [f64; 2], [f64; 2]); 6] = [
    (0.05, [2131.0, 4718.0], [123.0, 140.0]),
    (0.2, [5763.0, 7272.0], [123.0, 172.0]),
    (0.5, [9040.0, 9883.0], [97.0, 116.0]),
    (1.0, [11_222.0, 11_707.0], [79.0, 117.0]),
    (2.0, [12_685.0, 12_962.0], [61.0, 61.0]),
    (4.0, [13_294.0, 13_520.0], [19.0, 45.0]),
];

/// How long a run lasts, s.
const LASTS: f64 = 200e-6;

/// How often every run is repeated here.
const RUNS: u64 = 8;

/// A cell that is blind for 1.2 µs after each count, under pulses at 0.05 to 5 MHz in steps of 50 kHz:
/// the counts of all hundred rates together.
fn dead_times() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("detectors", "a published Monte Carlo");
    for (at, noise_khz) in [0_u32, 200].into_iter().enumerate() {
        let counters: Vec<Counter> =
            (1..=100).map(|step| Counter::new(step, noise_khz)).collect::<Result<_, Error>>()?;
        for (photons, published, within) in COUNTED {
            let counts = counters
                .iter()
                .map(|counter| counter.counts(photons))
                .sum::<Result<f64, Error>>()?;
            let noise = if noise_khz > 0 { ", 200 kHz of noise" } else { "" };
            let what =
                format!("counts with 1.2 \u{b5}s of dead time, {photons} photons a pulse{noise}");
            figures.add(what, published[at], counts, Within::Absolute(within[at]));
        }
    }
    Ok(figures.done())
}

/// One cell, and the pulses that it is given.
struct Counter {
    design: Design,
    /// The number of its rate, in steps of 50 kHz.
    step: u32,
    log: ShotLog,
}

impl Counter {
    fn new(step: u32, noise_khz: u32) -> Result<Self, Error> {
        let pulses = 10 * step;
        let period_fs = 20_000_000_000 / i64::from(step);
        // It listens until the next pulse at least.
        let range = range_from_tof(s_from_fs(period_fs)) * 1.001;
        let text = format!(
            "version = 1\nname = \"counter\"\nidealised = [\"footprint\", \"link-budget\", \
             \"eye-safety\", \"detector-bandwidth\", \"inter-chip\", \"mirror-motion\"]\n\
             scan.scans_per_s = {rate}\nscan.max_range_m = {range}\n\
             scan.raster = {{ rows = 1, columns = {pulses}, horizontal_deg = 10.0, vertical_deg = 1.0 }}\n\
             light = {{ wavelength_nm = 905.0, pulse_ps = 100.0 }}\n\
             [detector.geiger]\n\
             sensitivity = {{ range_m = 10.0, reflectance = 1.0, pd = 0.5 }}\n\
             cells = 1\ndead_time_ns = 1200.0\ndark_counts_hz = {noise}\n\
             [tdc]\nconverters = 64\nresolution_ps = 100.0\n[receiver]\nkind = \"direct\"\n",
            rate = 1.0 / LASTS,
            noise = f64::from(noise_khz) * 1e3,
        );
        let design = Design::from_toml(&text, "counter", Path::new(""), &[])?;
        let shots = pulses as usize;
        let log = ShotLog {
            fired_at_fs: (0..i64::from(pulses)).map(|pulse| pulse * period_fs).collect(),
            row: vec![0; shots],
            column: (0..pulses as u16).collect(),
            label: vec![0; shots],
            word: vec![0; shots],
            channel: vec![0; shots],
            owned: 0..shots,
            first: 0,
        };
        Ok(Self { design, step, log })
    }

    /// The counts of a run, as the mean of [`RUNS`] runs.
    fn counts(&self, photons: f64) -> Result<f64, Error> {
        // Soon after it is fired a pulse is back.
        let echo = |shot| Echo { shot, delay_fs: 1_000_000, photons };
        let light = light_of_echoes(&self.design, &self.log, (0..self.log.len()).map(echo));
        let operating = Operating::of(&self.design, &Environment::vacuum_dark())?;
        let counted: usize = (0..RUNS)
            .map(|run| {
                let chance = Chance::new(u64::from(self.step) * RUNS + run);
                let detectors = Detectors::new(&self.design, &operating, chance);
                detectors.detections(&self.log, &light, &mut Memory::default()).time.len()
            })
            .sum();
        Ok(counted as f64 / RUNS as f64)
    }
}

/// Two heads in one plane: the beam of one crosses what a detector of the other looks at where the two
/// half-lines meet.
fn turning_heads() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("interference", "computed apart");
    let head =
        |rate: &str| Design::open("vlp-16", &[("scan.scans_per_s".to_owned(), rate.to_owned())]);
    let (ours, slower) = (head("10.0")?, head("9.7")?);
    let within = Within::Absolute(0.01);
    let apart = crossed(&ours, &slower, Clock::default());
    figures.add(
        "share of time in which two turning heads, 10 and 9.7 Hz, cross",
        0.25,
        apart,
        within,
    );
    // At the same rate it depends on by how much of a turn one is ahead: (π − δ)/2π.
    for (turn, published) in [(0.05, 0.45), (0.25, 0.25), (0.45, 0.05)] {
        let behind = Clock { phase_fs: (turn * 1e14) as i64, drift: 0 };
        let what = format!("the same at 10 Hz, one {turn} turns behind");
        figures.add(what, published, crossed(&ours, &ours, behind), within);
    }
    Ok(figures.done())
}

/// Share of the shots of `ours` in 3.33 s at which the beam of `other` crosses the half-line that our beam is
/// on. `other` stands east of `ours` and has a `clock` of its own.
fn crossed(ours: &Design, other: &Design, clock: Clock) -> f64 {
    // In this time 10 Hz gain a turn on 9.7 Hz.
    const SPAN_FS: i64 = 3_333_333_333_333_333;
    let azimuths = |design: &Design, clock: Clock| {
        let mut list: Vec<(i64, f64)> = Vec::new();
        for log in clock.shots(design, 0..SPAN_FS) {
            for shot in log.owned.clone() {
                let [x, y, _] = design.directions().of_shot(&log, shot);
                list.push((log.fired_at_fs[shot], y.atan2(x).rem_euclid(TAU)));
            }
        }
        list
    };
    let theirs = azimuths(other, clock);
    let mut latest = theirs.iter().peekable();
    let (mut crossing, mut all) = (0, 0);
    let mut beam = None;
    for (time, a) in azimuths(ours, Clock::default()) {
        while let Some((_, azimuth)) = latest.next_if(|(fired, _)| *fired <= time) {
            beam = Some(*azimuth);
        }
        let Some(b) = beam else { continue };
        all += 1;
        // Both above the line between them, or both below it, and leaning towards each other.
        crossing += u32::from(if a < PI { a < b && b < PI } else { b > PI && b < a });
    }
    f64::from(crossing) / f64::from(all.max(1))
}
