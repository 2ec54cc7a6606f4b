//! A square of numbers as a picture.

use super::Error;
use super::colour::{Rgb, range_colour};
use super::range_image::{Key, Layout, draw};

/// Width and height that small squares are enlarged to, px.
const WANTED: usize = 560;

/// How alike things are, each with each: a square of coloured cells.
#[derive(Debug, Clone, PartialEq)]
pub struct MatrixPicture<'a> {
    /// A line above the picture.
    pub title: String,
    /// Cells of a side.
    pub side: usize,
    /// Values row by row.
    pub values: &'a [u16],
}

impl MatrixPicture<'_> {
    /// The picture as an 8-bit RGB PNG: the highest value warm, 0 cool, with a key.
    ///
    /// # Errors
    /// If there is no cell, or not one value for each.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        if self.values.len() != self.side * self.side {
            let (side, found) = (self.side, self.values.len());
            return Err(Error::Uneven { rows: side, columns: side, found });
        }
        let highest = self.values.iter().copied().max().unwrap_or(0).max(1);
        let layout = Layout {
            zoom: [(WANTED / self.side.max(1)).max(1); 2],
            title: self.title.clone(),
            ..Layout::new(self.side, self.side)
        };
        let colour = |at: usize| heat(f64::from(self.values[at]) / f64::from(highest));
        draw(&layout, colour, &Key::Bar { colour: heat, ends: [0.0, highest.into()], unit: "" })
    }
}

/// Colour of a place on a scale from 0, cool, to 1, warm.
fn heat(place: f64) -> Rgb {
    range_colour(1.0 - place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_is_drawn_and_anything_else_refused() {
        let picture = |side, values| MatrixPicture { title: "t".into(), side, values };
        let png = picture(2, &[7, 1, 1, 7]).png().unwrap();
        assert!(png.starts_with(b"\x89PNG"));
        assert_eq!(png, picture(2, &[7, 1, 1, 7]).png().unwrap());
        assert!(matches!(picture(2, &[7, 1, 1]).png(), Err(Error::Uneven { found: 3, .. })));
        assert!(matches!(picture(0, &[]).png(), Err(Error::Size { .. })));
        assert!(picture(1, &[0]).png().is_ok());
    }

    #[test]
    fn the_highest_is_warm() {
        assert!(heat(1.0)[0] > heat(0.0)[0]);
    }
}
