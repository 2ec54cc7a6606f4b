//! Assessment of a candidate by closed forms: the energy that eyes allow, the least aperture that does, and
//! the limit that it meets first.

use argmin::core::{CostFunction, Executor, State};
use argmin::solver::neldermead::NelderMead;
use macropulse::design::safety::strictest;
use macropulse::design::{Design, Detector};
use macropulse::predict::verdict::slant;
use macropulse::predict::{Forecaster, stray_room};
use macropulse::units::{RMS_OF_FWHM, range_from_tof, tof_from_range};

use super::candidate::Candidate;
use super::requirements::Requirements;
use super::{Error, Limit};

/// Relative tolerance of the area of the aperture.
const TOLERANCE: f64 = 0.02;

/// Areas of the aperture are tried from the largest one allowed by such factors, up to [`MOST`] of it.
const STRIDE: f64 = 4.0;

/// Beyond this factor on the area, the factor is not told.
const MOST: f64 = 1e6;

/// Rms length of the response of a Gaussian low-pass times its bandwidth, √(ln 2)/(2π).
const RMS_BY_BANDWIDTH: f64 = 0.132_505_181_759_698_4;

/// Least rms length of a mark in samples: a sampled detector takes no shorter one.
const SAMPLES: f64 = 1.0 / 1.5;

/// Assessment of a candidate by closed forms.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessed {
    /// The candidate, its energy what eyes and its receiver allow, its aperture the least that does; the largest allowed
    /// where none does.
    pub candidate: Candidate,
    /// Time between shots of a channel, s.
    pub period: f64,
    /// Probability of a return at the range wanted.
    pub pd: f64,
    /// Standard deviation of the range there, m; `None` where next to nothing is seen.
    pub precision: Option<f64>,
    /// The limit in its way, and the factor by which it is missed; `None` for a candidate that does.
    pub limit: Option<(Limit, f64)>,
}

/// The range at which least is found: a trial's wall stands at one range, where other marks are lost to own light than
/// at others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worst {
    /// That range, m.
    pub range: f64,
    /// Probability of a return there.
    pub pd: f64,
}

/// Energy, J, that laser class 1 allows to a shot of the sensor, the share wanted of it.
pub(super) fn energy(design: &Design, required: &Requirements) -> Option<f64> {
    strictest(design.eye_limits()).map(|limit| required.parts.energy_share * limit.energy)
}

/// Energy of a shot, J, small enough to ask only how much more eyes allow.
pub(super) const DIM: f64 = 1e-12;

/// As bright as eyes allow.
pub(super) fn for_eyes(required: &Requirements, dim: Candidate) -> Result<Candidate, Error> {
    // Class 1 asks for no energy but that of the shots beside each other.
    let energy = energy(&dim.unlimited(required)?, required).ok_or_else(|| {
        Error::Asked(format!("no limit of class 1 is known at {} nm", dim.part.wavelength_nm))
    })?;
    Ok(Candidate { energy, ..dim })
}

/// As bright as eyes and its own stray light allow.
pub(super) fn brightest(required: &Requirements, dim: Candidate) -> Result<Candidate, Error> {
    let (bright, share) = bearable(required, for_eyes(required, dim)?)?;
    Ok(Candidate { energy: share * bright.energy, ..bright })
}

/// `candidate`, and the share of its light with which the stray light of its own marks is over when a channel listens
/// again. One that waits listens later if it must.
fn bearable(required: &Requirements, candidate: Candidate) -> Result<(Candidate, f64), Error> {
    // A little less, so that no rounding is more.
    let share =
        |design: &Design| stray_room(design).map_or(1.0, |room| (room * (1.0 - 1e-9)).min(1.0));
    let at_once = share(&candidate.unlimited(required)?);
    if at_once == 1.0 || !candidate.waits() {
        return Ok((candidate, at_once));
    }
    let late = Candidate { is_late: true, ..candidate };
    let share = share(&late.unlimited(required)?);
    Ok((late, share))
}

/// Largest share of the codes of the converter for the echo of the target wanted. More light would find
/// nothing more, and long clipping near the end of the range gate would lose echoes.
const SCALE: f64 = 0.5;

/// `candidate`, no brighter than the converter bears with its aperture.
pub(super) fn within_scale(
    required: &Requirements,
    candidate: Candidate,
) -> Result<Candidate, Error> {
    let wanted = &required.wanted;
    let design = candidate.unlimited(required)?;
    let (Detector::Sampled(detector), Some(budget)) = (&design.detector, &design.budget) else {
        return Ok(candidate);
    };
    let mark = candidate.energy / f64::from(candidate.marks);
    let sent_back = budget.photons(mark, wanted.reflectance, wanted.range_m) * budget.efficiency;
    let most = SCALE * f64::from(detector.codes.1) * detector.step;
    let energy = candidate.energy * (most / sent_back).min(1.0);
    Ok(Candidate { energy, ..candidate })
}

