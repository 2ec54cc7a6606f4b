//! A detector that counts photons chip by chip.
//!
//! 1. Every mark of every echo is seen with probability (1 − m)·(1 − exp(−n)), n the mean photons
//!    detected per mark and m the fraction lost for other reasons (docs/physics.md#photon-counting).
//! 2. A mark that is seen makes one edge at its arrival, displaced by Gaussian jitter.
//! 3. Dark and background counts are Poisson in time.
//!
//! Marks that arrive within one tick make one edge in the end: the converters merge them, which is
//! the hard limiter of the coding literature.

use rand_chacha::rand_core::Rng;
use rand_distr::{Distribution, Poisson, StandardNormal};

use super::Edges;
use crate::channel::Echoes;
use crate::design::{Design, PhotonCounting};
use crate::emit::ShotLog;
use crate::random::{Chance, Stage};
use crate::units::{FS_PER_S, fs_from_s, tof_from_range};

/// False edges are drawn in windows of this length, so that neighbouring bands see the same ones.
const WINDOW_FS: i64 = FS_PER_S / 100_000;

pub(super) fn edges(
    counting: &PhotonCounting,
    design: &Design,
    log: &ShotLog,
    echoes: &Echoes,
    chance: &Chance,
) -> Edges {
    let mut time_fs = Vec::new();
    let chip_fs = design.coding.chip_fs;
    let jitter_fs = counting.jitter * FS_PER_S as f64;
    let mut i = 0;
    while i < echoes.shot.len() {
        let shot = echoes.shot[i] as usize;
        let marks = design.coding.codebook.marks(log.label[shot], log.word[shot]);
        let mut stream = chance.at(Stage::Marks, log.first + shot as u64);
        while i < echoes.shot.len() && echoes.shot[i] as usize == shot {
            let arrival = log.fired_at_fs[shot] + echoes.delay_fs[i];
            let pd = (1.0 - counting.missed_marks) * -libm::expm1(-echoes.photons[i]);
            let places = marks.iter().map(|&chip| arrival + i64::from(chip) * chip_fs);
            let seen = Bernoulli::new(pd);
            match (seen.is_certain(), jitter_fs > 0.0) {
                (true, false) => time_fs.extend(places),
                (_, false) => time_fs.extend(places.filter(|_| seen.draw(&mut stream))),
                (_, true) => {
                    for place in places {
                        if seen.draw(&mut stream) {
                            let normal: f64 = StandardNormal.sample(&mut stream);
                            time_fs.push(place + (normal * jitter_fs).round() as i64);
                        }
                    }
                }
            }
            i += 1;
        }
    }
    if counting.false_rate > 0.0
        && let Some(span) = listening(design, log)
    {
        add_false_edges(&mut time_fs, counting.false_rate, span, chance);
    }
    // Macropulses follow each other with little overlap: nearly sorted runs, which a merging sort
    // joins in almost linear time.
    time_fs.sort();
    Edges { time_fs, ..Edges::default() }
}

/// From the first firing to the last possible echo of a band, fs.
fn listening(design: &Design, log: &ShotLog) -> Option<(i64, i64)> {
    let macropulse = i64::from(design.coding.codebook.chips()) * design.coding.chip_fs;
    let gate = fs_from_s(tof_from_range(design.scan.max_range));
    Some((*log.fired_at_fs.first()?, log.fired_at_fs.last()? + gate + macropulse))
}

fn add_false_edges(time_fs: &mut Vec<i64>, rate: f64, (from, to): (i64, i64), chance: &Chance) {
    let mean = rate * WINDOW_FS as f64 / FS_PER_S as f64;
    let Ok(poisson) = Poisson::new(mean) else { return };
    for window in from.div_euclid(WINDOW_FS)..=to.div_euclid(WINDOW_FS) {
        let mut stream = chance.at(Stage::FalseEdges, window as u64);
        let count = poisson.sample(&mut stream) as u64;
        let start = window * WINDOW_FS;
        for _ in 0..count {
            let time = start + uniform_below(&mut stream, WINDOW_FS);
            if (from..=to).contains(&time) {
                time_fs.push(time);
            }
        }
    }
}

/// A whole number in 0…n−1; the bias is below n/2⁶⁴.
fn uniform_below(stream: &mut impl Rng, n: i64) -> i64 {
    ((u128::from(stream.next_u64()) * n as u128) >> 64) as i64
}

/// A yes/no question of fixed probability, asked with 32 random bits each time.
#[derive(Clone, Copy)]
struct Bernoulli {
    threshold: u64,
}

impl Bernoulli {
    fn new(probability: f64) -> Self {
        Self { threshold: (probability * 4_294_967_296.0).round() as u64 }
    }

