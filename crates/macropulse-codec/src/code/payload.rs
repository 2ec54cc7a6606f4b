//! The payload: the bits of a macropulse, that is a label and its checksum.
//!
//! Bits in the order in which they are sent, most significant first:
//!
//! ```text
//! [sync = 1]  label (label_bits)  CRC (width)
//! ```

use super::Error;

/// The checksum of a label: the remainder of a polynomial division over GF(2).
///
/// Convention: the label enters most significant bit first into a register of `width` bits that
/// starts at `init`; nothing is reflected and nothing is inverted at the end. With `init` 0 the
/// checksum is the remainder of label·x^width, so that of label 0 is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Crc {
    /// Number of bits, 1 to 8.
    pub width: u8,
    /// Coefficients below the leading term, which is implied: x³ + x + 1 is `0b011`.
    pub polynomial: u8,
    /// Value of the register before the first bit.
    pub init: u8,
}

impl Default for Crc {
    /// CRC-3 with x³ + x + 1, starting at 0 \[KP16 §2.1\].
    fn default() -> Self {
        Self { width: 3, polynomial: 0b011, init: 0 }
    }
}

impl Crc {
    fn validate(self) -> Result<Self, Error> {
        let Self { width, polynomial, init } = self;
        if !(1..=8).contains(&width) {
            return Err(Error::CrcWidth { width });
        }
        for (part, value) in [("polynomial", polynomial), ("init", init)] {
            if u32::from(value) >> width != 0 {
                return Err(Error::CrcTooWide { part, value, width });
            }
        }
        if polynomial & 1 == 0 {
            return Err(Error::CrcWithoutOne { polynomial });
        }
        Ok(self)
    }

    /// The register after `bits`, in the order in which they enter.
    fn remainder(self, bits: impl Iterator<Item = bool>) -> u32 {
        let kept = (1_u32 << self.width) - 1;
        bits.fold(u32::from(self.init), |register, bit| {
            let carry = (register >> (self.width - 1)) & 1 != 0;
            let shifted = (register << 1) & kept;
            if carry == bit { shifted } else { shifted ^ u32::from(self.polynomial) }
        })
    }
}

/// How labels are written into bits. A format that exists is valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Payload {
    label_bits: u32,
    crc: Crc,
    sync: bool,
}

/// Why received bits are no payload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum PayloadFault {
    /// The sync bit is dark.
    #[error("the sync bit is dark")]
    Sync,
    /// The checksum does not fit the label.
    #[error("the checksum does not fit the label")]
    Crc,
}

/// A label that is taken for another one when its leading dark bits are overlooked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ShiftAlias {
    /// Label that was sent.
    pub label: u16,
    /// Dark bits before the first lit one.
    pub leading_zeros: u32,
    /// Label that is read from the first lit bit on, with a checksum that fits.
    pub read_as: u16,
}

impl Payload {
    /// A payload of `label_bits` for the label and `crc` behind it; with `sync`, a bit that is
    /// always lit goes first.
    ///
    /// # Errors
    /// If the label has not 1 to 16 bits, or the checksum not 1 to 8. If the polynomial or the initial value
    /// of the checksum does not fit, or the polynomial lacks the term 1.
    pub fn new(label_bits: u32, crc: Crc, sync: bool) -> Result<Self, Error> {
        if !(1..=16).contains(&label_bits) {
            return Err(Error::LabelBits { bits: label_bits });
        }
        Ok(Self { label_bits, crc: crc.validate()?, sync })
    }

    /// Bits of the label.
    pub fn label_bits(&self) -> u32 {
        self.label_bits
    }

    /// The checksum.
    pub fn crc(&self) -> Crc {
        self.crc
    }

    /// All bits: sync, label and checksum.
    pub fn bits(&self) -> u32 {
        u32::from(self.sync) + self.checked_bits()
    }

    /// Number of labels the format can carry.
    pub fn possible_labels(&self) -> u32 {
        1 << self.label_bits
    }

