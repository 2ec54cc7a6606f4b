//! Decoding recorded shots and ticks: the points of the simulation again, from files alone.

#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used)]

use crate::common;

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Command, Stdio};

use common::Desk;

/// Simulates with ticks or samples, decodes them, and compares every file of points byte by byte; gives the JSON
/// of both.
fn again(
    desk: &Desk,
    sensor: &str,
    rest: &str,
    scans: usize,
) -> (serde_json::Value, serde_json::Value) {
    let (record, ending) = match sensor {
        _ if sensor.contains(MINI) => ("samples", "mpw"),
        _ if sensor.contains(FLASH) => ("histograms", "mph"),
        _ if sensor.contains(CAMERA) => ("taps", "mpa"),
        _ if sensor.contains("fmcw") => ("beats", "mpb"),
        _ => ("ticks", "mpt"),
    };
    let formats = "--format pcd,csv,png";
    let line = format!("simulate {sensor} {rest} {formats},{record} -o out --json -j 1");
    let simulated = desk.json(&format!("{line} --scans {scans}"));
    assert!(simulated["counts"]["returns"].as_u64().unwrap() > 0, "{line}");
    let environment = simulated["environment"]["name"].as_str().unwrap();
    let mut returns = 0;
    let mut decoded = serde_json::Value::Null;
    for scan in 0..scans {
        let files = format!("out/shots-{scan:06}.mps out/{record}-{scan:06}.{ending}");
        let line = format!("decode {sensor} {files} --environment {environment} {formats} -j 3");
        decoded = desk.json(&format!("{line} -o again --json"));
        returns += decoded["counts"]["returns"].as_u64().unwrap();
        for ending in ["pcd", "csv", "png"] {
            let kind = if ending == "png" { "range" } else { "scan" };
            let name = format!("{kind}-{scan:06}.{ending}");
            let [was, is] = ["out", "again"]
                .map(|folder| fs::read(desk.path().join(folder).join(&name)).unwrap());
            assert!(was == is, "{sensor} {rest}: {name} differs");
        }
    }
    assert_eq!(simulated["counts"]["returns"], returns, "{sensor}");
    assert_eq!(
        simulated["counts"]["shots"].as_u64().unwrap(),
        decoded["counts"]["shots"].as_u64().unwrap() * scans as u64
    );
    (simulated, decoded)
}

const ROWS: &str = "--set scan.raster.rows";

/// A sampled sensor of few shots and no pauses, so that its bands overlap.
const MINI: &str = "mini.toml";

/// A sensor that counts bursts in histograms.
const FLASH: &str = "flash.toml";

/// The text of [`FLASH`].
const FLASH_TEXT: &str = "version = 1\nname = \"flash\"\nidealised = [\"footprint\", \"mirror-motion\", \"eye-safety\"]\n\
    [scan]\nscans_per_s = 10.0\nmax_range_m = 30.0\n\
    [scan.flash]\nrows = 12\ncolumns = 16\nhorizontal_deg = 16.0\nvertical_deg = 12.0\n\
    [light]\nwavelength_nm = 940.0\nbeam_diameter_mm = 3.0\npulse_ps = 1000.0\n\
    energy = { shot_nj = 4000.0 }\n\
    [optics]\naperture_mm = 3.0\ntransmission = 0.7\nfilter_nm = 20.0\nfield = \"descanned\"\n\
    [detector.geiger]\nefficiency = 0.15\ncells = 4\narming = \"once-per-pulse\"\n\
    [burst]\npulses = 2000\ninterval_ns = 250.0\n[histogram]\nbin_ps = 250.0\nbins = 820\n\
    [receiver]\nkind = \"histogram\"\nreturns = 2\nright_within_m = 0.05\n";

