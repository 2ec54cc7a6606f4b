//! The few SVG elements charts are made of, and the one style they share.

use super::theme;

/// Colours of series and bars. Their shades depend on the reader's light or dark page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Hue {
    /// First choice.
    Blue,
    /// Stands out against blue for every kind of eye.
    Orange,
    /// For a result that holds.
    Green,
    /// For a result that fails.
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

/// Background of a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ground {
    /// A light page.
    Light,
    /// A dark page, or a picture.
    Dark,
}

/// Name of each colour, on a light and on a dark ground.
const COLOURS: [(&str, &str, &str); 11] = [
    ("ink", "#1b2230", "#e6e9f0"),
    ("soft", "#5b6475", "#9aa3b4"),
    ("grid", "#e3e6ec", "#2a303c"),
    ("paper", "#fff", "#12151c"),
    ("blue", "#2463b4", "#6aa5f8"),
    ("orange", "#cf6a0c", "#f5a155"),
    ("green", "#1d8758", "#55cd98"),
    ("red", "#c6373c", "#f47c79"),
    ("purple", "#7850bf", "#b598f7"),
    ("teal", "#0e8094", "#4fc9da"),
    ("grey", "#727b8b", "#98a1b2"),
];

/// Style of the classes. The hue of an element is its text colour, which its strokes and fills refer to.
/// Unlike a property of our own, that is understood wherever SVG is drawn.
const RULES: &str = "\
svg.mp{font:12px/1.2 ui-sans-serif,system-ui,-apple-system,'Segoe UI',Roboto,Helvetica,Arial,sans-serif;\
font-variant-numeric:tabular-nums}\
.mp text{fill:var(--ink)}.mp .soft{fill:var(--soft)}.mp .bold{font-weight:600}\
.mp .guard{paint-order:stroke;stroke:var(--paper);stroke-width:4px;stroke-linejoin:round}\
.mp .grid{stroke:var(--grid);fill:none}.mp .axis{stroke:var(--soft);fill:none}\
.mp .h-blue{color:var(--blue)}.mp .h-orange{color:var(--orange)}.mp .h-green{color:var(--green)}\
.mp .h-red{color:var(--red)}.mp .h-purple{color:var(--purple)}.mp .h-teal{color:var(--teal)}\
.mp .h-grey{color:var(--grey)}\
.mp .line{fill:none;stroke:currentColor;stroke-width:2;stroke-linejoin:round;stroke-linecap:round}\
.mp .thin{stroke-width:1}.mp .dashed{stroke-dasharray:5 5}\
.mp .area{fill:currentColor}.mp .band{fill:currentColor;opacity:.16}.mp .faint{opacity:.55}\
.mp .outline{fill:var(--paper);stroke:currentColor;stroke-width:1.5}\
.mp .dot{fill:currentColor;stroke:var(--paper);stroke-width:1}.mp text.hued{fill:currentColor}\
.mp text.on{fill:var(--paper);font-weight:600}";

/// Style of the charts of a page, which carries it once.
pub(super) fn style_of_pages() -> String {
    theme::ground("svg.mp", &declared(Ground::Light), &declared(Ground::Dark)) + RULES
}

/// Style of a chart that is a file of its own: as light or dark as the reader's system.
fn style() -> String {
    let [light, dark] = [Ground::Light, Ground::Dark].map(declared);
    format!(
        "svg.mp{{{light}}}@media screen and (prefers-color-scheme:dark){{svg.mp{{{dark}}}}}{RULES}"
    )
}

fn declared(ground: Ground) -> String {
    colours(ground).map(|(name, colour)| format!("--{name}:{colour};")).collect()
}

/// The same where the ground is known: plain colours, no variables.
pub(super) fn style_on(ground: Ground) -> String {
    colours(ground).fold(RULES.to_owned(), |rules, (name, colour)| {
        rules.replace(&format!("var(--{name})"), colour)
    })
}

fn colours(ground: Ground) -> impl Iterator<Item = (&'static str, &'static str)> {
    COLOURS.into_iter().map(move |(name, light, dark)| match ground {
        Ground::Light => (name, light),
        Ground::Dark => (name, dark),
    })
}

/// A chart as a file of its own, with its style inside.
pub fn standalone(svg: &str) -> String {
    svg.replacen('>', &format!("><style>{}</style>", style()), 1)
}

/// Which end of a text stands at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A drawing in the making. Classes say what its elements look like.
#[derive(Debug, Clone)]
pub(super) struct Svg {
    pub size: [f64; 2],
    title: String,
    elements: String,
}

