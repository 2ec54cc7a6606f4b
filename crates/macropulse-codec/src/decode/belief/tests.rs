//! Laws of the rule of belief.

use std::collections::BTreeSet;

use libm::{exp, log1p};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;

/// ln of the number of ways to choose k of n.
fn choose(k: u32, n: u32) -> f64 {
    let [k, n] = [k, n].map(f64::from);
    lgamma(n + 1.0) - lgamma(k + 1.0) - lgamma(n - k + 1.0)
}

/// Probability of k of n if each has the probability d.
fn binomial(k: u32, n: u32, d: f64) -> f64 {
    let [lit, dark] = [k, n - k].map(f64::from);
    exp(choose(k, n) + lit * log(d) + dark * log1p(-d))
}

/// ln(x·(x + 1)·…·(x + n − 1)).
fn rising(x: f64, n: u32) -> f64 {
    (0..n).map(|step| log(x + f64::from(step))).sum()
}

/// Probability, as a logarithm, of k of n marks and t of m places if all have one density, drawn from Beta(1, b).
fn by_chance([k, n, t, m]: [u32; 4], b: f64) -> f64 {
    let drawn = rising(1.0, k + t) + rising(b, n + m - k - t) - rising(1.0 + b, n + m);
    choose(k, n) + choose(t, m) + drawn
}

/// The mean of exp(evidence) under chance, without the demand that light adds marks; `factor` is added to it.
fn mean_factor(n: u32, m: u32, density: f64, factor: f64) -> f64 {
    let of = |(k, t): (u32, u32)| {
        let around = Surroundings { lit: t.into(), places: m.into(), density };
        let chance = by_chance([k, n, t, m], density.recip() - 1.0);
        exp(chance + log_factor(Marks { lit: k, of: n }, &around) + factor)
    };
    (1..=n).flat_map(|k| (0..=m).map(move |t| (k, t))).map(of).sum()
}

/// Σ over all outcomes of P(outcome)·exp(evidence) = 1 to 10⁻⁹: 112 cases. Negative control: if light that is not bright
/// were not made rarer by that which is, it would be 1.1 at least.
#[test]
fn the_mean_of_the_bayes_factor_is_one_under_chance() {
    for n in [1, 2, 3, 8, 29, 87, 174] {
        for m in [0, 1, 30, 200] {
            for density in [1e-5, 1e-3, 0.02, 0.4] {
                let mean = mean_factor(n, m, density, 0.0);
                assert!((mean - 1.0).abs() < 1e-9, "{n} {m} {density}: {mean}");
                let other = mean_factor(n, m, density, -log1p(-BRIGHT));
                assert!(other > 1.1, "{n} {m} {density}: {other}");
            }
        }
    }
}

/// In the limit of a known density d the evidence is E(k, n, d), whose mean is 1 to 10⁻⁹: 5 densities, n up to 400.
#[test]
fn a_known_density_is_the_limit_of_many_places() {
    for d in [1e-4, 1e-3, 0.011, 0.2, 0.5] {
        for n in [3, 29, 174, 400] {
            let known = |k: u32| {
                let [lit, dark] = [k, n - k].map(f64::from);
                let beta = exp(lgamma(lit) + lgamma(dark + 1.0) - lgamma(f64::from(n) + 1.0));
                let faint = 0.75 * beta / (harmonic(n.into()) - 1.0);
                log(faint + if k == n { 0.25 } else { 0.0 }) - lit * log(d) - dark * log1p(-d)
            };
            let chance =
                |k: u32| choose(k, n) + f64::from(k) * log(d) + f64::from(n - k) * log1p(-d);
            let mean: f64 = (2..=n).map(|k| exp(chance(k) + known(k))).sum();
            assert!((mean - 1.0).abs() < 1e-9, "{n} {d}: {mean}");
            let around = Surroundings { lit: 1e7 * d, places: 1e7, density: d };
            for k in (2..n).step_by(7).chain([n]) {
                let found = log_factor(Marks { lit: k, of: n }, &around);
                let tolerance = 1e-3 + 2.0 * f64::from(n * n) / (1e7 * d);
                assert!((found - known(k)).abs() < tolerance, "{k} {n} {d}: {found} {}", known(k));
            }
        }
    }
}

