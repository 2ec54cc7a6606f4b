//! Inputs made of others: a seeded mutator for machines without a fuzzer.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Bytes that hurt in place of a number or a line.
const WORDS: [&[u8]; 16] = [
    b"0",
    b"-1",
    b"4294967296",
    b"99999999999999999999",
    b"1e308",
    b"-0.0",
    b"nan",
    b"inf",
    b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x80",
    b"\xff\xff\xff\xff\xff\xff\xff\x7f",
    b"\n",
    b"\r\n\t",
    b"\xef\xbb\xbf",
    b"\"",
    b"[[",
];

/// Makes inputs out of others; the same ones from the same seed.
pub struct Mutator(ChaCha8Rng);

impl Mutator {
    /// The one of this seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// One of `corpus`, which is not empty, changed in a few places, `longest` bytes at most.
    pub fn next(&mut self, corpus: &[Vec<u8>], longest: usize) -> Vec<u8> {
        let mut bytes = corpus[self.below(corpus.len())].clone();
        for _ in 0..=self.below(4) {
            self.change(&mut bytes, corpus);
        }
        bytes.truncate(longest);
        bytes
    }

    fn below(&mut self, end: usize) -> usize {
        self.0.random_range(0..end.max(1))
    }

    /// A part of `bytes`: a short one, more often than not.
    fn part(&mut self, bytes: &[u8]) -> std::ops::Range<usize> {
        let most = if self.below(4) == 0 { bytes.len() } else { 16 };
        let from = self.below(bytes.len() + 1);
        from..(from + self.below(most + 1)).min(bytes.len())
    }

    fn change(&mut self, bytes: &mut Vec<u8>, corpus: &[Vec<u8>]) {
        let at = self.below(bytes.len());
        let place = self.below(bytes.len() + 1);
        match self.below(9) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << self.below(8),
            1 if !bytes.is_empty() => bytes[at] = self.0.next_u32() as u8,
            2 => drop(bytes.drain(self.part(bytes))),
            3 => {
                let twice = bytes[self.part(bytes)].to_vec();
                bytes.splice(place..place, twice);
            }
            4 => {
                let other = &corpus[self.below(corpus.len())];
                let taken = other[self.part(other)].to_vec();
                let replaced = self.part(bytes);
                bytes.splice(replaced, taken);
            }
            5 => {
                let word = WORDS[self.below(WORDS.len())];
                let end = (place + word.len()).min(bytes.len());
                bytes.splice(place..end, word.iter().copied());
            }
            6 => self.number(bytes, place),
            7 => bytes.truncate(place),
            _ => {
                let word = WORDS[self.below(WORDS.len())];
                bytes.splice(place..place, word.iter().copied());
            }
        }
    }

    /// Puts another number in place of the one that is written at or behind `place`.
    fn number(&mut self, bytes: &mut Vec<u8>, place: usize) {
        let is_digit = |byte: &u8| byte.is_ascii_digit();
        let Some(from) = bytes[place..].iter().position(is_digit).map(|at| place + at) else {
            return;
        };
        let length = bytes[from..].iter().take_while(|byte| is_digit(byte)).count();
        let other = match self.below(3) {
            0 => self.below(10).to_string(),
            1 => self.0.next_u32().to_string(),
            _ => "9".repeat(1 + self.below(20)),
        };
        bytes.splice(from..from + length, other.into_bytes());
    }
}
