//! How late a detection event is: Gaussian jitter, rounded to parts of a tick.
//!
//! A rounded delay takes one of n values, and Walker's method \[Walker77\] draws it with one number. The
//! number falls into one of n cells of equal size, each shared by two values. The probabilities are those of
//! the Gaussian between two rounded values, so that nothing is lost by rounding first. Jitter of more than
//! [`EXACT`] parts is drawn coarser and spread evenly within the cell.

use macropulse_codec::statistics::normal_tail;

use crate::design::MOST_SIGMA;
use crate::kernels::Amounts;

/// Largest standard deviation that is rounded to single parts.
const EXACT: f64 = 200.0;

/// Bits of a random number that tell where in its cell a coarse value lies.
const PLACE_BITS: u32 = 8;

/// A Gaussian delay.
#[derive(Debug)]
pub(super) struct Jitter {
    /// The values, in steps.
    amounts: Amounts,
    /// Parts of a tick for a step of the values; 1 where they are exact.
    step: f64,
}

impl Jitter {
    /// Jitter of `sigma` parts of a tick, standard deviation; `None` where there is none.
    pub fn new(sigma: f64) -> Option<Self> {
        if sigma <= 0.0 {
            return None;
        }
        let step = (sigma / EXACT).max(1.0);
        let most = (MOST_SIGMA * sigma / step) as i16;
        let values: Vec<i16> = (-most..=most).collect();
        let bits = values.len().next_power_of_two().trailing_zeros().max(1);
        let mut shares: Vec<(i16, f64)> =
            values.iter().map(|value| (*value, probability(*value, sigma / step))).collect();
        shares.resize(1 << bits, (0, 0.0));
        Some(Self { amounts: Amounts::new(cells(&shares))?, step })
    }

    /// Delays each of `times` by what the number in the same place says, and sorts them again.
    pub fn delay(&self, times: &mut [u32], numbers: &[u32]) {
        if self.step == 1.0 {
            let falls = self.amounts.delay(times, numbers);
            sort_again(times, falls);
            return;
        }
        for (time, number) in times.iter_mut().zip(numbers) {
            *time = time.wrapping_add_signed(self.coarse(*number));
        }
        times.sort_unstable();
    }

    fn coarse(&self, number: u32) -> i32 {
        let all = f64::from(1_u32 << PLACE_BITS);
        let place = (f64::from(number % (1 << PLACE_BITS)) + 0.5) / all - 0.5;
        let value = f64::from(self.amounts.drawn(number));
        ((value + place) * self.step).round() as i32
    }
}

/// Probability that a Gaussian of standard deviation `sigma` is rounded to `value`.
fn probability(value: i16, sigma: f64) -> f64 {
    // A small probability is the difference of small numbers here, not of large ones.
    let from = f64::from(value).abs() - 0.5;
    let beyond = |x: f64| normal_tail(x / sigma);
    beyond(from) - beyond(from + 1.0)
}

/// Returns one cell per value, each with the bound below which its own value is drawn, that value, and the
/// other one. The cell of a value with too small a share is filled up by one with too large a share.
fn cells(shares: &[(i16, f64)]) -> Vec<u64> {
    let total: f64 = shares.iter().map(|share| share.1).sum();
    let mut left: Vec<f64> =
        shares.iter().map(|share| share.1 / total * shares.len() as f64).collect();
    let cell = |bound: u32, own: i16, other: i16| {
        u64::from(bound) << 32 | u64::from(own as u16) << 16 | u64::from(other as u16)
    };
    let mut cells: Vec<u64> =
        shares.iter().map(|&(value, _)| cell(u32::MAX, value, value)).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) =
        (0..left.len()).partition(|&index| left[index] < 1.0);
    while let (Some(&giver), Some(taker)) = (large.last(), small.pop()) {
        let bound = (left[taker] * 4_294_967_296.0).round() as u32;
        cells[taker] = cell(bound, shares[taker].0, shares[giver].0);
        left[giver] -= 1.0 - left[taker];
        if left[giver] < 1.0 {
            large.pop();
            small.push(giver);
        }
    }
    cells
}

