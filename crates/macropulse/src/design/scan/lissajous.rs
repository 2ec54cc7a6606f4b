//! One beam from a mirror that swings about two axes, as micromechanical mirrors do: a figure of Lissajous.

use schemars::JsonSchema;
use serde::Deserialize;

use super::directions::{Swing, Way};
use super::steered::shots_of;
use super::{Pattern, Steered, Typed};
use crate::design::Error;
use crate::design::limits::Check;

/// `[scan.lissajous]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Shots per second: 65535 in a scan at most.
    #[schemars(range(min = 1, max = 1e9))]
    shots_per_s: f64,
    /// The swing across.
    horizontal: SwingFile,
    /// The swing up and down.
    vertical: SwingFile,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SwingFile {
    /// Whole angle of the beam, from one end to the other, degrees.
    #[schemars(range(min = 0.01, max = 150))]
    field_deg: f64,
    /// Swings per second, there and back.
    #[schemars(range(min = 0, max = 1e6))]
    hz: f64,
    /// Phase of the sine when the first scan begins, degrees; at 0 the beam passes the middle towards the left or the top.
    #[serde(default)]
    #[schemars(range(min = -360, max = 360))]
    phase_deg: f64,
}

impl Typed for File {
    fn check(&self, check: &Check, period: f64) -> Result<Pattern, Error> {
        let swing = |name: &str, typed: &SwingFile| {
            let within = |key: &str, value: f64, [least, most]: [f64; 2]| {
                check.within(&format!("scan.lissajous.{name}.{key}"), value, least, most)
            };
            Ok(Swing {
                half: within("field_deg", typed.field_deg, [0.01, 150.0])?.to_radians() / 2.0,
                hz: within("hz", typed.hz, [0.0, 1e6])?,
                phase: within("phase_deg", typed.phase_deg, [-360.0, 360.0])?.to_radians(),
            })
        };
        let swings = [swing("horizontal", &self.horizontal)?, swing("vertical", &self.vertical)?];
        let key = "scan.lissajous.shots_per_s";
        let shots = shots_of(check, key, self.shots_per_s, period)?;
        let way = Way::Mirror(swings, period / f64::from(shots));
        let sides = swings.map(|swing| 2.0 * swing.half);
        Ok(Pattern::Lissajous(Steered { way, shots, sides }))
    }
}
