//! The sizes of effects that are not modelled, in closed form.

use std::f64::consts::{LN_2, PI};

use crate::channel::{Error, Link, Operating};
use crate::design::detector::Lit;
use crate::design::{Budget, Design};
use crate::environment::Environment;
use crate::units::{range_from_tof, s_from_fs};

/// Share of light that a pane reflects if it falls on it square on, both faces together: 2·((n − 1)/(n +
/// 1))², n = 1.5 (Fresnel).
const PANE: f64 = 0.08;

/// Solid angle of the sun, sr: its disk is 0.533° wide.
const SUN: f64 = 6.8e-5;

/// Structure constant of the refractive index over warm ground at noon, m^(−2/3) \[AP05\].
const WARM_GROUND: f64 = 1e-13;

/// Farthest range that is looked at, m.
const FARTHEST: f64 = 1e5;

/// A sensor at work, with the light that a mark has to bring.
pub struct Sized<'a> {
    design: &'a Design,
    link: Link,
    /// Detected photons of a mark that makes an event half of the time; `None` where none does.
    needed: Option<f64>,
    /// Backscatter of the air, 1/(m·sr).
    backscatter: f64,
}

impl<'a> Sized<'a> {
    /// The sensor `design` in `environment`.
    ///
    /// # Errors
    /// If it cannot be simulated there.
    pub fn of(design: &'a Design, environment: &Environment) -> Result<Self, Error> {
        let operating = Operating::of(design, environment)?;
        let lit = |photons: f64| Lit {
            photons,
            background: operating.background,
            falling: operating.false_rate,
        };
        let detector = design.detector.model();
        let needed = least(1e-6, 1e12, |photons| detector.mark_pd(&lit(photons)) >= 0.5);
        let backscatter = environment.backscatter(design.light.wavelength);
        Ok(Self { design, link: operating.link, needed, backscatter })
    }

    /// Range, m, up to which the light that the air sends back exceeds the light that a mark has to bring;
    /// `None` if the air sends none back.
    ///
    /// A volume of the backscatter β that is c·τ/2 deep shines like a surface of the reflectance π·β·c·τ/2
    /// that fills the beam. The equivalent width of a mark in the detector is τ, √(π/(4·ln 2)) of its full
    /// width for a Gaussian.
    pub fn air_reach(&self) -> Option<f64> {
        let design = self.design;
        let tick = s_from_fs(design.clock.tick_fs);
        let width = design.detector.model().response().max(design.light.pulse).max(tick);
        let depth = range_from_tof(width) * (PI / (4.0 * LN_2)).sqrt();
        let reflectance = PI * self.backscatter * depth;
        (reflectance > 0.0).then_some(())?;
        self.reach(reflectance)
    }

    /// Up to which range, m, the image of a white wall in a pane is seen: both ways by the pane.
    pub fn image_reach(&self) -> Option<f64> {
        self.reach(PANE * PANE)
    }

    /// The nearest range that is measured, m; 1 m where the gate begins at the sensor.
    pub fn nearest(&self) -> f64 {
        match self.design.scan.min_range {
            nearest if nearest > 0.0 => nearest,
            _ => 1.0,
        }
    }

    /// The light of white at the nearest range over what a mark has to bring.
    pub fn nearest_over_threshold(&self) -> Option<f64> {
        Some(self.link.detected(1.0, self.nearest()) / self.needed?)
    }

    /// The farthest range, m, at which a surface of such a `reflectance` that fills the beam brings
    /// what a mark has to bring; 0 where there is none.
    fn reach(&self, reflectance: f64) -> Option<f64> {
        let needed = self.needed?;
        let is_dark = |range: f64| self.link.detected(reflectance, range) < needed;
        Some(least(1e-6, FARTHEST, is_dark).unwrap_or(FARTHEST))
    }
}

