//! A sampled detector: the sum of all light behind an amplifier, as codes.
//!
//! 1. The photons of each mark are drawn, Poisson, slice by slice of its pulse, and multiplied. With a gain
//!    of excess F, the sum of k of them is gamma-distributed with the mean k and the variance k·(F − 1).
//! 2. Each slice becomes what the amplifier makes of a photon. All add up, whoever sent them, with the stray
//!    light of the sensor's own marks.
//! 3. Noise of the amplifier and of steady light is added, normal with the covariance that both have behind
//!    the filter, and with the third cumulant that single photons give it.
//! 4. If that is more than the converter has codes for, the amplifier is at its limit. It stays there behind
//!    the pulse until it has recovered.
//! 5. An amplifier that is coupled by a capacitor lets through what is faster than its low cutoff: the
//!    baseline sinks with all light, and comes back ([`super::baseline`]).
//! 6. The converter rounds to its steps and stops at its limits.
//!
//! Steady light has no level of its own: the amplifier lets no direct current through
//! (docs/physics.md#photodiode-and-adc).

use std::ops::Range;

use macropulse_codec::{Samples, ShotLog};
use rand_distr::{Distribution, Gamma, Poisson, StandardNormal};

use super::baseline::Baseline;
use super::channel::{Arrangement, Channel};
use super::clock::Clock;
use super::colour::Colour;
use super::linear::{PLENTY, Together, gather};
use super::noise::PART_BITS;
use crate::channel::{Light, Stretch, Transmitter};
use crate::design::Design;
use crate::design::detector::Sampled;
use crate::kernels::rounded;
use crate::random::{Address, Chance, Stage, Stream};
use crate::units::{FS_PER_S, RMS_OF_FWHM, fs_from_s, s_from_fs};

/// Light of one shot this share of the response apart, or nearer, is one pulse.
const TOGETHER: f64 = 1.0 / 8.0;

/// Length of a slice of a pulse, in rms lengths of the pulse. A pulse is followed to three rms lengths. A
/// Gaussian in steps of σ/2 is as smooth as one without to 10⁻³⁰.
const SLICE: f64 = 0.5;
const SLICES: i32 = 6;
const ALL_SLICES: usize = 2 * SLICES as usize + 1;

/// Samples that are looked at together for one at the limit.
const CHUNK: usize = 256;

/// Pulses in a row up to this length, in rms lengths of one, are added together. Over a longer row exponentials leave the
/// range of numbers.
const WIDEST_ROW: f64 = 8.0;

/// The pulse of a photon is followed to where it is less than this share of a step of the converter.
const NEGLIGIBLE: f64 = 1.0 / 16.0;

/// A sampled detector at work.
#[derive(Debug)]
pub(super) struct Sampler {
    sampled: Sampled,
    colour: Colour,
    /// The baseline, if light moves it.
    baseline: Option<Baseline>,
    tick_fs: i64,
    /// The pulse that the amplifier makes of a photon.
    photon: Gaussian,
    /// Its height for a single one.
    height: f64,
    /// Share of the light in each slice of a pulse.
    shares: [f64; ALL_SLICES],
    /// Ticks before those wanted that are worked out, too.
    before: i64,
}

impl Sampler {
    pub fn new(sampled: &Sampled, design: &Design, background: f64) -> Self {
        let front_end = &sampled.front_end;
        let tick_fs = design.clock.tick_fs;
        let in_ticks = |time: f64| time * FS_PER_S as f64 / tick_fs as f64;
        let share = |slice: i32| libm::exp(-0.5 * (f64::from(slice) * SLICE).powi(2));
        let shares: [f64; ALL_SLICES] = std::array::from_fn(|slice| share(slice as i32 - SLICES));
        let total: f64 = shares.iter().sum();
        let colour = Colour::new(
            |apart| front_end.covariance(apart as f64 * s_from_fs(tick_fs), background),
            front_end.third_cumulant(background),
        );
        // A clipped pulse of before may still hold the amplifier.
        let before = in_ticks(sampled.lingers());
        Self {
            sampled: *sampled,
            colour,
            baseline: Baseline::of(sampled),
            tick_fs,
            photon: Gaussian::new(in_ticks(front_end.photon_rms())),
            height: front_end.photon_height(),
            shares: shares.map(|share| share / total),
            before: before.ceil() as i64,
        }
    }