#[test]
fn histograms_decode_to_the_points_of_the_simulation() {
    let desk = Desk::new();
    desk.put(FLASH, FLASH_TEXT);
    let (simulated, _) =
        again(&desk, &format!("--sensor {FLASH}"), "--scene street --environment night", 2);
    assert!(simulated["counts"]["counts"].as_u64().unwrap() > 10_000, "{simulated}");
    let shots = "decode --sensor flash.toml out/shots-000000.mps";
    for (bins, words) in
        [("810", "histograms of 820 bins, where those of the sensor have 810"), ("820", "")]
    {
        let line = format!(
            "{shots} --set histogram.bins={bins} out/histograms-000000.mph -o b --format none"
        );
        match words {
            "" => assert_eq!(desk.run(&line).code, Some(0)),
            words => desk.refused(&line, &[words]),
        }
    }
    let line = "simulate flash.toml street --environment night --explain 11,8 --format none -o e";
    let ran = desk.run(line);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let told = fs::read_to_string(desk.path().join("e/explain-000000-11-8.txt")).unwrap();
    assert!(told.contains("A return was accepted at") && told.contains("2 000 pulses"), "{told}");
    desk.refused("simulate flash.toml street --format ticks -o b", &["flash records histograms"]);
}

/// A sensor of modulated light.
const CAMERA: &str = "itof-camera";

#[test]
fn taps_decode_to_the_points_of_the_simulation() {
    let desk = Desk::new();
    let small = "--set scan.flash.rows=12 --set scan.flash.columns=16";
    let (simulated, _) = again(
        &desk,
        &format!("--sensor {CAMERA} {small}"),
        "--scene wall --set scene:object.wall.position_m.x=3 --environment night",
        2,
    );
    assert_eq!(simulated["counts"]["taps"], 2 * 12 * 16 * 8, "{simulated}");
    let line = format!(
        "decode --sensor {CAMERA} {small} --set modulation.phases=3 out/shots-000000.mps \
         out/taps-000000.mpa -o b --format none"
    );
    desk.refused(&line, &["8 taps of a shot, where the sensor has 6"]);
    let line = format!(
        "simulate {CAMERA} {small} wall --set scene:object.wall.position_m.x=3 --environment night \
         --explain 6,8 --format none -o e"
    );
    let ran = desk.run(&line);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let told = fs::read_to_string(desk.path().join("e/explain-000000-6-8.txt")).unwrap();
    let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(told.contains("explains the phases of 2 of 2 modulation frequencies best."), "{told}");
    assert!(told.contains("or more by whole intervals of 1.2491 m; codes "), "{told}");
    desk.refused(
        &format!("simulate {CAMERA} wall --format ticks -o b"),
        &["itof-camera records taps"],
    );
}

/// A sensor of frequency-modulated light: its points have radial velocities, also those of a stream, and its header without
/// any point.
#[test]
fn beats_decode_to_the_points_of_the_simulation() {
    let desk = Desk::new();
    let sensor = "--sensor fmcw-1550 --set scan.raster.rows=8 --set scan.raster.columns=60";
    let wall = "--scene wall --set scene:object.wall.velocity_m_s=[-3,0,0]";
    let (simulated, _) = again(&desk, sensor, wall, 2);
    assert!(simulated["counts"]["peaks"].as_u64().unwrap() > 200, "{simulated}");
    let line = format!(
        "decode {sensor} --set chirp.down_us=0 out/shots-000000.mps out/beats-000000.mpb -o b --format none"
    );
    desk.refused(&line, &["2 ramps of a shot with 8 peaks each, where the sensor has 1 with 8"]);
    let line = format!("simulate {sensor} {wall} --explain 4,30 --format csv -o e");
    let ran = desk.run(&line);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let points = fs::read_to_string(desk.path().join("e/scan-000000.csv")).unwrap();
    assert!(points.lines().next().unwrap().ends_with(",flags,radial_velocity_m_s"));
    let told = fs::read_to_string(desk.path().join("e/explain-000000-4-30.txt")).unwrap();
    let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        told.contains("times the mean power of noise") && told.contains(" m/s: power "),
        "{told}"
    );
    let away = format!("simulate {sensor} {wall} --set scene:sensor.yaw_deg=180 --format csv -o n");
    assert_eq!(desk.run(&away).code, Some(0));
    let nothing = fs::read_to_string(desk.path().join("n/scan-000000.csv")).unwrap();
    assert_eq!(nothing.trim_end(), points.lines().next().unwrap());
    desk.refused(
        &format!("simulate {sensor} {wall} --format taps -o b"),
        &["fmcw-1550 records beats"],
    );
}

