//! A rectangle of coloured pixels that takes rectangles and drawings.

use super::colour::{NIGHT, Rgb};
use super::svg::{Ground, Svg};
use super::{Error, raster};
use resvg::tiny_skia::Pixmap;

const LONGEST_SIDE: usize = 16_384;

/// A picture in the making. Everything outside it is cut off.
#[derive(Debug, Clone)]
pub(super) struct Canvas {
    pub width: usize,
    pub height: usize,
    /// Red, green, blue and 255.
    pixels: Pixmap,
}

impl Canvas {
    /// A dark canvas.
    pub fn new(width: usize, height: usize) -> Result<Self, Error> {
        let drawable = 1..=LONGEST_SIDE;
        if !drawable.contains(&width) || !drawable.contains(&height) {
            return Err(Error::Size { width, height });
        }
        let pixels = Pixmap::new(width as u32, height as u32);
        let pixels = pixels.ok_or(Error::Size { width, height })?;
        let mut canvas = Self { width, height, pixels };
        canvas.fill([0, 0], [width, height], NIGHT);
        Ok(canvas)
    }

    pub fn put(&mut self, x: usize, y: usize, colour: Rgb) {
        if x < self.width && y < self.height {
            let at = 4 * (y * self.width + x);
            let [red, green, blue] = colour;
            self.pixels.data_mut()[at..at + 4].copy_from_slice(&[red, green, blue, 255]);
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

    /// Draws over what is there, `zoom` pixels to a unit, from the upper left corner.
    pub fn draw(&mut self, svg: &Svg, ground: Ground, zoom: f64) -> Result<(), Error> {
        raster::draw(svg, ground, zoom, &mut self.pixels)
    }

    /// The canvas as an 8-bit RGB PNG.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Balanced);
        let mut writer = encoder.write_header()?;
        let colours = self.pixels.data().chunks_exact(4).flat_map(|pixel| &pixel[..3]);
        writer.write_image_data(&colours.copied().collect::<Vec<u8>>())?;
        writer.finish()?;
        Ok(bytes)
    }
}

#[cfg(test)]
impl Canvas {
    pub fn get(&self, x: usize, y: usize) -> Rgb {
        let at = 4 * (y * self.width + x);
        let pixel = &self.pixels.data()[at..at + 3];
        [pixel[0], pixel[1], pixel[2]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_falls_outside_is_cut_off() {
        let mut canvas = Canvas::new(8, 8).unwrap();
        let mut svg = Svg::new([8.0; 2], "t");
        svg.line([5.0, 5.0], [50.0, 5.0], "axis");
        canvas.draw(&svg, Ground::Dark, 1.0).unwrap();
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
