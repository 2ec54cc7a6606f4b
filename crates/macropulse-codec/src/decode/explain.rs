//! Why a shot was decided as it was.
//!
//! The verdict is the receiver's. The same code decodes the band again, once with that shot as the last owned
//! one and once without it. The difference is the verdict. The explanation also counts the marks found at
//! every lag, and tells which light other shots account for. Both follow from the ticks in the plainest way,
//! mark by mark. Odds are those of the thorough receiver.

use std::ops::Range;

use super::belief::{Hypothesis, Marks};
use super::check::check_lags;
use super::matched::{self, Odds, Question};
use super::{Error, Method, Receiver, Reject, Returns, of_channel};
use crate::code::Codebook;
use crate::shot_log::ShotLog;
use crate::ticks::Ticks;
use crate::time;

/// Lags of a gate that are counted at most; of longer ones every second, third, … is counted.
pub(super) const MOST_LAGS: u64 = 1 << 20;

/// One shot of a band and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Index of the shot in the band's log.
    pub shot: usize,
    /// Absolute tick in which it was fired.
    pub fired_tick: i64,
    /// When the marks of its macropulse leave, in ticks after that; ascending.
    pub marks: Vec<u32>,
    /// Lags of the gate, ticks.
    pub gate: Range<i64>,
    /// Lag of each entry of `found`: this many ticks apart, the first one where the gate begins.
    pub step: i64,
    /// For how many ticks from its place on a mark is looked for.
    pub width: u32,
    /// Marks found at each lag; of a receiver of single marks 1 where there is a tick.
    pub found: Vec<u16>,
    /// The same without ticks that other shots account for.
    pub left: Vec<u16>,
    /// Ticks of its channel from the opening of the gate to the end of the last macropulse in it, in
    /// ticks after firing; and whether another shot accounts for it.
    pub ticks: Vec<(i64, bool)>,
    /// Share of places in that time at which a mark would be found by chance.
    pub density: f64,
    /// Odds of the lags of `found`; `None` if the receiver is no matched one, or nothing can be found of the shot.
    pub odds: Option<Odds>,
    /// The lag with most marks, and how many.
    pub peak: Option<(i64, u16)>,
    /// The best lag that is not at the peak, more than the width of a mark away from it.
    pub sidelobe: Option<(i64, u16)>,
    /// The decision of the receiver.
    pub verdict: Verdict,
    /// Other shots whose light is in this shot's time.
    pub others: Vec<OtherLight>,
}

/// The decision of the receiver on a shot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Verdict {
    /// Its returns, the nearest first.
    pub returns: Vec<Accepted>,
    /// Reasons of refusal, and how often each occurred.
    pub rejects: Vec<(Reject, u64)>,
}

/// A return that was accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accepted {
    /// Two-way time of flight, s.
    pub tof: f64,
    /// Marks found.
    pub peak: u16,
    /// Marks of the macropulse.
    pub marks: u16,
    /// Peak minus the best other lag that the receiver looked at.
    pub margin: u16,
    /// Detected photons per mark, as far as the receiver can tell.
    pub photons: f32,
}

/// Light of another shot that overlaps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OtherLight {
    /// Index of the shot in the band's log.
    pub shot: usize,
    /// When its macropulse begins to arrive, in ticks after the explained shot was fired.
    pub begins: i64,
    /// Marks of it that are found, all of them in the time of the explained shot.
    pub marks: u32,
    /// Those of `marks` at places where the explained shot has a mark at its peak.
    pub shared: u32,
}

impl Receiver {
    /// Why `shot` of `log` was decided as it was, out of all `ticks` of its band.
    ///
    /// # Errors
    /// As [`Receiver::decode`]; of a receiver of samples see [`Receiver::explain_samples`].
    pub fn explain(
        &self,
        codebook: &Codebook,
        (log, ticks): (&ShotLog, &Ticks),
        shot: usize,
    ) -> Result<Explanation, Error> {
        let first = log.owned.start.min(shot);
        let to = |end: usize| {
            let log = ShotLog { owned: first..end, ..log.clone() };
            self.decode(codebook, &log, ticks)
        };
        let verdict = Verdict::of(shot, &to(shot)?, &to(shot.saturating_add(1))?);
        check_lags(self)?;
        let everyone = ShotLog { owned: 0..log.len(), ..log.clone() };
        let all = self.decode(codebook, &everyone, ticks)?;
        let bench = Bench::new(self, (codebook, log), ticks, shot);
        let lit = bench.lit_by(|_| true);
        let found = bench.counts(&lit);
        // Share of the places that are lit.
        let density = lit.iter().filter(|lit| **lit).count() as f64 / lit.len().max(1) as f64;
        let mut claimed = vec![false; bench.seen.len()];
        let width = i64::from(bench.width);
        let peak = best(&found, |_| true).map(|(at, count)| (bench.lag(at), count));
        let mut others = Vec::new();
        for at in (0..all.len()).filter(|at| all.shot[*at] as usize != shot) {
            let other = all.shot[at] as usize;
            others.extend(bench.claims(other, all.tof[at], peak, &mut claimed));
        }
        let free = |at: usize| !claimed[at];
        let left = bench.counts(&bench.lit_by(free));
        let odds = bench.odds(ticks, (&all, &verdict), peak);
        let is_beside = |at: usize| {
            peak.is_some_and(|(lag, _)| (bench.lag(at) - lag).abs() > width.max(bench.step))
        };
        let sidelobe = best(&found, is_beside).map(|(at, count)| (bench.lag(at), count));
        Ok(Explanation {
            shot,
            fired_tick: bench.fired,
            gate: bench.gate.clone(),
            step: bench.step,
            width: bench.width,
            ticks: bench.seen.iter().copied().zip(claimed).collect(),
            density,
            odds,
            sidelobe,
            peak,
            found,
            left,
            verdict,
            others,
            marks: bench.marks,
        })
    }
}

