//! The manifest of a run that decodes what was recorded.

use macropulse::codec::decode::Reject;
use macropulse::design::Design;
use macropulse::environment::Environment;
use macropulse::formats::{Entries, State, versioned};
use serde_json::{Value, json};

use super::{defaults, named, surroundings};

/// Shots, and ticks, samples or histograms, that were decoded, with what was counted.
#[derive(Debug, Clone, Copy)]
pub struct Decoded<'a> {
    /// The sensor.
    pub design: &'a Design,
    /// Sun and air by which intensity is measured.
    pub environment: &'a Environment,
    /// Names of the inputs: of the shots, and of the ticks, samples or histograms.
    pub inputs: [&'a str; 2],
    /// How far the run has come.
    pub state: State,
    /// Scans with a decoded shot.
    pub scans: u64,
    /// Shots whose returns are wanted.
    pub shots: u64,
    /// Ticks, or samples of all channels; those of guard shots included.
    pub recorded: u64,
    /// Returns found.
    pub returns: u64,
    /// Macropulses refused, by reason.
    pub rejects: [u64; Reject::ALL.len()],
    /// Warnings for the reader.
    pub warnings: &'a [String],
    /// Names of the files written.
    pub files: &'a [String],
    /// Wall-clock time, s.
    pub elapsed: f64,
}

impl Decoded<'_> {
    /// The manifest: the keys of one that simulates, as far as the receiver's side knows them.
    pub fn manifest(&self) -> Value {
        let mut rejects = Entries::default();
        for (kind, count) in Reject::ALL.into_iter().zip(self.rejects) {
            rejects.push(kind.name(), count);
        }
        let [shots, record] = self.inputs;
        let kind = self.design.records().name();
        versioned(json!({
            "state": self.state,
            "version": env!("CARGO_PKG_VERSION"),
            "sensor": named(self.design),
            "environment": surroundings(self.environment),
            "recorded": { "shots": shots, kind: record },
            "defaults": defaults(self.design),
            "warnings": self.warnings,
            "counts": {
                "scans": self.scans,
                "shots": self.shots,
                kind: self.recorded,
                "returns": self.returns,
            },
            "rejects": rejects,
            "files": self.files,
            "times_s": { "elapsed": self.elapsed },
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manifest_of_decoding_knows_no_scene() {
        let design = Design::open("peregrine", &[]).unwrap();
        let environment = Environment::default();
        let decoded = Decoded {
            design: &design,
            environment: &environment,
            inputs: ["a.mps", "stdin"],
            state: State::Finished,
            scans: 1,
            shots: 7,
            recorded: 30,
            returns: 5,
            rejects: Default::default(),
            warnings: &[],
            files: &["index.html".to_owned()],
            elapsed: 0.5,
        };
        let manifest = decoded.manifest();
        assert_eq!(manifest["sensor"]["digest"], design.digest());
        assert_eq!(manifest["recorded"], json!({ "shots": "a.mps", "ticks": "stdin" }));
        assert_eq!(manifest["counts"]["returns"], 5);
        assert!(manifest["defaults"].as_object().is_some_and(|keys| !keys.is_empty()));
        let keys: Vec<&String> = manifest.as_object().unwrap().keys().collect();
        assert_eq!(keys[0], "schema_version");
        assert!(!keys.iter().any(|key| ["scene", "seed", "outcomes"].contains(&key.as_str())));
    }
}
