//! Light whose frequency goes up and down: `[chirp]`.

use std::f64::consts::PI;

use macropulse_codec::decode::beat::{Ramp, SpectralWindow};
use schemars::JsonSchema;
use serde::Deserialize;

use super::check::{Continuous, OptionalTable, SensorFile};
use super::emission::{Exposures, Model, Occupancy};
use super::limits::{Check, Idle};
use super::{Clock, Coding, Emission, Error, Readout};
use crate::units::{fs_from_s, range_from_tof, s_from_fs, tof_from_range};

/// Light whose frequency rises, and then falls. A shot is one ramp or both; before each lies the time in which
/// the light of the ramp before it is still on its way.
#[derive(Debug, Clone, PartialEq)]
pub struct Chirp {
    /// The shot as a code word of one mark, at which its light begins.
    pub shot: Coding,
    /// The change of the frequency while a ramp is recorded, Hz.
    pub bandwidth: f64,
    /// How long the rising ramp is recorded, fs.
    pub up_fs: i64,
    /// How long the falling ramp is recorded, fs; 0 where there is none.
    pub down_fs: i64,
    /// Time before each ramp that is not recorded, fs.
    pub settle_fs: i64,
    /// Spectral width of the laser's line (full width at half maximum of a Lorentz curve), Hz.
    pub linewidth: f64,
    /// How the frequency strays from its ramps.
    pub error: ChirpError,
}

/// A frequency that strays from its ramps as a sine.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ChirpError {
    /// By how much at most, Hz.
    pub amplitude: f64,
    /// How often per second, Hz; 0 where it does not.
    pub rate: f64,
}

impl Chirp {
    /// Its ramps in the order in which they are sent, as a receiver knows them.
    pub fn ramps(&self) -> Vec<Ramp> {
        let up = Ramp { bandwidth: self.bandwidth, seconds: s_from_fs(self.up_fs) };
        let down = Ramp { bandwidth: -self.bandwidth, seconds: s_from_fs(self.down_fs) };
        if self.down_fs > 0 { vec![up, down] } else { vec![up] }
    }

    /// When ramp number `ramp` begins to be recorded, fs after the shot.
    pub fn begins_fs(&self, ramp: usize) -> i64 {
        let before = if ramp > 0 { self.settle_fs + self.up_fs } else { 0 };
        before + self.settle_fs
    }

    /// How long ramp number `ramp` is recorded, fs.
    pub fn recorded_fs(&self, ramp: usize) -> i64 {
        if ramp > 0 { self.down_fs } else { self.up_fs }
    }

    /// The share of the light of a shot that each ramp brings, in their order.
    pub fn shares(&self) -> Vec<f64> {
        let length = s_from_fs(self.length_fs());
        self.ramps().iter().map(|ramp| ramp.seconds / length).collect()
    }

    /// True if the phase of its light is that of an ideal chirp.
    pub fn is_ideal(&self) -> bool {
        self.linewidth == 0.0 && self.error.amplitude == 0.0
    }

    /// Variance of the beat of light from `tof` seconds away, Hz², over a ramp of `seconds`, for the width of the line.
    ///
    /// A receiver that takes the spectrum behind a window w(u), u the time in ramps from the middle of one,
    /// finds 1/(2πT)·∫ q(u)·φ(u) du, q = w·u/∫w·u² du. Here φ is how far the phase strays: the phase of the
    /// laser now less that of the laser τ ago. It is a sum of independent steps with the variance 2π·Δν per
    /// second, each weighted with G(u) = ∫ q over τ from u on. The variance is Δν/(2π·T)·∫ G² du.
    pub fn wander(&self, tof: f64, seconds: f64, window: SpectralWindow) -> f64 {
        const STEPS: u32 = 512;
        // ∫ w·u du up to u, and ∫ w·u² du.
        let (up_to, square): (fn(f64) -> f64, f64) = match window {
            SpectralWindow::None => (|u| u * u / 2.0, 1.0 / 12.0),
            SpectralWindow::Hann => (
                |u| {
                    let turns = 2.0 * PI * u;
                    u * u / 4.0
                        + u * libm::sin(turns) / (4.0 * PI)
                        + libm::cos(turns) / (8.0 * PI * PI)
                },
                1.0 / 24.0 - 1.0 / (4.0 * PI * PI),
            ),
        };
        let late = tof / seconds;
        let step = (1.0 + late) / f64::from(STEPS);
        let weight = |number: u32| {
            let from = -0.5 - late + (f64::from(number) + 0.5) * step;
            let until = (from + late).min(0.5);
            ((up_to(until) - up_to(from.max(-0.5))) / square).powi(2)
        };
        self.linewidth / (2.0 * PI * seconds) * step * (0..STEPS).map(weight).sum::<f64>()
    }

