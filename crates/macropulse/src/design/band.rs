//! The longest stretch of time that is computed in one go.
//!
//! Detection events are timed in 32 bits, in parts of a tick. The shots of a band, its guard shots, and their
//! echoes must fit in.

use super::Design;
use macropulse_codec::Cut;

use crate::units::{FS_PER_S, fs_from_s, tof_from_range};

/// Parts of a tick in which detection events are timed. Jitter is rounded to one, by 6 µm for 2.5 ps.
pub const PARTS_OF_TICK: u32 = 64;

/// Jitter beyond this number of standard deviations does not happen: once in 10¹⁸ events.
pub const MOST_SIGMA: f64 = 9.0;

/// Said where 2²⁶ ticks do not hold the echoes of one shot and of those in flight with it.
pub(super) const TOO_FINE: &str = "is too fine for so long a range gate: three gates (one, if shots are not coded) with the \
     jitter, and what detector and converters remember, four dead times, must be within 67 million ticks; \
     use longer ticks, a shorter max_range_m or a shorter dead time";

impl Design {
    /// How long the receiver listens to a shot, from its firing on, fs: to the end of a macropulse
    /// that begins at the end of the range gate.
    pub fn listening_fs(&self) -> i64 {
        fs_from_s(tof_from_range(self.scan.max_range)) + self.emission.length_fs()
    }

    /// From the firing of a shot to the last of its light that is followed, fs: for the clock that
    /// starts first.
    pub fn light_fs(&self) -> i64 {
        let offsets = self.scan.model().range_offsets().iter();
        let early = offsets.map(|offset| -offset).fold(0.0, f64::max);
        fs_from_s(tof_from_range(self.scan.light_range + early)) + self.emission.length_fs()
    }

    /// Returns how a band is cut out of a stream of shots and ticks. Light must be known for some time before
    /// the first owned shot. This time covers earlier shots whose light is under way when the ticks begin. It
    /// also lets the detector and the converters forget the state that they start in.
    pub fn cut(&self) -> Cut {
        let jitter_fs = self.most_jitter_fs();
        // Light is looked for to twice the gate: what arrives in it is that of shots the receiver knows. A
        // record made shot by shot has the light of its own shot, and nothing before it.
        let is_by_shot = self.records().is_by_shot();
        let lead_fs = if is_by_shot { 0 } else { 2 * self.listening_fs() + jitter_fs };
        let model = self.detector.model();
        let under_way_fs = self.light_fs() + jitter_fs + model.settles_fs();
        Cut {
            tick_fs: self.clock.tick_fs,
            clock_fs: self.clock.period_fs,
            jitter_fs,
            listening_fs: self.listening_fs(),
            lead_fs,
            history_fs: lead_fs
                + under_way_fs.max(model.memory_fs()).max(self.readout.model().memory_fs()),
        }
    }

    /// How far jitter, and the length of a micropulse, can displace a detection event, fs.
    pub fn most_jitter_fs(&self) -> i64 {
        let most = MOST_SIGMA
            * (self.detector.model().jitter()
                + self.detector.spread_of(&self.light).unwrap_or(0.0));
        (most * FS_PER_S as f64).ceil() as i64
    }

    /// For how long guard shots must be known around the shots of a band, on both sides together, fs.
    pub(super) fn around_fs(&self) -> i64 {
        let cut = self.cut();
        cut.history_fs + cut.listening_fs + cut.lead_fs
    }

    /// The longest time from the first to the last shot of a band without its guard shots, fs; negative
    /// where not even one shot has room. Histograms, taps and beats are no events that are timed.
    pub fn longest_band_fs(&self) -> i64 {
        if self.records().is_by_shot() {
            return i64::MAX;
        }
        let counted = i64::from(u32::MAX / PARTS_OF_TICK).saturating_mul(self.clock.tick_fs);
        let around = self.around_fs() + self.light_fs();
        // The clock starts at one of its own periods, and jitter goes both ways.
        counted - around - 2 * self.most_jitter_fs() - 2 * self.clock.period_fs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_of_the_paper_may_last_158_microseconds() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        assert_eq!(design.listening_fs(), 1_000_692_286 + 10_933 * 2500);
        // Four lines of 848 shots, 139 µs, have room.
        assert_eq!(design.longest_band_fs() / 1_000_000_000, 158);
    }

    /// A band includes the time before its ticks that cells, converters and amplifiers remember.
    #[test]
    fn a_band_begins_as_early_as_its_detector_and_converters_remember() {
        for (name, key, ns) in [
            ("kim-park-2016", "tdc.dead_time_ns", 10_000),
            ("coded-32", "detector.photodiode.recovery_ns", 10_000),
        ] {
            let history_fs = |ns: i64| {
                let set = [(key.to_owned(), ns.to_string())];
                let cut = Design::open(name, &set).unwrap().cut();
                cut.history_fs - cut.lead_fs
            };
            assert!(history_fs(ns) >= ns * 1_000_000, "{name}");
            assert!(history_fs(1) < ns * 1_000_000, "{name}");
        }
    }

    #[test]
    fn a_gate_too_long_for_its_ticks_is_refused() {
        let fine = [("tdc.resolution_ps", "0.01"), ("tdc.clock_ps", "1.0")]
            .map(|(key, value)| (key.to_owned(), value.to_owned()));
        let error = Design::open("hdl-64e", &fine).unwrap_err().to_string();
        assert!(error.contains("range gate"), "{error}");
    }
}
