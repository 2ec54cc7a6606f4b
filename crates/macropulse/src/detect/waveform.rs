//! A linear detector as its comparator sees it: the pulses of all light at the detector, summed.
//!
//! 1. A mark of mean n detected photons brings k of them, Poisson; multiplication makes an amplitude
//!    k + √(k·(F − 1))·g of them, F the excess noise factor.
//! 2. Behind the amplifier it is a Gaussian of the response. Pulses add up, whoever sent them.
//! 3. Noise is added: independent numbers, smoothed with a Gaussian to the memory that the noise has behind
//!    the amplifier. It then crosses the threshold at the rate that the threshold was set for.
//! 4. The comparator makes an event where the sum crosses the threshold, and none before the sum has
//!    fallen below the hysteresis again. It tells the crossing itself, or the constant fraction.
//! 5. An event is displaced by the jitter of the input.
//!
//! Around pulses, the sum is worked out in steps of an eighth of the response, or of a quarter of the noise's
//! memory if that is shorter. Crossings are interpolated. Elsewhere noise crosses the threshold at the rate
//! that it was set for. The amplifier neither clips nor has a steady level that moves
//! (docs/physics.md#photodiode-and-comparator).

use std::f64::consts::FRAC_1_SQRT_2;

use rand_distr::{Distribution, Poisson, StandardNormal};

use super::channel::Channel;
use super::linear::{PLENTY, gather};
use super::noise::{PART_BITS, counts};
use super::{Detections, Kind, Memory};
use crate::design::Design;
use crate::design::detector::{
    COMPARATOR_DELAY, COMPARATOR_FRACTION, Comparator, LinearSetting, Timing,
};
use crate::kernels::GROUP;
use crate::random::{Address, Chance, Stage};
use crate::units::{FS_PER_S, RMS_OF_FWHM, fs_from_s};

/// Steps in a response at least. With 4000 pulses and the noise of one crossing in 10⁴ responses, the times
/// from 8 and from 16 steps differ by 0.008 of a response, rms, at the threshold. At five times the threshold
/// they differ by 0.004. Crossings between the steps are found, too, see [`peak`].
const STEPS: f64 = 8.0;

/// Steps in the memory of the noise at least. Noise in such steps crosses the threshold as often as noise in
/// finer steps, to a percent, the parabolas of [`peak`] included.
const STEPS_OF_MEMORY: f64 = 4.0;

/// A pulse is followed to where it is less than this share of the noise.
const NEGLIGIBLE: f64 = 1.0 / 16.0;

/// Light of one shot this share of the response apart, or nearer, is one pulse.
const TOGETHER: f64 = 1.0 / 8.0;

/// Samples whose noise is drawn at once, of two numbers each.
const BLOCK: usize = GROUP / 2;

/// Standard deviations at which the smoothing of the noise is cut off.
const CUT: f64 = 3.5;

/// A linear detector that sums the pulses of all light.
#[derive(Debug)]
pub(super) struct Waveform {
    linear: LinearSetting,
    comparator: Comparator,
    /// Set if the height of a pulse is measured, as in [`super::linear`].
    measures: bool,
    /// A step, fs.
    step_fs: i64,
    /// Steps in the delay of the comparator.
    delay: i64,
    /// rms length of a pulse, in steps.
    rms: f64,
    /// How much later than the peak the moment is told, fs.
    late_fs: i64,
    /// Weights by which noise is smoothed; of an odd number of samples, the squares add up to 1.
    kernel: Vec<f32>,
}

/// A pulse at the detector.
#[derive(Clone, Copy)]
struct Pulse {
    peak_fs: i64,
    /// Its height, detected photons.
    height: f64,
}

/// A detection event, before the clock of the band counts its time.
struct Event {
    time_fs: i64,
    /// The highest that the signal was since, detected photons.
    height: f64,
}