/// The largest P(evidence ≥ x)·eˣ over x > 0 where a place is lit with probability d.
fn largest_tail(n: u32, m: u32, density: f64, d: f64) -> f64 {
    let mut outcomes = Vec::new();
    for t in 0..=m {
        let beside = binomial(t, m, d);
        for k in (1..=n).filter(|_| beside > 1e-30) {
            let around = Surroundings { lit: t.into(), places: m.into(), density };
            let found = evidence(Marks { lit: k, of: n }, &around);
            if found > 0.0 {
                outcomes.push((found, beside * binomial(k, n, d)));
            }
        }
    }
    outcomes.sort_by(|one, other| other.0.total_cmp(&one.0));
    let tails = outcomes.iter().scan(0.0, |sum, (found, chance)| {
        *sum += chance;
        Some(*sum * exp(*found))
    });
    tails.fold(0.0, f64::max)
}

/// P(evidence ≥ x) ≤ max(1, d/d₀)·e⁻ˣ for every x > 0 and density from a twentieth of the expected one to twice that.
/// Negative control: at twenty times that it is a thousand times as much somewhere.
#[test]
fn the_tail_is_bounded_at_twice_the_expected_density() {
    let mut beyond: f64 = 0.0;
    for n in [1, 3, 8, 29, 174] {
        for m in [0, 30, 300, 2000] {
            for density in [1e-5, 1e-3, 0.02, 0.1] {
                for times in [0.05, 0.5, 1.0, 1.5, 2.0] {
                    let tail = largest_tail(n, m, density, density * times);
                    assert!(tail <= times.max(1.0) + 1e-9, "{n} {m} {density} × {times}: {tail}");
                }
                beyond = beyond.max(largest_tail(n, m, density, (20.0 * density).min(0.5)));
            }
        }
    }
    assert!(beyond > 1000.0, "{beyond}");
}

#[test]
fn no_more_marks_than_chance_gives_are_no_evidence() {
    let around = Surroundings { lit: 499.0, places: 998.0, density: 0.5 };
    let of = |lit| evidence(Marks { lit, of: 100 }, &around);
    assert_eq!([0, 1, 50].map(of), [f64::NEG_INFINITY; 3]);
    assert!(of(51) < 0.0 && of(80) > 10.0, "{} {}", of(51), of(80));
}

#[test]
fn the_logarithm_of_gamma_is_that_of_a_reference() {
    for x in (1..4000).map(|step| 0.25 * f64::from(step)).chain([1e4, 1e6, 1e9]) {
        let (found, reference) = (log_gamma(x), lgamma(x));
        assert!((found - reference).abs() <= 1e-11 * (1.0 + reference.abs()), "{x}: {found}");
    }
}

/// The digamma function is that of `statrs` to 10⁻⁷, and each step up adds 1/x.
#[test]
fn digamma_is_that_of_a_reference() {
    for x in [0.03, 0.5, 1.0, 2.7, 5.999, 6.0, 6.3, 48.0, 1023.5, 1e7] {
        let reference = statrs::function::gamma::digamma(x);
        assert!((digamma(x) - reference).abs() < 1e-7, "{x}");
        assert!((digamma(x + 1.0) - digamma(x) - 1.0 / x).abs() < 2e-7, "{x}");
    }
}

