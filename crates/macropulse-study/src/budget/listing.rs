//! A budget as text, for people.

use macropulse::channel::idealised as idealised_in;
use macropulse::codec::decode::Method;
use macropulse::design::safety::{ASSUMED, TELESCOPE};
use macropulse::environment::Environment;

use super::{Farthest, Figures};
use crate::text::{Columns, section, short};

/// Probability of a return below which a quick receiver may find fewer shots than a thorough one. At 0.95 it
/// loses next to no shots of rooms, at 0.5 one in a hundred, at 0.1 half to nearly all.
const LIKELY: f64 = 0.9;

impl Figures<'_> {
    /// All of it as plain lines of at most 96 characters, each section under its heading.
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

    /// Returns the unit for which photons are counted: a mark, or the whole shot if it has no pulses.
    fn part(&self) -> &'static str {
        if self.design.emission.is_pulsed() { "mark" } else { "shot" }
    }

    fn light(&self) -> Columns {
        let mut columns = Columns::default();
        let there = &self.there;
        let is_pulsed = self.design.emission.is_pulsed();
        let part = self.part();
        match &self.design.budget {
            None => {
                columns.push("energy", "unknown: the sensor is declared by what it can see");
            }
            Some(budget) => {
                let marks = self.design.emission.mean_pulses();
                let power = budget.energy / self.design.derived().pixel_period;
                columns.push(
                    "energy",
                    format!(
                        "{} nJ a shot{}, {} mW on average, at {} nm",
                        short(budget.energy * 1e9),
                        if is_pulsed {
                            format!(" of {} marks", short(marks))
                        } else {
                            String::new()
                        },
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
                    match is_pulsed {
                        true => format!(
                            "{} a shot, {} a mark",
                            short(there.photons_per_shot),
                            short(there.photons_per_shot / marks)
                        ),
                        false => format!("{} a shot", short(there.photons_per_shot)),
                    },
                );
                let chip = if self.design.is_coded() { "chip" } else { "tick" };
                if is_pulsed {
                    let photons = short(self.background_per_chip());
                    columns.push("sunlight", format!("{photons} photons in every {chip}"));
                }
            }
        }
        columns.push(
            "detected",
            match there.detected_per_mark.is_finite() {
                true => format!("{} photons a {part}", short(there.detected_per_mark)),
                false => {
                    "every mark: the sensitivity has pd = 1, and so no scale of light".to_owned()
                }
            },
        );
        if let Some(factor) = self.mark_by_mark {
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
        for limit in self.design.eye_limits() {
            let bright = match short(limit.brightness).as_str() {
                "1" => String::new(),
                times => format!(", {times} times as bright as the mean"),
            };
            let far = match limit.distance == TELESCOPE {
                true => format!(", {} m away", short(limit.distance)),
                false => String::new(),
            };
            columns.push(
                limit.rule.name(),
                format!(
                    "{} nJ a shot ({} of them in {}{bright}{far})",
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
        for Farthest { reflectance, range, range_at_night, there } in &self.farthest {
            text += &format!(
                "  {:>4.0} % {:>9} {:>9} {:>8} {:>8.4} {:>9.1e} {:>10} {:>9} {:>9}\n",
                reflectance * 100.0,
                counted(there.photons_per_shot),
                counted(there.detected_per_mark),
                counted(there.snr),
                there.pd,
                there.false_per_shot,
                there.precision.map_or("-".to_owned(), |told| format!("{:.3} mm", told * 1e3)),
                metres(*range),
                metres(*range_at_night)
            );
        }
        let part = self.part();
        let pd = self.wanted.pd;
        text += &format!(
            "  photons a shot, detected a {part}; range of Pd {pd} in {}, and at night\n",
            self.environment.name
        );
        let method = &self.design.receiver.method;
        if let Some(aside) = self.there.aside.filter(|aside| aside.share >= RARELY) {
            text += &format!(
                "  on a sidelobe {:.1e} of the returns at the rated range, {:.0} mm off (rms), apart from \
                 precision\n",
                aside.share,
                aside.rms * 1e3
            );
        }
        if matches!(method, Method::Matched(..)) && self.there.pd < LIKELY {
            text += "  Pd is that of receiver.effort = \"thorough\" on a target all around; a quick receiver \
                     finds\n  fewer so faint shots, and any finds fewer of a small target\n";
        }
        text
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
}

/// Returns on a sidelobe that are rarer are not spoken of.
const RARELY: f64 = 1e-6;

/// A number of the table; a dash where it has no end.
fn counted(number: f64) -> String {
    if number.is_finite() { short(number) } else { "-".to_owned() }
}

/// A duration in the unit that suits it.
fn time(seconds: f64) -> String {
    let units = [(1.0, "s"), (1e-3, "ms"), (1e-6, "\u{b5}s"), (1e-9, "ns")];
    let unit = units.into_iter().find(|(unit, _)| seconds >= *unit).unwrap_or((1e-12, "ps"));
    format!("{} {}", short(seconds / unit.0), unit.1)
}

fn by(factor: f64) -> String {
    match factor {
        factor if factor.is_finite() => format!(" by a factor of {}", short(factor)),
        _ => " whatever the factor".to_owned(),
    }
}
