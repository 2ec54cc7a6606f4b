//! The description of a run: `manifest.json`.

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

/// Version of the keys of `manifest.json` and of what `--json` prints. It is raised when a key goes or
/// changes its meaning; new keys may come without.
pub const SCHEMA_VERSION: u32 = 1;

/// `object` with [`SCHEMA_VERSION`] before its keys; anything but an object stays as it is.
pub fn versioned(object: serde_json::Value) -> serde_json::Value {
    let serde_json::Value::Object(object) = object else { return object };
    let version = [("schema_version".to_owned(), SCHEMA_VERSION.into())];
    let others = object.into_iter().filter(|(key, _)| key != "schema_version");
    version.into_iter().chain(others).collect::<serde_json::Map<_, _>>().into()
}

/// A sensor or scene file by name and by the digest of its text.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Named {
    /// Name of the preset, or path as typed.
    pub name: String,
    /// Digest of the text that was read.
    pub digest: String,
}

/// Sun and air of a run.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Surroundings {
    /// Name of the environment.
    pub name: String,
    /// Its conditions, in words.
    pub conditions: String,
}

/// How far a run has come.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Its files are being written, or it was killed meanwhile: which there are is not known.
    Running,
    /// All is done.
    #[default]
    Finished,
    /// Stopped by whoever started it: what it names is whole, and the rest was not begun.
    Stopped,
    /// Ended by an error: what it names is whole.
    Failed,
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

/// Everything that is needed to repeat a run and to judge it. The fields are written in this order.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Manifest {
    /// Version of these keys, [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// How far the run has come.
    pub state: State,
    /// Version of macropulse.
    pub version: String,
    /// Seed of the random numbers.
    pub seed: u64,
    /// The sensor.
    pub sensor: Named,
    /// The scene.
    pub scene: Named,
    /// Sun and air.
    pub environment: Surroundings,
    /// Values the files left open, by key; the keys carry their units.
    pub defaults: Entries<serde_json::Value>,
    /// Effects that are left out.
    pub idealised: Vec<String>,
    /// Effects that no run models, by name: what is assumed instead, and how large each would be.
    pub not_modelled: Entries<serde_json::Value>,
    /// Assumptions made in reading the scene.
    pub assumed: Vec<String>,
    /// Warnings to the reader.
    pub warnings: Vec<String>,
    /// Counts from stage to stage: shots, echoes, detection events, ticks, returns.
    pub counts: Entries<u64>,
    /// Rejected shots or macropulses by reason.
    pub rejects: Entries<u64>,
    /// Converters: most busy at once, detection events lost and merged.
    pub converters: Entries<u64>,
    /// Pixels by outcome.
    pub outcomes: Entries<u64>,
    /// Further returns of their shots by outcome; empty where shots have one return.
    pub further_outcomes: Entries<u64>,
    /// Share of the pixels with an echo whose range is right; `None` where there is no echo.
    pub right_fraction: Option<f64>,
    /// Error up to which a range counts as right, m.
    pub right_within_m: f64,
    /// Scan by scan, when it began and where the sensor was.
    pub scans: Vec<Begun>,
    /// Files written beside the manifest, relative to it.
    pub files: Vec<String>,
    /// Processor time per stage, and wall-clock time of writing and of the whole, s. Last, because
    /// it is the only part that differs between two equal runs.
    pub times_s: Entries<f64>,
}

impl Default for Manifest {
    /// Nothing but the version of the keys.
    fn default() -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            state: State::default(),
            version: String::new(),
            seed: 0,
            sensor: Named::default(),
            scene: Named::default(),
            environment: Surroundings::default(),
            defaults: Entries::default(),
            idealised: Vec::new(),
            not_modelled: Entries::default(),
            assumed: Vec::new(),
            warnings: Vec::new(),
            counts: Entries::default(),
            rejects: Entries::default(),
            converters: Entries::default(),
            outcomes: Entries::default(),
            further_outcomes: Entries::default(),
            right_fraction: None,
            right_within_m: 0.0,
            scans: Vec::new(),
            files: Vec::new(),
            times_s: Entries::default(),
        }
    }
}

impl Manifest {
    /// The manifest as a JSON object.
    pub fn value(&self) -> serde_json::Value {
        // Names are strings and numbers finite or null: there is nothing JSON could refuse.
        serde_json::to_value(self).unwrap_or_default()
    }

    /// The manifest as indented JSON with a final newline.
    pub fn json(&self) -> String {
        // As above.
        let text = serde_json::to_string_pretty(self).unwrap_or_default();
        text + "\n"
    }

    /// Writes `manifest.json` into `folder`.
    ///
    /// # Errors
    /// [`Error::Write`] if it cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        write_manifest(&self.json(), folder)
    }
}

/// Writes what a run says of itself, as `json`, into `folder`.
///
/// # Errors
/// [`Error::Write`] if it cannot be written.
pub fn write_manifest(json: &str, folder: &Path) -> Result<(), Error> {
    write_atomically(&folder.join("manifest.json"), |out| out.write_all(json.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Manifest {
        let mut manifest = Manifest { version: "0.1.0".into(), seed: 7, ..Manifest::default() };
        manifest.counts.push("shots", 407_040);
        manifest.counts.push("echoes", 3658);
        manifest.times_s.push("decode", 0.25);
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
            slower.times_s = Entries::default();
            slower.times_s.push("decode", 99.0);
            slower.json()
        };
        let before = |json: &str| json.split("\"times_s\"").next().unwrap().to_owned();
        assert_ne!(json, slower);
        assert_eq!(before(&json), before(&slower));
    }

    #[test]
    fn a_time_that_is_no_number_is_null() {
        let mut manifest = sample();
        manifest.times_s.push("view", f64::NAN);
        assert!(manifest.json().contains("\"view\": null"));
    }

    #[test]
    fn the_version_of_the_keys_comes_first_and_once() {
        let object = versioned(serde_json::json!({ "b": 1, "schema_version": 7 }));
        assert_eq!(object.to_string(), r#"{"schema_version":1,"b":1}"#);
        assert_eq!(versioned(object.clone()), object);
        assert_eq!(versioned(3.into()), 3);
        let first = sample().json().lines().nth(1).map(str::to_owned);
        assert_eq!(first.as_deref(), Some("  \"schema_version\": 1,"));
    }

    #[test]
    fn it_is_written_by_its_name() {
        let folder = tempfile::tempdir().unwrap();
        sample().write(folder.path()).unwrap();
        let text = std::fs::read_to_string(folder.path().join("manifest.json")).unwrap();
        assert_eq!(text, sample().json());
    }
}
