//! The balanced receiver: marks found, less what is lit where the macropulse is dark.
//!
//! 1. For every lag of the gate, the ticks that fall on marks of the known macropulse count for
//!    it, those that fall on its dark chips against it. The highest balance is taken, the earliest
//!    of several.
//! 2. It is believed if chance would not fit what is lit to the marks so well, see [`chance`].
//!
//! Light that is there all the time falls on marks and dark chips alike and cancels, where about
//! half the chips are lit. So does the light of other shots, if their words are made for it.
//!
//! The maximum is exact. It is found soon because its light lies whole chips apart: see [`grid`].
//! The ticks of some gates are at hand together, so that memory does not grow with the band.

mod chance;
mod grid;

use super::timing::{self, Histogram, Known};
use super::{Correlation, Energy, GATES_PER_BLOCK, MIDDLE, Receiver, Reject, Return, Returns};
use super::{beyond, window};
use crate::code::Codebook;
use crate::kernels::{Balance, Chips};
use crate::{ShotLog, Ticks, time};
use chance::Chance;
use grid::Grid;

/// How far from the lag of the shot before the beginning of the next macropulse is looked for
/// first, in ticks.
const NEAR: i64 = 1024;

/// Decodes one band.
///
/// It looks beyond the end of the gate by the length of a macropulse. An echo there has sidelobes
/// within the gate. The echo is higher than its sidelobes, so it wins over them, and is then refused.
pub(super) fn decode(
    receiver: &Receiver,
    correlation: &Correlation,
    sent: (&Codebook, &ShotLog),
    ticks: &Ticks,
) -> Returns {
    let mut band = Band::new(receiver, correlation, sent, ticks);
    let owned = sent.1.owned.clone();
    let mut returns = Returns::with_capacity(owned.len());
    for shot in owned {
        match band.found(shot) {
            Some(found) => returns.push(found),
            None => returns.reject(Reject::NoPeak),
        }
    }
    let closes = time::s_from_fs((i64::from(receiver.gate_ticks.1) + 1) * receiver.tick_fs);
    returns.refuse_beyond(closes);
    beyond::exclude(receiver, correlation, sent, ticks, &mut returns);
    returns
}

/// The tick at which a macropulse begins, and its balance there.
type Peak = (i64, Balance);

struct Band<'a> {
    receiver: &'a Receiver,
    correlation: &'a Correlation,
    /// Nearest and farthest lag that is looked at.
    gate: (i64, i64),
    codebook: &'a Codebook,
    log: &'a ShotLog,
    ticks: &'a [u32],
    /// Absolute time of tick 0, in ticks.
    epoch: i64,
    /// Tick in which each shot was fired, from the epoch.
    fired: Vec<i64>,
    /// How many ticks late a mark still counts, from the earliest of its places on.
    late: i64,
    grid: Grid,
    chance: Chance,
    /// The chips of the shot at hand.
    chips: Chips,
    /// The lag of the last shot that was found.
    last_lag: Option<i64>,
}

impl<'a> Band<'a> {
    fn new(
        receiver: &'a Receiver,
        correlation: &'a Correlation,
        sent: (&'a Codebook, &'a ShotLog),
        ticks: &'a Ticks,
    ) -> Self {
        let (codebook, log) = sent;
        let fired = receiver.fired_since(log, ticks.epoch);
        let late = i64::from(window(correlation.jitter_ticks)) - 1;
        let scale = i64::from(correlation.ticks_per_chip);
        let (nearest, farthest) = receiver.gate_ticks;
        let farthest = farthest.saturating_add(codebook.chips() * correlation.ticks_per_chip);
        let lags = f64::from(farthest.saturating_sub(nearest)) + 1.0;
        Self {
            receiver,
            correlation,
            gate: (nearest.into(), farthest.into()),
            codebook,
            log,
            ticks: &ticks.tick,
            epoch: ticks.epoch,
            late,
            grid: Grid::new((scale, late)),
            chance: Chance::new(lags, correlation.false_alarm, codebook.chips()),
            fired,
            chips: Chips::default(),
            last_lag: None,
        }
    }

