//! Samples as a linear detector makes them, for tests: Gaussian pulses of counted and multiplied photons
//! and white noise through three poles, rounded to codes.
#![allow(clippy::unwrap_used)]

use macropulse_codec::code::{Codebook, Family, Keying, Separated};
use macropulse_codec::decode::{Method, Receiver, STEPS_OF_TICK, Sampled, Sampling};
use macropulse_codec::{Samples, ShotLog};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Gamma, Poisson, StandardNormal};

/// 0.4 ns.
pub const TICK_FS: i64 = 400_000;

/// From one shot to the next, ticks: 472 ns.
pub const PERIOD: i64 = 1180;

/// Detected photons of a mark from a target of 10 % at 149 m.
pub const FAINT: f64 = 311.0;

/// Standard deviation of the noise behind the matched filter, in photons.
pub const SIGMA: f64 = 36.0;

/// Excess noise factor.
pub const EXCESS: f64 = 5.56;

/// The highest code.
pub const FULL_SCALE: i16 = 1843;

/// Steps of a tick in which the signal is made.
const STEPS: usize = 8;

/// Length of the light of a mark, standard deviation, and time constant of each pole, in such steps:
/// 0.8 ns wide at half maximum, and 550 MHz.
const LENGTH: f64 = 6.8;
const POLE: f64 = 2.95;

/// Ten words of three marks.
pub fn codebook() -> Codebook {
    let words =
        Separated { length: 238, weight: 3, words: 10, gap: 20, apart: 5, later: 0, seed: 1 };
    Codebook::new(Family::separated(words).unwrap(), None, 1, Keying::OnOff).unwrap()
}

/// Light that comes back: its shot, its delay in ticks, and its photons per mark.
#[derive(Debug, Clone, Copy)]
pub struct Echo {
    pub shot: usize,
    pub ticks: f64,
    pub photons: f64,
}

/// One channel, its shots, and its light.
pub struct Channel {
    pub log: ShotLog,
    pub echoes: Vec<Echo>,
    /// Samples from time 0 on.
    pub samples: usize,
    /// Standard deviation of the noise, in photons behind the filter.
    pub sigma: f64,
    pub seed: u64,
}

/// The signal through three poles.
struct Poles([f64; 3]);

impl Poles {
    fn next(&mut self, signal: f64) -> f64 {
        let share = 1.0 - (-1.0 / POLE).exp();
        let mut through = signal;
        for pole in &mut self.0 {
            *pole += share * (through - *pole);
            through = *pole;
        }
        through
    }
}

/// Returns the response to a mark of one photon, step by step, and the index of its highest step.
fn pulse() -> (Vec<f64>, usize) {
    let light = |at: usize| (-((at as f64 - 60.0) / LENGTH).powi(2) / 2.0).exp();
    let all: f64 = (0..121).map(light).sum();
    let mut poles = Poles([0.0; 3]);
    let pulse: Vec<f64> =
        (0..241).map(|at| poles.next(if at <= 120 { light(at) / all } else { 0.0 })).collect();
    let highest = (0..241).fold(0, |most, at| if pulse[at] > pulse[most] { at } else { most });
    (pulse, highest)
}

/// Codes per photon, for a noise of 2.5 codes.
fn codes_per_photon() -> f64 {
    // For white noise of deviation 1 a step.
    let (raw, filtered) = deviations();
    // LSB = raw/2.5; `filtered` photons make a signal of their own.
    2.5 / raw * filtered / SIGMA
}

/// Standard deviations of white noise of 1 a step behind the poles, and behind the matched filter too, in
/// photons.
fn deviations() -> (f64, f64) {
    let (pulse, highest) = pulse();
    let mut poles = Poles([0.0; 3]);
    let answer: Vec<f64> = (0..400).map(|at| poles.next(if at == 0 { 1.0 } else { 0.0 })).collect();
    let ticks: Vec<f64> =
        (-3..=3_i64).map(|tick| pulse[(highest as i64 + tick * STEPS as i64) as usize]).collect();
    let energy: f64 = ticks.iter().map(|value| value * value).sum();
    let filtered = |at: usize| -> f64 {
        let taps = ticks.iter().enumerate();
        taps.map(|(tap, value)| {
            value / energy * answer.get(at.wrapping_sub(tap * STEPS)).unwrap_or(&0.0)
        })
        .sum()
    };
    let raw: f64 = answer.iter().map(|value| value * value).sum();
    let behind: f64 = (0..500).map(|at| filtered(at).powi(2)).sum();
    (raw.sqrt(), behind.sqrt())
}

