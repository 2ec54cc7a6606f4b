//! Histograms: what a time-correlated counter hands to a receiver.

/// Histograms of the times at which a detector counted photons, one of each shot. A shot is here a
/// burst of laser pulses that are accumulated into one histogram.
///
/// Bin `i` counts the photons from `offset_fs + i·bin_fs` to `offset_fs + (i + 1)·bin_fs` after the
/// laser pulse that they belong to. Counts carry no trace of what made them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Histograms {
    /// Width of a bin, fs.
    pub bin_fs: i64,
    /// Beginning of the first bin after the firing of the shot, fs; negative if it lies before.
    pub offset_fs: i64,
    /// Bins of a histogram.
    pub bins: u32,
    /// Laser pulses that are accumulated, shot by shot; 0 where their number is not known.
    pub cycles: Vec<u32>,
    /// Photons counted, `bins` entries of each shot, one shot behind the other.
    pub counts: Vec<u32>,
}

impl Histograms {
    /// Number of histograms.
    pub fn len(&self) -> usize {
        self.cycles.len()
    }

    /// True if there is no histogram at all.
    pub fn is_empty(&self) -> bool {
        self.cycles.is_empty()
    }

    /// The counts of the histogram number `shot`; none where it is not there.
    pub fn of(&self, shot: usize) -> &[u32] {
        let bins = self.bins as usize;
        let first = shot.saturating_mul(bins);
        self.counts.get(first..first.saturating_add(bins)).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_shot_has_its_counts() {
        let histograms = Histograms {
            bins: 3,
            cycles: vec![9, 9],
            counts: vec![1, 2, 3, 4, 5, 6],
            ..Histograms::default()
        };
        assert_eq!((histograms.of(0), histograms.of(1)), (&[1, 2, 3][..], &[4, 5, 6][..]));
        assert!(histograms.of(2).is_empty() && histograms.of(usize::MAX).is_empty());
        assert_eq!((histograms.len(), histograms.is_empty()), (2, false));
    }
}
