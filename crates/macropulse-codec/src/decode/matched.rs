//! The matched receiver: the lag at which the whole known macropulse of a shot fits best.
//!
//! The receiver cancels successively, as multi-user detectors do: the ticks of each macropulse that
//! is found are taken out, and the next one is looked for in the residual.
//!
//! 1. *Cancel.* Macropulses of which every mark is there are taken off the stream of ticks one
//!    after another: no lag can have more. In clear weather this is all.
//! 2. *Track.* Neighbouring pixels see neighbouring ranges: around the lags of the neighbours the
//!    exact maximum is taken. Half of the marks, or twice what chance can give, with none of the
//!    lit bits missing, cannot be a sidelobe (an own lobe that far off leaves a bit dark) nor
//!    another shot.
//! 3. *Acquire.* The residual is searched for the shots that no neighbour predicted, first on a
//!    grid of pixels, the bright ones first: where many bright ones overlap, their light could pass
//!    for a faint one.
//! 4. *Test for multipath.* A predicted shot keeps its lag unless the residual is crowded somewhere
//!    in its gate: then that is searched for a competing return. The light of the weaker one of the
//!    two is cancelled, too.
//! 5. *Check.* A bit that should be dark must not be lit, nor a lit one dark.
//! 6. *Secondary returns.* Where several returns of a shot are wanted, the residual is searched for
//!    more of its surfaces.
//!
//! A return is believed if chance would not reach its count of marks at any lag of the gate, see
//! [`super::threshold`].

mod multipath;
#[cfg(test)]
mod exhaustive;
mod further;
mod acquisition;
mod cancellation;
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
use acquisition::Evidence;

/// Decodes one band.
pub(super) fn decode(receiver: &Receiver, sent: (&Codebook, &ShotLog), ticks: &Ticks) -> Returns {
    let sent = Sent::new(receiver, sent, ticks.epoch);
    let cancelled = cancellation::cancel(&sent, &ticks.tick);
    let mut band = Band::new(&sent, (&ticks.tick, cancelled), MEMORY.take());
    if !band.is_dark() {
        // What can be tracked from somewhere need not be searched, and is out of the way then.
        band.search(Evidence::Overwhelming, ACQUISITION_GRID);
        band.track_back(Evidence::Overwhelming);
        band.search(Evidence::Overwhelming, 1);
        // Where macropulses overlap everywhere, more of them stand out when some are cancelled.
        while band.search(Evidence::Bright, 1) > band.detections.len() / MANY_FOUND {}
        // Faint light is one tick among many everywhere: a search of the grid must do.
        let every = if sent.is_thorough() { 1 } else { ACQUISITION_GRID };
        band.search(Evidence::MoreThanChance, every);
        band.track_back(Evidence::MoreThanChance);
        band.test_multipath();
        band.search_further();
    }
    let returns = band.returns();
    MEMORY.set(band.into_memory());
    returns
}

/// The acquisition grid: one shot in this many in a row is searched for in all of its gate; the
/// rows are staggered by this many shots.
const ACQUISITION_GRID: u32 = 16;
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
struct Detection {
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
    /// The code words, in ticks, each made when it is first needed: one pixel of a flash has a
    /// single word.
    words: Vec<OnceCell<WordTicks>>,
    /// The same as bits, needed only where light is not clear.
    bits: Vec<OnceCell<Bits>>,
}

/// A code word, as bits.
struct Bits {
    pattern: Pattern,
    /// The ticks that are cancelled with it, half a window before each mark and as many behind it.
    cancelled: Pattern,
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

    /// The ticks that are cancelled with the code word of `shot`, from so many before its start on.
    fn cancels(&self, shot: usize) -> (i64, &Pattern) {
        (self.farther().into(), &self.as_bits(shot).cancelled)
    }

    /// How many ticks before a mark are cancelled with it: one tick in twenty jitters farther than
    /// marks are looked for.
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
            Bits { pattern: pattern(1), cancelled: pattern(self.width + 2 * self.farther()) }
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
    /// Ticks of the residual in the gate of each shot, to begin with; empty if there are nowhere
    /// any.
    residual_in_gate: Vec<u32>,
    /// The shot at the same column one line earlier.
    above: Vec<Option<u32>>,
    detections: Vec<Option<Detection>>,
    /// The secondary returns of each shot.
    secondary: Vec<[Option<Detection>; SURFACES]>,
    thresholds: Thresholds,
    /// For the bits of one macropulse instead of the lags of a gate.
    bit_thresholds: Thresholds,
    /// For a code word that few places of a gate have by chance.
    word_thresholds: Thresholds,
    /// For the first marks of a macropulse, or the last ones.
    end_thresholds: Thresholds,
    /// For each word, the marks that one tick may count for, worked out when first needed.
    marks_per_tick: Vec<OnceCell<u32>>,
    /// For each shot its known-empty bound: no lag of its gate has so many marks in the residual.
    known_empty: Vec<u16>,
    counts: Counts,
    /// Memory for the lit bits of a shot.
    bits: Vec<usize>,
    /// Memory for the residual of a block.
    residual_bits: Vec<u64>,
    search: Search,
    /// Photons per mark where all marks are found, by their number.
    all_found: Vec<f32>,
}

