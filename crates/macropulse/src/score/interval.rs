//! Intervals in which a true value lies with 95 % confidence.
//!
//! The seed is repeated. The pixels of one scan are no independent trials: they share the surfaces they look
//! at, the marks that fall on each other and the search of the receiver. Two seeds are independent. Every
//! interval here therefore takes its scatter from seed to seed. It is conditional on the scene: other
//! surfaces are not part of the chance.

use macropulse_codec::statistics::student_95;

/// Both tails of the standard normal distribution beyond this hold 5 %.
const NORMAL: f64 = 1.959_963_984_540_054;

/// A value with the interval in which the truth lies with 95 % confidence. The ends are NaN where
/// there is too little to say; the value too where there is nothing at all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The best guess.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Estimate {
    /// Nothing is known.
    const NONE: Self = Self { value: f64::NAN, low: f64::NAN, high: f64::NAN };

    /// The probability behind `counts`, hits and trials of each seed.
    ///
    /// Wilson's interval \[Wilson27\] for p = x/n, all hits over all trials, with an effective
    /// number of trials in place of n \[KG98, FLLS19\]:
    ///
    /// `n* = n / d · (z/t)²`, `d = max(1, v·n / (p(1 − p)))`,
    /// `v = m/(m − 1) · Σ(xⱼ − p·nⱼ)² / n²`,
    ///
    /// Here m is the number of seeds, and v the variance of p as the scatter between seeds shows it. The
    /// factor d says how many times larger v is than for independent trials. The quantiles are z of the
    /// normal distribution and t of Student's with m − 1 degrees of freedom. Student's pays for v being
    /// estimated from few seeds. So
    ///
    /// - pixels that fail together widen the interval as they should, and Student's interval over
    ///   the means of the seeds would say about the same;
    /// - yet it stays within \[0, 1\] and is skewed near its ends. It keeps a width if not one hit was met or
    ///   missed and the scatter is 0: the trials then count as independent;
    /// - it is never narrower than Wilson's own: scatter that is small by luck does not count, nor
    ///   does the smaller one of pixels that differ among themselves.
    ///
    /// One seed shows no scatter: then n* = n, and the interval is too narrow where pixels fail
    /// together.
    pub fn of_rate(counts: &[[u64; 2]]) -> Self {
        let counts: Vec<[f64; 2]> = counts
            .iter()
            .filter(|[_, trials]| *trials > 0)
            .map(|count| count.map(|number| number as f64))
            .collect();
        let [hits, trials] =
            counts.iter().fold([0.0, 0.0], |sum, count| [sum[0] + count[0], sum[1] + count[1]]);
        if trials == 0.0 {
            return Self::NONE;
        }
        let value = hits / trials;
        let [low, high] = wilson(value, effective_trials(&counts, value, trials));
        Self { value, low, high }
    }

    /// The mean behind `values`, one for each seed: Student's interval,
    /// `mean ± t·s/√m`, s² the variance of the m values. Values that are no numbers are left out;
    /// of a single value there is no interval.
    ///
    /// The values are means or deviations over many pixels, so they are nearly normal whatever the
    /// pixels are. An interval of the deviation by χ² would take every single error for normal and
    /// independent; those of a converter are neither.
    pub fn of_mean(values: &[f64]) -> Self {
        let values: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        if values.len() < 2 {
            return Self { value: mean, ..Self::NONE };
        }
        let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        let half = student_95(values.len() as u32 - 1) * (squares / (count - 1.0) / count).sqrt();
        Self { value: mean, low: mean - half, high: mean + half }
    }

    /// The same with both ends at `least` or above, for what cannot be below.
    pub fn at_least(self, least: f64) -> Self {
        // Comparisons with NaN are false: what is unknown stays so.
        let lift = |end: f64| if end < least { least } else { end };
        Self { low: lift(self.low), high: lift(self.high), ..self }
    }
}

/// Returns the number of independent trials that `counts` are worth, see [`Estimate::of_rate`].
fn effective_trials(counts: &[[f64; 2]], value: f64, trials: f64) -> f64 {
    let seeds = counts.len() as f64;
    if counts.len() < 2 {
        return trials;
    }
    let squares = counts.iter().map(|[hits, n]| (hits - value * n).powi(2)).sum::<f64>();
    let variance = seeds / (seeds - 1.0) * squares / trials.powi(2);
    let independent = value * (1.0 - value) / trials;
    let excess = if independent > 0.0 { (variance / independent).max(1.0) } else { 1.0 };
    trials / excess * (NORMAL / student_95(counts.len() as u32 - 1)).powi(2)
}

