//! The few SVG elements charts are made of, and the one style they share.

/// Colours of series and bars. What each looks like depends on the reader's light or dark page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Hue {
    /// First choice.
    Blue,
    /// Stands out against blue for every kind of eye.
    Orange,
    /// What holds.
    Green,
    /// What fails.
    Red,
    /// A fifth series.
    Purple,
    /// A sixth series.
    Teal,
    /// Context, theory, the rest.
    Grey,
}

impl Hue {
    /// All hues in the order in which series take them.
    pub const ALL: [Self; 7] =
        [Self::Blue, Self::Orange, Self::Green, Self::Red, Self::Purple, Self::Teal, Self::Grey];

    pub(super) fn class(self) -> &'static str {
        match self {
            Self::Blue => "h-blue",
            Self::Orange => "h-orange",
            Self::Green => "h-green",
            Self::Red => "h-red",
            Self::Purple => "h-purple",
            Self::Teal => "h-teal",
            Self::Grey => "h-grey",
        }
    }
}

/// Style of every chart. The page carries it once; [`standalone`] puts it into a single chart.
pub(super) const STYLE: &str = "\
svg.mp{--ink:#1b2230;--soft:#5b6475;--grid:#e3e6ec;--paper:#fff;--blue:#2463b4;--orange:#cf6a0c;\
--green:#1d8758;--red:#c6373c;--purple:#7850bf;--teal:#0e8094;--grey:#727b8b;\
font:12px/1.2 ui-sans-serif,system-ui,-apple-system,'Segoe UI',Roboto,Helvetica,Arial,sans-serif;\
font-variant-numeric:tabular-nums}\
@media screen and (prefers-color-scheme:dark){svg.mp{--ink:#e6e9f0;--soft:#9aa3b4;--grid:#2a303c;\
--paper:#12151c;--blue:#6aa5f8;--orange:#f5a155;--green:#55cd98;--red:#f47c79;--purple:#b598f7;\
--teal:#4fc9da;--grey:#98a1b2}}\
.mp text{fill:var(--ink)}.mp .soft{fill:var(--soft)}.mp .bold{font-weight:600}\
.mp .guard{paint-order:stroke;stroke:var(--paper);stroke-width:4px;stroke-linejoin:round}\
.mp .grid{stroke:var(--grid);fill:none}.mp .axis{stroke:var(--soft);fill:none}\
.mp .h-blue{--hue:var(--blue)}.mp .h-orange{--hue:var(--orange)}.mp .h-green{--hue:var(--green)}\
.mp .h-red{--hue:var(--red)}.mp .h-purple{--hue:var(--purple)}.mp .h-teal{--hue:var(--teal)}\
.mp .h-grey{--hue:var(--grey)}\
.mp .line{fill:none;stroke:var(--hue);stroke-width:2;stroke-linejoin:round;stroke-linecap:round}\
.mp .thin{stroke-width:1}.mp .dashed{stroke-dasharray:5 5}\
.mp .area{fill:var(--hue)}.mp .band{fill:var(--hue);opacity:.16}.mp .faint{opacity:.55}\
.mp .outline{fill:var(--paper);stroke:var(--hue);stroke-width:1.5}\
.mp .dot{fill:var(--hue);stroke:var(--paper);stroke-width:1}.mp text.hued{fill:var(--hue)}\
.mp text.on{fill:var(--paper);font-weight:600}";

/// A chart as a file of its own, with its style inside.
pub fn standalone(svg: &str) -> String {
    svg.replacen('>', &format!("><style>{STYLE}</style>"), 1)
}

/// Which end of a text stands at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// One element of a drawing, with the classes that say what it looks like.
#[derive(Debug, Clone)]
pub(super) enum Stroke {
    Line {
        from: [f64; 2],
        to: [f64; 2],
        class: String,
    },
    /// Steps M, L, H, V and Z with absolute coordinates.
    Path {
        steps: String,
        class: String,
    },
    Rect {
        corner: [f64; 2],
        size: [f64; 2],
        class: String,
    },
    Dot {
        centre: [f64; 2],
        radius: f64,
        class: String,
    },
    Text {
        place: [f64; 2],
        anchor: Anchor,
        class: String,
        text: String,
    },
    /// Until the window closes, what lies outside of it is cut off.
    OpenWindow {
        corner: [f64; 2],
        size: [f64; 2],
    },
    CloseWindow,
    /// Until the group closes, everything is moved to the right and down.
    OpenGroup {
        shift: [f64; 2],
    },
    CloseGroup,
}

/// A drawing in the making.
#[derive(Debug, Clone)]
pub(super) struct Svg {
    pub size: [f64; 2],
    title: String,
    pub strokes: Vec<Stroke>,
}

