//! Edges to ticks: the bank of time-to-digital converters.
//!
//! 1. A converter counts whole clock periods in 32 bits and the rest of the way in ticks. The
//!    counter rolls over every 2³² periods (429.5 ms at 100 ps, \[KP16 §2\]); the receiver knows
//!    roughly what time it is and undoes that.
//! 2. Edges within the same tick are one: the hard limiter.
//! 3. The first free converter takes the next edge and is busy for the dead time. With all of
//!    them busy the edge is lost.
//! 4. Where every detector has its own channel, the bank is divided evenly among them.

use crate::design::{Design, Tdc};
use crate::detect::Edges;
use crate::emit::ShotLog;

/// What the time-to-digital converters hand to the decoder: integers. Sorted by channel, then by
/// tick, no tick twice in a channel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ticks {
    /// Absolute time of tick 0, in ticks since the first scan began.
    pub epoch: i64,
    /// Ticks since the epoch.
    pub tick: Vec<u32>,
    /// Detector; empty where the sensor has a single one.
    pub channel: Vec<u16>,
    /// Measured pulse energy in detected photons; empty where not measured.
    pub amplitude: Vec<f32>,
    /// Most converters busy at once, in any one channel.
    pub peak_busy: u32,
    /// Edges that found every converter busy.
    pub lost: u64,
    /// Edges that fell into the tick of another one.
    pub merged: u64,
}

/// What one converter puts out for one edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    /// Whole clock periods since power-up, rolling over in 32 bits.
    pub clock: u32,
    /// Ticks since the last clock edge.
    pub fine: u32,
}

impl Reading {
    /// The reading for an edge at absolute time `time_fs`.
    pub fn at(tdc: &Tdc, time_fs: i64) -> Self {
        Self {
            clock: time_fs.div_euclid(tdc.clock_fs) as u32,
            fine: (time_fs.rem_euclid(tdc.clock_fs) / tdc.tick_fs) as u32,
        }
    }

    /// Ticks from the clock count `epoch_clock` to this reading, however often the counter has
    /// rolled over since power-up; right for intervals shorter than one roll-over.
    pub fn ticks_since(self, tdc: &Tdc, epoch_clock: u32) -> i64 {
        let clocks = self.clock.wrapping_sub(epoch_clock);
        i64::from(clocks) * (tdc.clock_fs / tdc.tick_fs) + i64::from(self.fine)
    }
}

/// The ticks of the `edges` of one band.
pub fn ticks(design: &Design, log: &ShotLog, edges: &Edges) -> Ticks {
    let tdc = &design.tdc;
    // Jitter may put an edge a little before the first shot.
    let start = log.fired_at_fs.first().copied().unwrap_or(0);
    let epoch_clocks = start.div_euclid(tdc.clock_fs) - 1;
    let mut ticks =
        Ticks { epoch: epoch_clocks * (tdc.clock_fs / tdc.tick_fs), ..Ticks::default() };
    let per_channel = (tdc.converters / design.channels()).max(1) as usize;
    let mut bank = Bank::new(
        per_channel,
        tdc.dead_fs.div_euclid(tdc.tick_fs) + i64::from(tdc.dead_fs % tdc.tick_fs > 0),
    );
    let mut previous = None;
    for (i, &time_fs) in edges.time_fs.iter().enumerate() {
        let channel = edges.channel.get(i).copied().unwrap_or(0);
        let reading = Reading::at(tdc, time_fs);
        let Ok(tick) = u32::try_from(reading.ticks_since(tdc, epoch_clocks as u32)) else {
            ticks.lost += 1;
            continue;
        };
        match previous {
            Some((before, _)) if before != channel => bank.release(),
            Some((_, last)) if last == tick => {
                ticks.merged += 1;
                continue;
            }
            _ => {}
        }
        previous = Some((channel, tick));
        if !bank.take(tick) {
            ticks.lost += 1;
            continue;
        }
        ticks.tick.push(tick);
        if !edges.channel.is_empty() {
            ticks.channel.push(channel);
        }
        if let Some(&amplitude) = edges.amplitude.get(i) {
            ticks.amplitude.push(amplitude);
        }
    }
    ticks.peak_busy = bank.peak;
    ticks
}

