//! Chance is addressed, never drawn in sequence.
//!
//! Every random number belongs to an address (seed, stage, index), where the index is a shot or a
//! time window. Whoever computes that shot, in whatever order, on whatever thread, draws the same
//! numbers; the overlap between neighbouring bands sees the same edges as their home band does.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Which question chance is asked. Each stage has numbers of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Is this mark seen, and when? Indexed by shot.
    Marks = 1,
    /// Dark counts and background. Indexed by time window.
    FalseEdges = 2,
    /// The firing of a one-mark detector. Indexed by shot.
    Firing = 3,
}

/// All the chance of one run.
#[derive(Debug, Clone)]
pub struct Chance {
    base: ChaCha8Rng,
}

impl Chance {
    /// The chance that belongs to `seed`.
    pub fn new(seed: u64) -> Self {
        Self { base: ChaCha8Rng::seed_from_u64(seed) }
    }

    /// The stream of random numbers at (seed, `stage`, `index`); `index` below 2⁵⁶.
    pub fn at(&self, stage: Stage, index: u64) -> ChaCha8Rng {
        let mut stream = self.base.clone();
        stream.set_stream((stage as u64) << 56 | (index & ((1 << 56) - 1)));
        stream
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::rand_core::Rng;

    #[test]
    fn an_address_gives_the_same_numbers_whatever_happened_between() {
        let chance = Chance::new(7);
        let first = chance.at(Stage::Marks, 12).next_u64();
        let _ = chance.at(Stage::FalseEdges, 12).next_u64();
        assert_eq!(chance.at(Stage::Marks, 12).next_u64(), first);
    }

    #[test]
    fn addresses_differ_in_each_part() {
        let at = |seed, stage, index| Chance::new(seed).at(stage, index).next_u64();
        let home = at(7, Stage::Marks, 12);
        assert_ne!(home, at(8, Stage::Marks, 12));
        assert_ne!(home, at(7, Stage::Firing, 12));
        assert_ne!(home, at(7, Stage::Marks, 13));
    }
}
