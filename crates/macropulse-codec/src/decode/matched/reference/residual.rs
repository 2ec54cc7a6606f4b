//! The light at hand, as the returns that were taken leave it.

use std::ops::Range;

use super::Sent;
use super::search::Peak;
use crate::decode::belief::{self, Marks, Prior, Surroundings, evidence};
use crate::decode::field::Field;
use crate::decode::timeline::Timeline;
use crate::kernels::{count_each, look_ahead};

/// Ticks that no return explains, and places that returns claim.
pub(in crate::decode::matched) struct Residual<'a> {
    pub sent: &'a Sent<'a>,
    /// The time at hand, in whole machine words.
    extent: Range<i64>,
    /// Ticks that no return explains.
    left: Timeline,
    /// Places at which a mark of a return, or a tick that it explains, counts as found.
    claimed: Timeline,
    /// Unclaimed places at which a mark counts as found by a tick that is left.
    lit: Timeline,
    /// Places that are lit or claimed.
    open: Timeline,
    /// Machine words of a cell.
    cell: usize,
    /// Ticks that are left in each cell, and places that are claimed there.
    in_cells: [Vec<u32>; 2],
    /// Memory.
    widened: Vec<u64>,
}

/// Approximate number of cells in a macropulse. A cell has 1 to 64 machine words.
const CELLS: i64 = 32;

/// Ticks and places of one shot that are the same for all its lags.
#[derive(Debug, Clone, Copy)]
pub(in crate::decode::matched) struct Gate {
    pub shot: usize,
    /// Ticks that are left where its light may be.
    pub ticks: u32,
    /// Unclaimed places there.
    places: f64,
}

/// A part of a [`Residual`], as it was.
pub(in crate::decode::matched) struct Saved {
    span: Range<i64>,
    words: [Vec<u64>; 4],
}

impl<'a> Residual<'a> {
    pub fn new(sent: &'a Sent<'a>) -> Self {
        let dark = Timeline::default;
        let (left, claimed, lit, open) = (dark(), dark(), dark(), dark());
        let cell = (sent.takes_up() / CELLS / 64).clamp(1, 64) as usize;
        let (in_cells, widened) = (Default::default(), Vec::new());
        Self { sent, extent: 0..0, left, claimed, lit, open, cell, in_cells, widened }
    }

    /// Starts again with all the light of `field`: no return explains any of it.
    pub fn restore(&mut self, field: &Field) {
        self.extent = field.extent();
        let Range { start, end } = self.extent;
        self.timelines().into_iter().for_each(|timeline| timeline.clear_all(start, end - start));
        let seen = field.seen().words(&self.extent);
        self.left.words_mut(&self.extent).copy_from_slice(seen);
        let cells = self.left.words(&self.extent).len().div_ceil(self.cell);
        self.in_cells.iter_mut().for_each(|counts| counts.resize(cells, 0));
        self.renew(&self.extent.clone());
    }

    fn timelines(&mut self) -> [&mut Timeline; 4] {
        [&mut self.left, &mut self.claimed, &mut self.lit, &mut self.open]
    }

    /// Whole machine words at hand that hold `span`.
    fn words_of(&self, span: &Range<i64>) -> Range<i64> {
        let Range { start, end } = self.extent;
        let first = (span.start.div_euclid(64) * 64).clamp(start, end);
        first..((span.end + 63).div_euclid(64) * 64).clamp(first, end)
    }

    /// Finds anew what is lit where `span` has changed.
    fn renew(&mut self, span: &Range<i64>) {
        let width = i64::from(self.sent.width);
        let places = self.words_of(&(span.start - width..span.end));
        let ticks = self.words_of(&(places.start..places.end + width));
        let left = self.left.words(&ticks);
        self.widened.resize(left.len(), 0);
        look_ahead(left, &mut self.widened, width as usize - 1);
        let lit = self.lit.words_mut(&places).iter_mut().zip(self.open.words_mut(&places));
        let claimed = self.claimed.words(&places).iter().zip(&self.widened);
        for ((lit, open), (claimed, widened)) in lit.zip(claimed) {
            *lit = widened & !claimed;
            *open = widened | claimed;
        }
        self.count(&places);
    }

    /// Counts anew what is in the cells of `span`.
    fn count(&mut self, span: &Range<i64>) {
        let ticks = 64 * self.cell as i64;
        let begin = self.extent.start;
        let cell = |tick: i64| (tick - begin) / ticks;
        let cells = cell(span.start)..cell(span.end + ticks - 1);
        let whole = begin + cells.start * ticks..(begin + cells.end * ticks).min(self.extent.end);
        let cells = cells.start as usize..cells.end as usize;
        for (counts, of) in self.in_cells.iter_mut().zip([&self.left, &self.claimed]) {
            count_each(of.words(&whole), self.cell, &mut counts[cells.clone()]);
        }
    }

    /// Returns the time that contains all that light of `shot` at `lag` explains or claims.
    pub fn touched(&self, shot: usize, lag: i64) -> Range<i64> {
        let (light, farther) = (self.sent.light(shot, lag), self.sent.farther());
        light.start - farther - i64::from(self.sent.width)..light.end + farther
    }