#[test]
fn harmonic_numbers_are_sums() {
    let mut sum = 0.0;
    for n in 1..=2000 {
        sum += f64::from(n).recip();
        assert!((harmonic(n.into()) - sum).abs() < 1e-11, "{n}");
    }
    assert_eq!(harmonic(0.0), 0.0);
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::with_cases(200) })]

    /// Σ π = 1 to 10⁻⁹ for any neighbours, and π stays below its bound. Negative control: without the lag of a
    /// neighbour it is less.
    #[test]
    fn a_prior_sums_to_one(
        start in -50..5000_i64,
        length in 1..4000_i64,
        neighbours in proptest::collection::vec(-3000..12_000_i64, 0..9),
        part in (0..4000_i64, 1..700_i64),
    ) {
        let prior = Prior::new(start..start + length, &neighbours);
        let at = |lag: i64| exp(prior.at(lag));
        let sum: f64 = (start..start + length).map(at).sum();
        prop_assert!((sum - 1.0).abs() < 1e-9, "{sum}");
        if let Some(lag) = neighbours.first() {
            let lag = (*lag).clamp(start, start + length - 1);
            prop_assert!(sum - at(lag) < 1.0 - 1e-3, "{sum}");
        }
        let first = start + part.0 % length;
        let lags = first..(first + part.1).min(start + length);
        let most = prior.most(&lags);
        prop_assert!(lags.clone().all(|lag| prior.at(lag) <= most));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(3), ..ProptestConfig::with_cases(2000) })]

    /// The cheap bound of a contradiction is never below it, nor below that of the same bits with fewer marks in dark ones.
    #[test]
    fn a_contradiction_is_bounded(
        in_bit in 1..65_u32,
        shares in prop::collection::vec(0.0..1.3_f64, 1..20),
        lit_bits in 1..20_usize,
        places in 1..5000_u32,
        share in 0.0..1.0_f64,
        density in 1e-4..0.5_f64,
    ) {
        let places = f64::from(places);
        let around = Surroundings { lit: (share * share * places).floor(), places, density };
        let found = |share: &f64| (share.min(1.0) * f64::from(in_bit)).round() as u32;
        let mut found: Vec<u32> = shares.iter().map(found).collect();
        let bits: Vec<Marks> = found.iter().map(|lit| Marks { lit: *lit, of: in_bit }).collect();
        let (lit, dark) = bits.split_at(lit_bits.min(bits.len()));
        let lit_in_all = lit.iter().map(|bit| bit.lit).sum();
        let own = Marks { lit: lit_in_all, of: in_bit * lit.len() as u32 };
        let exact = contradiction(lit, dark, &around, 0.5);
        let bound = contradiction_at_most(&mut found, in_bit, own, &around, 0.5);
        prop_assert!(bound >= exact - 1e-5, "{bound} {exact}");
        let fewer = |bit: &Marks| Marks { lit: (f64::from(bit.lit) * share) as u32, ..*bit };
        let darker: Vec<Marks> = dark.iter().map(fewer).collect();
        let left = contradiction(lit, &darker, &around, 0.5);
        prop_assert!(bound >= left - 1e-5, "{bound} {left}");
    }
}

/// A payload has 13 bits with 29 marks each, and half the marks of a lit bit are seen. Two lit bits more or
/// less contradict the label, and its own light does not. Two marks of a bit do not tell.
#[test]
fn light_of_another_label_contradicts() {
    let around = Surroundings { lit: 5.0, places: 5000.0, density: 1e-3 };
    let bits = |lit: u32, of: usize| vec![Marks { lit, of: 29 }; of];
    let against = |lit: &[Marks], dark: &[Marks]| contradiction(lit, dark, &around, 0.0);
    assert!(against(&bits(14, 6), &bits(0, 7)) < 0.0);
    assert!(against(&bits(2, 6), &bits(0, 7)) < 0.0);
    let [two, four] = [2, 4].map(|more| [bits(14, more), bits(0, 7 - more)].concat());
    assert!(against(&bits(14, 6), &two) > 0.0);
    assert!(against(&bits(14, 6), &four) > against(&bits(14, 6), &two));
    assert!(against(&[bits(14, 3), bits(0, 3)].concat(), &bits(0, 7)) > 0.0);
    let expected = contradiction(&bits(14, 6), &two, &around, 5.0);
    assert!((against(&bits(14, 6), &two) - expected - 5.0).abs() < 1e-9);
    // Claimed bits tell nothing.
    let claimed = vec![Marks { lit: 0, of: 0 }; 3];
    assert!(against(&[bits(14, 3), claimed].concat(), &bits(0, 7)) < 0.0);
    assert_eq!(against(&bits(0, 6), &bits(0, 7)), f64::NEG_INFINITY);
    // Two whole bits of three speak better than all with one mark missed, where chance lights every other place.
    let dense = Surroundings { lit: 0.0, places: 1.0, density: 0.5 };
    let lit = [64, 64, 63].map(|lit| Marks { lit, of: 64 });
    let dark = vec![Marks { lit: 5, of: 64 }; 4];
    assert!(contradiction(&lit, &dark, &dense, 0.0) > 0.7);
    assert!(contradiction(&lit, &dark, &around, 0.0) < -4.0);
}

