//! Dark and background counts: Poisson in time, with a rate λ(t).
//!
//! The steady part of the rate is cut into windows of time. The counts of each are drawn from its own
//! address, so that neighbouring bands see the same ones where they overlap. Within a window the waits from
//! one count to the next are exponential. A process without memory may start anew with every window.
//! Stretches of time with a rate of their own are windows of their own: counts of independent Poisson
//! processes add up to one of the summed rate.
//!
//! At high rates most counts would fall into the tick of another one, and converters make one event of both.
//! Then each tick is drawn: lit or dark.

use std::ops::RangeInclusive;

use rand_distr::{Distribution, Exp1};

use super::channel::Channel;
use super::clock::Clock;
use crate::design::{Design, PARTS_OF_TICK};
use crate::kernels::{END, Events, GROUP};
use crate::random::{Address, Chance, Stage};
use crate::units::FS_PER_S;

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
        let span = channel.whole_span();
        let mut stream = chance.stream(stretch.address);
        let mut passed_fs = 0.0;
        loop {
            let wait: f64 = Exp1.sample(&mut stream);
            passed_fs += wait / stretch.per_s * FS_PER_S as f64;
            let now_fs = stretch.from_fs + passed_fs as i64;
            if now_fs >= stretch.until_fs {
                break;
            }
            let time = channel.clock.time(now_fs);
            times.extend(span.contains(&time).then_some(time as u32));
        }
    }
    if times.len() > from {
        times.sort_unstable();
    }
}

/// Background that lasts for a stretch of time.
pub(super) struct Stretch {
    pub from_fs: i64,
    pub until_fs: i64,
    /// Detections per second.
    pub per_s: f64,
    /// Address of its random numbers.
    pub address: Address,
}

/// The stretches that `channel` sees, those without light left out.
pub(super) fn stretches(channel: &Channel) -> impl Iterator<Item = Stretch> {
    let background = &channel.light.background;
    channel.stretches.iter().map(move |(_, i)| {
        let i = *i as usize;
        let (from_fs, until_fs) = (background.from_fs[i], background.until_fs[i]);
        // Stretches that begin at once differ in their end or in their rate.
        let rate = background.per_s[i].to_bits().rotate_left(42);
        let others = (until_fs as u64).rotate_left(21) ^ rate;
        let address = Address {
            stage: Stage::Stretch,
            index: from_fs as u64 ^ others,
            part: u32::from(channel.number) << PART_BITS,
        };
        Stretch { from_fs, until_fs, per_s: channel.steady_in(i), address }
    })
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
