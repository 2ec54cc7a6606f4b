//! The explanation of a shot that was decided by samples.

use macropulse::codec::decode::{self, MarkState, Refusal, Reject, SampledExplanation, Sampling};
use macropulse::codec::{self, RecordKind, ShotLog};
use macropulse::design::Design;
use macropulse::units::range_from_tof;
use serde::{Deserialize, Serialize};

use super::curve::{Curve, Scale, Words};
use super::{Decision, MOST_OTHERS, Record, RecordExplanation, Sent, Shot, finite};
use crate::text::{Columns, counted, short};
use crate::view::{Axis, Chart, Hue, Series, Style};

const WORDS: Words = Words {
    title: "Sum of the marks",
    axis: "Standard deviations of noise",
    all: "all light",
    left: "without that of other shots",
    is_left_lowest: false,
};

/// The samples in the time of a shot, and how far the sum of its marks is above noise in them.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Samples {
    /// Standard deviation of the noise behind the matched filter.
    noise_photons: f32,
    threshold_deviations: f32,
    more_if_missing_deviations: f64,
    least_marks: u16,
    is_candidate: bool,
    /// The lags that were tested; without a candidate the highest one.
    tested: Vec<Tested>,
    cancelled: Vec<CancelledEcho>,
    /// The signal and every lag; nothing in a summary.
    #[serde(flatten)]
    whole: Option<Whole>,
}

/// A lag at which light of the shot was tested for.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Tested {
    lag_ticks: i64,
    range_m: f64,
    deviations: Option<f32>,
    threshold_deviations: Option<f32>,
    marks: Vec<Mark>,
    /// `found`, or the reason for which it was refused.
    outcome: String,
    #[serde(flatten)]
    light: Option<FoundLight>,
}

/// A mark at a lag.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Mark {
    tick: i64,
    photons: Option<f32>,
    doubt_photons: Option<f32>,
    #[serde(with = "StateName")]
    state: MarkState,
}

/// The names of a [`MarkState`] in files.
#[derive(Serialize, Deserialize)]
#[serde(remote = "MarkState", rename_all = "snake_case")]
enum StateName {
    Counted,
    OwnLight,
    Blind,
    Hidden,
    Clipped,
    Outside,
}

/// Light that was found at a lag.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct FoundLight {
    late_ticks: f64,
    photons: Option<f32>,
    is_clipped: bool,
}

/// Light of another shot that was cancelled.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct CancelledEcho {
    row: u16,
    column: u16,
    begins_ticks: i64,
    photons: Option<f32>,
    /// Marks in one of this shot.
    shared: u32,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Whole {
    signal: Signal,
    pub correlation: Correlation,
}

/// The signal behind the matched filter about the marks at the lag that was tested first.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Signal {
    first_tick: i64,
    photons: Vec<Option<f32>>,
    photons_without_others: Vec<Option<f32>>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Correlation {
    #[serde(flatten)]
    pub scale: Scale,
    deviations: Vec<Option<f32>>,
    deviations_without_others: Vec<Option<f32>>,
}

