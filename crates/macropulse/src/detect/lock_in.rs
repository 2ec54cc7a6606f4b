//! Light to taps: pixels that collect it in step with its modulation.
//!
//! Each exposure of a shot is a tap, one of T. Light of the shot itself reaches it along all paths at once. A
//! path of N detected photons brings the charge N/T·(1 + c·cos(2πfτ − θ)), or that of a triangle instead of
//! the cosine. Here τ is its time of flight in the middle of the exposure, f and θ are frequency and phase of the
//! tap, and c is its contrast. A surface that approaches at v shortens τ by 2v/c per second. Steady light adds the
//! same to every tap. A pulse of another lidar adds its photons times the gain of the tap at its arrival. The
//! electrons of a tap are a Poisson variable.
//!
//! Modulated light of another lidar, of the frequency f', adds the integral of its rate times that share over the time
//! in which it meets the exposure. Its phase behind the tap, 2π·(f·t − f'·t') − θ, changes by 2π·(f − f') per
//! second: t and t' are the times since the exposure and since the other light began. Harmonics of frequencies that
//! differ by more are neglected.

use std::f64::consts::TAU;

use macropulse_codec::{Given, ShotLog, Taps};
use rand_distr::{Distribution, Poisson, StandardNormal};

use super::{ShotRecorder, own_by_shot};
use crate::channel::{Light, Stretch, Varies};
use crate::design::detector::LockIn;
use crate::design::emission::Model;
use crate::design::{Design, Modulation};
use crate::random::{Chance, Stage};
use crate::units::{s_from_fs, tof_from_range};

/// A way that light of a shot takes.
struct Path {
    /// Photons of the whole shot.
    photons: f64,
    /// Time of flight of light that leaves as the shot is fired, s.
    tof: f64,
    /// Speed at which the surface approaches, m/s.
    velocity: f64,
}

/// Pixels that collect light in step with its modulation, at work.
#[derive(Debug)]
pub(super) struct Demodulator {
    lock_in: LockIn,
    /// Detections per photon.
    efficiency: f64,
}

impl ShotRecorder for Demodulator {
    fn record(&self, chance: &Chance, log: &ShotLog, light: &Light) -> Given {
        Given::Taps(self.taps(chance, log, light))
    }
}

impl Demodulator {
    pub fn new(lock_in: &LockIn, design: &Design) -> Self {
        Self { lock_in: lock_in.clone(), efficiency: design.efficiency() }
    }

    fn taps(&self, chance: &Chance, log: &ShotLog, light: &Light) -> Taps {
        let (own, others) = (own_by_shot(light), pulses_of_others(light));
        let stretches = light.background.by_channel();
        let taps = self.lock_in.modulation.taps();
        let steady = self.lock_in.dark + light.background.steady * self.efficiency;
        let of_each = steady * s_from_fs(self.lock_in.modulation.exposure_fs);
        let of_responses = self.of_responses(light);
        let mut codes = Vec::with_capacity(log.owned.len() * taps as usize);
        let mut means = Vec::with_capacity(taps as usize);
        for shot in log.owned.clone() {
            let (channel, fired_fs) = (log.channel[shot], log.fired_at_fs[shot]);
            let number = log.first + shot as u64;
            means.clear();
            means.extend(of_responses.iter().map(|electrons| of_each + electrons));
            let from = own.partition_point(|(of, _)| *of < number);
            for &(_, train) in own[from..].iter().take_while(|(of, _)| *of == number) {
                let tof = s_from_fs(light.trains.arrives_fs[train] - fired_fs);
                let velocity = light.trains.radial_velocity.get(train).copied().unwrap_or(0.0);
                let path =
                    Path { photons: light.trains.photons[train], tof, velocity: velocity.into() };
                self.add_path(&mut means, &path);
            }
            self.add_pulses(&mut means, (channel, fired_fs), (&others, light));
            let seen = |it: &Stretch| (it.channel, it.until_fs) <= (channel, fired_fs);
            let seen = &stretches[stretches.partition_point(seen)..];
            let seen = seen.iter().take_while(|it| it.channel == channel);
            seen.for_each(|stretch| self.add_stretch(&mut means, fired_fs, stretch));
            let mut stream = chance.at(Stage::LockIn, number);
            codes.extend(means.iter().map(|mean| {
                let drawn = Poisson::new(*mean).map_or(0.0, |law| law.sample(&mut stream));
                let noise: f64 = StandardNormal.sample(&mut stream);
                let electrons = drawn + self.lock_in.read_noise * noise;
                let code = self.lock_in.dark_code + electrons / self.lock_in.electrons_per_code();
                // Rounds, and cuts off what a code cannot say.
                (code.round() as u16).min(self.lock_in.full_scale)
            }));
        }
        Taps { taps, codes }
    }

