//! What reaches the aperture: surfaces become echoes.
//!
//! For an extended Lambertian target that the beam does not overfill, the energy received is
//!
//! E_r = E_t · ρ · cos i · A_r · η · T² / (π · R²), T = exp(−σ·R)   (docs/physics.md#link-equation)
//!
//! A sensor declared by its sensitivity knows the product E_t · A_r · η / π through the photons n₀
//! it detects per mark from a reference target (ρ₀, R₀), so that
//!
//! n = n₀ · (ρ_eff / ρ₀) · (R₀ / R)² · T² · w
//!
//! with ρ_eff the material's backscatter towards the sensor and w the share of the beam. A sensor
//! with a link budget has n₀ from it, for a white target at its reach. Where its field follows the
//! beam, the share of the spot that is still in the field when the echo arrives is a factor too.

mod operating;
mod others;

pub use operating::{Error, Idealised, LinearSetting, Operating, idealised};
pub use others::{APERTURE_RADIUS, Foreign, foreign};

use crate::design::{Design, Field};
use crate::environment::Environment;
pub use crate::scene::PARTS;
use crate::scene::{Hits, Material};
use crate::units::{tof_from_range, tof_fs_from_ranges};

/// Echoes of a band of shots, as columns, ordered by shot. Truth: the light itself, before any
/// detector.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Echoes {
    /// Index of the shot in the band's log.
    pub shot: Vec<u32>,
    /// Time from firing to the arrival of the same chip, fs.
    pub delay_fs: Vec<i64>,
    /// Mean number of photons detected per mark; infinite for a detector that never misses.
    pub photons: Vec<f64>,
    /// Which of the [`PARTS`] of the macropulse it is an echo of; empty where all of it takes the
    /// same way.
    pub part: Vec<u8>,
    /// Light of other lidars that arrives beside them.
    pub foreign: Foreign,
}

/// The echoes of `hits` at a sensor with this `link`, whose scene has `materials`.
pub fn echoes(link: &Link, materials: &[Material], hits: &Hits) -> Echoes {
    let photons: Vec<f64> = (0..hits.shot.len())
        .map(|i| {
            let material = &materials[usize::from(hits.material[i])];
            let reflectance = material.backscatter(f64::from(hits.cosine[i]));
            link.photons(reflectance * f64::from(hits.weight[i]), hits.range[i])
        })
        .collect();
    let delay_fs = tof_fs_from_ranges(&hits.range);
    let mut echoes = Echoes { shot: hits.shot.clone(), delay_fs, photons, ..Echoes::default() };
    if !echoes.photons.iter().all(|&photons| photons > 0.0) {
        echoes.leave_out_the_dark();
    }
    echoes
}

/// The echoes of macropulses whose parts have met `hits` each, the first part first.
pub fn echoes_of_parts(link: &Link, materials: &[Material], hits: &[Hits]) -> Echoes {
    let parts: Vec<Echoes> = hits.iter().map(|hits| echoes(link, materials, hits)).collect();
    let mut order: Vec<(u32, u8, usize)> = Vec::new();
    for (part, echoes) in parts.iter().enumerate() {
        order.extend(echoes.shot.iter().enumerate().map(|(i, shot)| (*shot, part as u8, i)));
    }
    order.sort_unstable();
    let each = |&(_, part, i): &(u32, u8, usize)| (&parts[usize::from(part)], i);
    Echoes {
        shot: order.iter().map(|(shot, ..)| *shot).collect(),
        delay_fs: order.iter().map(each).map(|(echoes, i)| echoes.delay_fs[i]).collect(),
        photons: order.iter().map(each).map(|(echoes, i)| echoes.photons[i]).collect(),
        part: order.iter().map(|(_, part, _)| *part).collect(),
        foreign: Foreign::default(),
    }
}

impl Echoes {
    /// What has no light is no echo.
    fn leave_out_the_dark(&mut self) {
        let is_lit: Vec<bool> = self.photons.iter().map(|&photons| photons > 0.0).collect();
        let mut of_shots = is_lit.iter();
        self.shot.retain(|_| of_shots.next() == Some(&true));
        let mut of_delays = is_lit.iter();
        self.delay_fs.retain(|_| of_delays.next() == Some(&true));
        self.photons.retain(|&photons| photons > 0.0);
    }
}

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
    /// The link of a sensor through the air of `environment`.
    pub fn of(design: &Design, environment: &Environment) -> Self {
        Self {
            photons_at_one_metre: at_one_metre(design),
            extinction: environment.extinction(design.light.wavelength),
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
    pub fn of_other(ours: &Design, other: &Design, environment: &Environment) -> Option<Self> {
        let filter = ours.budget.as_ref().map_or(FILTER, |budget| budget.filter / 2.0);
        if (ours.light.wavelength - other.light.wavelength).abs() > filter {
            return None;
        }
        let [own, its] = [ours, other].map(at_one_metre);
        let receivers = match (&ours.budget, &other.budget) {
            (Some(ours), Some(other)) => ours.receiver() / other.receiver(),
            _ => 1.0,
        };
        let its = its * receivers;
        let photons_at_one_metre = if own.is_infinite() || its.is_infinite() { own } else { its };
        let extinction = environment.extinction(other.light.wavelength);
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

/// Mean photons that a sensor detects per mark from white at one metre, in clear air.
fn at_one_metre(design: &Design) -> f64 {
    let sensitivity = design.detector.sensitivity();
    sensitivity.photons * sensitivity.range.powi(2) / sensitivity.reflectance
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dark() -> Environment {
        Environment::vacuum_dark()
    }

    #[test]
    fn what_has_no_light_is_no_echo() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let materials = [Material::matt("white", 1.0), Material::matt("black", 0.0)];
        let hits = Hits {
            shot: vec![3, 5, 5, 9],
            weight: vec![1.0; 4],
            range: vec![10.0, 20.0, 30.0, 40.0],
            cosine: vec![1.0, 1.0, 0.5, 0.0],
            material: vec![0, 1, 0, 0],
            object: vec![0; 4],
        };
        let echoes = echoes(&Link::of(&design, &dark()), &materials, &hits);
        assert_eq!(echoes.shot, [3, 5]);
        assert_eq!(echoes.delay_fs[1], crate::units::fs_from_s(crate::units::tof_from_range(30.0)));
        assert_eq!(echoes.photons[1], Link::of(&design, &dark()).photons(0.5, 30.0));
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
    }
}
