//! What is printed of a run that decodes.

use macropulse::codec::decode::Reject;
use macropulse::environment::Environment;
use macropulse_study::record::{named, surroundings};
use serde_json::{Map, Value, json};

use super::run::Run;
use crate::text::{Columns, counted, grouped};

impl Run<'_> {
    /// A report for people.
    pub fn text(&self, environment: &Environment) -> String {
        let mut columns = Columns::default();
        columns.push("shots", grouped(self.shots));
        columns.push("ticks", grouped(self.ticks));
        columns.push("returns", grouped(self.returns));
        let kinds = Reject::ALL.into_iter().zip(self.rejects).filter(|(_, count)| *count > 0);
        let kinds: Vec<String> = kinds
            .map(|(kind, count)| format!("{} {}", grouped(count), kind.name().replace('_', " ")))
            .collect();
        let rejects = if kinds.is_empty() { "none".to_owned() } else { kinds.join(", ") };
        columns.push("rejects", rejects);
        columns
            .push("intensity", format!("as in {}: {}", environment.name, environment.conditions()));
        columns.push_list("warnings", self.warnings.iter().cloned());
        if !self.folder.is_empty() {
            let files = counted(self.files.len() as u64, "file");
            columns.push("written", format!("{files} to {}", self.folder));
        }
        let (name, scans) = (&self.design.name, counted(self.scans, "scan"));
        let mut text = format!("{name}: {scans} decoded, {:.2} s\n\n", self.elapsed);
        text.push_str(&columns.text());
        for (explained, _) in &self.explained {
            text.push('\n');
            text.push_str(explained);
        }
        text
    }

    /// The same for programs; keys carry their units.
    pub fn json(&self, environment: &Environment) -> Value {
        let rejects: Map<String, Value> = Reject::ALL
            .into_iter()
            .zip(self.rejects)
            .map(|(kind, count)| (kind.name().to_owned(), count.into()))
            .collect();
        let explained: Vec<&Value> = self.explained.iter().map(|(_, json)| json).collect();
        json!({
            "sensor": named(self.design),
            "environment": surroundings(environment),
            "counts": {
                "scans": self.scans,
                "shots": self.shots,
                "ticks": self.ticks,
                "returns": self.returns,
            },
            "rejects": rejects,
            "times_s": { "elapsed": self.elapsed },
            "warnings": self.warnings,
            "folder": (!self.folder.is_empty()).then_some(&self.folder),
            "files": self.files,
            "explained": explained,
        })
    }
}
