//! Eqs. 1, 3 and 4 of the paper, tried out on signals and words.

use std::f64::consts::PI;

use macropulse::codec::code::correlation::{aperiodic, periodic};
use macropulse::design::Design;
use macropulse::predict::ranging::{amplitude_modulated, frequency_modulated};
use macropulse::units::{range_from_tof, tof_from_range};

/// A target, m.
const RANGE: f64 = 42.0;

/// Modulation of a continuous wave, Hz: it comes round once in 75 m.
const MODULATION: f64 = 2e6;

/// Period of a frequency sweep, s, and its excursion, Hz.
const SWEEP: (f64, f64) = (2e-3, 1.5e9);

/// Results of the equations.
#[derive(Debug, Clone)]
pub struct Equations {
    /// The range of the target.
    pub range: f64,
    /// Range by Eq. 1 from the phase of a wave of modulated amplitude, mixed down from samples.
    pub amplitude: f64,
    /// Range at which that phase comes round.
    pub phase_wraps: f64,
    /// Range by Eq. 1 from a triangular sweep if B is the beat, T the period, Δf the excursion.
    pub frequency: f64,
    /// The same with Δf the difference between what is sent and received, as printed.
    pub frequency_printed: f64,
    /// The autocorrelation peak of Eq. 3 where words vanish for n < 0 and n ≤ N, as printed.
    pub peak_printed: u32,
    /// The same where they vanish for n < 0 and n ≥ N.
    pub peak: u32,
    /// Pairs of words and lags tried in Eq. 4.
    pub tried: u64,
    /// Number of those that do not fulfil Θ(l) = C(l) + C(l − N).
    pub wrong_with_minus: u64,
    /// Number of those that do not fulfil Θ(l) = C(l) + C(l + N).
    pub wrong_with_plus: u64,
}

impl Equations {
    pub(super) fn of(design: &Design) -> Self {
        let words = design.emission.coding().codebook.family().words();
        let (mut tried, mut wrong_with_minus, mut wrong_with_plus) = (0, 0, 0);
        for (a, b) in words.iter().flat_map(|a| words.iter().map(move |b| (a, b))) {
            let once = aperiodic(a, b);
            let length = a.length as i32;
            for (lag, round) in (0..length).zip(periodic(a, b)) {
                let sum = |other: i32| once.at(lag) + once.at(lag + other);
                tried += 1;
                wrong_with_minus += u64::from(sum(-length) != round);
                wrong_with_plus += u64::from(sum(length) != round);
            }
        }
        let word = &words[1];
        let kept = |is_left: &dyn Fn(u32) -> bool| {
            word.marks.iter().filter(|&&mark| is_left(u32::from(mark))).count() as u32
        };
        let flight = tof_from_range(RANGE);
        let (period, excursion) = SWEEP;
        // Halfway up, the sweep has moved on by this much while the light was away.
        let sent = |time: f64| excursion * time / (period / 2.0);
        let beat = sent(period / 4.0) - sent(period / 4.0 - flight);
        Self {
            range: RANGE,
            amplitude: amplitude_modulated(phase(flight), MODULATION),
            phase_wraps: range_from_tof(MODULATION.recip()),
            frequency: frequency_modulated(beat, period, excursion),
            frequency_printed: frequency_modulated(beat, period, beat),
            peak_printed: kept(&|mark| mark > word.length),
            peak: kept(&|mark| mark < word.length),
            tried,
            wrong_with_minus,
            wrong_with_plus,
        }
    }
}

/// Phase of a wave that comes `flight` seconds late, from samples over one period.
fn phase(flight: f64) -> f64 {
    const SAMPLES: u32 = 64;
    let (mut in_phase, mut quadrature) = (0.0, 0.0);
    for sample in 0..SAMPLES {
        let turn = 2.0 * PI * f64::from(sample) / f64::from(SAMPLES);
        let received = 1.0 + 0.5 * libm::cos(turn - 2.0 * PI * MODULATION * flight);
        in_phase += received * libm::cos(turn);
        quadrature += received * libm::sin(turn);
    }
    libm::atan2(quadrature, in_phase).rem_euclid(2.0 * PI)
}