/// The timing of the comparator.
#[derive(Clone, Copy, PartialEq)]
enum State {
    /// The signal has been below the hysteresis: the next crossing counts.
    Armed,
    /// The threshold has been crossed; the constant fraction has not come yet.
    Waiting,
    /// The event has been made.
    Told,
}

/// A stretch of time that has pulses.
#[derive(Default)]
struct Stretch {
    /// Number of its first step.
    first: i64,
    /// The signal in every step.
    signal: Vec<f64>,
    /// Independent numbers, and what becomes of them.
    white: Vec<f32>,
    noise: Vec<f32>,
    numbers: Vec<[u32; GROUP]>,
}

impl Waveform {
    pub fn new(linear: LinearSetting, comparator: Comparator, design: &Design) -> Self {
        // The delay is a whole number of them.
        let steps = (STEPS_OF_MEMORY * linear.response / linear.memory).max(STEPS).ceil();
        let step_fs = fs_from_s(linear.response / steps).max(1);
        let in_steps = |seconds: f64| seconds * FS_PER_S as f64 / step_fs as f64;
        let smoothing = in_steps(linear.memory * FRAC_1_SQRT_2);
        let half = (CUT * smoothing).ceil() as i32;
        let weight = |at: i32| libm::exp(-0.5 * (f64::from(at) / smoothing).powi(2));
        let squares: f64 = (-half..=half).map(|at| weight(at).powi(2)).sum();
        let kernel = (-half..=half).map(|at| (weight(at) / squares.sqrt()) as f32).collect();
        let late = match comparator.timing {
            Timing::ConstantFraction => Comparator::late(linear.response),
            Timing::LeadingEdge => 0.0,
        };
        Self {
            linear,
            comparator,
            measures: !design.is_coded(),
            step_fs,
            delay: (steps * COMPARATOR_DELAY) as i64,
            rms: in_steps(linear.response * RMS_OF_FWHM),
            late_fs: fs_from_s(late),
            kernel,
        }
    }

    /// The pulses of all light in `channel`, in the order in which they begin.
    fn pulses(&self, channel: &Channel, chance: &Chance) -> Vec<Pulse> {
        let mut pulses = Vec::new();
        let span = channel.whole_span();
        let response = self.linear.response;
        for together in gather(channel, fs_from_s(response * TOGETHER)) {
            let address = channel.light.trains.address(together.train);
            let mut stream = chance.at(Stage::Photons, address);
            let photons = Poisson::new(together.photons.min(PLENTY)).ok();
            for mark_fs in channel.light.arrivals_fs(together.train) {
                let count = photons.map_or(0.0, |photons| photons.sample(&mut stream));
                let spread: f64 = StandardNormal.sample(&mut stream);
                let height = count + (count * (self.linear.excess - 1.0)).sqrt() * spread;
                let peak_fs = mark_fs + together.later_fs;
                if height > 0.0 && span.contains(&channel.clock.time(peak_fs)) {
                    pulses.push(Pulse { peak_fs, height });
                }
            }
        }
        // Sorted by the start of their waveform. The order of simultaneous ones must not depend on the
        // others.
        pulses.sort_by_cached_key(|pulse| {
            (self.steps(pulse).0, pulse.peak_fs, pulse.height.to_bits())
        });
        pulses
    }

    /// How far to either side a pulse is followed, steps.
    fn reach(&self, pulse: &Pulse) -> i64 {
        let over = pulse.height / (NEGLIGIBLE * self.linear.noise).max(f64::MIN_POSITIVE);
        let deviations = (2.0 * libm::log(over.clamp(2.0, 1e30))).sqrt();
        (deviations * self.rms).ceil() as i64 + 1
    }

    /// The steps from the first to the last in which `pulse` is followed, with what the delay of the
    /// comparator looks back upon.
    fn steps(&self, pulse: &Pulse) -> (i64, i64) {
        let (at, reach) = (pulse.peak_fs.div_euclid(self.step_fs), self.reach(pulse));
        let delay = self.delay;
        (at - reach - delay, at + reach + delay)
    }

