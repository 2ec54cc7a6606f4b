//! Detection events to ticks: the bank of time-to-digital converters (TDC).
//!
//! 1. A converter counts whole clock periods in 32 bits and the rest of the way in ticks. The
//!    counter rolls over every 2³² periods (429.5 ms at 100 ps, \[KP16 §2\]); the receiver knows
//!    roughly what time it is and undoes that.
//! 2. Detection events within the same tick are one: the hard limiter.
//! 3. The first free converter takes the next event and is busy for the dead time. With all of
//!    them busy the event is lost.
//! 4. If every detector has its own channel, the bank is divided evenly among them.

mod bank;
mod marks;

use macropulse_codec::Ticks;

use bank::Bank;

use crate::design::{Clock, Design};
use crate::detect::{Detections, Response};

/// Output of the bank of converters for the detection events of a band.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Converted {
    /// Ticks that the receiver is given.
    pub ticks: Ticks,
    /// Number of ticks made, including those that the receiver is not given.
    pub made: u64,
    /// Most converters busy at once, in any one channel; no less than was known before.
    pub peak_busy: u32,
    /// Events that found every converter busy.
    pub lost: u64,
    /// Events that fell into the tick of another one.
    pub merged: u64,
}

/// Output of one converter for one detection event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    /// Whole clock periods since power-up, rolling over in 32 bits.
    pub clock: u32,
    /// Ticks since the last period of the clock began.
    pub fine: u32,
}

impl Reading {
    /// The reading for an event at absolute time `time_fs`.
    pub fn at(clock: Clock, time_fs: i64) -> Self {
        Self {
            clock: time_fs.div_euclid(clock.period_fs) as u32,
            fine: (time_fs.rem_euclid(clock.period_fs) / clock.tick_fs) as u32,
        }
    }

    /// Ticks from the clock count `epoch_clock` to this reading, however often the counter has
    /// rolled over since power-up; right for intervals shorter than one roll-over.
    pub fn ticks_since(self, clock: Clock, epoch_clock: u32) -> i64 {
        let clocks = self.clock.wrapping_sub(epoch_clock);
        i64::from(clocks) * (clock.period_fs / clock.tick_fs) + i64::from(self.fine)
    }
}

/// Request for the ticks of a band, and what is known before they are made.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Most converters that were busy at once in other bands of its scan, 0 if none was measured. Only a
    /// larger number is new, and most of a band is converted without looking for smaller ones.
    pub known_busy: u32,
    /// The absolute tick from which on ticks are wanted: earlier ones may be left out, and are where that
    /// saves time.
    pub from: i64,
}

impl Wanted {
    /// All ticks, of a band before which nothing is known.
    pub const ALL: Self = Self { known_busy: 0, from: i64::MIN };
}

/// Returns what is `wanted` of the `response` of the detectors to one band, in the memory that it had;
/// nothing if the sensor has no converters.
pub fn ticks<'a>(design: &Design, response: impl Into<Response<'a>>, wanted: Wanted) -> Converted {
    let Some(share) = design.bank() else { return Converted::default() };
    let converters = share.converters as usize;
    let peak = converters.min(wanted.known_busy as usize);
    let mut bank = Bank { converters, dead: share.dead_ticks(design.clock), peak };
    let Taken { ticks, made, found, merged } = match response.into() {
        Response::Events(events) => of_events(&mut bank, events),
        Response::Marks(marks) => marks::ticks(&mut bank, marks, wanted.from),
    };
    let (lost, merged) = ((found - merged - made) as u64, merged as u64);
    Converted { ticks, made: made as u64, peak_busy: bank.peak as u32, lost, merged }
}

/// Ticks, how many were made, of how many events, and how many of these fell into the tick of another one.
struct Taken {
    ticks: Ticks,
    made: usize,
    found: usize,
    merged: usize,
}

