//! What was sent and received of one pixel, out of the explanation that a run leaves of it.

use std::path::Path;

use serde_json::Value;

use crate::view::{Axis, Chart, Figure, Hue, Line, Note, Section, Series, Stack, Style};

/// Places of a curve: of each the highest lag is drawn.
const PLACES: usize = 1200;

/// Lags on both sides of the peak that are drawn one by one.
const AROUND: usize = 300;

/// Whether a file of a run is an explanation, by its name.
pub fn is_explanation(file: &str) -> bool {
    file.starts_with("explain-") && file.ends_with(".json")
}

/// The section of the pixel that the file at `path` explains; nothing if it holds no explanation.
pub fn section(path: &Path) -> Option<Section> {
    let text = macropulse::opened::text(path).ok()?;
    of(&serde_json::from_str(&text).ok()?)
}

/// The section of a pixel: why it was decided so, what was sent, what came to the detector and what it
/// made of that, and the correlation.
fn of(told: &Value) -> Option<Section> {
    let (row, column) = (told["row"].as_u64()?, told["column"].as_u64()?);
    let (_, decided) = headline(told)?;
    let why = told["why"].as_str().unwrap_or_default();
    let mut section = Section::new(&format!("Pixel {row},{column}"))
        .paragraph(&format!("Shot {}: **{decided}**. {why}", told["shot"]));
    if let Some(chart) = arrivals(told) {
        let said = match told["light"].is_null() {
            true => {
                "The marks of the macropulse where the correlation is highest, and the ticks there. \
                 What light there was is not known: ticks are all that was decoded."
            }
            false => {
                "From the top: light and what the detector made of it, which the receiver never \
                 sees; the ticks, which are all it has; and the marks of the macropulse where the \
                 correlation is highest."
            }
        };
        section = section.figure(Figure::svg(&chart.svg(), said));
    }
    if let Some(chart) = signal(told) {
        let said = "What the filter that is matched to the pulse makes of the samples, at the marks of the \
                    lag that was tested first; and what was left of it then, echoes of other shots \
                    cancelled. Points are the marks: green ones counted.";
        section = section.figure(Figure::svg(&chart.svg(), said));
    }
    for chart in Counts::of(told)?.charts() {
        section = section.figure(Figure::svg(&chart.svg(), ""));
    }
    Some(section)
}

/// The picture of the pixel that `told` explains, as its JSON file has it.
pub fn picture(told: &Value) -> Stack {
    let (pixel, decided) = headline(told).unwrap_or_default();
    let counts = Counts::of(told).into_iter().flat_map(|counts| counts.charts());
    Stack {
        title: format!("{pixel}: {decided}"),
        charts: arrivals(told).into_iter().chain(signal(told)).chain(counts).collect(),
    }
}

/// Which pixel it is, and what was decided of it.
fn headline(told: &Value) -> Option<(String, String)> {
    let decided = told["decided"].as_str()?.replace('_', " ");
    Some((format!("Row {}, column {}", told["row"], told["column"]), decided))
}

