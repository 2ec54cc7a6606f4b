//! How long the receiver takes for a whole scan of `kim-park-2016`, on one thread, beside the plain
//! ways to find a lag; and how that grows.
//!
//! `cargo bench --bench decode` decodes bands spread over a scan and scales them up to it. A shot
//! is right if its return is as near to one of its surfaces as the sensor file asks for, 1.5 mm.
#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::hint::black_box;

use common::{Met, clock, conditions, detector, spread};
use macropulse::codec::ShotLog;
use macropulse::codec::Ticks;
use macropulse::codec::decode::Returns;
use macropulse::design::Design;
use macropulse::detect::Memory;
use macropulse::emit::Band;
use macropulse::scene::Hits;
use macropulse::units;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

const SCENES: [&str; 3] = ["car-50m", "street", "random"];

/// Bands of a scan that are decoded: one in twenty-four.
const BANDS: usize = 10;

/// Rounds are run until they add up to this, s; the best of them counts. What takes longer is run
/// once.
const ENOUGH: f64 = 0.3;

fn open(keys: &[(String, String)]) -> Design {
    Design::open("kim-park-2016", keys).unwrap()
}

fn met(design: &Design, bands: &[Band], scene: &str) -> Met {
    match scene {
        "random" => Met::anywhere(design, bands),
        _ => Met::in_scene(design, bands, scene).unwrap(),
    }
}

/// What the receiver is given, and what it was made of.
struct Sample<'a> {
    design: &'a Design,
    bands: Vec<(ShotLog, Ticks, &'a Hits)>,
}

impl<'a> Sample<'a> {
    fn new(design: &'a Design, met: &'a Met) -> Self {
        let detectors = common::detectors(design);
        let mut memory = Memory::default();
        let bands = met.bands.iter().map(|band| {
            let (log, ticks) = met.ticks(design, band, (&detectors, &mut memory));
            (log, ticks, &band.1)
        });
        Self { design, bands: bands.collect() }
    }

    fn decode(&self) -> Vec<Returns> {
        let receiver = &self.design.receiver;
        let decode = |(log, ticks, _): &(ShotLog, Ticks, _)| {
            receiver.decode(&self.design.coding.codebook, log, ticks).unwrap()
        };
        self.bands.iter().map(decode).collect()
    }

    fn shots(&self) -> usize {
        self.bands.iter().map(|(log, ..)| log.owned.len()).sum()
    }

    fn ticks(&self) -> usize {
        self.bands.iter().map(|(_, ticks, _)| ticks.tick.len()).sum()
    }

    /// What is `part` of these bands, of a whole scan.
    fn scaled(&self, part: f64) -> f64 {
        part * self.design.shots_per_scan() as f64 / self.shots() as f64
    }

    /// Seconds to decode these bands once, and what comes out.
    fn seconds(&self) -> (f64, Vec<Returns>) {
        let mut returns = vec![];
        let seconds = best_of_several(|| returns = black_box(self.decode()));
        (seconds, returns)
    }

    fn score(&self, returns: &[Returns]) -> Score {
        let mut score = Score::default();
        for ((log, _, hits), returns) in self.bands.iter().zip(returns) {
            score.add(self.design, log, (hits, returns));
        }
        score
    }
}

fn best_of_several(mut run: impl FnMut()) -> f64 {
    let (mut best, mut sum) = (f64::INFINITY, 0.0);
    while sum < ENOUGH {
        let began = clock();
        run();
        let seconds = clock() - began;
        (best, sum) = (seconds.min(best), sum + seconds);
    }
    best
}

/// How the shots came out: those with an echo, those of them found where it came from, and
/// returns that come from no surface.
#[derive(Default)]
struct Score {
    echoes: usize,
    right: usize,
    stray: usize,
}

impl Score {
    fn add(&mut self, design: &Design, log: &ShotLog, (hits, returns): (&Hits, &Returns)) {
        let gate = design.scan.min_range..=design.scan.max_range;
        for shot in log.owned.clone() {
            let own = hits.shot.partition_point(|&other| (other as usize) < shot)
                ..hits.shot.partition_point(|&other| other as usize <= shot);
            let mut ranges = hits.range[own].iter().filter(|range| gate.contains(range)).peekable();
            let marks = design.coding.codebook.marks(log.label[shot], log.word[shot]);
            let has_echo = ranges.peek().is_some() && !marks.is_empty();
            let found = returns.shot.binary_search(&(shot as u32));
            let is_right = found.is_ok_and(|at| {
                let measured = units::range_from_tof(returns.tof[at]);
                ranges.any(|range| (range - measured).abs() <= design.right_within)
            });
            self.echoes += usize::from(has_echo);
            self.right += usize::from(is_right);
            self.stray += usize::from(found.is_ok() && !is_right);
        }
    }

