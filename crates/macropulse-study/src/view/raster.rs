//! Drawings as pixels, for those who have no use for SVG.

use super::Error;
use super::canvas::{self, Canvas, Pen};
use super::colour::{Rgb, mix};
use super::svg::{Anchor, Stroke, Svg};

/// Pixels to a unit of the drawing.
const ZOOM: f64 = 2.0;

/// Pixels to a dot of the font.
const LETTER: usize = 2;

/// Lengths of a dash and of the gap behind it, units.
const DASH: f64 = 5.0;

/// Background.
const PAPER: Rgb = [255; 3];

/// The colours of classes on paper, those of the style for light pages.
const COLOURS: [(&str, Rgb); 10] = [
    ("h-blue", [0x24, 0x63, 0xb4]),
    ("h-orange", [0xcf, 0x6a, 0x0c]),
    ("h-green", [0x1d, 0x87, 0x58]),
    ("h-red", [0xc6, 0x37, 0x3c]),
    ("h-purple", [0x78, 0x50, 0xbf]),
    ("h-teal", [0x0e, 0x80, 0x94]),
    ("h-grey", [0x72, 0x7b, 0x8b]),
    ("grid", [0xe3, 0xe6, 0xec]),
    ("axis", [0x5b, 0x64, 0x75]),
    ("soft", [0x5b, 0x64, 0x75]),
];

/// Text without a class.
const INK: Rgb = [0x1b, 0x22, 0x30];

/// The drawing as an RGB PNG on white.
pub(super) fn png(svg: &Svg) -> Result<Vec<u8>, Error> {
    let [width, height] = svg.size.map(|side| (side * ZOOM).round() as usize);
    let mut canvas = Canvas::new(width, height)?;
    canvas.fill([0, 0], [width, height], PAPER);
    let mut sheet = Sheet { canvas, shift: [0.0; 2], window: None };
    svg.strokes.iter().for_each(|stroke| sheet.draw(stroke));
    sheet.canvas.png()
}

/// A canvas, and where on it is drawn.
struct Sheet {
    canvas: Canvas,
    /// How far everything is moved to the right and down, units.
    shift: [f64; 2],
    /// Outside of these corners nothing is drawn, pixels.
    window: Option<[[f64; 2]; 2]>,
}

/// How a stroke looks.
struct Look<'a>(&'a str);

impl Look<'_> {
    fn has(&self, class: &str) -> bool {
        self.0.split(' ').any(|word| word == class)
    }

    fn colour(&self) -> Rgb {
        let known = COLOURS.iter().find(|(class, _)| self.has(class));
        known.map_or(INK, |(_, colour)| *colour)
    }

    /// Width of a line, pixels.
    fn width(&self) -> f64 {
        let is_thin = ["thin", "grid", "axis"].iter().any(|class| self.has(class));
        if is_thin { ZOOM } else { 2.0 * ZOOM }
    }

    /// How much of what is behind is covered.
    fn share(&self) -> f64 {
        match () {
            () if self.has("band") => 0.16,
            () if self.has("faint") => 0.55,
            () => 1.0,
        }
    }
}

