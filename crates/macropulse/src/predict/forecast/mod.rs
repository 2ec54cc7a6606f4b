//! The forecast of a scan for a target at one range, in closed form.
//!
//! The target is extended, Lambertian and square on, and fills the surroundings: the light of the other shots
//! in flight comes from it too. The beam is a line.

mod needed;
mod not_modelled;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use macropulse_codec::decode::{self, Method};

use super::best_lag::{BestLag, Sight};
use super::converters::bank_loss;
use super::own_light::{OwnLight, stray_room};
use super::sidelobes::{Aside, Sidelobes};
use super::way::{self, ClosedForm, Incident};
use super::{balanced, belief, matched, sampled};
use crate::channel::{self, Operating, Speckle};
use crate::design::detector::{Awaited, Lit, Model, PLENTY, Sampled};
use crate::design::{Design, Detector};
use crate::environment::Environment;
use crate::units::{RMS_OF_FWHM, range_from_tof, s_from_fs, tof_from_range};

/// There is no forecast of a sensor: why, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// It cannot be simulated in the environment either.
    #[error(transparent)]
    Operating(#[from] channel::Error),
    /// It can be simulated, but what becomes of its light has no closed form here.
    #[error("{sensor}: there is no forecast of {what}: {remedy}")]
    NotModelled {
        /// The sensor.
        sensor: String,
        /// The effect without a closed form.
        what: String,
        /// A way to get an answer all the same.
        remedy: String,
    },
}

/// A sensor in an environment, perhaps with more or less light than it has.
#[derive(Debug, Clone)]
pub struct Forecaster<'a> {
    design: &'a Design,
    operating: Operating,
    /// Mean time between shots of the same detector, s.
    channel_period: f64,
    /// Number of macropulses by their number of marks, dark ones left out.
    weights: BTreeMap<usize, usize>,
    mean_weight: f64,
    /// Shots that may lead a matched receiver to expect light of one, on average.
    neighbours: f64,
    /// Those of a matched receiver; the dark chips of a balanced one have none.
    sidelobes: Option<Sidelobes>,
    /// The points of the sums over noise, of a receiver of samples; empty of the others.
    points: Arc<[sampled::Points]>,
    /// For a way to measure that has one of its own.
    closed_form: Option<Arc<dyn ClosedForm>>,
    /// Factor on the light of the sensor.
    light: f64,
    /// Factor on the dark and background counts.
    background: f64,
}

/// A precision needs at least one return in this number of shots.
const FEWEST: f64 = 1e6;

/// Expected measurements of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forecast {
    /// Range, m.
    pub range: f64,
    /// Reflectance of the target.
    pub reflectance: f64,
    /// Photons of a shot that reach the detector, the mean over labels; detected ones where the
    /// sensor has no link budget; infinite, as [`Forecast::detected_per_mark`], where it never misses.
    pub photons_per_shot: f64,
    /// Photons detected per mark.
    pub detected_per_mark: f64,
    /// Probability that a mark makes a tick where it is looked for.
    pub mark_pd: f64,
    /// Share of detection events that find every converter busy.
    pub bank_loss: f64,
    /// Probability that a place in the gate is lit by something else.
    pub density: f64,
    /// Ratio of signal to noise:
    ///
    /// * with a code, the marks expected over the spread of those lit by chance, (p − d)·√N/√(d·(1 − d)), of
    ///   a shot with the mean number N of marks;
    /// * without a code, photons over their noise, infinite if the sensor never misses;
    /// * of samples, the mean of the marks over its noise;
    /// * of a histogram, √(2Λ), Λ the logarithm of the likelihood of its mean counts with an echo over that
    ///   without;
    /// * without pulses, amplitude over noise.
    pub snr: f64,
    /// Probability that a shot which is lit gives a return there.
    pub pd: f64,
    /// False returns per shot that meets nothing.
    pub false_per_shot: f64,
    /// Standard deviation of the range of returns, m, sidelobes apart; `None` where there are next to
    /// none, fewer than one in a million.
    pub precision: Option<f64>,
    /// Returns that lie on a sidelobe of their own macropulse, where neighbours tell which of several as
    /// high ones is the peak. `None` without a matched receiver, and where there is no precision.
    pub aside: Option<Aside>,
    /// The least deviation of any unbiased estimate from the same number of photons, m: c/2·σ/√n, σ the rms
    /// length of a micropulse with the jitter.
    pub bound: f64,
}

