//! Requirements on the input of a receiver; all else is refused before it is looked at.

use std::ops::Range;

use super::{Coupling, Error, MOST_RETURNS, Method, Receiver, Sampling};
use crate::code::Codebook;
use crate::kernels::ascends;
use crate::{Record, Samples, ShotLog, Ticks};

/// Ticks of a macropulse that a correlating receiver can keep: 65535 chips of 256 ticks. The bits
/// of a code word are kept several times, 2 MB each at this length.
const LONGEST: u64 = 1 << 24;

/// Ticks over which light may be looked for, with the length of a macropulse. The matched receiver keeps up
/// to thirty-two bits for each: 270 MB.
const FARTHEST: u64 = 1 << 26;

/// How far from the epoch of the ticks a shot may be fired, in ticks: as far as these are counted.
const COUNTED: i128 = 1 << 32;

/// Ticks that times may be beyond the light of a shot, by rounding and jitter.
const SLACK: i128 = 1 << 13;

/// Refuses what cannot be decoded, but for ticks out of order where the receiver sees to it itself. All other ticks
/// are read once; nothing else is as long as they are.
pub(super) fn check(
    receiver: &Receiver,
    (codebook, log): (&Codebook, &ShotLog),
    record: Record,
) -> Result<(), Error> {
    settings(receiver, codebook)?;
    of_log(log)?;
    match record {
        Record::Ticks(ticks) => of_ticks(receiver, ticks)?,
        Record::Samples(samples) => of_samples(samples)?,
        _ => {}
    }
    in_codebook(log, codebook)?;
    in_time(receiver, (codebook, log), record)
}

/// Refuses settings outside their limits, and code words that the receiver does not understand or has no memory
/// for.
pub(super) fn settings(receiver: &Receiver, codebook: &Codebook) -> Result<(), Error> {
    let &Receiver { tick_fs, gate_ticks: (nearest, farthest), returns, ref method, .. } = receiver;
    if farthest < nearest {
        return Err(Error::Gate { nearest, farthest });
    }
    require(tick_fs >= 1, "tick_fs", &tick_fs, "1 or more")?;
    require((1..=MOST_RETURNS).contains(&returns), "returns", &returns, "1 to 8")?;
    let jitter = method.jitter_ticks();
    let is_possible = jitter.is_finite() && jitter >= 0.0;
    require(is_possible, "jitter_ticks", &jitter, "0 or a positive number")?;
    if let Some(rate) = method.false_alarm() {
        require(rate.is_finite() && rate > 0.0, "false_alarm", &rate, "a positive number")?;
    }
    if let Some(known) = method.sampling() {
        sampling(known)?;
    }
    let Some(ticks_per_chip) = method.ticks_per_chip() else { return Ok(()) };
    require(ticks_per_chip >= 1, "ticks_per_chip", &ticks_per_chip, "1 or more")?;
    if codebook.zeros_are_lit() && !matches!(method, Method::Balanced(_)) {
        return Err(Error::LitZeros);
    }
    let (length, reach) = (length(receiver, codebook), reach(receiver, codebook));
    let too_long = |what, ticks, possible| Err(Error::TooLong { what, ticks, possible });
    match () {
        () if length > LONGEST => too_long("a macropulse", length, LONGEST),
        () if reach > FARTHEST => too_long("a time of flight, with a macropulse,", reach, FARTHEST),
        () => Ok(()),
    }
}

/// Refuses the value of a setting that does not hold.
pub(super) fn require(
    holds: bool,
    setting: &'static str,
    value: &dyn ToString,
    possible: &'static str,
) -> Result<(), Error> {
    match holds {
        true => Ok(()),
        false => Err(Error::Setting { setting, value: value.to_string(), possible }),
    }
}

