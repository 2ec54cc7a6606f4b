//! The record of a sensor, and the clock by which it is made. This file lists the readouts and the questions
//! that each of them answers. It has those of detection events and signals: `[tdc]` and `[adc]`.

use macropulse_codec::{Given, RecordKind};
use schemars::JsonSchema;
use serde::Deserialize;

use super::band::TOO_FINE;
use super::limits::Check;
use super::modulation::Taps;
use super::{Emission, Error, Histogram, Scan, Spectrum};
use crate::units::fs_from_s;

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

impl Clock {
    /// The clock of a sensor that times no events: its range gate ends to 1.5 mm.
    pub(super) const UNTIMED: Self = Self { tick_fs: 10_000, period_fs: 10_000 };
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

/// A readout of any kind.
pub trait Model {
    /// The kind of record that it makes.
    fn records(&self) -> RecordKind;

    /// The key that says how long a tick is.
    fn tick_key(&self) -> &'static str;

    /// Time, fs, for which its state depends on the events that it was given.
    fn memory_fs(&self) -> i64 {
        0
    }

    /// Bytes that a run takes for each recorded part of a shot; `None` where the record is not made shot by shot.
    fn bytes_of_part(&self) -> Option<f64> {
        None
    }

    /// Bandwidth, Hz, in which it sees the light of a single mode; `None` where the optics choose the light.
    fn bandwidth_of_mode(&self) -> Option<f64> {
        None
    }

    /// A clause for people: each detector or pixel has this for itself, which is never busy. Empty of a bank that
    /// they share.
    fn unshared(&self) -> &'static str {
        ""
    }

    /// Why a receiver finds nothing in its record of light: a sentence for people.
    fn why_nothing_is_found(&self) -> &'static str;

    /// The record of one shot in which nothing was detected, of a shot that sends such light; `None` of a record that
    /// is not made shot by shot.
    fn blank(&self, _emission: &Emission, _clock: Clock) -> Option<Given> {
        None
    }

    /// Gives `add` the numbers that decide how its record is decoded, beside those of the clock.
    fn numbers(&self, _add: &mut dyn FnMut(&[u64])) {}
}

impl Readout {
    /// The model of its kind.
    pub fn model(&self) -> &dyn Model {
        match self {
            Self::Tdc(tdc) => tdc,
            Self::Adc => &Adc,
            Self::Histogram(histogram) => histogram,
            Self::Taps => &Taps,
            Self::Spectrum(spectrum) => spectrum,
        }
    }

    /// The kind of record that it makes.
    pub fn records(&self) -> RecordKind {
        self.model().records()
    }

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
}

impl Model for Tdc {
    fn records(&self) -> RecordKind {
        RecordKind::Ticks
    }

    fn tick_key(&self) -> &'static str {
        "tdc.resolution_ps"
    }

    fn why_nothing_is_found(&self) -> &'static str {
        "the receiver decoded none of the macropulses; the rejects say why"
    }

    /// All converters are free in the beginning, which they are after each dead time in which few events come.
    fn memory_fs(&self) -> i64 {
        DEAD_TIMES * self.dead_fs
    }
}

/// A converter for each detector that samples its signal.
struct Adc;

impl Model for Adc {
    fn records(&self) -> RecordKind {
        RecordKind::Samples
    }

    fn tick_key(&self) -> &'static str {
        "adc.sample_ps"
    }

    fn why_nothing_is_found(&self) -> &'static str {
        "the receiver found none of the echoes in the samples: too little light for the noise, or \
         the channel was blind with its own light"
    }

    fn unshared(&self) -> &'static str {
        "every detector has an ADC of its own, which is never busy"
    }
}

impl Check<'_> {
    /// Refuses ticks, or samples, that are too fine: 2²⁶ of them do not hold the echoes of a shot and of
    /// those in flight with it.
    pub(super) fn too_fine<T>(&self, readout: &Readout) -> Result<T, Error> {
        self.refuse(readout.model().tick_key(), TOO_FINE)
    }

    /// Clock and readout of a detector whose signal is sampled.
    pub(super) fn adc(&self, file: &AdcFile) -> Result<(Clock, Readout), Error> {
        let tick_fs = self.whole_fs("adc.sample_ps", file.sample_ps)?;
        Ok((Clock { tick_fs, period_fs: tick_fs }, Readout::Adc))
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