    /// The samples of all channels in `span`, absolute ticks.
    pub fn samples(
        &self,
        (design, chance): (&Design, &Chance),
        (log, light): (&ShotLog, &Light),
        span: &Range<i64>,
    ) -> Samples {
        let mut samples = Samples { epoch: span.start, ..Samples::default() };
        let Some(first) = log.fired_at_fs.first() else { return samples };
        let clock = Clock::new(design, *first);
        let mut arrangement = Arrangement::default();
        arrangement.fill(design, &clock, log, light);
        let known = self.baseline.as_ref().map_or(span.start, |it| it.begins(span.start));
        let worked_out = known - self.before..span.end;
        let mut signal = Signal::default();
        for channel in arrangement.channels(design, clock, log, light) {
            signal.begin(&worked_out);
            self.add_light(&channel, chance, &mut signal);
            self.add_stray(&channel, &mut signal);
            self.add_stretches(&channel, chance, &mut signal);
            let part = u32::from(channel.number) << PART_BITS;
            self.colour.add((chance, part), signal.first, &mut signal.level);
            samples.channel.push(channel.number);
            self.limit(&mut signal.level, &mut signal.codes);
            let skipped = (span.start - signal.first) as usize;
            match &self.baseline {
                Some(baseline) => {
                    baseline.take_from(&mut signal.level[self.before as usize..], known);
                    self.convert(&signal.level[skipped..], &mut samples.code);
                }
                None => samples.code.extend_from_slice(&signal.codes[skipped..]),
            }
        }
        samples
    }

    fn add_light(&self, channel: &Channel, chance: &Chance, signal: &mut Signal) {
        let within_fs = fs_from_s(self.sampled.front_end.mark_rms() / RMS_OF_FWHM * TOGETHER);
        let slices = |transmitter: &Transmitter| {
            let slice_fs = transmitter.pulse * RMS_OF_FWHM * SLICE * FS_PER_S as f64;
            (slice_fs, self.row(self.photon, slice_fs / self.tick_fs as f64, self.height))
        };
        let slices: Vec<(f64, Row)> = channel.light.transmitters.iter().map(slices).collect();
        for Together { train, later_fs, photons } in gather(channel, within_fs) {
            let trains = &channel.light.trains;
            let mut stream = chance.at(Stage::Photons, trains.address(train));
            let (slice_fs, row) = &slices[usize::from(trains.transmitter[train])];
            for mark_fs in channel.light.arrivals_fs(train) {
                let late: f64 = StandardNormal.sample(&mut stream);
                let at_fs = mark_fs + later_fs + fs_from_s(late * self.sampled.jitter);
                let charges =
                    self.shares.map(|share| self.multiplied(photons * share, &mut stream));
                let in_a_row = row.weights.len();
                for (first, charges) in (-SLICES..).step_by(in_a_row).zip(charges.chunks(in_a_row))
                {
                    let first_fs = at_fs + (f64::from(first) * slice_fs) as i64;
                    signal.add(self.in_ticks(first_fs), charges, row);
                }
            }
        }
    }

    /// Adds the stray light of own marks. It is bright enough that its photons need not be drawn.
    fn add_stray(&self, channel: &Channel, signal: &mut Signal) {
        let codebook = &channel.design.emission.coding().codebook;
        let front_end = &self.sampled.front_end;
        let pulse = Gaussian::new(front_end.mark_rms() / s_from_fs(self.tick_fs));
        let stray = self.row(pulse, 0.0, self.sampled.stray);
        for shot in channel.shots.iter().map(|shot| *shot as usize) {
            let (label, word) = (channel.log.label[shot], channel.log.word[shot]);
            for mark in codebook.marks(label, word) {
                let at_fs = channel.log.fired_at_fs[shot]
                    + i64::from(*mark) * channel.design.emission.coding().chip_fs;
                signal.add(self.in_ticks(at_fs), &[1.0], &stray);
            }
        }
    }

    /// Light without pulses that lasts for stretches of time, tick by tick.
    fn add_stretches(&self, channel: &Channel, chance: &Chance, signal: &mut Signal) {
        let Some((number, _)) = channel.stretches.first() else { return };
        let tick = s_from_fs(self.tick_fs);
        let mut photons = vec![0.0; signal.level.len()];
        let last = signal.first + signal.level.len() as i64;
        for (_, stretch) in channel.stretches {
            let Stretch { from_fs, until_fs, varies, .. } =
                channel.light.background.at(*stretch as usize);
            let [from, until] = [from_fs, until_fs].map(|fs| fs.div_euclid(self.tick_fs));
            let per_tick = channel.steady_in(*stretch as usize) * tick;
            for tick in from.max(signal.first)..until.min(last) {
                let since = |tick: i64| s_from_fs(tick * self.tick_fs - from_fs);
                let power = varies.mean_power(since(tick), since(tick + 1));
                photons[(tick - signal.first) as usize] += per_tick * power;
            }
        }
        let photon = self.row(self.photon, 0.0, self.height);
        for (tick, photons) in (signal.first..).zip(photons).filter(|(_, photons)| *photons > 0.0) {
            let part = u32::from(*number) << PART_BITS;
            let address = Address { stage: Stage::Stretch, index: tick as u64, part };
            let charge = self.multiplied(photons, &mut chance.stream(address));
            let middle_fs = tick * self.tick_fs + self.tick_fs / 2;
            signal.add(self.in_ticks(middle_fs), &[charge], &photon);
        }
    }

