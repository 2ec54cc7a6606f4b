//! A rectangle of coloured pixels that takes rectangles and text.

use super::Error;
use super::colour::{NIGHT, Rgb, mix};
use super::font::{ADVANCE, glyph};

const LONGEST_SIDE: usize = 16_384;

/// Where a text stands against its x.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
}

/// A picture in the making. What falls outside is cut off.
#[derive(Debug, Clone)]
pub(super) struct Canvas {
    pub width: usize,
    pub height: usize,
    pixels: Vec<u8>,
}

impl Canvas {
    /// A dark canvas.
    pub fn new(width: usize, height: usize) -> Result<Self, Error> {
        let drawable = 1..=LONGEST_SIDE;
        if !drawable.contains(&width) || !drawable.contains(&height) {
            return Err(Error::Size { width, height });
        }
        Ok(Self { width, height, pixels: NIGHT.repeat(width * height) })
    }

    pub fn put(&mut self, x: usize, y: usize, colour: Rgb) {
        if x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            self.pixels[at..at + 3].copy_from_slice(&colour);
        }
    }

    pub fn get(&self, x: usize, y: usize) -> Rgb {
        let at = 3 * (y * self.width + x);
        [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]]
    }

    /// Covers a pixel with `share` of a colour.
    pub fn blend(&mut self, x: usize, y: usize, (colour, share): (Rgb, f64)) {
        if x < self.width && y < self.height && share > 0.0 {
            self.put(x, y, mix(self.get(x, y), colour, share));
        }
    }

    /// Fills the rectangle with its corner at `corner`, `size` wide and high.
    pub fn fill(&mut self, corner: [usize; 2], size: [usize; 2], colour: Rgb) {
        let [x, y] = corner;
        for row in y..y.saturating_add(size[1]).min(self.height) {
            for column in x..x.saturating_add(size[0]).min(self.width) {
                self.put(column, row, colour);
            }
        }
    }

    /// Draws `text` with its top at `place[1]` and gives its width. Letters have 5 × 7 dots of
    /// `size` pixels each, and tails below.
    pub fn text(&mut self, place: [usize; 2], text: &str, pen: Pen) -> usize {
        let width = text_width(text, pen.size);
        let mut x = match pen.anchor {
            Anchor::Start => place[0],
            Anchor::Middle => place[0].saturating_sub(width / 2),
        };
        for letter in text.chars() {
            for (row, dots) in glyph(letter).iter().enumerate() {
                for column in (0..5).filter(|column| dots >> (4 - column) & 1 == 1) {
                    let corner = [x + column * pen.size, place[1] + row * pen.size];
                    self.fill(corner, [pen.size; 2], pen.colour);
                }
            }
            x += ADVANCE * pen.size;
        }
        width
    }

    /// The canvas as an 8-bit RGB PNG.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Balanced);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// How a text is written.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pen {
    /// Pixels per dot.
    pub size: usize,
    pub colour: Rgb,
    pub anchor: Anchor,
}

/// Width of a text in pixels, without the gap after its last letter.
pub(super) fn text_width(text: &str, size: usize) -> usize {
    (text.chars().count() * ADVANCE).saturating_sub(1) * size
}

#[cfg(test)]
mod tests {
    use super::*;

    const PEN: Pen = Pen { size: 2, colour: [255; 3], anchor: Anchor::Start };

    #[test]
    fn a_text_covers_what_it_says_it_covers() {
        let mut canvas = Canvas::new(60, 20).unwrap();
        let width = canvas.text([3, 2], "HH", PEN);
        assert_eq!(width, 2 * (6 + 5));
        assert_eq!(canvas.get(3, 2), PEN.colour);
        assert_eq!(canvas.get(3 + width - 1, 15), PEN.colour);
        assert_eq!(canvas.get(3 + width, 15), NIGHT);
        assert_eq!(canvas.get(3, 16), NIGHT);
    }

    #[test]
    fn what_falls_outside_is_cut_off() {
        let mut canvas = Canvas::new(8, 8).unwrap();
        canvas.text([5, 5], "WWWW", PEN);
        canvas.fill([7, 7], [usize::MAX, 9], [1, 2, 3]);
        assert_eq!(canvas.get(7, 7), [1, 2, 3]);
    }

    #[test]
    fn a_canvas_of_nothing_is_refused() {
        for (width, height) in [(0, 4), (4, 0), (LONGEST_SIDE + 1, 1)] {
            assert!(matches!(Canvas::new(width, height), Err(Error::Size { .. })));
        }
    }
}
