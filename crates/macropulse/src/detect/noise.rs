//! Dark and background counts: Poisson in time, with a rate λ(t).
//!
//! The steady part of the rate is cut into windows of time. The counts of each are drawn from its own
//! address, so that neighbouring bands see the same ones where they overlap. Within a window the waits from
//! one count to the next are exponential. A process without memory may start anew with every window.
//! Stretches of time with a rate of their own have windows of their own: counts of independent Poisson
//! processes add up to one of the summed rate. If the rate varies, counts are drawn at its highest value, and
//! each is kept with the share that the rate at its time has in it.
//!
//! At high rates most counts would fall into the tick of another one, and converters make one event of both.
//! Then each tick is drawn: lit or dark.

use std::ops::{Range, RangeInclusive};

use rand_distr::{Distribution, Exp1};

use super::channel::Channel;
use super::clock::Clock;
use crate::channel::Stretch;
use crate::design::{Design, PARTS_OF_TICK};
use crate::kernels::{END, Events, GROUP};
use crate::random::{Address, Chance, Stage, Stream};
use crate::units::{FS_PER_S, s_from_fs};

/// A wait is rounded to a fraction of its mean: one part in this number, or finer.
const FINENESS: f64 = (1 << 18) as f64;

/// With more counts in a tick than this, on average, they are drawn tick by tick.
const CROWDED: f64 = 0.5;

/// Ticks of a window that is drawn tick by tick.
const TICKS: i64 = 1 << 14;

/// Counts at a steady rate.
#[derive(Debug)]
enum Noise {
    /// Drawn one after the other.
    Apart(Waits),
    /// Drawn tick by tick.
    Crowded {
        /// Probability that a tick stays dark, in units of 2⁻³².
        dark: u32,
    },
}

/// Waits from one count to the next.
#[derive(Debug)]
struct Waits {
    /// Mean wait, in fractions of a part of a tick.
    mean: f32,
    /// Those fractions are 2 to the power of −`shift`, and a window lasts [`END`] of them.
    shift: u32,
}

impl Noise {
    /// Counts at `rate` per second; `None` where there are none.
    fn new(rate: f64, design: &Design) -> Option<Self> {
        if rate <= 0.0 {
            return None;
        }
        let in_tick = rate * design.clock.tick_fs as f64 / FS_PER_S as f64;
        if in_tick > CROWDED {
            let dark = libm::exp(-in_tick) * 2_f64.powi(32);
            return Some(Self::Crowded { dark: dark.round() as u32 });
        }
        let mean = FS_PER_S as f64 / rate * f64::from(PARTS_OF_TICK) / design.clock.tick_fs as f64;
        let mut shift = 0;
        while mean * f64::from(1_u32 << shift) < FINENESS && shift < 20 {
            shift += 1;
        }
        Some(Self::Apart(Waits { mean: (mean * f64::from(1_u32 << shift)) as f32, shift }))
    }

    /// Appends the counts in the `spans` of a channel, ascending.
    fn times(
        &self,
        (channel, spans): (&Channel, &[RangeInclusive<i64>]),
        chance: &Chance,
        times: &mut Vec<u32>,
    ) {
        for span in spans {
            let source = Source {
                clock: &channel.clock,
                span: span.clone(),
                chance,
                channel: channel.number,
            };
            match self {
                Self::Apart(waits) => waits.counts(&source, times),
                Self::Crowded { dark } => lit_ticks(*dark, &source, times),
            }
        }
    }
}

/// The counts while `channel` listens, as [`counts_in`] has them.
pub(super) fn counts(steady: f64, channel: &Channel, chance: &Chance, times: &mut Vec<u32>) {
    counts_in(&channel.spans, steady, (channel, chance), times);
}

/// Puts the counts in the `spans` of a channel into `times`, ascending, in place of what was there. `steady`
/// ones come per second. The stretches of background with a rate of their own add theirs, from the first span
/// to the last.
pub(super) fn counts_in(
    spans: &[RangeInclusive<i64>],
    steady: f64,
    (channel, chance): (&Channel, &Chance),
    times: &mut Vec<u32>,
) {
    times.clear();
    if let Some(steady) = Noise::new(steady, channel.design) {
        steady.times((channel, spans), chance, times);
    }
    let from = times.len();
    for stretch in stretches(channel) {
        stretch.counts(channel, chance, times);
    }
    if times.len() > from {
        times.sort_unstable();
    }
}

