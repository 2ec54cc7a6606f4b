//! The codebook: the marks of every macropulse a sensor can send.

use std::collections::HashMap;

use super::correlation::aperiodic;
use super::{CodeWord, Error, Family, Payload};

/// Most marks a codebook may hold: half a gigabyte of them.
pub(super) const MOST_MARKS: u64 = 1 << 28;

/// Signal of a 0 bit; a 1 bit is the code word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Keying {
    /// Darkness (NRZ-OOK, \[KP16 §2.2\]).
    #[default]
    OnOff,
    /// The complement of the code word: sequence-inversion keying. It suits words with about half of their
    /// chips lit.
    Inversion,
}

/// A family's words times a payload's labels: one template of marks for each pair.
///
/// Bit b of the payload, counted from the one sent first, takes the chips b·length … (b+1)·length − 1 of the
/// macropulse. A 1 bit is the code word, and the [`Keying`] defines a 0 bit. Both ends of the link own the
/// same codebook.
#[derive(Debug, Clone, PartialEq)]
pub struct Codebook {
    family: Family,
    payload: Option<Payload>,
    keying: Keying,
    labels: u32,
    words: Vec<CodeWord>,
    /// Templates one behind the other: all words of label 0, all words of label 1, …
    marks: Vec<u16>,
    /// Index in `marks` where each template begins, and where the last one ends.
    starts: Vec<u32>,
    /// The highest sidelobe of each template.
    sidelobes: Vec<u16>,
    /// First chip of each 1 bit: those of label 0, those of label 1, …
    lit: Vec<u32>,
    /// Index in `lit` where each label begins, and where the last one ends.
    lit_starts: Vec<u32>,
}

impl Codebook {
    /// The macropulses of labels 0 to `labels` − 1 in every word of `family`. Without a payload
    /// a macropulse is one bare code word, and there is one label, 0.
    ///
    /// # Errors
    /// If the payload cannot carry that many labels, or none is asked for. If a macropulse is longer than
    /// 65535 chips, or all templates together have more than 2²⁸ marks.
    pub fn new(
        family: Family,
        payload: Option<Payload>,
        labels: u32,
        keying: Keying,
    ) -> Result<Self, Error> {
        let possible = payload.map_or(1, |payload| payload.possible_labels());
        if !(1..=possible).contains(&labels) {
            return Err(Error::Labels { labels, possible });
        }
        let (bits, length) = (payload.map_or(1, |payload| payload.bits()), family.length());
        let chips = bits * length;
        if chips > u32::from(u16::MAX) {
            return Err(Error::MacropulseTooLong { bits, length, chips });
        }
        let lit_bits = |label: u32| -> Vec<u32> {
            payload.map_or(vec![0], |payload| payload.lit_bits(label as u16).collect())
        };
        let lit_in_all: u64 = (0..labels).map(|label| lit_bits(label).len() as u64).sum();
        let dark_in_all = match keying {
            Keying::OnOff => 0,
            Keying::Inversion => u64::from(bits) * u64::from(labels) - lit_in_all,
        };
        let words = family.words();
        let in_words = words.iter().map(|word| word.weight() as u64).sum::<u64>();
        let in_complements = words.len() as u64 * u64::from(length) - in_words;
        let total = lit_in_all * in_words + dark_in_all * in_complements;
        if total > MOST_MARKS {
            let (words, possible) = (words.len(), MOST_MARKS);
            return Err(Error::CodebookTooLarge { labels, words, marks: total, possible });
        }

        let mut marks = Vec::with_capacity(total as usize);
        let mut starts = vec![0];
        let mut sidelobes = Vec::new();
        let (mut all_lit, mut lit_starts) = (Vec::new(), vec![0]);
        let mut shapes: Vec<Shapes> = words.iter().map(|word| Shapes::of(word, keying)).collect();
        for label in 0..labels {
            let lit = lit_bits(label);
            let is_lit: Vec<bool> = (0..bits).map(|bit| lit.contains(&bit)).collect();
            let counts = BitCounts::of(&is_lit);
            all_lit.extend(lit.iter().map(|bit| bit * length));
            lit_starts.push(all_lit.len() as u32);
            for shapes in &mut shapes {
                sidelobes.push(shapes.highest_sidelobe(counts));
                for (bit, &is_lit) in (0..).zip(&is_lit) {
                    let first = (bit * length) as u16;
                    marks.extend(shapes.of_bit(is_lit).map(|mark| first + mark));
                }
                starts.push(marks.len() as u32);
            }
        }
        let lit = all_lit;
        Ok(Self {
            family,
            payload,
            keying,
            labels,
            words,
            marks,
            starts,
            sidelobes,
            lit,
            lit_starts,
        })
    }

