//! From light to edges.

use super::Check;
use crate::design::budget::Budget;
use crate::design::detector::photons_for;
use crate::design::file::{
    DetectorFile, FirstFiringFile, GeigerFile, LinearFile, PhotonCountingFile, SensitivityFile,
};
use crate::design::linear::Amplifier;
use crate::design::{
    Coding, Detector, Effect, Error, FirstFiring, Geiger, Light, Linear, PhotonCounting, Scan,
    Sensitivity,
};
use crate::units::fs_from_s;

/// The most dark counts, or declared background counts, per second.
const MOST_COUNTS: f64 = 1e12;

/// What a detector gets to see.
pub(super) struct Before<'a> {
    pub scan: &'a Scan,
    pub light: &'a Light,
    pub coding: &'a Coding,
    pub budget: Option<&'a Budget>,
}

impl Before<'_> {
    /// What is detected per mark of the budget: of a white target at the rated range in clear air.
    fn honest(&self, budget: &Budget) -> Sensitivity {
        let energy = budget.energy / self.coding.codebook.mean_weight();
        let range = self.scan.rated_range;
        let photons = budget.photons(energy, 1.0, range) * budget.efficiency;
        Sensitivity { photons, range, reflectance: 1.0 }
    }
}

/// The dotted key of the efficiency and its value.
pub(super) fn efficiency(file: &DetectorFile) -> (&'static str, Option<f64>) {
    match file {
        DetectorFile { photon_counting: Some(counting), .. } => {
            ("detector.photon-counting.efficiency", counting.efficiency)
        }
        DetectorFile { geiger: Some(geiger), .. } => {
            ("detector.geiger.efficiency", geiger.efficiency)
        }
        DetectorFile { linear: Some(linear), .. } => {
            ("detector.linear.efficiency", Some(linear.efficiency))
        }
        DetectorFile { first_firing: Some(firing), .. } => {
            ("detector.first-firing.efficiency", firing.efficiency)
        }
        _ => ("detector", None),
    }
}

