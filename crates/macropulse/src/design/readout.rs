//! The record of a sensor, and the clock by which it is made: `[tdc]`, `[adc]`, `[histogram]`, `[spectrum]`,
//! or the taps of modulated light.

use std::sync::Arc;

use macropulse_codec::RecordKind;
use macropulse_codec::decode::beat::SpectralWindow;
use macropulse_codec::decode::histogram::Pulse;
use schemars::JsonSchema;
use serde::Deserialize;

use super::band::TOO_FINE;
use super::limits::Check;
use super::{Chirp, Error, Scan};
use crate::units::{FS_PER_S, fs_from_s, tof_from_range};

/// `[tdc]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct TdcFile {
    /// Converters of the whole bank, divided evenly among the detectors: one for each at least.
    #[schemars(range(min = 1, max = 16777216))]
    converters: u32,
    /// Length of a tick, ps: a whole number of femtoseconds.
    #[schemars(range(min = 0.001, max = 1e9))]
    resolution_ps: Option<f64>,
    /// Period of the coarse counter, ps: a whole number of ticks.
    #[schemars(range(min = 0.001, max = 1e9))]
    clock_ps: f64,
    /// Bits of the fine counter, which must hold the ticks of one period.
    #[schemars(range(min = 1, max = 16))]
    bits: u32,
    /// Time for which a converter is busy with an event, ns.
    #[schemars(range(min = 0, max = 1e6))]
    dead_time_ns: f64,
}

/// The clock of a sensor, in whose ticks its receiver counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Clock {
    /// Length of a tick, fs: the resolution of a time-to-digital converter, or the time from sample to
    /// sample.
    pub tick_fs: i64,
    /// Period of the counter of whole clock ticks, fs: a whole number of ticks.
    pub period_fs: i64,
}

/// The part behind the detectors that makes the record for the receiver.
#[derive(Debug, Clone, PartialEq)]
pub enum Readout {
    /// Time-to-digital converters (TDC): the ticks of detection events.
    Tdc(Tdc),
    /// An analogue-to-digital converter (ADC) for each detector: samples of its signal.
    Adc,
    /// Counters for each detector, one for each bin of time since a pulse was sent: histograms.
    Histogram(Histogram),
    /// A converter for each detector that reads its taps.
    Taps,
    /// A converter for each detector, and the peaks of the spectra of its samples.
    Spectrum(Spectrum),
}

impl Readout {
    /// The bank of time-to-digital converters, if it is one.
    pub fn tdc(&self) -> Option<&Tdc> {
        match self {
            Self::Tdc(tdc) => Some(tdc),
            _ => None,
        }
    }

    /// The histogram of each shot, if counts go into one.
    pub fn histogram(&self) -> Option<&Histogram> {
        match self {
            Self::Histogram(histogram) => Some(histogram),
            _ => None,
        }
    }

    /// The kind of record that it makes.
    pub fn records(&self) -> RecordKind {
        match self {
            Self::Tdc(_) => RecordKind::Ticks,
            Self::Adc => RecordKind::Samples,
            Self::Histogram(_) => RecordKind::Histograms,
            Self::Taps => RecordKind::Taps,
            Self::Spectrum(_) => RecordKind::Beats,
        }
    }

    /// The key that says how long a tick is.
    pub(super) fn tick_key(&self) -> &'static str {
        match self {
            Self::Tdc(_) => "tdc.resolution_ps",
            Self::Adc => "adc.sample_ps",
            Self::Histogram(_) => "histogram.bin_ps",
            Self::Taps => "modulation",
            Self::Spectrum(_) => "chirp",
        }
    }

    /// Why a receiver finds nothing in its record of light, in a sentence.
    pub fn why_nothing_is_found(&self) -> &'static str {
        match self {
            Self::Tdc(_) => "the receiver decoded none of the macropulses; the rejects say why",
            Self::Adc => {
                "the receiver found none of the echoes in the samples: too little light for the noise, or \
                 the channel was blind with its own light"
            }
            Self::Histogram(_) => {
                "the receiver found none of the echoes in the histograms: too little light for the \
                 background"
            }
            Self::Taps => {
                "the receiver found none of the echoes in the taps: too little light for the noise, or so much \
                 that the taps are full"
            }
            Self::Spectrum(_) => {
                "the receiver found none of the echoes in the peaks of the spectra: too little light for the noise, or \
                 a laser whose line is too broad"
            }
        }
    }

    /// Time, fs, for which its state depends on the events that it was given.
    pub(super) fn memory_fs(&self) -> i64 {
        self.tdc().map_or(0, Tdc::memory_fs)
    }
}

