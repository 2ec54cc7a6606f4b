//! The page by which a run is looked at.

use std::path::Path;

use macropulse::design::Design;
use macropulse::formats::{self, Names, write_atomically};
use macropulse::points::PointCloud;
use macropulse::scene::Scene;
use serde_json::Value;

use super::explanation;
use crate::text::grouped;
use crate::view::Explorer;

/// Name of the page that a run leaves.
pub const PAGE: &str = "index.html";

/// Name of the manifest that a run leaves.
pub const MANIFEST: &str = "manifest.json";

/// Most scans in the page of a run: each takes time and room, and few look at more.
const MOST_SCANS: usize = 10;

/// The page of a run in the making: its clouds, scan after scan, and what its manifest tells.
#[derive(Debug, Clone)]
pub struct Page {
    explorer: Explorer,
    scans: usize,
    objects: Vec<String>,
    materials: Vec<String>,
}

impl Page {
    /// The page of a run of a sensor that has no scan yet, in a scene if one is known.
    pub fn new(design: &Design, scene: Option<&Scene>) -> Self {
        let title = titled(&design.name, scene.map(|scene| scene.name.as_str()));
        let names = |of: fn(&Scene) -> Vec<String>| scene.map(of).unwrap_or_default();
        Self {
            explorer: Explorer::new(&title),
            scans: 0,
            objects: names(|scene| scene.objects.iter().map(|one| one.name.clone()).collect()),
            materials: names(|scene| scene.materials.iter().map(|one| one.name.clone()).collect()),
        }
    }

    /// Adds a scan, with the truth if the cloud has it. The page shows the first ten, and says how many it
    /// leaves out.
    pub fn add(&mut self, cloud: &PointCloud) {
        self.scans += 1;
        if self.scans > MOST_SCANS {
            self.explorer.leave_out();
            return;
        }
        let names = Names { objects: &self.objects, materials: &self.materials };
        self.explorer.cloud(&format!("scan {}", cloud.scan), cloud, &names);
    }

    /// Writes the page of a run that is over into its `folder`. It is the same for equal runs, however
    /// long they took.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(mut self, folder: &Path, manifest: &Value) -> Result<(), formats::Error> {
        describe(&mut self.explorer, manifest);
        self.explorer.file(MANIFEST);
        let files = manifest["files"].as_array().into_iter().flatten().filter_map(Value::as_str);
        for file in files.filter(|file| *file != PAGE) {
            self.explorer.file(file);
            explain(&mut self.explorer, &folder.join(file));
        }
        write_atomically(&folder.join(PAGE), |out| out.write_all(self.explorer.html().as_bytes()))
    }
}

/// Title of the page of a run, from its `manifest`; `None` if that names no sensor.
pub fn title(manifest: &Value) -> Option<String> {
    let name = |what: &str| manifest[what]["name"].as_str();
    Some(titled(name("sensor")?, name("scene")))
}

fn titled(sensor: &str, scene: Option<&str>) -> String {
    match scene {
        Some(scene) => format!("{sensor} in {scene}"),
        None => format!("{sensor}, decoded"),
    }
}

/// Adds what was sent and received of a pixel, if the file at `path` explains one.
pub fn explain(page: &mut Explorer, path: &Path) {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if explanation::is_explanation(&name)
        && let Some(section) = explanation::section(path)
    {
        page.section(section);
    }
}

/// Tells on a page what the `manifest` of a run does: what was simulated or decoded, and what was
/// counted.
pub fn describe(page: &mut Explorer, manifest: &Value) {
    let text = |value: &Value| match (value.as_str(), value.as_u64()) {
        (Some(text), _) => text.to_owned(),
        (None, Some(count)) => grouped(count),
        (None, None) => value.to_string(),
    };
    let facts = [
        ("sensor", &manifest["sensor"]["name"]),
        ("scene", &manifest["scene"]["name"]),
        ("environment", &manifest["environment"]["name"]),
        ("conditions", &manifest["environment"]["conditions"]),
        ("seed", &manifest["seed"]),
        ("shots of", &manifest["recorded"]["shots"]),
        ("ticks of", &manifest["recorded"]["ticks"]),
        ("samples of", &manifest["recorded"]["samples"]),
    ];
    for (what, value) in facts.into_iter().filter(|(_, value)| !value.is_null()) {
        page.fact(what, &text(value));
    }
    for warning in manifest["warnings"].as_array().into_iter().flatten() {
        page.fact("warning", &text(warning));
    }
    for (counts, prefix) in [("counts", ""), ("outcomes", "pixels ")] {
        for (what, count) in manifest[counts].as_object().into_iter().flatten() {
            page.fact(&format!("{prefix}{}", what.replace('_', " ")), &text(count));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_page_tells_what_the_manifest_does_but_for_times() {
        let manifest = json!({
            "sensor": { "name": "mine" },
            "environment": { "name": "clear-day", "conditions": "visibility 23 km" },
            "counts": { "shots": 407_040, "interferer_shots": 7 },
            "outcomes": { "missed": 3 },
            "warnings": ["not a single point"],
            "times_s": { "elapsed": 77.5 },
        });
        let mut page = Explorer::new("t");
        describe(&mut page, &manifest);
        let html = page.html().replace(['\u{202f}', '\u{a0}'], " ");
        for (what, value) in [
            ("sensor", "mine"),
            ("conditions", "visibility 23 km"),
            ("shots", "407 040"),
            ("interferer shots", "7"),
            ("pixels missed", "3"),
            ("warning", "not a single point"),
        ] {
            let line = format!("<dt>{what}</dt><dd>{value}</dd>");
            assert!(html.contains(&line), "{line}");
        }
        assert!(!html.contains("<dt>scene</dt>") && !html.contains("77.5"));
        assert_eq!(title(&manifest).as_deref(), Some("mine, decoded"));
        assert_eq!(title(&json!({ "files": [] })), None);
    }
}
