//! The ticks that a correlating receiver looks at: a stretch of time that slides along the band.

use std::ops::Range;

use super::timeline::Timeline;
use crate::kernels::{COARSE, Pattern, coarse, count_each, look_ahead};

/// Ticks before the stretch that is asked for and behind it, so that whole blocks of lags can be
/// looked at at its ends.
const MARGIN: i64 = 2048;

/// Ticks that are laid down together: as bits they fit into a first-level cache.
const PIECE: i64 = 1 << 16;

/// The ticks of a stretch as three rows of bits.
///
/// - `seen`: the ticks as they came.
/// - `lit`: the places at which a mark counts as found, a tick and the `width` − 1 places before it.
/// - `residual`: the ticks that are left when those of the macropulses found so far are cancelled.
#[derive(Debug)]
pub(super) struct Field<'a> {
    ticks: &'a [u32],
    /// Ticks that are laid down already, or were passed by.
    laid: usize,
    width: u32,
    /// Ticks that are counted together, a power of two, and which.
    cell: i64,
    cell_bits: u32,
    /// The first tick of the first cell, and of all that is at hand.
    begin: i64,
    /// Ticks of the list before each cell, and before their end.
    before: Vec<u32>,
    /// Ticks of the residual in each cell, or [`UNKNOWN`].
    left: Vec<u32>,
    seen: Timeline,
    lit: Timeline,
    residual: Timeline,
    picture: Picture,
}

/// A picture of the ticks at which marks count as found, with one bit for every eight. A bit is lit if any of the
/// sixteen ticks from the first of its eight on is lit. So one bit covers a mark at any of eight lags. It is made where
/// it is looked at.
#[derive(Debug, Default)]
pub(super) struct Picture {
    words: Vec<u64>,
    /// Which segments are made.
    made: Vec<bool>,
    /// Bits that are lit if any of eight ticks is, for the segment that is made.
    fine: Vec<u64>,
}

/// Machine words of a picture that are made together: those of 32 768 ticks.
const SEGMENT: usize = 64;

impl Picture {
    /// Makes what is missing of the bits `from` to `to`, of a picture of `words`.
    fn make(&mut self, words: &[u64], (from, to): (usize, usize)) {
        let segments = words.len() / COARSE / SEGMENT + 1;
        self.made.resize(segments, false);
        self.words.resize(segments * SEGMENT, 0);
        // The last word looks at its next one.
        self.fine.resize(SEGMENT + 1, 0);
        for segment in from / 64 / SEGMENT..(to / 64 / SEGMENT + 1).min(segments) {
            if std::mem::replace(&mut self.made[segment], true) {
                continue;
            }
            let begin = segment * SEGMENT;
            coarse(words.get(COARSE * begin..).unwrap_or_default(), 0, &mut self.fine);
            look_ahead(&self.fine[..SEGMENT], &mut self.words[begin..begin + SEGMENT], 1);
            self.words[begin + SEGMENT - 1] |= self.fine[SEGMENT] << 63;
        }
    }

    fn forget(&mut self) {
        self.made.clear();
    }
}

/// The count of a cell in which ticks were cancelled since.
const UNKNOWN: u32 = u32::MAX;

