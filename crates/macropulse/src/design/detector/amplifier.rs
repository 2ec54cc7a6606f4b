//! The noise of a linear detector: a photodiode, with or without gain, and its amplifier.

use std::f64::consts::SQRT_2;

use crate::units::ELEMENTARY_CHARGE;

/// Full width at half maximum of a Gaussian response times its 3 dB bandwidth.
const WIDTH_BY_BANDWIDTH: f64 = 0.44;

/// Peak of a Gaussian of unit area and unit full width at half maximum.
const PEAK: f64 = 0.939_437_278_699_651_3;

/// Excess noise factor of a multiplication M by a photodiode whose ionisation coefficients have the ratio k:
/// F = k·M + (1 − k)·(2 − 1/M) \[McI66\].
pub(super) fn excess(gain: f64, ionisation: f64) -> f64 {
    ionisation * gain + (1.0 - ionisation) * (2.0 - 1.0 / gain)
}

/// A photodiode and its amplifier, SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplifier {
    /// Mean multiplication M; 1 for a PIN diode.
    pub gain: f64,
    /// Ratio k of the ionisation coefficients.
    pub ionisation: f64,
    /// 3 dB bandwidth B, Hz.
    pub bandwidth: f64,
    /// Noise of the amplifier at its input, A/√Hz.
    pub current_noise: f64,
    /// Dark current that is multiplied, A.
    pub dark_current: f64,
    /// Length of a micropulse, full width at half maximum, s.
    pub pulse: f64,
}

impl Amplifier {
    /// Full width at half maximum, s, of what a mark becomes behind the amplifier:
    /// √(pulse² + (0.44/B)²).
    pub fn response(&self) -> f64 {
        libm::hypot(self.pulse, WIDTH_BY_BANDWIDTH / self.bandwidth)
    }

    /// Excess noise factor of the multiplication.
    pub fn excess(&self) -> f64 {
        excess(self.gain, self.ionisation)
    }

    /// Noise without a mark, rms, in detected photons: i_n over the peak current of one,
    /// i_n² = 2q·(I_b + I_d)·M²·F·B + i_amp²·B, I_b the current of `background` detections per
    /// second.
    pub fn noise_electrons(&self, background: f64) -> f64 {
        let q = ELEMENTARY_CHARGE;
        let steady = q * background + self.dark_current;
        let shot = 2.0 * q * steady * self.gain.powi(2) * self.excess() * self.bandwidth;
        let noise = (shot + self.current_noise.powi(2) * self.bandwidth).sqrt();
        noise / (q * self.gain * PEAK / self.response())
    }

    /// The threshold over the rms noise, TNR, that noise crosses `rate` times per second:
    /// rate = exp(−TNR²/2)/(2√3·τ), τ the response \[Rice44\]. `None` where the rate is higher than
    /// any threshold has.
    pub fn threshold_for(&self, rate: f64) -> Option<f64> {
        let share = rate / self.highest_rate();
        (share <= 1.0).then(|| SQRT_2 * (-share.ln()).sqrt())
    }

    /// How often per second noise crosses its mean upwards: 1/(2√3·τ).
    pub fn highest_rate(&self) -> f64 {
        1.0 / (2.0 * 3_f64.sqrt() * self.response())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn pin(pulse: f64) -> Amplifier {
        Amplifier {
            gain: 1.0,
            ionisation: 0.0,
            bandwidth: 1e15,
            current_noise: 0.0,
            dark_current: 0.0,
            pulse,
        }
    }

    /// Pfa 0.5 within 1 µs with pulses of 5 ns: 20·log10 TNR = 9.776 dB.
    #[test]
    fn the_threshold_of_half_a_false_alarm_per_microsecond() {
        let tnr = pin(5e-9).threshold_for(0.5 / 1e-6).unwrap();
        assert_relative_eq!(20.0 * tnr.log10(), 9.776, max_relative = 1e-4);
    }

    #[test]
    fn no_threshold_is_crossed_more_often_than_the_mean() {
        let amplifier = pin(5e-9);
        assert_eq!(amplifier.threshold_for(amplifier.highest_rate()), Some(0.0));
        assert_eq!(amplifier.threshold_for(1e9), None);
    }

    #[test]
    fn excess_noise_has_its_limits() {
        assert_eq!(pin(1e-9).excess(), 1.0);
        let apd = |ionisation, gain| Amplifier { gain, ionisation, ..pin(1e-9) }.excess();
        assert_relative_eq!(apd(1.0, 100.0), 100.0);
        assert_relative_eq!(apd(0.0, 1e9), 2.0, max_relative = 1e-8);
        assert_relative_eq!(apd(0.02, 100.0), 3.9502, max_relative = 1e-4);
    }

    /// 20 pA/√Hz in 280 GHz are 10.6 µA; over 2.5 ps that is 165 electrons.
    #[test]
    fn a_fast_amplifier_has_the_noise_of_165_electrons() {
        let amplifier = Amplifier { bandwidth: 280e9, current_noise: 20e-12, ..pin(2.5e-12) };
        let current = 20e-12 * 280e9_f64.sqrt();
        assert_relative_eq!(current * 2.5e-12 / ELEMENTARY_CHARGE, 165.0, max_relative = 5e-3);
        // With what the bandwidth makes of the pulse, and its peak.
        let wider = amplifier.response() / 2.5e-12 / PEAK;
        assert_relative_eq!(amplifier.noise_electrons(0.0), 165.0 * wider, max_relative = 5e-3);
    }

    #[test]
    fn background_is_shot_noise() {
        // 1e9 detections per second in 1 ns: their count has a variance near 1.
        let amplifier = Amplifier { bandwidth: 0.44e9, ..pin(1e-15) };
        assert_relative_eq!(amplifier.noise_electrons(1e9), 1.0, max_relative = 0.01);
    }
}
