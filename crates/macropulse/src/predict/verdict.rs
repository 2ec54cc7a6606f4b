//! The verdict on a design: if it meets its requirements, and what fails first.

use std::f64::consts::FRAC_PI_4;

use super::forecast::{Forecast, Forecaster};
use super::link::spot_depth;
use super::own_light::{Blind, stray_room};
use super::way;
use crate::design::Design;
use crate::design::safety::strictest;
use crate::units::{range_from_tof, s_from_fs};

/// Share of converters' work that may be lost.
const LOSS: f64 = 0.01;

/// Requirements on a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Reflectance of the target.
    pub reflectance: f64,
    /// Range of the target, m.
    pub range: f64,
    /// Least probability of a return.
    pub pd: f64,
    /// Most false returns per shot that meets nothing.
    pub false_points: f64,
}

/// One thing that must hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// The subject of the check.
    pub name: &'static str,
    /// By what factor it is missed; it holds up to 1. Infinite where no factor would do.
    pub shortfall: f64,
    /// The finding.
    pub finding: String,
    /// The change that would be needed.
    pub remedy: String,
}

impl Check {
    /// Tells if the check holds.
    pub fn holds(&self) -> bool {
        self.shortfall <= 1.0
    }
}

/// The checks in the order of the light: eyes, the light alone, own light, sunlight, converters, false
/// returns, chips on a slanted surface. `by_night` is the same without the sun. Idealised properties are left
/// out.
pub fn checks(by_day: &Forecaster, by_night: &Forecaster, wanted: &Wanted) -> Vec<Check> {
    let day = by_day.design();
    let forecast = by_day.forecast(wanted.reflectance, wanted.range);
    let mut checks = Vec::new();
    checks.extend(eyes(day));
    let light = light(by_night, wanted);
    let bright_enough = light.holds();
    checks.push(light);
    if bright_enough {
        checks.extend(own_light(by_night, wanted));
    }
    checks.extend(stray_light(day));
    if bright_enough && day.budget.is_some() && by_day.operating().background > 0.0 {
        checks.push(sunlight(by_day, wanted, &forecast));
    }
    checks.push(converters(day, &forecast));
    checks.push(Check {
        name: "false points",
        shortfall: forecast.false_per_shot / wanted.false_points,
        finding: format!(
            "{:.1e} per shot, wanted {:.1e}",
            forecast.false_per_shot, wanted.false_points
        ),
        remedy: "a smaller false_alarm of the receiver, or fewer dark and background counts".into(),
    });
    checks.extend(slant(day, wanted.range));
    checks
}

/// The light that a receiver needs which decides mark by mark, over the light there is from `wanted`. It must
/// see all N marks, the mean number, with probability 0.99: a counter without noise needs n = −ln(1 −
/// 0.99^(1/N)) photons of each. `None` if shots are not coded, or if the sensor never misses.
pub fn mark_by_mark(forecaster: &Forecaster, wanted: &Wanted) -> Option<f64> {
    let design = forecaster.design();
    let marks = design.emission.coding().codebook.mean_weight();
    let needed = -libm::log1p(-libm::pow(0.99, 1.0 / marks));
    let forecast = forecaster.forecast(wanted.reflectance, wanted.range);
    let is_told = design.is_coded() && forecast.detected_per_mark.is_finite();
    is_told.then(|| needed / forecast.detected_per_mark)
}

fn eyes(design: &Design) -> Option<Check> {
    let budget = design.budget.as_ref()?;
    let limit = strictest(design.eye_limits())?;
    Some(Check {
        name: "eye safety",
        shortfall: budget.energy / limit.energy * (1.0 - 1e-12),
        finding: format!(
            "{:.3} nJ a shot; class 1 allows {:.3} nJ ({})",
            budget.energy * 1e9,
            limit.energy * 1e9,
            limit.rule.name()
        ),
        remedy: "less energy a shot, fewer shots through one pupil, or 1550 nm".into(),
    })
}

