//! Beams and the spots they make.

use std::f64::consts::PI;

/// Full divergence (1/e²), rad, of a perfect Gaussian beam whose 1/e² diameter is `diameter`
/// metres: 2λ/(π·w₀), w₀ half the diameter.
pub fn diffraction(wavelength: f64, diameter: f64) -> f64 {
    2.0 * wavelength / (PI * diameter / 2.0)
}

/// Depth, m, of a spot of `diameter` metres on a surface tilted by `tilt` rad: D·tan tilt. Light
/// from its two sides arrives that much of range apart, and chips shorter than that are smeared.
pub fn spot_depth(diameter: f64, tilt: f64) -> f64 {
    diameter * libm::tan(tilt)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_one_millimetre_beam_spreads_by_more_than_a_pixel() {
        let divergence = diffraction(905e-9, 1e-3);
        approx::assert_relative_eq!(divergence, 1.152e-3, max_relative = 1e-3);
        let spot = divergence * 150.0;
        approx::assert_relative_eq!(
            spot_depth(spot, 0.124_f64.to_radians()),
            0.374e-3,
            max_relative = 0.01
        );
    }
}
