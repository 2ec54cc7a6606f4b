//! The budget of a link: will it work, how far, and what fails first?
//!
//! Everything is a forecast in closed form. [`Figures`] are the numbers; they can be told as text,
//! as JSON and as a page with curves.

mod json;
mod listing;
mod page;

use macropulse::design::Design;
use macropulse::environment::Environment;
use macropulse::predict::verdict::{Check, Wanted, checks, mark_by_mark};
use macropulse::predict::{Error, Forecast, Forecaster};
use macropulse::units::s_from_fs;

/// Reflectances that tables and curves show.
pub const REFLECTANCES: [f64; 5] = [0.05, 0.1, 0.3, 0.8, 1.0];

/// Reflectance of the target where nothing else is said; 1 is white.
pub const USUAL_REFLECTANCE: f64 = 1.0;

/// Probability of a return that is wanted where nothing else is said.
pub const USUAL_PD: f64 = 0.9;

/// False points per shot that are accepted where nothing else is said.
pub const USUAL_FALSE_POINTS: f64 = 1e-4;

/// Returns the default requirements on `design`, for a target at the rated range of the sensor.
pub fn usual(design: &Design) -> Wanted {
    Wanted {
        reflectance: USUAL_REFLECTANCE,
        range: design.scan.rated_range,
        pd: USUAL_PD,
        false_points: USUAL_FALSE_POINTS,
    }
}

/// All numbers of a budget.
#[derive(Debug)]
pub struct Figures<'a> {
    /// The sensor.
    pub design: &'a Design,
    /// The environment chosen.
    pub environment: Environment,
    /// The sensor in that environment.
    pub chosen: Forecaster<'a>,
    /// The sensor in the same environment at night.
    pub night: Forecaster<'a>,
    /// Requirements on the sensor.
    pub wanted: Wanted,
    /// Checks that must hold, in the order of the light.
    pub checks: Vec<Check>,
    /// The light that a receiver which must see every single mark needs, over the light there is;
    /// `None` where shots are not coded.
    pub mark_by_mark: Option<f64>,
    /// Forecast for the target wanted, in the environment chosen.
    pub there: Forecast,
    /// How far each of [`REFLECTANCES`] is seen.
    pub farthest: Vec<Farthest>,
}

/// How far a reflectance is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Farthest {
    /// Reflectance of the target; 1 is white.
    pub reflectance: f64,
    /// Farthest range with the Pd wanted in the environment chosen, m; `None` where there is none.
    pub range: Option<f64>,
    /// The same at night, m.
    pub range_at_night: Option<f64>,
    /// Forecast at the range wanted, in the environment chosen.
    pub there: Forecast,
}

impl<'a> Figures<'a> {
    /// Returns the budget of `design` in `environment` for the requirements `wanted`.
    ///
    /// # Errors
    /// If the sensor cannot work in that environment, as [`Forecaster::new`].
    pub fn of(design: &'a Design, environment: Environment, wanted: Wanted) -> Result<Self, Error> {
        let chosen = Forecaster::new(design, &environment)?;
        let night = Forecaster::new(design, &environment.at_night())?;
        let farthest = |reflectance: f64| Farthest {
            reflectance,
            range: chosen.farthest(wanted.pd, reflectance),
            range_at_night: night.farthest(wanted.pd, reflectance),
            there: chosen.forecast(reflectance, wanted.range),
        };
        Ok(Self {
            checks: checks(&chosen, &night, &wanted),
            mark_by_mark: mark_by_mark(&chosen, &wanted),
            there: chosen.forecast(wanted.reflectance, wanted.range),
            farthest: REFLECTANCES.map(farthest).into(),
            design,
            environment,
            chosen,
            night,
            wanted,
        })
    }

    /// Returns true if all checks hold.
    pub fn closes(&self) -> bool {
        self.first_failure().is_none()
    }

    /// The first thing that fails.
    pub fn first_failure(&self) -> Option<&Check> {
        self.checks.iter().find(|check| !check.holds())
    }

    /// Photons of sunlight that reach the detector during a chip; of a sensor without a code during
    /// a tick. 0 where the sensor has no link budget.
    pub fn background_per_chip(&self) -> f64 {
        let chip = s_from_fs(self.design.emission.coding().chip_fs);
        let detected = self.chosen.operating().background * chip;
        self.design.budget.as_ref().map_or(0.0, |budget| detected / budget.efficiency)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Text, JSON and page tell one verdict. At 150 m, where the sensor has enough light, it is not the light that fails.
    #[test]
    fn every_telling_names_what_fails_first() {
        let design = Design::open("kim-park-2016-physical", &[]).unwrap();
        let fails_at = |range: f64| {
            let wanted = Wanted { range, ..usual(&design) };
            let figures = Figures::of(&design, Environment::default(), wanted).unwrap();
            let name = figures.first_failure().map_or("nothing", |check| check.name);
            assert_eq!(figures.json()["first_failure"]["what"], name);
            assert_eq!(figures.json()["closes"], figures.closes());
            assert!(figures.text().contains(&format!("does not close  {name} fails first")));
            assert!(figures.page().html().contains(&figures.text()[..40]));
            name
        };
        assert_eq!(usual(&design).range, 150.0);
        assert_eq!(fails_at(150.0), "sunlight");
        assert_eq!(fails_at(220.0), "light");
    }

    #[test]
    fn a_sensor_without_a_link_budget_has_no_sunlight_to_tell_of() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let figures = Figures::of(&design, Environment::default(), usual(&design)).unwrap();
        assert_eq!(figures.background_per_chip(), 0.0);
        assert!(figures.json()["background_photons_per_chip"].is_null());
        assert_eq!(figures.farthest.len(), REFLECTANCES.len());
    }
}
