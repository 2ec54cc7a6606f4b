//! The section of the report with five lidars side by side.

use super::claims::{COMPARED_M, line};
use super::lidars::GATE;
use super::measured::{Methods, Place, Reach};
use super::side_by_side::{REFLECTANCE, SCENE, SHOTS, Side};
use super::{Error, Findings};
use crate::view::{
    Align, Axis, Band, Block, Cell, Chart, Figure, Hue, Layout, Line, RangePicture, Section, Style,
    Table,
};
use macropulse::points::Outcome;
use macropulse::score::Score;
use macropulse::units::s_from_fs;

/// Width of a range image, px.
const WIDTH: usize = 560;

/// A factor between a precision and its forecast that is worth a word.
const APART: f64 = 1.5;

/// Ends of the colours of the range images, m.
const COLOURS: [f32; 2] = [5.0, 125.0];

/// The section.
pub(super) fn section(findings: &Findings) -> Result<Section, Error> {
    let methods = &findings.measured.methods;
    let percent = 100.0 * REFLECTANCE;
    let mut section = Section::new("Five lidars side by side")
        .paragraph(&format!(
            "The first equation of the paper names three ways to measure range. Here are five lidars with \
             one field of 24\u{b0} by 6\u{b0}, 16 rows and 64 columns, 2.5 scans a second, one beam of 905 nm, \
             an aperture of 15 mm and a range gate of {GATE:.0} m. All send what class 1 allows, and that \
             depends on how long the light of a shot lasts. Each keeps the detector and the receiver of \
             its ready sensor. Energy and length are those of a shot. Right pixels and precision are those \
             of the scene below."
        ))
        .table(sensors(&findings.sides))
        .table(detectors(&findings.sides))
        .block(Block::Heading(format!("The scene `{SCENE}`, by day")))
        .block(Block::Gallery(2, images(&findings.sides)?))
        .block(Block::Heading("Detection and precision".into()))
        .paragraph(&format!(
            "Walls of {percent:.0} % stand all around, by day, {SHOTS} shots at each. Strokes are intervals \
             of 95 %. Curves are forecasts in closed form."
        ))
        .figure(detection(methods));
    let refused = findings.sides.iter().filter_map(|side| {
        side.unforecast.as_ref().map(|why| format!("No curve of {}: {why}.", side.lidar.name))
    });
    for why in refused {
        section = section.paragraph(&why);
    }
    Ok(section
        .figure(precision(methods))
        .paragraph(&apart(methods))
        .table(numbers(methods))
        .block(Block::Heading("Long, middle and short distances".into()))
        .paragraph(
            "The reach of a lidar is the range at which it misses half of its shots. That of FMCW depends \
             on the line of its laser: light that comes back after its phase was lost makes no beat. \
             Between two walls the normal quantile of Pd is drawn out in proportion to the logarithm of \
             range. The simulation counts points within 0.35 m, the forecast all of them.",
        )
        .figure(lines(methods))
        .table(reaches(methods)))
}

/// The table of all numbers as text, a line for each lidar and wall.
pub(super) fn csv(methods: &Methods) -> String {
    let mut text = String::from(
        "lidar,linewidth_khz,range_m,shots,seen,pd,pd_low,pd_high,precision_m,pd_forecast,\
         precision_forecast_m\n",
    );
    let named = methods.lidars.iter().map(|reach| (None, reach));
    let lines = methods.lines.iter().map(|(hz, reach)| (Some(hz), reach));
    let number = |value: f64| if value.is_nan() { String::new() } else { format!("{value:.7}") };
    for (hz, reach) in named.chain(lines) {
        let khz = hz.map(|hz| format!("{:.0}", hz * 1e-3)).unwrap_or_default();
        for place in &reach.places {
            let Place { range, shots, seen, pd: [pd, low, high], precision, .. } = place;
            let [forecast, spread] = reach.forecast(*range).unwrap_or([f64::NAN; 2]);
            text += &format!(
                "{},{khz},{range},{shots},{seen},{pd:.7},{low:.7},{high:.7},{},{},{}\n",
                reach.lidar,
                number(*precision),
                number(forecast),
                number(spread)
            );
        }
    }
    text
}

