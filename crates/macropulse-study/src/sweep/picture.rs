//! Curves with their intervals, a chart for each score.

use super::{Axis, Spread, Table};
use crate::view::{self, Chart, Hue, Stack, Style};

/// A chart for each score, one below the other.
pub(super) fn stack(table: &Table, title: &str) -> Stack {
    let charts = (0..table.metrics.len()).map(|metric| chart(table, metric, title)).collect();
    Stack { title: title.to_owned(), charts }
}

/// The score of number `at`: along x the first key, a curve for each value of the second.
fn chart(table: &Table, at: usize, title: &str) -> Chart {
    let metric = table.metrics[at];
    let y = view::Axis::linear(&format!("{}: {}", metric.name(), metric.meaning()));
    let mut chart = Chart::new(&format!("{} of {title}", metric.name()), x_axis(table), y);
    let Some(first) = table.axes.first() else { return chart };
    let curves = table.axes.get(1).map_or(1, |second| second.values.len());
    for curve in 0..curves {
        let rows = table.rows.iter().skip(curve).step_by(curves);
        let estimates: Vec<(f64, _)> =
            rows.enumerate().map(|(index, row)| (first.place(index), row.scores[at])).collect();
        let label = table.axes.get(1).map_or("", |second| second.values[curve].as_str());
        let style = if first.spread == Spread::Names { Style::Points } else { Style::Joined };
        let values = estimates.iter().map(|(x, estimate)| [*x, estimate.value]).collect();
        chart = chart.series(label, style, values);
        let ends = estimates.iter().map(|(x, estimate)| [*x, estimate.low, estimate.high]);
        let hue = Hue::ALL[curve % Hue::ALL.len()];
        chart.whiskers.push(view::Band { points: ends.collect(), hue });
    }
    chart
}

fn x_axis(table: &Table) -> view::Axis {
    let Some(Axis { key, values, spread }) = table.axes.first() else {
        return view::Axis::linear("");
    };
    let title = match table.axes.get(1) {
        Some(second) => format!("{key}; a curve for each {}", second.key),
        None => key.clone(),
    };
    match spread {
        Spread::Steps => view::Axis::linear(&title),
        Spread::Ratios => view::Axis::log(&title),
        Spread::Names => {
            let names: Vec<&str> = values.iter().map(String::as_str).collect();
            view::Axis::categories(&title, &names)
        }
    }
}
