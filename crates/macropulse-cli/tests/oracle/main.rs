//! A second opinion: `tests/oracle` works out in NumPy, from the equations alone, what the program
//! must say, and both are compared.
//!
//! Arithmetic agrees to rounding; what is drawn, to four standard errors; what is decoded from clean
//! light, to a tick, shot by shot.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

#[path = "../common/mod.rs"]
mod common;
mod continuous;
mod ranges;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use common::Desk;
use serde_json::{Value, json};

/// A Python with NumPy.
static PYTHON: LazyLock<std::path::PathBuf> = LazyLock::new(|| {
    let wanted = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/oracle/requirements.txt");
    macropulse_testbed::python(&wanted).unwrap()
});

/// Asks the oracle a question, and returns its answer.
fn ask(desk: &Desk, question: &str, given: &Value) -> Value {
    let oracle = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/oracle");
    let file = desk.path().join(format!("{question}.json"));
    fs::write(&file, given.to_string()).unwrap();
    let said = macropulse_testbed::call(
        Command::new(&*PYTHON)
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .current_dir(desk.path())
            .arg(oracle)
            .arg(question)
            .arg(format!("@{}", file.display())),
    );
    serde_json::from_str(&said.unwrap_or_else(|why| panic!("{question}: {why}"))).unwrap()
}

/// The points of a cloud in text: the requested columns, by row and column.
fn points<const N: usize>(
    desk: &Desk,
    cloud: &str,
    names: [&str; N],
) -> BTreeMap<(u64, u64), [f64; N]> {
    let text = fs::read_to_string(desk.path().join(cloud)).unwrap();
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| head.iter().position(|known| *known == name).unwrap();
    let (row, column, places) = (at("row"), at("column"), names.map(at));
    let point = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let pixel = (cells[row].parse().unwrap(), cells[column].parse().unwrap());
        (pixel, places.map(|place| cells[place].parse().unwrap()))
    };
    lines.map(point).collect()
}

#[track_caller]
fn assert_near(program: f64, oracle: f64, tolerance: f64) {
    let off = (program / oracle - 1.0).abs();
    assert!(off <= tolerance, "the program says {program}, the oracle {oracle}: off by {off:.2e}");
}

/// The script of the documentation reads shots and samples in NumPy, by the documented layout of their bytes.
#[test]
fn samples_are_read_by_what_is_written_of_them() {
    let desk = Desk::new();
    desk.put(
        "mini.toml",
        "version = 1\nname = \"mini\"\nextends = \"coded-32\"\n[scan]\nscans_per_s = 2500.0\n\
         [scan.raster]\nrows = 32\ncolumns = 106\nbeams = 8\nvertical_deg = 1.62\n\
         horizontal_deg = 5.4\nmirror = \"uniform\"\nduty = 1.0\n[light]\nenergy = { shot_nj = 4.0 }\n",
    );
    let _ = desk.json("simulate mini.toml wall --format csv,samples -o out --json");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/examples/samples.py");
    let files = ["shots-000000.mps", "samples-000000.mpw"];
    let said = macropulse_testbed::call(
        Command::new(&*PYTHON)
            .arg(script)
            .args(files.map(|name| desk.path().join("out").join(name))),
    );
    let said: Value = serde_json::from_str(&said.unwrap()).unwrap();
    assert_eq!(said["blocks"], said["blocks_said"]);
    let header_and_blocks = 128 + 16 * said["blocks"].as_u64().unwrap();
    let bytes = fs::metadata(desk.path().join("out").join(files[1])).unwrap().len();
    assert_eq!(header_and_blocks + 2 * said["codes"].as_u64().unwrap(), bytes);
    // All shots at a wall square on are within 0.1 % of the distance; a tick is 6 cm.
    let points = fs::read_to_string(desk.path().join("out/scan-000000.csv")).unwrap();
    let ranges: Vec<f64> = points
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(4).unwrap().parse().unwrap())
        .collect();
    let mean = ranges.iter().sum::<f64>() / ranges.len() as f64;
    let range = said["range_m"].as_f64().unwrap();
    assert!((range - mean).abs() < 0.1, "the script says {range} m, the points {mean} m");
    let photons = said["photons"].as_f64().unwrap();
    assert!(photons > 100.0 && said["shots"].as_u64().unwrap() > 2000, "{said}");
}

mod light {
    use super::*;

    const SENSOR: &str = "kim-park-2016-physical --set light.energy.shot_nj=0.5 \
                          --set optics.aperture_mm=40 --set optics.transmission=0.6";