    /// Explains the ticks of `shot` at `lag`, and claims its places.
    pub fn explain(&mut self, shot: usize, lag: i64) {
        let (sent, start) = (self.sent, self.sent.fired[shot] + lag);
        let (bits, lit_bits) = (sent.bits(shot), sent.lit_bits(shot));
        let (farther, width) = (sent.farther(), i64::from(sent.width));
        self.left.put_out(start - farther, lit_bits, &bits.cancelled);
        self.claimed.light_up(start - farther - (width - 1), lit_bits, &bits.claimed);
        self.renew(&self.touched(shot, lag));
    }

    /// Returns the content of `span`.
    pub fn save(&mut self, span: &Range<i64>) -> Saved {
        let span = self.words_of(span);
        Saved { words: self.timelines().map(|timeline| timeline.words(&span).to_vec()), span }
    }

    /// Puts back what was saved.
    pub fn put_back(&mut self, saved: &Saved) {
        for (timeline, words) in self.timelines().into_iter().zip(&saved.words) {
            timeline.words_mut(&saved.span).copy_from_slice(words);
        }
        self.count(&saved.span);
    }

    /// Places at which unclaimed marks count as found.
    pub fn lit(&self) -> &Timeline {
        &self.lit
    }

    /// Places that are lit or claimed.
    pub fn open(&self) -> &Timeline {
        &self.open
    }

    /// Returns the fewest places that are neither about marks of `shot` nor among the claimed ones, whose
    /// number is `claimed`.
    pub fn fewest_places(&self, shot: usize, claimed: u32) -> u32 {
        let taken = claimed + self.sent.weight(shot) * self.sent.zone();
        (self.sent.takes_up() as u32).saturating_sub(taken)
    }

    /// Makes `sums` those of `span`.
    pub fn sum_up(&self, span: &Range<i64>, sums: &mut Sums) {
        let ticks = 64 * self.cell as i64;
        let all = self.in_cells[0].len() as i64;
        let cell = |tick: i64| ((tick - self.extent.start).div_euclid(ticks)).clamp(0, all);
        let cells = cell(span.start)..cell(span.end + ticks - 1);
        (sums.first, sums.cell) = (self.extent.start + cells.start * ticks, ticks);
        let cells = cells.start as usize..cells.end.max(cells.start) as usize;
        for (sums, counts) in [&mut sums.left, &mut sums.taken].into_iter().zip(&self.in_cells) {
            sums.clear();
            sums.push(0);
            let mut sum = 0;
            sums.extend(counts[cells.clone()].iter().map(|count| {
                sum += count;
                sum
            }));
        }
    }

    /// All the light of `shot`.
    pub fn gate(&self, shot: usize) -> Gate {
        let span = self.sent.arrival(shot);
        let [ticks, taken] = [(0, &self.left), (1, &self.claimed)]
            .map(|(counts, of)| self.count_with_cells(&self.in_cells[counts], of, &span));
        let free = span.end - span.start - i64::from(taken);
        Gate { shot, ticks, places: free as f64 }
    }

    /// Counts the lit bits of a timeline in `span`. The `counts` are those of whole cells.
    fn count_with_cells(&self, counts: &[u32], of: &Timeline, span: &Range<i64>) -> u32 {
        let (begin, ticks) = (self.extent.start, 64 * self.cell as i64);
        let first = (span.start - begin + ticks - 1).div_euclid(ticks).max(0) as usize;
        let end = ((span.end - begin).div_euclid(ticks).max(0) as usize).min(counts.len());
        if first >= end {
            return of.count(span.clone());
        }
        let tick = |cell: usize| begin + cell as i64 * ticks;
        let whole: u32 = counts[first..end].iter().sum();
        whole + of.count(span.start..tick(first)) + of.count(tick(end)..span.end)
    }

    /// The marks of a shot at `lag` that no return claims, and the light about them.
    ///
    /// A tick is one piece of evidence: where it may be one of two marks it counts for one, the earliest. As all
    /// marks are looked for in equally many ticks, no other choice gives more marks a tick. All other ticks are
    /// surroundings, but where each photon makes an event of its own those about the marks tell nothing.
    pub fn look(&self, gate: &Gate, lag: i64) -> (Marks, Surroundings) {
        let (sent, shot, light) = (self.sent, gate.shot, self.sent.light(gate.shot, lag));
        let (bits, lit_bits) = (sent.bits(shot), sent.lit_bits(shot));
        let claimed = self.claimed.lit_in_all(light.start, lit_bits, &bits.pattern);
        let of = sent.weight(shot) - claimed;
        let lit = sent.marks_with_ticks(&self.lit, &self.left, shot, light.start);
        let most = sent.ticks_at_most(shot, lit);
        let own = match sent.correlation.photons_apart {
            true => {
                let about = light.start - sent.farther();
                self.left.lit_in_all(about, lit_bits, &bits.cancelled).min(most)
            }
            false => lit,
        };
        let beside = self.left.count(light.clone()).saturating_sub(own);
        let taken = i64::from(self.claimed.count(light.clone()) + of * sent.zone());
        let places = (light.end - light.start - taken) as f64;
        (Marks { lit, of }, self.surroundings(beside, places, gate.without(own)))
    }

