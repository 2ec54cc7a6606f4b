//! Probability that a receiver of beats finds a target, in closed form.
//!
//! The field of an echo is a complex normal variable, so that its photons S in a ramp are exponential about
//! their mean. In a bin beside its beat the field is that of S·h² photons, h the amplitude of the window
//! there, with the noise of a complex normal variable. Its power exceeds γ with the probability Q₁(√(2·S·h²),
//! √(2γ)) of Marcum. The peak is the stronger one of the two bins beside a beat. Behind a window their noise
//! is correlated, with ρ. The probability that both exceed γ at once is taken to lie at the share ρ² of the
//! way from that of independent powers to that of equal ones. A return needs a power of γ in each ramp, and
//! of x in both together. Any place of a beat in its bin is equally likely, in each ramp. The line of the
//! laser leaves less light in step, and lets beats wander.

use std::f64::consts::PI;
use std::sync::Arc;

use macropulse_codec::decode::Method;
use macropulse_codec::decode::beat::Ramp;
use macropulse_codec::statistics::power_tail;

use super::unmodelled::Unmodelled;
use super::way::{Chances, ClosedForm, Incident, Way};
use crate::design::detector::Coherent;
use crate::design::{Design, Detector};
use crate::units::{range_from_tof, tof_from_range};

/// Powers between the least one that is recorded and that of a return without more in the other ramp.
const STEPS: usize = 16;

/// Places in a bin at which a beat may lie, from its middle to its edge.
const PLACES: u32 = 6;

/// Steps of the natural logarithm of the photons of a ramp, and from where to where.
const FINE: f64 = 0.05;
const PHOTONS: (f64, f64) = (-3.0, 9.0);

/// Beats of light whose frequency is modulated. No mark has a threshold, and each detector sees its own mode alone.
pub(super) static WAY: Way = Way {
    not_modelled,
    closed_form: |design| Some(Arc::new(Beats::of(design)?)),
    limit_of_light: "it is out of step with that of the laser",
    effects: &[
        (Unmodelled::Saturation, None),
        (Unmodelled::AirReturn, Some("its beats would lie over those of the first metres")),
        (Unmodelled::Crosstalk, None),
        (
            Unmodelled::MirrorImages,
            Some("an image has a beat of its own, and is found as a surface is"),
        ),
    ],
};

fn not_modelled(design: &Design) -> Option<(String, String)> {
    let Detector::Coherent(Coherent { chirp, .. }) = &design.detector else { return None };
    let what = "a frequency that strays from its ramps".to_owned();
    (chirp.error.amplitude > 0.0).then(|| (what, "simulate it".to_owned()))
}

/// A sensor of frequency-modulated light, and its receiver.
#[derive(Debug, Clone)]
struct Beats {
    coherent: Coherent,
    false_alarm: f64,
    /// For each number of photons in a ramp, e to the steps of [`FINE`]: the probability of a return, and the mean
    /// power of such returns over all ramps.
    found: Vec<Found>,
}

/// The chances of an echo with a number of photons.
#[derive(Debug, Clone, Copy)]
struct Found {
    photons: f64,
    pd: f64,
    /// Amplitude of what is found over that of all.
    brighter: f64,
}

impl Beats {
    /// The forecast for a sensor of frequency-modulated light; `None` for others.
    fn of(design: &Design) -> Option<Self> {
        let (Detector::Coherent(coherent), Method::Beat(method)) =
            (&design.detector, &design.receiver.method)
        else {
            return None;
        };
        let threshold = method.threshold(design.receiver.gate_fs());
        let (least, ramps) = (method.least_power, method.ramps.len());
        let step = (threshold - ramps as f64 * least) / STEPS as f64;
        let powers: Vec<f64> = match ramps {
            1 => vec![threshold],
            _ => (0..=STEPS).map(|at| least + step * at as f64).collect(),
        };
        let count = ((PHOTONS.1 - PHOTONS.0) / FINE) as usize;
        let photons = |at: usize| libm::exp(PHOTONS.0 + FINE * at as f64);
        let tails =
            |at: usize| powers.iter().map(|power| power_tail(1, photons(at), *power)).collect();
        let tails: Vec<Vec<f64>> = (0..=count).map(tails).collect();
        let aside = |place: u32| (f64::from(place) + 0.5) / f64::from(2 * PLACES);
        let share = |aside: f64| method.window.amplitude(aside).powi(2);
        let places: Vec<[f64; 2]> =
            (0..PLACES).map(|place| [share(aside(place)), share(1.0 - aside(place))]).collect();
        let [own, beside] = method.window.weights();
        let alike = (2.0 * own * beside).powi(2);
        let found = |at: usize| {
            let of = |shares: &[f64; 2]| {
                let [one, other] =
                    shares.map(|share| between(&tails, libm::log(photons(at) * share)));
                one.iter().zip(&other).map(|(one, other)| either([*one, *other], alike)).collect()
            };
            let seen: Vec<Vec<f64>> = places.iter().map(of).collect();
            let pd = match ramps {
                1 => seen.iter().map(|tails| tails[0]).sum::<f64>() / f64::from(PLACES),
                _ => {
                    let pairs =
                        seen.iter().flat_map(|one| seen.iter().map(move |other| both(one, other)));
                    pairs.sum::<f64>() / f64::from(PLACES * PLACES)
                }
            };
            // The mean power of all, and at least the one that is asked for and one more.
            let share = places.iter().map(|[nearer, _]| nearer).sum::<f64>() / f64::from(PLACES);
            let mean = ramps as f64 * (1.0 + photons(at) * share);
            let brighter = (mean.max(threshold + 1.0) / mean).sqrt();
            Found { photons: photons(at), pd, brighter }
        };
        let found = (0..=count).map(found).collect();
        Some(Self { coherent: coherent.clone(), false_alarm: method.false_alarm, found })
    }
}

