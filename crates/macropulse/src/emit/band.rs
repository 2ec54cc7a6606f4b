//! Bands: the fixed runs of shots in which everything is computed.
//!
//! How a scan is cut into bands depends on the sensor alone, never on the number of threads, so
//! the bytes that come out do not depend on it either.

use super::ShotLog;
use super::pattern::{fired_at_fs, pixel};
use crate::design::{Design, Pattern};
use crate::units::{fs_from_s, tof_from_range};

/// A band holds about this many shots, in whole lines.
const SHOTS: u64 = 8192;

/// One band: consecutive shots of one scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Band {
    /// Number of the scan, from 0.
    pub scan: u64,
    /// First shot within the scan.
    pub first: u64,
    /// Number of shots.
    pub shots: u64,
}

/// The bands of scan number `scan`, in the order of time.
pub fn bands(design: &Design, scan: u64) -> impl Iterator<Item = Band> {
    let line = match &design.scan.pattern {
        Pattern::Raster { .. } => u64::from(design.scan.columns),
        Pattern::Spinning { order, .. } => order.len() as u64,
        Pattern::Flash { .. } => design.shots_per_scan(),
    };
    let total = design.shots_per_scan();
    // Ticks within a band are counted in 32 bits; leave room for the halo.
    let longest_fs = (i64::from(u32::MAX) / 4) as f64 * design.tdc.tick_fs as f64;
    let line_fs = design.scan_period() * 1e15 * line as f64 / total as f64;
    let lines = (SHOTS / line).min((longest_fs / line_fs) as u64).max(1);
    let step = lines * line;
    (0..total.div_ceil(step)).map(move |n| Band {
        scan,
        first: n * step,
        shots: step.min(total - n * step),
    })
}

impl Band {
    /// The shots of the band and of its halo: everything whose light can arrive together with
    /// light of the band's own shots.
    ///
    /// A sensor whose shots each have a detector of their own needs no halo.
    pub fn shot_log(&self, design: &Design) -> ShotLog {
        let per_scan = design.shots_per_scan();
        let home_first = self.scan * per_scan + self.first;
        let halo = if design.is_coded() { halo_shots(design) } else { 0 };
        let first = home_first.saturating_sub(halo);
        let last = home_first + self.shots + halo;
        let count = (last - first) as usize;
        let mut log = ShotLog { first, ..ShotLog::default() };
        log.fired_at_fs.reserve_exact(count);
        for shot in first..last {
            let (scan, order) = (shot / per_scan, shot % per_scan);
            let (row, column) = pixel(design, order);
            log.fired_at_fs.push(fired_at_fs(design, scan, order));
            log.row.push(row);
            log.column.push(column);
            log.label.push(if design.is_coded() { column } else { 0 });
            log.word.push(word(design, row, column));
            log.channel.push(match design.scan.pattern {
                Pattern::Raster { .. } => 0,
                Pattern::Spinning { .. } => row,
                Pattern::Flash { .. } => order as u16,
            });
        }
        let home = (home_first - first) as usize;
        log.home = home..home + self.shots as usize;
        log
    }
}

/// `first_word + pixel mod word_modulus`, the pixel counted row by row.
pub(super) fn word(design: &Design, row: u16, column: u16) -> u16 {
    let pixel = u32::from(row) * design.scan.columns + u32::from(column);
    (design.coding.first_word + pixel % design.coding.word_modulus) as u16
}

/// Shots fired in one range gate and one macropulse, rounded up.
///
/// Counted with the shortest dwell, because a resonant mirror is faster than the mean.
fn halo_shots(design: &Design) -> u64 {
    let derived = design.derived();
    let dwell = fs_from_s(derived.shortest_dwell.min(derived.pixel_period)).max(1);
    let reach = fs_from_s(tof_from_range(design.scan.max_range) + derived.macropulse);
    reach as u64 / dwell as u64 + 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_a_scan_without_gap_or_overlap() {
        for name in ["kim-park-2016", "hdl-64e", "peregrine"] {
            let design = Design::open(name, &[]).unwrap();
            let mut next = 0;
            for band in bands(&design, 3) {
                assert_eq!((band.scan, band.first), (3, next));
                next += band.shots;
            }
            assert_eq!(next, design.shots_per_scan());
        }
    }

    #[test]
    fn the_halo_reaches_into_the_scan_before_and_is_absent_at_the_beginning() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let log = bands(&design, 0).next().unwrap().shot_log(&design);
        assert_eq!((log.first, log.home.start), (0, 0));
        let log = bands(&design, 1).next().unwrap().shot_log(&design);
        assert!(log.home.start >= 25);
        assert_eq!(log.row[log.home.start - 1], 479);
        assert_eq!(log.row[log.home.start], 0);
    }

    #[test]
    fn shots_in_flight_together_differ_by_word_within_a_scan_and_by_label_across_its_end() {
        for name in ["kim-park-2016", "kim-park-2016-fixed"] {
            let design = Design::open(name, &[]).unwrap();
            for band in bands(&design, 1) {
                let log = band.shot_log(&design);
                let same_scan = |i: usize| (log.first + i as u64) / design.shots_per_scan() == 1;
                for i in 0..log.len() - 24 {
                    let clash = (i + 1..i + 25).find(|&j| log.word[j] == log.word[i]);
                    if let Some(j) = clash {
                        assert!(!(same_scan(i) && same_scan(j)), "{name}: band at {}", band.first);
                        assert_ne!(log.label[i], log.label[j]);
                    }
                }
            }
        }
    }
}