/// What arrives in the time of one macropulse: where the correlation is highest, or else where light
/// of the shot is.
fn arrivals(told: &Value) -> Option<Chart> {
    let light = Light::of(&told["light"]);
    let sent: Vec<i64> = whole(&told["marks_ticks"]).collect();
    let of_light = || Some(light.ours.first()?.floor() as i64 - sent.first()?);
    let peak = told["peak"]["lag_ticks"].as_i64();
    let lag = peak.or_else(of_light)?;
    let marks: Vec<i64> = sent.iter().map(|mark| mark + lag).collect();
    let window = told["window_ticks"].as_i64().unwrap_or(1).max(1);
    let (first, last) = (*marks.first()?, *marks.last()? + window);
    let claimed = told["is_of_others"].as_array()?.iter().map(|claimed| claimed == true);
    let ticks = whole(&told["ticks"]).zip(claimed);
    let [mut ours, mut others, mut rest] = [Vec::new(), Vec::new(), Vec::new()];
    for (tick, is_of_others) in ticks.filter(|(tick, _)| (first..=last).contains(tick)) {
        let before = marks.partition_point(|mark| *mark <= tick);
        let is_on_mark = before > 0 && tick - marks[before - 1] < window;
        let lane = match (is_on_mark, is_of_others) {
            (true, _) => &mut ours,
            (false, true) => &mut others,
            (false, false) => &mut rest,
        };
        lane.push(tick as f64);
    }
    let sent = marks.iter().map(|mark| *mark as f64).collect();
    let mut lanes = vec![
        ("marks sent", Hue::Blue, sent),
        ("ticks on a mark", Hue::Green, ours),
        ("ticks of other shots", Hue::Orange, others),
        ("other ticks", Hue::Grey, rest),
    ];
    if light.is_known {
        lanes.push(("detection events", Hue::Grey, light.events));
        lanes.push(("light of others", Hue::Orange, light.others));
        lanes.push(("light of this shot", Hue::Green, light.ours));
    }
    let names: Vec<&str> = lanes.iter().map(|(name, ..)| *name).collect();
    let x = Axis::linear("Ticks since the shot").limits(first as f64, last as f64);
    let mut chart =
        Chart::new("What was sent and what came back", x, Axis::categories("Arrivals", &names));
    chart.size = [904.0, 80.0 + 40.0 * lanes.len() as f64];
    let is_shown = |at: &f64| (first as f64..=last as f64 + 1.0).contains(at);
    for (place, (_, hue, times)) in lanes.into_iter().enumerate() {
        let times = times.into_iter().filter(is_shown);
        let points = times.map(|at| [at, place as f64]).collect();
        chart.series.push(Series { label: String::new(), points, style: Style::Points, hue });
    }
    Some(chart)
}

/// The signal about the marks at the lag that was tested first; of samples alone.
fn signal(told: &Value) -> Option<Chart> {
    let signal = &told["signal"];
    let first = signal["first_tick"].as_f64()?;
    let whole: Vec<f64> = reals(&signal["photons"]).collect();
    let left: Vec<f64> = reals(&signal["photons_without_others"]).collect();
    let most = whole.iter().copied().fold(1.0, f64::max);
    let least = whole.iter().chain(&left).copied().fold(0.0, f64::min);
    let last = first + whole.len() as f64;
    let x = Axis::linear("Ticks since the shot").limits(first, last.max(first + 1.0));
    let y = Axis::linear("Photons per mark").limits(least * 1.08, most * 1.08);
    let mut chart = Chart::new("Signal behind the matched filter", x, y);
    chart.size = [904.0, 320.0];
    chart.legend = true;
    let mut push = |label: &str, points: Vec<[f64; 2]>, style: Style, hue: Hue| {
        chart.series.push(Series { label: label.to_owned(), points, style, hue });
    };
    let line =
        |values: &[f64]| (0..).zip(values).map(|(at, v)| [first + f64::from(at), *v]).collect();
    push("all light", line(&whole), Style::Line, Hue::Grey);
    push("without that of other shots", line(&left), Style::Line, Hue::Blue);
    let marks = told["tested"][0]["marks"].as_array()?;
    let point = |mark: &&Value| Some([mark["tick"].as_f64()?, mark["photons"].as_f64()?]);
    let (counted, rest): (Vec<&Value>, Vec<&Value>) =
        marks.iter().partition(|mark| mark["state"] == "counted");
    push("marks", counted.iter().filter_map(point).collect(), Style::Points, Hue::Green);
    push(
        "marks that tell nothing",
        rest.iter().filter_map(point).collect(),
        Style::Points,
        Hue::Orange,
    );
    Some(chart)
}

/// When light and detection events come, ticks since the shot.
#[derive(Default)]
struct Light {
    is_known: bool,
    ours: Vec<f64>,
    others: Vec<f64>,
    events: Vec<f64>,
}

