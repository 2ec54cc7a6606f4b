//! The hash by which a manifest says which sensor and scene it was.

/// The 64-bit FNV-1a hash \[FNV\] under way: the same on every machine and run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self::new()
    }
}

impl Fnv {
    /// The hash of nothing.
    pub fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Takes in some bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// Takes in a number, to its last bit.
    pub fn number(&mut self, value: f64) {
        self.bytes(&value.to_bits().to_le_bytes());
    }

    /// The hash as sixteen hexadecimal digits.
    pub fn text(self) -> String {
        format!("{:016x}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(bytes: &[u8]) -> String {
        let mut hash = Fnv::new();
        hash.bytes(bytes);
        hash.text()
    }

    #[test]
    fn the_published_values_come_out() {
        assert_eq!(of(b""), "cbf29ce484222325");
        assert_eq!(of(b"a"), "af63dc4c8601ec8c");
        assert_eq!(of(b"foobar"), "85944171f73967e8");
    }

    #[test]
    fn one_bit_of_one_number_counts() {
        let hash = |value: f64| {
            let mut hash = Fnv::new();
            hash.number(value);
            hash
        };
        assert_ne!(hash(1.0), hash(1.0 + f64::EPSILON));
        assert_eq!(hash(1.0), hash(1.0));
    }
}
