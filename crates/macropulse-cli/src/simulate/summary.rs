//! Printed report of a run.

use std::path::Path;

use macropulse::channel::idealised;
use macropulse::codec::RecordKind;
use macropulse::codec::decode::Reject;
use macropulse::points::Outcome;
use macropulse_study::record::PAGE;
use serde_json::Value;

use super::run::Run;
use crate::text::{Columns, NO_BREAK, counted, grouped, lasted, short};

/// Returns the number of files written to a folder, and the page to open there.
pub fn written(files: &[String], folder: &str) -> String {
    let count = counted(files.len() as u64, "file");
    let page = Path::new(folder).join(PAGE);
    match files.iter().any(|file| file == PAGE) {
        true => format!("{count} and manifest.json to {folder}; open {}", page.display()),
        false => format!("{count} and manifest.json to {folder}"),
    }
}

impl Run<'_> {
    /// A report for people.
    pub fn text(&self, verbose: bool) -> String {
        let (tally, score, design) = (&self.tally, &self.score, self.design);
        let mut columns = Columns::default();
        columns.push("shots", grouped(tally.shots));
        columns.push("light", self.light());
        if !self.scene.interferers.is_empty() {
            columns.push("interferers", self.interferers());
        }
        columns.push("returns", self.returns());
        columns.push("pixels", self.outcomes());
        if score.with_echo() > 0 {
            // Rounded down: 100 % is said only of all.
            let percent = (1e4 * score.right_fraction()).floor() / 100.0;
            let within = short(design.right_within * 1e3);
            let echoes = grouped(score.with_echo());
            columns.push(
                "right",
                format!("{percent:.2} % of {echoes} pixels with an echo, to within {within} mm"),
            );
        }
        if score.samples_on_target > 0 {
            let (points, samples) = (score.points_on_target, score.samples_on_target);
            columns
                .push("on target", format!("{} of {}", counted(points, "point"), grouped(samples)));
        }
        columns.push("rejects", self.rejects());
        if design.bank().is_some() {
            columns.push("converters", self.converters());
        }
        let stages = self.stages().map(|(stage, s)| format!("{stage}{NO_BREAK}{}", lasted(s)));
        columns.push("time", format!("{}; summed over threads", listed(stages)));
        let environment = &self.scene.environment;
        let conditions = environment.conditions();
        columns.push("environment", format!("{}: {conditions}", environment.name));
        let idealised = idealised(design, environment).into_iter();
        columns.push("idealised", listed(idealised.map(|effect| effect.name.to_owned())));
        if verbose {
            columns.push_list("assumed", self.scene.notes.iter().cloned());
            let defaults = design.defaults.iter().map(|(key, value)| format!("{key} = {value}"));
            columns.push_list("defaults", defaults);
        }
        columns.push_list("warnings", self.warnings.iter().cloned());
        if !self.folder.is_empty() {
            columns.push("written", self.written());
        }
        let mut text = format!("{}\n\n{}", self.headline(), columns.text());
        for (explained, _) in &self.explained {
            text.push('\n');
            text.push_str(explained);
        }
        text
    }

    fn headline(&self) -> String {
        format!(
            "{} in {}: {}, seed {}, {:.2} s (speed {})",
            self.design.name,
            self.scene.name,
            if self.scans == 1 { "1 scan".to_owned() } else { format!("{} scans", self.scans) },
            self.seed,
            self.elapsed,
            short((self.speed() * 1e4).round() / 1e4),
        )
    }

    fn light(&self) -> String {
        let tally = &self.tally;
        let record = self.design.records();
        let recorded = counted(tally.recorded, record.counted());
        let recorded = match record {
            RecordKind::Ticks => format!("{}, {recorded}", counted(tally.detections, "detection")),
            _ => recorded,
        };
        let surfaces = counted(tally.surfaces, "surface");
        format!("{surfaces} met, {}, {recorded}", counted(tally.echoes, "echo"))
    }

    fn interferers(&self) -> String {
        let lidars = counted(self.scene.interferers.len() as u64, "other lidar");
        let shots = counted(self.tally.interferer_shots, "shot");
        let ghosts = counted(self.score.ghosts, "ghost");
        format!("{lidars}, {shots} of theirs seen, {ghosts}")
    }

    fn returns(&self) -> String {
        let tally = &self.tally;
        let all = grouped(tally.returns);
        if self.design.receiver.returns == 1 {
            return all;
        }
        let numbers = (1..).zip(tally.by_number).filter(|(_, count)| *count > 0);
        let numbers = numbers.map(|(number, count)| format!("{} no. {number}", grouped(count)));
        let further = &self.score;
        let met = Outcome::ALL.into_iter().filter(|outcome| further.count_further(*outcome) > 0);
        let met = met.map(|o| format!("{} {}", grouped(further.count_further(o)), o.name()));
        format!("{all}: {}; of the further ones {}", listed(numbers), listed(met))
    }

    fn outcomes(&self) -> String {
        let count = |outcome| (self.score.count(outcome), outcome);
        let met = Outcome::ALL.map(count).into_iter().filter(|(count, _)| *count > 0);
        listed(met.map(|(count, outcome)| format!("{} {}", grouped(count), outcome.name())))
    }

    fn rejects(&self) -> String {
        let kinds = Reject::ALL.into_iter().zip(self.tally.rejects);
        let met = kinds.filter(|(_, count)| *count > 0);
        let words = |kind: Reject| kind.name().replace('_', " ");
        listed(met.map(|(kind, count)| format!("{} {}", grouped(count), words(kind))))
    }

    fn converters(&self) -> String {
        let per_channel = self.design.bank().map_or(0, |bank| bank.converters);
        let of = if self.design.channels() == 1 { "" } else { " per detector" };
        format!(
            "at most {} of {}{of} busy; {} lost, {} merged",
            self.tally.peak_busy,
            grouped(u64::from(per_channel)),
            counted(self.tally.lost, "detection"),
            grouped(self.tally.merged),
        )
    }

    fn written(&self) -> String {
        written(&self.files, &self.folder)
    }

    /// The same for programs: the manifest, and what depends on this machine.
    pub fn json(&self) -> Value {
        let mut json = self.manifest().value();
        json["speed"] = self.speed().into();
        json["folder"] = (!self.folder.is_empty()).then_some(self.folder.as_str()).into();
        if !self.explained.is_empty() {
            json["explained"] = self.explained.iter().map(|(_, json)| json.clone()).collect();
        }
        json
    }
}

fn listed(parts: impl Iterator<Item = String>) -> String {
    let parts: Vec<String> = parts.collect();
    if parts.is_empty() { "none".to_owned() } else { parts.join(", ") }
}
