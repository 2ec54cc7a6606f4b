//! The model of a histogram: an even background and pulses, fitted by maximum likelihood.

use libm::log1p;

use super::pile_up::Exposed;
use super::pulse::{Kernel, STEPS};

/// Rounds of fitting after a pulse was added, and before returns are given.
const ROUNDS: usize = 4;

/// Iterations of the fit of background and photons in each round.
const ITERATIONS: usize = 12;

/// Steps by which a pulse is moved uphill, the coarse ones first.
const MOVES: [i64; 3] = [STEPS as i64 / 2, STEPS as i64 / 8, 1];

/// No pulse moves further from where it was found, in steps.
const FARTHEST: i64 = 2 * STEPS as i64;

/// The background is no fainter than this share of the one photon in all bins that could be counted.
const FAINTEST: f64 = 1e-6;

/// A pulse of light in a histogram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Light {
    /// The beginning of its kernel, in steps of a bin from the first bin on.
    pub step: i64,
    /// The same in bins, to a fraction of a step.
    pub lag: f64,
    /// All its photons.
    pub photons: f64,
    /// Significance beyond the threshold, in standard deviations of a normal variable.
    pub margin: u16,
}

/// Background and pulses of one histogram.
#[derive(Debug, Clone)]
pub(super) struct Model<'a> {
    pub kernel: &'a Kernel,
    pub exposed: &'a Exposed,
    shape_error: f64,
    /// Photons of the background in a bin.
    background: f64,
    pub lights: Vec<Light>,
    /// Mean count of each bin.
    pub expected: Vec<f64>,
    /// Variance of each count, with the error of the shape of the pulse.
    pub variance: Vec<f64>,
}

impl<'a> Model<'a> {
    /// Background alone; `None` where nothing was counted.
    pub fn new(kernel: &'a Kernel, exposed: &'a Exposed, shape_error: f64) -> Option<Self> {
        let counted: f64 = exposed.count.iter().sum();
        let seen: f64 = exposed.exposure.iter().sum();
        let background = counted / seen;
        if !(background > 0.0 && background.is_finite()) {
            return None;
        }
        let (lights, expected, variance) = (Vec::new(), Vec::new(), Vec::new());
        let mut model =
            Self { kernel, exposed, shape_error, background, lights, expected, variance };
        model.expect();
        Some(model)
    }

    /// Adds a pulse, and fits all anew.
    pub fn add(&mut self, light: Light) {
        self.lights.push(light);
        for _ in 0..ROUNDS {
            self.fit();
            self.climb();
        }
        self.fit();
        self.expect();
    }

    /// Finds the lags of all pulses to a fraction of a step.
    pub fn locate(&mut self) {
        for at in 0..self.lights.len() {
            self.lights[at].lag = self.vertex(at);
        }
    }

    /// Works out what is expected in each bin.
    fn expect(&mut self) {
        let exposure = &self.exposed.exposure;
        self.expected.clear();
        self.expected.extend(exposure.iter().map(|exposure| exposure * self.background));
        let mut of_shape = vec![0.0; exposure.len()];
        for light in &self.lights {
            let (first, shares) = self.kernel.within(light.step, exposure.len());
            for (at, share) in (first..).zip(shares) {
                of_shape[at] += light.photons * share * exposure[at];
            }
        }
        self.variance.clear();
        for (at, expected) in self.expected.iter_mut().enumerate() {
            *expected += of_shape[at];
            let beside = &of_shape[at.saturating_sub(1)..(at + 2).min(of_shape.len())];
            let error = self.shape_error * beside.iter().fold(0.0, |most: f64, one| most.max(*one));
            self.variance.push(*expected + error * error);
        }
    }