    /// The codebook of a sensor that is not coded: a macropulse is one lit chip.
    pub fn single() -> Self {
        Self {
            family: Family::Single,
            payload: None,
            keying: Keying::OnOff,
            labels: 1,
            words: Family::Single.words(),
            marks: vec![0],
            starts: vec![0, 1],
            sidelobes: vec![0],
            lit: vec![0],
            lit_starts: vec![0, 1],
        }
    }

    /// The lit chips of the macropulse that carries `label` in `word`, ascending, counted from
    /// its first chip.
    ///
    /// # Panics
    /// Like a slice, where `label` or `word` is not in the book.
    pub fn marks(&self, label: u16, word: u16) -> &[u16] {
        let of_label = &self.starts[usize::from(label) * self.words.len()..][..=self.words.len()];
        let word = usize::from(word);
        &self.marks[of_label[word] as usize..of_label[word + 1] as usize]
    }

    /// The first chip of each 1 bit of `label`, ascending: where its code words begin.
    ///
    /// # Panics
    /// Like a slice, where `label` is not in the book.
    pub fn lit_bits(&self, label: u16) -> &[u32] {
        let label = usize::from(label);
        &self.lit[self.lit_starts[label] as usize..self.lit_starts[label + 1] as usize]
    }

    /// Returns the largest number of its own marks that the macropulse of `label` in `word` meets, shifted by
    /// less than a code word. That peak is the nearest to the right one in height and in time.
    ///
    /// # Panics
    /// Like a slice, where `label` or `word` is not in the book.
    pub fn sidelobe(&self, label: u16, word: u16) -> u16 {
        self.sidelobes[usize::from(label) * self.words.len() + usize::from(word)]
    }

    /// Chips of a macropulse, at most 65535.
    pub fn chips(&self) -> u32 {
        self.payload.map_or(1, |payload| payload.bits()) * self.family.length()
    }

    /// The code word with index `w`.
    ///
    /// # Panics
    /// Like a slice, where `w` is not in the book.
    pub fn word(&self, w: u16) -> &CodeWord {
        &self.words[usize::from(w)]
    }

    /// Number of code words.
    pub fn words(&self) -> usize {
        self.words.len()
    }

    /// Number of labels.
    pub fn labels(&self) -> u32 {
        self.labels
    }

    /// How labels are written; `None` where a macropulse is one bare code word.
    pub fn payload(&self) -> Option<&Payload> {
        self.payload.as_ref()
    }

    /// Returns true if a 0 bit sends light, too: the complement of the code word.
    pub fn zeros_are_lit(&self) -> bool {
        self.keying == Keying::Inversion
    }

    /// The family of the code words.
    pub fn family(&self) -> &Family {
        &self.family
    }

    /// Fewest and most marks of a macropulse, label by label: they differ where the words of the
    /// family have different weights.
    pub fn weights(&self) -> impl Iterator<Item = (usize, usize)> {
        let of_label = |starts: &[u32]| {
            let weights = starts.windows(2).map(|ends| (ends[1] - ends[0]) as usize);
            weights.fold((usize::MAX, 0), |(fewest, most), w| (fewest.min(w), most.max(w)))
        };
        let words = self.words.len();
        (0..self.labels as usize)
            .map(move |label| of_label(&self.starts[label * words..][..=words]))
    }

    /// Marks of the macropulse that has the fewest.
    pub fn min_weight(&self) -> usize {
        self.weights().map(|(fewest, _)| fewest).min().unwrap_or(0)
    }

    /// Mean marks of a macropulse, all labels being sent equally often.
    pub fn mean_weight(&self) -> f64 {
        self.marks.len() as f64 / (self.starts.len() - 1) as f64
    }

    /// Marks of the macropulse that has the most.
    pub fn max_weight(&self) -> usize {
        self.weights().map(|(_, most)| most).max().unwrap_or(0)
    }

    /// Marks of the code word that has the fewest.
    pub fn lightest_word(&self) -> usize {
        self.words.iter().map(CodeWord::weight).min().unwrap_or(0)
    }
}

/// Shapes of the bits of a macropulse in one code word.
struct Shapes {
    /// A 0 bit and a 1 bit; `None` where it is dark.
    bits: [Option<CodeWord>; 2],
    /// Marks that each bit shares with itself at each positive lag, if it is not dark.
    alone: [Vec<u16>; 2],
    /// Marks that each bit shares at each positive lag with each bit that follows it.
    follower: [[Vec<u16>; 2]; 2],
    /// The highest sidelobes of macropulses so far.
    highest: HashMap<BitCounts, u16>,
}

