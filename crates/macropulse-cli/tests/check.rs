//! Numbers derived from the paper's sensor, and the lists.

#![allow(missing_docs)]

use crate::common;

use common::Desk;

#[test]
fn the_numbers_of_the_paper() {
    let report = Desk::new().json("check kim-park-2016 --json");
    let close = |key: &str, wanted: f64, tolerance: f64| {
        let found = report[key].as_f64().unwrap_or(f64::NAN);
        assert!((found - wanted).abs() <= tolerance, "{key}: {found}, not {wanted}");
    };
    close("pixel_period_ns", 1e9 / (60.0 * 848.0 * 480.0), 1e-9);
    close("shots_in_flight", 24.44, 0.005);
    close("macropulse_ns", 27.3325, 1e-9);
    close("range_gate_ns", 1000.69, 0.01);
    close("unambiguous_range_m", 178.0, 0.1);
    close("marks_mean", 179.75, 0.01);
    close("mean_overlap", 0.6675, 1e-4);
    close("tick_mm", 0.374_74, 1e-5);
    assert_eq!(report["macropulse_chips"], 10_933);
    assert_eq!((&report["marks_min"], &report["marks_max"]), (&58.into(), &319.into()));
    assert_eq!(report["assumptions"]["footprint"], "the beam is a line without width");
    assert_eq!(report["defaults"]["scan.min_range_m"], 0.5);
}

#[test]
fn what_is_changed_counts() {
    let report = Desk::new().json("check hdl-64e --set scan.max_range_m=60 --json");
    assert_eq!(report["max_range_m"], 60.0);
    assert_eq!(report["unambiguous_range_m"], serde_json::Value::Null);
}

#[test]
fn every_ready_sensor_and_scene_is_right() {
    let desk = Desk::new();
    for list in ["sensors", "scenes"] {
        for entry in desk.json(&format!("{list} --json"))[list].as_array().unwrap() {
            let name = entry["name"].as_str().unwrap();
            assert_ne!(entry["summary"], "", "{name}");
            assert_eq!(desk.run(&format!("check {name}")).code, Some(0), "{name}");
            // A file printed to start from is right too, wherever it is put.
            let ran = desk.run(&format!("{list} {name}"));
            desk.put("mine.toml", &ran.out);
            assert_eq!(desk.run("check mine.toml").code, Some(0), "{name}");
        }
    }
}

#[test]
fn all_files_are_checked_though_one_is_wrong() {
    let desk = Desk::new();
    desk.put("a.toml", "version = 1\n[[object]]\nnmae = \"a\"\n").put("b.toml", "rows = 3\n");
    let ran = desk.run("check a.toml peregrine b.toml wall");
    assert_eq!(ran.code, Some(2));
    let told: Vec<&str> = ran.err.lines().collect();
    assert_eq!(told.len(), 2, "{}", ran.err);
    assert!(told[0].contains("a.toml:3:1:") && told[0].contains("name"), "{}", told[0]);
    assert!(told[1].contains("b.toml: is neither a sensor"), "{}", told[1]);
    assert!(ran.out.contains("peregrine: a sensor") && ran.out.contains("wall: a scene"));
}

#[test]
fn there_are_completions_for_the_usual_shells() {
    for shell in ["bash", "zsh", "fish"] {
        let ran = Desk::new().run(&format!("completions {shell}"));
        assert_eq!(ran.code, Some(0));
        assert!(ran.out.contains("macropulse"), "{shell}");
    }
}

#[test]
fn the_other_lidars_of_a_scene_are_listed_and_their_ghosts_counted() {
    let desk = Desk::new();
    let others = "[[interferers]]\nsensor = \"hdl-64e\"\nposition_m = [3, 1, 2]\nphase_ns = 1234.5\n\
                  [[interferers]]\nsensor = \"mine.toml\"\nname = \"van\"\ndrift_ppm = -20\n";
    desk.put("mine.toml", "version = 1\nname = \"mine\"\nextends = \"peregrine\"\n");
    desk.put("a.toml", &format!("version = 1\nground = {{ material = \"white\" }}\n{others}"));
    let text = desk.run("check a.toml").out;
    let plain = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for words in [
        "hdl-64e 1: hdl-64e, at x 3, y 1, z 2 m",
        "reads 0 at 1234.5 ns of ours, 0 ppm fast",
        "van: mine,",
        "-20 ppm fast",
        "van: no phase_ns given",
        "through the same aperture and optics",
    ] {
        assert!(plain.contains(words), "no {words:?} in {text}");
    }
    assert_eq!(desk.json("check a.toml --json")["interferers"][0]["phase_ns"], 1234.5);
    let run = "simulate --sensor peregrine --scene a.toml --format none";
    assert!(desk.run(run).out.contains("2 other lidars, "));
    let counted = desk.json(&format!("{run} --json"));
    assert!(
        counted["counts"]["ghosts"].is_u64() && counted["counts"]["interferer_shots"].is_u64(),
        "{counted}"
    );
    let alone = desk.json("simulate --sensor peregrine --scene wall --format none --json");
    assert_eq!(alone["counts"]["ghosts"], serde_json::Value::Null);
}

#[test]
fn a_wrong_other_lidar_is_told_with_its_place() {
    let desk = Desk::new();
    desk.put("a.toml", "version = 1\n[[interferers]]\nsensor = \"hdl64e\"\n");
    desk.refused("check a.toml", &["a.toml:3:10:", "did you mean `hdl-64e`?"]);
    desk.put("a.toml", "version = 1\n[[interferers]]\nsensor = \"hdl-64e\"\ndrift_ppm = nan\n");
    desk.refused("simulate --sensor peregrine --scene a.toml -o out", &["a.toml:4:13:", "-1000"]);
}