    /// The share of the light from `tof` seconds away that is in step over a ramp of `seconds`, for the width of the line:
    ///
    /// (2/T²)·∫₀ᵀ (T − u)·exp(−2π·Δν·min(u, τ)) du
    ///
    /// It is the part that is left of the peak, the mean over all ramps. The difference of two phases that
    /// are τ apart wanders with the variance 2·2π·Δν·min(u, τ) in the time u.
    pub fn coherence(&self, tof: f64, seconds: f64) -> f64 {
        let rate = 2.0 * PI * self.linewidth;
        let until = tof.clamp(0.0, seconds);
        let (rest, decay) = (seconds - until, libm::exp(-rate * until));
        // ∫ (T − u)·exp(−r·u) du over 0 to τ: (T·r − 1)(1 − e)/r² + τ·e/r, by its series where r·τ is small.
        let x = rate * until;
        let within = if x < 1e-4 {
            until * (seconds - until / 2.0) - rate * until * until * (seconds / 2.0 - until / 3.0)
        } else {
            (seconds * rate - 1.0) * (1.0 - decay) / (rate * rate) + until * decay / rate
        };
        2.0 / (seconds * seconds) * (within + decay * rest * rest / 2.0)
    }
}

impl Model for Chirp {
    fn coding(&self) -> &Coding {
        &self.shot
    }

    /// From the beginning of the first ramp, the unrecorded part included, to the end of the last one.
    fn length_fs(&self) -> i64 {
        let last = self.ramps().len() - 1;
        self.begins_fs(last) + self.recorded_fs(last)
    }

    fn exposures(&self) -> Option<Exposures> {
        Some(Exposures { count: 1, each_fs: self.length_fs() })
    }

    fn recorded_parts(&self) -> u32 {
        self.ramps().len() as u32
    }

    fn share_within(&self, seconds: f64) -> f64 {
        (seconds / s_from_fs(self.length_fs())).min(1.0)
    }

    fn occupancy(&self) -> Option<Occupancy> {
        Some(Occupancy {
            fs: self.length_fs(),
            table: "chirp",
            with: "",
            remedy: "shorter ramps, a shorter light_range_m",
        })
    }

    fn ambiguity(&self) -> &'static str {
        "as far as its samples hold the beats"
    }

    fn sees_motion(&self) -> bool {
        true
    }

    fn measures_speed(&self) -> bool {
        self.down_fs > 0
    }

    fn numbers(&self, add: &mut dyn FnMut(&[u64])) {
        add(&[self.up_fs as u64, self.down_fs as u64, self.settle_fs as u64]);
        add(&[self.bandwidth.to_bits()]);
    }

    fn description(&self, number: fn(f64) -> String) -> Vec<String> {
        let (ghz, us) = (self.bandwidth * 1e-9, s_from_fs(self.length_fs()) * 1e6);
        let times: Vec<String> =
            self.ramps().iter().map(|ramp| format!("{} us", number(ramp.seconds * 1e6))).collect();
        let cell = number(range_from_tof(1.0 / self.bandwidth));
        vec![
            format!("a frequency that changes by {} GHz, in {} us", number(ghz), number(us)),
            format!("recorded for {}: bins of {cell} m", times.join(" up and ")),
            format!("line {} kHz wide", number(self.linewidth * 1e-3)),
        ]
    }
}

/// `[chirp]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ChirpFile {
    /// Change of the frequency while a ramp is recorded, GHz.
    #[schemars(range(min = 1e-6, max = 1e5))]
    bandwidth_ghz: f64,
    /// How long the rising ramp is recorded, µs.
    #[schemars(range(min = 0.001, max = 1e5))]
    up_us: f64,
    /// How long the falling ramp is recorded, µs; 0 for a single ramp. Left out: as long as the rising one.
    #[schemars(range(min = 0, max = 1e5))]
    down_us: Option<f64>,
    /// Time before each ramp that is not recorded, µs. Left out: the flight of light from light_range_m.
    #[schemars(range(min = 0, max = 1e5))]
    settle_us: Option<f64>,
    /// Spectral width of the laser's line (full width at half maximum), kHz. Left out: 0, a line without width.
    #[schemars(range(min = 0, max = 1e6))]
    linewidth_khz: Option<f64>,
    /// How far the frequency strays from its ramps, as a sine over time, MHz. Left out: 0.
    #[schemars(range(min = 0, max = 1e5))]
    error_mhz: Option<f64>,
    /// How often per second it does, kHz; with `error_mhz`.
    #[schemars(range(min = 0, max = 1e6))]
    error_khz: Option<f64>,
}

