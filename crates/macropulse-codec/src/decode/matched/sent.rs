//! The light sent, as the receiver knows it: shots and code words, counted in ticks.

use std::cell::OnceCell;
use std::ops::Range;

use super::chance::BY_CHANCE;
use super::spacing::{crowded, crowding, shared};
use super::track::NEAREST_SIDE;
use crate::ShotLog;
use crate::code::{CodeWord, Codebook, Family, Payload};
use crate::decode::timeline::Timeline;
use crate::decode::timing;
use crate::decode::{Correlation, Pick, Receiver, window};
use crate::kernels::{Pattern, WordTicks};

/// The light sent.
pub(super) struct Sent<'a> {
    pub receiver: &'a Receiver,
    pub correlation: &'a Correlation,
    pub codebook: &'a Codebook,
    pub log: &'a ShotLog,
    /// Absolute time of tick 0, in ticks.
    pub epoch: i64,
    /// Tick in which each shot was fired.
    pub fired: Vec<i64>,
    /// The lags at which light is looked for: see [`Self::reach`].
    reach: Range<i64>,
    /// Number of marks of each shot.
    weights: Vec<u32>,
    /// Bits of a payload, the length of each, and of all, in ticks.
    bits: i64,
    bit_length: i64,
    length: i64,
    /// Ticks to each bit about a macropulse, from one length before its start to one length behind its end.
    /// They count from the first of these bits.
    bits_about: Vec<u32>,
    /// Length of the stretch in which a mark may be found, in ticks.
    pub width: u32,
    pub words: Words,
}

/// Number of first marks of a word. One of them may be the first that is not hidden under another macropulse.
pub(super) const FIRST: usize = 3;

/// One of the first marks of a word.
#[derive(Debug, Clone, Copy)]
pub(super) struct First {
    /// Ticks from the start of the word to it.
    mark: u32,
    /// Ticks from it to the next one; 0 where there is none.
    pub gap: u32,
    /// True if the word has that mark.
    exists: bool,
}

/// The code words of a family and the bits of all labels, in ticks. Kept from band to band: there are hundreds.
#[derive(Default)]
pub(super) struct Words {
    /// The family, payload, ticks to a chip and places to a mark for which it was made.
    of: Option<(Family, Option<Payload>, u32, u32, u32)>,
    words: Vec<Word>,
    labels: Vec<Label>,
    /// Ticks from the start of a macropulse to each of its bits, label by label.
    bits: Vec<u32>,
}

/// A code word.
struct Word {
    first: [First; FIRST],
    /// How many marks it has.
    marks: u32,
    /// Most of them that one tick may count for.
    per_tick: u32,
    /// Its marks as ticks.
    ticks: WordTicks,
    /// The same as bits, made when they are first needed: one pixel of a flash has a single word, and clear light
    /// needs none.
    bits: OnceCell<Bits>,
}

impl Word {
    /// The code word `word`, with `scale` ticks a chip. A tick may count for marks in `places` chips in a
    /// row.
    fn new(word: &CodeWord, scale: u32, places: u32) -> Self {
        let marks = &word.marks;
        let first = std::array::from_fn(|mark| {
            let pair = marks.get(mark).zip(marks.get(mark + 1));
            let gap = pair.map_or(0, |(mark, next)| scale * u32::from(next - mark));
            let mark = marks.get(mark).map(|mark| scale * u32::from(*mark));
            First { mark: mark.unwrap_or(0), gap, exists: mark.is_some() }
        });
        let (ticks, per_tick) = (WordTicks::new(marks, scale), crowding(word, places));
        Self { first, marks: marks.len() as u32, per_tick, ticks, bits: OnceCell::new() }
    }
}

/// The bits of a label among those of [`Words`]: the lit ones, and behind them the dark ones.
struct Label {
    lit: u32,
    dark: u32,
    end: u32,
}