    /// Puts the sum of `pulses` and the noise of the channel in place of what `stretch` held.
    fn sum(&self, pulses: &[Pulse], last: i64, noise: &Noise, stretch: &mut Stretch) {
        let length = (last - stretch.first + 1) as usize;
        noise.smooth(stretch, length, &self.kernel);
        let rms = self.linear.noise;
        stretch.signal.clear();
        stretch.signal.extend(stretch.noise.iter().map(|noise| f64::from(*noise) * rms));
        // From step to step a Gaussian grows by a ratio that shrinks by a constant one.
        let shrinks = libm::exp(-(self.rms * self.rms).recip());
        for pulse in pulses {
            let (from, to) = self.steps(pulse);
            let at = (from * self.step_fs - pulse.peak_fs) as f64 / self.step_fs as f64;
            let at = at / self.rms;
            let mut value = pulse.height * libm::exp(-at * at / 2.0);
            let mut grows = libm::exp(-(at + 0.5 / self.rms) / self.rms);
            let steps = (from - stretch.first) as usize..=(to - stretch.first) as usize;
            for sample in &mut stretch.signal[steps] {
                *sample += value;
                value *= grows;
                grows *= shrinks;
            }
        }
    }

    /// Appends the events of a stretch.
    fn compare(&self, stretch: &Stretch, events: &mut Vec<Event>) {
        let threshold = self.linear.threshold;
        let release = (1.0 - self.comparator.hysteresis) * threshold;
        let delay = self.delay as usize;
        let signal = &stretch.signal;
        // The delayed signal less the fraction of the undelayed one.
        let fraction = |at: usize| {
            let ago = at.checked_sub(delay).map_or(0.0, |ago| signal[ago]);
            ago - COMPARATOR_FRACTION * signal[at]
        };
        let event = |at: usize, part: f64, height: f64| {
            let steps = (stretch.first + at as i64 - 1) as f64 + part;
            Event { time_fs: (steps * self.step_fs as f64) as i64 - self.late_fs, height }
        };
        let mut state = match signal.first() {
            Some(first) if *first > threshold => State::Told,
            _ => State::Armed,
        };
        for at in 1..signal.len() {
            let [before, now] = [signal[at - 1], signal[at]];
            let next = signal.get(at + 1).copied().unwrap_or(now);
            if state == State::Armed && peak(before, now, next) > threshold {
                state = match self.comparator.timing {
                    Timing::ConstantFraction => State::Waiting,
                    Timing::LeadingEdge => {
                        events.push(event(at, part_of_flank(before, now, threshold), now));
                        State::Told
                    }
                };
            } else if state == State::Waiting && fraction(at) >= 0.0 {
                let highest = signal[at - delay.min(at)..=at].iter().copied().fold(now, f64::max);
                let [before, now] = [fraction(at - 1), fraction(at)];
                let part = if before < 0.0 { before / (before - now) } else { 0.0 };
                events.push(event(at, part, highest));
                state = State::Told;
            } else if state == State::Told && now < release {
                state = State::Armed;
            } else if state == State::Told
                && let Some(last) = events.last_mut()
            {
                last.height = last.height.max(now);
            }
        }
    }
}

/// The highest value of the signal around a step: `now`, or if it is no less than `before` and `next`, the
/// top of the parabola through all three. With 4000 pulses at the threshold, 7 to 13 in 1000 cross it between
/// steps alone. The parabola and steps eight times as fine disagree about 1 or 2 in 1000.
fn peak(before: f64, now: f64, next: f64) -> f64 {
    let bend = 2.0 * now - before - next;
    match before <= now && next <= now && bend > 0.0 {
        true => now + (next - before).powi(2) / (8.0 * bend),
        false => now,
    }
}

