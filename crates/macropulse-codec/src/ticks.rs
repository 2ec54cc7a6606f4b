//! Ticks: what time-to-digital converters hand to a receiver.

use std::ops::Range;

/// The ticks of one stretch of time, as columns. Sorted by channel, then by tick, no tick twice in
/// a channel.
///
/// A tick is the number of a slot of the converters' time, as long as their resolution; it carries
/// no trace of what made it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ticks {
    /// Absolute time of tick 0, in ticks since the first scan began.
    pub epoch: i64,
    /// Ticks since the epoch.
    pub tick: Vec<u32>,
    /// Detector channel; empty where the sensor has a single one.
    pub channel: Vec<u16>,
    /// Measured pulse energy in detected photons; empty where not measured.
    pub amplitude: Vec<f32>,
}

/// One tick of a stream: which detector saw light in which slot of time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tick {
    /// Absolute tick, since the first scan began.
    pub tick: i64,
    /// Detector channel; 0 where the sensor has a single one.
    pub channel: u16,
    /// Measured pulse energy in detected photons; 0 where not measured.
    pub amplitude: f32,
}

impl Tick {
    /// Returns the sort key of ticks in a stream: first the time, then the channel.
    pub fn order(&self) -> (i64, u16) {
        (self.tick, self.channel)
    }
}

impl Ticks {
    /// The ticks of `stream`, counted from `epoch` on, as a receiver is given them: with channels
    /// where there are `several`, with amplitudes where they are `measured`. Those that cannot be
    /// counted from there, 2³² ticks later or earlier, are left out.
    pub fn of(stream: &[Tick], epoch: i64, (several, measured): (bool, bool)) -> Self {
        let counted = |one: &&Tick| u32::try_from(one.tick.saturating_sub(epoch)).is_ok();
        let mut order: Vec<&Tick> = stream.iter().filter(counted).collect();
        if several {
            // Stable: within a channel they stay in their order.
            order.sort_by_key(|one| one.channel);
        }
        let channels = if several { &order[..] } else { &[] };
        let amplitudes = if measured { &order[..] } else { &[] };
        Self {
            epoch,
            tick: order.iter().map(|one| (one.tick - epoch) as u32).collect(),
            channel: channels.iter().map(|one| one.channel).collect(),
            amplitude: amplitudes.iter().map(|one| one.amplitude).collect(),
        }
    }

    /// Number of ticks.
    pub fn len(&self) -> usize {
        self.tick.len()
    }

    /// True if there is no tick.
    pub fn is_empty(&self) -> bool {
        self.tick.is_empty()
    }

    /// The ticks as a stream: in the order of time, those of one moment in the order of channels.
    pub fn stream(&self) -> Vec<Tick> {
        let one = |at: usize| Tick {
            tick: self.epoch.saturating_add(i64::from(self.tick[at])),
            channel: self.channel.get(at).copied().unwrap_or(0),
            amplitude: self.amplitude.get(at).copied().unwrap_or(0.0),
        };
        let mut stream: Vec<Tick> = (0..self.len()).map(one).collect();
        if !self.channel.is_empty() {
            stream.sort_by_key(Tick::order);
        }
        stream
    }

    /// Keeps the ticks of `span`, absolute ticks, and drops the others.
    pub fn keep(&mut self, span: &Range<i64>) {
        let [from, until] = [span.start, span.end].map(|tick| tick.saturating_sub(self.epoch));
        if self.channel.is_empty() {
            let before = |end: i64| self.tick.partition_point(|tick| i64::from(*tick) < end);
            let kept = before(from)..before(until).max(before(from));
            let amplitudes = kept.clone();
            self.tick.truncate(kept.end);
            self.tick.drain(..kept.start);
            if !self.amplitude.is_empty() {
                self.amplitude.truncate(amplitudes.end);
                self.amplitude.drain(..amplitudes.start.min(self.amplitude.len()));
            }
            return;
        }
        let is_within = |tick: &u32| (from..until).contains(&i64::from(*tick));
        let within: Vec<bool> = self.tick.iter().map(is_within).collect();
        keep_where(&mut self.tick, &within);
        keep_where(&mut self.channel, &within);
        keep_where(&mut self.amplitude, &within);
    }
}

/// Keeps the entries of a column that are to be kept; an empty column stays empty.
fn keep_where<T>(column: &mut Vec<T>, kept: &[bool]) {
    let mut kept = kept.iter();
    column.retain(|_| kept.next().is_some_and(|kept| *kept));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks() -> Ticks {
        Ticks {
            epoch: 100,
            tick: vec![5, 20, 30, 5, 10],
            channel: vec![0, 0, 0, 3, 3],
            amplitude: vec![1.0, 2.0, 3.0, 4.0, 5.0],
        }
    }

    #[test]
    fn a_stream_is_in_the_order_of_time_and_comes_back() {
        let stream = ticks().stream();
        let order: Vec<_> = stream.iter().map(Tick::order).collect();
        assert_eq!(order, [(105, 0), (105, 3), (110, 3), (120, 0), (130, 0)]);
        assert_eq!(Ticks::of(&stream, 100, (true, true)), ticks());
        // A tick before the epoch cannot be counted.
        assert_eq!(Ticks::of(&stream, 106, (true, true)).tick, [14, 24, 4]);
        assert_eq!(Ticks::of(&stream[..1], 100, (false, false)).tick, [5]);
    }

    #[test]
    fn what_is_kept_keeps_its_channel_and_amplitude() {
        let mut ticks = ticks();
        ticks.keep(&(106..130));
        assert_eq!((ticks.tick, ticks.channel), (vec![20, 10], vec![0, 3]));
        assert_eq!(ticks.amplitude, [2.0, 5.0]);
    }

    #[test]
    fn a_single_channel_is_cut_at_both_ends() {
        let mut ticks = Ticks { epoch: -7, tick: vec![0, 3, 6, 9], ..Ticks::default() };
        ticks.keep(&(-4..2));
        assert_eq!(ticks.tick, [3, 6]);
        ticks.keep(&(50..50));
        assert!(ticks.is_empty());
    }
}
