//! What is told of a shot that was decided by samples.

use macropulse::codec::decode::{
    Light, MarkSeen, MarkState, Refusal, Reject, SampledExplanation, Sampling, Tested,
};
use macropulse::units::range_from_tof;
use serde_json::{Value, json};

use super::Explained;
use super::ticks::MOST_OTHERS;
use crate::text::{Columns, counted, short};

impl Explained<'_> {
    /// Adds what is `told` to programs, the signal apart.
    pub(super) fn add_samples(&self, told: &SampledExplanation, json: &mut Value) {
        let tested = told.tested.iter().map(|tested| self.tested_json(tested));
        let cancelled = told.cancelled.iter().zip(&self.others).map(|(echo, (row, column))| {
            json!({
                "row": row,
                "column": column,
                "begins_ticks": echo.begins,
                "photons": echo.photons,
                "shared": echo.shared,
            })
        });
        json["noise_photons"] = told.sigma.into();
        json["threshold_deviations"] = told.threshold.into();
        json["more_if_missing_deviations"] = Sampling::MORE_IF_MISSING.into();
        json["least_marks"] = told.fewest.into();
        json["is_candidate"] = told.is_candidate.into();
        json["tested"] = tested.collect();
        json["cancelled"] = cancelled.collect();
    }

    fn tested_json(&self, tested: &Tested) -> Value {
        let marks = tested.marks.iter().map(|mark| {
            json!({
                "tick": mark.tick,
                "photons": mark.photons,
                "doubt_photons": mark.doubt,
                "state": mark.state.name(),
            })
        });
        let mut json = json!({
            "lag_ticks": tested.lag,
            "range_m": self.range(tested.lag),
            "deviations": tested.score,
            "threshold_deviations": tested.threshold,
            "marks": marks.collect::<Vec<_>>(),
        });
        match tested.outcome {
            Ok(Light { late, photons, is_clipped }) => {
                json["outcome"] = "found".into();
                json["late_ticks"] = late.into();
                json["photons"] = photons.into();
                json["is_clipped"] = is_clipped.into();
            }
            Err(refusal) => json["outcome"] = refusal.name().into(),
        }
        json
    }

    /// Adds the signal about the marks and every lag.
    pub(super) fn add_signal(&self, told: &SampledExplanation, json: &mut Value) {
        let SampledExplanation { gate, step, score, left, signal: (first, whole, rest), .. } = told;
        json["signal"] = json!({
            "first_tick": first,
            "photons": whole,
            "photons_without_others": rest,
        });
        json["correlation"] = json!({
            "first_lag_ticks": gate.start,
            "step_ticks": step,
            "first_range_m": self.range(gate.start),
            "step_m": self.range(gate.start + step) - self.range(gate.start),
            "deviations": score,
            "deviations_without_others": left,
        });
    }

    /// Why it was decided so, in sentences.
    pub(super) fn why_of_samples(&self, told: &SampledExplanation) -> String {
        let mut said: Vec<String> = Vec::new();
        for one in &told.verdict.returns {
            let is_it =
                |tested: &&Tested| tested.outcome.is_ok_and(|light| light.photons == one.photons);
            let asked = told.tested.iter().find(is_it).and_then(|one| one.score.zip(one.threshold));
            let sum = asked.map_or(String::new(), |(score, threshold)| {
                let (score, threshold) = (deviations(score), deviations(threshold));
                format!(
                    ", and their sum is {score} standard deviations of the noise above 0, where {threshold} \
                     are asked for"
                )
            });
            said.push(format!(
                "A return was accepted at {} m: {} of {} marks counted, with {} photons each{sum}.",
                short(range_from_tof(one.tof)),
                one.peak,
                one.marks,
                photons(one.photons)
            ));
        }
        if !told.cancelled.is_empty() {
            said.push(format!(
                "Before that, {} of other shots {} cancelled that {} into its marks.",
                counted(told.cancelled.len() as u64, "echo"),
                if told.cancelled.len() == 1 { "was" } else { "were" },
                if told.cancelled.len() == 1 { "falls" } else { "fall" },
            ));
        }
        for (kind, _) in &told.verdict.rejects {
            said.push(match kind {
                Reject::OutsideGate => {
                    let (nearest, farthest) = (told.gate.start, told.gate.end - 1);
                    format!(
                        "Light of it was found, but none within the range gate, which is {} to {} m.",
                        short(self.range(nearest)),
                        short(self.range(farthest))
                    )
                }
                _ => self.nothing_in_samples(told),
            });
        }
        said.join(" ")
    }

    /// Why no lag was believed.
    fn nothing_in_samples(&self, told: &SampledExplanation) -> String {
        if told.marks.is_empty() {
            return "The macropulse of this shot has no mark: it is dark, and cannot be found."
                .to_owned();
        }
        let Some(tested) = told.tested.first() else {
            return format!(
                "At no lag of the gate the samples tell anything of {} of its {} marks.",
                told.fewest,
                told.marks.len()
            );
        };
        let at = short(self.range(tested.lag));
        let counts = tested.marks.iter().filter(|mark| mark.state == MarkState::Counted).count();
        let score = tested.score.map_or("none".to_owned(), deviations);
        match tested.outcome {
            Err(Refusal::TooFewMarks) => format!(
                "Light may come from {at} m, but what is left there tells of {counts} of {} marks alone, and \
                 {} are needed.",
                tested.marks.len(),
                told.fewest
            ),
            Err(Refusal::MarksDiffer) => format!(
                "At {at} m a mark is missing, and the others differ by more than noise: their light is of \
                 several shots."
            ),
            Err(Refusal::ClippedApart) => format!(
                "At {at} m marks are clipped and do not rise together: their light is of several shots."
            ),
            Err(Refusal::BelowThreshold) => format!(
                "Highest is {at} m, where the sum of {} is {score} standard deviations of the noise above 0; \
                 {} are asked for.",
                counted(counts as u64, "mark"),
                tested.threshold.map_or("more".to_owned(), deviations)
            ),
            // The receiver does not try what is no candidate.
            Ok(_) => format!(
                "Highest is {at} m, but it became one only when light of other shots had been cancelled, and \
                 was no candidate before."
            ),
        }
    }

    /// What is `told` to people of the signal and what was tested.
    pub(super) fn push_samples(&self, told: &SampledExplanation, columns: &mut Columns) {
        columns.push("noise", format!("{} photons behind the matched filter", photons(told.sigma)));
        columns.push(
            "threshold",
            format!(
                "{} standard deviations of the sum, {} more where a mark is missing; by {} at least",
                deviations(told.threshold),
                short(Sampling::MORE_IF_MISSING),
                counted(told.fewest.into(), "mark")
            ),
        );
        let name = if told.is_candidate { "tested" } else { "highest" };
        columns.push_list(name, told.tested.iter().map(|tested| self.tested_text(tested)));
        let more = told.cancelled.len().saturating_sub(MOST_OTHERS);
        let listed = told.cancelled.iter().zip(&self.others).take(MOST_OTHERS);
        let mut listed: Vec<String> = listed
            .map(|(echo, (row, column))| {
                let (light, shared) = (photons(echo.photons), counted(echo.shared.into(), "mark"));
                format!("row {row}, column {column}: {light} photons a mark, {shared} in one of this shot")
            })
            .collect();
        if more > 0 {
            listed.push(format!("and {more} more"));
        }
        columns.push_list("cancelled", listed);
    }

    fn tested_text(&self, tested: &Tested) -> String {
        let marks: Vec<String> = tested.marks.iter().map(mark_text).collect();
        let asked = match (tested.score, tested.threshold) {
            (Some(score), Some(threshold)) => {
                format!("{} deviations of {}", deviations(score), deviations(threshold))
            }
            (Some(score), None) => format!("{} deviations", deviations(score)),
            (None, _) => "no sum".to_owned(),
        };
        let outcome = match tested.outcome {
            Ok(Light { late, photons: light, is_clipped }) => format!(
                "found, {} photons, {} ticks later by {}",
                photons(light),
                short((late * 1e3).round() / 1e3),
                if is_clipped { "its clipped edges" } else { "its peak" }
            ),
            Err(refusal) => refusal.name().replace('_', " "),
        };
        format!("{} m: {}; {asked}: {outcome}", short(self.range(tested.lag)), marks.join(", "))
    }
}

/// "410 ± 12 photons", and why a mark does not count.
fn mark_text(mark: &MarkSeen) -> String {
    let doubt = match mark.doubt > 0.0 && mark.doubt.is_finite() {
        true => format!(" ± {}", photons(mark.doubt)),
        false => String::new(),
    };
    let light = format!("{}{doubt}", photons(mark.photons));
    match mark.state {
        MarkState::Counted => light,
        MarkState::OwnLight => "blind with own light".to_owned(),
        MarkState::Blind => "blind behind clipped light".to_owned(),
        MarkState::Hidden => format!("{light} hidden by other light"),
        MarkState::Clipped => "clipped by other light".to_owned(),
        MarkState::Outside => "not in the record".to_owned(),
    }
}

/// Photons, to a whole one or three digits.
fn photons(photons: f32) -> String {
    let scale = if photons.abs() < 10.0 { 100.0 } else { 1.0 };
    short((f64::from(photons) * scale).round() / scale)
}

/// Standard deviations, to a hundredth.
fn deviations(deviations: f32) -> String {
    short((f64::from(deviations) * 100.0).round() / 100.0)
}
