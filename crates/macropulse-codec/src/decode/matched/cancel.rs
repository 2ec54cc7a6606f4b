//! Cancellation of complete macropulses: those of which no mark is missing are taken off the stream
//! of ticks one after another, as they come.
//!
//! 1. The earliest tick that is not cancelled yet is taken for the first mark of a macropulse.
//!    The shot after the last one found is asked first: in smooth scenes it is the one.
//! 2. Otherwise each shot in flight is asked whether its second mark is there, too; codes are made
//!    so that hardly more than one says yes.
//! 3. All marks of that shot are looked for. If none is missing no lag can have more, and none
//!    earlier is left: this is the maximum. Its ticks are cancelled.
//! 4. Marks of one macropulse may be those of another one, too: the first tick that is not
//!    cancelled may be the second mark.
//!
//! Light from beyond the gate is cancelled, too, from as far as it may come: it gives no return,
//! but would pass for noise.
//!
//! A tick of which no macropulse without a gap can begin is left for the receivers that follow.
//! Where marks are missed everywhere nothing can be cancelled so: this is soon noticed.

use super::Detection;
use super::sent::Sent;
use crate::kernels::begin_with;

/// Ticks without a complete macropulse after which cancellation ends, and how many more for each
/// macropulse that was found.
const PATIENCE: (usize, usize) = (256, 4);

/// First marks that may be hidden under another macropulse.
const MOST_HIDDEN: usize = 2;

/// What was found without a gap, and the residual.
#[derive(Debug)]
pub(super) struct Cancelled {
    /// The lag of each shot that was found.
    pub detections: Vec<Option<Detection>>,
    /// Shots that were found once more, behind their first lag, and where.
    pub again: Vec<(usize, Detection)>,
    /// Ticks that are not cancelled, in order; `None` where that is all of them.
    pub residual: Option<Vec<u32>>,
}

/// Cancels the complete macropulses of the shots `sent` in the sorted `ticks`.
pub(super) fn cancel(sent: &Sent, ticks: &[u32]) -> Cancelled {
    let mut canceller = Canceller {
        sent,
        ticks,
        gate: (sent.gate().start, sent.gate().end - 1),
        light: sent.reach().end - 1,
        scale: sent.receiver.ticks_per_chip,
        least: fewest_without_a_gap(sent, ticks),
        cancelled: CancelledTicks::new(ticks.len()),
        detections: vec![None; sent.fired.len()],
        again: Vec::new(),
        oldest: 0,
        oldest_beyond: 0,
        next: 0,
        places: Vec::new(),
    };
    // Marks that jitter are not where they should be.
    let (mut place, mut patience) = (0, if sent.width > 1 { 0 } else { PATIENCE.0 });
    while place < ticks.len() && patience > 0 {
        match canceller.shot_at(place) {
            Some(()) => patience += PATIENCE.1,
            None => patience -= 1,
        }
        place = canceller.cancelled.next_without(place + 1);
    }
    let found_any = ticks.is_empty() || canceller.cancelled.any();
    let residual = found_any.then(|| canceller.cancelled.residual(ticks));
    Cancelled { detections: canceller.detections, again: canceller.again, residual }
}

/// Marks that chance does not put there all together, at none of the lags of a gate: the least N
/// with L · dᴺ ≤ α, d the share of lit ticks. Two at least, as the second mark is asked for.
fn fewest_without_a_gap(sent: &Sent, ticks: &[u32]) -> usize {
    let time = ticks.last().zip(ticks.first()).map_or(0, |(last, first)| last - first);
    let density = ticks.len() as f64 / f64::from(time.max(1));
    let lags = (sent.gate().end - sent.gate().start) as f64;
    let rarity = libm::log(sent.receiver.false_alarm / lags);
    (rarity / libm::log(density.clamp(1e-9, 0.999))).ceil().max(2.0) as usize
}

struct Canceller<'a> {
    sent: &'a Sent<'a>,
    ticks: &'a [u32],
    gate: (i64, i64),
    /// Farthest lag from which light may come: beyond the gate it is cancelled, and no return.
    light: i64,
    scale: u32,
    /// Fewest marks with which a shot can be told from chance.
    least: usize,
    cancelled: CancelledTicks,
    detections: Vec<Option<Detection>>,
    again: Vec<(usize, Detection)>,
    /// Light of no shot before this one can come from within the gate any more.
    oldest: usize,
    /// Light of no shot before this one can come any more.
    oldest_beyond: usize,
    /// The shot after the last one found.
    next: usize,
    /// Where the marks of a shot were found.
    places: Vec<usize>,
}

