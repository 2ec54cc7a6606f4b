//! The part of a record that is in memory: the shots that are decoded together, and their data.

use std::collections::VecDeque;
use std::io::Read;
use std::ops::Range;

use super::records::RecordsAtHand;
use super::{Error, SampleBlock, SampleReader, TickReader};
use crate::ticks::{Tick, Ticks};
use crate::{Given, Samples};

/// Ticks of a band at most: 400 MB of them.
const MOST_TICKS: usize = 1 << 24;

/// Samples of a band at most: 512 MB of them.
const MOST_SAMPLES: usize = 1 << 28;

/// A record under way.
#[derive(Debug)]
pub(super) enum AtHand<R> {
    Ticks(TicksAtHand<R>),
    Samples(SamplesAtHand<R>),
    Records(RecordsAtHand<R>),
}

impl<R: Read> AtHand<R> {
    /// Returns the record of the shots with the ids `owned`, or the ticks or samples of the absolute ticks of `span`.
    /// A span never begins before the one asked for last. Times of ticks are counted from `epoch` on.
    pub fn of(
        &mut self,
        owned: &Range<u64>,
        span: &Range<i64>,
        epoch: i64,
    ) -> Result<Given, Error> {
        match self {
            Self::Records(records) => records.of(owned),
            Self::Ticks(ticks) => Ok(Given::Ticks(ticks.of(span, epoch)?)),
            Self::Samples(samples) => Ok(Given::Samples(samples.of(span)?)),
        }
    }

    /// True if it has a record for each shot, and no other.
    pub fn is_by_shot(&self) -> bool {
        matches!(self, Self::Records(_))
    }

    /// Reads to the end, so that what is wrong there is not passed over.
    pub fn drain(&mut self) -> Result<(), Error> {
        match self {
            Self::Ticks(ticks) => while ticks.reader.next_tick()?.is_some() {},
            Self::Samples(samples) => while samples.reader.next_block()?.is_some() {},
            Self::Records(records) => records.drain()?,
        }
        Ok(())
    }
}

/// Ticks under way.
#[derive(Debug)]
pub(super) struct TicksAtHand<R> {
    reader: TickReader<R>,
    /// True if the receiver is given the channel of each tick.
    several: bool,
    seen: Vec<Tick>,
    is_over: bool,
}

impl<R: Read> TicksAtHand<R> {
    pub fn new(reader: TickReader<R>, several: bool) -> Self {
        Self { reader, several, seen: Vec::new(), is_over: false }
    }

    fn of(&mut self, span: &Range<i64>, epoch: i64) -> Result<Ticks, Error> {
        let past = self.seen.partition_point(|one| one.tick < span.start);
        self.seen.drain(..past);
        while !self.is_over && self.seen.last().is_none_or(|last| last.tick < span.end) {
            match self.reader.next_tick()? {
                Some(one) if one.tick < span.start => {}
                Some(one) => self.seen.push(one),
                None => self.is_over = true,
            }
            if self.seen.len() > MOST_TICKS {
                return self.reader.refuse(format!(
                    "more than {MOST_TICKS} ticks belong to shots that are decoded together"
                ));
            }
        }
        let within = self.seen.partition_point(|one| one.tick < span.end);
        let kind = (self.several, self.reader.header().measured);
        Ok(Ticks::of(&self.seen[..within], epoch, kind))
    }
}

/// Samples under way.
#[derive(Debug)]
pub(super) struct SamplesAtHand<R> {
    reader: SampleReader<R>,
    seen: VecDeque<SampleBlock>,
    /// Codes in them.
    codes: usize,
    is_over: bool,
}

impl<R: Read> SamplesAtHand<R> {
    pub fn new(reader: SampleReader<R>) -> Self {
        Self { reader, seen: VecDeque::new(), codes: 0, is_over: false }
    }

    fn of(&mut self, span: &Range<i64>) -> Result<Samples, Error> {
        self.seen.retain(|block| block.end() > span.start);
        self.codes = self.seen.iter().map(|block| block.code.len()).sum();
        while !self.is_over && self.seen.back().is_none_or(|last| last.first < span.end) {
            match self.reader.next_block()? {
                Some(block) if block.end() <= span.start => {}
                Some(block) => {
                    self.codes += block.code.len();
                    self.seen.push_back(block);
                }
                None => self.is_over = true,
            }
            if self.codes > MOST_SAMPLES {
                return self.reader.refuse(format!(
                    "more than {MOST_SAMPLES} samples belong to shots that are decoded together"
                ));
            }
        }
        self.joined(span)
    }

    /// Those of `span` that are at hand, channel by channel, all of the same ticks.
    fn joined(&self, span: &Range<i64>) -> Result<Samples, Error> {
        let within = |block: &&SampleBlock| block.first < span.end && block.end() > span.start;
        let mut blocks: Vec<&SampleBlock> = self.seen.iter().filter(within).collect();
        blocks.sort_by_key(|block| (block.channel, block.first));
        let ends = |block: &SampleBlock| block.end().min(span.end);
        let mut samples = Samples { epoch: span.start, ..Samples::default() };
        let mut closes = span.start;
        for of_channel in blocks.chunk_by(|one, next| one.channel == next.channel) {
            let (first, last) = (of_channel[0], of_channel[of_channel.len() - 1]);
            let (channel, from, until) = (first.channel, first.first.max(span.start), ends(last));
            let mut pairs = of_channel.windows(2);
            if let Some(pair) = pairs.find(|pair| pair[0].end() < pair[1].first) {
                return self.reader.refuse(format!(
                    "samples of channel {channel} from tick {} to {} are missing, and light of shots that \
                     are decoded may come then",
                    pair[0].end(),
                    pair[1].first - 1
                ));
            }
            if samples.channel.is_empty() {
                (samples.epoch, closes) = (from, until);
            } else if (from, until) != (samples.epoch, closes) {
                return self.reader.refuse(format!(
                    "of channel {channel} there are the samples from tick {from} to {}, of channel {} those \
                     from tick {} to {}, for the same shots: record all channels for the same time",
                    until - 1,
                    samples.channel[0],
                    samples.epoch,
                    closes - 1
                ));
            }
            samples.channel.push(channel);
            for block in of_channel {
                let at = |tick: i64| (tick.clamp(block.first, block.end()) - block.first) as usize;
                samples.code.extend_from_slice(&block.code[at(span.start)..at(span.end)]);
            }
        }
        Ok(samples)
    }
}
