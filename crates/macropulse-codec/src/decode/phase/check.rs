//! The limits of the settings of a receiver of taps, and of its record.

use super::super::Error;
use super::super::check::{of_log, require};
use super::{PhaseMethod, PhaseReceiver, Tone};
use crate::time::s_from_fs;
use crate::{ShotLog, Taps};

/// Periods of a modulation frequency in the gate at most: each is a candidate for each shot.
const MOST_PERIODS: f64 = 65_536.0;

/// Refuses settings outside their limits.
pub(super) fn settings(receiver: &PhaseReceiver) -> Result<(), Error> {
    let PhaseReceiver { gate_fs: (opens, closes), method } = receiver;
    let gate = format!("{opens} to {closes} fs");
    require(opens <= closes, "gate_fs", &gate, "the nearer time of flight first")?;
    let tones = method.tones.len();
    require((1..=16).contains(&tones), "tones", &tones, "1 to 16 of them")?;
    for tone in &method.tones {
        let Tone { hz, phases, contrasts } = tone;
        require((1.0..=1e12).contains(hz), "tones.hz", hz, "1 to 1e12")?;
        let periods = (s_from_fs(*closes) - s_from_fs(*opens)) * hz;
        let told = format!("{hz} with a gate of {periods:.0} periods");
        require(periods <= MOST_PERIODS, "tones.hz", &told, "a gate of 65536 periods or fewer")?;
        let is_possible = (3..=Tone::MOST_PHASES).contains(phases);
        require(is_possible, "tones.phases", phases, "3 to 64")?;
        let many = contrasts.len();
        let is_possible = (1..=Tone::MOST_HARMONICS).contains(&many);
        require(is_possible, "tones.contrasts", &many, "1 to 64 of them")?;
        for contrast in contrasts {
            let is_possible = (-2.0..=2.0).contains(contrast);
            require(is_possible, "tones.contrasts", contrast, "-2 to 2")?;
        }
        let first = contrasts[0];
        require(first >= 1e-6, "tones.contrasts", &first, "1e-6 or more for the first of them")?;
    }
    let gain = method.electrons_per_code;
    require((1e-6..=1e9).contains(&gain), "electrons_per_code", &gain, "1e-6 to 1e9")?;
    let dark = method.dark_code;
    require((0.0..=65_535.0).contains(&dark), "dark_code", &dark, "0 to 65535")?;
    let noise = method.read_noise;
    require((0.0..=1e9).contains(&noise), "read_noise", &noise, "0 to 1e9")?;
    let rate = method.false_alarm;
    require(rate > 0.0 && rate < 1.0, "false_alarm", &rate, "a number above 0 and below 1")
}

/// Refuses a number of taps of a shot that is not that of all phases.
pub(super) fn taps(method: &PhaseMethod, taps: u32) -> Result<(), Error> {
    let wanted: u32 = method.tones.iter().map(|tone| tone.phases).sum();
    require(taps == wanted, "taps", &taps, "as many as the tones have phases")
}

/// Refuses codes that are not those of the shots.
pub(super) fn record(receiver: &PhaseReceiver, log: &ShotLog, taps: &Taps) -> Result<(), Error> {
    of_log(log)?;
    self::taps(&receiver.method, taps.taps)?;
    let wanted = log.len().saturating_mul(taps.taps as usize);
    match taps.codes.len() == wanted {
        true => Ok(()),
        false => Err(Error::Column {
            column: "codes",
            length: taps.codes.len(),
            wanted,
            of: "taps of all shots",
            or: "",
        }),
    }
}
