//! Light to beats: a receiver that mixes it with that of its laser.
//!
//! The light of each path in the mode of the laser is a field. Its size and phase vary from shot to shot like one
//! speckle: it is a complex normal variable. Mixed with the laser it is a beat. S detected photons in a ramp give a
//! peak in the spectrum with the mean power S, where the shot noise of the laser has the power 1. Frequencies and
//! phases differ between the ramps; the size of the field does not. `spectrum` draws bins, and `waveform` draws
//! samples; `peaks` finds and measures the peaks of both.
//!
//! Pulses of other lidars make no beat: their frequencies are outside the bandwidth of the receiver. The motion of a surface
//! during a shot, 0.2 mm at 15 m/s, is neglected.

mod peaks;
mod spectrum;
mod waveform;

#[cfg(test)]
mod tests;

use std::ops::Range;

use macropulse_codec::decode::beat::Ramp;
use macropulse_codec::{Beats, Given, Peak, ShotLog};
use rand_distr::{Distribution, StandardNormal};
use rustfft::num_complex::Complex64;

use super::{ShotRecorder, own_by_shot};
use crate::channel::Light;
use crate::design::detector::Coherent;
use crate::design::{Design, Fidelity};
use crate::random::{Address, Chance, Stage, Stream};
use crate::units::s_from_fs;
use peaks::strongest;
use spectrum::Spectra;
use waveform::Waveforms;

/// A receiver of frequency-modulated light at work.
#[derive(Debug)]
pub(super) struct Mixer {
    coherent: Coherent,
    /// Detections per photon.
    efficiency: f64,
    /// Noise over the shot noise of the laser.
    noise: f64,
    /// Power from which on a peak is recorded.
    least_power: f64,
    ramps: Vec<RampBins>,
    way: Way,
}

/// How spectra are made.
#[derive(Debug)]
enum Way {
    Spectra(Spectra),
    Waveforms(Waveforms),
}

/// A ramp, and what is recorded of it.
#[derive(Debug, Clone)]
struct RampBins {
    ramp: Ramp,
    /// Its share of the light of a shot.
    share: f64,
    /// The bins in which peaks are looked for: all, but those that hold the mean and the highest frequency of real samples.
    bins: Range<i64>,
    /// Samples.
    samples: usize,
}

/// A beat of a path in a ramp.
#[derive(Debug, Clone, Copy)]
struct Tone {
    /// Frequency in bins.
    bins: f64,
    /// Its field in a bin of this frequency, noise having the mean power 1.
    field: Complex64,
    /// Time of flight, s.
    tof: f64,
}

/// Light of a shot that comes along a path.
#[derive(Debug, Clone, Copy)]
struct Path {
    tof: f64,
    radial_velocity: f64,
    /// Field of one detected photon of the shot times the root of their mean number.
    field: Complex64,
}

impl ShotRecorder for Mixer {
    fn record(&self, chance: &Chance, log: &ShotLog, light: &Light) -> Given {
        Given::Beats(self.beats(chance, log, light))
    }
}

impl Mixer {
    /// The mixer of `design`. `background` is the photons of sunlight detected per second in the mode of its laser.
    pub fn new(coherent: &Coherent, design: &Design, background: f64) -> Self {
        let (chirp, spectrum) = (&coherent.chirp, &coherent.spectrum);
        let bins_of = |(ramp, share): (Ramp, f64)| {
            let samples = spectrum.samples(ramp.seconds) as usize;
            let half = samples as i64 / 2;
            let bins = if coherent.quadratures { -half + 1..half } else { 1..half };
            RampBins { ramp, share, bins, samples }
        };
        let ramps: Vec<RampBins> =
            chirp.ramps().into_iter().zip(chirp.shares()).map(bins_of).collect();
        let way = match spectrum.fidelity {
            Fidelity::Spectrum => Way::Spectra(Spectra::new(coherent)),
            Fidelity::Waveform => Way::Waveforms(Waveforms::new(coherent, &ramps)),
        };
        let noise = coherent.noise(background);
        let (efficiency, least_power) = (design.efficiency(), coherent.least_power());
        Self { coherent: coherent.clone(), efficiency, noise, least_power, ramps, way }
    }

