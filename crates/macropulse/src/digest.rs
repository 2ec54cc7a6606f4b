//! The hash by which a manifest says which sensor and scene it was.

/// Bytes that are gathered before they are hashed: to hash numbers one by one would cost more than the hash
/// itself.
const BLOCK: usize = 1 << 16;

/// The BLAKE3 hash \[BLAKE3\] under way. 128 bits of it are kept. It is the same on every machine and run,
/// and no two inputs that share it are known, or can be made.
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
        self.hash_what_waits();
    }

    /// Hashes what waits, if that is enough.
    #[inline]
    fn hash_what_waits(&mut self) {
        if self.waiting.len() >= BLOCK {
            self.hasher.update(&self.waiting);
            self.waiting.clear();
        }
    }

    /// Takes in numbers, to their last bit.
    pub fn numbers(&mut self, values: &[f64]) {
        for some in values.chunks(BLOCK / size_of::<f64>()) {
            let from = self.waiting.len();
            self.waiting.resize(from + size_of_val(some), 0);
            let places = self.waiting[from..].as_chunks_mut().0;
            places.iter_mut().zip(some).for_each(|(place, value)| *place = value.to_le_bytes());
            self.hash_what_waits();
        }
    }

    /// Takes in a number, to its last bit.
    pub fn number(&mut self, value: f64) {
        self.bytes(&value.to_le_bytes());
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
    fn numbers_together_are_as_one_by_one() {
        let values: Vec<f64> = (0..20_001).map(|at| f64::from(at) / 7.0 - 900.0).collect();
        let (mut together, mut alone) = (Digest::new(), Digest::new());
        for hash in [&mut together, &mut alone] {
            hash.bytes(b"abc");
        }
        together.numbers(&values);
        values.iter().for_each(|value| alone.number(*value));
        assert_eq!(together.text(), alone.text());
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
