//! The time of every shot.
//!
//! Shots are numbered from the first one of the first scan. Times are exact: shot `k` of a uniform
//! raster fires at ⌊k · T_scan / shots⌋ on the chip clock, in integers, however long the run.

use crate::design::Design;
use crate::units::{FS_PER_S, fs_from_s};

/// Absolute time at which shot number `order` of scan `scan` is fired, fs.
pub(super) fn fired_at_fs(design: &Design, scan: u64, order: u64) -> i64 {
    let moment = design.scan.model().moment(order, design.scan_period());
    let fs = fraction_of_scan(design, scan, moment.shots) + fs_from_s(moment.then);
    fs - fs.rem_euclid(design.emission.grid_fs())
}

/// The times of consecutive shots, where all of them are equally far apart: those of
/// [`fired_at_fs`] without a division for each.
pub(super) struct EqualSteps {
    /// Runs of every fourth shot, counted on side by side: the time of a shot has to wait for that of the one
    /// before it in its run.
    runs: [Run; SIDE_BY_SIDE],
}

/// Runs of shots: with four, the log of a scan takes four fifths of the time that it takes with one.
const SIDE_BY_SIDE: usize = 4;

/// The time of a shot: a whole number of femtoseconds and a rest, counted in parts of one. [`SIDE_BY_SIDE`]
/// shots later both have grown by the same.
struct Run {
    fs: i64,
    rest: u64,
    /// How far `fs` lies beyond the last tick of the chip clock.
    beyond_fs: i64,
    step: (i64, u64, i64),
    parts: u64,
    chip_fs: i64,
}

impl EqualSteps {
    /// From shot number `first` on, counted from the first one of the first scan; `None` where
    /// shots are not equally far apart.
    pub(super) fn new(design: &Design, first: u64) -> Option<Self> {
        let run = |shot: usize| Run::new(design, first + shot as u64);
        design.scan.model().equal_steps().then(|| Self { runs: std::array::from_fn(run) })
    }

    /// Fills in the times of consecutive shots, one for each place of `fired_at_fs`.
    pub(super) fn fill(mut self, fired_at_fs: &mut [i64]) {
        let (whole, rest) = fired_at_fs.as_chunks_mut::<SIDE_BY_SIDE>();
        whole.iter_mut().for_each(|places| *places = self.runs.each_mut().map(Run::next));
        rest.iter_mut().zip(&mut self.runs).for_each(|(place, run)| *place = run.next());
    }
}

impl Run {
    /// Returns the run of every [`SIDE_BY_SIDE`]-th shot from number `first` on.
    fn new(design: &Design, first: u64) -> Self {
        let (parts, chip_fs) = (parts_of_fs(design), design.emission.grid_fs());
        let whole = |shots: u64| (u128::from(shots) * NUMERATOR / parts) as i64;
        let rest = |shots: u64| (u128::from(shots) * NUMERATOR % parts) as u64;
        let apart = SIDE_BY_SIDE as u64;
        Self {
            fs: whole(first),
            rest: rest(first),
            beyond_fs: whole(first) % chip_fs,
            step: (whole(apart), rest(apart), whole(apart) % chip_fs),
            parts: parts as u64,
            chip_fs,
        }
    }

    #[inline]
    fn next(&mut self) -> i64 {
        let fired_at_fs = self.fs - self.beyond_fs;
        self.rest += self.step.1;
        let carry = self.rest >= self.parts;
        self.rest -= if carry { self.parts } else { 0 };
        self.fs += self.step.0 + i64::from(carry);
        // Less than a chip and at most a chip more.
        self.beyond_fs += self.step.2 + i64::from(carry);
        self.beyond_fs -= if self.beyond_fs >= self.chip_fs { self.chip_fs } else { 0 };
        fired_at_fs
    }
}

/// Femtoseconds in 1000 s, the time in which scans are counted.
const NUMERATOR: u128 = FS_PER_S as u128 * 1000;

/// Returns the parts in a femtosecond: times of shots are whole numbers of parts.
fn parts_of_fs(design: &Design) -> u128 {
    u128::from(design.shots_per_scan()) * u128::from(design.scan.rate_millihertz)
}

/// ⌊(scan + passed/shots) · T_scan⌋ in femtoseconds, without rounding on the way.
fn fraction_of_scan(design: &Design, scan: u64, passed: u64) -> i64 {
    let shot = u128::from(scan) * u128::from(design.shots_per_scan()) + u128::from(passed);
    (shot * NUMERATOR / parts_of_fs(design)) as i64
}

