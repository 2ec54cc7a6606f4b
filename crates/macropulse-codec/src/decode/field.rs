//! The ticks that a correlating receiver looks at: a stretch of time that slides along the band.

use std::ops::Range;

use super::timeline::Timeline;
use crate::kernels::{Pattern, count_each, look_ahead};

/// Ticks before the stretch that is asked for and behind it, so that whole blocks of lags can be
/// looked at at its ends.
const MARGIN: i64 = 2048;

/// Ticks that are laid down together: as bits they fit into a first-level cache.
const PIECE: i64 = 1 << 16;

/// The ticks of a stretch, one bit each, three times: as they came; lit wherever a mark counts as
/// found, which is at a tick and at the `width` − 1 places before it; and the residual, the ticks
/// that are left when those of the macropulses found so far are cancelled.
#[derive(Debug)]
pub(super) struct Field<'a> {
    ticks: &'a [u32],
    /// Ticks that are laid down already, or were passed by.
    laid: usize,
    width: u32,
    /// Ticks that are counted together, a power of two.
    cell: i64,
    /// The first tick of the first cell.
    begin: i64,
    /// Ticks of the list before each cell, as far as they are laid down.
    before: Vec<u32>,
    /// Ticks in each cell that are not cancelled.
    left: Vec<u32>,
    seen: Timeline,
    lit: Timeline,
    residual: Timeline,
}

/// Memory of a field, whatever is in it.
pub(super) type Memory = [Timeline; 3];

impl<'a> Field<'a> {
    /// The field of the sorted `ticks`, from `begin` on, no longer than `length` ticks at a time;
    /// ticks are counted in stretches not much longer than `cell`.
    pub fn new(
        ticks: &'a [u32],
        width: u32,
        (begin, length): (i64, i64),
        cell: i64,
        memory: Memory,
    ) -> Self {
        let cell = 1 << (64 - cell.max(64).leading_zeros() - 1);
        let begin = (begin - MARGIN).div_euclid(cell) * cell;
        let laid = ticks.partition_point(|&tick| i64::from(tick) < begin);
        let [mut seen, mut lit, mut residual] = memory;
        // Twice as long as need be, so that it is moved less often.
        let length = 2 * (length + 3 * MARGIN + 2 * cell + i64::from(width));
        seen.clear_all(begin, length);
        residual.clear_all(begin, length);
        lit.clear_all(begin, if width > 1 { length } else { 0 });
        let before = vec![laid as u32];
        let left = vec![];
        Self { ticks, laid, width, cell, begin, before, left, seen, lit, residual }
    }

    /// Gives its memory back.
    pub fn into_memory(self) -> Memory {
        [self.seen, self.lit, self.residual]
    }

    /// Where the ticks that are laid down end.
    fn end(&self) -> i64 {
        self.begin + self.cell * (self.before.len() as i64 - 1)
    }

    /// Lays down the ticks of `span`, and forgets what was before. A span never begins before the one
    /// asked for last.
    pub fn cover(&mut self, span: Range<i64>) {
        let origin = (span.start - MARGIN).max(self.begin).div_euclid(self.cell) * self.cell;
        // Ticks that nobody asked for are counted only.
        while self.end() < origin {
            let end = self.end() + self.cell;
            let passed = self.ticks[self.laid..].iter();
            self.laid += passed.take_while(|&&tick| i64::from(tick) < end).count();
            self.before.push(self.laid as u32);
            self.left.push(0);
        }
        let to = span.end + 2 * MARGIN + i64::from(self.width);
        if to + self.cell > self.seen.end() {
            let lit = (self.width > 1).then_some(&mut self.lit);
            let all = [&mut self.seen, &mut self.residual].into_iter().chain(lit);
            all.for_each(|timeline| timeline.slide(origin));
        }
        while self.end() < to {
            let from = self.end();
            let cells = ((to - from).min(PIECE) / self.cell).max(1);
            let end = from + cells * self.cell;
            let laid = self.seen.lay(&self.ticks[self.laid..], end);
            let words = self.seen.words(&(from..end));
            let known = self.before.len();
            self.before.resize(known + cells as usize, 0);
            count_each(words, (self.cell / 64) as usize, &mut self.before[known..]);
            self.left.extend_from_slice(&self.before[known..]);
            let mut before = self.laid as u32;
            for count in &mut self.before[known..] {
                before += *count;
                *count = before;
            }
            self.laid += laid;
            self.residual.words_mut(&(from..end)).copy_from_slice(words);
            if self.width > 1 {
                self.widen(from..end);
            }
        }
    }

    /// Lights the places of `span` at which a mark counts as found, and those before it that may
    /// change by ticks of it.
    fn widen(&mut self, span: Range<i64>) {
        let span = span.start - 64 * (i64::from(self.width) / 64 + 1)..span.end;
        let (seen, lit) = (self.seen.words(&span), self.lit.words_mut(&span));
        lit.copy_from_slice(seen);
        look_ahead(lit, self.width as usize - 1);
    }

