//! Every combination of pattern, detector, code and link budget is what the table of
//! `docs/formats.md` says: it measures, or is refused with the sentence given there.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;
use std::sync::OnceLock;

use macropulse::design::{Design, Detector};
use macropulse::emit::short_bands;
use macropulse::environment::Environment;
use macropulse::predict::Forecaster;
use macropulse::scene::Scene;
use macropulse::sim;

const FORMATS: &str = include_str!("../../../docs/formats.md");

const PATTERNS: [&str; 6] = ["raster", "spinning", "flash", "table", "rosette", "lissajous"];

/// A table of directions on a disc, once for all tests: without times, so that their rate is typed.
fn table_file() -> &'static str {
    static FILE: OnceLock<(tempfile::TempDir, String)> = OnceLock::new();
    let (_, path) = FILE.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let line = |entry: i32| {
            let (angle, out) = (f64::from(entry) * 2.4, f64::from(entry) / 8.0);
            format!("{:.4},{:.4}\n", out * angle.cos(), out * angle.sin())
        };
        let lines: String = (0..32).map(line).collect();
        let path = folder.path().join("table.csv");
        std::fs::write(&path, format!("azimuth,elevation\n{lines}")).unwrap();
        let path = path.display().to_string();
        (folder, path)
    });
    path
}

fn pattern(name: &str) -> String {
    let keys = match name {
        "raster" => {
            "scan.raster = { rows = 4, columns = 8, horizontal_deg = 8.0, vertical_deg = 4.0 }"
        }
        "spinning" => {
            "scan.spinning = { azimuth_step_deg = 45.0, blocks = [{ lasers = 4, first_deg = 2.0, \
             step_deg = -1.0 }] }"
        }
        "flash" => {
            "scan.flash = { rows = 4, columns = 8, horizontal_deg = 8.0, vertical_deg = 4.0 }"
        }
        "table" => "scan.table = { file = 'TABLE', firings_per_s = 320.0 }",
        "rosette" => {
            "scan.rosette = { shots_per_s = 320.0, prisms = [{ deflection_deg = 2.0, turns_per_s = \
             7.3 }, { deflection_deg = 2.0, turns_per_s = -4.7 }] }"
        }
        "lissajous" => {
            "scan.lissajous = { shots_per_s = 320.0, horizontal = { field_deg = 8.0, hz = 7.3 }, \
             vertical = { field_deg = 4.0, hz = 4.7 } }"
        }
        other => panic!("no pattern {other}"),
    };
    keys.replace("TABLE", table_file())
}

/// The section of `docs/formats.md` on combinations.
fn section() -> &'static str {
    let section = FORMATS.split("### Combinations").nth(1).unwrap();
    section.split("\n### ").next().unwrap()
}

/// Returns the names in the first column of the table: the detectors of pulses, and what stands behind a
/// photodiode.
fn detectors() -> Vec<&'static str> {
    let others = Detector::NAMES
        .iter()
        .copied()
        .filter(|name| !["photodiode", "lock-in", "coherent"].contains(name));
    others.chain(["comparator", "adc"]).collect()
}

/// The tables of a detector: as `docs/formats.md` shows those of a photodiode, or else how much light it gets.
fn detector(name: &str, light: &str) -> String {
    let title = format!("\n[{name}]\n");
    let mut shown = section().split("```").filter_map(|text| text.strip_prefix("toml\n"));
    if let Some(shown) = shown.find(|text| text.contains(&title)) {
        return shown.to_owned();
    }
    let own = match light {
        "budget" => "efficiency = 0.1\n",
        _ => "sensitivity = { range_m = 20.0, reflectance = 0.1, pd = 0.999 }\n",
    };
    format!("[detector.{name}]\n{own}")
}

/// The sensor file of a combination, which declares what it is told to.
fn file(scanned: &str, seen: &str, shots: &str, light: &str) -> String {
    let mut idealised = vec!["footprint", "eye-safety", "mirror-motion"];
    if light == "declared" {
        idealised.push("link-budget");
    }
    let written = |idealised: &[&str]| written(scanned, seen, shots, light, idealised);
    for effect in ["inter-chip", "detector-bandwidth"] {
        let opened = Design::from_toml(&written(&idealised), "mine.toml", Path::new(""), &[]);
        let wanted = format!("add `{effect}` to this list");
        if opened.is_err_and(|told| told.to_string().contains(&wanted)) {
            idealised.push(effect);
        }
    }
    written(&idealised)
}

