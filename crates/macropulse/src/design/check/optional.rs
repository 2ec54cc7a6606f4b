//! The tables of a sensor file that one way to measure needs and others leave out.

use super::SensorFile;
use crate::design::limits::{Check, Idle};
use crate::design::{Clock, Coding, Emission, Error, Readout};

/// A table that a sensor file may leave out.
pub(in crate::design) trait OptionalTable {
    /// Keys of the `file` that mean nothing with it.
    fn idle(&self, file: &SensorFile) -> Vec<Idle>;

    /// The same table, if it describes light without pulses.
    fn continuous(&self) -> Option<&dyn Continuous> {
        None
    }
}

/// Light without pulses, as typed. It excludes pulses and other such light, and needs a detector that follows it.
pub(in crate::design) trait Continuous {
    /// The name of its table.
    fn table(&self) -> &'static str;

    /// The property of its light that varies, which other light does not have.
    fn varies(&self) -> &'static str;

    /// The name of the detector that follows it.
    fn detector(&self) -> &'static str;

    /// Clock and readout of that detector.
    fn readout(&self, check: &Check, file: &SensorFile) -> Result<(Clock, Readout), Error>;

    /// The light of shots that begin as `shot`, followed to `farthest` metres.
    fn emission(&self, check: &Check, shot: Coding, farthest: f64) -> Result<Emission, Error>;
}

impl SensorFile {
    /// The optional tables that the file has. If a key is idle for several of them, the first one is named.
    pub(super) fn optional(&self) -> impl Iterator<Item = &dyn OptionalTable> {
        let all: [Option<&dyn OptionalTable>; 4] = [
            self.histogram.as_ref().map(|table| table as _),
            self.modulation.as_ref().map(|table| table as _),
            self.chirp.as_ref().map(|table| table as _),
            self.spectrum.as_ref().map(|table| table as _),
        ];
        all.into_iter().flatten()
    }

    /// The tables of light without pulses that the file has: one, or none.
    pub(super) fn continuous(&self) -> impl Iterator<Item = &dyn Continuous> {
        self.optional().filter_map(OptionalTable::continuous)
    }
}
