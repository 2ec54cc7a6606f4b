//! Checks of settings, shot log and histograms before the receiver decodes them.

use super::pile_up::PileUp;
use super::pulse::{Kernel, Pulse, is_length};
use super::{Error, HistogramReceiver, MOST_RETURNS};
use crate::decode::check::of_log;
use crate::{Histograms, ShotLog};

/// Bins of a histogram at most.
const MOST_BINS: u32 = 1 << 16;

/// Products of a bin and an entry of the pulse that a histogram may take: a fraction of a second.
const MOST_WORK: usize = 1 << 24;

/// Times further from the firing are not counted, fs.
const FARTHEST_FS: i64 = 1 << 62;

/// Entries of a measured pulse are no larger.
const MOST_LIGHT: f64 = 1e12;

fn refuse<T>(setting: &'static str, value: String, possible: &'static str) -> Result<T, Error> {
    Err(Error::Setting { setting, value, possible })
}

/// Refuses settings outside their limits.
pub(super) fn settings(receiver: &HistogramReceiver) -> Result<(), Error> {
    let (nearest, farthest) = receiver.gate_fs;
    if nearest > farthest {
        let value = format!("{nearest} to {farthest}");
        return refuse("gate_fs", value, "a gate that does not end before it begins");
    }
    match &receiver.method.pulse {
        Pulse::Gaussian { rms_fs } if !is_length(*rms_fs) => {
            return refuse("pulse.rms_fs", rms_fs.to_string(), "1 to 1e15");
        }
        Pulse::Measured { counts, origin } => {
            if let Some(count) = counts.iter().find(|count| !(0.0..=MOST_LIGHT).contains(*count)) {
                return refuse("pulse.counts", count.to_string(), "counts from 0 to 1e12");
            }
            if !(0.0..=MOST_LIGHT).contains(&origin.abs()) {
                return refuse("pulse.origin", origin.to_string(), "a number up to 1e12");
            }
        }
        Pulse::Gaussian { .. } => {}
    }
    if !(receiver.method.false_alarm > 0.0 && receiver.method.false_alarm.is_finite()) {
        return refuse("false_alarm", receiver.method.false_alarm.to_string(), "a positive number");
    }
    let shares = [
        ("shape_error", receiver.method.shape_error),
        ("least_share", receiver.method.least_share),
    ];
    if let Some((setting, share)) =
        shares.into_iter().find(|(_, share)| !(0.0..=1.0).contains(share))
    {
        return refuse(setting, share.to_string(), "0 to 1");
    }
    match (1..=MOST_RETURNS).contains(&receiver.returns) {
        true => Ok(()),
        false => refuse("returns", receiver.returns.to_string(), "1 to 8"),
    }
}

/// Refuses a log and histograms that do not belong together, and counts that no detector has.
pub(super) fn record(
    receiver: &HistogramReceiver,
    log: &ShotLog,
    histograms: &Histograms,
) -> Result<(), Error> {
    of_log(log)?;
    let Histograms { bin_fs, offset_fs, bins, cycles, counts } = histograms;
    if *bin_fs < 1 {
        return refuse("bin_fs", bin_fs.to_string(), "1 or more");
    }
    if !(-FARTHEST_FS..=FARTHEST_FS).contains(offset_fs) {
        return refuse("offset_fs", offset_fs.to_string(), "times up to ±4.6e18 fs");
    }
    if !(1..=MOST_BINS).contains(bins) {
        return refuse("bins", bins.to_string(), "1 to 65536");
    }
    let (shots, all) = (log.len(), log.len().saturating_mul(*bins as usize));
    let columns = [
        ("cycles", cycles.len(), shots, "shots"),
        ("counts", counts.len(), all, "bins of all shots"),
    ];
    for (column, length, wanted, of) in columns {
        if length != wanted {
            return Err(Error::Column { column, length, wanted, of, or: "" });
        }
    }
    if receiver.method.pile_up == PileUp::None {
        return Ok(());
    }
    for shot in log.owned.clone() {
        let counted: u64 = histograms.of(shot).iter().map(|count| u64::from(*count)).sum();
        let cycles = super::trials(receiver, cycles[shot]);
        if counted > u64::from(cycles) {
            return Err(Error::MoreThanCycles { shot, counted, cycles });
        }
    }
    Ok(())
}

/// A pulse that has no kernel in bins of the histograms.
pub(super) fn unusable(pulse: &Pulse) -> Error {
    let (setting, value) = match pulse {
        Pulse::Gaussian { rms_fs } => ("pulse.rms_fs", rms_fs.to_string()),
        Pulse::Measured { counts, .. } => ("pulse.counts", format!("{} entries", counts.len())),
    };
    Error::Setting { setting, value, possible: "a pulse with light in 1 to 4096 bins" }
}

/// Refuses what would take too long.
pub(super) fn work(kernel: &Kernel, histograms: &Histograms) -> Result<(), Error> {
    let bins = histograms.bins as usize;
    if kernel.length.saturating_mul(bins) <= MOST_WORK {
        return Ok(());
    }
    let value = format!("{} bins long in histograms of {bins}", kernel.length);
    refuse("pulse", value, "a product of both up to 16777216")
}