impl Light {
    fn of(told: &Value) -> Self {
        let mut light = Self { is_known: !told.is_null(), ..Self::default() };
        for train in told["trains"].as_array().into_iter().flatten() {
            let is_ours = train["of"] == "this_shot";
            let lane = if is_ours { &mut light.ours } else { &mut light.others };
            lane.extend(reals(&train["marks_ticks"]));
        }
        light.events.extend(reals(&told["detections_ticks"]));
        light
    }
}

/// How much speaks for each lag of the gate: marks found, or how far the sum of marks is above noise.
struct Counts {
    /// Range of the first lag, and from one to the next, m.
    first: f64,
    step: f64,
    /// Not a number where nothing can be told.
    found: Vec<f64>,
    left: Vec<f64>,
    /// The end of the axis.
    most: f64,
    threshold: Option<f64>,
    /// Place of the peak among the lags, and what is said of it.
    peak: Option<(usize, String)>,
    words: &'static Words,
}

/// What is said in a chart of [`Counts`].
struct Words {
    title: &'static str,
    axis: &'static str,
    all: &'static str,
    left: &'static str,
}

const OF_TICKS: Words = Words {
    title: "Marks found",
    axis: "Marks",
    all: "all ticks",
    left: "without those of other shots",
};

const OF_SAMPLES: Words = Words {
    title: "Sum of the marks",
    axis: "Standard deviations of noise",
    all: "all light",
    left: "without that of other shots",
};

impl Counts {
    fn of(told: &Value) -> Option<Self> {
        let correlation = &told["correlation"];
        let [first_lag, step_lags] = ["first_lag_ticks", "step_ticks"].map(|key| &correlation[key]);
        let (first_lag, step_lags) = (first_lag.as_i64()?, step_lags.as_i64()?.max(1));
        let (first, step) =
            (correlation["first_range_m"].as_f64()?, correlation["step_m"].as_f64()?);
        let marks = told["marks_ticks"].as_array().map_or(0, Vec::len);
        let is_sampled = correlation["deviations"].is_array();
        let (peak, words, keys) = match is_sampled {
            true => (&told["tested"][0], &OF_SAMPLES, ["deviations", "deviations_without_others"]),
            false => (&told["peak"], &OF_TICKS, ["marks", "marks_without_others"]),
        };
        let [found, left] = keys.map(|key| list(&correlation[key]));
        let place = peak["lag_ticks"].as_i64().and_then(|lag| {
            let place = usize::try_from((lag - first_lag) / step_lags).ok();
            place.filter(|at| *at < found.len() && found[*at].is_finite())
        });
        let said = |range: f64| match is_sampled {
            true => format!(
                "{} at {range:.3} m",
                peak["outcome"].as_str().unwrap_or("").replace('_', " ")
            ),
            false => format!("{} of {marks} at {range:.3} m", peak["marks"]),
        };
        let peak = place.zip(peak["range_m"].as_f64()).map(|(place, range)| (place, said(range)));
        let most = match is_sampled {
            true => found.iter().copied().fold(1.0, f64::max),
            false => marks.max(1) as f64,
        };
        let mut threshold = ["threshold_marks", "threshold_deviations"].iter();
        let threshold = threshold.find_map(|key| told[*key].as_f64());
        // The threshold is shown where it is near; marks that are fewer than it are told in words.
        let most = if is_sampled { most.max(threshold.unwrap_or(0.0)) } else { most };
        Some(Self { first, step, found, left, most, threshold, peak, words })
    }

    fn range(&self, place: usize) -> f64 {
        self.first + place as f64 * self.step
    }

    /// Over the whole gate and, if there is a peak, about that.
    fn charts(&self) -> Vec<Chart> {
        let mut charts = vec![self.chart("over the gate", 0..self.found.len())];
        if let Some((place, _)) = self.peak {
            let around = place.saturating_sub(AROUND)..(place + AROUND + 1).min(self.found.len());
            charts.push(self.chart("about the peak", around));
        }
        charts
    }

