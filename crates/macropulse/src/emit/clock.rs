//! The shots of a lidar that runs by a clock of its own.
//!
//! Its scans repeat without end, before its clock reads 0 as well as after. 1000 s of its clock hold a whole
//! number of scans. So a shot of any age is one of the first 1000 s, moved by a multiple of them. Both clocks
//! are whole numbers of femtoseconds; conversion rounds down.

use std::ops::Range;

use super::band::log_of;
use super::times::fired_at_fs;
use crate::design::Design;
use crate::units::FS_PER_S;
use macropulse_codec::ShotLog;

/// Drift is counted in parts of 10¹².
const WHOLE: i128 = 1_000_000_000_000;

/// The time in which every sensor makes a whole number of scans, fs.
const BLOCK_FS: i128 = FS_PER_S as i128 * 1000;

/// Shots handed over at once.
const SHOTS: u64 = 4096;

/// A clock beside ours: at our time t it reads (t − phase) · (1 + drift).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Clock {
    /// Our time at which it reads 0, fs.
    pub phase_fs: i64,
    /// How much faster than ours it runs, in parts of 10¹²; above −10¹².
    pub drift: i64,
}

impl Clock {
    /// Our time when it reads `its_fs`, fs.
    fn ours(&self, its_fs: i128) -> i128 {
        (its_fs * WHOLE).div_euclid(WHOLE + i128::from(self.drift)) + i128::from(self.phase_fs)
    }

    /// Returns its reading at our time `ours_fs`, fs.
    fn its(&self, ours_fs: i64) -> i128 {
        let passed = i128::from(ours_fs) - i128::from(self.phase_fs);
        (passed * (WHOLE + i128::from(self.drift))).div_euclid(WHOLE)
    }

    /// How long a unit of its time takes by ours.
    pub fn stretch(&self) -> f64 {
        WHOLE as f64 / (WHOLE as f64 + self.drift as f64)
    }

    /// The shots that `design` fires by this clock in the `span` of our time, fs, in logs of some
    /// thousand at most, all of them owned.
    ///
    /// Their times are ours. Shots are counted from reading 0; those before it wrap.
    pub fn shots<'a>(
        &'a self,
        design: &'a Design,
        span: Range<i64>,
    ) -> impl Iterator<Item = ShotLog> + 'a {
        let per_scan = design.shots_per_scan();
        let per_block = per_scan * design.scan.rate_millihertz;
        let block = self.its(span.start).div_euclid(BLOCK_FS);
        let ours = move |its_fs: i64| self.ours(block * BLOCK_FS + i128::from(its_fs));
        let fired = move |shot: u64| ours(fired_at_fs(design, shot / per_scan, shot % per_scan));
        let [start, end] = [span.start, span.end].map(i128::from);
        let first = first_where(0..2 * per_block, |shot| fired(shot) >= start);
        let end = first_where(first..first + per_block, |shot| fired(shot) >= end);
        let before = (block as u64).wrapping_mul(per_block);
        (first..end).step_by(SHOTS as usize).map(move |from| {
            let mut log = log_of(design, from..end.min(from + SHOTS));
            log.first = log.first.wrapping_add(before);
            log.fired_at_fs.iter_mut().for_each(|time| *time = ours(*time) as i64);
            log.owned = 0..log.len();
            log
        })
    }
}

