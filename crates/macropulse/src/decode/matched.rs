//! The matched receiver: the lag at which the whole known macropulse of a shot fits best.
//!
//! 1. *Predict.* Neighbouring pixels see neighbouring ranges: around the lags of the neighbours
//!    the exact maximum is taken. Half of the marks, or twice what chance can give, with none of
//!    the lit bits missing, cannot be a sidelobe (an own lobe that far off leaves a bit dark) nor
//!    another shot.
//! 2. *Explain.* The ticks of a shot that is found need no other explanation; what is left over
//!    is searched for the shots that no neighbour predicted, the bright ones first: where many
//!    bright ones overlap, their light could pass for a faint one.
//! 3. *Contest.* A predicted shot keeps its lag unless unexplained ticks crowd somewhere in its
//!    gate: then these are searched for a better one.
//! 4. *Check.* A bit that should be dark must not be lit, nor a lit one dark.
//!
//! A return is believed if chance would not reach its count of marks at any lag of the gate, see
//! [`super::threshold`].

mod leftover;
mod verdict;

use super::correlator::{BLOCK, Counts};
use super::search::Search;
use super::threshold::Thresholds;
use super::timeline::{Density, Timeline, Unexplained};
use super::{FARTHEST_JITTER, Receiver, Returns};
use crate::code::{CodeWord, Codebook};
use crate::emit::ShotLog;
use crate::tdc::Ticks;
use leftover::Evidence;

/// Decodes one band.
pub(super) fn decode(receiver: &Receiver, sent: (&Codebook, &ShotLog), ticks: &Ticks) -> Returns {
    let mut band = Band::new(receiver, sent, ticks);
    for shot in 0..band.log.len() {
        if let Some(lock) = band.predicted(shot) {
            band.lock(shot, lock);
        }
    }
    band.search(Evidence::Overwhelming);
    band.search(Evidence::Bright);
    band.search(Evidence::MoreThanChance);
    band.contest();
    band.returns()
}

/// The lag at which a shot was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Lock {
    lag: i64,
    count: u16,
    margin: u16,
    /// Whether the whole gate was searched, not only around a prediction.
    searched: bool,
}

struct Band<'a> {
    receiver: &'a Receiver,
    codebook: &'a Codebook,
    log: &'a ShotLog,
    /// Absolute tick in which each shot was fired.
    fired: Vec<i64>,
    /// The shot at the same column one line earlier.
    above: Vec<Option<usize>>,
    /// Length of the stretch in which a mark may be found, in ticks.
    width: u32,
    ticks: Timeline,
    /// Lit where a mark counts as found, unless that is where the ticks are.
    dilated: Option<Timeline>,
    density: Density,
    unexplained: Unexplained,
    thresholds: Thresholds,
    /// For the bits of one macropulse instead of the lags of a gate.
    bit_thresholds: Thresholds,
    /// For each word, the marks that one tick may count for.
    marks_per_tick: Vec<u32>,
    search: Search,
    locks: Vec<Option<Lock>>,
}

impl<'a> Band<'a> {
    fn new(receiver: &'a Receiver, sent: (&'a Codebook, &'a ShotLog), ticks: &Ticks) -> Self {
        let (codebook, log) = sent;
        let fired: Vec<i64> = (0..log.len()).map(|shot| receiver.fired(log, shot)).collect();
        let ticks = receiver.timeline(codebook, &fired, ticks);
        let width = window(receiver.jitter_ticks);
        let dilated = (width > 1).then(|| ticks.dilated(0, width - 1));
        let (nearest, farthest) = receiver.gate_ticks;
        let lags = f64::from(farthest.saturating_sub(nearest)) + 1.0;
        let bits = codebook.payload().map_or(1, |payload| payload.bits());
        Self {
            receiver,
            codebook,
            log,
            above: above(log),
            width,
            density: Density::new(dilated.as_ref().unwrap_or(&ticks)),
            unexplained: Unexplained::new(ticks.clone()),
            thresholds: Thresholds::new(lags, receiver.false_alarm),
            bit_thresholds: Thresholds::new(f64::from(bits), receiver.false_alarm),
            marks_per_tick: (0..codebook.words())
                .map(|word| {
                    let word = codebook.word(word as u16);
                    crowding(word, width.div_ceil(receiver.ticks_per_chip.max(1)))
                })
                .collect(),
            search: Search::default(),
            locks: vec![None; fired.len()],
            fired,
            ticks,
            dilated,
        }
    }

    /// Lit where a mark counts as found.
    fn seen(&self) -> &Timeline {
        self.dilated.as_ref().unwrap_or(&self.ticks)
    }

