//! The table of a detector in a sensor file, as its kind reads it.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{ComparatorFile, Sensitivity};
use crate::design::budget::Budget;
use crate::design::limits::Check;
use crate::design::readout::AdcFile;
use crate::design::{Emission, Error, Light, Readout, Scan};

/// The most dark counts, or declared background counts, per second.
pub(super) const MOST_COUNTS: f64 = 1e12;

/// `sensitivity` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::design) struct SensitivityFile {
    /// Range of the target, m.
    #[schemars(range(min = 0.01, max = 1e6))]
    range_m: f64,
    /// Reflectance of the target, which is seen square on: 1 is white.
    #[schemars(range(min = 1e-6, max = 1e6))]
    reflectance: f64,
    /// Probability that a mark is detected.
    #[schemars(range(min = 1e-6, max = 1))]
    pd: f64,
}

/// Parts of a sensor that are checked before its detector.
pub(in crate::design) struct Before<'a> {
    pub scan: &'a Scan,
    pub light: &'a Light,
    pub emission: &'a Emission,
    pub readout: &'a Readout,
    pub budget: Option<&'a Budget>,
    /// The comparator for the signal of a photodiode.
    pub comparator: Option<&'a ComparatorFile>,
    /// The converter that samples it.
    pub adc: Option<&'a AdcFile>,
}

/// The table `[detector.NAME]`: tests values by their keys in it.
pub(in crate::design) struct Table<'a> {
    pub check: &'a Check<'a>,
    pub name: &'static str,
    pub before: &'a Before<'a>,
}

impl Table<'_> {
    /// The dotted path of `key`.
    fn path(&self, key: &str) -> String {
        format!("detector.{}.{key}", self.name)
    }

    /// An error about the table as a whole.
    pub(super) fn refuse<T>(&self, message: &str) -> Result<T, Error> {
        self.check.refuse(&format!("detector.{}", self.name), message)
    }

    /// An error about the value of `key`.
    pub(super) fn refuse_key<T>(&self, key: &str, message: String) -> Result<T, Error> {
        self.check.refuse(&self.path(key), message)
    }

    /// A number in [least, most].
    pub(super) fn within(
        &self,
        key: &str,
        value: f64,
        least: f64,
        most: f64,
    ) -> Result<f64, Error> {
        self.check.within(&self.path(key), value, least, most)
    }

    /// An integer from `least` to `most`.
    pub(super) fn count(&self, key: &str, value: u32, least: u32, most: u32) -> Result<u32, Error> {
        self.check.count(&self.path(key), value, least, most)
    }

    /// The timing jitter `jitter_ps`, s.
    pub(super) fn jitter(&self, picoseconds: f64) -> Result<f64, Error> {
        Ok(self.within("jitter_ps", picoseconds, 0.0, 1e6)? * 1e-12)
    }

    /// The rate `dark_counts_hz`, 1/s.
    pub(super) fn dark(&self, rate: f64) -> Result<f64, Error> {
        self.within("dark_counts_hz", rate, 0.0, MOST_COUNTS)
    }

    /// The rate `background_hz` of counts that sunlight makes, 1/s, as declared; 0 where they follow
    /// from a budget.
    pub(super) fn background(&self, declared: f64) -> Result<f64, Error> {
        let declared = self.within("background_hz", declared, 0.0, MOST_COUNTS)?;
        match self.before.budget {
            Some(_) if declared > 0.0 => self.refuse_key(
                "background_hz",
                "follows from [optics] and the environment of the scene where the link budget is \
                 not idealised: leave it out"
                    .to_owned(),
            ),
            _ => Ok(declared),
        }
    }

    /// Photons detected per mark: by the budget, or as declared under `sensitivity`. `photons` gives the
    /// number that a probability of detection needs.
    pub(super) fn sensitivity(
        &self,
        declared: Option<&SensitivityFile>,
        photons: impl Fn(f64) -> f64,
    ) -> Result<Sensitivity, Error> {
        if let Some(budget) = self.before.budget {
            return Ok(self.honest(budget));
        }
        let Some(declared) = declared else {
            let message = "is needed where the link budget is idealised";
            return self.refuse_key("sensitivity", message.to_owned());
        };
        Ok(Sensitivity {
            photons: photons(self.within("sensitivity.pd", declared.pd, 1e-6, 1.0)?),
            range: self.within("sensitivity.range_m", declared.range_m, 0.01, 1e6)?,
            reflectance: self.within("sensitivity.reflectance", declared.reflectance, 1e-6, 1e6)?,
        })
    }

    /// Photons detected per mark of the budget: from a white target at the rated range in clear air.
    pub(super) fn honest(&self, budget: &Budget) -> Sensitivity {
        let Before { scan, emission, .. } = self.before;
        let energy = budget.energy / emission.mean_pulses();
        let range = scan.rated_range;
        let photons = budget.photons(energy, 1.0, range) * budget.efficiency;
        Sensitivity { photons, range, reflectance: 1.0 }
    }
}
