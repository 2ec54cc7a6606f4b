//! The photons a coded lidar would honestly have: what its declared sensitivity leaves out.

use std::f64::consts::PI;

use crate::units::{PLANCK, SPEED_OF_LIGHT};

/// A receiver looking at an extended Lambertian target that fills the beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// Wavelength, m.
    pub wavelength: f64,
    /// Diameter of the aperture, m.
    pub aperture: f64,
    /// Transmission of the optics, both ways together.
    pub optics: f64,
    /// Extinction of the air, 1/m.
    pub extinction: f64,
}

impl Receiver {
    /// Photons at the detector for `energy` joules sent at a target of `reflectance` at `range`
    /// metres, square on: E·ρ·A·η·T²/(π·R²) over h·c/λ (docs/physics.md#link-equation).
    pub fn photons(&self, energy: f64, reflectance: f64, range: f64) -> f64 {
        let transmission = libm::exp(-self.extinction * range);
        let received = energy * reflectance * self.area() * self.optics * transmission.powi(2)
            / (PI * range.powi(2));
        received / self.photon_energy()
    }

    /// Photons per second of sunlight reflected by the scene, P = E_λ·Δλ·ρ/π·A·Ω·η over h·c/λ
    /// (docs/physics.md#background).
    pub fn background(&self, sun: &Sunlight) -> f64 {
        let power = sun.irradiance * sun.bandwidth * sun.albedo / PI
            * self.area()
            * sun.field
            * self.optics;
        power / self.photon_energy()
    }

    fn area(&self) -> f64 {
        PI * self.aperture.powi(2) / 4.0
    }

    fn photon_energy(&self) -> f64 {
        PLANCK * SPEED_OF_LIGHT / self.wavelength
    }
}

/// Sunlight on the scene, and how much of it the receiver looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sunlight {
    /// Spectral irradiance of the scene, W/m² per metre of wavelength (\[G173\]: 0.817 W/m²/nm
    /// at 905 nm).
    pub irradiance: f64,
    /// Width of the optical filter, m.
    pub bandwidth: f64,
    /// Reflectance of the scene.
    pub albedo: f64,
    /// Solid angle the detector sees, sr: the whole field where the receiver stares.
    pub field: f64,
}

/// Full divergence (1/e²), rad, of a perfect Gaussian beam whose 1/e² diameter is `diameter`
/// metres: 2λ/(π·w₀), w₀ half the diameter.
pub fn diffraction(wavelength: f64, diameter: f64) -> f64 {
    2.0 * wavelength / (PI * diameter / 2.0)
}

/// Solid angle, sr, of a rectangular field `horizontal` by `vertical` radians across:
/// 4·asin(sin(h/2)·sin(v/2)).
pub fn field(horizontal: f64, vertical: f64) -> f64 {
    4.0 * libm::asin(libm::sin(horizontal / 2.0) * libm::sin(vertical / 2.0))
}

/// Depth, m, of a spot of `diameter` metres on a surface tilted by `tilt` rad: D·tan tilt. Light
/// from its two sides arrives that much of range apart, and chips shorter than that are smeared.
pub fn spot_depth(diameter: f64, tilt: f64) -> f64 {
    diameter * libm::tan(tilt)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 25 mm, 0.7 optics, V = 23 km: the receiver of docs/physics.
    fn receiver() -> Receiver {
        let extinction = crate::channel::extinction(23e3, 905e-9);
        Receiver { wavelength: 905e-9, aperture: 25e-3, optics: 0.7, extinction }
    }

    #[test]
    fn a_nanojoule_brings_22_photons_from_150_metres() {
        let photons = receiver().photons(1.01e-9, 1.0, 150.0);
        approx::assert_relative_eq!(photons, 21.7, max_relative = 0.005);
        assert_eq!(receiver().photons(0.0, 1.0, 150.0), 0.0);
    }

    #[test]
    fn a_staring_receiver_drowns_in_sunlight() {
        let field = field(43.2_f64.to_radians(), 24.3_f64.to_radians());
        approx::assert_relative_eq!(field, 0.310, max_relative = 1e-3);
        let sun = Sunlight { irradiance: 0.817e9, bandwidth: 10e-9, albedo: 0.3, field };
        approx::assert_relative_eq!(
            receiver().background(&sun) * 2.5e-12,
            947.0,
            max_relative = 0.002
        );
    }

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
