//! Sweeps: in one go, in parts, interrupted, and refused.

#![allow(missing_docs, clippy::unwrap_used)]

use crate::common;

use std::fs;
use std::path::Path;

use common::Desk;
use serde_json::Value;

/// The lidar of the paper with 848 pixels, which are fired as closely as its own.
const TINY: &str = "sweep kim-park-2016-fixed --scene wall --set scan.raster.rows=8 \
                    --set scan.raster.columns=106 --set scan.scans_per_s=28800";

const MARKS: &str = "--vary detector.photon-counting.missed_marks=0,0.5,0.95";

/// The files that are the same however a sweep came about.
const RESULTS: [&str; 5] = ["index.html", "sweep.json", "sweep.csv", "sweep.svg", "manifest.json"];

/// Runs what must succeed without a word on stderr, and gives what it said.
fn good(desk: &Desk, line: &str) -> String {
    let ran = desk.run(line);
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""), "{line}");
    ran.out
}

fn read(desk: &Desk, path: &str) -> String {
    fs::read_to_string(desk.path().join(path)).unwrap()
}

/// Names of the files of jobs in `folder`, sorted.
fn jobs(desk: &Desk, folder: &str) -> Vec<String> {
    let files = fs::read_dir(desk.path().join(folder).join("jobs")).unwrap();
    let mut names: Vec<String> =
        files.map(|file| file.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The cell of `column` in row `row` of a table without quotes.
fn cell(csv: &str, row: usize, column: &str) -> f64 {
    let mut lines = csv.lines();
    let place = lines.next().unwrap().split(',').position(|name| name == column).unwrap();
    lines.nth(row).unwrap().split(',').nth(place).unwrap().parse().unwrap()
}

fn same_results(desk: &Desk, one: &str, other: &str) {
    assert_eq!(jobs(desk, one), jobs(desk, other));
    let of_jobs = jobs(desk, one).into_iter().map(|job| format!("jobs/{job}"));
    for file in RESULTS.map(str::to_owned).into_iter().chain(of_jobs) {
        let [a, b] = [one, other].map(|folder| read(desk, &format!("{folder}/{file}")));
        assert!(a == b, "{file} differs");
    }
}

#[test]
fn a_sweep_leaves_a_table_a_picture_and_a_manifest() {
    let desk = Desk::new();
    let out = good(&desk, &format!("{TINY} {MARKS} --seeds 3 --score pd,false,precision -o out"));
    assert!(out.contains("3 values of detector.photon-counting.missed_marks, 3 seeds each"));
    assert!(out.contains("848 of 848 pixels of a scan"), "{out}");
    assert_eq!(jobs(&desk, "out").len(), 9);
    let csv = read(&desk, "out/sweep.csv");
    let header = "detector.photon-counting.missed_marks,seeds,pixels,pd,pd_low,pd_high,\
                  false,false_low,false_high,precision_m,precision_m_low,precision_m_high";
    assert_eq!(csv.lines().next(), Some(header));
    assert_eq!(csv.lines().count(), 4);
    assert_eq!(cell(&csv, 0, "pixels"), 3.0 * 848.0);
    // With one mark in twenty seen, echoes are lost; with all of them seen, none is.
    assert!(cell(&csv, 0, "pd") > 0.99);
    assert!(cell(&csv, 2, "pd_high") < cell(&csv, 0, "pd_low"), "{csv}");
    let manifest: Value = serde_json::from_str(&read(&desk, "out/manifest.json")).unwrap();
    assert_eq!(manifest["points"].as_array().unwrap().len(), 3);
    assert_eq!(manifest["seeds"], 3);
    assert!(manifest["idealised"].as_array().unwrap().contains(&"footprint".into()));
    assert!(read(&desk, "out/sweep.svg").matches("<g transform").count() == 3);
}

#[test]
fn a_sweep_goes_on_where_half_of_it_is_gone() {
    let desk = Desk::new();
    let line = format!("{TINY} {MARKS} --seeds 4 -o out");
    good(&desk, &line);
    let all: Vec<(String, String)> = jobs(&desk, "out")
        .into_iter()
        .map(|job| (read(&desk, &format!("out/jobs/{job}")), job))
        .collect();
    let csv = read(&desk, "out/sweep.csv");
    let path = |job: &str| desk.path().join("out/jobs").join(job);
    let written = |job: &str| fs::metadata(path(job)).unwrap().modified().unwrap();
    for (_, job) in all.iter().step_by(2) {
        fs::remove_file(path(job)).unwrap();
    }
    let kept: Vec<_> = all.iter().skip(1).step_by(2).map(|(_, job)| (job, written(job))).collect();
    fs::remove_file(desk.path().join("out/sweep.csv")).unwrap();
    good(&desk, &line);
    assert_eq!(read(&desk, "out/sweep.csv"), csv);
    for (text, job) in &all {
        assert_eq!(read(&desk, &format!("out/jobs/{job}")), *text);
    }
    for (job, when) in kept {
        assert_eq!(written(job), when, "{job} was measured again");
    }
}

#[test]
fn shards_do_their_own_jobs_and_together_the_whole() {
    let desk = Desk::new();
    let line = format!("{TINY} {MARKS} --seeds 3");
    good(&desk, &format!("{line} -o whole"));
    let first = good(&desk, &format!("{line} -o parts --shard 1/2"));
    assert!(first.contains("4 of 9 scans are missing"), "{first}");
    assert!(first.contains("with --shard 2/2, or"), "{first}");
    assert_eq!(jobs(&desk, "parts").len(), 5);
    assert!(!desk.path().join("parts/sweep.csv").exists());
    let again = desk.json(&format!("{line} -o parts --shard 1/2 --json"));
    assert_eq!((&again["missing"], &again["missing_shards"][0]), (&4.into(), &"2/2".into()));
    good(&desk, &format!("{line} -o parts --shard 2/2"));
    same_results(&desk, "whole", "parts");
}

#[test]
fn shards_may_run_side_by_side_in_a_folder_that_is_not_there_yet() {
    let desk = Desk::new();
    let line = format!("{TINY} {MARKS} --seeds 3");
    let start = |shard| desk.command(&format!("{line} -q -o new/parts --shard {shard}/4")).spawn();
    let started = [1, 2, 3, 4].map(|shard| start(shard).unwrap());
    for mut program in started {
        assert_eq!(program.wait().unwrap().code(), Some(0));
    }
    good(&desk, &format!("{line} -o whole"));
    same_results(&desk, "whole", "new/parts");
}

#[test]
fn the_bytes_depend_on_the_seed_and_not_on_the_threads() {
    let desk = Desk::new();
    let line = format!("{TINY} --vary scan.raster.rows=8,24 --shots 1000 --seeds 3");
    let line = line.replace("--set scan.raster.rows=8 ", "").replace("28800", "9600");
    good(&desk, &format!("{line} -o one -j 1"));
    good(&desk, &format!("{line} -o two -j 2"));
    same_results(&desk, "one", "two");
    good(&desk, &format!("{line} -o other --seed 2 -j 2"));
    // Two of three seeds are the same.
    let (one, other) = (jobs(&desk, "one"), jobs(&desk, "other"));
    assert_eq!(one.iter().filter(|job| other.contains(job)).count(), 4);
    assert!(read(&desk, "one/sweep.csv") != read(&desk, "other/sweep.csv"));
}

#[test]
fn two_keys_make_a_grid_and_sensors_an_axis() {
    let desk = Desk::new();
    let grid = desk.json(&format!(
        "{TINY} --vary scene:object.wall.position_m.x=20..40:3 --vary tdc.converters=20,1150 \
         --seeds 1 --score right,lost,precision -o grid --json"
    ));
    let rows = grid["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 6);
    assert_eq!(
        (&rows[3]["scene:object.wall.position_m.x"], &rows[3]["tdc.converters"]),
        (&30.0.into(), &1150.0.into())
    );
    // One seed has no scatter, so there is no interval of a mean.
    assert_eq!(rows[3]["precision_m"]["low"], Value::Null);
    assert!(rows[3]["precision_m"]["value"].as_f64().unwrap() < 1e-3);
    assert_eq!(rows[3]["lost"]["value"], 0.0);
    assert!(rows[2]["lost"]["value"].as_f64().unwrap() > 0.0);
    let line = "sweep --sensors peregrine,hdl-64e --scene wall --shots 2000 --seeds 2 -o sensors";
    good(&desk, line);
    let csv = read(&desk, "sensors/sweep.csv");
    assert!(csv.starts_with("sensor,seeds,pixels,pd"), "{csv}");
    assert!(csv.lines().nth(2).unwrap().starts_with("hdl-64e,2,"), "{csv}");
}

#[test]
fn other_scores_need_no_new_scans() {
    let desk = Desk::new();
    good(&desk, &format!("{TINY} {MARKS} --seeds 2 -o out"));
    let before = jobs(&desk, "out");
    good(&desk, &format!("{TINY} {MARKS} --seeds 2 --score busy -o out"));
    assert_eq!(jobs(&desk, "out"), before);
    assert!(cell(&read(&desk, "out/sweep.csv"), 0, "busy") > 1.0);
}

#[test]
fn an_empty_point_says_where_the_light_went() {
    let desk = Desk::new();
    let line = "sweep peregrine --scene wall --vary scan.max_range_m=20,60 --seeds 1 -o out --json";
    let ran = desk.run(line);
    assert_eq!(ran.code, Some(0));
    let sentence = "1 of 2 rows of the table are without a single return: no ray met";
    assert!(ran.err.contains(sentence), "{}", ran.err);
    assert!(read(&desk, "out/manifest.json").contains(sentence));
    let sweep: Value = serde_json::from_str(&ran.out).unwrap();
    assert!(sweep["rows"][0]["empty"].is_string() && sweep["rows"][1]["empty"].is_null());
    assert!(sweep["rows"][0]["pd"]["value"].is_null());
}

#[test]
fn wrong_input_is_one_sentence() {
    let desk = Desk::new();
    let refused =
        |rest: &str, words: &[&str]| desk.refused(&format!("{TINY} -o out {rest}"), words);
    refused(
        "--vary scan.max_rnage_m=50,60",
        &["scan.max_rnage_m = 50", "did you mean `max_range_m`?"],
    );
    refused("--vary scan.max_range_m=50,-1", &["scan.max_range_m = -1", "between"]);
    refused("--vary scan.max_range_m=50,nan", &["--vary", "nan cannot be a value", "a list as"]);
    refused("--vary scan.max_range_m=", &["--vary", "a key and its values are wanted"]);
    refused("--vary scan.max_range_m=50..200:1000000000", &["--vary", "2 to 1000 values"]);
    refused("--vary scan.max_range_m=50..200", &["how many values", "50..200:7"]);
    refused("--vary code.label_bits=8..9:3", &["code.label_bits = 8.5"]);
    refused(&format!("{MARKS} --score pd,precsion"), &["precsion", "did you mean `precision`?"]);
    refused(&format!("{MARKS} --shard 5/4"), &["--shard", "no shard 5/4", "1/4 to 4/4"]);
    refused(&format!("{MARKS} --seeds 0"), &["--seeds"]);
    refused(&format!("{MARKS} --seeds 1000000000"), &["--seeds"]);
    refused(&format!("{MARKS} --shots 0"), &["--shots"]);
    refused("", &["nothing is varied"]);
    refused(
        &format!("{MARKS} --vary tdc.bits=8,9 --vary code.label_bits=9,10"),
        &["more than two"],
    );
    refused(
        "--vary scene:object.wal.position_m.x=1,2",
        &["nothing in it is called `wal`", "`wall`"],
    );
    desk.refused("sweep --scene wall --vary tdc.bits=8,9 -o out", &["SENSOR", "sweep --help"]);
    desk.refused(
        "sweep --sensors peregrine,perigrine --scene wall -o out",
        &["did you mean `peregrine`"],
    );
    desk.refused(
        &format!("sweep peregrine --scene wal {MARKS} -o out"),
        &["did you mean \"wall\"?"],
    );
}

#[test]
fn a_folder_belongs_to_one_sweep() {
    let desk = Desk::new();
    good(&desk, &format!("{TINY} {MARKS} --seeds 2 -o out"));
    let words =
        ["out holds another sweep (of detector.photon-counting.missed_marks)", "choose another"];
    desk.refused(&format!("{TINY} {MARKS} --seeds 3 -o out"), &words);
    desk.refused(&format!("{TINY} --vary tdc.converters=50,60 --seeds 2 -o out"), &words);
    good(&desk, "simulate --sensor peregrine --scene wall -o run");
    desk.refused(&format!("{TINY} {MARKS} -o run"), &["run holds the results of another run"]);
    desk.put("file", "");
    desk.refused(&format!("{TINY} {MARKS} -o file"), &["file", "choose another folder"]);
    desk.refused(
        &format!("{TINY} {MARKS} -o file/below"),
        &["file/below", "choose another folder"],
    );
}

#[test]
fn a_damaged_job_is_named() {
    let desk = Desk::new();
    let line = format!("{TINY} {MARKS} --seeds 2 -o out");
    good(&desk, &line);
    let job = format!("out/jobs/{}", jobs(&desk, "out")[0]);
    let whole = read(&desk, &job);
    let more = whole.replacen("\"dark\": 0", "\"dark\": 99999", 1);
    assert!(whole != more);
    for damaged in ["", "{}", &whole[..whole.len() / 2], &more] {
        fs::write(desk.path().join(&job), damaged).unwrap();
        desk.refused(&line, &[&job, "delete it, and it is measured again"]);
    }
    fs::remove_file(desk.path().join(&job)).unwrap();
    good(&desk, &line);
    assert_eq!(read(&desk, &job), whole);
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_whole_jobs_and_no_table() {
    use std::io::{BufRead, BufReader, Read};
    use std::process::{Command, Stdio};

    let desk = Desk::new();
    let line = format!("{TINY} {MARKS} --seeds 10000 --progress json -o out");
    let mut program =
        desk.command(&line).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut told = BufReader::new(program.stderr.take().unwrap());
    told.read_line(&mut String::new()).unwrap();
    let id = program.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let mut rest = String::new();
    told.read_to_string(&mut rest).unwrap();
    assert_eq!(program.wait().unwrap().code(), Some(130), "{rest}");
    assert!(rest.contains("of 30 000 scans are missing; the same command goes on"), "{rest}");
    assert!(!Path::new(&desk.path().join("out/sweep.csv")).exists());
    for job in jobs(&desk, "out") {
        let counted: Value =
            serde_json::from_str(&read(&desk, &format!("out/jobs/{job}"))).unwrap();
        assert_eq!(counted["job"], job.trim_end_matches(".json"));
    }
}
