//! Shots and what was recorded of them read side by side, and cut into bands that can each be decoded by
//! itself.

use std::io::Read;
use std::ops::Range;

use super::at_hand::{AtHand, SamplesAtHand, TicksAtHand};
use super::records::RecordsAtHand;
use super::{Error, RecordReader, SampleReader, Shot, ShotReader, TickReader};
use crate::Given;
use crate::cut::Cut;
use crate::shot_log::ShotLog;

/// Shots of a band at most, guard shots included.
const MOST_SHOTS: usize = 1 << 20;

/// A shot log and its record under way; of both no more is kept than belongs to one band.
#[derive(Debug)]
pub struct Stream<S, R> {
    cut: Cut,
    shots: ShotReader<S>,
    record: AtHand<R>,
    /// The shots at hand, and the id of the first one.
    at_hand: Vec<Shot>,
    first: u64,
    shots_end: bool,
    /// The shots that are still to be owned.
    left: Range<u64>,
}

impl<S: Read, R: Read> Stream<S, R> {
    /// The bands of `shots` and `ticks`, which are of a sensor that is `cut` so; with the channel of
    /// each tick if it has `several`.
    pub fn new(cut: Cut, shots: ShotReader<S>, ticks: TickReader<R>, several: bool) -> Self {
        Self::of(cut, shots, AtHand::Ticks(TicksAtHand::new(ticks, several)))
    }

    /// The bands of `shots` and `samples`, which are of a sensor that is `cut` so.
    pub fn of_samples(cut: Cut, shots: ShotReader<S>, samples: SampleReader<R>) -> Self {
        Self::of(cut, shots, AtHand::Samples(SamplesAtHand::new(samples)))
    }

    /// The bands of `shots` and their `records`, which are of a sensor that is `cut` so.
    pub fn of_records(cut: Cut, shots: ShotReader<S>, records: RecordReader<R>) -> Self {
        Self::of(cut, shots, AtHand::Records(RecordsAtHand::new(records)))
    }

    fn of(cut: Cut, shots: ShotReader<S>, record: AtHand<R>) -> Self {
        let first = shots.header().first;
        let left = shots.header().owned.clone().unwrap_or(first..u64::MAX);
        Self {
            cut,
            shots,
            record,
            at_hand: Vec::new(),
            first,
            shots_end: false,
            left: left.start.max(first)..left.end,
        }
    }

    /// Returns the shots and the record of the next band; `None` behind the last one. Its owned shots end
    /// before the shot that `until` gives for the first of them. Time that a file of samples does not reach
    /// at its beginning or end is left out.
    ///
    /// # Errors
    /// If a file cannot be read, or if samples are missing between others. Also if shots are fired too far
    /// apart, or have too many ticks or samples, to be decoded together.
    pub fn next_band(
        &mut self,
        until: impl Fn(u64) -> u64,
    ) -> Result<Option<(ShotLog, Given)>, Error> {
        if !self.cut.is_possible() {
            return self.shots.refuse(
                "cannot be cut into bands: ticks and clock must last 1 fs or more, and no span may be \
                 negative",
            );
        }
        let first = self.left.start;
        let wanted = first..until(first).min(self.left.end).max(first);
        while self.end_at_hand() < wanted.end && self.read_shot()? {}
        let owned = wanted.start..wanted.end.min(self.end_at_hand());
        if owned.is_empty() {
            return self.drain();
        }
        self.left.start = owned.end;
        let [begins, ends] = [owned.start, owned.end - 1].map(|shot| self.shot(shot).fired_fs);
        let fired_fs = self.cut.shots(begins, ends);
        while self.at_hand.last().is_none_or(|shot| shot.fired_fs <= *fired_fs.end())
            && self.read_shot()?
        {}
        let is_before = |shot: &Shot| shot.fired_fs < *fired_fs.start();
        let past = self.at_hand.partition_point(is_before);
        self.at_hand.drain(..past);
        self.first += past as u64;
        let is_guard = |shot: &Shot| shot.fired_fs <= *fired_fs.end();
        let ids = owned.clone();
        let log = self.log(self.at_hand.partition_point(is_guard), owned);
        if self.record.is_by_shot() {
            let given = self.record.of(&ids, &(0..0), 0)?;
            return Ok(Some((log.part(log.owned.clone()), given)));
        }
        let span = self.cut.ticks(begins, ends);
        let epoch = self.cut.epoch(log.fired_at_fs[0]);
        if span.end.saturating_sub(epoch) > i64::from(u32::MAX) {
            return self.shots.refuse(format!(
                "shots {} to {} are fired too far apart to be decoded together; is it the sensor \
                 that they were recorded with, with the same changes?",
                first,
                self.left.start - 1
            ));
        }
        Ok(Some((self.cut.known(&log), self.record.of(&ids, &span, epoch)?)))
    }

    /// The id behind the last shot at hand.
    fn end_at_hand(&self) -> u64 {
        self.first.saturating_add(self.at_hand.len() as u64)
    }

    fn shot(&self, id: u64) -> &Shot {
        &self.at_hand[(id - self.first) as usize]
    }

    /// Reads one more shot; `false` at the end.
    fn read_shot(&mut self) -> Result<bool, Error> {
        if self.shots_end {
            return Ok(false);
        }
        if self.at_hand.len() >= MOST_SHOTS {
            return self.shots.refuse(format!(
                "more than {MOST_SHOTS} shots are fired while light of one of them is under way"
            ));
        }
        match self.shots.next_shot()? {
            Some(shot) => self.at_hand.push(shot),
            None => self.shots_end = true,
        }
        Ok(!self.shots_end)
    }

    /// The first `shots` at hand as a log.
    fn log(&self, shots: usize, owned: Range<u64>) -> ShotLog {
        let shots = &self.at_hand[..shots];
        let column = |number: fn(&Shot) -> u16| shots.iter().map(number).collect();
        let place = |id: u64| (id - self.first) as usize;
        ShotLog {
            first: self.first,
            fired_at_fs: shots.iter().map(|shot| shot.fired_fs).collect(),
            row: column(|shot| shot.row),
            column: column(|shot| shot.column),
            label: column(|shot| shot.label),
            word: column(|shot| shot.word),
            channel: column(|shot| shot.channel),
            owned: place(owned.start)..place(owned.end),
        }
    }

    /// Reads both files to their ends, so that what is wrong there is not passed over.
    fn drain(&mut self) -> Result<Option<(ShotLog, Given)>, Error> {
        while self.shots.next_shot()?.is_some() {}
        self.record.drain()?;
        Ok(None)
    }
}
