//! The light of a shot, and its readout.

use super::SensorFile;
use super::optional::Continuous;
use crate::design::limits::Check;
use crate::design::{Clock, Emission, Error, Readout, Scan};

impl Check<'_> {
    /// Returns the clock and the readout of the record.
    pub(super) fn readout(&self, file: &SensorFile) -> Result<(Clock, Readout), Error> {
        if let Some(light) = file.continuous().next() {
            return light.readout(self, file);
        }
        match (&file.histogram, file.adc()) {
            (Some(histogram), _) => self.histogram(histogram),
            (None, Some(adc)) => self.adc(adc),
            (None, None) => self.tdc(&file.tdc),
        }
    }

    /// Returns the light that a shot sends.
    pub(super) fn emission(
        &self,
        file: &SensorFile,
        scan: &Scan,
        clock: Clock,
    ) -> Result<Emission, Error> {
        let coding = self.coding(file.code.as_ref(), scan, clock)?;
        if let Some(light) = file.continuous().next() {
            self.stands_alone(light, file)?;
            return light.emission(self, coding, scan.light_range);
        }
        let Some(burst) = &file.burst else { return Ok(Emission::Marks(coding)) };
        if file.code.is_some() {
            return self.refuse("burst", "repeats single pulses: leave out [code], or [burst]");
        }
        Ok(Emission::Burst(self.burst(burst, coding, clock)?))
    }

    /// Refuses tables of other light in a `file` whose `light` has no pulses, and a detector that does not
    /// follow it.
    fn stands_alone(&self, light: &dyn Continuous, file: &SensorFile) -> Result<(), Error> {
        let (table, detector) = (light.table(), light.detector());
        let of_pulses = [
            ("code", file.code.is_some()),
            ("burst", file.burst.is_some()),
            ("histogram", file.histogram.is_some()),
        ];
        let pulses = of_pulses.iter().filter(|(_, is_there)| *is_there);
        let others = file.continuous().skip(1).map(|other| (other.table(), other.varies()));
        if let Some((key, of)) = pulses.map(|(key, _)| (*key, "pulses")).chain(others).next() {
            let message =
                format!("is of {of}, and the light of a [{table}] has none: leave one of them out");
            return self.refuse(key, message);
        }
        if file.detector.only().is_none_or(|only| only.name != detector) {
            let message = format!("must be `{detector}` where light has a [{table}]");
            return self.refuse("detector", message);
        }
        Ok(())
    }
}
