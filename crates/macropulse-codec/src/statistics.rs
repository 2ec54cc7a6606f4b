//! The distributions that thresholds and forecasts are derived from, each with one owned here.
//!
//! Sums and rational approximations of elementary functions from `libm`, so that every machine
//! gives the same bits. Tests compare them with `statrs`.

use libm::{erfc, exp, lgamma, log, log1p};

/// Terms of a sum that are less than this share of it are left out.
const NEGLIGIBLE: f64 = 1e-17;

/// `Q(x) = ½·erfc(x/√2)`: probability that a standard normal variable exceeds `x`.
pub fn normal_tail(x: f64) -> f64 {
    0.5 * erfc(x * std::f64::consts::FRAC_1_SQRT_2)
}

/// Quantile of the standard normal distribution, Φ⁻¹(p), from the rational approximation of
/// \[Acklam03\] (relative error below 1.2e-9); `p` is held within \[1e-300, 1 − 1e-16\].
pub fn normal_quantile(p: f64) -> f64 {
    const A: [f64; 6] = [
        -3.969683028665376e1,
        2.209460984245205e2,
        -2.759285104469687e2,
        1.38357751867269e2,
        -3.066479806614716e1,
        2.506628277459239,
    ];
    const B: [f64; 5] = [
        -5.447609879822406e1,
        1.615858368580409e2,
        -1.556989798598866e2,
        6.680131188771972e1,
        -1.328068155288572e1,
    ];
    const C: [f64; 6] = [
        -7.784894002430293e-3,
        -3.223964580411365e-1,
        -2.400758277161838,
        -2.549732539343734,
        4.374664141464968,
        2.938163982698783,
    ];
    const D: [f64; 4] =
        [7.784695709041462e-3, 3.224671290700398e-1, 2.445134137142996, 3.754408661907416];
    let horner = |c: &[f64], x: f64| c.iter().fold(0.0, |sum, a| sum * x + a);
    let p = p.clamp(1e-300, 1.0 - 1e-16);
    let tail = p.min(1.0 - p);
    if tail < 0.02425 {
        let q = libm::sqrt(-2.0 * log(tail));
        let x = horner(&C, q) / (horner(&D, q) * q + 1.0);
        return if p < 0.5 { x } else { -x };
    }
    let q = p - 0.5;
    let r = q * q;
    horner(&A, r) * q / (horner(&B, r) * r + 1.0)
}

/// Mean and standard deviation of the `place`-th smallest, m, of `count` k independent standard
/// normal variables \[DJ54\], with p = m/(k + 1), q = 1 − p, z = Φ⁻¹(p) and φ = φ(z):
///
/// > z + pq/(2(k + 2))·z/φ² + pq/(k + 2)²·[(q − p)/3·(1 + 2z²)/φ³ + pq/8·z(7 + 6z²)/φ⁴],
/// > √(pq/(k + 2))/φ.
///
/// The mean is right to 4·10⁻⁴ where 20 or more are below it and one or more above, or the other way round,
/// and to 0.01 everywhere. The standard deviation has its first term only. It is too small by up to 4 % if
/// ten or more are on both sides, and by up to 28 % elsewhere. `count` is held within 1 and 10¹⁵, `place`
/// within 1 and `count`.
pub fn normal_order(place: f64, count: f64) -> (f64, f64) {
    let count = count.clamp(1.0, 1e15);
    let place = place.clamp(1.0, count);
    let all = count + 2.0;
    let below = place / (all - 1.0);
    let above = (all - 1.0 - place) / (all - 1.0);
    let z = normal_quantile(below);
    let density = exp(-z * z / 2.0) / libm::sqrt(std::f64::consts::TAU);
    let first = libm::sqrt(below * above / all) / density;
    let skew = (above - below) / (all * density);
    let square = first * first;
    let second = skew / 3.0 * (1.0 + 2.0 * z * z) + square / 8.0 * z * (7.0 + 6.0 * z * z);
    (z + square / 2.0 * z + square * second, first)
}

