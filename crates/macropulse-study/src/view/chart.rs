//! Charts as SVG: lines, steps, dots, bars, shaded bands, notes.

use super::curves::{
    band_path, curve_class, draw_curve, draw_dots, draw_line, draw_note, draw_whiskers,
};
use super::hover::told;
use super::plot::{Plane, Ruler, room_for_ticks};
use super::svg::{Anchor, Hue, Svg, text_width};
use super::ticks::label;

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
    /// Its text.
    pub text: String,
}

/// A chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Description in words for those who cannot see the chart.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// The data; later series cover earlier ones.
    pub series: Vec<Series>,
    /// Shaded areas behind everything.
    pub bands: Vec<Band>,
    /// Intervals about values, drawn as upright strokes from the lower to the upper y.
    pub whiskers: Vec<Band>,
    /// Lines across the chart.
    pub lines: Vec<Line>,
    /// Remarks.
    pub notes: Vec<Note>,
    /// Names in a legend, also where the lines could carry them.
    pub legend: bool,
    /// Width and height, px.
    pub size: [f64; 2],
}

impl Chart {
    /// A chart without content, 704 × 360.
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self {
            title: title.to_owned(),
            x,
            y: Axis { upright: true, ..y },
            series: Vec::new(),
            bands: Vec::new(),
            whiskers: Vec::new(),
            lines: Vec::new(),
            notes: Vec::new(),
            legend: false,
            size: [704.0, 360.0],
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
        self.draw().finish()
    }

    pub(super) fn draw(&self) -> Svg {
        let mut svg = Svg::new(self.size, &self.title);
        let plane = self.plane();
        plane.draw_axes(&mut svg, [&self.x.title, &self.y.title]);
        let [left, top] = [plane.left(), plane.top() - 1.0];
        svg.open_window([left, top], [plane.right() - left, plane.bottom() + 1.0 - top]);
        for band in &self.bands {
            svg.path(&band_path(band, &plane), &format!("band {}", band.hue.class()));
        }
        self.draw_bars(&mut svg, &plane, BarPart::Body);
        for series in &self.series {
            draw_curve(&mut svg, series, &plane);
        }
        svg.close_window();
        self.draw_bars(&mut svg, &plane, BarPart::Value);
        for whiskers in &self.whiskers {
            draw_whiskers(&mut svg, whiskers, &plane);
        }
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
        svg.told(&told(self, &plane));
        svg
    }

    fn plane(&self) -> Plane {
        let named = self.series.iter().any(|series| !series.label.is_empty());
        let labels = self.series.iter().map(|series| text_width(&series.label)).fold(0.0, f64::max);
        let at_ends = self.labels_at_ends();
        let right = self.size[0] - if at_ends && named { labels.min(220.0) + 22.0 } else { 16.0 };
        let legend = if at_ends || !named { 0.0 } else { 26.0 };
        let y = self.upright_ruler(30.0 + legend);
        let xs = self.series.iter().flat_map(|series| series.points.iter().map(|point| point[0]));
        let x = Ruler::new(&self.x, xs, [room_for_ticks(&y), right]);
        Plane { x, y }
    }

    /// The vertical axis, from `top` down to the room of the horizontal one.
    fn upright_ruler(&self, top: f64) -> Ruler {
        let ys = self.series.iter().flat_map(|series| {
            let zero = (series.style == Style::Bars).then_some(0.0);
            series.points.iter().map(|point| point[1]).chain(zero)
        });
        let bands = self.bands.iter().chain(&self.whiskers);
        let ys = ys.chain(bands.flat_map(|band| band.points.iter().flat_map(|p| [p[1], p[2]])));
        Ruler::new(&self.y, ys, [self.size[1] - 52.0, top])
    }

    /// Lines end somewhere, and that is where their names belong, unless they all end in one
    /// place. Dots and bars need a legend.
    fn labels_at_ends(&self) -> bool {
        const FARTHEST: f64 = 26.0;
        let no_end = |series: &Series| matches!(series.style, Style::Bars | Style::Points);
        if self.legend || self.series.iter().any(no_end) {
            return false;
        }
        let ruler = self.upright_ruler(30.0);
        let named = self.series.iter().filter(|series| !series.label.is_empty());
        let mut ends: Vec<f64> = named
            .filter_map(|series| series.points.iter().rev().find_map(|point| ruler.place(point[1])))
            .map(|end| end.clamp(ruler.ends[1], ruler.ends[0]))
            .collect();
        ends.sort_by(f64::total_cmp);
        let spread = spread(&ends, ruler.ends[0]);
        ends.iter().zip(spread).all(|(end, height)| (end - height).abs() < FARTHEST)
    }

