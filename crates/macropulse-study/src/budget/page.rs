//! The curves of a budget, as a page.

use macropulse::predict::{Forecast, Forecaster};

use super::{Figures, REFLECTANCES};
use crate::view::{Axis, Block, Chart, Figure, Hue, Line, Page, Section, Series, Style};

/// Ranges along a curve.
const STEPS: u32 = 96;

impl Figures<'_> {
    /// All of it as a page: the verdict, curves against the range, and the text.
    pub fn page(&self) -> Page {
        let verdict = match self.first_failure() {
            None => "It closes: everything that was asked for holds.".to_owned(),
            Some(check) => {
                format!("It does not close. **{}** fails first: {}.", check.name, check.finding)
            }
        };
        let drawn = Drawn::of(self);
        let curves = Section::new("Curves")
            .paragraph(&format!(
                "By reflectance of a target square on, from 5 to 100 %; solid in {}, dashed at \
                 night.",
                self.environment.name
            ))
            .figure(drawn.chart("Photons of a shot that reach the detector", Kind::Photons))
            .figure(drawn.chart("Probability of a return", Kind::Pd))
            .figure(drawn.chart("Signal to noise of a whole shot", Kind::Snr))
            .figure(drawn.chart("Precision of the range, mm", Kind::Precision))
            .figure(drawn.chart("False points per shot", Kind::False));
        Page::new(&format!("Link budget of {}", self.design.name), &self.design.summary)
            .section(Section::new("Verdict").paragraph(&verdict))
            .section(curves)
            .section(Section::new("Numbers").block(Block::Listing(self.text())))
    }
}

/// A quantity that a chart shows against the range.
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
            Self::Precision => forecast.precision.map_or(f64::NAN, |precision| precision * 1e3),
            Self::False => forecast.false_per_shot,
        }
    }
}

/// Forecasts for a reflectance along the range, in the environment chosen and at night.
struct Curve {
    reflectance: f64,
    chosen: Vec<Forecast>,
    night: Vec<Forecast>,
}

/// Data that the charts of a budget share.
struct Drawn {
    /// Nearest and farthest range that curves show, m.
    span: [f64; 2],
    /// The range wanted, m.
    range: f64,
    /// The probability of a return that is wanted.
    pd: f64,
    /// One for each reflectance.
    curves: Vec<Curve>,
}

impl Drawn {
    fn of(figures: &Figures) -> Self {
        let wanted = &figures.wanted;
        let nearest = figures.design.scan.min_range.max(1.0);
        let farthest = 2.0 * wanted.range.max(nearest);
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
        let curves = REFLECTANCES.map(curve).into();
        Self { span: [nearest, farthest], range: wanted.range, pd: wanted.pd, curves }
    }

    /// Draws `kind` against the range, for every reflectance.
    fn chart(&self, title: &str, kind: Kind) -> Figure {
        let y = match kind {
            Kind::Pd => Axis::linear(title).limits(0.0, 1.0),
            _ => Axis::log(title),
        };
        let [nearest, farthest] = self.span;
        let x = Axis::log("Range, m").limits(nearest, farthest);
        let mut chart = Chart::new(title, x, y);
        chart.legend = true;
        chart.lines.push(Line::AtX(self.range, format!("{} m", self.range)));
        if kind == Kind::Pd {
            chart.lines.push(Line::AtY(self.pd, "wanted".to_owned()));
        }
        for (curve, hue) in self.curves.iter().zip(Hue::ALL) {
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
}
