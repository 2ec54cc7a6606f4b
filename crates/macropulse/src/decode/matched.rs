//! The matched receiver: the lag at which the whole known macropulse of a shot fits best.
//!
//! 1. *Predict.* Neighbouring pixels see neighbouring ranges: around the lags of the neighbours
//!    the exact maximum is taken. More than half of the marks, with none of the lit bits missing,
//!    cannot be a sidelobe (an own lobe that far off leaves a bit dark) nor another shot.
//! 2. *Explain.* The ticks of a shot that is found need no other explanation; what is left over
//!    is searched for the shots that no neighbour predicted, the bright ones first, as their
//!    light could pass for a faint one.
//! 3. *Contest.* A shot keeps its lag unless unexplained ticks crowd somewhere in its gate: then
//!    these are searched for a better one.
//! 4. *Check.* A bit that should be dark must not be lit, nor a lit one dark.
//!
//! A return is believed if chance would not reach its count of marks at any lag of the gate, see
//! [`super::threshold`].

use std::ops::Range;

use super::correlator::{BLOCK, Counts};
use super::search::{Search, Sought};
use super::threshold::{Thresholds, binomial_tail};
use super::timeline::{Density, Timeline, Unexplained};
use super::{Receiver, Reject, Return, Returns, photons_per_mark};
use crate::code::Codebook;
use crate::emit::ShotLog;
use crate::tdc::Ticks;
use crate::units;

/// Decodes one band.
pub(super) fn decode(receiver: &Receiver, sent: (&Codebook, &ShotLog), ticks: &Ticks) -> Returns {
    let mut band = Band::new(receiver, sent, ticks);
    for shot in 0..band.log.len() {
        if let Some(lock) = band.predicted(shot) {
            band.lock(shot, lock);
        }
    }
    band.search(Brightness::HalfTheMarks);
    band.search(Brightness::AsChanceAllows);
    band.contest();
    band.returns()
}

/// The lag at which a shot was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Lock {
    lag: i64,
    count: u16,
    margin: u16,
}

