//! From light to edges.

use super::Check;
use crate::design::file::{DetectorFile, SensitivityFile};
use crate::design::{Detector, Error, FirstFiring, PhotonCounting, Sensitivity};

impl Check<'_> {
    pub(super) fn detector(&self, file: &DetectorFile, dark_sky: bool) -> Result<Detector, Error> {
        match (&file.photon_counting, &file.first_firing) {
            (Some(counting), None) => {
                let at = |key: &str| format!("detector.photon-counting.{key}");
                let pd = self.pd(&at("sensitivity"), &counting.sensitivity)?;
                let dark =
                    self.within(&at("dark_counts_hz"), counting.dark_counts_hz, 0.0, 1e12)?;
                let light = self.within(&at("background_hz"), counting.background_hz, 0.0, 1e12)?;
                Ok(Detector::PhotonCounting(PhotonCounting {
                    sensitivity: sensitivity(&counting.sensitivity, -(-pd).ln_1p()),
                    missed_marks: self.within(
                        &at("missed_marks"),
                        counting.missed_marks,
                        0.0,
                        1.0,
                    )?,
                    false_rate: dark + if dark_sky { 0.0 } else { light },
                    jitter: self.within(&at("jitter_ps"), counting.jitter_ps, 0.0, 1e6)? * 1e-12,
                }))
            }
            (None, Some(firing)) => {
                let at = |key: &str| format!("detector.first-firing.{key}");
                let pd = self.pd(&at("sensitivity"), &firing.sensitivity)?;
                let needed =
                    self.count(&at("firing_photons"), firing.firing_photons, 1, 1 << 20)?;
                let noise = self.within(&at("noise_photons"), firing.noise_photons, 0.0, 1e6)?;
                let photons = crate::detect::photons_for(pd, needed, noise);
                Ok(Detector::FirstFiring(FirstFiring {
                    sensitivity: sensitivity(&firing.sensitivity, photons),
                    firing_photons: needed,
                    noise_photons: noise,
                    false_rate: self.within(
                        &at("false_firing_hz"),
                        firing.false_firing_hz,
                        0.0,
                        1e9,
                    )?,
                    jitter: self.within(&at("jitter_ps"), firing.jitter_ps, 0.0, 1e6)? * 1e-12,
                }))
            }
            _ => self.refuse(
                "detector",
                "needs exactly one of [detector.photon-counting], [detector.first-firing]",
            ),
        }
    }

    fn pd(&self, path: &str, file: &SensitivityFile) -> Result<f64, Error> {
        self.within(&format!("{path}.range_m"), file.range_m, 0.01, 1e6)?;
        self.within(&format!("{path}.reflectance"), file.reflectance, 1e-6, 1e6)?;
        self.within(&format!("{path}.pd"), file.pd, 1e-6, 1.0)
    }
}

fn sensitivity(file: &SensitivityFile, photons: f64) -> Sensitivity {
    Sensitivity { photons, range: file.range_m, reflectance: file.reflectance }
}
