//! The matched receiver: the lag at which the whole known macropulse of a shot fits best.
//!
//! 1. *Peel.* Macropulses of which every mark is there are taken off the stream of ticks one
//!    after another: no lag can have more. In clear weather this is all.
//! 2. *Track.* Neighbouring pixels see neighbouring ranges: around the lags of the neighbours the
//!    exact maximum is taken. Half of the marks, or twice what chance can give, with none of the
//!    lit bits missing, cannot be a sidelobe (an own lobe that far off leaves a bit dark) nor
//!    another shot.
//! 3. *Search.* The ticks of a shot that is found need no other explanation; what is left over is
//!    searched for the shots that no neighbour predicted, the bright ones first: where many
//!    bright ones overlap, their light could pass for a faint one.
//! 4. *Contest.* A predicted shot keeps its lag unless unexplained ticks crowd somewhere in its
//!    gate: then these are searched for a better one. The light of the lesser one is explained,
//!    too.
//! 5. *Check.* A bit that should be dark must not be lit, nor a lit one dark.
//!
//! 6. *Further surfaces.* Where several returns of a shot are wanted, the light that is left is
//!    searched for more of it.
//!
//! A return is believed if chance would not reach its count of marks at any lag of the gate, see
//! [`super::threshold`].

mod contest;
#[cfg(test)]
mod exhaustive;
mod further;
mod leftover;
mod peel;
mod track;
mod verdict;

use std::cell::{Cell, OnceCell};
use std::ops::Range;

use super::correlator::Counts;
use super::field::{self, Field};
use super::search::Search;
use super::threshold::Thresholds;
use super::{Effort, FARTHEST_JITTER, Pick, Receiver, Returns};
use crate::ShotLog;
use crate::Ticks;
use crate::code::{CodeWord, Codebook};
use crate::kernels::{Pattern, WordTicks};
use leftover::Evidence;

/// Decodes one band.
pub(super) fn decode(receiver: &Receiver, sent: (&Codebook, &ShotLog), ticks: &Ticks) -> Returns {
    let sent = Sent::new(receiver, sent, ticks.epoch);
    let peeled = peel::peel(&sent, &ticks.tick);
    let mut band = Band::new(&sent, (&ticks.tick, peeled), MEMORY.take());
    if !band.is_dark() {
        // What can be tracked from somewhere need not be searched, and is out of the way then.
        band.search(Evidence::Overwhelming, SOUNDINGS);
        band.track_back(Evidence::Overwhelming);
        band.search(Evidence::Overwhelming, 1);
        // Where light lies upon light everywhere, more stands out when some is explained.
        while band.search(Evidence::Bright, 1) > band.locks.len() / MANY_FOUND {}
        // Faint light is one among many ticks everywhere: soundings must do.
        let every = if sent.is_thorough() { 1 } else { SOUNDINGS };
        band.search(Evidence::MoreThanChance, every);
        band.track_back(Evidence::MoreThanChance);
        band.contest();
        band.search_further();
    }
    let returns = band.returns();
    MEMORY.set(band.into_memory());
    returns
}

/// Where soundings are taken, one shot in this many in a row is searched for; the rows are
/// staggered by this many shots.
const SOUNDINGS: u32 = 16;
const STAGGER: u32 = 5;

/// After one in so many shots was found, the others are searched for once more.
const MANY_FOUND: usize = 64;

/// So many places of a gate may be taken for a code word by mistake, and looked at again.
const FEW: f64 = 50.0;

/// Surfaces that light of a shot may come from beside the one that is taken for its range.
const SURFACES: usize = 3;

/// Returns of a shot that this receiver can give at most.
pub(super) const MOST_RETURNS: u8 = 1 + SURFACES as u8;

/// How often chance may light an end of a macropulse where there is none.
const BY_CHANCE: f64 = 1e-3;

