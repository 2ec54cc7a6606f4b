//! The report: figures beside each other, as Markdown and as a page.

use super::published::Within;
use super::{Figure, Findings, Place, SHOTS};
use crate::view::{Align, Cell, Page, Section, Table, Verdict};

const LEAD: &str = "This page compares published figures with those of Macropulse, and its \
                    forecasts with its simulations. Sources are those of the references; a figure \
                    that was computed apart comes from the same definitions, and shares no code. A \
                    figure may differ by its rounding, by the tolerance of its source, or by three \
                    standard deviations if it was drawn.";

/// The text above the forecasts.
fn of_forecasts(findings: &Findings) -> String {
    format!(
        "A wall stands all around a ready sensor by night, square on, at 70 % of its range. Its \
         reflectance is such that one shot in ten, half of them, four in five, and nearly all \
         should be seen. It stands at up to four places within a tick, with a part of the shots at \
         each. N is {SHOTS} shots or a few more, or the shots of a scan if they are fewer; seed \
         {}. A shot is seen if it has a return within 0.35 m. Standard deviations are not compared \
         if three of them are more. A forecast of the share that is seen holds within 0.02, three \
         standard deviations or 2 % of the light. The standard deviation of the range about the \
         peak holds within 20 %. The share of points on a sidelobe of their own macropulse holds \
         within 0.2 % of them or three standard deviations. Those points are farther than six \
         forecast standard deviations from the truth, and farther than a right point may be. The \
         matched receivers are thorough. The quick ones of the ready sensors look where light is \
         likely, and find less faint light. Forecasts leave out that pulses which only just cross \
         a threshold are timed later or earlier than others, so that the receiver looks beside \
         them. There is no forecast of sidelobes if the first points, which have no neighbours, \
         may lie on one and mislead others.",
        findings.seed
    )
}

/// A number of four digits, or all of those before its point.
fn number(value: f64) -> String {
    let size = value.abs();
    if size > 0.0 && !(1e-3..1e6).contains(&size) {
        return format!("{value:.3e}");
    }
    let before_the_point = size.max(1e-3).log10().floor() as i32;
    let decimals = (3 - before_the_point).clamp(0, 6) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

fn within(figure: &Figure) -> String {
    match figure.within {
        Within::Exactly => "exact".to_owned(),
        Within::Share(most) | Within::Absolute(most) if most < 1e-6 => "rounding".to_owned(),
        Within::Share(share) => format!("{} %", number(100.0 * share)),
        Within::Absolute(most) => number(most),
        Within::AtMost => "no more".to_owned(),
        Within::AtLeast => "no less".to_owned(),
    }
}

/// A source as the references name it, or in words.
fn source(figure: &Figure) -> String {
    match figure.source.contains(' ') {
        true => figure.source.to_owned(),
        false => format!("[{}]", figure.source),
    }
}

fn said(holds: bool) -> &'static str {
    if holds { "holds" } else { "fails" }
}

/// The cells of a figure, its verdict last.
fn cells(figure: &Figure) -> [String; 6] {
    [
        figure.what.clone(),
        source(figure),
        number(figure.published),
        number(figure.ours),
        within(figure),
        said(figure.holds()).to_owned(),
    ]
}

const OF_FIGURES: [&str; 6] = ["figure", "source", "published", "ours", "may differ by", "verdict"];

fn place_cells(place: &Place) -> [String; 14] {
    let millimetres = |metres: f64| format!("{:.2}", metres * 1e3);
    let share = |share: f64| format!("{share:.3}");
    let (precision, found) = place.precision_m;
    let aside = |which: usize| {
        place.aside.map_or_else(String::new, |both| format!("{:.2}", 100.0 * both[which]))
    };
    [
        place.sensor.clone(),
        format!("{:.2} % at {:.1} m", 100.0 * place.reflectance, place.range_m),
        place.shots.to_string(),
        share(place.pd[0]),
        place.pd_between.map(share).join(" to "),
        share(place.pd[1]),
        said(place.pd_holds()).to_owned(),
        precision.map_or_else(|| "none".to_owned(), millimetres),
        found.map_or_else(|| "few".to_owned(), millimetres),
        place.precision_holds().map_or("", said).to_owned(),
        aside(0),
        aside(1),
        place.aside_holds().map_or("", said).to_owned(),
        format!("{:.0e}", place.false_per_shot[1]),
    ]
}