fn sensors(sides: &[Side]) -> Table {
    let header = [
        ("lidar", Align::Left),
        ("made of", Align::Left),
        ("energy, nJ", Align::Right),
        ("length, \u{b5}s", Align::Right),
        ("right pixels", Align::Right),
        ("precision, mm", Align::Right),
    ];
    sides.iter().fold(Table::new("", &header), |table, side| {
        let design = &side.design;
        let energy = design.budget.as_ref().map_or(f64::NAN, |budget| budget.energy);
        let lasts = match design.emission.is_pulsed() && !design.is_coded() {
            true => s_from_fs(design.emission.length_fs()).max(design.light.pulse),
            false => s_from_fs(design.emission.length_fs()),
        };
        table.row(vec![
            Cell::from(side.lidar.name),
            Cell::from(format!("`{}`", side.lidar.sensor)),
            Cell::from(format!("{:.0}", energy * 1e9)),
            Cell::from(format!("{:.3}", lasts * 1e6)),
            Cell::from(format!("{:.1} %", 100.0 * right(&side.score))),
            Cell::from(format!("{:.1}", side.precision * 1e3)),
        ])
    })
}

fn detectors(sides: &[Side]) -> Table {
    let header = [("lidar", Align::Left), ("detector", Align::Left)];
    sides.iter().fold(Table::new("", &header), |table, side| {
        let detector = side.design.detector.model().summary();
        table.row(vec![Cell::from(side.lidar.name), Cell::from(detector)])
    })
}

/// Share of the pixels with an echo that came out right.
fn right(score: &Score) -> f64 {
    score.count(Outcome::Right) as f64 / score.with_echo() as f64
}

fn images(sides: &[Side]) -> Result<Vec<Figure>, Error> {
    let mut figures = Vec::new();
    for side in sides {
        let cloud = &side.cloud;
        let pitch = [24.0 / cloud.columns as f64, 6.0 / cloud.rows as f64];
        let png = RangePicture {
            layout: Layout::new(cloud.rows, cloud.columns).fit(pitch, WIDTH),
            range: &cloud.image(cloud.pick).spread(&cloud.range, f32::NAN),
            near: COLOURS[0],
            far: COLOURS[1],
        }
        .png()?;
        let name = side.lidar.name;
        figures.push(Figure::png(
            png,
            &format!("range image of the {name} lidar in the scene {SCENE}"),
            &format!("{name}: **{:.1} %** of the pixels right", 100.0 * right(&side.score)),
        ));
    }
    Ok(figures)
}

/// Pd against range.
fn detection(methods: &Methods) -> Figure {
    let x = Axis::log("range of the wall, m").limits(4.5, 230.0);
    let y = Axis::linear("probability of detection").limits(0.0, 1.05);
    let mut chart = Chart::new("Detection against range, five lidars", x, y);
    for (reach, hue) in methods.lidars.iter().zip(Hue::ALL) {
        let found = reach.places.iter().map(|place| [place.range, place.pd[0]]).collect();
        chart = chart.series(reach.lidar, Style::Points, found);
        let forecast = reach.curve.iter().map(|[range, pd, _]| [*range, *pd]).collect();
        chart = chart.series("", Style::Line, forecast);
        chart.series.iter_mut().rev().take(2).for_each(|series| series.hue = hue);
        let strokes = reach.places.iter().map(|place| [place.range, place.pd[1], place.pd[2]]);
        chart.whiskers.push(Band { points: strokes.collect(), hue });
    }
    chart.lines.push(Line::AtY(0.5, "one half".into()));
    Figure::svg(
        &chart.svg(),
        "Probability of detection against range: simulated (dots) and forecast (curves).",
    )
}

/// Precision against range, where it is that of half of the shots at least.
fn precision(methods: &Methods) -> Figure {
    let x = Axis::log("range of the wall, m").limits(4.5, 230.0);
    let y = Axis::log("standard deviation of the range, mm");
    let mut chart = Chart::new("Precision against range, five lidars", x, y);
    for (reach, hue) in methods.lidars.iter().zip(Hue::ALL) {
        let seen = reach.places.iter().filter(|place| place.pd[0] >= 0.5);
        let found = seen.map(|place| [place.range, place.precision * 1e3]).collect();
        let forecast = reach.curve.iter().filter(|[_, pd, _]| *pd >= 0.5);
        let forecast = forecast.map(|[range, _, spread]| [*range, *spread * 1e3]).collect();
        chart = chart.series(reach.lidar, Style::Points, found).series("", Style::Line, forecast);
        chart.series.iter_mut().rev().take(2).for_each(|series| series.hue = hue);
    }
    Figure::svg(
        &chart.svg(),
        "Standard deviation of the range of walls of which half of the shots are seen: simulated (dots) \
         and forecast (curves).",
    )
}