impl Svg {
    /// A drawing of `size`, called `title` for those who cannot see it.
    pub fn new(size: [f64; 2], title: &str) -> Self {
        Self { size, title: title.to_owned(), elements: String::new() }
    }

    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], class: &str) {
        let [x1, y1, x2, y2] = [from[0], from[1], to[0], to[1]].map(number);
        self.push(&format!(
            "<line class=\"{class}\" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>"
        ));
    }

    /// Steps as in the `d` of SVG; nothing if there are none.
    pub fn path(&mut self, steps: &str, class: &str) {
        if !steps.is_empty() {
            self.push(&format!("<path class=\"{class}\" d=\"{steps}\"/>"));
        }
    }

    /// A rectangle with a hint of round corners.
    pub fn rect(&mut self, corner: [f64; 2], size: [f64; 2], class: &str) {
        let [x, y, width, height] =
            [corner[0], corner[1], size[0].max(0.0), size[1].max(0.0)].map(number);
        let round = number((size[0].min(size[1]) / 4.0).clamp(0.0, 2.5));
        self.push(&format!(
            "<rect class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"{round}\"/>"
        ));
    }

    pub fn dot(&mut self, centre: [f64; 2], radius: f64, class: &str) {
        let [x, y, r] = [centre[0], centre[1], radius].map(number);
        self.push(&format!("<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{r}\"/>"));
    }

    /// `text` with its baseline at `place`.
    pub fn text(&mut self, place: [f64; 2], anchor: Anchor, class: &str, text: &str) {
        let [x, y] = place.map(number);
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        self.push(&format!(
            "<text class=\"{class}\" x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{}</text>",
            escape(text)
        ));
    }

    /// JSON that is not drawn, for the script that shows values at the pointer.
    pub fn told(&mut self, json: &serde_json::Value) {
        self.push(&format!("<metadata>{}</metadata>", escape(&json.to_string())));
    }

    /// Opens a window: drawing outside this rectangle is cut off until [`Svg::close_window`].
    pub fn open_window(&mut self, corner: [f64; 2], size: [f64; 2]) {
        let [x, y, width, height] = [corner[0], corner[1], size[0], size[1]].map(number);
        // A nested drawing needs no identifier, which would have to be unique in the page.
        self.push(&format!(
            "<svg x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" viewBox=\"{x} {y} {width} {height}\">"
        ));
    }

    pub fn close_window(&mut self) {
        self.push("</svg>");
    }

    /// Adds another drawing, moved to the right and down by `shift`.
    pub fn add(&mut self, shift: [f64; 2], other: Self) {
        let [x, y] = shift.map(number);
        self.push(&format!("<g transform=\"translate({x} {y})\">\n{}</g>", other.elements));
    }

    /// The drawing as SVG.
    pub fn finish(&self) -> String {
        let [width, height] = self.size.map(number);
        format!(
            "<svg class=\"mp\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"{}\">\n{}</svg>\n",
            escape(&self.title),
            self.elements
        )
    }

    fn push(&mut self, element: &str) {
        self.elements += element;
        self.elements.push('\n');
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
            // Not even escaped may they stand in a file of this kind.
            '\u{fffe}' | '\u{ffff}' => {}
            letter if letter.is_control() && letter != '\n' => {}
            letter => safe.push(letter),
        }
    }
    safe
}

/// Width of a text of 12 px, rather too much than too little: that of Inter, in which pictures are
/// written and which is wider than what browsers choose.
pub(super) fn text_width(text: &str) -> f64 {
    text.chars().map(letter_width).sum()
}

fn letter_width(letter: char) -> f64 {
    match letter {
        '\u{202f}' => 2.1,
        'i' | 'j' | 'l' | 'I' | ' ' => 3.5,
        '!' | '\'' | ',' | '.' | ':' | ';' | '`' | '·' | 't' => 4.0,
        '(' | ')' | '/' | '[' | '\\' | ']' | '|' | 'f' | 'r' | '1' | '{' | '}' => 5.0,
        '-' | '_' | '"' | '°' | '²' | '³' | '¹' | '⁰'..='⁻' | '₀'..='₉' => 6.0,
        '*' | '?' | 'a' | 'c' | 'e' | 'k' | 's' | 'v' | 'x'..='z' | 'F' | 'J' | 'L' | '7' => 7.1,
        '–' | '2' | '3' | '5' | '6' | '8' | '9' | '#' | 'E' | 'P' => 7.6,
        'b' | 'd' | 'g' | 'h' | 'n'..='q' | 'u' | 'µ' => 7.6,
        '0' | '4' | '+' | '−' | '<'..='>' | '~' | '±' | '×' | '≤' | '≥' | '$' | '&' => 8.1,
        'B' | 'R' | 'S' | 'T' | 'Z' => 8.1,
        'C' | 'G' | 'H' | 'N' | 'O' | 'U' | 'A' | 'D' | 'K' | 'V' | 'X' | 'Y' => 9.1,
        'Q' | 'w' => 10.1,
        'm' | 'M' => 11.1,
        _ => 12.0,
    }
}

/// True if every tag that opens also closes, in order. The tests of all drawings call it.
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