/// The sensor file of a combination that declares what is `idealised`.
fn written(scanned: &str, seen: &str, shots: &str, light: &str, idealised: &[&str]) -> String {
    let optics = match light {
        "budget" => {
            "[optics]\naperture_mm = 3.0\ntransmission = 0.7\nfilter_nm = 1.0\n\
             field = { cone_mrad = 1.0 }\n"
        }
        _ => "",
    };
    let code = match shots {
        "coded" => {
            "[code]\nfamily = { prime = 7 }\nchip_ps = 2000.0\nlabel = \"none\"\n\
             word = { first = 0, modulus = 7 }\n"
        }
        _ => "",
    };
    let receiver = match shots {
        _ if seen == "adc" => "kind = \"sampled\"\nfalse_alarm = 1e-3\nblank_ns = 0.5\n",
        "coded" => "kind = \"matched\"\nfalse_alarm = 1e-3\n",
        _ => "kind = \"direct\"\n",
    };
    let tdc = match seen {
        "adc" => "",
        _ => "[tdc]\nconverters = 64\nresolution_ps = 100.0\n",
    };
    let energy = if light == "budget" { "energy = { shot_nj = 100.0 }\n" } else { "" };
    format!(
        "version = 1\nname = \"mine\"\nidealised = {idealised:?}\nscan.scans_per_s = 10.0\n\
         scan.max_range_m = 30.0\n{}\n[light]\nwavelength_nm = 1550.0\npulse_ps = 200.0\n{energy}\
         {optics}{code}{}{tdc}[receiver]\n{receiver}",
        pattern(scanned),
        detector(seen, light),
    )
}

/// The rows of the table of combinations: detector, shots, light, and a cell for each pattern.
fn table() -> Vec<Vec<&'static str>> {
    let rows = section().lines().filter(|line| line.starts_with("| `"));
    let cells = |line: &'static str| line.split('|').map(|cell| cell.trim().trim_matches('`'));
    rows.map(|line| cells(line).filter(|cell| !cell.is_empty()).collect()).collect()
}

/// The sentence with this number under the table.
fn sentence(number: &str) -> &'static str {
    let start = format!("{number}. `");
    let line = FORMATS.lines().find_map(|line| line.strip_prefix(start.as_str())).unwrap();
    line.strip_suffix('`').unwrap()
}

#[test]
fn the_table_has_every_combination_once() {
    let rows: Vec<Vec<&str>> = table().iter().map(|row| row[..3].to_vec()).collect();
    assert_eq!(rows.len(), detectors().len() * 2 * 2);
    for seen in detectors() {
        for shots in ["uncoded", "coded"] {
            for light in ["declared", "budget"] {
                assert!(rows.contains(&vec![seen, shots, light]), "{seen}, {shots}, {light}");
            }
        }
    }
}

#[test]
fn every_combination_is_what_the_table_says() {
    let scene = "version = 1\nenvironment = \"clear-day\"\n[[object]]\nshape.sphere.radius_m = 10\n\
                 material = \"white\"\n";
    let scene = Scene::from_toml(scene, "room", Path::new("")).unwrap();
    for row in table() {
        for (scanned, cell) in PATTERNS.iter().zip(&row[3..]) {
            let which = format!("{scanned}, {row:?}");
            let text = file(scanned, row[0], row[1], row[2]);
            let opened = Design::from_toml(&text, "mine.toml", Path::new(""), &[]);
            if let Some(number) = cell.strip_prefix("no ") {
                let told = opened.unwrap_err();
                let told: Vec<String> = told.sentences().collect();
                assert_eq!(told.len(), 1, "{which}: {told:?}");
                let place = told[0].find(": ").unwrap() + 2;
                assert_eq!(told[0][place..].replace('`', ""), sentence(number), "{which}");
                continue;
            }
            assert_eq!(*cell, "yes", "{which}");
            let design = opened.unwrap_or_else(|error| panic!("{which}: {error}"));
            let band: Vec<_> = short_bands(&design, 0).take(1).collect();
            let scan = sim::scan_part(&design, &scene, 1, &band).unwrap();
            let found = scan.score.right_fraction();
            assert!(found > 0.8, "{which}: {found}");
            let day = Environment::named("clear-day").unwrap();
            let forecast = Forecaster::new(&design, &day).unwrap().forecast(1.0, 10.0);
            assert!((0.8..=1.0).contains(&forecast.pd), "{which}: {}", forecast.pd);
        }
    }
}

