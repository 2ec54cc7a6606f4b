//! Charts of the evidence for each lag of the gate.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::Shot;
use crate::view::{Axis, Chart, Hue, Line, Note, Series, Style};

/// Points of a curve at most; each shows the highest of several lags.
const PLACES: usize = 1200;

/// Lags on both sides of the peak that are drawn one by one.
const AROUND: usize = 300;

/// Lags at equal steps, and their ranges.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Scale {
    first_lag_ticks: i64,
    step_ticks: i64,
    first_range_m: f64,
    step_m: f64,
}

impl Scale {
    /// Lags `step` ticks apart, from `first` on.
    pub fn new(first: i64, step: i64, shot: &Shot) -> Self {
        let first_range_m = shot.range(first);
        let step_m = shot.range(first + step) - first_range_m;
        Self { first_lag_ticks: first, step_ticks: step, first_range_m, step_m }
    }

    /// The range of `lag`, m.
    pub fn range(&self, lag: i64) -> f64 {
        let steps = (lag - self.first_lag_ticks) as f64 / self.step_ticks as f64;
        self.first_range_m + steps * self.step_m
    }

    /// The lag of an entry.
    pub fn lag(&self, place: usize) -> i64 {
        self.first_lag_ticks + place as i64 * self.step_ticks
    }

    fn range_at(&self, place: usize) -> f64 {
        self.first_range_m + place as f64 * self.step_m
    }

    fn place(&self, lag: i64) -> Option<usize> {
        usize::try_from((lag - self.first_lag_ticks) / self.step_ticks.max(1)).ok()
    }
}

/// How much speaks for each lag: marks found, or how far the sum of marks is above noise.
pub(super) struct Curve<'a> {
    pub words: &'static Words,
    pub scale: &'a Scale,
    /// Not a number where nothing can be told.
    pub found: Vec<f64>,
    /// The same without light of other shots.
    pub left: Vec<f64>,
    /// The end of the axis.
    pub most: f64,
    pub threshold: Option<f64>,
    /// The lag of the peak, and what is said of it.
    pub peak: Option<(i64, String)>,
}

/// The labels of a [`Curve`].
pub(super) struct Words {
    pub title: &'static str,
    pub axis: &'static str,
    pub all: &'static str,
    pub left: &'static str,
    /// True if the second curve shows the lowest of several lags.
    pub is_left_lowest: bool,
}

impl Curve<'_> {
    /// Over the whole gate and, if there is a peak, about that.
    pub fn charts(&self) -> Vec<Chart> {
        let mut charts = vec![self.chart("over the gate", 0..self.found.len())];
        if let Some((place, _)) = self.peak() {
            let around = place.saturating_sub(AROUND)..(place + AROUND + 1).min(self.found.len());
            charts.push(self.chart("about the peak", around));
        }
        charts
    }

    /// The place of the peak, if anything is told there, and what is said of it.
    fn peak(&self) -> Option<(usize, &str)> {
        let (lag, said) = self.peak.as_ref()?;
        let place = self.scale.place(*lag)?;
        self.found.get(place)?.is_finite().then_some((place, said))
    }

    fn chart(&self, which: &str, places: Range<usize>) -> Chart {
        let ends = [places.start, places.end.max(places.start + 1) - 1];
        let ends = ends.map(|at| self.scale.range_at(at));
        let x = Axis::linear("Range, m").limits(ends[0], ends[1].max(ends[0] + 1e-3));
        let y = Axis::linear(self.words.axis).limits(0.0, self.most * 1.08);
        let mut chart = Chart::new(&format!("{}, {which}", self.words.title), x, y);
        chart.size = [904.0, 320.0];
        chart.legend = true;
        let together = places.len().div_ceil(PLACES).max(1);
        let Words { all, left, is_left_lowest, .. } = *self.words;
        for (label, counts, hue, is_lowest) in
            [(all, &self.found, Hue::Grey, false), (left, &self.left, Hue::Blue, is_left_lowest)]
        {
            let counts = counts.get(places.clone()).unwrap_or_default().chunks(together);
            let highest = counts.enumerate().filter_map(|(part, counts)| {
                let told = counts.iter().enumerate().filter(|(_, count)| count.is_finite());
                // The last one of equal counts.
                let height = |count: &f64| if is_lowest { -count } else { *count };
                let (at, count) =
                    told.max_by(|one, other| height(one.1).total_cmp(&height(other.1)))?;
                let place = places.start + part * together + at;
                Some([self.scale.range_at(place), count.max(0.0)])
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
        if let Some((place, text)) = self.peak().filter(|(at, _)| places.contains(at)) {
            let at = [self.scale.range_at(place), self.found[place]];
            chart.notes.push(Note { at, text: text.to_owned() });
        }
        chart
    }
}