/// The line of the pixel that was explained, in a table of points.
fn point_of<'a>(points: &'a str, told: &serde_json::Value) -> Option<&'a str> {
    let pixel = [told["row"].to_string(), told["column"].to_string()];
    points.lines().find(|line| line.split(',').skip(6).take(2).eq(&pixel))
}

fn mini() -> Desk {
    let desk = Desk::new();
    desk.put(
        MINI,
        "version = 1\nname = \"mini\"\nextends = \"coded-32\"\n[scan]\nscans_per_s = 1250.0\n\
         [scan.raster]\nrows = 64\ncolumns = 106\nbeams = 8\nvertical_deg = 3.24\n\
         horizontal_deg = 5.4\nmirror = \"uniform\"\nduty = 1.0\n[light]\nenergy = { shot_nj = 6.0 }\n",
    );
    desk
}

#[test]
fn a_sampled_sensor_finds_the_same_points_in_files() {
    let desk = mini();
    let (simulated, decoded) = again(&desk, "--sensor mini.toml", "--scene street", 2);
    let counts = [&simulated["counts"], &decoded["counts"]];
    assert!(counts.iter().all(|counts| counts["ticks"].is_null()));
    // Those of overlapping bands are counted in both, and stand in the file once.
    let codes = counts[1]["samples"].as_u64().unwrap();
    let bytes = fs::metadata(desk.path().join("out/samples-000001.mpw")).unwrap().len();
    assert!(codes > 16_000_000 && counts[0]["samples"].as_u64().unwrap() > codes, "{simulated}");
    assert!(bytes < 2 * codes && bytes * 21 > 40 * codes, "{bytes} bytes of {codes} codes");
    assert_eq!(decoded["recorded"]["samples"], "out/samples-000001.mpw");
    // Points leave as they are decided.
    let was = fs::read_to_string(desk.path().join("out/scan-000000.csv")).unwrap();
    let line = "decode --sensor mini.toml out/shots-000000.mps - -o - --environment clear-day";
    let samples = fs::File::open(desk.path().join("out/samples-000000.mpw")).unwrap();
    let streamed = desk.command(line).stdin(samples).output().unwrap();
    assert!(streamed.status.success() && String::from_utf8(streamed.stdout).unwrap() == was);
}

#[test]
fn what_is_wrong_with_samples_is_one_sentence_with_its_place() {
    let desk = mini();
    let _ = desk.json("simulate mini.toml wall --format samples -o out --json");
    let path = |name: &str| desk.path().join("out").join(name);
    let samples = fs::read(path("samples-000000.mpw")).unwrap();
    let put = |name: &str, at: usize, others: &[u8]| {
        let mut bytes = samples.clone();
        bytes[at..at + others.len()].copy_from_slice(others);
        fs::write(path(name), bytes).unwrap();
    };
    fs::write(path("short.mpw"), &samples[..samples.len() / 2]).unwrap();
    put("step.mpw", 64, &f64::NAN.to_le_bytes());
    put("huge.mpw", 136, &u32::MAX.to_le_bytes());
    put("many.mpw", 16, &u64::MAX.to_le_bytes().map(|byte| byte / 2));
    put("code.mpw", 144, &i16::MAX.to_le_bytes());
    put("digest.mpw", 32, &[7; 16]);
    let start = "decode --sensor mini.toml out/shots-000000.mps";
    for (samples, words) in [
        ("out/short.mpw", &["short.mpw: byte ", "truncated"][..]),
        ("out/step.mpw", &["step.mpw: byte 0: a step of NaN photons"]),
        ("out/huge.mpw", &["huge.mpw: byte 128: a block of 4294967295 codes", "damaged"]),
        ("out/many.mpw", &["many.mpw: byte ", "truncated"]),
        ("out/code.mpw", &["code.mpw: byte 144: code 32767 at tick "]),
        ("out/digest.mpw", &["digest.mpw: is of another sensor", "name the sensor"]),
        ("out/shots-000000.mps", &["these are shots, where samples are wanted"]),
    ] {
        desk.refused(&format!("{start} {samples} -o a"), words);
    }
    let files = "out/shots-000000.mps out/samples-000000.mpw";
    let other = format!("decode --sensor peregrine {files} -o a");
    desk.refused(&other, &["samples-000000.mpw: byte 0: these are samples", "records ticks"]);
    let coarse = format!("decode --sensor mini.toml --set adc.bits=10 {files} -o a");
    desk.refused(&coarse, &["codes from -204 to 1843, where those of the sensor are -102 to 921"]);
    let line = "simulate mini.toml wall --format pcd,ticks -o b";
    desk.refused(line, &["--format: mini records samples and nothing else; ask for `samples`"]);
    let line = "simulate peregrine wall --format samples -o b";
    desk.refused(line, &["--format: peregrine records ticks and nothing else; ask for `ticks`"]);
    let line = "encode mini.toml --wall-m 30 -o b";
    desk.refused(line, &["--wall-m: mini records samples"]);
}