impl Words {
    /// Makes them those of the `codebook`.
    fn of(self, codebook: &Codebook, scale: u32, width: u32) -> Self {
        let (payload, labels) = (codebook.payload().copied(), codebook.labels());
        let of = Some((codebook.family().clone(), payload, labels, scale, width));
        if self.of == of {
            return self;
        }
        let places = width.div_ceil(scale.max(1));
        let words = (0..codebook.words()).map(|word| codebook.word(word as u16));
        let words = words.map(|word| Word::new(word, scale, places)).collect();
        let in_payload = payload.map_or(1, |payload| payload.bits());
        let length = codebook.chips() / in_payload;
        let all = (0..in_payload).map(|bit| bit * length);
        let mut bits = Vec::new();
        let of_label = |label: u32| {
            let (chips, lit) = (codebook.lit_bits(label as u16), bits.len() as u32);
            bits.extend(chips.iter().map(|chip| scale * chip));
            let dark = bits.len() as u32;
            let is_dark = |chip: &u32| chips.binary_search(chip).is_err();
            bits.extend(all.clone().filter(is_dark).map(|chip| scale * chip));
            Label { lit, dark, end: bits.len() as u32 }
        };
        let labels = (0..labels).map(of_label).collect();
        Self { of, words, labels, bits }
    }

    /// Ticks from the start of a macropulse with this `label` to each bit of it that is lit.
    #[inline]
    fn lit(&self, label: u16) -> &[u32] {
        let Label { lit, dark, .. } = self.labels[usize::from(label)];
        &self.bits[lit as usize..dark as usize]
    }
}

/// A code word, as bits.
pub(super) struct Bits {
    /// One bit for each mark.
    pub pattern: Pattern,
    /// The ticks that are cancelled with it, from [`Sent::farther`] before its start on.
    pub cancelled: Pattern,
    /// The places at which a mark counts as found because of it, from twice that and a window
    /// before its start on.
    pub claimed: Pattern,
    /// The first marks and the last ones, no farther apart than the lags beside a block, and how many
    /// these are.
    pub ends: [(u32, Pattern); 2],
    /// Marks that a tick may count for besides an earlier one.
    pub shared: u32,
    /// The marks whose ticks can be those of no other mark, and the ticks from the start of the word to all others.
    alone: Pattern,
    crowded: Vec<u32>,
    /// How far other marks of the word are from a mark, and from what share of them, as far as their
    /// ticks may be counted with its own.
    pub neighbours: Vec<(i64, f64)>,
}

impl<'a> Sent<'a> {
    pub fn new(
        receiver: &'a Receiver,
        correlation: &'a Correlation,
        sent: (&'a Codebook, &'a ShotLog),
        (epoch, words): (i64, Words),
    ) -> Self {
        let (codebook, log) = sent;
        let fired = receiver.fired_since(log, epoch);
        let &Correlation { ticks_per_chip, jitter_ticks, .. } = correlation;
        let width = window(jitter_ticks);
        let words = words.of(codebook, ticks_per_chip, width);
        let weight = |(label, word): (&u16, &u16)| {
            words.lit(*label).len() as u32 * words.words[usize::from(*word)].marks
        };
        let weights = log.label.iter().zip(&log.word).map(weight).collect();
        let bits = codebook.payload().map_or(1, |payload| i64::from(payload.bits()));
        let length = i64::from(codebook.chips()) * i64::from(ticks_per_chip);
        let bit_length = length / bits;
        let bits_about = (0..3 * bits).map(|bit| (bit * bit_length) as u32).collect();
        Self {
            reach: receiver.lags_of_light(correlation, length),
            receiver,
            correlation,
            codebook,
            log,
            epoch,
            fired,
            weights,
            bits,
            bit_length,
            length: bits * bit_length,
            bits_about,
            width,
            words,
        }
    }

    /// The code word of `shot`.
    #[inline]
    fn code_word(&self, shot: usize) -> &Word {
        &self.words.words[usize::from(self.log.word[shot])]
    }

