//! From light to detection events: what holds for every kind of detector.

use super::{Before, Detector, DetectorFile, Follows, Table};
use crate::design::limits::Check;
use crate::design::{Effect, Error};

/// The efficiency of a detector, detections per photon, as typed.
pub(in crate::design) struct Efficiency {
    /// Its dotted key.
    pub path: String,
    pub value: Option<f64>,
}

impl Efficiency {
    pub(in crate::design) fn of(file: &DetectorFile) -> Self {
        match file.given().next() {
            Some(given) => Self {
                path: format!("detector.{}.efficiency", given.name),
                value: given.file.efficiency(),
            },
            None => Self { path: "detector".to_owned(), value: None },
        }
    }
}

impl Check<'_> {
    pub(in crate::design) fn detector(
        &self,
        file: &DetectorFile,
        before: &Before,
    ) -> Result<Detector, Error> {
        if let Some(only) = file.only() {
            return only.file.check(&Table { check: self, name: only.name, before });
        }
        let all: Vec<String> =
            Detector::NAMES.iter().map(|name| format!("[detector.{name}]")).collect();
        self.refuse("detector", format!("needs exactly one of {}", all.join(", ")))
    }

    /// The effects that the detector does not follow and that are not declared as left out, each as
    /// an error.
    pub(in crate::design) fn not_followed(
        &self,
        file: &DetectorFile,
        idealised: &[Effect],
    ) -> Vec<Error> {
        let Some(only) = file.only() else { return Vec::new() };
        let Follows { bandwidth, neighbouring_chips } = only.file.follows();
        let told = |is_followed: bool, effect: Effect, how: &str| {
            let message = format!(
                "this detector {how}: add `{}` to this list, which declares that {}",
                effect.name(),
                effect.assumption()
            );
            let is_wrong = !is_followed && !idealised.contains(&effect);
            is_wrong.then(|| self.chain.error("idealised", message))
        };
        let both = [
            told(bandwidth, Effect::DetectorBandwidth, "has no bandwidth of its own"),
            told(neighbouring_chips, Effect::InterChip, "judges every mark alone"),
        ];
        both.into_iter().flatten().collect()
    }
}
