//! Belief: the one rule by which light is taken for a return.
//!
//! A hypothesis is a shot and a lag. Three numbers decide about it, all in nats:
//!
//! * The **evidence** of its marks against chance, [`evidence`].
//! * The **prior** probability of its lag, [`Prior`], made from returns of other shots.
//! * The **threshold** ln(1/α), where α is the number of false returns accepted per shot.
//!
//! A hypothesis is believed if evidence + ln prior ≥ ln(1/α). Under chance the mean of exp(evidence) is 1 at
//! every lag, and the prior sums to 1 over all lags. So the mean of Σ prior·exp(evidence) is 1, and by Markov's
//! inequality chance makes any lag of a shot believed with a probability of α at most.
//!
//! Hypotheses compete for light. A return claims the places of its marks, and what it claims is evidence for no
//! less full hypothesis: `settle`. Light may carry another label than the shot: `contradiction`.
//!
//! This module knows neither ticks nor code words. A receiver tells it through `Light` what it counted.

use std::cmp::Ordering;
use std::f64::consts::LN_2;
use std::ops::Range;
use std::sync::LazyLock;

use libm::{exp, lgamma, log, log1p};

/// Euler's constant γ.
const EULER: f64 = 0.577_215_664_901_532_9;

/// The prior probability that light shows every mark.
///
/// Bright light does, and without this a whole word of few marks is hardly more evidence than one with gaps. Chosen on two
/// scenes that no goal uses, `crossing` and `car-70m` with seed 11: ⅛ loses 40 % of what `coded-practical` finds of `car-70m`
/// with crosstalk from chip to chip left out, ½ makes `kim-park-2016` miss 1.4 % more there.
const BRIGHT: f64 = 0.25;

/// Marks of a hypothesis that no fuller return claims.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Marks {
    /// Marks that are lit, k.
    pub lit: u32,
    /// All of them, n.
    pub of: u32,
}

impl Marks {
    /// Compares the shares of lit marks.
    fn cmp_share(self, other: Self) -> Ordering {
        let cross = |one: Self, other: Self| u64::from(one.lit) * u64::from(other.of);
        cross(self, other).cmp(&cross(other, self))
    }
}

/// The light that no return explains and that chance may light marks with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surroundings {
    /// Lit places about the marks, t.
    pub lit: f64,
    /// All places about the marks, m.
    pub places: f64,
    /// Share of lit places in all the light of the shot, d₀, above 0.
    pub density: f64,
}

impl Surroundings {
    /// The expected density of lit places, (t + 1)/(m + 1/d₀).
    fn mean(&self) -> f64 {
        (self.lit + 1.0) / (self.places + self.density.recip())
    }

    /// The second parameter of the distribution that the places leave the density, m − t + b.
    fn dark(&self) -> f64 {
        (self.places - self.lit).max(0.0) + (self.density.recip() - 1.0).max(1.0)
    }
}

/// Evidence for light at the `marks`, in nats: the logarithm of a Bayes factor.
///
/// *Chance* lights a place with the density d, be it a mark or not. d is not known: it has the distribution
/// Beta(1, 1/d₀ − 1), whose mean is d₀. *Light* leaves the other places to chance. It is bright with the probability
/// w = ¼, and then shows every mark; else it shows each mark with a probability q, log-uniform on (0, 1). It shows
/// at least two marks of a word that has two: a single mark has no distance to another, which would tell the word.
///
/// With k of n marks and t of m other places lit, the probabilities of one such outcome are, with b = 1/d₀ − 1,
///
/// > chance: B(k + t + 1, n + m − k − t + b) / B(1, b)
/// >
/// > light: S(k, n) · B(t + 1, m − t + b) / B(1, b)
/// >
/// > S(k, n) = (1 − w)·B(k, n − k + 1)/(Hₙ − 1), and w more if k = n; S(1, 1) = 1
///
/// where Hₙ = 1 + ½ + … + 1/n makes S sum to 1 over all outcomes with k ≥ 2. The evidence is the logarithm of their
/// quotient. In the limit of a known density, m → ∞ with t/m = d, it becomes
///
/// > E(k, n, d) = ln S(k, n) − k·ln d − (n − k)·ln(1 − d).
///
/// Both hypotheses are distributions over (k, t), so the mean of exp(evidence) under chance is exactly 1. This is a
/// mean over d, too. At a given density up to twice the expected one the tail P(evidence ≥ x) stays below
/// max(1, d/d₀)·e⁻ˣ; a test sums it up. To put a mean density into E instead saves 1 to 2 nats and has no such bound.
///
/// Light adds marks: no more lit ones than chance gives, k/n ≤ (t + 1)/(m + 1/d₀), are no evidence at all, −∞.
pub fn evidence(marks: Marks, around: &Surroundings) -> f64 {
    match f64::from(marks.lit) > f64::from(marks.of) * around.mean() {
        true => log_factor(marks, around),
        false => f64::NEG_INFINITY,
    }
}

