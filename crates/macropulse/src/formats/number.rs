//! The kinds of numbers that binary formats store, little endian.

/// Kind of a stored number: unsigned, signed or floating, with its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    U1,
    I1,
    U2,
    I2,
    U4,
    I4,
    U8,
    I8,
    F4,
    F8,
}

impl Kind {
    /// The kind of a number of `size` bytes by the letter that PCD and NumPy write before the size:
    /// `U` or `u`, `I` or `i`, `F` or `f`.
    pub fn from_letter(letter: &str, size: usize) -> Option<Self> {
        match (letter, size) {
            ("U" | "u", 1) => Some(Self::U1),
            ("I" | "i", 1) => Some(Self::I1),
            ("U" | "u", 2) => Some(Self::U2),
            ("I" | "i", 2) => Some(Self::I2),
            ("U" | "u", 4) => Some(Self::U4),
            ("I" | "i", 4) => Some(Self::I4),
            ("U" | "u", 8) => Some(Self::U8),
            ("I" | "i", 8) => Some(Self::I8),
            ("F" | "f", 4) => Some(Self::F4),
            ("F" | "f", 8) => Some(Self::F8),
            _ => None,
        }
    }

    /// The letter that PCD writes for it.
    pub fn letter(self) -> &'static str {
        match self {
            Self::U1 | Self::U2 | Self::U4 | Self::U8 => "U",
            Self::I1 | Self::I2 | Self::I4 | Self::I8 => "I",
            Self::F4 | Self::F8 => "F",
        }
    }

    /// Returns true for kinds of whole numbers.
    pub fn is_whole(self) -> bool {
        !matches!(self, Self::F4 | Self::F8)
    }

    /// Bytes.
    pub fn size(self) -> usize {
        match self {
            Self::U1 | Self::I1 => 1,
            Self::U2 | Self::I2 => 2,
            Self::U4 | Self::I4 | Self::F4 => 4,
            Self::U8 | Self::I8 | Self::F8 => 8,
        }
    }

    /// The number at the start of `bytes`; NaN where there are too few of them. Whole numbers beyond
    /// 2⁵³, which none of our attributes reaches, are rounded.
    pub fn read(self, bytes: &[u8]) -> f64 {
        let mut wide = [0; 8];
        let Some(stored) = bytes.get(..self.size()) else { return f64::NAN };
        wide[..stored.len()].copy_from_slice(stored);
        let [a, b, c, d, ..] = wide;
        match self {
            Self::U1 => f64::from(a),
            Self::I1 => f64::from(a as i8),
            Self::U2 => f64::from(u16::from_le_bytes([a, b])),
            Self::I2 => f64::from(i16::from_le_bytes([a, b])),
            Self::U4 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::I4 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::U8 => u64::from_le_bytes(wide) as f64,
            Self::I8 => i64::from_le_bytes(wide) as f64,
            Self::F4 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::F8 => f64::from_le_bytes(wide),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_by_their_kind() {
        let bytes = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff];
        assert_eq!(Kind::U1.read(&bytes), 255.0);
        assert_eq!(Kind::I1.read(&bytes), -1.0);
        assert_eq!(Kind::U2.read(&bytes), 65_535.0);
        assert_eq!(Kind::I4.read(&bytes), -1.0);
        assert_eq!(Kind::F4.read(&1.5_f32.to_le_bytes()), 1.5);
        assert_eq!(Kind::F8.read(&(-2.25_f64).to_le_bytes()), -2.25);
        assert!(Kind::F8.read(&bytes[1..]).is_nan());
    }

    #[test]
    fn a_letter_and_a_size_name_a_kind() {
        for kind in [Kind::U1, Kind::I2, Kind::U4, Kind::I8, Kind::F4, Kind::F8] {
            assert_eq!(Kind::from_letter(kind.letter(), kind.size()), Some(kind));
        }
        assert_eq!(Kind::from_letter("F", 2), None);
    }
}
