//! From detection events to ticks: `[tdc]`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::limits::Check;
use super::{Error, Scan};
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

/// The bank of time-to-digital converters; of a sampled detector, which has none, its clock.
#[derive(Debug, Clone, PartialEq)]
pub struct Tdc {
    /// Converters in the bank (for all detectors together).
    pub converters: u32,
    /// Length of a tick, fs.
    pub tick_fs: i64,
    /// Period of the counter of whole clock ticks, fs.
    pub clock_fs: i64,
    /// Time for which a converter is busy with one event, fs.
    pub dead_fs: i64,
}

/// Converters start so many dead times before the first ticks of a band, as Geiger cells do.
const DEAD_TIMES: i64 = 4;

impl Tdc {
    /// Ticks for which a converter is busy with one event, rounded up.
    pub fn dead_ticks(&self) -> u32 {
        u32::try_from((self.dead_fs + self.tick_fs - 1) / self.tick_fs).unwrap_or(u32::MAX)
    }

    /// For how long, fs, the state of the bank depends on the events that it was given. All converters are
    /// free in the beginning, which they are after each dead time in which few events come.
    pub(super) fn memory_fs(&self) -> i64 {
        DEAD_TIMES * self.dead_fs
    }
}

impl Check<'_> {
    /// The time of a sampled detector, `sample_ps` from tick to tick, which has no converters of events.
    pub(super) fn sampling_clock(&self, sample_ps: f64) -> Result<Tdc, Error> {
        let tick_fs = self.whole_fs("detector.sampled.sample_ps", sample_ps)?;
        Ok(Tdc { converters: 0, tick_fs, clock_fs: tick_fs, dead_fs: 0 })
    }

    pub(super) fn tdc(&self, file: &TdcFile) -> Result<Tdc, Error> {
        let Some(resolution) = file.resolution_ps else {
            let message = "missing field `resolution_ps`";
            return Err(self.chain.lacks("tdc.resolution_ps", message));
        };
        let tick_fs = self.whole_fs("tdc.resolution_ps", resolution)?;
        let clock_fs = self.whole_fs("tdc.clock_ps", file.clock_ps)?;
        let bits = self.count("tdc.bits", file.bits, 1, 16)?;
        if clock_fs % tick_fs != 0 {
            return self.refuse("tdc.clock_ps", "must be a whole number of ticks (resolution_ps)");
        }
        if clock_fs / tick_fs > 1 << bits {
            let message = format!(
                "{bits} bits hold {} ticks, but a clock period has {}",
                1 << bits,
                clock_fs / tick_fs
            );
            return self.refuse("tdc.bits", message);
        }
        let dead = self.within("tdc.dead_time_ns", file.dead_time_ns, 0.0, 1e6)?;
        Ok(Tdc {
            converters: self.count("tdc.converters", file.converters, 1, 1 << 24)?,
            tick_fs,
            clock_fs,
            dead_fs: fs_from_s(dead * 1e-9),
        })
    }

    /// Whether each detector of `scan` has a converter.
    pub(super) fn share(&self, tdc: &Tdc, scan: &Scan) -> Result<(), Error> {
        let (converters, channels) = (tdc.converters, scan.channels());
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