thread_local! {
    /// Kept from band to band: fresh memory costs more than what is done with it.
    static MEMORY: Cell<Memory> = Cell::default();
}

/// Memory of a band.
#[derive(Default)]
struct Memory {
    field: field::Memory,
    search: Search,
    thresholds: Vec<Thresholds>,
    all_found: Vec<f32>,
}

/// The lag at which a shot was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Lock {
    lag: i64,
    count: u16,
    margin: u16,
}

/// What was sent, as the receiver knows it.
struct Sent<'a> {
    receiver: &'a Receiver,
    codebook: &'a Codebook,
    log: &'a ShotLog,
    /// Absolute time of tick 0, in ticks.
    epoch: i64,
    /// Tick in which each shot was fired.
    fired: Vec<i64>,
    /// Length of the stretch in which a mark may be found, in ticks.
    width: u32,
    /// The code words, in ticks, each once somebody asks: one pixel of a flash has a single word.
    words: Vec<OnceCell<WordTicks>>,
    /// The same as bits: where everything is clear nobody asks.
    bits: Vec<OnceCell<Bits>>,
}

/// A code word, as bits.
struct Bits {
    pattern: Pattern,
    /// The ticks that it explains, half a window before each mark and as many behind it.
    explained: Pattern,
}

impl<'a> Sent<'a> {
    fn new(receiver: &'a Receiver, sent: (&'a Codebook, &'a ShotLog), epoch: i64) -> Self {
        let (codebook, log) = sent;
        let fired = receiver.all_fired(log).iter().map(|fired| fired - epoch).collect();
        let width = window(receiver.jitter_ticks);
        let words = vec![OnceCell::new(); codebook.words()];
        let bits = (0..codebook.words()).map(|_| OnceCell::new()).collect();
        Self { receiver, codebook, log, epoch, fired, width, words, bits }
    }

    /// The code word of `shot` as bits, one for each mark.
    fn pattern(&self, shot: usize) -> &Pattern {
        &self.as_bits(shot).pattern
    }

    /// The ticks that the code word of `shot` explains, from so many before its start on.
    fn explains(&self, shot: usize) -> (i64, &Pattern) {
        (self.farther().into(), &self.as_bits(shot).explained)
    }

    /// How many ticks before a mark others are explained by it: one edge in twenty jitters farther
    /// than marks are looked for.
    fn farther(&self) -> u32 {
        self.width / 2
    }

    fn as_bits(&self, shot: usize) -> &Bits {
        let word = self.log.word[shot];
        self.bits[usize::from(word)].get_or_init(|| {
            let scale = self.receiver.ticks_per_chip as usize;
            let pattern = |width: u32| {
                let marks = self.codebook.word(word).marks.iter();
                Pattern::new(marks.map(|&mark| scale * usize::from(mark)), width as usize)
            };
            Bits { pattern: pattern(1), explained: pattern(self.width + 2 * self.farther()) }
        })
    }

