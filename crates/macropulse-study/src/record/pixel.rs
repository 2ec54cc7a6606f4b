//! What was sent and received of one pixel, out of the explanation that a run leaves of it.

use std::path::Path;

use serde_json::Value;

use crate::view::{Axis, Chart, Figure, Hue, Line, Note, Section, Series, Style};

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
    let text = std::fs::read_to_string(path).ok()?;
    of(&serde_json::from_str(&text).ok()?)
}

/// The section of a pixel: why it was decided so, what was sent and what came back, and the
/// correlation of both.
fn of(told: &Value) -> Option<Section> {
    let (row, column) = (told["row"].as_u64()?, told["column"].as_u64()?);
    let decided = told["decided"].as_str()?.replace('_', " ");
    let why = told["why"].as_str().unwrap_or_default();
    let mut section = Section::new(&format!("Pixel {row},{column}"))
        .paragraph(&format!("Shot {}: **{decided}**. {why}", told["shot"]));
    if let Some(chart) = arrivals(told) {
        section = section.figure(Figure::svg(
            &chart.svg(),
            "The marks of the macropulse where the correlation is highest, and the ticks there: of \
             the light a receiver has nothing else.",
        ));
    }
    let counts = Counts::of(told)?;
    let all = 0..counts.found.len();
    section =
        section.figure(Figure::svg(&counts.chart("Marks found, over the gate", all).svg(), ""));
    if let Some((place, _)) = counts.peak {
        let around = place.saturating_sub(AROUND)..(place + AROUND + 1).min(counts.found.len());
        let chart = counts.chart("Marks found, about the peak", around);
        section = section.figure(Figure::svg(&chart.svg(), ""));
    }
    Some(section)
}

/// Ticks in the time of the macropulse at the peak, beside its marks.
fn arrivals(told: &Value) -> Option<Chart> {
    let lag = told["peak"]["lag_ticks"].as_i64()?;
    let marks: Vec<i64> = whole(&told["marks_ticks"]).map(|mark| mark + lag).collect();
    let window = told["window_ticks"].as_i64().unwrap_or(1).max(1);
    let (first, last) = (*marks.first()?, *marks.last()? + window);
    let claimed = told["is_of_others"].as_array()?.iter().map(|claimed| claimed == true);
    let ticks = whole(&told["ticks"]).zip(claimed);
    let [mut ours, mut others, mut rest] = [Vec::new(), Vec::new(), Vec::new()];
    for (tick, is_of_others) in ticks.filter(|(tick, _)| (first..=last).contains(tick)) {
        let before = marks.partition_point(|mark| *mark <= tick);
        let is_on_mark = before > 0 && tick - marks[before - 1] < window;
        let (place, lane) = match (is_on_mark, is_of_others) {
            (true, _) => (1.0, &mut ours),
            (false, true) => (2.0, &mut others),
            (false, false) => (3.0, &mut rest),
        };
        lane.push([tick as f64, place]);
    }
    let lanes = ["marks sent", "ticks on a mark", "ticks of other shots", "other ticks"];
    let x = Axis::linear("Ticks since the shot").limits(first as f64, last as f64);
    let mut chart =
        Chart::new("Marks and ticks of the macropulse", x, Axis::categories("Arrivals", &lanes));
    chart.size = [904.0, 240.0];
    let sent = marks.iter().map(|mark| [*mark as f64, 0.0]).collect();
    let hues = [Hue::Blue, Hue::Green, Hue::Orange, Hue::Grey];
    for (points, hue) in [sent, ours, others, rest].into_iter().zip(hues) {
        chart.series.push(Series { label: String::new(), points, style: Style::Points, hue });
    }
    Some(chart)
}

/// Marks found at the lags of the gate.
struct Counts {
    first: i64,
    step: i64,
    found: Vec<i64>,
    left: Vec<i64>,
    marks: usize,
    threshold: Option<f64>,
    /// Place of the peak among the lags, and what is said of it.
    peak: Option<(usize, String)>,
}

impl Counts {
    fn of(told: &Value) -> Option<Self> {
        let correlation = &told["correlation"];
        let first = correlation["first_lag_ticks"].as_i64()?;
        let step = correlation["step_ticks"].as_i64()?.max(1);
        let found: Vec<i64> = whole(&correlation["marks"]).collect();
        let left = whole(&correlation["marks_without_others"]).collect();
        let marks = whole(&told["marks_ticks"]).count();
        let peak = &told["peak"];
        let peak = peak["lag_ticks"].as_i64().and_then(|lag| {
            let place =
                usize::try_from((lag - first) / step).ok().filter(|at| *at < found.len())?;
            let range = peak["range_m"].as_f64()?;
            Some((place, format!("{} of {marks} at {range:.3} m", peak["marks"])))
        });
        let threshold = told["threshold_marks"].as_f64();
        Some(Self { first, step, found, left, marks, threshold, peak })
    }

    fn lag(&self, place: usize) -> f64 {
        (self.first + place as i64 * self.step) as f64
    }

    fn chart(&self, title: &str, places: std::ops::Range<usize>) -> Chart {
        let ends = [places.start, places.end.max(places.start + 1) - 1].map(|at| self.lag(at));
        let x = Axis::linear("Lag, ticks").limits(ends[0], ends[1].max(ends[0] + 1.0));
        let y = Axis::linear("Marks").limits(0.0, self.marks.max(1) as f64 * 1.08);
        let mut chart = Chart::new(title, x, y);
        chart.size = [904.0, 320.0];
        chart.legend = true;
        let together = places.len().div_ceil(PLACES).max(1);
        for (label, counts, hue) in [
            ("all ticks", &self.found, Hue::Grey),
            ("without those of other shots", &self.left, Hue::Blue),
        ] {
            let counts = counts.get(places.clone()).unwrap_or_default().chunks(together);
            let highest = counts.enumerate().filter_map(|(part, counts)| {
                let (at, count) = counts.iter().enumerate().max_by_key(|(_, count)| **count)?;
                Some([self.lag(places.start + part * together + at), *count as f64])
            });
            let points = highest.collect();
            chart.series.push(Series { label: label.to_owned(), points, style: Style::Line, hue });
        }
        if let Some(threshold) = self.threshold.filter(|most| *most <= self.marks as f64) {
            chart.lines.push(Line::AtY(threshold, format!("threshold {threshold}")));
        }
        if let Some((place, text)) = self.peak.as_ref().filter(|(at, _)| places.contains(at)) {
            let at = [self.lag(*place), self.found[*place] as f64];
            chart.notes.push(Note { at, text: text.clone() });
        }
        chart
    }
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
                "first_lag_ticks": 40, "step_ticks": 1,
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

    #[test]
    fn a_pixel_without_a_peak_has_its_correlation_alone() {
        let mut told = told();
        told["peak"] = Value::Null;
        assert_eq!(html(&told).matches("<metadata>").count(), 1);
        assert_eq!(of(&json!({ "row": 3 })), None);
        assert!(is_explanation("explain-000000-3-10.json") && !is_explanation("manifest.json"));
    }
}