impl<'a> Forecaster<'a> {
    /// The sensor as it is, in `environment`.
    ///
    /// # Errors
    /// As [`Operating::of`]; for the receivers that decide bit by bit; and where marks of a code word
    /// follow each other so soon that they are one to the detector.
    pub fn new(design: &'a Design, environment: &Environment) -> Result<Self, Error> {
        let operating = Operating::of(design, environment)?;
        if let Some((what, remedy)) = not_modelled::reason(design, &operating) {
            return Err(Error::NotModelled { sensor: design.name.clone(), what, remedy });
        }
        let codebook = &design.emission.coding().codebook;
        let mut weights = BTreeMap::new();
        let sent = (0..codebook.labels() as u16)
            .flat_map(|label| (0..codebook.words() as u16).map(move |word| (label, word)))
            .map(|(label, word)| codebook.marks(label, word).len());
        for weight in sent.filter(|&weight| weight > 0) {
            *weights.entry(weight).or_insert(0) += 1;
        }
        let channel_period = design.scan.shortest_period();
        let mean_weight = codebook.mean_weight();
        let (light, background) = (1.0, 1.0);
        let is_matched = matches!(design.receiver.method, Method::Matched(..));
        let sidelobes = is_matched.then(|| Sidelobes::of(design));
        let neighbours = if is_matched { belief::neighbours(design) } else { 0.0 };
        let sampling = design.receiver.method.sampling();
        let points = sampling.map_or_else(Vec::new, |known| sampled::Points::of(design, known));
        Ok(Self {
            design,
            operating,
            channel_period,
            weights,
            mean_weight,
            neighbours,
            sidelobes,
            points: points.into(),
            closed_form: way::of(design).and_then(|way| (way.closed_form)(design)),
            light,
            background,
        })
    }