    #[test]
    fn photons_come_back_as_the_link_equation_has_it() {
        let desk = Desk::new();
        for (wavelength, visibility, range, reflectance) in [
            (905, 23.0, 150.0, 1.0),
            (905, 4.0, 60.0, 0.1),
            (1550, 0.8, 90.0, 0.3),
            (850, 60.0, 30.0, 0.8),
        ] {
            let line = format!(
                "budget {SENSOR} --set light.wavelength_nm={wavelength} \
                 --set environment.visibility_km={visibility} --range {range} \
                 --reflectance {reflectance} --json"
            );
            let told = desk.json(&line);
            let given = json!({
                "energy_j": 0.5e-9, "wavelength_m": f64::from(wavelength) * 1e-9,
                "reflectance": reflectance, "range_m": range, "aperture_m": 0.04,
                "transmission": 0.6, "visibility_km": visibility,
            });
            let photons = told["photons_per_macropulse"].as_f64().unwrap();
            assert_near(photons, ask(&desk, "photons", &given).as_f64().unwrap(), 1e-6);
        }
    }

    /// Irradiance at 905 nm from the standard table, W/m²/nm; the program's has every fifth nanometre.
    const AT_905: f64 = 0.817;

    fn sunlight(desk: &Desk, field_sr: f64) -> f64 {
        let given = json!({
            "irradiance_w_m2_nm": AT_905, "filter_nm": 10.0, "albedo": 0.3, "field_sr": field_sr,
            "aperture_m": 0.04, "transmission": 0.6, "wavelength_m": 905e-9,
        });
        ask(desk, "sunlight", &given).as_f64().unwrap() * 2.5e-12
    }

    fn told(desk: &Desk, field: &str) -> f64 {
        let told = desk.json(&format!("budget {SENSOR} --set optics.field={field} --json"));
        told["background_photons_per_chip"].as_f64().unwrap()
    }

    #[test]
    fn sunlight_falls_into_a_pixel_as_irradiance_has_it() {
        let desk = Desk::new();
        let pixel = (43.2_f64 / 848.0).to_radians() * (24.3_f64 / 480.0).to_radians();
        assert_near(told(&desk, "descanned"), sunlight(&desk, pixel), 2e-3);
    }

    /// The directions of a raster are azimuths and elevations, whose field the oracle adds up. That of
    /// a pyramid as wide and as high in its middle planes, 2.3 % less, would be noticed.
    #[test]
    fn sunlight_falls_into_the_whole_field_as_irradiance_has_it() {
        let desk = Desk::new();
        let size = json!({ "horizontal_deg": 43.2, "vertical_deg": 24.3 });
        let field = ask(&desk, "field", &size).as_f64().unwrap();
        assert_near(told(&desk, "staring"), sunlight(&desk, field), 2e-3);
    }
}

mod counting {
    use super::*;

    /// A field so narrow that every pixel sees the wall square on.
    const NARROW: &str = "--set scan.raster.horizontal_deg=0.2 --set scan.raster.vertical_deg=0.2 \
                          --set scan.raster.rows=8 --environment vacuum-dark --format ticks-csv --json";

    /// Counts the ticks of the file in `folder` in the first `lasts` seconds.
    fn ticks(desk: &Desk, folder: &str, lasts: f64) -> f64 {
        let file = desk.path().join(folder).join("ticks-000000.csv");
        let text = fs::read_to_string(file).unwrap();
        let end = (lasts / 2.5e-12) as i64;
        let ticks = text.lines().skip(2).map(|line| line.parse::<i64>().unwrap());
        ticks.filter(|tick| (0..end).contains(tick)).count() as f64
    }

    /// Marks of a scan of eight rows, by the oracle's payloads.
    fn marks_sent(desk: &Desk) -> f64 {
        let labels: Vec<u32> = (0..848).collect();
        let given = json!({ "labels": labels, "start": 7, "sync": true });
        let payloads = ask(desk, "payloads", &given);
        let bits = |text: &Value| text.as_str().unwrap().matches('1').count();
        8.0 * 29.0 * payloads.as_array().unwrap().iter().map(bits).sum::<usize>() as f64
    }