fn light(night: &Forecaster, wanted: &Wanted) -> Check {
    let factor = night.light_needed(wanted.pd, wanted.reflectance, wanted.range);
    let found = night.forecast(wanted.reflectance, wanted.range);
    let remedy = match factor {
        Some(factor) => format!(
            "{factor:.3} times the energy, or an aperture {:.2} times as wide",
            factor.sqrt()
        ),
        None if night.design().receiver.method.sampling().is_some() => {
            "no amount of light would do: own light hides too many marks there".to_owned()
        }
        None => {
            let limit = way::of(night.design())
                .map_or("the receiver finds too many marks lit", |way| way.limit_of_light);
            format!("no amount of light would do: {limit}")
        }
    };
    let light = match found.photons_per_shot.is_finite() {
        true => format!("{:.1} photons a shot", found.photons_per_shot),
        false => "a detector that never misses".to_owned(),
    };
    Check {
        name: "light",
        shortfall: factor.unwrap_or(f64::INFINITY),
        finding: format!("in the dark Pd {:.3} from {light}, wanted {}", found.pd, wanted.pd),
        remedy,
    }
}

/// Exactness of forecasts of samples: with four times the points of their sum they differ by less.
const EXACT: f64 = 1e-3;

/// By what factor more is missed where returns have probability `pd` than where they have the one `wanted`: 1 at
/// most, if a forecast does not tell one from the other.
pub fn missed(pd: f64, wanted: f64) -> f64 {
    let factor = (1.0 - pd) / (1.0 - wanted).max(f64::MIN_POSITIVE);
    if pd < wanted - EXACT { factor } else { factor.min(1.0) }
}

/// Checks that enough is found at the range, up to the wanted one, at which own light hides most marks;
/// `None` for a channel that it does not blind.
fn own_light(night: &Forecaster, wanted: &Wanted) -> Option<Check> {
    Blind::at_most(night.design().receiver.method.sampling()?)?;
    let worst = night.worst(wanted.reflectance, wanted.range);
    Some(Check {
        name: "own light",
        shortfall: missed(worst.pd, wanted.pd),
        finding: format!(
            "Pd {:.3} at {:.2} m, the worst range, wanted {}",
            worst.pd, worst.range, wanted.pd
        ),
        remedy: "words that lose fewer marks to own light, or more channels".into(),
    })
}

/// Stray light of the sensor's own marks that is not over when the channel listens again; `None` where it is.
fn stray_light(design: &Design) -> Option<Check> {
    let room = stray_room(design).filter(|room| *room < 1.0)?;
    Some(Check {
        name: "stray light",
        shortfall: 1.0 / room,
        finding: format!(
            "stray light of the sensor's own marks is {:.3e} times too strong to be over when the channel \
             listens again: every shot returns it",
            1.0 / room
        ),
        remedy:
            "a longer blank_ns of the receiver, more isolation_db, more bandwidth, or less energy"
                .into(),
    })
}

fn sunlight(day: &Forecaster, wanted: &Wanted, forecast: &Forecast) -> Check {
    let bearable = day.background_bearable(wanted.pd, wanted.reflectance, wanted.range);
    // In a linear detector the sun is noise: fewer counts do not help, more light does.
    let brighter = day.light_needed(wanted.pd, wanted.reflectance, wanted.range);
    let shortfall = bearable.map(f64::recip).or(brighter).unwrap_or(f64::INFINITY);
    Check {
        name: "sunlight",
        shortfall,
        finding: match day.design().records().is_by_shot() {
            true => format!("under the sun Pd {:.3}", forecast.pd),
            false => format!(
                "under the sun Pd {:.3}; a place where a mark is looked for is lit with probability {:.3}",
                forecast.pd, forecast.density
            ),
        },
        remedy: "a narrower field or filter by that factor, or more light in fewer marks".into(),
    }
}

fn converters(design: &Design, forecast: &Forecast) -> Check {
    let loss = forecast.bank_loss;
    let finding = match design.bank() {
        None => design.readout.model().unshared().to_owned(),
        Some(bank) => format!(
            "{:.2} % of detection events find all {} of a detector's bank busy",
            loss * 100.0,
            bank.converters
        ),
    };
    Check {
        name: "converters",
        shortfall: if loss > LOSS { 1.0 / (1.0 - loss) } else { loss / LOSS },
        finding,
        remedy: "more converters, a shorter dead time, or fewer dark and background counts".into(),
    }
}

