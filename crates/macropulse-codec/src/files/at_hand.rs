//! The part of a record that is in memory: the shots that are decoded together, and their data.

use std::collections::VecDeque;
use std::io::Read;
use std::ops::Range;

use super::{
    BeatReader, Error, Histogram, HistogramReader, SampleBlock, SampleReader, TapReader, TickReader,
};
use crate::ticks::{Tick, Ticks};
use crate::{Beats, Given, Histograms, Peak, Samples, Taps};

/// Ticks of a band at most: 400 MB of them.
const MOST_TICKS: usize = 1 << 24;

/// Samples of a band at most: 512 MB of them.
const MOST_SAMPLES: usize = 1 << 28;

/// Counts, taps or peaks of a band at most: a gigabyte of them.
const MOST_COUNTS: usize = 1 << 27;

/// A record under way.
#[derive(Debug)]
pub(super) enum AtHand<R> {
    Ticks(TicksAtHand<R>),
    Samples(SamplesAtHand<R>),
    Histograms(EachShot<HistogramReader<R>, Histogram>),
    Taps(EachShot<TapReader<R>, Vec<u16>>),
    Beats(EachShot<BeatReader<R>, Vec<Peak>>),
}

impl<R: Read> AtHand<R> {
    /// Returns the record of the shots with the ids `owned`: their histograms, taps or beats, or the ticks or
    /// samples of the absolute ticks of `span`. A span never begins before the one asked for last. Times of
    /// ticks are counted from `epoch` on.
    pub fn of(
        &mut self,
        owned: &Range<u64>,
        span: &Range<i64>,
        epoch: i64,
    ) -> Result<Given, Error> {
        match self {
            Self::Histograms(histograms) => Ok(Given::Histograms(histograms.of(owned)?)),
            Self::Taps(taps) => Ok(Given::Taps(taps.of(owned)?)),
            Self::Beats(beats) => Ok(Given::Beats(beats.of(owned)?)),
            Self::Ticks(ticks) => Ok(Given::Ticks(ticks.of(span, epoch)?)),
            Self::Samples(samples) => Ok(Given::Samples(samples.of(span)?)),
        }
    }

    /// True if it has a record for each shot, and no other.
    pub fn is_by_shot(&self) -> bool {
        matches!(self, Self::Histograms(_) | Self::Taps(_) | Self::Beats(_))
    }

    /// Reads to the end, so that what is wrong there is not passed over.
    pub fn drain(&mut self) -> Result<(), Error> {
        match self {
            Self::Ticks(ticks) => while ticks.reader.next_tick()?.is_some() {},
            Self::Samples(samples) => while samples.reader.next_block()?.is_some() {},
            Self::Histograms(histograms) => while histograms.reader.next_histogram()?.is_some() {},
            Self::Taps(taps) => while taps.reader.next_shot()?.is_some() {},
            Self::Beats(beats) => while beats.reader.next_shot()?.is_some() {},
        }
        Ok(())
    }
}

/// A file under way that has a record of each shot.
#[derive(Debug)]
pub(super) struct EachShot<R, T> {
    reader: R,
    /// The one behind those that were asked for, with its shot.
    next: Option<(u64, T)>,
}

impl<R, T> EachShot<R, T> {
    pub fn new(reader: R) -> Self {
        Self { reader, next: None }
    }

    /// Gives to `keep` what `read` finds of the shots `owned`, with the place of the shot among them.
    fn each(
        &mut self,
        owned: &Range<u64>,
        read: impl Fn(&mut R) -> Result<Option<(u64, T)>, Error>,
        mut keep: impl FnMut(usize, T),
    ) -> Result<(), Error> {
        loop {
            if self.next.is_none() {
                self.next = read(&mut self.reader)?;
            }
            let Some((shot, one)) = self.next.take_if(|(shot, _)| *shot < owned.end) else {
                return Ok(());
            };
            if let Some(at) = shot.checked_sub(owned.start) {
                keep(at as usize, one);
            }
        }
    }
}

impl<R: Read> EachShot<HistogramReader<R>, Histogram> {
    /// The histograms of the shots `owned`: empty of a shot without one.
    fn of(&mut self, owned: &Range<u64>) -> Result<Histograms, Error> {
        let header = *self.reader.header();
        let (shots, bins) = ((owned.end - owned.start) as usize, header.bins as usize);
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
        let read = |reader: &mut HistogramReader<R>| {
            Ok(reader.next_histogram()?.map(|one| (one.shot, one)))
        };
        self.each(owned, read, |at, one| {
            found.cycles[at] = one.cycles;
            found.counts[at * bins..(at + 1) * bins].copy_from_slice(&one.counts);
        })?;
        Ok(found)
    }
}

impl<R: Read> EachShot<TapReader<R>, Vec<u16>> {
    /// The taps of the shots `owned`: codes of 0 of a shot without any.
    fn of(&mut self, owned: &Range<u64>) -> Result<Taps, Error> {
        let taps = self.reader.header().taps;
        let (shots, each) = ((owned.end - owned.start) as usize, taps as usize);
        if shots.saturating_mul(each) > MOST_COUNTS {
            return self.reader.refuse(format!(
                "more than {MOST_COUNTS} taps belong to shots that are decoded together"
            ));
        }
        let mut found = Taps { taps, codes: vec![0; shots * each] };
        self.each(owned, TapReader::next_shot, |at, codes| {
            found.codes[at * each..(at + 1) * each].copy_from_slice(&codes);
        })?;
        Ok(found)
    }
}

impl<R: Read> EachShot<BeatReader<R>, Vec<Peak>> {
    /// The peaks of the shots `owned`: none of a shot without any.
    fn of(&mut self, owned: &Range<u64>) -> Result<Beats, Error> {
        let header = *self.reader.header();
        let (shots, each) =
            ((owned.end - owned.start) as usize, (header.ramps * header.peaks) as usize);
        if shots.saturating_mul(each) > MOST_COUNTS {
            return self.reader.refuse(format!(
                "more than {MOST_COUNTS} peaks belong to shots that are decoded together"
            ));
        }
        let found = vec![Peak::EMPTY; shots * each];
        let mut beats = Beats { ramps: header.ramps, peaks: header.peaks, found };
        self.each(owned, BeatReader::next_shot, |at, peaks| {
            beats.found[at * each..(at + 1) * each].copy_from_slice(&peaks);
        })?;
        Ok(beats)
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