/// Memory of a field, whatever is in it.
pub(super) type Memory = ([Timeline; 3], Picture);

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
        let cell_bits = cell.max(64).ilog2();
        let cell = 1 << cell_bits;
        let begin = (begin - MARGIN).div_euclid(cell) * cell;
        let laid = ticks.partition_point(|&tick| i64::from(tick) < begin);
        let ([mut seen, mut lit, mut residual], picture) = memory;
        // Twice as long as need be, so that it is moved less often.
        let length = 2 * (length + 3 * MARGIN + 2 * cell + i64::from(width));
        seen.begin(begin, length);
        residual.begin(begin, length);
        lit.begin(begin, if width > 1 { length } else { 0 });
        let (before, left) = (vec![laid as u32], Vec::new());
        Self {
            ticks,
            laid,
            width,
            cell,
            cell_bits,
            begin,
            before,
            left,
            seen,
            lit,
            residual,
            picture,
        }
    }

    /// Gives its memory back.
    pub fn into_memory(self) -> Memory {
        ([self.seen, self.lit, self.residual], self.picture)
    }

    /// The end of the ticks that are laid down.
    fn end(&self) -> i64 {
        self.begin + self.cell * (self.before.len() as i64 - 1)
    }

    /// True if `ticks` ticks, one at least, come in a shorter time than `within` anywhere in `span`, laid down or not.
    pub fn come_together(&self, ticks: usize, span: &Range<i64>, within: i64) -> bool {
        let before = |end: i64| self.ticks.partition_point(|tick| i64::from(*tick) < end);
        let last = ticks - 1;
        let is_short = |some: &[u32]| i64::from(some[last] - some[0]) < within;
        self.ticks[before(span.start)..before(span.end)].windows(ticks).any(is_short)
    }

    /// Lays down the ticks of `span`, and forgets what was before. A span never begins before the one
    /// asked for last.
    pub fn cover(&mut self, span: Range<i64>) {
        self.picture.forget();
        let origin = (span.start - MARGIN).max(self.begin).div_euclid(self.cell) * self.cell;
        let to = span.end + 2 * MARGIN + i64::from(self.width);
        if to + self.cell > self.seen.end() {
            self.forget_before(origin);
        }
        while self.end() < to {
            let from = self.end();
            let cells = ((to - from).min(PIECE) / self.cell).max(1);
            let end = from + cells * self.cell;
            let laid = self.seen.lay_anew(&self.ticks[self.laid..], from..end);
            let words = self.seen.words(&(from..end));
            let known = self.left.len();
            self.left.resize(known + cells as usize, 0);
            count_each(words, (self.cell / 64) as usize, &mut self.left[known..]);
            let mut before = self.laid as u32;
            self.before.extend(self.left[known..].iter().map(|count| {
                before += *count;
                before
            }));
            self.laid += laid;
            self.residual.words_mut(&(from..end)).copy_from_slice(words);
            if self.width > 1 {
                self.widen(from..end);
            }
        }
    }

    /// Lets all that is at hand begin at `origin`, a whole number of cells later.
    fn forget_before(&mut self, origin: i64) {
        let lit = (self.width > 1).then_some(&mut self.lit);
        let all = [&mut self.seen, &mut self.residual].into_iter().chain(lit);
        all.for_each(|timeline| timeline.slide(origin));
        if self.end() > origin {
            let passed = ((origin - self.begin) / self.cell) as usize;
            self.before.drain(..passed);
            self.left.drain(..passed);
        } else {
            // Ticks between are asked for by nobody.
            let ticks = &self.ticks[self.laid..];
            self.laid += ticks.partition_point(|&tick| i64::from(tick) < origin);
            self.before.clear();
            self.before.push(self.laid as u32);
            self.left.clear();
        }
        self.begin = origin;
    }

    /// Lights the places of `span` at which a mark counts as found, and those before it that may
    /// change by ticks of it.
    fn widen(&mut self, span: Range<i64>) {
        let span = span.start - 64 * (i64::from(self.width) / 64 + 1)..span.end;
        let (seen, lit) = (self.seen.words(&span), self.lit.words_mut(&span));
        look_ahead(seen, lit, self.width as usize - 1);
    }

    /// The ticks at which marks count as found.
    pub fn lit(&self) -> &Timeline {
        if self.width == 1 { &self.seen } else { &self.lit }
    }

    /// The picture of where marks count as found, from tick `from` to `to` at least, and the tick of its first bit.
    pub fn picture(&mut self, from: i64, to: i64) -> (&[u64], i64) {
        let extent = self.extent();
        let bit = |tick: i64| (tick - extent.start).max(0) as usize / COARSE;
        let mut picture = std::mem::take(&mut self.picture);
        picture.make(self.lit().words(&extent), (bit(from), bit(to)));
        self.picture = picture;
        (&self.picture.words, extent.start)
    }

    /// The ticks as they came.
    pub fn seen(&self) -> &Timeline {
        &self.seen
    }

    /// True if there is a tick at `tick` that is not cancelled.
    pub fn is_left(&self, tick: i64) -> bool {
        self.residual.has(tick)
    }

    /// The number of ticks of `pattern` that are not cancelled, summed over its beginnings, which are `after` ticks
    /// behind `start`.
    pub fn left_in_all(&self, start: i64, after: &[u32], pattern: &Pattern) -> u32 {
        self.residual.lit_in_all(start, after, pattern)
    }

    /// Cancels the ticks of `pattern` at each of its beginnings, which are `after` ticks behind `start`, ascending.
    pub fn cancel(&mut self, start: i64, after: &[u32], pattern: &Pattern) {
        self.residual.put_out(start, after, pattern);
        if let (Some(first), Some(last)) = (after.first(), after.last()) {
            let end = start + i64::from(*last) + 64 * pattern.reach() as i64;
            let cells = self.cells(&(start + i64::from(*first)..end));
            self.left[cells].fill(UNKNOWN);
        }
    }

    /// The ticks at which marks count as found in the residual, for all of `span`. It is made in `memory` if a mark is
    /// looked for in several ticks.
    pub fn lit_by_residual<'b>(
        &'b self,
        span: &Range<i64>,
        memory: &'b mut Timeline,
    ) -> &'b Timeline {
        if self.width == 1 {
            return &self.residual;
        }
        let words = self.residual.words(&(span.start..span.end + i64::from(self.width) + 64));
        let start = span.start.div_euclid(64) * 64;
        let reach = self.width as usize - 1;
        memory.look_ahead(start.max(self.residual.origin()), words, reach);
        memory
    }

    /// The cells that touch `span`.
    fn cells(&self, span: &Range<i64>) -> Range<usize> {
        let last = self.before.len() as i64 - 1;
        // Rounds down where a division would round towards 0; both are clamped to it.
        let cell = |tick: i64| ((tick - self.begin) >> self.cell_bits).clamp(0, last) as usize;
        cell(span.start)..cell(span.end + self.cell - 1).max(cell(span.start))
    }

    /// How many ticks there are in the cells that touch `span`, and how long these are.
    pub fn ticks_about(&self, span: &Range<i64>) -> (u32, i64) {
        let cells = self.cells(span);
        let ticks = self.before[cells.end] - self.before[cells.start];
        (ticks, self.cell * (cells.end - cells.start) as i64)
    }

    /// Share of the places about `span` at which a mark counts as found if its ticks are spread evenly, without `ticks`
    /// and `places` of them.
    pub fn density_without(&self, span: &Range<i64>, ticks: u32, places: u32) -> f64 {
        let (all, length) = self.ticks_about(span);
        let places = (length - i64::from(places)).max(1) as f64;
        (f64::from(self.width) * f64::from(all.saturating_sub(ticks)) / places).min(1.0)
    }

    /// The residual ticks in each cell about `span`, and where the first one begins.
    pub fn residual_cells(&mut self, span: &Range<i64>) -> (&[u32], i64) {
        let cells = self.cells(span);
        let at = |cell: usize| self.begin + self.cell * cell as i64;
        let mut end = cells.start;
        for known in self.left[cells.clone()]
            .chunk_by_mut(|one, next| (*one == UNKNOWN) == (*next == UNKNOWN))
        {
            let first = end;
            end += known.len();
            if known[0] == UNKNOWN {
                let words = self.residual.words(&(at(first)..at(end)));
                count_each(words, (self.cell / 64) as usize, known);
            }
        }
        (&self.left[cells.clone()], at(cells.start))
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_picture_shows_sixteen_ticks_with_each_bit(
            ticks in proptest::collection::btree_set(0_u32..90_000, 0..300),
            width in 1..9_u32,
            spans in proptest::collection::vec((0..40_000_i64, 1..50_000_i64), 1..4),
        ) {
            let ticks: Vec<u32> = ticks.into_iter().collect();
            let mut field = Field::new(&ticks, width, (0, 90_000), 4096, Memory::default());
            field.cover(0..90_000);
            let lit: Vec<bool> = (0..90_016).map(|tick| field.lit().has(tick)).collect();
            for (from, length) in spans {
                let to = (from + length).min(89_000);
                let (picture, origin) = field.picture(from, to);
                prop_assert!(origin <= 0);
                for bit in (from - origin) / 8..=(to - origin) / 8 {
                    let first = origin + 8 * bit;
                    let any = (first.max(0)..first + 16).any(|tick| lit[tick as usize]);
                    let shown = picture[(bit / 64) as usize] >> (bit % 64) & 1 == 1;
                    prop_assert_eq!(shown, any, "{} from {}", bit, origin);
                }
            }
        }
    }
}