#[test]
fn the_coded_receivers_find_the_same_points_in_files() {
    for (sensor, rows) in [
        ("kim-park-2016-fixed", 24),
        ("kim-park-2016", 12),
        ("bipolar-gold", 6),
        ("coded-practical", 10),
    ] {
        let desk = Desk::new();
        let sensor = format!("--sensor {sensor} {ROWS}={rows}");
        let (_, decoded) = again(&desk, &sensor, "--scene street", 1);
        assert_eq!(decoded["counts"]["scans"], 1);
    }
}

#[test]
fn the_direct_receivers_find_the_same_points_in_files() {
    for sensor in ["hdl-64e", "peregrine"] {
        again(&Desk::new(), &format!("--sensor {sensor}"), "--scene car-30m", 1);
    }
}

#[test]
fn several_returns_and_several_scans_of_a_moving_scene_come_out_the_same() {
    let desk = Desk::new();
    let scene = "version = 1\nground = { material = \"asphalt\" }\nenvironment = \"overcast\"\n\
                 [sensor]\nposition_m = [0, 0, 2]\npitch_deg = 10\nvelocity_m_s = [20, 0, 0]\n";
    desk.put("drive.toml", scene);
    let sensor = format!("--sensor kim-park-2016-fixed {ROWS}=8 --set receiver.returns=3");
    let (simulated, _) = again(&desk, &sensor, "--scene drive.toml", 3);
    assert_eq!(simulated["counts"]["scans"], 3);
}

/// Detectors and converters that remember: what they saw before a band decides what they see in it.
#[test]
fn cells_that_are_blind_and_converters_that_are_busy_change_nothing() {
    let desk = Desk::new();
    desk.put(
        "cells.toml",
        "version = 1\nname = \"cells\"\nextends = \"kim-park-2016\"\n[scan.raster]\nrows = 6\n\
         [detector.geiger]\nsensitivity = { range_m = 150.0, reflectance = 1.0, pd = 0.99 }\n\
         cells = 20\ndead_time_ns = 20\ndark_counts_hz = 1e8\n",
    );
    again(&desk, "--sensor cells.toml", "--scene car-30m", 1);
    let desk = Desk::new();
    let sensor = format!("--sensor kim-park-2016-fixed {ROWS}=12 --set tdc.converters=10");
    let (simulated, _) = again(&desk, &sensor, "--scene car-30m", 1);
    assert!(simulated["converters"]["lost"].as_u64().unwrap() > 1000, "{simulated}");
}

const SMALL: &str = "--sensor kim-park-2016-fixed --set scan.raster.rows=6";

/// The sun and air of the scene.
const DARK: &str = "--environment vacuum-dark";

/// A desk with the record of a small scan in both forms.
fn recorded() -> Desk {
    let desk = Desk::new();
    for form in ["ticks", "ticks-csv"] {
        desk.json(&format!("simulate {SMALL} --scene car-30m --format csv,{form} -o out --json"));
    }
    desk
}

