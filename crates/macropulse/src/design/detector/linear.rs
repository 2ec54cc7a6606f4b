//! A photodiode with an amplifier and a comparator.

use macropulse_codec::statistics::{normal_tail, poisson};

use super::comparator::{bump, threshold_over_noise};
use super::{
    Comparator, FrontEnd, LinearSetting, Lit, Model, Noise, SLICES, Sensitivity, slices_above,
};
use crate::design::Light;

/// Terms of a Poisson sum that are less than this share of all are left out.
const NEGLIGIBLE: f64 = 1e-15;

/// From this number of photons on, the number passes for a normal variable.
const MANY: f64 = 1e4;

/// A photodiode with an amplifier and a comparator. Its noise, and with it the threshold, depends on
/// the sunlight it sees, too: [`LinearSetting`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// Mean photons detected per mark at the reference target.
    pub sensitivity: Sensitivity,
    /// The photodiode and its amplifier.
    pub front_end: FrontEnd,
    /// Crossings of the threshold by noise alone that are accepted, 1/s.
    pub false_alarm: f64,
    /// Standard deviation of the timing of the converter's input alone, s.
    pub jitter: f64,
    /// The comparator on the summed signal; `None` if every mark is judged alone.
    pub comparator: Option<Comparator>,
}

impl Linear {
    /// The threshold over the rms noise, by which noise alone crosses it as often as is accepted.
    fn threshold_over_noise(&self, memory: f64) -> f64 {
        threshold_over_noise(memory, self.false_alarm).unwrap_or(0.0)
    }

    /// The setting of a detector that sees `background` detections of steady light per second.
    pub fn setting(&self, background: f64) -> LinearSetting {
        let noise = self.front_end.noise(background);
        let memory = self.front_end.memory(background);
        LinearSetting {
            threshold: self.threshold_over_noise(memory) * noise,
            noise,
            excess: self.front_end.excess(),
            response: self.front_end.response(),
            memory,
            false_rate: self.false_alarm,
            jitter: self.jitter,
            comparator: self.comparator,
        }
    }
}

impl LinearSetting {
    /// Standard deviation, s, of the time at which a mark of `amplitude` detected photons is told:
    /// noise over the slope with the jitter of the input. The slope is amplitude/τ where marks are
    /// judged alone, else that of the pulse there.
    pub fn timing(&self, amplitude: f64) -> f64 {
        let amplitude = amplitude.max(self.threshold);
        let error = match self.comparator {
            None => self.response * self.noise / amplitude,
            Some(comparator) => comparator.error(self, amplitude),
        };
        libm::hypot(self.jitter, error)
    }

    /// Standard deviation, s, of the time of those marks of `photons`, the mean, that cross the
    /// threshold: over their amplitudes, with the walk of a leading edge.
    fn timing_of_seen(&self, photons: f64) -> f64 {
        let spread = (photons * self.excess + self.noise * self.noise).sqrt();
        let walk = |amplitude| match self.comparator {
            None => 0.0,
            Some(comparator) => comparator.walk(self, amplitude),
        };
        let (mut variance, mut walks, mut squares) = (0.0, 0.0, 0.0);
        for amplitude in slices_above(self.threshold, photons, spread) {
            variance += self.timing(amplitude).powi(2);
            walks += walk(amplitude);
            squares += walk(amplitude).powi(2);
        }
        let count = f64::from(SLICES);
        ((variance + squares) / count - (walks / count).powi(2)).max(0.0).sqrt()
    }

    /// Probability that a mark with n = `photons` detected on average crosses the threshold, summed over the
    /// photons k that come: Σ_k e^(−n)·n^k/k! · Q((threshold − k)/√(k·(F − 1) + noise²)). No photon, no
    /// event.
    ///
    /// If the noise of the amplifier is so large that the photons' own does not matter, it is the
    /// ½·erfc((TNR − SNR)/√2) of textbooks.
    fn crossing(&self, photons: f64) -> f64 {
        let Self { noise, excess, .. } = *self;
        let threshold = self.threshold - self.comparator.map_or(0.0, |_| bump(self));
        let above = |count: f64, variance: f64| normal_tail((threshold - count) / variance.sqrt());
        if photons > MANY {
            return above(photons, photons * excess + noise * noise);
        }
        let mut sum = 0.0;
        let mut k = 1.0;
        loop {
            let share = poisson(photons, k);
            sum += share * above(k, k * (excess - 1.0) + noise * noise);
            if k > photons && share < NEGLIGIBLE {
                return sum;
            }
            k += 1.0;
        }
    }
}