impl Canceller<'_> {
    /// Finds the shot whose light begins with the tick at `place`, and cancels its ticks.
    fn shot_at(&mut self, place: usize) -> Option<()> {
        if self.next < self.detections.len() && self.fits_in_a_row(self.next, place) {
            return Some(());
        }
        let tick = i64::from(self.ticks[place]);
        let (sent, nearest) = (self.sent, self.gate.0);
        let fired = &sent.fired;
        let advance = |oldest: &mut usize, farthest: i64| {
            while *oldest < fired.len() && fired[*oldest] + farthest < tick {
                *oldest += 1;
            }
        };
        advance(&mut self.oldest, self.gate.1 + sent.length());
        advance(&mut self.oldest_beyond, self.light + sent.length());
        let in_gate = self.oldest..fired.len();
        let in_gate = in_gate.take_while(|&shot| fired[shot] + nearest <= tick);
        // Its first marks may lie under those of a macropulse that was cancelled before.
        for hidden in 0..=MOST_HIDDEN {
            for shot in in_gate.clone() {
                if self.fits(shot, place, hidden) {
                    return Some(());
                }
            }
        }
        // Light from beyond the gate is rare: it is thought of last.
        for hidden in 0..=MOST_HIDDEN {
            for shot in self.oldest_beyond..self.oldest {
                if self.fits(shot, place, hidden) {
                    return Some(());
                }
            }
        }
        None
    }

    /// Whether the ticks from `place` on are all the marks of `shot`, with nothing between them.
    fn fits_in_a_row(&mut self, shot: usize, place: usize) -> bool {
        let (word, bits) = (self.sent.word(shot), self.sent.lit_bits(shot));
        let (Some(bit), Some(mark)) = (bits.first(), word.first()) else { return false };
        let first = i64::from(self.scale * bit) + mark;
        let start = i64::from(self.ticks[place]) - first;
        let count = bits.len() * word.marks();
        let Some(lag) = self.lag(shot, start, count) else { return false };
        if !begin_with(&self.ticks[place..], word, bits, (start as u32, self.scale)) {
            return false;
        }
        self.cancelled.run(place, count);
        self.keep(shot, lag, count);
        true
    }

    /// The lag of `shot` if its macropulse begins at `start` and could be told from chance.
    fn lag(&self, shot: usize, start: i64, marks: usize) -> Option<i64> {
        let lag = start - self.sent.fired[shot];
        let possible = marks >= self.least && (self.gate.0..=self.light).contains(&lag);
        possible.then_some(lag)
    }

    /// Whether all marks of `shot` are there if the tick at `place` is the first one of them that
    /// is not `hidden`.
    fn fits(&mut self, shot: usize, place: usize, hidden: usize) -> bool {
        let marks = self.sent.marks(shot);
        let Some(&[shown, second]) = marks.get(hidden..hidden + 2) else { return false };
        let scale = i64::from(self.scale);
        let start = i64::from(self.ticks[place]) - scale * i64::from(shown);
        let Some(lag) = self.lag(shot, start, marks.len()) else { return false };
        // Nearly every shot is refused here.
        let next = start + scale * i64::from(second);
        let follower = self.ticks[place + 1..].iter().find(|&&tick| i64::from(tick) >= next);
        if follower.map(|&tick| i64::from(tick)) != Some(next) {
            return false;
        }
        let first = start + scale * i64::from(marks[0]);
        let before = self.ticks[..place].iter().rev();
        let from = place - before.take_while(|&&tick| i64::from(tick) >= first).count();
        self.places.clear();
        let mut next = from;
        for &mark in marks {
            // Beyond the last tick that can be counted there is none: it is looked for in vain.
            let tick = (start as u32).wrapping_add(self.scale.wrapping_mul(u32::from(mark)));
            while self.ticks.get(next).is_some_and(|&other| other < tick) {
                next += 1;
            }
            if self.ticks.get(next) != Some(&tick) {
                return false;
            }
            self.places.push(next);
        }
        self.cancelled.each(&self.places);
        self.keep(shot, lag, marks.len());
        true
    }

    /// Keeps `lag`: of several surfaces the first one counts, the others are found again.
    fn keep(&mut self, shot: usize, lag: i64, count: usize) {
        let count = count as u32;
        self.next = shot + 1;
        let (label, word) = (self.sent.log.label[shot], self.sent.log.word[shot]);
        let margin = count - u32::from(self.sent.codebook.sidelobe(label, word));
        let detection = Detection { lag, count, margin };
        if self.detections[shot].get_or_insert(detection).lag != lag {
            self.again.push((shot, detection));
        }
    }
}

/// Which ticks are cancelled, by their place in the list: one bit each.
#[derive(Debug)]
struct CancelledTicks {
    words: Vec<u64>,
    ticks: usize,
}

impl CancelledTicks {
    fn new(ticks: usize) -> Self {
        Self { words: vec![0; ticks / 64 + 1], ticks }
    }

    /// Whether any tick is cancelled.
    fn any(&self) -> bool {
        self.words.iter().any(|word| *word != 0)
    }

    /// Cancels `count` ticks from `first` on.
    fn run(&mut self, first: usize, count: usize) {
        let end = first + count;
        let (from, to) = (first / 64, end / 64);
        let (head, tail) = (u64::MAX << (first % 64), !(u64::MAX << (end % 64)));
        if from == to {
            self.words[from] |= head & tail;
            return;
        }
        self.words[from] |= head;
        self.words[from + 1..to].fill(u64::MAX);
        self.words[to] |= tail;
    }

    /// Cancels the ticks at `places`.
    fn each(&mut self, places: &[usize]) {
        for place in places {
            self.words[place / 64] |= 1 << (place % 64);
        }
    }

    /// The first place from `place` on whose tick is not cancelled; the number of ticks if all
    /// are.
    fn next_without(&self, place: usize) -> usize {
        let mut index = place / 64;
        let mut others = !self.words[index.min(self.words.len() - 1)] & u64::MAX << (place % 64);
        while others == 0 && index + 1 < self.words.len() {
            index += 1;
            others = !self.words[index];
        }
        (64 * index + others.trailing_zeros() as usize).min(self.ticks)
    }

    /// The ticks that are not cancelled.
    fn residual(&self, ticks: &[u32]) -> Vec<u32> {
        let mut residual = Vec::new();
        for (ticks, cancelled) in ticks.chunks(64).zip(&self.words) {
            let mut others = !cancelled;
            while others != 0 {
                let Some(&tick) = ticks.get(others.trailing_zeros() as usize) else { break };
                residual.push(tick);
                others &= others - 1;
            }
        }
        residual
    }
}
