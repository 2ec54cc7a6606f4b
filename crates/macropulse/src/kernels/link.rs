//! Light of many targets in clear air.

use macropulse_codec::on_every_level;

on_every_level! {
    /// Turns the effective reflectances that `photons` holds into mean photons per mark, N = N₁·ρ/R²: N₁ are those
    /// `at_one_metre` from a target of reflectance 1, R are the `ranges`, m. None come where ρ or R is not positive.
    pub(crate) fn photons_from(at_one_metre: f64, ranges: &[f64], photons: &mut [f64]) {
        let count = ranges.len().min(photons.len());
        let (ranges, photons) = (&ranges[..count], &mut photons[..count]);
        for i in 0..count {
            let there_are = photons[i] > 0.0 && ranges[i] > 0.0;
            let light = at_one_metre * photons[i] / (ranges[i] * ranges[i]);
            photons[i] = if there_are { light } else { 0.0 };
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
        fn light_falls_with_the_square_of_the_range_at_every_level(
            targets in proptest::collection::vec((-1.0..2.0_f64, -10.0..500.0_f64), 0..40),
            at_one_metre in prop_oneof![1.0..1e9_f64, Just(f64::INFINITY)],
        ) {
            let (reflectances, ranges): (Vec<f64>, Vec<f64>) = targets.iter().copied().unzip();
            let expected = targets.iter().map(|&(reflectance, range)| match () {
                () if reflectance <= 0.0 || range <= 0.0 => 0.0,
                () => at_one_metre * reflectance / range.powi(2),
            });
            let expected: Vec<f64> = expected.collect();
            for (level, photons) in at_each_level(|| {
                let mut photons = reflectances.clone();
                photons_from(at_one_metre, &ranges, &mut photons);
                photons
            }) {
                prop_assert_eq!(&photons, &expected, "{:?}", level);
            }
        }
    }
}
