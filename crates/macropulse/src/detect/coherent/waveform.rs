//! Spectra sample by sample: for chirps that are not ideal.
//!
//! Sample n of a ramp with N of them is a sum over the tones, and noise. A tone of b bins and the field a
//! adds a/√N·exp(2πi·b·(n − (N − 1)/2)/N). It is turned by the phase of the laser now less that of the laser
//! when the light left. The phase of the laser wanders with the variance 2π·Δν per second, Δν the width of
//! its line, and strays with its chirp.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use macropulse_codec::decode::beat::SpectralWindow;
use rand_distr::{Distribution, StandardNormal};
use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftPlannerScalar};

use super::peaks::{Bins, NEAR};
use super::{RampBins, Tone, normal, turned};
use crate::design::Chirp;
use crate::design::detector::Coherent;
use crate::design::emission::Model;
use crate::random::{Chance, Stage, Stream};
use crate::units::s_from_fs;

/// Draws samples, and takes their spectra.
pub(super) struct Waveforms {
    chirp: Arc<Chirp>,
    sample_hz: f64,
    quadratures: bool,
    /// The transform of each ramp.
    transforms: Vec<Arc<dyn Fft<f64>>>,
    /// The first sample of each ramp, counted from the beginning of the shot.
    begins: Vec<usize>,
}

impl std::fmt::Debug for Waveforms {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Waveforms").field("begins", &self.begins).finish_non_exhaustive()
    }
}

impl Waveforms {
    pub fn new(coherent: &Coherent, ramps: &[RampBins]) -> Self {
        // Scalar: sums in another order would be other bytes on other processors.
        let mut planner = FftPlannerScalar::new();
        let sample_hz = coherent.spectrum.sample_hz;
        let begins = |ramp: usize| (s_from_fs(coherent.chirp.begins_fs(ramp)) * sample_hz) as usize;
        Self {
            chirp: coherent.chirp.clone(),
            sample_hz,
            quadratures: coherent.quadratures,
            transforms: ramps.iter().map(|ramp| planner.plan_fft_forward(ramp.samples)).collect(),
            begins: (0..ramps.len()).map(begins).collect(),
        }
    }

    /// How the light of the laser is turned in each sample of shot `number`, those that are not recorded included; none of
    /// an ideal chirp.
    pub fn phases(&self, chance: &Chance, number: u64) -> Vec<Complex64> {
        if self.chirp.is_ideal() {
            return Vec::new();
        }
        let mut stream = chance.at(Stage::Phase, number);
        let step = (TAU * self.chirp.linewidth / self.sample_hz).sqrt();
        let error = self.chirp.error;
        let samples = (s_from_fs(self.chirp.length_fs()) * self.sample_hz) as usize + 1;
        let mut wandered = Complex64::new(1.0, 0.0);
        let at = |sample: usize| {
            if step > 0.0 {
                let drawn: f64 = StandardNormal.sample(&mut stream);
                wandered *= turn(step * drawn);
            }
            if error.amplitude == 0.0 {
                return wandered;
            }
            let phase = TAU * error.rate * sample as f64 / self.sample_hz;
            wandered * turn(-error.amplitude / error.rate * libm::cos(phase))
        };
        (0..samples).map(at).collect()
    }

    /// The bins of ramp number `at` with such `tones`, `phases` being those of the laser.
    pub fn bins(
        &self,
        at: usize,
        ramp: &RampBins,
        (tones, phases): (&[Tone], &[Complex64]),
        stream: &mut Stream,
    ) -> Bins {
        let count = ramp.samples;
        let mut samples = vec![Complex64::default(); count];
        let root = (count as f64).sqrt();
        let begins = self.begins[at];
        // The field of a falling ramp turns the other way.
        let sense = ramp.ramp.bandwidth.signum();
        for tone in tones {
            let step = turned(TAU * tone.bins / count as f64);
            let middle = -PI * tone.bins * (count as f64 - 1.0) / count as f64;
            let field = tone.field / root * turned(middle);
            let late = (tone.tof * self.sample_hz).round() as usize;
            add(&mut samples, (field, step), phases.get(begins.saturating_sub(late)..), sense);
        }
        if let Some(now) = phases.get(begins..) {
            for (sample, phase) in samples.iter_mut().zip(now) {
                *sample *= Complex64::new(phase.re, sense * phase.im);
            }
        }
        for sample in &mut samples {
            // Real samples hold each beat twice, and noise in one part alone.
            *sample = match self.quadratures {
                true => *sample + normal(stream),
                false => {
                    let drawn: f64 = StandardNormal.sample(stream);
                    Complex64::new(2.0 * sample.re + drawn, 0.0)
                }
            };
        }
        self.transforms[at].process(&mut samples);
        self.cut(ramp, &samples, root)
    }

    /// The bins that are looked at out of a whole spectrum, their phases counted from the middle of the ramp.
    fn cut(&self, ramp: &RampBins, spectrum: &[Complex64], root: f64) -> Bins {
        let count = spectrum.len() as i64;
        let first = ramp.bins.start - NEAR - 1;
        let last = ramp.bins.end + NEAR + 1;
        let step = PI * (count as f64 - 1.0) / count as f64;
        let (mut middle, step) = (turned(step * first as f64) / root, turned(step));
        let field = |bin: i64| {
            let field = spectrum[bin.rem_euclid(count) as usize] * middle;
            middle *= step;
            field
        };
        let window = SpectralWindow::None;
        Bins { first, fields: (first..last).map(field).collect(), window }
    }
}

/// Adds a tone to `samples`. The tone begins with `field` and is turned by `step` from sample to sample. It
/// is also turned, against their `sense`, by the phases that the light of the laser had when it `left`.
fn add(
    samples: &mut [Complex64],
    (field, step): (Complex64, Complex64),
    left: Option<&[Complex64]>,
    sense: f64,
) {
    let Complex64 { mut re, mut im } = field;
    let mut next = || {
        let now = (re, im);
        (re, im) = (re * step.re - im * step.im, re * step.im + im * step.re);
        now
    };
    match left {
        None => samples.iter_mut().for_each(|sample| {
            let (re, im) = next();
            *sample = Complex64::new(sample.re + re, sample.im + im);
        }),
        Some(left) => samples.iter_mut().zip(left).for_each(|(sample, phase)| {
            let ((re, im), turn) = (next(), -sense * phase.im);
            let turned = (re * phase.re - im * turn, re * turn + im * phase.re);
            *sample = Complex64::new(sample.re + turned.0, sample.im + turned.1);
        }),
    }
}

/// e^iφ; by its series where φ is small, as it is from sample to sample.
fn turn(phase: f64) -> Complex64 {
    if phase.abs() > 0.1 {
        return turned(phase);
    }
    let square = phase * phase;
    // The first terms left out are below 10⁻¹⁴.
    let cosine =
        1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)));
    let sine = phase * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)));
    Complex64::new(cosine, sine)
}
