//! Bands: the fixed runs of shots in which everything is computed.
//!
//! How a scan is cut into bands depends on the sensor alone, never on the number of threads, so
//! the bytes that come out do not depend on it either.

use std::iter::repeat_n;
use std::ops::{Range, RangeInclusive};

use super::times::{EqualSteps, fired_at_fs};
use crate::design::{Design, SHOTS_OF_BAND};
use macropulse_codec::ShotLog;

/// Approximate number of shots in a band if a few bands stand for a scan. It is small, so that some thousand
/// shots come from several places.
const SHOTS_OF_FEW: u64 = 1700;

/// Shots of a log that are worked out together.
const PART: u64 = 4096;

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
    bands_of(design, scan, SHOTS_OF_BAND)
}

/// Returns bands half as long. A few of them are computed if they are to stand for the whole scan.
pub fn short_bands(design: &Design, scan: u64) -> impl Iterator<Item = Band> {
    bands_of(design, scan, SHOTS_OF_FEW)
}

/// Returns the bands of about `shots` each.
fn bands_of(design: &Design, scan: u64, shots: u64) -> impl Iterator<Item = Band> {
    let total = design.shots_per_scan();
    let step = shots_of_band(design, shots);
    (0..total.div_ceil(step)).flat_map(move |n| {
        let mut next = n * step;
        let end = total.min(next + step);
        std::iter::from_fn(move || {
            let first = next;
            next = first + fitting(design, scan, first..end);
            (first < end).then_some(Band { scan, first, shots: next - first })
        })
    })
}

/// Returns the number of these `shots` of a scan, from the first on, that the clock of one band counts. These
/// are all, unless there is a pause between them that is longer.
fn fitting(design: &Design, scan: u64, shots: Range<u64>) -> u64 {
    let count = shots.end.saturating_sub(shots.start);
    let fired = |shot: u64| fired_at_fs(design, scan, shots.start + shot);
    let room_fs = design.longest_band_fs();
    let fits = |count: u64| fired(count - 1) - fired(0) <= room_fs;
    most(1..=count, fits)
}

/// The last of these `counts` for which `fits` is true, which it is up to there; the first if it never is.
fn most(counts: RangeInclusive<u64>, fits: impl Fn(u64) -> bool) -> u64 {
    let (mut low, mut high) = counts.into_inner();
    if low > high || fits(high) {
        return high;
    }
    while high - low > 1 {
        let middle = u64::midpoint(low, high);
        if fits(middle) { low = middle } else { high = middle }
    }
    low
}

/// Returns the number of shots in every band but the last, about `shots`. These are whole lines, or equal
/// parts of a line that takes longer than the clock of a band counts.
fn shots_of_band(design: &Design, shots: u64) -> u64 {
    if design.scan.is_one_flash() {
        return design.shots_per_scan();
    }
    let line = design.scan.model().line();
    let room_fs = design.longest_band_fs();
    let line_fs = design.scan_period() * 1e15 * line as f64 / design.shots_per_scan() as f64;
    let lines = (shots / line).min((room_fs as f64 / line_fs) as u64);
    if lines > 0 || line_fs <= room_fs as f64 {
        return lines.max(1) * line;
    }
    // A mirror that swings is slowest at the ends of a line.
    let lasts_fs =
        |from: u64, to: u64| fired_at_fs(design, 0, to - 1) - fired_at_fs(design, 0, from);
    let fits = |shots: u64| lasts_fs(0, shots).max(lasts_fs(line - shots, line)) <= room_fs;
    // The fewest parts that are short enough, as equal as they can be.
    let longest = most(1..=line.div_ceil(2), fits);
    line.div_ceil(line.div_ceil(longest))
}

impl Band {
    /// The band that owns `shot`, counted from the first shot of the first scan.
    pub fn of_shot(design: &Design, shot: u64) -> Self {
        let total = design.shots_per_scan();
        let step = shots_of_band(design, SHOTS_OF_BAND);
        let (scan, shot) = (shot / total, shot % total);
        let mut band = Self::from(design, scan, shot / step * step);
        while band.first + band.shots <= shot {
            band = Self::from(design, scan, band.first + band.shots);
        }
        band
    }