/// How bright a shot must be to be searched for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Brightness {
    HalfTheMarks,
    AsChanceAllows,
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
    /// three of them, on the line through two, and at the lag of one.
    fn expected(&self, shot: usize) -> impl Iterator<Item = i64> + use<> {
        let at = |shot: Option<usize>| Some(self.locks.get(shot?)?.as_ref()?.lag);
        let before = shot.checked_sub(1);
        let left = at(before);
        let above = at(self.above[shot]);
        let above_left = at(before.and_then(|before| self.above[before]));
        let plane = || Some(left? + above? - above_left?);
        let line = || Some(2 * left? - at(shot.checked_sub(2))?);
        [plane(), line(), left, above, at(Some(shot + 1))].into_iter().flatten()
    }

    /// The lag of `shot` if it lies where its neighbours say and can be no other.
    fn predicted(&mut self, shot: usize) -> Option<Lock> {
        if self.weight(shot) == 0 {
            return None;
        }
        let mut tried = [i64::MIN; 5];
        for (index, lag) in self.expected(shot).enumerate() {
            if tried.iter().any(|&other| lag.abs_diff(other) < BLOCK as u64 / 4) {
                continue;
            }
            tried[index] = lag;
            let lock = self.best_near(shot, lag);
            if lock.is_some_and(|lock| self.is_bright(shot, lock)) {
                return lock;
            }
        }
        None
    }

    /// The highest peak that can be climbed to from `lag`.
    ///
    /// The sidelobes of a code word reach almost as far as the word is long, and a peak that does
    /// not have all its marks may be one of them: then the blocks to both sides are seen, too.
    fn best_near(&self, shot: usize, lag: i64) -> Option<Lock> {
        const STEPS: usize = 64;
        let weight = self.weight(shot);
        let mut best = self.best_in_block(shot, lag)?;
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
        Some(Lock { lag: first + peak.at, count: peak.count, margin })
    }

    /// Whether half of the marks were found and no lit bit is much darker than the others.
    fn is_bright(&mut self, shot: usize, lock: Lock) -> bool {
        let weight = self.weight(shot);
        if lock.count == weight {
            return true;
        }
        let lit = self.bits(shot).filter(|(lit, _)| *lit);
        2 * lock.count >= weight
            && lit.clone().all(|(_, bit)| {
                let found = self.found_in_bit(shot, lock.lag + bit, self.seen());
                2 * u32::from(found) * lit.clone().count() as u32 >= u32::from(lock.count)
            })
            && self.is_believed(shot, lock)
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
        let start = self.fired[shot] + lock.lag;
        let around = self.density.over(start..start + self.length());
        let density = self.density_in_gate(shot).max(around);
        lock.count >= self.thresholds.least(self.weight(shot), density)
    }

    /// Keeps `lock` and explains its ticks.
    fn lock(&mut self, shot: usize, lock: Lock) {
        let start = self.fired[shot] + lock.lag;
        for mark in self.marks(shot) {
            self.unexplained.explain(start + mark..start + mark + i64::from(self.width));
        }
        self.locks[shot] = Some(lock);
    }

    /// Searches the unexplained light for the shots that have no lag yet.
    fn search(&mut self, brightness: Brightness) {
        for shot in 0..self.log.len() {
            if self.locks[shot].is_some() {
                continue;
            }
            let least = match brightness {
                Brightness::HalfTheMarks => self.weight(shot).div_ceil(2),
                Brightness::AsChanceAllows => 1,
            };
            let lock = match self.predicted(shot) {
                Some(lock) => Some(lock),
                None => self.searched(shot, least),
            };
            if let Some(lock) = lock
                && lock.count >= least
                && self.is_believed(shot, lock)
            {
                self.lock(shot, lock);
            }
        }
    }

    /// Gives a shot the lag that unexplained light speaks for, where it fits better.
    fn contest(&mut self) {
        for shot in 0..self.log.len() {
            let Some(lock) = self.locks[shot] else { continue };
            let density = self.density_in_gate(shot);
            let by_chance = self.thresholds.least(self.weight(shot), density);
            if !self.is_crowded(shot, lock.count.saturating_sub(by_chance)) {
                continue;
            }
            if let Some(rival) = self.searched(shot, lock.count / 2)
                && rival.count > lock.count
                && self.is_believed(shot, rival)
            {
                self.lock(shot, rival);
            }
        }
    }

    /// Whether there are so many unexplained ticks within one macropulse somewhere in the gate
    /// of `shot` that they could be `marks` of its marks.
    fn is_crowded(&self, shot: usize, marks: u16) -> bool {
        let needed = u32::from(marks) / self.marks_per_tick();
        let gate = self.gate_and_macropulse(shot);
        self.unexplained.at_most(gate.clone()) >= needed
            && self.unexplained.densest(gate, self.length() as u32) >= needed
    }

    /// Marks that a single tick may count for, where the window is longer than a chip.
    fn marks_per_tick(&self) -> u32 {
        if self.width <= self.receiver.ticks_per_chip { 1 } else { self.width }
    }

    /// The time in which light of `shot` can arrive.
    fn gate_and_macropulse(&self, shot: usize) -> Range<i64> {
        let (nearest, farthest) = self.gate();
        let end = farthest + self.length() + i64::from(self.width);
        self.fired[shot] + nearest..self.fired[shot] + end
    }

    /// The lag at which most marks of `shot` are found, out of all that unexplained ticks speak
    /// for. `None` where these are fewer than `at_least` or chance could as well have put them
    /// there.
    fn searched(&mut self, shot: usize, at_least: u16) -> Option<Lock> {
        let (nearest, farthest) = self.gate();
        let weight = self.weight(shot);
        if weight == 0 || farthest < nearest {
            return None;
        }
        let gate = self.gate_and_macropulse(shot);
        let ticks = self.unexplained.at_most(gate.clone()) * self.width;
        let left_over = f64::from(ticks) / (gate.end - gate.start) as f64;
        // Marks under ticks that are explained already are missing here: half are taken to be
        // visible.
        let density = self.density_in_gate(shot);
        let visible = self.thresholds.least(weight, density).div_ceil(2);
        let least = self.thresholds.least(weight, left_over).max(visible).max(at_least);
        if !self.is_crowded(shot, least) {
            return None;
        }
        let scale = self.receiver.ticks_per_chip as usize;
        let word = self.codebook.word(self.log.word[shot]);
        let sought = Sought {
            word: word.marks.iter().map(|&mark| scale * usize::from(mark)).collect(),
            bits: self.bits(shot).filter(|(lit, _)| *lit).map(|(_, bit)| bit as usize).collect(),
            lags: (farthest - nearest + 1) as usize,
            least,
        };
        let at = (self.fired[shot] + nearest, self.width);
        let found = self.search.best(self.unexplained.timeline(), at, &sought)?;
        self.best_near(shot, nearest + found.lag as i64)
    }

    /// What was found of the home shots.
    fn returns(mut self) -> Returns {
        let left_over = self.unexplained.timeline().dilated(0, self.width - 1);
        let mut returns = Returns::default();
        for shot in self.log.home.clone() {
            let Some(lock) = self.locks[shot] else {
                returns.reject(Reject::NoPeak);
                continue;
            };
            let density = self.density_around(shot, lock);
            if !self.carries_its_label(shot, lock, (&left_over, density)) {
                returns.reject(Reject::LabelMismatch);
                continue;
            }
            let marks = self.weight(shot);
            returns.push(Return {
                shot,
                tof: self.tof(shot, lock),
                peak: lock.count,
                marks,
                margin: lock.margin,
                photons: photons_per_mark(lock.count, marks, density),
            });
        }
        returns
    }

    /// Whether no bit of `shot` is lit that should be dark, nor dark that should be lit.
    ///
    /// A dark bit is lit if it has half the marks of a lit one and more than chance gives it;
    /// unexplained light only, as other shots may well shine there. A lit bit is dark if it has
    /// less than half the marks of the others and chance would not take away so many.
    fn carries_its_label(&mut self, shot: usize, lock: Lock, around: (&Timeline, f64)) -> bool {
        let (left_over, density) = around;
        let bits = self.bits(shot);
        let lit = bits.clone().filter(|(lit, _)| *lit).count() as u32;
        let mean = f64::from(lock.count) / f64::from(lit);
        let in_word = self.codebook.word(self.log.word[shot]).marks.len() as u16;
        let by_chance = self.bit_thresholds.least(in_word, density);
        let seen_share = mean / f64::from(in_word);
        for (lit, bit) in bits {
            if lit && lock.count == self.weight(shot) {
                continue;
            }
            let timeline = if lit { self.seen() } else { left_over };
            let found = self.found_in_bit(shot, lock.lag + bit, timeline);
            let half = 2.0 * f64::from(found) >= mean;
            let wrong = if lit {
                let missing = binomial_tail(in_word, 1.0 - seen_share, in_word - found);
                !half && missing <= self.receiver.false_alarm
            } else {
                half && found >= by_chance
            };
            if wrong {
                return false;
            }
        }
        true
    }

    /// Two-way time of flight, s. Where edges jitter, the mean over all marks that were found.
    fn tof(&self, shot: usize, lock: Lock) -> f64 {
        let start = self.fired[shot] + lock.lag;
        let tof = self.receiver.tof(self.log.fired_at_fs[shot], start);
        tof + self.mean_offset(shot, start) * units::s_from_fs(self.receiver.tick_fs)
    }

    /// By how many ticks the marks of `shot` are late on average if it begins at `start`. A
    /// window that is not centred on them would cut one side off, so it is centred again.
    fn mean_offset(&self, shot: usize, start: i64) -> f64 {
        const ROUNDS: usize = 3;
        let reach = i64::from(self.width / 2);
        if reach == 0 {
            return 0.0;
        }
        let mut mean = f64::from(self.width - 1) / 2.0;
        for _ in 0..ROUNDS {
            let middle = mean.round() as i64;
            let (mut sum, mut count) = (0, 0);
            for mark in self.marks(shot) {
                let late = (middle - reach..=middle + reach)
                    .filter(|late| self.ticks.has(start + mark + late));
                for late in late {
                    sum += late;
                    count += 1;
                }
            }
            mean = f64::from(sum as i32) / f64::from(count.max(1));
        }
        mean
    }
}

/// For how many ticks from its earliest place on a mark is looked for: ±2 σ of the jitter and the
/// tick itself, which holds 19 of 20 marks. Below σ = 1/20 tick hardly any mark leaves its tick.
fn window(jitter: f64) -> u32 {
    if jitter > 0.05 { 1 + (4.0 * jitter).ceil().min(1023.0) as u32 } else { 1 }
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