    /// The lit chips of `shot`.
    fn marks(&self, shot: usize) -> &'a [u16] {
        self.codebook.marks(self.log.label[shot], self.log.word[shot])
    }

    /// Number of marks of `shot`.
    fn weight(&self, shot: usize) -> u16 {
        (self.lit_bits(shot).len() * self.word(shot).marks()) as u16
    }

    /// The first chip of each lit bit of `shot`.
    fn lit_bits(&self, shot: usize) -> &'a [u32] {
        self.codebook.lit_bits(self.log.label[shot])
    }

    /// The code word of `shot`.
    fn word(&self, shot: usize) -> &WordTicks {
        let word = self.log.word[shot];
        self.words[usize::from(word)].get_or_init(|| {
            WordTicks::new(&self.codebook.word(word).marks, self.receiver.ticks_per_chip)
        })
    }

    /// Ticks per chip.
    fn scale(&self) -> i64 {
        i64::from(self.receiver.ticks_per_chip)
    }

    /// The marks of `shot`, in ticks from its start.
    fn places(&self, shot: usize) -> impl ExactSizeIterator<Item = i64> + use<'a> {
        let scale = self.scale();
        self.marks(shot).iter().map(move |&mark| scale * i64::from(mark))
    }

    /// The first tick of each lit bit of the payload of `shot`, or of each dark one.
    fn bits(&self, shot: usize, lit: bool) -> impl Iterator<Item = i64> + use<> {
        let (label, word) = (self.log.label[shot], self.log.word[shot]);
        let (payload, bits) = match self.codebook.payload() {
            Some(payload) => (payload.encode(label), payload.bits()),
            None => (1, 1),
        };
        let length = i64::from(self.codebook.word(word).length) * self.scale();
        let is_lit = move |&bit: &u32| payload >> (bits - 1 - bit) & 1 == 1;
        (0..bits).filter(move |bit| is_lit(bit) == lit).map(move |bit| i64::from(bit) * length)
    }

    /// Length of a macropulse, in ticks.
    fn length(&self) -> i64 {
        i64::from(self.codebook.chips()) * self.scale()
    }

    /// Bits of a payload.
    fn bits_of_payload(&self) -> i64 {
        self.codebook.payload().map_or(1, |payload| i64::from(payload.bits()))
    }

    /// Nearest and farthest lag.
    fn gate(&self) -> (i64, i64) {
        (self.receiver.gate_ticks.0.into(), self.receiver.gate_ticks.1.into())
    }

    /// Whether faint light is searched for wherever it may be.
    fn is_thorough(&self) -> bool {
        self.receiver.effort == Effort::Thorough
    }

    /// Whether surfaces of a shot beside the strongest one are asked for.
    fn wants_further(&self) -> bool {
        self.receiver.returns > 1 || self.receiver.pick != Pick::Strongest
    }

    /// Number of lags in the gate.
    fn lags(&self) -> f64 {
        let (nearest, farthest) = self.gate();
        (farthest - nearest).max(0) as f64 + 1.0
    }

    /// The time in which light of `shot` can arrive.
    fn gate_and_macropulse(&self, shot: usize) -> Range<i64> {
        let (nearest, farthest) = self.gate();
        let end = farthest + self.length() + i64::from(self.width);
        self.fired[shot] + nearest..self.fired[shot] + end
    }

    /// The time in which light of any shot can arrive.
    fn span(&self) -> Range<i64> {
        match self.fired.len() {
            0 => 0..0,
            shots => self.gate_and_macropulse(0).start..self.gate_and_macropulse(shots - 1).end,
        }
    }
}

struct Band<'a> {
    sent: &'a Sent<'a>,
    field: Field<'a>,
    /// How many there were to begin with in the gate of each shot; empty if nowhere any.
    left_in_gate: Vec<u32>,
    /// The shot at the same column one line earlier.
    above: Vec<Option<u32>>,
    locks: Vec<Option<Lock>>,
    /// Further surfaces that each shot was found at.
    behind: Vec<[Option<Lock>; SURFACES]>,
    thresholds: Thresholds,
    /// For the bits of one macropulse instead of the lags of a gate.
    bit_thresholds: Thresholds,
    /// For a code word that few places of a gate have by chance.
    word_thresholds: Thresholds,
    /// For the first marks of a macropulse, or the last ones.
    end_thresholds: Thresholds,
    /// For each word, the marks that one tick may count for, once somebody asks.
    marks_per_tick: Vec<OnceCell<u32>>,
    /// For each shot, the number of marks that nowhere in its gate are unexplained.
    barren: Vec<u16>,
    counts: Counts,
    /// Memory for the lit bits of a shot.
    bits: Vec<usize>,
    /// Memory for light nobody has explained.
    residual: Vec<u64>,
    search: Search,
    /// Photons per mark where all marks are found, by their number.
    all_found: Vec<f32>,
}

