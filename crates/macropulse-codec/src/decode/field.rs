//! The ticks of a band as the matched receiver looks at them: one bit each, so that sixty-four
//! places are looked at in one step, and counted.

use std::ops::Range;

use super::FARTHEST_JITTER;
use super::residual::Residual;
use crate::kernels::{Pattern, lit_in, look_ahead};

/// Ticks that are turned into bits together, when one of them is first looked at.
const CHUNK: i64 = CELLS * CELL;
const CELLS: i64 = 16;

/// Ticks that are counted together: where these begin and end is near enough.
pub(super) const CELL: i64 = 1 << 10;

/// Machine words of a chunk.
const WORDS: usize = CHUNK as usize / 64;

/// Dark ticks before the first and behind the last one, so that blocks may reach beyond a gate.
pub(super) const MARGIN: i64 = 4096;

/// A sorted list of ticks, as a field of bits: lit is where a mark counts as found, which is at
/// a tick and at the `width` − 1 places before it. Bits are made from the list chunk by chunk, as
/// they are needed: where everything is clear none is.
#[derive(Debug)]
pub(super) struct Field<'a> {
    ticks: &'a [u32],
    width: usize,
    /// Tick of the first bit.
    origin: i64,
    /// Ticks before each [`CELL`], and before the end.
    before: Vec<u32>,
    /// What is made of each chunk.
    made: Vec<Made>,
    memory: Memory,
    residual: Residual,
    /// Whether nothing was cancelled to begin with: then the residual of a chunk that is not made
    /// yet is all of its ticks.
    nothing_cancelled: bool,
}

/// Memory of a field, whatever is in it.
#[derive(Debug, Default)]
pub(super) struct Memory {
    /// One bit for each tick.
    ticks: Vec<u64>,
    /// One for each place at which a mark counts as found, unless that is the same.
    lit: Vec<u64>,
    residual: Vec<u64>,
}

/// How far the bits of a chunk are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Made {
    Nothing,
    Ticks,
    Lit,
}

