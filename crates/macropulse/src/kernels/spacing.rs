//! How far apart times are.
#![allow(clippy::needless_range_loop)]

use macropulse_codec::on_every_level;

on_every_level! {
    /// Returns true if each of `later` follows the one of `earlier` in the same place by `least` or more;
    /// both of one length.
    pub(crate) fn all_apart(earlier: &[u32], later: &[u32], least: u32) -> bool {
        let count = later.len().min(earlier.len());
        let (earlier, later) = (&earlier[..count], &later[..count]);
        let mut apart = true;
        for i in 0..count {
            apart &= later[i].wrapping_sub(earlier[i]) >= least;
        }
        apart
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn one_pair_too_close_is_noticed_at_every_level(
            earlier in proptest::collection::vec(0..1_000_000_u32, 1..100),
            least in 1..1000_u32,
            close in proptest::option::of(0.0..1.0_f64),
        ) {
            let mut later: Vec<u32> = earlier.iter().map(|time| time + least).collect();
            if let Some(place) = close {
                let place = (place * later.len() as f64) as usize;
                later[place] -= 1;
            }
            for (level, apart) in at_each_level(|| all_apart(&earlier, &later, least)) {
                prop_assert_eq!(apart, close.is_none(), "{:?}", level);
            }
        }
    }
}