    fn chart(&self, which: &str, places: std::ops::Range<usize>) -> Chart {
        let ends = [places.start, places.end.max(places.start + 1) - 1].map(|at| self.range(at));
        let x = Axis::linear("Range, m").limits(ends[0], ends[1].max(ends[0] + 1e-3));
        let y = Axis::linear(self.words.axis).limits(0.0, self.most * 1.08);
        let mut chart = Chart::new(&format!("{}, {which}", self.words.title), x, y);
        chart.size = [904.0, 320.0];
        chart.legend = true;
        let together = places.len().div_ceil(PLACES).max(1);
        for (label, counts, hue) in
            [(self.words.all, &self.found, Hue::Grey), (self.words.left, &self.left, Hue::Blue)]
        {
            let counts = counts.get(places.clone()).unwrap_or_default().chunks(together);
            let highest = counts.enumerate().filter_map(|(part, counts)| {
                let told = counts.iter().enumerate().filter(|(_, count)| count.is_finite());
                // Of equal ones the last.
                let (at, count) = told.max_by(|one, other| one.1.total_cmp(other.1))?;
                Some([self.range(places.start + part * together + at), count.max(0.0)])
            });
            let points = highest.collect();
            chart.series.push(Series { label: label.to_owned(), points, style: Style::Line, hue });
        }
        if let Some(threshold) = self.threshold.filter(|threshold| *threshold <= self.most) {
            chart.lines.push(Line::AtY(
                threshold,
                format!("threshold {}", (threshold * 100.0).round() / 100.0),
            ));
        }
        if let Some((place, text)) = self.peak.as_ref().filter(|(at, _)| places.contains(at)) {
            let at = [self.range(*place), self.found[*place]];
            chart.notes.push(Note { at, text: text.clone() });
        }
        chart
    }
}

/// The numbers of a list, one for each entry: what is none is not a number.
fn list(list: &Value) -> Vec<f64> {
    let entries = list.as_array().into_iter().flatten();
    entries.map(|entry| entry.as_f64().unwrap_or(f64::NAN)).collect()
}

/// The numbers of a list.
fn reals(list: &Value) -> impl Iterator<Item = f64> + '_ {
    list.as_array().into_iter().flatten().filter_map(Value::as_f64)
}