/// H0: returns of a wall by day come as often as the forecast says, from about half of the pixels. With a
/// code they come at least a third as often. A thorough receiver believes bare short words less often than is
/// forecast if shots are so far apart that each is judged before those behind it. And no pixel is found more
/// often alone, in a flash, than with neighbours that tell where to look. N = 2048 shots, seed 1: a share is
/// known to 0.011, and may be off by three times that. Control: four times the light is farther off.
#[test]
fn the_forecast_holds_for_every_combination() {
    let day = Environment::named("clear-day").unwrap();
    for row in table().into_iter().filter(|row| row[0] != "adc") {
        // The reflectance and the share seen of the first pattern.
        let (mut paint, mut of_raster) = (None, None);
        for (scanned, _) in PATTERNS.iter().zip(&row[3..]).filter(|(_, cell)| **cell == "yes") {
            let which = format!("{scanned}, {row:?}");
            let text = file(scanned, row[0], row[1], row[2])
                .replace("rows = 4, columns = 8", "rows = 32, columns = 64")
                .replace("azimuth_step_deg = 45.0", "azimuth_step_deg = 5.625")
                .replace("_per_s = 320.0", "_per_s = 20480.0")
                .replace("lasers = 4", "lasers = 32")
                .replace("converters = 64", "converters = 2048")
                .replace("kind = \"matched\"", "kind = \"matched\"\neffort = \"thorough\"");
            let design = Design::from_toml(&text, "mine.toml", Path::new(""), &[]).unwrap();
            let forecaster = Forecaster::new(&design, &day).unwrap();
            let forecast = |reflectance: f64| forecaster.forecast(reflectance, 10.0).pd;
            let reflectance = *paint.get_or_insert_with(|| {
                let mut steps = (0..130).map(|step| 0.9_f64.powi(step));
                steps.find(|&step| forecast(step) <= 0.6).unwrap_or(1e-6)
            });
            let found = |reflectance: f64| {
                let scene = format!(
                    "version = 1\nenvironment = \"clear-day\"\n[[material]]\nname = \"paint\"\n\
                     diffuse = {reflectance}\n[[object]]\nshape.sphere.radius_m = 10\n\
                     material = \"paint\"\n"
                );
                let scene = Scene::from_toml(&scene, "room", Path::new("")).unwrap();
                let scan = sim::scan(&design, &scene, 1, 0).unwrap();
                scan.score.right_fraction()
            };
            let (expected, seen) = (forecast(reflectance), found(reflectance));
            match row[1] {
                "uncoded" => {
                    assert!((seen - expected).abs() < 0.035, "{which}: {seen}, not {expected}");
                    assert!((found(4.0 * reflectance) - expected).abs() > 0.1, "{which}: control");
                }
                _ => {
                    let as_raster = *of_raster.get_or_insert(seen);
                    assert!(seen < as_raster + 0.035, "{which}: {seen}, not {as_raster}");
                    let possible = expected / 3.0..expected + 0.035;
                    assert!(possible.contains(&seen), "{which}: {seen}, {expected}");
                    let brighter = found((4.0 * reflectance).min(1.0));
                    assert!(brighter > seen + 0.1, "{which}: control");
                }
            }
        }
    }
}

/// Faults that do not follow from each other are told at once, each with its place.
#[test]
fn all_reasons_are_told_at_once() {
    let text = file("flash", "comparator", "uncoded", "budget")
        .replace("converters = 64", "converters = 4")
        .replace("pulse_ps = 200.0", "pulse_ps = 0.0")
        .replace("rows = 4", "rows = 0");
    let told = Design::from_toml(&text, "mine.toml", Path::new(""), &[]).unwrap_err();
    let expected = [
        "mine.toml:6:16: scan.flash.rows: is 0, but must lie between 1 and 16384",
        "mine.toml:9:1: light.pulse_ps: is 0, but must lie between 0.001 and 1000000000",
    ];
    assert_eq!(told.to_string(), expected.join("\n"));
    let text = text
        .replace("rows = 0", "rows = 4")
        .replace("wavelength_nm = 1550.0", "wavelength_nm = 1.0");
    let text = text.replace("pulse_ps = 0.0", "pulse_ps = 200.0");
    let told = Design::from_toml(&text, "mine.toml", Path::new(""), &[]).unwrap_err();
    let told = told.to_string();
    assert!(told.lines().count() == 2, "{told}");
    assert!(told.contains("divided evenly among 32 detectors: write 32"), "{told}");
    assert!(told.contains("light.wavelength_nm: is 1, but must lie between"), "{told}");
}
