//! Light without pulses of other lidars, in the cycles of a burst.
//!
//! It adds its rate to every bin that it shines in. If its power is modulated, each cycle meets it at another
//! phase, and all cycles that it shines in whole are given the mean of them. The mean of the harmonic n is
//!
//! aₙ·D·sinc(n·f·b)·cos(2πn·f·t + φ), |D| = |sin(πn·f·I·M)/(M·sin(πn·f·I))|
//!
//! Here f is the modulation frequency, b the length of a bin, I the interval between the M pulses. D is 1 if
//! n·f·I is a whole number, and 1/M or so if it is not.

use std::f64::consts::{PI, TAU};

use macropulse_codec::decode::beat::sinc;

use crate::channel::{Stretch, Varies};
use crate::units::s_from_fs;

/// Harmonics that are weaker than this part of the mean are left out.
const FAINT: f64 = 1e-9;

/// Light that shines in the same part of each of some cycles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shining {
    /// First cycle and the one behind the last.
    pub cycles: [i64; 2],
    /// From when to when it shines, fs since the beginning of a cycle.
    within_fs: [i64; 2],
    /// Its stretch.
    light: Stretch,
    /// From the beginning of the stretch to that of the first cycle, fs.
    first_fs: i64,
    /// Time from cycle to cycle, fs.
    interval_fs: i64,
}

impl Shining {
    /// The light of `stretch` in the cycles of a burst of `pulses` that is fired at `fired_fs`: those that it meets in
    /// part, and those between them.
    pub fn of(stretch: &Stretch, fired_fs: i64, (interval_fs, pulses): (i64, u32)) -> Vec<Self> {
        let ends_fs = fired_fs + interval_fs * i64::from(pulses);
        let from = stretch.from_fs.max(fired_fs) - fired_fs;
        let until = stretch.until_fs.min(ends_fs) - fired_fs;
        if from >= until {
            return Vec::new();
        }
        let of = |cycles: [i64; 2], within_fs: [i64; 2]| Self {
            cycles,
            within_fs,
            light: *stretch,
            first_fs: fired_fs + cycles[0] * interval_fs - stretch.from_fs,
            interval_fs,
        };
        let (first, last) = (from / interval_fs, until / interval_fs);
        let (begins, ends) = (from % interval_fs, until % interval_fs);
        if first == last {
            return vec![of([first, first + 1], [begins, ends])];
        }
        let whole = if begins > 0 { first + 1 } else { first };
        let mut all = Vec::new();
        if begins > 0 {
            all.push(of([first, first + 1], [begins, interval_fs]));
        }
        if whole < last {
            all.push(of([whole, last], [0, interval_fs]));
        }
        if ends > 0 {
            all.push(of([last, last + 1], [0, ends]));
        }
        all
    }

    /// Adds the mean detections in each bin of `bin_fs` of a cycle to `rates`, with an `efficiency` of detections per
    /// photon.
    pub fn add(&self, rates: &mut [f64], bin_fs: i64, efficiency: f64) {
        let per_fs = self.light.per_s * efficiency * s_from_fs(1);
        let waves = self.waves(bin_fs);
        let [from, until] = self.within_fs;
        let end = usize::try_from(until.div_euclid(bin_fs) + 1).unwrap_or(0).min(rates.len());
        let first = usize::try_from(from / bin_fs).unwrap_or(0).min(end);
        for (bin, rate) in (first..end).zip(&mut rates[first..end]) {
            let begins = bin as i64 * bin_fs;
            let lit = (begins + bin_fs).min(until) - begins.max(from);
            let middle = s_from_fs(begins) + 0.5 * s_from_fs(bin_fs);
            let wave =
                |(hz, size, phase): &(f64, f64, f64)| size * libm::cos(TAU * hz * middle + phase);
            let power = 1.0 + waves.iter().map(wave).sum::<f64>();
            *rate += per_fs * lit.max(0) as f64 * power.max(0.0);
        }
    }

