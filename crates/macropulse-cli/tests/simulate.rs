//! Runs of the whole flow.

#![allow(missing_docs)]

use crate::common;

use std::fs;

use common::Desk;

const START: &str = "simulate --sensor peregrine --scene wall";

#[test]
fn a_run_leaves_its_scans_and_a_manifest() {
    let desk = Desk::new();
    let ran = desk.run(&format!("{START} --scans 2 --format pcd,png -o a/b"));
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
    assert!(ran.out.starts_with("peregrine in wall: 2 scans, seed 1, "), "{}", ran.out);
    let wanted = [
        "a",
        "a/b",
        "a/b/index.html",
        "a/b/manifest.json",
        "a/b/range-000000-colour.png",
        "a/b/range-000000.png",
        "a/b/range-000001-colour.png",
        "a/b/range-000001.png",
        "a/b/scan-000000.pcd",
        "a/b/scan-000001.pcd",
    ];
    assert_eq!(desk.files(), wanted);
    let manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(desk.path().join("a/b/manifest.json")).unwrap()).unwrap();
    assert_eq!(manifest["counts"]["shots"], 2 * 32 * 128);
    assert_eq!(manifest["files"].as_array().unwrap().len(), 7);
}

/// The pose of a moving sensor is in the manifest, scan by scan, and in the files of points.
#[test]
fn a_run_of_a_moving_sensor_tells_where_each_scan_began() {
    let desk = Desk::new();
    let scene = "version = 1\nground = { material = \"asphalt\" }\n[sensor]\n\
                 position_m = [0, 0, 2]\npitch_deg = 20\nvelocity_m_s = [20, 0, 0]\n\
                 turn_rate_deg_s = 10\n";
    fs::write(desk.path().join("drive.toml"), scene).unwrap();
    let ran = desk.run("simulate --sensor peregrine --scene drive.toml --scans 2 -o a");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(desk.path().join("a/manifest.json")).unwrap()).unwrap();
    let [first, second] = manifest["scans"].as_array().unwrap().as_slice() else { unreachable!() };
    assert_eq!((&first["scan"], &second["scan"]), (&0.into(), &1.into()));
    assert_eq!(first["start_ns"], 0.0);
    let start = second["start_ns"].as_f64().unwrap() * 1e-9;
    assert!(start > 0.01, "{start}");
    let close = |value: &serde_json::Value, wanted: f64| {
        assert!((value.as_f64().unwrap() - wanted).abs() < 1e-9, "{value} {wanted}");
    };
    close(&second["position_m"][0], 20.0 * start);
    close(&second["position_m"][2], 2.0);
    close(&second["yaw_deg"], 10.0 * start);
    close(&second["pitch_deg"], 20.0);
    let pcd = fs::read(desk.path().join("a/scan-000001.pcd")).unwrap();
    let header = String::from_utf8_lossy(&pcd[..2000]).into_owned();
    let viewpoint = header.lines().find_map(|line| line.strip_prefix("VIEWPOINT ")).unwrap();
    let numbers: Vec<f64> = viewpoint.split(' ').map(|number| number.parse().unwrap()).collect();
    assert!((numbers[0] - 20.0 * start).abs() < 1e-9 && numbers[2] == 2.0, "{viewpoint}");
    assert!((numbers[3..].iter().map(|part| part * part).sum::<f64>() - 1.0).abs() < 1e-12);
    let told = desk.run("check drive.toml").out;
    assert!(told.contains("sensor: moves by (20, 0, 0) m and turns by 10 deg in each"), "{told}");
}

#[test]
fn the_same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let desk = Desk::new();
    let points = |line: &str| {
        let line = format!("simulate --sensor hdl-64e --scene car-30m --format csv --truth {line}");
        assert_eq!(desk.run(&line).code, Some(0));
        ["scan-000000.csv", "index.html"]
            .map(|file| fs::read(desk.path().join("out").join(file)).unwrap())
    };
    let one = points("--seed 7 -j 1 -o out");
    assert!(one[0].len() > 100_000);
    assert!(one == points("--seed 7 -j 3 -o out"), "threads change the points");
    assert!(one != points("--seed 8 -j 3 -o out"), "the seed does not change the points");
}

#[test]
fn truth_is_written_only_when_asked_for() {
    let desk = Desk::new();
    let header = |line: &str| {
        assert_eq!(desk.run(&format!("{START} --format csv -o out {line}")).code, Some(0));
        let text = fs::read_to_string(desk.path().join("out/scan-000000.csv")).unwrap();
        text.lines().next().unwrap_or_default().to_owned()
    };
    assert!(!header("").contains("outcome"));
    assert!(header("--truth").contains("outcome"));
}

#[test]
fn nothing_is_written_when_nothing_is_wanted() {
    let desk = Desk::new();
    let run = desk.json(&format!("{START} --format none --json"));
    assert_eq!(desk.files(), [""; 0]);
    assert_eq!(run["counts"]["shots"], 4096);
    assert_eq!(run["folder"], serde_json::Value::Null);
}

