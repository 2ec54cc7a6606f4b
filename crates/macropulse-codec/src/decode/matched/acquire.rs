//! Acquisition: the exact maximum over the gate, and where light is left over at all.
//!
//! Coarse pictures of the timeline, one bit for eight ticks, bound the count of marks from above for
//! eight lags at once: a mark that is lit is lit in the picture. There are eight pictures, each a
//! tick later, so that a mark of any place is met by exactly the eight ticks it may fall on. Only
//! where the bound is high enough are the lags counted one by one. What is skipped cannot be the
//! maximum.

use std::ops::Range;

use super::Band;
use super::sent::Sent;
use super::track::{below, places_of};
use crate::decode::field::{Field, Source};
use crate::decode::timeline::Timeline;
use crate::kernels::{COARSE, Counts, WIDE, coarse, is_dark};

/// Lags that are counted at once.
const BLOCK: i64 = 64 * WIDE as i64;

/// Macropulses that are cancelled before the pictures of the residual are made anew: till then they
/// show ticks that are no longer there, which costs time and nothing else.
const STALE: usize = 32;

/// Marks after which it is asked whether enough can still be found.
const CHUNK: usize = 48;

/// Memory kept from search to search.
#[derive(Debug, Default)]
pub(super) struct Search {
    /// The marks of the macropulse at hand in the pictures.
    places: Vec<u32>,
    farthest: u32,
    counts: Counts<WIDE>,
    /// Pictures of shorter stretches, and of whole gates.
    pictures: [Pictures; 2],
    /// Where marks count as found.
    lit: Timeline,
    /// Macropulses that were cancelled since the pictures of whole gates were made.
    stale: usize,
}

/// The pictures of a stretch of time, one for each shift.
#[derive(Debug, Default)]
struct Pictures {
    /// One behind the other.
    words: Vec<u64>,
    /// Machine words of each.
    stride: usize,
    /// What they show.
    shown: Option<(Source, Range<i64>)>,
}

impl Pictures {
    /// Makes them of `span`.
    fn make(&mut self, field: &Field, source: Source, span: &Range<i64>, memory: &mut Timeline) {
        let lit = field.lit_in(source, span, memory);
        let start = (span.start.div_euclid(64) * 64).max(lit.origin());
        let words = lit.words(&(start..span.end + 64 * WIDE as i64));
        // Blocks of lags are read beyond their end.
        self.stride = words.len() / COARSE + 2 * WIDE;
        self.words.resize(self.stride * COARSE, 0);
        for (shift, picture) in self.words.chunks_exact_mut(self.stride).enumerate() {
            coarse(words, shift, picture);
        }
        self.shown = Some((source, start..span.end));
    }

    /// Whether they show all of `span`.
    fn show(&self, source: Source, span: &Range<i64>) -> bool {
        self.shown.as_ref().is_some_and(|(shown, extent)| {
            *shown == source && extent.start <= span.start && span.end <= extent.end
        })
    }
}

impl Search {
    /// Forgets the pictures.
    pub fn forget(&mut self) {
        self.pictures.iter_mut().for_each(|pictures| pictures.shown = None);
        self.stale = 0;
    }

    /// Tells that a macropulse was cancelled.
    pub fn grow_stale(&mut self) {
        self.stale += 1;
        if self.stale == STALE {
            self.forget();
        }
    }

    /// Makes pictures of `span`, unless there are, and tells which these are. Those of more than half
    /// of a `gate` are kept, and show some more: the next shots will be searched for in much the same
    /// time.
    fn show(&mut self, field: &Field, source: Source, span: &Range<i64>, gate: i64) -> usize {
        let is_long = span.end - span.start > gate / 2;
        let which = usize::from(is_long || self.pictures[1].show(source, span));
        if !self.pictures[which].show(source, span) {
            let ahead = if is_long { gate / 4 } else { 0 };
            let end = (span.end + ahead).min(field.extent().end).max(span.end);
            self.pictures[which].make(field, source, &(span.start..end), &mut self.lit);
        }
        which
    }

