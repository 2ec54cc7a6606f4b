//! The points on the car that the README and docs/paper.md quote are those that `paper` finds.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use macropulse::design::Design;
use macropulse::scene::Scene;
use macropulse::sim;
use macropulse_study::paper::{DISTANCES, SENSORS};

/// Seed 1, as `paper` has it.
#[test]
fn quoted_points_are_those_found() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let [readme, paper] = ["README.md", "docs/paper.md"]
        .map(|page| std::fs::read_to_string(root.join(page)).unwrap());
    for sensor in SENSORS {
        let design = Design::open(sensor, &[]).unwrap();
        let counts = DISTANCES.map(|distance| {
            let scene = Scene::open(&format!("car-{distance}m")).unwrap();
            let score = sim::scan(&design, &scene, 1, 0).unwrap().score;
            (score.points_on_target, score.samples_on_target)
        });
        let is_quoted = |page: &str, cell: &dyn Fn(&(u64, u64)) -> String| {
            let cells: Vec<String> = counts.iter().map(cell).collect();
            let row = cells.join(" | ");
            page.lines().any(|line| line.contains(sensor) && line.contains(&row))
        };
        let in_readme = is_quoted(&readme, &|(points, samples)| format!("{points} ({samples})"));
        let in_paper = is_quoted(&paper, &|(points, samples)| format!("{samples} → {points}"));
        assert!(in_readme && in_paper, "{sensor}: {counts:?}");
    }
}