/// The evidence E(k, n, d) where chance lights places with a known `density`, d.
pub(super) fn evidence_at(marks: Marks, density: f64) -> f64 {
    let [lit, of] = [marks.lit, marks.of].map(f64::from);
    if lit <= of * density {
        return f64::NEG_INFINITY;
    }
    let dark = if lit < of { (of - lit) * log1p(-density) } else { 0.0 };
    log_light(lit, of) - lit * log(density) - dark
}

/// The logarithm of the Bayes factor, be it for light or against it.
fn log_factor(marks: Marks, around: &Surroundings) -> f64 {
    let [k, n] = [marks.lit, marks.of].map(f64::from);
    let t = around.lit;
    let dark = around.dark();
    let beside = log_gamma(t + 1.0) + log_gamma(dark) - log_gamma(t + dark + 1.0);
    let chance = log_gamma(k + t + 1.0) + log_gamma(n - k + dark) - log_gamma(n + t + dark + 1.0);
    log_light(k, n) + beside - chance
}

/// ln S(k, n), see [`evidence`].
fn log_light(k: f64, n: f64) -> f64 {
    static OF_WHOLE: LazyLock<[f64; IN_TABLE]> =
        LazyLock::new(|| std::array::from_fn(|whole| log_of_all(whole as f64)));
    static SUMS: LazyLock<[f64; IN_TABLE]> =
        LazyLock::new(|| std::array::from_fn(|whole| log_sum(whole as f64)));
    if n < 2.0 {
        return 0.0;
    }
    if k < 2.0 {
        return f64::NEG_INFINITY;
    }
    if k >= n {
        return OF_WHOLE.get(n as usize).copied().unwrap_or_else(|| log_of_all(n));
    }
    let one_way = log_gamma(k) + log_gamma(n - k + 1.0) - log_gamma(n + 1.0);
    one_way - SUMS.get(n as usize).copied().unwrap_or_else(|| log_sum(n))
}

/// ln S(n, n).
fn log_of_all(n: f64) -> f64 {
    log(BRIGHT + exp(-log(n) - log_sum(n)))
}

/// ln((Hₙ − 1)/(1 − w)), the sum that S is divided by.
fn log_sum(n: f64) -> f64 {
    log((harmonic(n) - 1.0) / (1.0 - BRIGHT))
}

/// Tables hold ln Γ and the terms of [`log_light`] for whole numbers below this one.
const IN_TABLE: usize = 1024;

/// From here on ln Γ is that of Stirling's series.
const STIRLING: f64 = 48.0;

/// ln Γ(x) for x > 0, to 10⁻¹¹.
fn log_gamma(x: f64) -> f64 {
    static OF_WHOLE: LazyLock<[f64; IN_TABLE]> =
        LazyLock::new(|| std::array::from_fn(|whole| lgamma(whole as f64)));
    let whole = x as usize;
    if whole < IN_TABLE && whole as f64 == x {
        return OF_WHOLE[whole];
    }
    if x < STIRLING {
        return lgamma(x);
    }
    let (inverse, half_log_tau) = (x.recip(), 0.918_938_533_204_672_7);
    let rest = inverse * (1.0 / 12.0 - inverse * inverse / 360.0);
    (x - 0.5) * log(x) - x + half_log_tau + rest
}

/// The digamma function ψ(x), the derivative of ln Γ, for x > 0, to 10⁻⁷.
fn digamma(x: f64) -> f64 {
    if x < 6.0 {
        return digamma(x + 1.0) - x.recip();
    }
    let square = (x * x).recip();
    log(x) - 0.5 / x - square * (1.0 / 12.0 - square / 120.0)
}

/// The harmonic number Hₙ = 1 + ½ + … + 1/n of a whole `n`, to 10⁻¹¹; from 32 on by Euler and Maclaurin.
fn harmonic(n: f64) -> f64 {
    if n < 32.0 {
        return (1..=n as u32).map(|term| f64::from(term).recip()).sum();
    }
    let square = (n * n).recip();
    log(n) + EULER + 0.5 / n - square * (1.0 / 12.0 - square / 120.0)
}

