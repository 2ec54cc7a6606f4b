//! Taps to returns: the receiver of amplitude-modulated light.
//!
//! Each shot is decoded by itself. `tone` makes the taps of a modulation frequency a phasor, whose angle is the
//! phase of the light and whose length is its amplitude. A shot has a return if its phasors are longer than noise
//! makes them. `unwrap` then finds the time of flight that explains the phases of all frequencies best: a phase
//! alone leaves open how many whole periods the light was on its way.

mod check;
mod tone;
mod unwrap;

#[cfg(test)]
mod tests;

pub use tone::Tone;
pub use unwrap::rivals;

use super::{Error, Receiver, Reject, Return, Returns};
use crate::statistics::power_tail;
use crate::{ShotLog, Taps};
use tone::{Demodulator, Phasor};
use unwrap::unwrapped;

/// Settings of a receiver of taps.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseMethod {
    /// The modulation frequencies, in the order of their taps.
    pub tones: Vec<Tone>,
    /// Electrons of one step of a code.
    pub electrons_per_code: f64,
    /// The code of a tap that has collected nothing.
    pub dark_code: f64,
    /// Noise of a tap that has collected nothing, rms, electrons; the steps of the code come on top.
    pub read_noise: f64,
    /// The highest code. A modulation frequency with a tap that has it is left out.
    pub full_scale: u16,
    /// False returns accepted per shot.
    pub false_alarm: f64,
}

impl PhaseMethod {
    /// Takes codes for electrons, without noise of their own, up to 65 535, and accepts one false return in a million
    /// shots.
    pub fn new(tones: Vec<Tone>) -> Self {
        Self {
            tones,
            electrons_per_code: 1.0,
            dark_code: 0.0,
            read_noise: 0.0,
            full_scale: u16::MAX,
            false_alarm: 1e-6,
        }
    }

    /// Noise of a tap of this mean `code`, the variance in steps of the code: photons, reading, rounding.
    fn variance(&self, code: f64) -> f64 {
        let electrons = ((code - self.dark_code) * self.electrons_per_code).max(0.0);
        let noise = electrons + self.read_noise * self.read_noise;
        noise / (self.electrons_per_code * self.electrons_per_code) + ROUNDING
    }
}

/// Variance of a number that is rounded to a whole one.
const ROUNDING: f64 = 1.0 / 12.0;

/// A receiver of taps.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseReceiver {
    /// Nearest and farthest two-way time of flight accepted, fs.
    pub gate_fs: (i64, i64),
    /// How it decodes.
    pub method: PhaseMethod,
}

/// The returns of the owned shots of `log`, one of each at most, `taps` being those of all its shots.
///
/// `peak` of a return counts the modulation frequencies that were used and `marks` all of them; `photons` are
/// the electrons of modulated light of the whole shot. `margin` is in standard deviations. It tells how far
/// the amplitude is above the noise or, if that is less, how much worse the next best number of whole periods
/// explains the phases. `saturated` says that a tap was full.
///
/// # Errors
/// If a setting is outside its limits, columns differ in length, or the log is out of order. A shot in which nothing
/// is found is no error: it is counted as [`Reject::NoPeak`] or, if no time of flight in the gate has its phases, as
/// [`Reject::OutsideGate`].
pub fn decode(receiver: &PhaseReceiver, log: &ShotLog, taps: &Taps) -> Result<Returns, Error> {
    check::settings(receiver)?;
    check::record(receiver, log, taps)?;
    let method = &receiver.method;
    let demodulators: Vec<Demodulator> = method.tones.iter().map(Demodulator::new).collect();
    let thresholds: Vec<f64> =
        (0..=method.tones.len()).map(|tones| threshold(tones, method.false_alarm)).collect();
    let mut returns = Returns::default();
    let mut phasors = Vec::with_capacity(demodulators.len());
    for shot in log.owned.clone() {
        phasors.clear();
        let mut codes = taps.of(shot);
        for demodulator in &demodulators {
            let (own, others) = codes.split_at(demodulator.taps());
            phasors.extend(demodulator.phasor(method, own));
            codes = others;
        }
        let power: f64 = phasors.iter().map(Phasor::power).sum();
        if phasors.is_empty() || power < thresholds[phasors.len()] {
            returns.reject(Reject::NoPeak);
            continue;
        }
        let Some(found) = unwrapped(&phasors, receiver.gate_fs) else {
            returns.reject(Reject::OutsideGate);
            continue;
        };
        let above_noise = (2.0 * power).sqrt();
        returns.push(Return {
            shot,
            tof: found.tof,
            peak: phasors.len() as u16,
            marks: demodulators.len() as u16,
            margin: above_noise.min(found.apart) as u16,
            photons: electrons(method, &phasors) as f32,
            saturated: phasors.len() < demodulators.len(),
        });
    }
    Ok(returns)
}

/// The same with the gate of `receiver`.
pub(super) fn decode_band(
    receiver: &Receiver,
    method: &PhaseMethod,
    log: &ShotLog,
    taps: &Taps,
) -> Result<Returns, Error> {
    decode(&PhaseReceiver { gate_fs: receiver.gate_fs(), method: method.clone() }, log, taps)
}

/// Phase and amplitude of the light, as the taps of one modulation frequency show them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Phase of the light, rad, −π to π.
    pub phase: f64,
    /// Its standard deviation, rad.
    pub sigma: f64,
    /// Electrons of modulated light.
    pub electrons: f64,
}

/// Phase and amplitude of each modulation frequency by the `codes` of a shot; `None` for one with a full tap.
///
/// # Errors
/// If a setting is outside its limits, or the shot has another number of codes.
pub fn measured(method: &PhaseMethod, codes: &[u16]) -> Result<Vec<Option<Measured>>, Error> {
    let receiver = PhaseReceiver { gate_fs: (0, 0), method: method.clone() };
    check::settings(&receiver)?;
    check::taps(method, codes.len() as u32)?;
    let mut left = codes;
    let each = method.tones.iter().map(|tone| {
        let demodulator = Demodulator::new(tone);
        let (own, others) = left.split_at(demodulator.taps());
        left = others;
        demodulator.phasor(method, own).map(|phasor| Measured {
            phase: phasor.phase,
            sigma: phasor.variance.sqrt(),
            electrons: phasor.light * method.electrons_per_code,
        })
    });
    Ok(each.collect())
}

/// Electrons of modulated light of a whole shot, by the frequencies that were used.
fn electrons(method: &PhaseMethod, phasors: &[Phasor]) -> f64 {
    let used: f64 = phasors.iter().map(|phasor| phasor.light).sum();
    let taps = |tone: &Tone| f64::from(tone.phases);
    let all: f64 = method.tones.iter().map(taps).sum();
    let of_used: f64 = phasors.iter().map(|phasor| taps(phasor.tone)).sum();
    used * all / of_used * method.electrons_per_code
}

/// The power, in units of the mean of one phasor of noise, that this number of phasors of noise together exceed with the
/// probability `false_alarm`.
pub fn threshold(phasors: usize, false_alarm: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1e3);
    // To the last bit of the result.
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        match power_tail(phasors as u32, 0.0, middle) > false_alarm {
            true => low = middle,
            false => high = middle,
        }
    }
    high
}
