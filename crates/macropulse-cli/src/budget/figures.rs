//! What a budget says, as text and as JSON.

use macropulse::channel::idealised as idealised_in;
use macropulse::design::Design;
use macropulse::design::safety::{ASSUMED, Class1, Limit, Rule};
use macropulse::environment::Environment;
use macropulse::predict::verdict::{Check, Wanted, checks, mark_by_mark};
use macropulse::predict::{Forecast, Forecaster};
use macropulse::units::s_from_fs;
use serde_json::{Value, json};

use crate::fault::Fault;
use crate::text::{Columns, section, short};

/// Reflectances that tables and curves show.
pub const REFLECTANCES: [f64; 5] = [0.05, 0.1, 0.3, 0.8, 1.0];

/// Everything there is to say.
pub struct Figures<'a> {
    pub design: &'a Design,
    pub environment: Environment,
    /// The sensor in that environment, and in the same at night.
    pub chosen: Forecaster<'a>,
    pub night: Forecaster<'a>,
    pub wanted: Wanted,
    checks: Vec<Check>,
    by_mark: Option<f64>,
    /// What is to be expected of the target in the environment chosen.
    there: Forecast,
    /// How far each reflectance is seen.
    reaches: Vec<Reach>,
}

/// Where a reflectance is seen.
struct Reach {
    reflectance: f64,
    /// In the environment chosen and at night, m.
    ranges: [Option<f64>; 2],
    /// At the range wanted, in the environment chosen.
    there: Forecast,
}

impl<'a> Figures<'a> {
    pub fn of(design: &'a Design, environment: Environment, wanted: Wanted) -> Result<Self, Fault> {
        let chosen = Forecaster::new(design, &environment)?;
        let night = Forecaster::new(design, &environment.at_night())?;
        let reach = |reflectance: f64| Reach {
            reflectance,
            ranges: [&chosen, &night].map(|sky| sky.reach(wanted.pd, reflectance)),
            there: chosen.forecast(reflectance, wanted.range),
        };
        Ok(Self {
            checks: checks(&chosen, &night, &wanted),
            by_mark: mark_by_mark(&chosen, &wanted),
            there: chosen.forecast(wanted.reflectance, wanted.range),
            reaches: REFLECTANCES.map(reach).into(),
            design,
            environment,
            chosen,
            night,
            wanted,
        })
    }

    /// Whether all that must hold holds.
    fn closes(&self) -> bool {
        self.checks.iter().all(Check::holds)
    }

    /// The first thing that fails.
    pub fn first_failure(&self) -> Option<&Check> {
        self.checks.iter().find(|check| !check.holds())
    }

    pub fn text(&self) -> String {
        let mut text = format!("{}: a link budget\n{}\n", self.design.name, self.design.summary);
        text += &section("Wanted", &self.request());
        text += &section("Light", &self.light());
        text += &section("Eye safety", &self.eyes());
        text += &format!("\nBy reflectance, at {} m\n", short(self.wanted.range));
        text += &self.table();
        let mut list = Columns::default();
        for check in &self.checks {
            let sign = if check.holds() { "holds" } else { "fails" };
            let by = if check.holds() { String::new() } else { by(check.shortfall) };
            list.push(check.name, format!("{sign}{by}: {}", check.finding));
        }
        text += &section("Checks", &list);
        text += &section("Verdict", &self.verdict());
        let mut idealised = Columns::default();
        for effect in idealised_in(self.design, &self.environment) {
            idealised.push(effect.name, effect.assumption);
        }
        text += &section("Idealised", &idealised);
        text
    }

    fn request(&self) -> Columns {
        let mut columns = Columns::default();
        let wanted = &self.wanted;
        let share = short(wanted.reflectance * 100.0);
        let Environment { name, .. } = &self.environment;
        columns.push("target", format!("{share} % at {} m, square on", short(wanted.range)));
        columns.push("in", format!("{name}: {}", self.environment.conditions()));
        columns.push("Pd", format!("at least {}", wanted.pd));
        columns.push("false", format!("at most {:e} points per shot", wanted.false_points));
        columns
    }