/// The prior probability of each lag of a shot. It sums to 1 over all lags.
///
/// > π(l) = ½·1/L + ½·mean over neighbours j of 1/(Zⱼ·(1 + |l − lⱼ|)).
///
/// L is the number of lags. Zⱼ = H(lⱼ) + H(L + 1 − lⱼ) − 1 makes each peak sum to 1, where the lag lⱼ counts from one.
/// A peak has no width: each octave of distance is about as likely as the next. Without neighbours the prior is
/// uniform. Neighbours must not depend on the light of the shot.
#[derive(Debug, Clone)]
pub struct Prior {
    lags: Range<i64>,
    /// The uniform part.
    even: f64,
    /// Lags of neighbours, and the probability there.
    peaks: Vec<(i64, f64)>,
}

impl Prior {
    /// That of `lags`, with neighbours at the lags given; one beyond the lags counts at their end.
    pub fn new(lags: Range<i64>, neighbours: &[i64]) -> Self {
        let all = (lags.end - lags.start).max(1) as f64;
        let (even, share) = match neighbours.len() {
            0 => (1.0, 0.0),
            some => (0.5, 0.5 / some as f64),
        };
        let peak = |lag: &i64| {
            let lag = (*lag).clamp(lags.start, (lags.end - 1).max(lags.start));
            let place = (lag - lags.start + 1) as f64;
            (lag, share / (harmonic(place) + harmonic(all + 1.0 - place) - 1.0))
        };
        let peaks = neighbours.iter().map(peak).collect();
        Self { even: even / all, peaks, lags }
    }

    /// By how many nats neighbours make `lag` likelier than a uniform prior does, ln π + ln L.
    pub fn expected(&self, lag: i64) -> f64 {
        self.at(lag) + log((self.lags.end - self.lags.start).max(1) as f64)
    }

    /// How many nats neighbours can make one of the lags likelier than another at most, ln(1 + L/H(L)).
    pub fn sway(&self) -> f64 {
        let all = (self.lags.end - self.lags.start).max(1) as f64;
        log(1.0 + all / harmonic(all))
    }

    /// The lags at which neighbours lead to expect light, ascending, each once.
    pub fn expected_lags(&self) -> Vec<i64> {
        let mut lags: Vec<i64> = self.peaks.iter().map(|(lag, _)| *lag).collect();
        lags.sort_unstable();
        lags.dedup();
        lags
    }

    /// The lags that have a probability.
    pub fn lags(&self) -> &Range<i64> {
        &self.lags
    }

    /// ln π of `lag`.
    pub fn at(&self, lag: i64) -> f64 {
        self.most(&(lag..lag + 1))
    }

    /// A bound of ln π over some `lags`, which all of them stay below; exact for a single one.
    pub fn most(&self, lags: &Range<i64>) -> f64 {
        let of = |(lag, most): &(i64, f64)| {
            most / (1 + (lags.start - lag).max(lag - (lags.end - 1)).max(0)) as f64
        };
        log(self.even + self.peaks.iter().map(of).sum::<f64>())
    }
}

/// The threshold ln(1/α) for `false_alarm` false returns accepted per shot.
pub fn threshold(false_alarm: f64) -> f64 {
    -log(false_alarm)
}

/// By how many nats light of another label explains a macropulse better than that of its own, which lights the bits
/// `lit` and leaves the bits `dark`. The label is contradicted where this is above 0.
///
/// Light of unknown origin has any of the 2ᵇ labels of b bits with the same probability, and any of L lags. The label
/// for which j bits speak best lights the j fullest ones, Sⱼ. So the comparison is that of posterior odds,
///
/// > max over j of E(Sⱼ) − b·ln 2 − ln L − \[E(own) + ln π(l)\],
///
/// where `expected` is ln π(l) + ln L, by which neighbours make the lag likelier than others: [`Prior::expected`].
pub(super) fn contradiction(
    lit: &[Marks],
    dark: &[Marks],
    around: &Surroundings,
    expected: f64,
) -> f64 {
    let add = |sum: &mut Marks, bit: &Marks| {
        *sum = Marks { lit: sum.lit + bit.lit, of: sum.of + bit.of };
        Some(*sum)
    };
    let own = lit.iter().scan(Marks::default(), add).last().unwrap_or_default();
    let mut bits: Vec<Marks> = lit.iter().chain(dark).filter(|bit| bit.of > 0).copied().collect();
    bits.sort_by(|one, other| other.cmp_share(*one));
    let fullest = bits.iter().scan(Marks::default(), add);
    let best = fullest.map(|sum| evidence(sum, around)).fold(f64::NEG_INFINITY, f64::max);
    if best == f64::NEG_INFINITY {
        return best;
    }
    best - evidence(own, around) - expected - (lit.len() + dark.len()) as f64 * LN_2
}