/// The counts of bits that the sidelobes of a macropulse follow from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct BitCounts {
    /// Bits, by value.
    alone: [u16; 2],
    /// Bits that follow each other, by both values.
    pairs: [[u16; 2]; 2],
}

impl BitCounts {
    fn of(is_lit: &[bool]) -> Self {
        let mut counts = Self { alone: [0; 2], pairs: [[0; 2]; 2] };
        is_lit.iter().for_each(|&bit| counts.alone[usize::from(bit)] += 1);
        is_lit.windows(2).for_each(|pair| {
            counts.pairs[usize::from(pair[0])][usize::from(pair[1])] += 1;
        });
        counts
    }
}

impl Shapes {
    fn of(word: &CodeWord, keying: Keying) -> Self {
        let zero = match keying {
            Keying::OnOff => None,
            Keying::Inversion => Some(word.complement()),
        };
        let bits = [zero, Some(word.clone())];
        let length = word.length as i32;
        let shared = |one: &Option<CodeWord>, other: &Option<CodeWord>, apart: i32| {
            let (Some(one), Some(other)) = (one, other) else { return Vec::new() };
            let both = aperiodic(one, other);
            (1..length).map(|lag| both.at(lag - apart)).collect()
        };
        let alone = [0, 1].map(|bit| shared(&bits[bit], &bits[bit], 0));
        let follower =
            [0, 1].map(|one| [0, 1].map(|other| shared(&bits[one], &bits[other], length)));
        Self { bits, alone, follower, highest: HashMap::new() }
    }

    /// The marks of a bit, from its first chip on.
    fn of_bit(&self, is_lit: bool) -> impl Iterator<Item = u16> {
        self.bits[usize::from(is_lit)].iter().flat_map(|word| word.marks.iter().copied())
    }

