//! The matched receiver: the lag at which the whole known macropulse of a shot fits best.
//!
//! A hypothesis is a shot and a lag, and the rule of [`belief`](super::belief) decides about it. To try every
//! lag with every mark takes tens of microseconds a shot. So the receiver cancels light that it has
//! explained, as multi-user detectors do, and looks first where light is likely:
//!
//! 1. [`cancel`]: complete macropulses are taken off the stream of ticks one after another: no lag can have
//!    more marks. In clear light this is all.
//! 2. [`track`]: neighbouring pixels see neighbouring ranges. About them the exact maximum is taken;
//!    it is kept at once if as large a share of the marks is found as of the shots before.
//! 3. [`acquire`]: the exact maximum over the gate, of shots that no neighbour predicts and of those
//!    fainter than their neighbours; and, where light is left over, of further surfaces.
//! 4. [`verify`]: each return is judged again, as the light of all others is known.
//!
//! Posterior odds decide whether what these steps find is believed, and whether its label fits: [`odds`].
//!
//! A thorough receiver takes what they find for hypotheses, and counts every lag: [`reference`](self::reference).
//!
//! The shots go through these steps in blocks, so that the ticks at hand fit into a cache.

mod acquire;
mod cancel;
mod chance;
mod explain;
mod look;
mod measure;
mod neighbours;
mod odds;
mod pace;
mod reference;
mod sent;
mod spacing;
#[cfg(test)]
mod tests;
mod track;
mod verify;

use std::cell::Cell;
use std::ops::Range;

use serde::Deserialize;

use super::belief;
use super::field::{self, Field};
use super::timeline::Timeline;
use super::{Correlation, Error, GATES_PER_BLOCK, Receiver, Returns};
use crate::ShotLog;
use crate::Ticks;
use crate::code::Codebook;
use crate::kernels::{Counts, NARROW};
use acquire::{Leftover, Search};
use cancel::Cancelled;
use chance::Chance;
use measure::{Meter, Photons};
use neighbours::last_beside;
use pace::{Paced, Usual};
use sent::{Sent, Words};

pub use explain::{Odds, Weighed};
pub(super) use explain::{Question, odds};
pub use neighbours::neighbours;

/// How much the matched receiver does for faint light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Effort {
    /// Searches for some of the shots in faint light, finds the others from there, and skips light that lies evenly
    /// over everything. A target that is barely seen may be lost if it stands alone or fills the whole field.
    Quick,
    /// Counts every lag of every shot: the reference that the quick receiver is compared with. Takes many times as long in
    /// noise.
    Thorough,
}

/// Decodes one band.
///
/// # Errors
/// If the ticks do not ascend.
pub(super) fn decode(
    receiver: &Receiver,
    correlation: &Correlation,
    effort: Effort,
    sent: (&Codebook, &ShotLog),
    ticks: &Ticks,
) -> Result<Returns, Error> {
    let mut memory = MEMORY.take();
    let words = std::mem::take(&mut memory.words);
    let mut timelines = std::mem::take(&mut memory.timelines);
    let sent = Sent::new(receiver, correlation, sent, (ticks.epoch, words));
    let mut returns = Returns::with_capacity(sent.log.owned.len());
    let cancelled = cancel::cancel(&sent, &ticks.tick, &mut timelines)?;
    let memory = match cancelled {
        Some(cancelled) if cancelled.is_clear() && effort == Effort::Quick => {
            sent.settle_clear(&cancelled.lags, &mut memory.photons, &mut returns);
            memory
        }
        _ => {
            let mut band = Band::new(&sent, (&ticks.tick, cancelled), memory);
            band.decode(&mut returns);
            if effort == Effort::Thorough {
                returns = reference::decode(&sent, &ticks.tick, &band.lags());
            }
            band.into_memory()
        }
    };
    MEMORY.set(Memory { words: sent.words, timelines, ..memory });
    Ok(returns)
}

/// Surfaces that light of a shot may come from beside the one that is taken for its range.
const SURFACES: usize = 3;

/// Returns of a shot that this receiver can give at most.
pub(super) const MOST_RETURNS: u8 = 1 + SURFACES as u8;

/// Neighbours that define the expectation for a shot. Those before give the share of its marks, and those to
/// a side the lag of a doubtful one. In `street` as declared a mean over 32 shots loses 3 of 9099, over 2
/// none. In a room where one shot in three is seen, 3 to a side take 0.52 % of 25 898 shots for a sidelobe,
/// as one mistake leads to the next. With 5 it is 0.30 %, with 8 and with 12 it is 0.21 %.
const NEIGHBOURS: usize = 8;

thread_local! {
    /// Kept from band to band: fresh memory costs more than what is done with it.
    static MEMORY: Cell<Memory> = Cell::default();
}

/// Memory of a band.
#[derive(Default)]
struct Memory {
    words: Words,
    /// Those of [`cancel`].
    timelines: [Timeline; 2],
    claimed: Timeline,
    field: field::Memory,
    search: Search,
    chance: Option<Chance>,
    photons: Photons,
}

