//! Errors of overlapping users in closed form.
//!
//! Multiple access: `K` users of a prime code send at once, each its own word, each bit lit or
//! dark with equal chance, chips aligned. A receiver correlates with one word and calls the bit
//! lit where it counts at least `w` = p. A lit bit is always found; a dark one is mistaken where
//! the K − 1 others fill the word between them. One of them adds 0, 1 or 2 marks, with the
//! probabilities q₀, q₁, q₂ of [`Hits`].
//!
//! The formulas draw the hits of all interferers independently, from the average over all pairs
//! of words. Real pairs differ: C0 meets any other word exactly once at every lag, and the others
//! are not all alike either. So the truth lies a little beside. The soft formula, with all words
//! sending, says 1.2 % too much for p = 5 and 1.5 % too little for p = 7; with all words but C0
//! it is exact for p = 5 and says 0.5 % too much for p = 7. The hard formula says 5 % and
//! 13 % too much for p = 5, because real hits do not fall on random marks.

use crate::code::{Error, Family};
use crate::units::{range_from_tof, tof_from_range};

/// Which words of a prime code are in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Words {
    /// All p of them.
    All,
    /// The p − 1 words that are not periodic.
    WithoutC0,
}

/// Users of one prime code who send at the same time, each a word of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MultipleAccess {
    p: u32,
    users: u32,
    words: Words,
}

impl MultipleAccess {
    /// `users` of the prime code over GF(`p`), the one received among them.
    ///
    /// # Errors
    /// Where there is no such code: see [`Family::prime`].
    pub fn new(p: u32, users: u32, words: Words) -> Result<Self, Error> {
        Family::prime(p)?;
        Ok(Self { p, users, words })
    }

    /// Users who disturb the one received: K − 1.
    pub fn interferers(&self) -> u32 {
        self.users.saturating_sub(1)
    }

    /// Most interferers that cannot cause an error whatever they send, since each adds at most
    /// two marks and w are needed: ⌊(w − 1) / 2⌋.
    pub fn harmless_interferers(&self) -> u32 {
        (self.p - 1) / 2
    }

    /// How one interferer meets one word \[YK13\]:
    ///
    /// * all words: `q₁ = (2p² + p + 2) / 6p²`, `q₂ = (p + 1)(p − 2) / 12p²`;
    /// * without C0: `q₁ = (2p − 1) / 6p`, `q₂ = (p + 1) / 12p`.
    pub fn hits(&self) -> Hits {
        let p = f64::from(self.p);
        let (one, two) = match self.words {
            Words::All => {
                ((2.0 * p * p + p + 2.0) / (6.0 * p * p), (p + 1.0) * (p - 2.0) / (12.0 * p * p))
            }
            Words::WithoutC0 => ((2.0 * p - 1.0) / (6.0 * p), (p + 1.0) / (12.0 * p)),
        };
        Hits { none: 1.0 - one - two, one, two }
    }
}

/// Probabilities that an interferer adds no, one or two marks to the count of a receiver, its own
/// bit being dark half of the time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hits {
    /// q₀
    pub none: f64,
    /// q₁
    pub one: f64,
    /// q₂
    pub two: f64,
}

impl Hits {
    /// Marks added on average, `q₁ + 2q₂`; equal to w² / 2N = ½ for prime codes.
    pub fn mean(&self) -> f64 {
        self.one + 2.0 * self.two
    }

    /// Variance of the marks added, `v = q₁ + 4q₂ − (q₁ + 2q₂)²`.
    pub fn variance(&self) -> f64 {
        self.one + 4.0 * self.two - self.mean().powi(2)
    }
}

/// Bit error probability where the sum of all hits passes for a normal variable:
/// `Q(w / (2·√((K − 1)·v)))`, v from [`Hits::variance`] \[YK13\].
///
/// A rough approximation: for p = 29 and 25 users it says five times too much.
pub fn bit_error_gaussian(access: &MultipleAccess) -> f64 {
    let spread = (f64::from(access.interferers()) * access.hits().variance()).sqrt();
    normal_tail(f64::from(access.p) / (2.0 * spread))
}

/// Bit error probability of a receiver that counts every hit:
/// `½·Σ_{l₁+2l₂ ≥ w} (K−1)! / (l₀! l₁! l₂!) · q₀^l₀ q₁^l₁ q₂^l₂` \[YK13\].
///
/// Summed interferer by interferer instead of term by term, see `probability_of_filling`.
pub fn bit_error_soft(access: &MultipleAccess) -> f64 {
    let hits = access.hits();
    0.5 * probability_of_filling(access, |_| [hits.none, hits.one, hits.two])
}

/// Bit error probability of a receiver that limits every chip to one mark:
/// `½·Σ_i (−1)^i C(w,i) [q₀ + q₁(w−i)/w + q₂(w−i)(w−i−1)/(w(w−1))]^(K−1)` \[YK13\].
///
/// The printed sum alternates and, at p = 29, loses all digits of an `f64`: terms of 10⁵ are to
/// leave 10⁻¹⁶. But it is inclusion and exclusion over the marks that stay dark, hence the
/// probability that interferers, each lighting one or two marks drawn at random, light all w.
/// That is counted here by the number c of marks already lit, in positive terms only: a single
/// hit is new with chance (w−c)/w, and so on.
pub fn bit_error_hard(access: &MultipleAccess) -> f64 {
    let Hits { one, two, .. } = access.hits();
    let w = f64::from(access.p);
    let pairs = w * (w - 1.0);
    0.5 * probability_of_filling(access, |lit| {
        let lit = lit as f64;
        let dark = w - lit;
        let one_more = one * dark / w + two * 2.0 * lit * dark / pairs;
        let two_more = two * dark * (dark - 1.0) / pairs;
        [1.0 - one_more - two_more, one_more, two_more]
    })
}

