//! Curves with their intervals, a chart for each score.

use super::{Axis, Spread, Table};
use crate::view::{self, Align, Cell, Chart, Figure, Hue, Page, Section, Stack, Style};

/// A chart for each score, one below the other.
pub(super) fn stack(table: &Table, title: &str) -> Stack {
    let charts = (0..table.metrics.len()).map(|metric| chart(table, metric, title)).collect();
    Stack { title: title.to_owned(), charts }
}

/// The same charts, the table, and links to the files at these paths, as a page.
pub(super) fn page(table: &Table, stack: &Stack, files: &[String]) -> Page {
    let mut charts = Section::new("Curves");
    for chart in &stack.charts {
        charts = charts.figure(Figure::svg(&chart.svg(), ""));
    }
    let keys = table.axes.iter().map(|axis| (axis.key.clone(), Align::Right));
    let scores = table.metrics.iter().map(|metric| (metric.column(), Align::Right));
    let mut rows = view::Table::new("In brackets the 95 % intervals", &[]);
    rows.header = keys.chain(scores).collect();
    rows.rows = table.rows.iter().map(|row| row.cells().iter().map(Cell::from).collect()).collect();
    let varied: Vec<String> = table.axes.iter().map(|axis| axis.key.clone()).collect();
    Page::new(&format!("Sweep over {}", varied.join(" and ")), &stack.title)
        .kicker("Macropulse")
        .section(charts)
        .section(Section::new("Numbers").table(rows))
        .files(files)
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
