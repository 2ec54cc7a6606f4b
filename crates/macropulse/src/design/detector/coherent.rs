//! Coherent detection: light is mixed with that of the laser, and the beats of both are recorded.

use std::f64::consts::PI;
use std::sync::Arc;

use macropulse_codec::decode::{BeatMethod, Method};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{Detector, Lit, Model, Sensitivity, Table, Typed};
use crate::design::limits::Check;
use crate::design::receiver::{Inputs, ReceiverFile};
use crate::design::{Chirp, Emission, Error, Light, Readout, Spectrum};

/// A return that is only just found has this power in each ramp, in units of that of noise.
const JUST_FOUND: f64 = 13.8;

/// Radial velocity at most, m/s, if a file does not say: of two cars at 108 km/h that meet.
const MAX_SPEED: f64 = 60.0;

/// `[detector.coherent]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Electrons per photon.
    #[schemars(range(min = 1e-6, max = 1))]
    efficiency: f64,
    /// Share of the received light that is in the mode of the local oscillator.
    #[schemars(range(min = 1e-6, max = 1))]
    mixing_efficiency: f64,
    /// Noise of diodes, amplifier and converter together over the shot noise of the local oscillator; 1 of a receiver
    /// that adds none.
    #[schemars(range(min = 1, max = 1e6))]
    noise_factor: f64,
    /// True if both quadratures are recorded, which tell a beat from its negative. Left out: false.
    quadratures: Option<bool>,
}

/// A receiver that mixes the light it gets with that of its laser.
#[derive(Debug, Clone, PartialEq)]
pub struct Coherent {
    /// The light that it gets back.
    pub chirp: Arc<Chirp>,
    /// The spectra that it takes.
    pub spectrum: Spectrum,
    /// Mean photons detected of a shot at the reference target, in the mode of the local oscillator.
    pub sensitivity: Sensitivity,
    /// Noise over the shot noise of the local oscillator, without sunlight.
    pub noise_factor: f64,
    /// True if it tells a beat from its negative.
    pub quadratures: bool,
    /// Wavelength, m.
    pub wavelength: f64,
}

impl Typed for File {
    fn efficiency(&self) -> Option<f64> {
        Some(self.efficiency * self.mixing_efficiency)
    }

    fn check(&self, table: &Table) -> Result<Detector, Error> {
        let Emission::Chirped(chirp) = table.before.emission else {
            return table.refuse("is for light with a [chirp], which is missing");
        };
        let Readout::Spectrum(spectrum) = *table.before.readout else {
            return table.refuse("is recorded by its [spectrum], which is missing");
        };
        let Some(budget) = table.before.budget else {
            return table.refuse(
                "counts its noise in photons, so the light must be counted as well: take \
                 \"link-budget\" off the list `idealised`",
            );
        };
        table.within("efficiency", self.efficiency, 1e-6, 1.0)?;
        table.within("mixing_efficiency", self.mixing_efficiency, 1e-6, 1.0)?;
        Ok(Detector::Coherent(Coherent {
            chirp: Arc::new(chirp.clone()),
            spectrum,
            sensitivity: table.honest(budget),
            noise_factor: table.within("noise_factor", self.noise_factor, 1.0, 1e6)?,
            quadratures: self.quadratures.unwrap_or(false),
            wavelength: table.before.light.wavelength,
        }))
    }
}

impl Check<'_> {
    /// How a receiver decodes beats; `None` without the detector that it has to know.
    pub(in crate::design) fn of_beats(
        &self,
        file: &ReceiverFile,
        inputs: &Inputs,
        false_alarm: f64,
    ) -> Result<Option<Method>, Error> {
        let Some(Detector::Coherent(coherent)) = inputs.detector else { return Ok(None) };
        let fastest = file.max_speed_m_s.unwrap_or(MAX_SPEED);
        let fastest = self.within("receiver.max_speed_m_s", fastest, 0.0, 1e4)?;
        let share = file.least_share.unwrap_or(0.0);
        let share = self.within("receiver.least_share", share, 0.0, 1.0)?;
        self.bins(coherent, inputs.scan.max_range, fastest)?;
        Ok(Some(Method::Beat(coherent.method(share, fastest, false_alarm))))
    }
}

impl Coherent {
    /// Noise over the shot noise of the local oscillator, with `background` photons of sunlight detected per
    /// second in its mode. One photon per sample makes the same noise as the local oscillator.
    pub fn noise(&self, background: f64) -> f64 {
        self.noise_factor + background / self.spectrum.sample_hz
    }

    /// Description of the peaks for a receiver.
    pub fn method(&self, least_share: f64, max_speed: f64, false_alarm: f64) -> BeatMethod {
        let ramps = self.chirp.ramps();
        let recorded: f64 = self.chirp.shares().iter().sum();
        BeatMethod {
            photons: ramps.len() as f64 * self.noise_factor / recorded,
            ramps,
            wavelength: self.wavelength,
            window: self.spectrum.window,
            least_power: self.least_power(),
            least_share,
            max_speed,
            false_alarm,
        }
    }

    /// Bins of a ramp that lasts `seconds`: of all frequencies, or of those above zero.
    pub fn bins(&self, seconds: f64) -> u32 {
        let samples = self.spectrum.samples(seconds);
        if self.quadratures { samples } else { samples / 2 }
    }

    /// Power from which on a peak is recorded: noise exceeds it in the wanted number of bins of a ramp,
    /// `false_peaks`.
    pub fn least_power(&self) -> f64 {
        let most = self.chirp.ramps().iter().map(|ramp| self.bins(ramp.seconds)).max();
        libm::log(f64::from(most.unwrap_or(1)) / self.spectrum.false_peaks).max(1.0)
    }

    /// Standard deviation of the time of flight, s, by one ramp in which a beat has such a `power`: √6/(2π)/(B·√S), and
    /// 1.53 times as much behind a Hann window.
    pub fn spread(&self, power: f64) -> f64 {
        self.spectrum.loss_of_precision() * 6.0_f64.sqrt()
            / (2.0 * PI * self.chirp.bandwidth * power.sqrt())
    }

    /// The same of all ramps together, of an echo that is only just found.
    fn just_found(&self) -> f64 {
        self.spread(JUST_FOUND) / (self.chirp.ramps().len() as f64).sqrt()
    }
}

impl Model for Coherent {
    fn sensitivity(&self) -> Sensitivity {
        self.sensitivity
    }

    fn resolution(&self, _: &Light) -> f64 {
        self.just_found()
    }

    fn unpulsed(&self) -> Option<&'static str> {
        Some("the beat of two lasers is not simulated: give it another wavelength")
    }

    fn false_rate(&self, _: f64) -> f64 {
        0.0
    }

    fn mark_pd(&self, lit: &Lit) -> f64 {
        -libm::expm1(-lit.photons)
    }

    fn mark_jitter(&self, _: &Lit) -> f64 {
        self.just_found()
    }

    fn summary(&self) -> String {
        let ramps = self.chirp.ramps();
        let time: Vec<String> =
            ramps.iter().map(|ramp| format!("{:.4} µs", ramp.seconds * 1e6)).collect();
        format!(
            "coherent receiver, spectra of {} at {:.4} MS/s{}; {}",
            time.join(" and "),
            self.spectrum.sample_hz * 1e-6,
            if self.quadratures { " in both quadratures" } else { "" },
            self.sensitivity.summary_of("shot")
        )
    }

    fn follows_speckle(&self) -> bool {
        true
    }

    fn in_sunlight(&self) -> &'static str {
        "of the mode of its laser, which are noise to it"
    }
}