#[test]
fn text_says_what_binary_says() {
    let desk = recorded();
    let points = |shots: &str, ticks: &str| {
        let line =
            format!("decode {SMALL} {DARK} out/{shots} out/{ticks} --format csv -o a --json");
        desk.json(&line);
        fs::read(desk.path().join("a/scan-000000.csv")).unwrap()
    };
    let was = fs::read(desk.path().join("out/scan-000000.csv")).unwrap();
    assert!(was == points("shots-000000.csv", "ticks-000000.csv"));
    assert!(was == points("shots-000000.mps", "ticks-000000.csv"));
    assert!(was == points("shots-000000.csv", "ticks-000000.mpt"));
}

/// Points leave before the ticks have ended, and are those of the files.
#[test]
fn ticks_on_stdin_become_lines_on_stdout_as_they_come() {
    let desk = recorded();
    let was = fs::read_to_string(desk.path().join("out/scan-000000.csv")).unwrap();
    let ticks = fs::read(desk.path().join("out/ticks-000000.mpt")).unwrap();
    let line = format!("decode {SMALL} {DARK} out/shots-000000.mps - -o -");
    let mut program = desk
        .command(&line)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = program.stdin.take().unwrap();
    let mut out = BufReader::new(program.stdout.take().unwrap());
    let (begun, rest_of_ticks) = ticks.split_at(ticks.len() * 9 / 10);
    let (begun, rest_of_ticks) = (begun.to_vec(), rest_of_ticks.to_vec());
    let (go_on, is_told) = std::sync::mpsc::channel();
    // Whoever writes waits for the program, which waits for whoever reads.
    let writer = std::thread::spawn(move || {
        stdin.write_all(&begun).unwrap();
        stdin.flush().unwrap();
        is_told.recv().unwrap();
        stdin.write_all(&rest_of_ticks).unwrap();
    });
    let mut first = String::new();
    for _ in 0..100 {
        out.read_line(&mut first).unwrap();
    }
    assert!(was.starts_with(&first) && first.lines().count() == 100);
    go_on.send(()).unwrap();
    let mut rest = String::new();
    out.read_to_string(&mut rest).unwrap();
    writer.join().unwrap();
    assert!(program.wait().unwrap().success());
    assert!(was == format!("{first}{rest}"));
}

#[test]
fn what_is_wrong_with_a_file_is_one_sentence_with_its_place() {
    let desk = recorded();
    let path = |name: &str| desk.path().join("out").join(name);
    let read = |name: &str| fs::read(path(name)).unwrap();
    let (shots, ticks) = (read("shots-000000.mps"), read("ticks-000000.mpt"));
    let text = String::from_utf8(read("ticks-000000.csv")).unwrap();
    let put = |name: &str, bytes: &[u8]| fs::write(path(name), bytes).unwrap();
    put("short.mpt", &ticks[..ticks.len() - 3]);
    put("few.mpt", &ticks[..128 + 8 * 1000]);
    put("empty", b"");
    let mut lines: Vec<&str> = text.lines().collect();
    lines.swap(500, 501);
    put("order.csv", lines.join("\n").as_bytes());
    put("version.csv", text.replacen("ticks 1", "ticks 7", 1).as_bytes());
    put("length.csv", text.replacen("tick_fs=2500", "tick_fs=5000", 1).as_bytes());
    let mut far = shots.clone();
    far[128 + 10..128 + 12].copy_from_slice(&848_u16.to_le_bytes());
    put("far.mps", &far);
    let start = format!("decode {SMALL}");
    let good = ("out/shots-000000.mps", "out/ticks-000000.mpt");
    for (shots, ticks, words) in [
        (good.0, "out/short.mpt", &["short.mpt: byte ", "truncated"][..]),
        (good.0, "out/few.mpt", &["few.mpt: ", "1000 of", "truncated"]),
        (good.0, "out/empty", &["out/empty: ", "is empty"]),
        ("out/empty", good.1, &["out/empty: ", "is empty"]),
        (good.0, "out/order.csv", &["order.csv: line 502: ", "sort them"]),
        (good.0, "out/version.csv", &["version.csv: line 1: version `7`", "reads 1"]),
        (good.0, "out/length.csv", &["length.csv: line ", "ticks of 5000 fs", "2500 fs"]),
        ("out/far.mps", good.1, &["far.mps: byte 128: shot 0: column 848 is not among the 848"]),
        (good.1, good.0, &["these are ticks, where shots are wanted"]),
        (good.0, "out/nothing", &["out/nothing: cannot be read: there is no such file"]),
        ("-", "-", &["only one of SHOTS and RECORD can come from stdin"]),
    ] {
        desk.refused(&format!("{start} {shots} {ticks} -o a"), words);
    }
    let other = format!("decode --sensor kim-park-2016-fixed {} {} -o a", good.0, good.1);
    desk.refused(&other, &["shots-000000.mps: is of another sensor", "name the sensor"]);
}

