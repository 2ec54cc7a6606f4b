//! Errors of overlapping users in closed form.
//!
//! Multiple access: `K` users of a code family send at once, each its own word, each bit lit or
//! dark with equal chance, chips aligned. A receiver correlates with one word and calls the bit
//! lit where it counts at least `w`, all its marks. A lit bit is always found; a dark one is
//! mistaken where the K − 1 others fill the word between them. One of them adds k marks with the
//! probability q_k of [`Hits`].
//!
//! The formulas draw the hits of all interferers independently, from the average over all pairs of words.
//! Real pairs differ: C0 of a prime code meets any other word exactly once at every lag, and the others are
//! not all alike either. So the truth lies a little beside. The soft formula, with all words sending, says
//! 1.2 % too much for p = 5 and 1.5 % too little for p = 7. With all words but C0 it is exact for p = 5 and
//! says 0.5 % too much for p = 7. The hard formula says 5 % and 13 % too much for p = 5, because real hits do
//! not fall on random marks.

use crate::units::{range_from_tof, tof_from_range};
use macropulse_codec::code::correlation::{aperiodic, periodic};
use macropulse_codec::code::{CodeWord, Error, Family};
use macropulse_codec::statistics::normal_tail;

/// Which words of a prime code are in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Words {
    /// All p of them.
    All,
    /// The p − 1 words that are not periodic.
    WithoutC0,
}

/// Users of one code who send at the same time, each a word of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct MultipleAccess {
    weight: usize,
    users: u32,
    hits: Hits,
}

impl MultipleAccess {
    /// `users`, the one received among them, of words of `weight` marks that meet by `hits`.
    pub fn new(weight: usize, users: u32, hits: Hits) -> Self {
        Self { weight, users, hits }
    }

    /// `users` of the prime code over GF(`p`).
    ///
    /// # Errors
    /// If there is no such code: see [`Family::prime`].
    pub fn prime(p: u32, users: u32, words: Words) -> Result<Self, Error> {
        Ok(Self::new(Family::prime(p)?.weight(), users, Hits::prime(p, words)))
    }

    /// `users` of a code with these `words`, compared each with every other one. If they differ in weight,
    /// the one received is the lightest, which is filled first.
    pub fn of_words(words: &[CodeWord], users: u32) -> Self {
        let lightest = words.iter().map(CodeWord::weight).min().unwrap_or(0);
        Self::new(lightest, users, Hits::of_words(words))
    }

    /// The same with another number of `users`.
    pub fn with_users(&self, users: u32) -> Self {
        Self { users, ..self.clone() }
    }

    /// Users who disturb the one received: K − 1.
    pub fn interferers(&self) -> u32 {
        self.users.saturating_sub(1)
    }

    /// Most interferers that cannot cause an error whatever they send, since each adds at most
    /// λ marks and w are needed: ⌊(w − 1) / λ⌋. `None` where no number of them can.
    pub fn harmless_interferers(&self) -> Option<u32> {
        (self.weight.saturating_sub(1) as u32).checked_div(self.hits.most() as u32)
    }

    /// How one interferer meets one word.
    pub fn hits(&self) -> &Hits {
        &self.hits
    }
}

/// Probabilities q₀, q₁ … q_λ that an interferer adds 0, 1 … λ marks to the count of a receiver, its own bit
/// being dark half of the time.
#[derive(Debug, Clone, PartialEq)]
pub struct Hits {
    chances: Vec<f64>,
}

impl Hits {
    /// By the chances q₀, q₁ … q_λ, which must add up to 1.
    pub fn new(chances: Vec<f64>) -> Self {
        Self { chances }
    }

    /// The words of the prime code over GF(`p`) \[YK13\]:
    ///
    /// * all words: `q₁ = (2p² + p + 2) / 6p²`, `q₂ = (p + 1)(p − 2) / 12p²`;
    /// * without C0: `q₁ = (2p − 1) / 6p`, `q₂ = (p + 1) / 12p`.
    pub fn prime(p: u32, words: Words) -> Self {
        let p = f64::from(p);
        let (one, two) = match words {
            Words::All => {
                ((2.0 * p * p + p + 2.0) / (6.0 * p * p), (p + 1.0) * (p - 2.0) / (12.0 * p * p))
            }
            Words::WithoutC0 => ((2.0 * p - 1.0) / (6.0 * p), (p + 1.0) / (12.0 * p)),
        };
        Self::new(vec![1.0 - one - two, one, two])
    }

