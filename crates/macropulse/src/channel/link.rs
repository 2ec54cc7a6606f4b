//! The link equation: photons from energy, reflectance, range and air.

use crate::design::{Design, Field};
use crate::environment::Environment;
use crate::kernels::photons_from;
use crate::scene::{Finish, Hits};
use crate::units::tof_from_range;

/// Half of the width of a receiver's filter, m: what sensor files leave unsaid.
pub const FILTER: f64 = 15e-9;

/// The link equation with everything that does not depend on the target multiplied out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    photons_at_one_metre: f64,
    /// Detections per photon.
    efficiency: f64,
    extinction: f64,
    field: Option<Field>,
}

impl Link {
    /// The link of a sensor through the air of `environment`.
    pub fn of(design: &Design, environment: &Environment) -> Self {
        Self {
            photons_at_one_metre: at_one_metre(design),
            efficiency: design.efficiency(),
            extinction: environment.extinction(design.light.wavelength),
            field: design.budget.as_ref().map(|b| b.field).filter(|f| f.co_scanned.is_some()),
        }
    }

    /// One-way transmission of the air over `range` metres: exp(−σ·R).
    #[inline]
    pub fn transmission(&self, range: f64) -> f64 {
        match self.extinction == 0.0 {
            true => 1.0,
            false => libm::exp(-self.extinction * range),
        }
    }

    /// The link from the lidar `other` into the receiver of `ours`; `None` where the filter of the
    /// receiver stops the light: ±[`FILTER`] about its own wavelength, unless it is known.
    ///
    /// The photons of a mark of the interferer follow from the sensitivity that it declares of itself,
    /// n₀·R₀²/ρ₀ at one metre from white. This is its energy in an aperture, optics and detector like its
    /// own. Ours are taken to be like these unless both have a link budget. If our detector never misses, it
    /// sees every mark. If only that of the interferer never misses, its energy is left open, and ours is
    /// assumed.
    pub fn of_interferer(ours: &Design, other: &Design, environment: &Environment) -> Option<Self> {
        let filter = ours.budget.as_ref().map_or(FILTER, |budget| budget.filter / 2.0);
        if (ours.light.wavelength - other.light.wavelength).abs() > filter {
            return None;
        }
        let [own, its] = [ours, other].map(at_one_metre);
        let receivers = match (&ours.budget, &other.budget) {
            (Some(ours), Some(other)) => ours.receiver() / other.receiver(),
            _ => other.efficiency() / ours.efficiency(),
        };
        let its = its * receivers;
        let photons_at_one_metre = if own.is_infinite() || its.is_infinite() { own } else { its };
        let extinction = environment.extinction(other.light.wavelength);
        Some(Self { photons_at_one_metre, efficiency: ours.efficiency(), extinction, field: None })
    }

    /// Mean photons per mark of light that has gone `way` metres through air, the last
    /// `back` of them from a target of effective reflectance `reflectance`.
    pub fn photons_by(&self, (way, back): (f64, f64), reflectance: f64) -> f64 {
        if reflectance <= 0.0 || back <= 0.0 {
            return 0.0;
        }
        dimmed(self.photons_at_one_metre * reflectance, self.transmission(way)) / (back * back)
    }

    /// Adds to `photons` the mean photons per mark of what each ray of `hits` has met in a scene of
    /// materials with these `finishes`.
    pub(super) fn add_echoes(&self, finishes: &[Finish], hits: &Hits, photons: &mut Vec<f64>) {
        let from = photons.len();
        photons.extend((0..hits.shot.len()).map(|i| reflectance(finishes, hits, i)));
        let (photons, ranges) = (&mut photons[from..], &hits.range);
        if self.extinction == 0.0 && self.field.is_none() {
            return photons_from(self.photons_at_one_metre, ranges, photons);
        }
        photons.iter_mut().zip(ranges).for_each(|(it, range)| *it = self.photons(*it, *range));
    }

    /// Mean photons per mark of what ray `i` of `hits` has met in a scene of materials with these `finishes`.
    pub(super) fn echo(&self, finishes: &[Finish], hits: &Hits, i: usize) -> f64 {
        self.photons(reflectance(finishes, hits, i), hits.range[i])
    }

    /// Mean photons per mark that are detected of a target, as [`Link::photons`].
    pub fn detected(&self, reflectance: f64, range: f64) -> f64 {
        self.photons(reflectance, range) * self.efficiency
    }

    /// Mean photons per mark that reach the detector from a target of effective reflectance `reflectance`
    /// (which includes the cosine) at `range` metres.
    #[inline]
    pub fn photons(&self, reflectance: f64, range: f64) -> f64 {
        if reflectance <= 0.0 || range <= 0.0 {
            return 0.0;
        }
        let share = self.field.map_or(1.0, |field| field.share(tof_from_range(range)));
        let light = self.photons_at_one_metre * reflectance * share;
        dimmed(light, self.transmission(range).powi(2)) / range.powi(2)
    }
}

/// Returns the part of `light` that a `transmission` leaves. Infinite light, as at a detector that never
/// misses, stays infinite.
#[inline]
fn dimmed(light: f64, transmission: f64) -> f64 {
    if light.is_infinite() { light } else { light * transmission }
}

/// Effective reflectance of what ray `i` of `hits` has met, of its share of the light.
#[inline]
fn reflectance(finishes: &[Finish], hits: &Hits, i: usize) -> f64 {
    let finish = &finishes[usize::from(hits.material[i])];
    finish.backscatter(f64::from(hits.cosine[i])) * f64::from(hits.weight[i])
}

/// Mean photons that reach the detector of a sensor per mark from white at one metre, in clear air.
fn at_one_metre(design: &Design) -> f64 {
    let sensitivity = design.detector.model().sensitivity();
    sensitivity.photons / design.efficiency() * sensitivity.range.powi(2) / sensitivity.reflectance
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dark() -> Environment {
        Environment::vacuum_dark()
    }

    #[test]
    fn the_reference_target_gives_the_reference_photons() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let link = Link::of(&design, &dark());
        // Pd = 0.99 per mark means −ln 0.01 photons.
        approx::assert_relative_eq!(link.photons(1.0, 150.0), 4.605_170, max_relative = 1e-6);
        approx::assert_relative_eq!(link.photons(0.5, 75.0), 2.0 * 4.605_170, max_relative = 1e-6);
    }

    #[test]
    fn black_gives_nothing_even_to_a_perfect_detector() {
        let perfect = [("detector.photon-counting.sensitivity.pd".into(), "1.0".into())];
        let design = Design::open("kim-park-2016", &perfect).unwrap();
        assert_eq!(Link::of(&design, &dark()).photons(0.0, 10.0), 0.0);
        assert_eq!(Link::of(&design, &dark()).photons(1e-3, 10.0), f64::INFINITY);
        // Fog lets nothing through that a number can tell: exp(−782).
        let fog = Link::of(&design, &Environment::named("fog-50m").unwrap());
        assert_eq!(fog.transmission(1e4), 0.0);
        assert_eq!(fog.photons(1e-3, 1e4), f64::INFINITY);
        assert_eq!(fog.photons_by((2e4, 1e4), 1e-3), f64::INFINITY);
    }
}
