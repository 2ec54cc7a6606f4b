//! The baseline of an amplifier that is coupled by a capacitor: a high-pass of first order.
//!
//! With the angular cutoff ω the baseline b follows the signal x by db/dt = ω·(x − b), and x − b goes on. If
//! the signal is held from sample to sample, T apart, this is exactly
//!
//! bₙ₊₁ = a·bₙ + (1 − a)·xₙ, a = exp(−ω·T):
//!
//! behind a pulse of charge Q = ∫x dt the baseline lies ω·Q lower and comes back with exp(−ω·t), and in the
//! mean over time nothing is left of any light.
//!
//! A recursion has no beginning. So the baseline at the start of a block of ticks follows from the blocks
//! before it that it remembers. These are always the same, so it is the same in every band.

use crate::design::detector::{BASELINE_BLOCK, Sampled};

/// Ticks of a block.
const BLOCK: usize = BASELINE_BLOCK as usize;

/// Blocks that are gone through side by side: each tick of one has to wait for the tick before.
const LANES: usize = 8;

/// The coupling of an amplifier.
#[derive(Debug)]
pub(super) struct Baseline {
    /// Share of the baseline that is left after a tick, a.
    keeps: f64,
    /// Blocks that it remembers.
    blocks: usize,
}

impl Baseline {
    /// That of a `sampled` detector; `None` where light does not move it.
    pub fn of(sampled: &Sampled) -> Option<Self> {
        let blocks =
            usize::try_from(sampled.remembered_blocks()).ok().filter(|blocks| *blocks > 0)?;
        Some(Self { keeps: libm::exp(-sampled.low_cutoff * sampled.sample), blocks })
    }

    /// The absolute tick from which on the signal must be known for the baseline at `tick`: where a block
    /// begins.
    pub fn begins(&self, tick: i64) -> i64 {
        (tick.div_euclid(BASELINE_BLOCK) - self.blocks as i64) * BASELINE_BLOCK
    }

    /// Takes the baseline away from a signal whose first value is that of tick `first`, at which a block
    /// begins. The baseline of the first blocks, those that it remembers, is not known, and nothing is taken
    /// away from them.
    pub fn take_from(&self, level: &mut [f32], first: i64) {
        debug_assert_eq!(first.rem_euclid(BASELINE_BLOCK), 0);
        let over_block = libm::exp(libm::log(self.keeps) * BASELINE_BLOCK as f64);
        // The baseline behind each block alone, if it is zero before.
        let mut made = vec![0.0; level.len() / BLOCK];
        self.follow(level, &mut made, |_, _| {});
        let at = |number: usize| {
            let before = &made[number - self.blocks..number];
            before.iter().fold(0.0, |baseline, made| baseline * over_block + made)
        };
        let mut baselines: Vec<f64> = (self.blocks..=made.len()).map(at).collect();
        let known = level.get_mut(self.blocks * BLOCK..).unwrap_or_default();
        self.follow(known, &mut baselines, |level, baseline| {
            *level = (f64::from(*level) - baseline) as f32;
        });
    }

    /// Follows the baseline through each block of `level` for which there is one in `baselines`: from there, and
    /// what it is behind the block is put there. Does `to_each` with every value and the baseline under it.
    fn follow(&self, level: &mut [f32], baselines: &mut [f64], to_each: impl Fn(&mut f32, f64)) {
        for (level, baselines) in level.chunks_mut(LANES * BLOCK).zip(baselines.chunks_mut(LANES)) {
            match baselines.first_chunk_mut::<LANES>() {
                Some(baselines) if level.len() == LANES * BLOCK => {
                    self.side_by_side(level, baselines, &to_each);
                }
                _ => level.chunks_mut(BLOCK).zip(baselines).for_each(|(level, baseline)| {
                    self.side_by_side(level, std::array::from_mut(baseline), &to_each);
                }),
            }
        }
    }

    /// Follows the baseline through `N` blocks of one length, as [`Self::follow`] does.
    fn side_by_side<const N: usize>(
        &self,
        level: &mut [f32],
        baselines: &mut [f64; N],
        to_each: impl Fn(&mut f32, f64),
    ) {
        let length = level.len() / N;
        for at in 0..length {
            for (lane, baseline) in baselines.iter_mut().enumerate() {
                let level = &mut level[lane * length + at];
                let before = *baseline;
                *baseline = self.next(before, *level);
                to_each(level, before);
            }
        }
    }

    /// The baseline a tick later.
    fn next(&self, baseline: f64, level: f32) -> f64 {
        self.keeps * baseline + (1.0 - self.keeps) * f64::from(level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One that forgets by e in 5000 ticks, and all in 13 blocks.
    fn baseline() -> Baseline {
        Baseline { keeps: libm::exp(-1.0 / 5000.0), blocks: 13 }
    }

    /// A pulse of 100 in ten ticks: behind it the signal is ω·Q = 100·10/5000 below zero, and comes back with
    /// the time constant. Before it there is nothing.
    #[test]
    fn behind_a_pulse_the_baseline_comes_back() {
        let it = baseline();
        let mut level = vec![0.0_f32; 24 * BLOCK];
        let at = 15 * BLOCK + 77;
        level[at..at + 10].fill(100.0);
        it.take_from(&mut level, -3 * BASELINE_BLOCK);
        assert!(level[..at].iter().all(|level| *level == 0.0));
        assert!((level[at] - 100.0).abs() < 1e-6);
        for later in [10, 1000, 5000, 20_000] {
            let expected = -0.2 * libm::exp(-(later as f64 - 5.0) / 5000.0);
            let found = f64::from(level[at + later]);
            assert!((found - expected).abs() < 1e-3 * 0.2, "{later}: {found}, not {expected}");
        }
    }

    /// Nothing is left of steady light.
    #[test]
    fn steady_light_is_taken_away() {
        let mut level = vec![50.0_f32; 20 * BLOCK];
        baseline().take_from(&mut level, 0);
        let last = level[20 * BLOCK - 1];
        assert!(last.abs() < 50.0 * libm::expf(-10.0), "{last}");
    }

    /// From whichever block on the signal is known, the baseline is the same to the last bit. Control: known
    /// from one block less than it remembers, it is not.
    #[test]
    fn the_baseline_is_the_same_in_every_band() {
        let it = baseline();
        let whole: Vec<f32> = (0..40 * BLOCK).map(|at| (at * at % 977) as f32).collect();
        let from = |block: usize, whole: &[f32]| {
            let mut level = whole[block * BLOCK..].to_vec();
            it.take_from(&mut level, (block as i64) * BASELINE_BLOCK);
            level
        };
        let (all, part) = (from(0, &whole), from(9, &whole));
        assert_eq!(all[(9 + it.blocks) * BLOCK..], part[it.blocks * BLOCK..]);
        assert_eq!(it.begins((9 + it.blocks as i64) * BASELINE_BLOCK + 5), 9 * BASELINE_BLOCK);
        let shorter = Baseline { blocks: it.blocks - 1, ..baseline() };
        let mut level = whole;
        shorter.take_from(&mut level, 0);
        assert_ne!(all[20 * BLOCK..], level[20 * BLOCK..]);
    }
}
