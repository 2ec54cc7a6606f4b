//! Loops over samples: the matched filter, and the marks of a word added up at each lag.

use crate::on_every_level;

/// Lags that are looked at together, so that what is known of them stays close to the processor.
pub(crate) const LAGS: usize = 512;

/// What is known of up to [`LAGS`] lags of a shot, one after another.
pub(crate) struct Lags {
    /// The least of the marks that count; infinite where none does.
    pub least: [f32; LAGS],
    /// How much a mark counts at most.
    cap: [f32; LAGS],
    /// Marks that count.
    pub count: [f32; LAGS],
    /// Their sum, none above the cap.
    sum: [f32; LAGS],
    /// The sum over its standard deviation where there is noise alone.
    pub score: [f32; LAGS],
}

impl Default for Lags {
    fn default() -> Self {
        let none = [0.0; LAGS];
        Self { least: none, cap: none, count: none, sum: none, score: none }
    }
}

/// How marks are capped and counted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Counting {
    /// Standard deviation of the noise.
    pub sigma: f32,
    /// What n photons vary by, over n.
    pub excess: f32,
    /// Of how many of its own standard deviations a mark may exceed the least one.
    pub above: f32,
    /// Marks that must count.
    pub fewest: f32,
}

impl Counting {
    /// How much a mark counts at most where the `least` is so much.
    #[inline(always)]
    pub(crate) fn cap(&self, least: f32) -> f32 {
        let light = if least > 0.0 { least } else { 0.0 };
        least + self.above * (self.sigma * self.sigma + self.excess * light).sqrt()
    }
}

/// Samples that are filtered together.
const BLOCK: usize = 1024;

on_every_level! {
    /// Filters `samples`, of which there are `taps.len() − 1` more: entry n of `filtered` becomes
    /// Σ taps\[k\]·samples\[n + k\].
    pub(crate) fn filter(samples: &[f32], taps: &[f32], filtered: &mut [f32]) {
        for (block, sums) in filtered.chunks_mut(BLOCK).enumerate() {
            sums.fill(0.0);
            for (place, tap) in (block * BLOCK..).zip(taps) {
                let samples = &samples[place..][..sums.len()];
                for (sum, sample) in sums.iter_mut().zip(samples) {
                    *sum += tap * sample;
                }
            }
        }
    }
}

on_every_level! {
    /// Begins `count` lags.
    fn begin(lags: &mut Lags, count: usize) {
        lags.least[..count].fill(f32::INFINITY);
        lags.sum[..count].fill(0.0);
        lags.count[..count].fill(0.0);
    }
}

on_every_level! {
    /// Looks for the least mark; `mark` is the signal at one of them, infinite where it does not count.
    fn find_least(lags: &mut Lags, mark: &[f32]) {
        let count = mark.len().min(LAGS);
        for (least, mark) in lags.least[..count].iter_mut().zip(mark) {
            *least = if *mark < *least { *mark } else { *least };
        }
    }
}

on_every_level! {
    /// Caps the marks of `count` lags.
    fn cap(lags: &mut Lags, count: usize, how: &Counting) {
        for (cap, least) in lags.cap[..count].iter_mut().zip(&lags.least) {
            *cap = how.cap(*least);
        }
    }
}

on_every_level! {
    /// Adds a mark.
    fn add(lags: &mut Lags, mark: &[f32]) {
        let length = mark.len().min(LAGS);
        let so_far = lags.sum[..length].iter_mut().zip(&mut lags.count[..length]);
        for (((sum, count), cap), mark) in so_far.zip(&lags.cap[..length]).zip(mark) {
            let counts = *mark < f32::INFINITY;
            let capped = if *mark < *cap { *mark } else { *cap };
            *sum += if counts { capped } else { 0.0 };
            *count += if counts { 1.0 } else { 0.0 };
        }
    }
}

on_every_level! {
    /// Scores `count` lags, and tells the highest score.
    fn score(lags: &mut Lags, count: usize, how: &Counting) -> f32 {
        let per_sigma = 1.0 / how.sigma;
        let counted = lags.sum[..count].iter().zip(&lags.count[..count]);
        for (score, (sum, count)) in lags.score[..count].iter_mut().zip(counted) {
            let scored = sum / count.sqrt() * per_sigma;
            *score = if *count >= how.fewest { scored } else { f32::NEG_INFINITY };
        }
        let mut highest = [f32::NEG_INFINITY; 16];
        for scores in lags.score[..count].chunks(16) {
            for (highest, score) in highest.iter_mut().zip(scores) {
                *highest = if *score > *highest { *score } else { *highest };
            }
        }
        highest.into_iter().fold(f32::NEG_INFINITY, f32::max)
    }
}

impl Lags {
    /// Scores `count` lags, up to [`LAGS`], from the signal at each of the `marks`; the highest score.
    /// `signal` tells the signal at a mark, one entry for each lag, infinite where it does not count.
    pub(crate) fn score_all<'a>(
        &mut self,
        (count, how): (usize, &Counting),
        marks: impl Iterator<Item = &'a [f32]> + Clone,
    ) -> f32 {
        begin(self, count);
        marks.clone().for_each(|mark| find_least(self, mark));
        cap(self, count, how);
        marks.for_each(|mark| add(self, mark));
        score(self, count, how)
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    fn signal() -> impl Strategy<Value = Vec<f32>> {
        let value = prop_oneof![6 => -40.0..200.0_f32, 1 => Just(f32::INFINITY)];
        proptest::collection::vec(value, LAGS)
    }

    proptest! {
        #[test]
        fn every_level_filters_alike(
            samples in proptest::collection::vec(-2048.0..2048.0_f32, 1100..1300),
            taps in proptest::collection::vec(-1.0..1.0_f32, 1..12),
        ) {
            let count = samples.len() + 1 - taps.len();
            let expected: Vec<f32> = (0..count)
                .map(|n| taps.iter().zip(&samples[n..]).fold(0.0, |sum, (tap, s)| sum + tap * s))
                .collect();
            for (level, found) in at_each_level(|| {
                let mut filtered = vec![1.0; count];
                filter(&samples, &taps, &mut filtered);
                filtered
            }) {
                prop_assert_eq!(&found, &expected, "{:?}", level);
            }
        }

        #[test]
        fn every_level_scores_alike(marks in [signal(), signal(), signal()], count in 1..=LAGS) {
            let how = Counting { sigma: 36.0, excess: 5.5, above: 2.5, fewest: 2.0 };
            let mut expected = Vec::new();
            for lag in 0..count {
                let own: Vec<f32> =
                    marks.iter().map(|mark| mark[lag]).filter(|mark| mark.is_finite()).collect();
                let least = own.iter().copied().fold(f32::INFINITY, f32::min);
                let sum = own.iter().map(|mark| mark.min(how.cap(least))).sum::<f32>();
                let few = own.len() < 2;
                let root = (own.len() as f32).sqrt();
                expected.push(if few { f32::NEG_INFINITY } else { sum / root * (1.0 / 36.0) });
            }
            for (level, (scores, highest)) in at_each_level(|| {
                let mut lags = Lags::default();
                let highest =
                    lags.score_all((count, &how), marks.iter().map(|mark| &mark[..count]));
                (lags.score[..count].to_vec(), highest)
            }) {
                prop_assert_eq!(&scores, &expected, "{:?}", level);
                let most = expected.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                prop_assert_eq!(highest, most, "{:?}", level);
            }
        }
    }
}