/// The ticks of detection events.
fn of_events(bank: &mut Bank, events: Detections) -> Taken {
    let Detections { epoch, mut time, mut channel, mut amplitude } = events;
    let found = time.len();
    let merged = if channel.is_empty() && amplitude.is_empty() {
        bank.take_all(&mut time)
    } else {
        bank.take_by_channel(&mut time, &mut channel, &mut amplitude)
    };
    let ticks = Ticks { epoch, tick: time, channel, amplitude };
    Taken { made: ticks.len(), ticks, found, merged }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::{Readout, Tdc};
    use proptest::prelude::*;
    use std::collections::VecDeque;
    use std::sync::LazyLock;

    fn sensor(set: &[(&str, &str)]) -> Design {
        let set: Vec<(String, String)> =
            set.iter().map(|(k, v)| (format!("tdc.{k}"), (*v).to_owned())).collect();
        Design::open("kim-park-2016", &set).unwrap()
    }

    fn timed(design: &Design, epoch: i64, time: Vec<u32>) -> Converted {
        ticks(design, Detections { epoch, time, ..Detections::default() }, Wanted::ALL)
    }

    #[test]
    fn events_in_one_tick_are_one() {
        let Converted { ticks, merged, lost, .. } =
            timed(&sensor(&[]), 4000, vec![64 * 400, 64 * 400 + 63, 64 * 401]);
        assert_eq!((ticks.epoch, &ticks.tick[..]), (4000, &[400, 401][..]));
        assert_eq!((merged, lost), (1, 0));
    }

    /// The reading of a converter gives the time since the epoch, even if the counter rolls over on the way.
    #[test]
    fn the_counter_rolls_over_unnoticed() {
        let clock = sensor(&[]).clock;
        let rollover = (1_i64 << 32) * clock.period_fs;
        approx::assert_relative_eq!(rollover as f64 * 1e-15, 0.4295, max_relative = 1e-4);
        assert_eq!(Reading::at(clock, rollover).clock, 0);
        let epoch = rollover / clock.period_fs - 50;
        for tick in [0, 1, 1999, 2000, 2001, 67_000_000] {
            let time_fs = epoch * clock.period_fs + tick * clock.tick_fs;
            assert_eq!(Reading::at(clock, time_fs).ticks_since(clock, epoch as u32), tick);
        }
    }

    #[test]
    fn a_bank_of_two_loses_the_third_event_within_the_dead_time() {
        let design = sensor(&[("converters", "2"), ("dead_time_ns", "3.3")]);
        let ns = |t: f64| (t * 400.0 * 64.0) as u32;
        let found = timed(&design, 0, vec![ns(10.0), ns(11.0), ns(12.0), ns(13.4), ns(13.5)]);
        assert_eq!((found.ticks.tick.len(), found.lost, found.peak_busy), (3, 2, 2));
    }

    #[test]
    fn each_channel_has_its_share_of_the_bank() {
        let design =
            Design::open("peregrine", &[("tdc.dead_time_ns".into(), "100".into())]).unwrap();
        let detections = Detections {
            epoch: 0,
            time: vec![6400, 12_800, 6400],
            channel: vec![0, 0, 1],
            amplitude: vec![1.0, 2.0, 3.0],
        };
        let Converted { ticks, lost, .. } = ticks(&design, detections, Wanted::ALL);
        assert_eq!((ticks.tick, lost), (vec![100, 100], 1));
        assert_eq!((ticks.channel, ticks.amplitude), (vec![0, 1], vec![1.0, 3.0]));
    }

    /// The bank as one would tell it: every converter remembers when it is free again.
    fn told(design: &Design, times: &[u32]) -> Converted {
        let bank = design.bank().unwrap();
        let dead = (bank.dead_fs as u64).div_ceil(design.clock.tick_fs as u64);
        let mut busy_until: VecDeque<u64> = VecDeque::new();
        let (mut found, mut before) = (Converted::default(), None);
        for tick in times.iter().map(|time| time / 64) {
            if before.replace(tick) == Some(tick) {
                found.merged += 1;
                continue;
            }
            while busy_until.front().is_some_and(|until| *until <= u64::from(tick)) {
                busy_until.pop_front();
            }
            if busy_until.len() == bank.converters as usize {
                found.lost += 1;
                continue;
            }
            busy_until.push_back(u64::from(tick) + dead);
            found.peak_busy = found.peak_busy.max(busy_until.len() as u32);
            found.ticks.tick.push(tick);
            found.made += 1;
        }
        found
    }

    fn sensor_alone() -> &'static Design {
        static ALONE: LazyLock<Design> = LazyLock::new(|| sensor(&[]));
        &ALONE
    }

    /// Returns a sensor with this bank of converters. It reuses one sensor: reading the file for each takes a
    /// second for twenty.
    fn with_bank(converters: u32, dead_fs: i64) -> Design {
        let mut design = sensor_alone().clone();
        design.readout = Readout::Tdc(Tdc { converters, dead_fs });
        design
    }

    proptest! {
        #[test]
        fn blocks_come_to_the_same_as_one_event_after_the_other(
            gaps in proptest::collection::vec(0..30_000_u32, 0..1000),
            scale in 0..4_u32,
            converters in 1..60_u32,
            dead_ns in 0..5_u32,
            known in 0..100_u32,
        ) {
            let design = with_bank(converters, i64::from(dead_ns) * 1_000_000);
            let times: Vec<u32> = gaps.iter().scan(0, |time, gap| {
                *time += gap >> (4 * scale);
                Some(*time)
            }).collect();
            let expected = told(&design, &times);
            prop_assert_eq!(timed(&design, 0, times.clone()), expected.clone());
            let detections = Detections { time: times, ..Detections::default() };
            let peak_busy = expected.peak_busy.max(known.min(converters));
            let knowing = ticks(&design, detections, Wanted { known_busy: known, ..Wanted::ALL });
            prop_assert_eq!(knowing, Converted { peak_busy, ..expected });
        }

        /// Sensors with amplitudes go event by event.
        #[test]
        fn with_and_without_amplitudes_the_bank_is_the_same(
            mut times in proptest::collection::vec(0..1_000_000_u32, 0..300),
            converters in 1..60_u32,
        ) {
            times.sort_unstable();
            let design = with_bank(converters, sensor_alone().bank().unwrap().dead_fs);
            let without = timed(&design, 0, times.clone());
            let amplitude: Vec<f32> = times.iter().map(|time| (time / 64) as f32).collect();
            let detections = Detections { time: times, amplitude, ..Detections::default() };
            let with = ticks(&design, detections, Wanted::ALL);
            let of_ticks: Vec<f32> = with.ticks.tick.iter().map(|tick| *tick as f32).collect();
            prop_assert_eq!(&with.ticks.amplitude, &of_ticks);
            let ticks = Ticks { amplitude: Vec::new(), ..with.ticks.clone() };
            prop_assert_eq!(Converted { ticks, ..with }, without);
        }
    }
}
