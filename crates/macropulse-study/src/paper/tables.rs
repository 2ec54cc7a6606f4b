//! The tables of the report.

use super::claim::{Claim, Verdict};
use super::experiment::{DISTANCES, Trial};
use super::measured::Closing;
use super::receivers::Comparison;
use crate::view::{self, Align, Cell, Table};
use macropulse::codec::code::prime_sequence;
use macropulse::design::{Design, Extent};
use macropulse::points::Outcome;
use macropulse::units::s_from_fs;

/// `points.csv`: what was counted on the car, and what geometry predicts.
pub(super) fn points_csv(trials: &[Trial]) -> String {
    let mut text = String::from("sensor,distance_m,samples,points,predicted,low,high\n");
    for trial in trials {
        let predicted = &trial.predicted;
        text += &format!(
            "{},{},{},{},{:.1},{:.1},{:.1}\n",
            trial.sensor,
            trial.distance,
            trial.score.samples_on_target,
            trial.score.points_on_target,
            predicted.samples,
            predicted.low,
            predicted.high
        );
    }
    text
}

/// Table 1: the prime sequences.
pub(super) fn prime_sequences(p: u32) -> Table {
    let titles: Vec<String> =
        std::iter::once("i \\ j".to_owned()).chain((0..p).map(|j| j.to_string())).collect();
    let header: Vec<(&str, Align)> = titles.iter().map(|t| (t.as_str(), Align::Right)).collect();
    (0..p).fold(Table::new("", &header), |table, i| {
        let values = prime_sequence(p, i).into_iter().map(|s| s.to_string());
        let row = std::iter::once(format!("**{i}**")).chain(values);
        table.row(row.map(Cell::from).collect())
    })
}

/// Width and height of a field, and where it lies if not about the forward direction.
fn field(extent: &Extent) -> String {
    let [[right, left], [bottom, top]] =
        [extent.azimuth, extent.elevation].map(|ends| ends.map(f64::to_degrees));
    let (wide, high) = (degrees(left - right), format!("{:.1}\u{b0}", top - bottom));
    if top + bottom == 0.0 {
        return format!("{wide} \u{d7} {high}");
    }
    format!("{wide} \u{d7} {high} ({top:+.1}\u{b0} to {bottom:+.1}\u{b0})")
}

/// An angle with one digit; a whole turn without.
fn degrees(angle: f64) -> String {
    if angle == 360.0 { "360\u{b0}".to_owned() } else { format!("{angle:.1}\u{b0}") }
}

/// Table 3: the parameters of the three sensors.
pub(super) fn parameters(designs: &[Design]) -> Table {
    let mut header = vec![("", Align::Left)];
    header.extend(designs.iter().map(|design| (design.name.as_str(), Align::Left)));
    let mut table = Table::new("", &header);
    let mut row = |name: &str, value: &dyn Fn(&Design) -> String| {
        let mut cells = vec![Cell::from(name)];
        cells.extend(designs.iter().map(|design| Cell::from(value(design))));
        table = std::mem::take(&mut table).row(cells);
    };
    row("pattern", &|d| d.scan.summary());
    row("directions", &|d| format!("{} \u{d7} {}", d.scan.columns, d.scan.rows));
    row("field", &|d| field(&d.scan.extent()));
    row("refresh rate", &|d| format!("{} Hz", d.scan.rate_millihertz as f64 / 1e3));
    row("range", &|d| format!("{} m", d.scan.rated_range));
    row("wavelength", &|d| format!("{:.0} nm", d.light.wavelength * 1e9));
    row("light", &|d| {
        let derived = d.derived();
        if d.is_coded() {
            format!(
                "macropulses of {} to {} micropulses of {} ps on {} chips",
                derived.marks.0,
                derived.marks.2,
                d.light.pulse * 1e12,
                derived.chips
            )
        } else {
            format!("single pulses of {} ns", d.light.pulse * 1e9)
        }
    });
    row("pixel period", &|d| format!("{:.3} ns", d.derived().pixel_period * 1e9));
    row("shots in flight", &|d| match d.scan.is_one_flash() {
        true => "1 flash".into(),
        false => format!("{:.1}", d.derived().shots_in_flight),
    });
    row("detector", &|d| d.detector.model().summary());
    row("converters", &|d| {
        let converters = d.readout.tdc().map_or(0, |tdc| tdc.converters);
        format!("{converters} of {} ps", s_from_fs(d.clock.tick_fs) * 1e12)
    });
    table
}

/// Table 4: samples and points on the car.
pub(super) fn counts(trials: &[Trial]) -> Table {
    let header = [
        ("sensor", Align::Left),
        ("distance", Align::Right),
        ("predicted", Align::Right),
        ("band", Align::Right),
        ("samples", Align::Right),
        ("points", Align::Right),
        ("rows on car", Align::Right),
        ("lost on the car, by material", Align::Left),
    ];
    trials.iter().fold(Table::new("", &header), |table, trial| {
        let lost: Vec<String> =
            trial.lost.iter().map(|(material, count)| format!("{material} {count}")).collect();
        table.row(vec![
            Cell::from(trial.sensor),
            Cell::from(format!("{} m", trial.distance)),
            Cell::from(format!("{:.0}", trial.predicted.samples)),
            Cell::from(format!("{:.0} \u{2026} {:.0}", trial.predicted.low, trial.predicted.high)),
            Cell::from(trial.score.samples_on_target.to_string()),
            Cell::from(format!("**{}**", trial.score.points_on_target)),
            Cell::from(trial.rows_on_car.to_string()),
            Cell::from(lost.join(", ")),
        ])
    })
}

