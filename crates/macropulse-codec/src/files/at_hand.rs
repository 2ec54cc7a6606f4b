//! What of a record is at hand: as much as belongs to what is decoded together.

use std::collections::VecDeque;
use std::io::Read;
use std::ops::Range;

use super::{Error, Histogram, HistogramReader, SampleBlock, SampleReader, TickReader};
use crate::ticks::{Tick, Ticks};
use crate::{Given, Histograms, Samples};

/// Ticks of a band at most: 400 MB of them.
const MOST_TICKS: usize = 1 << 24;

/// Samples of a band at most: 512 MB of them.
const MOST_SAMPLES: usize = 1 << 28;

/// Counts of a band at most: 512 MB of them.
const MOST_COUNTS: usize = 1 << 27;

/// A record under way.
#[derive(Debug)]
pub(super) enum AtHand<R> {
    Ticks(TicksAtHand<R>),
    Samples(SamplesAtHand<R>),
    Histograms(HistogramsAtHand<R>),
}

impl<R: Read> AtHand<R> {
    /// The record of the shots with the ids `owned`: that of the absolute ticks of `span`, which lie behind
    /// those asked for before, times of ticks being counted from `epoch` on; or the histograms of these shots.
    pub fn of(
        &mut self,
        owned: &Range<u64>,
        span: &Range<i64>,
        epoch: i64,
    ) -> Result<Given, Error> {
        match self {
            Self::Histograms(histograms) => Ok(Given::Histograms(histograms.of(owned)?)),
            Self::Ticks(ticks) => Ok(Given::Ticks(ticks.of(span, epoch)?)),
            Self::Samples(samples) => Ok(Given::Samples(samples.of(span)?)),
        }
    }

    /// Reads to the end, so that what is wrong there is not passed over.
    pub fn drain(&mut self) -> Result<(), Error> {
        match self {
            Self::Ticks(ticks) => while ticks.reader.next_tick()?.is_some() {},
            Self::Samples(samples) => while samples.reader.next_block()?.is_some() {},
            Self::Histograms(histograms) => while histograms.reader.next_histogram()?.is_some() {},
        }
        Ok(())
    }
}

/// Histograms under way.
#[derive(Debug)]
pub(super) struct HistogramsAtHand<R> {
    reader: HistogramReader<R>,
    /// The one behind those that were asked for.
    next: Option<Histogram>,
}

impl<R: Read> HistogramsAtHand<R> {
    pub fn new(reader: HistogramReader<R>) -> Self {
        Self { reader, next: None }
    }

    /// Those of the shots `owned`: empty of a shot without one.
    fn of(&mut self, owned: &Range<u64>) -> Result<Histograms, Error> {
        let header = *self.reader.header();
        let shots = (owned.end - owned.start) as usize;
        let bins = header.bins as usize;
        if shots.saturating_mul(bins) > MOST_COUNTS {
            return self.reader.refuse(format!(
                "more than {MOST_COUNTS} bins belong to shots that are decoded together"
            ));
        }
        let mut found = Histograms {
            bin_fs: header.bin_fs,
            offset_fs: header.offset_fs,
            bins: header.bins,
            cycles: vec![0; shots],
            counts: vec![0; shots * bins],
        };
        loop {
            if self.next.is_none() {
                self.next = self.reader.next_histogram()?;
            }
            let Some(one) = self.next.take_if(|one| one.shot < owned.end) else {
                return Ok(found);
            };
            if let Some(at) = one.shot.checked_sub(owned.start) {
                let at = at as usize;
                found.cycles[at] = one.cycles;
                found.counts[at * bins..(at + 1) * bins].copy_from_slice(&one.counts);
            }
        }
    }
}

/// Ticks under way.
#[derive(Debug)]
pub(super) struct TicksAtHand<R> {
    reader: TickReader<R>,
    /// Whether the receiver is given the channel of each tick.
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
