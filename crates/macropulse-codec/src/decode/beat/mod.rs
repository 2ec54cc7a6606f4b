//! Beats to returns: the receiver of frequency-modulated light.
//!
//! Light that comes back is mixed with the light that is sent, while its frequency goes up and then while it
//! goes down. After the time of flight τ it lags behind by γ·τ, γ being the slope of the ramp. Light of a
//! surface that approaches is higher by the Doppler shift D = 2·v/λ \[AB01\]. The beats are
//!
//! f_up = γ_up·τ − D, f_down = γ_down·τ + D.
//!
//! Each shot is decoded by itself. A peak of the rising ramp and one of the falling ramp give a range and a
//! radial velocity. Both come of one surface if their powers together are more than noise makes of any two
//! peaks. If there are several surfaces, the strongest peaks of both ramps belong together.

mod check;
mod window;

#[cfg(test)]
mod tests;

pub use window::{SpectralWindow, sinc};

use super::{Error, MOST_RETURNS, Pick, Receiver, Reject, Return, Returns, Strength};
use crate::time::s_from_fs;
use crate::{Beats, Peak, ShotLog};

/// Settings of a receiver of beats.
#[derive(Debug, Clone, PartialEq)]
pub struct BeatMethod {
    /// The ramps of a shot, in the order of their peaks: one that rises or falls, or one of each.
    pub ramps: Vec<Ramp>,
    /// Wavelength, m.
    pub wavelength: f64,
    /// The window that was laid over a ramp before its spectrum was taken.
    pub window: SpectralWindow,
    /// Peaks with less power than this are not recorded, in units of the mean of noise.
    pub least_power: f64,
    /// A peak with less than this share of the power of the strongest one of its ramp is left out. The light of a bright
    /// surface is spread over other bins by the line of the laser.
    pub least_share: f64,
    /// Photons of a shot whose peaks have a power of 1 in every ramp.
    pub photons: f64,
    /// Radial velocity of a surface at most, m/s.
    pub max_speed: f64,
    /// False returns accepted per shot.
    pub false_alarm: f64,
}

/// A ramp of the frequency, as far as it is recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    /// By how much the frequency changes, Hz; negative where it falls.
    pub bandwidth: f64,
    /// Time that is recorded, s.
    pub seconds: f64,
}

impl Ramp {
    /// The change of the frequency per second without its sign, Hz/s.
    pub fn slope(&self) -> f64 {
        self.bandwidth.abs() / self.seconds
    }

    /// The beat, in bins, of light with this time of flight, s, from a surface that approaches and shifts it by
    /// `doppler` Hz.
    pub fn bins(&self, tof: f64, doppler: f64) -> f64 {
        self.bandwidth.abs() * tof - self.bandwidth.signum() * doppler * self.seconds
    }
}

/// A receiver of beats.
#[derive(Debug, Clone, PartialEq)]
pub struct BeatReceiver {
    /// Nearest and farthest two-way time of flight accepted, fs.
    pub gate_fs: (i64, i64),
    /// Returns of a shot at most, 1 to [`MOST_RETURNS`].
    pub returns: u8,
    /// Which returns are kept if there are more.
    pub pick: Pick,
    /// How it decodes.
    pub method: BeatMethod,
}

/// The measurement that peaks of all ramps make together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Two-way time of flight, s.
    pub tof: f64,
    /// Radial velocity, m/s, positive of a surface that approaches; `None` of a single ramp.
    pub radial_velocity: Option<f64>,
    /// Powers of its peaks together, in units of the mean of noise.
    pub power: f64,
    /// Place of its peak in the list of each ramp.
    pub peaks: [usize; 2],
    /// Photons of the shot.
    pub photons: f64,
    /// Why it is no return.
    pub refused: Option<Refused>,
}

/// Why a candidate is no return.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// Noise makes as much.
    Faint,
    /// Its time of flight is outside the gate.
    Range,
    /// It would be faster than anything is.
    Speed,
    /// A stronger return has one of its peaks.
    Taken,
}