/// Ratios of Table 4, the proposed lidar against the others.
pub(super) fn ratios(trials: &[Trial]) -> Table {
    let header = [
        ("distance", Align::Right),
        ("samples : HDL-64E", Align::Right),
        ("points : HDL-64E", Align::Right),
        ("samples : Peregrine", Align::Right),
        ("points : Peregrine", Align::Right),
    ];
    let find = |sensor: &str, distance| {
        trials.iter().find(|t| t.sensor == sensor && t.distance == distance).map(|t| &t.score)
    };
    DISTANCES.iter().fold(Table::new("", &header), |table, &distance| {
        let mut cells = vec![Cell::from(format!("{distance} m"))];
        for other in ["hdl-64e", "peregrine"] {
            let (ours, theirs) = (find("kim-park-2016", distance), find(other, distance));
            let of = |count: fn(&macropulse::score::Score) -> u64| match (ours, theirs) {
                (Some(a), Some(b)) if count(b) > 0 => {
                    format!("{:.1}", count(a) as f64 / count(b) as f64)
                }
                _ => "\u{2013}".to_owned(),
            };
            cells.push(Cell::from(of(|score| score.samples_on_target)));
            cells.push(Cell::from(of(|score| score.points_on_target)));
        }
        table.row(cells)
    })
}

/// The receivers compared.
pub(super) fn receivers(comparisons: &[Comparison]) -> Table {
    let header = [
        ("sensor", Align::Left),
        ("detector", Align::Left),
        ("receiver", Align::Left),
        ("right", Align::Right),
        ("near", Align::Right),
        ("wrong", Align::Right),
        ("missed", Align::Right),
        ("false", Align::Right),
    ];
    comparisons.iter().fold(Table::new("", &header), |table, comparison| {
        let percent = |outcome| Cell::from(format!("{:.2} %", 100.0 * comparison.share(outcome)));
        table.row(vec![
            Cell::from(comparison.sensor),
            Cell::from(comparison.detector),
            Cell::from(comparison.receiver),
            percent(Outcome::Right),
            percent(Outcome::Near),
            percent(Outcome::Wrong),
            percent(Outcome::Missed),
            Cell::from(comparison.score.count(Outcome::False).to_string()),
        ])
    })
}

/// The table of claims.
pub(super) fn claims(claims: &[Claim]) -> Table {
    let header = [
        ("where", Align::Left),
        ("the paper says", Align::Left),
        ("in its words", Align::Left),
        ("measured", Align::Left),
        ("verdict", Align::Left),
    ];
    claims.iter().fold(Table::new("", &header), |table, claim| {
        table.row(vec![
            Cell::from(claim.section),
            Cell::from(claim.claim),
            Cell::from(claim.paper),
            Cell::from(&claim.measured),
            verdict(claim),
        ])
    })
}

/// The verdict of a claim, in its colour.
pub(super) fn verdict(claim: &Claim) -> Cell {
    let name = claim.verdict.name();
    match claim.verdict {
        Verdict::Holds => Cell::verdict(view::Verdict::Holds, name),
        Verdict::Partly => Cell::verdict(view::Verdict::Partly, name),
        Verdict::Fails => Cell::verdict(view::Verdict::Fails, name),
        Verdict::Unsaid | Verdict::Assumed => Cell::from(name),
    }
}

/// The sensors that never wait and close, beside lidars that wait.
pub(super) fn closing(sensors: &[Closing]) -> Table {
    let header = [
        ("sensor", Align::Left),
        ("channels", Align::Right),
        ("aperture, mm", Align::Right),
        ("Pd of 10 %, forecast", Align::Right),
        ("closes?", Align::Left),
        ("channels waiting for its range", Align::Right),
        ("channels waiting for all light", Align::Right),
    ];
    let missing = |sensor: &Closing| {
        let each = sensor.lacks.iter().map(|(name, factor)| format!("{name}, {factor:.1} times"));
        each.collect::<Vec<_>>().join("; ")
    };
    sensors.iter().fold(Table::new("", &header), |table, sensor| {
        let closes = match sensor.lacks.is_empty() {
            true => Cell::verdict(view::Verdict::Holds, "yes"),
            false => Cell::verdict(view::Verdict::Fails, &missing(sensor)),
        };
        table.row(vec![
            Cell::from(format!("`{}`", sensor.sensor)),
            Cell::from(sensor.channels.to_string()),
            Cell::from(format!("{:.0}", sensor.aperture * 1e3)),
            Cell::from(format!("{:.3}", sensor.pd)),
            closes,
            Cell::from(sensor.waiting[0].to_string()),
            Cell::from(sensor.waiting[1].to_string()),
        ])
    })
}