    /// The frequency, Hz, the contrast and the phase, rad, of each tap.
    fn each_tap(&self) -> impl Iterator<Item = (f64, f64, f64)> + '_ {
        let LockIn { modulation, contrast, .. } = &self.lock_in;
        let phases = modulation.phases;
        let tones = modulation.hz.iter().zip(contrast);
        tones.flat_map(move |(hz, contrast)| {
            (0..phases).map(move |tap| (*hz, *contrast, TAU * f64::from(tap) / f64::from(phases)))
        })
    }

    /// Adds the electrons of light that comes along `path`.
    fn add_path(&self, means: &mut [f64], path: &Path) {
        let modulation = &self.lock_in.modulation;
        let each = path.photons * self.efficiency / f64::from(modulation.taps());
        let shortens = tof_from_range(path.velocity);
        for (tap, (mean, (hz, contrast, phase))) in (0..).zip(means.iter_mut().zip(self.each_tap()))
        {
            let tof = path.tof - shortens * modulation.middle(tap);
            *mean += each * modulation.wave.share(contrast, TAU * hz * tof - phase);
        }
    }

    /// Electrons in each tap of what the light brings without pulses after it was sent.
    fn of_responses(&self, light: &Light) -> Vec<f64> {
        let mut means = vec![0.0; self.lock_in.modulation.taps() as usize];
        for response in &light.responses {
            for (step, photons) in response.photons.iter().enumerate() {
                let tof = (step as f64 + 0.5) * s_from_fs(response.step_fs);
                self.add_path(&mut means, &Path { photons: *photons, tof, velocity: 0.0 });
            }
        }
        means
    }

    /// Adds the pulses of other lidars that arrive while a tap of the shot fired at `fired_fs` collects light.
    fn add_pulses(
        &self,
        means: &mut [f64],
        (channel, fired_fs): (u16, i64),
        (others, light): (&[(u16, i64, usize)], &Light),
    ) {
        let Modulation { exposure_fs, gap_fs, wave, .. } = *self.lock_in.modulation;
        let end_fs = fired_fs + self.lock_in.modulation.length_fs();
        let from = others.partition_point(|(of, at, _)| (*of, *at) < (channel, fired_fs));
        let seen = others[from..].iter().take_while(|(of, at, _)| (*of, *at) < (channel, end_fs));
        for &(_, arrives_fs, train) in seen {
            let since = arrives_fs - fired_fs;
            let tap = (since / (exposure_fs + gap_fs)) as usize;
            let within = since - self.lock_in.modulation.begins_fs(tap as u32);
            let Some((hz, contrast, phase)) = self.each_tap().nth(tap) else { continue };
            if within >= exposure_fs {
                continue;
            }
            let photons = light.trains.photons[train] * self.efficiency;
            means[tap] += photons * wave.share(contrast, TAU * hz * s_from_fs(within) - phase);
        }
    }

    /// Adds the light of `stretch` that comes while a tap of the shot fired at `fired_fs` collects light.
    fn add_stretch(&self, means: &mut [f64], fired_fs: i64, stretch: &Stretch) {
        let modulation = &self.lock_in.modulation;
        for (tap, (mean, (hz, contrast, phase))) in (0..).zip(means.iter_mut().zip(self.each_tap()))
        {
            let begins_fs = fired_fs + modulation.begins_fs(tap);
            let from_fs = stretch.from_fs.max(begins_fs);
            let until_fs = stretch.until_fs.min(begins_fs + modulation.exposure_fs);
            if from_fs >= until_fs {
                continue;
            }
            let share = match stretch.varies {
                Varies::Power { hz: its, phase: behind, .. } => {
                    let at = |time_fs: i64| {
                        TAU * hz * s_from_fs(time_fs - begins_fs)
                            - TAU * its * s_from_fs(time_fs - stretch.from_fs)
                    };
                    let apart = at(from_fs) - phase - behind;
                    let turns = TAU * (hz - its) * s_from_fs(until_fs - from_fs);
                    modulation.wave.mean_share(contrast, apart, apart + turns)
                }
                Varies::Not | Varies::Frequency { .. } => 1.0,
            };
            *mean += stretch.per_s * self.efficiency * s_from_fs(until_fs - from_fs) * share;
        }
    }
}

/// The pulses of other lidars by channel and arrival, each with its train.
fn pulses_of_others(light: &Light) -> Vec<(u16, i64, usize)> {
    let trains = &light.trains;
    let mut others = Vec::new();
    for train in (0..trains.len()).filter(|train| trains.transmitter[*train] != 0) {
        let channel = trains.channel[train];
        others.extend(light.arrivals_fs(train).map(|arrives| (channel, arrives, train)));
    }
    others.sort_unstable();
    others
}