    /// The sensor.
    pub fn design(&self) -> &'a Design {
        self.design
    }

    /// The quantities that follow from the sensor and its environment.
    pub fn operating(&self) -> &Operating {
        &self.operating
    }

    /// The same forecaster with `factor` times the light.
    pub fn with_light(&self, factor: f64) -> Self {
        Self { light: self.light * factor, ..self.clone() }
    }

    /// The same forecaster with `factor` times the dark and background counts.
    pub fn with_background(&self, factor: f64) -> Self {
        Self { background: self.background * factor, ..self.clone() }
    }

    /// The forecast for a target of `reflectance` at `range` metres. If speckle is simulated, probabilities
    /// are the mean over the brightness of an echo, and precision is that over the echoes that are seen.
    pub fn forecast(&self, reflectance: f64, range: f64) -> Forecast {
        let told = self.own_light(range).map(|own| own.told_at(range));
        self.of_told(reflectance, range, told.as_deref().unwrap_or_default())
    }

    /// The least that it will find up to `farthest` metres of a target of `reflectance`, and where: as
    /// [`Forecaster::forecast`], at the one of all ranges that is worst. Next to where a channel of samples has just
    /// sent a mark nothing is told, and nothing is asked. Near by, where marks are clipped, more may be found.
    pub fn worst(&self, reflectance: f64, farthest: f64) -> Forecast {
        let mut worst = self.forecast(reflectance, farthest);
        let Some(own) = self.own_light(farthest) else { return worst };
        // Two ranges with the same numbers of visible marks differ only in light. The farther one has less.
        let mut looked_at = BTreeSet::new();
        for (range, told) in own.each_change(self.design.scan.min_range, farthest) {
            let mut sorted = told.clone();
            sorted.sort_unstable();
            if looked_at.insert(sorted) {
                let here = self.of_told(reflectance, range, &told);
                if here.pd < worst.pd {
                    worst = here;
                }
            }
        }
        worst
    }

    /// The detector and its receiver, if it is sampled.
    fn sampled(&self) -> Option<(&Sampled, &decode::Sampled)> {
        match (&self.design.detector, &self.design.receiver.method) {
            (Detector::Sampled(detector), Method::Sampled(settings)) => Some((detector, settings)),
            _ => None,
        }
    }

    /// The light that blinds the channels of a sampled sensor to echoes from up to `farthest` metres.
    fn own_light(&self, farthest: f64) -> Option<OwnLight> {
        let (detector, settings) = self.sampled()?;
        let background = self.background * self.operating.background;
        let blind = sampled::blind(detector, &settings.sampling, background);
        Some(OwnLight::of(self.design, blind, tof_from_range(farthest)))
    }

    /// The same forecast if the shots have the numbers of marks in `told`. Only receivers of samples use
    /// these.
    fn of_told(&self, reflectance: f64, range: f64, told: &[usize]) -> Forecast {
        let mean = self.of_brightness(reflectance, range, told);
        let Some(speckle) = Speckle::simulated(self.design) else { return mean };
        let (mut pd, mut mark_pd, mut square) = (0.0, 0.0, 0.0);
        for (brightness, share) in brightnesses(speckle.cells(range, 1.0)) {
            let one = self.of_brightness(brightness * reflectance, range, told);
            pd += share * one.pd;
            mark_pd += share * one.mark_pd;
            square += share * one.pd * one.precision.unwrap_or(0.0).powi(2);
        }
        let is_seen = pd * FEWEST >= 1.0;
        Forecast {
            pd: pd.min(1.0),
            mark_pd: mark_pd.min(1.0),
            precision: is_seen.then(|| (square / pd).sqrt()),
            ..mean
        }
    }

    /// The same of an echo that is as bright as it is on average.
    fn of_brightness(&self, reflectance: f64, range: f64, told: &[usize]) -> Forecast {
        let (design, operating) = (self.design, &self.operating);
        if let Some(sampled) = self.sampled() {
            return self.of_samples(sampled, reflectance, range, told);
        }
        if let Some(form) = &self.closed_form {
            return self.of_form(form.as_ref(), reflectance, range);
        }
        let detected = self.light * operating.link.detected(reflectance, range);
        let detector = design.detector.model();
        let (channel_period, mean_weight) = (self.channel_period, self.mean_weight);
        let false_rate = self.background * operating.false_rate;
        let photon_rate = self.falling_of(detected) * mean_weight / channel_period;
        let falling = false_rate + photon_rate;
        let mark = Lit { photons: detected, background: operating.background, falling };
        let false_events = false_rate * detector.ready_share(falling);
        // Events that share a tick keep a single converter busy.
        let tick = s_from_fs(design.clock.tick_fs);
        let own = matched::ticks_lit(design, &mark) * mean_weight / channel_period;
        let events = -libm::expm1(-(false_events + own) * tick) / tick;
        let loss = design.bank().map_or(0.0, |share| bank_loss(&share, events));
        let place = matched::Place::of(design, &mark);
        // An overrun bank stays lit until the last converter is taken: losing the rest makes it no clearer.
        let density = -libm::expm1(-(false_events + own) * place.width);
        let seen = place.seen(design, &mark) * (1.0 - loss);
        // Shots that meet the same range overlap where a macropulse is longer than the time to the next.
        let false_density = -libm::expm1(-false_events * place.width);
        let macropulse = s_from_fs(design.emission.length_fs());
        let at_the_lag = if macropulse <= channel_period { false_density } else { density };
        let mark_pd = 1.0 - (1.0 - seen) * (1.0 - at_the_lag);

        let efficiency = design.efficiency();
        let found = matched::Found { seen: mark_pd, false_density };
        let chances = match &design.receiver.method {
            Method::Matched(correlation, _) => {
                let ticks = tof_from_range(range) / s_from_fs(design.clock.tick_fs);
                let converted = 1.0 - loss;
                let sight = Sight { late: ticks.fract(), density: at_the_lag, converted };
                let shots = belief::Shots {
                    weights: &self.weights,
                    neighbours: self.neighbours,
                    lag: ticks as i64,
                    seen: BestLag::of(design, &mark, &sight),
                    false_density,
                };
                belief::chances(design, correlation, &shots)
            }
            Method::Balanced(correlation) => {
                let tof = tof_from_range(range);
                balanced::chances(design, correlation, &self.weights, &found, tof)
            }
            // The first event in the gate is taken.
            _ => {
                let awaited = Awaited {
                    since: since_opening(design, range),
                    photons: detected,
                    false_rate,
                    falling,
                    period: channel_period,
                    mark_pd,
                    converted: 1.0 - loss,
                };
                let echo = detector.first_event(&awaited);
                let since = since_opening(design, design.scan.max_range);
                let nothing = Awaited { since, photons: 0.0, mark_pd: 0.0, ..awaited };
                let false_per_shot = detector.first_event(&nothing).is_false;
                let lone = matched::Lone::default();
                matched::Chances { pd: echo.is_echo, false_per_shot, found: 1.0, lone }
            }
        };
        let spread = (density * (1.0 - density)).max(f64::MIN_POSITIVE).sqrt();
        let timing = matched::Timing::of(design, &mark);
        let matched::Chances { pd, false_per_shot, found, lone } = chances;
        let marks_seen = (mean_weight * found).max(1.0);
        let is_seen = pd * FEWEST >= 1.0;
        let photons = (detected * mean_weight).max(f64::MIN_POSITIVE);
        Forecast {
            range,
            reflectance,
            photons_per_shot: detected * mean_weight / efficiency,
            detected_per_mark: detected,
            mark_pd,
            bank_loss: loss,
            density,
            snr: match design.is_coded() {
                true => (mark_pd - density) * mean_weight.sqrt() / spread,
                false if detected.is_infinite() => f64::INFINITY,
                false => {
                    let noise = detector.noise(operating.background);
                    detected / noise.map_or(detected.sqrt(), |noise| noise.of_mark(detected))
                }
            },
            pd,
            false_per_shot,
            precision: is_seen.then(|| timing.precision(marks_seen)),
            aside: self
                .sidelobes
                .as_ref()
                .filter(|_| is_seen)
                .and_then(|sidelobes| sidelobes.aside(found, at_the_lag, lone)),
            bound: range_from_tof(timing.spread) / photons.sqrt(),
        }
    }

    /// Photons of a mark that fall on the detector, if `detected` of them are detected on average. With light
    /// without end, each cell fires for one photon at most.
    fn falling_of(&self, detected: f64) -> f64 {
        match &self.design.detector {
            _ if detected.is_finite() => detected,
            Detector::Geiger(geiger) => f64::from(geiger.cells),
            _ => PLENTY,
        }
    }

    /// The forecast of a receiver of samples for a target of `reflectance` at `range` metres. Its noise is
    /// that of the amplifier and of steady light; `background` counts for that.
    fn of_samples(
        &self,
        (detector, settings): (&Sampled, &decode::Sampled),
        reflectance: f64,
        range: f64,
        told: &[usize],
    ) -> Forecast {
        let (design, mean_weight) = (self.design, self.mean_weight);
        let detected = self.light * self.operating.link.detected(reflectance, range);
        let background = self.background * self.operating.background;
        let parts = (design, detector, settings);
        let chances = sampled::chances(parts, &self.points, background, detected, told);
        let efficiency = design.efficiency();
        let mark = Lit { photons: detected, background, falling: 0.0 };
        let photons = (detected * mean_weight).max(f64::MIN_POSITIVE);
        Forecast {
            range,
            reflectance,
            photons_per_shot: detected * mean_weight / efficiency,
            detected_per_mark: detected,
            mark_pd: detector.mark_pd(&mark),
            bank_loss: 0.0,
            density: 0.0,
            snr: chances.snr,
            pd: chances.pd,
            false_per_shot: match stray_room(design) {
                Some(room) if room < 1.0 => 1.0,
                _ => settings.false_alarm,
            },
            precision: (chances.pd * FEWEST >= 1.0).then(|| range_from_tof(chances.timing)),
            aside: None,
            bound: range_from_tof(design.light.pulse * RMS_OF_FWHM) / photons.sqrt(),
        }
    }

    /// The forecast of a sensor with a closed `form` for a target of `reflectance` at `range` metres.
    fn of_form(&self, form: &dyn ClosedForm, reflectance: f64, range: f64) -> Forecast {
        let (design, operating) = (self.design, &self.operating);
        let detected = self.light * operating.link.detected(reflectance, range);
        let chances = form.chances(&Incident {
            range,
            photons: detected,
            background: self.background * operating.background,
            falling: self.background * operating.false_rate,
        });
        Forecast {
            range,
            reflectance,
            photons_per_shot: detected * design.emission.mean_pulses() / design.efficiency(),
            detected_per_mark: detected,
            mark_pd: -libm::expm1(-detected),
            bank_loss: 0.0,
            density: 0.0,
            snr: chances.snr,
            pd: chances.pd,
            false_per_shot: form.false_alarm(),
            precision: (chances.pd * FEWEST >= 1.0).then_some(chances.precision),
            aside: None,
            bound: chances.bound,
        }
    }
}

