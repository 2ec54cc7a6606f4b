//! Printed report of a run that decodes.

use macropulse::codec::decode::Reject;
use serde_json::Value;

use super::run::Run;
use crate::simulate::summary::written;
use crate::text::{Columns, counted, grouped};

impl Run<'_> {
    /// A report for people.
    pub fn text(&self) -> String {
        let environment = self.setting.environment;
        let mut columns = Columns::default();
        columns.push("shots", grouped(self.shots));
        let recorded = self.setting.design.records().name();
        columns.push(recorded, grouped(self.recorded));
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
            columns.push("written", written(&self.files, &self.folder));
        }
        let (name, scans) = (&self.setting.design.name, counted(self.scans, "scan"));
        let mut text = format!("{name}: {scans} decoded, {:.2} s\n\n", self.elapsed);
        text.push_str(&columns.text());
        for (explained, _) in &self.explained {
            text.push('\n');
            text.push_str(explained);
        }
        text
    }

    /// The same for programs: the manifest, and what is printed alone.
    pub fn json(&self) -> Value {
        let mut json = self.manifest();
        json["folder"] = (!self.folder.is_empty()).then_some(self.folder.as_str()).into();
        json["explained"] = self.explained.iter().map(|(_, json)| json.clone()).collect();
        json
    }
}