    fn percent(&self) -> f64 {
        100.0 * self.right as f64 / self.echoes as f64
    }
}

/// Every scene with every detector.
fn scenes() {
    println!(
        "\n{:>8} {:>20} {:>9} {:>9} {:>9} {:>6}",
        "scene", "detector", "ms/scan", "real time", "% right", "stray"
    );
    let declared = open(&[]);
    let bands = spread(&declared, BANDS);
    for scene in SCENES {
        let met = met(&declared, &bands, scene);
        for (condition, keys) in conditions() {
            let design = open(&keys);
            let sample = Sample::new(&design, &met);
            let (seconds, returns) = sample.seconds();
            let (seconds, score) = (sample.scaled(seconds), sample.score(&returns));
            println!(
                "{scene:>8} {condition:>20} {:>9.2} {:>9.2} {:>9.3} {:>6}",
                1e3 * seconds,
                seconds / design.scan_period(),
                score.percent(),
                score.stray
            );
        }
    }
}

/// One shot whose lag is sought, and the ticks in which its light may be.
struct Sought<'a> {
    /// The ticks from the beginning of its gate on, counted from there.
    lit: Vec<usize>,
    lags: usize,
    /// Ticks from the start of the macropulse to each mark.
    marks: Vec<usize>,
    /// The lag at which the receiver found it, counted from the beginning of its gate.
    found: usize,
    design: &'a Design,
}

impl<'a> Sought<'a> {
    /// The return number `at` of a band.
    fn new(
        design: &'a Design,
        (log, ticks): (&ShotLog, &Ticks),
        returns: &Returns,
        at: usize,
    ) -> Self {
        let receiver = &design.receiver;
        let shot = returns.shot[at] as usize;
        let (nearest, farthest) = receiver.gate_ticks;
        let fired = log.fired_at_fs[shot].div_euclid(receiver.tick_fs);
        let opens = fired + i64::from(nearest);
        let length = i64::from(design.coding.codebook.chips() * receiver.ticks_per_chip);
        let closes = fired + i64::from(farthest) + length;
        let absolute = ticks.tick.iter().map(|&tick| ticks.epoch + i64::from(tick));
        let lit = absolute.filter(|tick| (opens..closes).contains(tick));
        // A tick is taken for its middle.
        let came = returns.tof[at] * 1e15 + log.fired_at_fs[shot] as f64;
        let came = (came / receiver.tick_fs as f64).floor() as i64;
        let marks = design.coding.codebook.marks(log.label[shot], log.word[shot]);
        let scale = receiver.ticks_per_chip as usize;
        Self {
            lit: lit.map(|tick| (tick - opens) as usize).collect(),
            lags: (farthest - nearest) as usize + 1,
            marks: marks.iter().map(|&mark| scale * usize::from(mark)).collect(),
            found: (came - opens) as usize,
            design,
        }
    }

    /// Sixty-four lags at once: their counts are numbers whose binary digits lie in one machine
    /// word each, and every mark adds one to those lags at which it is lit.
    fn exhaustively(&self) -> usize {
        let end = self.lags + self.marks.last().unwrap_or(&0);
        let mut words = vec![0_u64; end / 64 + 3];
        for &tick in &self.lit {
            words[tick / 64] |= 1 << (tick % 64);
        }
        let (mut best, mut most) = (0, 0);
        for first in (0..self.lags).step_by(64) {
            let mut digits = [0_u64; 10];
            for mark in &self.marks {
                let (word, shift) = ((first + mark) / 64, (first + mark) % 64);
                let mut carry = words[word] >> shift | words[word + 1] << 1 << (63 - shift);
                for digit in &mut digits {
                    (*digit, carry) = (*digit ^ carry, *digit & carry);
                }
            }
            let mut lags = u64::MAX >> 64_usize.saturating_sub(self.lags - first);
            let mut count = 0;
            for digit in digits.iter().rev() {
                let lit = lags & digit;
                count = 2 * count + usize::from(lit != 0);
                lags = if lit == 0 { lags } else { lit };
            }
            if count > most {
                (best, most) = (first + lags.trailing_zeros() as usize, count);
            }
        }
        best
    }

