//! A linear detector: a photodiode, an amplifier, and a threshold.
//!
//! 1. A mark of mean n detected photons brings k of them, Poisson.
//! 2. Multiplication spreads their number: a = k + √(k·(F − 1))·g, F the excess noise factor.
//! 3. Shot noise of steady currents and the amplifier add their own: a + noise·g'.
//! 4. An amplitude above the threshold makes an event at the arrival of the mark, displaced by what
//!    the noise does to the slope.
//! 5. Between marks, noise crosses the threshold at the rate the threshold was set for.
//!
//! This model applies if the list `idealised` names `inter-chip`. Light of one shot that comes within the
//! response of the amplifier adds up; light of several shots does not. Marks of one word are separate events
//! even if they follow each other sooner than that. The walk of the crossing with the amplitude is taken to be
//! calibrated out. Otherwise [`super::waveform`] applies (docs/physics.md#photodiode-and-comparator).

use rand_distr::{Distribution, Poisson, StandardNormal};

use super::channel::Channel;
use super::noise::counts;
use super::{Detections, Kind, Memory};
use crate::design::Design;
use crate::design::detector::LinearSetting;
use crate::random::{Chance, Stage, Stream};
use crate::units::fs_from_s;

/// A mark of more photons than this is never below a threshold.
pub(super) const PLENTY: f64 = 1e12;

/// A linear detector and the crossings that its noise makes.
#[derive(Debug)]
pub(super) struct Thresholding {
    linear: LinearSetting,
    /// True if the height of a pulse is measured: the receiver of single pulses derives reflectance from it.
    measures: bool,
}

/// Light of one shot that comes within the response of the amplifier.
pub(super) struct Together {
    /// The first of the pulse trains.
    pub train: usize,
    /// How much later the mean of their light comes, fs.
    pub later_fs: i64,
    /// Photons of all of them, per mark.
    pub photons: f64,
}

impl Thresholding {
    pub fn new(linear: LinearSetting, design: &Design) -> Self {
        Self { linear, measures: !design.is_coded() }
    }
}

impl Kind for Thresholding {
    fn measures(&self) -> bool {
        self.measures
    }

    fn add(&self, channel: &Channel, chance: &Chance, found: &mut Detections, memory: &mut Memory) {
        let mut events: Vec<(u32, f32)> = Vec::new();
        let span = channel.whole_span();
        let response_fs = fs_from_s(self.linear.response);
        for Together { train, later_fs, photons } in gather(channel, response_fs) {
            let mut stream = chance.at(Stage::Photons, channel.light.trains.address(train));
            let photons = Poisson::new(photons.min(PLENTY)).ok();
            for mark_fs in channel.light.arrivals_fs(train) {
                let count = photons.map_or(0.0, |photons| photons.sample(&mut stream));
                if let Some((late_fs, amplitude)) = self.crossing(count, &mut stream) {
                    let time = channel.clock.time(mark_fs + later_fs + late_fs);
                    if span.contains(&time) {
                        events.push((time as u32, amplitude as f32));
                    }
                }
            }
        }
        counts(self.linear.false_rate, channel, chance, &mut memory.noise);
        let noise = memory.noise.iter();
        events.extend(noise.map(|time| (*time, self.linear.threshold as f32)));
        // The order of simultaneous events must not depend on the other shots that are looked at.
        events.sort_unstable_by(|one, other| one.0.cmp(&other.0).then(other.1.total_cmp(&one.1)));
        found.time.extend(events.iter().map(|event| event.0));
        if self.measures {
            found.amplitude.extend(events.iter().map(|event| event.1));
        }
    }
}

/// The pulse trains of a channel, those of one shot that begin within `within_fs` as one.
pub(super) fn gather(channel: &Channel, within_fs: i64) -> Vec<Together> {
    let trains = &channel.light.trains;
    let mut order: Vec<usize> =
        channel.order.iter().map(|arrival| *arrival as u32 as usize).collect();
    let whose = |train: usize| (trains.transmitter[train], trains.shot[train], trains.marks[train]);
    let begins = |train: usize| trains.arrives_fs[train];
    order.sort_by_cached_key(|&train| (whose(train), begins(train)));
    let mut together = Vec::new();
    let mut rest = order.as_slice();
    while let Some(&first) = rest.first() {
        let is_with = |train: &usize| {
            whose(*train) == whose(first) && begins(*train) <= begins(first) + within_fs
        };
        let count = rest.iter().take_while(|train| is_with(train)).count();
        let (one, others) = rest.split_at(count);
        let photons: f64 = one.iter().map(|&train| channel.detected(train)).sum();
        let later = |&train: &usize| {
            (begins(train) - begins(first)) as f64 * (channel.detected(train) / photons)
        };
        // A detector that never misses has no end of photons.
        let later: f64 = one.iter().map(later).sum();
        let later_fs = if later.is_finite() { later as i64 } else { 0 };
        together.push(Together { train: first, later_fs, photons });
        rest = others;
    }
    together
}

impl Thresholding {
    /// How late, fs, a mark of `count` detected photons crosses the threshold, and its amplitude;
    /// `None` if it does not.
    fn crossing(&self, count: f64, stream: &mut Stream) -> Option<(i64, f64)> {
        let LinearSetting { threshold, noise, excess, .. } = self.linear;
        let spread = (count * (excess - 1.0) + noise * noise).sqrt();
        let draw = |stream: &mut _| -> f64 { StandardNormal.sample(stream) };
        let amplitude = count + spread * draw(stream);
        let late = draw(stream);
        (count > 0.0 && amplitude > threshold)
            .then(|| (fs_from_s(late * self.linear.timing(amplitude)), amplitude))
    }
}

#[cfg(test)]
mod tests {
    use crate::channel::{Echo, light_of_echoes};
    use crate::design::Design;
    use crate::detect::{Detectors, Memory};
    use crate::random::Chance;

    /// Seven rays of a footprint with a seventh of the light each are one mark; 30 cm apart they
    /// are seven. N = 8 marks of one shot, seed 1.
    #[test]
    fn light_that_comes_together_adds_up() {
        let quiet = [("comparator.false_alarm_hz", "1.0"), ("without", "inter-chip")];
        let quiet = quiet.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let design = Design::open("coded-practical", &quiet).unwrap();
        let log = crate::emit::Band { scan: 0, first: 0, shots: 1 }.shot_log(&design);
        let shot = log.owned.start;
        let events = |apart_fs: i64, photons: f64| {
            let echo = |ray| Echo { shot, delay_fs: 500_000_000 + ray * apart_fs, photons };
            let light = light_of_echoes(&design, &log, (0..7).map(echo));
            let detectors = Detectors::in_the_dark(&design, Chance::new(1));
            detectors.detections(&log, &light, &mut Memory::default()).time.len()
        };
        // The threshold is at some 300 photons.
        assert_eq!(events(10_000, 90.0), 8);
        assert_eq!(events(2_000_000, 90.0), 0);
        assert_eq!(events(2_000_000, 900.0), 56);
    }
}