    /// The marks of `shot`, in ticks from its start.
    fn marks(&self, shot: usize) -> impl ExactSizeIterator<Item = i64> + use<'a> {
        let scale = i64::from(self.receiver.ticks_per_chip);
        let marks = self.codebook.marks(self.log.label[shot], self.log.word[shot]);
        marks.iter().map(move |&mark| scale * i64::from(mark))
    }

    /// Number of marks of `shot`.
    fn weight(&self, shot: usize) -> u16 {
        self.marks(shot).len() as u16
    }

    /// Each bit of the payload of `shot`: whether it is lit, and its first tick.
    fn bits(&self, shot: usize) -> impl Iterator<Item = (bool, i64)> + Clone + use<> {
        let (label, word) = (self.log.label[shot], self.log.word[shot]);
        let (payload, bits) = match self.codebook.payload() {
            Some(payload) => (payload.encode(label), payload.bits()),
            None => (1, 1),
        };
        let length = self.codebook.word(word).length * self.receiver.ticks_per_chip;
        (0..bits).map(move |bit| (payload >> (bits - 1 - bit) & 1 == 1, i64::from(bit * length)))
    }

    /// Length of a macropulse, in ticks.
    fn length(&self) -> i64 {
        i64::from(self.codebook.chips() * self.receiver.ticks_per_chip)
    }

    /// Nearest and farthest lag.
    fn gate(&self) -> (i64, i64) {
        (self.receiver.gate_ticks.0.into(), self.receiver.gate_ticks.1.into())
    }

    /// The lags at which `shot` is to be expected, after its neighbours: on the plane through
    /// three of them, on the lines through two, and at the lag of one.
    fn expected(&self, shot: usize) -> [Option<i64>; 6] {
        let at = |shot: Option<usize>| Some(self.locks.get(shot?)?.as_ref()?.lag);
        let over = |shot: Option<usize>| self.above.get(shot?).copied().flatten();
        let before = shot.checked_sub(1);
        let (left, above) = (at(before), at(over(Some(shot))));
        let plane = || Some(left? + above? - at(over(before))?);
        let across = || Some(2 * left? - at(shot.checked_sub(2))?);
        let down = || Some(2 * above? - at(over(over(Some(shot))))?);
        [plane(), across(), down(), left, above, at(Some(shot + 1))]
    }

    /// The lag of `shot` if it lies where its neighbours say and can be no other.
    fn predicted(&mut self, shot: usize) -> Option<Lock> {
        let weight = self.weight(shot);
        if weight == 0 {
            return None;
        }
        let density = self.density_in_gate(shot);
        let least = weight.div_ceil(2).min(2 * self.thresholds.least(weight, density));
        let expected = self.expected(shot);
        for (index, lag) in expected.iter().enumerate() {
            let Some(lag) = *lag else { continue };
            let mut tried = expected[..index].iter().flatten();
            if tried.any(|other| lag.abs_diff(*other) < BLOCK as u64 / 4) {
                continue;
            }
            // The flank of a peak just outside would show half as many marks as the peak.
            let lock = self.best_near(shot, lag, least.div_ceil(2));
            if lock.is_some_and(|lock| self.is_certain(shot, lock)) {
                return lock;
            }
        }
        None
    }

    /// The highest peak that can be climbed to from `lag`. `None` where fewer than `at_least`
    /// marks fit anywhere around.
    ///
    /// The sidelobes of a code word reach almost as far as the word is long, and a peak that does
    /// not have all its marks may be one of them: then the blocks to both sides are seen, too.
    fn best_near(&self, shot: usize, lag: i64, at_least: u16) -> Option<Lock> {
        const STEPS: usize = 64;
        let weight = self.weight(shot);
        let mut best = self.best_in_block(shot, lag).filter(|best| best.count >= at_least)?;
        let mut middle = lag;
        for _ in 0..STEPS {
            if best.lag.abs_diff(middle) > BLOCK as u64 / 8 {
                middle = best.lag;
                best = self.best_in_block(shot, middle)?;
                continue;
            }
            if best.count == weight {
                break;
            }
            let sides = [middle - BLOCK, middle + BLOCK];
            let sides = sides.map(|side| self.best_in_block(shot, side));
            let higher = sides.into_iter().flatten().find(|side| {
                side.count > best.count || (side.count == best.count && side.lag < best.lag)
            });
            match higher {
                Some(side) => best = side,
                None => break,
            }
        }
        Some(best)
    }

    /// The highest peak in the [`BLOCK`] around `middle`.
    fn best_in_block(&self, shot: usize, middle: i64) -> Option<Lock> {
        let (nearest, farthest) = self.gate();
        let first = middle - BLOCK / 2;
        let counts = Counts::new(self.seen(), self.fired[shot] + first, self.marks(shot));
        let peak = counts.peak(nearest - first..farthest + 1 - first, self.width.into())?;
        let margin = peak.count - peak.next;
        Some(Lock { lag: first + peak.at, count: peak.count, margin, searched: false })
    }

    /// Whether `lock` can be no sidelobe and no other shot: half of the marks were found, or twice
    /// what chance can give, and no lit bit is much darker than the others.
    fn is_certain(&mut self, shot: usize, lock: Lock) -> bool {
        let weight = self.weight(shot);
        if lock.count == weight {
            return true;
        }
        let by_chance = self.by_chance(shot, lock);
        let lit = self.bits(shot).filter(|(lit, _)| *lit);
        lock.count >= by_chance
            && (2 * lock.count >= weight || lock.count >= 2 * by_chance)
            && lit.clone().all(|(_, bit)| {
                let found = self.found_in_bit(shot, lock.lag + bit, self.seen());
                3 * u32::from(found) * lit.clone().count() as u32 >= u32::from(lock.count)
            })
    }

    /// Marks of the code word of `shot` that are lit in `timeline` if it begins at `lag`.
    fn found_in_bit(&self, shot: usize, lag: i64, timeline: &Timeline) -> u16 {
        let start = self.fired[shot] + lag;
        let scale = i64::from(self.receiver.ticks_per_chip);
        let word = self.codebook.word(self.log.word[shot]);
        word.marks.iter().filter(|&&mark| timeline.has(start + scale * i64::from(mark))).count()
            as u16
    }

    /// Share of lit places around a shot found at `lock`, its own marks apart.
    fn density_around(&self, shot: usize, lock: Lock) -> f64 {
        let own = [lock.count, self.weight(shot)].map(|marks| u32::from(marks) * self.width);
        let start = self.fired[shot] + lock.lag;
        self.density.without(start..start + self.length(), own.into())
    }

    /// Share of lit places in the gate of `shot`.
    fn density_in_gate(&self, shot: usize) -> f64 {
        let (nearest, farthest) = self.gate();
        self.density.over(self.fired[shot] + nearest..self.fired[shot] + farthest + 1)
    }

    /// Whether chance reaches `lock` at no lag of the gate, be it as dense as around the lock.
    /// The marks found count among the light around: chance finds most where there is most.
    fn is_believed(&mut self, shot: usize, lock: Lock) -> bool {
        lock.count >= self.by_chance(shot, lock)
    }

    /// The marks that chance does not reach, be it as dense in all the gate as around `lock`.
    fn by_chance(&mut self, shot: usize, lock: Lock) -> u16 {
        let start = self.fired[shot] + lock.lag;
        let around = self.density.over(start..start + self.length());
        let density = self.density_in_gate(shot).max(around);
        self.thresholds.least(self.weight(shot), density)
    }

    /// Keeps `lock` and explains its ticks.
    fn lock(&mut self, shot: usize, lock: Lock) {
        let start = self.fired[shot] + lock.lag;
        for mark in self.marks(shot) {
            self.unexplained.explain(start + mark..start + mark + i64::from(self.width));
        }
        self.locks[shot] = Some(lock);
    }
}