    /// Those of the `valid` bits from bit `first` of the pictures on that may have `needed` marks.
    fn bounded(
        &mut self,
        first: u32,
        needed: u32,
        (which, valid): (usize, [u64; WIDE]),
    ) -> [u64; WIDE] {
        let pictures = &self.pictures[which];
        self.counts.clear();
        let mut left = self.places.len() as u32;
        let mut hits = valid;
        for places in self.places.chunks(CHUNK) {
            self.counts.add(&pictures.words, first, places, self.farthest);
            left -= places.len() as u32;
            if needed > left {
                let enough = self.counts.at_least(needed - left);
                hits = std::array::from_fn(|lane| enough[lane] & valid[lane]);
                if is_dark(&hits) {
                    break;
                }
            }
        }
        hits
    }
}

impl Band<'_> {
    /// The lag with most marks of `shot` in the `source`, the earliest of several, of the `lags`
    /// given, ascending; `None` where fewer than `least` are found anywhere. And how many they are.
    pub(super) fn maximum(
        &mut self,
        shot: usize,
        source: Source,
        lags: &[Range<i64>],
        least: u32,
    ) -> Option<(i64, u32)> {
        let (sent, fired) = (self.sent, self.sent.fired[shot]);
        let (Some(from), Some(to)) = (lags.first(), lags.last()) else { return None };
        if least > sent.weight(shot) {
            return None;
        }
        let span = fired + from.start..fired + to.end + sent.length() + i64::from(sent.width);
        let search = &mut self.search;
        let gate = self.sent.gate();
        let which = search.show(&self.field, source, &span, gate.end - gate.start);
        let pictures = &search.pictures[which];
        let origin = pictures.shown.as_ref().map_or(0, |(_, extent)| extent.start);
        places_of(sent, shot, &mut self.places);
        let stride = 64 * pictures.stride as u32;
        let in_pictures = |mark: &u32| mark % COARSE as u32 * stride + mark / COARSE as u32;
        search.places.clear();
        search.places.extend(self.places.iter().map(in_pictures));
        search.farthest = search.places.iter().copied().max().unwrap_or(0);
        let bit_of = |lag: i64| (fired + lag - origin) / COARSE as i64;
        let mut best = None;
        let mut needed = least.max(1);
        for lags in lags {
            let (first, last) = (bit_of(lags.start), bit_of(lags.end - 1));
            for block in (first..=last).step_by(BLOCK as usize) {
                let valid = below(last + 1 - block, [u64::MAX; WIDE], true);
                let hits = self.search.bounded(block as u32, needed, (which, valid));
                // A machine word of the picture stands for one block of lags.
                for lane in (0..WIDE).filter(|lane| hits[*lane] != 0) {
                    let first = origin + COARSE as i64 * (block + 64 * lane as i64) - fired;
                    let (lag, count) = self.exactly(source, fired + first, lags, first);
                    if count >= needed {
                        (best, needed) = (Some((lag, count)), count + 1);
                    }
                }
            }
        }
        best
    }

    /// The lag with most of the marks at `places` in the `source`, the earliest of several, of those
    /// `lags` that are in the block that begins with lag `first`, which is tick `start`.
    fn exactly(&mut self, source: Source, start: i64, lags: &Range<i64>, first: i64) -> (i64, u32) {
        let span = start..start + BLOCK + self.sent.length();
        let search = &mut self.search;
        let (words, begin) = self.field.lit_in(source, &span, &mut search.lit).at(start);
        let farthest = self.places.last().copied().unwrap_or(0);
        search.counts.clear();
        search.counts.add(words, begin as u32, &self.places, farthest);
        let allowed = below(lags.start - first, [u64::MAX; WIDE], false);
        let allowed = below(lags.end - first, allowed, true);
        let highest = search.counts.highest(allowed);
        highest.map_or((first, 0), |(at, count)| (first + i64::from(at), count))
    }
}

/// Where light that is left over may be looked for.
pub(super) struct Leftover<'a> {
    sent: &'a Sent<'a>,
    /// For each cell of a stretch of time, the residual ticks in a macropulse that begins there, and
    /// some more.
    stretches: Vec<u32>,
    begin: i64,
    cell: i64,
    /// Cells that a macropulse takes up.
    together: usize,
    fullest: u32,
}