/// The signal as the receiver knows it.
pub fn sampling() -> Sampling {
    let (pulse, highest) = pulse();
    let scale = codes_per_photon();
    let steps = (STEPS_OF_TICK / STEPS) as f64;
    let reach = 10 * STEPS_OF_TICK as i64;
    let at = |step: i64| {
        let place = highest as f64 + step as f64 / steps;
        let before = place.floor().max(0.0) as usize;
        let share = place - before as f64;
        let value =
            |at: usize| if place < 0.0 { 0.0 } else { pulse.get(at).copied().unwrap_or(0.0) };
        (((1.0 - share) * value(before) + share * value(before + 1)) * scale) as f32
    };
    Sampling {
        pulse: (-reach..=reach).map(at).collect(),
        excess: EXCESS,
        full_scale: FULL_SCALE,
        blank_ticks: 0,
        held_ticks: 0,
        recovery_ticks: 25,
        least_marks: 2,
        coupling: None,
    }
}

/// A gate of 150 m, and light up to 300 m.
pub fn receiver() -> Receiver {
    receiver_of(sampling())
}

/// The same that knows this of the signal.
pub fn receiver_of(sampling: Sampling) -> Receiver {
    let (ticks_per_chip, light_ticks, false_alarm) = (1, 5003, 2.5e-6);
    let method = Method::Sampled(Sampled { ticks_per_chip, light_ticks, false_alarm, sampling });
    Receiver { gate_ticks: (8, 2502), method, ..Receiver::matched(TICK_FS) }
}

/// Returns the log of `shots` shots, one behind the other.
pub fn log(shots: usize) -> ShotLog {
    let fired: Vec<i64> = (0..shots as i64).map(|shot| shot * PERIOD * TICK_FS).collect();
    let words: Vec<u16> = (0..shots).map(|shot| (shot % 10) as u16).collect();
    ShotLog::of_one_channel(&fired, &words)
}

impl Channel {
    /// Shots one behind the other, each with one echo.
    pub fn of(echoes: &[(f64, f64)], seed: u64) -> Self {
        let log = log(echoes.len());
        let echoes = (0..).zip(echoes).map(|(shot, (ticks, photons))| Echo {
            shot,
            ticks: *ticks,
            photons: *photons,
        });
        let samples = log.len() * PERIOD as usize + 5300;
        Self { log, echoes: echoes.collect(), samples, sigma: SIGMA, seed }
    }

    /// The codes of its samples.
    pub fn codes(&self) -> Vec<i16> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let (highest, scale) = (pulse().1, codes_per_photon());
        // The light is made as much earlier as the poles delay it.
        let delay = (highest - 60) as f64;
        let mut light = vec![0.0_f64; self.samples * STEPS];
        let book = codebook();
        for echo in &self.echoes {
            let fired = self.log.fired_at_fs[echo.shot] as f64 / TICK_FS as f64;
            for mark in book.marks(0, self.log.word[echo.shot]) {
                let middle = (fired + f64::from(*mark) + echo.ticks) * STEPS as f64 - delay;
                for at in (middle - 8.0 * LENGTH).ceil() as i64..=(middle + 8.0 * LENGTH) as i64 {
                    let Some(light) = usize::try_from(at).ok().and_then(|at| light.get_mut(at))
                    else {
                        continue;
                    };
                    let apart = (at as f64 - middle) / LENGTH;
                    *light += echo.photons * (-apart * apart / 2.0).exp()
                        / (LENGTH * std::f64::consts::TAU.sqrt());
                }
            }
        }
        let noise = self.sigma / deviations().1;
        let mut poles = Poles([0.0; 3]);
        let mut codes = Vec::with_capacity(self.samples);
        for (at, mean) in light.iter().enumerate() {
            let mut signal = 0.0;
            if *mean > 1e-9 {
                let photons: f64 = Poisson::new(*mean).unwrap().sample(&mut rng);
                if photons > 0.0 {
                    signal = Gamma::new(photons / (EXCESS - 1.0), EXCESS - 1.0)
                        .unwrap()
                        .sample(&mut rng);
                }
            }
            let white: f64 = StandardNormal.sample(&mut rng);
            let through = poles.next(signal + noise * white);
            if at % STEPS == 0 {
                codes.push((through * scale).round().clamp(-200.0, FULL_SCALE.into()) as i16);
            }
        }
        codes
    }

    /// Its samples, as those of channel 0.
    pub fn samples(&self) -> Samples {
        Samples { epoch: 0, channel: vec![0], code: self.codes() }
    }
}
