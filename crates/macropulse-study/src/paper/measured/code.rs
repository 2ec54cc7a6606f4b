//! Code words and payloads, counted.

use super::Error;
use macropulse::codec::code::correlation::{
    CrossCorrelation, aperiodic_sidelobe, periodic, periodic_sidelobe,
};
use macropulse::codec::code::{CodeWord, Crc, Payload, prime_sequence};
use macropulse::design::Design;
use macropulse::predict::multiple_access::{
    Hits, MultipleAccess, Words as Which, bit_error_hard, bit_error_soft,
};
use macropulse::units::{range_from_tof, s_from_fs};

/// Users of the code at once: the shots in flight that the paper counts.
const USERS: u32 = 25;

/// Code words and their correlations.
#[derive(Debug, Clone)]
pub struct Words {
    /// Number of words.
    pub count: usize,
    /// Chips of a word.
    pub length: u32,
    /// Marks of a word.
    pub weight: usize,
    /// Most marks in which two different words coincide, at any lag, periodic or aperiodic.
    pub most_shared: u16,
    /// Mean of the periodic cross-correlation.
    pub mean_shared: f64,
    /// Its variance.
    pub variance: f64,
    /// Its variance without C0.
    pub variance_without_c0: f64,
    /// The lowest and the highest greatest aperiodic sidelobe of a word.
    pub sidelobes: (u16, u16),
    /// The greatest periodic sidelobe of C0.
    pub c0_sidelobe: u16,
    /// Range by which the greatest sidelobe of C1 is off.
    pub c1_error: f64,
    /// Interferers that can do no harm, whatever they send.
    pub harmless: u32,
    /// Probability that a bit fails beside 24 others whose bits begin with it: every mark counted,
    /// and chips limited to one.
    pub bit_errors: [f64; 2],
    /// The same with others that begin at any chip of it.
    pub unaligned_bit_errors: [f64; 2],
    /// Other users that the row on interference counts.
    pub others: u32,
    /// Most marks that `others` users can add at once at the peak of C1.
    pub interference: u32,
    /// Sequences of Table 1 that begin with 0.
    pub zero_first: usize,
    /// Words that begin with a mark.
    pub mark_first: usize,
    /// Words whose first block is that of C0.
    pub block_of_c0: usize,
    /// Words that are C0 as a whole.
    pub equal_to_c0: usize,
}

impl Words {
    pub(super) fn of(design: &Design) -> Result<Self, Error> {
        let family = design.emission.coding().codebook.family();
        let words = family.words();
        let weight = family.weight();
        let cross = CrossCorrelation::of(&words);
        let lobes = words.iter().filter_map(aperiodic_sidelobe).map(|lobe| lobe.height);
        let chip = s_from_fs(design.emission.coding().chip_fs);
        let aligned =
            MultipleAccess::prime(weight as u32, USERS, Which::All).map_err(Error::Code)?;
        let unaligned = MultipleAccess::new(weight, USERS, Hits::of_unaligned_words(&words));
        let errors = |access: &MultipleAccess| [bit_error_soft(access), bit_error_hard(access)];
        let block = |word: &CodeWord| -> Vec<u16> {
            word.marks.iter().copied().take_while(|&mark| usize::from(mark) < weight).collect()
        };
        Ok(Self {
            count: words.len(),
            length: family.length(),
            weight,
            most_shared: cross.periodic_max.max(cross.aperiodic_max),
            mean_shared: cross.periodic.mean(),
            variance: cross.periodic.variance(),
            variance_without_c0: CrossCorrelation::of(&words[1..]).periodic.variance(),
            sidelobes: (lobes.clone().min().unwrap_or(0), lobes.max().unwrap_or(0)),
            c0_sidelobe: periodic_sidelobe(&words[0]).map_or(0, |lobe| lobe.height),
            c1_error: aperiodic_sidelobe(&words[1])
                .map_or(0.0, |lobe| range_from_tof(f64::from(lobe.lag) * chip)),
            harmless: aligned.harmless_interferers().unwrap_or(0),
            bit_errors: errors(&aligned),
            unaligned_bit_errors: errors(&unaligned),
            others: USERS - 1,
            interference: most_added(&words, 1, USERS as usize - 1),
            zero_first: (0..weight as u32)
                .filter(|&i| prime_sequence(weight as u32, i).first() == Some(&0))
                .count(),
            mark_first: words.iter().filter(|word| word.marks.first() == Some(&0)).count(),
            block_of_c0: words.iter().filter(|word| block(word) == block(&words[0])).count(),
            equal_to_c0: words.iter().filter(|word| word.marks == words[0].marks).count(),
        })
    }
}

