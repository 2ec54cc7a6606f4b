//! How shots are told apart.

use super::Check;
use crate::code::{Codebook, Crc, Family, Payload};
use crate::design::file::{CodeFile, FamilyFile};
use crate::design::{Coding, Error, Pattern, Scan, Tdc};

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
        if !matches!(scan.pattern, Pattern::Raster { .. }) {
            return self.refuse("code", "only a raster can be coded; leave [code] out");
        }
        let family = match file.family {
            FamilyFile::Prime(p) => Family::prime(p)
                .or_else(|error| self.refuse("code.family.prime", error.to_string()))?,
        };
        let chip_fs = self.whole_fs("code.chip_ps", file.chip_ps)?;
        if chip_fs % tdc.tick_fs != 0 {
            return self.refuse("code.chip_ps", "must be a whole number of TDC ticks");
        }
        let label_bits = self.count("code.label_bits", file.label_bits, 1, 16)?;
        if scan.columns > 1 << label_bits {
            let message = format!("{label_bits} bits cannot number {} columns", scan.columns);
            return self.refuse("code.label_bits", message);
        }
        let crc =
            Crc { width: file.crc.width, polynomial: file.crc.polynomial, init: file.crc.init };
        let payload = Payload::new(label_bits, crc, file.sync_bit)
            .or_else(|error| self.refuse("code.crc", error.to_string()))?;
        let dark = (0..scan.columns).find(|&label| payload.is_dark(label as u16));
        if let (Some(label), false) = (dark, file.allow_dark) {
            let message = format!(
                "label {label} is {} zero bits and sends no light: set sync_bit = true or another \
                 crc init, or accept it with allow_dark = true",
                payload.bits()
            );
            return self.refuse("code.allow_dark", message);
        }
        let words = family.count() as u32;
        let modulus = self.count("code.word.modulus", file.word.modulus, 1, words)?;
        let first = self.count("code.word.first", file.word.first, 0, words - modulus)?;
        let codebook = Codebook::new(family, Some(payload), scan.columns)
            .or_else(|error| self.refuse("code", error.to_string()))?;
        Ok(Coding {
            codebook,
            chip_fs,
            label: Some(file.label),
            first_word: first,
            word_modulus: modulus,
        })
    }
}