impl Verdict {
    /// That of `shot`, from what came of the shots `before` it and of those and it `together`.
    pub(super) fn of(shot: usize, before: &Returns, together: &Returns) -> Self {
        let accepted = |at: usize| Accepted {
            tof: together.tof[at],
            peak: together.peak[at],
            marks: together.marks[at],
            margin: together.margin[at],
            photons: together.photons[at],
        };
        let rejects = together.rejects.iter().zip(before.rejects);
        let rejects = rejects.map(|(together, before)| together.saturating_sub(before));
        let own = together.shot.partition_point(|other| (*other as usize) < shot)..together.len();
        Self {
            returns: own.map(accepted).collect(),
            rejects: Reject::ALL.into_iter().zip(rejects).filter(|(_, count)| *count > 0).collect(),
        }
    }
}

/// The time of one shot, tick by tick.
struct Bench<'a> {
    receiver: &'a Receiver,
    codebook: &'a Codebook,
    log: &'a ShotLog,
    shot: usize,
    fired: i64,
    marks: Vec<u32>,
    gate: Range<i64>,
    step: i64,
    width: u32,
    /// Ticks of the channel in this time, after firing.
    seen: Vec<i64>,
}

impl<'a> Bench<'a> {
    fn new(
        receiver: &'a Receiver,
        (codebook, log): (&'a Codebook, &'a ShotLog),
        ticks: &Ticks,
        shot: usize,
    ) -> Self {
        let fired = receiver.fired(log, shot);
        let marks: Vec<u32> = match receiver.method.ticks_per_chip() {
            None => vec![0],
            Some(chip) => {
                let marks = codebook.marks(log.label[shot], log.word[shot]).iter();
                marks.map(|mark| u32::from(*mark) * chip).collect()
            }
        };
        let (nearest, farthest) = receiver.gate_ticks;
        let gate = i64::from(nearest)..i64::from(farthest) + 1;
        let step = ((gate.end - gate.start) as u64).div_ceil(MOST_LAGS) as i64;
        let width = receiver.window_ticks();
        let length = marks.last().map_or(0, |last| i64::from(*last)) + i64::from(width);
        let until = gate.end + length;
        let of_channel =
            |at: &usize| ticks.channel.get(*at).is_none_or(|channel| *channel == log.channel[shot]);
        let after = |at: usize| ticks.epoch + i64::from(ticks.tick[at]) - fired;
        let seen = (0..ticks.len()).filter(of_channel).map(after);
        let seen: Vec<i64> = seen.filter(|tick| (gate.start..until).contains(tick)).collect();
        Self { receiver, codebook, log, shot, fired, marks, gate, step, width, seen }
    }

    /// How many lags are counted.
    fn lags(&self) -> usize {
        ((self.gate.end - self.gate.start) / self.step.max(1)) as usize
    }

    /// The lag of place `at` of a list of counts.
    fn lag(&self, at: usize) -> i64 {
        self.gate.start + at as i64 * self.step
    }

    /// The places from the opening of the gate on at which marks are found by those of the ticks seen
    /// that are `wanted`.
    fn lit_by(&self, wanted: impl Fn(usize) -> bool) -> Vec<bool> {
        let length = self.marks.last().map_or(0, |last| *last as usize) + self.width as usize;
        let mut lit = vec![false; (self.gate.end - self.gate.start) as usize + length];
        let (early, late) = self.window();
        for (_, tick) in self.seen.iter().enumerate().filter(|(at, _)| wanted(*at)) {
            let place = tick - self.gate.start;
            for place in (place - late).max(0)..=(place + early).min(lit.len() as i64 - 1) {
                lit[place as usize] = true;
            }
        }
        lit
    }