/// P(X ≥ k) of X ~ Bin(n, p): the chance that `least` or more of `trials` succeed, each with
/// probability `p`. Summed from the smaller side.
pub fn binomial_tail(trials: usize, p: f64, least: usize) -> f64 {
    if least == 0 || p >= 1.0 {
        return if least <= trials { 1.0 } else { 0.0 };
    }
    if least > trials || p <= 0.0 {
        return 0.0;
    }
    let (n, k, odds) = (trials as f64, least as f64, p / (1.0 - p));
    let choose = lgamma(n + 1.0) - lgamma(k + 1.0) - lgamma(n - k + 1.0);
    let first = exp(choose + k * log(p) + (n - k) * log1p(-p));
    // Away from the mean each term is smaller than the one before it.
    let (mut sum, mut term) = (0.0, first);
    if k < n * p {
        for k in (1..=least).rev() {
            term *= k as f64 / (n - k as f64 + 1.0) / odds;
            sum += term;
            if term < sum * NEGLIGIBLE {
                break;
            }
        }
        return (1.0 - sum).max(0.0);
    }
    for k in least..=trials {
        sum += term;
        if term < sum * NEGLIGIBLE {
            break;
        }
        term *= odds * (n - k as f64) / (k as f64 + 1.0);
    }
    sum.min(1.0)
}

/// P(X ≥ k) of the hypergeometric X: the chance that `least` or more of `drawn` items are marked. They are
/// drawn without replacement from `marked` marked items and `others` unmarked ones. Summed from the smaller
/// side.
pub fn hypergeometric_tail((marked, others): (u32, u32), drawn: u32, least: u32) -> f64 {
    let all = u64::from(marked) + u64::from(others);
    let (fewest, most) = (drawn.saturating_sub(others), marked.min(drawn));
    if least <= fewest || u64::from(drawn) > all {
        return 1.0;
    }
    if least > most {
        return 0.0;
    }
    let [marked, others, drawn, k] = [marked, others, drawn, least].map(f64::from);
    let choose =
        |of: f64, some: f64| lgamma(of + 1.0) - lgamma(some + 1.0) - lgamma(of - some + 1.0);
    let first = exp(choose(marked, k) + choose(others, drawn - k) - choose(all as f64, drawn));
    // P(X = k + 1)/P(X = k). Away from the mean each term is smaller than the one before it.
    let growth = |k: f64| (marked - k) * (drawn - k) / ((k + 1.0) * (others - drawn + k + 1.0));
    let (mut sum, mut term) = (0.0, first);
    if k < drawn * marked / all as f64 {
        for k in (fewest..least).rev() {
            term /= growth(f64::from(k));
            sum += term;
            if term < sum * NEGLIGIBLE {
                break;
            }
        }
        return (1.0 - sum).max(0.0);
    }
    for k in least..=most {
        sum += term;
        if term < sum * NEGLIGIBLE {
            break;
        }
        term *= growth(f64::from(k));
    }
    sum.min(1.0)
}

/// P(X = 0), P(X = 1) … P(X = n) of X ~ Bin(n, p), n being `trials`; `p` is held within
/// \[1e-12, 1 − 1e-12\].
pub fn binomial(trials: usize, p: f64) -> Vec<f64> {
    let p = p.clamp(1e-12, 1.0 - 1e-12);
    let all = lgamma(trials as f64 + 1.0);
    let term = |k: usize| {
        let (k, rest) = (k as f64, (trials - k) as f64);
        exp(all - lgamma(k + 1.0) - lgamma(rest + 1.0) + k * log(p) + rest * log1p(-p))
    };
    (0..=trials).map(term).collect()
}

/// P(X = k) of a Poisson variable with the given `mean`, e^(−n)·n^k/k!.
pub fn poisson(mean: f64, k: f64) -> f64 {
    exp(k * log(mean) - mean - lgamma(k + 1.0))
}

/// [`poisson`] for k from `first` to `last`, each from the one before it. It must not be too small a number at `first`.
pub fn poisson_from(mean: f64, first: u32, last: u32) -> Vec<f64> {
    let at_first = match mean > 0.0 {
        true => poisson(mean, first.into()),
        false => f64::from(u8::from(first == 0)),
    };
    let next = |(k, chance): &(u32, f64)| Some((k + 1, chance * mean / f64::from(k + 1)));
    let all = std::iter::successors(Some((first, at_first)), next);
    all.take_while(|(k, _)| *k <= last).map(|(_, chance)| chance).collect()
}

