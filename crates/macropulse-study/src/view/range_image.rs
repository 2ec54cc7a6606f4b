//! Pictures on the pixel grid of a sensor: range, amplitude, outcome.

use super::Error;
use super::canvas::Canvas;
use super::colour::{INK, PALE, Rgb, grey, outcome_colour, place, range_colour};
use super::svg::{self, Anchor, Ground, Svg};
use super::ticks::{label, linear_ticks};
use macropulse::points::Outcome;
use std::ops::Range;

const MARGIN: usize = 16;
/// Pixels to a unit of the letters, which are 12 units high.
const LETTERS: f64 = 1.5;
/// Height of a capital letter, and a bit.
const LINE: usize = 14;
/// Width of a scale bar's line and of a tick.
const STROKE: usize = 2;
/// The key below the picture needs this much, however small the picture.
const NARROWEST: usize = 440;
const BAR_HEIGHT: usize = 10;

/// A part of the pixel grid. Anything outside the grid is left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Crop {
    /// Rows, from the top.
    pub rows: Range<usize>,
    /// Columns, from the left.
    pub columns: Range<usize>,
}

/// A length drawn below the picture, so that sizes can be read off.
#[derive(Debug, Clone, PartialEq)]
pub struct ScaleBar {
    /// Its text, for instance "1 m at 30 m".
    pub label: String,
    /// Its length in columns of the grid.
    pub columns: f64,
}

impl ScaleBar {
    /// The bar for `length` metres across the line of sight at `range` metres, on a grid whose
    /// columns are `pitch` radians apart: L / (R·pitch) columns.
    pub fn at_range(length: f64, range: f64, pitch: f64) -> Self {
        Self { label: format!("{length} m at {range} m"), columns: length / (range * pitch) }
    }
}

/// How a grid becomes a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Rows of the grid.
    pub rows: usize,
    /// Columns of the grid.
    pub columns: usize,
    /// The part to show; all of it if `None`.
    pub crop: Option<Crop>,
    /// Width and height of one grid pixel in the picture. They differ where the sensor's steps do.
    pub zoom: [usize; 2],
    /// A line above the picture; may be empty.
    pub title: String,
    /// A length below the picture; left out where it does not fit.
    pub scale_bar: Option<ScaleBar>,
}

impl Layout {
    /// The whole grid, one picture pixel each, no title, no bar.
    pub fn new(rows: usize, columns: usize) -> Self {
        Self { rows, columns, crop: None, zoom: [1, 1], title: String::new(), scale_bar: None }
    }

    /// Sets the zoom so that the part shown is at most about `width` pixels wide and angles are in
    /// proportion, as far as whole pixels allow. `pitch` are the angles between columns and rows.
    pub fn fit(mut self, pitch: [f64; 2], width: usize) -> Self {
        let wide = (width / self.shown().columns.len().max(1)).max(1);
        let high = (wide as f64 * pitch[1] / pitch[0]).round();
        // A float beyond the integers becomes the nearest one, NaN becomes 0.
        self.zoom = [wide, (high as usize).max(1)];
        self
    }

    fn shown(&self) -> Crop {
        let whole = Crop { rows: 0..self.rows, columns: 0..self.columns };
        let Some(crop) = &self.crop else { return whole };
        let within = |part: &Range<usize>, end: usize| part.start.min(end)..part.end.min(end);
        Crop { rows: within(&crop.rows, self.rows), columns: within(&crop.columns, self.columns) }
    }

    fn check(&self, found: usize) -> Result<(), Error> {
        let (rows, columns) = (self.rows, self.columns);
        if rows.checked_mul(columns) == Some(found) {
            Ok(())
        } else {
            Err(Error::Uneven { rows, columns, found })
        }
    }
}

/// A range image in colours, near warm and far cool.
#[derive(Debug, Clone, PartialEq)]
pub struct RangePicture<'a> {
    /// Grid and size.
    pub layout: Layout,
    /// Range in m, row-major; NaN where there is no return.
    pub range: &'a [f32],
    /// Range with the warm end of the colours, m.
    pub near: f32,
    /// Range with the cool end of the colours, m.
    pub far: f32,
}

impl RangePicture<'_> {
    /// The picture as PNG.
    ///
    /// # Errors
    /// [`Error::Uneven`] if there is not one range per pixel, [`Error::Size`] if nothing is left
    /// to draw or too much.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        self.layout.check(self.range.len())?;
        let key = Key::Bar { colour: range_colour, ends: [self.near, self.far], unit: " m" };
        let colour = |at: usize| range_colour(place(self.range[at], self.near, self.far));
        draw(&self.layout, colour, &key)
    }
}