/// When scan number `scan` begins, fs from the beginning of the first one.
pub fn scan_begins_fs(design: &Design, scan: u64) -> i64 {
    fraction_of_scan(design, scan, 0)
}

/// Two unit vectors across `direction`: to the left and up.
pub fn beam_axes(direction: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let [x, y, z] = direction;
    let level = libm::hypot(x, y);
    if level < 1e-9 {
        return ([0.0, 1.0, 0.0], [-z.signum(), 0.0, 0.0]);
    }
    let left = [-y / level, x / level, 0.0];
    let up = [-z * x / level, -z * y / level, level];
    (left, up)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Mirror;
    use std::f64::consts::PI;

    fn sensor(name: &str) -> Design {
        sensor_with(name, &[])
    }

    fn sensor_with(name: &str, set: &[(String, String)]) -> Design {
        Design::open(name, set).unwrap()
    }

    #[test]
    fn a_raster_fires_at_exact_fractions_of_a_scan() {
        let design = sensor("kim-park-2016");
        assert_eq!(fired_at_fs(&design, 0, 0), 0);
        // 16 378.41 chips of 2.5 ps: the shot waits for the chip clock, never for a rounded sum.
        assert_eq!(fired_at_fs(&design, 0, 1), 16_378 * 2500);
        assert_eq!(fired_at_fs(&design, 0, 100), 1_637_840 * 2500);
        // Sixty scans are one second to the femtosecond.
        assert_eq!(fired_at_fs(&design, 60, 0), FS_PER_S);
    }

    #[test]
    fn steps_come_to_the_same_as_fractions() {
        let odd = [("scan.scans_per_s".to_owned(), "59.94".to_owned())];
        let turn = [("scan.spinning.azimuth_step_deg".to_owned(), "0.0864".to_owned())];
        for (name, set) in [
            ("kim-park-2016", &[][..]),
            ("kim-park-2016", &odd),
            ("hdl-64e", &[]),
            ("hdl-64e", &turn),
        ] {
            let design = sensor_with(name, set);
            let shots = design.shots_per_scan();
            // The last ones are fired after two and a half hours.
            let scans = 9 * design.scan.rate_millihertz;
            for first in [0, 1, 12_345, scans / 7 * shots + 99, scans * shots - 7] {
                let mut times = vec![0; 5000];
                EqualSteps::new(&design, first).unwrap().fill(&mut times);
                for (shot, fs) in (first..).zip(times) {
                    assert_eq!(
                        fs,
                        fired_at_fs(&design, shot / shots, shot % shots),
                        "{name} {shot}"
                    );
                }
            }
        }
    }

    #[test]
    fn no_steps_are_equal_before_a_resonant_mirror_or_in_a_flash() {
        let mirror = [("scan.raster.mirror".to_owned(), "sinusoidal".to_owned())];
        let duty = [("scan.raster.duty".to_owned(), "0.8".to_owned())];
        let together = [("scan.spinning.firing".to_owned(), "together".to_owned())];
        for (name, set) in [
            ("kim-park-2016", &mirror[..]),
            ("kim-park-2016", &duty),
            ("hdl-64e", &together),
            ("peregrine", &[]),
        ] {
            assert!(EqualSteps::new(&sensor_with(name, set), 5).is_none(), "{name}");
        }
    }

    #[test]
    fn a_day_of_scans_does_not_overflow() {
        let design = sensor("kim-park-2016");
        assert_eq!(fired_at_fs(&design, 60 * 7200, 0), 7200 * FS_PER_S);
    }

    #[test]
    fn a_resonant_mirror_is_slow_at_the_edges_and_keeps_the_order() {
        let mid = Mirror::Sinusoidal.moment(1.0, 0.501) - Mirror::Sinusoidal.moment(1.0, 0.5);
        let edge = Mirror::Sinusoidal.moment(1.0, 0.001) - Mirror::Sinusoidal.moment(1.0, 0.0);
        // 2/π of the mean at the centre [KP16 §2.2 gives the mean only].
        approx::assert_relative_eq!(mid / 0.001, 2.0 / PI, max_relative = 1e-4);
        assert!(edge > 10.0 * mid);
    }

    #[test]
    fn every_laser_of_a_spinning_sensor_fires_once_a_column() {
        let design = sensor("hdl-64e");
        let mut rows: Vec<u16> =
            (0..64).map(|order| design.scan.model().pixel(64 + order).0).collect();
        rows.sort_unstable();
        assert_eq!(rows, (0..64).collect::<Vec<u16>>());
        assert_eq!(design.scan.model().pixel(64).1, 1);
    }
}