/// For how many ticks from its earliest place on a mark is looked for: ±2 σ of the jitter and the
/// tick itself, which holds 19 of 20 marks. Below σ = 1/20 tick hardly any mark leaves its tick.
fn window(jitter: f64) -> u32 {
    if jitter > 0.05 { 1 + (4.0 * jitter).ceil().min(FARTHEST_JITTER) as u32 } else { 1 }
}

/// Most marks in any `chips` chips of `word`, or of two in a row.
fn crowding(word: &CodeWord, chips: u32) -> u32 {
    let once = word.marks.iter().map(|&mark| u32::from(mark));
    let marks: Vec<u32> = once.clone().chain(once.map(|mark| mark + word.length)).collect();
    let within = |first: usize| {
        marks[first..].iter().take_while(|&&mark| mark < marks[first] + chips).count() as u32
    };
    (0..word.marks.len()).map(within).max().unwrap_or(1)
}

/// For each shot, the last one before it at the same column of another row.
fn above(log: &ShotLog) -> Vec<Option<usize>> {
    let columns = log.column.iter().max().map_or(0, |&column| usize::from(column) + 1);
    let mut last = vec![None; columns];
    let mut above = Vec::with_capacity(log.len());
    for shot in 0..log.len() {
        let at_column = &mut last[usize::from(log.column[shot])];
        above.push(at_column.filter(|&other: &usize| log.row[other] != log.row[shot]));
        *at_column = Some(shot);
    }
    above
}

#[cfg(test)]
mod tests {
    use super::super::ReceiverKind;
    use super::*;
    use crate::code::{Crc, Family, Payload};
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    /// Chips from shot to shot: about five are in flight.
    const PERIOD: i64 = 1100;