    /// How many ticks early, and late, a mark may come.
    fn window(&self) -> (i64, i64) {
        let width = i64::from(self.width);
        ((width - 1) / 2, width - 1 - (width - 1) / 2)
    }

    /// Marks found at each lag.
    fn counts(&self, lit: &[bool]) -> Vec<u16> {
        let count = |at: usize| {
            let from = (at as i64 * self.step) as usize;
            let found = |mark: &&u32| lit.get(from + **mark as usize).is_some_and(|lit| *lit);
            self.marks.iter().filter(found).count() as u16
        };
        (0..self.lags()).map(count).collect()
    }

    /// The absolute tick in which light of `shot` arrives after `tof` seconds.
    fn arrives(&self, shot: usize, tof: f64) -> i64 {
        let arrives_fs = self.log.fired_at_fs[shot] + time::fs_from_s(tof);
        arrives_fs.div_euclid(self.receiver.tick_fs)
    }

    /// The odds of the shot at each lag; `None` of a receiver that is no matched one.
    fn odds(
        &self,
        ticks: &Ticks,
        (all, verdict): (&Returns, &Verdict),
        peak: Option<(i64, u16)>,
    ) -> Option<Odds> {
        let Method::Matched(correlation, _) = &self.receiver.method else { return None };
        let (early, _) = self.window();
        let channel = self.log.channel[self.shot];
        let (shots, log) =
            self.log.each_channel().into_iter().find(|(_, log)| log.channel[0] == channel)?;
        let ticks = of_channel(ticks, channel);
        let hypothesis = |shot: usize, lag: i64, lit: u16, of: u16| {
            let marks = Marks { lit: lit.into(), of: of.into() };
            Some(Hypothesis { shot: shots.binary_search(&shot).ok()?, lag: lag - early, marks })
        };
        let lag =
            |shot: usize, tof: f64| self.arrives(shot, tof) - self.receiver.fired(self.log, shot);
        let others = all.each().filter(|one| one.shot != self.shot);
        let others = others
            .filter_map(|one| hypothesis(one.shot, lag(one.shot, one.tof), one.peak, one.marks));
        let fullest = verdict.returns.iter().max_by_key(|one| one.peak);
        let of = self.marks.len() as u16;
        let own = match (fullest, peak) {
            (Some(one), _) => hypothesis(self.shot, lag(self.shot, one.tof), one.peak, of),
            (None, Some((lag, lit))) => hypothesis(self.shot, lag, lit, of),
            (None, None) => None,
        }?;
        let lags = (0..self.lags()).map(|at| self.lag(at) - early).collect();
        let question =
            Question { own, others: others.collect(), lags, is_accepted: fullest.is_some() };
        let sent = (self.codebook, &log);
        let mut odds = matched::odds(self.receiver, correlation, sent, &ticks, &question)?;
        odds.best.lag += early;
        odds.reach = odds.reach.start + early..odds.reach.end + early;
        odds.expected.iter_mut().for_each(|lag| *lag += early);
        Some(odds)
    }

    /// Marks the ticks that `other`, found after `tof` seconds, accounts for; `None` where its light is
    /// not in this time.
    fn claims(
        &self,
        other: usize,
        tof: f64,
        peak: Option<(i64, u16)>,
        claimed: &mut [bool],
    ) -> Option<OtherLight> {
        let chip = self.receiver.method.ticks_per_chip()?;
        if self.log.channel[other] != self.log.channel[self.shot] {
            return None;
        }
        let begins = self.arrives(other, tof) - self.fired;
        let (early, late) = self.window();
        let own: Vec<i64> = peak
            .map(|(lag, _)| self.marks.iter().map(|mark| lag + i64::from(*mark)).collect())
            .unwrap_or_default();
        let mut light = OtherLight { shot: other, begins, marks: 0, shared: 0 };
        for mark in self.codebook.marks(self.log.label[other], self.log.word[other]) {
            let place = begins + i64::from(u32::from(*mark) * chip);
            let first = self.seen.partition_point(|tick| *tick < place - early);
            let near = self.seen[first..].iter().take_while(|tick| **tick <= place + late).count();
            claimed[first..first + near].fill(true);
            light.marks += u32::from(near > 0);
            let is_shared = own.iter().any(|own| (own - place).abs() <= early.max(late));
            light.shared += u32::from(near > 0 && is_shared);
        }
        (light.marks > 0).then_some(light)
    }
}

/// The place with most, the first of several, of those that are `wanted`; `None` where nothing is.
fn best(counts: &[u16], wanted: impl Fn(usize) -> bool) -> Option<(usize, u16)> {
    let wanted = counts.iter().copied().enumerate().filter(|(at, count)| *count > 0 && wanted(*at));
    wanted.max_by_key(|(at, count)| (*count, std::cmp::Reverse(*at)))
}
