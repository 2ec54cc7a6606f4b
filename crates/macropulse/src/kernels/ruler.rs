//! Femtoseconds to parts of a tick.
#![allow(clippy::needless_range_loop)]

use macropulse_codec::on_every_level;

/// Counts parts of a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ruler {
    /// Parts of a tick.
    parts: i64,
    tick_fs: i64,
    parts_per_fs: f64,
}

impl Ruler {
    /// A ruler with this number of `parts` in a tick of `tick_fs`.
    pub(crate) fn new(parts: u32, tick_fs: i64) -> Self {
        let parts_per_fs = f64::from(parts) / tick_fs as f64;
        Self { parts: i64::from(parts), tick_fs, parts_per_fs }
    }

    /// Whole parts of a tick in `fs`, rounded down.
    #[inline(always)]
    pub(crate) fn parts(&self, fs: i64) -> i64 {
        self.corrected((fs as f64 * self.parts_per_fs) as i64, fs)
    }

    /// The parts in `fs` if they are `guessed` to be one more or one less at most.
    #[inline(always)]
    fn corrected(&self, guessed: i64, fs: i64) -> i64 {
        // Not far from zero, so that what wraps in between is of no account.
        let over = fs.wrapping_mul(self.parts).wrapping_sub(guessed.wrapping_mul(self.tick_fs));
        guessed + i64::from(over >= self.tick_fs) - i64::from(over < 0)
    }
}

/// Added to a number below 2⁵¹, it leaves it rounded in the lowest bits.
const ROUNDING: f64 = 1.5 * (1_u64 << 52) as f64;

/// `number` rounded to the nearest whole one, if it is below 2⁵¹: conversions that processors have
/// are checked for what does not fit, one by one.
#[inline(always)]
fn nearest(number: f64) -> i64 {
    (number + ROUNDING).to_bits().wrapping_sub(ROUNDING.to_bits()) as i64
}

on_every_level! {
    /// Puts what `ruler` counts until each of `marks` in its place in `times`, where a pulse train
    /// of chips of `chip_fs` begins at `begins_fs`; all of it below 2⁵¹.
    pub(crate) fn arrivals(
        ruler: Ruler,
        begins_fs: i64,
        chip_fs: f64,
        marks: &[u16],
        times: &mut [i64],
    ) {
        let count = marks.len().min(times.len());
        let (marks, times) = (&marks[..count], &mut times[..count]);
        for i in 0..count {
            let fs = begins_fs + nearest((f64::from(marks[i]) * chip_fs).floor());
            times[i] = ruler.corrected(nearest(fs as f64 * ruler.parts_per_fs), fs);
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
        fn marks_arrive_when_they_do_at_every_level(
            marks in proptest::collection::vec(any::<u16>(), 0..50),
            begins_fs in -1_000_000_000_000..1_000_000_000_000_i64,
            (parts, tick_fs) in (1..65_u32, 1..100_000_i64),
            chip_fs in 1.0..1e6_f64,
        ) {
            let ruler = Ruler::new(parts, tick_fs);
            let arrives_fs = |mark: &u16| begins_fs + (f64::from(*mark) * chip_fs) as i64;
            let exact = |fs: i64| (fs * i64::from(parts)).div_euclid(tick_fs);
            let expected: Vec<i64> = marks.iter().map(|mark| exact(arrives_fs(mark))).collect();
            for (level, found) in at_each_level(|| {
                let mut found = vec![0; marks.len()];
                arrivals(ruler, begins_fs, chip_fs, &marks, &mut found);
                found
            }) {
                prop_assert_eq!(&found, &expected, "{:?}", level);
            }
        }
    }
}