impl OptionalTable for ChirpFile {
    fn idle(&self, _: &SensorFile) -> Vec<Idle> {
        let no_pulse = ["tdc", "light.pulse_ps", "light.linewidth_ghz"];
        let why = "light with a chirp has no pulses, and its line is that of chirp.linewidth_khz";
        let mut idle = Idle::all(&no_pulse, "chirp", why);
        let of_mode = ["optics.filter_nm", "optics.field"];
        let why = "light of the mode of the laser alone makes a beat";
        idle.extend(Idle::all(&of_mode, "chirp", why));
        if self.down_us == Some(0.0) {
            let (speed, why) = (["receiver.max_speed_m_s"], "a single ramp measures no speed");
            idle.extend(Idle::all(&speed, "chirp.down_us", why));
        }
        idle
    }

    fn continuous(&self) -> Option<&dyn Continuous> {
        Some(self)
    }
}

impl Continuous for ChirpFile {
    fn table(&self) -> &'static str {
        "chirp"
    }

    fn varies(&self) -> &'static str {
        "a frequency"
    }

    fn detector(&self) -> &'static str {
        "coherent"
    }

    fn readout(&self, check: &Check, file: &SensorFile) -> Result<(Clock, Readout), Error> {
        match &file.spectrum {
            Some(spectrum) => check.spectrum(spectrum),
            None => {
                Err(check.chain.lacks("spectrum", "records the beats of a [chirp], and is missing"))
            }
        }
    }

    fn emission(&self, check: &Check, shot: Coding, farthest: f64) -> Result<Emission, Error> {
        Ok(Emission::Chirped(check.chirp(self, shot, farthest)?))
    }
}

impl Check<'_> {
    /// The chirp, whose shots are `shot`; light is followed to `farthest` metres.
    fn chirp(&self, file: &ChirpFile, shot: Coding, farthest: f64) -> Result<Chirp, Error> {
        let seconds = |key: &str, us: f64, least: f64| -> Result<f64, Error> {
            Ok(self.within(key, us, least, 1e5)? * 1e-6)
        };
        let up = seconds("chirp.up_us", file.up_us, 1e-3)?;
        let down = match file.down_us {
            Some(typed) => seconds("chirp.down_us", typed, 0.0)?,
            None => up,
        };
        let flight = tof_from_range(farthest);
        let settle = match file.settle_us {
            Some(typed) => seconds("chirp.settle_us", typed, 0.0)?,
            None => flight,
        };
        if settle < flight {
            let message = format!(
                "is {}, but light is on its way from {farthest:.1} m, the end of light_range_m, for {:.3}: leave it \
                 out, or write as much",
                settle * 1e6,
                (flight * 1e9).ceil() * 1e-3
            );
            return self.refuse("chirp.settle_us", message);
        }
        let hz = |key: &str, typed: Option<f64>, unit: f64, most: f64| -> Result<f64, Error> {
            Ok(self.within(key, typed.unwrap_or(0.0), 0.0, most)? * unit)
        };
        let amplitude = hz("chirp.error_mhz", file.error_mhz, 1e6, 1e5)?;
        let rate = hz("chirp.error_khz", file.error_khz, 1e3, 1e6)?;
        if (amplitude > 0.0) != (rate > 0.0) {
            let message = "says how often it strays by error_mhz: give both, or leave both out";
            return self.refuse("chirp.error_khz", message);
        }
        Ok(Chirp {
            shot,
            bandwidth: self.within("chirp.bandwidth_ghz", file.bandwidth_ghz, 1e-6, 1e5)? * 1e9,
            up_fs: fs_from_s(up),
            down_fs: fs_from_s(down),
            settle_fs: fs_from_s(settle),
            linewidth: hz("chirp.linewidth_khz", file.linewidth_khz, 1e3, 1e6)?,
            error: ChirpError { amplitude, rate },
        })
    }
}
