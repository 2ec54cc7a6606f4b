//! Correlation against range, over the whole gate and about the peak.

use macropulse::codec::decode::Explanation;
use macropulse_study::view::{Axis, Chart, Hue, Line, Note, Series, Stack, Style};

use super::Explained;

/// Places of a curve: of each the highest lag is drawn.
const PLACES: usize = 1400;

/// Lags on both sides of the peak that are drawn one by one.
const AROUND: usize = 400;

impl Explained<'_> {
    /// The picture.
    pub(super) fn picture(&self) -> Stack {
        let Explanation { found, gate, step, peak, .. } = &self.explanation;
        let (row, column) = self.pixel;
        let mut charts = vec![self.chart("Marks found, over the gate", 0..found.len())];
        if let Some((lag, _)) = peak {
            let place = usize::try_from((lag - gate.start) / step).unwrap_or(0);
            let around = place.saturating_sub(AROUND)..(place + AROUND + 1).min(found.len());
            charts.push(self.chart("Marks found, about the peak", around));
        }
        let decided = self.decided().replace('_', " ");
        Stack { title: format!("Row {row}, column {column}: {decided}"), charts }
    }

    /// Counts of the lags at `places` against range.
    fn chart(&self, title: &str, places: std::ops::Range<usize>) -> Chart {
        let Explanation { found, left, marks, threshold, peak, .. } = &self.explanation;
        let all = marks.len().max(1) as f64;
        let ends = [places.start, places.end.max(places.start + 1) - 1];
        let [near, far] = ends.map(|at| self.range_at(at));
        let x = Axis::linear("Range, m").limits(near, far.max(near + 1e-3));
        let y = Axis::linear("Marks").limits(0.0, all * 1.08);
        let mut chart = Chart::new(title, x, y);
        chart.size = [904.0, 320.0];
        chart.legend = true;
        let together = places.len().div_ceil(PLACES).max(1);
        let curve = |counts: &[u16]| -> Vec<[f64; 2]> {
            let counts = counts.get(places.clone()).unwrap_or_default();
            let highest = |(part, counts): (usize, &[u16])| {
                let (at, count) = counts.iter().enumerate().max_by_key(|(_, count)| **count)?;
                Some([self.range_at(places.start + part * together + at), f64::from(*count)])
            };
            counts.chunks(together).enumerate().filter_map(highest).collect()
        };
        for (label, counts, hue) in
            [("all ticks", found, Hue::Grey), ("without those of other shots", left, Hue::Blue)]
        {
            let (label, points) = (label.to_owned(), curve(counts));
            chart.series.push(Series { label, points, style: Style::Line, hue });
        }
        if let Some(threshold) = threshold.filter(|threshold| f64::from(*threshold) <= all) {
            let label = format!("threshold {threshold}");
            chart.lines.push(Line::AtY(f64::from(threshold), label));
        }
        if let Some((lag, count)) = peak {
            let range = self.range(*lag);
            let text = format!("{count} of {} at {range:.3} m", marks.len());
            chart.notes.push(Note { at: [range, f64::from(*count)], text });
        }
        chart
    }

    fn range_at(&self, place: usize) -> f64 {
        let Explanation { gate, step, .. } = &self.explanation;
        self.range(gate.start + place as i64 * step)
    }
}
