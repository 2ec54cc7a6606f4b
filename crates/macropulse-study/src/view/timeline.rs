//! Shots, their light and their echoes over time.

use super::svg::{Anchor, Hue, Svg, text_width};
use super::ticks::{label, linear_ticks};

/// A stretch of time in a lane.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// Start, ns.
    pub start: f64,
    /// End, ns.
    pub end: f64,
    /// Written on it if it fits, else beside it; left out if that is taken too.
    pub label: String,
    /// Its colour.
    pub hue: Hue,
    /// Drawn as an outline: expected, not seen.
    pub hollow: bool,
}

/// A row of the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Lane {
    /// Name at the left.
    pub label: String,
    /// Its stretches of time.
    pub spans: Vec<Span>,
}

/// A line from a time in one lane to a time in another: light under way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flight {
    /// Lane and time (ns) where it begins.
    pub from: (usize, f64),
    /// Lane and time (ns) where it ends.
    pub to: (usize, f64),
    /// Its colour.
    pub hue: Hue,
}

/// Lanes over time \[KP16 Fig. 2\].
#[derive(Debug, Clone, PartialEq)]
pub struct Timeline {
    /// Description in words for those who cannot see the picture.
    pub title: String,
    /// Rows from the top.
    pub lanes: Vec<Lane>,
    /// Light under way between them.
    pub flights: Vec<Flight>,
    /// First and last time shown, ns.
    pub window: [f64; 2],
    /// Width, px.
    pub width: f64,
}

const LANE: f64 = 46.0;
const BAR: f64 = 20.0;
const TOP: f64 = 10.0;

impl Timeline {
    /// The timeline as SVG.
    pub fn svg(&self) -> String {
        let names = self.lanes.iter().map(|lane| text_width(&lane.label)).fold(0.0, f64::max);
        let left = names.min(200.0) + 14.0;
        let right = self.width - 14.0;
        let bottom = TOP + LANE * self.lanes.len() as f64;
        let mut svg = Svg::new([self.width, bottom + 46.0], &self.title);
        let [first, last] = self.window;
        let scale = (right - left) / (last - first).max(f64::MIN_POSITIVE);
        let x = |time: f64| left + (time - first) * scale;

        let ticks = linear_ticks(first, last, 9);
        let step = if let [a, b, ..] = ticks[..] { b - a } else { 1.0 };
        for tick in ticks {
            svg.line([x(tick), TOP], [x(tick), bottom], "grid");
            svg.text([x(tick), bottom + 17.0], Anchor::Middle, "soft", &label(tick, step));
        }
        svg.line([left, bottom], [right, bottom], "axis");
        svg.text([right, bottom + 38.0], Anchor::End, "", "time in ns");
        for (at, lane) in self.lanes.iter().enumerate() {
            svg.text([left - 10.0, middle(at) + 4.0], Anchor::End, "", &lane.label);
            svg.line([left, middle(at)], [right, middle(at)], "grid");
        }
        svg.open_window([left, 0.0], [right - left, bottom]);
        for flight in &self.flights {
            let [from, to] = [flight.from, flight.to];
            let down = if to.0 >= from.0 { BAR / 2.0 } else { -BAR / 2.0 };
            let class = format!("line thin faint {}", flight.hue.class());
            svg.line([x(from.1), middle(from.0) + down], [x(to.1), middle(to.0) - down], &class);
        }
        for (at, lane) in self.lanes.iter().enumerate() {
            for span in &lane.spans {
                let later =
                    lane.spans.iter().map(|other| x(other.start)).filter(|s| *s > x(span.start));
                let room = later.fold(right, f64::min);
                draw_span(&mut svg, span, [x(span.start), x(span.end), room], middle(at));
            }
        }
        svg.close_window();
        svg.finish()
    }
}

fn middle(lane: usize) -> f64 {
    TOP + LANE * (lane as f64 + 0.5)
}

/// Draws a span from `start` to `end`; its label may reach up to `room`.
fn draw_span(svg: &mut Svg, span: &Span, [start, end, room]: [f64; 3], middle: f64) {
    let width = (end - start).max(1.5);
    let kind = if span.hollow { "outline" } else { "area" };
    let class = format!("{kind} {}", span.hue.class());
    svg.rect([start, middle - BAR / 2.0], [width, BAR], &class);
    if span.label.is_empty() {
        return;
    }
    let hue = span.hue.class();
    if text_width(&span.label) + 4.0 < width {
        let class = if span.hollow { format!("hued bold {hue}") } else { "on".into() };
        svg.text([start + width / 2.0, middle + 4.0], Anchor::Middle, &class, &span.label);
    } else if start + width + 4.0 + text_width(&span.label) < room {
        let class = format!("hued guard {hue}");
        svg.text([start + width + 4.0, middle + 4.0], Anchor::Start, &class, &span.label);
    }
}

#[cfg(test)]
mod tests {
    use super::super::svg::is_balanced;
    use super::*;

    fn timeline(spans: Vec<Span>) -> String {
        let lanes = vec![Lane { label: "sent <1>".into(), spans }];
        let flights = vec![Flight { from: (0, 0.0), to: (0, 9.0), hue: Hue::Blue }];
        Timeline { title: "t".into(), lanes, flights, window: [0.0, 100.0], width: 400.0 }.svg()
    }

    fn span(start: f64, end: f64, label: &str) -> Span {
        Span { start, end, label: label.into(), hue: Hue::Blue, hollow: false }
    }

    #[test]
    fn a_span_is_as_long_as_it_lasts() {
        let svg = timeline(vec![span(0.0, 50.0, "")]);
        let left = text_width("sent <1>") + 14.0;
        let half = super::super::svg::number((400.0 - 14.0 - left) / 2.0);
        assert!(svg.contains(&format!("width=\"{half}\" height=\"20\"")), "{svg}");
        assert!(is_balanced(&svg));
        assert!(svg.contains("sent &lt;1&gt;"));
    }

    #[test]
    fn a_label_stands_on_its_span_or_beside_it() {
        assert!(timeline(vec![span(0.0, 90.0, "one")]).contains("class=\"on\""));
        assert!(timeline(vec![span(0.0, 1.0, "one")]).contains("class=\"hued guard h-blue\""));
        let crowded = timeline(vec![span(0.0, 1.0, "one"), span(2.0, 3.0, "")]);
        assert!(!crowded.contains(">one<"));
    }

    #[test]
    fn no_lanes_and_no_time_still_draw() {
        let empty = Timeline {
            title: String::new(),
            lanes: Vec::new(),
            flights: Vec::new(),
            window: [0.0, 0.0],
            width: 100.0,
        };
        assert!(is_balanced(&empty.svg()));
    }
}
