//! Time as both ends of the link count it: whole femtoseconds since the first scan began (`i64`,
//! good for ±2.5 h). 1 fs is 0.15 µm of range.

/// Femtoseconds in a second.
pub const FS_PER_S: i64 = 1_000_000_000_000_000;

/// Seconds to whole femtoseconds, rounded to the nearest.
pub fn fs_from_s(seconds: f64) -> i64 {
    (seconds * FS_PER_S as f64).round() as i64
}

/// Femtoseconds to seconds.
pub fn s_from_fs(fs: i64) -> f64 {
    fs as f64 / FS_PER_S as f64
}
