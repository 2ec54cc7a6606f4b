use super::*;
use crate::random::{Chance, Stage};

/// Cells with bins of 1 ns in cycles of 100 ns, all of them recorded.
const CELLS: Cells = Cells {
    number: 1,
    dead_fs: 0,
    arming: Arming::FreeRunning,
    afterpulse: (0.0, 30e6),
    crosstalk: 0.0,
    cycle_fs: 100_000_000,
    bin_fs: 1_000_000,
    bins: 100,
};

const SINGLE_STOP: Cells = Cells { arming: Arming::OncePerPulse, ..CELLS };

fn stream(seed: u64) -> Stream {
    Chance::new(seed).at(Stage::Histogram, 0)
}

/// A pulse over four bins, and `steady` light.
fn pulse(steady: f64) -> Vec<f64> {
    let mut rates = vec![steady; 100];
    for (bin, light) in [(40, 0.05), (41, 0.4), (42, 0.3), (43, 0.1)] {
        rates[bin] += light;
    }
    rates
}

/// Returns the counts of `cycles` of the same light.
fn counts(cells: Cells, cycles: u32, rates: &[f64], steady: f64, seed: u64) -> Vec<u32> {
    let mut counts = Vec::new();
    let lit = std::iter::once((cycles, rates.to_vec()));
    cells.count(lit, steady, &mut stream(seed), &mut counts);
    counts
}

/// Pearson's statistic of `counts` against the `expected` ones, in standard deviations of its law: of d bins its
/// mean is d and its variance 2d.
fn deviation(counts: &[u32], expected: &[f64]) -> f64 {
    let sum: f64 = counts
        .iter()
        .zip(expected)
        .map(|(count, mean)| (f64::from(*count) - mean).powi(2) / mean)
        .sum();
    let bins = counts.len() as f64;
    (sum - bins) / (2.0 * bins).sqrt()
}

/// Expected counts of each bin where a cell counts once a cycle: M·e^(−Σ before)·(1 − e^(−λ)).
fn once_per_cycle(cycles: f64, rates: &[f64]) -> Vec<f64> {
    let mut before = 0.0;
    let of_bin = |rate: &f64| {
        let mean = cycles * libm::exp(-before) * -libm::expm1(-rate);
        before += rate;
        mean
    };
    rates.iter().map(of_bin).collect()
}

/// H0: counts of a cell that counts once a cycle have the closed form's means. M = 200 000 cycles, seed 1, in bright
/// and in faint light, α = 10⁻⁶ (4.9 deviations of χ² with 100 degrees of freedom, whose tail is a little longer).
/// Control: counts without pile-up are rejected.
#[test]
fn a_cell_that_counts_once_a_cycle_has_the_closed_form() {
    for (cycles, steady) in [(200_000, 0.01), (200_000, 1e-6)] {
        let rates = pulse(steady);
        let counts = counts(SINGLE_STOP, cycles, &rates, steady, 1);
        let expected = once_per_cycle(f64::from(cycles), &rates);
        let seen: Vec<usize> = (0..100).filter(|bin| expected[*bin] > 5.0).collect();
        let pick = |from: &[f64]| -> Vec<f64> { seen.iter().map(|bin| from[*bin]).collect() };
        let counted: Vec<u32> = seen.iter().map(|bin| counts[*bin]).collect();
        assert!(deviation(&counted, &pick(&expected)).abs() < 5.5, "{steady}");
        let linear: Vec<f64> = rates.iter().map(|rate| f64::from(cycles) * rate).collect();
        assert!(deviation(&counted, &pick(&linear)) > 100.0);
    }
}

/// H0: cells that are followed from count to count give the same law as the multinomial, and as Poisson counts where
/// nothing blinds them. 16 cells, M = 20 000, seed 3, α = 10⁻⁶. Control: the law of single cells is rejected.
#[test]
fn cells_that_are_followed_give_the_same_counts() {
    let rates: Vec<f64> = pulse(0.02).iter().map(|rate| 4.0 * rate).collect();
    let followed = |cells: Cells| {
        let mut counts = vec![0; 100];
        let lit = std::iter::once((20_000, rates.clone()));
        cells.follow(lit, &mut stream(3), &mut counts);
        counts
    };
    let shares: Vec<f64> = rates.iter().map(|rate| rate / 16.0).collect();
    let once = once_per_cycle(16.0 * 20_000.0, &shares);
    let stopping = followed(Cells { number: 16, ..SINGLE_STOP });
    assert!(deviation(&stopping, &once).abs() < 5.5);
    assert!(deviation(&stopping, &once_per_cycle(20_000.0, &rates)) > 100.0);
    let linear: Vec<f64> = rates.iter().map(|rate| 20_000.0 * rate).collect();
    assert!(deviation(&followed(Cells { number: 16, ..CELLS }), &linear).abs() < 5.5);
    let drawn = counts(CELLS, 20_000, &rates, 0.08, 3);
    assert!(deviation(&drawn, &linear).abs() < 5.5);
    assert!(deviation(&drawn, &once) > 10.0);
}

