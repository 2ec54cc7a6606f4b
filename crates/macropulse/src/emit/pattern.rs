//! Scan patterns: the pixel and the time of every shot.
//!
//! Shots are numbered from the first one of the first scan. Times are exact: shot `k` of a uniform
//! raster fires at ⌊k · T_scan / shots⌋ on the chip clock, in integers, however long the run.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::design::{Design, Firing, Mirror, Pattern};
use crate::units::{FS_PER_S, fs_from_s};

/// Row and column of the `order`-th shot of a scan.
pub(super) fn pixel(design: &Design, order: u64) -> (u16, u16) {
    let columns = u64::from(design.scan.columns);
    match &design.scan.pattern {
        Pattern::Raster { mirror: Mirror::Sinusoidal, .. } if order / columns % 2 == 1 => {
            ((order / columns) as u16, (columns - 1 - order % columns) as u16)
        }
        Pattern::Raster { .. } | Pattern::Flash { .. } => {
            ((order / columns) as u16, (order % columns) as u16)
        }
        Pattern::Spinning { order: rows, .. } => {
            let lasers = rows.len() as u64;
            (rows[(order % lasers) as usize], (order / lasers) as u16)
        }
    }
}

/// The place of a pixel of the image in the order of its scan: the inverse of [`pixel`].
pub(super) fn order_of_pixel(design: &Design, row: u16, column: u16) -> u64 {
    let columns = u64::from(design.scan.columns);
    let (line, across) = (u64::from(row), u64::from(column));
    match &design.scan.pattern {
        Pattern::Raster { mirror: Mirror::Sinusoidal, .. } if line % 2 == 1 => {
            line * columns + columns - 1 - across
        }
        Pattern::Raster { .. } | Pattern::Flash { .. } => line * columns + across,
        Pattern::Spinning { order: rows, .. } => {
            let turn = rows.iter().position(|&fired| fired == row).unwrap_or(0);
            across * rows.len() as u64 + turn as u64
        }
    }
}

/// Absolute time at which shot number `order` of scan `scan` is fired, fs.
pub(super) fn fired_at_fs(design: &Design, scan: u64, order: u64) -> i64 {
    let shots = design.shots_per_scan();
    let columns = u64::from(design.scan.columns);
    let exact = |passed: u64| fraction_of_scan(design, scan, passed, shots);
    let fs = match &design.scan.pattern {
        Pattern::Raster { mirror: Mirror::Uniform, duty: 1.0, .. } => exact(order),
        Pattern::Raster { mirror, duty, .. } => {
            let line_start = exact(order / columns * columns);
            let line = design.scan_period() / f64::from(design.scan.rows);
            let across = (order % columns) as f64 / columns as f64;
            line_start + fs_from_s(line * moment(*mirror, *duty, across))
        }
        Pattern::Spinning { order: rows, firing, .. } => match firing {
            Firing::BlocksInTurn => exact(order),
            Firing::Together => exact(order - order % rows.len() as u64),
        },
        Pattern::Flash { .. } => exact(0),
    };
    fs - fs.rem_euclid(design.coding.chip_fs)
}

/// ⌊(scan + passed/shots) · T_scan⌋ in femtoseconds, without rounding on the way.
fn fraction_of_scan(design: &Design, scan: u64, passed: u64, shots: u64) -> i64 {
    let numerator =
        (u128::from(scan) * u128::from(shots) + u128::from(passed)) * FS_PER_S as u128 * 1000;
    (numerator / (u128::from(shots) * u128::from(design.scan.rate_millihertz))) as i64
}

/// When, as a fraction of the line time, the mirror has crossed the fraction `across` of the line.
///
/// A resonant mirror stands at sin(π·s), s = −½…½ over the line time; only |s| ≤ duty/2 is used.
fn moment(mirror: Mirror, duty: f64, across: f64) -> f64 {
    match mirror {
        Mirror::Uniform => (1.0 - duty) / 2.0 + duty * across,
        Mirror::Sinusoidal => {
            let edge = libm::sin(FRAC_PI_2 * duty);
            0.5 + libm::asin((2.0 * across - 1.0) * edge) / PI
        }
    }
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

    fn sensor(name: &str) -> Design {
        Design::open(name, &[]).unwrap()
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
    fn a_day_of_scans_does_not_overflow() {
        let design = sensor("kim-park-2016");
        assert_eq!(fired_at_fs(&design, 60 * 7200, 0), 7200 * FS_PER_S);
    }

    #[test]
    fn a_resonant_mirror_is_slow_at_the_edges_and_keeps_the_order() {
        let mid = moment(Mirror::Sinusoidal, 1.0, 0.501) - moment(Mirror::Sinusoidal, 1.0, 0.5);
        let edge = moment(Mirror::Sinusoidal, 1.0, 0.001) - moment(Mirror::Sinusoidal, 1.0, 0.0);
        // 2/π of the mean at the centre [KP16 §2.2 gives the mean only].
        approx::assert_relative_eq!(mid / 0.001, 2.0 / PI, max_relative = 1e-4);
        assert!(edge > 10.0 * mid);
    }

    #[test]
    fn every_laser_of_a_spinning_sensor_fires_once_a_column() {
        let design = sensor("hdl-64e");
        let mut rows: Vec<u16> = (0..64).map(|order| pixel(&design, 64 + order).0).collect();
        rows.sort_unstable();
        assert_eq!(rows, (0..64).collect::<Vec<u16>>());
        assert_eq!(pixel(&design, 64).1, 1);
    }
}
