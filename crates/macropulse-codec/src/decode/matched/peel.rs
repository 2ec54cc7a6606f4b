//! Clean macropulses are taken off the stream of ticks one after another, as they come.
//!
//! 1. The earliest tick that nobody has explained is taken for the first mark of a macropulse.
//!    The shot after the last one found is asked first: in smooth scenes it is the one.
//! 2. Otherwise each shot in flight is asked whether its second mark is there, too; codes are made
//!    so that hardly more than one says yes.
//! 3. All marks of that shot are looked for. If none is missing no lag can have more, and none
//!    earlier is left: this is the maximum. Its ticks are explained.
//! 4. Marks of one macropulse may be those of another one, too: the first tick that is not
//!    explained may be the second mark.
//!
//! Light from beyond the gate is peeled off, too, as far as it may come from: it is no return, but
//! would pass for noise.
//!
//! A tick of which no macropulse without a gap can begin is left for the receivers that follow.
//! Where marks are missed everywhere nothing can be peeled: this is soon noticed.

use super::{Lock, Sent};
use crate::kernels::begin_with;

/// Ticks without a macropulse that are put up with before peeling ends, and how many more for
/// each macropulse that was found.
const PATIENCE: (usize, usize) = (256, 4);

/// First marks that may be hidden under another macropulse.
const MOST_HIDDEN: usize = 2;

/// What was found without a gap, and what is left.
#[derive(Debug)]
pub(super) struct Peeled {
    /// The lag of each shot that was found.
    pub locks: Vec<Option<Lock>>,
    /// Shots that were found once more, behind their first lag, and where.
    pub again: Vec<(usize, Lock)>,
    /// Ticks that nobody has explained, in order, unless these are all.
    pub left: Option<Vec<u32>>,
}

/// Peels the macropulses of the shots `sent` off the sorted `ticks`.
pub(super) fn peel(sent: &Sent, ticks: &[u32]) -> Peeled {
    let mut peeler = Peeler {
        sent,
        ticks,
        gate: sent.gate(),
        light: sent.receiver.light_ticks.into(),
        scale: sent.receiver.ticks_per_chip,
        least: fewest_without_a_gap(sent, ticks),
        explained: Explained::new(ticks.len()),
        locks: vec![None; sent.fired.len()],
        again: Vec::new(),
        oldest: 0,
        oldest_beyond: 0,
        next: 0,
        places: Vec::new(),
    };
    // Marks that jitter are not where they should be.
    let (mut place, mut patience) = (0, if sent.width > 1 { 0 } else { PATIENCE.0 });
    while place < ticks.len() && patience > 0 {
        match peeler.shot_at(place) {
            Some(()) => patience += PATIENCE.1,
            None => patience -= 1,
        }
        place = peeler.explained.next_without(place + 1);
    }
    let found_any = ticks.is_empty() || peeler.explained.any();
    let left = found_any.then(|| peeler.explained.left(ticks));
    Peeled { locks: peeler.locks, again: peeler.again, left }
}

/// Marks that chance does not put there all together, at none of the lags of a gate: the least N
/// with L · dᴺ ≤ α, d the share of lit ticks. Two at least, as the second mark is asked for.
fn fewest_without_a_gap(sent: &Sent, ticks: &[u32]) -> usize {
    let span = sent.span();
    let density = ticks.len() as f64 / (span.end - span.start).max(1) as f64;
    let rarity = libm::log(sent.receiver.false_alarm / sent.lags());
    (rarity / libm::log(density.clamp(1e-9, 0.999))).ceil().max(2.0) as usize
}

struct Peeler<'a> {
    sent: &'a Sent<'a>,
    ticks: &'a [u32],
    gate: (i64, i64),
    /// Farthest lag from which light may come: beyond the gate it is explained, and no return.
    light: i64,
    scale: u32,
    /// Fewest marks with which a shot can be told from chance.
    least: usize,
    explained: Explained,
    locks: Vec<Option<Lock>>,
    again: Vec<(usize, Lock)>,
    /// Light of no shot before this one can come from within the gate any more.
    oldest: usize,
    /// Light of no shot before this one can come any more.
    oldest_beyond: usize,
    /// The shot after the last one found.
    next: usize,
    /// Where the marks of a shot were found.
    places: Vec<usize>,
}

impl Peeler<'_> {
    /// Finds the shot whose light begins with the tick at `place`, and explains its ticks.
    fn shot_at(&mut self, place: usize) -> Option<()> {
        if self.next < self.locks.len() && self.fits_in_a_row(self.next, place) {
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
        // Its first marks may lie under those of a macropulse that was peeled off before.
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
        self.explained.run(place, count);
        self.lock(shot, lag, count);
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
        self.explained.each(&self.places);
        self.lock(shot, lag, marks.len());
        true
    }

    /// Keeps `lag`: of several surfaces the first one counts, the others are found again.
    fn lock(&mut self, shot: usize, lag: i64, count: usize) {
        let count = count as u16;
        self.next = shot + 1;
        if lag > self.gate.1 {
            return;
        }
        let margin = count
            - self.sent.codebook.sidelobe(self.sent.log.label[shot], self.sent.log.word[shot]);
        let lock = Lock { lag, count, margin };
        if self.locks[shot].get_or_insert(lock).lag != lag {
            self.again.push((shot, lock));
        }
    }
}

/// Which ticks are explained, by their place in the list: one bit each.
#[derive(Debug)]
struct Explained {
    words: Vec<u64>,
    ticks: usize,
}

impl Explained {
    fn new(ticks: usize) -> Self {
        Self { words: vec![0; ticks / 64 + 1], ticks }
    }

    /// Whether any tick is explained.
    fn any(&self) -> bool {
        self.words.iter().any(|word| *word != 0)
    }

    /// Explains `count` ticks from `first` on.
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

    /// Explains the ticks at `places`.
    fn each(&mut self, places: &[usize]) {
        for place in places {
            self.words[place / 64] |= 1 << (place % 64);
        }
    }

    /// The first place from `place` on whose tick is not explained; the number of ticks if all
    /// are.
    fn next_without(&self, place: usize) -> usize {
        let mut index = place / 64;
        let mut unexplained =
            !self.words[index.min(self.words.len() - 1)] & u64::MAX << (place % 64);
        while unexplained == 0 && index + 1 < self.words.len() {
            index += 1;
            unexplained = !self.words[index];
        }
        (64 * index + unexplained.trailing_zeros() as usize).min(self.ticks)
    }

    /// The ticks that are not explained.
    fn left(&self, ticks: &[u32]) -> Vec<u32> {
        let mut left = Vec::new();
        for (ticks, explained) in ticks.chunks(64).zip(&self.words) {
            let mut unexplained = !explained;
            while unexplained != 0 {
                let Some(&tick) = ticks.get(unexplained.trailing_zeros() as usize) else { break };
                left.push(tick);
                unexplained &= unexplained - 1;
            }
        }
        left
    }
}