/// H0: in steady light of rate r on each cell with dead time τ, the counts are r/(1 + r·τ). Here r·τ = 0.6,
/// N cells 1 and 8, 4·10⁵ to 2·10⁶ counts, seed 4. Counts behind a dead time vary less than Poisson ones, so
/// α < 10⁻⁶ at 4.9. Control: r is rejected.
#[test]
fn a_dead_time_takes_its_share_of_steady_light() {
    for number in [1, 8] {
        let cells = Cells { number, dead_fs: 60_000_000, ..CELLS };
        let (cycles, each) = (400_000, 0.01);
        let rates = vec![each * f64::from(number); 100];
        let total: f64 =
            counts(cells, cycles, &rates, rates[0], 4).iter().map(|count| f64::from(*count)).sum();
        let falling = f64::from(cycles) * 100.0 * rates[0];
        let z = |mean: f64| (total - mean) / mean.sqrt();
        assert!(z(falling / (1.0 + each * 60.0)).abs() < 4.9, "{number}");
        assert!(z(falling).abs() > 100.0);
    }
}

/// A pulse that every armed cell counts leaves none of these armed for the dead time behind it: what comes then is of
/// the cells that had counted before. Control: cells without dead time.
#[test]
fn a_bright_pulse_blinds_the_cells_behind_it() {
    let mut rates = vec![0.1; 100];
    rates[50] = 1e3;
    let counted = |dead_fs: i64| {
        let cells = Cells { number: 4, dead_fs, ..CELLS };
        counts(cells, 5_000, &rates, 0.1, 5)
    };
    let (blinded, always) = (counted(20_000_000), counted(0));
    assert!(blinded[51..56].iter().all(|count| *count < 50), "{blinded:?}");
    assert!(always[51..56].iter().all(|count| *count > 400), "{always:?}");
    assert!(blinded[72..].iter().all(|count| *count > 250));
}

/// H0: with the probability p of crosstalk or of an afterpulse each count brings p further ones, and these again:
/// 1/(1 − p) in all. Faint light on 1000 cells, p = 0.2, 10⁵ primary counts, seed 6. A family of mean size 1/(1 − p)
/// has the variance p/(1 − p)³; α = 10⁻⁶. Control: no further counts.
#[test]
fn crosstalk_and_afterpulses_multiply_the_counts() {
    let many = Cells { number: 1000, ..CELLS };
    for cells in [Cells { crosstalk: 0.2, ..many }, Cells { afterpulse: (0.2, 30e6), ..many }] {
        let rates = vec![1e-3; 100];
        let total: f64 =
            counts(cells, 1_000_000, &rates, 1e-3, 6).iter().map(|count| f64::from(*count)).sum();
        let (primary, family) = (1e5, 1.0 / 0.8);
        let variance = primary * (family * family + 0.2 / 0.8_f64.powi(3));
        let z = |mean: f64| (total - mean) / variance.sqrt();
        assert!(z(primary * family).abs() < 4.9, "{total}");
        assert!(z(primary).abs() > 50.0);
    }
}

/// An afterpulse of a cell that counts once a cycle comes in a later cycle, evenly if its delay is long.
#[test]
fn light_of_a_run_of_cycles_stays_in_it() {
    let mut counts = vec![0; 100];
    let lit = [(10, vec![0.0; 100]), (1_000, pulse(0.0)), (10, vec![0.0; 100])];
    SINGLE_STOP.follow(lit.into_iter(), &mut stream(7), &mut counts);
    let total: u32 = counts.iter().sum();
    assert!((400..750).contains(&total), "{total}");
    assert_eq!(counts[40..44].iter().sum::<u32>(), total);
}
