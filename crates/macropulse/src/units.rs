//! Physical constants and the few conversions the whole workbench shares.
//!
//! Inside, every `f64` is in SI base units. Absolute time is an integer number of femtoseconds
//! since the first scan began (`i64`, good for ±2.5 h); 1 fs is 0.15 µm of range.

pub use macropulse_codec::time::{FS_PER_S, fs_from_s, s_from_fs};

use crate::kernels::whole;

/// Speed of light in vacuum, m/s (exact, SI 2019).
pub const SPEED_OF_LIGHT: f64 = 299_792_458.0;

/// Planck constant, J·s (exact, SI 2019).
pub const PLANCK: f64 = 6.626_070_15e-34;

/// Elementary charge, C (exact, SI 2019).
pub const ELEMENTARY_CHARGE: f64 = 1.602_176_634e-19;

/// rms length of a Gaussian over its full width at half maximum: 1/(2·√(2·ln 2)).
pub const RMS_OF_FWHM: f64 = 0.424_660_900_144_009_5;

/// One-way range in metres of an echo whose light was `tof` seconds under way, there and back.
///
/// `R = c·t/2` \[KP16 eq. 1\]; with [`tof_from_range`] and its column the only place
/// of this factor 2.
pub fn range_from_tof(tof: f64) -> f64 {
    SPEED_OF_LIGHT * tof / 2.0
}

/// Two-way time of flight in seconds to a target at `range` metres. Inverse of [`range_from_tof`].
pub fn tof_from_range(range: f64) -> f64 {
    2.0 * range / SPEED_OF_LIGHT
}

/// Frequency, Hz, of light of the vacuum `wavelength`, m: c/λ.
#[inline]
pub fn frequency_from_wavelength(wavelength: f64) -> f64 {
    SPEED_OF_LIGHT / wavelength
}

/// Two-way times of flight to targets at `ranges` metres, in whole femtoseconds: for each what
/// [`fs_from_s`] makes of [`tof_from_range`].
pub fn tof_fs_from_ranges(ranges: &[f64]) -> Vec<i64> {
    let mut tof_fs = vec![0; ranges.len()];
    whole(ranges, 2.0, SPEED_OF_LIGHT, FS_PER_S as f64, &mut tof_fs);
    tof_fs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_microsecond_is_150_metres() {
        approx::assert_relative_eq!(range_from_tof(1e-6), 149.896_229, max_relative = 1e-12);
        approx::assert_relative_eq!(tof_from_range(150.0), 1.000_692e-6, max_relative = 1e-6);
    }

    #[test]
    fn range_and_tof_are_inverse() {
        for range in [0.0, 0.375e-3, 30.0, 150.0, 5e3] {
            approx::assert_relative_eq!(range_from_tof(tof_from_range(range)), range);
        }
    }

    #[test]
    fn a_column_of_ranges_comes_to_the_same_as_each_alone() {
        let ranges: Vec<f64> = (0..100_000).map(|i| f64::from(i) * 1.7e-3 + 1e-9).collect();
        for (range, tof_fs) in ranges.iter().zip(tof_fs_from_ranges(&ranges)) {
            assert_eq!(tof_fs, fs_from_s(tof_from_range(*range)));
        }
    }

    #[test]
    fn femtoseconds_round_to_nearest() {
        assert_eq!(fs_from_s(2.5e-12), 2500);
        assert_eq!(fs_from_s(-0.6e-15), -1);
        approx::assert_relative_eq!(s_from_fs(40_946_000), 40.946e-9);
    }
}
