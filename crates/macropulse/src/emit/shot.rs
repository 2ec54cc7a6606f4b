//! One shot on its own, asked for by pixel.

use macropulse_codec::ShotLog;

use super::band::word;
use super::times::fired_at_fs;
use crate::design::Design;

/// Longest run in s: absolute time is an `i64` of femtoseconds, which ends after 9223 s.
const LONGEST_RUN: f64 = 9000.0;

/// A shot to one pixel: its time, and the label and the word that it carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shot {
    /// Absolute time at which the first chip leaves, fs.
    pub fired_at_fs: i64,
    /// The number the macropulse carries; 0 where shots carry none.
    pub label: u16,
    /// Index of the code word in its family; 0 where shots are not coded.
    pub word: u16,
}

/// The shot of scan number `scan` to the pixel at `row` and `column`; `None` if the pixel is not in
/// the image or the scan not within [`most_scans`].
pub fn shot_of_pixel(design: &Design, scan: u64, row: u32, column: u32) -> Option<Shot> {
    if row >= design.scan.rows || column >= design.scan.columns || scan >= most_scans(design) {
        return None;
    }
    let (row, column) = (row as u16, column as u16);
    Some(Shot {
        fired_at_fs: fired_at_fs(design, scan, design.scan.model().order_of(row, column)),
        label: design.emission.coding().label_of(column),
        word: word(design, row, column),
    })
}

/// Scans a run may have before its clock ends: those of two and a half hours.
pub fn most_scans(design: &Design) -> u64 {
    (LONGEST_RUN / design.scan_period()) as u64
}

/// The shot of `log` that `design` fires at the pixel at this row and column; the first one, if
/// there are several.
pub fn shot_at(design: &Design, log: &ShotLog, (row, column): (u16, u16)) -> Option<usize> {
    let per_scan = design.shots_per_scan();
    let order = design.scan.model().order_of(row, column);
    let after = (order + per_scan - log.first % per_scan) % per_scan;
    usize::try_from(after).ok().filter(|shot| *shot < log.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emit::bands;

    #[test]
    fn the_second_pixel_of_the_paper_is_sent_with_the_second_word() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let shot = shot_of_pixel(&design, 0, 0, 1).unwrap();
        assert_eq!(shot, Shot { fired_at_fs: 40_945_000, label: 1, word: 1 });
    }

    #[test]
    fn it_is_the_shot_the_log_has() {
        let resonant = [("scan.raster.mirror".to_owned(), "sinusoidal".to_owned())];
        for (name, set) in
            [("kim-park-2016", &[][..]), ("kim-park-2016", &resonant), ("hdl-64e", &[])]
        {
            let design = Design::open(name, set).unwrap();
            let log = bands(&design, 1).nth(1).unwrap().shot_log(&design);
            for i in log.owned.clone() {
                let (row, column) = (u32::from(log.row[i]), u32::from(log.column[i]));
                let shot = shot_of_pixel(&design, 1, row, column).unwrap();
                assert_eq!(
                    (shot.fired_at_fs, shot.label, shot.word),
                    (log.fired_at_fs[i], log.label[i], log.word[i]),
                    "{name}: {row}, {column}"
                );
            }
        }
    }

    #[test]
    fn outside_the_image_and_after_the_clock_there_is_none() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        assert_eq!(shot_of_pixel(&design, 0, 480, 0), None);
        assert_eq!(shot_of_pixel(&design, 0, 0, 848), None);
        assert_eq!(most_scans(&design), 540_000);
        assert!(shot_of_pixel(&design, 539_999, 479, 847).unwrap().fired_at_fs > 0);
        assert_eq!(shot_of_pixel(&design, 540_000, 0, 0), None);
    }

    #[test]
    fn every_shot_is_found_by_its_pixel() {
        use crate::emit::bands;
        for name in ["hdl-64e", "peregrine", "kim-park-2016", "vlp-16", "rosette-mid-40"] {
            let design = Design::open(name, &[]).unwrap();
            let log = bands(&design, 1).next().unwrap().shot_log(&design);
            for shot in 0..log.len() {
                let pixel = (log.row[shot], log.column[shot]);
                assert_eq!(shot_at(&design, &log, pixel), Some(shot), "{name}");
            }
        }
        let design = Design::open("hdl-64e", &[]).unwrap();
        let log = bands(&design, 1).next().unwrap().shot_log(&design);
        assert_eq!(shot_at(&design, &log, (0, 4499)), None);
    }
}
