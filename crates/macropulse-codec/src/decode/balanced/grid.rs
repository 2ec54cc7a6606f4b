//! The lit places of a stretch of time, chip by chip at each phase of the chip clock.
//!
//! The marks of one macropulse lie whole chips apart. So all places that can hold them, begun at
//! one tick, are side by side here, and a shift by a chip is a shift by one bit.

use std::ops::Range;

use crate::kernels::{Balance, Chips, best_balance};

/// Which places are lit, by phase.
#[derive(Debug)]
pub(super) struct Grid {
    /// Tick of the first bit of phase 0, and the one behind all that is at hand.
    origin: i64,
    end: i64,
    /// Ticks per chip, that is phases.
    scale: i64,
    /// How many ticks before another one a place is lit.
    late: i64,
    /// Machine words of one phase.
    width: usize,
    words: Vec<u64>,
    /// Lit places of the phase before each word, and before its end.
    before: Vec<u32>,
}

impl Grid {
    /// Creates an empty grid of `scale` ticks per chip. A tick also lights the `late` places before its own,
    /// as a mark may be late by that.
    pub fn new((scale, late): (i64, i64)) -> Self {
        Self { origin: 0, end: 0, scale, late, width: 0, words: Vec::new(), before: Vec::new() }
    }

    /// Returns true if all of `span` is at hand.
    pub fn covers(&self, span: &Range<i64>) -> bool {
        self.origin <= span.start && span.end <= self.end
    }

    /// Lays down those of the sorted `ticks` that lie in `span`, in place of what was before.
    pub fn cover(&mut self, span: Range<i64>, ticks: &[u32]) {
        let chips = (span.end - span.start).max(0) / self.scale + 2;
        self.width = chips as usize / 64 + 1;
        (self.origin, self.end) = (span.start, span.end);
        self.words.clear();
        self.words.resize(self.width * self.scale as usize, 0);
        let first = ticks.partition_point(|&tick| i64::from(tick) < span.start);
        let ticks = ticks[first..].iter().map(|&tick| i64::from(tick) - span.start);
        for tick in ticks.take_while(|tick| *tick < span.end - span.start) {
            let (mut chip, mut phase) = (tick / self.scale, tick % self.scale);
            for _ in 0..=self.late.min(tick) {
                self.words[phase as usize * self.width + chip as usize / 64] |= 1 << (chip % 64);
                (chip, phase) =
                    if phase > 0 { (chip, phase - 1) } else { (chip - 1, self.scale - 1) };
            }
        }
        self.before.clear();
        for phase in self.words.chunks(self.width) {
            let mut sum = 0;
            self.before.push(0);
            self.before.extend(phase.iter().map(|word: &u64| {
                sum += word.count_ones();
                sum
            }));
        }
    }

    /// Returns the marks and the dark chips that are lit if a macropulse begins at tick `start`.
    pub fn at(&self, start: i64, chips: &Chips) -> Option<Balance> {
        let (phase, chip) = self.place(start)?;
        best_balance(self.phase(phase), chip..chip + 1, chips, i32::MIN)
    }

    /// The start in `starts` with the highest score, the earliest of several, and what is lit
    /// there; `None` where none has `least`, or only `least` and not before tick `better`.
    pub fn best(
        &self,
        starts: Range<i64>,
        chips: &Chips,
        (least, better): (i32, i64),
    ) -> Option<(i64, Balance)> {
        let mut best = None;
        let (mut least, mut better) = (least, better);
        for phase in 0..self.scale {
            let places = self.places_of(phase, &starts);
            let Some(found) = self.best_of_phase(phase, places, (chips, least)) else { continue };
            let start = self.origin + self.scale * found.place as i64 + phase;
            // The earliest of equals counts, whichever phase it is at.
            if found.score() > least || start < better {
                (least, better) = (found.score(), start);
                best = Some((start, found));
            }
        }
        best
    }

    /// The highest score beside `start`: less than a macropulse away, by whole chips.
    pub fn best_beside(&self, start: i64, chips: &Chips) -> i32 {
        let Some((phase, chip)) = self.place(start) else { return 0 };
        let (own, reach) = (1 + (self.late / self.scale) as usize, 64 * chips.reach());
        let sides =
            [chip.saturating_sub(reach)..(chip + 1).saturating_sub(own), chip + own..chip + reach];
        let best = |side| best_balance(self.phase(phase), side, chips, 0);
        sides.into_iter().filter_map(best).map(Balance::score).max().unwrap_or(0)
    }

    /// Counts the `starts` by the number of chips, marks or not, that a macropulse of these `chips` would
    /// have lit there, from `least` on: `counts[lit - least]`.
    pub fn lit_about(
        &self,
        starts: &Range<i64>,
        (chips, length): (&Chips, usize),
        least: u32,
        counts: &mut Vec<u32>,
    ) {
        counts.clear();
        counts.resize((length + 1).saturating_sub(least as usize), 0);
        for phase in 0..self.scale {
            let places = self.places_of(phase, starts);
            let words = self.phase(phase);
            let lit = |place: usize| {
                words.get(place / 64).map_or(0, |word| (word >> (place % 64) & 1) as u32)
            };
            for word in places.start / 64..places.end.div_ceil(64) {
                if places.is_empty() || self.lit_in(phase, word..word + chips.reach()) < least {
                    continue;
                }
                let run = (64 * word).max(places.start)..(64 * (word + 1)).min(places.end);
                let mut now: u32 = (run.start..run.start + length).map(lit).sum();
                for place in run {
                    if let Some(count) = now.checked_sub(least) {
                        counts[count as usize] += 1;
                    }
                    now = now + lit(place + length) - lit(place);
                }
            }
        }
    }

    /// The places of `phase` at which one of `starts` is.
    fn places_of(&self, phase: i64, starts: &Range<i64>) -> Range<usize> {
        let place =
            |start: i64| (start - self.origin - phase + self.scale - 1).div_euclid(self.scale);
        place(starts.start).max(0) as usize
            ..(place(starts.end).max(0) as usize).min(64 * self.width)
    }

    /// Lit places of `phase` in these machine words.
    fn lit_in(&self, phase: i64, words: Range<usize>) -> u32 {
        let before = &self.before[phase as usize * (self.width + 1)..][..=self.width];
        before[words.end.min(self.width)] - before[words.start.min(self.width)]
    }

    /// The best of some `places` of one phase. Runs of them with too few lit places are left out.
    fn best_of_phase(
        &self,
        phase: i64,
        places: Range<usize>,
        (chips, least): (&Chips, i32),
    ) -> Option<Balance> {
        let words = self.phase(phase);
        let lit = |from: usize, to: usize| self.lit_in(phase, from..to) as i32;
        let (first, last) = (places.start / 64, places.end.div_ceil(64));
        if places.is_empty() || lit(first, last + chips.reach()) < least {
            return None;
        }
        let mut best: Option<Balance> = None;
        for word in first..last {
            let wanted = best.map_or(least, |best| best.score() + 1);
            if lit(word, word + chips.reach()) < wanted {
                continue;
            }
            let run = (64 * word).max(places.start)..(64 * (word + 1)).min(places.end);
            best = best_balance(words, run, chips, wanted).or(best);
        }
        best
    }

    fn phase(&self, phase: i64) -> &[u64] {
        &self.words[phase as usize * self.width..][..self.width]
    }

    /// Phase and chip of a tick; `None` before the first one.
    fn place(&self, tick: i64) -> Option<(i64, usize)> {
        let since = tick - self.origin;
        let chip = usize::try_from(since.div_euclid(self.scale)).ok()?;
        Some((since.rem_euclid(self.scale), chip))
    }
}
