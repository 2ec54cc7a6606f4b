//! Light from beyond the gate that passes for an echo within it.
//!
//! Code words repeat after some shots. An echo from beyond the gate, of an earlier shot in the same word, arrives in
//! the gate of a later one. If both payloads have bits in common, it looks like a faint echo of the later shot. The
//! receiver knows both macropulses, and compares them at the same place, or whole bits beside it. A share c of the
//! marks that both have is lit. Marks that only one of them has are lit with the share c if the light is of that one.
//! If it is of the other, they are lit with the share d of all lit places. The return is given up if the light is of
//! the earlier shot with odds of [`ODDS`] to one.

use std::cell::Cell;
use std::ops::Range;

use super::field::{self, Field};
use super::{Correlation, Receiver, Reject, Return, Returns};
use crate::code::Codebook;
use crate::{ShotLog, Ticks};

/// One in this number of returns that are compared with an earlier shot may be given up wrongly.
const ODDS: f64 = 1000.0;

thread_local! {
    /// Kept from band to band: fresh memory costs more than what is done with it.
    static MEMORY: Cell<field::Memory> = Cell::default();
}

/// Takes the returns out of `returns` that light from beyond the gate accounts for better.
pub(super) fn exclude(
    receiver: &Receiver,
    correlation: &Correlation,
    (codebook, log): (&Codebook, &ShotLog),
    ticks: &Ticks,
    returns: &mut Returns,
) {
    let is_doubtful = |one: &Return| one.peak < one.marks;
    let looks_beyond = correlation.light_ticks > receiver.gate_ticks.1;
    if !looks_beyond || !returns.each().any(|one| is_doubtful(&one)) {
        return;
    }
    let fired = receiver.fired_since(log, ticks.epoch);
    // Half of the window in which a mark is looked for, and rounding.
    let slack = 1 + (2.0 * correlation.jitter()).ceil() as u32;
    let width = 2 * slack + 1;
    let length = i64::from(codebook.chips() * correlation.ticks_per_chip);
    // The span to examine for a return: its macropulse, and the same length to both sides.
    let (nearest, farthest) = receiver.gate_ticks;
    let light = |fired: i64| {
        fired + i64::from(nearest) - 2 * length..fired + i64::from(farthest) + 3 * length
    };
    let first = light(fired[returns.shot[0] as usize]);
    let extent = (first.start, first.end - first.start);
    let field = Field::new(&ticks.tick, width, extent, length, MEMORY.take());
    // An upper bound of the lit places, as neighbours overlap.
    let lit = ticks.tick.len() as f64 * f64::from(width);
    let ends = ticks.tick.last().zip(ticks.tick.first());
    let lasts = 1.0 + ends.map_or(0.0, |(last, first)| f64::from(last - first));
    let density = (lit / lasts).clamp(1e-6, 0.999);
    let mut kept = Returns::with_capacity(returns.len());
    kept.add_rejects(returns);
    let mut bench = Bench { receiver, correlation, codebook, log, fired, field, slack, density };
    for one in returns.each() {
        let is_other = is_doubtful(&one) && {
            bench.field.cover(light(bench.fired[one.shot]));
            bench.is_of_an_earlier_shot(&one)
        };
        match is_other {
            true => kept.reject(Reject::OutsideGate),
            false => kept.push(one),
        }
    }
    *returns = kept;
    MEMORY.set(bench.field.into_memory());
}

/// The data that a return is compared with.
struct Bench<'a> {
    receiver: &'a Receiver,
    correlation: &'a Correlation,
    codebook: &'a Codebook,
    log: &'a ShotLog,
    /// Tick in which each shot was fired, from the epoch on.
    fired: Vec<i64>,
    /// A place is lit if light came this number of ticks behind it, or near that.
    field: Field<'a>,
    slack: u32,
    /// Share of the ticks that are.
    density: f64,
}