impl Svg {
    /// A drawing of `size`, called `title` for those who cannot see it.
    pub fn new(size: [f64; 2], title: &str) -> Self {
        Self { size, title: title.to_owned(), strokes: Vec::new() }
    }

    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], class: &str) {
        self.strokes.push(Stroke::Line { from, to, class: class.to_owned() });
    }

    pub fn path(&mut self, steps: &str, class: &str) {
        if !steps.is_empty() {
            self.strokes.push(Stroke::Path { steps: steps.to_owned(), class: class.to_owned() });
        }
    }

    /// A rectangle with a hint of round corners.
    pub fn rect(&mut self, corner: [f64; 2], size: [f64; 2], class: &str) {
        self.strokes.push(Stroke::Rect { corner, size, class: class.to_owned() });
    }

    pub fn dot(&mut self, centre: [f64; 2], radius: f64, class: &str) {
        self.strokes.push(Stroke::Dot { centre, radius, class: class.to_owned() });
    }

    /// `text` with its baseline at `place`.
    pub fn text(&mut self, place: [f64; 2], anchor: Anchor, class: &str, text: &str) {
        let (class, text) = (class.to_owned(), text.to_owned());
        self.strokes.push(Stroke::Text { place, anchor, class, text });
    }

    /// What is drawn until [`Svg::close_window`] is cut off at this rectangle.
    pub fn open_window(&mut self, corner: [f64; 2], size: [f64; 2]) {
        self.strokes.push(Stroke::OpenWindow { corner, size });
    }

    pub fn close_window(&mut self) {
        self.strokes.push(Stroke::CloseWindow);
    }

    /// Adds another drawing, moved to the right and down by `shift`.
    pub fn add(&mut self, shift: [f64; 2], other: Self) {
        self.strokes.push(Stroke::OpenGroup { shift });
        self.strokes.extend(other.strokes);
        self.strokes.push(Stroke::CloseGroup);
    }

    /// The drawing as SVG.
    pub fn finish(self) -> String {
        let [width, height] = self.size.map(number);
        let mut text = format!(
            "<svg class=\"mp\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"{}\">\n",
            escape(&self.title)
        );
        for stroke in &self.strokes {
            text += &stroke.markup();
            text.push('\n');
        }
        text + "</svg>\n"
    }
}

impl Stroke {
    fn markup(&self) -> String {
        match self {
            Self::Line { from, to, class } => {
                let [x1, y1, x2, y2] = [from[0], from[1], to[0], to[1]].map(number);
                format!("<line class=\"{class}\" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>")
            }
            Self::Path { steps, class } => format!("<path class=\"{class}\" d=\"{steps}\"/>"),
            Self::Rect { corner, size, class } => {
                let [x, y, width, height] =
                    [corner[0], corner[1], size[0].max(0.0), size[1].max(0.0)].map(number);
                let round = number((size[0].min(size[1]) / 4.0).clamp(0.0, 2.5));
                format!(
                    "<rect class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"{round}\"/>"
                )
            }
            Self::Dot { centre, radius, class } => {
                let [x, y, r] = [centre[0], centre[1], *radius].map(number);
                format!("<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{r}\"/>")
            }
            Self::Text { place, anchor, class, text } => {
                let [x, y] = place.map(number);
                let anchor = match anchor {
                    Anchor::Start => "start",
                    Anchor::Middle => "middle",
                    Anchor::End => "end",
                };
                format!(
                    "<text class=\"{class}\" x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{}</text>",
                    escape(text)
                )
            }
            // A nested drawing needs no identifier, which would have to be unique in the page.
            Self::OpenWindow { corner, size } => {
                let [x, y, width, height] = [corner[0], corner[1], size[0], size[1]].map(number);
                format!(
                    "<svg x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" viewBox=\"{x} {y} {width} {height}\">"
                )
            }
            Self::CloseWindow => "</svg>".to_owned(),
            Self::OpenGroup { shift } => {
                let [x, y] = shift.map(number);
                format!("<g transform=\"translate({x} {y})\">")
            }
            Self::CloseGroup => "</g>".to_owned(),
        }
    }
}

/// A coordinate: two decimals, and never so large that a renderer loses its way.
pub(super) fn number(value: f64) -> String {
    let value = if value.is_nan() { 0.0 } else { value.clamp(-1e5, 1e5) };
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Text that cannot be taken for markup, also within an attribute.
pub(super) fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            letter if letter.is_control() && letter != '\n' => {}
            letter => safe.push(letter),
        }
    }
    safe
}

/// Width of a text of 12 px, about: fonts differ, so margins are generous.
pub(super) fn text_width(text: &str) -> f64 {
    6.6 * text.chars().count() as f64
}

/// Whether every tag that opens also closes, in order; what the tests of all drawings ask.
#[cfg(test)]
pub(super) fn is_balanced(markup: &str) -> bool {
    let mut open = Vec::new();
    for tag in markup.split('<').skip(1) {
        let Some((tag, _)) = tag.split_once('>') else { return false };
        let name = tag.trim_end_matches('/').split_whitespace().next().unwrap_or("");
        let void = matches!(name, "meta" | "img" | "!doctype" | "br");
        if let Some(closed) = tag.strip_prefix('/') {
            if open.pop() != Some(closed) {
                return false;
            }
        } else if !tag.ends_with('/') && !void {
            open.push(name);
        }
    }
    open.is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_short() {
        assert_eq!([12.0, 0.125, -0.001, 1e9].map(number), ["12", "0.12", "0", "100000"]);
        assert_eq!(number(f64::NAN), "0");
    }

    #[test]
    fn markup_in_a_text_stays_text() {
        let mut svg = Svg::new([10.0, 10.0], "a \"b\" <c>");
        svg.text([0.0, 0.0], Anchor::Start, "soft", "</svg><script>&");
        let svg = svg.finish();
        assert!(svg.contains("&lt;/svg&gt;&lt;script&gt;&amp;</text>"));
        assert!(svg.contains("aria-label=\"a &quot;b&quot; &lt;c&gt;\""));
        assert!(is_balanced(&svg));
    }

    #[test]
    fn a_standalone_drawing_has_its_style() {
        let svg = standalone(&Svg::new([10.0, 10.0], "x").finish());
        assert!(svg.contains("<style>svg.mp{"));
        assert!(is_balanced(&svg));
    }

    #[test]
    fn the_balance_check_can_fail() {
        assert!(!is_balanced("<a><b></a></b>"));
        assert!(!is_balanced("<a>"));
    }
}
