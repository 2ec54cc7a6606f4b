//! The shot log: what the sensor itself knows of what it sent.

use std::ops::Range;

use super::pattern::order_of_pixel;
use crate::design::Design;

/// A run of consecutive shots, as columns. Shot `i` of the log has the absolute id `first + i`.
///
/// This is everything the receiver may know of the transmitter: where and when each shot was
/// fired and with which code. It holds nothing of the scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ShotLog {
    /// Absolute id of the first shot here, counted from the first shot of the first scan.
    pub first: u64,
    /// Absolute time at which the first chip leaves, fs; never decreasing.
    pub fired_at_fs: Vec<i64>,
    /// Row of the pixel, 0 at the top.
    pub row: Vec<u16>,
    /// Column of the pixel, 0 at the left.
    pub column: Vec<u16>,
    /// The number the macropulse carries; 0 where shots carry none.
    pub label: Vec<u16>,
    /// Index of the code word in its family; 0 where shots are not coded.
    pub word: Vec<u16>,
    /// The detector that listens to this shot.
    pub channel: Vec<u16>,
    /// The shots this band exists for. The others are its halo: they are generated and decoded
    /// because their light overlaps, and their results dropped.
    pub home: Range<usize>,
}

impl ShotLog {
    /// Number of shots, halo included.
    pub fn len(&self) -> usize {
        self.fired_at_fs.len()
    }

    /// The shot here that `design` fires at the pixel at this row and column; the first one, if
    /// there are several.
    pub fn shot_at(&self, design: &Design, (row, column): (u16, u16)) -> Option<usize> {
        let per_scan = design.shots_per_scan();
        let order = order_of_pixel(design, row, column);
        let after = (order + per_scan - self.first % per_scan) % per_scan;
        usize::try_from(after).ok().filter(|shot| *shot < self.len())
    }

    /// Whether there is no shot at all.
    pub fn is_empty(&self) -> bool {
        self.fired_at_fs.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emit::bands;

    #[test]
    fn every_shot_is_found_by_its_pixel() {
        for name in ["hdl-64e", "peregrine", "kim-park-2016"] {
            let design = Design::open(name, &[]).unwrap();
            let log = bands(&design, 1).next().unwrap().shot_log(&design);
            for shot in 0..log.len() {
                let pixel = (log.row[shot], log.column[shot]);
                assert_eq!(log.shot_at(&design, pixel), Some(shot), "{name}");
            }
        }
        let design = Design::open("hdl-64e", &[]).unwrap();
        let log = bands(&design, 1).next().unwrap().shot_log(&design);
        assert_eq!(log.shot_at(&design, (0, 4499)), None);
    }
}