/// Returns the part of a step after which a flank that rises from `before` to `now` is at the `threshold`.
/// Far below its peak a pulse rises by a ratio, not by a difference.
fn part_of_flank(before: f64, now: f64, threshold: f64) -> f64 {
    match before > 0.0 {
        true => libm::log(threshold / before) / libm::log(now / before),
        false => (threshold - before) / (now - before),
    }
    .clamp(0.0, 1.0)
}

impl Kind for Waveform {
    fn measures(&self) -> bool {
        self.measures
    }

    fn add(&self, channel: &Channel, chance: &Chance, found: &mut Detections, memory: &mut Memory) {
        let pulses = self.pulses(channel, chance);
        let noise = Noise { chance, part: u32::from(channel.number) << PART_BITS };
        let mut stretch = Stretch::default();
        let mut events: Vec<(u32, f32)> = Vec::new();
        let mut told: Vec<Event> = Vec::new();
        // When there are pulses, in parts of a tick.
        let mut with_pulses: Vec<(i64, i64)> = Vec::new();
        let span = channel.whole_span();
        let mut rest = pulses.as_slice();
        while let Some(pulse) = rest.first() {
            let (first, mut last) = self.steps(pulse);
            stretch.first = first;
            let mut count = 0;
            while let Some(next) = rest.get(count).map(|next| self.steps(next))
                && next.0 <= last
            {
                last = last.max(next.1);
                count += 1;
            }
            let (together, behind) = rest.split_at(count);
            rest = behind;
            self.sum(together, last, &noise, &mut stretch);
            told.clear();
            self.compare(&stretch, &mut told);
            for Event { time_fs, height } in &told {
                let time_fs = time_fs + noise.late_fs(*time_fs, self.linear.jitter);
                let time = channel.clock.time(time_fs);
                if span.contains(&time) {
                    events.push((time as u32, *height as f32));
                }
            }
            let times = [stretch.first, last].map(|step| channel.clock.time(step * self.step_fs));
            with_pulses.push((times[0], times[1]));
        }
        counts(self.linear.false_rate, channel, chance, &mut memory.noise);
        let mut busy = with_pulses.iter().peekable();
        for &time in &memory.noise {
            while busy.next_if(|(_, until)| *until < i64::from(time)).is_some() {}
            if busy.peek().is_none_or(|(from, _)| i64::from(time) < *from) {
                events.push((time, self.linear.threshold as f32));
            }
        }
        events.sort_unstable_by(|one, other| one.0.cmp(&other.0).then(other.1.total_cmp(&one.1)));
        found.time.extend(events.iter().map(|event| event.0));
        if self.measures {
            found.amplitude.extend(events.iter().map(|event| event.1));
        }
    }
}

/// The noise of a channel.
struct Noise<'a> {
    chance: &'a Chance,
    part: u32,
}

impl Noise<'_> {
    /// Fills the noise of `length` steps from the first one of `stretch` on, of variance 1.
    ///
    /// The independent numbers are the count of set bits among 64 random ones, less 32, over 4: their mean is
    /// 0, their variance 1 and their excess −1/32. The smoothing leaves a tenth of that.
    fn smooth(&self, stretch: &mut Stretch, length: usize, kernel: &[f32]) {
        let from = stretch.first - (kernel.len() / 2) as i64;
        let block = BLOCK as i64;
        let blocks =
            from.div_euclid(block)..=(from + (length + kernel.len()) as i64).div_euclid(block);
        stretch.white.clear();
        for index in blocks {
            let address = Address { stage: Stage::Amplifier, index: index as u64, part: self.part };
            let numbers = self.chance.draw(address, GROUP, &mut stretch.numbers);
            let (low, high) = numbers.split_at(BLOCK);
            let bits = low.iter().zip(high).map(|(low, high)| low.count_ones() + high.count_ones());
            stretch.white.extend(bits.take(BLOCK).map(|bits| (bits as f32 - 32.0) / 4.0));
        }
        let skipped = from.rem_euclid(block) as usize;
        stretch.noise.clear();
        stretch.noise.resize(length, 0.0);
        for (at, weight) in kernel.iter().enumerate() {
            let white = &stretch.white[skipped + at..skipped + at + length];
            for (noise, white) in stretch.noise.iter_mut().zip(white) {
                *noise += weight * white;
            }
        }
    }

    /// How late the input of the converters is with an event at `time_fs`, fs.
    fn late_fs(&self, time_fs: i64, jitter: f64) -> i64 {
        let index = time_fs as u64;
        let address = Address { stage: Stage::Comparator, index, part: self.part };
        let late: f64 = StandardNormal.sample(&mut self.chance.stream(address));
        fs_from_s(late * jitter)
    }
}

