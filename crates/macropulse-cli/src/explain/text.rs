//! Why a shot was decided as it was, in words.

use macropulse::units::range_from_tof;

use super::{Explained, Told};
use crate::text::{Columns, counted, grouped, short};

impl Explained<'_> {
    /// What the receiver decided, in a word.
    pub(super) fn decided(&self) -> &'static str {
        let verdict = self.told.verdict();
        match (verdict.returns.is_empty(), verdict.rejects.first()) {
            (false, _) => "accepted",
            (true, Some((kind, _))) => kind.name(),
            (true, None) => "not_found",
        }
    }

    /// Why, in sentences.
    pub(super) fn why(&self) -> String {
        let verdict = self.told.verdict();
        let told = match &self.told {
            Told::Ticks(told) => told,
            Told::Samples(told) => return self.why_of_samples(told),
        };
        let mut said: Vec<String> = Vec::new();
        for one in &verdict.returns {
            said.push(format!(
                "A return was accepted at {} m: {} of {} marks were found, {} more than at the best \
                 other lag that the receiver looked at.",
                short(range_from_tof(one.tof)),
                one.peak,
                one.marks,
                one.margin
            ));
        }
        said.extend(verdict.rejects.iter().map(|(kind, _)| self.refused(told, *kind)));
        if said.is_empty() {
            said.push(
                "The receiver goes from tick to tick, and no macropulse that it opened led to this \
                 shot."
                    .to_owned(),
            );
        }
        said.join(" ")
    }

    /// All of it for people.
    pub fn text(&self) -> String {
        let (marks, gate) = (self.told.marks(), self.told.gate());
        let mut columns = Columns::default();
        columns.push("decided", self.decided().replace('_', " "));
        columns.push("why", self.why());
        columns.push(
            "sent",
            format!(
                "label {}, word {}: {} at {} fs",
                self.label,
                self.word,
                counted(marks.len() as u64, "mark"),
                grouped(self.fired_fs.unsigned_abs())
            ),
        );
        columns.push(
            "gate",
            format!(
                "{} to {} m, {} lags",
                short(self.range(gate.start)),
                short(self.range(gate.end - 1)),
                grouped((gate.end - gate.start) as u64)
            ),
        );
        columns.push("light", self.light_text());
        match &self.told {
            Told::Ticks(told) => self.push_ticks(told, &mut columns),
            Told::Samples(told) => self.push_samples(told, &mut columns),
        }
        let (row, column) = self.pixel;
        format!("row {row}, column {column}, shot {}\n\n{}", self.id, columns.text())
    }
}
