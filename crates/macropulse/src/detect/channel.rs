//! The part of a band that the detector of one channel sees, and the times at which it listens.

use std::borrow::Cow;
use std::ops::RangeInclusive;

use macropulse_codec::ShotLog;

use super::Detections;
use super::clock::Clock;
use crate::channel::Light;
use crate::design::Design;
use crate::kernels::arrivals;

/// The light and the shots of a band in the order of their channels; kept from band to band.
#[derive(Debug, Default)]
pub(super) struct Arrangement {
    /// Channel of each pulse train, and with it the train, see [`Channel::order`].
    trains: Vec<(u16, u64)>,
    /// The same of a sensor with a single channel.
    order: Vec<u64>,
    /// Channel of each shot, and the shot, in the order of channels, then of time.
    shots: Vec<(u16, u32)>,
    /// Channel of each stretch of background that has light, and the stretch, in the order of
    /// channels.
    stretches: Vec<(u16, u32)>,
}

/// The part of a band that the detector of one channel is given.
pub(super) struct Channel<'a> {
    pub number: u16,
    pub clock: Clock,
    pub design: &'a Design,
    pub log: &'a ShotLog,
    pub light: &'a Light<'a>,
    /// Detections per photon.
    efficiency: f64,
    /// The pulse trains that it sees, in the order in which they begin to arrive. The upper half of each
    /// number is the time, 0 if it lies before the epoch. The lower half is the index.
    pub order: Cow<'a, [u64]>,
    /// The shots that it listens to, in the order of time.
    pub shots: Vec<u32>,
    /// When it listens, in parts of a tick from the epoch on; ascending, and apart.
    pub spans: Vec<RangeInclusive<i64>>,
    /// The stretches of background that it sees, by their index in the columns; its number stands
    /// before each.
    pub stretches: &'a [(u16, u32)],
}

impl Arrangement {
    /// Puts the pulse trains and the background of `light` and the shots of `log` in the order of
    /// their channels.
    pub fn fill(&mut self, design: &Design, clock: &Clock, log: &ShotLog, light: &Light) {
        // Light that arrives later than the clock of a band counts arrives when no gate is open.
        let arrival = |(index, arrives_fs): (usize, &i64)| {
            let time = u32::try_from(clock.time(*arrives_fs).max(0)).ok()?;
            Some(u64::from(time) << 32 | index as u64)
        };
        self.order.clear();
        self.order.extend(light.trains.arrives_fs.iter().enumerate().filter_map(arrival));
        self.trains.clear();
        self.shots.clear();
        let background = &light.background;
        let stretches = background.channel.iter().copied().zip(0..);
        self.stretches.clear();
        self.stretches
            .extend(stretches.filter(|(_, index)| background.per_s[*index as usize] > 0.0));
        self.stretches.sort();
        if design.channels() == 1 {
            if !self.order.is_sorted() {
                // Made of few runs, which a merging sort makes use of.
                self.order.sort();
            }
            return;
        }
        let channel = |order: &u64| (light.trains.channel[*order as u32 as usize], *order);
        self.trains.extend(self.order.iter().map(channel));
        self.trains.sort_unstable();
        self.shots.extend(log.channel.iter().zip(0..).map(|(channel, shot)| (*channel, shot)));
        self.shots.sort();
    }

    /// The pulse trains at a sensor with a single channel, as [`Channel::order`] has them.
    pub fn order(&self) -> &[u64] {
        &self.order
    }

    /// The channels that listen, in their order.
    pub fn channels<'a>(
        &'a self,
        design: &'a Design,
        clock: Clock,
        log: &'a ShotLog,
        light: &'a Light<'a>,
    ) -> impl Iterator<Item = Channel<'a>> {
        let single = (design.channels() == 1).then(|| Channel {
            number: 0,
            clock,
            design,
            log,
            light,
            efficiency: design.efficiency(),
            order: Cow::Borrowed(&self.order),
            shots: (0..log.len() as u32).collect(),
            spans: spans(design, &clock, log, 0..log.len() as u32),
            stretches: self.stretches_of(0),
        });
        let several = self.shots.chunk_by(|one, next| one.0 == next.0).map(move |shots| {
            let number = shots[0].0;
            let first = self.trains.partition_point(|train| train.0 < number);
            let trains = self.trains[first..].iter().take_while(|train| train.0 == number);
            let shots: Vec<u32> = shots.iter().map(|shot| shot.1).collect();
            Channel {
                number,
                clock,
                design,
                log,
                light,
                efficiency: design.efficiency(),
                order: Cow::Owned(trains.map(|train| train.1).collect()),
                spans: spans(design, &clock, log, shots.iter().copied()),
                shots,
                stretches: self.stretches_of(number),
            }
        });
        single.into_iter().chain(several)
    }

    /// The stretches of background of `channel`.
    fn stretches_of(&self, channel: u16) -> &[(u16, u32)] {
        let first = self.stretches.partition_point(|stretch| stretch.0 < channel);
        let count = self.stretches[first..].partition_point(|stretch| stretch.0 == channel);
        &self.stretches[first..first + count]
    }
}