/// Checks that the receiver separates chips, or marks behind the detector, on a surface at `range` metres
/// that is slanted by 45°. `None` for a beam that is a line, and for light without pulses.
pub fn slant(design: &Design, range: f64) -> Option<Check> {
    if design.light.divergence == 0.0 || !design.emission.is_pulsed() {
        return None;
    }
    let spot = libm::hypot(design.light.beam_diameter, design.light.divergence * range);
    let swept = swept(design) * range;
    let depth = spot_depth(libm::hypot(spot, swept), FRAC_PI_4);
    let chip = match design.is_coded() {
        true => s_from_fs(design.emission.coding().chip_fs),
        false => design.light.pulse,
    };
    let chip = range_from_tof(chip.max(design.detector.model().response()));
    Some(Check {
        name: "slant",
        shortfall: depth / chip,
        finding: format!(
            "a spot of {:.0} mm that moves by {:.0} mm on a surface at 45° is {:.0} mm deep, a chip \
             {:.2} mm",
            spot * 1e3,
            swept * 1e3,
            depth * 1e3,
            chip * 1e3
        ),
        remedy: "longer chips, a shorter macropulse, or a wider beam that spreads less".into(),
    })
}

/// Angle, rad, by which the mirror moves on during a macropulse.
fn swept(design: &Design) -> f64 {
    let Some(pixel) = design.scan.model().moves_by().filter(|_| design.scan.moves) else {
        return 0.0;
    };
    let derived = design.derived();
    derived.macropulse / derived.shortest_dwell * pixel
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::Environment;

    fn physical(set: &[(&str, &str)]) -> Design {
        let owned = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
        let set: Vec<_> = set.iter().map(owned).collect();
        Design::open("kim-park-2016-physical", &set).unwrap()
    }

    /// By day and by night.
    fn skies(design: &Design) -> [Forecaster<'_>; 2] {
        let day = Environment::default();
        [&day, &day.at_night()].map(|sky| Forecaster::new(design, sky).unwrap())
    }

    const WHITE: Wanted = Wanted { reflectance: 1.0, range: 150.0, pd: 0.9, false_points: 1e-4 };

    fn failing(checks: &[Check]) -> Vec<&str> {
        checks.iter().filter(|check| !check.holds()).map(|check| check.name).collect()
    }

    #[test]
    fn the_paper_has_too_much_sun_and_too_little_light_beyond_its_gate() {
        let design = physical(&[]);
        let [day, night] = skies(&design);
        assert_eq!(failing(&checks(&day, &night, &WHITE)), ["sunlight", "converters", "slant"]);
        assert_eq!(failing(&checks(&night, &night, &WHITE)), ["slant"]);
        let farther = Wanted { range: 220.0, ..WHITE };
        assert_eq!(failing(&checks(&day, &night, &farther)), ["light", "converters", "slant"]);
        assert_eq!(failing(&checks(&night, &night, &farther)), ["light", "slant"]);
    }

    /// 99 times too little light for a receiver that must see every micropulse.
    #[test]
    fn chip_by_chip_it_is_short_by_a_factor_of_100() {
        let design = physical(&[]);
        let [day, _] = skies(&design);
        let factor = mark_by_mark(&day, &WHITE).unwrap();
        assert!((97.0..101.0).contains(&factor), "{factor}");
        let uncoded = Design::open("hdl-64e", &[]).unwrap();
        assert_eq!(mark_by_mark(&skies(&uncoded)[0], &WHITE), None);
    }

    #[test]
    fn more_energy_than_class_1_allows_is_said_with_its_factor() {
        let own = "['eye-safety', 'detector-bandwidth', 'inter-chip', 'mirror-motion']";
        let design = physical(&[("light.energy", "{ shot_nj = 10.1 }"), ("idealised", own)]);
        let [day, night] = skies(&design);
        let checks = checks(&day, &night, &WHITE);
        assert_eq!(checks[0].name, "eye safety");
        assert!((12.1..12.4).contains(&checks[0].shortfall), "{}", checks[0].shortfall);
    }

    #[test]
    fn a_black_target_needs_more_light() {
        let design = physical(&[]);
        let [day, night] = skies(&design);
        let checks = checks(&day, &night, &Wanted { reflectance: 0.05, ..WHITE });
        let light = checks.iter().find(|check| check.name == "light").unwrap();
        assert!(light.shortfall > 5.0 && light.shortfall < 40.0, "{}", light.shortfall);
        assert!(checks.iter().all(|check| check.name != "sunlight"));
    }
}