    /// Shots so far apart that no light of one meets that of another.
    #[test]
    fn marks_are_seen_as_often_as_poisson_has_it() {
        let desk = Desk::new();
        let sent = marks_sent(&desk);
        let detector = "--set detector.photon-counting.sensitivity.pd=0.6 \
                        --set detector.photon-counting.sensitivity.range_m=60 \
                        --set detector.photon-counting.dark_counts_hz=0 \
                        --set detector.photon-counting.jitter_ps=0 \
                        --set detector.photon-counting.missed_marks=0.1";
        for range in [30.0, 60.0, 110.0] {
            let line = format!(
                "simulate kim-park-2016-fixed wall {detector} {NARROW} \
                 --set scene:object.wall.position_m.x={range} -o {range}"
            );
            desk.json(&line);
            let found = ticks(&desk, &range.to_string(), 1.0) / sent;
            let given = json!({
                "pd": 0.6, "reflectance": 1.0, "range_m": range, "at_reflectance": 1.0,
                "at_range_m": 60.0,
            });
            let photons = ask(&desk, "of-sensitivity", &given);
            let seen = |missed: f64| {
                let given = json!({ "photons": photons, "missed": missed });
                ask(&desk, "seen", &given).as_f64().unwrap()
            };
            let expected = seen(0.1);
            let four = 4.0 * (expected * (1.0 - expected) / sent).sqrt();
            assert!((found - expected).abs() < four, "{range} m: {found}, the oracle {expected}");
            // A detector that misses nothing else would be noticed.
            assert!((found - seen(0.0)).abs() > four);
        }
    }

    /// Four cells, half of them blind by their dark counts, and shots of one mark.
    #[test]
    fn cells_see_a_mark_if_one_that_waits_does() {
        let desk = Desk::new();
        desk.put(
            "cells.toml",
            "version = 1\nname = \"cells\"\nextends = \"kim-park-2016\"\n[code]\nlabel = \"none\"\n\
             family = { sparse = { length = 2, weight = 1, words = 2, seed = 1 } }\n\
             word = { first = 0, modulus = 2 }\n[detector.geiger]\ncells = 4\ndead_time_ns = 20\n\
             sensitivity = { range_m = 50.0, reflectance = 1.0, pd = 0.9 }\ndark_counts_hz = 2e8\n",
        );
        let ran = desk.run(&format!("simulate --sensor cells.toml --scene wall {NARROW} -o one"));
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        let numbers = |file: &str| -> Vec<Vec<i64>> {
            let text = fs::read_to_string(desk.path().join(file)).unwrap();
            let number = |number: &str| number.parse().unwrap();
            text.lines().skip(2).map(|line| line.split(',').map(number).collect()).collect()
        };
        let ticks: BTreeSet<i64> =
            numbers("one/ticks-000000.csv").iter().map(|tick| tick[0]).collect();
        let flight = (2.0 * 50.0 / 299_792_458.0 / 2.5e-12) as i64;
        // The mark is on the first or the second chip; a dark count in these ticks comes once in
        // a thousand shots.
        let is_seen = |shot: &&Vec<i64>| {
            let expected = shot[1] / 2500 + flight;
            ticks.range(expected - 1..expected + 4).next().is_some()
        };
        let shots = numbers("one/shots-000000.csv");
        let seen = shots.iter().filter(is_seen).count() as f64 / shots.len() as f64;
        let photons = -0.1_f64.ln();
        let given = json!({ "photons": photons, "rate_hz": 2e8, "cells": 4, "dead_s": 20e-9 });
        let expected = ask(&desk, "seen-by-cells", &given).as_f64().unwrap();
        let four = 4.0 * (expected * (1.0 - expected) / shots.len() as f64).sqrt();
        assert!((seen - expected).abs() < four, "{seen}, the oracle {expected}");
        // Light that is halved instead of cells would be noticed.
        assert!((seen + (-photons / 2.0).exp_m1()).abs() > four);
    }