/// The probability that the total power of `phasors` phasors is above `threshold`. The total power of the
/// signal in them is `signal`. Powers are in units of the mean of one phasor of noise alone, whose two parts
/// are normal.
///
/// Given the number k of a Poisson variable of the mean `signal`, the power is a gamma variable of `phasors` + k: the
/// generalised Marcum function Q(√(2·signal), √(2·threshold)) \[Kay93\].
pub fn power_tail(phasors: u32, signal: f64, threshold: f64) -> f64 {
    if threshold <= 0.0 {
        return 1.0;
    }
    // Beyond, less than 1e-15 of a Poisson variable lies.
    let reach = |mean: f64| 10.0 * mean.sqrt() + 40.0;
    if signal.is_infinite() || signal - reach(signal) > threshold + reach(threshold) {
        return 1.0;
    }
    let first = (signal - reach(signal)).max(0.0).floor();
    let last = if signal > 0.0 { signal + reach(signal) } else { 0.0 };
    // The tail of a gamma variable of n is the probability that a Poisson variable of the mean `threshold` is below n.
    let mut below: f64 = (0..phasors + first as u32).map(|j| poisson(threshold, j.into())).sum();
    let mut sum = 0.0;
    let mut k = first;
    while k <= last {
        let weight = if signal > 0.0 { poisson(signal, k) } else { 1.0 };
        sum += weight * below.min(1.0);
        below += poisson(threshold, f64::from(phasors) + k);
        k += 1.0;
    }
    sum.min(1.0)
}

/// Erlang's B, a^c/c! / Σ_k a^k/k! \[Erl17\]: the share of calls that find all of `servers` busy
/// where `offered` is the mean number of calls that come within the time one takes. It does not
/// depend on how the times are distributed.
///
/// Summed as 1/B = 1 + c/a + c·(c − 1)/a² + …, with about √a terms that count. The sum ends at negligible
/// terms, or where it is too large for a number and B is 0.
pub fn erlang_b(offered: f64, servers: u32) -> f64 {
    if offered <= 0.0 {
        return 0.0;
    }
    let (mut sum, mut term) = (1.0, 1.0);
    for free in (1..=servers).rev() {
        term *= f64::from(free) / offered;
        sum += term;
        if sum.is_infinite() || f64::from(free) < offered && term < sum * NEGLIGIBLE {
            break;
        }
    }
    sum.recip()
}

/// The bound that |t| exceeds with probability 0.05, t of Student's distribution with `degrees` of
/// freedom, at least 1.
///
/// Found by halving the angle θ = atan(t/√ν), in whose sine and cosine the distribution is a
/// finite sum \[AS64, 26.7.3 and 26.7.4\].
pub fn student_95(degrees: u32) -> f64 {
    let (mut low, mut high) = (0.0, std::f64::consts::FRAC_PI_2);
    // An angle has 53 bits.
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if student_within(middle, degrees) < 0.95 { low = middle } else { high = middle }
    }
    f64::from(degrees).sqrt() * libm::tan(low)
}

