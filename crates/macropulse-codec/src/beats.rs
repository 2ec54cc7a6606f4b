//! Beats: what the spectra of a frequency-modulated lidar hand to a receiver.

/// Peaks of the spectra of each shot, the same number of places for each of its ramps. Peaks carry no trace of what
/// made them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Beats {
    /// Ramps of a shot.
    pub ramps: u32,
    /// Places for peaks of a ramp. The strongest peak comes first; places behind the last one are
    /// [empty](Peak::EMPTY).
    pub peaks: u32,
    /// The peaks: `ramps` × `peaks` entries of each shot, ramp by ramp, one shot behind the other.
    pub found: Vec<Peak>,
}

/// A local maximum of a spectrum.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Peak {
    /// Frequency in parts of a bin, [`Peak::PARTS`] to each. A bin is 1 over the time that was recorded. The beat of a
    /// surface that stands still is positive in every ramp, rising or falling.
    pub frequency: i32,
    /// Power of its bin in units of the mean of noise, [`Peak::STEPS`] to each; 0 where there is no peak.
    pub power: u32,
}

impl Peak {
    /// Parts of a bin.
    pub const PARTS: f64 = 65_536.0;

    /// Steps of a unit of power.
    pub const STEPS: f64 = 256.0;

    /// No peak.
    pub const EMPTY: Self = Self { frequency: 0, power: 0 };

    /// A peak of this frequency, in bins, and this power, in units of the mean of noise; as far as its numbers go.
    pub fn of(bins: f64, power: f64) -> Self {
        Self {
            frequency: (bins * Self::PARTS).round() as i32,
            power: (power * Self::STEPS).round() as u32,
        }
    }

    /// Frequency in bins.
    pub fn bins(self) -> f64 {
        f64::from(self.frequency) / Self::PARTS
    }

    /// Power in units of the mean of noise.
    pub fn power(self) -> f64 {
        f64::from(self.power) / Self::STEPS
    }
}

impl Beats {
    /// The peaks of shot number `shot`, ramp by ramp; none where it is not there.
    pub fn of(&self, shot: usize) -> &[Peak] {
        let each = (self.ramps as usize).saturating_mul(self.peaks as usize);
        let first = shot.saturating_mul(each);
        self.found.get(first..first.saturating_add(each)).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_shot_has_its_peaks() {
        let found: Vec<Peak> = (1..=8).map(|power| Peak { frequency: 0, power }).collect();
        let beats = Beats { ramps: 2, peaks: 2, found };
        assert_eq!(beats.of(1).iter().map(|peak| peak.power).collect::<Vec<_>>(), [5, 6, 7, 8]);
        assert!(beats.of(2).is_empty() && beats.of(usize::MAX).is_empty());
    }

    /// A frequency is kept to 8e-6 of a bin; what its numbers cannot hold is cut off.
    #[test]
    fn a_peak_is_kept_to_its_parts() {
        let peak = Peak::of(-12.345_678, 41.5);
        assert!((peak.bins() + 12.345_678).abs() <= 0.5 / Peak::PARTS);
        assert_eq!(
            (peak.power(), Peak::of(1e9, -1.0)),
            (41.5, Peak { frequency: i32::MAX, power: 0 })
        );
    }
}
