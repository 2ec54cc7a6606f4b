//! Single-stop timing, a detector that fires once per shot: the simulation steps of
//! \[KP16 Fig. 7\], after \[OF05\].
//!
//! 1. Each echo of mean energy n (photons) gets white noise: n' = n + a·g, g standard normal.
//! 2. Its light is spread over a Gaussian pulse of rms length σ, so that Λ(t) = n'·Φ((t − t₀)/σ)
//!    photons are expected up to t. With m photons needed, the detector has fired by t with
//!    probability F(t) = P(Γ_m ≤ Λ(t)), Γ_m the sum of m unit exponentials. For m = 1 this is the
//!    1 − exp(−Λ(t)) of a Geiger detector.
//! 3. Monte Carlo: draw Γ_m; no firing if Γ_m > n', else t = t₀ + σ·Φ⁻¹(Γ_m / n').
//! 4. False firings are Poisson in time. The earliest firing wins, whatever its light is: an echo of
//!    this shot, one of an earlier shot from beyond the gate, an interferer.
//!    An interferer's marks that come within one micropulse of the detector's own are one flash, in
//!    the middle of them. Sunlight fires a detector of one photon as false firings do; to one of
//!    more it is noise ([`SingleStopSetting`]).
//! 5. A Gaussian sample of the temporal response is added.
//! 6. If m > 1 the detector measures the amplitude, the photons of the whole pulse: the m that fired
//!    it and those that come later, k = m + Poisson(n' − Γ_m).
//! 7. The firing runs ahead of the middle of the pulse the more the stronger the echo is. If k photons come
//!    at normal times, the m-th one comes σ·E(Z_m:k) after the middle on average. Here Z_m:k is the m-th
//!    smallest of k standard normal variables ([`normal_order`]). This walk follows from m, k and the length
//!    of the pulse. The sensor knows all of them, and the walk is taken off. The converter quantises.
//!
//! \[KP16\] mixes two kinds of detector here: additive Gaussian noise belongs to a linear-mode receiver, the
//! cumulative firing probability to a Geiger-mode one. With m ≫ 1 the threshold of a linear receiver is
//! meant, with m = 1 the Geiger detector. A Geiger detector cannot tell how many photons follow the first. So
//! it measures no amplitude, and its walk stays in its ranges.

use std::ops::RangeInclusive;

use macropulse_codec::statistics::{normal_order, normal_quantile, normal_tail};
use rand_distr::{Distribution, Exp1, Gamma, Poisson, StandardNormal};

use super::channel::Channel;
use super::noise::{Drawn, stretches};
use super::{Detections, Kind, Memory};
use crate::design::detector::{PLENTY, SingleStopSetting};
use crate::random::{Chance, Stage, Stream};
use crate::units::{FS_PER_S, RMS_OF_FWHM, fs_from_s, tof_from_range};

/// Light that the detector adds up: marks of one pulse train within one micropulse of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Flash {
    /// Absolute time of the middle of the marks, fs.
    arrives_fs: i64,
    photons: f64,
}

/// A firing.
#[derive(Debug, Clone, Copy)]
struct Fired {
    /// Absolute time, fs.
    time_fs: i64,
    /// Photons expected after it of the flash that fired the detector; `None` if it fired by itself.
    follow: Option<f64>,
}

impl Kind for SingleStopSetting {
    fn measures(&self) -> bool {
        SingleStopSetting::measures(self)
    }