    /// The first marks of the word of `shot`.
    #[inline]
    pub fn first_marks(&self, shot: usize) -> &[First; FIRST] {
        &self.code_word(shot).first
    }

    /// Ticks from the start of the macropulse of `shot` to its first mark but for those `hidden`.
    #[inline(always)]
    pub fn first_mark(&self, shot: usize, hidden: usize) -> Option<i64> {
        let bit = self.lit_bits(shot).first()?;
        let first = self.first_marks(shot)[hidden];
        first.exists.then_some(i64::from(*bit) + i64::from(first.mark))
    }

    /// The code word of `shot`, as ticks in a row.
    #[inline]
    pub fn word(&self, shot: usize) -> &WordTicks {
        &self.code_word(shot).ticks
    }

    /// The code word of `shot`, as bits.
    pub fn bits(&self, shot: usize) -> &Bits {
        self.code_word(shot).bits.get_or_init(|| {
            let word = self.codebook.word(self.log.word[shot]);
            let scale = self.correlation.ticks_per_chip;
            let marks = self.word(shot).ticks();
            let pattern =
                |width: u32| Pattern::new(marks.iter().map(|&mark| mark as usize), width as usize);
            let cancelled = self.cancelled();
            let chips = self.width.div_ceil(scale.max(1));
            let (first, last) = (marks.first().copied(), marks.last().copied());
            let of_end = |is_at_end: &dyn Fn(u32) -> bool| {
                let marks = marks.iter().filter(|mark| is_at_end(**mark));
                (marks.clone().count() as u32, Pattern::new(marks.map(|mark| *mark as usize), 1))
            };
            let ends = [
                of_end(&|mark| first.is_some_and(|first| i64::from(mark - first) < NEAREST_SIDE)),
                of_end(&|mark| last.is_some_and(|last| i64::from(last - mark) < NEAREST_SIDE)),
            ];
            let crowded = crowded(word, chips);
            let in_ticks = |mark: &u16| scale * u32::from(*mark);
            let alone = word.marks.iter().filter(|mark| !crowded.contains(mark));
            Bits {
                shared: shared(word, chips),
                alone: Pattern::new(alone.map(|mark| in_ticks(mark) as usize), 1),
                crowded: crowded.iter().map(in_ticks).collect(),
                ends,
                pattern: pattern(1),
                cancelled: pattern(cancelled),
                claimed: pattern(cancelled + self.width - 1),
                neighbours: self.neighbours(marks),
            }
        })
    }

    fn neighbours(&self, marks: &[u32]) -> Vec<(i64, f64)> {
        let places = timing::lateness(self.width);
        let marks: Vec<i64> = marks.iter().map(|&mark| i64::from(mark)).collect();
        timing::neighbours(&marks, places.end - places.start)
    }

    /// How many ticks before a mark are cancelled with it: one tick in twenty jitters farther than
    /// marks are looked for.
    pub fn farther(&self) -> i64 {
        i64::from(self.width / 2)
    }

    /// Ticks that are cancelled with a mark.
    pub fn cancelled(&self) -> u32 {
        self.width + 2 * self.farther() as u32
    }

    /// Marks that the macropulse of `shot` has more, without a gap, than are met by itself, moved by less than a
    /// code word.
    #[inline]
    pub fn complete_margin(&self, shot: usize) -> u32 {
        let sidelobe = self.codebook.sidelobe(self.log.label[shot], self.log.word[shot]);
        self.weight(shot) - u32::from(sidelobe)
    }

    /// Number of marks of `shot`.
    #[inline]
    pub fn weight(&self, shot: usize) -> u32 {
        self.weights[shot]
    }

    /// Marks of the code word of `shot`.
    pub fn in_word(&self, shot: usize) -> u32 {
        self.code_word(shot).marks
    }