    /// Draws the photons at a mean of `photons`, and returns them multiplied.
    fn multiplied(&self, photons: f64, stream: &mut Stream) -> f64 {
        let Ok(poisson) = Poisson::new(photons.min(PLENTY)) else { return 0.0 };
        let count: f64 = poisson.sample(stream);
        let spread = self.sampled.front_end.excess() - 1.0;
        if count <= 0.0 || spread <= 1e-9 {
            return count;
        }
        Gamma::new(count / spread, spread).map_or(count, |gamma| gamma.sample(stream))
    }

    /// Pulses of this shape and `height`, this many ticks `apart`.
    fn row(&self, pulse: Gaussian, apart: f64, height: f64) -> Row {
        Row::new(pulse, apart, height, NEGLIGIBLE * self.sampled.step)
    }

    /// Absolute ticks, whole ones and the rest, at `time_fs`.
    fn in_ticks(&self, time_fs: i64) -> (i64, f64) {
        let tick = time_fs.div_euclid(self.tick_fs);
        (tick, (time_fs - tick * self.tick_fs) as f64 / self.tick_fs as f64)
    }

    /// Holds the signal at the limit where it is more than the converter has codes for, and behind that until
    /// the amplifier has recovered. Its `codes` are put in place of what was there.
    fn limit(&self, level: &mut [f32], codes: &mut Vec<i16>) {
        let (recovery, limit) = (self.sampled.held_ticks(), self.sampled.limit() as f32);
        let highest = self.sampled.codes.1;
        codes.clear();
        self.convert(&[limit], codes);
        let code_of_limit = codes[0];
        codes.clear();
        self.convert(level, codes);
        let mut held = 0;
        for (level, codes) in level.chunks_mut(CHUNK).zip(codes.chunks_mut(CHUNK)) {
            // Without an exit, so that it is quick.
            let is_clear = !codes.iter().fold(false, |any, code| any | (*code == highest));
            if is_clear && held == 0 {
                continue;
            }
            for (level, code) in level.iter_mut().zip(codes) {
                let is_held = held > 0;
                let is_clipped = *code == highest;
                held = if is_clipped { recovery } else { held.saturating_sub(1) };
                if is_clipped || is_held {
                    (*level, *code) = (limit, code_of_limit);
                }
            }
        }
    }

    /// Appends the codes of a signal.
    fn convert(&self, level: &[f32], codes: &mut Vec<i16>) {
        let known = codes.len();
        codes.resize(known + level.len(), 0);
        let between = [self.sampled.codes.0, self.sampled.codes.1].map(f32::from);
        rounded(level, (1.0 / self.sampled.step) as f32, between, &mut codes[known..]);
    }
}

/// The shape of a pulse.
#[derive(Debug, Clone, Copy)]
struct Gaussian {
    /// rms length, ticks.
    rms: f64,
    /// From tick to tick it grows by a ratio that shrinks by this one.
    shrinks: f64,
}

impl Gaussian {
    fn new(rms: f64) -> Self {
        Self { rms, shrinks: libm::exp(-(rms * rms).recip()) }
    }
}

/// Pulses of one shape at even distances Δ, a Gaussian of rms length r. Multiplied by cⱼ, they are added up at little
/// cost:
///
/// > Σ cⱼ·exp(−(x − jΔ)²/2r²) = exp(−x²/2r²)·Σ cⱼ·exp(−j²Δ²/2r²)·uʲ, u = exp(xΔ/r²),
///
/// a polynomial in u, which grows by the same ratio from tick to tick.
#[derive(Debug)]
struct Row {
    pulse: Gaussian,
    /// Ticks from pulse to pulse, Δ.
    apart: f64,
    /// From tick to tick u grows by this ratio, exp(Δ/r²).
    grows: f64,
    /// Height of a pulse, times exp(−j²Δ²/2r²), for each one of those that are added together.
    weights: Vec<f64>,
    /// A pulse is followed to this height.
    negligible: f64,
}

