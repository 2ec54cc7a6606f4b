//! Acquisition: the exact maximum over the gate.
//!
//! Coarse pictures of the timeline, one bit for eight ticks, bound the count of marks from above for
//! eight lags at once: a mark that is lit is lit in the picture. There are eight pictures, each a
//! tick later, so that a mark of any place is met by exactly the eight ticks it may fall on. Lags
//! whose bound is high enough are looked at one by one, in falling order of the bound, until none
//! can be better than what was found. What is skipped cannot be the maximum.

use std::ops::Range;

use super::sent::Sent;
use super::track::{BLOCK, below, places_of};
use super::{Band, Detection};
use crate::decode::field::Field;
use crate::kernels::{BLOCK_WORDS, Block, COARSE, Counts, coarse, is_dark};

/// Which ticks are searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    /// All of them.
    Seen,
    /// Those that are not cancelled.
    Residual,
}

/// Macropulses that are cancelled before the pictures of the residual are made anew: till then they
/// show ticks that are no longer there, which costs time and nothing else.
const STALE: usize = 32;

/// Marks after which it is asked whether enough can still be found.
const CHUNK: usize = 48;

/// Memory kept from search to search.
#[derive(Debug, Default)]
pub(super) struct Search {
    /// The marks of the macropulse at hand.
    pub places: Vec<u32>,
    /// The same in the pictures.
    coarse_places: Vec<u32>,
    /// The pictures, one behind the other.
    pictures: Vec<u64>,
    /// Machine words of each.
    stride: usize,
    /// What they show, where they begin, and how many macropulses were cancelled since.
    shown: Option<(Source, Range<i64>)>,
    stale: usize,
    /// Where marks count as found in what they show.
    shown_lit: Vec<u64>,
    /// The same in the ticks about a block of lags.
    lit: Vec<u64>,
    /// Lags that may be the maximum, eight at a time, each with its bound.
    candidates: Vec<(u32, i64)>,
    /// Lags that were looked at one by one, by the first of each block.
    seen: Vec<i64>,
}

impl Search {
    /// Forgets the pictures.
    pub fn forget(&mut self) {
        self.shown = None;
    }

    /// Tells that a macropulse was cancelled.
    pub fn grow_stale(&mut self) {
        self.stale += 1;
    }

    /// Whether nothing was cancelled since the pictures were made, which begin before tick `start`.
    fn is_fresh(&self, start: i64) -> bool {
        let begins = self.shown.as_ref().is_some_and(|(_, span)| span.start <= start);
        begins && self.stale == 0
    }

    /// Makes pictures of `span` and some more, unless there are.
    fn show(&mut self, field: &Field, source: Source, span: &Range<i64>) {
        let is_shown = self.shown.as_ref().is_some_and(|(shown, extent)| {
            *shown == source && extent.start <= span.start && span.end <= extent.end
        });
        if is_shown && (source == Source::Seen || self.stale < STALE) {
            return;
        }
        // The next shots will be searched for in much the same time.
        let extent = field.extent();
        let ahead = span.end + (span.end - span.start) / 4;
        let all = span.start.max(extent.start)..ahead.clamp(span.end, extent.end.max(span.end));
        let all = all.start.div_euclid(64) * 64..all.end;
        let start = match source {
            Source::Seen => {
                self.shown_lit.clear();
                self.shown_lit.extend_from_slice(field.lit().words(&all));
                all.start
            }
            Source::Residual => field.lit_in_residual(&all, &mut self.shown_lit),
        };
        // Blocks of lags are read beyond their end.
        self.stride = self.shown_lit.len() / COARSE + 2 * BLOCK_WORDS;
        self.pictures.resize(self.stride * COARSE, 0);
        for (shift, picture) in self.pictures.chunks_exact_mut(self.stride).enumerate() {
            coarse(&self.shown_lit, shift, picture);
        }
        self.shown = Some((source, start..all.end));
        self.stale = 0;
    }
}

