//! What is in front of an analogue-to-digital converter: a photodiode, the filter and the noise of its
//! amplifier.
//!
//! Amplitudes are in detected photons: a mark of one, whose light is a Gaussian pulse, has the peak 1 behind
//! the amplifier. That is a Gaussian low-pass, |H(f)|² = exp(−(2π·f·s)²), s its rms response: without
//! ringing, and with no more delay than is calibrated out.

use std::f64::consts::PI;

use super::amplifier::excess;
use crate::units::{ELEMENTARY_CHARGE, RMS_OF_FWHM};

/// rms response of a Gaussian low-pass times its electrical 3 dB bandwidth: √(ln 2)/(2π).
const RMS_BY_BANDWIDTH: f64 = 0.132_505_181_759_698_4;

/// A photodiode and its amplifier before they are sampled, SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontEnd {
    /// Mean multiplication M; 1 for a PIN diode.
    pub gain: f64,
    /// Ratio k of the ionisation coefficients.
    pub ionisation: f64,
    /// Electrical 3 dB bandwidth B, Hz.
    pub bandwidth: f64,
    /// White noise of the amplifier at its input, i_n, A/√Hz.
    pub current_noise: f64,
    /// Noise of its input voltage, e_n, V/√Hz.
    pub voltage_noise: f64,
    /// Capacitance at its input C, of the photodiode and its own, F.
    pub capacitance: f64,
    /// Dark current that is multiplied, A.
    pub dark_current: f64,
    /// Length of a micropulse, full width at half maximum, s.
    pub pulse: f64,
}

impl FrontEnd {
    /// rms length of what one photon becomes behind the amplifier, s.
    pub fn photon_rms(&self) -> f64 {
        RMS_BY_BANDWIDTH / self.bandwidth
    }

    /// rms length of what a mark becomes behind the amplifier, s.
    pub fn mark_rms(&self) -> f64 {
        libm::hypot(RMS_OF_FWHM * self.pulse, self.photon_rms())
    }

    /// Height of what one photon becomes behind the amplifier, in those of a photon of a mark: it is as
    /// much charge in less time.
    pub fn photon_height(&self) -> f64 {
        self.mark_rms() / self.photon_rms()
    }

    /// Excess noise factor of the multiplication.
    pub fn excess(&self) -> f64 {
        excess(self.gain, self.ionisation)
    }

    /// Detected photons per second that steady light and the dark current are.
    pub fn steady(&self, background: f64) -> f64 {
        background + self.dark_current / ELEMENTARY_CHARGE
    }

    /// Covariance of the noise `apart` seconds apart, in detected photons squared, under `background`
    /// detections per second:
    ///
    /// ∫ S(f)·|H(f)|²·cos(2π·f·t) df, S(f) = \[i_n² + (2π·f·e_n·C)²\]/(q·M)² + 2·F·r,
    ///
    /// r the steady detections per second; for a Gaussian |H| in closed form.
    pub fn covariance(&self, apart: f64, background: f64) -> f64 {
        let rms = self.photon_rms();
        let of_charge = (ELEMENTARY_CHARGE * self.gain).powi(-2);
        let white =
            self.current_noise.powi(2) * of_charge + 2.0 * self.excess() * self.steady(background);
        let rising = (2.0 * PI * self.voltage_noise * self.capacitance).powi(2) * of_charge;
        let delay = apart / rms;
        // Of white noise, and by its second derivative of noise that rises with the frequency.
        let shape = libm::exp(-delay * delay / 4.0) / (4.0 * PI.sqrt() * rms);
        let steepness = (0.5 - delay * delay / 4.0) / (2.0 * PI * rms).powi(2);
        let peak = self.mark_rms() * (2.0 * PI).sqrt();
        peak * peak * shape * (white + rising * steepness)
    }

    /// Third cumulant of the noise, in detected photons cubed: of single photons, each multiplied by a
    /// gain that is gamma-distributed, r·F·(2F − 1)·∫h³.
    pub fn third_cumulant(&self, background: f64) -> f64 {
        let excess = self.excess();
        let cubes = self.photon_height().powi(3) * self.photon_rms() * (2.0 * PI / 3.0).sqrt();
        self.steady(background) * excess * (2.0 * excess - 1.0) * cubes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn front_end() -> FrontEnd {
        FrontEnd {
            gain: 20.0,
            ionisation: 0.2,
            bandwidth: 550e6,
            current_noise: 4e-12,
            voltage_noise: 0.6e-9,
            capacitance: 1.2e-12,
            dark_current: 3e-9,
            pulse: 0.8e-9,
        }
    }

    /// The integral as it stands, summed.
    #[test]
    fn the_covariance_is_that_of_the_spectrum() {
        let it = front_end();
        let background = 1e9;
        for apart in [0.0, 0.2e-9, 0.4e-9, 1.3e-9] {
            let step = 1e5;
            let sum: f64 = (0..60_000)
                .map(|n| {
                    let f = (f64::from(n) + 0.5) * step;
                    let of_amplifier = 16e-24 + (2.0 * PI * f * 0.6e-9 * 1.2e-12).powi(2);
                    let density = of_amplifier / (1.602_176_634e-19 * 20.0_f64).powi(2)
                        + 2.0 * 5.56 * (1e9 + 3e-9 / 1.602_176_634e-19);
                    let passed = 0.5_f64.powf((f / 550e6).powi(2));
                    density * passed * (2.0 * PI * f * apart).cos() * step
                })
                .sum();
            let mark = (0.8e-9_f64.powi(2) / (8.0 * 2.0_f64.ln())
                + 2.0_f64.ln() / (2.0 * PI * 550e6).powi(2))
            .sqrt();
            let expected = sum * mark * mark * 2.0 * PI;
            assert_relative_eq!(it.covariance(apart, background), expected, max_relative = 1e-3);
        }
    }

    /// McIntyre: k 0.2 and M 20 make 5.56.
    #[test]
    fn excess_noise_of_the_photodiode() {
        assert_relative_eq!(front_end().excess(), 5.56, max_relative = 1e-3);
    }
}