#[test]
fn a_scenario_with_several_sensors_gives_each_a_folder() {
    let desk = Desk::new();
    fs::create_dir(desk.path().join("in")).unwrap();
    desk.put("in/mine.toml", "version = 1\nname = \"mine\"\nextends = \"peregrine\"\n");
    let text = "version = 1\nsensors = [\"peregrine\", \"mine.toml\"]\nscene = \"wall\"\n\
                scans = 2\nseed = 5\nformats = [\"ply\"]\n";
    desk.put("in/s.toml", text);
    let runs = desk.json("simulate in/s.toml -o out --scans 1 --json");
    assert_eq!((&runs[0]["counts"]["scans"], &runs[1]["seed"]), (&1.into(), &5.into()));
    assert_eq!(runs[1]["sensor"]["name"], "mine");
    for file in ["out/mine/scan-000000.ply", "out/peregrine/manifest.json"] {
        assert!(desk.path().join(file).is_file(), "{file}");
    }
    assert!(desk.run("check in/s.toml").out.contains("peregrine, mine"));
}

#[test]
fn an_empty_cloud_says_where_the_points_went() {
    let desk = Desk::new();
    let near = "--set scan.max_range_m=20";
    let ran = desk.run(&format!("{START} {near} -o out"));
    assert_eq!(ran.code, Some(0));
    let sentence = "peregrine: not a single point: no ray met a surface within the range gate";
    assert!(ran.err.contains(sentence), "{}", ran.err);
    assert!(
        fs::read_to_string(desk.path().join("out/manifest.json")).unwrap().contains("no ray met")
    );
}

#[test]
fn a_range_image_too_large_for_a_picture_is_written_all_the_same() {
    let desk = Desk::new();
    let long = "--set scan.flash.rows=1 --set scan.flash.columns=30000 --set tdc.converters=30000";
    let ran = desk.run(&format!("{START} {long} --format png -o out"));
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains("too many pixels for a picture in colour"), "{}", ran.err);
    assert_eq!(
        desk.files(),
        ["out", "out/index.html", "out/manifest.json", "out/range-000000.png"]
    );
}

#[test]
fn progress_is_one_json_object_per_line() {
    let ran = Desk::new().run(&format!("{START} --format none --scans 3 --progress json -q"));
    let lines: Vec<serde_json::Value> =
        ran.err.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let last = lines.last().unwrap();
    assert_eq!((&last["event"], &last["shots"]), (&"done".into(), &(3 * 4096).into()));
    assert_eq!(ran.out, "");
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_after_the_scan_with_whole_files() {
    use std::io::{BufRead, BufReader, Read};
    use std::process::{Command, Stdio};

    let desk = Desk::new();
    let line = format!("{START} --scans 100000 --format pcd --progress json -o out");
    let mut program =
        desk.command(&line).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut told = BufReader::new(program.stderr.take().unwrap());
    // The first line of progress: the run is under way.
    told.read_line(&mut String::new()).unwrap();
    let id = program.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let mut rest = String::new();
    told.read_to_string(&mut rest).unwrap();
    assert_eq!(program.wait().unwrap().code(), Some(130), "{rest}");
    assert!(rest.contains("stopped by Ctrl-C after"), "{rest}");
    let text = fs::read_to_string(desk.path().join("out/manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&text).unwrap();
    let scans = manifest["counts"]["scans"].as_u64().unwrap() as usize;
    assert!((1..100_000).contains(&scans));
    // The folder, the manifest, the page, and one file for each scan: nothing half done.
    assert_eq!(desk.files().len(), 3 + scans);
}

/// A run that is killed leaves the file behind that it was writing; the next one clears it away.
#[cfg(unix)]
#[test]
fn what_a_killed_run_has_left_is_gone_after_the_next() {
    use std::time::{Duration, Instant};

    let desk = Desk::new();
    let unfinished = |file: &String| file.ends_with(".part");
    let is_left = || desk.files().iter().any(unfinished);
    let until = Instant::now() + Duration::from_secs(60);
    while !is_left() {
        assert!(Instant::now() < until, "it was never killed while it wrote");
        let line = format!("{START} --scans 100000 --format csv -o out -q");
        let mut program = desk.command(&line).spawn().unwrap();
        while !is_left() {
            assert!(program.try_wait().unwrap().is_none(), "it has ended");
        }
        program.kill().unwrap();
        program.wait().unwrap();
    }
    assert_eq!(desk.run(&format!("{START} --format csv -o out -q")).code, Some(0));
    assert!(!is_left(), "{:?}", desk.files());
    // It may have been killed before its folder was made.
    desk.put(".macropulse-AbCdEf.part", "");
    assert_eq!(desk.run(&format!("{START} --format csv -o new -q")).code, Some(0));
    assert!(!is_left(), "{:?}", desk.files());
}

/// A range image of a rosette comes with a warning. Without an image, or with `-q`, there is none.
#[test]
fn the_range_image_of_a_rosette_is_told_to_be_a_strip() {
    let desk = Desk::new();
    let ran = desk.run("simulate rosette-mid-40 wall --format png -o a");
    assert_eq!((ran.code, ran.err.lines().count()), (Some(0), 1), "{}", ran.err);
    assert!(ran.err.contains("a range image of it is a strip"), "{}", ran.err);
    let warnings = fs::read_to_string(desk.path().join("a/manifest.json")).unwrap();
    assert!(warnings.contains("is a strip, shot after shot"), "{warnings}");
    for quiet in ["--format ply -o b", "--format png -o c -q"] {
        let ran = desk.run(&format!("simulate rosette-mid-40 wall {quiet}"));
        assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""), "{quiet}");
    }
}