const OF_PLACES: [&str; 14] = [
    "sensor",
    "wall",
    "N",
    "seen, forecast",
    "with 2 % less and more light",
    "found",
    "verdict",
    "\u{3c3} of range, mm, forecast",
    "found",
    "verdict",
    "on a sidelobe, %, forecast",
    "found",
    "verdict",
    "false and wrong per shot",
];

/// Each once, in the order in which they come first.
fn topics(findings: &Findings) -> Vec<&'static str> {
    let mut topics = Vec::new();
    for figure in &findings.published {
        if !topics.contains(&figure.topic) {
            topics.push(figure.topic);
        }
    }
    topics
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// How many hold.
fn summary(findings: &Findings) -> String {
    let (figures, forecasts) = (findings.published.len(), findings.forecasts.len());
    format!(
        "{} of {figures} published figures are met, and {} of {forecasts} forecasts hold.",
        figures - findings.figures_that_fail(),
        forecasts - findings.forecasts_that_fail()
    )
}

pub(super) fn markdown(findings: &Findings) -> String {
    let row = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let head = |titles: &[&str]| {
        let titles: Vec<String> = titles.iter().map(|title| (*title).to_owned()).collect();
        row(&titles) + &format!("|{}\n", "---|".repeat(titles.len()))
    };
    let mut text = format!(
        "# Validation\n\n{LEAD} This page is written by\n\n```sh not run: a test of its own compares this page with it\nmacropulse validate -o validation\n```\n\n\
         and compared with it by a test. {}\n",
        summary(findings)
    );
    for topic in topics(findings) {
        text += &format!("\n## {}\n\n{}", capitalised(topic), head(&OF_FIGURES));
        let of_topic = findings.published.iter().filter(|figure| figure.topic == topic);
        text.extend(of_topic.map(|figure| row(&cells(figure))));
    }
    text += &format!("\n## Forecasts\n\n{}\n\n{}", of_forecasts(findings), head(&OF_PLACES));
    text.extend(findings.forecasts.iter().map(|place| row(&place_cells(place))));
    text
}

pub(super) fn html(findings: &Findings) -> String {
    let cell = |text: &String| match text.as_str() {
        "holds" => Cell::verdict(Verdict::Holds, "holds"),
        "fails" => Cell::verdict(Verdict::Fails, "fails"),
        text => text.into(),
    };
    let columns = |titles: &[&'static str]| -> Vec<(&'static str, Align)> {
        titles
            .iter()
            .enumerate()
            .map(|(at, title)| (*title, if at < 2 { Align::Left } else { Align::Right }))
            .collect()
    };
    let mut page = Page::new("Validation", LEAD).kicker("Macropulse");
    let mut short = Section::new("In short").paragraph(&summary(findings));
    if findings.forecasts_that_fail() > 0 {
        short = short.paragraph(
            "A forecast that fails is a fault of the forecast: what is simulated goes through the \
             receiver, shot by shot.",
        );
    }
    page = page.section(short);
    for topic in topics(findings) {
        let of_topic = findings.published.iter().filter(|figure| figure.topic == topic);
        let table = of_topic.fold(Table::new("", &columns(&OF_FIGURES)), |table, figure| {
            table.row(cells(figure).iter().map(cell).collect())
        });
        page = page.section(Section::new(&capitalised(topic)).table(table));
    }
    let table =
        findings.forecasts.iter().fold(Table::new("", &columns(&OF_PLACES)), |table, place| {
            table.row(place_cells(place).iter().map(cell).collect())
        });
    let forecasts = Section::new("Forecasts").paragraph(&of_forecasts(findings)).table(table);
    page.section(forecasts)
        .files(&[super::FILES[0], super::FILES[1]].map(str::to_owned))
        .footer(&format!("macropulse {}, seed {}.", env!("CARGO_PKG_VERSION"), findings.seed))
        .html()
}
