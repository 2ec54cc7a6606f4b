//! The limits of the settings of a receiver of beats, and of its record.

use super::super::Error;
use super::super::check::{of_log, require};
use super::{BeatMethod, BeatReceiver, MOST_RETURNS, Ramp};
use crate::{Beats, ShotLog};

/// Refuses settings outside their limits.
pub(super) fn settings(receiver: &BeatReceiver) -> Result<(), Error> {
    let BeatReceiver { gate_fs: (opens, closes), returns, method, .. } = receiver;
    let gate = format!("{opens} to {closes} fs");
    require(opens <= closes, "gate_fs", &gate, "the nearer time of flight first")?;
    require((1..=MOST_RETURNS).contains(returns), "returns", returns, "1 to 8")?;
    let BeatMethod { ramps, wavelength, least_power, photons, max_speed, false_alarm, .. } = method;
    let share = method.least_share;
    require((0.0..=1.0).contains(&share), "least_share", &share, "0 to 1")?;
    require((1..=2).contains(&ramps.len()), "ramps", &ramps.len(), "1 or 2 of them")?;
    for Ramp { bandwidth, seconds } in ramps {
        let is_possible = (1.0..=1e15).contains(&bandwidth.abs());
        require(is_possible, "ramps.bandwidth", bandwidth, "1 to 1e15, of either sign")?;
        require((1e-12..=1e3).contains(seconds), "ramps.seconds", seconds, "1e-12 to 1e3")?;
    }
    if let [one, other] = ramps.as_slice() {
        let is_possible = one.bandwidth.signum() != other.bandwidth.signum();
        let told = "rise or fall both";
        require(is_possible, "ramps", &told, "one that rises and one that falls")?;
    }
    require((1e-9..=1e-2).contains(wavelength), "wavelength", wavelength, "1e-9 to 0.01")?;
    require((0.0..=1e6).contains(least_power), "least_power", least_power, "0 to 1e6")?;
    require((1e-9..=1e18).contains(photons), "photons", photons, "1e-9 to 1e18")?;
    require((0.0..=1e6).contains(max_speed), "max_speed", max_speed, "0 to 1e6")?;
    let is_possible = *false_alarm > 0.0 && *false_alarm < 1.0;
    require(is_possible, "false_alarm", false_alarm, "a number above 0 and below 1")
}

/// Refuses peaks that are not those of the shots.
pub(super) fn record(receiver: &BeatReceiver, log: &ShotLog, beats: &Beats) -> Result<(), Error> {
    of_log(log)?;
    let ramps = receiver.method.ramps.len();
    let is_possible = beats.ramps as usize == ramps;
    require(is_possible, "ramps", &beats.ramps, "as many as the receiver has ramps")?;
    let wanted = log.len().saturating_mul(ramps).saturating_mul(beats.peaks as usize);
    match beats.found.len() == wanted {
        true => Ok(()),
        false => Err(Error::Column {
            column: "found",
            length: beats.found.len(),
            wanted,
            of: "peaks of all shots",
            or: "",
        }),
    }
}