    /// The peak of the correlation: the product of the one spectrum with the other's conjugate,
    /// transformed back.
    fn by_fourier(&self, planner: &mut FftPlanner<f32>) -> usize {
        let points = (self.lags + self.marks.last().unwrap_or(&0)).next_power_of_two();
        let forward = planner.plan_fft_forward(points);
        let back = planner.plan_fft_inverse(points);
        let mut scratch = vec![Complex::default(); forward.get_inplace_scratch_len()];
        let mut spectrum = |lit: &[usize]| {
            let mut values = vec![Complex::<f32>::default(); points];
            lit.iter().filter(|&&at| at < points).for_each(|&at| values[at].re = 1.0);
            forward.process_with_scratch(&mut values, &mut scratch);
            values
        };
        let (mut values, template) = (spectrum(&self.lit), spectrum(&self.marks));
        values.iter_mut().zip(&template).for_each(|(value, other)| *value *= other.conj());
        back.process(&mut values);
        let counts = values[..self.lags].iter().map(|value| value.re).enumerate();
        counts.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(lag, _)| lag)
    }

    /// Seconds for a scan in which every shot takes as long as this one.
    fn whole_scan(&self, rounds: usize, mut search: impl FnMut(&Self) -> usize) -> f64 {
        assert_eq!(search(self), self.found, "another lag than the receiver's");
        let seconds = (0..rounds).map(|_| {
            let began = clock();
            black_box(search(self));
            clock() - began
        });
        seconds.fold(f64::INFINITY, f64::min) * self.design.shots_per_scan() as f64
    }
}

/// The receiver beside the plain ways, on the same ticks.
fn plain_ways() {
    let design = open(&detector(0.0, 0.0));
    let bands = spread(&design, BANDS);
    let met = met(&design, &bands, "street");
    let sample = Sample::new(&design, &met);
    let (receiver, returns) = sample.seconds();
    let receiver = sample.scaled(receiver);
    // One shot from each of a few bands, in their middle.
    let sought: Vec<Sought> = sample
        .bands
        .iter()
        .zip(&returns)
        .filter(|(_, returns)| !returns.is_empty())
        .map(|((log, ticks, _), returns)| {
            Sought::new(&design, (log, ticks), returns, returns.len() / 2)
        })
        .collect();
    let mean = |seconds: Vec<f64>| seconds.iter().sum::<f64>() / seconds.len() as f64;
    let exhaustive = sought.iter().take(6).map(|shot| shot.whole_scan(3, Sought::exhaustively));
    let exhaustive = mean(exhaustive.collect());
    let mut planner = FftPlanner::new();
    let fourier = sought.iter().step_by(3).take(2);
    let fourier = fourier.map(|shot| shot.whole_scan(3, |shot| shot.by_fourier(&mut planner)));
    let fourier = mean(fourier.collect());
    println!("street without noise, one thread; every way finds the same lags");
    println!("{:>34} {:>14} {:>12} {:>12}", "", "ms/scan", "real time", "receiver");
    let ways = [
        ("receiver", receiver),
        ("every lag, 64 in a machine word", exhaustive),
        ("three Fourier transforms per shot", fourier),
    ];
    for (way, seconds) in ways {
        println!(
            "{way:>34} {:>14.2} {:>12.2} {:>12.1}",
            1e3 * seconds,
            seconds / design.scan_period(),
            seconds / receiver
        );
    }
}

/// How the time grows with the range gate and with the number of shots.
fn growth() {
    println!(
        "\n{:>8} {:>8} {:>9} {:>14} {:>9}",
        "scene", "gate", "ms/scan", "ticks/scan", "ns/tick"
    );
    for scene in ["street", "random"] {
        for gate in [37.0, 75.0, 150.0] {
            let mut keys = detector(0.0, 0.0);
            keys.push(("scan.max_range_m".to_owned(), format!("{gate:?}")));
            let design = open(&keys);
            let met = met(&design, &spread(&design, BANDS), scene);
            let sample = Sample::new(&design, &met);
            let (seconds, ticks) = (sample.seconds().0, sample.ticks() as f64);
            println!(
                "{scene:>8} {gate:>6.0} m {:>9.2} {:>14.0} {:>9.2}",
                1e3 * sample.scaled(seconds),
                sample.scaled(ticks),
                1e9 * seconds / ticks
            );
        }
    }
    println!("\n{:>8} {:>9} {:>9} {:>9} {:>9}", "scene", "bands", "shots", "ms", "ns/shot");
    let design = open(&detector(0.0, 0.0));
    for bands in [8, 32, 128] {
        let met = met(&design, &spread(&design, bands), "street");
        let sample = Sample::new(&design, &met);
        let (seconds, shots) = (sample.seconds().0, sample.shots());
        println!(
            "{:>8} {bands:>9} {shots:>9} {:>9.2} {:>9.1}",
            "street",
            1e3 * seconds,
            1e9 * seconds / shots as f64
        );
    }
}

fn main() {
    // `cargo test --benches` only asks whether it runs.
    if !std::env::args().any(|word| word == "--bench") {
        return;
    }
    plain_ways();
    growth();
    scenes();
}