    /// Ticks from the start of the macropulse of `shot` to each bit of it that is lit.
    #[inline]
    pub fn lit_bits(&self, shot: usize) -> &[u32] {
        self.words.lit(self.log.label[shot])
    }

    /// The same of those that are dark.
    pub fn dark_bits(&self, shot: usize) -> &[u32] {
        let Label { dark, end, .. } = self.words.labels[usize::from(self.log.label[shot])];
        &self.words.bits[dark as usize..end as usize]
    }

    /// Sums `found` over the lit bits of `shot` into `sums`, for each shift of its macropulse by whole bits.
    /// The shifts go from one payload earlier to one payload later. `found` has a number for each of the
    /// [`Self::bits_about`] it.
    pub fn in_bits(&self, shot: usize, found: &[u32], sums: &mut Vec<u32>) {
        sums.clear();
        sums.resize(2 * self.bits as usize + 1, 0);
        for bit in self.lit_bits(shot) {
            let bit = i64::from(*bit) / self.bit_length;
            let found = found.get(bit as usize..).unwrap_or_default();
            sums.iter_mut().zip(found).for_each(|(sum, found)| *sum += found);
        }
    }

    /// Length of a macropulse, in ticks.
    pub fn length(&self) -> i64 {
        self.length
    }

    /// Length of one bit of it, in ticks.
    pub fn bit_length(&self) -> i64 {
        self.bit_length
    }

    /// True if two lags lie whole bits `apart`: light then falls on the same marks of other bits.
    pub fn is_whole_bits(&self, apart: i64) -> bool {
        let width = i64::from(self.width);
        !(width..=self.bit_length - width).contains(&apart.rem_euclid(self.bit_length))
    }

    /// Bits of a payload.
    pub fn bits_of_payload(&self) -> i64 {
        self.bits
    }

    /// Returns the ticks to each bit about a macropulse, from one length before its start to one length
    /// behind its end. They count from the first of these bits.
    pub fn bits_about(&self) -> &[u32] {
        &self.bits_about
    }

    /// The lags at which a return is accepted.
    pub fn gate(&self) -> Range<i64> {
        let (nearest, farthest) = self.receiver.gate_ticks;
        i64::from(nearest)..i64::from(farthest) + 1
    }

    /// Returns the lags at which light is looked for: those of the gate, and all beyond it from which light
    /// may come, a macropulse farther at least. Light from beyond has sidelobes within the gate, and lights
    /// marks of later shots. Once found, it is not mistaken for returns.
    pub fn reach(&self) -> Range<i64> {
        self.reach.clone()
    }

    /// The time in which light of `shot` can arrive.
    pub fn arrival(&self, shot: usize) -> Range<i64> {
        let (reach, fired) = (self.reach(), self.fired[shot]);
        fired + reach.start..fired + reach.end - 1 + self.length() + i64::from(self.width)
    }

    /// The end of the block of shots that begins with `first` and lasts `gates` gates.
    pub fn end_of_block(&self, first: usize, gates: i64) -> usize {
        let gate = self.arrival(first);
        let end = self.fired[first] + gates * (gate.end - gate.start);
        self.fired.partition_point(|fired| *fired < end).max(first + 1)
    }

    /// The first shot whose light may still come when that of `shot` does.
    pub fn in_flight_before(&self, shot: usize) -> usize {
        let fired = &self.fired;
        let gate = self.arrival(0);
        let earliest = fired[shot.min(fired.len() - 1)] - (gate.end - gate.start);
        fired.partition_point(|&fired| fired < earliest)
    }

    /// The shots whose light may begin in the `time` if it comes after one of the `lags`.
    pub fn that_begin_in(&self, time: &Range<i64>, lags: &Range<i64>) -> Range<usize> {
        let first = self.fired.partition_point(|fired| fired + lags.end < time.start);
        let end = self.fired.partition_point(|fired| fired + lags.start < time.end);
        first..end.max(first)
    }