    fn light(&self) -> Columns {
        let mut columns = Columns::default();
        let there = &self.there;
        match &self.design.budget {
            None => {
                columns.push("energy", "unknown: the sensor is declared by what it can see");
            }
            Some(budget) => {
                let marks = self.design.coding.codebook.mean_weight();
                let power = budget.energy / self.design.derived().pixel_period;
                columns.push(
                    "energy",
                    format!(
                        "{} nJ a shot of {} marks, {} mW on average, at {} nm",
                        short(budget.energy * 1e9),
                        short(marks),
                        short(power * 1e3),
                        short(budget.wavelength * 1e9)
                    ),
                );
                columns.push(
                    "optics",
                    format!(
                        "{} mm aperture, transmission {}, filter {} nm, field {} msr",
                        short(budget.aperture * 1e3),
                        budget.transmission,
                        short(budget.filter * 1e9),
                        short(budget.field.solid_angle * 1e3)
                    ),
                );
                columns.push(
                    "photons",
                    format!(
                        "{} a shot, {} a mark",
                        short(there.photons_per_shot),
                        short(there.photons_per_shot / marks)
                    ),
                );
                let chip = if self.design.is_coded() { "chip" } else { "tick" };
                columns.push(
                    "sunlight",
                    format!("{} photons in every {chip}", short(self.background_per_chip())),
                );
            }
        }
        columns.push("detected", format!("{} photons a mark", short(there.detected_per_mark)));
        if let Some(factor) = self.by_mark {
            let more = if factor > 1.0 { "more" } else { "of the" };
            columns.push(
                "mark by mark",
                format!("to see every single mark would take {} times {more} light", short(factor)),
            );
        }
        columns
    }

    fn eyes(&self) -> Columns {
        let mut columns = Columns::default();
        let Some(budget) = &self.design.budget else { return columns };
        for limit in &budget.limits {
            let bright = match short(limit.brightness).as_str() {
                "1" => String::new(),
                times => format!(", {times} times as bright as the mean"),
            };
            columns.push(
                limit.rule.name(),
                format!(
                    "{} nJ a shot ({} of them in {}{bright})",
                    short(limit.energy * 1e9),
                    short(limit.shots),
                    time(limit.duration)
                ),
            );
        }
        columns.push("read as", ASSUMED);
        columns
    }

    fn table(&self) -> String {
        let mut text = format!(
            "  {:>6} {:>9} {:>9} {:>8} {:>8} {:>9} {:>10} {:>9} {:>9}\n",
            "target", "photons", "detected", "SNR", "Pd", "false", "precision", "range", "at night"
        );
        let metres = |range: Option<f64>| range.map_or("-".to_owned(), |r| format!("{r:.1} m"));
        for Reach { reflectance, ranges: [range, night], there } in &self.reaches {
            text += &format!(
                "  {:>4.0} % {:>9} {:>9} {:>8} {:>8.4} {:>9.1e} {:>7.3} mm {:>9} {:>9}\n",
                reflectance * 100.0,
                short(there.photons_per_shot),
                short(there.detected_per_mark),
                short(there.snr),
                there.pd,
                there.false_per_shot,
                there.precision * 1e3,
                metres(*range),
                metres(*night)
            );
        }
        let pd = self.wanted.pd;
        text + &format!(
            "  photons a shot, detected a mark; range of Pd {pd} in {}, and at night\n",
            self.environment.name
        )
    }

    fn verdict(&self) -> Columns {
        let mut columns = Columns::default();
        match self.first_failure() {
            None => columns.push("closes", "everything that was asked for holds"),
            Some(check) => {
                columns.push(
                    "does not close",
                    format!("{} fails first{}", check.name, by(check.shortfall)),
                );
                columns.push("needed", check.remedy.clone());
            }
        }
        columns
    }