/// An upper bound of [`contradiction`] that costs little. Each bit has `in_bit` marks, and `found` says how many of
/// them are lit in each bit. The marks of the lit bits together are `own`.
///
/// The marks of another label are more or fewer by Δk lit and Δj dark ones. Their probability under chance is that of
/// the own marks times the mean of d^Δk·(1 − d)^Δj. Here d has the distribution that own marks and places leave it,
/// Beta(p, q) with p = k + t + 1 and q = n − k + m − t + b. By Jensen's inequality the logarithm of that mean is at
/// least
///
/// > Δk·\[ψ(p) − ψ(p + q)\] + Δj·\[ψ(q) − ψ(p + q)\].
///
/// The bound is ∞ if own marks are no evidence at all.
pub(super) fn contradiction_at_most(
    found: &mut [u32],
    in_bit: u32,
    own: Marks,
    around: &Surroundings,
    expected: f64,
) -> f64 {
    let [k, n] = [own.lit, own.of].map(f64::from);
    let light = log_light(k, n);
    if k <= n * around.mean() || light == f64::NEG_INFINITY {
        return f64::INFINITY;
    }
    let (lit, dark) = (k + around.lit + 1.0, n - k + around.dark());
    let all = digamma(lit + dark);
    let (per_lit, per_dark) = (digamma(lit) - all, digamma(dark) - all);
    found.sort_unstable_by(|one, other| other.cmp(one));
    let (mut sum, mut best) = ([0.0; 2], f64::NEG_INFINITY);
    for bit in &*found {
        let [lit, of] = [sum[0] + f64::from(*bit), sum[1] + f64::from(in_bit)];
        let more = (lit - k) * per_lit + (of - lit - (n - k)) * per_dark;
        best = f64::max(best, log_light(lit, of) - more);
        sum = [lit, of];
    }
    best - light - expected - found.len() as f64 * LN_2
}

/// Light of `shot` that may come after `lag`.
///
/// Hypotheses are ordered by fullness: the larger share of lit marks first, then the later shot, then the nearer
/// lag. This order is total, as no two have the same shot and lag.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Hypothesis {
    pub shot: usize,
    /// Ticks from firing to the beginning of its light.
    pub lag: i64,
    /// Its marks in all light, claimed or not.
    pub marks: Marks,
}

impl Ord for Hypothesis {
    fn cmp(&self, other: &Self) -> Ordering {
        let fuller = other.marks.cmp_share(self.marks);
        fuller.then(other.shot.cmp(&self.shot)).then(self.lag.cmp(&other.lag))
    }
}

impl PartialOrd for Hypothesis {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The light of some shots, as hypotheses are asked about it.
pub(super) trait Light {
    /// Takes back verdicts: only those on the `kept` hypotheses that were judged first may stay. Returns how many stay.
    fn restore(&mut self, kept: usize) -> usize;

    /// Takes light of `hypothesis` for a return, if it is believed in what the returns taken so far leave.
    fn judge(&mut self, hypothesis: &Hypothesis);

    /// Further hypotheses, made from what the returns leave.
    fn propose(&mut self) -> Vec<Hypothesis>;
}

/// Takes from `light` the returns of `hypotheses`, and of all that it proposes.
///
/// Each round judges all hypotheses, the fullest first. So the verdict on a hypothesis depends on fuller ones
/// alone, and not on the order in which they came. Hypotheses before the first new one need not be judged
/// again. Then `light` proposes more of what is left, until it has no new one.
///
/// **It ends.** Every round but the last one adds a pair of shot and lag to those that `light` has proposed. It proposes
/// none of them twice, and there are finitely many. A return that is taken back stays a hypothesis: it is judged again.
pub(super) fn settle(light: &mut impl Light, hypotheses: &mut Vec<Hypothesis>) {
    let mut judged: Vec<Hypothesis> = Vec::new();
    loop {
        hypotheses.sort_unstable();
        hypotheses.dedup_by_key(|hypothesis| (hypothesis.shot, hypothesis.lag));
        let same = judged.iter().zip(&*hypotheses).take_while(|(one, other)| one == other);
        let kept = light.restore(same.count());
        hypotheses[kept..].iter().for_each(|hypothesis| light.judge(hypothesis));
        judged.clone_from(hypotheses);
        let proposals = light.propose();
        if proposals.is_empty() {
            return;
        }
        hypotheses.extend(proposals);
    }
}

#[cfg(test)]
mod tests;