/// Names the walls at which the precision is not as forecast.
fn apart(methods: &Methods) -> String {
    let mut words = Vec::new();
    for reach in &methods.lidars {
        let is_apart = |place: &&Place| {
            let forecast = reach.forecast(place.range).filter(|_| place.pd[0] >= 0.5);
            forecast.is_some_and(|[_, spread]| {
                let ratio = place.precision / spread;
                !(1.0 / APART..=APART).contains(&ratio)
            })
        };
        let walls = reach.places.iter().filter(is_apart);
        let walls: Vec<String> = walls.map(|place| format!("{:.0} m", place.range)).collect();
        if !walls.is_empty() {
            words.push(format!("{} at {}", reach.lidar, walls.join(" and ")));
        }
    }
    match words.is_empty() {
        true => format!("No precision is off its forecast by a factor of {APART} or more."),
        false => format!(
            "Precisions off their forecast by a factor of {APART} or more: {}. Light so near is too bright \
             for a closed form that sums up weak light.",
            words.join(", ")
        ),
    }
}

/// Pd and precision at each wall.
fn numbers(methods: &Methods) -> Table {
    let mut header = vec![("range", Align::Right)];
    header.extend(methods.lidars.iter().map(|reach| (reach.lidar, Align::Right)));
    let walls = methods.lidars.first().map_or(&[][..], |reach| &reach.places);
    let caption = "Pd, and the standard deviation of the range where half of the shots are seen";
    walls.iter().enumerate().fold(Table::new(caption, &header), |table, (at, wall)| {
        let each = methods.lidars.iter().map(|reach| Cell::from(told(&reach.places[at])));
        table.row(std::iter::once(Cell::from(format!("{:.0} m", wall.range))).chain(each).collect())
    })
}

fn told(place: &Place) -> String {
    match place.pd[0] >= 0.5 {
        true => format!("{:.3}, {:.1} mm", place.pd[0], place.precision * 1e3),
        false => format!("{:.3}", place.pd[0]),
    }
}

/// The reach of the FMCW lidar against the line of its laser, with those of the other two methods.
fn lines(methods: &Methods) -> Figure {
    let x = Axis::log("width of the line, kHz").limits(8.0, 12_500.0);
    let y = Axis::linear("range at which Pd falls below a half, m").limits(0.0, 160.0);
    let reach = |(hz, reach): &(f64, Reach)| [hz * 1e-3, reach.half()[0]];
    let found = methods.lines.iter().map(reach).collect();
    let mut chart =
        Chart::new("Reach of FMCW against its line", x, y).series("FMCW", Style::Joined, found);
    let stroke = |(hz, reach): &(f64, Reach)| [hz * 1e-3, reach.half()[1], reach.half()[2]];
    let points = methods.lines.iter().map(stroke).collect();
    chart.whiskers.push(Band { points, hue: Hue::Blue });
    for lidar in [super::PULSED, super::AMCW] {
        let Some(half) = methods.of(lidar).map(|reach| reach.half()[0]) else { continue };
        chart.lines.push(Line::AtY(half, format!("{lidar}: {half:.0} m")));
    }
    Figure::svg(
        &chart.svg(),
        "Range at which the FMCW lidar misses half of its shots, by the width of the line of its laser.",
    )
}

/// The reach of each method, and its precision at three ranges.
fn reaches(methods: &Methods) -> Table {
    let at = COMPARED_M.map(|range| format!("precision at {range:.0} m, mm"));
    let mut header = vec![("method", Align::Left), ("Pd below a half from, m", Align::Right)];
    header.push(("interval of 95 %, m", Align::Right));
    header.push(("forecast, m", Align::Right));
    header.extend(at.iter().map(|title| (title.as_str(), Align::Right)));
    let named = methods.lidars.iter().filter(|reach| reach.lidar != super::FMCW);
    let named = named.map(|reach| (reach.lidar.to_owned(), reach));
    let lined = methods.lines.iter();
    let lined = lined.map(|(hz, reach)| (format!("{}, line of {}", reach.lidar, line(*hz)), reach));
    named.chain(lined).fold(Table::new("", &header), |table, (name, reach)| {
        let [half, low, high] = reach.half();
        let bounded = |range: f64| match range.is_finite() {
            true => format!("{range:.0}"),
            false => "beyond the walls".to_owned(),
        };
        let mut cells = vec![Cell::from(name), Cell::from(bounded(half))];
        let interval = (half.is_finite() || low.is_finite())
            .then(|| format!("{} \u{2026} {}", bounded(low), bounded(high)));
        cells.push(Cell::from(interval.unwrap_or_default()));
        let forecast = reach.half_forecast().map(bounded);
        cells.push(Cell::from(forecast.unwrap_or_default()));
        for range in COMPARED_M {
            let seen = reach.at(range).filter(|place| place.pd[0] >= 0.5);
            let cell = seen.map(|place| format!("{:.1}", place.precision * 1e3));
            cells.push(Cell::from(cell.unwrap_or_default()));
        }
        table.row(cells)
    })
}
