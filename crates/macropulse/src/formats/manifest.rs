//! What a run says of itself: `manifest.json`.

use super::{Error, write_atomically};
use serde::ser::{Serialize, Serializer};
use std::path::Path;

/// A value with a name, in the place where it was put: maps would sort or shuffle.
#[derive(Debug, Clone, PartialEq)]
pub struct Entries<T>(pub Vec<(String, T)>);

impl<T> Default for Entries<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Entries<T> {
    /// Adds an entry at the end.
    pub fn push(&mut self, name: impl Into<String>, value: T) {
        self.0.push((name.into(), value));
    }
}

impl<T: Serialize> Serialize for Entries<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

/// A sensor or scene file by name and by the digest of its text.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Named {
    /// Name of the preset, or path as typed.
    pub name: String,
    /// Digest of the text that was read.
    pub digest: String,
}

/// When a scan began, and where the sensor was then.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Begun {
    /// Number of the scan, from 0.
    pub scan: u64,
    /// Since the first scan began, ns.
    pub start_ns: f64,
    /// In the world, m.
    pub position_m: [f64; 3],
    /// About the vertical axis, deg; positive to the left.
    pub yaw_deg: f64,
    /// About the left axis, deg; positive looks down.
    pub pitch_deg: f64,
    /// About the forward axis, deg; positive lifts the left side.
    pub roll_deg: f64,
}

/// What is needed to repeat a run and to judge it. The fields are written in this order.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Manifest {
    /// Version of macropulse.
    pub version: String,
    /// Seed of the random numbers.
    pub seed: u64,
    /// The sensor.
    pub sensor: Named,
    /// The scene.
    pub scene: Named,
    /// Sun and air: the name of the environment, and what it is like.
    pub environment: String,
    /// Values the files left open, by key, as text with unit.
    pub defaults: Entries<String>,
    /// What was idealised.
    pub idealisations: Vec<String>,
    /// Anything else a reader should know.
    pub notes: Vec<String>,
    /// Counts from stage to stage: shots, echoes, detection events, ticks, returns.
    pub counts: Entries<u64>,
    /// Rejected shots or macropulses by reason.
    pub rejects: Entries<u64>,
    /// Converters: most busy at once, detection events lost.
    pub tdc: Entries<u64>,
    /// Pixels by outcome; empty without truth.
    pub outcomes: Entries<u64>,
    /// Scan by scan, when it began and where the sensor was.
    pub scans: Vec<Begun>,
    /// Files written beside the manifest, relative to it.
    pub files: Vec<String>,
    /// Wall-clock time per stage, s. Last, because it is the only part that differs between two
    /// equal runs.
    pub stage_times_s: Entries<f64>,
}

impl Manifest {
    /// The manifest as indented JSON with a final newline.
    pub fn json(&self) -> String {
        // Names are strings and numbers finite or null: there is nothing JSON could refuse.
        let text = serde_json::to_string_pretty(self).unwrap_or_default();
        text + "\n"
    }

    /// Writes `manifest.json` into `folder`.
    ///
    /// # Errors
    /// [`Error::Write`] if it cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        write_atomically(&folder.join("manifest.json"), |out| out.write_all(self.json().as_bytes()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Manifest {
        let mut manifest = Manifest { version: "0.1.0".into(), seed: 7, ..Manifest::default() };
        manifest.counts.push("shots", 407_040);
        manifest.counts.push("echoes", 3658);
        manifest.stage_times_s.push("decode", 0.25);
        manifest
    }

    #[test]
    fn entries_keep_their_order() {
        let json = sample().json();
        assert!(json.contains("\"shots\": 407040,\n    \"echoes\": 3658"), "{json}");
        let read: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(read["seed"], 7);
    }

    #[test]
    fn times_are_the_last_part() {
        let json = sample().json();
        let slower = {
            let mut slower = sample();
            slower.stage_times_s = Entries::default();
            slower.stage_times_s.push("decode", 99.0);
            slower.json()
        };
        let before = |json: &str| json.split("\"stage_times_s\"").next().unwrap().to_owned();
        assert_ne!(json, slower);
        assert_eq!(before(&json), before(&slower));
    }

    #[test]
    fn a_time_that_is_no_number_is_null() {
        let mut manifest = sample();
        manifest.stage_times_s.push("view", f64::NAN);
        assert!(manifest.json().contains("\"view\": null"));
    }

    #[test]
    fn it_is_written_by_its_name() {
        let folder = tempfile::tempdir().unwrap();
        sample().write(folder.path()).unwrap();
        let text = std::fs::read_to_string(folder.path().join("manifest.json")).unwrap();
        assert_eq!(text, sample().json());
    }
}