/// An odd number without a pattern: its multiples tell the addresses of windows apart.
const ANOTHER: u64 = 0x9e37_79b9_7f4a_7c15;

/// Background that lasts for a stretch of time.
pub(super) struct Drawn {
    pub light: Stretch,
    /// Detections per second, the mean of the stretch.
    per_s: f64,
    /// Address of its random numbers.
    address: Address,
}

/// The stretches that `channel` sees, those without light left out.
pub(super) fn stretches(channel: &Channel) -> impl Iterator<Item = Drawn> {
    let background = &channel.light.background;
    channel.stretches.iter().map(move |(_, i)| {
        let light = background.at(*i as usize);
        let part = u32::from(channel.number) << PART_BITS;
        let address = Address { stage: Stage::Stretch, index: light.address, part };
        Drawn { light, per_s: channel.steady_in(*i as usize), address }
    })
}

impl Drawn {
    /// When the first count comes at `from_fs` or later, fs. `None` if the stretch ends before.
    pub fn first(&self, from_fs: i64, until_fs: i64, stream: &mut Stream) -> Option<i64> {
        // Counts at the highest rate, each kept with the share that its rate has in it.
        let most = self.light.varies.most_power();
        let mut passed_fs = 0.0;
        loop {
            let wait: f64 = Exp1.sample(stream);
            passed_fs += wait / (self.per_s * most) * FS_PER_S as f64;
            if passed_fs >= (until_fs - from_fs) as f64 {
                return None;
            }
            let now_fs = from_fs + passed_fs as i64;
            if most == 1.0 || stream.fraction() * most < self.power(now_fs) {
                return Some(now_fs);
            }
        }
    }

    /// The power over its mean at `now_fs`.
    fn power(&self, now_fs: i64) -> f64 {
        self.light.varies.power(s_from_fs(now_fs - self.light.from_fs))
    }

    /// Appends the counts while `channel` listens. They are drawn window by window, so that none is drawn far away
    /// from it.
    fn counts(&self, channel: &Channel, chance: &Chance, times: &mut Vec<u32>) {
        let tick_fs = channel.design.clock.tick_fs;
        let Stretch { from_fs, until_fs, .. } = self.light;
        let span = channel.whole_span();
        let at = |time_fs: i64| channel.clock.time(time_fs);
        let is_crowded = self.per_s * s_from_fs(tick_fs) > CROWDED;
        let ticks_fs = TICKS * tick_fs;
        let window_fs = match is_crowded {
            true => ticks_fs,
            false => ((TICKS as f64 / self.per_s * FS_PER_S as f64) as i64).max(ticks_fs),
        };
        for window in from_fs.div_euclid(window_fs)..=(until_fs - 1).div_euclid(window_fs) {
            let begins_fs = window * window_fs;
            let lit = begins_fs.max(from_fs)..begins_fs.saturating_add(window_fs).min(until_fs);
            if at(lit.end) < *span.start() || at(lit.start) > *span.end() {
                continue;
            }
            let index = self.address.index ^ (window as u64).wrapping_mul(ANOTHER);
            let mut stream = chance.stream(Address { index, ..self.address });
            let mut add = |time_fs: i64| {
                let time = at(time_fs);
                times.extend(span.contains(&time).then_some(time as u32));
            };
            match is_crowded {
                true => self.lit_ticks(lit, tick_fs, &mut stream, &mut add),
                false => self.each(lit, &mut stream, &mut add),
            }
        }
    }

    /// Calls `add` with the time of each count.
    fn each(&self, lit: Range<i64>, stream: &mut Stream, add: &mut impl FnMut(i64)) {
        let Range { mut start, end } = lit;
        while let Some(now_fs) = self.first(start, end, stream) {
            add(now_fs);
            start = now_fs;
        }
    }