    /// Where marks count as found.
    pub fn lit(&self) -> &Timeline {
        if self.width == 1 { &self.seen } else { &self.lit }
    }

    /// The ticks as they came.
    pub fn seen(&self) -> &Timeline {
        &self.seen
    }

    /// Cancels the ticks of `pattern`, begun at each of `starts`, all within `span`.
    pub fn cancel(
        &mut self,
        starts: impl Iterator<Item = i64>,
        pattern: &Pattern,
        span: Range<i64>,
    ) {
        starts.for_each(|start| self.residual.put_out(start, pattern));
        let cells = self.cells(&span);
        let at = |cell: usize| self.begin + self.cell * cell as i64;
        let first = cells.start.max(((self.residual.origin() - self.begin) / self.cell) as usize);
        if first < cells.end {
            let words = self.residual.words(&(at(first)..at(cells.end)));
            count_each(words, (self.cell / 64) as usize, &mut self.left[first..cells.end]);
        }
    }

    /// Puts into `places` where marks count as found in the residual of `span`, and tells which tick
    /// the first bit is.
    pub fn lit_in_residual(&self, span: &Range<i64>, places: &mut Vec<u64>) -> i64 {
        let start = span.start.div_euclid(64) * 64;
        let words = self.residual.words(&(start..span.end + i64::from(self.width) + 64));
        places.clear();
        places.extend_from_slice(words);
        look_ahead(places, self.width as usize - 1);
        start.max(self.residual.origin())
    }

    /// The cells that touch `span`.
    fn cells(&self, span: &Range<i64>) -> Range<usize> {
        let last = self.before.len() as i64 - 1;
        let cell = |tick: i64| ((tick - self.begin) / self.cell).clamp(0, last) as usize;
        cell(span.start)..cell(span.end + self.cell - 1).max(cell(span.start))
    }

    /// Ticks of the list before the machine word of `tick`.
    fn ticks_before(&self, tick: i64) -> u32 {
        let last = self.before.len() as i64 - 1;
        let cell = ((tick - self.begin) / self.cell).clamp(0, last);
        let start = self.begin + cell * self.cell;
        let words = self.seen.words(&(start..tick.min(start + self.cell)));
        self.before[cell as usize] + count_all(words)
    }

    /// How many ticks there are in `span`, and those of the machine words at its ends.
    pub fn ticks_in(&self, span: &Range<i64>) -> u32 {
        self.ticks_before(span.end) - self.ticks_before(span.start)
    }

    /// Share of the places of `span` at which a mark counts as found, were its ticks spread evenly.
    pub fn density(&self, span: &Range<i64>) -> f64 {
        self.density_without(span, 0, 0)
    }

    /// The same without so many ticks and places.
    pub fn density_without(&self, span: &Range<i64>, ticks: u32, places: u32) -> f64 {
        let places = ((span.end - span.start) as u32).saturating_sub(places).max(1);
        let all = self.ticks_in(span).saturating_sub(ticks);
        (f64::from(self.width) * f64::from(all) / f64::from(places)).min(1.0)
    }

    /// For each cell of `span`, the residual ticks in the `length` ticks from there on, and some more;
    /// and the first tick of the first cell.
    pub fn residual_stretches(&self, span: &Range<i64>, length: i64, sums: &mut Vec<u32>) -> i64 {
        let cells = self.cells(span);
        let begin = self.begin + self.cell * cells.start as i64;
        sums.clear();
        sums.extend_from_slice(&self.left[cells]);
        let together = self.stretch(length);
        let mut sum: u32 = sums.iter().take(together).sum();
        for cell in 0..sums.len() {
            let next = sums.get(cell + together).copied().unwrap_or(0);
            sum = sum + next - std::mem::replace(&mut sums[cell], sum);
        }
        begin
    }

    /// How many ticks of `span` are not cancelled, and those of the machine words at its ends.
    pub fn residual_in(&self, span: &Range<i64>) -> u32 {
        count_all(self.residual.words(&(span.start..span.end + 63)))
    }

    /// All that is at hand.
    pub fn extent(&self) -> Range<i64> {
        self.seen.origin()..self.end()
    }

    /// Cells that hold `length` ticks wherever in the first one these begin.
    pub fn stretch(&self, length: i64) -> usize {
        (length / self.cell) as usize + 2
    }

    /// Ticks that are counted together.
    pub fn cell(&self) -> i64 {
        self.cell
    }
}

/// How many bits are lit.
fn count_all(words: &[u64]) -> u32 {
    let mut count = [0];
    count_each(words, words.len().max(1), &mut count);
    count[0]
}