    fn receiver(jitter_ticks: f64) -> Receiver {
        Receiver {
            kind: ReceiverKind::Matched,
            gate_ticks: (50, 5000),
            ticks_per_chip: 1,
            tick_fs: 2500,
            jitter_ticks,
            false_alarm: 1e-2,
            bit_threshold: 6,
        }
    }

    fn codebook() -> Codebook {
        let payload = Payload::new(4, Crc::default(), false).unwrap();
        Codebook::new(Family::prime(11).unwrap(), Some(payload), 16).unwrap()
    }

    fn log(shots: u16) -> ShotLog {
        ShotLog {
            first: 0,
            fired_at_fs: (0..shots).map(|shot| i64::from(shot) * PERIOD * 2500).collect(),
            row: vec![0; shots.into()],
            column: (0..shots).collect(),
            label: (0..shots).map(|shot| 1 + shot % 15).collect(),
            word: (0..shots).map(|shot| 1 + shot % 10).collect(),
            channel: vec![0; shots.into()],
            home: 0..shots.into(),
        }
    }

    /// The earliest lag of the whole gate with most marks, every lag by itself.
    fn exhaustive(band: &Band, shot: usize) -> (i64, u16) {
        let (nearest, farthest) = band.gate();
        let count = |lag: i64| {
            let start = band.fired[shot] + lag;
            band.marks(shot).filter(|mark| band.seen().has(start + mark)).count() as u16
        };
        let best = (nearest..=farthest).rev().max_by_key(|&lag| count(lag)).unwrap();
        (best, count(best))
    }

    #[test]
    fn a_search_finds_the_maximum_over_the_gate() {
        let mut chance = ChaCha8Rng::seed_from_u64(3);
        let (codebook, log) = (codebook(), log(1));
        let mut found = 0;
        for ticks in [0, 5, 60, 200, 600] {
            for jitter in [0.0, 0.2, 0.5] {
                let mut tick: Vec<u32> = (0..ticks).map(|_| chance.next_u32() % 5900).collect();
                tick.sort_unstable();
                tick.dedup();
                let ticks = Ticks { tick, ..Ticks::default() };
                let receiver = Receiver { false_alarm: 1e4, ..receiver(jitter) };
                let mut band = Band::new(&receiver, (&codebook, &log), &ticks);
                let (lag, count) = exhaustive(&band, 0);
                if let Some(lock) = band.searched(0, 1) {
                    found += 1;
                    assert_eq!((lock.lag, lock.count), (lag, count));
                }
            }
        }
        assert!(found >= 9, "{found}");
    }

    #[test]
    fn shots_in_flight_do_not_hide_each_others_maximum() {
        // N = 400 shots at random lags, one mark in ten missed.
        let mut chance = ChaCha8Rng::seed_from_u64(4);
        let (codebook, log, receiver) = (codebook(), log(400), receiver(0.0));
        let mut tick = Vec::new();
        for shot in 0..400 {
            let start = shot as u32 * PERIOD as u32 + 50 + chance.next_u32() % 4951;
            for &mark in codebook.marks(log.label[shot], log.word[shot]) {
                if !chance.next_u32().is_multiple_of(10) {
                    tick.push(start + u32::from(mark));
                }
            }
        }
        tick.sort_unstable();
        tick.dedup();
        let ticks = Ticks { tick, ..Ticks::default() };
        let returns = decode(&receiver, (&codebook, &log), &ticks);
        let band = Band::new(&receiver, (&codebook, &log), &ticks);
        for (&shot, (&tof, &peak)) in returns.shot.iter().zip(returns.tof.iter().zip(&returns.peak))
        {
            let (lag, count) = exhaustive(&band, shot as usize);
            assert_eq!(peak, count, "shot {shot}");
            approx::assert_relative_eq!(tof, (lag as f64 + 0.5) * 2.5e-12, max_relative = 1e-9);
        }
        assert!(returns.len() > 380, "{:?}", returns.rejects);
    }

    #[test]
    fn a_tick_counts_for_all_marks_it_may_be() {
        let word = CodeWord { length: 20, marks: vec![0, 5, 6, 8, 19] };
        assert_eq!([1, 2, 3, 4, 8, 9].map(|chips| crowding(&word, chips)), [1, 2, 2, 3, 4, 4]);
        assert_eq!(crowding(&CodeWord { length: 20, marks: vec![] }, 5), 1);
    }

    #[test]
    fn the_window_grows_with_the_jitter() {
        assert_eq!([0.0, 0.05, 0.1, 0.4, 1.0, 2.0].map(window), [1, 1, 2, 3, 5, 9]);
    }
}
