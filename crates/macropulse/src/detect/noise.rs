//! False edges: dark counts and background, Poisson in time.
//!
//! Time is cut into windows, and the edges of each are drawn from its own address: neighbouring
//! bands see the same ones where they overlap. Within a window the waits from one edge to the next
//! are exponential. A process without memory may start anew with every window.
//!
//! Where there are so many that most would fall into the tick of another one, which the converters
//! make one of, it is drawn tick by tick whether there is any.

use std::ops::RangeInclusive;

use super::clock::Clock;
use crate::design::{Design, PARTS_OF_TICK};
use crate::kernels::{END, Events, GROUP};
use crate::random::{Address, Chance, Stage};
use crate::units::FS_PER_S;

/// A wait is rounded to a fraction of its mean, one in so many at least.
const FINENESS: f64 = (1 << 18) as f64;

/// So many edges in a tick, on average, are drawn tick by tick.
const CROWDED: f64 = 0.5;

/// Ticks of a window that is drawn tick by tick.
const TICKS: i64 = 1 << 14;

/// False edges at a steady rate.
#[derive(Debug)]
pub(super) enum Noise {
    /// Drawn one after the other.
    Apart(Waits),
    /// Drawn tick by tick.
    Crowded {
        /// Probability that a tick stays dark, in units of 2⁻³².
        dark: u32,
    },
}

/// Waits from one false edge to the next.
#[derive(Debug)]
pub(super) struct Waits {
    /// Mean wait, in fractions of a part of a tick.
    mean: f32,
    /// Those fractions are 2 to the power of −`shift`, and a window lasts [`END`] of them.
    shift: u32,
}

impl Noise {
    /// False edges at `rate` per second; `None` where there are none.
    pub fn new(rate: f64, design: &Design) -> Option<Self> {
        if rate <= 0.0 {
            return None;
        }
        let in_tick = rate * design.tdc.tick_fs as f64 / FS_PER_S as f64;
        if in_tick > CROWDED {
            let dark = libm::exp(-in_tick) * 2_f64.powi(32);
            return Some(Self::Crowded { dark: dark.round() as u32 });
        }
        let mean = FS_PER_S as f64 / rate * f64::from(PARTS_OF_TICK) / design.tdc.tick_fs as f64;
        let mut shift = 0;
        while mean * f64::from(1_u32 << shift) < FINENESS && shift < 20 {
            shift += 1;
        }
        Some(Self::Apart(Waits { mean: (mean * f64::from(1_u32 << shift)) as f32, shift }))
    }

    /// The false edges in `span`, which is in parts of a tick from the epoch of `clock` on; in
    /// `times`, in place of what was there.
    pub fn edges(
        &self,
        clock: &Clock,
        span: RangeInclusive<i64>,
        chance: &Chance,
        times: &mut Vec<u32>,
    ) {
        times.clear();
        match self {
            Self::Apart(waits) => waits.edges(clock, span, chance, times),
            Self::Crowded { dark } => lit_ticks(*dark, (clock, span), chance, times),
        }
    }
}

/// The ticks in `span` that are lit, each in its middle, where one is dark with probability
/// `dark` · 2⁻³².
fn lit_ticks(
    dark: u32,
    (clock, span): (&Clock, RangeInclusive<i64>),
    chance: &Chance,
    times: &mut Vec<u32>,
) {
    let parts = i64::from(PARTS_OF_TICK);
    let (first, last) = (
        (span.start() + clock.epoch_parts()).div_euclid(parts),
        (span.end() + clock.epoch_parts()).div_euclid(parts),
    );
    let mut numbers = Vec::new();
    for window in first.div_euclid(TICKS)..=last.div_euclid(TICKS) {
        let address = Address { stage: Stage::FalseEdges, index: window as u64, part: 0 };
        let numbers = chance.draw(address, TICKS as usize, &mut numbers);
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
    fn edges(
        &self,
        clock: &Clock,
        span: RangeInclusive<i64>,
        chance: &Chance,
        times: &mut Vec<u32>,
    ) {
        let window = i64::from(END >> self.shift);
        let number_of = |time: &i64| (time + clock.epoch_parts()).div_euclid(window);
        let mut numbers = Vec::new();
        for number in number_of(span.start())..=number_of(span.end()) {
            let from = times.len();
            let start = number * window - clock.epoch_parts();
            let events = Events { mean: self.mean, shift: self.shift, start: start as u32 };
            let address = Address { stage: Stage::FalseEdges, index: number as u64, part: 0 };
            draw(events, address, chance, (times, &mut numbers));
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
    (times, numbers): (&mut Vec<u32>, &mut Vec<[u32; GROUP]>),
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