/// Explains shot number `at` of a band out of its `samples`.
pub(super) fn decision<'a>(
    design: &Design,
    (log, samples): (&'a ShotLog, &codec::Samples),
    at: usize,
) -> Result<Decision<'a>, decode::Error> {
    let told =
        design.receiver.explain_samples(&design.emission.coding().codebook, (log, samples), at)?;
    // A sample stands for its beginning.
    let shot = Shot {
        log,
        at,
        fired_tick: told.fired_tick,
        tick_fs: design.clock.tick_fs,
        within_tick_fs: 0,
    };
    let why = Reasons { told: &told, shot: &shot }.text();
    let cancelled = told.cancelled.iter().map(|echo| {
        let (row, column) = shot.pixel(echo.shot);
        let (photons, shared) = (finite(echo.photons), echo.shared);
        CancelledEcho { row, column, begins_ticks: echo.begins, photons, shared }
    });
    let list = |numbers: &[f32]| numbers.iter().copied().map(finite).collect();
    let (first_tick, photons, without_others) = &told.signal;
    let record = Samples {
        noise_photons: told.sigma,
        threshold_deviations: told.threshold,
        more_if_missing_deviations: Sampling::MORE_IF_MISSING,
        least_marks: told.fewest,
        is_candidate: told.is_candidate,
        tested: told.tested.iter().map(|tested| Tested::new(tested, &shot)).collect(),
        cancelled: cancelled.collect(),
        whole: Some(Whole {
            signal: Signal {
                first_tick: *first_tick,
                photons: list(photons),
                photons_without_others: list(without_others),
            },
            correlation: Correlation {
                scale: Scale::new(told.gate.start, told.step, &shot),
                deviations: list(&told.score),
                deviations_without_others: list(&told.left),
            },
        }),
    };
    Ok(Decision {
        shot,
        marks: told.marks,
        gate: told.gate,
        width: 1,
        verdict: told.verdict,
        why,
        record: Record::Samples(record),
    })
}

/// Why a shot was decided so, by the numbers.
struct Reasons<'a> {
    told: &'a SampledExplanation,
    shot: &'a Shot<'a>,
}

impl Reasons<'_> {
    fn text(&self) -> String {
        let told = self.told;
        let mut said: Vec<String> = Vec::new();
        for one in &told.verdict.returns {
            let is_it = |tested: &&decode::Tested| {
                tested.outcome.is_ok_and(|light| light.photons == one.photons)
            };
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
                photons(Some(one.photons))
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
                        short(self.shot.range(nearest)),
                        short(self.shot.range(farthest))
                    )
                }
                _ => self.nothing_found(),
            });
        }
        said.join(" ")
    }

    /// Why no lag was believed.
    fn nothing_found(&self) -> String {
        let told = self.told;
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
        let at = short(self.shot.range(tested.lag));
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
}

impl RecordExplanation for Samples {
    fn kind(&self) -> RecordKind {
        RecordKind::Samples
    }

    fn scale(&self) -> Option<&Scale> {
        self.whole.as_ref().map(|whole| &whole.correlation.scale)
    }

    fn shorten(&mut self) {
        self.whole = None;
    }

    /// Adds the lines about the signal and what was tested.
    fn push(&self, _: usize, columns: &mut Columns) {
        columns.push(
            "noise",
            format!("{} photons behind the matched filter", photons(Some(self.noise_photons))),
        );
        columns.push(
            "threshold",
            format!(
                "{} standard deviations of the sum, {} more where a mark is missing; by {} at least",
                deviations(self.threshold_deviations),
                short(self.more_if_missing_deviations),
                counted(self.least_marks.into(), "mark")
            ),
        );
        let name = if self.is_candidate { "tested" } else { "highest" };
        columns.push_list(name, self.tested.iter().map(Tested::text));
        columns.push_some("cancelled", &self.cancelled, MOST_OTHERS, |echo| {
            format!(
                "row {}, column {}: {} photons a mark, {} in one of this shot",
                echo.row,
                echo.column,
                photons(echo.photons),
                counted(echo.shared.into(), "mark")
            )
        });
    }

    /// The signal and the sum of the marks, each chart with what is said of it.
    fn charts(&self, _: &Sent) -> Option<Vec<(Chart, &'static str)>> {
        let Whole { signal, correlation } = self.whole.as_ref()?;
        let said = "What the filter that is matched to the pulse makes of the samples, at the marks of the \
                    lag that was tested first; and what was left of it then, echoes of other shots \
                    cancelled. Points are the marks: green ones counted.";
        let signal = self.tested.first().map(|tested| (signal.chart(&tested.marks), said));
        let list = |numbers: &[Option<f32>]| -> Vec<f64> {
            numbers.iter().map(|number| number.map_or(f64::NAN, f64::from)).collect()
        };
        let found = list(&correlation.deviations);
        let threshold = f64::from(self.threshold_deviations);
        let said =
            |peak: &Tested| format!("{} at {:.3} m", peak.outcome.replace('_', " "), peak.range_m);
        let curve = Curve {
            words: &WORDS,
            scale: &correlation.scale,
            most: found.iter().copied().fold(1.0, f64::max).max(threshold),
            found,
            left: list(&correlation.deviations_without_others),
            threshold: Some(threshold),
            peak: self.tested.first().map(|peak| (peak.lag_ticks, said(peak))),
        };
        let curves = curve.charts().into_iter().map(|chart| (chart, ""));
        Some(signal.into_iter().chain(curves).collect())
    }
}

