//! Range by Eq. 1 out of the records that receivers are given: simulated walls at known range, white, in the dark.

use std::f64::consts::TAU;

use crate::paper::Error;
use crate::paper::lidars::{AMCW, FMCW, PULSED, named};
use crate::paper::side_by_side::first_shots;
use crate::paper::walls;
use macropulse::codec::decode::beat::Ramp;
use macropulse::codec::{Beats, Given, Taps};
use macropulse::design::{Design, Emission};
use macropulse::predict::ranging::{amplitude_modulated, frequency_modulated, pulsed};
use macropulse::sim::{self, Scans};
use macropulse::units::{range_from_tof, s_from_fs};

/// The nearer wall of each method, m.
const RANGE: f64 = 42.0;

/// Modulation of the AMCW lidar, Hz. Its phase comes round once in 75 m.
const MODULATION: f64 = 2e6;

/// Shots at each wall.
const SHOTS: u64 = 256;

const SEED: u64 = 1;

/// A wall, and its range as measured.
#[derive(Debug, Clone, Copy)]
pub struct Ranging {
    /// Its true range.
    pub wall: f64,
    /// Shots that found it.
    pub shots: u64,
    /// Mean range by Eq. 1.
    pub equation: f64,
    /// Standard error of that mean.
    pub error: f64,
    /// Mean range of the points of the lidar's own receiver.
    pub points: f64,
}

/// A wall before a frequency sweep, by three readings of Eq. 1.
#[derive(Debug, Clone, Copy)]
pub struct Triangles {
    /// With B the beat and Δf the excursion of the sweep.
    pub found: Ranging,
    /// Mean range with Δf the difference between what is sent and received, as printed, which is the beat again.
    pub printed: f64,
    /// Mean range with that Δf and B the excursion, a bandwidth.
    pub swapped: f64,
}

/// A wall at `wall` metres before `design`, and the mean of each value of `read`. That is given the time of flight of a
/// return, s, the record of its band and its shot there. The range by Eq. 1 is its first value.
fn measured<const N: usize>(
    design: &Design,
    wall: f64,
    read: impl Fn(f64, &Given, usize) -> Option<[f64; N]>,
) -> Result<(Ranging, [f64; N]), Error> {
    let scene = walls::around((wall, 0.9), "vacuum-dark")?;
    let scans = Scans::new(design, &scene, SEED)?;
    let (mut values, mut points) = (Vec::new(), 0.0);
    for band in first_shots(design, SHOTS) {
        let (log, given) = scans.record(&band);
        let returns = design.receive(&log, &given).map_err(sim::Error::from)?;
        for (&shot, &tof) in returns.shot.iter().zip(&returns.tof) {
            if let Some(value) = read(tof, &given, shot as usize) {
                values.push(value);
                points += range_from_tof(tof);
            }
        }
    }
    let count = values.len() as f64;
    let means: [f64; N] =
        std::array::from_fn(|at| values.iter().map(|value| value[at]).sum::<f64>() / count);
    let squares = values.iter().map(|value| (value[0] - means[0]).powi(2)).sum::<f64>();
    let ranging = Ranging {
        wall,
        shots: values.len() as u64,
        equation: means[0],
        error: (squares / (count - 1.0) / count).sqrt(),
        points: points / count,
    };
    Ok((ranging, means))
}

/// d = c·Δt/2, Δt from the returns of the receiver of ticks.
pub(super) fn pulses() -> Result<Ranging, Error> {
    let design = named(PULSED).design(&[])?;
    Ok(measured(&design, RANGE, |flight, _, _| Some([pulsed(flight)]))?.0)
}

/// d = ϕ·c/(4π·f), ϕ from the taps. The second wall is farther by the range after which the phase comes round, the third
/// result.
pub(super) fn phases() -> Result<(Ranging, Ranging, f64), Error> {
    let tone = format!("[{:?}]", MODULATION * 1e-6);
    let design = named(AMCW).design(&[
        ("modulation.frequencies_mhz", &tone),
        ("detector.lock-in.contrast", "[0.8]"),
        ("scan.max_range_m", "74.0"),
    ])?;
    let equation = |_: f64, given: &Given, shot: usize| match given {
        Given::Taps(taps) => Some([amplitude_modulated(phase(taps, shot), MODULATION)]),
        _ => None,
    };
    let wraps = range_from_tof(MODULATION.recip());
    let near = measured(&design, RANGE, equation)?.0;
    let beyond = measured(&design, RANGE + wraps, equation)?.0;
    Ok((near, beyond, wraps))
}

/// Phase of the light of a shot, 0 to 2π. Each of n taps is collected a part 1/n of a period later than the one before.
fn phase(taps: &Taps, shot: usize) -> f64 {
    let codes = taps.of(shot);
    let (mut in_phase, mut quadrature) = (0.0, 0.0);
    for (tap, code) in codes.iter().enumerate() {
        let (sine, cosine) = libm::sincos(TAU * tap as f64 / codes.len() as f64);
        in_phase += f64::from(*code) * cosine;
        quadrature += f64::from(*code) * sine;
    }
    libm::atan2(quadrature, in_phase).rem_euclid(TAU)
}

/// d = c·B·T/(4·Δf) by its three readings, from the strongest beat of each ramp.
pub(super) fn triangles() -> Result<[Triangles; 2], Error> {
    let design = named(FMCW).design(&[])?;
    let Emission::Chirped(chirp) = &design.emission else { return Err(Error::Sensor) };
    let period = s_from_fs(chirp.up_fs + chirp.down_fs);
    let excursion = chirp.bandwidth;
    let ramps = chirp.ramps();
    let read = |_: f64, given: &Given, shot: usize| {
        let Given::Beats(beats) = given else { return None };
        let beat = beat(beats, shot, &ramps)?;
        let range = |beat, excursion| frequency_modulated(beat, period, excursion);
        Some([range(beat, excursion), range(beat, beat), range(excursion, beat)])
    };
    let wall = |wall: f64| -> Result<Triangles, Error> {
        let (found, [_, printed, swapped]) = measured(&design, wall, read)?;
        Ok(Triangles { found, printed, swapped })
    };
    Ok([wall(RANGE)?, wall(2.0 * RANGE)?])
}

/// The beat of a shot, Hz: the mean over its `ramps`, so that a Doppler shift would cancel.
fn beat(beats: &Beats, shot: usize, ramps: &[Ramp]) -> Option<f64> {
    let strongest = beats.of(shot).chunks(beats.peaks as usize).map(|peaks| peaks.first());
    let each = ramps.iter().zip(strongest).map(|(ramp, peak)| Some(peak?.bins() / ramp.seconds));
    Some(each.sum::<Option<f64>>()? / ramps.len() as f64)
}