/// Converters served first-free, each busy for the same time: an edge finds one free unless as
/// many edges as there are converters were taken within the last dead time.
struct Bank {
    dead: i64,
    /// Ticks of the edges taken last, as a ring as long as the bank.
    taken: Vec<i64>,
    next: usize,
    /// First entry of the ring, counted back from `next`, that is still busy.
    busy: usize,
    peak: u32,
}

impl Bank {
    fn new(converters: usize, dead: i64) -> Self {
        Self { dead, taken: vec![i64::MIN / 2; converters], next: 0, busy: 0, peak: 0 }
    }

    /// All converters become free.
    fn release(&mut self) {
        self.taken.fill(i64::MIN / 2);
        self.busy = 0;
    }

    fn take(&mut self, tick: u32) -> bool {
        let (now, size) = (i64::from(tick), self.taken.len());
        while self.busy > 0 {
            let oldest = self.taken[(self.next + size - self.busy) % size];
            if oldest + self.dead > now {
                break;
            }
            self.busy -= 1;
        }
        if self.busy == size {
            return false;
        }
        self.taken[self.next] = now;
        self.next = (self.next + 1) % size;
        self.busy += 1;
        self.peak = self.peak.max(self.busy as u32);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(set: &[(&str, &str)]) -> (Design, ShotLog) {
        let set: Vec<(String, String)> =
            set.iter().map(|(k, v)| (format!("tdc.{k}"), (*v).to_owned())).collect();
        let design = Design::open("kim-park-2016", &set).unwrap();
        let log = crate::emit::bands(&design, 0).next().unwrap().shot_log(&design);
        (design, log)
    }

    fn timed(design: &Design, log: &ShotLog, time_fs: Vec<i64>) -> Ticks {
        ticks(design, log, &Edges { time_fs, ..Edges::default() })
    }

    #[test]
    fn edges_in_one_tick_are_one() {
        let (design, log) = sensor(&[]);
        let ticks = timed(&design, &log, vec![1_000_000, 1_002_499, 1_002_500]);
        let absolute: Vec<i64> = ticks.tick.iter().map(|t| i64::from(*t) + ticks.epoch).collect();
        assert_eq!(absolute, [400, 401]);
        assert_eq!(ticks.merged, 1);
    }

    #[test]
    fn the_counter_rolls_over_unnoticed() {
        let (design, mut log) = sensor(&[]);
        let rollover = (1_i64 << 32) * design.tdc.clock_fs;
        approx::assert_relative_eq!(rollover as f64 * 1e-15, 0.4295, max_relative = 1e-4);
        log.fired_at_fs = vec![rollover - 5_000_000];
        let edges = vec![rollover - 2_500, rollover, rollover + 2_500];
        let ticks = timed(&design, &log, edges);
        let absolute: Vec<i64> = ticks.tick.iter().map(|t| i64::from(*t) + ticks.epoch).collect();
        let first = rollover / 2_500 - 1;
        assert_eq!(absolute, [first, first + 1, first + 2]);
        assert_eq!(Reading::at(&design.tdc, rollover).clock, 0);
    }

    #[test]
    fn a_bank_of_two_loses_the_third_edge_within_the_dead_time() {
        let (design, log) = sensor(&[("converters", "2"), ("dead_time_ns", "3.3")]);
        let ns = |t: f64| (t * 1e6) as i64;
        let ticks = timed(&design, &log, vec![ns(10.0), ns(11.0), ns(12.0), ns(13.4), ns(13.5)]);
        assert_eq!((ticks.tick.len(), ticks.lost, ticks.peak_busy), (3, 2, 2));
    }

    #[test]
    fn each_channel_has_its_share_of_the_bank() {
        let design =
            Design::open("peregrine", &[("tdc.dead_time_ns".into(), "100".into())]).unwrap();
        let log = crate::emit::bands(&design, 0).next().unwrap().shot_log(&design);
        let edges = Edges {
            time_fs: vec![1_000_000, 2_000_000, 1_000_000],
            channel: vec![0, 0, 1],
            amplitude: vec![1.0; 3],
        };
        let ticks = ticks(&design, &log, &edges);
        assert_eq!((ticks.tick.len(), ticks.lost), (2, 1));
        assert_eq!(ticks.channel, [0, 1]);
    }
}