    /// The payload that carries `label`, the bit sent first being the most significant of
    /// [`bits`](Self::bits). Bits of `label` beyond the format's are dropped.
    pub fn encode(&self, label: u16) -> u32 {
        let label = u32::from(label) & (self.possible_labels() - 1);
        let bits = (0..self.label_bits).rev().map(|bit| (label >> bit) & 1 == 1);
        let sync = u32::from(self.sync) << self.checked_bits();
        sync | label << self.crc.width | self.crc.remainder(bits)
    }

    /// The label that `payload` carries; bits above [`bits`](Self::bits) are ignored.
    ///
    /// # Errors
    /// The fault of a payload that is none.
    pub fn check(&self, payload: u32) -> Result<u16, PayloadFault> {
        let payload = payload & ((1 << self.bits()) - 1);
        if self.sync && payload >> self.checked_bits() == 0 {
            return Err(PayloadFault::Sync);
        }
        let label = (payload >> self.crc.width & (self.possible_labels() - 1)) as u16;
        if self.encode(label) == payload { Ok(label) } else { Err(PayloadFault::Crc) }
    }

    /// The bits of `label` as zeros and ones, in the order in which they are sent.
    pub fn text(&self, label: u16) -> String {
        format!("{:0width$b}", self.encode(label), width = self.bits() as usize)
    }

    /// Positions of the lit bits of `label`, counted from the bit sent first; ascending.
    pub fn lit_bits(&self, label: u16) -> impl Iterator<Item = u32> {
        let payload = self.encode(label);
        let last = self.bits() - 1;
        (0..=last).filter(move |bit| (payload >> (last - bit)) & 1 == 1)
    }

    /// Number of lit bits of `label`.
    pub fn weight(&self, label: u16) -> u32 {
        self.encode(label).count_ones()
    }

    /// Returns true if `label` makes no light at all.
    pub fn is_dark(&self, label: u16) -> bool {
        self.encode(label) == 0
    }

    /// Hamming distance of the code: the fewest bits in which the payloads of two labels differ,
    /// over all labels the format can carry.
    ///
    /// The code is a shifted linear one, so the payloads of two labels differ as those of label 0
    /// and of some other label do.
    pub fn distance(&self) -> u32 {
        let origin = self.encode(0);
        let others = (1..self.possible_labels()).map(|label| self.encode(label as u16));
        others.map(|payload| (payload ^ origin).count_ones()).min().unwrap_or(0)
    }

    /// Fraction of all words of [`bits`](Self::bits) bits that are the payload of a label below
    /// `labels`: how often random bits are believed.
    pub fn legal_fraction(&self, labels: u32) -> f64 {
        f64::from(labels.min(self.possible_labels())) / f64::from(1_u32 << self.bits())
    }

    /// The labels below `labels` that a receiver takes for another label below `labels` if it
    /// lets the payload begin at the first lit bit, as \[KP16 §2.3\] does. Dark bits follow.
    pub fn shift_aliases(&self, labels: u32) -> Vec<ShiftAlias> {
        let labels = labels.min(self.possible_labels());
        let alias = |label: u16| {
            let payload = self.encode(label);
            let leading_zeros = self.lit_bits(label).next()?;
            let read_as = self.check(payload << leading_zeros).ok()?;
            let is_other = read_as != label && u32::from(read_as) < labels;
            is_other.then_some(ShiftAlias { label, leading_zeros, read_as })
        };
        (0..labels).filter_map(|label| alias(label as u16)).collect()
    }