/// Probability that the interferers between them raise a count from 0 to w or beyond, where each
/// raises it by 0, 1 or 2 with the chances that `raise` gives for the present count.
///
/// Adds products of positive numbers only, so the relative error stays near K·10⁻¹⁶ however
/// small the result.
fn probability_of_filling(access: &MultipleAccess, raise: impl Fn(usize) -> [f64; 3]) -> f64 {
    let full = access.p as usize;
    let mut chance = vec![0.0; full + 1];
    chance[0] = 1.0;
    for _ in 0..access.interferers() {
        // From the top down, so that a count is left before anything arrives at it.
        for count in (0..full).rev() {
            let here = chance[count];
            let [stay, one, two] = raise(count);
            chance[count] = here * stay;
            chance[count + 1] += here * one;
            chance[full.min(count + 2)] += here * two;
        }
    }
    chance[full]
}

/// `Q(x)`: probability that a standard normal variable exceeds `x`.
fn normal_tail(x: f64) -> f64 {
    0.5 * libm::erfc(x * std::f64::consts::FRAC_1_SQRT_2)
}

/// Shots whose light may be under way at once: those fired while light goes to `max_range`
/// (m) and back, one every `pixel_period` (s).
pub fn shots_in_flight(max_range: f64, pixel_period: f64) -> f64 {
    tof_from_range(max_range) / pixel_period
}

/// Macropulses that arrive at any one instant, on average: `macropulse` (s) over `pixel_period`
/// (s). Every shot that is reflected arrives once, so the scene does not matter, only the
/// fraction of shots that meet something, here all.
pub fn mean_overlap(macropulse: f64, pixel_period: f64) -> f64 {
    macropulse / pixel_period
}

/// Range in metres below which a word alone tells which shot an echo belongs to, where `words`
/// words take turns, one every `pixel_period` (s).
pub fn word_reuse_range(words: u32, pixel_period: f64) -> f64 {
    range_from_tof(f64::from(words) * pixel_period)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn access(p: u32, users: u32, words: Words) -> MultipleAccess {
        MultipleAccess::new(p, users, words).unwrap()
    }

    #[test]
    fn hit_probabilities_of_the_paper() {
        let hits = access(29, 25, Words::All).hits();
        assert_relative_eq!(hits.none, 0.58026, max_relative = 1e-5);
        assert_relative_eq!(hits.one, 0.33948, max_relative = 2e-5);
        assert_relative_eq!(hits.two, 0.08026, max_relative = 5e-5);
        assert_relative_eq!(hits.variance(), 0.4105, max_relative = 1e-4);
        for words in [Words::All, Words::WithoutC0] {
            assert_relative_eq!(access(29, 25, words).hits().mean(), 0.5, max_relative = 1e-14);
        }
    }

    /// The printed sums, evaluated in exact rational arithmetic.
    #[test]
    fn both_limiters_keep_twelve_digits() {
        let exact = [
            (5, 5, Words::All, 1.31532e-2, 9.2974464e-4),
            (17, 17, Words::All, 4.877718905387e-4, 2.783136384740e-9),
            (29, 16, Words::All, 1.190617177387e-15, 8.156526741481e-27),
            (29, 25, Words::All, 3.972431919281e-7, 4.684900466319e-17),
            (5, 4, Words::WithoutC0, 5e-3, 3.6e-4),
            (29, 25, Words::WithoutC0, 5.752798832713e-7, 7.903062180532e-17),
        ];
        for (p, users, words, soft, hard) in exact {
            let access = access(p, users, words);
            assert_relative_eq!(bit_error_soft(&access), soft, max_relative = 1e-12);
            assert_relative_eq!(bit_error_hard(&access), hard, max_relative = 1e-12);
        }
    }

    #[test]
    fn fourteen_interferers_are_harmless_and_fifteen_are_not() {
        let limit = access(29, 15, Words::All);
        assert_eq!((limit.interferers(), limit.harmless_interferers()), (14, 14));
        assert_eq!((bit_error_soft(&limit), bit_error_hard(&limit)), (0.0, 0.0));
        assert!(bit_error_hard(&access(29, 16, Words::All)) > 0.0);
    }

    #[test]
    fn nobody_disturbs_a_single_user_or_none() {
        for users in [0, 1] {
            let alone = access(29, users, Words::All);
            assert_eq!(bit_error_gaussian(&alone), 0.0);
            assert_eq!(bit_error_soft(&alone), 0.0);
            assert_eq!(bit_error_hard(&alone), 0.0);
        }
    }

    #[test]
    fn a_code_that_does_not_exist_is_refused() {
        let refusal = MultipleAccess::new(28, 25, Words::All).unwrap_err();
        assert_eq!(refusal.to_string(), "28 is not an odd prime; the nearest are 23 and 29");
    }

    #[test]
    fn timing_of_the_paper() {
        let pixel_period = 1.0 / (848.0 * 480.0 * 60.0);
        let macropulse = 13.0 * 841.0 * 2.5e-12;
        assert_relative_eq!(shots_in_flight(150.0, pixel_period), 24.44, max_relative = 1e-4);
        assert_relative_eq!(mean_overlap(macropulse, pixel_period), 0.6675, max_relative = 1e-4);
        assert_relative_eq!(word_reuse_range(29, pixel_period), 178.0, max_relative = 1e-3);
    }
}