impl ClosedForm for Beats {
    fn false_alarm(&self) -> f64 {
        self.false_alarm
    }

    fn chances(&self, incident: &Incident) -> Chances {
        let &Incident { range, photons, background, .. } = incident;
        let Coherent { chirp, .. } = &self.coherent;
        let tof = tof_from_range(range);
        let shares = chirp.shares().into_iter().zip(chirp.ramps());
        let in_step: f64 =
            shares.map(|(share, ramp)| share * chirp.coherence(tof, ramp.seconds)).sum();
        let ramps = chirp.ramps().len() as f64;
        let mean = photons * in_step / ramps / self.coherent.noise(background);
        let (mut all, mut pd, mut square) = (0.0, 0.0, 0.0);
        for one in &self.found {
            // The exponential variable over the steps of its logarithm.
            let weight = one.photons / mean * libm::exp(-one.photons / mean);
            all += weight * FINE;
            pd += weight * FINE * one.pd;
            square += weight * FINE * one.pd / (one.photons * one.brighter);
        }
        // Beyond the last step all are found, and all but those below the first.
        pd += (libm::exp(-self.found[0].photons / mean) - all).max(0.0);
        let spread = self.coherent.spread(1.0) / ramps.sqrt();
        let window = self.coherent.spectrum.window;
        let wander = |ramp: Ramp| chirp.wander(tof, ramp.seconds, window) / ramp.slope().powi(2);
        let wander: f64 = chirp.ramps().into_iter().map(wander).sum::<f64>() / ramps.powi(2);
        let noise = spread * spread * square / pd.max(f64::MIN_POSITIVE);
        Chances {
            pd: pd.min(1.0),
            snr: (2.0 * ramps * mean).sqrt(),
            precision: range_from_tof((noise + wander).sqrt()),
            bound: range_from_tof(
                6.0_f64.sqrt() / (2.0 * PI * chirp.bandwidth * (photons * in_step).sqrt()),
            ),
        }
    }
}

/// The probabilities that powers are exceeded by a signal of this logarithm, between those that were worked out.
fn between(tails: &[Vec<f64>], logarithm: f64) -> Vec<f64> {
    let place = ((logarithm - PHOTONS.0) / FINE).clamp(0.0, (tails.len() - 1) as f64);
    let (at, share) = (place as usize, place.fract());
    let next = &tails[(at + 1).min(tails.len() - 1)];
    tails[at].iter().zip(next).map(|(one, next)| one + share * (next - one)).collect()
}

/// The probability that one of two powers exceeds a threshold, from the probability for each. They are independent if
/// `alike` is 0, and equal if it is 1.
fn either([one, other]: [f64; 2], alike: f64) -> f64 {
    let both = one * other;
    one + other - both - alike * (one.min(other) - both)
}

/// The probability that both powers exceed γ, and together x: `one` and `other` are the probabilities that each exceeds γ to
/// x − γ, in equal steps.
fn both(one: &[f64], other: &[f64]) -> f64 {
    let last = one.len() - 1;
    let within = (0..last).map(|at| {
        // While the one lies in this step, the other has to exceed what is left.
        (one[at] - one[at + 1]) * (other[last - at] + other[last - at - 1]) / 2.0
    });
    within.sum::<f64>() + one[last] * other[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Both exponential: the powers of noise in both ramps, e^−x·(1 + x − 2γ).
    #[test]
    fn two_powers_of_noise_exceed_a_sum_as_in_closed_form() {
        let (least, threshold) = (2.0, 9.0);
        let step = (threshold - 2.0 * least) / 400.0;
        let tails: Vec<f64> =
            (0..=400).map(|at| libm::exp(-(least + step * f64::from(at)))).collect();
        let expected = libm::exp(-threshold) * (1.0 + threshold - 2.0 * least);
        assert_relative_eq!(both(&tails, &tails), expected, max_relative = 1e-3);
    }
}