/// The lag at which a shot was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Detection {
    lag: i64,
    /// Marks found there.
    count: u32,
    /// The same less those at the best other lag that was looked at.
    margin: u32,
    /// True if that is half of all marks, and half of it is more than chance gives. Chance finds most marks where
    /// macropulses overlap, but fewer than this.
    stands_out: bool,
}

impl Detection {
    /// A detection of `count` marks at `lag`, before anything else is measured.
    fn at(lag: i64, count: u32) -> Self {
        Self { lag, count, margin: 0, stands_out: false }
    }
}

/// The shots whose light may not all have been cancelled in the first step.
#[derive(Debug)]
enum Open {
    /// All shots: nothing was cancelled.
    All,
    /// No shot: all light was cancelled.
    None,
    /// Those with ticks left in their gate: the number for each shot.
    Left(Vec<u32>),
}

struct Band<'a> {
    sent: &'a Sent<'a>,
    field: Field<'a>,
    open: Open,
    /// The last shot before each one at the same column of another row.
    above: Vec<Option<u32>>,
    /// The last shot before each one at the same row of another column.
    left: Vec<Option<u32>>,
    found: Vec<Option<Detection>>,
    /// True if no light was found of the shots whose leftover is searched, nor near them.
    is_dark_around: bool,
    /// Other surfaces of the shots at hand.
    further: Vec<(usize, Detection)>,
    chance: Chance,
    usual: Usual,
    /// The time whose light is all at hand.
    at_hand: Range<i64>,
    /// Fewest ticks that make a return.
    fewest: usize,
    /// Its leftover, made when it is first needed.
    leftover: Option<Leftover<'a>>,
    /// Pacing of the searches for shots that tracking lost, for those without light that stands out, and for those
    /// found faint.
    searched: Paced,
    even: Paced,
    again: Paced,
    /// Counts of the block of lags that was looked at last.
    counts: Counts<NARROW>,
    /// The ticks from the start of a macropulse to each of its marks, and the shot whose they are.
    marks: Vec<u32>,
    marks_of: Option<usize>,
    /// The same in the picture.
    in_picture: Vec<u32>,
    search: Search,
    meter: Meter<'a>,
    /// Memory: the places that returns claim, and the marks found in each lit and in each dark bit.
    claimed: Timeline,
    found_in_bits: [Vec<u32>; 2],
    words: WordsAbout,
    /// The logarithm of the posterior odds from which on a detection is believed.
    threshold: f64,
}

/// Marks of a word that are found in each bit about a macropulse, and their sums for the bits of a label.
#[derive(Debug, Default)]
struct WordsAbout {
    found: Vec<u32>,
    sums: Vec<u32>,
}

