//! Charts as SVG: lines, steps, dots, bars, shaded bands, notes.

use super::plot::{Plane, Ruler, room_for_ticks};
use super::svg::{Anchor, Hue, Svg, number, text_width};

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps.
    Linear,
    /// Equal ratios; values that are not positive are left out.
    Log,
}

/// An axis: what it shows and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Title with unit.
    pub title: String,
    /// Linear or logarithmic.
    pub scale: Scale,
    /// Lowest and highest value shown; from the values if `None`.
    pub limits: Option<[f64; 2]>,
    /// Names of the places 0, 1, 2 …, instead of numbers.
    pub categories: Vec<String>,
    pub(super) upright: bool,
}

impl Axis {
    /// A linear axis that fits its values.
    pub fn linear(title: &str) -> Self {
        let title = title.to_owned();
        Self { title, scale: Scale::Linear, limits: None, categories: Vec::new(), upright: false }
    }

    /// A logarithmic axis that fits its values.
    pub fn log(title: &str) -> Self {
        Self { scale: Scale::Log, ..Self::linear(title) }
    }

    /// An axis of named places.
    pub fn categories(title: &str, names: &[&str]) -> Self {
        Self {
            categories: names.iter().map(|name| (*name).to_owned()).collect(),
            ..Self::linear(title)
        }
        .limits(-0.5, names.len().max(1) as f64 - 0.5)
    }

    /// Sets where the axis begins and ends.
    pub fn limits(mut self, low: f64, high: f64) -> Self {
        self.limits = Some([low, high]);
        self
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Points joined by lines.
    Line,
    /// As `Line`, dashed: theory beside measurement.
    Dashed,
    /// Each value holds until the next.
    Step,
    /// Dots.
    Points,
    /// Dots joined by thin lines.
    Joined,
    /// Bars from zero; those of several series stand side by side.
    Bars,
}

/// Values with a name. A value that is no number interrupts the line.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name; a series without one has no label.
    pub label: String,
    /// Pairs of x and y, in the order in which they are joined.
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub style: Style,
    /// Its colour.
    pub hue: Hue,
}

/// A shaded area between two curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// x, lower y, upper y.
    pub points: Vec<[f64; 3]>,
    /// Its colour.
    pub hue: Hue,
}

/// A straight line across the chart, at a limit for instance.
#[derive(Debug, Clone, PartialEq)]
pub enum Line {
    /// From bottom to top at x, with a label.
    AtX(f64, String),
    /// From left to right at y, with a label.
    AtY(f64, String),
}

/// A remark at a place in the chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// x and y.
    pub at: [f64; 2],
    /// What it says.
    pub text: String,
}

/// A chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// What the chart shows, in words for those who cannot see it.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is shown; later ones cover earlier ones.
    pub series: Vec<Series>,
    /// Shaded areas behind everything.
    pub bands: Vec<Band>,
    /// Lines across the chart.
    pub lines: Vec<Line>,
    /// Remarks.
    pub notes: Vec<Note>,
    /// Width and height, px.
    pub size: [f64; 2],
}