/// The assessment of `candidate`, which is as bright as eyes and its stray light allow.
pub(super) fn assess(required: &Requirements, candidate: Candidate) -> Result<Assessed, Error> {
    let wanted = &required.wanted;
    let design = candidate.design(required)?;
    let period = design.scan.shortest_period();
    let forecaster = Forecaster::new(&design, &required.environment)?;
    let needed = area(required, &forecaster, period);
    let [least, _] = required.parts.aperture_mm.map(|mm| (mm * 1e-3 / candidate.aperture).powi(2));
    let factor = needed.clamp(least, 1.0);
    let aperture = candidate.aperture * factor.sqrt();
    let bright = candidate.energy;
    let candidate = within_scale(required, Candidate { aperture, ..candidate })?;
    let forecaster = with_area(&forecaster, factor).with_light(candidate.energy / bright);
    let forecast = forecaster.forecast(wanted.reflectance, wanted.range_m);
    let listens = tof_from_range(wanted.range_m);
    let smeared = slant(&design, wanted.range_m).map_or(0.0, |check| check.shortfall);
    let limit = if candidate.waits() && listens > period {
        Some((Limit::Time, listens / period))
    } else if smeared > 1.0 {
        Some((Limit::Slant, smeared))
    } else if needed > 1.0 {
        Some((Limit::Light, needed))
    } else {
        candidate.beyond_mirror(required).map(|factor| (Limit::Mirror, factor))
    };
    Ok(Assessed { candidate, period, pd: forecast.pd, precision: forecast.precision, limit })
}

/// The target wanted, up to the range wanted, at which `candidate` is forecast to find least.
pub(super) fn worst(required: &Requirements, candidate: &Candidate) -> Result<Worst, Error> {
    let wanted = &required.wanted;
    let design = candidate.design(required)?;
    let forecaster = Forecaster::new(&design, &required.environment)?;
    let worst = forecaster.worst(wanted.reflectance, wanted.range_m);
    Ok(Worst { range: worst.range, pd: worst.pd })
}

/// The forecaster with `factor` times the area of the aperture: light and daylight.
fn with_area<'a>(forecaster: &Forecaster<'a>, factor: f64) -> Forecaster<'a> {
    forecaster.with_light(factor).with_background(factor)
}

/// The least area of the aperture, over that of the design, with which targets are found as wanted.
fn area(required: &Requirements, forecaster: &Forecaster, period: f64) -> f64 {
    let wanted = &required.wanted;
    let range = clear(wanted.range_m, period);
    let does = |area: f64| {
        let forecast = with_area(forecaster, area).forecast(wanted.reflectance, range);
        forecast.pd >= wanted.pd && forecast.precision.is_some_and(|m| m <= wanted.precision_m)
    };
    let [mut low, mut high] = match does(1.0) {
        true => [1.0 / STRIDE, 1.0],
        false => [1.0, STRIDE],
    };
    while low > 1.0 / MOST && does(low) {
        (low, high) = (low / STRIDE, low);
    }
    while !does(high) {
        if high > MOST {
            return f64::INFINITY;
        }
        (low, high) = (high, high * STRIDE);
    }
    while high > (1.0 + TOLERANCE) * low {
        let middle = (low * high).sqrt();
        *(if does(middle) { &mut high } else { &mut low }) = middle;
    }
    high
}

/// The range closest to `range`, m, and no farther, at which echoes come half-way between the shots of a
/// channel, `period` seconds apart; `range` itself if that is beyond. An echo that comes with a shot loses
/// marks to its stray light, over some metres in all: a simulation tells the share of all ranges.
fn clear(range: f64, period: f64) -> f64 {
    let between = range_from_tof(period);
    match (range / between).floor() {
        0.0 => range,
        shots => (shots + 0.5) * between,
    }
    .min(range)
}

