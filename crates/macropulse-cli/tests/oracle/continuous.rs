//! Ranges of modulated light and of chirps: `macropulse simulate` beside an oracle that tries every time of flight
//! and every pair of peaks.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::common::Desk;
use super::{ask, points};

/// A wall at `scale` times 3.45 m, and before it a slanted post that approaches at 11 m/s.
fn scene(scale: f64) -> String {
    format!(
        "version = 1\nenvironment = \"night\"\n[[material]]\nname = \"paint\"\ndiffuse = 0.6\n\
         [[object]]\nname = \"wall\"\nshape.box.size_m = [0.1, 900.0, 300.0]\n\
         position_m = [{:?}, 0.0, 0.0]\nmaterial = \"paint\"\n\
         [[object]]\nname = \"post\"\nshape.box.size_m = [0.3, {:?}, {:?}]\n\
         position_m = [{:?}, 0.3, 0.0]\nroll_deg = 17.0\nvelocity_m_s = [-11.0, 0.0, 0.0]\n\
         material = \"paint\"\n",
        3.45 * scale + 0.05,
        0.5 * scale,
        6.0 * scale,
        2.4 * scale
    )
}

/// Row and column of a shot, from its number and the number of columns.
fn pixel(shot: &Value, columns: u64) -> (u64, u64) {
    let shot = shot["shot"].as_u64().unwrap();
    (shot / columns, shot % columns)
}

/// N = 1200 pixels with sine waves, 1200 with square waves, seed 31. The program frees the phases of a square wave from
/// harmonics up to the 63rd, the oracle from all: their ranges may differ by 0.1 mm. Control: an oracle that takes the
/// waves for sines is off by more than 2 mm.
#[test]
fn phases_become_the_range_that_fits_best() {
    let desk = Desk::new();
    desk.put("post.toml", &scene(1.0));
    let codes_above_dark = 4095.0 - 256.0;
    for (wave, tolerance) in [("sine", 1e-6), ("square", 1e-4)] {
        let folder = format!("out-{wave}");
        desk.json(&format!(
            "simulate itof-camera post.toml --set modulation.wave={wave} --set scan.flash.rows=30 \
             --set scan.flash.columns=40 --seed 31 --format csv,taps -o {folder} --json"
        ));
        let points = points(&desk, &format!("{folder}/scan-000000.csv"), ["range_m"]);
        let worst = |as_wave: &str| {
            let given = json!({
                "file": format!("{folder}/taps-000000.mpa"), "frequencies_hz": [120e6, 90e6], "taps": 4,
                "gate_m": [0.3, 4.9], "electrons_per_code": 100_000.0 / codes_above_dark,
                "dark_code": 256, "read_noise_e": 30.0, "wave": as_wave,
            });
            let found = ask(&desk, "phase-ranges", &given);
            let off = |shot: &Value| {
                let [range] = points.get(&pixel(shot, 40))?;
                Some((shot["range_m"].as_f64()? - range).abs())
            };
            let off: Vec<f64> = found.as_array().unwrap().iter().filter_map(off).collect();
            assert_eq!(off.len(), 1200);
            off.into_iter().fold(0.0, f64::max)
        };
        let off = worst(wave);
        assert!(off < tolerance, "{wave}: {off} m");
        if wave == "square" {
            assert!(worst("sine") > 2e-3);
        }
    }
}

/// N = 1920 shots, seed 32: the same shots have a return, with the same range and radial velocity. Control: with a
/// chirp of a thousandth more, ranges differ.
#[test]
fn beats_become_the_strongest_pair() {
    let desk = Desk::new();
    desk.put("post.toml", &scene(14.0));
    desk.json(
        "simulate fmcw-1550 post.toml --set scan.raster.rows=8 --set scan.raster.columns=240 \
         --set receiver.returns=1 --seed 32 --format csv,beats -o out --json",
    );
    let names = ["range_m", "radial_velocity_m_s"];
    let points = points(&desk, "out/scan-000000.csv", names);
    let asked = |bandwidth_hz: f64| {
        let given = json!({
            "file": "out/beats-000000.mpb", "places": 8, "bandwidth_hz": bandwidth_hz, "seconds": 5e-6,
            "wavelength_m": 1550e-9, "gate_m": [1.0, 200.0], "max_speed_m_s": 60.0,
            "least_share": 0.003, "false_alarm": 1e-4,
        });
        let answer = ask(&desk, "beats", &given);
        let threshold = answer["threshold"].as_f64().unwrap();
        let number = |shot: &Value, name: &str| shot[name].as_f64().unwrap();
        let is_return = |shot: &&Value| number(shot, "power") >= threshold;
        let measured = |shot: &Value| {
            let [range, velocity] = ["range_m", "radial_velocity"].map(|name| number(shot, name));
            (pixel(shot, 240), [range, velocity])
        };
        let found = answer["found"].as_array().unwrap();
        found.iter().filter(is_return).map(measured).collect::<BTreeMap<_, _>>()
    };
    let worst = |found: &BTreeMap<(u64, u64), [f64; 2]>, place: usize| {
        points
            .iter()
            .map(|(shot, point)| (found[shot][place] - point[place]).abs())
            .fold(0.0, f64::max)
    };
    let found = asked(0.64e9);
    assert!(points.len() > 500 && points.keys().eq(found.keys()), "{}", points.len());
    assert!(worst(&found, 0) < 1e-5 && worst(&found, 1) < 1e-5);
    let moving = points.values().filter(|[_, velocity]| *velocity > 9.0).count();
    assert!(moving > 20, "{moving}");
    assert!(worst(&asked(0.64064e9), 0) > 1e-3);
}