    fn beats(&self, chance: &Chance, log: &ShotLog, light: &Light) -> Beats {
        let peaks = self.coherent.spectrum.peaks;
        let mut beats = Beats { ramps: self.ramps.len() as u32, peaks, found: Vec::new() };
        beats.found.reserve(log.owned.len() * self.ramps.len() * peaks as usize);
        let own = own_by_shot(light);
        for shot in log.owned.clone() {
            let number = log.first + shot as u64;
            let paths = self.paths(chance, (number, log.fired_at_fs[shot]), (&own, light));
            for found in self.peaks(chance, number, &paths) {
                beats.found.extend(strongest(found, peaks as usize));
            }
        }
        beats
    }

    /// The paths of the light of shot `number`, which was fired at `fired_fs`, `own` being the trains of the sensor itself.
    fn paths(
        &self,
        chance: &Chance,
        (number, fired_fs): (u64, i64),
        (own, light): (&[(u64, usize)], &Light),
    ) -> Vec<Path> {
        let mut stream = chance.at(Stage::Field, number);
        let mut path = |photons: f64, tof: f64, radial_velocity: f64| {
            let field = normal(&mut stream) * (photons * self.efficiency).sqrt();
            Path { tof, radial_velocity, field }
        };
        let trains = &light.trains;
        let from = own.partition_point(|(of, _)| *of < number);
        let mut paths: Vec<Path> = own[from..]
            .iter()
            .take_while(|(of, _)| *of == number)
            .map(|&(_, train)| {
                let tof = s_from_fs(trains.arrives_fs[train] - fired_fs);
                let velocity = trains.radial_velocity.get(train).copied().unwrap_or(0.0);
                path(trains.photons[train], tof, f64::from(velocity))
            })
            .collect();
        for response in &light.responses {
            for (step, photons) in response.photons.iter().enumerate() {
                paths.push(path(*photons, (step as f64 + 0.5) * s_from_fs(response.step_fs), 0.0));
            }
        }
        paths
    }

    /// The peaks of all ramps of shot `number`, whose light comes along `paths`.
    fn peaks(&self, chance: &Chance, number: u64, paths: &[Path]) -> Vec<Vec<Peak>> {
        let doppler = 2.0 / self.coherent.wavelength;
        let phases = match &self.way {
            Way::Waveforms(waveforms) => waveforms.phases(chance, number),
            Way::Spectra(_) => Vec::new(),
        };
        let of_ramp = |(number_of_ramp, ramp): (u32, &RampBins)| {
            let size = (ramp.share / self.noise).sqrt();
            let tone = |path: &Path| Tone {
                bins: ramp.ramp.bins(path.tof, doppler * path.radial_velocity),
                field: path.field * size,
                tof: path.tof,
            };
            let tones: Vec<Tone> = paths.iter().map(tone).collect();
            let part = number_of_ramp << 20;
            let mut stream = chance.stream(Address { stage: Stage::Spectrum, index: number, part });
            match &self.way {
                Way::Spectra(spectra) => spectra.peaks(ramp, &tones, self.least_power, &mut stream),
                Way::Waveforms(waveforms) => {
                    let bins = waveforms.bins(
                        number_of_ramp as usize,
                        ramp,
                        (&tones, &phases),
                        &mut stream,
                    );
                    let mut found = Vec::new();
                    let bins = bins.behind(self.coherent.spectrum.window);
                    bins.peaks(&ramp.bins, self.least_power, &mut found);
                    found
                }
            }
        };
        (0..).zip(&self.ramps).map(of_ramp).collect()
    }
}

/// A complex normal variable of the mean power 1.
fn normal(stream: &mut Stream) -> Complex64 {
    let (real, imaginary): (f64, f64) =
        (StandardNormal.sample(stream), StandardNormal.sample(stream));
    Complex64::new(real, imaginary) * std::f64::consts::FRAC_1_SQRT_2
}

/// e^iφ. Not that of the standard library, which depends on the system.
fn turned(phase: f64) -> Complex64 {
    Complex64::new(libm::cos(phase), libm::sin(phase))
}
