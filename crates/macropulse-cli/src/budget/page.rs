//! The curves of a budget, as a page.

use macropulse::predict::{Forecast, Forecaster};
use macropulse_study::view::{Axis, Block, Chart, Figure, Hue, Line, Page, Section, Series, Style};

use super::figures::{Figures, REFLECTANCES};

/// Ranges along a curve.
const STEPS: u32 = 96;

pub fn page(figures: &Figures) -> Page {
    let design = figures.design;
    let verdict = match figures.first_failure() {
        None => "It closes: everything that was asked for holds.".to_owned(),
        Some(check) => {
            format!("It does not close. **{}** fails first: {}.", check.name, check.finding)
        }
    };
    let along = curves(figures);
    let drawn = (figures, along.as_slice());
    let curves = Section::new("Curves")
        .paragraph(&format!(
            "By reflectance of a target square on, from 5 to 100 %; solid in {}, dashed at night.",
            figures.environment.name
        ))
        .figure(chart(drawn, "Photons of a shot that reach the detector", Kind::Photons))
        .figure(chart(drawn, "Probability of a return", Kind::Pd))
        .figure(chart(drawn, "Signal to noise of a whole shot", Kind::Snr))
        .figure(chart(drawn, "Precision of the range, mm", Kind::Precision))
        .figure(chart(drawn, "False points per shot", Kind::False));
    Page::new(&format!("Link budget of {}", design.name), &design.summary)
        .section(Section::new("Verdict").paragraph(&verdict))
        .section(curves)
        .section(Section::new("Numbers").block(Block::Listing(figures.text())))
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Photons,
    Pd,
    Snr,
    Precision,
    False,
}

impl Kind {
    fn of(self, forecast: &Forecast) -> f64 {
        match self {
            Self::Photons => forecast.photons_per_shot,
            Self::Pd => forecast.pd,
            Self::Snr => forecast.snr,
            Self::Precision => forecast.precision * 1e3,
            Self::False => forecast.false_per_shot,
        }
    }
}

/// What is to be expected of a reflectance along the range, in the environment chosen and at
/// night.
struct Curve {
    reflectance: f64,
    chosen: Vec<Forecast>,
    night: Vec<Forecast>,
}

/// The ranges that curves show, m.
fn span(figures: &Figures) -> [f64; 2] {
    let nearest = figures.design.scan.min_range.max(1.0);
    [nearest, 2.0 * figures.wanted.range.max(nearest)]
}

fn curves(figures: &Figures) -> Vec<Curve> {
    let [nearest, farthest] = span(figures);
    let along = |forecaster: &Forecaster, reflectance: f64| {
        let range =
            |step: u32| nearest * (farthest / nearest).powf(f64::from(step) / f64::from(STEPS));
        (0..=STEPS).map(|step| forecaster.forecast(reflectance, range(step))).collect()
    };
    let curve = |reflectance| Curve {
        reflectance,
        chosen: along(&figures.chosen, reflectance),
        night: along(&figures.night, reflectance),
    };
    REFLECTANCES.map(curve).into()
}

fn chart((figures, curves): (&Figures, &[Curve]), title: &str, kind: Kind) -> Figure {
    let y = match kind {
        Kind::Pd => Axis::linear(title).limits(0.0, 1.0),
        _ => Axis::log(title),
    };
    let [nearest, farthest] = span(figures);
    let x = Axis::log("Range, m").limits(nearest, farthest);
    let mut chart = Chart::new(title, x, y);
    chart.legend = true;
    chart.lines.push(Line::AtX(figures.wanted.range, format!("{} m", figures.wanted.range)));
    if kind == Kind::Pd {
        chart.lines.push(Line::AtY(figures.wanted.pd, "wanted".to_owned()));
    }
    for (curve, hue) in curves.iter().zip(Hue::ALL) {
        let series = |label: String, style, forecasts: &[Forecast]| {
            let point = |forecast: &Forecast| [forecast.range, kind.of(forecast)];
            Series { label, points: forecasts.iter().map(point).collect(), style, hue }
        };
        let percent = format!("{} %", curve.reflectance * 100.0);
        chart.series.push(series(percent, Style::Line, &curve.chosen));
        chart.series.push(series(String::new(), Style::Dashed, &curve.night));
    }
    Figure::svg(&chart.svg(), "")
}