impl Signal {
    /// The signal, with the `marks` of the lag that was tested first.
    fn chart(&self, marks: &[Mark]) -> Chart {
        let first = self.first_tick as f64;
        let line = |signal: &[Option<f32>]| -> Vec<[f64; 2]> {
            let photons = (0..).zip(signal);
            photons.filter_map(|(at, v)| Some([first + f64::from(at), f64::from((*v)?)])).collect()
        };
        let [whole, left] = [line(&self.photons), line(&self.photons_without_others)];
        let most = whole.iter().map(|point| point[1]).fold(1.0, f64::max);
        let least = whole.iter().chain(&left).map(|point| point[1]).fold(0.0, f64::min);
        let last = first + self.photons.len() as f64;
        let x = Axis::linear("Ticks since the shot").limits(first, last.max(first + 1.0));
        let y = Axis::linear("Photons per mark").limits(least * 1.08, most * 1.08);
        let mut chart = Chart::new("Signal behind the matched filter", x, y);
        chart.size = [904.0, 320.0];
        chart.legend = true;
        let points = |is_counted: bool| -> Vec<[f64; 2]> {
            let marks =
                marks.iter().filter(|mark| (mark.state == MarkState::Counted) == is_counted);
            marks.filter_map(|mark| Some([mark.tick as f64, f64::from(mark.photons?)])).collect()
        };
        for (label, points, style, hue) in [
            ("all light", whole, Style::Line, Hue::Grey),
            ("without that of other shots", left, Style::Line, Hue::Blue),
            ("marks", points(true), Style::Points, Hue::Green),
            ("marks that tell nothing", points(false), Style::Points, Hue::Orange),
        ] {
            chart.series.push(Series { label: label.to_owned(), points, style, hue });
        }
        chart
    }
}

impl Tested {
    fn new(tested: &decode::Tested, shot: &Shot) -> Self {
        let marks = tested.marks.iter().map(|mark| Mark {
            tick: mark.tick,
            photons: finite(mark.photons),
            doubt_photons: finite(mark.doubt),
            state: mark.state,
        });
        let found = |light: decode::Light| FoundLight {
            late_ticks: light.late,
            photons: finite(light.photons),
            is_clipped: light.is_clipped,
        };
        Self {
            lag_ticks: tested.lag,
            range_m: shot.range(tested.lag),
            deviations: tested.score,
            threshold_deviations: tested.threshold,
            marks: marks.collect(),
            outcome: tested.outcome.map_or_else(Refusal::name, |_| "found").to_owned(),
            light: tested.outcome.ok().map(found),
        }
    }

    fn text(&self) -> String {
        let marks: Vec<String> = self.marks.iter().map(Mark::text).collect();
        let asked = match (self.deviations, self.threshold_deviations) {
            (Some(score), Some(threshold)) => {
                format!("{} deviations of {}", deviations(score), deviations(threshold))
            }
            (Some(score), None) => format!("{} deviations", deviations(score)),
            (None, _) => "no sum".to_owned(),
        };
        let outcome = match &self.light {
            Some(light) => format!(
                "found, {} photons, {} ticks later by {}",
                photons(light.photons),
                short((light.late_ticks * 1e3).round() / 1e3),
                if light.is_clipped { "its clipped edges" } else { "its peak" }
            ),
            None => self.outcome.replace('_', " "),
        };
        format!("{} m: {}; {asked}: {outcome}", short(self.range_m), marks.join(", "))
    }
}