    /// The shot behind its last one, counted from the first shot of the first scan.
    pub fn end(&self, design: &Design) -> u64 {
        self.scan * design.shots_per_scan() + self.first + self.shots
    }

    /// The band behind it, in its scan or in the next one.
    pub fn next(&self, design: &Design) -> Self {
        let first = self.first + self.shots;
        let total = design.shots_per_scan();
        let (scan, first) = if first < total { (self.scan, first) } else { (self.scan + 1, 0) };
        Self::from(design, scan, first)
    }

    /// The band that begins with shot `first` of a scan.
    fn from(design: &Design, scan: u64, first: u64) -> Self {
        let step = shots_of_band(design, SHOTS_OF_BAND);
        let end = design.shots_per_scan().min((first / step + 1) * step);
        Self { scan, first, shots: fitting(design, scan, first..end) }
    }

    /// The ticks that the receiver is given of the band, absolute; and those of them that are the
    /// band's own: up to where those of the next band begin.
    pub fn ticks(&self, design: &Design) -> (Range<i64>, Range<i64>) {
        let fired = |shot: u64| fired_at_fs(design, self.scan, self.first + shot);
        let cut = design.cut();
        let seen = cut.ticks(fired(0), fired(self.shots - 1));
        let next = self.next(design);
        let own = seen.start..cut.opens(fired_at_fs(design, next.scan, next.first));
        (seen, own)
    }

    /// The shots of the band and its guard shots: all whose light can arrive in the ticks of the band,
    /// be it from beyond the range gate ([`Design::cut`]).
    pub fn shot_log(&self, design: &Design) -> ShotLog {
        let owned_first = self.scan * design.shots_per_scan() + self.first;
        let owned_last = owned_first + self.shots;
        let shots = with_guard(design, owned_first..owned_last);
        let owned = (owned_first - shots.start) as usize;
        ShotLog { owned: owned..owned + self.shots as usize, ..log_of(design, shots) }
    }
}

/// The shots of scan number `scan` and the guard shots around it, counted from the first shot of the
/// first scan: all that its returns can be decoded with.
pub fn shots_of_scan(design: &Design, scan: u64) -> Range<u64> {
    let first = scan * design.shots_per_scan();
    with_guard(design, first..first + design.shots_per_scan())
}

/// The log of `shots`, in parts of some thousand, all of them owned.
pub fn logs(design: &Design, shots: Range<u64>) -> impl Iterator<Item = ShotLog> {
    let ends = shots.end;
    shots.step_by(PART as usize).map(move |from| {
        let log = log_of(design, from..ends.min(from + PART));
        ShotLog { owned: 0..log.len(), ..log }
    })
}

/// The shots `owned`, those before them whose light is still under way when their ticks begin, and
/// those after them that are fired before their ticks end.
fn with_guard(design: &Design, owned: Range<u64>) -> Range<u64> {
    let per_scan = design.shots_per_scan();
    let fired = |shot: u64| fired_at_fs(design, shot / per_scan, shot % per_scan);
    let cut = design.cut();
    let fired_fs = cut.shots(fired(owned.start), fired(owned.end - 1));
    let (opens, closes) = fired_fs.into_inner();
    // The mean number of shots in that time comes first, and then single shots: a resonant mirror is faster
    // in the middle of a line, and slower at its ends.
    let mean = (cut.history_fs as f64 * per_scan as f64 / (design.scan_period() * 1e15)) as u64;
    let (mut first, mut end) = (owned.start.saturating_sub(mean), owned.end + mean);
    while first > 0 && fired(first - 1) >= opens {
        first -= 1;
    }
    while first < owned.start && fired(first) < opens {
        first += 1;
    }
    while fired(end) <= closes {
        end += 1;
    }
    while end > owned.end && fired(end - 1) > closes {
        end -= 1;
    }
    first..end
}

