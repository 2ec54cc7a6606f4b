//! Single pulses that a shot sends again and again: `[burst]`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::emission::{Model, Occupancy};
use super::limits::Check;
use super::{Clock, Coding, Error};
use crate::units::fs_from_s;

/// Equal pulses at a fixed interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Burst {
    /// The pulse, as a code word of one mark.
    pub pulse: Coding,
    /// Pulses of a shot.
    pub pulses: u32,
    /// Time from pulse to pulse, fs: a whole number of ticks.
    pub interval_fs: i64,
}

impl Model for Burst {
    fn coding(&self) -> &Coding {
        &self.pulse
    }

    fn length_fs(&self) -> i64 {
        i64::from(self.pulses - 1) * self.interval_fs + self.pulse.length_fs()
    }

    fn share_within(&self, seconds: f64) -> f64 {
        let within = fs_from_s(seconds) / self.interval_fs + 1;
        (within as f64 / f64::from(self.pulses)).min(1.0)
    }

    fn occupancy(&self) -> Option<Occupancy> {
        Some(Occupancy {
            fs: i64::from(self.pulses) * self.interval_fs,
            table: "burst",
            with: " with the interval behind its last pulse",
            remedy: "fewer pulses, a shorter interval",
        })
    }

    fn numbers(&self, add: &mut dyn FnMut(&[u64])) {
        add(&[self.pulses.into(), self.interval_fs as u64]);
    }
}

/// `[burst]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct BurstFile {
    /// Pulses of a shot.
    #[schemars(range(min = 1, max = 16777216))]
    pulses: u32,
    /// Time from pulse to pulse, ns: a whole number of ticks.
    #[schemars(range(min = 0.001, max = 1e6))]
    interval_ns: f64,
}

impl Check<'_> {
    /// The burst of `pulse`.
    pub(super) fn burst(
        &self,
        file: &BurstFile,
        pulse: Coding,
        clock: Clock,
    ) -> Result<Burst, Error> {
        let key = "burst.interval_ns";
        let interval_fs =
            self.whole_fs(key, self.within(key, file.interval_ns, 1e-3, 1e6)? * 1e3)?;
        if interval_fs % clock.tick_fs != 0 {
            return self.refuse(key, "must be a whole number of ticks, of which a bin is one");
        }
        let pulses = self.count("burst.pulses", file.pulses, 1, 1 << 24)?;
        Ok(Burst { pulse, pulses, interval_fs })
    }
}