    /// Fits background and photons by maximum likelihood with the pulses where they are. This is expectation
    /// and maximisation: each count is shared out among them as they are expected to have made it.
    fn fit(&mut self) {
        let Exposed { count, exposure, .. } = self.exposed;
        let seen: f64 = exposure.iter().sum();
        for _ in 0..ITERATIONS {
            self.expect();
            let ratio = |at: usize| match self.expected[at] > 0.0 {
                true => count[at] / self.expected[at] * exposure[at],
                false => 0.0,
            };
            let of_background: f64 = (0..count.len()).map(ratio).sum();
            let mut photons = Vec::with_capacity(self.lights.len());
            for light in &self.lights {
                let (first, shares) = self.kernel.within(light.step, count.len());
                let (mut shared, mut reached) = (0.0, 0.0);
                for (at, share) in (first..).zip(shares) {
                    shared += share * ratio(at);
                    reached += share * exposure[at];
                }
                photons.push(if reached > 0.0 { light.photons * shared / reached } else { 0.0 });
            }
            self.background = (self.background * of_background / seen).max(FAINTEST / seen);
            for (light, photons) in self.lights.iter_mut().zip(photons) {
                light.photons = photons;
            }
        }
    }

    /// Moves each pulse to where the likelihood is greatest with the others as they are.
    fn climb(&mut self) {
        for at in 0..self.lights.len() {
            self.expect();
            let rest = self.without(at);
            let light = self.lights[at];
            let (mut best, mut highest) = (light.step, self.gain(&rest, light, light.step));
            for by in MOVES {
                for direction in [-by, by] {
                    loop {
                        let next = best + direction;
                        let gain = self.gain(&rest, light, next);
                        if gain <= highest || (next - light.step).abs() > FARTHEST {
                            break;
                        }
                        (best, highest) = (next, gain);
                    }
                }
            }
            self.lights[at].step = best;
        }
    }

    /// The mean counts without the light of one pulse.
    fn without(&self, at: usize) -> Vec<f64> {
        let light = self.lights[at];
        let mut rest = self.expected.clone();
        let (first, shares) = self.kernel.within(light.step, rest.len());
        for (bin, share) in (first..).zip(shares) {
            let exposure = self.exposed.exposure[bin];
            let least = self.background * exposure;
            rest[bin] = (rest[bin] - light.photons * share * exposure).max(least);
        }
        rest
    }

    /// Logarithm of the likelihood with `light` at another `step` over that without it.
    fn gain(&self, rest: &[f64], light: Light, step: i64) -> f64 {
        let Exposed { count, exposure, .. } = self.exposed;
        let (first, shares) = self.kernel.within(step, rest.len());
        let mut gain = 0.0;
        for (at, share) in (first..).zip(shares) {
            let more = light.photons * share * exposure[at];
            if more > 0.0 && rest[at] > 0.0 {
                gain += count[at] * log1p(more / rest[at]) - more;
            }
        }
        gain
    }

    /// Returns the lag at which the likelihood is greatest, in bins: the vertex of a parabola through the
    /// best step and those beside it. If several steps are equally high, as for a pulse much shorter than a
    /// bin, it is the middle of these.
    fn vertex(&self, at: usize) -> f64 {
        let light = self.lights[at];
        let rest = self.without(at);
        let gain = |step: i64| self.gain(&rest, light, step);
        let best = gain(light.step);
        let is_level = |step: i64| best - gain(step) <= 1e-9 * best.abs();
        let reach = STEPS as i64;
        let level = |way: i64| (1..=reach).take_while(|by| is_level(light.step + way * by)).count();
        let (below, above) = (level(-1), level(1));
        let by = if below + above > 0 {
            (above as f64 - below as f64) / 2.0
        } else {
            let (before, behind) = (gain(light.step - 1), gain(light.step + 1));
            let bend = before - 2.0 * best + behind;
            if bend < 0.0 { ((before - behind) / (2.0 * bend)).clamp(-1.0, 1.0) } else { 0.0 }
        };
        (light.step as f64 + by) / STEPS as f64
    }
}