/// A file without ticks is read, and it is said that nothing came of it.
#[test]
fn no_points_are_never_silent() {
    let desk = recorded();
    desk.put("none.csv", "# macropulse ticks 1, tick_fs=2500\ntick\n");
    let ran = desk.run(&format!("decode {SMALL} out/shots-000000.mps none.csv -o a --format csv"));
    assert_eq!(ran.code, Some(0));
    assert!(
        ran.err.contains("not a single point: nothing was recorded in the time"),
        "{}",
        ran.err
    );
    desk.put("no-shots.csv", "# macropulse shots 1\nshot,fired_fs,row,column,label,word\n");
    let line = format!("decode {SMALL} no-shots.csv out/ticks-000000.mpt -o b");
    desk.refused(&line, &["there is not a single shot"]);
}

/// The shot log of `encode`, with the ticks of a wall at a known range.
#[test]
fn an_encoded_scan_is_decoded_to_the_wall_it_is_of() {
    let desk = Desk::new();
    for form in ["ticks", "ticks-csv"] {
        let line = format!("encode {SMALL} --scan 2 --wall-m 37.5 --format {form} -o in --json");
        let encoded = desk.json(&line);
        assert!(encoded["ticks"].as_u64().unwrap() > 100_000);
        let [shots, ticks] = [0, 1].map(|at| encoded["files"][at].as_str().unwrap().to_owned());
        let line = format!("decode {SMALL} in/{shots} in/{ticks} --format csv -o {form} --json");
        let decoded = desk.json(&line);
        // Column 0 is dark.
        assert_eq!(decoded["counts"]["returns"], 6 * 848);
        let points = fs::read_to_string(desk.path().join(form).join("scan-000002.csv")).unwrap();
        let range = |line: &str| line.split(',').nth(4).unwrap().parse::<f64>().unwrap();
        assert!(points.lines().skip(1).all(|line| (range(line) - 37.5).abs() < 4e-4));
    }
}

/// Ticks of hardware that we did not simulate, written by a program in another language.
#[test]
fn made_up_hardware_in_python_is_decoded_to_its_wall() {
    let desk = Desk::new();
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/examples");
    let written = Command::new("python3")
        .arg(format!("{examples}/ticks.py"))
        .arg(desk.path())
        .status()
        .expect("python3 is needed for this test");
    assert!(written.success());
    let line = format!("decode --sensor {examples}/hardware.toml shots.csv ticks.csv");
    let decoded = desk.json(&format!("{line} --format csv -o out --json"));
    assert_eq!(decoded["counts"]["returns"], 256);
    let points = fs::read_to_string(desk.path().join("out/scan-000000.csv")).unwrap();
    let range = |line: &str| line.split(',').nth(4).unwrap().parse::<f64>().unwrap();
    assert!(points.lines().skip(1).all(|line| (range(line) - 42.0).abs() < 4e-4), "{points}");
}