/// Most marks that the worst `others` of the words add at the peak of word `own`, each at its worst
/// lag.
fn most_added(words: &[CodeWord], own: usize, others: usize) -> u32 {
    let worst = |other: &CodeWord| periodic(&words[own], other).into_iter().max().unwrap_or(0);
    let mut added: Vec<u16> =
        (0..words.len()).filter(|&i| i != own).map(|i| worst(&words[i])).collect();
    added.sort_unstable_by(|a, b| b.cmp(a));
    added.iter().take(others).map(|&marks| u32::from(marks)).sum()
}

/// Labels, checksums, and the marks they make.
#[derive(Debug, Clone)]
pub struct Payloads {
    /// Bits of a payload.
    pub bits: u32,
    /// The payload of column 511.
    pub of_511: String,
    /// Chips of a macropulse.
    pub chips: u32,
    /// Length of a macropulse.
    pub macropulse: f64,
    /// Length of a chip.
    pub chip: f64,
    /// Fewest, mean and most marks of a column with light.
    pub marks: (usize, f64, usize),
    /// Marks of a lit bit.
    pub weight: usize,
    /// Marks of a whole scan.
    pub marks_per_scan: u64,
    /// Columns.
    pub columns: u32,
    /// Columns whose first bit is 0.
    pub begin_dark: usize,
    /// Columns without light.
    pub dark: Vec<u16>,
    /// The least number of bits in which two legal payloads differ.
    pub distance: u32,
    /// Share of all bit streams that are legal.
    pub legal: f64,
    /// Shifts that turn a column into another legal one.
    pub aliases: usize,
    /// Words that pixels are sent with in turn.
    pub word_modulus: u32,
    /// Fewest shots between two of the same word, if the word were the column modulo `word_modulus`.
    pub column_clash: u32,
    /// Shots between two of the same column.
    pub column_apart: u32,
    /// With a sync bit and a checksum that starts at 7; `None` if there is no such payload.
    pub repaired: Option<Repaired>,
}

/// The repaired payload.
#[derive(Debug, Clone, Copy)]
pub struct Repaired {
    /// Its bits.
    pub bits: u32,
    /// Length of its macropulse.
    pub macropulse: f64,
    /// Columns without light.
    pub dark: usize,
}

impl Payloads {
    pub(super) fn of(design: &Design) -> Self {
        let codebook = &design.emission.coding().codebook;
        let derived = design.derived();
        let columns = design.scan.columns;
        let payload = codebook.payload();
        let all = || 0..columns as u16;
        let first_bit =
            |payload: &Payload, label| payload.encode(label) >> (payload.bits() - 1) & 1;
        let of = |f: &dyn Fn(&Payload) -> usize| payload.map_or(0, f);
        let modulus = design.emission.coding().word_modulus;
        Self {
            bits: payload.map_or(0, Payload::bits),
            of_511: payload.map_or_else(String::new, |payload| payload.text(511)),
            chips: codebook.chips(),
            macropulse: derived.macropulse,
            chip: s_from_fs(design.emission.coding().chip_fs),
            marks: derived.marks,
            weight: codebook.family().weight(),
            marks_per_scan: derived.marks_per_scan,
            columns,
            begin_dark: of(&|p| all().filter(|&label| first_bit(p, label) == 0).count()),
            dark: payload.map_or_else(Vec::new, |p| all().filter(|&l| p.is_dark(l)).collect()),
            distance: payload.map_or(0, Payload::distance),
            legal: payload.map_or(1.0, |payload| payload.legal_fraction(columns)),
            aliases: of(&|payload| payload.shift_aliases(columns).len()),
            word_modulus: modulus,
            column_clash: column_clash(columns, modulus),
            column_apart: columns,
            repaired: payload.and_then(|payload| repaired(payload, design)),
        }
    }
}

/// Returns the fewest shots between two of the same word, if the word of a shot is its column modulo
/// `modulus`. At the end of a row, the last columns come before the first of the next.
fn column_clash(columns: u32, modulus: u32) -> u32 {
    let word = |shot: u32| shot % columns % modulus;
    let apart = |shot: u32| (1..=modulus).find(|step| word(shot + step) == word(shot));
    (0..columns).filter_map(apart).min().unwrap_or(modulus)
}

fn repaired(payload: &Payload, design: &Design) -> Option<Repaired> {
    let fixed = Payload::new(payload.label_bits(), Crc { init: 7, ..payload.crc() }, true).ok()?;
    let chips = fixed.bits() * design.emission.coding().codebook.family().length();
    Some(Repaired {
        bits: fixed.bits(),
        macropulse: f64::from(chips) * s_from_fs(design.emission.coding().chip_fs),
        dark: (0..design.scan.columns as u16).filter(|&label| fixed.is_dark(label)).count(),
    })
}
