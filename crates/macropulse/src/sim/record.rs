//! The record of a band, as its receiver is given it: the part of one continuous stream of ticks, or of
//! samples, that belongs to it. Whoever has the stream alone, from a file or from hardware, can cut the same
//! out of it. Samples depend on nothing but light and noise of their time, and those of two bands that
//! overlap are the same. Ticks follow these rules:
//!
//! A band owns the ticks from the beginning of its own to the beginning of the next band's. Behind them it is
//! given those of the next band, as far as light of its shots may arrive. If an event depends on nothing but
//! the light that makes it, these come out of both bands' simulations alike, for all of that light is in
//! both. If it may depend on cells that were blind or converters that were busy, the beginning of the next
//! band is simulated as it will be.

use macropulse_codec::{Given, ShotLog, Tick, Ticks};

use super::{DETECT, READOUT, Setup, Stages, Tally};
use crate::channel::{self, Light, Seen};
use crate::detect::Memory;
use crate::emit::Band;
use crate::tdc::{self, Converted, Wanted};

/// The record of a band.
pub(super) struct Recorded {
    /// Input of the receiver beside its shot log.
    pub given: Given,
    /// Counts taken on the way.
    pub tally: Tally,
}

/// The shots of `band` that its receiver knows, and their record.
pub(super) fn of(setup: &Setup, band: &Band) -> (ShotLog, Given) {
    let design = setup.seen.design;
    let log = band.shot_log(design);
    let light = light(setup, &log);
    let mut memory = Memory::default();
    let recorded = recorded(setup, &mut memory, (band, &log, &light), 0, &mut Stages::begin());
    (design.known(&log), recorded.given)
}

/// Returns the record that the detectors and the readout make of the `light` of the shots of `log`: those of
/// `band` with its guard shots. In its scan, `known` converters are known to have been busy at once.
pub(super) fn recorded(
    setup: &Setup,
    memory: &mut Memory,
    (band, log, light): (&Band, &ShotLog, &Light),
    known: u32,
    stages: &mut Stages,
) -> Recorded {
    let (design, detectors) = (setup.seen.design, setup.detectors);
    let mut tally = Tally::default();
    let span = band.ticks(design).0;
    let samples = || detectors.samples(log, light, &span).map(Given::Samples);
    if let Some(given) = detectors.record_by_shot(log, light).or_else(samples) {
        tally.recorded = given.counted();
        if matches!(given, Given::Histograms(_)) {
            tally.detections = tally.recorded;
        }
        return Recorded { given: stages.done(DETECT, given), tally };
    }
    let response = stages.done(DETECT, detectors.response(log, light, memory));
    let wanted = Wanted { known_busy: known, from: span.start };
    let mut converted = tdc::ticks(design, response, wanted);
    tally.recorded = converted.made;
    cut(setup, memory, (band, log), &mut converted);
    let Converted { ticks, peak_busy, lost, merged, .. } = converted;
    tally.detections = tally.recorded + merged + lost;
    (tally.merged, tally.lost, tally.peak_busy) = (merged, lost, peak_busy);
    Recorded { given: stages.done(READOUT, Given::Ticks(ticks)), tally }
}

/// The light of the shots of `log`, and of all others.
fn light<'a>(setup: &Setup<'a>, log: &ShotLog) -> Light<'a> {
    let Seen { design, scene, .. } = setup.seen;
    channel::light(&setup.seen, log, &scene.trace(design, log))
}

/// Returns the output of the converters for the `light` of the shots of `log`.
fn converted(setup: &Setup, memory: &mut Memory, (log, light): (&ShotLog, &Light)) -> Converted {
    tdc::ticks(setup.seen.design, setup.detectors.response(log, light, memory), Wanted::ALL)
}

/// Drops from `converted` the ticks of the guard shots that do not belong to the band.
fn cut(
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
    // Shots fired before the last gate closes of any shot whose light is looked at.
    let closes_fs = seen.end * design.clock.tick_fs + design.cut().listening_fs;
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
