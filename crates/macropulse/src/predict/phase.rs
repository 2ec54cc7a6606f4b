//! Probability that a receiver of taps finds a target, in closed form.
//!
//! The phasor of a modulation frequency is a mean phasor with normal noise in both parts. Its power over that of noise
//! decides whether there is a return; it also is half the inverse of the variance of the phase. A frequency with a full
//! tap is left out, so that each set of frequencies that may be left has a forecast of its own.

use std::f64::consts::TAU;
use std::sync::Arc;

use macropulse_codec::decode::Method;
use macropulse_codec::decode::phase::{rivals, threshold};
use macropulse_codec::statistics::{normal_tail, power_tail};

use super::unmodelled::Unmodelled;
use super::way::{Chances, ClosedForm, Incident, Way};
use crate::design::detector::LockIn;
use crate::design::{Design, Detector, Wave};
use crate::units::{range_from_tof, s_from_fs, tof_from_range};

/// Phases of light whose power is modulated. Full taps are simulated, and no mark has a threshold.
pub(super) static WAY: Way = Way {
    not_modelled,
    closed_form: |design| Some(Arc::new(Phases::of(design)?)),
    limit_of_light: "the taps are full, or several intervals have the same phases",
    effects: &[
        (Unmodelled::Saturation, None),
        (Unmodelled::AirReturn, Some("its phasor would add to that of every echo")),
        (
            Unmodelled::Crosstalk,
            Some("light that is scattered in the lens would add to the phasors of all pixels"),
        ),
        (Unmodelled::MirrorImages, Some("the phasor of an image would add to that of the pane")),
    ],
};

fn not_modelled(design: &Design) -> Option<(String, String)> {
    let Method::Phase(settings) = &design.receiver.method else { return None };
    let is_corrected = settings.tones.iter().all(|tone| tone.contrasts.len() > 1);
    (design.emission.modulation()?.wave == Wave::Square && !is_corrected).then(|| {
        let remedy = "simulate it, or leave out correct_harmonics";
        ("harmonics that are not corrected".to_owned(), remedy.to_owned())
    })
}

/// A sensor of modulated light, and its receiver.
#[derive(Debug, Clone)]
struct Phases {
    lock_in: LockIn,
    false_alarm: f64,
    /// Power that is asked of the sum of phasors, by their number.
    thresholds: Vec<f64>,
    gate_fs: (i64, i64),
}

/// A modulation frequency in this light.
struct Seen {
    hz: f64,
    /// Power of its phasor, in units of its mean under noise.
    power: f64,
    /// Probability that none of its taps is full.
    is_whole: f64,
}

/// Phasors that are accepted.
struct Accepted {
    /// Their share of all.
    share: f64,
    /// Their amplitude over that of all. The angle of a phasor with the mean amplitude a that happens to be r long has
    /// the variance 1/(a·r), in units of its noise.
    brighter: f64,
}

impl Phases {
    /// The forecast of a sensor of modulated light; `None` for others.
    fn of(design: &Design) -> Option<Self> {
        let (Detector::LockIn(lock_in), Method::Phase(method)) =
            (&design.detector, &design.receiver.method)
        else {
            return None;
        };
        let thresholds = (0..=lock_in.contrast.len())
            .map(|phasors| threshold(phasors, method.false_alarm))
            .collect();
        Some(Self {
            lock_in: lock_in.clone(),
            false_alarm: method.false_alarm,
            thresholds,
            gate_fs: design.receiver.gate_fs(),
        })
    }
}

impl ClosedForm for Phases {
    fn false_alarm(&self) -> f64 {
        self.false_alarm
    }

    /// Taps are full of too much light.
    fn can_be_blinded(&self) -> bool {
        true
    }