impl Sheet {
    /// Pixels of a place; never so far away that walking there takes long.
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x + self.shift[0], y + self.shift[1]]
            .map(|at| if at.is_nan() { 0.0 } else { at.clamp(-1e5, 1e5) * ZOOM })
    }

    fn draw(&mut self, stroke: &Stroke) {
        match stroke {
            Stroke::Line { from, to, class } => self.joined(&[*from, *to], &Look(class)),
            Stroke::Path { steps, class } => {
                let look = Look(class);
                for (points, is_closed) in lines(steps) {
                    match is_closed && (look.has("band") || look.has("area")) {
                        true => self.area(&points, &look),
                        false => self.joined(&points, &look),
                    }
                }
            }
            Stroke::Rect { corner, size, class } => {
                let [x, y] = *corner;
                let [right, bottom] = [x + size[0], y + size[1]];
                let outline = [[x, y], [right, y], [right, bottom], [x, bottom], [x, y]];
                match class.contains("outline") {
                    true => self.joined(&outline, &Look(class)),
                    false => self.area(&outline, &Look(class)),
                }
            }
            Stroke::Dot { centre, radius, class } => {
                let (look, radius) = (Look(class), radius * ZOOM);
                let is_hollow = look.has("outline");
                let [inner, rim] = match is_hollow {
                    true => [PAPER, look.colour()],
                    false => [look.colour(), PAPER],
                };
                let centre = self.place(*centre);
                self.disc([centre; 2], radius + 0.5 * ZOOM, (rim, 1.0));
                self.disc([centre; 2], radius - 0.5 * ZOOM, (inner, 1.0));
            }
            Stroke::Text { place, anchor, class, text } => {
                self.text(self.place(*place), *anchor, text, &Look(class));
            }
            Stroke::OpenWindow { corner: [x, y], size } => {
                self.window = Some([self.place([*x, *y]), self.place([x + size[0], y + size[1]])]);
            }
            Stroke::CloseWindow => self.window = None,
            Stroke::OpenGroup { shift } => self.shift = *shift,
            Stroke::CloseGroup => self.shift = [0.0; 2],
        }
    }

    /// Covers with `paint` all that lies within `radius` of the straight line between two points.
    fn disc(&mut self, [a, b]: [[f64; 2]; 2], radius: f64, (colour, share): (Rgb, f64)) {
        let along = [b[0] - a[0], b[1] - a[1]];
        let length2 = along[0] * along[0] + along[1] * along[1];
        let distance = |[x, y]: [f64; 2]| {
            let from = [x - a[0], y - a[1]];
            let part = (from[0] * along[0] + from[1] * along[1]) / length2.max(1e-12);
            let part = part.clamp(0.0, 1.0);
            (from[0] - part * along[0]).hypot(from[1] - part * along[1])
        };
        let reach = radius + 1.0;
        let low = [a[0].min(b[0]) - reach, a[1].min(b[1]) - reach];
        let high = [a[0].max(b[0]) + reach, a[1].max(b[1]) + reach];
        self.cover([low, high], colour, |point| {
            share * (radius + 0.5 - distance(point)).clamp(0.0, 1.0)
        });
    }

    /// Covers every pixel between two corners, within the window, with a share of a colour that
    /// depends on its middle.
    fn cover(&mut self, corners: [[f64; 2]; 2], colour: Rgb, share: impl Fn([f64; 2]) -> f64) {
        let size = [self.canvas.width as f64, self.canvas.height as f64];
        let [least, most] = self.window.unwrap_or([[0.0; 2], size]);
        let first = [0, 1].map(|side| corners[0][side].max(least[side]).max(0.0).floor() as usize);
        let end =
            [0, 1].map(|side| corners[1][side].min(most[side]).min(size[side]).ceil() as usize);
        for y in first[1]..end[1] {
            for x in first[0]..end[0] {
                let share = share([x as f64 + 0.5, y as f64 + 0.5]);
                self.canvas.blend(x, y, (colour, share));
            }
        }
    }

    /// A line through `points`.
    fn joined(&mut self, points: &[[f64; 2]], look: &Look) {
        let points: Vec<[f64; 2]> = points.iter().map(|point| self.place(*point)).collect();
        let mut walked = 0.0;
        for pair in points.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            let at = |way: f64| [0, 1].map(|side| a[side] + (b[side] - a[side]) * way / length);
            let paint = (look.colour(), look.share());
            if !look.has("dashed") || length == 0.0 {
                self.disc([a, b], look.width() / 2.0, paint);
            } else {
                let (dash, mut way) = (DASH * ZOOM, 0.0);
                while way < length {
                    let phase = (walked + way) % (2.0 * dash);
                    let next = if phase < dash { dash - phase } else { 2.0 * dash - phase };
                    let end = (way + next.max(1e-6)).min(length);
                    if phase < dash {
                        self.disc([at(way), at(end)], look.width() / 2.0, paint);
                    }
                    way = end;
                }
            }
            walked += length;
        }
    }

    /// What the line through `points` encloses.
    fn area(&mut self, points: &[[f64; 2]], look: &Look) {
        let points: Vec<[f64; 2]> = points.iter().map(|point| self.place(*point)).collect();
        let fold = |pick: fn(f64, f64) -> f64, start: f64| {
            points.iter().fold([start; 2], |ends, point| [0, 1].map(|i| pick(ends[i], point[i])))
        };
        let corners = [fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY)];
        let edges = || points.iter().zip(points.iter().cycle().skip(1));
        // Inside is where a ray to the right crosses the line an odd number of times.
        let crossed = |[x, y]: [f64; 2], (a, b): (&[f64; 2], &[f64; 2])| {
            (a[1] > y) != (b[1] > y) && x < a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1])
        };
        let is_inside = |point| edges().filter(|edge| crossed(point, *edge)).count() % 2 == 1;
        let share = look.share();
        self.cover(corners, look.colour(), |point| if is_inside(point) { share } else { 0.0 });
    }

    /// `text` with its baseline at `place`.
    fn text(&mut self, [x, y]: [f64; 2], anchor: Anchor, text: &str, look: &Look) {
        let (width, height) = (canvas::text_width(text, LETTER), 7 * LETTER);
        let left = match anchor {
            Anchor::Start => x,
            Anchor::Middle => x - width as f64 / 2.0,
            Anchor::End => x - width as f64,
        };
        let corner = [left.max(0.0) as usize, (y - height as f64).max(0.0) as usize];
        if look.has("guard") {
            let room = LETTER;
            let from = corner.map(|side| side.saturating_sub(room));
            self.canvas.fill(from, [width + 2 * room, height + 2 * room], PAPER);
        }
        let colour = match (look.has("on"), look.has("hued")) {
            (true, _) => PAPER,
            // The font has one weight; colour sets names apart.
            (_, true) => mix(look.colour(), INK, 0.15),
            _ => look.colour(),
        };
        self.canvas.text(corner, text, Pen { size: LETTER, colour, anchor: canvas::Anchor::Start });
    }
}

