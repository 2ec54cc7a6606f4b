//! Spectra bin by bin.
//!
//! Without a window the bins of a ramp are independent: the leaked fields of all tones, and a complex normal
//! variable of noise. Bins near a tone are drawn. The others count as noise alone, and only those are drawn
//! that exceed the least power of a peak. Their number is a binomial variable. The power of complex normal
//! noise is exponential, and so is its excess over any power.
//!
//! The window makes each bin a sum of bins, with a weight vector w of length 1. If a bin has the field Y
//! behind the window, the bins around it are those without this condition, moved along w until they sum to Y.

use macropulse_codec::Peak;
use macropulse_codec::decode::beat::{SpectralWindow, sinc};
use rand_distr::{Binomial, Distribution};
use rustfft::num_complex::Complex64;

use super::peaks::{Bins, NEAR};
use super::{RampBins, Tone, normal, turned};
use crate::design::detector::Coherent;
use crate::random::Stream;

/// Power of a tone in a bin that is neglected, in units of that of noise.
const NEGLECTED: f64 = 0.01;

/// Draws spectra.
#[derive(Debug)]
pub(super) struct Spectra {
    window: SpectralWindow,
    quadratures: bool,
}

impl Spectra {
    pub fn new(coherent: &Coherent) -> Self {
        Self { window: coherent.spectrum.window, quadratures: coherent.quadratures }
    }

    /// The peaks of a ramp with such `tones` that have at least the power `least`.
    pub fn peaks(
        &self,
        ramp: &RampBins,
        tones: &[Tone],
        least: f64,
        stream: &mut Stream,
    ) -> Vec<Peak> {
        let mut tones = tones.to_vec();
        if !self.quadratures {
            // Real samples have the same beat at the negative frequency.
            let images = tones.clone().into_iter();
            tones.extend(images.map(|it| Tone { bins: -it.bins, field: it.field.conj(), ..it }));
        }
        let mut found = Vec::new();
        let near = self.near(ramp, &tones);
        for &(from, to) in &near {
            // Farther by `NEAR`, so that every peak is measured with the same number of bins.
            let (first, last) = (from - NEAR - 1, to + NEAR + 1);
            let fields = (first..last)
                .map(|bin| {
                    let leaked = tones.iter().map(|it| it.field * sinc(it.bins - bin as f64));
                    leaked.sum::<Complex64>() + normal(stream)
                })
                .collect();
            let bins = Bins { first, fields, window: SpectralWindow::None };
            bins.behind(self.window).peaks(&(from..to), least, &mut found);
        }
        self.peaks_of_noise((ramp, &near), least, stream, &mut found);
        found
    }

    /// The bins of `ramp` that tones reach, as ranges in their order.
    fn near(&self, ramp: &RampBins, tones: &[Tone]) -> Vec<(i64, i64)> {
        let reach = |tone: &Tone| {
            // A tone leaks 1/(πj)² of its power into bin j, and 1/(πj³)² behind the window, at most.
            let alone = (tone.field.norm_sqr() / NEGLECTED).sqrt() / std::f64::consts::PI;
            2 + match self.window {
                SpectralWindow::None => alone as i64,
                SpectralWindow::Hann => libm::cbrt(alone) as i64,
            }
        };
        let range = |tone: &Tone| {
            let (middle, reach) = (tone.bins.round() as i64, reach(tone));
            ((middle - reach).max(ramp.bins.start), (middle + reach + 1).min(ramp.bins.end))
        };
        let mut ranges: Vec<(i64, i64)> =
            tones.iter().map(range).filter(|(from, to)| from < to).collect();
        ranges.sort_unstable();
        let mut near: Vec<(i64, i64)> = Vec::new();
        for (from, to) in ranges {
            match near.last_mut() {
                Some(last) if from <= last.1 => last.1 = last.1.max(to),
                _ => near.push((from, to)),
            }
        }
        near
    }

    /// Adds the peaks that noise has in the bins of `ramp` that are not `near` a tone.
    fn peaks_of_noise(
        &self,
        (ramp, near): (&RampBins, &[(i64, i64)]),
        least: f64,
        stream: &mut Stream,
        found: &mut Vec<Peak>,
    ) {
        let all = ramp.bins.end - ramp.bins.start;
        let others = all - near.iter().map(|(from, to)| to - from).sum::<i64>();
        let count = Binomial::new(others.max(0) as u64, libm::exp(-least));
        let [own, beside] = self.window.weights();
        for _ in 0..count.map_or(0, |law| law.sample(stream)) {
            // The bin with this number among those that are not near.
            let mut bin = ramp.bins.start + (stream.fraction() * others as f64) as i64;
            for (from, to) in near {
                bin += if bin >= *from { to - from } else { 0 };
            }
            let power = least - libm::log(stream.fraction());
            let phase = std::f64::consts::TAU * stream.fraction();
            let field = turned(phase) * power.sqrt();
            let first = bin - NEAR - 1;
            let mut fields: Vec<Complex64> = (0..2 * NEAR + 3).map(|_| normal(stream)).collect();
            let middle = NEAR as usize + 1;
            let sum = fields[middle] * own + (fields[middle - 1] + fields[middle + 1]) * beside;
            for (at, weight) in [(middle - 1, beside), (middle, own), (middle + 1, beside)] {
                fields[at] += (field - sum) * weight;
            }
            let bins = Bins { first, fields, window: SpectralWindow::None };
            bins.behind(self.window).peaks(&(bin..bin + 1), least, found);
        }
    }
}