    fn draw_end_labels(&self, svg: &mut Svg, plane: &Plane) {
        let last = |series: &Series| {
            let mut places = series.points.iter().filter_map(|point| plane.place(*point));
            let [x, y] = places.rfind(|[x, _]| *x <= plane.right() + 0.5)?;
            Some([x, y.clamp(plane.top(), plane.bottom())])
        };
        let named = self.series.iter().filter(|series| !series.label.is_empty());
        let mut labels: Vec<_> =
            named.filter_map(|series| last(series).map(|place| (place, series))).collect();
        labels.sort_by(|(a, _), (b, _)| a[1].total_cmp(&b[1]));
        let ends: Vec<f64> = labels.iter().map(|(place, _)| place[1]).collect();
        for (y, (_, series)) in spread(&ends, plane.bottom()).into_iter().zip(&labels) {
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
        let y = plane.top() - 38.0;
        let mut x = 0.0;
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

    /// Draws the bars, or what they say on top.
    fn draw_bars(&self, svg: &mut Svg, plane: &Plane, part: BarPart) {
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
            for point in &series.points {
                let Some([x, y]) = plane.place(*point) else { continue };
                let (base, left) = (plane.y.base(), x - group / 2.0 + at as f64 * width);
                let text = label(point[1], if point[1].fract() == 0.0 { 1.0 } else { 0.01 });
                if part == BarPart::Body {
                    let size = [(width - 1.0).max(0.5), (y - base).abs()];
                    let class = format!("area {}", series.hue.class());
                    svg.rect([left + 0.5, y.min(base)], size, &class);
                } else if text_width(&text) < width + 8.0 && y <= base && y >= plane.top() {
                    svg.text([left + width / 2.0, y - 5.0], Anchor::Middle, "soft guard", &text);
                }
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BarPart {
    Body,
    Value,
}

/// Heights for labels that belong at `ends`, sorted from the top: a line apart from each other and
/// not below `bottom`.
fn spread(ends: &[f64], bottom: f64) -> Vec<f64> {
    const LINE: f64 = 15.0;
    let mut heights = ends.to_vec();
    for at in 1..heights.len() {
        heights[at] = heights[at].max(heights[at - 1] + LINE);
    }
    let mut limit = bottom;
    for height in heights.iter_mut().rev() {
        *height = height.min(limit);
        limit = *height - LINE;
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::super::svg::{is_balanced, number};
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
        for _ in 0..2 {
            crowd = crowd.series("same", Style::Line, vec![[0.0, 5.0], [10.0, 5.0]]);
        }
        let svg = crowd.svg();
        let heights: Vec<f64> = svg
            .lines()
            .filter(|line| line.contains(">same<"))
            .map(|line| {
                line.split("y=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
            })
            .collect();
        assert_eq!(heights.len(), 2);
        assert!(heights[1] - heights[0] >= 14.9, "{heights:?}");
    }

    #[test]
    fn labels_that_would_stray_go_into_a_legend() {
        let falling =
            |chart: Chart| chart.series("same", Style::Line, vec![[0.0, 9.0], [9.0, 0.0]]);
        assert!(falling(chart()).labels_at_ends());
        assert!(!falling(falling(falling(chart()))).labels_at_ends());
    }

    #[test]
    fn whiskers_widen_the_axis_and_end_where_they_should() {
        let mut chart = Chart::new("t", Axis::linear("x"), Axis::linear("y"));
        chart = chart.series("", Style::Joined, vec![[0.0, 5.0], [1.0, 5.0]]);
        chart
            .whiskers
            .push(Band { points: vec![[0.0, 0.0, 8.0], [1.0, 5.0, 5.0]], hue: Hue::Blue });
        let plane = chart.plane();
        let [x, low] = plane.place([0.0, 0.0]).unwrap().map(number);
        let high = number(plane.place([0.0, 8.0]).unwrap()[1]);
        let stroke = format!("x1=\"{x}\" y1=\"{low}\" x2=\"{x}\" y2=\"{high}\"");
        assert!(chart.svg().contains(&stroke), "{stroke}");
    }

    #[test]
    fn bars_say_their_value_where_there_is_room() {
        let bars = |count: usize| {
            let points = (0..count).map(|at| [at as f64 / count as f64, 3658.0]).collect();
            Chart::new("t", Axis::linear("x"), Axis::linear("y"))
                .series("", Style::Bars, points)
                .svg()
        };
        assert!(bars(3).contains(">3658</text>"));
        assert!(!bars(60).contains(">3658</text>"));
    }

    #[test]
    fn every_style_is_well_formed_even_without_values() {
        for style in
            [Style::Line, Style::Dashed, Style::Step, Style::Points, Style::Joined, Style::Bars]
        {
            for points in [vec![], vec![[1.0, f64::INFINITY]], vec![[0.0, 1e-9], [2.0, 1e9]]] {
                let mut chart = Chart::new("<t>", Axis::categories("x", &["<a>"]), Axis::log("y"));
                chart.bands.push(Band { points: vec![[0.0, 1.0, 2.0]; 2], hue: Hue::Teal });
                chart.whiskers.push(Band { points: vec![[0.0, f64::NAN, 2.0]], hue: Hue::Teal });
                chart.lines = vec![Line::AtX(1.0, "<".into()), Line::AtY(1.0, "&".into())];
                chart.notes = vec![Note { at: [1.0, 1.0], text: "\"".into() }];
                let svg = chart.series("<s>", style, points).svg();
                assert!(is_balanced(&svg), "{style:?}");
                assert!(!svg.contains("NaN") && !svg.contains("inf"));
            }
        }
    }
}