/// The whole numbers of a list.
fn whole(list: &Value) -> impl Iterator<Item = i64> + '_ {
    list.as_array().into_iter().flatten().filter_map(Value::as_i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Explorer;
    use serde_json::json;

    fn told() -> Value {
        json!({
            "row": 3, "column": 10, "shot": 7, "decided": "right", "why": "Four of four.",
            "marks_ticks": [0, 5, 9, 20], "window_ticks": 2, "threshold_marks": 3,
            "ticks": [41, 46, 47, 50, 61, 900], "is_of_others": [false, false, true, false, false, true],
            "peak": { "lag_ticks": 41, "range_m": 30.5, "marks": 4 },
            "correlation": {
                "first_lag_ticks": 40, "step_ticks": 1, "first_range_m": 30.1, "step_m": 0.4,
                "marks": [1, 4, 2], "marks_without_others": [1, 3, 0],
            },
        })
    }

    fn html(told: &Value) -> String {
        let mut page = Explorer::new("t");
        page.section(of(told).unwrap());
        page.html()
    }

    #[test]
    fn a_pixel_has_its_ticks_and_its_correlation() {
        let html = html(&told());
        assert!(html.contains("id=\"pixel-3-10\"") && html.contains("4 of 4 at 30.500 m"));
        assert!(html.contains("threshold 3") && html.contains("Four of four."));
        let charts = html.matches("<metadata>").count();
        assert_eq!(charts, 3);
    }

    #[test]
    fn ticks_are_told_apart_by_the_marks_at_the_peak() {
        let chart = arrivals(&told()).unwrap();
        let of = |at: usize| chart.series[at].points.iter().map(|p| p[0]).collect::<Vec<f64>>();
        assert_eq!(of(0), [41.0, 46.0, 50.0, 61.0]);
        assert_eq!(of(1), [41.0, 46.0, 47.0, 50.0, 61.0]);
        assert!(
            of(2).is_empty() && of(3).is_empty(),
            "what lies beyond the macropulse is not drawn"
        );
    }

    /// Of a simulation what came to the detector stands above.
    #[test]
    fn light_is_shown_where_it_is_known() {
        let mut told = told();
        assert!(html(&told).contains("What light there was is not known"));
        told["light"] = json!({
            "trains": [
                { "of": "this_shot", "marks_ticks": [41.5, 46.5, 50.5, 61.5] },
                { "of": "another_shot", "marks_ticks": [47.25, 300.0] },
                { "of": "another_lidar", "marks_ticks": [44.0] },
            ],
            "detections_ticks": [41.75, 46.5, 47.25, 500.0],
        });
        let chart = arrivals(&told).unwrap();
        let of = |at: usize| chart.series[at].points.iter().map(|p| p[0]).collect::<Vec<f64>>();
        assert_eq!(of(6), [41.5, 46.5, 50.5, 61.5]);
        assert_eq!(of(5), [47.25, 44.0], "what lies beyond the macropulse is not drawn");
        assert_eq!(of(4), [41.75, 46.5, 47.25]);
        assert!(html(&told).contains("light of this shot"));
        // A shot that was missed is shown where its light is.
        told["peak"] = Value::Null;
        assert_eq!(arrivals(&told).unwrap().series[0].points[0], [41.0, 0.0]);
        assert_eq!(picture(&told).charts.len(), 2);
        assert_eq!(picture(&told).title, "Row 3, column 10: right");
    }

    /// Of samples the signal stands in place of the ticks, and lags of which nothing can be told are left
    /// out.
    #[test]
    fn a_pixel_of_a_sampled_sensor_has_its_signal() {
        let told = json!({
            "row": 3, "column": 10, "shot": 7, "decided": "accepted", "why": "Three of three.",
            "marks_ticks": [0, 2, 3], "threshold_deviations": 6.349,
            "tested": [{
                "lag_ticks": 41, "range_m": 30.5, "outcome": "found",
                "marks": [
                    { "tick": 41, "photons": 410.0, "state": "counted" },
                    { "tick": 43, "photons": null, "state": "outside" },
                    { "tick": 44, "photons": 12.5, "state": "hidden" },
                ],
            }],
            "signal": {
                "first_tick": 40, "photons": [1.0, 410.0, -3.0, 5.0, 900.0],
                "photons_without_others": [1.0, 410.0, -3.0, 5.0, 12.5],
            },
            "correlation": {
                "first_lag_ticks": 40, "step_ticks": 1, "first_range_m": 30.1, "step_m": 0.4,
                "deviations": [-1.0, 9.5, null], "deviations_without_others": [-1.0, 7.5, null],
            },
        });
        let chart = signal(&told).unwrap();
        let of = |at: usize| chart.series[at].points.clone();
        assert_eq!((of(2), of(3)), (vec![[41.0, 410.0]], vec![[44.0, 12.5]]));
        assert_eq!(of(1)[4], [44.0, 12.5]);
        let charts = picture(&told).charts;
        assert_eq!(charts.len(), 3, "the signal, and the sum over the gate and about the peak");
        assert_eq!(charts[1].series[0].points.len(), 2);
        let html = html(&told);
        assert!(html.contains("threshold 6.35") && html.contains("found at 30.500 m"));
        assert!(html.contains("Sum of the marks, over the gate"));
    }

    #[test]
    fn a_pixel_without_a_peak_has_its_correlation_alone() {
        let mut told = told();
        told["peak"] = Value::Null;
        assert_eq!(html(&told).matches("<metadata>").count(), 1);
        assert_eq!(of(&json!({ "row": 3 })), None);
        assert!(is_explanation("explain-000000-3-10.json") && !is_explanation("manifest.json"));
    }
}
