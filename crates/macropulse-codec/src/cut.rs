//! How a run of shots is cut out of a stream, so that it can be decoded by itself.

use std::ops::{Range, RangeInclusive};

use crate::shot_log::ShotLog;

/// Times that must be known around a run of **owned** shots, to decode them as if the whole stream were at
/// hand. All times are fs.
///
/// Simulations of a band and decoders of a recorded stream cut by the same rule. So the receiver is given the
/// same shots and the same ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cut {
    /// Length of a tick.
    pub tick_fs: i64,
    /// Period of the converters' clock, a whole number of ticks.
    pub clock_fs: i64,
    /// How far jitter can displace a tick.
    pub jitter_fs: i64,
    /// How long the receiver listens to a shot, from its firing on.
    pub listening_fs: i64,
    /// How long before the first owned shot the ticks begin, and how long after the last gate is closed they
    /// end. All light that overlaps with light of an owned shot is then there as a whole, and its shot can be
    /// told.
    pub lead_fs: i64,
    /// How long before the first owned shot others must be known: their light may still be under way
    /// when the ticks begin.
    pub history_fs: i64,
}

/// `time` in whole `parts`, rounded down; a part lasts 1 fs at least.
fn quotient(time: i64, part: i64) -> i64 {
    time.div_euclid(part.max(1))
}

impl Cut {
    /// Returns the range of firing times in the log of owned shots, the first fired at `first` and the last
    /// at `last`.
    pub fn shots(&self, first: i64, last: i64) -> RangeInclusive<i64> {
        first.saturating_sub(self.history_fs)..=self.closes(last)
    }

    /// The absolute ticks that belong to owned shots fired from `first` to `last`.
    pub fn ticks(&self, first: i64, last: i64) -> Range<i64> {
        let closes = quotient(self.closes(last), self.tick_fs);
        self.opens(first)..closes.saturating_add(1)
    }

    /// Returns the first absolute tick that belongs to owned shots, if the first of them is fired at `first`.
    pub fn opens(&self, first: i64) -> i64 {
        quotient(first.saturating_sub(self.lead_fs), self.tick_fs)
    }

    /// The absolute tick that ticks are counted from in a log whose first shot, owned or not, is
    /// fired at `first`: early enough for what jitter puts before that.
    pub fn epoch(&self, first: i64) -> i64 {
        let clocks = quotient(first.saturating_sub(self.jitter_fs), self.clock_fs);
        clocks.saturating_mul(quotient(self.clock_fs, self.tick_fs))
    }

    /// Returns the part of the log of a band that its receiver is given: without the shots that were fired
    /// before the ticks begin. Only some of their light is there; a receiver that knew of them would take
    /// light of others for theirs.
    pub fn known(&self, log: &ShotLog) -> ShotLog {
        let Some(first) = log.fired_at_fs.get(log.owned.start) else { return log.clone() };
        let opens_fs = self.opens(*first).saturating_mul(self.tick_fs);
        log.part(log.fired_at_fs.partition_point(|fired| *fired < opens_fs)..log.len())
    }

    /// Returns true if a stream can be cut so: its ticks and clock last some time, and nothing ends before it
    /// begins.
    pub(crate) fn is_possible(&self) -> bool {
        let spans = [self.jitter_fs, self.listening_fs, self.lead_fs, self.history_fs];
        self.tick_fs > 0 && self.clock_fs >= self.tick_fs && spans.iter().all(|span| *span >= 0)
    }

    fn closes(&self, last: i64) -> i64 {
        last.saturating_add(self.listening_fs).saturating_add(self.lead_fs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUT: Cut = Cut {
        tick_fs: 10,
        clock_fs: 80,
        jitter_fs: 5,
        listening_fs: 1000,
        lead_fs: 100,
        history_fs: 2100,
    };

    #[test]
    fn shots_and_ticks_reach_beyond_the_owned_shots() {
        assert_eq!(CUT.shots(5000, 7000), 2900..=8100);
        assert_eq!(CUT.ticks(5000, 7000), 490..811);
        assert_eq!(CUT.opens(5000), 490);
        // Light of the last shots may be beyond what is counted.
        assert_eq!(*CUT.shots(0, i64::MAX).end(), i64::MAX);
    }

    #[test]
    fn a_receiver_is_given_the_shots_all_of_whose_light_is_in_the_ticks() {
        let fired = [4000, 4880, 4900, 5000, 5100];
        let log = ShotLog { owned: 3..5, ..ShotLog::of_one_channel(&fired, &[4, 3, 2, 1, 0]) };
        let known = CUT.known(&log);
        assert_eq!((known.first, known.owned.clone()), (2, 1..3));
        assert_eq!((known.fired_at_fs, known.word), (vec![4900, 5000, 5100], vec![2, 1, 0]));
        assert_eq!(CUT.known(&ShotLog::default()), ShotLog::default());
    }

    #[test]
    fn ticks_are_counted_from_a_period_of_the_clock_on() {
        assert_eq!(CUT.epoch(2900), 2880 / 10);
        // A little before the first shot of all.
        assert_eq!(CUT.epoch(0), -8);
    }
}
