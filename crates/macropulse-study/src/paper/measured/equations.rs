//! Eqs. 1, 3 and 4 of the paper, tried out on simulated walls and on words.

use macropulse::codec::code::correlation::{aperiodic, periodic};
use macropulse::design::Design;

use super::ranging::{Ranging, Triangles, phases, pulses, triangles};
use crate::paper::Error;

/// Results of the equations.
#[derive(Debug, Clone)]
pub struct Equations {
    /// A wall before a lidar of single pulses.
    pub pulse: Ranging,
    /// A wall before a lidar of one modulation frequency.
    pub amplitude: Ranging,
    /// Range at which its phase comes round.
    pub phase_wraps: f64,
    /// A wall that is farther by this range.
    pub amplitude_beyond: Ranging,
    /// A wall before a lidar whose frequency sweeps up and down, and one twice as far.
    pub frequency: [Triangles; 2],
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
    pub(super) fn of(design: &Design) -> Result<Self, Error> {
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
        let (amplitude, amplitude_beyond, phase_wraps) = phases()?;
        Ok(Self {
            pulse: pulses()?,
            amplitude,
            phase_wraps,
            amplitude_beyond,
            frequency: triangles()?,
            peak_printed: kept(&|mark| mark > word.length),
            peak: kept(&|mark| mark < word.length),
            tried,
            wrong_with_minus,
            wrong_with_plus,
        })
    }
}
