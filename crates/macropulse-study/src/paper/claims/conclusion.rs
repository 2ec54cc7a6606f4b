//! The conclusion of the paper, sentence by sentence.

use std::f64::consts::PI;

use super::experiment::RECOGNISED;
use crate::paper::claim::{Claim, Verdict, said};
use crate::paper::experiment::{DISTANCES, SENSORS};
use crate::paper::measured::Measured;

const PROPOSED: &str = "kim-park-2016";

/// A row for each sentence.
pub(super) fn claims(measured: &Measured) -> Vec<Claim> {
    let mut claims = proposal(measured);
    claims.extend(uses(measured));
    claims.extend(wishes(measured));
    claims
}

/// Judges the sentences on the proposal.
fn proposal(measured: &Measured) -> Vec<Claim> {
    let found = &measured.on_paper;
    let (timing, payloads, outlook) = (&found.timing, &found.payloads, &found.outlook);
    let right = |receiver| measured.experiment.right(PROPOSED, "perfect detector", receiver);
    let (literal, matched) = (right("literal"), right("matched"));
    let moved = timing.macropulse / timing.pixel_period;
    let (columns, rows, rate) = outlook.directions;
    let dark = payloads.dark.len();
    let sees_all = DISTANCES.iter().all(|&distance| {
        let seen = measured.experiment.at(PROPOSED, distance);
        seen.is_some_and(|seen| seen.points * 10 >= seen.samples * 9 && seen.samples > 0)
    });
    vec![
        said(
            "end-waiting",
            "4",
            "It measures in each direction without waiting for each signal to return",
            "without waiting",
        )
        .holds_if(
            timing.shots_in_flight > 1.0 && matched >= 0.99,
            format!(
                "{:.1} shots are under way and {:.2} % of their echoes told apart, if whole \
                 macropulses are matched",
                timing.shots_in_flight,
                100.0 * matched
            ),
        ),
        said(
            "end-macropulse",
            "4",
            "In each direction it emits a macropulse with the number of its column, by DS-OCDMA",
            "each bearing direction",
        )
        .holds_or_partly(
            dark == 0,
            dark < payloads.columns as usize,
            format!("{dark} of {} columns without any light", payloads.columns),
        ),
        said(
            "end-mirror",
            "4",
            "A mirror instead of a slower motor steers the pulses at high speed",
            "high speed",
        )
        .holds_or_partly(
            moved <= 0.1,
            moved < 1.0,
            format!(
                "{:.0} lines a second, which no motor turns; but it moves on by {moved:.2} pixel \
                 during a macropulse",
                f64::from(rows) * rate
            ),
        ),
        said(
            "end-emission-time",
            "4",
            "As the column received tells the time of emission, no idle listening time is needed",
            "does not require",
        )
        .holds_or_partly(
            literal >= 0.99 && timing.word_range.is_infinite(),
            matched >= 0.99 && timing.word_range > timing.rated_range,
            format!(
                "{:.1} % of the echoes with the receiver as printed, {:.2} % if whole macropulses \
                 are matched; up to {:.0} m, where a code word returns",
                100.0 * literal,
                100.0 * matched,
                timing.word_range
            ),
        ),
        said(
            "end-refresh",
            "4",
            "So it can measure 848 x 480 points 60 times a second",
            "848 \u{d7} 480, 60 times",
        )
        .holds_or_partly(
            outlook.lacks.is_empty() && sees_all,
            (columns, rows) == (848, 480) && rate.round() == 60.0 && sees_all,
            format!("as declared; with the light of class 1: {}", missing(&outlook.lacks)),
        ),
    ]
}