/// Refuses what no signal can be like.
fn sampling(sampling: &Sampling) -> Result<(), Error> {
    let &Sampling { ref pulse, excess, full_scale, least_marks, coupling, .. } = sampling;
    let entries = format!("{} entries long", pulse.len());
    let is_possible = pulse.len() % 2 == 1 && pulse.len() <= Sampling::MOST_ENTRIES;
    require(is_possible, "sampling.pulse", &entries, "an odd number of entries up to 16383")?;
    for value in pulse {
        let is_possible = value.is_finite() && value.abs() <= 1e9;
        require(is_possible, "sampling.pulse", value, "codes of one photon, finite and small")?;
    }
    let middle = pulse[pulse.len() / 2];
    let told = format!("{middle} in its middle");
    let possible = "a pulse that is there at the time of its mark";
    require(middle >= 1e-9, "sampling.pulse", &told, possible)?;
    let is_possible = excess.is_finite() && (1.0..=1e9).contains(&excess);
    require(is_possible, "sampling.excess", &excess, "1 (no excess noise) or more")?;
    require(full_scale >= 1, "sampling.full_scale", &full_scale, "1 to 32767")?;
    if let Some(Coupling { low_cutoff, limit }) = coupling {
        let is_possible = low_cutoff.is_finite() && (0.0..=1.0).contains(&low_cutoff);
        require(is_possible, "sampling.coupling.low_cutoff", &low_cutoff, "0 to 1")?;
        let is_possible = limit.is_finite() && (f64::from(full_scale)..=1e9).contains(&limit);
        require(is_possible, "sampling.coupling.limit", &limit, "full_scale or more")?;
    }
    require(least_marks > 0, "sampling.least_marks", &least_marks, "1 or more")
}

/// Refuses a range gate whose lags cannot all be told one by one. A receiver that takes the first ticks as
/// they come needs no memory for them, and its explanation does.
pub(super) fn check_lags(receiver: &Receiver) -> Result<(), Error> {
    let (what, ticks) = ("a time of flight that is explained", u64::from(receiver.gate_ticks.1));
    match ticks > FARTHEST {
        true => Err(Error::TooLong { what, ticks, possible: FARTHEST }),
        false => Ok(()),
    }
}

/// Length of a macropulse, in ticks; 0 without a code.
fn length(receiver: &Receiver, codebook: &Codebook) -> u64 {
    u64::from(codebook.chips()) * u64::from(receiver.method.ticks_per_chip().unwrap_or(0))
}

/// Ticks after firing in which light is looked for.
fn reach(receiver: &Receiver, codebook: &Codebook) -> u64 {
    u64::from(receiver.gate_ticks.1.max(receiver.method.light_ticks())) + length(receiver, codebook)
}

/// Refuses columns that are not as long as the one beside them, and shots out of order.
pub(super) fn of_log(log: &ShotLog) -> Result<(), Error> {
    let shots = log.len();
    let of_log = [
        ("row", log.row.len()),
        ("column", log.column.len()),
        ("label", log.label.len()),
        ("word", log.word.len()),
        ("channel", log.channel.len()),
    ];
    if let Some((column, length)) = of_log.into_iter().find(|(_, length)| *length != shots) {
        return Err(Error::Column { column, length, wanted: shots, of: "shots", or: "" });
    }
    let owned = &log.owned;
    if owned.start > owned.end || owned.end > shots {
        return Err(Error::Owned { start: owned.start, end: owned.end, shots });
    }
    let fired = &log.fired_at_fs;
    if fired.is_sorted() {
        return Ok(());
    }
    let before = fired.windows(2).position(|pair| pair[1] < pair[0]).unwrap_or(0);
    Err(Error::ShotsDoNotAscend { shot: before + 1 })
}