/// The log of `shots`; its `owned` is left open.
pub(super) fn log_of(design: &Design, shots: Range<u64>) -> ShotLog {
    let count = (shots.end - shots.start) as usize;
    let mut log = ShotLog { first: shots.start, ..ShotLog::default() };
    let per_scan = design.shots_per_scan();
    log.fired_at_fs = vec![0; count];
    match EqualSteps::new(design, shots.start) {
        Some(steps) => steps.fill(&mut log.fired_at_fs),
        None => log.fired_at_fs.iter_mut().zip(shots.clone()).for_each(|(place, shot)| {
            *place = fired_at_fs(design, shot / per_scan, shot % per_scan);
        }),
    }
    for column in [&mut log.row, &mut log.column, &mut log.label, &mut log.word, &mut log.channel] {
        column.reserve_exact(count);
    }
    match design.scan.model().draws_from_the_left() {
        true => add_lines(design, shots, &mut log),
        false => add_pixels(design, shots, &mut log),
    }
    log
}

/// Pixels, labels and words of one beam that goes from the left to the right, line by line.
fn add_lines(design: &Design, shots: Range<u64>, log: &mut ShotLog) {
    let columns = u64::from(design.scan.columns);
    let mut next = shots.start;
    while next < shots.end {
        let (row, column) = design.scan.model().pixel(next % design.shots_per_scan());
        let run = (columns - u64::from(column)).min(shots.end - next) as usize;
        let pixels = column..column + run as u16;
        log.row.extend(repeat_n(row, run));
        log.column.extend(pixels.clone());
        log.label.extend(pixels.map(|column| design.emission.coding().label_of(column)));
        let (first, modulus) = (
            design.emission.coding().first_word as u16,
            design.emission.coding().word_modulus as u16,
        );
        let mut word = word(design, row, column);
        log.word.extend((0..run).map(|_| {
            let now = word;
            word += 1;
            word -= if word == first + modulus { modulus } else { 0 };
            now
        }));
        log.channel.extend(repeat_n(0, run));
        next += run as u64;
    }
}

/// Pixels, labels, words and detectors in whatever order.
fn add_pixels(design: &Design, shots: Range<u64>, log: &mut ShotLog) {
    let pattern = design.scan.model();
    for shot in shots {
        let order = shot % design.shots_per_scan();
        let (row, column) = pattern.pixel(order);
        log.row.push(row);
        log.column.push(column);
        log.label.push(design.emission.coding().label_of(column));
        log.word.push(word(design, row, column));
        log.channel.push(pattern.channel_of(order, row));
    }
}

/// `first_word + pixel mod word_modulus`, the pixel counted row by row.
pub(super) fn word(design: &Design, row: u16, column: u16) -> u16 {
    let pixel = u32::from(row) * design.scan.columns + u32::from(column);
    (design.emission.coding().first_word + pixel % design.emission.coding().word_modulus) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_a_scan_without_gap_or_overlap() {
        for name in ["kim-park-2016", "hdl-64e", "peregrine", "vlp-16", "rosette-mid-40"] {
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
    fn the_band_behind_the_last_one_is_the_first_of_the_next_scan() {
        for name in ["kim-park-2016", "hdl-64e", "peregrine"] {
            let design = Design::open(name, &[]).unwrap();
            let all: Vec<Band> = (0..2).flat_map(|scan| bands(&design, scan)).collect();
            for pair in all.windows(2) {
                assert_eq!(pair[0].next(&design), pair[1], "{name}");
                let end = pair[0].end(&design);
                assert_eq!(Band::of_shot(&design, end - 1), pair[0], "{name}");
                assert_eq!(Band::of_shot(&design, end), pair[1], "{name}");
                let ((seen, own), (_, next)) = (pair[0].ticks(&design), pair[1].ticks(&design));
                assert_eq!((own.start, own.end), (seen.start, next.start), "{name}");
            }
        }
    }

    #[test]
    fn guard_shots_lie_in_the_scan_before_and_there_are_none_at_the_beginning() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let log = bands(&design, 0).next().unwrap().shot_log(&design);
        assert_eq!((log.first, log.owned.start), (0, 0));
        let log = bands(&design, 1).next().unwrap().shot_log(&design);
        assert!(log.owned.start >= 25);
        assert_eq!(log.row[log.owned.start - 1], 479);
        assert_eq!(log.row[log.owned.start], 0);
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
