//! Common behaviour of all commands: names of sensors and scenes, the form of JSON, manual pages and
//! completions.

#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::io::Write;
use std::process::Stdio;

use common::{Desk, Ran};

/// Runs the program with `input` on its standard input.
fn fed(desk: &Desk, line: &str, input: &str) -> Ran {
    let mut command = desk.command(line);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Ran { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

#[test]
fn a_sensor_and_a_scene_are_named_in_their_order_or_by_options() {
    let desk = Desk::new();
    let plain = desk.json("simulate peregrine wall --format none --json");
    let named = desk.json("simulate --sensor peregrine --scene wall --format none --json");
    assert_eq!(plain["counts"], named["counts"]);
    let mixed = desk.json("simulate peregrine --scene wall --format none --json");
    assert_eq!(plain["counts"], mixed["counts"]);
    let by_position = desk.json("encode kim-park-2016 --pixel 0,1 --json");
    assert_eq!(by_position, desk.json("encode --sensor kim-park-2016 --pixel 0,1 --json"));
    let sweep = "--set scan.flash.rows=4 --set scan.flash.columns=4 --seeds 1 --json \
                 --vary scene:object.wall.position_m.x=10,20";
    let by_position = desk.json(&format!("sweep peregrine wall {sweep} -o a"));
    assert_eq!(by_position, desk.json(&format!("sweep peregrine --scene wall {sweep} -o b")));
}

#[test]
fn what_stands_in_the_wrong_place_is_said_with_the_right_line() {
    let desk = Desk::new();
    desk.refused("simulate wall peregrine -o out", &["`macropulse simulate peregrine wall`"]);
    desk.refused("simulate peregrine -o out", &["is a sensor", "`macropulse simulate peregrine"]);
    desk.refused("simulate wall -o out", &["is a scene", "name a sensor before it"]);
    desk.refused("simulate peregrine wal -o out", &["wal", "did you mean \"wall\"?"]);
    desk.refused("simulate --sensor peregrine -o out", &["--scene"]);
    desk.refused("encode --pixel 0,0", &["SENSOR"]);
}

#[test]
fn threads_asked_for_by_the_environment_have_the_limit_of_the_option() {
    let desk = Desk::new();
    let ran = |line: &str, threads: &str| {
        let output = desk.command(line).env("RAYON_NUM_THREADS", threads).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, told) = ran("sensors", "100000");
    assert_eq!(code, Some(2));
    assert!(told.contains("RAYON_NUM_THREADS is 100000; it must be from 0 to 1024"), "{told}");
    for (line, threads) in [("sensors", "2"), ("sensors", "many"), ("sensors -j 1", "100000")] {
        assert_eq!(ran(line, threads), (Some(0), String::new()));
    }
}

#[test]
fn a_hyphen_is_standard_input() {
    let desk = Desk::new();
    let sensor = desk.run("sensors peregrine").out;
    let scene = desk.run("scenes wall").out;
    let plain = desk.json("simulate peregrine wall --format none --json");
    for (line, input) in [("simulate - wall", &sensor), ("simulate peregrine -", &scene)] {
        let ran = fed(&desk, &format!("{line} --format none --json"), input);
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        let told: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
        assert_eq!(told["outcomes"], plain["outcomes"], "{line}");
    }
    let moved = "check - --json --set scene:object.wall.position_m.x=20";
    assert_eq!(fed(&desk, moved, &scene).code, Some(0));
    let scenario = "version = 1\nsensor = \"peregrine\"\nscene = \"wall\"\nformats = []\n";
    assert_eq!(fed(&desk, "simulate -", scenario).code, Some(0));
    for (line, input, words) in [
        ("simulate - -", "", "- is named twice"),
        ("simulate - wall", "version = ", "standard input:1:"),
        (
            "sweep - wall --vary scan.max_range_m=9,8 -o o",
            "",
            "write the sensor or scene into a file",
        ),
    ] {
        let ran = fed(&desk, line, input);
        assert_eq!((ran.code, ran.out.as_str()), (Some(2), ""), "{line}");
        assert!(ran.err.contains(words), "{line}: {}", ran.err);
    }
    assert!(desk.files().is_empty());
}

/// Whatever prints JSON says which version of the keys it is, and calls a thing by one name.
#[test]
fn all_json_has_a_version_and_one_vocabulary() {
    let desk = Desk::new();
    let lines = [
        "simulate peregrine wall -o run --json",
        "check peregrine --json",
        "check street --json",
        "budget coded-practical --json",
        "codes prime=5 --json",
        "encode peregrine --pixel 0,0 --json",
        "sensors --json",
        "sensors peregrine --json",
        "scenes --json",
        "scenes wall --json",
        "environments --json",
        "sweep peregrine wall --vary scan.max_range_m=60,70 --seeds 1 -o swept --json",
    ];
    let mut told: Vec<(String, serde_json::Value)> =
        lines.iter().map(|line| ((*line).to_owned(), desk.json(line))).collect();
    for file in ["run/manifest.json", "swept/manifest.json"] {
        let text = std::fs::read(desk.path().join(file)).unwrap();
        told.push((file.to_owned(), serde_json::from_slice(&text).unwrap()));
    }
    for (line, json) in &told {
        let first = json.as_object().unwrap().iter().next().unwrap();
        assert_eq!((first.0.as_str(), first.1), ("schema_version", &1.into()), "{line}");
        for old in ["idealisations", "notes", "stages_s", "stage_times_s", "conditions", "tdc"] {
            assert!(json.get(old).is_none(), "{line}: {old}");
        }
        for list in ["idealised", "assumed", "warnings", "files"] {
            assert!(json.get(list).is_none_or(serde_json::Value::is_array), "{line}: {list}");
        }
        if let Some(environment) = json.get("environment") {
            assert!(environment["conditions"].is_string(), "{line}");
        }
        if let Some(defaults) = json.get("defaults") {
            let values = defaults.as_object().unwrap();
            assert!(values.values().any(serde_json::Value::is_number), "{line}: {defaults}");
        }
    }
    // Values, not the text of a file.
    let values = |name: &str| &told.iter().find(|(line, _)| line == name).unwrap().1["values"];
    assert_eq!(values("sensors peregrine --json")["scan"]["flash"]["rows"], 32);
    assert_eq!(values("scenes wall --json")["object"][0]["name"], "wall");
    assert_eq!(desk.json("environments fog-50m --json")["values"]["visibility_km"], 0.05);
    let of = |name: &str| {
        let mut json = told.iter().find(|(line, _)| line == name).unwrap().1.clone();
        // These depend on the machine.
        for own in ["times_s", "speed", "folder"] {
            json.as_object_mut().unwrap().remove(own);
        }
        json
    };
    assert_eq!(of("simulate peregrine wall -o run --json"), of("run/manifest.json"));
}

/// A quiet command does not tell what it leaves out, finds in the folder or makes. It tells of a result
/// without a point.
#[test]
fn a_quiet_command_says_nothing() {
    let desk = Desk::new();
    let few = "--set scan.raster.rows=4 --set scan.raster.columns=40";
    let sensor = format!("kim-park-2016-fixed {few}");
    for line in [
        &format!("simulate {sensor} street --scans 2 --truth --format csv,kitti,ticks -o in"),
        &format!("simulate {sensor} street --truth --format csv,kitti,ticks -o in"),
        &format!("decode --sensor {sensor} in/shots-000000.mps in/ticks-000000.mpt -o in"),
        &format!("encode {sensor} -o shots"),
        "convert in/scan-000000.csv -o points.bin",
        "view in/scan-000000.csv",
        "view in",
        "sweep peregrine wall --vary scan.max_range_m=60,70 --seeds 1 -o swept",
        "budget coded-practical -o budget",
        "codes prime=5 -o codes",
        "check peregrine street",
    ] {
        let ran = desk.run(&format!("{line} -q"));
        let said = (ran.code, ran.out.as_str(), ran.err.as_str());
        assert_eq!(said, (Some(0), "", ""), "{line}");
    }
    let ran = desk.run("simulate peregrine wall --set scan.max_range_m=5 -o empty -q");
    assert_eq!((ran.code, ran.err.lines().count()), (Some(0), 1), "{}", ran.err);
    assert!(ran.err.contains("not a single point"), "{}", ran.err);
}

#[test]
fn scans_of_an_older_run_are_named() {
    let desk = Desk::new();
    let ran = desk.run("simulate peregrine wall --scans 3 --format pcd -o run");
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
    let ran = desk.run("simulate peregrine wall --format pcd -o run");
    assert_eq!(ran.code, Some(0));
    assert!(ran.err.contains("scan-000001.pcd and others like it are of an older run (2 in all)"));
    let again = desk.run("simulate peregrine wall --scans 3 --format pcd -o run");
    assert_eq!(again.err, "");
}

#[test]
fn there_is_a_manual_page_for_every_command() {
    let desk = Desk::new();
    assert_eq!(desk.run("man -o man").code, Some(0));
    let help = desk.run("--help").out;
    let after = help.split("Commands:\n").nth(1).unwrap();
    let commands = after.lines().take_while(|line| line.starts_with("  ")).filter_map(|line| {
        line.strip_prefix("  ")
            .filter(|rest| !rest.starts_with(' '))
            .map(|rest| rest.split(' ').next().unwrap())
    });
    let pages = desk.files();
    assert!(pages.contains(&"man/macropulse.1".to_owned()), "{pages:?}");
    for command in commands {
        let page = format!("man/macropulse-{command}.1");
        assert!(pages.contains(&page), "no {page} in {pages:?}");
    }
    let page = desk.run("man simulate").out;
    assert!(page.contains(".SH SYNOPSIS") && page.contains("Ready sensor or TOML file"), "{page}");
    desk.refused("man simulat", &["no such command", "simulate"]);
}

/// A shell asks the program itself what a line can go on with.
#[test]
fn names_of_sensors_and_scenes_are_completed() {
    let desk = Desk::new();
    let script = desk.run("completions bash").out;
    assert!(script.contains("MACROPULSE_COMPLETE"), "{script}");
    let asked = |line: &str, word: &str| {
        let mut command = desk.command(&format!("-- {line}"));
        command.env("MACROPULSE_COMPLETE", "bash").env("_CLAP_COMPLETE_INDEX", word);
        String::from_utf8(command.output().unwrap().stdout).unwrap()
    };
    let sensors = asked("macropulse simulate kim", "2");
    assert!(sensors.contains("kim-park-2016-fixed") && !sensors.contains("hdl"), "{sensors}");
    let scenes = asked("macropulse simulate hdl-64e st", "3");
    assert!(scenes.contains("street") && !scenes.contains("wall"), "{scenes}");
    let environments = asked("macropulse budget hdl-64e --environment fog", "4");
    assert!(environments.contains("fog-50m"), "{environments}");
    desk.put("mine.toml", "");
    assert!(asked("macropulse budget mi", "2").contains("mine.toml"));
}