    /// The words of an optical orthogonal code (`length`, `weight`, 1): `q₁ = w² / 2n` \[Sal89\].
    pub fn orthogonal(length: u32, weight: u32) -> Self {
        let one = f64::from(weight).powi(2) / (2.0 * f64::from(length));
        Self::new(vec![1.0 - one, one])
    }

    /// As `words` meet each other by periodic correlation, all pairs of different ones and all lags
    /// alike. Without a pair nothing is ever met.
    pub fn of_words(words: &[CodeWord]) -> Self {
        let mut counts = Vec::new();
        for (i, own) in words.iter().enumerate() {
            // Exchanging two words only turns the lags round.
            for hits in words[..i].iter().flat_map(|other| periodic(own, other)) {
                let hits = usize::from(hits);
                counts.resize(counts.len().max(hits + 1), 0);
                counts[hits] += 1;
            }
        }
        Self::of_counts(&counts)
    }

    /// As `words` meet each other if an interferer begins at any chip of the bit that is received. The end of
    /// one of its bits and the beginning of the next are seen, either lit half of the time. With b₀, b₁ the
    /// bits and C the aperiodic correlation, b₀·C(τ − L) + b₁·C(τ) marks are met. All pairs of different
    /// words and all τ from 0 to L − 1 count alike.
    pub fn of_unaligned_words(words: &[CodeWord]) -> Self {
        let mut counts: Vec<u64> = Vec::new();
        let ordered = words.iter().enumerate().flat_map(|(i, own)| {
            words
                .iter()
                .enumerate()
                .filter(move |(j, _)| *j != i)
                .map(move |(_, other)| (own, other))
        });
        for (own, other) in ordered {
            let met = aperiodic(own, other);
            let length = own.length.max(other.length) as i32;
            for delay in 0..length {
                let [end, begin] = [met.at(delay - length), met.at(delay)].map(usize::from);
                for marks in [0, end, begin, end + begin] {
                    counts.resize(counts.len().max(marks + 1), 0);
                    counts[marks] += 1;
                }
            }
        }
        let all = counts.iter().sum::<u64>().max(1) as f64;
        let chances: Vec<f64> = counts.iter().map(|&count| count as f64 / all).collect();
        Self::new(if chances.is_empty() { vec![1.0] } else { chances })
    }

    /// The probabilities for words that share 0, 1 … λ marks at `counts` lags each.
    pub(super) fn of_counts(counts: &[u64]) -> Self {
        let all = counts.iter().sum::<u64>() as f64;
        // The bit of the interferer is dark half of the time.
        let lit = counts.iter().skip(1).map(|&count| count as f64 / all / 2.0);
        let none = 1.0 - lit.clone().sum::<f64>();
        Self::new(std::iter::once(none).chain(lit).collect())
    }

    /// q_`marks`; 0 for more marks than are ever met.
    pub fn chance(&self, marks: usize) -> f64 {
        self.chances.get(marks).copied().unwrap_or(0.0)
    }

    /// λ: most marks that are ever met.
    pub fn most(&self) -> usize {
        self.chances.iter().rposition(|&chance| chance > 0.0).unwrap_or(0)
    }

    /// Marks added on average, `Σ k·q_k`; w² / 2N for words of one weight.
    pub fn mean(&self) -> f64 {
        self.moment(1)
    }

    /// Variance of the marks added, `v = Σ k²·q_k − (Σ k·q_k)²`.
    pub fn variance(&self) -> f64 {
        self.moment(2) - self.mean().powi(2)
    }

    fn moment(&self, power: i32) -> f64 {
        (0..).zip(&self.chances).map(|(marks, chance)| f64::from(marks).powi(power) * chance).sum()
    }
}

/// Bit error probability where the sum of all hits passes for a normal variable:
/// `Q(w / (2·√((K − 1)·v)))`, v from [`Hits::variance`] \[YK13\].
///
/// A rough approximation: for p = 29 and 25 users it says five times too much.
pub fn bit_error_gaussian(access: &MultipleAccess) -> f64 {
    let spread = (f64::from(access.interferers()) * access.hits.variance()).sqrt();
    normal_tail(access.weight as f64 / (2.0 * spread))
}

/// Bit error probability of a receiver that counts every hit: half the probability that the hits
/// of K − 1 interferers add up to w or more. For λ = 2 that is
/// `½·Σ_{l₁+2l₂ ≥ w} (K−1)! / (l₀! l₁! l₂!) · q₀^l₀ q₁^l₁ q₂^l₂` \[YK13\].
///
/// Summed interferer by interferer instead of term by term, see `probability_of_filling`.
pub fn bit_error_soft(access: &MultipleAccess) -> f64 {
    0.5 * probability_of_filling(access, |_, more| access.hits.chance(more))
}

