//! How much memory the clouds of a file may take.

use crate::machine;

/// Bytes of a point while a cloud is read and written: `tests/memory.rs` of the program holds what
/// conversions take against it.
const PER_POINT: u64 = 130;

/// The program and its threads, bytes.
const PROGRAM: u64 = 30_000_000;

/// The share of the machine's memory that a cloud may take unless another limit is set.
const SHARE: f64 = 0.8;

/// The memory that the clouds of a file may take. A file that needs more is refused before it is read.
/// A file that does not tell its number of points is refused while it is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CloudRoom {
    bytes: u64,
}

impl Default for CloudRoom {
    /// Four fifths of what the machine has; without end where that is not known.
    fn default() -> Self {
        let share = |memory: u64| (memory as f64 * SHARE) as u64;
        machine::memory().map_or(Self { bytes: u64::MAX }, |memory| Self::of_bytes(share(memory)))
    }
}

impl CloudRoom {
    /// The part of `bytes` that the program itself leaves.
    pub fn of_bytes(bytes: u64) -> Self {
        Self { bytes: bytes.saturating_sub(PROGRAM) }
    }

    /// The bytes that may be taken.
    pub(super) fn bytes(self) -> u64 {
        self.bytes
    }

    /// Refuses this number of points if they do not fit.
    ///
    /// # Errors
    /// A sentence, if they do not.
    pub(super) fn check(self, points: u64) -> Result<(), String> {
        self.check_beside(0, points)
    }

    /// Refuses this number of points if they do not fit beside other `bytes`.
    ///
    /// # Errors
    /// A sentence, if they do not.
    pub(super) fn check_beside(self, bytes: u64, points: u64) -> Result<(), String> {
        let needed = points.saturating_mul(PER_POINT).saturating_add(bytes);
        if needed <= self.bytes {
            return Ok(());
        }
        Err(format!(
            "its {points} points take about {} of memory, and {} are left: allow more memory \
             (--memory-limit)",
            megabytes(needed),
            megabytes(self.bytes)
        ))
    }
}

fn megabytes(bytes: u64) -> String {
    format!("{} MB", bytes.div_ceil(1_000_000))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused() {
        let room = CloudRoom::of_bytes(PROGRAM + 1_000_000);
        room.check(7692).unwrap();
        let told = room.check(7693).unwrap_err();
        assert!(told.starts_with("its 7693 points take about 2 MB of memory, and 1 MB are left"));
        assert_eq!(room.check_beside(350_000, 5000), Ok(()));
        assert!(room.check_beside(350_000, 5001).is_err());
        assert!(room.check_beside(u64::MAX, 1).is_err());
        assert!(CloudRoom::of_bytes(5).check(1).is_err());
        assert!(CloudRoom { bytes: u64::MAX }.check(u64::MAX / PER_POINT).is_ok());
    }
}