fn of_ticks(receiver: &Receiver, ticks: &Ticks) -> Result<(), Error> {
    let events = ticks.tick.len();
    let of_ticks = [("channel", ticks.channel.len()), ("amplitude", ticks.amplitude.len())];
    let is_uneven = |(_, length): &(_, usize)| *length != events && *length != 0;
    if let Some((column, length)) = of_ticks.into_iter().find(is_uneven) {
        let (of, or) = ("ticks", ", or none at all");
        return Err(Error::Column { column, length, wanted: events, of, or });
    }
    let channels = &ticks.channel;
    if let Some(before) = channels.windows(2).position(|pair| pair[1] < pair[0]) {
        let (before, channel, place) = (channels[before], channels[before + 1], before + 1);
        return Err(Error::ChannelsDoNotAscend { place, channel, before });
    }
    if channels.is_empty() {
        // The matched receiver sees to it as it goes: macropulses without a gap are in order.
        return match receiver.method {
            Method::Matched(..) => Ok(()),
            _ => in_order(&ticks.tick, 0..events),
        };
    }
    let mut begin = 0;
    while begin < events {
        let end = channels.partition_point(|other| *other <= channels[begin]);
        in_order(&ticks.tick, begin..end)?;
        begin = end;
    }
    Ok(())
}

/// Refuses `ticks` if those at `places` do not ascend.
pub(super) fn in_order(ticks: &[u32], places: Range<usize>) -> Result<(), Error> {
    let (begin, some) = (places.start, &ticks[places]);
    if ascends(some) {
        return Ok(());
    }
    let falls = some.windows(2).position(|pair| pair[1] <= pair[0]).unwrap_or(0);
    let (before, place) = (some[falls], begin + falls + 1);
    Err(Error::TicksDoNotAscend { place, tick: ticks[place], before })
}

fn of_samples(samples: &Samples) -> Result<(), Error> {
    let Samples { channel: channels, code, .. } = samples;
    if let Some(before) = channels.windows(2).position(|pair| pair[1] <= pair[0]) {
        let (before, channel, place) = (channels[before], channels[before + 1], before + 1);
        return Err(Error::SampledChannelsDoNotAscend { place, channel, before });
    }
    let (codes, channels) = (code.len(), channels.len());
    match codes.checked_rem(channels).unwrap_or(codes) {
        0 => Ok(()),
        _ => Err(Error::UnevenSamples { codes, channels }),
    }
}

fn in_codebook(log: &ShotLog, codebook: &Codebook) -> Result<(), Error> {
    let columns =
        [("label", &log.label, codebook.labels()), ("word", &log.word, codebook.words() as u32)];
    for (what, column, there_are) in columns {
        let highest = column.iter().fold(0, |highest, number| highest.max(*number));
        if !column.is_empty() && u32::from(highest) >= there_are {
            let shot = column.iter().position(|number| *number == highest).unwrap_or(0);
            let last = there_are.saturating_sub(1);
            return Err(Error::NotInCodebook { shot, what, number: highest, last });
        }
    }
    Ok(())
}

/// Checks that all times can be counted: those of light in femtoseconds, and of shots in ticks.
fn in_time(
    receiver: &Receiver,
    (codebook, log): (&Codebook, &ShotLog),
    record: Record,
) -> Result<(), Error> {
    let (epoch, is_dark) = match record {
        Record::Ticks(ticks) => (ticks.epoch, ticks.tick.is_empty()),
        Record::Samples(samples) => (samples.epoch, samples.is_empty()),
        _ => (0, true),
    };
    let ends = [log.fired_at_fs.first(), log.fired_at_fs.last()];
    for (shot, fired_at_fs) in [0, log.len().wrapping_sub(1)].into_iter().zip(ends) {
        let Some(&fired_at_fs) = fired_at_fs else { continue };
        let tick_fs = i128::from(receiver.tick_fs);
        let fired = i128::from(fired_at_fs);
        let light = i128::from(reach(receiver, codebook)) + SLACK;
        let is_counted = |time: i128| i64::try_from(time).is_ok();
        if !is_counted(fired - light * tick_fs) || !is_counted(fired + light * tick_fs) {
            return Err(Error::Time { shot, fired_at_fs });
        }
        let after = fired.div_euclid(tick_fs) - i128::from(epoch);
        if !is_dark && !(-COUNTED..=COUNTED).contains(&after) {
            let ticks = i64::try_from(after).unwrap_or(if after < 0 { i64::MIN } else { i64::MAX });
            return Err(match record {
                Record::Samples(_) => Error::FarFromSamples { shot, ticks },
                _ => Error::FarFromTicks { shot, ticks },
            });
        }
    }
    Ok(())
}