impl<'a> Band<'a> {
    fn new(sent: &'a Sent<'a>, ticks: (&'a [u32], peel::Peeled), memory: Memory) -> Self {
        let (ticks, peel::Peeled { locks, mut again, left }) = ticks;
        if !sent.wants_further() {
            again.clear();
        }
        // Nobody looks at a field that is explained altogether.
        let dark = left.as_ref().is_some_and(Vec::is_empty) && again.is_empty();
        let span = if dark { 0..0 } else { sent.span() };
        let receiver = sent.receiver;
        let words = if dark { 0 } else { sent.codebook.words() };
        let (lags, false_alarm) = (sent.lags(), receiver.false_alarm);
        let bits = sent.bits_of_payload() as f64;
        let wanted = [(lags, false_alarm), (bits, false_alarm), (lags, FEW), (1.0, BY_CHANCE)]
            .map(|(places, false_alarm)| Thresholds::new(places, false_alarm, sent.is_thorough()));
        let mut remembered = memory.thresholds;
        remembered.retain(|known| wanted.iter().any(|wanted| known.is_as(wanted)));
        let [thresholds, bit_thresholds, word_thresholds, end_thresholds] =
            wanted.map(|wanted| match remembered.iter().position(|known| known.is_as(&wanted)) {
                Some(known) => remembered.swap_remove(known),
                None => wanted,
            });
        Self {
            sent,
            field: Field::new((ticks, left.as_deref()), sent.width, span, memory.field),
            left_in_gate: match &left {
                _ if dark => vec![],
                Some(left) => in_gates(sent, left),
                None => vec![u32::MAX; sent.fired.len()],
            },
            above: if dark { vec![] } else { above(sent.log) },
            behind: match dark {
                true => vec![],
                false => further::found_again(locks.len(), again),
            },
            locks,
            thresholds,
            bit_thresholds,
            word_thresholds,
            end_thresholds,
            counts: Counts::default(),
            bits: Vec::new(),
            residual: Vec::new(),
            barren: vec![u16::MAX; if dark { 0 } else { sent.fired.len() }],
            marks_per_tick: vec![OnceCell::new(); words],
            search: memory.search,
            all_found: memory.all_found,
        }
    }

    fn into_memory(self) -> Memory {
        let thresholds =
            vec![self.thresholds, self.bit_thresholds, self.word_thresholds, self.end_thresholds];
        let (field, all_found) = (self.field.into_memory(), self.all_found);
        Memory { field, search: self.search, thresholds, all_found }
    }

    /// Most marks of `shot` that one tick may count for; `None` where nobody looks at a field.
    fn marks_per_tick(&self, shot: usize) -> Option<u32> {
        let word = self.sent.log.word[shot];
        let cell = self.marks_per_tick.get(usize::from(word))?;
        let chips = self.sent.width.div_ceil(self.sent.receiver.ticks_per_chip.max(1));
        Some(*cell.get_or_init(|| crowding(self.sent.codebook.word(word), chips)))
    }

    /// Whether nothing is left to be explained.
    fn is_dark(&self) -> bool {
        self.left_in_gate.is_empty()
    }

    /// Share of lit places around a shot found at `lock`, its own marks apart.
    fn density_around(&self, shot: usize, lock: Lock) -> f64 {
        let places = usize::from(self.sent.weight(shot)) * self.sent.width as usize;
        let start = self.sent.fired[shot] + lock.lag;
        self.field.density_without(start..start + self.sent.length(), (lock.count.into(), places))
    }

    /// Share of lit places in the gate of `shot`.
    fn density_in_gate(&self, shot: usize) -> f64 {
        let (nearest, farthest) = self.sent.gate();
        let fired = self.sent.fired[shot];
        self.field.density(fired + nearest..fired + farthest + 1)
    }

    /// The marks that chance does not reach, be it as dense in all the gate as around `lock`. The
    /// marks found count among the light around: chance finds most where there is most.
    fn by_chance(&mut self, shot: usize, lock: Lock) -> u16 {
        let start = self.sent.fired[shot] + lock.lag;
        let around = self.field.density(start..start + self.sent.length());
        let density = self.density_in_gate(shot).max(around);
        self.thresholds.least(self.sent.weight(shot), density)
    }

    /// Whether there may be light of `shot` that nobody has explained: two marks at least.
    fn may_be_lit(&self, shot: usize) -> bool {
        self.left_in_gate[shot] > 1 && self.sent.weight(shot) > 0
    }

    /// Keeps `lock` and explains its ticks.
    fn lock(&mut self, shot: usize, lock: Lock) {
        self.explain(shot, lock.lag);
        self.locks[shot] = Some(lock);
    }

    /// Explains the ticks of `shot` at `lag`.
    fn explain(&mut self, shot: usize, lag: i64) {
        let (farther, pattern) = self.sent.explains(shot);
        let start = self.sent.fired[shot] + lag - farther;
        let scale = self.sent.scale();
        let bits = self.sent.lit_bits(shot).iter().map(|&bit| start + scale * i64::from(bit));
        let end = start + self.sent.length() + i64::from(self.sent.width) + 2 * farther;
        let unexplained = self.field.unexplained(start..end);
        unexplained.explain(bits, pattern);
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

/// For each shot, how many of the sorted `ticks` lie where its light may be.
fn in_gates(sent: &Sent, ticks: &[u32]) -> Vec<u32> {
    let (mut first, mut last) = (0, 0);
    let count = |shot| {
        let gate = sent.gate_and_macropulse(shot);
        let before = |end: i64| move |tick: &&u32| i64::from(**tick) < end;
        first += ticks[first..].iter().take_while(before(gate.start)).count();
        last += ticks[last..].iter().take_while(before(gate.end)).count();
        (last - first) as u32
    };
    (0..sent.fired.len()).map(count).collect()
}

/// For each shot, the last one before it at the same column of another row.
fn above(log: &ShotLog) -> Vec<Option<u32>> {
    let columns = log.column.iter().max().map_or(0, |&column| usize::from(column) + 1);
    let mut last = vec![None; columns];
    let mut above = Vec::with_capacity(log.len());
    for shot in 0..log.len() {
        let at_column = &mut last[usize::from(log.column[shot])];
        above.push(at_column.filter(|&other: &u32| log.row[other as usize] != log.row[shot]));
        *at_column = Some(shot as u32);
    }
    above
}

#[cfg(test)]
mod tests {
    use super::exhaustive::{PERIOD, codebook, exhaustive, log, receiver};
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    #[test]
    fn a_search_finds_the_maximum_over_the_gate() {
        let mut chance = ChaCha8Rng::seed_from_u64(3);
        let (codebook, log) = (codebook(), log(1));
        let mut found = 0;
        for ticks in [1, 5, 60, 200, 600] {
            for jitter in [0.0, 0.2, 0.5] {
                let mut tick: Vec<u32> = (0..ticks).map(|_| chance.next_u32() % 5900).collect();
                tick.sort_unstable();
                tick.dedup();
                let receiver = Receiver { false_alarm: 1e4, ..receiver(jitter) };
                let sent = Sent::new(&receiver, (&codebook, &log), 0);
                let nothing = peel::Peeled { locks: vec![None], again: vec![], left: None };
                let mut band = Band::new(&sent, (&tick, nothing), Memory::default());
                let (lag, count) = exhaustive(&sent, &tick, 0);
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
            let start = shot as u32 * PERIOD + 50 + chance.next_u32() % 4951;
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
        let sent = Sent::new(&receiver, (&codebook, &log), 0);
        for (&shot, (&tof, &peak)) in returns.shot.iter().zip(returns.tof.iter().zip(&returns.peak))
        {
            let (lag, count) = exhaustive(&sent, &ticks.tick, shot as usize);
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
