//! Charts one below the other.

use super::chart::Chart;
use super::svg::{Anchor, Svg, standalone};
use super::{Error, raster};

/// Room around the charts, units.
const MARGIN: f64 = 14.0;

/// Room for the title.
const HEAD: f64 = 34.0;

/// Charts one below the other, as a picture of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Stack {
    /// Title above the first chart.
    pub title: String,
    /// From the top down.
    pub charts: Vec<Chart>,
}

impl Stack {
    /// As SVG, with its style inside.
    pub fn svg(&self) -> String {
        standalone(&self.draw().finish())
    }

    /// As PNG on white, two pixels to a unit of the charts.
    ///
    /// # Errors
    /// [`Error::Size`] if there are too many charts.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        raster::png(&self.draw())
    }

    fn draw(&self) -> Svg {
        let width = self.charts.iter().map(|chart| chart.size[0]).fold(0.0, f64::max);
        let height: f64 = self.charts.iter().map(|chart| chart.size[1]).sum();
        let mut svg = Svg::new([width + 2.0 * MARGIN, HEAD + height + MARGIN], &self.title);
        svg.text([MARGIN, MARGIN + 10.0], Anchor::Start, "bold", &self.title);
        let mut top = HEAD;
        for chart in &self.charts {
            svg.add([MARGIN, top], chart.draw());
            top += chart.size[1];
        }
        svg
    }
}

#[cfg(test)]
mod tests {
    use super::super::chart::Axis;
    use super::super::svg::is_balanced;
    use super::*;

    #[test]
    fn a_stack_is_as_high_as_its_charts() {
        let chart = Chart::new("<a>", Axis::linear("x"), Axis::linear("y"));
        let stack = Stack { title: "all".to_owned(), charts: vec![chart.clone(), chart] };
        let svg = stack.svg();
        let (width, height) = (704.0 + 2.0 * MARGIN, HEAD + 720.0 + MARGIN);
        assert!(svg.contains(&format!("viewBox=\"0 0 {width} {height}\"")));
        assert!(svg.contains(&format!("translate({MARGIN} {})", HEAD + 360.0)));
        assert!(svg.contains(">all</text>"));
        assert!(is_balanced(&svg));
        let png = stack.png().unwrap();
        let size = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().unwrap());
        assert_eq!([size(16), size(20)], [width, height].map(|side| 2 * side as u32));
    }

    #[test]
    fn a_stack_too_high_is_no_picture() {
        let chart = Chart::new("", Axis::linear("x"), Axis::linear("y"));
        let stack = Stack { title: String::new(), charts: vec![chart; 30] };
        assert!(matches!(stack.png(), Err(Error::Size { .. })));
    }
}