/// The returns of the owned shots of `log`, `beats` being the peaks of all its shots; ordered by shot, those of one
/// shot by range.
///
/// `peak` and `marks` of a return count its ramps. `photons` are those of the whole shot, and `margin` is the amplitude
/// of its peaks in standard deviations of the noise. [`Returns::radial_velocity`] is filled where there are two ramps.
///
/// # Errors
/// If a setting is outside its limits, columns differ in length, or the log is out of order. A shot in which nothing is
/// found is no error: it is counted as [`Reject::NoPeak`] or, if peaks stand out that no surface within the gate would
/// have, as [`Reject::OutsideGate`].
pub fn decode(receiver: &BeatReceiver, log: &ShotLog, beats: &Beats) -> Result<Returns, Error> {
    check::settings(receiver)?;
    check::record(receiver, log, beats)?;
    let threshold = receiver.method.threshold(receiver.gate_fs);
    let mut returns = Returns::default();
    for shot in log.owned.clone() {
        let found = candidates(receiver, threshold, beats.of(shot));
        let (mut kept, others): (Vec<_>, Vec<_>) =
            found.into_iter().partition(|one| one.refused.is_none());
        if kept.is_empty() {
            let stands_out = others.iter().any(|one| one.power >= threshold);
            returns.reject(if stands_out { Reject::OutsideGate } else { Reject::NoPeak });
            continue;
        }
        kept.sort_by(|one, next| one.tof.total_cmp(&next.tof));
        let strength = |one: &Candidate| Strength { peak: 1, light: one.power as f32 };
        receiver.pick.keep(receiver.returns.into(), &mut kept, strength);
        for one in kept {
            let ramps = receiver.method.ramps.len() as u16;
            returns.push(Return {
                shot,
                tof: one.tof,
                peak: ramps,
                marks: ramps,
                margin: (2.0 * one.power).sqrt() as u16,
                photons: one.photons as f32,
                saturated: false,
            });
            returns.radial_velocity.extend(one.radial_velocity.map(|velocity| velocity as f32));
        }
    }
    Ok(returns)
}

/// The same with the gate and the returns of `receiver`.
pub(super) fn decode_band(
    receiver: &Receiver,
    method: &BeatMethod,
    log: &ShotLog,
    beats: &Beats,
) -> Result<Returns, Error> {
    decode(&BeatReceiver::of(receiver, method), log, beats)
}

impl BeatReceiver {
    /// That of `receiver`, whose method is `method`.
    pub fn of(receiver: &Receiver, method: &BeatMethod) -> Self {
        let Receiver { returns, pick, .. } = *receiver;
        Self { gate_fs: receiver.gate_fs(), returns, pick, method: method.clone() }
    }
}

/// The possible measurements from the `peaks` of a shot, which are listed ramp by ramp. Every peak of a ramp is paired
/// with every one of the other, and the strongest pair comes first. A pair is a return if its power reaches `threshold`.
pub fn candidates(receiver: &BeatReceiver, threshold: f64, peaks: &[Peak]) -> Vec<Candidate> {
    let method = &receiver.method;
    let each = peaks.len() / method.ramps.len().max(1);
    // The strongest comes first.
    let list = |ramp: usize| {
        let peaks = &peaks[ramp * each..(ramp + 1) * each];
        let least = method.least_share * peaks.first().map_or(0.0, |peak| f64::from(peak.power));
        let is_there = move |peak: &Peak| peak.power > 0 && f64::from(peak.power) >= least;
        peaks.iter().enumerate().filter(move |(_, peak)| is_there(peak))
    };
    let mut found: Vec<Candidate> = match method.ramps.as_slice() {
        [ramp] => list(0).map(|(at, peak)| method.of_one(ramp, at, *peak)).collect(),
        [up, down] => list(0)
            .flat_map(|one| list(1).map(move |other| (one, other)))
            .map(|((one, first), (other, second))| {
                method.of_two([*up, *down], [one, other], [*first, *second])
            })
            .collect(),
        _ => Vec::new(),
    };
    found.sort_by(|one, other| other.power.total_cmp(&one.power));
    let gate = [receiver.gate_fs.0, receiver.gate_fs.1].map(s_from_fs);
    let mut taken: Vec<[usize; 2]> = Vec::new();
    for one in &mut found {
        let is_taken = |by: &[usize; 2]| {
            by[0] == one.peaks[0] || method.ramps.len() > 1 && by[1] == one.peaks[1]
        };
        let speed = one.radial_velocity.map_or(0.0, f64::abs);
        one.refused = if one.power < threshold {
            Some(Refused::Faint)
        } else if one.tof < gate[0] || one.tof >= gate[1] {
            Some(Refused::Range)
        } else if speed > method.max_speed {
            Some(Refused::Speed)
        } else if taken.iter().any(is_taken) {
            Some(Refused::Taken)
        } else {
            taken.push(one.peaks);
            None
        };
    }
    found
}