    /// Two rates of counts: the most that the cells can bear between them, and ten times that.
    #[test]
    fn cells_saturate_as_renewal_has_it() {
        let desk = Desk::new();
        let lasts = 1.0 / 3600.0;
        for (rate, name) in [(1e9, "one"), (1e10, "ten")] {
            let sensor = format!(
                "version = 1\nname = \"cells\"\nextends = \"kim-park-2016\"\n[detector.geiger]\n\
                 sensitivity = {{ range_m = 150.0, reflectance = 1.0, pd = 0.99 }}\n\
                 cells = 20\ndead_time_ns = 20\ndark_counts_hz = {rate:e}\n"
            );
            desk.put("cells.toml", &sensor);
            // A wall so far away that no light of it is followed.
            let line = format!(
                "simulate --sensor cells.toml --set scan.scans_per_s=3600 --scene wall {NARROW} \
                 --set scene:object.wall.position_m.x=5000 -o {name}"
            );
            desk.json(&line);
            let found = ticks(&desk, name, lasts) / lasts;
            let given = json!({ "rate_hz": rate, "cells": 20, "dead_s": 20e-9 });
            let law = ask(&desk, "fired", &given).as_f64().unwrap();
            let mut drawn = given;
            (drawn["lasts_s"], drawn["seed"]) = (json!(1e-4), json!(1));
            let drawn = ask(&desk, "fired-drawn", &drawn).as_f64().unwrap();
            // Cells with a dead time scatter less than Poisson; the tolerance is four deviations of Poisson.
            assert_near(drawn, law, 4.0 / (law * 1e-4).sqrt());
            // Two firings in a tick of 2.5 ps are one, at half the chance that there are any.
            assert_near(found, law * (1.0 - law * 2.5e-12 / 2.0), 4.0 / (law * lasts).sqrt());
        }
    }
}

mod words {
    use super::*;

    fn pixels(row: u32, columns: std::ops::Range<u32>) -> String {
        columns.map(|column| format!(" --pixel {row},{column}")).collect()
    }

    #[test]
    fn every_column_is_sent_as_its_bits_say() {
        let desk = Desk::new();
        for (sensor, how, first, modulus) in [
            ("kim-park-2016", json!({}), 0, 29),
            ("kim-park-2016-fixed", json!({ "start": 7, "sync": true }), 1, 28),
        ] {
            let row = 5;
            let told = desk.json(&format!("encode {sensor} --json{}", pixels(row, 0..848)));
            let shots: Vec<[u32; 2]> =
                (0..848).map(|column| [column, first + (row * 848 + column) % modulus]).collect();
            let with = |key: &str, value: Value| {
                let mut given = how.clone();
                given[key] = value;
                given
            };
            let payloads =
                ask(&desk, "payloads", &with("labels", json!((0..848).collect::<Vec<u32>>())));
            let marks = ask(&desk, "macropulses", &with("shots", json!(shots)));
            let mut other = with("labels", json!((0..848).collect::<Vec<u32>>()));
            other["start"] = json!(3);
            let mistaken = ask(&desk, "payloads", &other);
            for (column, told) in told.as_array().unwrap().iter().enumerate() {
                assert_eq!(told["code_word"], shots[column][1], "{sensor}, column {column}");
                assert_eq!(told["payload"], payloads[column], "{sensor}, column {column}");
                assert_eq!(told["marks"], marks[column], "{sensor}, column {column}");
                // A checksum that starts elsewhere would be noticed in every column.
                assert_ne!(told["payload"], mistaken[column]);
            }
        }
    }

    #[test]
    fn families_correlate_as_fourier_has_it() {
        let desk = Desk::new();
        let told = desk.json("codes prime=29 extended-prime=29 quadratic-congruence=29 --json");
        let names = ["prime", "extended-prime", "quadratic-congruence"];
        for (told, name) in told["families"].as_array().unwrap().iter().zip(names) {
            let counted = ask(&desk, "family", &json!({ "name": name, "p": 29 }));
            for (key, counted) in counted.as_object().unwrap() {
                let (told, counted) = (told[key].as_f64().unwrap(), counted.as_f64().unwrap());
                assert!((told - counted).abs() < 1e-9, "{name}, {key}: {told}, {counted}");
            }
        }
    }

    /// Two m-sequences of degree 7, and all their sums.
    #[test]
    fn gold_words_are_a_gold_family() {
        let desk = Desk::new();
        let told = desk.json(&format!("encode bipolar-gold --json{}", pixels(0, 0..129)));
        let words: Vec<&Value> =
            told.as_array().unwrap().iter().map(|shot| &shot["marks"]).collect();
        let gold = ask(&desk, "gold", &json!({ "words": words }));
        let family = json!({
            "words": 129, "complexity": [7, 7], "sums_of_the_first_two": 127, "distinct": 129,
            "cross_values": [-17, -1, 15],
        });
        assert_eq!(gold, family);
        // One chip that is wrong is noticed.
        let mut broken: Vec<Value> = words.into_iter().cloned().collect();
        broken[40].as_array_mut().unwrap().remove(3);
        let gold = ask(&desk, "gold", &json!({ "words": broken }));
        assert_eq!(gold["sums_of_the_first_two"], 126);
    }
}