/// Lists the failed checks with their factors.
fn missing(lacks: &[(&'static str, f64)]) -> String {
    let word = |(name, factor): &(&str, f64)| match *factor {
        factor if factor >= 100.0 => format!("{name} fails by a factor of {factor:.0}"),
        factor => format!("{name} by {factor:.2}"),
    };
    match lacks {
        [] => "nothing fails".to_owned(),
        _ => lacks.iter().map(word).collect::<Vec<_>>().join(", "),
    }
}

/// Judges the sentences on uses.
fn uses(measured: &Measured) -> Vec<Claim> {
    let light = &measured.on_paper.light;
    let seen = |sensor, distance| measured.experiment.at(sensor, distance);
    let near = seen(PROPOSED, 30).map_or(f64::NAN, |seen| seen.error);
    let classical = seen("hdl-64e", 30).map_or(f64::NAN, |seen| seen.error);
    let pitch = light.pitch[0] * 30.0;
    let rows =
        |sensor| DISTANCES.map(|distance| seen(sensor, distance).map_or(0, |seen| seen.rows));
    let ours = rows(PROPOSED);
    let theirs = SENSORS.map(|sensor| if sensor == PROPOSED { 0 } else { rows(sensor)[3] });
    let leads =
        ours.iter().all(|&rows| rows >= RECOGNISED) && theirs.iter().all(|&rows| rows < RECOGNISED);
    vec![
        said(
            "end-applications",
            "4",
            "It is good for terrestrial and mobile applications",
            "good for",
        )
        .holds_or_partly(
            light.pd_by_day >= 0.9,
            light.pd_by_night >= 0.5,
            format!(
                "with the light of class 1 white at {:.0} m is seen with Pd {:.3} in the dark and \
                 {:.3} in the sun, where most of them are",
                light.range, light.pd_by_night, light.pd_by_day
            ),
        ),
        said(
            "end-survey",
            "4",
            "It surveys heritage, evidence, crops and objects",
            "is used for",
        )
        .is(
            if near < classical { Verdict::Unsaid } else { Verdict::Fails },
            format!(
                "untried in the paper, and no accuracy is named; points at 30 m are {:.0} mm apart \
                 and off by {:.2} mm (HDL-64E: {:.1} mm)",
                pitch * 1e3,
                near * 1e3,
                classical * 1e3
            ),
        ),
        said(
            "end-robots",
            "4",
            "Autonomous vehicles and robots use 3-D lidars to recognise where they can move",
            "use",
        )
        .is(Verdict::Unsaid, "nothing to measure: said of others, not of this lidar".to_owned()),
        said(
            "end-cameras",
            "4",
            "As resolution and rate are high, surroundings are recognised more easily, without cameras",
            "without cameras",
        )
        .is(
            if leads { Verdict::Partly } else { Verdict::Fails },
            format!(
                "{} rows on the car at 30 to 120 m, at 120 m {} of the HDL-64E and {} of Peregrine, \
                 {RECOGNISED} being needed; whether cameras can be left out is untried",
                ours.map(|rows| rows.to_string()).join(", "),
                theirs[1],
                theirs[2]
            ),
        ),
    ]
}

/// Judges the sentences on further work.
fn wishes(measured: &Measured) -> Vec<Claim> {
    let light = &measured.on_paper.light;
    let outlook = &measured.on_paper.outlook;
    let chip_rate = measured.on_paper.timing.chip_rate;
    vec![
        said(
            "end-front",
            "4",
            "It makes images of what is in front of it alone",
            "in front of the system",
        )
        .holds_if(
            outlook.field < PI,
            format!("a field {:.1}\u{b0} wide", outlook.field.to_degrees()),
        ),
        said(
            "end-surroundings",
            "4",
            "Autonomous driving needs images of the entire area around",
            "are required",
        )
        .is(Verdict::Unsaid, "nothing to measure: a need, not a property".to_owned()),
        said("end-360", "4", "It should be enhanced to 360\u{b0}", "up to 360\u{b0}").holds_if(
            (outlook.field_360 - 2.0 * PI).abs() < 1e-6,
            format!("it can be: {:.0}\u{b0}, `coded-360`", outlook.field_360.to_degrees()),
        ),
        said(
            "half-terahertz",
            "4",
            "It relies on laser pulses of half a terahertz",
            "half-terahertz",
        )
        .holds_if(
            (chip_rate / 0.5e12 - 1.0).abs() < 0.1,
            format!("{:.0} GHz, as printed in 2.2, are {:.1} THz", chip_rate * 1e-9, chip_rate * 1e-12),
        ),
        said("end-slower", "4", "Its pulses must become slower", "lower down the speed").holds_or_partly(
            light.smear > 1.0 && outlook.slower > 1.0,
            outlook.slower > 1.0,
            format!(
                "a surface at 45\u{b0} smears a chip over {:.0}; `bipolar-gold` has chips {:.0} \
                 times as long",
                light.smear, outlook.slower
            ),
        ),
        said(
            "end-synchronous",
            "4",
            "An optical bipolar synchronous code is to be adapted",
            "bipolar synchronous",
        )
        .holds_or_partly(
            outlook.walsh < 0.5,
            outlook.gold < 0.5,
            format!(
                "bipolar, yes; synchronous, no: echoes come at times unknown. Walsh words correlate \
                 with {:.2} of their peak in step, with {:.2} at some delay; Gold words with {:.2} \
                 at any",
                outlook.walsh_in_step, outlook.walsh, outlook.gold
            ),
        ),
    ]
}