/// Explanations agree with decoding, accepted or not, in words, JSON and pictures.
#[test]
fn an_explanation_says_what_was_decided() {
    let desk = Desk::new();
    let sensor = "--sensor kim-park-2016 --set scan.raster.rows=6";
    let pixels = "--explain 2,0 --explain 2,300 --explain 3,424";
    let line =
        format!("simulate {sensor} --scene car-30m --format csv,ticks -o out --json {pixels}");
    let simulated = desk.json(&line);
    let files = "out/shots-000000.mps out/ticks-000000.mpt";
    let environment = simulated["environment"]["name"].as_str().unwrap();
    let line =
        format!("decode {sensor} {files} --environment {environment} -o again --json {pixels}");
    let decoded = desk.json(&line);
    let mut receiver_s = simulated["explained"].clone();
    for told in receiver_s.as_array_mut().unwrap() {
        // Only a simulation knows the light at the detector.
        assert!(told["light"]["detections"].as_u64().unwrap() > 0, "{told}");
        told["light"] = serde_json::Value::Null;
    }
    assert_eq!(receiver_s, decoded["explained"]);
    let points = fs::read_to_string(desk.path().join("out/scan-000000.csv")).unwrap();
    for told in decoded["explained"].as_array().unwrap() {
        let line = point_of(&points, told);
        assert_eq!(line.is_some(), told["decided"] == "accepted", "{told}");
        if let Some(line) = line {
            let range: f64 = line.split(',').nth(4).unwrap().parse().unwrap();
            assert!((told["returns"][0]["range_m"].as_f64().unwrap() - range).abs() < 1e-4);
        }
    }
    assert_eq!(decoded["explained"][0]["decided"], "no_peak");
    assert!(decoded["explained"][0]["why"].as_str().unwrap().contains("has no mark"));
    for ending in ["txt", "json", "svg", "png"] {
        let path = desk.path().join(format!("again/explain-000000-2-300.{ending}"));
        assert!(path.is_file(), "{}", path.display());
    }
    let text = |folder: &str| {
        fs::read_to_string(desk.path().join(folder).join("explain-000000-3-424.txt")).unwrap()
    };
    assert!(text("out").contains("marks of this shot from "), "{}", text("out"));
    assert!(text("again").contains("not known: what is decoded is ticks alone"));
    let line = format!("decode {sensor} {files} --explain 6,0");
    desk.refused(&line, &["--explain 6,0: kim-park-2016 has rows 0 to 5 and columns 0 to 847"]);
}

/// Samples are explained as well, with a reason if nothing was found.
#[test]
fn an_explanation_of_samples_says_what_was_decided() {
    let desk = mini();
    let pixels = "--explain 2,30 --explain 31,50 --explain 40,80 --explain 60,10 --explain 63,105";
    let line = format!("simulate mini.toml street --format csv,samples -o out --json {pixels}");
    let simulated = desk.json(&line);
    let files = "out/shots-000000.mps out/samples-000000.mpw --environment clear-day";
    let decoded = desk.json(&format!("decode --sensor mini.toml {files} -o again --json {pixels}"));
    // Decoded band after band, simulated in the order in which they were asked for.
    let by_shot = |told: &serde_json::Value| {
        let mut told = told["explained"].as_array().unwrap().clone();
        told.sort_by_key(|told| told["shot"].as_u64());
        told
    };
    let mut receiver_s = by_shot(&simulated);
    for told in &mut receiver_s {
        assert!(told["light"]["of_this_shot"].is_array(), "{told}");
        told["light"] = serde_json::Value::Null;
    }
    assert_eq!(receiver_s, by_shot(&decoded));
    let points = fs::read_to_string(desk.path().join("out/scan-000000.csv")).unwrap();
    let (mut accepted, mut refused) = (0, 0);
    for told in decoded["explained"].as_array().unwrap() {
        let line = point_of(&points, told);
        assert_eq!(line.is_some(), told["decided"] == "accepted", "{told}");
        let why = told["why"].as_str().unwrap();
        match line {
            Some(line) => {
                let range: f64 = line.split(',').nth(4).unwrap().parse().unwrap();
                assert!((told["returns"][0]["range_m"].as_f64().unwrap() - range).abs() < 1e-4);
                assert!(why.contains("A return was accepted at "), "{why}");
                accepted += 1;
            }
            None => {
                assert!(why.contains(" m"), "{why}");
                refused += 1;
            }
        }
        assert!(told["noise_photons"].as_f64().unwrap() > 1.0);
        assert_eq!(told["tested"][0]["marks"].as_array().unwrap().len(), 3, "{told}");
    }
    assert!(accepted > 0 && refused > 0, "{accepted} accepted, {refused} refused");
    for ending in ["txt", "json", "svg", "png"] {
        let path = desk.path().join(format!("again/explain-000000-31-50.{ending}"));
        assert!(path.is_file(), "{}", path.display());
    }
    let read = |name: &str| fs::read_to_string(desk.path().join(name)).unwrap();
    let text = read("again/explain-000000-31-50.txt");
    assert!(text.contains("behind the matched filter") && text.contains("threshold"), "{text}");
    assert!(text.contains("not known: what is decoded is samples alone"), "{text}");
    assert!(read("again/index.html").contains("Sum of the marks, over the gate"));
}