/// An image of amplitudes or reflectances in grey.
#[derive(Debug, Clone, PartialEq)]
pub struct AmplitudePicture<'a> {
    /// Grid and size.
    pub layout: Layout,
    /// Amplitude, row-major; NaN where there is no return.
    pub amplitude: &'a [f32],
    /// Amplitude shown as white; 0 is the darkest grey.
    pub white: f32,
}

impl AmplitudePicture<'_> {
    /// The picture as PNG.
    ///
    /// # Errors
    /// As [`RangePicture::png`].
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        self.layout.check(self.amplitude.len())?;
        let key = Key::Bar { colour: grey, ends: [0.0, self.white], unit: "" };
        draw(&self.layout, |at| grey(place(self.amplitude[at], 0.0, self.white)), &key)
    }
}

/// How each pixel came out, with a legend that counts what is shown.
#[derive(Debug, Clone, PartialEq)]
pub struct OutcomePicture<'a> {
    /// Grid and size.
    pub layout: Layout,
    /// Outcome, row-major.
    pub outcome: &'a [Outcome],
}

impl OutcomePicture<'_> {
    /// The picture as PNG.
    ///
    /// # Errors
    /// As [`RangePicture::png`].
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        self.layout.check(self.outcome.len())?;
        let crop = self.layout.shown();
        let mut counts = [0_usize; Outcome::ALL.len()];
        for row in crop.rows {
            for column in crop.columns.clone() {
                counts[self.outcome[row * self.layout.columns + column] as usize] += 1;
            }
        }
        let entries = Outcome::ALL.into_iter().filter(|outcome| *outcome != Outcome::Empty);
        let legend = entries
            .map(|outcome| {
                let text = format!("{} {}", outcome.name(), counts[outcome as usize]);
                (outcome_colour(outcome), text)
            })
            .collect();
        draw(&self.layout, |at| outcome_colour(self.outcome[at]), &Key::Legend(legend))
    }
}

/// Explanation of the colours.
pub(super) enum Key {
    Bar { colour: fn(f64) -> Rgb, ends: [f32; 2], unit: &'static str },
    Legend(Vec<(Rgb, String)>),
}

/// Draws title, pixels, key and scale bar; `colour` gives the colour of a grid pixel.
pub(super) fn draw(
    layout: &Layout,
    colour: impl Fn(usize) -> Rgb,
    key: &Key,
) -> Result<Vec<u8>, Error> {
    let crop = layout.shown();
    let [zoom_x, zoom_y] = layout.zoom;
    let width = crop.columns.len().saturating_mul(zoom_x);
    let height = crop.rows.len().saturating_mul(zoom_y);
    if width == 0 || height == 0 {
        return Err(Error::Size { width, height });
    }
    let inner = width.max(NARROWEST).max(text_width(&layout.title));
    let top = if layout.title.is_empty() { MARGIN } else { 2 * MARGIN + LINE - 4 };
    let key_top = top.saturating_add(height).saturating_add(12);
    let total = key_top.saturating_add(key_height(layout, key, inner) + MARGIN);
    let mut sheet = Sheet::new(inner.saturating_add(2 * MARGIN), total)?;
    sheet.write([MARGIN, MARGIN], Anchor::Start, &layout.title);
    for (y, row) in crop.rows.clone().enumerate() {
        for (x, column) in crop.columns.clone().enumerate() {
            let corner = [MARGIN + x * zoom_x, top + y * zoom_y];
            sheet.canvas.fill(corner, layout.zoom, colour(row * layout.columns + column));
        }
    }
    let bar_room = scale_bar(&mut sheet, layout, key_top, width);
    match key {
        Key::Bar { .. } => colour_bar(&mut sheet, key, key_top, inner.saturating_sub(bar_room)),
        Key::Legend(entries) => {
            let under_bar = if bar_room > 0 { BAR_HEIGHT + LINE + 16 } else { 0 };
            legend(&mut sheet, entries, key_top + under_bar, inner);
        }
    }
    sheet.png()
}

/// A canvas and what is yet to be written on it.
struct Sheet {
    canvas: Canvas,
    letters: Svg,
}

impl Sheet {
    fn new(width: usize, height: usize) -> Result<Self, Error> {
        let size = [width, height].map(|side| side as f64 / LETTERS);
        Ok(Self { canvas: Canvas::new(width, height)?, letters: Svg::new(size, "") })
    }

    /// Writes `text` with the top of its capitals at `place[1]`.
    fn write(&mut self, [x, top]: [usize; 2], anchor: Anchor, text: &str) {
        let baseline = top as f64 + LINE as f64 - 0.5;
        self.letters.text([x as f64 / LETTERS, baseline / LETTERS], anchor, "", text);
    }