/// Brightnesses of an echo of `cells` speckle cells, M, in units of its mean, and the share of each. They
/// follow the gamma distribution M^M·x^(M − 1)·exp(−M·x)/Γ(M).
///
/// Its cube root is nearly normal with the mean 1 − 1/9M and the deviation 1/(3·√M) \[WH31\]. The density of
/// the root is summed in steps of half a deviation, up to four deviations.
fn brightnesses(cells: f64) -> Vec<(f64, f64)> {
    let (middle, deviation) = (1.0 - 1.0 / (9.0 * cells), 1.0 / (3.0 * cells.sqrt()));
    let roots = (-8..=8).map(|step| middle + 0.5 * f64::from(step) * deviation);
    let weight = |root: f64| (3.0 * cells - 1.0) * libm::log(root) - cells * (root.powi(3) - 1.0);
    let most = weight(middle);
    let each: Vec<(f64, f64)> = roots
        .filter(|root| *root > 0.0)
        .map(|root| (root.powi(3), libm::exp(weight(root) - most)))
        .collect();
    let all: f64 = each.iter().map(|(_, share)| share).sum();
    each.into_iter().map(|(brightness, share)| (brightness, share / all)).collect()
}

/// Time, s, from the opening of the range gate to an echo from `range` metres.
fn since_opening(design: &Design, range: f64) -> f64 {
    (tof_from_range(range) - tof_from_range(design.scan.min_range)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean 1 and variance 1/M; control: not 1/2M.
    #[test]
    fn brightnesses_are_those_of_the_gamma_distribution() {
        for cells in [1.0, 3.0, 20.0, 200.0, 1e5] {
            let all = brightnesses(cells);
            let mean: f64 = all.iter().map(|(x, share)| share * x).sum();
            let spread: f64 = all.iter().map(|(x, share)| share * (x - mean).powi(2)).sum();
            approx::assert_relative_eq!(mean, 1.0, max_relative = 5e-3);
            approx::assert_relative_eq!(spread * cells, 1.0, max_relative = 3e-2);
            assert!((2.0 * spread * cells - 1.0).abs() > 0.5);
        }
    }
}
