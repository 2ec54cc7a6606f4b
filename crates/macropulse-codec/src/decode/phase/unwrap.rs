//! The phases of all modulation frequencies become a time of flight.

use std::f64::consts::TAU;

use super::tone::{Phasor, Tone, wrapped};
use crate::time::s_from_fs;

/// The time of flight that explains the phases of a shot best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unwrapped {
    /// Two-way time of flight, s.
    pub tof: f64,
    /// How much worse the next best number of whole periods in the gate explains the phases, in standard
    /// deviations; infinite if the gate has no other.
    pub apart: f64,
}

/// Costs that differ by less are equal: then the nearer one is taken.
const EQUAL: f64 = 1e-6;

/// The time of flight t in the gate of the least Σᵢ (2πfᵢt − φᵢ)²/σᵢ², the angles less whole turns; `None` if the gate
/// has none.
///
/// That is the one of greatest likelihood for phases that are normal. The frequency that tells time most precisely has
/// a candidate in each of its periods; the others move it, each by its own weight.
pub(super) fn unwrapped(phasors: &[Phasor], gate_fs: (i64, i64)) -> Option<Unwrapped> {
    let mut best: Option<Candidate> = None;
    let mut next = f64::INFINITY;
    for candidate in candidates(phasors, gate_fs) {
        match best.filter(|best| candidate.cost >= best.cost - EQUAL) {
            Some(_) => next = next.min(candidate.cost),
            None => {
                next = best.map_or(next, |before| next.min(before.cost));
                best = Some(candidate);
            }
        }
    }
    best.map(|best| Unwrapped { tof: best.tof, apart: (next - best.cost).max(0.0).sqrt() })
}

/// Returns how much worse each other number of whole periods in the gate explains light of the time of flight
/// `tof`, s. The values are in standard deviations of its phases; a forecast of wrong intervals needs them.
/// Each of the `tones` has a frequency, Hz, and the variance of the phase of its light, rad².
pub fn rivals(tones: &[(f64, f64)], tof: f64, gate_fs: (i64, i64)) -> Vec<f64> {
    let tone = |(hz, _): &(f64, f64)| Tone::pure(*hz, 3, 1.0);
    let all: Vec<Tone> = tones.iter().map(tone).collect();
    let phasor = |(tone, (hz, variance)): (_, &(f64, f64))| {
        let phase = wrapped(TAU * hz * tof);
        Phasor { tone, phase, variance: *variance, light: 0.0 }
    };
    let phasors: Vec<Phasor> = all.iter().zip(tones).map(phasor).collect();
    let highest = tones.iter().fold(1.0, |most: f64, (hz, _)| most.max(*hz));
    let is_other = |candidate: &Candidate| (candidate.tof - tof).abs() * highest > 0.5;
    candidates(&phasors, gate_fs).filter(is_other).map(|other| other.cost.sqrt()).collect()
}

/// The times of flight in the gate that explain some phases best, one for each whole number of periods of the frequency
/// that tells time most precisely.
fn candidates<'a>(
    phasors: &'a [Phasor],
    gate_fs: (i64, i64),
) -> impl Iterator<Item = Candidate> + 'a {
    let precision = |phasor: &&Phasor| phasor.tone.hz * phasor.tone.hz / phasor.variance;
    let finest = phasors.iter().max_by(|one, next| precision(one).total_cmp(&precision(next)));
    let (opens, closes) = (s_from_fs(gate_fs.0), s_from_fs(gate_fs.1));
    finest.into_iter().flat_map(move |finest| {
        let within = finest.phase / TAU;
        let period = |time: f64| time * finest.tone.hz - within;
        // The candidates beside the gate may be moved into it.
        let periods = period(opens).floor() as i64..=period(closes).ceil() as i64;
        let all = periods
            .map(move |whole| Candidate::near((within + whole as f64) / finest.tone.hz, phasors));
        all.filter(move |candidate| (opens..=closes).contains(&candidate.tof))
    })
}

/// A time of flight, and the squared errors of all phases there, in units of their variance.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    tof: f64,
    cost: f64,
}

impl Candidate {
    /// The one of least cost beside `time`, with the whole periods that are nearest there.
    fn near(time: f64, phasors: &[Phasor]) -> Self {
        let (mut pull, mut stiffness) = (0.0, 0.0);
        for Phasor { tone, phase, variance, .. } in phasors {
            let turn = TAU * tone.hz;
            pull += turn * wrapped(phase - turn * time) / variance;
            stiffness += turn * turn / variance;
        }
        let moved = pull / stiffness;
        let cost = |Phasor { tone, phase, variance, .. }: &Phasor| {
            let turn = TAU * tone.hz;
            (wrapped(phase - turn * time) - turn * moved).powi(2) / variance
        };
        Self { tof: time + moved, cost: phasors.iter().map(cost).sum() }
    }
}