/// A search takes hardly any time if so many blocks of lags, each with all its marks, are counted: at
/// a nanosecond each, a microsecond.
const SOON: i64 = 1000;

/// In a gate of so many macropulses or more one of them raises the mean hardly.
const MANY: usize = 16;

impl<'a> Leftover<'a> {
    /// Of the light that arrives in `span`.
    pub fn new(sent: &'a Sent<'a>, field: &Field, span: &Range<i64>) -> Self {
        let mut stretches = Vec::new();
        let length = sent.length() + i64::from(sent.width);
        let begin = field.residual_stretches(span, length, &mut stretches);
        let fullest = stretches.iter().copied().max().unwrap_or(0);
        let together = field.stretch(length);
        Self { sent, stretches, begin, cell: field.cell(), together, fullest }
    }

    /// Whether there are nowhere so many ticks.
    pub fn is_empty_of(&self, ticks: u32) -> bool {
        self.fullest < ticks
    }

    /// The cells in which light of `shot` begins that comes after the `lags`.
    fn cells(&self, fired: i64, lags: &Range<i64>) -> Range<usize> {
        let cell = |tick: i64| ((tick - self.begin) / self.cell).max(0) as usize;
        let end = (cell(fired + lags.end - 1) + 1).min(self.stretches.len());
        cell(fired + lags.start).min(end)..end
    }

    /// Share of places that are lit by what is left over where light of `shot` may begin.
    pub fn density(&self, shot: usize, lags: &Range<i64>) -> f64 {
        let stretches = &self.stretches[self.cells(self.sent.fired[shot], lags)];
        let ticks = stretches.iter().map(|&ticks| f64::from(ticks)).sum::<f64>();
        let places = (stretches.len().max(1) * self.together) as f64 * self.cell as f64;
        (ticks * f64::from(self.sent.width) / places).min(1.0)
    }

    /// Those of the `lags` of `shot` at which `least` of its marks may be left over; none where hardly
    /// anything is left but what chance spreads evenly. With `is_even` light is looked for that does
    /// not stand out, too.
    pub fn lags(
        &self,
        shot: usize,
        lags: Range<i64>,
        least: u32,
        is_even: bool,
    ) -> Vec<Range<i64>> {
        let mut places: Vec<Range<i64>> = Vec::new();
        let sent = self.sent;
        let (enough, fired) = (sent.ticks_of(shot, least), sent.fired[shot]);
        if self.fullest < enough || lags.is_empty() {
            return places;
        }
        let cells = self.cells(fired, &lags);
        let stretches = &self.stretches[cells.clone()];
        let mean = stretches.iter().map(|&ticks| u64::from(ticks)).sum::<u64>() as f64
            / stretches.len().max(1) as f64;
        // In a short gate it may be full everywhere of light that is sought; and what is soon searched
        // need not stand out.
        let blocks = (lags.end - lags.start) / (BLOCK * COARSE as i64);
        let is_long = stretches.len() > MANY * self.together
            && blocks * i64::from(sent.weight(shot)) > SOON
            && !sent.is_thorough();
        let fullest = stretches.iter().copied().max().map_or(0.0, f64::from);
        // What is sought adds to what chance spreads evenly.
        let may_be = mean + f64::from(enough) - 3.0 * mean.sqrt();
        let stands_out = fullest > mean + 5.0 * mean.sqrt();
        if is_long && !stands_out && !(is_even && fullest >= may_be) {
            return places;
        }
        let at = |cell: usize| self.begin + self.cell * (cells.start + cell) as i64 - fired;
        for (cell, _) in stretches.iter().enumerate().filter(|(_, ticks)| **ticks >= enough) {
            let (from, to) = (at(cell).max(lags.start), at(cell + 1).min(lags.end));
            match places.last_mut() {
                Some(last) if last.end >= from => last.end = to,
                _ => places.push(from..to),
            }
        }
        places
    }
}