#[cfg(test)]
mod tests {
    use crate::channel::{Echo, light_of_echoes};
    use crate::design::Design;
    use crate::design::detector::Lit;
    use crate::detect::{Detectors, Memory};
    use crate::emit::{Band, bands};
    use crate::random::Chance;

    /// Shots of `marks` marks, `gap` chips of 0.1 ns apart, behind an amplifier with a response of 0.44 ns
    /// and the noise of 1 crossing a second.
    fn sensor(marks: u32, gap: u32, timing: &str) -> Design {
        let length = (marks - 1) * gap + 1;
        let text = format!(
            "version = 1\nextends = \"coded-practical\"\nname = \"mine\"\n\
             [light]\npulse_ps = 1.0\nenergy = {{ shot_nj = 1.0 }}\n[optics]\nfield = \"descanned\"\n\
             [code]\nchip_ps = 100.0\nword = {{ first = 0, modulus = 1 }}\n\
             family = {{ sparse = {{ length = {length}, weight = {marks}, words = 1, gap = {gap}, \
             seed = 1 }} }}\n\
             [detector.photodiode]\nbandwidth_mhz = 709.158\njitter_ps = 0.0\n\
             [comparator]\nfalse_alarm_hz = 1.0\ntiming = \"{timing}\"\n[tdc]\nresolution_ps = 6.25\nclock_ps = 100.0\n"
        );
        Design::from_toml(&text, "mine", std::path::Path::new(""), &[]).unwrap()
    }

    /// Times of the events of the first shots, ns after each was fired, each with an echo of `over` times the
    /// threshold at 500 ns.
    fn events(design: &Design, over: f64, shots: usize) -> Vec<Vec<f64>> {
        let noise = design.detector.model().noise(0.0).unwrap();
        let mut found = Vec::new();
        for shot in 0..shots {
            let log = Band { scan: 0, first: shot as u64 * 40, shots: 1 }.shot_log(design);
            let own = log.owned.start;
            let echo = Echo { shot: own, delay_fs: 500_000_000, photons: over * noise.threshold };
            let light = light_of_echoes(design, &log, std::iter::once(echo));
            let detectors = Detectors::in_the_dark(design, Chance::new(7));
            let events = detectors.detections(&log, &light, &mut Memory::default());
            let part = design.clock.tick_fs as f64 / f64::from(crate::design::PARTS_OF_TICK);
            let fired = (log.fired_at_fs[own] - events.epoch * design.clock.tick_fs) as f64;
            let ns = |time: &u32| (f64::from(*time) * part - fired) * 1e-6;
            found.push(events.time.iter().map(ns).collect());
        }
        found
    }

    /// Two pulses of ten thresholds each, of standard deviation s = 0.187 ns, fall below half of the
    /// threshold between them if they are s·√(8·ln 40) = 1.015 ns apart, or more.
    #[test]
    fn pulses_are_two_where_the_signal_falls_between_them() {
        let count = |gap: u32| -> usize {
            events(&sensor(2, gap, "constant-fraction"), 10.0, 50).iter().map(Vec::len).sum()
        };
        assert_eq!([count(8), count(13)], [50, 100]);
    }

