//! The time line of a band.

use crate::design::{Design, PARTS_OF_TICK};
use crate::kernels::Ruler;

/// Counts parts of a tick from a period of the converters' clock on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    /// Ticks from the beginning of the first scan.
    pub epoch: i64,
    /// The same, fs.
    pub epoch_fs: i64,
    pub ruler: Ruler,
}

impl Clock {
    /// The clock of a band whose first shot is fired at `first_fs`. It starts early enough for an
    /// event that jitter puts before that.
    pub fn new(design: &Design, first_fs: i64) -> Self {
        let (tick_fs, epoch) = (design.clock.tick_fs, design.cut().epoch(first_fs));
        Self { epoch, epoch_fs: epoch * tick_fs, ruler: Ruler::new(PARTS_OF_TICK, tick_fs) }
    }

    /// Whole parts of a tick in `fs`, rounded down.
    pub fn parts(&self, fs: i64) -> i64 {
        self.ruler.parts(fs)
    }

    /// Parts of a tick from the epoch to the absolute time `time_fs`.
    pub fn time(&self, time_fs: i64) -> i64 {
        self.parts(time_fs - self.epoch_fs)
    }

    /// Parts of a tick from the beginning of the first scan to the epoch.
    pub fn epoch_parts(&self) -> i64 {
        self.epoch * i64::from(PARTS_OF_TICK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::sync::LazyLock;

    /// Sensors with ticks of three lengths.
    fn designs() -> &'static [Design] {
        static DESIGNS: LazyLock<Vec<Design>> = LazyLock::new(|| {
            let of_tick = |tick: &str| {
                let set = [("tdc.resolution_ps", tick), ("tdc.bits", "16")]
                    .map(|(key, value)| (key.to_owned(), value.to_owned()));
                Design::open("kim-park-2016", &set)
                    .unwrap_or_else(|_| Design::open("kim-park-2016", &[]).unwrap())
            };
            ["2.5", "0.1", "10.0"].map(of_tick).into()
        });
        &DESIGNS
    }

    proptest! {
        #[test]
        fn parts_are_rounded_down(fs in 0..1_000_000_000_000_i64, tick in 0..3_usize) {
            let design = &designs()[tick];
            let clock = Clock::new(design, 1_234_567_890);
            prop_assert_eq!(clock.parts(fs), fs * 64 / design.clock.tick_fs);
            prop_assert_eq!(clock.epoch_fs % design.clock.period_fs, 0);
            prop_assert!(clock.time(1_234_567_890) >= 0);
        }
    }
}