/// The light drawn above the ticks is the light that made them.
#[test]
fn light_that_is_explained_is_that_of_the_ticks() {
    let desk = Desk::new();
    let line = format!("simulate {SMALL} --scene wall --format none -o out --json --explain 3,500");
    let told = desk.json(&line);
    let text = fs::read(desk.path().join("out/explain-000000-3-500.json")).unwrap();
    let whole: serde_json::Value = serde_json::from_slice(&text).unwrap();
    assert_eq!(whole["schema_version"], 1);
    let light = &whole["light"];
    let list = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().filter_map(serde_json::Value::as_f64).collect()
    };
    let ours = &light["of_this_shot"][0];
    let range = |value: &serde_json::Value| value.as_f64().unwrap();
    assert!((range(&ours["range_m"]) - range(&whole["peak"]["range_m"])).abs() < 1e-3, "{ours}");
    assert!(range(&ours["marks"]) >= range(&whole["peak"]["marks"]));
    let trains = light["trains"].as_array().unwrap();
    assert_eq!(trains.len() as u64, 1 + light["trains_of_others"].as_u64().unwrap());
    let events = list(&light["detections_ticks"]);
    assert_eq!(events.len() as u64, light["detections"].as_u64().unwrap());
    // Every tick is an event of the detector, and nearly every event is of a mark that arrived.
    let fired: BTreeSet<i64> = events.iter().map(|event| event.floor() as i64).collect();
    let ticks = list(&whole["ticks"]);
    assert!(ticks.len() > 100);
    assert!(ticks.iter().all(|tick| fired.contains(&(*tick as i64))), "a tick without an event");
    let arrived: BTreeSet<i64> =
        trains.iter().flat_map(|train| list(&train["marks_ticks"])).map(|at| at as i64).collect();
    let is_lit = |event: &&i64| (**event - 2..=**event + 2).any(|tick| arrived.contains(&tick));
    assert!(fired.iter().filter(is_lit).count() * 100 > fired.len() * 99);
    assert!(told["explained"][0]["light"]["trains"].is_null(), "the whole is in the file alone");
}

/// A folder has a page and a manifest, as that of a simulation, but what no receiver knows.
#[test]
fn a_folder_of_points_has_a_page_and_a_manifest() {
    let desk = recorded();
    let files = "out/shots-000000.mps out/ticks-000000.mpt";
    let line = format!("decode {SMALL} {DARK} {files} --explain 3,424 -o again --json");
    let decoded = desk.json(&line);
    let read = |name: &str| fs::read_to_string(desk.path().join("again").join(name)).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&read("manifest.json")).unwrap();
    for (key, value) in manifest.as_object().unwrap() {
        assert_eq!(decoded[key], *value, "{key}");
    }
    assert_eq!(manifest["recorded"]["ticks"], "out/ticks-000000.mpt");
    let names: Vec<&str> =
        manifest["files"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    for name in ["scan-000000.pcd", "range-000000.png", "explain-000000-3-424.json", "index.html"] {
        assert!(names.contains(&name), "{name} is not among {names:?}");
    }
    let page = read("index.html");
    assert!(page.contains("<title>kim-park-2016-fixed, decoded"), "{}", &page[..400]);
    assert!(page.contains("What light there was is not known"));
    assert!(page.contains("href=\"./manifest.json\"") && !page.contains("<dt>scene</dt>"));
    // Older files in the folder are named.
    let ran = desk.run(&format!("decode {SMALL} {files} --format csv -o again"));
    assert!(ran.err.contains("of an older run"), "{}", ran.err);
    assert!(ran.out.contains("manifest.json to again; open again/index.html"), "{}", ran.out);
}