impl<'a> Band<'a> {
    fn new(
        sent: &'a Sent<'a>,
        (ticks, cancelled): (&'a [u32], Option<Cancelled>),
        mut memory: Memory,
    ) -> Self {
        let mut chance = Chance::new(sent, memory.chance);
        let open = match &cancelled {
            Some(cancelled) if cancelled.residual.is_empty() => Open::None,
            Some(cancelled) => Open::Left(in_gates(sent, &cancelled.residual)),
            None => Open::All,
        };
        let (mut found, further) = cancelled.unwrap_or_default().detections(sent);
        found.resize(sent.fired.len(), None);
        let reach = sent.reach();
        let light = reach.end - reach.start + sent.length() + i64::from(sent.width);
        let begin = sent.fired.first().map_or(0, |first| first + reach.start);
        // In clear light everything is cancelled, and the field is never looked at.
        let (rows, columns) = (&sent.log.row, &sent.log.column);
        let (extent, above, left) = match open {
            Open::None => ((0, 0), vec![], vec![]),
            _ => (
                (begin, (GATES_PER_BLOCK + 2) * light + 3 * sent.length()),
                last_beside(columns, rows),
                last_beside(rows, columns),
            ),
        };
        let field = Field::new(ticks, sent.width, extent, sent.length() / CELLS, memory.field);
        let fewest = match open {
            // Nobody asks.
            Open::None => 1,
            _ => chance.fewest_ticks(sent, field.cell()),
        };
        memory.search.forget();
        Self {
            field,
            open,
            above,
            left,
            found,
            is_dark_around: false,
            further,
            chance,
            usual: Usual::new(),
            at_hand: 0..0,
            fewest,
            leftover: None,
            searched: Paced::default(),
            even: Paced::default(),
            again: Paced::default(),
            counts: Counts::default(),
            marks: Vec::new(),
            marks_of: None,
            in_picture: Vec::new(),
            search: memory.search,
            meter: Meter::new(sent, memory.photons),
            claimed: memory.claimed,
            found_in_bits: Default::default(),
            words: WordsAbout::default(),
            threshold: belief::threshold(sent.correlation.false_alarm),
            sent,
        }
    }

    /// All steps for all shots, into `returns`.
    fn decode(&mut self, returns: &mut Returns) {
        let (shots, mut first, mut settled) = (self.found.len(), 0, 0);
        if matches!(self.open, Open::None) {
            self.settle(0..shots, returns);
            first = shots;
        }
        while first < shots {
            let block = first..self.sent.end_of_block(first, GATES_PER_BLOCK);
            first = block.end;
            // Light that overlaps with that of the last ones may not be known yet.
            let end =
                if block.end == shots { shots } else { self.sent.in_flight_before(block.end) };
            let closed = settled..end.max(settled);
            settled = closed.end;
            if block.clone().chain(closed.clone()).any(|shot| self.is_open(shot)) {
                self.at_hand = Self::span(self.sent, block.clone());
                if self.is_too_dark() {
                    self.pass_by(block);
                } else {
                    self.field.cover(self.at_hand.clone());
                    self.search.forget();
                    self.leftover = None;
                    self.cancel_found(block.clone());
                    self.look_for(block);
                    self.look_for_leftovers(closed.clone(), first);
                }
            }
            self.settle(closed, returns);
        }
    }

    /// The shots that were found, and the lags where.
    fn lags(&self) -> Vec<(usize, i64)> {
        let found = self.found.iter().enumerate();
        found.filter_map(|(shot, found)| Some((shot, found.as_ref()?.lag))).collect()
    }

    /// The memory back.
    fn into_memory(self) -> Memory {
        Memory {
            words: Words::default(),
            timelines: Default::default(),
            claimed: self.claimed,
            field: self.field.into_memory(),
            search: self.search,
            photons: self.meter.photons,
            chance: Some(self.chance),
        }
    }

    /// True if no macropulse in the time at hand can have the fewest ticks that are believed.
    fn is_too_dark(&self) -> bool {
        let light = self.sent.light(0, 0);
        !self.field.come_together(self.fewest, &self.at_hand, light.end - light.start)
    }

    /// The time that must be at hand for a block of shots: their light, and what it may overlap with.
    fn span(sent: &Sent, block: Range<usize>) -> Range<i64> {
        let last = sent.arrival(block.end - 1);
        let first = sent.arrival(block.start);
        // Shots that are settled with the block are as old as the light of its first one. Their light is
        // compared with bits a macropulse before it, and one behind it.
        first.start - (first.end - first.start) - sent.length()..last.end + sent.length()
    }

    /// True if `shot` may have light that was not found yet.
    fn is_open(&self, shot: usize) -> bool {
        let may_be_left = match &self.open {
            Open::All => true,
            Open::None => false,
            // A single mark tells nothing.
            Open::Left(ticks) => ticks[shot] > 1,
        };
        may_be_left && self.sent.weight(shot) > 0
    }

    /// Cancels what is known of a block of shots.
    fn cancel_found(&mut self, block: Range<usize>) {
        if matches!(self.open, Open::All) {
            return;
        }
        for shot in self.sent.in_flight_before(block.start)..block.end {
            if let Some(detection) = self.found[shot] {
                self.cancel(shot, detection.lag);
            }
        }
        for (shot, detection) in self.further.clone() {
            self.cancel(shot, detection.lag);
        }
    }

    /// Keeps `detection` and cancels its ticks.
    fn keep(&mut self, shot: usize, detection: Detection) {
        self.cancel(shot, detection.lag);
        self.found[shot] = Some(detection);
        self.usual.learn(detection.count, self.sent.weight(shot));
    }

    /// Cancels the ticks of `shot` at `lag`.
    fn cancel(&mut self, shot: usize, lag: i64) {
        let start = self.sent.fired[shot] + lag - self.sent.farther();
        let lit_bits = self.sent.lit_bits(shot);
        self.field.cancel(start, lit_bits, &self.sent.bits(shot).cancelled);
        if let Some(leftover) = &mut self.leftover {
            leftover.renew(&mut self.field, &self.sent.light(shot, lag));
        }
    }

    /// The leftover of the ticks at hand.
    fn leftover(&mut self) -> &mut Leftover<'a> {
        let first = self.at_hand.start;
        self.leftover.get_or_insert_with(|| Leftover::new(self.sent, &mut self.field, first))
    }
}

/// Cells in which ticks are counted, to a macropulse: 8 take a tenth more time in noise, 2 as long as 4
/// or a fifth more.
const CELLS: i64 = 4;

/// For each shot, how many of the sorted `ticks` lie where its light may be.
fn in_gates(sent: &Sent, ticks: &[u32]) -> Vec<u32> {
    let (mut first, mut last) = (0, 0);
    let count = |shot| {
        let gate = sent.arrival(shot);
        let before = |end: i64| move |tick: &&u32| i64::from(**tick) < end;
        first += ticks[first..].iter().take_while(before(gate.start)).count();
        last += ticks[last..].iter().take_while(before(gate.end)).count();
        (last - first) as u32
    };
    (0..sent.fired.len()).map(count).collect()
}
