//! Probability that a return is taken for a sidelobe of its own macropulse, in closed form.
//!
//! If a macropulse is shifted by some chips, A of its N marks fall upon others of it. Those of them that are
//! found count at the sidelobe as at the peak. The other d = N − A marks count at the peak only: X of them
//! are found, X ~ Bin(d, p). At the sidelobe, chance lights Y of the same number of places, Y ~ Bin(d, q).
//! The sidelobe is taken if Y > X. If both are the same, neighbours decide.
//!
//! The returns that come first have no neighbours. If two lags have the same number of marks they take the
//! nearer one: the sidelobe on one side of the peak. They may mislead those about them, and to what extent is
//! not known. So there is no forecast if more than a few of them lie on one.

use macropulse_codec::statistics::binomial;

use super::matched::Lone;
use crate::design::Design;
use crate::units::{range_from_tof, s_from_fs};

/// Number of macropulses that stand for all, evenly spread.
const SAMPLE: usize = 64;

/// Share of the returns up to which those that come first may lie on a sidelobe.
const MISLED: f64 = 0.01;

/// Returns on a sidelobe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aside {
    /// Share of the returns.
    pub share: f64,
    /// How far these are off, root mean square, m.
    pub rms: f64,
}

/// The sidelobes of the macropulses of a sensor that have half of the marks of the peak or more. Fewer are
/// what the threshold of the receiver is for.
#[derive(Debug, Clone)]
pub(super) struct Sidelobes {
    /// For each number d of marks that do not count at them: the number of sidelobes, and the sum of their
    /// squared distances from the peak, m². Both are means over macropulses.
    own: Vec<(usize, f64, f64)>,
}

impl Sidelobes {
    /// Those of `design`.
    pub fn of(design: &Design) -> Self {
        let codebook = &design.emission.coding().codebook;
        let words = codebook.words();
        let sent = |index: usize| codebook.marks((index / words) as u16, (index % words) as u16);
        let all = codebook.labels() as usize * words;
        // Not a divisor of the words, so that all of them come.
        let step = (all / SAMPLE).max(1) | 1;
        let sample: Vec<&[u16]> =
            (0..all).step_by(step).map(sent).filter(|marks| !marks.is_empty()).collect();
        let per_chip = range_from_tof(s_from_fs(design.emission.coding().chip_fs));
        let mut own: Vec<(f64, f64)> = Vec::new();
        for marks in &sample {
            for (shift, common) in (0..).zip(correlation(marks)).skip(1) {
                let alone = marks.len() - common;
                if alone > common {
                    continue;
                }
                own.resize(own.len().max(alone + 1), (0.0, 0.0));
                // To both sides.
                own[alone].0 += 2.0 / sample.len() as f64;
                own[alone].1 += 2.0 / sample.len() as f64 * (f64::from(shift) * per_chip).powi(2);
            }
        }
        let own = own.into_iter().enumerate().filter(|(_, (count, _))| *count > 0.0);
        Self { own: own.map(|(alone, (count, squares))| (alone, count, squares)).collect() }
    }

    /// The expected sidelobes if a share `found` of the marks of returns is found, and chance lights a share
    /// `density` of places. `None` if it depends on the `lone` ones.
    pub fn aside(&self, found: f64, density: f64, lone: Lone) -> Option<Aside> {
        let (mut share, mut squares, mut misled) = (0.0, 0.0, 0.0);
        for &(alone, count, square) in &self.own {
            let exceeds = exceeds(alone, found, density);
            share += count * exceeds;
            squares += square * exceeds;
            misled += 0.5 * count * lone.share * as_many(alone, lone.found, density);
        }
        let rms = if share > 0.0 { (squares / share).sqrt() } else { 0.0 };
        (misled < MISLED).then_some(Aside { share: share.min(1.0), rms })
    }
}

/// P(Y > X), X ~ Bin(d, p) and Y ~ Bin(d, q).
fn exceeds(places: usize, found: f64, density: f64) -> f64 {
    let stray = binomial(places, density);
    let mut fewer = 0.0;
    let chances = binomial(places, found.min(1.0)).into_iter().zip(stray.iter().skip(1));
    // P(X < y), summed over y.
    chances
        .map(|(chance, stray)| {
            fewer += chance;
            fewer * stray
        })
        .sum()
}

/// P(Y = X) of the same.
fn as_many(places: usize, found: f64, density: f64) -> f64 {
    let chances = binomial(places, found.min(1.0)).into_iter().zip(binomial(places, density));
    chances.map(|(chance, stray)| chance * stray).sum()
}

/// How many of the ascending `marks` fall upon others at each shift, from 0 on.
fn correlation(marks: &[u16]) -> Vec<usize> {
    let mut common = vec![0; usize::from(marks.last().copied().unwrap_or(0)) + 1];
    for (index, mark) in marks.iter().enumerate() {
        marks[index..].iter().for_each(|other| common[usize::from(other - mark)] += 1);
    }
    common
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comb_has_a_sidelobe_at_each_tooth() {
        assert_eq!(correlation(&[0, 3, 6]), [3, 0, 0, 2, 0, 0, 1]);
    }

    /// Two coins against two, as counted by hand: 1 against 0 in 2/16, 2 against 0 or 1 in 3/16, a tie in
    /// 6/16.
    #[test]
    fn coins_exceed_coins_as_counted() {
        assert!((exceeds(2, 0.5, 0.5) - 5.0 / 16.0).abs() < 1e-12);
        assert!((as_many(2, 0.5, 0.5) - 6.0 / 16.0).abs() < 1e-12);
        assert!(exceeds(2, 0.5, 0.0) < 1e-11);
        assert!((as_many(2, 0.5, 0.0) - 0.25).abs() < 1e-12);
        assert!((exceeds(2, 0.0, 0.5) - 0.75).abs() < 1e-12);
    }
}
