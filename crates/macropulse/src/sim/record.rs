//! What the receiver is given of a band: the part of one continuous stream of ticks, or of samples, that
//! belongs to it, so that who has the stream alone, from a file or from hardware, can cut the same out of
//! it. Samples depend on nothing but light and noise of their time, and those of two bands that overlap
//! are the same. Of ticks:
//!
//! A band owns the ticks from where its own begin to where those of the next band do. Behind them it
//! is given those of the next band, as far as light of its shots may arrive. These come out of the
//! band's own simulation as they do of the next one's where an event depends on nothing but the
//! light that makes it, for all of that is in both. Where it may depend on more, cells that were
//! blind or converters that were busy, the beginning of the next band is simulated as it will be.

use macropulse_codec::{Given, ShotLog, Tick, Ticks};

use super::Setup;
use crate::channel::{self, Light, Seen};
use crate::detect::Memory;
use crate::emit::Band;
use crate::tdc::{self, Converted, Wanted};

/// What the receiver is given of `band`: its shots, and its ticks or samples.
pub(super) fn of(setup: &Setup, band: &Band) -> (ShotLog, Given) {
    let design = setup.seen.design;
    let log = band.shot_log(design);
    let known = design.cut().known(&log);
    let light = light(setup, &log);
    if let Some(samples) = setup.detectors.samples(&log, &light, &band.ticks(design).0) {
        return (known, Given::Samples(samples));
    }
    let mut memory = Memory::default();
    let mut converted = converted(setup, &mut memory, (&log, &light));
    cut(setup, &mut memory, (band, &log), &mut converted);
    (known, Given::Ticks(converted.ticks))
}

/// The light of the shots of `log`, and of all others.
fn light<'a>(setup: &Setup<'a>, log: &ShotLog) -> Light<'a> {
    let Seen { design, scene, .. } = setup.seen;
    channel::light(&setup.seen, log, &scene.trace(design, log))
}

/// What the converters make of the light of the shots of `log`.
fn converted(setup: &Setup, memory: &mut Memory, (log, light): (&ShotLog, &Light)) -> Converted {
    tdc::ticks(setup.seen.design, setup.detectors.response(log, light, memory), Wanted::ALL)
}

/// Leaves of what was `converted` of a band, with its guard shots, the ticks that belong to it.
pub(super) fn cut(
    setup: &Setup,
    memory: &mut Memory,
    (band, log): (&Band, &ShotLog),
    converted: &mut Converted,
) {
    let design = setup.seen.design;
    let (seen, own) = band.ticks(design);
    let is_the_same = !design.detector.model().has_state() && converted.lost == 0;
    if is_the_same || own.end >= seen.end {
        converted.ticks.keep(&seen);
        return;
    }
    let next = band.next(design).shot_log(design);
    // What is fired while gates are open of shots whose light is looked at.
    let closes_fs = seen.end * design.tdc.tick_fs + design.cut().listening_fs;
    let shots = next.fired_at_fs.partition_point(|fired| *fired <= closes_fs);
    let next = next.part(0..shots);
    let mut later = self::converted(setup, memory, (&next, &light(setup, &next))).ticks;
    later.keep(&(own.end..seen.end));
    converted.ticks.keep(&own);
    append(&mut converted.ticks, &later);
    debug_assert_eq!(converted.ticks.epoch, design.cut().epoch(log.fired_at_fs[0]));
}

/// Adds ticks that come `later`, whatever they are counted from.
fn append(ticks: &mut Ticks, later: &Ticks) {
    let kinds =
        [ticks, later].map(|ticks| (!ticks.channel.is_empty(), !ticks.amplitude.is_empty()));
    let stream: Vec<Tick> = [ticks.stream(), later.stream()].concat();
    let kind = (kinds[0].0 || kinds[1].0, kinds[0].1 || kinds[1].1);
    *ticks = Ticks::of(&stream, ticks.epoch, kind);
}