/// Probability that |t| < √ν·tan θ, where ν is `degrees`:
///
/// - ν odd: `2/π · (θ + sin θ·(cos θ + 2/3·cos³θ + … ))`, up to cos^(ν−2);
/// - ν even: `sin θ·(1 + 1/2·cos²θ + 1·3/(2·4)·cos⁴θ + … )`, up to cos^(ν−2).
fn student_within(angle: f64, degrees: u32) -> f64 {
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    let is_odd = degrees % 2 == 1;
    let mut term = if is_odd { cosine } else { 1.0 };
    let mut sum = 0.0;
    let first = if is_odd { 3 } else { 2 };
    for next in (first..=degrees).step_by(2) {
        sum += term;
        term *= cosine * cosine * f64::from(next - 1) / f64::from(next);
    }
    if is_odd { std::f64::consts::FRAC_2_PI * (angle + sine * sum) } else { sine * sum }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use statrs::distribution::{
        Binomial, ContinuousCDF, Discrete, DiscreteCDF, Hypergeometric, Normal, Poisson, StudentsT,
    };

    #[test]
    fn the_normal_distribution_is_that_of_a_reference() {
        let normal = Normal::standard();
        for x in [-6.0, -2.5, -0.3, 0.0, 0.7, 1.96, 5.0] {
            assert_relative_eq!(normal_tail(x), normal.sf(x), max_relative = 1e-9);
            let p = normal.cdf(x);
            assert_abs_diff_eq!(normal_quantile(p), x, epsilon = 1e-7);
        }
        assert_eq!(normal_quantile(0.5), 0.0);
        assert!(normal_quantile(0.0).is_finite() && normal_quantile(1.0).is_finite());
    }

    #[test]
    fn the_binomial_is_that_of_a_reference() {
        for (n, p) in [(10, 0.5), (180, 0.01), (29, 0.66), (8000, 0.3), (3, 0.999)] {
            let reference = Binomial::new(p, n).unwrap();
            let mut points = vec![1, 2, n / 3, (n as f64 * p) as u64, n / 2, n - 1, n];
            points.retain(|k| *k > 0);
            for k in points {
                let tail = reference.sf(k - 1);
                let found = binomial_tail(n as usize, p, k as usize);
                assert_abs_diff_eq!(found, tail, epsilon = 1e-9 * tail + 1e-14);
                let mass = binomial(n as usize, p)[k as usize];
                assert_abs_diff_eq!(mass, reference.pmf(k), epsilon = 1e-9 * mass + 1e-15);
            }
        }
        assert_relative_eq!(binomial_tail(10, 0.5, 7), 176.0 / 1024.0, max_relative = 1e-12);
        assert_eq!((binomial_tail(10, 0.5, 0), binomial_tail(10, 0.5, 11)), (1.0, 0.0));
        assert_eq!((binomial_tail(9, 1.0, 9), binomial_tail(9, 0.0, 1)), (1.0, 0.0));
    }

    #[test]
    fn poisson_and_student_are_those_of_a_reference() {
        let reference = Poisson::new(4.6).unwrap();
        for k in [0, 1, 4, 20] {
            let mass = reference.pmf(k);
            assert_relative_eq!(poisson(4.6, k as f64), mass, max_relative = 1e-9);
            let of_many = poisson_from(4.6, 0, 20)[k as usize];
            assert_relative_eq!(of_many, mass, max_relative = 1e-9);
        }
        for degrees in [1, 2, 5, 30, 199] {
            let reference = StudentsT::new(0.0, 1.0, f64::from(degrees)).unwrap();
            let bound = student_95(degrees);
            assert_relative_eq!(reference.sf(bound), 0.025, max_relative = 1e-7);
        }
    }

    /// Mean and standard deviation from the density of the order statistic, m·C(k, m)·Φ^(m−1)·
    /// (1 − Φ)^(k−m)·φ, summed at a million places. Published \[DJ54\]: 1/√π for the larger of two,
    /// 1.16296 for the largest of five, 1.86748 for that of twenty.
    #[test]
    fn the_order_of_normal_variables_is_that_of_its_density() {
        let summed = |place: f64, count: f64| {
            let step = |at: i32| f64::from(at) * 1.2e-5 - 6.0;
            let weight = |t: f64| {
                let (above, below) = (normal_tail(t), normal_tail(-t));
                (place - 1.0) * log(below) + (count - place) * log(above) - t * t / 2.0
            };
            let highest = (0..1000).map(|at| weight(step(at * 1000))).fold(f64::MIN, f64::max);
            let mut sums = [0.0; 3];
            for at in 0..1_000_000 {
                let (t, weight) = (step(at), exp(weight(step(at)) - highest));
                for (power, sum) in (0..).zip(&mut sums) {
                    *sum += weight * t.powi(power);
                }
            }
            let mean = sums[1] / sums[0];
            (mean, (sums[2] / sums[0] - mean * mean).sqrt())
        };
        for (place, count, published) in
            [(2.0, 2.0, 0.564_19), (5.0, 5.0, 1.162_96), (20.0, 20.0, 1.867_48)]
        {
            assert_abs_diff_eq!(summed(place, count).0, published, epsilon = 1e-5);
        }
        for (place, count, right_to, share) in [
            (1.0, 1.0, 1e-2, 0.28),
            (2.0, 2.0, 1e-2, 0.28),
            (1.0, 500.0, 1e-2, 0.28),
            (20.0, 20.0, 1e-2, 0.28),
            (20.0, 21.0, 4e-4, 0.28),
            (2.0, 21.0, 4e-4, 0.28),
            (11.0, 21.0, 4e-4, 0.04),
            (100.0, 101.0, 4e-4, 0.28),
            (100.0, 130.0, 4e-4, 0.04),
            (100.0, 90_000.0, 4e-4, 0.04),
            (400.0, 450.0, 4e-4, 0.04),
            (400.0, 160_000.0, 4e-4, 0.04),
        ] {
            let (found, expected) = (normal_order(place, count), summed(place, count));
            assert!((found.0 - expected.0).abs() < right_to, "{place}, {count}: {found:?}");
            assert_relative_eq!(found.1, expected.1, max_relative = share);
            // Turned round, it is the same from the other side.
            let other = normal_order(count + 1.0 - place, count);
            assert_abs_diff_eq!(other.0, -found.0, epsilon = 1e-6);
        }
        assert_eq!(normal_order(7.0, 3.0), normal_order(3.0, 3.0));
        assert!([1e9, f64::INFINITY].iter().all(|count| normal_order(1.0, *count).0.is_finite()));
    }

    /// Q₁(√18, √27.63) is 0.182; a diffuse echo, whose power is itself exponential, has 10^(−6/10) = 0.251 for the mean
    /// signal 9 and one false alarm in a million. Without a signal the tail is (1 + x)·e^(−x) for two phasors.
    #[test]
    fn the_power_of_phasors_has_the_published_tails() {
        let threshold = -log(1e-6);
        assert_relative_eq!(power_tail(1, 0.0, threshold), 1e-6, max_relative = 1e-9);
        assert_relative_eq!(power_tail(2, 0.0, 5.0), 6.0 * exp(-5.0), max_relative = 1e-12);
        assert_relative_eq!(power_tail(1, 9.0, threshold), 0.182, max_relative = 5e-3);
        let steps = 4000;
        let diffuse: f64 = (0..steps)
            .map(|step| {
                power_tail(1, -9.0 * log((f64::from(step) + 0.5) / f64::from(steps)), threshold)
            })
            .sum();
        assert_relative_eq!(diffuse / f64::from(steps), 0.251, max_relative = 3e-3);
        // Pd 0.9 needs 20.81; far above and below the threshold nothing is left to chance.
        assert_relative_eq!(power_tail(1, 20.81, threshold), 0.9, max_relative = 1e-3);
        assert_eq!((power_tail(3, 1e5, 20.0), power_tail(1, 1.0, 0.0)), (1.0, 1.0));
        assert_eq!(power_tail(2, f64::INFINITY, 20.0), 1.0);
        assert!(power_tail(1, 1.0, 500.0) < 1e-100);
    }

    #[test]
    fn hypergeometric_tails_are_those_of_the_reference() {
        for (marked, others) in [(64, 63), (56, 71), (5, 145), (400, 10_500), (1, 1)] {
            let all = marked + others;
            for drawn in [0, 1, 2, all / 9, all / 3, all / 2, all - 1, all] {
                let (few, many) = (u64::from(marked), u64::from(drawn));
                let reference = Hypergeometric::new(u64::from(all), few, many).unwrap();
                let mut tail = 0.0;
                for least in (0..=marked.min(drawn).min(90)).rev() {
                    let found = hypergeometric_tail((marked, others), drawn, least);
                    if least == 90 {
                        tail = found;
                    } else {
                        let is_possible = least + others >= drawn;
                        let pmf = reference.ln_pmf(u64::from(least)).exp();
                        tail += if is_possible { pmf } else { 0.0 };
                    }
                    assert_relative_eq!(found, tail, max_relative = 1e-7, epsilon = 1e-300);
                }
            }
        }
        // Two of two marks among four, in one of six draws of two.
        assert_relative_eq!(hypergeometric_tail((2, 2), 2, 2), 1.0 / 6.0, max_relative = 1e-12);
        assert_eq!(hypergeometric_tail((2, 2), 2, 3), 0.0);
    }

    /// 10 Erlang offered to 10 lines: 21.46 %; 1 to 1: one half; far too many: what is not served.
    #[test]
    fn erlang_has_the_published_values() {
        assert_relative_eq!(erlang_b(10.0, 10), 0.214_58, max_relative = 1e-4);
        assert_relative_eq!(erlang_b(1.0, 1), 0.5, max_relative = 1e-12);
        assert_relative_eq!(erlang_b(1e5, 1150), 1.0 - 1150.0 / 1e5, max_relative = 1e-3);
        assert_eq!(erlang_b(0.0, 3), 0.0);
        // One server more at a time: B(c) = a·B(c − 1)/(c + a·B(c − 1)), B(0) = 1.
        let one_by_one = |offered: f64, servers: u32| {
            (1..=servers).fold(1.0, |loss, servers| {
                let carried = offered * loss;
                carried / (f64::from(servers) + carried)
            })
        };
        for (offered, servers) in [(20.0, 30), (1150.0, 1150), (1e6, 1_000_000), (1e6, 1_010_000)] {
            let expected = one_by_one(offered, servers);
            assert_relative_eq!(erlang_b(offered, servers), expected, max_relative = 1e-12);
        }
        for offered in [1e-9, 1e-3, 1.4e7] {
            assert_eq!(erlang_b(offered, 1 << 24), 0.0);
        }
    }
}
