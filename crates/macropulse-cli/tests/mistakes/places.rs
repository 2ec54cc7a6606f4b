//! Places that take no files: they are the machine's fault, not that of whoever named them (exit code
//! 1), unless another run is at work there. Nothing half-written is left.
#![cfg(target_os = "linux")]

use std::fs::{self, OpenOptions};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::{Desk, THEIRS};

const FEW: &str = "--set scan.raster.rows=4 --set scan.raster.columns=200";

/// A desk with a cloud, and with shots and ticks.
fn desk() -> Desk {
    let desk = Desk::new();
    let recorded =
        format!("simulate kim-park-2016-fixed car-30m {FEW} --format csv,ticks -o in -q");
    assert_eq!(desk.run(&recorded).code, Some(0));
    desk
}

/// Runs `line` by a shell, after what it says `before`; gives the exit code and what is told.
fn run(desk: &Desk, before: &str, line: &str) -> (Option<i32>, String) {
    let script = format!("{before} exec {} {line}", env!("CARGO_BIN_EXE_macropulse"));
    let mut shell = Command::new("sh");
    let ran = shell.current_dir(desk.path()).args(["-c", &script]).output().unwrap();
    (ran.status.code(), String::from_utf8(ran.stderr).unwrap())
}

/// Commands that write more than 4 KB.
fn writers() -> Vec<String> {
    let decode = format!("decode --sensor kim-park-2016-fixed {FEW} in/shots-000000.mps");
    vec![
        format!("simulate kim-park-2016-fixed car-30m {FEW} -o out -q"),
        format!("simulate kim-park-2016-fixed car-30m {FEW} --format laz -o out -q"),
        format!("simulate kim-park-2016-fixed car-30m {FEW} --format ticks -o out -q"),
        format!("encode kim-park-2016-fixed {FEW} -o out -q"),
        format!("{decode} in/ticks-000000.mpt -o out -q"),
        "convert in/scan-000000.csv -o out.pcd -q".to_owned(),
        "view in/scan-000000.csv -o out.html -q".to_owned(),
        "codes prime=29 -o out -q".to_owned(),
        "budget coded-practical -o out -q".to_owned(),
    ]
}

/// Each of `lines` is refused by the machine with `words`, in one sentence, and leaves nothing.
fn not_taken(desk: &Desk, before: &str, lines: &[String], words: &[&str]) {
    let files = desk.files();
    for line in lines {
        let (code, err) = run(desk, before, line);
        assert_eq!((code, err.lines().count()), (Some(1), 1), "{line}: {err}");
        assert!(err.starts_with("macropulse: cannot write "), "{line}: {err}");
        for word in words {
            assert!(err.contains(word), "{line}: no {word:?} in {err}");
        }
        assert!(!THEIRS.iter().any(|theirs| err.contains(theirs)), "{line}: {err}");
        assert_eq!(desk.files(), files, "{line}");
    }
}

/// As a full disk does, a limit to the length of files ends a write in its middle.
#[test]
fn files_that_may_not_grow() {
    let before = "trap '' XFSZ; ulimit -f 8;";
    let words = ["out", "a file may not be as large as this here; make room"];
    not_taken(&desk(), before, &writers(), &words);
}

/// A disk of 64 KB, where users may mount one.
#[test]
fn a_full_disk() {
    let desk = desk();
    fs::create_dir(desk.path().join("disk")).unwrap();
    let before = "mount -t tmpfs -o size=64k none disk && head -c 64k /dev/zero > disk/full;";
    let outside = format!("unshare -rm sh -c '{before}'");
    if !Command::new("sh")
        .current_dir(desk.path())
        .args(["-c", &outside])
        .status()
        .unwrap()
        .success()
    {
        eprintln!("NOT TESTED: a full disk, for want of leave to mount one");
        return;
    }
    for line in writers() {
        let line = line.replace(" out", " disk/out");
        let script = format!(
            "{before} {} {line}; code=$?; ls -A disk >&2; exit $code",
            env!("CARGO_BIN_EXE_macropulse")
        );
        let mut command = Command::new("unshare");
        let command = command.current_dir(desk.path()).args(["-rm", "sh", "-c", &script]);
        let ran = command.output().unwrap();
        let err = String::from_utf8(ran.stderr).unwrap();
        let [told, left] = err.lines().collect::<Vec<_>>()[..] else { panic!("{line}: {err}") };
        assert_eq!((ran.status.code(), left), (Some(1), "full"), "{line}: {err}");
        assert!(told.contains("disk/out") && told.contains("the disk is full"), "{line}: {told}");
    }
}

#[test]
fn standard_output_that_is_full() {
    let desk = desk();
    for line in [
        "encode kim-park-2016 --pixel 0,1",
        "simulate peregrine wall --format none --json",
        "sensors peregrine",
        &format!(
            "decode --sensor kim-park-2016-fixed {FEW} in/shots-000000.mps in/ticks-000000.mpt -o -"
        ),
    ] {
        let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
        let ran = desk.command(line).stdout(full).output().unwrap();
        let told = String::from_utf8(ran.stderr).unwrap();
        let wanted = "macropulse: cannot write to standard output: the disk is full\n";
        assert_eq!((ran.status.code(), told.as_str()), (Some(1), wanted), "{line}");
    }
}

/// A folder that takes nothing, whoever asks.
#[test]
fn a_folder_that_is_closed() {
    let to_sys = |line: String| line.replace("-o out", "-o /sys/out");
    let mut lines: Vec<String> = writers().into_iter().map(to_sys).collect();
    lines.push("sweep peregrine wall --vary scan.max_range_m=10,20 -o /sys/out -q".to_owned());
    not_taken(&desk(), "", &lines, &["/sys"]);
}

/// The second of two runs in one folder is refused as long as the first one writes.
#[test]
fn two_runs_in_one_folder() {
    let desk = Desk::new();
    let mut first = desk.command("simulate peregrine wall --scans 100000 --format mcap -o out");
    let mut first = first.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let until = Instant::now() + Duration::from_secs(60);
    while !desk.path().join("out/scans.mcap").exists() {
        assert!(Instant::now() < until && first.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(20));
    }
    let second = "simulate peregrine wall --format mcap -o out -q";
    let refused = desk.run(second);
    let elsewhere = desk.run("simulate peregrine wall --format mcap -o out/of-its-own -q");
    first.kill().unwrap();
    first.wait().unwrap();
    assert_eq!((refused.code, refused.err.lines().count()), (Some(2), 1), "{}", refused.err);
    let told =
        "another run is writing into the folder out; give this one a folder of its own with -o";
    assert!(refused.err.contains(told), "{}", refused.err);
    assert_eq!(elsewhere.code, Some(0), "{}", elsewhere.err);
    // The control: what the first one has left is no lock.
    let again = desk.run(second);
    assert_eq!(again.code, Some(0), "{}", again.err);
}
