//! Times moved by random amounts that have been tabulated.
#![allow(clippy::needless_range_loop)]

use super::level::on_every_level;

on_every_level! {
    /// Adds to each of `times` what the number in the same place draws from `cells`, of which
    /// there are 2 to the power of `bits`, 1 to 16, and tells how often a time is then below the
    /// one before it.
    ///
    /// The leading bits of a number choose the cell, the others whether they are below its bound,
    /// the upper 32 bits; then the next 16 bits are the amount, else the last 16.
    pub(crate) fn delay(times: &mut [u32], numbers: &[u32], cells: &[u64], bits: u32) -> usize {
        let count = times.len().min(numbers.len());
        let (times, numbers) = (&mut times[..count], &numbers[..count]);
        let (mut before, mut falls) = (0, 0);
        for i in 0..count {
            let time = times[i].wrapping_add_signed(drawn(numbers[i], cells, bits));
            times[i] = time;
            falls += usize::from(time < before);
            before = time;
        }
        falls
    }
}

/// What `number` draws from `cells`, as [`delay`] does.
#[inline(always)]
pub(crate) fn drawn(number: u32, cells: &[u64], bits: u32) -> i32 {
    let cell = cells[(number >> (32 - bits)) as usize];
    let amounts = cell as u32;
    let is_own = number << bits < (cell >> 32) as u32;
    (if is_own { amounts } else { amounts << 16 }) as i32 >> 16
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn times_move_by_one_of_two_amounts_at_every_level(
            table in proptest::collection::vec(any::<(u32, i16, i16)>(), 16),
            pairs in proptest::collection::vec((100_000..1_000_000_u32, any::<u32>()), 0..100),
        ) {
            let cells: Vec<u64> = table
                .iter()
                .map(|(bound, own, other)| {
                    u64::from(*bound) << 32 | u64::from(*own as u16) << 16 | u64::from(*other as u16)
                })
                .collect();
            let (times, numbers): (Vec<u32>, Vec<u32>) = pairs.iter().copied().unzip();
            let expected: Vec<u32> = pairs
                .iter()
                .map(|(time, number)| {
                    let (bound, own, other) = table[(number >> 28) as usize];
                    time.wrapping_add_signed(i32::from(if number << 4 < bound { own } else { other }))
                })
                .collect();
            let falls = expected.windows(2).filter(|pair| pair[1] < pair[0]).count();
            for (level, found) in at_each_level(|| {
                let mut times = times.clone();
                (delay(&mut times, &numbers, &cells, 4), times)
            }) {
                prop_assert_eq!(&found, &(falls, expected.clone()), "{:?}", level);
            }
        }
    }
}