/// The first of `numbers` for which `is` holds, if it holds for all behind it, too.
fn first_where(numbers: Range<u64>, is: impl Fn(u64) -> bool) -> u64 {
    let Range { mut start, mut end } = numbers;
    while start < end {
        let middle = start + (end - start) / 2;
        if is(middle) {
            end = middle;
        } else {
            start = middle + 1;
        }
    }
    start
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emit::bands;

    /// All shots in `span`, as one log.
    fn shots(clock: Clock, design: &Design, span: Range<i64>) -> ShotLog {
        let mut all = ShotLog::default();
        for log in clock.shots(design, span) {
            if all.is_empty() {
                all.first = log.first;
            }
            all.fired_at_fs.extend(log.fired_at_fs);
            all.row.extend(log.row);
            all.column.extend(log.column);
            all.label.extend(log.label);
            all.word.extend(log.word);
            all.channel.extend(log.channel);
        }
        all.owned = 0..all.len();
        all
    }

    #[test]
    fn by_our_own_clock_they_are_our_own_shots() {
        for name in ["kim-park-2016", "hdl-64e", "peregrine", "vlp-16"] {
            let design = Design::open(name, &[]).unwrap();
            let band = bands(&design, 2).next().unwrap();
            let ours = ShotLog {
                owned: 0..band.shots as usize,
                ..log_of(&design, {
                    let first = 2 * design.shots_per_scan();
                    first..first + band.shots
                })
            };
            let span = ours.fired_at_fs[0]..ours.fired_at_fs[ours.len() - 1] + 1;
            assert_eq!(shots(Clock::default(), &design, span), ours, "{name}");
        }
    }

    #[test]
    fn before_its_clock_reads_0_it_fires_too() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let clock = Clock { phase_fs: 50_000_000, drift: 0 };
        let log = shots(clock, &design, 0..100_000_000);
        // One shot every 40.9 ns; the last one of a scan, then the first of the next.
        assert_eq!((log.first, log.len()), (u64::MAX, 3));
        assert_eq!((log.row[0], log.column[0]), (479, 847));
        assert_eq!((log.row[1], log.column[1]), (0, 0));
        assert_eq!(log.fired_at_fs[1], 50_000_000);
    }

    #[test]
    fn a_fast_clock_gains_20_microseconds_in_a_second() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let clock = Clock { phase_fs: 0, drift: 20_000_000 };
        // Shot 0 of scan 60 is fired when its clock has counted a second.
        let early = FS_PER_S - 20_000_000_000;
        let log = shots(clock, &design, early..early + 1_000_000);
        assert_eq!((log.first, log.len()), (60 * 848 * 480, 1));
        // 1 s / 1.00002, rounded down.
        assert_eq!(log.fired_at_fs[0], 999_980_000_399_992);
        assert!((clock.stretch() - 1.0 / 1.00002).abs() < 1e-15);
    }

    #[test]
    fn spans_side_by_side_have_every_shot_once() {
        let resonant = [("scan.raster.mirror".to_owned(), "sinusoidal".to_owned())];
        for (name, set) in
            [("kim-park-2016", &[][..]), ("kim-park-2016", &resonant), ("hdl-64e", &[])]
        {
            let design = Design::open(name, set).unwrap();
            for phase_fs in [-7, 0, 3 * FS_PER_S, -BLOCK_FS as i64] {
                let clock = Clock { phase_fs, drift: -31_415_926 };
                let whole = shots(clock, &design, 0..30_000_000_000);
                let mut parts = shots(clock, &design, 0..12_345_678_901);
                let second = shots(clock, &design, 12_345_678_901..30_000_000_000);
                assert_eq!(parts.first.wrapping_add(parts.len() as u64), second.first);
                parts.fired_at_fs.extend(second.fired_at_fs);
                assert_eq!(parts.fired_at_fs, whole.fired_at_fs, "{name}");
                assert!(whole.fired_at_fs.is_sorted() && whole.len() > 10, "{name}");
            }
        }
    }

    #[test]
    fn after_two_and_a_half_hours_nothing_overflows() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let clock = Clock { phase_fs: -BLOCK_FS as i64, drift: 1_000_000_000 };
        let end = 9000 * FS_PER_S;
        let log = shots(clock, &design, end..end + 1_000_000_000);
        assert!((24..=25).contains(&log.len()), "{}", log.len());
        assert!(log.fired_at_fs.iter().all(|time| (end..end + 1_000_000_000).contains(time)));
    }
}