    /// Bits of label and checksum.
    fn checked_bits(&self) -> u32 {
        self.label_bits + u32::from(self.crc.width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kim_park() -> Payload {
        Payload::new(10, Crc::default(), false).unwrap()
    }

    #[test]
    fn label_1_ends_in_the_polynomial() {
        assert_eq!(kim_park().bits(), 13);
        assert_eq!(kim_park().text(1), "0000000001011");
        assert_eq!(kim_park().encode(1), 0b1011);
        assert_eq!(kim_park().weight(1), 3);
        assert!(kim_park().lit_bits(1).eq([9, 11, 12]));
    }

    #[test]
    fn label_0_is_dark_unless_the_register_or_the_sync_bit_light_it() {
        assert_eq!(kim_park().text(0), "0000000000000");
        assert!(kim_park().is_dark(0));
        let from_seven = Payload::new(10, Crc { init: 7, ..Crc::default() }, false).unwrap();
        assert!(!from_seven.is_dark(0));
        let with_sync = Payload::new(10, Crc::default(), true).unwrap();
        assert_eq!(with_sync.text(0), "10000000000000");
    }

    /// The published check values: the checksum of the nine ASCII characters `123456789`.
    #[test]
    fn checksums_agree_with_the_published_catalogue() {
        let checksum = |width, polynomial, init| {
            let bits =
                b"123456789".iter().flat_map(|byte| (0..8).rev().map(move |i| byte >> i & 1));
            Crc { width, polynomial, init }.remainder(bits.map(|bit| bit == 1))
        };
        assert_eq!(checksum(3, 0b011, 0) ^ 7, 0x4, "CRC-3/GSM, which inverts at the end");
        assert_eq!(checksum(5, 0x09, 0x09), 0x00, "CRC-5/EPC-C1G2");
        assert_eq!(checksum(8, 0x07, 0x00), 0xf4, "CRC-8/SMBUS");
        assert_eq!(checksum(8, 0x31, 0xff), 0xf7, "CRC-8/NRSC-5");
    }

    #[test]
    fn every_label_comes_back_from_the_widest_and_the_narrowest_format() {
        let wide = Crc { width: 8, polynomial: 0x31, init: 0xff };
        let parity = Crc { width: 1, polynomial: 1, init: 0 };
        for (label_bits, crc, sync) in [(16, wide, true), (1, parity, false)] {
            let payload = Payload::new(label_bits, crc, sync).unwrap();
            for label in (0..payload.possible_labels()).map(|label| label as u16) {
                assert_eq!(payload.check(payload.encode(label)), Ok(label));
            }
        }
    }

    #[test]
    fn faults_are_told_apart() {
        let payload = Payload::new(10, Crc::default(), true).unwrap();
        let sent = payload.encode(700);
        assert_eq!(payload.check(sent ^ 1 << 13), Err(PayloadFault::Sync));
        assert_eq!(payload.check(sent ^ 1), Err(PayloadFault::Crc));
        assert_eq!(payload.check(sent ^ 1 << 12), Err(PayloadFault::Crc));
    }

    #[test]
    fn a_label_that_does_not_fit_loses_its_upper_bits() {
        assert_eq!(kim_park().encode(1024 + 5), kim_park().encode(5));
    }

    #[test]
    fn refusals_name_what_is_possible() {
        let refusal = |bits, crc| Payload::new(bits, crc, false).unwrap_err().to_string();
        let crc = Crc::default();
        assert_eq!(refusal(17, crc), "a label of 17 bits is not possible; use 1 to 16 bits");
        assert_eq!(refusal(0, crc), "a label of 0 bits is not possible; use 1 to 16 bits");
        assert_eq!(
            refusal(10, Crc { width: 9, ..crc }),
            "a CRC of 9 bits is not possible; use 1 to 8 bits"
        );
        assert_eq!(
            refusal(10, Crc { polynomial: 0b1011, ..crc }),
            "the CRC polynomial 0b1011 does not fit 3 bits; the leading term is implied"
        );
        assert_eq!(
            refusal(10, Crc { polynomial: 0b110, ..crc }),
            "the CRC polynomial 0b110 must end in +1: set its lowest bit"
        );
        assert!(refusal(10, Crc { init: 8, ..crc }).starts_with("the CRC init 0b1000 does not"));
    }
}