/// Returns `dim` with the pulse and the bandwidth that need the least aperture, and the shortest words of
/// such marks.
///
/// The search is Nelder and Mead's simplex over their logarithms. It starts with a low-pass as long as the
/// pulse. The shorter a pulse, the more it exceeds the noise. This ends at the noise of the capacitance,
/// which grows with the bandwidth, at the samples, or at a slanted surface.
pub(super) fn shaped(
    required: &Requirements,
    dim: &Candidate,
    sample: f64,
) -> Result<Candidate, Error> {
    let [least, most] = required.parts.pulse_ps.map(|ps| ps * 1e-12);
    let bandwidth = dim.part.most_bandwidth_mhz * 1e6;
    let bounds = Bounds { pulse: [least, most], bandwidth, sample };
    let start = bounds.inside([(least * 1.6).ln(), (0.3 / (least * 1.6)).ln()]);
    let simplex =
        vec![start.to_vec(), vec![start[0] + 0.4, start[1]], vec![start[0], start[1] - 0.4]];
    let bright = for_eyes(required, bounds.candidate(required, dim, start)?)?;
    let cost = Cost { required, bright: &bright, bounds };
    let failed = |error: argmin::core::Error| Error::Asked(error.to_string());
    let solver = NelderMead::new(simplex).with_sd_tolerance(0.005).map_err(failed)?;
    let run = Executor::new(cost, solver).configure(|state| state.max_iters(ITERATIONS));
    let found = run.run().map_err(failed)?;
    let best = found.state().get_best_param().cloned().unwrap_or_else(|| start.to_vec());
    bounds.candidate(required, dim, bounds.inside([best[0], best[1]]))
}

/// Steps of the simplex at most: what it has found by then is taken.
const ITERATIONS: u64 = 40;

/// How steeply pulses cost that are too short for a surface aslant. In white noise the area grows with the root
/// of the pulse: any slope far above that keeps to pulses that are long enough.
const STEEP: f64 = 10.0;

/// Within which pulse and bandwidth are looked for.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    /// Shortest and longest pulse, s.
    pulse: [f64; 2],
    /// Most bandwidth, Hz.
    bandwidth: f64,
    /// From sample to sample, s.
    sample: f64,
}

impl Bounds {
    /// The nearest logarithms of pulse and bandwidth that may be.
    fn inside(&self, [pulse, bandwidth]: [f64; 2]) -> [f64; 2] {
        let [least, most] = self.pulse;
        let pulse = pulse.exp().clamp(least, most);
        let bandwidth = bandwidth.exp().clamp(1e6, self.bandwidth);
        // As long as the samples ask for, the low-pass longer if need be.
        let rest = (SAMPLES * self.sample * 1.001).powi(2) - (RMS_OF_FWHM * pulse).powi(2);
        let most = if rest > 0.0 { RMS_BY_BANDWIDTH / rest.sqrt() } else { f64::INFINITY };
        [pulse.ln(), bandwidth.min(most).ln()]
    }

    /// As `like` with the pulse and bandwidth of these logarithms, in whole picoseconds and megahertz, and the
    /// shortest words of such marks.
    fn candidate(
        &self,
        required: &Requirements,
        like: &Candidate,
        [pulse, bandwidth]: [f64; 2],
    ) -> Result<Candidate, Error> {
        let pulse = (pulse.exp() * 1e12).round() * 1e-12;
        let bandwidth = (bandwidth.exp() * 1e-6).floor() * 1e6;
        required.with_shortest_words(Candidate { pulse, bandwidth, ..like.clone() })
    }
}

/// The area of the aperture that a pulse and a bandwidth need.
struct Cost<'a> {
    required: &'a Requirements,
    /// As bright as eyes allow, which hardly depends on them.
    bright: &'a Candidate,
    bounds: Bounds,
}

impl CostFunction for Cost<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    /// The logarithm of the area; beside the bounds more by the distance, and more where marks are smeared.
    fn cost(&self, at: &Self::Param) -> Result<Self::Output, argmin::core::Error> {
        let required = self.required;
        let at = [at[0], at[1]];
        let inside = self.bounds.inside(at);
        let beside = (at[0] - inside[0]).abs() + (at[1] - inside[1]).abs();
        let candidate = self.bounds.candidate(required, self.bright, inside)?;
        // Longer marks take longer words, for which there is no time.
        let over = required.macropulse(&candidate) / required.mean_period(candidate.beams);
        if over > 1.0 {
            return Ok(MOST.ln() + beside + over);
        }
        let (candidate, share) = bearable(required, candidate)?;
        let design = candidate.unlimited(required)?;
        let forecaster = Forecaster::new(&design, &required.environment)?.with_light(share);
        let period = design.scan.shortest_period();
        let range = required.wanted.range_m;
        let smeared = slant(&design, range).map_or(0.0, |check| check.shortfall.max(1.0).ln());
        Ok(area(required, &forecaster, period).min(MOST).ln() + beside + STEEP * smeared)
    }
}