/// The lines of a path, and whether each is closed. A step that is none ends it.
fn lines(steps: &str) -> Vec<(Vec<[f64; 2]>, bool)> {
    let mut lines: Vec<(Vec<[f64; 2]>, bool)> = Vec::new();
    let mut rest = steps;
    while let Some(kind) = rest.chars().next() {
        let tail = &rest[kind.len_utf8()..];
        let end = tail.find(|letter: char| letter.is_ascii_alphabetic()).unwrap_or(tail.len());
        let numbers: Vec<f64> =
            tail[..end].split_whitespace().filter_map(|number| number.parse().ok()).collect();
        rest = &tail[end..];
        let here = lines.last().and_then(|(points, _)| points.last().copied());
        match (kind, numbers.as_slice(), here, lines.last_mut()) {
            ('M', [x, y], _, _) => lines.push((vec![[*x, *y]], false)),
            ('L', [x, y], _, Some((points, _))) => points.push([*x, *y]),
            ('H', [x], Some([_, y]), Some((points, _))) => points.push([*x, y]),
            ('V', [y], Some([x, _]), Some((points, _))) => points.push([x, *y]),
            ('Z', [], _, Some((points, is_closed))) => {
                points.extend(points.first().copied());
                *is_closed = true;
            }
            _ => break,
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(draw: impl Fn(&mut Svg)) -> Canvas {
        let mut svg = Svg::new([40.0, 40.0], "t");
        draw(&mut svg);
        let mut canvas = Canvas::new(80, 80).unwrap();
        canvas.fill([0, 0], [80, 80], PAPER);
        let mut sheet = Sheet { canvas, shift: [0.0; 2], window: None };
        svg.strokes.iter().for_each(|stroke| sheet.draw(stroke));
        sheet.canvas
    }

    const BLUE: Rgb = [0x24, 0x63, 0xb4];

    #[test]
    fn a_line_is_as_wide_as_it_should_be() {
        let canvas = drawn(|svg| svg.line([10.0, 20.0], [30.0, 20.0], "line h-blue"));
        let column: Vec<Rgb> = (36..44).map(|y| canvas.get(40, y)).collect();
        let wanted = [PAPER, PAPER, BLUE, BLUE, BLUE, BLUE, PAPER, PAPER];
        assert_eq!(column, wanted);
        assert_eq!(canvas.get(10, 40), PAPER);
        let dashed = drawn(|svg| svg.line([0.0, 20.0], [40.0, 20.0], "line dashed h-blue"));
        let along: Vec<bool> = [5, 15, 25, 35].map(|x| dashed.get(x, 40) == BLUE).to_vec();
        assert_eq!(along, [true, false, true, false]);
    }

    #[test]
    fn a_path_turns_corners_and_an_area_has_an_inside() {
        let steps = drawn(|svg| svg.path("M5 10H20V30", "line h-blue"));
        assert_eq!([steps.get(20, 20), steps.get(40, 50), steps.get(20, 50)], [BLUE, BLUE, PAPER]);
        let area = drawn(|svg| svg.path("M5 5L35 5L35 35L5 35Z", "band h-blue"));
        assert_eq!(area.get(40, 40), mix(PAPER, BLUE, 0.16));
        assert_eq!(area.get(75, 40), PAPER);
        let bar = drawn(|svg| svg.rect([10.0, 10.0], [5.0, 20.0], "area h-blue"));
        assert_eq!([bar.get(25, 40), bar.get(35, 40)], [BLUE, PAPER]);
        assert!(lines("M1 2L3").len() == 1 && lines("x").is_empty() && lines("L1 2").is_empty());
    }

    #[test]
    fn windows_cut_off_and_groups_move() {
        let canvas = drawn(|svg| {
            svg.open_window([0.0, 0.0], [20.0, 40.0]);
            svg.line([0.0, 10.0], [40.0, 10.0], "line h-blue");
            svg.close_window();
            let mut other = Svg::new([40.0, 20.0], "t");
            other.dot([20.0, 10.0], 4.0, "dot h-blue");
            svg.add([0.0, 20.0], other);
        });
        assert_eq!([canvas.get(30, 20), canvas.get(60, 20)], [BLUE, PAPER]);
        assert_eq!([canvas.get(40, 60), canvas.get(40, 20)], [BLUE, PAPER]);
    }

    #[test]
    fn a_text_ends_where_its_anchor_says() {
        for (anchor, inside, outside) in
            [(Anchor::Start, 41, 38), (Anchor::End, 38, 42), (Anchor::Middle, 36, 50)]
        {
            let canvas = drawn(|svg| svg.text([20.0, 20.0], anchor, "", "H"));
            let is_inked = |x: usize| (20..45).any(|y| canvas.get(x, y) != PAPER);
            assert!(is_inked(inside) && !is_inked(outside), "{anchor:?}");
        }
    }
}