impl Mark {
    /// "410 ± 12 photons", and why it does not count.
    fn text(&self) -> String {
        let doubt = self.doubt_photons.filter(|doubt| *doubt > 0.0);
        let doubt = doubt.map_or(String::new(), |doubt| format!(" ± {}", photons(Some(doubt))));
        let light = format!("{}{doubt}", photons(self.photons));
        match self.state {
            MarkState::Counted => light,
            MarkState::OwnLight => "blind with own light".to_owned(),
            MarkState::Blind => "blind behind clipped light".to_owned(),
            MarkState::Hidden => format!("{light} hidden by other light"),
            MarkState::Clipped => "clipped by other light".to_owned(),
            MarkState::Outside => "not in the record".to_owned(),
        }
    }
}

/// Photons, to a whole one or three digits.
fn photons(photons: Option<f32>) -> String {
    let photons = photons.unwrap_or(f32::NAN);
    let scale = if photons.abs() < 10.0 { 100.0 } else { 1.0 };
    short((f64::from(photons) * scale).round() / scale)
}

/// Standard deviations, to a hundredth.
fn deviations(deviations: f32) -> String {
    short((f64::from(deviations) * 100.0).round() / 100.0)
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::super::tests::{explanation, html};

    fn record() -> Value {
        let mark = |tick: i64, photons: Option<f32>, state: &str| json!({ "tick": tick, "photons": photons, "doubt_photons": null, "state": state });
        json!({
            "noise_photons": 12.5, "threshold_deviations": 6.349, "more_if_missing_deviations": 1.5,
            "least_marks": 2, "is_candidate": true, "cancelled": [],
            "tested": [{
                "lag_ticks": 41, "range_m": 30.5, "deviations": 9.5, "threshold_deviations": 6.5,
                "outcome": "found", "late_ticks": 0.25, "photons": 410.0, "is_clipped": false,
                "marks": [
                    mark(41, Some(410.0), "counted"),
                    mark(43, None, "outside"),
                    mark(44, Some(12.5), "hidden"),
                ],
            }],
            "signal": {
                "first_tick": 40, "photons": [1.0, 410.0, -3.0, 5.0, 900.0],
                "photons_without_others": [1.0, 410.0, null, 5.0, 12.5],
            },
            "correlation": {
                "first_lag_ticks": 40, "step_ticks": 1, "first_range_m": 30.1, "step_m": 0.4,
                "deviations": [-1.0, 9.5, null], "deviations_without_others": [-1.0, 7.5, null],
            },
        })
    }

    /// The signal stands in place of the ticks, and lags and samples that tell nothing are left out.
    #[test]
    fn a_pixel_of_a_sampled_sensor_has_its_signal() {
        let told = explanation(record(), Value::Null);
        let charts = told.picture().charts;
        assert_eq!(charts.len(), 3, "the signal, and the sum over the gate and about the peak");
        let of = |at: usize| charts[0].series[at].points.clone();
        assert_eq!((of(2), of(3)), (vec![[41.0, 410.0]], vec![[44.0, 12.5]]));
        assert_eq!((of(1)[2], of(1)[3]), ([43.0, 5.0], [44.0, 12.5]));
        assert_eq!(charts[1].series[0].points.len(), 2);
        let html = html(&told);
        assert!(html.contains("threshold 6.35") && html.contains("found at 30.500 m"));
        assert!(html.contains("Sum of the marks, over the gate"));
    }

    #[test]
    fn text_lists_the_marks_that_were_tested() {
        let text = explanation(record(), Value::Null).text().replace("\n", " ");
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            text.contains("30.5 m: 410, not in the record, 13 hidden by other light"),
            "{text}"
        );
        assert!(text.contains("9.5 deviations of 6.5: found, 410 photons"), "{text}");
        assert!(text.contains("what is decoded is samples alone"), "{text}");
    }
}
