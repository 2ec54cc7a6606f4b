//! The loss of light in air and rain on its way, and the light that they send back.

/// Natural extinction, 1/m, of one decibel per kilometre.
const DB_PER_KM: f64 = std::f64::consts::LN_10 / 10.0 * 1e-3;

/// Extinction of air or fog in 1/m for a meteorological `visibility` V in m at a `wavelength` λ
/// in m.
///
/// σ = 3.912/V · (λ/550 nm)^−q, natural units, with q after Kim: 1.6 (V > 50 km), 1.3 (6–50 km),
/// 0.16·V + 0.34 (1–6 km), V − 0.5 (0.5–1 km), 0 below \[Kim01\]. Fog is air of a visibility below
/// 1 km.
pub fn haze(visibility: f64, wavelength: f64) -> f64 {
    let km = visibility * 1e-3;
    let q = match km {
        _ if km > 50.0 => 1.6,
        _ if km > 6.0 => 1.3,
        _ if km > 1.0 => 0.16 * km + 0.34,
        _ if km > 0.5 => km - 0.5,
        _ => 0.0,
    };
    3.912 / visibility * libm::pow(wavelength / 550e-9, -q)
}

/// Extinction by rain in 1/m at a rate R of `mm_per_hour`: σ = 1.076·R^0.67 dB/km \[CW98\], the
/// same at all wavelengths, since drops are much larger than any of them.
pub fn rain(mm_per_hour: f64) -> f64 {
    match mm_per_hour > 0.0 {
        true => 1.076 * libm::pow(mm_per_hour, 0.67) * DB_PER_KM,
        false => 0.0,
    }
}

/// Extinction over backscatter of water drops, sr: those of fog and rain \[OHI04\].
const DROPS: f64 = 18.8;

/// Extinction over backscatter of haze, sr: between that over the sea and that of a city \[Mul07\].
const HAZE: f64 = 50.0;

/// Returns the backscatter of a unit of volume, 1/(m·sr), for air of this `visibility`, m, in rain of
/// `mm_per_hour`, at a `wavelength` in m.
pub fn backscatter(visibility: f64, mm_per_hour: f64, wavelength: f64) -> f64 {
    let ratio = if is_fog(visibility) { DROPS } else { HAZE };
    haze(visibility, wavelength) / ratio + rain(mm_per_hour) / DROPS
}

/// Returns true if air of this `visibility`, m, is fog.
pub fn is_fog(visibility: f64) -> bool {
    visibility < 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clear_air_has_its_known_extinction() {
        approx::assert_relative_eq!(haze(23e3, 550e-9), 0.170e-3, max_relative = 1e-3);
        approx::assert_relative_eq!(haze(23e3, 905e-9), 0.0890e-3, max_relative = 2e-3);
        // Dense fog is grey.
        assert_eq!(haze(400.0, 905e-9), haze(400.0, 1550e-9));
    }

    /// 1.076·25^0.67 = 9.30 dB/km.
    #[test]
    fn heavy_rain_takes_nine_decibels_a_kilometre() {
        let decibels = 10.0 * (rain(25.0) * 1e3).exp().log10();
        approx::assert_relative_eq!(decibels, 9.30, max_relative = 2e-3);
        assert_eq!(rain(0.0), 0.0);
    }
}
