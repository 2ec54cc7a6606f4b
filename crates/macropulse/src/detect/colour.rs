//! Noise with a given covariance: independent numbers behind a filter.

use crate::kernels::{GROUP, mixed, smoothed};
use crate::random::{Address, Chance, Stage};

/// Ticks to either side over which noise is smoothed.
const HALF: usize = 24;

/// Points of the spectrum: about twice the number of weights of the filter.
const POINTS: usize = 4 * HALF;

/// Numbers drawn at once, of two words each.
const BLOCK: usize = GROUP / 2;

/// Samples whose noise is worked out together, so that it stays in the cache.
const RUN: usize = 4096;

/// Noise of a covariance and a skewness.
#[derive(Debug)]
pub(super) struct Colour {
    /// Weights of the filter, symmetric.
    weights: Vec<f32>,
    /// x = a·g + c·(g² − 1) of a normal number g.
    mixture: (f32, f32),
}

impl Colour {
    /// Creates noise. Values n ticks apart have the `covariance` of n, and single ones the `third_cumulant`.
    ///
    /// The filter is the symmetric one whose gain is the root of the spectrum. The numbers it smooths are
    /// a·g + c·(g² − 1) with a² + 2c² = 1, whose third cumulant is 6c − 4c³, c to the first order.
    pub fn new(covariance: impl Fn(usize) -> f64, third_cumulant: f64) -> Self {
        let angle = |at: usize| std::f64::consts::TAU * at as f64 / POINTS as f64;
        let cosine = |one: usize, other: usize| libm::cos(angle(one * other % POINTS));
        let covariance: Vec<f64> = (0..=HALF).map(covariance).collect();
        let gain = |at: usize| {
            let both = (1..=HALF).map(|apart| 2.0 * covariance[apart] * cosine(at, apart));
            (covariance[0] + both.sum::<f64>()).max(0.0).sqrt()
        };
        let gains: Vec<f64> = (0..POINTS).map(gain).collect();
        let weight = |apart: usize| {
            (0..POINTS).map(|at| gains[at] * cosine(at, apart)).sum::<f64>() / POINTS as f64
        };
        let half: Vec<f64> = (0..=HALF).map(weight).collect();
        let weights: Vec<f64> = half[1..].iter().rev().chain(&half).copied().collect();
        let cubes: f64 = weights.iter().map(|weight| weight.powi(3)).sum();
        let skewness = if cubes > 0.0 { third_cumulant / cubes } else { 0.0 };
        let quadratic = (skewness / 6.0).clamp(-0.3, 0.3);
        let linear = (1.0 - 2.0 * quadratic * quadratic).sqrt();
        Self {
            weights: weights.iter().map(|weight| *weight as f32).collect(),
            mixture: (linear as f32, quadratic as f32),
        }
    }

    /// Adds the noise of `part` from tick `first` on to `level`.
    ///
    /// A normal number is the count of set bits among 64 random ones, less 32, over 4. The mean is 0, the
    /// variance 1 and the excess −1/32. The smoothing leaves a tenth of the excess.
    pub fn add(&self, (chance, part): (&Chance, u32), first: i64, level: &mut [f32]) {
        let block = BLOCK as i64;
        let (mut white, mut numbers): (Vec<f32>, _) = (Vec::new(), Vec::new());
        for (run, level) in level.chunks_mut(RUN).enumerate() {
            let from = first + (run * RUN) as i64 - HALF as i64;
            let last = from + (level.len() + 2 * HALF) as i64;
            white.clear();
            for index in from.div_euclid(block)..=last.div_euclid(block) {
                let address = Address { stage: Stage::Amplifier, index: index as u64, part };
                let numbers = chance.draw(address, GROUP, &mut numbers);
                let (low, high) = numbers.split_at(BLOCK);
                let known = white.len();
                white.resize(known + BLOCK, 0.0);
                mixed(low, high, self.mixture, &mut white[known..]);
            }
            let skipped = from.rem_euclid(block) as usize;
            smoothed(&white[skipped..], &self.weights, level);
        }
    }
}

#[cfg(test)]
mod tests {
    use macropulse_codec::level::forced::at_each_level;

    use super::*;

    /// The plain sums, sample by sample, on every level.
    #[test]
    fn every_level_smooths_the_same() {
        let colour = Colour::new(|apart| libm::exp(-(apart as f64).powi(2) / 3.0), 0.5);
        let white: Vec<f32> = (0..1000_u32).map(|at| (at * at % 977) as f32 - 488.0).collect();
        for length in [1, 63, 64, 65, 640, 952] {
            let sum = |at: usize| {
                colour
                    .weights
                    .iter()
                    .zip(&white[at..])
                    .fold(7.0, |sum, (weight, white)| sum + weight * white)
            };
            let expected: Vec<f32> = (0..length).map(sum).collect();
            let smooth = || {
                let mut level = vec![7.0; length];
                smoothed(&white, &colour.weights, &mut level);
                level
            };
            for (level, found) in at_each_level(smooth) {
                assert_eq!(found, expected, "{level:?}, {length}");
            }
        }
        let noise = || {
            let mut level = vec![0.0; 10_000];
            colour.add((&Chance::new(5), 0), 3, &mut level);
            level
        };
        for (level, found) in at_each_level(noise) {
            assert_eq!(found, noise(), "{level:?}");
        }
    }

    /// H0: variance, covariance and third cumulant are those asked for. N = 4·10⁶, seed 3; bounds are some
    /// five standard errors. Control: those of white noise are not.
    #[test]
    fn noise_has_the_covariance_and_the_skewness_asked_for() {
        let covariance = |apart: usize| 9.0 * libm::exp(-(apart as f64).powi(2) / 3.0);
        let colour = Colour::new(covariance, 2.0);
        let mut level = vec![0.0; 4_000_000];
        colour.add((&Chance::new(3), 0), -77, &mut level);
        let mean = |sum: f64| sum / level.len() as f64;
        let product = |apart: usize| {
            let pairs = level.iter().zip(&level[apart..]);
            mean(pairs.map(|(one, other)| f64::from(*one) * f64::from(*other)).sum())
        };
        for apart in [0, 1, 2, 4] {
            let found = product(apart);
            assert!((found - covariance(apart)).abs() < 0.06, "{apart}: {found}");
            assert!(apart == 0 || apart == 4 || found > 0.5);
        }
        let third = mean(level.iter().map(|level| f64::from(*level).powi(3)).sum());
        assert!((third - 2.0).abs() < 0.5, "{third}");
    }
}