impl BeatMethod {
    /// The Doppler shift of light from a surface that approaches with this radial velocity, m/s, in Hz.
    pub fn doppler(&self, radial_velocity: f64) -> f64 {
        2.0 * radial_velocity / self.wavelength
    }

    /// Powers of its peaks together from which on a return is one, in units of the mean of noise.
    ///
    /// The powers of noise in different bins are independent exponential variables. Those of a pair exceed γ
    /// each and x together, x ≥ 2γ, with the probability e⁻ˣ·(1 + x − 2γ), γ being the least power that is
    /// recorded. The number of pairs of bins that are tried is an area in the plane of both beats. The gate,
    /// Δτ long, and all Doppler shifts ΔD span it: Δτ·ΔD·(B_up·T_down + B_down·T_up).
    pub fn threshold(&self, gate_fs: (i64, i64)) -> f64 {
        let gate = s_from_fs(gate_fs.1.saturating_sub(gate_fs.0));
        let least = self.least_power;
        let (trials, ramps) = match self.ramps.as_slice() {
            [up, down] => {
                let [across, along] =
                    [up.bandwidth.abs() * down.seconds, down.bandwidth.abs() * up.seconds];
                (gate * 2.0 * self.doppler(self.max_speed) * (across + along), 2.0)
            }
            [ramp] => (gate * ramp.bandwidth.abs(), 1.0),
            _ => return f64::INFINITY,
        };
        let false_returns = |power: f64| {
            let beyond = if ramps > 1.0 { 1.0 + power - 2.0 * least } else { 1.0 };
            trials.max(1.0) * beyond * libm::exp(-power)
        };
        let (mut low, mut high) = (ramps * least, ramps * least + 800.0);
        if false_returns(low) <= self.false_alarm {
            return low;
        }
        // To the last bit of the result.
        for _ in 0..64 {
            let middle = (low + high) / 2.0;
            match false_returns(middle) > self.false_alarm {
                true => low = middle,
                false => high = middle,
            }
        }
        high
    }

    /// The measurement from a peak of a single ramp, without any Doppler shift.
    fn of_one(&self, ramp: &Ramp, at: usize, peak: Peak) -> Candidate {
        Candidate {
            tof: peak.bins() / ramp.bandwidth.abs(),
            radial_velocity: None,
            power: peak.power(),
            peaks: [at, 0],
            photons: self.photons * self.window.signal(peak),
            refused: None,
        }
    }

    /// The measurement from two peaks, one of each ramp.
    fn of_two(&self, ramps: [Ramp; 2], at: [usize; 2], peaks: [Peak; 2]) -> Candidate {
        let hz = [0, 1].map(|ramp| peaks[ramp].bins() / ramps[ramp].seconds);
        // Each ramp says slope·tof − sign·doppler: their difference, by the signs, is without Doppler shift.
        let signs = ramps.map(|ramp| ramp.bandwidth.signum());
        let slopes = ramps.map(|ramp| ramp.slope());
        let tof =
            (hz[0] * signs[1] - hz[1] * signs[0]) / (slopes[0] * signs[1] - slopes[1] * signs[0]);
        let doppler = signs[0] * (slopes[0] * tof - hz[0]);
        let signal = peaks.map(|peak| self.window.signal(peak));
        Candidate {
            tof,
            radial_velocity: Some(doppler * self.wavelength / 2.0),
            power: peaks.iter().map(|peak| peak.power()).sum(),
            peaks: at,
            photons: self.photons * (signal[0] + signal[1]) / 2.0,
            refused: None,
        }
    }
}
