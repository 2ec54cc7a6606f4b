//! Relative energies of the shots of a scan.

use crate::design::{Coding, Scan};

/// The energy of a shot by its column, in energies of a mean shot, every mark having the same: that
/// of the brightest word of its label.
pub(super) struct Energies {
    by_column: Vec<f64>,
    /// All columns have the same energy.
    pub alike: bool,
}

impl Energies {
    pub(super) fn of(scan: &Scan, coding: &Coding) -> Self {
        let book = &coding.codebook;
        let words = coding.first_word..coding.first_word + coding.word_modulus;
        let marks = |label: u16| {
            words.clone().map(|word| book.marks(label, word as u16).len()).max().unwrap_or(0)
        };
        let mut last = (0, marks(0));
        let by_column = (0..scan.columns).map(|column| {
            let label = coding.label_of(column as u16);
            if label != last.0 {
                last = (label, marks(label));
            }
            last.1 as f64 / book.mean_weight()
        });
        Self::new(by_column.collect())
    }

    pub(super) fn new(by_column: Vec<f64>) -> Self {
        let alike = by_column.windows(2).all(|pair| pair[0] == pair[1]);
        Self { by_column, alike }
    }

    pub(super) fn at(&self, column: u32) -> f64 {
        self.by_column.get(column as usize).copied().unwrap_or(0.0)
    }

    pub(super) fn most(&self) -> f64 {
        self.by_column.iter().copied().fold(0.0, f64::max)
    }

    pub(super) fn sum(&self) -> f64 {
        self.by_column.iter().sum()
    }
}
