//! The part in front of a comparator or an analogue-to-digital converter: a photodiode, the filter and the
//! noise of its amplifier.
//!
//! Amplitudes are in detected photons: a mark of one, whose light is a Gaussian pulse, has the peak 1 behind
//! the amplifier. That is a Gaussian low-pass, |H(f)|² = exp(−(2π·f·s)²), s its rms response: without
//! ringing, and with no more delay than is calibrated out.

use std::f64::consts::{PI, SQRT_2};

use crate::units::{ELEMENTARY_CHARGE, RMS_OF_FWHM};

/// rms response of a Gaussian low-pass times its electrical 3 dB bandwidth: √(ln 2)/(2π).
const RMS_BY_BANDWIDTH: f64 = 0.132_505_181_759_698_4;

/// Excess noise factor of a multiplication M by a photodiode whose ionisation coefficients have the ratio k:
/// F = k·M + (1 − k)·(2 − 1/M) \[McI66\].
fn excess(gain: f64, ionisation: f64) -> f64 {
    ionisation * gain + (1.0 - ionisation) * (2.0 - 1.0 / gain)
}

/// A photodiode and its amplifier, SI units.
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

    /// Full width at half maximum of what a mark becomes behind the amplifier, s.
    pub fn response(&self) -> f64 {
        self.mark_rms() / RMS_OF_FWHM
    }

    /// Excess noise factor of the multiplication.
    pub fn excess(&self) -> f64 {
        excess(self.gain, self.ionisation)
    }

    /// Detected photons per second that steady light and the dark current are.
    pub fn steady(&self, background: f64) -> f64 {
        background + self.dark_current / ELEMENTARY_CHARGE
    }

    /// Noise per charge of a detected photon, under `background` detections per second, in two parts. The
    /// first is the spectral density of the white part. The second is the variance of the part that rises
    /// with the frequency, in units of that of white noise of density 1.
    fn densities(&self, background: f64) -> [f64; 2] {
        let of_charge = (ELEMENTARY_CHARGE * self.gain).powi(-2);
        let white =
            self.current_noise.powi(2) * of_charge + 2.0 * self.excess() * self.steady(background);
        let rising = (2.0 * PI * self.voltage_noise * self.capacitance).powi(2) * of_charge;
        [white, rising / (2.0 * PI * self.photon_rms()).powi(2)]
    }

    /// Noise under `background` detections per second, rms, in detected photons.
    pub fn noise(&self, background: f64) -> f64 {
        self.covariance(0.0, background).sqrt()
    }

    /// Memory v of the noise, s, under `background` detections per second: noise with the covariance
    /// R(t) crosses its mean upwards 1/(2π·v) times per second, v² = −R(0)/R″(0) \[Rice44\].
    ///
    /// That of white noise is the longest.
    pub fn memory(&self, background: f64) -> f64 {
        let [white, rising] = self.densities(background);
        let by_rising = match rising > 0.0 {
            true => (white + rising / 2.0) / (white + 1.5 * rising),
            false => 1.0,
        };
        self.white_memory() * by_rising.sqrt()
    }

    /// Memory of white noise, s: √2 times the rms length of what a photon becomes.
    pub fn white_memory(&self) -> f64 {
        SQRT_2 * self.photon_rms()
    }

    /// Covariance of the noise `apart` seconds apart, in detected photons squared, under `background`
    /// detections per second:
    ///
    /// ∫ S(f)·|H(f)|²·cos(2π·f·t) df, S(f) = \[i_n² + (2π·f·e_n·C)²\]/(q·M)² + 2·F·r,
    ///
    /// r the steady detections per second; for a Gaussian |H| in closed form.
    pub fn covariance(&self, apart: f64, background: f64) -> f64 {
        let rms = self.photon_rms();
        let [white, rising] = self.densities(background);
        let delay = apart / rms;
        // The shape for white noise; noise that rises with the frequency has its second derivative.
        let shape = libm::exp(-delay * delay / 4.0) / (4.0 * PI.sqrt() * rms);
        let steepness = 0.5 - delay * delay / 4.0;
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

    /// The noise crosses its mean as often as its spectrum says: √(∫ f²·S·|H|² df / ∫ S·|H|² df) per second.
    #[test]
    fn the_memory_is_that_of_the_spectrum() {
        let it = front_end();
        for background in [0.0, 1e12] {
            let step = 1e5;
            let [mut power, mut steep] = [0.0, 0.0];
            for n in 0..60_000 {
                let f = (f64::from(n) + 0.5) * step;
                let of_amplifier = 16e-24 + (2.0 * PI * f * 0.6e-9 * 1.2e-12).powi(2);
                let density = of_amplifier / (1.602_176_634e-19 * 20.0_f64).powi(2)
                    + 2.0 * 5.56 * (background + 3e-9 / 1.602_176_634e-19);
                let passed = density * 0.5_f64.powf((f / 550e6).powi(2));
                power += passed;
                steep += passed * f * f;
            }
            let often = 1.0 / (2.0 * PI * it.memory(background));
            assert_relative_eq!(often, (steep / power).sqrt(), max_relative = 1e-3);
        }
        // White noise alone: √(ln 2)/(2π·B)·√2.
        let white = FrontEnd { voltage_noise: 0.0, ..it };
        assert_relative_eq!(white.memory(0.0), 0.340_71e-9, max_relative = 1e-4);
    }

    /// McIntyre: k 0.2 and M 20 make 5.56; a PIN diode has 1, and no gain more than k lets it.

    #[test]
    fn excess_noise_of_the_photodiode() {
        assert_relative_eq!(front_end().excess(), 5.56, max_relative = 1e-3);
        let with = |gain, ionisation| FrontEnd { gain, ionisation, ..front_end() }.excess();
        assert_eq!(with(1.0, 0.0), 1.0);
        assert_relative_eq!(with(100.0, 1.0), 100.0);
        assert_relative_eq!(with(1e9, 0.0), 2.0, max_relative = 1e-8);
        assert_relative_eq!(with(100.0, 0.02), 3.9502, max_relative = 1e-4);
    }
}
