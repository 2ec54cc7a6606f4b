//! A payload's bits, the marks they become, and one code word enlarged.

use super::svg::{Anchor, Hue, Svg, number};
use super::ticks::{label, linear_ticks};

/// The bits of a payload and the chips of its code word \[KP16 Fig. 4\].
#[derive(Debug, Clone, PartialEq)]
pub struct BitPicture<'a> {
    /// Description in words for those who cannot see the picture.
    pub title: String,
    /// Bits in the order in which they are sent, label first.
    pub bits: &'a [bool],
    /// How many bits at the end are the checksum.
    pub checksum_bits: usize,
    /// Name of the code word, for instance "C₇".
    pub word: String,
    /// Chips of the code word.
    pub word_length: u32,
    /// Chips of the code word that are lit.
    pub marks: &'a [u32],
    /// Width, px.
    pub width: f64,
}

const EDGE: f64 = 12.0;
const CELL_TOP: f64 = 30.0;
const CELL: f64 = 34.0;
const STRIP_TOP: f64 = CELL_TOP + CELL + 8.0;
const STRIP: f64 = 26.0;
const WORD_TOP: f64 = STRIP_TOP + STRIP + 62.0;
const WORD: f64 = 46.0;
const HEIGHT: f64 = WORD_TOP + WORD + 48.0;

impl BitPicture<'_> {
    /// The picture as SVG: bits, marks of the whole macropulse, marks of its first 1 bit.
    pub fn svg(&self) -> String {
        let mut svg = Svg::new([self.width, HEIGHT], &self.title);
        let cell = (self.width - 2.0 * EDGE) / self.bits.len().max(1) as f64;
        for (at, bit) in self.bits.iter().enumerate() {
            self.draw_bit(&mut svg, at, *bit, cell);
        }
        self.draw_brackets(&mut svg, cell);
        if let Some(first) = self.bits.iter().position(|bit| *bit) {
            let left = EDGE + first as f64 * cell;
            let [foot, head] = [STRIP_TOP + STRIP, WORD_TOP];
            let wedge =
                [[left, foot], [left + cell, foot], [self.width - EDGE, head], [EDGE, head]];
            let corners = wedge.map(|[x, y]| format!("{} {}", number(x), number(y))).join("L");
            svg.path(&format!("M{corners}Z"), "band h-blue");
            self.draw_word(&mut svg);
        }
        svg.finish()
    }

    fn hue(&self, at: usize) -> Hue {
        if at + self.checksum_bits < self.bits.len() { Hue::Blue } else { Hue::Orange }
    }

    fn draw_bit(&self, svg: &mut Svg, at: usize, bit: bool, cell: f64) {
        let left = EDGE + at as f64 * cell;
        let hue = self.hue(at).class();
        let kind = if bit { "area" } else { "outline" };
        svg.rect([left + 1.5, CELL_TOP], [cell - 3.0, CELL], &format!("{kind} {hue}"));
        let class = if bit { "on".to_owned() } else { format!("hued {hue}") };
        let place = [left + cell / 2.0, CELL_TOP + CELL / 2.0 + 4.5];
        svg.text(place, Anchor::Middle, &class, if bit { "1" } else { "0" });
        let base = STRIP_TOP + STRIP;
        svg.line([left + 1.5, base], [left + cell - 1.5, base], "axis");
        if bit {
            let marks = self.mark_path([left + 1.5, cell - 3.0], [STRIP_TOP + 4.0, base]);
            svg.path(&marks, &format!("line thin {hue}"));
        }
    }

    /// One stroke per mark of the code word, spread over `[left, width]`, from `[top, bottom]`.
    fn mark_path(&self, [left, width]: [f64; 2], [top, bottom]: [f64; 2]) -> String {
        let chip = width / f64::from(self.word_length.max(1));
        let stroke = |mark: &u32| {
            let x = number(left + (f64::from(*mark) + 0.5) * chip);
            format!("M{x} {}V{}", number(top), number(bottom))
        };
        self.marks.iter().map(stroke).collect()
    }

    fn draw_brackets(&self, svg: &mut Svg, cell: f64) {
        let label_bits = self.bits.len().saturating_sub(self.checksum_bits);
        let parts =
            [(0, label_bits, "label"), (label_bits, self.bits.len() - label_bits, "checksum")];
        for (from, bits, name) in parts.into_iter().filter(|(_, bits, _)| *bits > 0) {
            let left = EDGE + from as f64 * cell;
            let class = format!("hued bold {}", self.hue(from).class());
            let plural = if bits == 1 { "bit" } else { "bits" };
            let text = format!("{name}, {bits} {plural}");
            svg.text([left + 2.0, CELL_TOP - 10.0], Anchor::Start, &class, &text);
        }
    }

    fn draw_word(&self, svg: &mut Svg) {
        let width = self.width - 2.0 * EDGE;
        let [top, base] = [WORD_TOP + 8.0, WORD_TOP + WORD];
        let chip = width / f64::from(self.word_length.max(1));
        for tick in linear_ticks(0.0, f64::from(self.word_length), 9) {
            let x = EDGE + tick * chip;
            svg.line([x, base], [x, base + 5.0], "axis");
            svg.text([x.max(EDGE + 3.0), base + 18.0], Anchor::Middle, "soft", &label(tick, 1.0));
        }
        svg.line([EDGE, base], [self.width - EDGE, base], "axis");
        svg.path(&self.mark_path([EDGE, width], [top, base]), "line h-blue");
        let caption = format!(
            "code word {}: {} marks in {} chips",
            self.word,
            self.marks.len(),
            self.word_length
        );
        svg.text([EDGE, base + 40.0], Anchor::Start, "bold", &caption);
        svg.text([self.width - EDGE, base + 40.0], Anchor::End, "soft", "chip");
    }
}

#[cfg(test)]
mod tests {
    use super::super::svg::is_balanced;
    use super::*;

    fn picture(bits: &[bool], checksum_bits: usize) -> String {
        let marks = [0, 8, 16];
        let title = "bits".into();
        let word = "C₁".into();
        BitPicture {
            title,
            bits,
            checksum_bits,
            word,
            word_length: 25,
            marks: &marks,
            width: 600.0,
        }
        .svg()
    }

    #[test]
    fn a_one_has_its_marks_and_a_zero_has_none() {
        let svg = picture(&[true, false, true], 1);
        assert!(is_balanced(&svg));
        assert_eq!(svg.matches("line thin h-blue").count(), 1);
        assert_eq!(svg.matches("line thin h-orange").count(), 1);
        assert!(svg.contains("code word C₁: 3 marks in 25 chips"));
        assert!(svg.contains("checksum, 1 bit<"));
    }

    #[test]
    fn a_dark_payload_has_no_word_to_enlarge() {
        let svg = picture(&[false; 13], 3);
        assert!(is_balanced(&svg));
        assert!(!svg.contains("code word"));
    }

    #[test]
    fn nonsense_is_drawn_without_harm() {
        assert!(is_balanced(&picture(&[], 3)));
        assert!(is_balanced(&picture(&[true], 9)));
    }
}