    fn png(mut self) -> Result<Vec<u8>, Error> {
        self.canvas.draw(&self.letters, Ground::Dark, LETTERS)?;
        self.canvas.png()
    }
}

/// Width of a text in pixels, rather too much than too little.
fn text_width(text: &str) -> usize {
    (svg::text_width(text) * LETTERS).ceil() as usize
}

fn key_height(layout: &Layout, key: &Key, inner: usize) -> usize {
    let bar = BAR_HEIGHT + LINE + 10;
    match key {
        Key::Bar { .. } => bar,
        Key::Legend(entries) => {
            let bar = if layout.scale_bar.is_some() { bar + 6 } else { 0 };
            bar + legend_places(entries, inner).last().map_or(0, |place| place[1] + LINE)
        }
    }
}

/// Bar of colours with round numbers under it, from the left margin, at most `room` wide.
fn colour_bar(sheet: &mut Sheet, key: &Key, top: usize, room: usize) {
    let Key::Bar { colour, ends, unit } = key else { return };
    let width = room.min(420);
    // Room for half of the outermost labels.
    let [left, length] = [MARGIN + 2, width.saturating_sub(28).max(1)];
    for x in 0..length {
        sheet.canvas.fill([left + x, top], [1, BAR_HEIGHT], colour(x as f64 / length as f64));
    }
    let [near, far] = ends.map(f64::from);
    let ticks = linear_ticks(near.min(far), near.max(far), (length / 72).max(2));
    let step = ticks.get(1).zip(ticks.first()).map_or(1.0, |(b, a)| b - a);
    for (at, tick) in ticks.iter().enumerate() {
        let x =
            left + (place(*tick as f32, ends[0], ends[1]) * (length - 1) as f64).round() as usize;
        sheet.canvas.fill([x, top + BAR_HEIGHT], [STROKE, 4], PALE);
        let last = at + 1 == ticks.len();
        let digits = label(*tick, step);
        // The unit hangs over: the digits alone stay centred under their tick.
        let half = text_width(&digits) / 2;
        let middle = x.max(MARGIN + half);
        let foot = top + BAR_HEIGHT + 8;
        sheet.write([middle, foot], Anchor::Middle, &digits);
        if last {
            sheet.write([middle + half + 5, foot], Anchor::Start, unit.trim());
        }
    }
}

/// Draws the scale bar at the right edge of the picture and gives the width it takes.
fn scale_bar(sheet: &mut Sheet, layout: &Layout, top: usize, width: usize) -> usize {
    let Some(bar) = &layout.scale_bar else { return 0 };
    let length = (bar.columns * layout.zoom[0] as f64).round();
    if !(1.0..=width as f64).contains(&length) {
        return 0;
    }
    let right = sheet.canvas.width - MARGIN;
    let length = length as usize;
    let text = text_width(&bar.label);
    let taken = text.max(length) + 2 * MARGIN;
    if taken + NARROWEST / 3 > right {
        return 0;
    }
    let [left, centre] = match text.saturating_sub(length) {
        0 => [right - length, right - length / 2],
        over => [right - length - over / 2, right - text / 2],
    };
    let middle = top + BAR_HEIGHT / 2 - 1;
    sheet.canvas.fill([left, middle], [length, STROKE], INK);
    for end in [left, left + length.saturating_sub(STROKE)] {
        sheet.canvas.fill([end, top], [STROKE, BAR_HEIGHT], INK);
    }
    sheet.write([centre, top + BAR_HEIGHT + 8], Anchor::Middle, &bar.label);
    taken
}

/// Places of the legend's entries, relative to its corner; a new line where the width is used up.
fn legend_places(entries: &[(Rgb, String)], inner: usize) -> Vec<[usize; 2]> {
    let mut places = Vec::new();
    let [mut x, mut y] = [0, 0];
    for (_, text) in entries {
        let width = LINE + 8 + text_width(text);
        if x > 0 && x + width > inner {
            [x, y] = [0, y + LINE + 8];
        }
        places.push([x, y]);
        x += width + 20;
    }
    places
}

fn legend(sheet: &mut Sheet, entries: &[(Rgb, String)], top: usize, inner: usize) {
    for ([x, y], (colour, text)) in legend_places(entries, inner).into_iter().zip(entries) {
        let [left, top] = [MARGIN + x, top + y];
        sheet.canvas.fill([left, top], [LINE, LINE], *colour);
        sheet.write([left + LINE + 8, top], Anchor::Start, text);
    }
}

#[cfg(test)]
mod tests {
    use super::super::colour::NOTHING;
    use super::*;

    /// Width, height and pixels of a PNG.
    fn decoded(bytes: &[u8]) -> (usize, usize, Vec<Rgb>) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let shape = reader.next_frame(&mut pixels).unwrap();
        let pixels = pixels.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        (shape.width as usize, shape.height as usize, pixels)
    }