    /// The highest sidelobe of a macropulse with these bits, shifted by less than a code word.
    fn highest_sidelobe(&mut self, counts: BitCounts) -> u16 {
        let Self { alone, follower, highest, .. } = self;
        *highest.entry(counts).or_insert_with(|| {
            let lobes = alone.iter().zip(counts.alone);
            let pairs = counts.pairs.into_iter().flatten();
            let lobes = lobes.chain(follower.iter().flatten().zip(pairs));
            let mut sums = Vec::new();
            for (shared, count) in lobes.filter(|(shared, count)| !shared.is_empty() && *count > 0)
            {
                sums.resize(shared.len(), 0);
                sums.iter_mut().zip(shared).for_each(|(sum, shared)| *sum += count * shared);
            }
            sums.into_iter().max().unwrap_or(0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Crc;
    use super::*;

    fn of_order(p: u32, labels: u32) -> Result<Codebook, Error> {
        let payload = Payload::new(10, Crc::default(), false)?;
        Codebook::new(Family::prime(p)?, Some(payload), labels, Keying::OnOff)
    }

    #[test]
    fn a_macropulse_is_the_word_at_every_lit_bit() {
        let book = of_order(3, 848).unwrap();
        // Label 1 is 0000000001011: bits 9, 11 and 12; word 2 over GF(3) is 0, 5, 7.
        assert_eq!(book.marks(1, 2), [81, 86, 88, 99, 104, 106, 108, 113, 115]);
        assert_eq!(book.chips(), 13 * 9);
    }

    #[test]
    fn every_template_is_the_word_written_out_bit_by_bit() {
        let book = of_order(29, 848).unwrap();
        let payload = *book.payload().unwrap();
        for label in 0..848 {
            let text = payload.text(label);
            for word in 0..29 {
                let chips =
                    text.chars().enumerate().filter(|&(_, bit)| bit == '1').flat_map(|(bit, _)| {
                        book.word(word).marks.iter().map(move |m| 841 * bit as u16 + m)
                    });
                assert!(chips.eq(book.marks(label, word).iter().copied()), "{label}, {word}");
                let lit = book.lit_bits(label).iter().map(|&first| first as u16);
                let spelt =
                    lit.flat_map(|first| book.word(word).marks.iter().map(move |m| first + m));
                assert!(spelt.eq(book.marks(label, word).iter().copied()), "{label}, {word}");
            }
        }
    }

    #[test]
    fn the_paper_lights_0_to_319_marks_of_10933_chips() {
        let book = of_order(29, 848).unwrap();
        assert_eq!((book.chips(), book.words(), book.labels()), (10_933, 29, 848));
        assert_eq!((book.min_weight(), book.max_weight()), (0, 319));
        approx::assert_relative_eq!(book.mean_weight(), 5256.0 * 29.0 / 848.0);
        assert_eq!(book.weights().nth(1), Some((3 * 29, 3 * 29)));
    }

    #[test]
    fn a_sidelobe_is_the_most_marks_that_meet_when_shifted() {
        let book = of_order(7, 848).unwrap();
        for (label, word) in [(0, 3), (1, 0), (1, 2), (511, 6), (847, 4)] {
            let marks = book.marks(label, word);
            let met =
                |lag: u16| marks.iter().filter(|&&mark| marks.contains(&(mark + lag))).count();
            let highest = (1..49).map(met).max().unwrap();
            assert_eq!(usize::from(book.sidelobe(label, word)), highest, "{label}, {word}");
        }
    }

    fn inverted(family: Family) -> Codebook {
        let payload = Payload::new(4, Crc::default(), true).unwrap();
        Codebook::new(family, Some(payload), 16, Keying::Inversion).unwrap()
    }

    #[test]
    fn an_inverted_macropulse_is_the_complement_at_every_0_bit() {
        let book = inverted(Family::gold(5).unwrap());
        for (label, word) in [(0, 0), (5, 1), (15, 32)] {
            let text = book.payload().unwrap().text(label);
            let marks = &book.word(word).marks;
            let is_lit = |chip: u16| {
                let bit = text.as_bytes()[usize::from(chip / 31)] == b'1';
                bit == marks.contains(&(chip % 31))
            };
            let expected = (0..book.chips() as u16).filter(|&chip| is_lit(chip));
            assert!(expected.eq(book.marks(label, word).iter().copied()), "{label} {word}");
        }
        // Every bit sends light: 16 of 31 chips for a 1 of a balanced word, 15 for a 0.
        assert!(book.min_weight() > 60, "{}", book.min_weight());
    }

    #[test]
    fn an_inverted_sidelobe_is_the_most_marks_that_meet_when_shifted() {
        let book = inverted(Family::gold(5).unwrap());
        for (label, word) in [(0, 3), (7, 0), (12, 31)] {
            let marks = book.marks(label, word);
            let met =
                |lag: u16| marks.iter().filter(|&&mark| marks.contains(&(mark + lag))).count();
            let highest = (1..31).map(met).max().unwrap();
            assert_eq!(usize::from(book.sidelobe(label, word)), highest, "{label}, {word}");
        }
    }

    #[test]
    fn words_of_one_family_may_differ_in_weight() {
        let book = Codebook::new(Family::gold(7).unwrap(), None, 1, Keying::OnOff).unwrap();
        assert_eq!(book.weights().collect::<Vec<_>>(), [(56, 72)]);
        assert_eq!((book.min_weight(), book.max_weight(), book.lightest_word()), (56, 72, 56));
        assert!((book.mean_weight() - 64.0).abs() < 1.0, "{}", book.mean_weight());
    }

    #[test]
    fn an_uncoded_sensor_lights_its_only_chip() {
        let book = Codebook::single();
        assert_eq!((book.marks(0, 0), book.chips()), (&[0_u16][..], 1));
        assert_eq!(Ok(book), Codebook::new(Family::Single, None, 1, Keying::OnOff));
    }

    #[test]
    fn a_bare_word_is_its_own_macropulse() {
        let book = Codebook::new(Family::prime(7).unwrap(), None, 1, Keying::OnOff).unwrap();
        assert_eq!(book.chips(), 49);
        assert_eq!(book.marks(0, 3), book.word(3).marks);
    }

    #[test]
    fn refusals_name_the_way_out() {
        let refusal = |p, labels| of_order(p, labels).unwrap_err().to_string();
        assert_eq!(
            refusal(29, 1025),
            "1025 labels are not possible; this payload carries 1 to 1024"
        );
        assert!(refusal(29, 0).starts_with("0 labels are not possible"));
        assert_eq!(
            refusal(73, 848),
            "a macropulse of 13 bits × 5329 chips has 69277 chips; at most 65535 are possible: \
             use a shorter code word or fewer payload bits"
        );
        let payload = Payload::new(16, Crc::default(), false).unwrap();
        let large = Codebook::new(Family::prime(53).unwrap(), Some(payload), 65_536, Keying::OnOff)
            .unwrap_err();
        assert!(large.to_string().starts_with("the macropulses of 65536 labels with 53 words"));
    }
}
