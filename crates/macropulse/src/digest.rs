//! The hash by which a manifest says which sensor and scene it was.

/// What is gathered before it is hashed: numbers one by one would cost more than their hash.
const BLOCK: usize = 1 << 16;

/// The BLAKE3 hash \[BLAKE3\] under way, of which 128 bits are kept: the same on every machine and
/// run, and no two inputs are known, or can be made, that share it.
#[derive(Debug, Clone)]
pub struct Digest {
    hasher: blake3::Hasher,
    waiting: Vec<u8>,
}

impl Default for Digest {
    fn default() -> Self {
        Self::new()
    }
}

impl Digest {
    /// The hash of nothing.
    pub fn new() -> Self {
        Self { hasher: blake3::Hasher::new(), waiting: Vec::new() }
    }

    /// Takes in some bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.waiting.extend_from_slice(bytes);
        if self.waiting.len() >= BLOCK {
            self.hasher.update(&self.waiting);
            self.waiting.clear();
        }
    }

    /// Takes in a number, to its last bit.
    pub fn number(&mut self, value: f64) {
        self.bytes(&value.to_bits().to_le_bytes());
    }

    /// The first 128 bits of the hash as 32 hexadecimal digits.
    pub fn text(mut self) -> String {
        self.hasher.update(&self.waiting);
        let mut kept = [0; 16];
        self.hasher.finalize_xof().fill(&mut kept);
        format!("{:032x}", u128::from_be_bytes(kept))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(bytes: &[u8]) -> String {
        let mut hash = Digest::new();
        hash.bytes(bytes);
        hash.text()
    }

    #[test]
    fn the_published_values_come_out() {
        let input = |length: u32| (0..length).map(|at| (at % 251) as u8).collect::<Vec<u8>>();
        assert_eq!(of(&input(0)), "af1349b9f5f9a1a6a0404dea36dcc949");
        assert_eq!(of(&input(1)), "2d3adedff11b61f14c886e35afa03673");
        assert_eq!(of(&input(102_400)), "bc3e3d41a1146b069abffad3c0d44860");
    }

    #[test]
    fn how_the_bytes_are_divided_does_not_matter() {
        let bytes: Vec<u8> = (0..200_003_u32).map(|at| (at.wrapping_mul(at) >> 3) as u8).collect();
        let mut hash = Digest::new();
        bytes.chunks(7).for_each(|part| hash.bytes(part));
        assert_eq!(hash.text(), of(&bytes));
    }

    #[test]
    fn one_bit_of_one_number_counts() {
        let hash = |value: f64| {
            let mut hash = Digest::new();
            hash.number(value);
            hash.text()
        };
        assert_ne!(hash(1.0), hash(1.0 + f64::EPSILON));
        assert_eq!(hash(1.0), hash(1.0));
    }
}