impl<'a> Field<'a> {
    /// The field of `ticks` over `span`, of which those in `remaining` are not cancelled yet;
    /// `None` for all of them.
    pub fn new(
        (ticks, remaining): (&'a [u32], Option<&[u32]>),
        width: u32,
        span: Range<i64>,
        mut memory: Memory,
    ) -> Self {
        let origin = span.start - MARGIN;
        let chunks = ((span.end + MARGIN - origin).max(0) / CHUNK + 1) as usize;
        let cells = chunks as i64 * CELLS;
        let mut before = Vec::with_capacity(cells as usize + 1);
        let mut passed = 0;
        for cell in 0..=cells {
            let end = origin + CELL * cell;
            let is_before = |tick: &&u32| i64::from(**tick) < end;
            passed += ticks[passed..].iter().take_while(is_before).count();
            before.push(passed as u32);
        }
        let width = width as usize;
        memory.ticks.resize(memory.ticks.len().max(chunks * WORDS), 0);
        if width > 1 {
            memory.lit.resize(memory.lit.len().max(chunks * WORDS), 0);
        }
        let words = std::mem::take(&mut memory.residual);
        let residual = match remaining {
            Some(remaining) => Residual::new(remaining, span, words),
            None => {
                let cells = before.windows(2).map(|before| before[1] - before[0]);
                Residual::counted(cells.collect(), span.start, words)
            }
        };
        let (made, nothing_cancelled) = (vec![Made::Nothing; chunks], remaining.is_none());
        Self { ticks, width, origin, before, made, memory, residual, nothing_cancelled }
    }

    /// Makes sure that all bits of `span` are there.
    fn make(&mut self, span: Range<i64>) {
        for chunk in self.chunks(span) {
            if self.made[chunk] < Made::Lit {
                self.make_chunk(chunk);
            }
        }
    }

    fn make_chunk(&mut self, chunk: usize) {
        const REACH: usize = FARTHEST_JITTER as usize / 64 + 2;
        self.make_ticks(chunk);
        self.made[chunk] = Made::Lit;
        if self.width == 1 {
            return;
        }
        let mut bits = [0; WORDS + REACH];
        let next = chunk + 1;
        bits[..WORDS].copy_from_slice(&self.memory.ticks[chunk * WORDS..][..WORDS]);
        if next < self.made.len() {
            self.make_ticks(next);
            bits[WORDS..].copy_from_slice(&self.memory.ticks[next * WORDS..][..REACH]);
        }
        look_ahead(&mut bits, self.width - 1);
        self.memory.lit[chunk * WORDS..][..WORDS].copy_from_slice(&bits[..WORDS]);
    }

    fn make_ticks(&mut self, chunk: usize) {
        if self.made[chunk] > Made::Nothing {
            return;
        }
        self.made[chunk] = Made::Ticks;
        let cells = CELLS as usize;
        let [from, to] = [chunk, chunk + 1].map(|chunk| self.before[chunk * cells] as usize);
        let words = &mut self.memory.ticks[chunk * WORDS..][..WORDS];
        words.fill(0);
        let start = self.origin + CHUNK * chunk as i64;
        for &tick in &self.ticks[from..to] {
            let bit = (i64::from(tick) - start) as usize % CHUNK as usize;
            words[bit / 64] |= 1 << (bit % 64);
        }
        if self.nothing_cancelled {
            self.residual.learn(chunk * WORDS, words);
        }
    }

    /// The ticks that are not cancelled, bit by bit in `span`, elsewhere counted only.
    pub fn residual(&mut self, span: Range<i64>) -> &mut Residual {
        if self.nothing_cancelled {
            self.chunks(span).for_each(|chunk| self.make_ticks(chunk));
        }
        &mut self.residual
    }

    /// How many ticks are not cancelled, as counts only.
    pub fn residual_counts(&self) -> &Residual {
        &self.residual
    }

    /// The chunks that touch `span`.
    fn chunks(&self, span: Range<i64>) -> Range<usize> {
        let chunk = |tick: i64| ((tick - self.origin) / CHUNK).max(0) as usize;
        chunk(span.start)..(chunk(span.end - 1) + 1).min(self.made.len())
    }

    /// The words of the field and the bit at which `tick` lies in them, with all bits of the
    /// `length` ticks from there on.
    pub fn bits(&mut self, tick: i64, length: i64) -> (&[u64], usize) {
        // Blocks are read a word beyond their end.
        self.make(tick..tick + length + 64);
        let words = if self.width == 1 { &self.memory.ticks } else { &self.memory.lit };
        (words, (tick - self.origin).max(0) as usize)
    }

    /// How many ticks lie where the pattern, begun at `start`, is lit.
    pub fn ticks_in(&mut self, start: i64, pattern: &Pattern) -> u32 {
        self.make(start..start + 64 * pattern.reach() as i64);
        lit_in(&self.memory.ticks, (start - self.origin).max(0) as usize, pattern)
    }

    /// Gives its memory back.
    pub fn into_memory(self) -> Memory {
        Memory { residual: self.residual.into_words(), ..self.memory }
    }

    /// The cells that touch `span`.
    fn cells(&self, span: &Range<i64>) -> Range<usize> {
        let last = self.before.len() as i64 - 1;
        let first = (span.start - self.origin).div_euclid(CELL).clamp(0, last);
        let end = (span.end - self.origin + CELL - 1).div_euclid(CELL).clamp(first, last);
        first as usize..end as usize
    }

    /// Share of lit places in and about `span`, were its ticks spread evenly.
    pub fn density(&self, span: Range<i64>) -> f64 {
        self.density_without(span, (0, 0))
    }

    /// Share of lit places in and about `span`, of which (ticks, places) are left out.
    pub fn density_without(&self, span: Range<i64>, own: (usize, usize)) -> f64 {
        let cells = self.cells(&span);
        let places = (cells.len() * CELL as usize).saturating_sub(own.1).max(1);
        let ticks = (self.before[cells.end] - self.before[cells.start]) as usize;
        let ticks = ticks.saturating_sub(own.0);
        (self.width as f64 * ticks as f64 / places as f64).min(1.0)
    }
}