    fn is_certain(self) -> bool {
        self.threshold >= 1 << 32
    }

    fn draw(self, stream: &mut impl Rng) -> bool {
        self.is_certain() || u64::from(stream.next_u32()) < self.threshold
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(set: &[(&str, &str)]) -> Design {
        let set: Vec<(String, String)> = set
            .iter()
            .map(|(key, value)| (format!("detector.photon-counting.{key}"), (*value).to_owned()))
            .collect();
        Design::open("kim-park-2016", &set).unwrap()
    }

    fn run(design: &Design, photons: f64, seed: u64) -> Edges {
        let band = crate::emit::bands(design, 0).next().unwrap();
        let log = band.shot_log(design);
        let shots = log.len() as u32;
        let echoes = Echoes {
            shot: (0..shots).collect(),
            delay_fs: vec![200_000_000; shots as usize],
            photons: vec![photons; shots as usize],
        };
        super::super::edges(design, &log, &echoes, &Chance::new(seed))
    }

    fn marks(design: &Design) -> usize {
        let log = crate::emit::bands(design, 0).next().unwrap().shot_log(design);
        (0..log.len()).map(|i| design.coding.codebook.marks(log.label[i], log.word[i]).len()).sum()
    }

    const CLEAN: [(&str, &str); 3] =
        [("sensitivity.pd", "1.0"), ("dark_counts_hz", "0"), ("jitter_ps", "0")];

    #[test]
    fn a_perfect_detector_sees_every_mark_at_its_place() {
        let design = sensor(&CLEAN);
        let edges = run(&design, f64::INFINITY, 1);
        assert_eq!(edges.time_fs.len(), marks(&design));
        // Column 0 is dark; column 1 is 0000000001 011 on word C1, its first mark in bit 9.
        let first = 16_378 * 2500 + 200_000_000 + 9 * 841 * 2500;
        assert_eq!(edges.time_fs[0], first);
    }

    /// H0: marks are seen with 1 − exp(−n). N ≈ 1.5 M marks, seed 11, α = 1e-6 (|z| < 4.9).
    #[test]
    fn the_fraction_seen_follows_the_photons() {
        let design = sensor(&[CLEAN[1], CLEAN[2]]);
        let total = marks(&design) as f64;
        let z = |photons: f64, claimed: f64| {
            let seen = run(&design, photons, 11).time_fs.len() as f64;
            let p: f64 = 1.0 - (-claimed).exp();
            (seen - total * p) / (total * p * (1.0 - p)).sqrt()
        };
        for photons in [0.05, 0.7, 3.0] {
            assert!(z(photons, photons).abs() < 4.9, "n = {photons}: z = {}", z(photons, photons));
            // Negative control: one per cent more light than there is must be noticed.
            assert!(z(photons, photons * 1.01 + 0.01).abs() > 4.9);
        }
    }

    /// H0: false edges are Poisson with the rate given. Mean ≈ 3.4e5, seed 3, α = 1e-6.
    #[test]
    fn false_edges_come_at_their_rate() {
        let design = sensor(&[CLEAN[0], CLEAN[2], ("dark_counts_hz", "1e9")]);
        let log = crate::emit::bands(&design, 0).next().unwrap().shot_log(&design);
        let edges = super::super::edges(&design, &log, &Echoes::default(), &Chance::new(3)).time_fs;
        let (from, to) = listening(&design, &log).unwrap();
        let expected = (to - from) as f64 * 1e-15 * 1e9;
        let z = |mean: f64| (edges.len() as f64 - mean) / mean.sqrt();
        assert!(z(expected).abs() < 4.9, "{} against {expected}", edges.len());
        assert!(z(expected * 1.02).abs() > 4.9);
    }

    #[test]
    fn neighbouring_bands_agree_where_they_overlap() {
        let design = sensor(&[("dark_counts_hz", "1e9")]);
        let logs: Vec<ShotLog> =
            crate::emit::bands(&design, 0).take(2).map(|b| b.shot_log(&design)).collect();
        let times: Vec<Vec<i64>> = logs
            .iter()
            .map(|log| {
                super::super::edges(&design, log, &Echoes::default(), &Chance::new(3)).time_fs
            })
            .collect();
        let (from, to) = (
            logs[1].fired_at_fs[0],
            listening(&design, &logs[0]).unwrap().1.min(logs[1].fired_at_fs[40]),
        );
        let within = |times: &[i64]| -> Vec<i64> {
            times.iter().copied().filter(|t| (from..=to).contains(t)).collect()
        };
        assert!(!within(&times[0]).is_empty());
        assert_eq!(within(&times[0]), within(&times[1]));
    }
}