/// The histogram of a shot. Its bins are ticks of the sensor's clock; the first begins with each pulse.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Bins.
    pub bins: u32,
    /// Counts of a pulse of the sensor, bin by bin, where they are measured.
    pub pulse: Option<Arc<[f64]>>,
}

impl Histogram {
    /// A pulse of the sensor as it is recorded: the one that was measured, sent in the middle of its highest bin, or a
    /// Gaussian one of `rms` seconds.
    pub fn pulse(&self, rms: f64) -> Pulse {
        let Some(measured) = &self.pulse else {
            return Pulse::Gaussian { rms_fs: rms * FS_PER_S as f64 };
        };
        let higher = |peak: usize, at: usize| if measured[at] > measured[peak] { at } else { peak };
        let peak = (0..measured.len()).fold(0, higher);
        Pulse::Measured { counts: measured.to_vec(), origin: peak as f64 + 0.5 }
    }
}

/// A bank of time-to-digital converters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tdc {
    /// Converters in the bank, for all detectors together.
    pub converters: u32,
    /// Time for which a converter is busy with one event, fs.
    pub dead_fs: i64,
}

/// `[adc]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct AdcFile {
    /// From sample to sample, ps: a whole number of femtoseconds; the tick of this sensor.
    #[schemars(range(min = 0.001, max = 1e9))]
    pub sample_ps: f64,
    /// Bits of a code, the level without light at a tenth of the range.
    #[schemars(range(min = 4, max = 15))]
    pub bits: u32,
    /// Step of a code: the height of a mark of this number of detected photons.
    #[schemars(range(min = 1e-6, max = 1e9))]
    pub step_photons: f64,
}

/// `[histogram]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct HistogramFile {
    /// Width of a bin, ps: a whole number of femtoseconds; the tick of this sensor.
    #[schemars(range(min = 0.001, max = 1e9))]
    bin_ps: f64,
    /// Number of bins. The first one begins when a pulse is sent.
    #[schemars(range(min = 1, max = 65536))]
    bins: u32,
    /// A pulse of the sensor as it records it, light and detector together: counts of a reference path without
    /// background, bin by bin. It is sent in the middle of its highest bin. In place of the Gaussian pulse of
    /// `light.pulse_ps` and the jitter.
    #[schemars(length(min = 1, max = 4096), inner(range(min = 0, max = 1e12)))]
    pub pulse: Option<Vec<f64>>,
}

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

/// Tick of the clock of a sensor of modulated light, fs: no time is measured by it, and its range gate ends to 1.5 mm.
const TICK_OF_TAPS_FS: i64 = 10_000;

/// Converters start this number of dead times before the first ticks of a band, as Geiger cells do.
const DEAD_TIMES: i64 = 4;

impl Tdc {
    /// Ticks of `clock` for which a converter is busy with one event, rounded up.
    pub fn dead_ticks(&self, clock: Clock) -> u32 {
        u32::try_from((self.dead_fs + clock.tick_fs - 1) / clock.tick_fs).unwrap_or(u32::MAX)
    }

    /// The part of the bank that each of `channels` detectors has.
    pub fn share(&self, channels: u32) -> Self {
        Self { converters: self.converters / channels, ..*self }
    }

    /// Time, fs, for which the state of the bank depends on the events that it was given. All converters are
    /// free in the beginning, which they are after each dead time in which few events come.
    fn memory_fs(&self) -> i64 {
        DEAD_TIMES * self.dead_fs
    }
}