    /// The return of `shot`, if its macropulse is there.
    fn found(&mut self, shot: usize) -> Option<Return> {
        let marks = self.codebook.marks(self.log.label[shot], self.log.word[shot]);
        if marks.is_empty() {
            return None;
        }
        self.chips.set(self.codebook.chips() as usize, marks);
        self.cover(shot);
        let (start, peak) = self.peak(shot, marks)?;
        let (weight, score) = (marks.len() as u16, peak.score() as u16);
        if !self.is_believed(shot, weight, peak) {
            return None;
        }
        self.last_lag = Some(start - self.fired[shot]);
        let dark = self.codebook.chips() - u32::from(weight);
        let fired_at_fs = self.log.fired_at_fs[shot];
        let others = f64::from(peak.stray) / f64::from(dark.max(1)) * 0.999;
        let late = self.late(start, marks, others);
        let width = self.late as u32 + 1;
        let window = timing::window(self.correlation, width, late);
        let Energy { photons, saturated } = Energy::of((peak.found, weight.into()), others, window);
        Some(Return {
            shot,
            tof: self.receiver.tof(late)(fired_at_fs, start + self.epoch),
            peak: score,
            marks: weight,
            margin: score - self.grid.best_beside(start, &self.chips).clamp(0, peak.score()) as u16,
            photons,
            saturated,
        })
    }

    /// Lays down the ticks of the gate of `shot`, and of a macropulse before it and behind it; those of
    /// the next shots with them.
    fn cover(&mut self, shot: usize) {
        let (nearest, farthest) = self.gate;
        let length = i64::from(self.codebook.chips() * self.correlation.ticks_per_chip);
        let beside = length + 64 * i64::from(self.correlation.ticks_per_chip) + self.late + 1;
        let light = |shot: usize| {
            self.fired[shot] + nearest - beside..self.fired[shot] + farthest + length + beside
        };
        let span = light(shot);
        if !self.grid.covers(&span) {
            let last = light(self.log.owned.end.max(shot + 1) - 1);
            let ahead = span.end + GATES_PER_BLOCK * (span.end - span.start);
            self.grid.cover(span.start..ahead.min(last.end), self.ticks);
        }
    }

    /// True if chance does not explain `peak`, the best one of `shot`, which has `marks` marks.
    fn is_believed(&mut self, shot: usize, marks: u16, peak: Balance) -> bool {
        let (nearest, farthest) = self.gate;
        let gate = self.fired[shot] + nearest..self.fired[shot] + farthest + 1;
        let chips = (&self.chips, self.codebook.chips() as usize);
        let lit_about = |least, counts: &mut _| self.grid.lit_about(&gate, chips, least, counts);
        self.chance.is_unlikely(marks.into(), peak, lit_about)
    }

    /// The highest balance in the gate of `shot`, the earliest of several, if it can be believed at
    /// all.
    fn peak(&mut self, shot: usize, marks: &[u16]) -> Option<Peak> {
        let (nearest, farthest) = self.gate;
        let fired = self.fired[shot];
        let gate = fired + nearest..fired + farthest + 1;
        let least = self.chance.least(marks.len() as u32) as i32;
        // Whatever is known beforehand need not be searched for: only what is better.
        let known = self.near_the_last(shot, marks).filter(|(_, known)| known.score() >= least);
        let at_least = known.map_or((least, i64::MAX), |(start, known)| (known.score(), start));
        self.grid.best(gate, &self.chips, at_least).or(known)
    }

    /// The best of the lags about that of the last shot at which the first mark is lit.
    fn near_the_last(&self, shot: usize, marks: &[u16]) -> Option<Peak> {
        let (nearest, farthest) = self.gate;
        let fired = self.fired[shot];
        let expected = fired + self.last_lag?;
        let first = i64::from(self.correlation.ticks_per_chip) * i64::from(*marks.first()?);
        let from = expected + first - NEAR;
        let begin = self.ticks.partition_point(|&tick| i64::from(tick) < from);
        let ticks = self.ticks[begin..].iter().map(|&tick| i64::from(tick) - first);
        let starts = ticks.take_while(|&start| start <= expected + NEAR);
        let starts = starts.filter(|start| (nearest..=farthest).contains(&(start - fired)));
        let peaks = starts.filter_map(|start| Some((start, self.grid.at(start, &self.chips)?)));
        peaks.reduce(|best, next| if next.1.score() > best.1.score() { next } else { best })
    }