    fn background_per_chip(&self) -> f64 {
        let chip = s_from_fs(self.design.coding.chip_fs);
        let detected = self.chosen.operating().background * chip;
        self.design.budget.as_ref().map_or(0.0, |budget| detected / budget.efficiency)
    }

    pub fn json(&self) -> Value {
        let there = &self.there;
        let budget = self.design.budget.as_ref();
        let marks = self.design.coding.codebook.mean_weight();
        let class = Class1::at(self.design.light.wavelength);
        let alone = |limit: &&Limit| limit.rule == Rule::SingleShot;
        let single = budget
            .and_then(|budget| budget.limits.iter().find(alone))
            .zip(class)
            .map(|(limit, class)| class.single_exposure(limit.duration) * 1e9);
        json!({
            "sensor": self.design.name,
            "environment": self.environment.name,
            "conditions": self.environment.conditions(),
            "range_m": self.wanted.range,
            "reflectance": self.wanted.reflectance,
            "energy_per_macropulse_nj": budget.map(|budget| budget.energy * 1e9),
            "photons_per_macropulse": budget.map(|_| there.photons_per_shot),
            "photons_per_micropulse": budget.map(|_| there.photons_per_shot / marks),
            "detected_per_micropulse": there.detected_per_mark,
            "background_photons_per_chip": budget.map(|_| self.background_per_chip()),
            "single_pulse_ael_nj": single,
            "cw_ael_mw": class.map(|class| class.continuous() * 1e3),
            "limits": budget.map(|budget| budget.limits.iter().map(|limit| json!({
                "rule": limit.rule.name(),
                "shots": limit.shots,
                "brightness": limit.brightness,
                "duration_s": limit.duration,
                "energy_per_macropulse_nj": limit.energy * 1e9,
            })).collect::<Vec<_>>()),
            "pd": there.pd,
            "pd_wanted": self.wanted.pd,
            "false_points_per_shot": there.false_per_shot,
            "false_points_wanted": self.wanted.false_points,
            "snr": finite(there.snr),
            "precision_mm": there.precision * 1e3,
            "precision_bound_mm": there.bound * 1e3,
            "converter_loss": there.bank_loss,
            "mark_by_mark_shortfall": self.by_mark,
            "by_reflectance": self.reaches.iter().map(reach_json).collect::<Vec<_>>(),
            "checks": self.checks.iter().map(check_json).collect::<Vec<_>>(),
            "first_failure": self.first_failure().map(check_json),
            "closes": self.closes(),
            "idealised": idealised_in(self.design, &self.environment)
                .iter()
                .map(|effect| effect.name)
                .collect::<Vec<_>>(),
        })
    }
}

fn reach_json(reach: &Reach) -> Value {
    json!({
        "reflectance": reach.reflectance,
        "photons_per_macropulse": finite(reach.there.photons_per_shot),
        "snr": finite(reach.there.snr),
        "pd": reach.there.pd,
        "false_points_per_shot": reach.there.false_per_shot,
        "precision_mm": reach.there.precision * 1e3,
        "range_of_pd_m": reach.ranges[0],
        "range_of_pd_at_night_m": reach.ranges[1],
    })
}

fn check_json(check: &Check) -> Value {
    json!({
        "what": check.name,
        "holds": check.holds(),
        "factor": finite(check.shortfall),
        "finding": check.finding,
        "needed": check.remedy,
    })
}

/// A duration in the unit that suits it.
fn time(seconds: f64) -> String {
    let units = [(1.0, "s"), (1e-3, "ms"), (1e-6, "\u{b5}s"), (1e-9, "ns")];
    let unit = units.into_iter().find(|(unit, _)| seconds >= *unit).unwrap_or((1e-12, "ps"));
    format!("{} {}", short(seconds / unit.0), unit.1)
}

/// JSON has no infinity: `null` stands for it.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn by(factor: f64) -> String {
    match factor {
        factor if factor.is_finite() => format!(" by a factor of {}", short(factor)),
        _ => " whatever the factor".to_owned(),
    }
}
