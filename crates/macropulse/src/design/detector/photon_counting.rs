//! Photon counting, fast enough for every chip: every mark is a Bernoulli trial of its own.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    Detector, Follows, Idle, Lit, Model, Sensitivity, SensitivityFile, Table, Typed,
    length_followed,
};
use crate::design::{Error, Light};

/// `[detector.photon-counting]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Declared sensitivity; if the list `idealised` names `link-budget`.
    sensitivity: Option<SensitivityFile>,
    /// Detections per photon; with a link budget.
    #[schemars(range(min = 1e-6, max = 1))]
    efficiency: Option<f64>,
    /// Share of marks that are lost otherwise.
    #[schemars(range(min = 0, max = 1))]
    missed_marks: f64,
    /// Rate of dark counts (DCR), per second.
    #[schemars(range(min = 0, max = 1e12))]
    dark_counts_hz: f64,
    /// Rate of counts by sunlight, per second; without a link budget, from which it follows.
    #[schemars(range(min = 0, max = 1e12))]
    background_hz: f64,
    /// Timing jitter, ps rms.
    #[schemars(range(min = 0, max = 1e6))]
    jitter_ps: f64,
}

/// A detector that counts photons, fast enough for every chip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotonCounting {
    /// Mean photons detected per mark at the reference target.
    pub sensitivity: Sensitivity,
    /// Marks lost for another reason than lack of light, as a fraction.
    pub missed_marks: f64,
    /// Dark counts, 1/s.
    pub dark: f64,
    /// Background counts where the file declares them, 1/s; else 0.
    pub background: f64,
    /// Standard deviation of the timing, s.
    pub jitter: f64,
}

impl Typed for File {
    fn efficiency(&self) -> Option<f64> {
        self.efficiency
    }

    fn idle(&self) -> Idle {
        Idle::EITHER
    }

    fn follows(&self) -> Follows {
        Follows { bandwidth: false, neighbouring_chips: true }
    }

    fn check(&self, table: &Table) -> Result<Detector, Error> {
        Ok(Detector::PhotonCounting(PhotonCounting {
            sensitivity: table.sensitivity(self.sensitivity.as_ref(), |pd| -(-pd).ln_1p())?,
            dark: table.dark(self.dark_counts_hz)?,
            missed_marks: table.within("missed_marks", self.missed_marks, 0.0, 1.0)?,
            background: table.background(self.background_hz)?,
            jitter: table.jitter(self.jitter_ps)?,
        }))
    }
}

impl Model for PhotonCounting {
    fn sensitivity(&self) -> Sensitivity {
        self.sensitivity
    }

    fn declared_background(&self) -> f64 {
        self.background
    }

    fn jitter(&self) -> f64 {
        self.jitter
    }

    fn resolution(&self, light: &Light) -> f64 {
        libm::hypot(self.jitter, length_followed(light))
    }

    fn false_rate(&self, background: f64) -> f64 {
        self.dark + background
    }

    /// (1 − m)·(1 − exp(−n)), m the marks lost for other reasons.
    fn mark_pd(&self, lit: &Lit) -> f64 {
        -(1.0 - self.missed_marks) * libm::expm1(-lit.photons)
    }

    fn mark_jitter(&self, _: &Lit) -> f64 {
        self.jitter
    }

    fn mark_displacement(&self, _: &Lit, light: &Light) -> f64 {
        length_followed(light)
    }

    fn summary(&self) -> String {
        format!(
            "photon counting; {}; {:.0e} dark counts/s; jitter {} ps",
            self.sensitivity.summary(),
            self.dark,
            self.jitter * 1e12
        )
    }

    fn in_sunlight(&self) -> &'static str {
        "each of which is counted"
    }
}
