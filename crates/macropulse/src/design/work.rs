//! How much a band may take to compute: what grows with a ratio of keys has a limit here.
//!
//! A band is the least that is computed in one go. Its cost grows with the number of pixels. It also grows
//! with the shots that are under way at once, the samples of a gate, and the counts within it.

use super::detector::Detector;
use super::limits::Check;
use super::{Design, Error};
use crate::units::{FS_PER_S, s_from_fs};

/// A band holds about this many shots, in whole lines. They are few enough for the detection events of a
/// coded sensor to stay in a cache, and the guard shots, 125 of `kim-park-2016`, are a small part. Half the
/// number takes a twentieth longer, and less is known of a shot's neighbours: 75 instead of 62 of 407 040
/// shots of `street` as declared are then near their surface and not on it (mean of seeds 5, 101, 202, 303).
/// It holds four lines of `kim-park-2016`; five are more than [`Design::longest_band_fs`] allows.
pub const SHOTS_OF_BAND: u64 = 3400;

/// Shots that must be known around those of a band.
const MOST_SHOTS: f64 = 1_048_576.0;

/// Samples of all channels.
const MOST_SAMPLES: f64 = 68_719_476_736.0;

/// Detection events without light of lidars, of all channels.
const MOST_COUNTS: f64 = 268_435_456.0;

impl Design {
    /// How long a band lasts with its guard shots and their light, s: that of the first shots of a scan.
    fn band_lasts(&self) -> f64 {
        let line = self.scan.model().line().max(SHOTS_OF_BAND) as f64;
        let own_fs = (line * self.scan_period() / self.shots_per_scan() as f64 * FS_PER_S as f64)
            .min(self.longest_band_fs() as f64);
        s_from_fs(self.around_fs()) + own_fs / FS_PER_S as f64
    }

    /// Why a band has too many counts where `per_s` come in each channel without light of lidars, and what to
    /// do, if it has.
    ///
    /// A detector that fires once a shot draws the first of them alone; of the others converters make no more
    /// than one event a tick, and no more are drawn.
    pub fn too_many_counts(&self, per_s: f64) -> Option<String> {
        if let Some(burst) = self.emission.burst() {
            return self.too_many_in_a_burst(per_s * s_from_fs(burst.interval_fs), burst.pulses);
        }
        if self.bank().is_none() || matches!(self.detector, Detector::SingleStop(_)) {
            return None;
        }
        let ticks = FS_PER_S as f64 / self.clock.tick_fs as f64;
        let counts = per_s.min(ticks) * self.band_lasts() * f64::from(self.channels());
        (counts > MOST_COUNTS).then(|| {
            format!(
                "{per_s:.1e} counts per second in each of {} channels are {counts:.1e} while the \
                 shots of one band are listened to, more than the {MOST_COUNTS:.1e} that are followed: \
                 fewer dark counts, less sunlight, or a shorter range gate",
                self.channels()
            )
        })
    }
}

impl Design {
    /// As [`Design::too_many_counts`], for histograms of bursts of `pulses`, with `per_cycle` counts from one
    /// pulse to the next.
    fn too_many_in_a_burst(&self, per_cycle: f64, pulses: u32) -> Option<String> {
        let counts = per_cycle * f64::from(pulses);
        (counts > MOST_COUNTS).then(|| {
            format!(
                "{counts:.1e} counts come while a shot sends its {pulses} pulses, more than the \
                 {MOST_COUNTS:.1e} that are followed: fewer dark counts, less sunlight, or fewer pulses"
            )
        })
    }
}

impl Check<'_> {
    /// Refuses a `design`, whose clock was checked, if a band of it cannot be computed in bounded time.
    pub(super) fn work(&self, design: &Design) -> Result<(), Error> {
        let per_s = design.shots_per_scan() as f64 / design.scan_period();
        let known = s_from_fs(design.around_fs()) * per_s;
        if known > MOST_SHOTS {
            let message = format!(
                "{known:.1e} shots are fired while light of a shot may be under way or is remembered by the \
                 detector, more than {MOST_SHOTS}: take fewer shots per second, or a shorter range \
                 gate, light_range_m or memory of the detector"
            );
            return self.refuse("scan", message);
        }
        let detector = design.detector.model();
        if let Some(why) =
            design.too_many_counts(detector.false_rate(detector.declared_background()))
        {
            return self.refuse("detector", why);
        }
        if let Detector::Sampled(sampled) = &design.detector {
            let lasts = design.band_lasts() + sampled.recovery;
            let samples = lasts / sampled.sample * f64::from(design.channels());
            if samples > MOST_SAMPLES {
                let message = format!(
                    "makes {samples:.1e} samples of {} channels while the shots of one band are listened \
                     to, more than {MOST_SAMPLES:.1e}: take longer samples, or a shorter range gate, \
                     recovery_ns or memory of the baseline",
                    design.channels()
                );
                return self.refuse("adc.sample_ps", message);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(name: &str, set: &[(&str, &str)]) -> String {
        let set: Vec<_> = set.iter().map(|(key, value)| ((*key).into(), (*value).into())).collect();
        Design::open(name, &set).map_or_else(|error| error.to_string(), |_| "fine".to_owned())
    }

    #[test]
    fn too_many_shots_in_flight_are_refused() {
        let often = [("scan.scans_per_s", "1e5"), ("scan.max_range_m", "1e4")];
        let often = told("hdl-64e", &often);
        assert!(
            often.contains("shots are fired while light of a shot may be under way"),
            "{often}"
        );
        assert_eq!(told("hdl-64e", &[]), "fine");
    }

    #[test]
    fn too_many_counts_are_refused() {
        let dark = |rate: &str, tick: &str| {
            let keys = [
                ("detector.photon-counting.dark_counts_hz", rate),
                ("tdc.resolution_ps", tick),
                ("tdc.clock_ps", "1000.0"),
                ("tdc.bits", "16"),
                ("tdc.converters", "1024"),
                ("scan.raster.beams", "32"),
                ("scan.raster.rows", "512"),
            ];
            told("kim-park-2016", &keys)
        };
        assert_eq!(dark("1e6", "2.5"), "fine");
        let many = dark("1e12", "2.5");
        assert!(
            many.contains("detector: 1.0e12 counts per second in each of 32 channels"),
            "{many}"
        );
    }
}
