//! How light without pulses varies while it lasts.

use std::f64::consts::TAU;

use crate::design::Wave;

/// How the light of a stretch of time varies.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Varies {
    /// It is the same all the time.
    #[default]
    Not,
    /// Its power follows a wave, from nothing to twice its mean.
    Power {
        /// Modulation frequency, Hz.
        hz: f64,
        /// How far it is behind its peak as the stretch begins, rad.
        phase: f64,
        /// Shape of the modulation.
        wave: Wave,
    },
    /// Its frequency rises or falls evenly.
    Frequency {
        /// By how much it exceeds the middle frequency of the sensor that receives as the stretch begins, Hz.
        hz: f64,
        /// How much it rises per second, Hz/s.
        per_s: f64,
        /// Spectral width of the laser's line (full width at half maximum), Hz.
        linewidth: f64,
    },
}

impl Varies {
    /// The power over its mean, `since` seconds after the stretch began.
    pub fn power(self, since: f64) -> f64 {
        match self {
            Self::Power { hz, phase, wave } => wave.power(phase + TAU * hz * since),
            Self::Not | Self::Frequency { .. } => 1.0,
        }
    }

    /// The mean of [`Varies::power`] from one time to a later one, s.
    pub fn mean_power(self, from: f64, until: f64) -> f64 {
        match self {
            Self::Power { hz, phase, wave } => {
                wave.mean_power(phase + TAU * hz * from, phase + TAU * hz * until)
            }
            Self::Not | Self::Frequency { .. } => 1.0,
        }
    }

    /// How it varies from `since` seconds after the stretch began.
    pub fn from(self, since: f64) -> Self {
        match self {
            Self::Not => self,
            Self::Power { hz, phase, wave } => {
                Self::Power { hz, phase: phase + TAU * hz * since, wave }
            }
            Self::Frequency { hz, per_s, linewidth } => {
                Self::Frequency { hz: hz + per_s * since, per_s, linewidth }
            }
        }
    }

    /// The highest [`Varies::power`].
    pub fn most_power(self) -> f64 {
        match self {
            Self::Power { .. } => 2.0,
            Self::Not | Self::Frequency { .. } => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean is that of many samples, for parts of a period and for several of them.
    #[test]
    fn a_mean_is_that_of_many_samples() {
        for wave in [Wave::Sine, Wave::Square] {
            let varies = Varies::Power { hz: 80e6, phase: 0.0, wave };
            for (from, until) in [(0.0, 1e-9), (2.5e-9, 3.7e-9), (1e-9, 40.3e-9), (11e-9, 12.4e-9)]
            {
                let steps = 20_000;
                let at =
                    |step: i32| from + (until - from) * (f64::from(step) + 0.5) / f64::from(steps);
                let mean =
                    (0..steps).map(|step| varies.power(at(step))).sum::<f64>() / f64::from(steps);
                approx::assert_relative_eq!(varies.mean_power(from, until), mean, epsilon = 1e-3);
                assert!(mean <= varies.most_power());
            }
            approx::assert_relative_eq!(varies.mean_power(0.0, 1.0 / 80e6), 1.0, epsilon = 1e-9);
            assert_eq!(varies.power(0.0), varies.most_power());
            let later = varies.from(3.3e-9);
            approx::assert_relative_eq!(later.power(1e-9), varies.power(4.3e-9), epsilon = 1e-9);
        }
    }
}
