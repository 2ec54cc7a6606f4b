//! How shots are told apart.

use super::Check;
use crate::design::file::{CodeFile, FamilyFile, KeyingFile, OrthogonalFile, SparseFile};
use crate::design::{Coding, Error, Label, Scan, Tdc};
use macropulse_codec::code::{self, Codebook, Crc, Family, Keying, Payload};

impl Check<'_> {
    pub(super) fn coding(
        &self,
        file: Option<&CodeFile>,
        scan: &Scan,
        tdc: &Tdc,
    ) -> Result<Coding, Error> {
        let Some(file) = file else {
            return Ok(Coding {
                codebook: Codebook::single(),
                chip_fs: tdc.tick_fs,
                label: None,
                first_word: 0,
                word_modulus: 1,
            });
        };
        let family =
            family(file.family).or_else(|error| self.refuse("code.family", error.to_string()))?;
        let chip_fs = self.whole_fs("code.chip_ps", file.chip_ps)?;
        if chip_fs % tdc.tick_fs != 0 {
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

/// The code family that a sensor file names.
pub(in crate::design) fn family(file: FamilyFile) -> Result<Family, code::Error> {
    match file {
        FamilyFile::Prime(p) => Family::prime(p),
        FamilyFile::ExtendedPrime(p) => Family::extended_prime(p),
        FamilyFile::QuadraticCongruence(p) => Family::quadratic_congruence(p),
        FamilyFile::ExtendedQuadraticCongruence(p) => Family::extended_quadratic_congruence(p),
        FamilyFile::Orthogonal(OrthogonalFile { length, weight, words }) => {
            Family::orthogonal(length, weight, words)
        }
        FamilyFile::Sparse(SparseFile { length, weight, words, seed }) => {
            Family::sparse(length, weight, words, seed)
        }
        FamilyFile::MSequence(degree) => Family::m_sequence(degree),
        FamilyFile::Gold(degree) => Family::gold(degree),
    }
}