    /// For each shot, while its gate is open, the earliest firing.
    fn add(&self, channel: &Channel, chance: &Chance, found: &mut Detections, _: &mut Memory) {
        let &Channel { clock, design, log, .. } = channel;
        let scan = &design.scan;
        let [opens, closes] =
            [scan.min_range, scan.max_range].map(|range| fs_from_s(tof_from_range(range)));
        let Some(flash) = Firing::of(self, channel) else { return };
        let flashes = flashes(channel);
        let mut events: Vec<(u32, f32)> = Vec::with_capacity(channel.shots.len());
        for &shot in &channel.shots {
            let fired_fs = log.fired_at_fs[shot as usize];
            let gate = fired_fs + opens..=fired_fs + closes;
            let mut stream = chance.at(Stage::Firing, log.first + u64::from(shot));
            let mut earliest = flash.by_itself(&gate, &mut stream);
            // Light that arrives just before the gate opens may fire the detector just after.
            let early_fs = fs_from_s(design.light.pulse);
            let first =
                flashes.partition_point(|flash| flash.arrives_fs < *gate.start() - early_fs);
            let open = flashes[first..].iter().take_while(|flash| flash.arrives_fs <= *gate.end());
            for candidate in open {
                if let Some(fired) = flash.fires(candidate, *gate.start(), &mut stream)
                    && earliest.is_none_or(|earliest| fired.time_fs < earliest.time_fs)
                {
                    earliest = Some(fired);
                }
            }
            if let Some(fired) = earliest {
                let response: f64 = StandardNormal.sample(&mut stream);
                let photons = flash.measures(fired, &mut stream);
                let walk_fs = if fired.follow.is_some() { flash.walk_fs(photons) } else { 0 };
                // A detector that hardly ever fires by itself does so after the end of time.
                let late_fs = fs_from_s(response * self.jitter) - walk_fs;
                let time_fs = fired.time_fs.saturating_add(late_fs);
                if gate.contains(&time_fs) {
                    events.push((clock.time(time_fs) as u32, photons as f32));
                }
            }
        }
        events.sort_by_key(|event| event.0);
        found.time.extend(events.iter().map(|event| event.0));
        if self.measures() {
            found.amplitude.extend(events.iter().map(|event| event.1));
        }
    }
}

/// How the detector fires.
struct Firing<'a> {
    firing: &'a SingleStopSetting,
    /// Photons needed, and their sum of unit exponentials.
    needed: f64,
    gamma: Gamma<f64>,
    /// rms length of a micropulse, fs.
    rms_fs: f64,
    /// Background that fires it as false firings do. A detector that needs more photons than one adds them
    /// up: to it, background is noise.
    stretches: Vec<Drawn>,
}

impl<'a> Firing<'a> {
    fn of(firing: &'a SingleStopSetting, channel: &Channel) -> Option<Self> {
        let needed = f64::from(firing.needed);
        let gamma = Gamma::new(needed, 1.0).ok()?;
        let rms_fs = channel.design.light.pulse * RMS_OF_FWHM * FS_PER_S as f64;
        let stretches = if firing.needed == 1 { stretches(channel).collect() } else { Vec::new() };
        Some(Self { firing, needed, gamma, rms_fs, stretches })
    }

    /// When it fires in the light of a flash, its gate being open from `opens` fs on; `None` if it does
    /// not. Photons that come before that fire no Geiger cell; the gate of an amplifier is one of
    /// ranges, which are known behind it.
    fn fires(&self, flash: &Flash, opens: i64, stream: &mut Stream) -> Option<Fired> {
        let noise: f64 = StandardNormal.sample(stream);
        let photons = (flash.photons.min(PLENTY) + self.firing.noise * noise).max(0.0);
        let drawn: f64 = self.gamma.sample(stream);
        let before = match self.firing.measures() {
            true => 0.0,
            false => normal_tail((flash.arrives_fs - opens) as f64 / self.rms_fs),
        };
        let draw = drawn + photons * before;
        (draw < photons).then(|| {
            let late = self.rms_fs * normal_quantile(draw / photons);
            let time_fs = flash.arrives_fs + late.round() as i64;
            Fired { time_fs, follow: Some(photons - draw) }
        })
    }

    /// The photons of the pulse that fired it: those needed, and those that follow.
    fn measures(&self, fired: Fired, stream: &mut Stream) -> f64 {
        let follow = fired.follow.and_then(|photons| Poisson::new(photons).ok());
        self.needed + follow.map_or(0.0, |follow| follow.sample(stream))
    }

    /// Returns the mean delay of a firing behind the middle of a pulse of `photons`, fs; 0 if it cannot
    /// measure them.
    fn walk_fs(&self, photons: f64) -> i64 {
        match self.firing.measures() {
            true => (self.rms_fs * normal_order(self.needed, photons).0).round() as i64,
            false => 0,
        }
    }