    /// How late the marks of a macropulse that begins at `start` are, in ticks, where others light
    /// the share `others` of the places of a mark.
    fn late(&self, start: i64, marks: &[u16], others: f64) -> f64 {
        if self.late == 0 {
            return MIDDLE;
        }
        let width = self.late as u32 + 1;
        let places = timing::lateness(width);
        let scale = i64::from(self.correlation.ticks_per_chip);
        let marks: Vec<i64> = marks.iter().map(|&mark| scale * i64::from(mark)).collect();
        let room = (places.end - places.start) as usize;
        let mut counts = vec![0; room];
        for mark in &marks {
            let from = start + mark + places.start;
            let first = self.ticks.partition_point(|&tick| i64::from(tick) < from);
            let late = self.ticks[first..].iter().map(|&tick| (i64::from(tick) - from) as usize);
            late.take_while(|late| *late < room).for_each(|late| counts[late] += 1);
        }
        let mut histogram = Histogram::default();
        histogram.count(width, self.correlation.jitter(), |place, some| {
            some.copy_from_slice(&counts[(place - places.start) as usize..][..some.len()]);
        });
        let known = Known {
            sigma: self.correlation.jitter(),
            marks: marks.len() as f64,
            others: others / f64::from(width),
            neighbours: &timing::neighbours(&marks, places.end - places.start),
        };
        histogram.late_by(&known)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Method;
    use super::*;
    use crate::code::{Crc, Family, Keying, Payload};
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    /// Farthest lag, ticks.
    const GATE: u32 = 1500;

    fn receiver(correlation: &Correlation) -> Receiver {
        let method = Method::Balanced(correlation.clone());
        Receiver { gate_ticks: (20, GATE), method, ..Receiver::matched(1000) }
    }

    fn correlation(ticks_per_chip: u32, jitter_ticks: f64) -> Correlation {
        let (light_ticks, false_alarm, photons_apart) = (GATE, 1e-2, false);
        Correlation { ticks_per_chip, light_ticks, jitter_ticks, photons_apart, false_alarm }
    }

    fn log(shots: u16, (period, labels, words): (u32, u16, u16)) -> ShotLog {
        ShotLog {
            fired_at_fs: (0..i64::from(shots)).map(|s| s * i64::from(period) * 1000).collect(),
            row: vec![0; shots.into()],
            column: (0..shots).collect(),
            label: (0..shots).map(|shot| shot % labels).collect(),
            word: (0..shots).map(|shot| shot % words).collect(),
            channel: vec![0; shots.into()],
            owned: 0..shots.into(),
            first: 0,
        }
    }

    /// Every shot of `log` at a lag of its own near 600, some marks missed, some ticks false.
    fn ticks(book: &Codebook, log: &ShotLog, weather: (u32, u32, u32), seed: u64) -> Ticks {
        let ((missed, stray, scale), mut chance) = (weather, ChaCha8Rng::seed_from_u64(seed));
        let period = if log.len() > 1 { (log.fired_at_fs[1] / 1000) as u32 } else { 0 };
        let mut tick = Vec::new();
        for shot in 0..log.len() {
            let start = shot as u32 * period + 500 + chance.next_u32() % 200;
            for &mark in book.marks(log.label[shot], log.word[shot]) {
                if chance.next_u32() % 100 >= missed {
                    tick.push(start + scale * u32::from(mark));
                }
            }
        }
        let end = log.len() as u32 * period + GATE;
        tick.extend((0..end * stray / 1000).map(|_| chance.next_u32() % end));
        tick.sort_unstable();
        tick.dedup();
        Ticks { tick, ..Ticks::default() }
    }

    /// The earliest lag with the highest balance, that balance, and whether it is believed: every lag and
    /// every chip by itself.
    fn exhaustive(band: &Band, shot: usize) -> (i64, i32, bool) {
        let marks = band.codebook.marks(band.log.label[shot], band.log.word[shot]);
        let scale = i64::from(band.correlation.ticks_per_chip);
        let mut lit = vec![false; 1 << 16];
        for tick in band.ticks.iter().map(|&tick| i64::from(tick)) {
            ((tick - band.late).max(0)..=tick).for_each(|place| lit[place as usize] = true);
        }
        let all = band.codebook.chips() as usize;
        let found = |lag: i64| -> [usize; 2] {
            let chips = 0..all as i64;
            let seen = chips.filter(|c| lit[(band.fired[shot] + lag + scale * c) as usize]);
            let seen: Vec<bool> = seen.map(|c| marks.contains(&(c as u16))).collect();
            let of_marks = seen.iter().filter(|of_mark| **of_mark).count();
            [of_marks, seen.len()]
        };
        let (nearest, farthest) = band.gate;
        let at: Vec<[usize; 2]> = (nearest..=farthest).map(found).collect();
        let score = |[found, lit]: [usize; 2]| 2 * found as i32 - lit as i32;
        let best = (0..at.len()).rev().max_by_key(|&lag| score(at[lag])).unwrap();
        // C(N, k)·C(M, n − k)/C(N + M, n), factor by factor.
        let chance = |lit: usize, found: usize| {
            let choose = |of: usize, some: usize| -> f64 {
                (0..some).map(|k| (of.saturating_sub(k)) as f64 / (some - k) as f64).product()
            };
            let of = |k: usize| choose(marks.len(), k) * choose(all - marks.len(), lit - k);
            (found..=lit).map(of).sum::<f64>() / choose(all, lit)
        };
        let as_lit = |lit: usize| at.iter().filter(|at| at[1] >= lit).count() as f64;
        let accepted = band.correlation.false_alarm;
        let least = (1..=marks.len())
            .find(|&lit| chance(lit, lit) <= accepted && as_lit(lit) * chance(lit, lit) <= accepted)
            .filter(|least| score(at[best]) >= *least as i32);
        let [found, lit] = at[best];
        let believed = least.is_some_and(|least| as_lit(least) * chance(lit, found) <= accepted);
        (nearest + best as i64, score(at[best]), believed)
    }

    fn books() -> Vec<Codebook> {
        let payload = Payload::new(2, Crc::default(), true).unwrap();
        let inverted = |family| Codebook::new(family, Some(payload), 4, Keying::Inversion);
        let bare = |family| Codebook::new(family, None, 1, Keying::OnOff);
        let books = [
            bare(Family::gold(5).unwrap()),
            bare(Family::gold(7).unwrap()),
            bare(Family::m_sequence(6).unwrap()),
            inverted(Family::gold(5).unwrap()),
            Codebook::new(Family::prime(5).unwrap(), Some(payload), 4, Keying::OnOff),
        ];
        books.map(Result::unwrap).to_vec()
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::with_cases(40) })]

        /// The return is the maximum, and a shot without one has a maximum below the threshold.
        #[test]
        fn it_is_the_exhaustive_maximum(
            book in 0..5_usize,
            scale in 1..6_u32,
            missed in 0..60_u32,
            stray in prop_oneof![Just(0), 1..100_u32],
            jitter in prop_oneof![Just(0.0), 0.1..1.0],
            seed in 0..u64::MAX,
        ) {
            let book = &books()[book];
            let correlation = correlation(scale, jitter);
            let receiver = receiver(&correlation);
            let log = log(6, (150, book.labels() as u16, book.words() as u16));
            let ticks = ticks(book, &log, (missed, stray, scale), seed);
            let mut band = Band::new(&receiver, &correlation, (book, &log), &ticks);
            for shot in 0..log.len() {
                let (lag, score, believed) = exhaustive(&band, shot);
                let marks = book.marks(log.label[shot], log.word[shot]);
                let found = band.found(shot);
                prop_assert_eq!(found.is_some(), believed, "{} of {}", score, marks.len());
                let Some(found) = found else { continue };
                prop_assert_eq!(i32::from(found.peak), score);
                band.chips.set(book.chips() as usize, marks);
                let (start, _) = band.peak(shot, marks).unwrap();
                prop_assert_eq!(start - band.fired[shot], lag);
            }
        }
    }

    /// H0: in gates with light in step, none of it the shot's own, returns are believed at the accepted rate, one in a
    /// hundred. N = 6000 gates, seed 6: 85 or more come with α = 0.0014 (Poisson, mean 60). Runs of 50 chips are dark,
    /// or lit at a share of 0.1 to 0.6 of the places that are whole chips apart. Control: by the mean density of the
    /// gate more than one in ten would be believed.
    #[test]
    fn light_in_step_is_believed_no_more_often_than_is_accepted() {
        let book = &books()[1];
        let (correlation, scale) = (correlation(16, 0.0), 16);
        let receiver = receiver(&correlation);
        let mut chance = ChaCha8Rng::seed_from_u64(6);
        let log = log(1, (1, 1, 129));
        let (mut believed, mut above_the_mean) = (0, 0);
        for gate_number in 0..6000_u32 {
            let word = (gate_number % 129) as u16;
            let log = ShotLog { word: vec![word], ..log.clone() };
            let mut share = 0;
            let tick: Vec<u32> = (0..GATE + 127 * scale)
                .step_by(scale as usize)
                .enumerate()
                .filter_map(|(place, tick)| {
                    if place % 50 == 0 {
                        share = (chance.next_u32() % 2) * (10 + chance.next_u32() % 51);
                    }
                    (chance.next_u32() % 100 < share).then_some(tick)
                })
                .collect();
            let ticks = Ticks { tick, ..Ticks::default() };
            believed += receiver.decode(book, &log, &ticks).unwrap().len();
            let mut band = Band::new(&receiver, &correlation, (book, &log), &ticks);
            let marks = book.marks(0, word);
            band.chips.set(127, marks);
            band.cover(0);
            let best = band.grid.best(20..i64::from(GATE) + 1, &band.chips, (1, 0));
            let mean = ticks.tick.len() as f64 / f64::from(GATE + 127 * scale);
            let is_rare = |peak: Balance| {
                let tail =
                    crate::statistics::binomial_tail(marks.len(), mean, peak.score() as usize);
                1480.0 * tail <= correlation.false_alarm
            };
            above_the_mean += u32::from(best.is_some_and(|(_, peak)| is_rare(peak)));
        }
        assert!(believed <= 84, "{believed} of 6000");
        assert!(above_the_mean > 600, "{above_the_mean} of 6000");
    }

    #[test]
    fn clear_shots_come_back_at_their_lag_with_all_their_marks() {
        let book = &books()[1];
        let (receiver, log) = (receiver(&correlation(4, 0.0)), log(20, (600, 1, 129)));
        let mut tick: Vec<u32> = (0..20)
            .flat_map(|shot| {
                let marks = book.marks(0, shot as u16).iter();
                marks.map(move |&mark| 600 * shot + 700 + 3 * shot + 4 * u32::from(mark))
            })
            .collect();
        tick.sort_unstable();
        let ticks = Ticks { tick, ..Ticks::default() };
        let returns = receiver.decode(book, &log, &ticks).unwrap();
        assert_eq!(returns.len(), 20);
        assert_eq!(returns.peak, returns.marks);
        for (shot, tof) in returns.tof.iter().enumerate() {
            let expected = (700.5 + 3.0 * shot as f64) * 1e-12;
            approx::assert_relative_eq!(*tof, expected, max_relative = 1e-9);
        }
        assert!(returns.margin.iter().all(|&margin| margin > 30), "{:?}", returns.margin);
    }

    /// H0: where nothing is, light that is always there leaves the balance at (marks − dark chips)·d of its
    /// level d. That is next to nothing, while it lifts a count of marks by marks·d. N = 400 shots of 127
    /// chips, seed 5, d = 0.25. The balance has a standard error of √(127·d·(1 − d)/400) = 0.24, the count
    /// one of 0.17. α = 10⁻⁴ is 3.9 of them. The count is the negative control.
    #[test]
    fn a_constant_level_lifts_a_count_but_not_the_balance() {
        let book = &books()[1];
        let correlation = correlation(1, 0.0);
        let (receiver, log) = (receiver(&correlation), log(400, (300, 1, 129)));
        let mut chance = ChaCha8Rng::seed_from_u64(5);
        let tick = (0..400 * 300 + 2000).filter(|_| chance.next_u32().is_multiple_of(4)).collect();
        let ticks = Ticks { tick, ..Ticks::default() };
        let mut band = Band::new(&receiver, &correlation, (book, &log), &ticks);
        let [mut balance, mut count, mut marks] = [0.0; 3];
        for shot in 0..400 {
            let own = book.marks(0, log.word[shot]);
            band.chips.set(127, own);
            band.cover(shot);
            let seen = band.grid.at(band.fired[shot] + 100, &band.chips).unwrap();
            balance += f64::from(seen.score()) / 400.0;
            count += f64::from(seen.found) / 400.0;
            marks += own.len() as f64 / 400.0;
        }
        let still = 0.25 * (2.0 * marks - 127.0);
        assert!((balance - still).abs() < 3.9 * 0.24, "{balance} for {still}");
        assert!((count - 0.25 * marks).abs() < 3.9 * 0.17, "{count} for {}", 0.25 * marks);
        assert!(count - still > 3.9 * 0.24);
    }

    #[test]
    fn an_empty_sky_and_an_empty_log_give_nothing() {
        let book = &books()[0];
        let (receiver, log) = (receiver(&correlation(2, 0.0)), log(3, (100, 1, 33)));
        let returns = receiver.decode(book, &log, &Ticks::default()).unwrap();
        assert_eq!((returns.len(), returns.rejected(Reject::NoPeak)), (0, 3));
        let nothing = receiver.decode(book, &ShotLog::default(), &Ticks::default()).unwrap();
        assert!(nothing.is_empty());
    }
}
