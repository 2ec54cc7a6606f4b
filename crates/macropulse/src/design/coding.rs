//! How shots are told apart: `[code]`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::emission::Model;
use super::family::{FamilyFile, family};
use super::limits::Check;
use super::{Clock, Error, Scan};
use macropulse_codec::code::{Codebook, Crc, Keying, Payload};

/// `[code]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct CodeFile {
    /// Family of code words, one, as { prime = 29 }.
    family: FamilyFile,
    /// Length of a chip, ps: a whole number of ticks.
    #[schemars(range(min = 0.001, max = 1e9))]
    chip_ps: f64,
    /// Keying of a bit: 1 is the code word, 0 is dark or its complement.
    keying: KeyingFile,
    /// The label that a shot carries.
    pub label: Label,
    /// Bits of the label, which must number all columns.
    #[schemars(range(min = 1, max = 16))]
    label_bits: u32,
    /// Checksum behind the label.
    crc: CrcFile,
    /// True if a lit bit goes before the label.
    sync_bit: bool,
    /// True if labels that send no light are accepted.
    allow_dark: bool,
    /// Which code word a pixel is sent with: pixel n, row by row, with word `first` + n mod
    /// `modulus`.
    word: WordFile,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum KeyingFile {
    /// A 0 bit is dark.
    OnOff,
    /// A 0 bit is the complement of the code word; for the receiver `balanced`.
    Inversion,
}

/// Which number a macropulse carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Label {
    /// The column of its pixel.
    Column,
    /// None: a macropulse is one bare code word.
    None,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct CrcFile {
    /// Bits of the checksum.
    #[schemars(range(min = 1, max = 8))]
    width: u8,
    /// Its polynomial, without the leading term.
    polynomial: u8,
    /// Value of its register at the start.
    init: u8,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct WordFile {
    /// First word in use, from 0.
    first: u32,
    /// How many words are in use.
    #[schemars(range(min = 1))]
    modulus: u32,
}

/// How shots are told apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Coding {
    /// Marks of every label and word.
    pub codebook: Codebook,
    /// Length of a chip, fs; of the whole shot where it is not coded.
    pub chip_fs: i64,
    /// Which number a macropulse carries; `None` where shots are not coded.
    pub label: Option<Label>,
    /// The word of pixel `n` of a scan is `first_word + n mod word_modulus`.
    pub first_word: u32,
    /// See `first_word`.
    pub word_modulus: u32,
}

impl Coding {
    /// The number that a shot to `column` carries; 0 where it carries none.
    pub fn label_of(&self, column: u16) -> u16 {
        match self.label {
            Some(Label::Column) => column,
            Some(Label::None) | None => 0,
        }
    }
}

impl Model for Coding {
    fn coding(&self) -> &Coding {
        self
    }

    fn length_fs(&self) -> i64 {
        i64::from(self.codebook.chips()) * self.chip_fs
    }

    fn ambiguity(&self) -> &'static str {
        match self.label {
            Some(_) => "a code word comes again",
            None => "by the detector alone: shots carry no code",
        }
    }
}

impl Check<'_> {
    pub(super) fn coding(
        &self,
        file: Option<&CodeFile>,
        scan: &Scan,
        clock: Clock,
    ) -> Result<Coding, Error> {
        let Some(file) = file else {
            return Ok(Coding {
                codebook: Codebook::single(),
                chip_fs: clock.tick_fs,
                label: None,
                first_word: 0,
                word_modulus: 1,
            });
        };
        let family = family(file.family.clone())
            .or_else(|error| self.refuse("code.family", error.to_string()))?;
        let chip_fs = self.whole_fs("code.chip_ps", file.chip_ps)?;
        if chip_fs % clock.tick_fs != 0 {
            return self.refuse("code.chip_ps", "must be a whole number of TDC ticks");
        }
        let keying = match file.keying {
            KeyingFile::OnOff => Keying::OnOff,
            KeyingFile::Inversion => Keying::Inversion,
        };
        let (payload, labels) = match file.label {
            Label::Column => (Some(self.payload(file, scan, keying)?), scan.columns),
            Label::None => (None, 1),
        };
        if payload.is_none() && keying == Keying::Inversion {
            return self.refuse(
                "code.keying",
                "`inversion` says how 0 bits are sent, but with label = \"none\" there are none: \
                 use \"on-off\"",
            );
        }
        let words = family.count() as u32;
        let modulus = self.count("code.word.modulus", file.word.modulus, 1, words)?;
        let first = self.count("code.word.first", file.word.first, 0, words - modulus)?;
        let codebook = Codebook::new(family, payload, labels, keying)
            .or_else(|error| self.refuse("code", error.to_string()))?;
        if codebook.max_weight() == 0 {
            return self.refuse(
                "code.allow_dark",
                "no label of this sensor sends any light: set sync_bit = true, or another crc init",
            );
        }
        Ok(Coding {
            codebook,
            chip_fs,
            label: Some(file.label),
            first_word: first,
            word_modulus: modulus,
        })
    }

    /// The payload of a macropulse that carries its column.
    fn payload(&self, file: &CodeFile, scan: &Scan, keying: Keying) -> Result<Payload, Error> {
        let label_bits = self.count("code.label_bits", file.label_bits, 1, 16)?;
        if scan.columns > 1 << label_bits {
            let message = format!("{label_bits} bits cannot number {} columns", scan.columns);
            return self.refuse("code.label_bits", message);
        }
        let crc =
            Crc { width: file.crc.width, polynomial: file.crc.polynomial, init: file.crc.init };
        let payload = Payload::new(label_bits, crc, file.sync_bit)
            .or_else(|error| self.refuse("code.crc", error.to_string()))?;
        let is_dark = |&label: &u32| keying == Keying::OnOff && payload.is_dark(label as u16);
        let dark = (0..scan.columns).find(is_dark);
        if let (Some(label), false) = (dark, file.allow_dark) {
            let message = format!(
                "label {label} is {} zero bits and sends no light: set sync_bit = true or another \
                 crc init, or accept it with allow_dark = true",
                payload.bits()
            );
            return self.refuse("code.allow_dark", message);
        }
        Ok(payload)
    }
}
