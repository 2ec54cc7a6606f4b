//! Link budgets from the command line.

#![allow(missing_docs, clippy::unwrap_used)]

use crate::common;

use common::Desk;

fn json(line: &str) -> serde_json::Value {
    let ran = Desk::new().run(line);
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
    serde_json::from_str(&ran.out).unwrap()
}

fn assert_about(value: &serde_json::Value, key: &str, expected: f64, tolerance: f64) {
    let found = value[key].as_f64().unwrap();
    assert!((found / expected - 1.0).abs() < tolerance, "{key}: {found}, expected {expected}");
}

#[test]
fn the_paper_with_honest_light_has_the_numbers_of_its_budget() {
    let budget = json("budget kim-park-2016-physical --json");
    assert_about(&budget, "energy_per_macropulse_nj", 0.823, 0.005);
    assert_about(&budget, "photons_per_macropulse", 17.76, 0.005);
    assert_about(&budget, "photons_per_micropulse", 0.0988, 0.01);
    assert_about(&budget, "background_photons_per_chip", 969.0, 0.002);
    assert_about(&budget, "single_pulse_ael_nj", 197.9, 0.001);
    assert_about(&budget, "cw_ael_mw", 1.0, 0.003);
    assert_about(&budget, "mark_by_mark_shortfall", 99.1, 0.01);
    assert_eq!(budget["closes"], false);
    assert_eq!(budget["first_failure"]["what"], "sunlight");
    assert_eq!(budget["range_m"], 150.0);
}

/// The probability of a return is that nothing comes before the echo: exp(−10/s · 2·119.1 m/c) of hdl-64e,
/// whose gate opens at 0.9 m.
#[test]
fn a_sensor_that_never_misses_has_a_budget_that_closes() {
    let never = "--set detector.single-stop.sensitivity.pd=1";
    let budget = json(&format!("budget hdl-64e {never} --environment vacuum-dark --json"));
    let first = (-10.0 * 2.0 * 119.1 / 299_792_458.0_f64).exp();
    assert!((budget["pd"].as_f64().unwrap() - first).abs() < 1e-9, "{}", budget["pd"]);
    assert_eq!((&budget["closes"], budget["converter_loss"].is_f64()), (&true.into(), true));
    // Infinite numbers are null.
    assert!(budget["snr"].is_null() && budget["detected_per_micropulse"].is_null());
    for name in ["peregrine", "rosette-mid-40"] {
        let text = Desk::new().run(&format!("budget {name} {never}")).out;
        assert!(!text.contains("NaN") && !text.contains("inf "), "{text}");
    }
}

#[test]
fn at_night_and_square_on_nothing_but_the_slant_fails() {
    let budget = json("budget kim-park-2016-physical --environment night --range 130 --json");
    assert_eq!(budget["first_failure"]["what"], "slant");
    assert!(budget["pd"].as_f64().unwrap() > 0.9);
}

#[test]
fn a_sensor_declared_by_its_sensitivity_has_no_energy_to_tell() {
    let budget = json("budget kim-park-2016 --environment vacuum-dark --json");
    assert!(budget["energy_per_macropulse_nj"].is_null());
    assert_about(&budget, "detected_per_micropulse", 4.605, 0.001);
    assert_eq!(budget["closes"], true);
    assert_eq!(budget["idealised"].as_array().unwrap().len(), 8);
}

#[test]
fn the_curves_are_one_page() {
    let desk = Desk::new();
    let ran = desk.run("budget hdl-64e -o out");
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
    assert_eq!(desk.files(), ["out", "out/budget.html"]);
    assert!(ran.out.contains("closes") && ran.out.contains("out/budget.html"), "{}", ran.out);
    let page = std::fs::read_to_string(desk.path().join("out/budget.html")).unwrap();
    assert_eq!(page.matches("<figure>").count(), 5);
}

#[test]
fn what_cannot_be_is_refused_with_a_reason() {
    let cases = [
        ("budget kim-park-2016-physical --range 0", "between 0.000001 and 1000000"),
        ("budget kim-park-2016-physical --pd 1.5", "between 0 and 1"),
        ("budget kim-park-2016-fysical", "did you mean `kim-park-2016-physical`"),
        (
            "budget kim-park-2016-physical --set light.energy={shot_nj=5.0}",
            "class 1 allows 0.8232 nJ (the shots that count as one)",
        ),
        ("budget kim-park-2016-physical --set light.wavelength_nm=1310", "no limit of class 1"),
        ("budget kim-park-2016-physical --set optics.aperture_mm=nan", "optics.aperture_mm"),
        (
            "budget kim-park-2016 --set idealised=['link-budget','footprint','inter-chip','mirror-motion']",
            "eye safety limits an energy",
        ),
        (
            "budget peregrine --set idealised=['detector-bandwidth','footprint','inter-chip','mirror-motion']",
            "needs [optics]",
        ),
    ];
    for (line, reason) in cases {
        let ran = Desk::new().run(line);
        assert_eq!(ran.code, Some(2), "{line}");
        assert!(ran.err.contains(reason), "{line}: {}", ran.err);
    }
}

/// Sensors written from the reference alone: energy, photons and Pd against range.
#[test]
fn every_pattern_and_detector_has_a_budget() {
    for name in ["spinning-32", "flash-cells", "flash-linear", "flash-coded"] {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/examples/sensors");
        let at = |range: f64| json(&format!("budget {folder}/{name}.toml --range {range} --json"));
        let [near, far] = [at(15.0), at(150.0)];
        for budget in [&near, &far] {
            assert!(budget["energy_per_macropulse_nj"].as_f64().unwrap() > 1.0, "{name}");
        }
        let of = |budget: &serde_json::Value, key: &str| budget[key].as_f64().unwrap();
        let ratio = of(&near, "photons_per_macropulse") / of(&far, "photons_per_macropulse");
        // As the square of the range, with the air, and a head that has turned on.
        assert!((100.0..105.0).contains(&ratio), "{name}: {ratio}");
        assert!(of(&near, "pd") > 0.9 && of(&far, "pd") <= of(&near, "pd"), "{name}");
    }
}

#[test]
fn all_that_is_wrong_with_a_sensor_is_told_line_by_line() {
    let desk = Desk::new();
    let text = "version = 1\nname = \"mine\"\nextends = \"peregrine\"\n[light]\npulse_ps = 0.0\n\
                [tdc]\nconverters = 7\n";
    desk.put("mine.toml", text);
    let ran = desk.run("check mine.toml");
    assert_eq!(ran.code, Some(2));
    let lines: Vec<&str> = ran.err.lines().collect();
    assert_eq!(lines.len(), 2, "{}", ran.err);
    assert!(lines[0].starts_with("macropulse: mine.toml:7:1: tdc.converters: is 7, but the bank"));
    assert!(lines[1].starts_with("macropulse: mine.toml:5:1: light.pulse_ps: is 0"));
}
