//! Drawings as pixels, for those who have no use for SVG: the same on every machine, whatever fonts
//! it has.

use std::sync::Arc;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::fontdb::{Database, Source};
use resvg::usvg::{Options, Tree};

use super::Error;
use super::canvas::Canvas;
use super::svg::{Ground, Svg, style_on};

/// Pixels to a unit of a chart.
const ZOOM: f64 = 2.0;

/// The letters of all pictures.
const FAMILY: &str = "Inter";
const REGULAR: &[u8] = include_bytes!("fonts/Inter-Regular.ttf");
const SEMIBOLD: &[u8] = include_bytes!("fonts/Inter-SemiBold.ttf");

/// A chart as an RGB PNG on white.
///
/// # Errors
/// [`Error::Size`] if it is empty or too large.
pub(super) fn png(svg: &Svg) -> Result<Vec<u8>, Error> {
    let [width, height] = svg.size.map(|side| (side * ZOOM).round() as usize);
    let mut canvas = Canvas::new(width, height)?;
    canvas.fill([0, 0], [width, height], [255; 3]);
    canvas.draw(svg, Ground::Light, ZOOM)?;
    canvas.png()
}

/// Draws over `pixels`, `zoom` of them to a unit, from the upper left corner.
///
/// # Errors
/// [`Error::Drawing`] if there are more than a million elements.
pub(super) fn draw(svg: &Svg, ground: Ground, zoom: f64, pixels: &mut Pixmap) -> Result<(), Error> {
    let turned = Transform::from_scale(zoom as f32, zoom as f32);
    resvg::render(&tree(svg, ground)?, turned, &mut pixels.as_mut());
    Ok(())
}

fn tree(svg: &Svg, ground: Ground) -> Result<Tree, Error> {
    let mut fonts = Database::new();
    fonts.load_font_source(Source::Binary(Arc::new(REGULAR)));
    fonts.load_font_source(Source::Binary(Arc::new(SEMIBOLD)));
    fonts.set_sans_serif_family(FAMILY);
    let options = Options {
        font_family: FAMILY.to_owned(),
        style_sheet: Some(style_on(ground)),
        fontdb: Arc::new(fonts),
        ..Options::default()
    };
    Ok(Tree::from_str(&svg.finish(), &options)?)
}

#[cfg(test)]
mod tests {
    use super::super::colour::{Rgb, mix};
    use super::super::svg::{Anchor, text_width};
    use super::*;

    const BLUE: Rgb = [0x24, 0x63, 0xb4];
    const PAPER: Rgb = [255; 3];

    fn drawn(draw: impl Fn(&mut Svg)) -> Canvas {
        let mut svg = Svg::new([40.0, 40.0], "t");
        draw(&mut svg);
        let mut canvas = Canvas::new(80, 80).unwrap();
        canvas.fill([0, 0], [80, 80], PAPER);
        canvas.draw(&svg, Ground::Light, ZOOM).unwrap();
        canvas
    }

    #[test]
    fn classes_have_their_colours_and_widths() {
        let canvas = drawn(|svg| svg.line([10.0, 20.0], [30.0, 20.0], "line h-blue"));
        let column: Vec<Rgb> = (36..44).map(|y| canvas.get(40, y)).collect();
        assert_eq!(column, [PAPER, PAPER, BLUE, BLUE, BLUE, BLUE, PAPER, PAPER]);
        let thin = drawn(|svg| svg.line([10.0, 20.0], [30.0, 20.0], "line thin h-blue"));
        assert_eq!([38, 39, 40, 41].map(|y| thin.get(40, y)), [PAPER, BLUE, BLUE, PAPER]);
        let bar = drawn(|svg| svg.rect([10.0, 10.0], [5.0, 20.0], "area h-blue"));
        assert_eq!([bar.get(25, 40), bar.get(35, 40)], [BLUE, PAPER]);
        let band = drawn(|svg| svg.path("M5 5L35 5L35 35L5 35Z", "band h-blue"));
        let (found, wanted) = (band.get(40, 40), mix(PAPER, BLUE, 0.16));
        assert!((0..3).all(|part| found[part].abs_diff(wanted[part]) <= 1), "{found:?}");
        assert_eq!(band.get(75, 40), PAPER);
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
            [(Anchor::Start, 43, 38), (Anchor::End, 37, 42), (Anchor::Middle, 34, 52)]
        {
            let canvas = drawn(|svg| svg.text([20.0, 20.0], anchor, "", "H"));
            let is_inked = |x: usize| (20..45).any(|y| canvas.get(x, y) != PAPER);
            assert!(is_inked(inside) && !is_inked(outside), "{anchor:?}");
        }
    }

    #[test]
    fn the_fonts_have_every_letter_in_use_in_both_weights() {
        let letters = (' '..='~').chain("°·×±²µ–…≥≤⁰¹³⁴⁵⁶⁷⁸⁹⁻−\u{202f}₀₁₂₃₄₅₆₇₈₉äéßσ".chars());
        let drawn = |class: &str, letter: char| {
            drawn(|svg| svg.text([10.0, 20.0], Anchor::Start, class, &letter.to_string()))
        };
        for class in ["", "bold"] {
            // A letter that is missing is drawn as an empty box.
            let lacking = drawn(class, 'Ж');
            for letter in letters.clone() {
                let drawn = drawn(class, letter);
                let differs =
                    (0..80).any(|x| (0..80).any(|y| drawn.get(x, y) != lacking.get(x, y)));
                assert!(differs, "{letter:?}");
            }
        }
    }

    #[test]
    fn texts_are_no_wider_than_charts_believe() {
        for text in [
            "0.00004",
            "5.5·10⁻⁵",
            "1 234 567",
            "detector.photon-counting.missed_marks",
            "kim-park-2016-fixed in wall, 8 seeds each",
            "extended prime 29",
            "WAITS, 64 BEAMS",
            "words return: 1022 m",
            "C₇",
            "right or near (within 0.35 m)",
        ] {
            for class in ["", "bold"] {
                let mut svg = Svg::new([999.0, 40.0], "t");
                svg.text([0.0, 20.0], Anchor::Start, class, text);
                let tree = tree(&svg, Ground::Light).unwrap();
                let width = f64::from(tree.root().abs_bounding_box().width());
                let believed = text_width(text);
                assert!(
                    (width..1.3 * width).contains(&believed),
                    "{text} {class} {width} {believed}"
                );
            }
        }
    }

    #[test]
    fn what_no_file_may_hold_does_no_harm() {
        drawn(|svg| svg.text([0.0, 9.0], Anchor::Start, "", "a\u{0}\u{fffe}<&>\"\u{1b}"));
    }
}