    /// When it first fires without a pulse while `gate` is open. Firings are as frequent at all times,
    /// and to take a walk off them would change nothing.
    fn by_itself(&self, gate: &RangeInclusive<i64>, stream: &mut Stream) -> Option<Fired> {
        let rate = self.firing.false_rate;
        let steady = (rate > 0.0).then(|| {
            let wait: f64 = Exp1.sample(stream);
            gate.start().saturating_add((wait / rate * FS_PER_S as f64) as i64)
        });
        let others = self.stretches.iter().filter_map(|stretch| {
            let from_fs = stretch.light.from_fs.max(*gate.start());
            let until_fs = stretch.light.until_fs.min(*gate.end());
            (from_fs < until_fs).then(|| stretch.first(from_fs, until_fs, stream))?
        });
        let time_fs = others.chain(steady).min()?;
        Some(Fired { time_fs, follow: None })
    }
}

/// The flashes that the pulse trains of a channel make, in the order of time.
fn flashes(channel: &Channel) -> Vec<Flash> {
    let pulse_fs = fs_from_s(channel.design.light.pulse);
    let trains = &channel.light.trains;
    let mut flashes = Vec::new();
    let mut marks_fs: Vec<i64> = Vec::new();
    for arrival in channel.order.iter() {
        let index = *arrival as u32 as usize;
        let begins = trains.arrives_fs[index];
        marks_fs.clear();
        marks_fs.extend(channel.light.arrivals_fs(index));
        let is_with =
            |one: &i64, next: &i64| (one - begins) / pulse_fs == (next - begins) / pulse_fs;
        for marks in marks_fs.chunk_by(is_with) {
            flashes.push(Flash {
                arrives_fs: marks[0] + (marks[marks.len() - 1] - marks[0]) / 2,
                photons: channel.detected(index) * marks.len() as f64,
            });
        }
    }
    if !flashes.is_sorted_by_key(|flash| flash.arrives_fs) {
        flashes.sort_by_key(|flash| flash.arrives_fs);
    }
    flashes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::{Echo, Light, PulseTrain, Transmitter, light_of_echoes};
    use crate::design::Design;
    use macropulse_codec::ShotLog;

    /// Returns the events of shots that all have an echo of `photons`. They are those of the first nine
    /// bands, or of all that the sensor has.
    fn run(design: &Design, photons: f64, seed: u64) -> Vec<(ShotLog, Detections)> {
        let detectors = super::super::Detectors::in_the_dark(design, Chance::new(seed));
        let bands = crate::emit::bands(design, 0).take(9);
        bands
            .map(|band| {
                let log = band.shot_log(design);
                let echo = |shot| Echo { shot, delay_fs: 400_000_000, photons };
                let light = light_of_echoes(design, &log, (0..log.len()).map(echo));
                let found =
                    detectors.detections(&log, &light, &mut super::super::Memory::default());
                (log, found)
            })
            .collect()
    }

    fn set(name: &str, keys: &[(&str, &str)]) -> Design {
        let keys: Vec<(String, String)> = keys
            .iter()
            .map(|(key, value)| (format!("detector.single-stop.{key}"), (*value).to_owned()))
            .collect();
        Design::open(name, &keys).unwrap()
    }

    /// H0: the reference target is detected with the Pd declared. N = 4096 + 8640 shots, seed 5,
    /// α = 1e-5 (|z| < 4.4); the Gaussian approximation of Γ_m is granted 0.004.
    #[test]
    fn the_reference_target_is_seen_with_its_pd() {
        for (name, keys) in [
            ("hdl-64e", &[("sensitivity.pd", "0.9"), ("false_firing_hz", "0")][..]),
            ("peregrine", &[("sensitivity.pd", "0.9"), ("false_firing_hz", "0")][..]),
        ] {
            let design = set(name, keys);
            let z = |scale: f64| {
                let photons = design.derived().reference_photons * scale;
                let bands = run(&design, photons, 5);
                let n = bands.iter().map(|(log, _)| log.len()).sum::<usize>() as f64;
                let seen = bands.iter().map(|(_, found)| found.time.len()).sum::<usize>() as f64;
                let off = (seen / n - 0.9).abs() - 0.004;
                off / (0.09 / n).sqrt()
            };
            assert!(z(1.0) < 4.4, "{name}: {}", z(1.0));
            assert!(z(1.06) > 4.4, "{name}: the control was not rejected");
        }
    }

    #[test]
    fn the_velodyne_is_good_to_two_centimetres_on_a_strong_echo() {
        let design = set("hdl-64e", &[("false_firing_hz", "0")]);
        let bands = run(&design, 3000.0, 9);
        let errors: Vec<f64> = bands
            .iter()
            .flat_map(|(log, found)| -> Vec<i64> {
                let fs =
                    |time: &u32| (64 * found.epoch + i64::from(*time)) * design.clock.tick_fs / 64;
                let times = found.time.iter().map(fs).zip(&found.channel);
                times
                    .filter_map(|(time, channel)| {
                        let shots = (0..log.len()).filter(|&s| log.channel[s] == *channel);
                        shots
                            .map(|s| time - log.fired_at_fs[s] - 400_000_000)
                            .min_by_key(|e| e.abs())
                    })
                    .collect()
            })
            .map(|fs| crate::units::range_from_tof(fs as f64 * 1e-15))
            .collect();
        let n = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / n;
        let sigma = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
        assert!(mean.abs() < 0.005, "bias {mean}");
        assert!(sigma < 0.02 && sigma > 0.001, "σ {sigma}");
    }

    /// How late the first event of each shot is, rms lengths of the pulse, and all amplitudes.
    fn late(design: &Design, photons: f64, seed: u64) -> (Vec<f64>, Vec<f32>) {
        let rms = design.light.pulse * RMS_OF_FWHM * FS_PER_S as f64;
        let (mut late, mut amplitudes) = (Vec::new(), Vec::new());
        for (log, found) in run(design, photons, seed) {
            let parts = (found.time.iter()).map(|time| 64 * found.epoch + i64::from(*time));
            for (parts, channel) in parts.zip(&found.channel) {
                let shot = log.channel.iter().position(|other| other == channel).unwrap();
                let time_fs = parts as f64 / 64.0 * design.clock.tick_fs as f64;
                late.push((time_fs - log.fired_at_fs[shot] as f64 - 4e8) / rms);
            }
            amplitudes.extend(found.amplitude);
        }
        (late, amplitudes)
    }

    /// The first of a hundred photons comes 2.5076 rms lengths before the middle on average, with a
    /// standard deviation of 0.4294 \[DJ54\]; a hundred that are Poisson, 0.002 later. H0: so do the
    /// firings of a Geiger detector, which knows no more. N = 4096 shots, seed 6, α = 1e-5 (|z| < 4.4).
    /// Control: those of 130 photons are rejected.
    #[test]
    fn the_walk_of_a_first_photon_stays() {
        let keys = [("firing_photons", "1"), ("noise_photons", "0"), ("jitter_ps", "0")];
        let design = set("peregrine", &[&keys[..], &[("false_firing_hz", "0")]].concat());
        let z = |photons| {
            let (late, amplitudes) = late(&design, photons, 6);
            assert!(late.len() == 4096 && amplitudes.is_empty());
            let mean = late.iter().sum::<f64>() / 4096.0;
            (mean + 2.5056).abs() / (0.4294 / 64.0)
        };
        assert!(z(100.0) < 4.4, "{}", z(100.0));
        assert!(z(130.0) > 4.4, "the control was not rejected");
    }

    /// H0: the amplitude is the energy of the echo with its shot noise and that of the amplifier, of
    /// variance n + a², whatever the detector fires at. N = 4096 shots, n = 500, a = 10, seed 6,
    /// α = 1e-5 each (|z| < 4.4). Control: the noise of the amplifier alone is rejected.
    #[test]
    fn the_amplitude_has_the_noise_of_its_photons() {
        let design = set("peregrine", &[("false_firing_hz", "0")]);
        let (_, amplitudes) = late(&design, 500.0, 6);
        assert_eq!(amplitudes.len(), 4096);
        let moment = |of: &dyn Fn(f64) -> f64| {
            amplitudes.iter().map(|amplitude| of(f64::from(*amplitude))).sum::<f64>() / 4096.0
        };
        let mean = moment(&|amplitude| amplitude);
        let variance = moment(&|amplitude| (amplitude - mean).powi(2));
        let z = |expected: f64| (variance / expected - 1.0).abs() / (2.0_f64 / 4096.0).sqrt();
        assert!((mean - 500.0).abs() / (600.0_f64 / 4096.0).sqrt() < 4.4, "{mean}");
        assert!(z(600.0) < 4.4, "{variance}");
        assert!(z(100.0) > 4.4, "the control was not rejected");
    }

    #[test]
    fn nothing_comes_from_nothing() {
        let design = set("peregrine", &[("false_firing_hz", "0")]);
        assert!(run(&design, 0.0, 1).iter().all(|(_, found)| found.time.is_empty()));
    }

    /// A macropulse of 27 ns falls on a detector that adds up over 5 ns: six flashes at most, with
    /// all its photons.
    #[test]
    fn marks_within_a_micropulse_are_one_flash() {
        let design = Design::open("hdl-64e", &[]).unwrap();
        let coded = Design::open("kim-park-2016-fixed", &[]).unwrap();
        let log = crate::emit::Band { scan: 0, first: 0, shots: 64 }.shot_log(&design);
        let transmitters = vec![Transmitter::of(&design, 1.0), Transmitter::of(&coded, 1.0)];
        let mut light = Light { transmitters, ..Light::default() };
        let arrives_fs = log.fired_at_fs[5] + 300_000_000;
        light.trains.push(PulseTrain {
            transmitter: 1,
            channel: log.channel[5],
            arrives_fs,
            photons: 2.0,
            label: 5,
            word: 3,
            marks: crate::channel::ALL_MARKS,
            shot: 0,
            way: 0,
        });
        let clock = super::super::clock::Clock::new(&design, log.fired_at_fs[0]);
        let mut arrangement = super::super::channel::Arrangement::default();
        arrangement.fill(&design, &clock, &log, &light);
        let marks = light.marks(0).len() as f64;
        let mut seen = 0;
        for channel in arrangement.channels(&design, clock, &log, &light) {
            let flashes = flashes(&channel);
            if channel.number != log.channel[5] {
                assert!(flashes.is_empty());
                continue;
            }
            seen += 1;
            assert!((2..=6).contains(&flashes.len()), "{}", flashes.len());
            assert_eq!(flashes.iter().map(|flash| flash.photons).sum::<f64>(), 2.0 * marks);
            assert!(flashes.is_sorted_by_key(|flash| flash.arrives_fs));
            assert!(flashes.iter().all(|flash| flash.arrives_fs >= arrives_fs));
        }
        assert_eq!(seen, 1);
    }

    /// Light from beyond the gate of one shot fires the detector in the gate of the next: the second time
    /// around. Control: with more time between the shots it does not.
    #[test]
    fn light_of_an_earlier_shot_fires_the_detector_again() {
        let open = |rate: &str| {
            let text = "version = 1\nextends = \"hdl-64e\"\nname = \"mine\"\n\
                        [scan]\nmax_range_m = 100.0\ngate_beyond_m = 0.0\n\
                        [scan.raster]\nrows = 10\ncolumns = 100\nhorizontal_deg = 10.0\n\
                        vertical_deg = 1.0\n[detector.single-stop]\nfalse_firing_hz = 0.0\n";
            let set = [("scan.scans_per_s".to_owned(), rate.to_owned())];
            Design::from_toml(text, "mine", std::path::Path::new(""), &set).unwrap()
        };
        // The light of the last of the ten fires the detector in the gate of a guard shot.
        for (rate, expected) in [("1000", 10), ("500", 0)] {
            let design = open(rate);
            let log = crate::emit::Band { scan: 0, first: 0, shots: 10 }.shot_log(&design);
            // 165 m away: 1.1 µs. Shots follow each other after 1 µs, or after 2 µs.
            let echo = |shot| Echo { shot, delay_fs: 1_100_000_000, photons: 1e6 };
            let light = light_of_echoes(&design, &log, (0..10).map(echo));
            let detectors = super::super::Detectors::in_the_dark(&design, Chance::new(1));
            let found = detectors.detections(&log, &light, &mut super::super::Memory::default());
            assert_eq!(found.time.len(), expected, "{rate} scans per second");
        }
    }
}