impl Chart {
    /// A chart without content, 720 × 360.
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self {
            title: title.to_owned(),
            x,
            y: Axis { upright: true, ..y },
            series: Vec::new(),
            bands: Vec::new(),
            lines: Vec::new(),
            notes: Vec::new(),
            size: [720.0, 360.0],
        }
    }

    /// Adds a series in the next colour.
    pub fn series(mut self, label: &str, style: Style, points: Vec<[f64; 2]>) -> Self {
        let hue = Hue::ALL[self.series.len() % Hue::ALL.len()];
        self.series.push(Series { label: label.to_owned(), points, style, hue });
        self
    }

    /// The chart as SVG.
    pub fn svg(&self) -> String {
        let mut svg = Svg::new(self.size, &self.title);
        let plane = self.plane();
        plane.draw_axes(&mut svg, [&self.x.title, &self.y.title]);
        let [left, top] = [plane.left(), plane.top() - 1.0];
        svg.open_window([left, top], [plane.right() - left, plane.bottom() + 1.0 - top]);
        for band in &self.bands {
            svg.path(&band_path(band, &plane), &format!("band {}", band.hue.class()));
        }
        self.draw_bars(&mut svg, &plane);
        for series in &self.series {
            draw_curve(&mut svg, series, &plane);
        }
        svg.close_window();
        for series in &self.series {
            draw_dots(&mut svg, series, &plane);
        }
        for line in &self.lines {
            draw_line(&mut svg, line, &plane);
        }
        if self.labels_at_ends() {
            self.draw_end_labels(&mut svg, &plane);
        } else {
            self.draw_legend(&mut svg, &plane);
        }
        for note in &self.notes {
            draw_note(&mut svg, note, &plane);
        }
        svg.finish()
    }

    fn plane(&self) -> Plane {
        let named = self.series.iter().any(|series| !series.label.is_empty());
        let labels = self.series.iter().map(|series| text_width(&series.label)).fold(0.0, f64::max);
        let at_ends = self.labels_at_ends();
        let right = self.size[0] - if at_ends && named { labels.min(220.0) + 22.0 } else { 16.0 };
        let legend = if at_ends || !named { 0.0 } else { 24.0 };
        let ends = [self.size[1] - 52.0, 30.0 + legend];
        let ys = self.series.iter().flat_map(|series| {
            let zero = (series.style == Style::Bars).then_some(0.0);
            series.points.iter().map(|point| point[1]).chain(zero)
        });
        let ys = ys.chain(
            self.bands.iter().flat_map(|band| band.points.iter().flat_map(|p| [p[1], p[2]])),
        );
        let y = Ruler::new(&self.y, ys, ends);
        let xs = self.series.iter().flat_map(|series| series.points.iter().map(|point| point[0]));
        let x = Ruler::new(&self.x, xs, [room_for_ticks(&y), right]);
        Plane { x, y }
    }

    /// Lines end somewhere, and that is where their name belongs. Dots and bars need a legend.
    fn labels_at_ends(&self) -> bool {
        !self.series.iter().any(|series| matches!(series.style, Style::Bars | Style::Points))
    }

    fn draw_end_labels(&self, svg: &mut Svg, plane: &Plane) {
        let last = |series: &Series| {
            let places = series.points.iter().filter_map(|point| plane.place(*point));
            let [x, y] = places.filter(|[x, _]| *x <= plane.right() + 0.5).last()?;
            Some([x, y.clamp(plane.top(), plane.bottom())])
        };
        let named = self.series.iter().filter(|series| !series.label.is_empty());
        let mut labels: Vec<_> =
            named.filter_map(|series| last(series).map(|place| (place, series))).collect();
        labels.sort_by(|(a, _), (b, _)| a[1].total_cmp(&b[1]));
        for (y, (_, series)) in spread(&labels, plane).into_iter().zip(&labels) {
            let place = [plane.right() + 8.0, y + 4.0];
            svg.text(
                place,
                Anchor::Start,
                &format!("hued bold {}", series.hue.class()),
                &series.label,
            );
        }
    }

    fn draw_legend(&self, svg: &mut Svg, plane: &Plane) {
        let y = plane.top() - 34.0;
        let mut x = plane.left() - 8.0;
        for series in self.series.iter().filter(|series| !series.label.is_empty()) {
            let hue = series.hue.class();
            match series.style {
                Style::Points => svg.dot([x + 6.0, y - 4.0], 4.0, &format!("dot {hue}")),
                Style::Bars => svg.rect([x, y - 10.0], [12.0, 12.0], &format!("area {hue}")),
                _ => svg.line([x, y - 4.0], [x + 14.0, y - 4.0], &curve_class(series)),
            }
            svg.text([x + 19.0, y], Anchor::Start, "", &series.label);
            x += 19.0 + text_width(&series.label) + 18.0;
        }
    }

    fn draw_bars(&self, svg: &mut Svg, plane: &Plane) {
        let groups: Vec<_> =
            self.series.iter().filter(|series| series.style == Style::Bars).collect();
        let mut xs: Vec<f64> = groups
            .iter()
            .flat_map(|series| series.points.iter().filter_map(|point| plane.x.place(point[0])))
            .collect();
        xs.sort_by(f64::total_cmp);
        let gaps = xs.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > 0.5);
        let group = gaps.fold(plane.right() - plane.left(), f64::min).min(160.0) * 0.72;
        let width = group / groups.len().max(1) as f64;
        for (at, series) in groups.iter().enumerate() {
            for [x, y] in series.points.iter().filter_map(|point| plane.place(*point)) {
                let base = plane.y.base();
                let corner = [x - group / 2.0 + at as f64 * width + 0.5, y.min(base)];
                let size = [(width - 1.0).max(0.5), (y - base).abs()];
                svg.rect(corner, size, &format!("area {}", series.hue.class()));
            }
        }
    }
}

/// Heights for the labels, from the top, that keep a line's distance from each other.
fn spread(labels: &[([f64; 2], &Series)], plane: &Plane) -> Vec<f64> {
    const LINE: f64 = 15.0;
    let mut heights: Vec<f64> = labels.iter().map(|(place, _)| place[1]).collect();
    for at in 1..heights.len() {
        heights[at] = heights[at].max(heights[at - 1] + LINE);
    }
    let mut limit = plane.bottom();
    for height in heights.iter_mut().rev() {
        *height = height.min(limit);
        limit = *height - LINE;
    }
    heights
}

fn curve_class(series: &Series) -> String {
    let kind = match series.style {
        Style::Dashed => "line dashed",
        Style::Joined => "line thin",
        _ => "line",
    };
    format!("{kind} {}", series.hue.class())
}