    /// The time that light of `shot` takes up if it comes after `lag`.
    pub fn light(&self, shot: usize, lag: i64) -> Range<i64> {
        let start = self.fired[shot] + lag;
        start..start + self.takes_up()
    }

    /// Marks of `shot` that are found `lit` if its light begins at tick `start`, where each of the `ticks` counts for one
    /// of them: the earliest that it may be.
    pub fn marks_with_ticks(
        &self,
        lit: &Timeline,
        ticks: &Timeline,
        shot: usize,
        start: i64,
    ) -> u32 {
        let (bits, lit_bits) = (self.bits(shot), self.lit_bits(shot));
        let (mut count, mut free) = (lit.lit_in_all(start, lit_bits, &bits.alone), start);
        let places =
            lit_bits.iter().flat_map(|bit| bits.crowded.iter().map(move |mark| bit + mark));
        let places = places.map(|place| start + i64::from(place));
        for first in places.filter(|place| lit.has(*place)) {
            let tick = ticks.next_lit(first.max(free)..first + i64::from(self.width));
            (count, free) = tick.map_or((count, free), |tick| (count + 1, tick + 1));
        }
        count
    }

    /// Ticks that the light of a shot takes up.
    pub fn takes_up(&self) -> i64 {
        self.length() + i64::from(self.width) - 1
    }

    /// Fewest ticks that `marks` marks of `shot` can make.
    pub fn ticks_of(&self, shot: usize, marks: u32) -> u32 {
        let alone = marks.saturating_sub(self.bits(shot).shared * self.lit_bits(shot).len() as u32);
        alone.max(self.ticks_in_bit(shot, marks))
    }

    /// Fewest ticks that `marks` marks in one bit of `shot` can make.
    pub fn ticks_in_bit(&self, shot: usize, marks: u32) -> u32 {
        marks.div_ceil(self.code_word(shot).per_tick)
    }

    /// Fewest marks of a shot that has any.
    pub fn lightest(&self) -> Option<u32> {
        self.weights.iter().copied().filter(|weight| *weight > 0).min()
    }

    /// Fewest ticks that `marks` marks of any shot can make.
    pub fn ticks_of_any(&self, marks: u32) -> u32 {
        let per_tick = self.words.words.iter().map(|word| word.per_tick).max();
        marks.div_ceil(per_tick.unwrap_or(1).max(1))
    }

    /// Ticks about a mark that its own light may light: the places at which it is looked for. If each photon makes an
    /// event of its own, these are cancelled with it.
    pub fn zone(&self) -> u32 {
        match self.correlation.photons_apart {
            true => self.cancelled(),
            false => self.width,
        }
    }

    /// Returns the greatest number of ticks that light of `shot` makes if `marks` of it are lit, k of N.
    ///
    /// A mark makes one tick. But if each photon makes an event of its own, and marks have n photons on
    /// average, a mark stays dark with the probability e⁻ⁿ. Then k lit marks stand for
    /// N·n = N·ln(1/(1 − k/N)) photons. Three deviations are added.
    pub fn ticks_at_most(&self, shot: usize, marks: u32) -> u32 {
        if !self.correlation.photons_apart || marks == 0 {
            return marks;
        }
        let weight = f64::from(self.weight(shot));
        let dark = (1.0 - f64::from(marks) / weight).max(0.5 / weight);
        let photons = -weight * libm::log(dark);
        let most = (photons + 3.0 * photons.sqrt()) as u32 + 1;
        most.max(marks).min(marks * self.zone())
    }

    /// How often chance may be taken for light: as often as false returns are accepted, but hardly ever.
    pub fn accepted(&self) -> f64 {
        self.correlation.false_alarm.min(BY_CHANCE)
    }

    /// True if surfaces of a shot beside the strongest one are looked for everywhere. Either the user wants them, or
    /// their light must not pass for that of a bit that should be dark.
    pub fn wants_further(&self) -> bool {
        self.receiver.returns > 1 || self.receiver.pick != Pick::Strongest
    }
}