impl Band<'_> {
    /// The lag with most marks of `shot` in the `source`, the earliest of several, of the `lags`
    /// given; `None` where fewer than `least` are found anywhere. And how many they are.
    pub(super) fn maximum(
        &mut self,
        shot: usize,
        source: Source,
        lags: Range<i64>,
        least: u32,
    ) -> Option<(i64, u32)> {
        let (sent, fired) = (self.sent, self.sent.fired[shot]);
        let weight = sent.weight(shot);
        if weight == 0 || lags.is_empty() || least > weight {
            return None;
        }
        let span = fired + lags.start..fired + lags.end + sent.length() + i64::from(sent.width);
        self.search.show(&self.field, source, &span);
        let search = &mut self.search;
        let origin = search.shown.as_ref().map_or(0, |(_, span)| span.start);
        places_of(sent, shot, &mut search.places);
        let (places, stride) = (&search.places, search.stride * 64);
        search.coarse_places.clear();
        search.coarse_places.extend(
            places.iter().map(|&mark| mark % COARSE as u32 * stride as u32 + mark / COARSE as u32),
        );
        search.seen.clear();
        let begin = fired + lags.start - origin;
        let first = begin / COARSE as i64;
        let last = (begin + (lags.end - lags.start) - 1) / COARSE as i64;
        // The lag of a bit of a picture; the first one may begin before the first lag.
        let lag_of = |bit: i64| origin + COARSE as i64 * bit - fired;
        let mut best: Option<(i64, u32)> = None;
        for block in (first..=last).step_by(BLOCK as usize) {
            let needed = best.map_or(least, |(_, count)| count);
            let valid = below(last + 1 - block, [u64::MAX; BLOCK_WORDS], true);
            let search = &mut self.search;
            let hits = bounded(search, &mut self.counts, block as u32, (needed, valid));
            search.candidates.clear();
            let many = hits.iter().map(|hits| hits.count_ones()).sum::<u32>() > MANY_HITS;
            for (lane, mut hits) in hits.into_iter().enumerate() {
                while hits != 0 {
                    let bit = 64 * lane as u32 + hits.trailing_zeros();
                    hits &= hits - 1;
                    // Where there are many, each would have to be looked at.
                    let bound = if many { weight } else { self.counts.at(bit) };
                    search.candidates.push((bound, lag_of(block + i64::from(bit))));
                    if many {
                        // The block about this one is looked at, whatever else is in it.
                        hits = 0;
                    }
                }
            }
            if !many {
                search.candidates.sort_unstable_by_key(|&(bound, lag)| (u32::MAX - bound, lag));
            }
            for index in 0..self.search.candidates.len() {
                let (bound, lag) = self.search.candidates[index];
                if best.is_some_and(|(at, count)| bound < count || bound == count && lag > at) {
                    continue;
                }
                // The eighth of a picture block that a machine word of it stands for is one block.
                let first = if many {
                    lag_of(block + (lag - lag_of(block)) / BLOCK * 64)
                } else {
                    lag - BLOCK / 2 + COARSE as i64 / 2
                };
                let covers = |seen: &i64| *seen <= lag && lag + COARSE as i64 <= seen + BLOCK;
                if self.search.seen.iter().any(covers) {
                    continue;
                }
                self.search.seen.push(first);
                let Some((lag, count)) = self.exactly(shot, source, (first, &lags)) else {
                    continue;
                };
                let is_better =
                    best.is_none_or(|(at, most)| count > most || count == most && lag < at);
                if count >= least && is_better {
                    best = Some((lag, count));
                }
            }
        }
        best
    }

    /// The lag with most marks of `shot` in the `source`, the earliest of several, of those `lags`
    /// that are in the [`BLOCK`] from lag `first` on.
    pub(super) fn exactly(
        &mut self,
        shot: usize,
        source: Source,
        (first, lags): (i64, &Range<i64>),
    ) -> Option<(i64, u32)> {
        let allowed = below(lags.start - first, [u64::MAX; BLOCK_WORDS], false);
        let allowed = below(lags.end - first, allowed, true);
        let start = self.sent.fired[shot] + first;
        places_of(self.sent, shot, &mut self.search.places);
        let (words, begin) = match source {
            Source::Seen => self.field.lit().at(start),
            Source::Residual if self.search.is_fresh(start) => {
                let origin = self.search.shown.as_ref().map_or(0, |(_, span)| span.start);
                (self.search.shown_lit.as_slice(), (start - origin) as usize)
            }
            Source::Residual => {
                let span = start..start + BLOCK + self.sent.length();
                let origin = self.field.lit_in_residual(&span, &mut self.search.lit);
                (self.search.lit.as_slice(), (start - origin).max(0) as usize)
            }
        };
        self.counts.clear();
        self.counts.add(words, begin as u32, &self.search.places);
        let (at, count) = self.counts.highest(allowed)?;
        Some((first + i64::from(at), count))
    }

    /// The peak in the gate of `shot` that most marks in the `source` lead to, if they are `least`.
    pub(super) fn acquired(
        &mut self,
        shot: usize,
        source: Source,
        lags: Range<i64>,
        least: u32,
    ) -> Option<Detection> {
        let (lag, _) = self.maximum(shot, source, lags, least)?;
        self.climb(shot, lag, 1)
    }
}

