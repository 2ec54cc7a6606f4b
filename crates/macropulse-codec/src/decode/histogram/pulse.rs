//! The shape of the emitted pulse in bins, at fractions of a bin.

use crate::statistics::normal_tail;
use crate::time;

/// Steps of a bin at which the shape of a pulse is tabulated.
pub const STEPS: usize = 16;

/// Standard deviations of a Gaussian pulse that are tabulated to both sides of its middle.
const REACH: f64 = 5.0;

/// The emitted pulse as the detector responds to it.
#[derive(Debug, Clone, PartialEq)]
pub enum Pulse {
    /// A Gaussian one, whose middle is the time of flight.
    Gaussian {
        /// Standard deviation, fs.
        rms_fs: f64,
    },
    /// A measured one, as of a histogram of a reference path.
    Measured {
        /// Counts without background in bins as wide as those of the record, in any unit.
        counts: Vec<f64>,
        /// Place of zero time of flight, in bins from the beginning of the first entry. May lie outside.
        origin: f64,
    },
}

impl Pulse {
    /// Entries that a shape may have in bins of a histogram.
    pub const MOST_BINS: usize = 4096;
}

/// The shares of a pulse in the bins that it meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    /// The shares of a pulse that begins `k` steps after a bin does, for each k from 0 to [`STEPS`].
    shares: Vec<f64>,
    /// Bins that a pulse meets.
    pub length: usize,
    /// Place of zero time of flight, in bins from the beginning of the first one.
    pub origin: f64,
    /// The bin with most light.
    pub peak: usize,
    /// Root of Σ(p_i − p_(i−1))²/Σp_i², per bin: how fast the filtered background varies.
    pub roughness: f64,
}

impl Kernel {
    /// The kernel of `pulse` in bins of `bin_fs`; `None` if it has no light, or too many bins.
    pub fn new(pulse: &Pulse, bin_fs: i64) -> Option<Self> {
        match pulse {
            Pulse::Gaussian { rms_fs } => {
                let rms = rms_fs / (bin_fs as f64);
                let reach = (REACH * rms).ceil().max(1.0);
                if reach * 2.0 > Pulse::MOST_BINS as f64 {
                    return None;
                }
                let before = |place: f64| normal_tail((reach - place) / rms);
                Some(Self::of(before, 2 * reach as usize, reach))
            }
            Pulse::Measured { counts, origin } => {
                let sum: f64 = counts.iter().sum();
                let is_usable = sum > 0.0 && sum.is_finite() && counts.len() <= Pulse::MOST_BINS;
                let curve = is_usable.then(|| Cumulative::of(counts, sum))?;
                Some(Self::of(|place| curve.at(place), counts.len(), *origin))
            }
        }
    }

    /// The kernel of a pulse that has a share `before(t)` of its light before t, and all within `bins`.
    fn of(before: impl Fn(f64) -> f64, bins: usize, origin: f64) -> Self {
        let length = bins + 1;
        let mut shares = Vec::with_capacity(length * STEPS);
        for step in 0..STEPS {
            let late = step as f64 / STEPS as f64;
            let mut begun = 0.0;
            for bin in 0..length {
                let ends = if bin + 1 == length { 1.0 } else { before((bin + 1) as f64 - late) };
                shares.push((ends - begun).max(0.0));
                begun = ends;
            }
        }
        let whole = &shares[..length];
        let square = |share: f64| share * share;
        let energy: f64 = whole.iter().map(|share| square(*share)).sum();
        let ends = square(whole[0]) + square(whole[length - 1]);
        let slopes: f64 = whole.windows(2).map(|pair| square(pair[1] - pair[0])).sum();
        let peak = (0..length).fold(0, |most, at| if whole[at] > whole[most] { at } else { most });
        let roughness = ((slopes + ends) / energy).sqrt();
        Self { shares, length, origin, peak, roughness }
    }

    /// The first bin of a pulse that begins `step` steps after the first bin of the histogram, and the
    /// shares of its light from there on.
    pub fn at(&self, step: i64) -> (i64, &[f64]) {
        let phase = step.rem_euclid(STEPS as i64) as usize;
        let shares = &self.shares[phase * self.length..(phase + 1) * self.length];
        (step.div_euclid(STEPS as i64), shares)
    }

    /// The same, as far as it is within `bins`.
    pub fn within(&self, step: i64, bins: usize) -> (usize, &[f64]) {
        let (first, shares) = self.at(step);
        let skipped = usize::try_from(-first).unwrap_or(0).min(shares.len());
        let first = usize::try_from(first).unwrap_or(0);
        let until = (skipped + bins.saturating_sub(first)).min(shares.len());
        (first, &shares[skipped..until.max(skipped)])
    }
}

/// The light of a measured pulse up to a time, as a share: between the edges of bins a cubic that
/// nowhere falls \[FB84\].
struct Cumulative {
    /// At the edges of the bins.
    share: Vec<f64>,
    slope: Vec<f64>,
}