impl Check<'_> {
    pub(super) fn detector(&self, file: &DetectorFile, before: &Before) -> Result<Detector, Error> {
        let kinds = (&file.photon_counting, &file.geiger, &file.linear, &file.first_firing);
        match kinds {
            (Some(counting), None, None, None) => {
                Ok(Detector::PhotonCounting(self.photon_counting(counting, before)?))
            }
            (None, Some(geiger), None, None) => Ok(Detector::Geiger(self.geiger(geiger, before)?)),
            (None, None, Some(linear), None) => Ok(Detector::Linear(self.linear(linear, before)?)),
            (None, None, None, Some(firing)) => {
                Ok(Detector::FirstFiring(self.first_firing(firing, before)?))
            }
            _ => self.refuse(
                "detector",
                "needs exactly one of [detector.photon-counting], [detector.geiger], \
                 [detector.linear], [detector.first-firing]",
            ),
        }
    }

    /// Whether a detector without a bandwidth of its own is declared to need none.
    pub(super) fn bandwidth(&self, file: &DetectorFile, idealised: &[Effect]) -> Result<(), Error> {
        let without = file.photon_counting.is_some() || file.first_firing.is_some();
        if without && !idealised.contains(&Effect::DetectorBandwidth) {
            let message = format!(
                "this detector has no bandwidth of its own: add `{}` to this list, which declares \
                 that {}",
                Effect::DetectorBandwidth.name(),
                Effect::DetectorBandwidth.assumption()
            );
            return self.refuse("idealised", message);
        }
        Ok(())
    }

    /// Whether a detector that does not follow light into neighbouring chips is declared to need
    /// not.
    pub(super) fn chips(&self, file: &DetectorFile, idealised: &[Effect]) -> Result<(), Error> {
        let alone = file.linear.is_some() || file.first_firing.is_some();
        if alone && !idealised.contains(&Effect::InterChip) {
            let message = format!(
                "this detector judges every mark alone: add `{}` to this list, which declares \
                 that {}",
                Effect::InterChip.name(),
                Effect::InterChip.assumption()
            );
            return self.refuse("idealised", message);
        }
        Ok(())
    }

    fn photon_counting(
        &self,
        file: &PhotonCountingFile,
        before: &Before,
    ) -> Result<PhotonCounting, Error> {
        let at = |key: &str| format!("detector.photon-counting.{key}");
        let declared = (at("sensitivity"), &file.sensitivity);
        let sensitivity = self.sensitivity(declared, before, |pd| -(-pd).ln_1p())?;
        let dark = self.within(&at("dark_counts_hz"), file.dark_counts_hz, 0.0, MOST_COUNTS)?;
        Ok(PhotonCounting {
            sensitivity,
            missed_marks: self.within(&at("missed_marks"), file.missed_marks, 0.0, 1.0)?,
            dark,
            background: self.background((at("background_hz"), file.background_hz), before)?,
            jitter: self.within(&at("jitter_ps"), file.jitter_ps, 0.0, 1e6)? * 1e-12,
        })
    }

    fn geiger(&self, file: &GeigerFile, before: &Before) -> Result<Geiger, Error> {
        let at = |key: &str| format!("detector.geiger.{key}");
        let declared = (at("sensitivity"), &file.sensitivity);
        let sensitivity = self.sensitivity(declared, before, |pd| -(-pd).ln_1p())?;
        let dark = self.within(&at("dark_counts_hz"), file.dark_counts_hz, 0.0, MOST_COUNTS)?;
        let background = self.background((at("background_hz"), file.background_hz), before)?;
        let dead = self.within(&at("dead_time_ns"), file.dead_time_ns, 0.0, 1e6)?;
        Ok(Geiger {
            sensitivity,
            cells: self.count(&at("cells"), file.cells, 1, 1 << 20)?,
            dead_fs: fs_from_s(dead * 1e-9),
            dark,
            background,
            jitter: self.within(&at("jitter_ps"), file.jitter_ps, 0.0, 1e6)? * 1e-12,
        })
    }

    fn linear(&self, file: &LinearFile, before: &Before) -> Result<Linear, Error> {
        let at = |key: &str| format!("detector.linear.{key}");
        let Some(budget) = before.budget else {
            return self.refuse(
                "detector.linear",
                "counts its noise in electrons, so the light must be counted as well: take \
                 \"link-budget\" off the list `idealised`",
            );
        };
        let amplifier = Amplifier {
            gain: self.within(&at("gain"), file.gain, 1.0, 1e6)?,
            ionisation: self.within(&at("ionisation_ratio"), file.ionisation_ratio, 0.0, 1.0)?,
            bandwidth: self.within(&at("bandwidth_mhz"), file.bandwidth_mhz, 1e-3, 1e9)? * 1e6,
            current_noise: self.within(
                &at("amplifier_pa_rthz"),
                file.amplifier_pa_rthz,
                0.0,
                1e6,
            )? * 1e-12,
            dark_current: self.within(&at("dark_current_na"), file.dark_current_na, 0.0, 1e6)?
                * 1e-9,
            pulse: before.light.pulse,
        };
        let path = at("false_alarm_hz");
        let rate = self.within(&path, file.false_alarm_hz, 1e-3, MOST_COUNTS)?;
        let Some(tnr) = amplifier.threshold_for(rate) else {
            let message = format!(
                "is {rate:.3e}, but noise of this bandwidth crosses even its own mean only \
                 {:.3e} times per second",
                amplifier.highest_rate()
            );
            return self.refuse(&path, message);
        };
        Ok(Linear {
            sensitivity: before.honest(budget),
            amplifier,
            false_alarm: rate,
            threshold_over_noise: tnr,
            jitter: self.within(&at("jitter_ps"), file.jitter_ps, 0.0, 1e6)? * 1e-12,
        })
    }

    fn first_firing(&self, file: &FirstFiringFile, before: &Before) -> Result<FirstFiring, Error> {
        let at = |key: &str| format!("detector.first-firing.{key}");
        if before.coding.codebook.max_weight() > 1 {
            return self.refuse(
                "detector.first-firing",
                "fires once per shot, but a coded shot has several marks: use \
                 [detector.geiger], [detector.linear] or [detector.photon-counting], or leave \
                 [code] out",
            );
        }
        let needed = self.count(&at("firing_photons"), file.firing_photons, 1, 1 << 20)?;
        let noise = self.within(&at("noise_photons"), file.noise_photons, 0.0, 1e6)?;
        let photons = |pd| photons_for(pd, needed, noise);
        let path = at("false_firing_hz");
        Ok(FirstFiring {
            sensitivity: self.sensitivity(
                (at("sensitivity"), &file.sensitivity),
                before,
                photons,
            )?,
            firing_photons: needed,
            noise_photons: noise,
            false_rate: self.within(&path, file.false_firing_hz, 0.0, 1e9)?,
            jitter: self.within(&at("jitter_ps"), file.jitter_ps, 0.0, 1e6)? * 1e-12,
        })
    }

    /// What is detected per mark: by the budget, or as declared, with `photons` for what a
    /// probability of detection needs.
    fn sensitivity(
        &self,
        (path, declared): (String, &Option<SensitivityFile>),
        before: &Before,
        photons: impl Fn(f64) -> f64,
    ) -> Result<Sensitivity, Error> {
        if let Some(budget) = before.budget {
            return Ok(before.honest(budget));
        }
        let Some(declared) = declared else {
            return self.refuse(&path, "is needed where the link budget is idealised");
        };
        let at = |key: &str| format!("{path}.{key}");
        Ok(Sensitivity {
            photons: photons(self.within(&at("pd"), declared.pd, 1e-6, 1.0)?),
            range: self.within(&at("range_m"), declared.range_m, 0.01, 1e6)?,
            reflectance: self.within(&at("reflectance"), declared.reflectance, 1e-6, 1e6)?,
        })
    }

    /// Counts per second that sunlight makes, as declared; 0 where they follow from a budget.
    fn background(&self, (path, declared): (String, f64), before: &Before) -> Result<f64, Error> {
        let declared = self.within(&path, declared, 0.0, MOST_COUNTS)?;
        match before.budget {
            Some(_) if declared > 0.0 => self.refuse(
                &path,
                "follows from [optics] and the environment of the scene where the link budget is \
                 not idealised: leave it out",
            ),
            _ => Ok(declared),
        }
    }
}