    /// A leading edge is s·√(2·ln(A/T)) before the peak; a constant fraction is there whatever the
    /// amplitude. N = 200 pulses each; noise displaces the mean of them by less than 2 ps.
    #[test]
    fn a_leading_edge_walks_and_a_constant_fraction_does_not() {
        let rms = 0.44 / 1.0 * 0.424_66;
        let mean = |timing: &str, over: f64| -> f64 {
            let all = events(&sensor(1, 1, timing), over, 200).concat();
            assert_eq!(all.len(), 200);
            all.iter().sum::<f64>() / 200.0 - 500.0
        };
        for over in [4.0, 40.0, 4000.0] {
            let early = rms * (2.0 * f64::ln(over)).sqrt();
            let edge = mean("leading-edge", over) + early;
            assert!(edge.abs() < 4e-3, "{over}: {edge} ns");
            let fraction = mean("constant-fraction", over);
            assert!(fraction.abs() < 2e-3, "{over}: {fraction} ns");
            assert!(early > 0.3);
        }
    }

    /// N = 4000 pulses at each of four amplitudes about the threshold. The number of events is that of the
    /// closed form, to within 4 standard deviations. Their precision is as forecast, to within a tenth; at
    /// the threshold and below it may be 30 % worse. Controls: a tenth more light, and the precision at twice
    /// the amplitude.
    #[test]
    fn pulses_are_seen_and_timed_as_forecast() {
        let design = sensor(1, 1, "constant-fraction");
        let model = design.detector.model();
        let threshold = model.noise(0.0).unwrap().threshold;
        let lit = |over: f64| Lit { photons: over * threshold, background: 0.0, falling: 0.0 };
        for over in [0.9, 1.0, 1.15, 1.6] {
            let found = events(&design, over, 4000).concat();
            let share = found.len() as f64 / 4000.0;
            let deviation = |pd: f64| (share - pd).abs() / (pd * (1.0 - pd) / 4000.0).sqrt();
            let pd = model.mark_pd(&lit(over));
            assert!(deviation(pd) < 4.0, "{over}: {share}, forecast {pd}");
            if over < 1.5 {
                assert!(deviation(model.mark_pd(&lit(1.1 * over))) > 4.0);
            }
            let square: f64 = found.iter().map(|time| (time - 500.0).powi(2)).sum();
            let found = (square / found.len() as f64).sqrt() * 1e-9;
            let ratio = found / model.mark_jitter(&lit(over));
            // About the threshold the noise is no longer small, as the slope of the forecast has it.
            let most = if over < 1.1 { 1.3 } else { 1.1 };
            assert!((0.9..most).contains(&ratio), "{over}: {found} s, {ratio} times the forecast");
            let brighter = found / model.mark_jitter(&lit(2.0 * over));
            assert!(brighter > 1.2);
        }
    }

    /// The events of a band do not depend on the shots around it that are looked at as well.
    #[test]
    fn neighbouring_bands_see_the_same_events() {
        let design = Design::open("coded-practical", &[]).unwrap();
        let seen = |band: Band| {
            let log = band.shot_log(&design);
            let echo = |shot: usize| Echo { shot, delay_fs: 700_000_000, photons: 400.0 };
            let light = light_of_echoes(&design, &log, (0..log.len()).map(echo));
            let detectors = Detectors::in_the_dark(&design, Chance::new(3));
            let events = detectors.detections(&log, &light, &mut Memory::default());
            let parts = i64::from(crate::design::PARTS_OF_TICK);
            let absolute = |time: &u32| events.epoch * parts + i64::from(*time);
            events.time.iter().map(absolute).collect::<Vec<i64>>()
        };
        let first = bands(&design, 0).next().unwrap();
        let all = seen(first);
        let half = seen(Band { shots: first.shots / 2, ..first });
        let from = half[half.len() / 4];
        let until = half[half.len() / 2];
        let within = |times: &[i64]| -> Vec<i64> {
            times.iter().copied().filter(|time| (from..until).contains(time)).collect()
        };
        assert!(within(&half).len() > 1000);
        assert_eq!(within(&all), within(&half));
    }
}