    /// Only a return in the right interval counts.
    fn chances(&self, incident: &Incident) -> Chances {
        let &Incident { range, photons, falling, .. } = incident;
        let tof = tof_from_range(range);
        let seen: Vec<Seen> = self.each(tof, photons, falling).collect();
        let (mut pd, mut square) = (0.0, 0.0);
        // Each set of frequencies whose taps are not full, while those of the others are.
        for set in 1_u32..1 << seen.len() {
            let is_in = |at: usize| set >> at & 1 == 1;
            let chance = |(at, tone): (usize, &Seen)| match is_in(at) {
                true => tone.is_whole,
                false => 1.0 - tone.is_whole,
            };
            let share: f64 = seen.iter().enumerate().map(chance).product();
            if share <= 0.0 {
                continue;
            }
            let used = seen.iter().enumerate().filter(|(at, _)| is_in(*at)).map(|(_, tone)| tone);
            let used: Vec<&Seen> = used.collect();
            let power: f64 = used.iter().map(|tone| tone.power).sum();
            let Accepted { share: above, brighter } = self.accepted(used.len() as u32, power);
            let here = share * above * self.right_interval(&used, brighter, tof);
            let each = used.iter().map(|tone| (TAU * tone.hz).powi(2) * 2.0 * tone.power);
            let information = brighter * each.sum::<f64>();
            pd += here;
            square += here / information.max(f64::MIN_POSITIVE);
        }
        let precision = range_from_tof((square / pd.max(f64::MIN_POSITIVE)).sqrt());
        let power: f64 = seen.iter().map(|tone| tone.power).sum();
        let bound = range_from_tof(self.information(photons).powf(-0.5));
        Chances { pd: pd.min(1.0), snr: (2.0 * power).sqrt(), precision, bound }
    }
}

impl Phases {
    /// The phasor of each frequency for this light.
    fn each(&self, tof: f64, photons: f64, falling: f64) -> impl Iterator<Item = Seen> + '_ {
        let LockIn { modulation, contrast, full_well, .. } = &self.lock_in;
        let of_tap = photons / f64::from(modulation.taps());
        let steady = falling * s_from_fs(modulation.exposure_fs);
        let taps = f64::from(modulation.phases);
        modulation.hz.iter().zip(contrast).map(move |(&hz, &contrast)| {
            // z is K/2·Q·c long, and the power of its noise is K·v.
            let noise = self.lock_in.variance(of_tap + steady);
            let power = taps * (of_tap * contrast).powi(2) / (4.0 * noise);
            let not_full = (0..modulation.phases).map(|tap| {
                let phase = TAU * (hz * tof - f64::from(tap) / taps);
                let mean = steady + of_tap * modulation.wave.share(contrast, phase);
                let room = full_well - 0.5 * self.lock_in.electrons_per_code() - mean;
                normal_tail(-room / self.lock_in.variance(mean).sqrt())
            });
            Seen { hz, power, is_whole: not_full.product() }
        })
    }

    /// The accepted share of phasors with this mean `power`, in units of that of noise.
    ///
    /// The power M of F phasors is a gamma variable of F + k, k a Poisson variable of the mean P. With T(F) for the
    /// probability that it is above the threshold the mean of what is above is (F·T(F + 1) + P·T(F + 2))/T(F).
    fn accepted(&self, phasors: u32, power: f64) -> Accepted {
        let threshold = self.thresholds[phasors as usize];
        let above = |more: u32| power_tail(phasors + more, power, threshold);
        let (share, noise) = (above(0), f64::from(phasors));
        let mean = (noise * above(1) + power * above(2)) / share.max(f64::MIN_POSITIVE);
        Accepted { share, brighter: (mean / (noise + power)).sqrt().max(1.0) }
    }

    /// Probability that no other interval explains the phases better: each other one does so with Q(D/2), D being how
    /// far it is from the right one, in standard deviations.
    fn right_interval(&self, used: &[&Seen], brighter: f64, tof: f64) -> f64 {
        let variance = |tone: &&Seen| 0.5 / (brighter * tone.power).max(f64::MIN_POSITIVE);
        let tones: Vec<(f64, f64)> = used.iter().map(|tone| (tone.hz, variance(tone))).collect();
        let right = rivals(&tones, tof, self.gate_fs)
            .into_iter()
            .map(|apart| 1.0 - normal_tail(apart / 2.0));
        right.product()
    }

    /// Information about the time of flight in this number of photons without noise of a detector, 1/s². A
    /// tone with N of them and the contrast c has (2πf)²·N·(1 − √(1 − c²)).
    fn information(&self, photons: f64) -> f64 {
        let LockIn { modulation, contrast, .. } = &self.lock_in;
        let of_tone = photons / modulation.hz.len() as f64;
        let each = modulation.hz.iter().zip(contrast).map(|(hz, contrast)| {
            (TAU * hz).powi(2) * of_tone * (1.0 - (1.0 - contrast * contrast).sqrt())
        });
        each.sum()
    }
}
