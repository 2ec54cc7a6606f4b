//! The peaks of the spectra of beats: `[spectrum]`.

use macropulse_codec::decode::beat::SpectralWindow;
use macropulse_codec::{Beats, Given, Peak, RecordKind};
use schemars::JsonSchema;
use serde::Deserialize;

use super::check::{OptionalTable, SensorFile};
use super::detector::Coherent;
use super::limits::{Check, Idle};
use super::readout::Model;
use super::{Clock, Emission, Error, Readout};
use crate::units::tof_from_range;

/// Bytes of a peak in the memory of a run: its frequency and its power, and the same once more while it is written.
const PER_PEAK: f64 = 16.0;

/// `[spectrum]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SpectrumFile {
    /// Samples taken per second, in millions.
    #[schemars(range(min = 0.001, max = 1e6))]
    sample_msps: f64,
    /// The window over a ramp.
    window: SpectralWindow,
    /// Peaks recorded of a ramp at most, the strongest ones.
    #[schemars(range(min = 1, max = 256))]
    peaks: u32,
    /// Peaks of noise that are recorded of a ramp on average; the least power that is recorded follows from it.
    #[schemars(range(min = 1e-9, max = 100))]
    false_peaks: f64,
    /// How spectra are simulated. Left out: `waveform`.
    fidelity: Option<Fidelity>,
}

/// How spectra are simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Fidelity {
    /// Sample by sample.
    Waveform,
    /// Bin by bin, and only where there is something to see: much faster, and for ideal chirps alone.
    Spectrum,
}

/// The spectra of the ramps of a shot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectrum {
    /// Samples taken per second.
    pub sample_hz: f64,
    /// The window over a ramp.
    pub window: SpectralWindow,
    /// Peaks recorded of a ramp at most.
    pub peaks: u32,
    /// Peaks of noise that are recorded of a ramp on average.
    pub false_peaks: f64,
    /// How it is simulated.
    pub fidelity: Fidelity,
}

impl Model for Spectrum {
    fn records(&self) -> RecordKind {
        RecordKind::Beats
    }

    fn tick_key(&self) -> &'static str {
        "chirp"
    }

    fn why_nothing_is_found(&self) -> &'static str {
        "the receiver found none of the echoes in the peaks of the spectra: too little light for the noise, or \
         a laser whose line is too broad"
    }

    fn blank(&self, emission: &Emission, _: Clock) -> Option<Given> {
        let (ramps, peaks) = (emission.model().recorded_parts(), self.peaks);
        let found = vec![Peak::EMPTY; (ramps * peaks) as usize];
        Some(Given::Beats(Beats { ramps, peaks, found }))
    }

    fn bytes_of_part(&self) -> Option<f64> {
        Some(f64::from(self.peaks) * PER_PEAK)
    }

    fn bandwidth_of_mode(&self) -> Option<f64> {
        Some(self.sample_hz)
    }

    fn unshared(&self) -> &'static str {
        "every detector has spectra of its own, which are never busy"
    }

    fn numbers(&self, add: &mut dyn FnMut(&[u64])) {
        add(&[self.window as u64]);
    }
}

impl OptionalTable for SpectrumFile {
    fn idle(&self, file: &SensorFile) -> Vec<Idle> {
        match file.chirp {
            Some(_) => Vec::new(),
            None => Idle::all(&["spectrum"], "chirp", "there are no beats without a [chirp]"),
        }
    }
}

/// Samples of a ramp: at least and at most.
const SAMPLES: (f64, f64) = (64.0, 65_536.0);

impl Spectrum {
    /// Returns the number of samples of a ramp that is recorded for `seconds`.
    pub fn samples(&self, seconds: f64) -> u32 {
        (self.sample_hz * seconds).round() as u32
    }

    /// By how much less precisely a beat is measured behind the window than by all samples alike. For a window w(t) it is
    /// √(∫w²t² dt·∫t² dt)/∫w·t² dt.
    pub fn loss_of_precision(&self) -> f64 {
        match self.window {
            SpectralWindow::None => 1.0,
            SpectralWindow::Hann => 1.530_3,
        }
    }
}

impl Check<'_> {
    /// Clock and readout of a detector of whose samples spectra are taken.
    pub(super) fn spectrum(&self, file: &SpectrumFile) -> Result<(Clock, Readout), Error> {
        let msps = self.within("spectrum.sample_msps", file.sample_msps, 1e-3, 1e6)?;
        let spectrum = Spectrum {
            sample_hz: msps * 1e6,
            window: file.window,
            peaks: self.count("spectrum.peaks", file.peaks, 1, 256)?,
            false_peaks: self.within("spectrum.false_peaks", file.false_peaks, 1e-9, 100.0)?,
            fidelity: file.fidelity.unwrap_or(Fidelity::Waveform),
        };
        Ok((Clock::UNTIMED, Readout::Spectrum(spectrum)))
    }

    /// Refuses spectra of `coherent` that do not hold the beats of its ramps. These are beats of surfaces up to
    /// `farthest` metres that move by up to `fastest` m/s.
    pub(super) fn bins(
        &self,
        coherent: &Coherent,
        farthest: f64,
        fastest: f64,
    ) -> Result<(), Error> {
        let Coherent { spectrum, chirp, wavelength, .. } = coherent;
        let key = "spectrum.sample_msps";
        for ramp in chirp.ramps() {
            let (samples, (least, most)) = (spectrum.sample_hz * ramp.seconds, SAMPLES);
            if !(least..=most).contains(&samples) {
                let message = format!(
                    "takes {samples:.0} samples of a ramp of {} µs, where {least} to {most} are possible",
                    ramp.seconds * 1e6
                );
                return self.refuse(key, message);
            }
            if (samples - samples.round()).abs() > 1e-3 {
                let message = format!(
                    "takes {samples:.3} samples of a ramp of {} µs: choose it so that this is a whole number",
                    ramp.seconds * 1e6
                );
                return self.refuse(key, message);
            }
            let highest = ramp.slope() * tof_from_range(farthest) + 2.0 * fastest / wavelength;
            if 2.0 * highest > spectrum.sample_hz {
                let message = format!(
                    "is {}, but the beat of a surface at {farthest} m that moves by {fastest} m/s is {:.1} MHz: \
                     {:.1} or more",
                    spectrum.sample_hz * 1e-6,
                    highest * 1e-6,
                    (2.0 * highest * 1e-5).ceil() * 0.1
                );
                return self.refuse(key, message);
            }
        }
        if spectrum.fidelity == Fidelity::Spectrum && !chirp.is_ideal() {
            let message = "`spectrum` is exact for ideal chirps alone: `waveform`, or chirp.linewidth_khz and \
                           chirp.error_mhz of 0";
            return self.refuse("spectrum.fidelity", message);
        }
        Ok(())
    }
}