impl<'a> Band<'a> {
    fn new(
        sent: &'a Sent<'a>,
        ticks: (&'a [u32], cancellation::Cancelled),
        memory: Memory,
    ) -> Self {
        let (ticks, cancellation::Cancelled { detections, mut again, residual }) = ticks;
        if !sent.wants_further() {
            again.clear();
        }
        // A field that is cancelled altogether is never looked at.
        let dark = residual.as_ref().is_some_and(Vec::is_empty) && again.is_empty();
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
            field: Field::new((ticks, residual.as_deref()), sent.width, span, memory.field),
            residual_in_gate: match &residual {
                _ if dark => vec![],
                Some(residual) => in_gates(sent, residual),
                None => vec![u32::MAX; sent.fired.len()],
            },
            above: if dark { vec![] } else { above(sent.log) },
            secondary: match dark {
                true => vec![],
                false => further::found_again(detections.len(), again),
            },
            detections,
            thresholds,
            bit_thresholds,
            word_thresholds,
            end_thresholds,
            counts: Counts::default(),
            bits: Vec::new(),
            residual_bits: Vec::new(),
            known_empty: vec![u16::MAX; if dark { 0 } else { sent.fired.len() }],
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

    /// Most marks of `shot` that one tick may count for; `None` where the field is empty.
    fn marks_per_tick(&self, shot: usize) -> Option<u32> {
        let word = self.sent.log.word[shot];
        let cell = self.marks_per_tick.get(usize::from(word))?;
        let chips = self.sent.width.div_ceil(self.sent.receiver.ticks_per_chip.max(1));
        Some(*cell.get_or_init(|| crowding(self.sent.codebook.word(word), chips)))
    }

    /// Whether the residual is empty.
    fn is_dark(&self) -> bool {
        self.residual_in_gate.is_empty()
    }

    /// Share of lit places around a shot found at `detection`, its own marks apart.
    fn density_around(&self, shot: usize, detection: Detection) -> f64 {
        let places = usize::from(self.sent.weight(shot)) * self.sent.width as usize;
        let start = self.sent.fired[shot] + detection.lag;
        self.field
            .density_without(start..start + self.sent.length(), (detection.count.into(), places))
    }

    /// Share of lit places in the gate of `shot`.
    fn density_in_gate(&self, shot: usize) -> f64 {
        let (nearest, farthest) = self.sent.gate();
        let fired = self.sent.fired[shot];
        self.field.density(fired + nearest..fired + farthest + 1)
    }

    /// The marks that chance does not reach, be it as dense in all the gate as around `detection`.
    /// The marks found count among the light around: chance finds most where there is most.
    fn by_chance(&mut self, shot: usize, detection: Detection) -> u16 {
        let start = self.sent.fired[shot] + detection.lag;
        let around = self.field.density(start..start + self.sent.length());
        let density = self.density_in_gate(shot).max(around);
        self.thresholds.least(self.sent.weight(shot), density)
    }

    /// Whether there may be light of `shot` in the residual: two marks at least.
    fn may_be_lit(&self, shot: usize) -> bool {
        self.residual_in_gate[shot] > 1 && self.sent.weight(shot) > 0
    }

    /// Keeps `detection` and cancels its ticks.
    fn keep(&mut self, shot: usize, detection: Detection) {
        self.cancel(shot, detection.lag);
        self.detections[shot] = Some(detection);
    }

    /// Cancels the ticks of `shot` at `lag`.
    fn cancel(&mut self, shot: usize, lag: i64) {
        let (farther, pattern) = self.sent.cancels(shot);
        let start = self.sent.fired[shot] + lag - farther;
        let scale = self.sent.scale();
        let bits = self.sent.lit_bits(shot).iter().map(|&bit| start + scale * i64::from(bit));
        let end = start + self.sent.length() + i64::from(self.sent.width) + 2 * farther;
        let residual = self.field.residual(start..end);
        residual.cancel(bits, pattern);
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
                let nothing = cancellation::Cancelled {
                    detections: vec![None],
                    again: vec![],
                    residual: None,
                };
                let mut band = Band::new(&sent, (&tick, nothing), Memory::default());
                let (lag, count) = exhaustive(&sent, &tick, 0);
                if let Some(detection) = band.searched(0, 1) {
                    found += 1;
                    assert_eq!((detection.lag, detection.count), (lag, count));
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