impl Cumulative {
    fn of(counts: &[f64], sum: f64) -> Self {
        let mut share = vec![0.0];
        let mut so_far = 0.0;
        for count in counts {
            so_far += count;
            share.push(so_far / sum);
        }
        let count = |edge: usize| counts.get(edge).map_or(0.0, |count| count / sum);
        // The harmonic mean of the densities on both sides keeps the cubic from falling.
        let slope = |edge: usize| {
            let (before, behind) = (count(edge.wrapping_sub(1)), count(edge));
            match before > 0.0 && behind > 0.0 {
                true => 2.0 * before * behind / (before + behind),
                false => 0.0,
            }
        };
        Self { share, slope: (0..=counts.len()).map(slope).collect() }
    }

    fn at(&self, place: f64) -> f64 {
        let last = self.share.len() - 1;
        if place <= 0.0 || place >= last as f64 {
            return if place <= 0.0 { 0.0 } else { 1.0 };
        }
        let edge = (place as usize).min(last - 1);
        let t = place - edge as f64;
        let (from, to) = (self.share[edge], self.share[edge + 1]);
        let (leaves, arrives) = (self.slope[edge], self.slope[edge + 1]);
        let rest = 1.0 - t;
        let ends = from * (1.0 + 2.0 * t) * rest * rest + to * t * t * (3.0 - 2.0 * t);
        ends + leaves * t * rest * rest - arrives * t * t * rest
    }
}

/// A lag in bins from that of time `after_fs` after the first bin begins, of a pulse of zero time of
/// flight at `origin`.
pub(super) fn lag(after_fs: i128, bin_fs: i64, origin: f64) -> f64 {
    after_fs as f64 / bin_fs as f64 - origin
}

/// True if a length of time can be a standard deviation.
pub(super) fn is_length(rms_fs: f64) -> bool {
    (1.0..=time::FS_PER_S as f64).contains(&rms_fs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    /// Mean and standard deviation, in bins, of the shares from the first bin on.
    fn moments(kernel: &Kernel, step: i64) -> (f64, f64) {
        let (first, shares) = kernel.at(step);
        let place = |bin: usize| first as f64 + bin as f64 + 0.5;
        let mean: f64 = shares.iter().enumerate().map(|(at, p)| p * place(at)).sum();
        let square: f64 =
            shares.iter().enumerate().map(|(at, p)| p * (place(at) - mean).powi(2)).sum();
        (mean, square.sqrt())
    }

    /// A bin adds the variance 1/12 of its width, and a fraction of a bin moves the mean by it.
    #[test]
    fn shares_are_those_of_the_pulse_at_every_fraction_of_a_bin() {
        let gaussian = Kernel::new(&Pulse::Gaussian { rms_fs: 2000.0 }, 1000).unwrap();
        let (_, shares) = gaussian.at(0);
        let measured = Pulse::Measured { counts: shares.to_vec(), origin: gaussian.origin };
        let measured = Kernel::new(&measured, 1000).unwrap();
        for (kernel, right_to) in [(&gaussian, 1e-4), (&measured, 6e-3)] {
            for step in [-40, -16, 0, 3, 8, 15, 16, 100] {
                let (mean, rms) = moments(kernel, step);
                let at = step as f64 / STEPS as f64 + kernel.origin;
                assert_abs_diff_eq!(mean, at, epsilon = right_to);
                assert_abs_diff_eq!(rms, (4.0_f64 + 1.0 / 12.0).sqrt(), epsilon = right_to);
            }
        }
        // exp(−τ²/4σ²) falls as 1 − τ²/4σ²: the rate of change is 1/(√2·σ).
        assert_abs_diff_eq!(gaussian.roughness, 0.5_f64.sqrt() / 2.0, epsilon = 0.015);
        assert!(Kernel::new(&Pulse::Measured { counts: vec![0.0], origin: 0.0 }, 1).is_none());
        assert!(Kernel::new(&Pulse::Gaussian { rms_fs: 1e12 }, 1).is_none());
    }

    #[test]
    fn a_kernel_is_cut_at_the_ends_of_the_histogram() {
        let counts = vec![1.0, 2.0, 1.0];
        let kernel = Kernel::new(&Pulse::Measured { counts, origin: 0.0 }, 1).unwrap();
        let steps = STEPS as i64;
        let cut = |bins: i64| {
            let (first, shares) = kernel.within(bins * steps, 5);
            (first, shares.to_vec())
        };
        assert_eq!(cut(1), (1, vec![0.25, 0.5, 0.25, 0.0]));
        assert_eq!(cut(-1), (0, vec![0.5, 0.25, 0.0]));
        assert_eq!(cut(4), (4, vec![0.25]));
        assert!(cut(7).1.is_empty() && cut(-9).1.is_empty());
    }
}
