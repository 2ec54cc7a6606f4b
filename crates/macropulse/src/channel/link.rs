//! The link equation: photons from energy, reflectance, range and air.

use crate::design::{Design, Field};
use crate::scene::{Hits, Material};
use crate::units::tof_from_range;

/// Half of the width of a receiver's filter, m: what sensor files leave unsaid.
pub const FILTER: f64 = 15e-9;

/// The link equation with everything that does not depend on the target multiplied out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    photons_at_one_metre: f64,
    extinction: f64,
    field: Option<Field>,
}

impl Link {
    /// The link of a sensor through its air.
    pub fn of(design: &Design) -> Self {
        let sensitivity = design.detector.sensitivity();
        let extinction = design.visibility.map_or(0.0, |v| extinction(v, design.light.wavelength));
        Self {
            photons_at_one_metre: sensitivity.photons * sensitivity.range.powi(2)
                / sensitivity.reflectance,
            extinction,
            field: design.budget.as_ref().map(|b| b.field).filter(|f| f.trailing.is_some()),
        }
    }

    /// One-way transmission of the air over `range` metres: exp(−σ·R).
    pub fn transmission(&self, range: f64) -> f64 {
        match self.extinction == 0.0 {
            true => 1.0,
            false => libm::exp(-self.extinction * range),
        }
    }

    /// The link from the lidar `other` into the receiver of `ours`; `None` where the filter of the
    /// receiver stops the light: ±[`FILTER`] about its own wavelength, unless it is known.
    ///
    /// What a foreign mark brings follows from the sensitivity that the other declares of itself,
    /// n₀·R₀²/ρ₀ at one metre from white: its energy in an aperture, optics and detector like its
    /// own, which ours are taken to be unless both have a link budget. A detector of ours that never
    /// misses sees every mark; of another that never misses, by which its energy is left open, ours
    /// is assumed.
    pub fn of_interferer(ours: &Design, other: &Design) -> Option<Self> {
        let filter = ours.budget.as_ref().map_or(FILTER, |budget| budget.filter / 2.0);
        if (ours.light.wavelength - other.light.wavelength).abs() > filter {
            return None;
        }
        let [own, its] = [ours, other].map(|design| Self::of(design).photons_at_one_metre);
        let receivers = match (&ours.budget, &other.budget) {
            (Some(ours), Some(other)) => ours.receiver() / other.receiver(),
            _ => 1.0,
        };
        let its = its * receivers;
        let photons_at_one_metre = if own.is_infinite() || its.is_infinite() { own } else { its };
        let extinction = ours.visibility.map_or(0.0, |v| extinction(v, other.light.wavelength));
        Some(Self { photons_at_one_metre, extinction, field: None })
    }

    /// Mean photons detected per mark of light that has gone `way` metres through air, the last
    /// `back` of them from a target of effective reflectance `reflectance`.
    pub fn photons_by(&self, (way, back): (f64, f64), reflectance: f64) -> f64 {
        if reflectance <= 0.0 || back <= 0.0 {
            return 0.0;
        }
        self.photons_at_one_metre * reflectance * self.transmission(way) / (back * back)
    }

    /// Mean photons detected per mark of what ray `i` of `hits` has met in a scene of `materials`.
    #[inline]
    pub(super) fn echo(&self, materials: &[Material], hits: &Hits, i: usize) -> f64 {
        let material = &materials[usize::from(hits.material[i])];
        let reflectance = material.backscatter(f64::from(hits.cosine[i]));
        self.photons(reflectance * f64::from(hits.weight[i]), hits.range[i])
    }

    /// Mean photons detected per mark from a target of effective reflectance `reflectance` (which
    /// includes the cosine) at `range` metres.
    pub fn photons(&self, reflectance: f64, range: f64) -> f64 {
        if reflectance <= 0.0 || range <= 0.0 {
            return 0.0;
        }
        let share = self.field.map_or(1.0, |field| field.share(tof_from_range(range)));
        let light = self.photons_at_one_metre * reflectance * share;
        light * self.transmission(range).powi(2) / range.powi(2)
    }
}

/// Extinction of air in 1/m for a meteorological `visibility` V in m at a `wavelength` λ in m.
///
/// σ = 3.912/V · (λ/550 nm)^−q, natural units, with q after Kim: 1.6 (V > 50 km), 1.3 (6–50 km),
/// 0.16·V + 0.34 (1–6 km), V − 0.5 (0.5–1 km), 0 below \[Kim01\].
pub fn extinction(visibility: f64, wavelength: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extinction_has_the_published_values() {
        approx::assert_relative_eq!(extinction(23e3, 550e-9), 0.170e-3, max_relative = 1e-3);
        approx::assert_relative_eq!(extinction(23e3, 905e-9), 0.0890e-3, max_relative = 2e-3);
        // In dense fog the wavelength does not matter.
        assert_eq!(extinction(400.0, 905e-9), extinction(400.0, 1550e-9));
    }

    #[test]
    fn the_reference_target_gives_the_reference_photons() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let link = Link::of(&design);
        // Pd = 0.99 per mark means −ln 0.01 photons.
        approx::assert_relative_eq!(link.photons(1.0, 150.0), 4.605_170, max_relative = 1e-6);
        approx::assert_relative_eq!(link.photons(0.5, 75.0), 2.0 * 4.605_170, max_relative = 1e-6);
    }

    #[test]
    fn black_gives_nothing_even_to_a_perfect_detector() {
        let perfect = [("detector.photon-counting.sensitivity.pd".into(), "1.0".into())];
        let design = Design::open("kim-park-2016", &perfect).unwrap();
        assert_eq!(Link::of(&design).photons(0.0, 10.0), 0.0);
        assert_eq!(Link::of(&design).photons(1e-3, 10.0), f64::INFINITY);
    }
}