    /// Returns the evidence for light of a shot at `lag`, and its odds.
    pub fn peak(&self, gate: &Gate, lag: i64, prior: &Prior) -> Peak {
        let (marks, around) = self.look(gate, lag);
        let evidence = evidence(marks, &around);
        Peak { lag, marks, evidence, odds: evidence + prior.at(lag) }
    }

    /// Returns the surroundings with this number of `ticks` in `places`, for a shot with this `gate`.
    ///
    /// A mark is looked for in several ticks in a row. This number of places is one trial, which one tick
    /// lights.
    pub fn surroundings(&self, ticks: u32, places: f64, gate: Gate) -> Surroundings {
        let width = f64::from(self.sent.width);
        let places = places.max(0.0) / width;
        let density = (f64::from(gate.ticks) + 1.0) * width / gate.places.max(1.0);
        Surroundings { lit: f64::from(ticks).min(places), places, density: density.min(0.5) }
    }

    /// The [contradiction](belief::contradiction) of the label of a shot at `lag`.
    pub fn contradiction(&self, gate: &Gate, lag: i64, prior: &Prior) -> f64 {
        let (sent, shot) = (self.sent, gate.shot);
        let in_bits = |bits: &[u32]| self.in_bits(shot, lag, bits);
        let (lit, dark) = (in_bits(sent.lit_bits(shot)), in_bits(sent.dark_bits(shot)));
        let (_, around) = self.look(gate, lag);
        belief::contradiction(&lit, &dark, &around, prior.expected(lag))
    }

    /// Returns the marks of the word of `shot` in each of the `bits`. These are given in ticks behind the
    /// start of its light at `lag`.
    fn in_bits(&self, shot: usize, lag: i64, bits: &[u32]) -> Vec<Marks> {
        let (start, word) = (self.sent.fired[shot] + lag, self.sent.word(shot).ticks());
        let of_bit = |bit: &u32| {
            let places = word.iter().map(|mark| start + i64::from(bit + mark));
            places.filter(|place| !self.claimed.has(*place)).fold(Marks::default(), |sum, place| {
                Marks { lit: sum.lit + u32::from(self.lit.has(place)), of: sum.of + 1 }
            })
        };
        bits.iter().map(of_bit).collect()
    }
}

/// Ticks that are left and places that are claimed before each cell of a stretch.
#[derive(Debug, Default)]
pub(in crate::decode::matched) struct Sums {
    first: i64,
    /// Ticks of a cell.
    cell: i64,
    left: Vec<u32>,
    taken: Vec<u32>,
}

impl Sums {
    /// The difference of the `sums` at two cells.
    fn between(sums: &[u32], from: i64, to: i64) -> u32 {
        let last = sums.len() as i64 - 1;
        let before = |cell: i64| sums[cell.clamp(0, last) as usize];
        before(to).saturating_sub(before(from))
    }

    /// The cell that `tick` is in.
    fn cell_of(&self, tick: i64) -> i64 {
        (tick - self.first).div_euclid(self.cell)
    }

    fn about(&self, sums: &[u32], span: &Range<i64>) -> u32 {
        Self::between(sums, self.cell_of(span.start), self.cell_of(span.end + self.cell - 1))
    }

    /// No fewer ticks than are left in `span`.
    pub fn ticks(&self, span: &Range<i64>) -> u32 {
        self.about(&self.left, span)
    }

    /// No more ticks than are left in `span`.
    pub fn ticks_within(&self, span: &Range<i64>) -> u32 {
        let [from, to] = [span.start + self.cell - 1, span.end].map(|tick| self.cell_of(tick));
        Self::between(&self.left, from, to.max(from))
    }

    /// No fewer places than are claimed in `span`.
    pub fn claimed(&self, span: &Range<i64>) -> u32 {
        self.about(&self.taken, span)
    }
}

impl Gate {
    /// A gate with no more ticks and no fewer places. Both are rounded to three bits, so that many gates have the same.
    pub fn coarse(self) -> Self {
        let step = libm::exp2((libm::floor(libm::log2(self.places.max(1.0))) - 2.0).max(0.0));
        Self {
            ticks: first_bits(self.ticks, 3),
            places: libm::ceil(self.places / step) * step,
            ..self
        }
    }

    /// Its ticks and places, as a key of a table.
    pub fn key(&self) -> (u32, u64) {
        (self.ticks, self.places.to_bits())
    }

    /// Returns the gate without this number of `ticks`.
    pub fn without(self, ticks: u32) -> Self {
        Self { ticks: self.ticks.saturating_sub(ticks), ..self }
    }
}

/// The `number` rounded down to its first `bits`.
pub(super) fn first_bits(number: u32, bits: u32) -> u32 {
    let shift = (u32::BITS - bits).saturating_sub(number.leading_zeros());
    number >> shift << shift
}