/// The cheap bound tells that a label fits if its bits are clearly lit or dark. Control: of lit bits in place of
/// dark ones it tells nothing.
#[test]
fn a_clear_label_is_told_at_little_cost() {
    let around = Surroundings { lit: 5.0, places: 5000.0, density: 1e-3 };
    let own = Marks { lit: 6 * 27, of: 6 * 29 };
    let bound = |of_dark: u32| {
        let mut found = [vec![27; 6], vec![of_dark; 7]].concat();
        contradiction_at_most(&mut found, 29, own, &around, 0.0)
    };
    assert!(bound(0) < 0.0 && bound(3) < 0.0, "{} {}", bound(0), bound(3));
    assert!(bound(14) > 0.0);
}

#[test]
fn the_order_is_by_fullness_then_shot_then_lag() {
    let of = |shot, lag, lit, of| Hypothesis { shot, lag, marks: Marks { lit, of } };
    let sorted = [of(1, 5, 3, 4), of(9, 8, 2, 3), of(9, 9, 4, 6), of(2, 1, 20, 30), of(2, 7, 0, 9)];
    assert!(sorted.is_sorted());
    let mut others = sorted;
    others.reverse();
    others.sort_unstable();
    assert_eq!(others, sorted);
}

/// A band of 64 ticks in which each hypothesis has some of them as marks, whatever these are.
struct Toy {
    lit: u64,
    left: u64,
    /// The marks of each pair of shot and lag.
    marks: Vec<u64>,
    found: BTreeSet<(usize, i64)>,
    /// The hypotheses that were judged, in the order of their verdicts.
    judged: Vec<Hypothesis>,
    /// True if verdicts stay from round to round.
    keeps: bool,
    proposed: BTreeSet<(usize, i64)>,
    chance: ChaCha8Rng,
    rounds: usize,
}

const LAGS: usize = 12;

impl Toy {
    /// Creates `shots` shots, each mark in a random place, all from one seed.
    fn new(shots: usize, seed: u64) -> Self {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut some = || chance.next_u64() & chance.next_u64();
        let marks = (0..shots * LAGS).map(|_| some() & some() | 1).collect();
        let lit = some() | some();
        let (found, proposed) = (BTreeSet::new(), BTreeSet::new());
        let (judged, keeps) = (Vec::new(), true);
        Self { lit, left: 0, marks, found, judged, keeps, proposed, chance, rounds: 0 }
    }

    fn hypothesis(&self, pair: usize) -> Hypothesis {
        let marks = self.marks[pair];
        let marks = Marks { lit: (marks & self.lit).count_ones(), of: marks.count_ones() };
        Hypothesis { shot: pair / LAGS, lag: (pair % LAGS) as i64, marks }
    }
}

