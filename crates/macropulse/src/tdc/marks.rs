//! Marks to ticks where nothing but marks makes events.
//!
//! Macropulses follow each other with pauses in between. One that no other comes near needs no second look:
//! no two of its marks share a tick, and its code word gives the number of converters it keeps busy. Only
//! where macropulses overlap are their marks merged, and only where that may keep more converters busy than
//! ever before are they counted.

use macropulse_codec::Ticks;

use super::{Taken, bank::Bank};
use crate::detect::Marks;
use crate::kernels::{Macropulse, PAD, Words, distinct, merge};

/// The ticks of `marks`; of those before the absolute tick `from` as few as may be.
pub(super) fn ticks(bank: &mut Bank, marks: Marks, from: i64) -> Taken {
    let Marks { epoch, words: exact, mut macropulses, ticks } = marks;
    let words = &exact.words;
    // Bits that are dark to begin with may let one that begins later come first.
    let first = |sent: &Macropulse| words.ends(sent).map_or(sent.start, |[first, _]| first);
    if !macropulses.is_sorted_by_key(first) {
        macropulses.sort_by_key(first);
    }
    let mut layout = Layout { words, ticks, rows: Default::default(), found: 0, merged: 0 };
    layout.ticks.clear();
    // Converters that are never dead take several marks of one tick for one, too.
    let dead = bank.dead.max(1);
    let from = from.saturating_sub(epoch);
    let begin_wanted = macropulses.partition_point(|sent| i64::from(first(sent)) < from);
    let (mut at, mut unwanted) = (0, None);
    while at < macropulses.len() {
        let mut end = begin_wanted;
        if at >= begin_wanted {
            // All ticks so far come before those of this run.
            let before = |ticks: &[u32]| ticks.partition_point(|tick| i64::from(*tick) < from);
            let drop = |ticks: &mut Vec<u32>| ticks.drain(..before(ticks)).count();
            unwanted.get_or_insert_with(|| drop(&mut layout.ticks));
            end = macropulses.len();
        }
        let known = bank.peak / exact.busiest.max(1);
        let (run, last) = layout.add_run(&macropulses[at..end], (dead, known > 0));
        at += run;
        let Some(last) = last else { continue };
        // The last one of the run, and all that begin while its converters are busy.
        let begin = layout.ticks.len() - words.count(&last);
        let mut together = 1;
        while let Some(next) = macropulses.get(at)
            && layout.is_near(next, dead)
        {
            layout.add_among(next, begin);
            together += 1;
            at += 1;
        }
        if together > known {
            bank.take_from(&mut layout.ticks, begin);
        }
    }
    let Layout { ticks, found, merged, .. } = layout;
    let made = ticks.len() + unwanted.unwrap_or(0);
    Taken { ticks: Ticks { epoch, tick: ticks, ..Ticks::default() }, made, found, merged }
}

/// The ticks of some macropulses.
struct Layout<'a> {
    words: &'a Words,
    /// Apart, in the order of time.
    ticks: Vec<u32>,
    /// Two rows that are to be merged.
    rows: [Vec<u32>; 2],
    /// Marks that have come so far.
    found: usize,
    /// How many of them fell into the tick of another one.
    merged: usize,
}

impl Layout<'_> {
    /// Adds `macropulses` from the first one on, as long as each begins after the `dead` time of those
    /// before. The first one must be near nothing before. If not `several`, only one with marks is added.
    /// Returns how many were added, and the last one with marks.
    fn add_run(
        &mut self,
        macropulses: &[Macropulse],
        (dead, several): (u32, bool),
    ) -> (usize, Option<Macropulse>) {
        let (mut run, mut last, mut free) = (0, None, 0);
        for macropulse in macropulses {
            if let Some([begins, ends]) = self.words.ends(macropulse) {
                if last.is_some() && (begins < free || !several) {
                    break;
                }
                (last, free) = (Some(*macropulse), ends.saturating_add(dead));
            }
            run += 1;
        }
        let before = self.ticks.len();
        self.words.append(&macropulses[..run], &mut self.ticks);
        self.found += self.ticks.len() - before;
        (run, last)
    }

    /// Returns true if the marks of `next` begin within the `dead` time of the last tick, or if it has none.
    fn is_near(&self, next: &Macropulse, dead: u32) -> bool {
        match (self.words.ends(next), self.ticks.last()) {
            (Some([begins, _]), Some(last)) => begins < last.saturating_add(dead),
            (ends, _) => ends.is_none(),
        }
    }

    /// Adds the marks of `next` to the ticks, none of them before place `from`.
    fn add_among(&mut self, next: &Macropulse, from: usize) {
        self.found += self.words.count(next);
        let Some([begins, _]) = self.words.ends(next) else { return };
        let meet = from + self.ticks[from..].partition_point(|tick| *tick < begins);
        if meet == self.ticks.len() {
            self.words.append(&[*next], &mut self.ticks);
            return;
        }
        // Its bits that begin behind all ticks need not be merged with them.
        let (near, behind) = self.words.parted(next, self.ticks.last().copied().unwrap_or(0));
        let [earlier, later] = &mut self.rows;
        earlier.clear();
        earlier.extend_from_slice(&self.ticks[meet..]);
        earlier.extend(PAD);
        later.clear();
        self.words.append(&[near], later);
        later.extend(PAD);
        merge(earlier, later, &mut self.ticks, meet);
        let mut last = u32::MAX;
        let all = meet..self.ticks.len();
        let end = distinct(&mut self.ticks, all, meet, 0, &mut last);
        self.merged += self.ticks.len() - end;
        self.ticks.truncate(end);
        self.words.append(&[behind], &mut self.ticks);
    }
}
