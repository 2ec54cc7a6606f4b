//! Real numbers to whole ones.
#![allow(clippy::needless_range_loop)]

use macropulse_codec::on_every_level;

on_every_level! {
    /// Puts `factor · value / divisor · scale`, in this order and rounded to the nearest whole
    /// number, in the place of each of `values` in `whole`.
    pub(crate) fn whole(
        values: &[f64],
        factor: f64,
        divisor: f64,
        scale: f64,
        whole: &mut [i64],
    ) {
        let count = values.len().min(whole.len());
        let (values, whole) = (&values[..count], &mut whole[..count]);
        for i in 0..count {
            whole[i] = (factor * values[i] / divisor * scale).round() as i64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn halves_go_away_from_zero_at_every_level(
            halves in proptest::collection::vec(-1_000_000_000_000..1_000_000_000_000_i64, 0..40),
        ) {
            let values: Vec<f64> = halves.iter().map(|half| *half as f64 * 0.5).collect();
            let expected: Vec<i64> =
                halves.iter().map(|half| half.signum() * (half.abs() + 1) / 2).collect();
            for (level, found) in at_each_level(|| {
                let mut found = vec![0; values.len()];
                whole(&values, 2.0, 4.0, 2.0, &mut found);
                found
            }) {
                prop_assert_eq!(&found, &expected, "{:?}", level);
            }
        }
    }
}
