//! Photodiodes that a search may choose from: some with their sources come with the program, and a file of
//! requirements may bring its own.

use macropulse::told;
use schemars::JsonSchema;
use serde::Deserialize;

/// A photodiode with its amplifier: the keys of `[detector.photodiode]`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Name by which it is chosen.
    pub name: String,
    /// Source of its figures.
    #[serde(default)]
    pub source: String,
    /// Wavelength at which it works, nm.
    pub wavelength_nm: f64,
    /// Detections per photon.
    pub efficiency: f64,
    /// Gain; 1 multiplies nothing.
    pub gain: f64,
    /// Ratio of the ionisation rates.
    pub ionisation_ratio: f64,
    /// Dark current that is multiplied, nA.
    pub dark_current_na: f64,
    /// Capacitance with that of the amplifier, pF.
    pub capacitance_pf: f64,
    /// Most bandwidth of the photodiode with its amplifier, MHz.
    pub most_bandwidth_mhz: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Known {
    detector: Vec<Part>,
}

/// The photodiodes that come with the program.
pub fn known() -> Vec<Part> {
    toml::from_str::<Known>(include_str!("detectors.toml"))
        .map(|known| known.detector)
        .unwrap_or_default()
}

/// Those of `names`, of the file's `own` or of ours; all of its own, or else of ours, where none is named.
/// Refuses with the key and a message.
pub(super) fn chosen(
    names: &[String],
    own: Vec<Part>,
) -> Result<Vec<Part>, (&'static str, String)> {
    const KEY: &str = "parts.detectors";
    for (at, part) in own.iter().enumerate() {
        if own[..at].iter().any(|other| other.name == part.name) {
            return Err(("detector", format!("two are called `{}`", part.name)));
        }
        if let Some(message) = part.fault() {
            return Err(("detector", format!("`{}`: {message}", part.name)));
        }
    }
    let known = known();
    if names.is_empty() {
        return Ok(if own.is_empty() { known } else { own });
    }
    let all: Vec<Part> = own.into_iter().chain(known).collect();
    let mut parts: Vec<Part> = Vec::new();
    for name in names {
        let Some(part) = all.iter().find(|part| part.name == *name) else {
            let known: Vec<&str> = all.iter().map(|part| part.name.as_str()).collect();
            return Err((KEY, told::unknown("photodiode", name, &known)));
        };
        if parts.iter().any(|other| other.name == part.name) {
            return Err((KEY, format!("`{name}` stands there twice")));
        }
        parts.push(part.clone());
    }
    Ok(parts)
}

impl Part {
    /// The first of its numbers that is none of a photodiode.
    fn fault(&self) -> Option<String> {
        let limits = [
            ("wavelength_nm", self.wavelength_nm, 200.0, 20e3),
            ("efficiency", self.efficiency, 1e-6, 1.0),
            ("gain", self.gain, 1.0, 1e6),
            ("ionisation_ratio", self.ionisation_ratio, 0.0, 1.0),
            ("dark_current_na", self.dark_current_na, 0.0, 1e6),
            ("capacitance_pf", self.capacitance_pf, 0.0, 1e6),
            ("most_bandwidth_mhz", self.most_bandwidth_mhz, 1.0, 1e6),
        ];
        let outside = limits.iter().find(|(_, value, low, high)| !(value >= low && value <= high));
        outside.map(|(key, value, low, high)| {
            format!("{key} is {value}, but must lie between {low} and {high}")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_photodiode_has_a_source_and_sound_numbers() {
        let known = known();
        assert!(known.len() >= 4);
        for part in known {
            assert!(!part.source.is_empty(), "{}", part.name);
            assert_eq!(part.fault(), None, "{}", part.name);
        }
    }
}
