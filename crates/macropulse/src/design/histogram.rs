//! Counts of the pulses of a burst, bin by bin: `[histogram]`.

use std::sync::Arc;

use macropulse_codec::decode::histogram::{PileUp, Pulse};
use macropulse_codec::decode::{HistogramMethod, Method};
use macropulse_codec::{Given, Histograms, RecordKind};
use schemars::JsonSchema;
use serde::Deserialize;

use super::check::{OptionalTable, SensorFile};
use super::detector::Arming;
use super::limits::{Check, Idle};
use super::readout::Model;
use super::receiver::{Inputs, PileUpFile, ReceiverFile};
use super::{Clock, Detector, Emission, Error, Readout, Scan};
use crate::units::{FS_PER_S, fs_from_s, tof_from_range};

/// Bytes of a bin in the memory of a run: its count, and the same once more while it is written.
const PER_BIN: f64 = 8.0;

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

impl Model for Histogram {
    fn records(&self) -> RecordKind {
        RecordKind::Histograms
    }

    fn tick_key(&self) -> &'static str {
        "histogram.bin_ps"
    }

    fn why_nothing_is_found(&self) -> &'static str {
        "the receiver found none of the echoes in the histograms: too little light for the background"
    }

    fn blank(&self, emission: &Emission, clock: Clock) -> Option<Given> {
        Some(Given::Histograms(Histograms {
            bin_fs: clock.tick_fs,
            offset_fs: 0,
            bins: self.bins,
            cycles: vec![emission.burst()?.pulses],
            counts: vec![0; self.bins as usize],
        }))
    }

    fn bytes_of_part(&self) -> Option<f64> {
        Some(f64::from(self.bins) * PER_BIN)
    }

    fn unshared(&self) -> &'static str {
        "every pixel has a histogram of its own, which is never busy"
    }
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
    pulse: Option<Vec<f64>>,
}

impl OptionalTable for HistogramFile {
    fn idle(&self, _: &SensorFile) -> Vec<Idle> {
        let why = "counts go into bins, and no converter times them";
        let mut idle = Idle::all(&["tdc"], "histogram", why);
        if self.pulse.is_some() {
            let why = "the pulse that was measured has it in it";
            idle.extend(Idle::all(&["detector.geiger.jitter_ps"], "histogram.pulse", why));
        }
        idle
    }
}

impl Check<'_> {
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

    /// How a receiver decodes histograms; `None` without one.
    pub(super) fn of_histograms(
        &self,
        file: &ReceiverFile,
        inputs: &Inputs,
        false_alarm: f64,
    ) -> Result<Option<Method>, Error> {
        let Some(histogram) = inputs.readout.histogram() else { return Ok(None) };
        let (cells, piles_up) = match inputs.detector {
            Some(Detector::Geiger(geiger)) => (geiger.cells, geiger.arming == Arming::OncePerPulse),
            _ => (1, false),
        };
        let pile_up = match (file.pile_up, piles_up) {
            (Some(PileUpFile::Coates), false) => {
                return self.refuse(
                    "receiver.pile_up",
                    "`coates` corrects cells that count once a pulse: arming = \"once-per-pulse\", or \"none\"",
                );
            }
            (Some(PileUpFile::None), _) | (None, false) => PileUp::None,
            (Some(PileUpFile::Coates) | None, true) => PileUp::Coates,
        };
        let share = |key, typed: Option<f64>| self.within(key, typed.unwrap_or(0.0), 0.0, 1.0);
        Ok(Some(Method::Histogram(HistogramMethod {
            pile_up,
            cells,
            pulse: histogram.pulse(inputs.pulse),
            false_alarm,
            shape_error: share("receiver.shape_error", file.shape_error)?,
            least_share: share("receiver.least_share", file.least_share)?,
        })))
    }

    /// Checks that bursts and histograms go together. A sensor that repeats pulses adds up their counts, in
    /// bins that lie within a cycle and hold the range gate.
    pub(super) fn cycles(
        &self,
        file: &SensorFile,
        emission: &Emission,
        (clock, readout): (Clock, &Readout),
        scan: &Scan,
    ) -> Result<(), Error> {
        let (burst, histogram) = match (emission.burst(), readout.histogram()) {
            (None, None) => return Ok(()),
            (Some(_), None) => {
                return self.refuse("burst", "is added up in a [histogram], which is missing");
            }
            (None, Some(_)) => {
                let message = "adds up the pulses of a [burst], which is missing";
                return Err(self.chain.lacks("histogram", message));
            }
            (Some(burst), Some(histogram)) => (burst, histogram),
        };
        if file.detector.only().is_none_or(|only| only.name != "geiger") {
            return self.refuse("detector", "must be `geiger` where counts go into a [histogram]");
        }
        let last_fs = i64::from(histogram.bins) * clock.tick_fs;
        if last_fs > burst.interval_fs {
            let most = burst.interval_fs / clock.tick_fs;
            let message = format!("is {}, but between two pulses lie {most} bins", histogram.bins);
            return self.refuse("histogram.bins", message);
        }
        let last = fs_from_s(tof_from_range(scan.max_range)) / clock.tick_fs;
        if last >= i64::from(histogram.bins) {
            let message = format!(
                "is {}, but the range gate ends in bin {last}: more bins, or a shorter max_range_m",
                histogram.bins
            );
            return self.refuse("histogram.bins", message);
        }
        Ok(())
    }
}
