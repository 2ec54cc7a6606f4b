//! One beam through two thin prisms that turn, as in the lidars with which rosettes came into use:
//! a pattern that hardly repeats.

use schemars::JsonSchema;
use serde::Deserialize;

use super::directions::{Prism, Way};
use super::steered::shots_of;
use super::{Pattern, Steered, Typed};
use crate::design::Error;
use crate::design::limits::Check;

/// `[scan.rosette]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Shots per second: 65535 in a scan at most.
    #[schemars(range(min = 1, max = 1e9))]
    shots_per_s: f64,
    /// The two prisms.
    #[schemars(length(equal = 2))]
    prisms: Vec<PrismFile>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PrismFile {
    /// Angle by which it bends the beam, degrees.
    #[schemars(range(min = 0, max = 45))]
    deflection_deg: f64,
    /// Turns per second, positive from the left to the top.
    #[schemars(range(min = -1e5, max = 1e5))]
    turns_per_s: f64,
    /// Direction of its deflection when the first scan begins, degrees from the left.
    #[serde(default)]
    #[schemars(range(min = -360, max = 360))]
    phase_deg: f64,
}

impl Typed for File {
    fn check(&self, check: &Check, period: f64) -> Result<Pattern, Error> {
        let path = "scan.rosette.prisms";
        let [one, two] = self.prisms.as_slice() else {
            return check.refuse(path, "must be two, as { deflection_deg, turns_per_s }");
        };
        let prism = |typed: &PrismFile| {
            Ok(Prism {
                deflection: check.within(path, typed.deflection_deg, 0.0, 45.0)?.to_radians(),
                turns_per_s: check.within(path, typed.turns_per_s, -1e5, 1e5)?,
                phase: check.within(path, typed.phase_deg, -360.0, 360.0)?.to_radians(),
            })
        };
        let prisms = [prism(one)?, prism(two)?];
        let key = "scan.rosette.shots_per_s";
        let shots = shots_of(check, key, self.shots_per_s, period)?;
        // The square about the disc.
        let side = 2.0 * prisms.iter().map(|prism| prism.deflection).sum::<f64>();
        let way = Way::Prisms(prisms, period / f64::from(shots));
        Ok(Pattern::Rosette(Steered { way, shots, sides: [side; 2] }))
    }
}