/// Bit error probability of a receiver that limits every chip to one mark. For λ = 2 that is
/// `½·Σ_i (−1)^i C(w,i) [q₀ + q₁(w−i)/w + q₂(w−i)(w−i−1)/(w(w−1))]^(K−1)` \[YK13\], for λ = 1 the
/// formula of \[Sal89\].
///
/// The printed sum alternates and, at p = 29, loses all digits of an `f64`: terms of 10⁵ are to
/// leave 10⁻¹⁶. But it is inclusion and exclusion over the marks that stay dark, hence the
/// probability that interferers, each lighting k marks drawn at random with chance q_k, light all
/// w. That is counted here by the number c of marks already lit, in positive terms only: of k hits,
/// h are new with the chance `C(w−c, h)·C(c, k−h) / C(w, k)`.
pub fn bit_error_hard(access: &MultipleAccess) -> f64 {
    let (w, most) = (access.weight, access.hits.most());
    0.5 * probability_of_filling(access, |lit, new| {
        let ways = |hits: usize| {
            access.hits.chance(hits) * choose(w - lit, new) * choose(lit, hits - new)
                / choose(w, hits)
        };
        (new..=most.min(w)).map(ways).sum()
    })
}

/// `C(n, k)`
fn choose(n: usize, k: usize) -> f64 {
    if k > n {
        return 0.0;
    }
    (0..k).fold(1.0, |ways, drawn| ways * (n - drawn) as f64 / (drawn + 1) as f64)
}

/// Probability that the interferers between them raise a count from 0 to w or beyond. Each raises it by 0, 1
/// … λ with the chances that `raise` gives for the present count.
///
/// Adds products of positive numbers only, so the relative error stays near K·10⁻¹⁶ however
/// small the result.
fn probability_of_filling(access: &MultipleAccess, raise: impl Fn(usize, usize) -> f64) -> f64 {
    let (full, most) = (access.weight, access.hits.most());
    let raises: Vec<Vec<f64>> =
        (0..full).map(|count| (0..=most).map(|more| raise(count, more)).collect()).collect();
    let mut chance = vec![0.0; full + 1];
    chance[0] = 1.0;
    for _ in 0..access.interferers() {
        // From the top down, so that a count is left before anything arrives at it.
        for count in (0..full).rev() {
            let here = chance[count];
            chance[count] = here * raises[count][0];
            for more in 1..=most {
                chance[full.min(count + more)] += here * raises[count][more];
            }
        }
    }
    chance[full]
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
        MultipleAccess::prime(p, users, words).unwrap()
    }

    #[test]
    fn hit_probabilities_of_the_paper() {
        let hits = Hits::prime(29, Words::All);
        assert_relative_eq!(hits.chance(0), 0.58026, max_relative = 1e-5);
        assert_relative_eq!(hits.chance(1), 0.33948, max_relative = 2e-5);
        assert_relative_eq!(hits.chance(2), 0.08026, max_relative = 5e-5);
        assert_eq!((hits.chance(3), hits.most()), (0.0, 2));
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
        assert_eq!((limit.interferers(), limit.harmless_interferers()), (14, Some(14)));
        assert_eq!((bit_error_soft(&limit), bit_error_hard(&limit)), (0.0, 0.0));
        assert!(bit_error_hard(&access(29, 16, Words::All)) > 0.0);
    }

    #[test]
    fn a_single_user_or_none_is_not_disturbed() {
        for users in [0, 1] {
            let alone = access(29, users, Words::All);
            assert_eq!(bit_error_gaussian(&alone), 0.0);
            assert_eq!(bit_error_soft(&alone), 0.0);
            assert_eq!(bit_error_hard(&alone), 0.0);
        }
    }

    #[test]
    fn a_word_that_meets_no_other_is_never_filled() {
        let words = Family::m_sequence(5).unwrap().words();
        let alone = MultipleAccess::of_words(&words, 25);
        assert_eq!((alone.hits().most(), alone.harmless_interferers()), (0, None));
        assert_eq!((bit_error_soft(&alone), bit_error_hard(&alone)), (0.0, 0.0));
    }

    #[test]
    fn a_code_that_does_not_exist_is_refused() {
        let refusal = MultipleAccess::prime(28, 25, Words::All).unwrap_err();
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