    /// Calls `add` with the middle of each tick that has a count: converters make one event of the counts in a tick.
    fn lit_ticks(
        &self,
        lit: Range<i64>,
        tick_fs: i64,
        stream: &mut Stream,
        add: &mut impl FnMut(i64),
    ) {
        for tick in lit.start.div_euclid(tick_fs)..lit.end.div_euclid(tick_fs) {
            let since = |tick: i64| s_from_fs(tick * tick_fs - self.light.from_fs);
            let power = self.light.varies.mean_power(since(tick), since(tick + 1));
            if stream.fraction() > libm::exp(-power * self.per_s * s_from_fs(tick_fs)) {
                add(tick * tick_fs + tick_fs / 2);
            }
        }
    }
}

/// The span of time in which counts are drawn, with its clock, chance and channel.
struct Source<'a> {
    clock: &'a Clock,
    /// In parts of a tick from the epoch of the clock on.
    span: RangeInclusive<i64>,
    chance: &'a Chance,
    channel: u16,
}

impl Source<'_> {
    /// The address of the counts of window `index`.
    fn address(&self, index: i64) -> Address {
        let part = u32::from(self.channel) << PART_BITS;
        Address { stage: Stage::Noise, index: index as u64, part }
    }
}

/// Bits of a part that are left for the runs of numbers of one window.
pub(super) const PART_BITS: u32 = 8;

/// The ticks in `span` that are lit, each in its middle, where one is dark with probability
/// `dark` · 2⁻³².
fn lit_ticks(dark: u32, source: &Source, times: &mut Vec<u32>) {
    let Source { clock, span, chance, .. } = source;
    let parts = i64::from(PARTS_OF_TICK);
    let (first, last) = (
        (span.start() + clock.epoch_parts()).div_euclid(parts),
        (span.end() + clock.epoch_parts()).div_euclid(parts),
    );
    let mut numbers = Vec::new();
    for window in first.div_euclid(TICKS)..=last.div_euclid(TICKS) {
        let numbers = chance.draw(source.address(window), TICKS as usize, &mut numbers);
        for (tick, number) in (window * TICKS..).zip(&numbers[..TICKS as usize]) {
            // The clock starts at a whole tick.
            let time = tick * parts + parts / 2 - clock.epoch_parts();
            if *number >= dark && span.contains(&time) {
                times.push(time as u32);
            }
        }
    }
}

impl Waits {
    fn counts(&self, source: &Source, times: &mut Vec<u32>) {
        let Source { clock, span, chance, .. } = source;
        let window = i64::from(END >> self.shift);
        let number_of = |time: &i64| (time + clock.epoch_parts()).div_euclid(window);
        let mut numbers = Vec::new();
        for number in number_of(span.start())..=number_of(span.end()) {
            let from = times.len();
            let start = number * window - clock.epoch_parts();
            let events = Events { mean: self.mean, shift: self.shift, start: start as u32 };
            draw(events, source.address(number), chance, times, &mut numbers);
            if *span.start() <= start && start + window <= *span.end() {
                continue;
            }
            // The window may begin before the epoch.
            let mut kept = from;
            for i in from..times.len() {
                let time = times[i];
                times[kept] = time;
                kept += usize::from(
                    span.contains(&(start + i64::from(time.wrapping_sub(start as u32)))),
                );
            }
            times.truncate(kept);
        }
    }
}

/// Appends the `events` of the window at `address`.
fn draw(
    events: Events,
    mut address: Address,
    chance: &Chance,
    times: &mut Vec<u32>,
    numbers: &mut Vec<[u32; GROUP]>,
) {
    // Enough for five windows in six; the others draw some more.
    let expected = END as f32 / events.mean;
    let mut count = (expected + expected.sqrt()) as usize + 1;
    let mut last = 0;
    loop {
        let groups = chance.draw(address, count, numbers).as_chunks().0;
        for group in groups {
            last = events.append(group, last, times);
            if last >= END {
                return;
            }
        }
        address.part += 1;
        count = GROUP;
    }
}