impl Light for Toy {
    fn restore(&mut self, kept: usize) -> usize {
        self.left = self.lit;
        self.rounds += 1;
        let kept = if self.keeps { kept } else { 0 };
        self.judged.truncate(kept);
        let is_kept = |(shot, lag): &(usize, i64)| {
            self.judged.iter().any(|judged| (judged.shot, judged.lag) == (*shot, *lag))
        };
        self.found.retain(is_kept);
        for (shot, lag) in &self.found {
            self.left &= !self.marks[shot * LAGS + *lag as usize];
        }
        kept
    }

    fn judge(&mut self, hypothesis: &Hypothesis) {
        let marks = self.marks[hypothesis.shot * LAGS + hypothesis.lag as usize];
        // Fewer ticks that are left do for the later shots, so that what is taken back is found again.
        if (marks & self.left).count_ones() >= 3 + (hypothesis.shot as u32 + 1) % 2 {
            self.left &= !marks;
            self.found.insert((hypothesis.shot, hypothesis.lag));
        }
        self.judged.push(*hypothesis);
    }

    /// Anything once: what was taken back, what is known, and what cannot be.
    fn propose(&mut self) -> Vec<Hypothesis> {
        let pairs = self.marks.len() as u32;
        let some: Vec<u32> = (0..3).map(|_| self.chance.next_u32() % pairs).collect();
        let some = some.into_iter().map(|pair| self.hypothesis(pair as usize));
        let some: Vec<Hypothesis> = some.collect();
        some.into_iter().filter(|one| self.proposed.insert((one.shot, one.lag))).collect()
    }
}

/// N = 2000 bands, seeds 0 to 1999: the same returns in whatever order the hypotheses come. Negative control: judged in
/// the order in which they come, more than one band in ten has others.
#[test]
fn the_verdict_does_not_depend_on_the_order_of_hypotheses() {
    let mut others = 0;
    for seed in 0..2000 {
        let returns = |turn: usize, is_sorted: bool| {
            let mut toy = Toy::new(6, seed);
            let mut all: Vec<Hypothesis> = (0..6 * LAGS).map(|pair| toy.hypothesis(pair)).collect();
            all.rotate_left(turn);
            match is_sorted {
                true => settle(&mut toy, &mut all),
                false => {
                    toy.restore(0);
                    all.iter().for_each(|hypothesis| toy.judge(hypothesis));
                }
            }
            toy.found
        };
        let first = returns(0, true);
        assert!((1..4).all(|turn| returns(17 * turn, true) == first), "{seed}");
        others += usize::from(returns(17, false) != returns(0, false));
    }
    assert!(others > 200, "{others}");
}

/// N = 2000 bands that propose whatever they like, seeds 0 to 1999. Each ends after at most one round more
/// than there are pairs, with the returns that it has if no verdict is kept from round to round. In more than
/// one in ten a return was taken back. Negative control: no more than half of them end in ten rounds.
#[test]
fn accepting_and_taking_back_ends() {
    let (mut early, mut taken_back) = (0, 0);
    for seed in 0..2000 {
        let mut toy = Toy::new(4, seed);
        let mut all = Vec::new();
        settle(&mut toy, &mut all);
        let mut anew = Toy { keeps: false, ..Toy::new(4, seed) };
        settle(&mut anew, &mut Vec::new());
        assert_eq!(anew.found, toy.found, "{seed}");
        assert!(toy.rounds <= 4 * LAGS + 1, "{seed}: {}", toy.rounds);
        early += usize::from(toy.rounds <= 10);
        // One after another, each with those before it.
        let mut known: BTreeSet<(usize, i64)> = BTreeSet::new();
        let mut is_back = false;
        for some in 1..=all.len() {
            let mut toy = Toy::new(4, seed);
            toy.restore(0);
            all[all.len() - some..].iter().for_each(|hypothesis| toy.judge(hypothesis));
            is_back |= known.iter().any(|pair| !toy.found.contains(pair));
            known = toy.found;
        }
        taken_back += usize::from(is_back);
    }
    assert!(taken_back > 200, "{taken_back}");
    assert!(early < 1000, "{early}");
}