impl Row {
    fn new(pulse: Gaussian, apart: f64, height: f64, negligible: f64) -> Self {
        let rms = pulse.rms;
        let together = (WIDEST_ROW * rms / apart).min(ALL_SLICES as f64 - 1.0) as usize + 1;
        let weight = |pulse: usize| height * libm::exp(-0.5 * (pulse as f64 * apart / rms).powi(2));
        Self {
            pulse,
            apart,
            grows: libm::exp(apart / (rms * rms)),
            weights: (0..together).map(weight).collect(),
            negligible,
        }
    }
}

/// The signal of one channel in ticks, in detected photons.
#[derive(Debug, Default)]
struct Signal {
    /// The absolute tick of the first one.
    first: i64,
    level: Vec<f32>,
    /// Its codes.
    codes: Vec<i16>,
}

impl Signal {
    fn begin(&mut self, span: &Range<i64>) {
        self.first = span.start;
        self.level.clear();
        self.level.resize((span.end - span.start).max(0) as usize, 0.0);
    }

    /// Adds the pulses of a `row`, multiplied by these `factors`, to where they are negligible. The first one comes
    /// at `tick` and `part` of a tick.
    fn add(&mut self, (tick, part): (i64, f64), factors: &[f64], row: &Row) {
        let Gaussian { rms, shrinks } = row.pulse;
        let highest = factors.iter().copied().fold(0.0, f64::max);
        if highest <= 0.0 {
            return;
        }
        let over = (highest * row.weights[0] / row.negligible).max(1.0);
        let reach = ((2.0 * libm::log(over)).sqrt() * rms) as i64 + 1;
        let last = tick + (part + (factors.len() - 1) as f64 * row.apart) as i64;
        let (from, to) = (tick - reach - self.first, last + reach + 1 - self.first);
        let to = to.min(self.level.len() as i64 - 1);
        if to < 0 {
            return;
        }
        let mut terms = [0.0; ALL_SLICES];
        for (term, (factor, weight)) in terms.iter_mut().zip(factors.iter().zip(&row.weights)) {
            *term = factor * weight;
        }
        // The part before the span is worked out, too: the rest is then the same to the last bit, wherever a
        // span begins.
        let at = ((from + self.first - tick) as f64 - part) / rms;
        let mut value = libm::exp(-at * at / 2.0);
        let mut grows = libm::exp(-(at + 0.5 / rms) / rms);
        let mut along = libm::exp(at * row.apart / rms);
        for place in from..=to {
            if let Ok(place) = usize::try_from(place) {
                let sum =
                    terms[..factors.len()].iter().rev().fold(0.0, |sum, term| sum * along + term);
                self.level[place] += (value * sum) as f32;
            }
            value *= grows;
            grows *= shrinks;
            along *= row.grows;
        }
    }
}

#[cfg(test)]
mod tests {
    use macropulse_codec::level::forced::at_each_level;

    use super::*;

    /// At every tick a row is the sum of its pulses, however far apart they are, but for what is negligible.
    #[test]
    fn a_row_is_the_sum_of_its_pulses() {
        let shapes = [(1.5, 0.2), (1.5, 1.0), (4.0, 3.0), (0.6, 5.0), (0.3, 20.0), (40.0, 40.0)];
        for ((rms, apart), together) in shapes.into_iter().zip([13, 13, 11, 1, 1, 9]) {
            let row = Row::new(Gaussian::new(rms), apart, 2.0, 1e-7);
            assert_eq!(row.weights.len(), together);
            let factors: Vec<f64> = (0..together).map(|pulse| (pulse * 7 % 5 + 1) as f64).collect();
            let mut signal = Signal::default();
            signal.begin(&(-400..900));
            signal.add((3, 0.4), &factors, &row);
            for (tick, level) in (-400..900).zip(&signal.level) {
                let at = |pulse: usize| (f64::from(tick) - 3.4 - pulse as f64 * apart) / rms;
                let pulses = factors.iter().enumerate();
                let expected: f64 = pulses
                    .map(|(pulse, factor)| 2.0 * factor * libm::exp(-0.5 * at(pulse).powi(2)))
                    .sum();
                assert!((f64::from(*level) - expected).abs() < 2e-6 * expected + 2e-6);
            }
        }
    }

    /// Halves go to the even code, and what is beyond the codes to the last one.
    #[test]
    fn every_level_rounds_the_same() {
        let level = [-9.0, -1.25, -0.75, -0.5, -0.2, 0.0, 0.25, 0.26, 0.75, 1.25, 3.9, 4.0, 1e9];
        let expected = [-4, -2, -2, -1, 0, 0, 0, 1, 2, 2, 7, 7, 7];
        for (at, codes) in at_each_level(|| {
            let mut codes = [0; 13];
            rounded(&level, 2.0, [-4.0, 7.0], &mut codes);
            codes
        }) {
            assert_eq!(codes, expected, "{at:?}");
        }
    }
}