impl Model for Linear {
    fn sensitivity(&self) -> Sensitivity {
        self.sensitivity
    }

    /// Jitter of a mark that only just crosses the threshold: noise over the slope, τ·noise/threshold, with
    /// the jitter of the input. It does not depend on how large the noise is.
    fn jitter(&self) -> f64 {
        let setting = self.setting(0.0);
        match setting.noise > 0.0 {
            true => setting.timing(setting.threshold),
            false => self.jitter,
        }
    }

    /// The light of a pulse is followed as a whole, so its length displaces no event.
    fn resolution(&self, _: &Light) -> f64 {
        self.jitter()
    }

    fn response(&self) -> f64 {
        self.front_end.response()
    }

    fn unpulsed(&self) -> Option<&'static str> {
        Some("a photodiode behind a comparator is not simulated in it: take [adc] for [comparator]")
    }

    /// The threshold follows the noise, so that this crosses it as often in any light.
    fn false_rate(&self, _: f64) -> f64 {
        self.false_alarm
    }

    fn noise(&self, background: f64) -> Option<Noise> {
        let LinearSetting { noise, threshold, excess, .. } = self.setting(background);
        Some(Noise { rms: noise, threshold, excess })
    }

    fn mark_pd(&self, lit: &Lit) -> f64 {
        self.setting(lit.background).crossing(lit.photons)
    }

    fn mark_jitter(&self, lit: &Lit) -> f64 {
        self.setting(lit.background).timing_of_seen(lit.photons)
    }

    fn summary(&self) -> String {
        format!(
            "comparator; threshold {:.2} times the noise; {}; {:.0e} false alarms/s",
            self.threshold_over_noise(self.front_end.memory(0.0)),
            self.sensitivity.summary(),
            self.false_alarm
        )
    }

    fn in_sunlight(&self) -> &'static str {
        "which are noise to it"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn linear(threshold: f64, noise: f64, excess: f64) -> LinearSetting {
        LinearSetting {
            threshold,
            noise,
            excess,
            response: 1e-9,
            memory: 0.5e-9,
            false_rate: 0.0,
            jitter: 0.0,
            comparator: None,
        }
    }

    /// TNR 9.78 dB: SNR of 9.8, 12, 13, 14 and 16 dB give 0.50, 0.816, 0.917, 0.973 and 0.9994.
    #[test]
    fn a_noisy_amplifier_has_the_curve_of_the_textbook() {
        let noise = 1000.0;
        let db = |db: f64| 10_f64.powf(db / 20.0);
        for (snr, pd) in [(9.776, 0.5), (12.0, 0.816), (13.0, 0.917), (14.0, 0.973), (16.0, 0.9994)]
        {
            let found = linear(db(9.776) * noise, noise, 1.0).crossing(db(snr) * noise);
            assert!((found - pd).abs() < 2e-3, "SNR {snr} dB: {found}");
        }
    }

    /// With neither noise nor excess noise an event takes the number of photons that the threshold says.
    #[test]
    fn without_noise_it_is_the_tail_of_poisson() {
        let found = linear(2.5, 1e-9, 1.0).crossing(2.0);
        assert_relative_eq!(found, 1.0 - (-2.0_f64).exp() * 5.0, max_relative = 1e-9);
    }

    #[test]
    fn sum_and_normal_approximation_meet() {
        let detector = linear(MANY, 300.0, 4.0);
        let (below, above) = (detector.crossing(MANY), detector.crossing(MANY * (1.0 + 1e-9)));
        assert!((below - above).abs() < 2e-3, "{below}, {above}");
    }
}