    #[test]
    fn a_pixel_is_as_large_as_its_zoom_and_has_its_colour() {
        let range = [10.0, 20.0, f32::NAN, 30.0];
        let layout = Layout { zoom: [3, 5], ..Layout::new(2, 2) };
        let picture = RangePicture { layout, range: &range, near: 10.0, far: 30.0 };
        let (width, _, pixels) = decoded(&picture.png().unwrap());
        let at = |x: usize, y: usize| pixels[(MARGIN + y) * width + MARGIN + x];
        assert_eq!([at(0, 0), at(2, 4)], [range_colour(0.0); 2]);
        assert_eq!(at(3, 0), range_colour(0.5));
        assert_eq!(at(0, 5), NOTHING);
        assert_eq!(at(5, 9), range_colour(1.0));
    }

    #[test]
    fn a_crop_shows_its_part_only() {
        let range: Vec<f32> = (0..100).map(|at| at as f32).collect();
        let crop = Crop { rows: 4..6, columns: 7..99 };
        let layout = Layout { crop: Some(crop), ..Layout::new(10, 10) };
        let picture = RangePicture { layout, range: &range, near: 0.0, far: 100.0 };
        let (width, _, pixels) = decoded(&picture.png().unwrap());
        assert_eq!(pixels[MARGIN * width + MARGIN], range_colour(0.47));
        assert_eq!(pixels[(MARGIN + 1) * width + MARGIN + 2], range_colour(0.59));
    }

    #[test]
    fn the_scale_bar_has_its_length() {
        let bar = ScaleBar::at_range(1.0, 30.0, 0.001);
        assert_eq!(bar.label, "1 m at 30 m");
        approx::assert_relative_eq!(bar.columns, 33.333, max_relative = 1e-4);
        let range = vec![f32::NAN; 500];
        let layout = Layout { scale_bar: Some(bar), zoom: [3, 3], ..Layout::new(1, 500) };
        let picture = RangePicture { layout, range: &range, near: 0.0, far: 1.0 };
        let (width, _, pixels) = decoded(&picture.png().unwrap());
        let row = MARGIN + 3 + 12 + BAR_HEIGHT / 2;
        let right_half = &pixels[row * width + width / 2..(row + 1) * width];
        assert_eq!(right_half.iter().filter(|pixel| **pixel == INK).count(), 100);
    }

    #[test]
    fn a_scale_bar_without_room_is_left_out() {
        for bar in [("x".repeat(99), 5.0), ("1 m".into(), 9e9), ("1 m".into(), f64::NAN)] {
            let scale_bar = Some(ScaleBar { label: bar.0, columns: bar.1 });
            let plain = Layout::new(1, 500);
            let with_bar = Layout { scale_bar, ..plain.clone() };
            let png =
                |layout| RangePicture { layout, range: &[1.0; 500], near: 0.0, far: 1.0 }.png();
            assert_eq!(png(with_bar).unwrap(), png(plain).unwrap());
        }
    }

    #[test]
    fn angles_stay_in_proportion() {
        let hdl = Layout::new(64, 540).fit([0.08, 0.33], 1100);
        assert_eq!(hdl.zoom, [2, 8]);
        assert_eq!(Layout::new(9, 4000).fit([1.0, f64::NAN], 960).zoom, [1, 1]);
    }

    #[test]
    fn wrong_lengths_and_empty_crops_are_refused() {
        let short = RangePicture { layout: Layout::new(2, 2), range: &[1.0], near: 0.0, far: 1.0 };
        assert!(matches!(short.png(), Err(Error::Uneven { found: 1, .. })));
        let crop = Some(Crop { rows: 5..9, columns: 0..1 });
        let layout = Layout { crop, ..Layout::new(1, 1) };
        let nothing = OutcomePicture { layout, outcome: &[Outcome::Right] };
        assert!(matches!(nothing.png(), Err(Error::Size { .. })));
    }

    #[test]
    fn amplitude_and_outcome_have_their_own_colours() {
        let layout = Layout::new(1, 2);
        let grey_one =
            AmplitudePicture { layout: layout.clone(), amplitude: &[1.0, 0.0], white: 1.0 };
        let (width, _, pixels) = decoded(&grey_one.png().unwrap());
        assert_eq!(pixels[MARGIN * width + MARGIN], [255; 3]);
        let outcome = [Outcome::Wrong, Outcome::Empty];
        let picture = OutcomePicture { layout, outcome: &outcome };
        let (width, _, pixels) = decoded(&picture.png().unwrap());
        assert_eq!(pixels[MARGIN * width + MARGIN], outcome_colour(Outcome::Wrong));
        assert_eq!(pixels[MARGIN * width + MARGIN + 1], NOTHING);
    }
}