    /// The frequency, size and phase at the beginning of a cycle of each harmonic, the mean over all cycles.
    fn waves(&self, bin_fs: i64) -> Vec<(f64, f64, f64)> {
        let Varies::Power { hz, phase, wave } = self.light.varies else { return Vec::new() };
        let cycles = (self.cycles[1] - self.cycles[0]) as f64;
        let harmonic = |(number, size): (u32, f64)| {
            let number = f64::from(number);
            let hz = number * hz;
            // Turns from cycle to cycle, without whole ones.
            let turns = hz * s_from_fs(self.interval_fs);
            let turns = turns - turns.round();
            let sum = sinc(turns * cycles) / sinc(turns);
            let phase =
                number * phase + TAU * hz * s_from_fs(self.first_fs) + PI * turns * (cycles - 1.0);
            (hz, size * sum * sinc(hz * s_from_fs(bin_fs)), phase)
        };
        // Those of one period in a bin or more hardly show.
        let highest = (hz * s_from_fs(bin_fs)).recip();
        let harmonics = wave.harmonics_of_power(highest).map(harmonic);
        harmonics.filter(|(_, size, _)| size.abs() > FAINT).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Wave;
    use approx::assert_relative_eq;

    /// Light of both waves over 7 whole cycles and two in part: the mean of each cycle's own, by [`Varies::mean_power`],
    /// is what the bins get. Control: a phase that is off by a tenth of a turn is not.
    #[test]
    fn the_mean_over_cycles_is_that_of_each_of_them() {
        const BIN: i64 = 500_000;
        for (wave, hz) in [(Wave::Sine, 120e6), (Wave::Sine, 80.3e6), (Wave::Square, 31e6)] {
            let (interval, fired) = (100 * BIN, 7_000_000);
            let varies = Varies::Power { hz, phase: 0.4, wave };
            let stretch = Stretch {
                channel: 0,
                from_fs: fired + interval / 3,
                until_fs: fired + 8 * interval + interval / 5,
                per_s: 1e9,
                varies,
                address: 0,
            };
            let parts = Shining::of(&stretch, fired, (interval, 20));
            assert_eq!(
                parts.iter().map(|part| part.cycles).collect::<Vec<_>>(),
                [[0, 1], [1, 8], [8, 9]]
            );
            let error = |late: f64| {
                let mut most: f64 = 0.0;
                for part in &parts {
                    let mut rates = vec![0.0; 100];
                    part.add(&mut rates, BIN, 0.5);
                    for (bin, rate) in (0_i64..).zip(rates) {
                        let mean = (part.cycles[0]..part.cycles[1]).map(|cycle| {
                            let begins = fired + cycle * interval + bin * BIN;
                            let from = begins.max(stretch.from_fs);
                            let until = (begins + BIN).min(stretch.until_fs);
                            if until - from < BIN {
                                return None;
                            }
                            let since = |time: i64| s_from_fs(time - stretch.from_fs) + late;
                            Some(varies.mean_power(since(from), since(until)))
                        });
                        let Some(mean) = mean.collect::<Option<Vec<f64>>>() else { continue };
                        let mean = mean.iter().sum::<f64>() / mean.len() as f64;
                        most = most.max((rate / (0.5e9 * s_from_fs(BIN)) - mean).abs());
                    }
                }
                most
            };
            let within = if wave == Wave::Sine { 1e-6 } else { 0.06 };
            assert!(error(0.0) < within, "{wave:?} {hz}: {}", error(0.0));
            assert!(error(0.1 / hz) > within, "{wave:?} {hz}: {}", error(0.1 / hz));
        }
    }

    /// Light that shines for all of a burst, and light that misses it.
    #[test]
    fn light_is_cut_to_the_burst() {
        let stretch = |from_fs, until_fs| Stretch {
            channel: 0,
            from_fs,
            until_fs,
            per_s: 1e12,
            varies: Varies::Not,
            address: 0,
        };
        let all = Shining::of(&stretch(-50, 5000), 100, (1000, 3));
        assert_eq!(all.iter().map(|part| part.cycles).collect::<Vec<_>>(), [[0, 3]]);
        let mut rates = [0.0; 2];
        all[0].add(&mut rates, 300, 1.0);
        assert_relative_eq!(rates[1], 0.3, max_relative = 1e-9);
        assert!(Shining::of(&stretch(3100, 5000), 100, (1000, 3)).is_empty());
        let part = Shining::of(&stretch(700, 900), 100, (1000, 3));
        let mut rates = [0.0; 3];
        part[0].add(&mut rates, 300, 1.0);
        assert_eq!(part[0].cycles, [0, 1]);
        assert_relative_eq!(rates[2], 0.2, max_relative = 1e-9);
        assert_eq!(rates[1], 0.0);
    }
}