/// Those of the `valid` bits from bit `first` of the pictures on that may have `needed` marks, their
/// bounds in `counts`.
fn bounded(
    search: &Search,
    counts: &mut Counts,
    first: u32,
    (needed, valid): (u32, Block),
) -> Block {
    counts.clear();
    let mut left = search.coarse_places.len() as u32;
    for places in search.coarse_places.chunks(CHUNK) {
        counts.add(&search.pictures, first, places);
        left -= places.len() as u32;
        if needed > left {
            let enough = counts.at_least(needed - left);
            let hits: Block = std::array::from_fn(|lane| enough[lane] & valid[lane]);
            if is_dark(&hits) || left == 0 {
                return hits;
            }
        }
    }
    valid
}

/// Where light that is left over may be looked for.
#[derive(Debug, Default)]
pub(super) struct Leftover {
    /// For each cell of the block, the residual ticks in a macropulse that begins there, and some
    /// more.
    stretches: Vec<u32>,
    begin: i64,
    cell: i64,
    /// Cells that a stretch takes up.
    together: i64,
    fullest: u32,
}

impl Leftover {
    /// Of the light of a block of shots, which arrives in `span`.
    pub fn new(sent: &Sent, field: &Field, span: &Range<i64>) -> Self {
        let mut stretches = Vec::new();
        let length = sent.length() + i64::from(sent.width);
        let begin = field.residual_stretches(span, length, &mut stretches);
        let fullest = stretches.iter().copied().max().unwrap_or(0);
        let (cell, together) = (field.cell(), field.stretch(length) as i64);
        Self { stretches, begin, cell, together, fullest }
    }

    /// Share of places of `span` that are lit by what is left over.
    pub fn density(&self, sent: &Sent, span: &Range<i64>) -> f64 {
        let cell = |tick: i64| ((tick - self.begin) / self.cell).max(0) as usize;
        let to = cell(span.end).min(self.stretches.len());
        let stretches = &self.stretches[cell(span.start).min(to)..to];
        let ticks = stretches.iter().map(|&ticks| u64::from(ticks)).sum::<u64>() as f64;
        let places = (stretches.len().max(1) as i64 * self.together * self.cell) as f64;
        (ticks * f64::from(sent.width) / places).min(1.0)
    }

    /// Those of the `lags` of `shot` at which `least` of its marks may be left over; none where hardly
    /// anything is left but what chance spreads evenly. With `is_even` light is looked for that does
    /// not stand out, too.
    pub fn lags(
        &self,
        (sent, shot): (&Sent, usize),
        lags: Range<i64>,
        least: u32,
        is_even: bool,
    ) -> Range<i64> {
        let enough = sent.ticks_of(shot, least);
        if self.fullest < enough {
            return 0..0;
        }
        let fired = sent.fired[shot];
        let cell = |tick: i64| ((tick - self.begin) / self.cell).max(0) as usize;
        let to = (cell(fired + lags.end - 1) + 1).min(self.stretches.len());
        let from = cell(fired + lags.start).min(to);
        let stretches = &self.stretches[from..to];
        let (mut sum, mut fullest) = (0, 0);
        for &ticks in stretches {
            sum += ticks;
            fullest = ticks.max(fullest);
        }
        let mean = f64::from(sum) / stretches.len().max(1) as f64;
        // In a short gate it may be full everywhere of light that is sought; and what is soon searched
        // need not stand out.
        let blocks = (lags.end - lags.start) / (BLOCK * COARSE as i64);
        let is_long = lags.end - lags.start > MANY * sent.length()
            && blocks * i64::from(sent.weight(shot)) > SOON
            && !sent.is_thorough();
        let sigma = mean.sqrt();
        let stands_out = f64::from(fullest) > mean + 5.0 * sigma;
        let may_be = is_even && f64::from(fullest) >= mean + f64::from(enough) - 3.0 * sigma;
        if fullest < enough || is_long && !stands_out && !may_be {
            return 0..0;
        }
        let is_enough = |ticks: &u32| *ticks >= enough;
        let first = stretches.iter().position(is_enough).unwrap_or(0);
        let last = stretches.iter().rposition(is_enough).unwrap_or(0);
        let at = |cell: usize| self.begin + self.cell * (from + cell) as i64 - fired;
        at(first).max(lags.start)..at(last + 1).min(lags.end)
    }
}

/// If more bits of a block of a picture may be the maximum, all ticks of it are looked at: to order
/// them would take longer.
const MANY_HITS: u32 = 32;

/// A search takes hardly any time if so many blocks of lags, each with all its marks, are counted: at
/// a nanosecond each, a microsecond.
const SOON: i64 = 1000;

/// A gate of so many macropulses is taken to be dark on average.
const MANY: i64 = 16;
