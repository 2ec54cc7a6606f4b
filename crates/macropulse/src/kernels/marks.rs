//! Marks against ticks.

use super::level::on_every_level;

on_every_level! {
    /// Whether `ticks[i] == start + scale · marks[i]` for all `i`; both of one length.
    pub(crate) fn matching(ticks: &[u32], marks: &[u16], start: u32, scale: u32) -> bool {
        // In blocks, so that a mismatch ends it early and no step has to ask for it.
        const BLOCK: usize = 16;
        let mut ticks = ticks.chunks_exact(BLOCK);
        let mut marks = marks.chunks_exact(BLOCK);
        for (ticks, marks) in (&mut ticks).zip(&mut marks) {
            let mut wrong = 0;
            for (tick, mark) in ticks.iter().zip(marks) {
                wrong |= tick ^ start.wrapping_add(scale.wrapping_mul(u32::from(*mark)));
            }
            if wrong != 0 {
                return false;
            }
        }
        let rest = ticks.remainder().iter().zip(marks.remainder());
        rest.fold(0, |wrong, (tick, mark)| {
            wrong | (tick ^ start.wrapping_add(scale.wrapping_mul(u32::from(*mark))))
        }) == 0
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::forced::at_each_level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn one_wrong_tick_is_noticed_at_every_level(
            mut marks in proptest::collection::vec(0_u16.., 1..330),
            start in 0..1_000_000_u32,
            scale in 1..20_u32,
            wrong in proptest::option::of((0.0..1.0_f64, 1..1000_u32)),
        ) {
            marks.sort_unstable();
            let mut ticks: Vec<u32> = marks.iter().map(|&mark| start + scale * u32::from(mark)).collect();
            if let Some((place, by)) = wrong {
                let place = (place * ticks.len() as f64) as usize;
                ticks[place] += by;
            }
            for (level, all) in at_each_level(|| matching(&ticks, &marks, start, scale)) {
                prop_assert_eq!(all, wrong.is_none(), "{:?}", level);
            }
        }
    }
}
