//! The strokes of a chart: curves, dots, bands, lines across, notes.

use super::chart::{Band, Line, Note, Series, Style};
use super::plot::Plane;
use super::svg::{Anchor, Svg, number};

/// Classes of a curve in a chart or legend.
pub(super) fn curve_class(series: &Series) -> String {
    let kind = match series.style {
        Style::Dashed => "line dashed",
        Style::Joined => "line thin",
        _ => "line",
    };
    format!("{kind} {}", series.hue.class())
}

pub(super) fn draw_curve(svg: &mut Svg, series: &Series, plane: &Plane) {
    if matches!(series.style, Style::Points | Style::Bars) {
        return;
    }
    let mut path = String::new();
    let mut pen_down = false;
    for point in &series.points {
        let Some([x, y]) = plane.place(*point) else {
            pen_down = false;
            continue;
        };
        let [x, y] = [x, y].map(number);
        path += &match (pen_down, series.style) {
            (false, _) => format!("M{x} {y}"),
            (true, Style::Step) => format!("H{x}V{y}"),
            (true, _) => format!("L{x} {y}"),
        };
        pen_down = true;
    }
    svg.path(&path, &curve_class(series));
}

pub(super) fn draw_dots(svg: &mut Svg, series: &Series, plane: &Plane) {
    if !matches!(series.style, Style::Points | Style::Joined) {
        return;
    }
    let radius = if series.points.len() > 200 { 2.0 } else { 4.0 };
    let inside = |[x, y]: &[f64; 2]| {
        (plane.left() - 1.0..=plane.right() + 1.0).contains(x)
            && (plane.top() - 1.0..=plane.bottom() + 1.0).contains(y)
    };
    for place in series.points.iter().filter_map(|point| plane.place(*point)).filter(inside) {
        svg.dot(place, radius, &format!("dot {}", series.hue.class()));
    }
}

pub(super) fn band_path(band: &Band, plane: &Plane) -> String {
    let edge = |side: usize| {
        band.points.iter().filter_map(move |point| plane.place([point[0], point[side]]))
    };
    let outline: Vec<_> = edge(1).chain(edge(2).collect::<Vec<_>>().into_iter().rev()).collect();
    let corners: Vec<_> =
        outline.iter().map(|[x, y]| format!("{} {}", number(*x), number(*y))).collect();
    if corners.len() < 3 { String::new() } else { format!("M{}Z", corners.join("L")) }
}

pub(super) fn draw_whiskers(svg: &mut Svg, whiskers: &Band, plane: &Plane) {
    /// Half the width of the cross strokes at both ends.
    const HALF: f64 = 4.0;
    let class = format!("line thin {}", whiskers.hue.class());
    for [x, low, high] in &whiskers.points {
        let (Some([x, low]), Some([_, high])) = (plane.place([*x, *low]), plane.place([*x, *high]))
        else {
            continue;
        };
        svg.line([x, low], [x, high], &class);
        for end in [low, high] {
            svg.line([x - HALF, end], [x + HALF, end], &class);
        }
    }
}

pub(super) fn draw_line(svg: &mut Svg, line: &Line, plane: &Plane) {
    const CLASS: &str = "line thin dashed h-grey";
    match line {
        Line::AtX(value, label) => {
            let Some(x) = plane.x.place(*value) else { return };
            svg.line([x, plane.top()], [x, plane.bottom()], CLASS);
            let (shift, anchor) = away_from_edge(x, plane);
            svg.text([x + shift, plane.top() + 10.0], anchor, "soft guard", label);
        }
        Line::AtY(value, label) => {
            let Some(y) = plane.y.place(*value) else { return };
            svg.line([plane.left(), y], [plane.right(), y], CLASS);
            svg.text([plane.right() - 6.0, y - 5.0], Anchor::End, "soft guard", label);
        }
    }
}

pub(super) fn draw_note(svg: &mut Svg, note: &Note, plane: &Plane) {
    let Some([x, y]) = plane.place(note.at) else { return };
    svg.dot([x, y], 3.5, "outline h-grey");
    let (shift, anchor) = away_from_edge(x, plane);
    svg.text([x + 1.5 * shift, y - 8.0], anchor, "guard", &note.text);
}

/// Text beside x goes where there is more room.
fn away_from_edge(x: f64, plane: &Plane) -> (f64, Anchor) {
    if x > plane.left() + 0.6 * (plane.right() - plane.left()) {
        (-6.0, Anchor::End)
    } else {
        (6.0, Anchor::Start)
    }
}