fn draw_curve(svg: &mut Svg, series: &Series, plane: &Plane) {
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

fn draw_dots(svg: &mut Svg, series: &Series, plane: &Plane) {
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

fn band_path(band: &Band, plane: &Plane) -> String {
    let edge = |side: usize| {
        band.points.iter().filter_map(move |point| plane.place([point[0], point[side]]))
    };
    let outline: Vec<_> = edge(1).chain(edge(2).collect::<Vec<_>>().into_iter().rev()).collect();
    let corners: Vec<_> =
        outline.iter().map(|[x, y]| format!("{} {}", number(*x), number(*y))).collect();
    if corners.len() < 3 { String::new() } else { format!("M{}Z", corners.join("L")) }
}

fn draw_line(svg: &mut Svg, line: &Line, plane: &Plane) {
    const CLASS: &str = "line thin dashed h-grey";
    match line {
        Line::AtX(value, label) => {
            let Some(x) = plane.x.place(*value) else { return };
            svg.line([x, plane.top()], [x, plane.bottom()], CLASS);
            let (shift, anchor) = away_from_edge(x, plane);
            svg.text([x + shift, plane.top() + 10.0], anchor, "soft halo", label);
        }
        Line::AtY(value, label) => {
            let Some(y) = plane.y.place(*value) else { return };
            svg.line([plane.left(), y], [plane.right(), y], CLASS);
            svg.text([plane.right() - 6.0, y - 5.0], Anchor::End, "soft halo", label);
        }
    }
}

fn draw_note(svg: &mut Svg, note: &Note, plane: &Plane) {
    let Some([x, y]) = plane.place(note.at) else { return };
    svg.dot([x, y], 3.5, "outline h-grey");
    let (shift, anchor) = away_from_edge(x, plane);
    svg.text([x + 1.5 * shift, y - 8.0], anchor, "halo", &note.text);
}

/// Text beside x goes where there is more room.
fn away_from_edge(x: f64, plane: &Plane) -> (f64, Anchor) {
    if x > plane.left() + 0.6 * (plane.right() - plane.left()) {
        (-6.0, Anchor::End)
    } else {
        (6.0, Anchor::Start)
    }
}

#[cfg(test)]
mod tests {
    use super::super::svg::is_balanced;
    use super::*;

    fn chart() -> Chart {
        Chart::new("t", Axis::linear("x").limits(0.0, 10.0), Axis::linear("y").limits(0.0, 10.0))
    }

    /// The `d` of the only line in the chart.
    fn path(chart: &Chart) -> String {
        let svg = chart.svg();
        let tail = svg.split("<path class=\"line h-blue\" d=\"").nth(1).unwrap();
        tail.split('"').next().unwrap().to_owned()
    }

    #[test]
    fn values_become_places() {
        let straight = chart().series("", Style::Line, vec![[0.0, 0.0], [10.0, 10.0]]);
        let plane = straight.plane();
        let place = |x: f64, y: f64| format!("{} {}", number(x), number(y));
        let expected = format!(
            "M{}L{}",
            place(plane.left(), plane.bottom()),
            place(plane.right(), plane.top())
        );
        assert_eq!(path(&straight), expected);
    }

    #[test]
    fn a_gap_interrupts_and_a_step_is_square() {
        let gap = vec![[0.0, 1.0], [1.0, f64::NAN], [2.0, 1.0]];
        assert_eq!(path(&chart().series("", Style::Line, gap)).matches('M').count(), 2);
        let step = chart().series("", Style::Step, vec![[0.0, 0.0], [5.0, 5.0]]);
        assert!(path(&step).contains('H') && path(&step).contains('V'));
    }

    #[test]
    fn labels_that_end_together_stand_apart() {
        let mut crowd = chart();
        for _ in 0..5 {
            crowd = crowd.series("same", Style::Line, vec![[0.0, 0.1], [10.0, 0.1]]);
        }
        let svg = crowd.svg();
        let heights: Vec<f64> = svg
            .lines()
            .filter(|line| line.contains(">same<"))
            .map(|line| {
                line.split("y=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
            })
            .collect();
        assert_eq!(heights.len(), 5);
        assert!(heights.windows(2).all(|pair| pair[1] - pair[0] >= 14.9), "{heights:?}");
    }

    #[test]
    fn every_style_is_well_formed_even_without_values() {
        for style in
            [Style::Line, Style::Dashed, Style::Step, Style::Points, Style::Joined, Style::Bars]
        {
            for points in [vec![], vec![[1.0, f64::INFINITY]], vec![[0.0, 1e-9], [2.0, 1e9]]] {
                let mut chart = Chart::new("<t>", Axis::categories("x", &["<a>"]), Axis::log("y"));
                chart.bands.push(Band { points: vec![[0.0, 1.0, 2.0]; 2], hue: Hue::Teal });
                chart.lines = vec![Line::AtX(1.0, "<".into()), Line::AtY(1.0, "&".into())];
                chart.notes = vec![Note { at: [1.0, 1.0], text: "\"".into() }];
                let svg = chart.series("<s>", style, points).svg();
                assert!(is_balanced(&svg), "{style:?}");
                assert!(!svg.contains("NaN") && !svg.contains("inf"));
            }
        }
    }
}