/// Wilson's interval for a share `p` of `n` independent trials, n not necessarily whole
/// \[Wilson27\]: `(p + z²/2n ± z·√(p(1 − p)/n + z²/4n²)) / (1 + z²/n)`.
fn wilson(p: f64, n: f64) -> [f64; 2] {
    let z2 = NORMAL * NORMAL / n;
    let half = (p * (1.0 - p) * z2 + z2 * z2 / 4.0).sqrt();
    let end = |half: f64| (p + z2 / 2.0 + half) / (1.0 + z2);
    // Both are exact where no trial or every trial was a hit; rounding must not say otherwise.
    [end(-half).clamp(0.0, p), end(half).clamp(p, 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The tables of every textbook.
    /// The examples by which seven methods were compared \[Newc98\], to their four digits.
    #[test]
    fn intervals_of_wilson() {
        for (hits, trials, low, high) in [
            (81, 263, 0.2553, 0.3662),
            (15, 148, 0.0624, 0.1605),
            (0, 20, 0.0, 0.1611),
            (1, 29, 0.0061, 0.1718),
        ] {
            let estimate = Estimate::of_rate(&[[hits, trials]]);
            assert_relative_eq!(estimate.low, low, epsilon = 5e-5);
            assert_relative_eq!(estimate.high, high, epsilon = 5e-5);
        }
        assert_eq!(Estimate::of_rate(&[[0, 20]]).low, 0.0);
        assert_eq!(Estimate::of_rate(&[[20, 20]]).high, 1.0);
    }

    /// By hand: p = 1/2, Σ(x − pn)² = 800, v = 2·800/200² = 0.04, v·n/p(1−p) = 32, t = 12.706.
    #[test]
    fn seeds_that_disagree_are_worth_few_trials() {
        let counts = [[70.0, 100.0], [30.0, 100.0]];
        let wanted = 200.0 / 32.0 * (NORMAL / 12.706_204_736_f64).powi(2);
        assert_relative_eq!(effective_trials(&counts, 0.5, 200.0), wanted, max_relative = 1e-9);
        // Agreement beyond chance earns nothing.
        let counts = [[50.0, 100.0]; 2];
        let wanted = 200.0 * (NORMAL / 12.706_204_736_f64).powi(2);
        assert_relative_eq!(effective_trials(&counts, 0.5, 200.0), wanted, max_relative = 1e-9);
    }

    #[test]
    fn what_was_not_counted_is_not_known() {
        for estimate in [Estimate::of_rate(&[]), Estimate::of_rate(&[[0, 0], [0, 0]])] {
            assert!(estimate.value.is_nan() && estimate.low.is_nan() && estimate.high.is_nan());
        }
        assert_eq!(Estimate::of_rate(&[[0, 0], [3, 4]]).value, 0.75);
        assert!(Estimate::of_mean(&[]).value.is_nan());
        let one = Estimate::of_mean(&[f64::NAN, 3.0]);
        assert!(one.value == 3.0 && one.low.is_nan() && one.at_least(5.0).low.is_nan());
    }

    #[test]
    fn a_mean_of_three() {
        let Estimate { value, low, high } = Estimate::of_mean(&[1.0, 2.0, 3.0]);
        let half = 4.302_652_730 / 3.0_f64.sqrt();
        assert_eq!(value, 2.0);
        assert_relative_eq!(low, 2.0 - half, max_relative = 1e-9);
        assert_relative_eq!(high, 2.0 + half, max_relative = 1e-9);
        assert_eq!(Estimate::of_mean(&[1.0, 2.0, 3.0]).at_least(0.0).low, 0.0);
    }

    /// Share of `TRIALS` sweeps whose interval holds the truth, less 0.95, in standard deviations.
    const TRIALS: usize = 4000;

    fn excess_coverage(covers: impl Fn(&mut ChaCha8Rng) -> bool) -> f64 {
        let mut chance = ChaCha8Rng::seed_from_u64(1);
        let covered = (0..TRIALS).filter(|_| covers(&mut chance)).count() as f64;
        (covered - 0.95 * TRIALS as f64) / (0.95 * 0.05 * TRIALS as f64).sqrt()
    }

    /// Returns hits and pixels of a scan of 400 pixels. The pixels of each run of `together` come out alike.
    fn scan(chance: &mut ChaCha8Rng, truth: f64, together: u64) -> [u64; 2] {
        let runs = (0..400 / together).filter(|_| chance.random_bool(truth)).count() as u64;
        [together * runs, 400]
    }

    /// H0: the interval covers the truth 95 times in 100 or more. N = 4000 sweeps of 8 seeds, seed
    /// 1, α = 1e-6 for each case (z > −4.75).
    #[test]
    fn a_rate_is_covered_whether_pixels_fail_alone_or_together() {
        let covers = |truth: f64, together: u64| {
            excess_coverage(|chance| {
                let counts = [(); 8].map(|()| scan(chance, truth, together));
                let Estimate { low, high, .. } = Estimate::of_rate(&counts);
                (low..=high).contains(&truth)
            })
        };
        for (truth, together) in [(0.5, 1), (0.01, 1), (0.999, 1), (0.5, 20), (0.1, 20)] {
            let z = covers(truth, together);
            assert!(z > -4.75, "{truth}, {together} together: {z}");
        }
    }

    /// Negative control: Wilson's interval over all pixels as if they were independent.
    #[test]
    fn without_the_scatter_between_seeds_coverage_is_lost() {
        let z = excess_coverage(|chance| {
            let hits: u64 = (0..8).map(|_| scan(chance, 0.5, 20)[0]).sum();
            let [low, high] = wilson(hits as f64 / 3200.0, 3200.0);
            (low..=high).contains(&0.5)
        });
        assert!(z < -4.75, "{z}");
    }

    /// H0: 95 times in 100 exactly. N = 4000 sweeps of 4 seeds, seed 1, α = 1e-6 (|z| < 4.9); and
    /// the control, with the normal quantile for Student's, is rejected.
    #[test]
    fn a_mean_is_covered() {
        let covers = |shrink: f64| {
            excess_coverage(|chance| {
                let mean =
                    |chance: &mut ChaCha8Rng| (0..50).map(|_| chance.random::<f64>()).sum::<f64>();
                let values = [(); 4].map(|()| mean(chance));
                let Estimate { value, high, .. } = Estimate::of_mean(&values);
                (value - 25.0).abs() <= (high - value) * shrink
            })
        };
        let z = covers(1.0);
        assert!(z.abs() < 4.9, "{z}");
        assert!(covers(NORMAL / student_95(3)) < -4.9);
    }
}