impl Bench<'_> {
    /// True if an earlier shot, with an echo from beyond the gate, explains the light of `one` better than its own shot
    /// does.
    fn is_of_an_earlier_shot(&self, one: &Return) -> bool {
        let lag = (one.tof * 1e15 / self.receiver.tick_fs as f64) as i64;
        let arrives = self.fired[one.shot] + lag;
        let bit = i64::from(self.codebook.family().length() * self.correlation.ticks_per_chip);
        let bits = self.codebook.payload().map_or(1, |payload| i64::from(payload.bits()));
        let beyond =
            i64::from(self.receiver.gate_ticks.1) + 1..=i64::from(self.correlation.light_ticks);
        let later = Sent { shot: one.shot, begins: arrives };
        self.earlier(one.shot, arrives, bits * bit).any(|shot| {
            (1 - bits..bits).any(|shift| {
                let begins = arrives + shift * bit;
                beyond.contains(&(begins - self.fired[shot]))
                    && self.begins_like(shot, begins, one)
                    && self.is_rather(Sent { shot, begins }, later)
            })
        })
    }

    /// True if the first bit of `shot`, begun at tick `begins`, is lit at least half as well as the marks of `one`.
    /// Nearly every shot is refused here.
    fn begins_like(&self, shot: usize, begins: i64, one: &Return) -> bool {
        let first = self.first_bit(shot);
        let scale = i64::from(self.correlation.ticks_per_chip);
        let is_lit = |mark: &&u16| self.has(begins + scale * i64::from(**mark));
        let lit = first.iter().filter(is_lit).count();
        2 * lit * usize::from(one.marks) >= first.len() * usize::from(one.peak)
    }

    /// The marks of the first bit of `shot` that is lit.
    fn first_bit(&self, shot: usize) -> &[u16] {
        let marks = self.marks(shot);
        let bit = |mark: &u16| u32::from(*mark) / self.codebook.family().length();
        &marks[..marks.partition_point(|mark| bit(mark) == bit(&marks[0]))]
    }

    /// True if the light is more likely of the `earlier` macropulse than of the `later` one.
    fn is_rather(&self, earlier: Sent, later: Sent) -> bool {
        let [both, of_earlier, of_later] = self.compared(earlier, later);
        let lit = (both.lit as f64 + 0.5) / (both.all as f64 + 1.0);
        if lit <= self.density {
            return false;
        }
        // Evidence of each mark for a macropulse that has it: ln(c/d), or ln((1 − c)/(1 − d)).
        let (found, missing) =
            (libm::log(lit / self.density), libm::log((1.0 - lit) / (1.0 - self.density)));
        let speaks =
            |marks: Marks| marks.lit as f64 * found + (marks.all - marks.lit) as f64 * missing;
        speaks(of_earlier) - speaks(of_later) > libm::log(ODDS)
    }

    /// The marks of both, and of either alone.
    fn compared(&self, earlier: Sent, later: Sent) -> [Marks; 3] {
        let scale = i64::from(self.correlation.ticks_per_chip);
        let places = |sent: Sent| -> Vec<i64> {
            let marks = self.marks(sent.shot).iter();
            marks.map(|mark| sent.begins + scale * i64::from(*mark)).collect()
        };
        let (earlier, later) = (places(earlier), places(later));
        let count = |of: &[i64], others: &[i64], are_shared: bool| {
            let is_of = |place: &&i64| others.binary_search(place).is_ok() == are_shared;
            let places = of.iter().filter(is_of);
            Marks {
                lit: places.clone().filter(|place| self.has(**place)).count(),
                all: places.count(),
            }
        };
        [
            count(&earlier, &later, true),
            count(&earlier, &later, false),
            count(&later, &earlier, false),
        ]
    }

    /// True if light came about tick `place`.
    fn has(&self, place: i64) -> bool {
        self.field.lit().has(place - i64::from(self.slack))
    }

    /// The shots before `shot`, in the same word, whose light from beyond the gate can arrive within `about` ticks of
    /// `arrives`.
    fn earlier(&self, shot: usize, arrives: i64, about: i64) -> impl Iterator<Item = usize> {
        let (_, farthest) = self.receiver.gate_ticks;
        let opened = arrives - about - i64::from(self.correlation.light_ticks);
        let closed = arrives + about - i64::from(farthest);
        let range: Range<usize> = self.fired.partition_point(|fired| *fired < opened)
            ..self.fired.partition_point(|fired| *fired < closed).min(shot);
        range.filter(move |other| self.log.word[*other] == self.log.word[shot])
    }

    fn marks(&self, shot: usize) -> &[u16] {
        self.codebook.marks(self.log.label[shot], self.log.word[shot])
    }
}

/// Marks, and how many of them are lit.
#[derive(Clone, Copy)]
struct Marks {
    lit: usize,
    all: usize,
}

/// A macropulse: its shot, and the tick at which it begins to arrive.
#[derive(Clone, Copy)]
struct Sent {
    shot: usize,
    begins: i64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::{Crc, Family, Keying, Payload};

    /// Twenty shots in four words, 200 ticks apart; a gate of 700 ticks, light from 1500.
    fn bench() -> (Receiver, Correlation, Codebook, ShotLog) {
        let payload = Payload::new(4, Crc::default(), true).unwrap();
        let codebook =
            Codebook::new(Family::prime(5).unwrap(), Some(payload), 16, Keying::OnOff).unwrap();
        let receiver = Receiver { gate_ticks: (10, 700), ..Receiver::matched(1000) };
        let correlation = Correlation { light_ticks: 1500, ..Correlation::default() };
        let fired: Vec<i64> = (0..20).map(|shot| shot * 200_000).collect();
        let words: Vec<u16> = (0..20).map(|shot| 1 + shot % 4).collect();
        let mut log = ShotLog::of_one_channel(&fired, &words);
        log.label = (0..20).map(|shot| shot % 16).collect();
        (receiver, correlation, codebook, log)
    }

    fn ticks(codebook: &Codebook, log: &ShotLog, shot: usize, lag: u32) -> Ticks {
        let begins = shot as u32 * 200 + lag;
        let marks = codebook.marks(log.label[shot], log.word[shot]);
        let tick = marks.iter().map(|mark| begins + u32::from(*mark)).collect();
        Ticks { tick, ..Ticks::default() }
    }

    /// A faint return of shot 8 at the place where shot 4 has all of its marks.
    #[test]
    fn an_earlier_shot_that_fits_better_is_believed() {
        let (receiver, correlation, codebook, log) = bench();
        let sent = (&codebook, &log);
        let seen = ticks(&codebook, &log, 4, 900);
        let marks = codebook.marks(log.label[8], log.word[8]).len() as u16;
        let faint = Return {
            shot: 8,
            tof: (900.5 - 800.0) * 1e-12,
            peak: marks / 2,
            marks,
            margin: 0,
            photons: 1.0,
            saturated: false,
        };
        let judge = |correlation: &Correlation, seen: &Ticks, one: Return| {
            let mut returns = Returns::default();
            returns.push(one);
            exclude(&receiver, correlation, sent, seen, &mut returns);
            (returns.len(), returns.rejected(Reject::OutsideGate))
        };
        assert_eq!(judge(&correlation, &seen, faint), (0, 1));
        // Controls: light that is not followed so far, and light of the shot itself.
        let near = Correlation { light_ticks: 700, ..correlation.clone() };
        assert_eq!(judge(&near, &seen, faint), (1, 0));
        let own = ticks(&codebook, &log, 8, 100);
        assert_eq!(judge(&correlation, &own, faint), (1, 0));
    }
}
