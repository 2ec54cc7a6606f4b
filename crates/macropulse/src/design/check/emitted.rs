//! The light of a shot, and its readout where it is not the light of a code word.

use super::SensorFile;
use crate::design::limits::Check;
use crate::design::{Clock, Coding, Emission, Error, Readout, Scan};
use crate::units::{fs_from_s, tof_from_range};

impl Check<'_> {
    /// Returns the light that a shot sends.
    pub(super) fn emission(
        &self,
        file: &SensorFile,
        scan: &Scan,
        clock: Clock,
    ) -> Result<Emission, Error> {
        let coding = self.coding(file.code.as_ref(), scan, clock)?;
        if !file.is_pulsed() {
            return self.without_pulses(file, coding, scan);
        }
        let Some(burst) = &file.burst else { return Ok(Emission::Marks(coding)) };
        if file.code.is_some() {
            return self.refuse("burst", "repeats single pulses: leave out [code], or [burst]");
        }
        Ok(Emission::Burst(self.burst(burst, coding, clock)?))
    }

    /// The same for light that is modulated, in power or in frequency. It allows no pulses, and needs a
    /// detector that follows it.
    fn without_pulses(
        &self,
        file: &SensorFile,
        shot: Coding,
        scan: &Scan,
    ) -> Result<Emission, Error> {
        let (table, detector) = match file.modulation {
            Some(_) => ("modulation", "lock-in"),
            None => ("chirp", "coherent"),
        };
        for (key, is_there) in [
            ("code", file.code.is_some()),
            ("burst", file.burst.is_some()),
            ("histogram", file.histogram.is_some()),
            ("chirp", file.modulation.is_some() && file.chirp.is_some()),
        ] {
            if is_there {
                let of = if key == "chirp" { "a frequency" } else { "pulses" };
                let message = format!(
                    "is of {of}, and the light of a [{table}] has none: leave one of them out"
                );
                return self.refuse(key, message);
            }
        }
        if file.detector.only().is_none_or(|only| only.name != detector) {
            let message = format!("must be `{detector}` where light has a [{table}]");
            return self.refuse("detector", message);
        }
        match (&file.modulation, &file.chirp) {
            (Some(modulation), _) => {
                Ok(Emission::Modulated(self.modulation(modulation, shot, scan.light_range)?))
            }
            (None, Some(chirp)) => {
                Ok(Emission::Chirped(self.chirp(chirp, shot, scan.light_range)?))
            }
            (None, None) => Ok(Emission::Marks(shot)),
        }
    }

    /// Clock and readout of light with a chirp.
    pub(super) fn chirped_readout(&self, file: &SensorFile) -> Result<(Clock, Readout), Error> {
        match &file.spectrum {
            Some(spectrum) => self.spectrum(spectrum),
            None => {
                Err(self.chain.lacks("spectrum", "records the beats of a [chirp], and is missing"))
            }
        }
    }

    /// Checks that bursts and histograms go together. A sensor that repeats pulses adds up their counts, in
    /// bins that lie within a cycle and hold the range gate.
    pub(super) fn cycles(
        &self,
        file: &SensorFile,
        emission: &Emission,
        (clock, readout): (Clock, &Readout),
        scan: &Scan,
    ) -> Result<(), Error> {
        let (burst, histogram) = match (emission.burst(), readout.histogram()) {
            (None, None) => return Ok(()),
            (Some(_), None) => {
                return self.refuse("burst", "is added up in a [histogram], which is missing");
            }
            (None, Some(_)) => {
                let message = "adds up the pulses of a [burst], which is missing";
                return Err(self.chain.lacks("histogram", message));
            }
            (Some(burst), Some(histogram)) => (burst, histogram),
        };
        if file.detector.only().is_none_or(|only| only.name != "geiger") {
            return self.refuse("detector", "must be `geiger` where counts go into a [histogram]");
        }
        let last_fs = i64::from(histogram.bins) * clock.tick_fs;
        if last_fs > burst.interval_fs {
            let most = burst.interval_fs / clock.tick_fs;
            let message = format!("is {}, but between two pulses lie {most} bins", histogram.bins);
            return self.refuse("histogram.bins", message);
        }
        let last = fs_from_s(tof_from_range(scan.max_range)) / clock.tick_fs;
        if last >= i64::from(histogram.bins) {
            let message = format!(
                "is {}, but the range gate ends in bin {last}: more bins, or a shorter max_range_m",
                histogram.bins
            );
            return self.refuse("histogram.bins", message);
        }
        Ok(())
    }
}
