//! A pixel that collects light in step with its modulation ("lock-in"): a tap for each phase.

use std::f64::consts::TAU;
use std::sync::Arc;

use macropulse_codec::decode::phase::Tone;
use macropulse_codec::decode::{Method, PhaseMethod};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{Detector, Lit, Model, Sensitivity, Table, Typed};
use crate::design::limits::Check;
use crate::design::receiver::{Inputs, ReceiverFile};
use crate::design::{Emission, Error, Light, Modulation};

/// Share of the codes that are below that of a tap which has collected nothing, so that noise is not cut off.
const BELOW: f64 = 1.0 / 16.0;

/// A return that is only just found has this power, in units of that of noise: one in a million shots without light has
/// more.
const JUST_FOUND: f64 = 13.8;

/// `[detector.lock-in]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Electrons collected per photon, the mean over a period of the modulation.
    #[schemars(range(min = 1e-6, max = 1))]
    efficiency: f64,
    /// Contrast of each modulation frequency: the amplitude of the charge of a tap over its mean, as its phase goes
    /// round.
    #[schemars(length(min = 1, max = 4), inner(range(min = 0.001, max = 1)))]
    contrast: Vec<f64>,
    /// Electrons that a tap holds.
    #[schemars(range(min = 1, max = 1e9))]
    full_well_e: f64,
    /// Noise of reading a tap, rms, electrons.
    #[schemars(range(min = 0, max = 1e6))]
    read_noise_e: f64,
    /// Dark current, electrons per second.
    #[schemars(range(min = 0, max = 1e12))]
    dark_counts_hz: f64,
    /// Bits of a code.
    #[schemars(range(min = 4, max = 16))]
    adc_bits: u32,
}

/// A pixel that collects light in step with its modulation.
#[derive(Debug, Clone, PartialEq)]
pub struct LockIn {
    /// The modulation that it follows.
    pub modulation: Arc<Modulation>,
    /// Mean photons detected of a shot at the reference target.
    pub sensitivity: Sensitivity,
    /// Contrast of each modulation frequency.
    pub contrast: Vec<f64>,
    /// Electrons that a tap holds.
    pub full_well: f64,
    /// Noise of reading a tap, rms, electrons.
    pub read_noise: f64,
    /// Dark current, electrons per second.
    pub dark: f64,
    /// Code of a tap that has collected nothing.
    pub dark_code: f64,
    /// The highest code, of a tap that is full.
    pub full_scale: u16,
}

impl Typed for File {
    fn efficiency(&self) -> Option<f64> {
        Some(self.efficiency)
    }

    fn check(&self, table: &Table) -> Result<Detector, Error> {
        let Emission::Modulated(modulation) = table.before.emission else {
            return table.refuse("is for light with a [modulation], which is missing");
        };
        let Some(budget) = table.before.budget else {
            return table.refuse(
                "counts its noise in electrons, so the light must be counted as well: take \
                 \"link-budget\" off the list `idealised`",
            );
        };
        let tones = modulation.hz.len();
        if self.contrast.len() != tones {
            let message = format!(
                "has {} numbers for {tones} modulation frequencies: give one for each",
                self.contrast.len()
            );
            return table.refuse_key("contrast", message);
        }
        let most = modulation.wave.most_contrast();
        let contrast =
            self.contrast.iter().map(|typed| table.within("contrast", *typed, 1e-3, most));
        let contrast = contrast.collect::<Result<Vec<f64>, Error>>()?;
        let full_well = table.within("full_well_e", self.full_well_e, 1.0, 1e9)?;
        let bits = table.count("adc_bits", self.adc_bits, 4, 16)?;
        let full_scale = (1_u32 << bits) - 1;
        Ok(Detector::LockIn(LockIn {
            modulation: Arc::new(modulation.clone()),
            sensitivity: table.honest(budget),
            contrast,
            full_well,
            read_noise: table.within("read_noise_e", self.read_noise_e, 0.0, 1e6)?,
            dark: table.dark(self.dark_counts_hz)?,
            dark_code: (f64::from(full_scale) * BELOW).round(),
            full_scale: full_scale as u16,
        }))
    }
}

impl Check<'_> {
    /// How a receiver decodes taps; `None` without the detector that it has to know.
    pub(in crate::design) fn of_taps(
        &self,
        file: &ReceiverFile,
        inputs: &Inputs,
        false_alarm: f64,
    ) -> Result<Option<Method>, Error> {
        let Some(Detector::LockIn(lock_in)) = inputs.detector else { return Ok(None) };
        let corrects = file.correct_harmonics.unwrap_or(true);
        Ok(Some(Method::Phase(lock_in.method(corrects, false_alarm))))
    }
}

impl LockIn {
    /// Electrons of one step of a code.
    pub fn electrons_per_code(&self) -> f64 {
        self.full_well / (f64::from(self.full_scale) - self.dark_code)
    }

    /// Variance of the electrons of a tap that holds `electrons` on average: of photons, reading and
    /// rounding.
    pub fn variance(&self, electrons: f64) -> f64 {
        electrons + self.read_noise.powi(2) + self.electrons_per_code().powi(2) / 12.0
    }

    /// Description of the taps for a receiver, with harmonics if it `corrects` them.
    pub fn method(&self, corrects: bool, false_alarm: f64) -> PhaseMethod {
        let modulation = &self.modulation;
        let tone = |(hz, contrast): (&f64, &f64)| {
            let mut contrasts = modulation.wave.contrasts(*contrast);
            if !corrects {
                contrasts.truncate(1);
            }
            Tone { hz: *hz, phases: modulation.phases, contrasts }
        };
        PhaseMethod {
            tones: modulation.hz.iter().zip(&self.contrast).map(tone).collect(),
            electrons_per_code: self.electrons_per_code(),
            dark_code: self.dark_code,
            read_noise: self.read_noise,
            full_scale: self.full_scale,
            false_alarm,
        }
    }

    /// Standard deviation of the time of flight, s, of an echo that is only just found, with the highest frequency.
    fn just_found(&self) -> f64 {
        (0.5 / JUST_FOUND).sqrt() / (TAU * self.modulation.highest())
    }
}

impl Model for LockIn {
    fn sensitivity(&self) -> Sensitivity {
        self.sensitivity
    }

    fn resolution(&self, _: &Light) -> f64 {
        self.just_found()
    }

    fn false_rate(&self, background: f64) -> f64 {
        self.dark + background
    }

    fn mark_pd(&self, lit: &Lit) -> f64 {
        -libm::expm1(-lit.photons)
    }

    fn mark_jitter(&self, _: &Lit) -> f64 {
        self.just_found()
    }

    fn summary(&self) -> String {
        format!(
            "lock-in pixel, {} taps a shot, each of {} electrons and with {} of noise; {}",
            self.modulation.taps(),
            self.full_well,
            self.read_noise,
            self.sensitivity.summary_of("shot")
        )
    }

    fn in_sunlight(&self) -> &'static str {
        "which fill its taps and are noise to it"
    }
}