/// The least value between `low` and `high` at which `holds`, which holds above it as well, to 1e-9
/// of it; `None` if it holds nowhere.
fn least(low: f64, high: f64, holds: impl Fn(f64) -> bool) -> Option<f64> {
    holds(high).then_some(())?;
    let (mut low, mut high) = (low, high);
    while high / low > 1.0 + 1e-9 {
        let middle = (low * high).sqrt();
        if holds(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

/// From where on, m, the field holds the beam of a laser that stands beside the lens, its axis one
/// aperture D away: R = D/√(Ω/π), Ω the solid angle of the field.
pub fn overlap_from(budget: &Budget) -> f64 {
    budget.aperture / (budget.field.solid_angle / PI).sqrt()
}

/// The counts of sunlight over those of the scene on average: 1/ρ in a field that is filled with sunlit
/// white, and π/(ρ·Ω) in one that holds the sun. The solid angle Ω is that of the field or, if that is
/// larger, of the sun. `None` if there is no sunlight.
pub fn brightest(budget: &Budget, environment: &Environment) -> Option<(f64, f64)> {
    let is_dark = environment.irradiance(budget.wavelength)? * environment.albedo == 0.0;
    (!is_dark).then(|| {
        let field = budget.field.solid_angle.max(SUN);
        (1.0 / environment.albedo, PI / (environment.albedo * field))
    })
}

/// Standard deviation over mean of the light of a plane wave on a point after `range` metres of
/// weak turbulence: √(1.23·C_n²·k^(7/6)·R^(11/6)), k = 2π/λ \[AP05\].
pub fn scintillation(wavelength: f64, range: f64) -> f64 {
    let wave_number = 2.0 * PI / wavelength;
    let variance =
        1.23 * WARM_GROUND * libm::pow(wave_number, 7.0 / 6.0) * libm::pow(range, 11.0 / 6.0);
    variance.sqrt()
}

/// `value` with two digits, or as a whole number from 10 to 10⁵.
pub fn rounded(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        large if large >= 1e5 => format!("{value:.1e}"),
        whole if whole >= 10.0 => format!("{value:.0}"),
        small => {
            let digits = (1 - libm::floor(libm::log10(small)) as i32).max(0) as usize;
            format!("{value:.digits$}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::tof_from_range;
    use approx::assert_relative_eq;

    fn environment(name: &str) -> Environment {
        Environment::named(name).unwrap()
    }

    #[test]
    fn numbers_have_two_digits() {
        let told = [0.0, 0.0123, 1.26, 14.6, 99_999.0, 123_456.0].map(rounded);
        assert_eq!(told, ["0", "0.012", "1.3", "15", "99999", "1.2e5"]);
    }

    /// Rytov variance at 905 nm over 150 m, worked out by hand.
    #[test]
    fn light_over_warm_ground_varies_by_a_third() {
        assert_relative_eq!(scintillation(905e-9, 150.0), 0.34, max_relative = 0.01);
    }

    #[test]
    fn the_least_value_is_found_and_nothing_where_there_is_none() {
        assert_relative_eq!(least(1e-3, 1e3, |x| x >= 0.7).unwrap(), 0.7, max_relative = 1e-8);
        assert_eq!(least(1e-3, 1e3, |_| false), None);
    }

    /// A second way to the reach: the light of each slice of fog, summed under the Gaussian response
    /// of the detector, against the threshold that the detector says itself.
    #[test]
    fn the_reach_of_fog_is_that_of_the_sum_over_its_slices() {
        for (sensor, beam) in [("coded-32", 40e-9), ("vlp-16", 88e-9)] {
            let fog = environment("fog-50m");
            let design = Design::open(sensor, &[]).unwrap();
            let seen = Sized::of(&design, &fog).unwrap();
            let reach = seen.air_reach().unwrap();
            let operating = Operating::of(&design, &fog).unwrap();
            let model = design.detector.model();
            let threshold = model.noise(operating.background).unwrap().threshold;
            let budget = design.budget.as_ref().unwrap();
            let energy = budget.energy / design.emission.mean_pulses().max(1.0);
            assert_relative_eq!(energy, beam, max_relative = 0.1);
            let extinction = 3.912 / 50.0;
            let (mut sum, step) = (0.0, 1e-3);
            for slice in 1..100_000 {
                let range = step * f64::from(slice);
                let late = tof_from_range(reach - range);
                let share = (-4.0 * LN_2 * (late / model.response()).powi(2)).exp();
                let white = budget.efficiency * budget.photons(energy, 1.0, range);
                let air = PI * extinction / 18.8 * step * (-2.0 * extinction * range).exp();
                sum += white * air * share * budget.field.share(tof_from_range(range));
            }
            assert_relative_eq!(sum, threshold, max_relative = 0.02);
        }
    }

    #[test]
    fn a_vacuum_sends_nothing_back_and_denser_fog_more() {
        let design = Design::open("coded-32", &[]).unwrap();
        let reach = |name: &str| Sized::of(&design, &environment(name)).unwrap().air_reach();
        assert_eq!(reach("vacuum-dark"), None);
        assert!(reach("clear-day").unwrap() < reach("rain-25mm").unwrap());
        assert!(reach("rain-25mm").unwrap() < reach("fog-50m").unwrap());
    }
}