/// Sorts what is nearly sorted, being below its predecessor `falls` times; what is not is left to
/// the library.
fn sort_again(times: &mut [u32], falls: usize) {
    if falls == 0 {
        return;
    }
    if falls * 8 > times.len() {
        times.sort_unstable();
        return;
    }
    for i in 1..times.len() {
        let time = times[i];
        let mut place = i;
        while place > 0 && times[place - 1] > time {
            times[place] = times[place - 1];
            place -= 1;
        }
        times[place] = time;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Address, Chance, Stage};
    use proptest::prelude::*;

    /// Returns the share of each value in 2³² equally likely numbers, from the bounds of its cells.
    fn shares_of(jitter: &Jitter) -> std::collections::HashMap<i16, f64> {
        let mut shares = std::collections::HashMap::new();
        let cells = jitter.amounts.cells();
        for cell in cells {
            let all = 1.0 / cells.len() as f64;
            let own = (cell >> 32) as f64 / 4_294_967_296.0 * all;
            *shares.entry((cell >> 16) as i16).or_insert(0.0) += own;
            *shares.entry(*cell as i16).or_insert(0.0) += all - own;
        }
        shares
    }

    #[test]
    fn the_cells_hold_the_rounded_gaussian() {
        for sigma in [0.2, 1.0, 12.8, 100.0, 199.9] {
            let jitter = Jitter::new(sigma).unwrap();
            let shares = shares_of(&jitter);
            let most = (4.0 * sigma) as i16;
            for value in -most..=most {
                let (share, expected) = (shares[&value], probability(value, sigma));
                approx::assert_abs_diff_eq!(share, expected, epsilon = 1e-9);
            }
        }
        assert!(Jitter::new(0.0).is_none());
    }

    /// H0: mean and variance are those of a Gaussian of σ (with what rounding adds, 1/12).
    /// N = 2²⁰, seed 4, α = 1e-6 each (|z| < 4.9).
    #[test]
    fn delays_have_the_moments_of_a_gaussian() {
        let mut numbers = Vec::new();
        let address = Address { stage: Stage::Jitter, index: 9, part: 0 };
        let numbers = Chance::new(4).draw(address, 1 << 20, &mut numbers);
        let n = numbers.len() as f64;
        for sigma in [1.0, 12.8, 150.0, 5000.0] {
            let jitter = Jitter::new(sigma).unwrap();
            let middle = 1 << 20;
            // One at a time: the order of them all does not matter.
            let delays: Vec<f64> = numbers
                .iter()
                .map(|number| {
                    let mut time = [middle];
                    jitter.delay(&mut time, &[*number]);
                    f64::from(time[0]) - f64::from(middle)
                })
                .collect();
            let mean = delays.iter().sum::<f64>() / n;
            let variance = delays.iter().map(|delay| delay * delay).sum::<f64>() / n;
            assert!((mean / sigma * n.sqrt()).abs() < 4.9, "σ {sigma}: mean {mean}");
            let z = |sigma: f64| {
                let expected = sigma * sigma + 1.0 / 12.0;
                (variance / expected - 1.0) / (2.0 / n).sqrt()
            };
            assert!(z(sigma).abs() < 4.9, "σ {sigma}: variance {variance}");
            // Negative control: jitter of a hundredth more.
            assert!(z(1.01 * sigma).abs() > 4.9, "σ {sigma}: the control was not rejected");
        }
    }

    proptest! {
        #[test]
        fn whatever_was_nearly_sorted_is_sorted(
            mut times in proptest::collection::vec(0..10_000_u32, 0..300), by in 0..2000_usize,
        ) {
            times.sort_unstable();
            for i in (0..times.len()).step_by(1 + by % 40) {
                times[i] += by as u32;
            }
            let mut expected = times.clone();
            expected.sort_unstable();
            let falls = times.windows(2).filter(|pair| pair[0] > pair[1]).count();
            sort_again(&mut times, falls);
            prop_assert_eq!(times, expected);
        }
    }
}