/// When a detector listens to `shots`: from the firing of each to the end of a macropulse that
/// begins at the end of the gate.
fn spans(
    design: &Design,
    clock: &Clock,
    log: &ShotLog,
    shots: impl Iterator<Item = u32>,
) -> Vec<RangeInclusive<i64>> {
    let mut spans: Vec<(i64, i64)> = Vec::new();
    let listening_fs = design.listening_fs();
    for shot in shots {
        let fired_fs = log.fired_at_fs[shot as usize];
        let closes_fs = fired_fs + listening_fs;
        match spans.last_mut() {
            Some(last) if fired_fs <= last.1 => last.1 = closes_fs,
            _ => spans.push((fired_fs, closes_fs)),
        }
    }
    spans.iter().map(|(from, to)| clock.time(*from)..=clock.time(*to)).collect()
}

impl Channel<'_> {
    /// Mean photons that are detected of each mark of pulse train `index`.
    pub fn detected(&self, index: usize) -> f64 {
        self.light.trains.photons[index] * self.efficiency
    }

    /// Detections per second of light that is steady all the time.
    pub fn steady(&self) -> f64 {
        self.light.background.steady * self.efficiency
    }

    /// Detections per second of light that is steady for stretch `index` of time.
    pub fn steady_in(&self, index: usize) -> f64 {
        self.light.background.per_s[index] * self.efficiency
    }

    /// When it begins and ceases to listen, in parts of a tick.
    pub fn whole_span(&self) -> RangeInclusive<i64> {
        let first = self.spans.first().map_or(0, |span| *span.start());
        first..=self.spans.last().map_or(-1, |span| *span.end())
    }

    /// When it must be followed to know its state while it listens: then, and for `memory` parts of a tick
    /// before, as far as its light is known. Ascending, and apart.
    pub fn followed(&self, memory: i64) -> Vec<RangeInclusive<i64>> {
        let known = *self.whole_span().start();
        let mut followed: Vec<RangeInclusive<i64>> = Vec::with_capacity(self.spans.len());
        for span in &self.spans {
            let from = (span.start() - memory).max(known);
            match followed.last_mut() {
                Some(last) if from <= *last.end() => *last = *last.start()..=*span.end(),
                _ => followed.push(from..=*span.end()),
            }
        }
        followed
    }

    /// When the marks of train `index` arrive while it listens, in parts of a tick from the epoch
    /// on, ascending; in `times`, in place of what was there.
    pub fn arrivals<'t>(&self, index: usize, times: &'t mut Vec<i64>) -> &'t [i64] {
        let (light, clock) = (self.light, &self.clock);
        let marks = light.marks(index);
        let chip_fs = light.transmitters[usize::from(light.trains.transmitter[index])].chip_fs;
        times.resize(marks.len(), 0);
        let begins_fs = light.trains.arrives_fs[index] - clock.epoch_fs;
        arrivals(clock.ruler, begins_fs, chip_fs, marks, times);
        let span = self.whole_span();
        let before = times.partition_point(|time| time < span.start());
        let until = times.partition_point(|time| time <= span.end());
        times.get(before..until).unwrap_or_default()
    }

    /// Takes those of the last events of `found`, from place `from` on, out that came while no gate was
    /// open.
    pub fn keep_what_is_listened_to(&self, found: &mut Detections, from: usize) {
        let mut spans = self.spans.iter().peekable();
        let mut kept = from;
        for place in from..found.time.len() {
            let time = i64::from(found.time[place]);
            while spans.next_if(|span| *span.end() < time).is_some() {}
            if spans.peek().is_some_and(|span| span.contains(&time)) {
                found.time[kept] = found.time[place];
                if place < found.amplitude.len() {
                    found.amplitude[kept] = found.amplitude[place];
                }
                kept += 1;
            }
        }
        found.time.truncate(kept);
        found.channel.truncate(kept);
        found.amplitude.truncate(kept);
    }
}