impl Check<'_> {
    /// Refuses ticks, or samples, that are too fine: 2²⁶ of them do not hold the echoes of a shot and of
    /// those in flight with it.
    pub(super) fn too_fine<T>(&self, readout: &Readout) -> Result<T, Error> {
        self.refuse(readout.tick_key(), TOO_FINE)
    }

    /// Clock and readout of a detector whose signal is sampled.
    pub(super) fn adc(&self, file: &AdcFile) -> Result<(Clock, Readout), Error> {
        let tick_fs = self.whole_fs("adc.sample_ps", file.sample_ps)?;
        Ok((Clock { tick_fs, period_fs: tick_fs }, Readout::Adc))
    }

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
        Ok((self.of_taps().0, Readout::Spectrum(spectrum)))
    }

    /// Refuses a `spectrum` that does not hold the beats of the ramps of a `chirp`. These are beats of
    /// surfaces up to `farthest` metres that move by up to `fastest` m/s, at this wavelength.
    pub(super) fn bins(
        &self,
        spectrum: &Spectrum,
        chirp: &Chirp,
        (farthest, fastest, wavelength): (f64, f64, f64),
    ) -> Result<(), Error> {
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

    /// Clock and readout of a detector whose taps are read.
    pub(super) fn of_taps(&self) -> (Clock, Readout) {
        (Clock { tick_fs: TICK_OF_TAPS_FS, period_fs: TICK_OF_TAPS_FS }, Readout::Taps)
    }

    /// Clock and readout of a detector whose counts go into a histogram.
    pub(super) fn histogram(&self, file: &HistogramFile) -> Result<(Clock, Readout), Error> {
        let tick_fs = self.whole_fs("histogram.bin_ps", file.bin_ps)?;
        let bins = self.count("histogram.bins", file.bins, 1, 65_536)?;
        let clock = Clock { tick_fs, period_fs: tick_fs };
        let pulse = file.pulse.as_ref().map(|counts| self.measured(counts)).transpose()?;
        Ok((clock, Readout::Histogram(Histogram { bins, pulse })))
    }

    /// A pulse that was measured.
    fn measured(&self, counts: &[f64]) -> Result<Arc<[f64]>, Error> {
        let key = "histogram.pulse";
        let most = Pulse::MOST_BINS;
        if !(1..=most).contains(&counts.len()) {
            return self
                .refuse(key, format!("has {} counts, but can have 1 to {most}", counts.len()));
        }
        for count in counts {
            self.within(key, *count, 0.0, 1e12)?;
        }
        if counts.iter().all(|count| *count == 0.0) {
            return self.refuse(key, "has no light: a count must be above 0");
        }
        Ok(counts.into())
    }

    /// Clock and readout of a detector whose events are timed.
    pub(super) fn tdc(&self, file: &TdcFile) -> Result<(Clock, Readout), Error> {
        let Some(resolution) = file.resolution_ps else {
            let message = "missing field `resolution_ps`";
            return Err(self.chain.lacks("tdc.resolution_ps", message));
        };
        let tick_fs = self.whole_fs("tdc.resolution_ps", resolution)?;
        let period_fs = self.whole_fs("tdc.clock_ps", file.clock_ps)?;
        let bits = self.count("tdc.bits", file.bits, 1, 16)?;
        if period_fs % tick_fs != 0 {
            return self.refuse("tdc.clock_ps", "must be a whole number of ticks (resolution_ps)");
        }
        if period_fs / tick_fs > 1 << bits {
            let message = format!(
                "{bits} bits hold {} ticks, but a clock period has {}",
                1 << bits,
                period_fs / tick_fs
            );
            return self.refuse("tdc.bits", message);
        }
        let dead = self.within("tdc.dead_time_ns", file.dead_time_ns, 0.0, 1e6)?;
        let tdc = Tdc {
            converters: self.count("tdc.converters", file.converters, 1, 1 << 24)?,
            dead_fs: fs_from_s(dead * 1e-9),
        };
        Ok((Clock { tick_fs, period_fs }, Readout::Tdc(tdc)))
    }

    /// Refuses a bank with fewer converters than `scan` has detectors.
    pub(super) fn share(&self, readout: &Readout, scan: &Scan) -> Result<(), Error> {
        let Some(&Tdc { converters, .. }) = readout.tdc() else { return Ok(()) };
        let channels = scan.channels();
        if converters >= channels {
            return Ok(());
        }
        let message = format!(
            "is {converters}, but the bank is divided evenly among {channels} detectors: write \
             {channels}, or more"
        );
        self.refuse("tdc.converters", message)
    }
}
