//! Files that a run leaves in a folder, however it ends: whole files, and a manifest that describes no others
//! than its own.
#![cfg(unix)]
#![allow(missing_docs, clippy::unwrap_used)]

use crate::common;

use std::fs;
use std::process::Stdio;
use std::time::{Duration, Instant};

use common::Desk;
use serde_json::Value;

fn manifest(desk: &Desk) -> Value {
    let text = fs::read_to_string(desk.path().join("out/manifest.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// Starts `line` and kills it when its fifth scan is there.
fn killed(desk: &Desk, line: &str) {
    let mut child = desk.command(line).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let began = Instant::now();
    while !desk.path().join("out/scan-000004.pcd").exists() {
        assert!(began.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_killed_run_leaves_no_manifest_that_describes_an_older_one() {
    let desk = Desk::new();
    desk.run("simulate peregrine wall -o out --seed 1 --scans 2 --format pcd -q");
    let first = manifest(&desk);
    assert_eq!(first["state"], "finished");
    assert_eq!(first["files"].as_array().unwrap().len(), 3);
    killed(&desk, "simulate peregrine street -o out --seed 9 --scans 100000 --format pcd -q");
    let left = manifest(&desk);
    assert_eq!(left["state"], "running");
    assert_eq!((&left["seed"], &left["scene"]["name"]), (&9.into(), &"street".into()));
    assert_eq!(left["files"], Value::Array(Vec::new()));
    assert!(left["warnings"].to_string().contains("of an older run (2 in all)"), "{left:#}");
    // Every cloud that has its name is whole.
    let clouds = desk.files().into_iter().filter(|file| file.ends_with(".pcd"));
    for cloud in clouds {
        let ran = desk.run(&format!("convert {cloud} -o whole.csv -q"));
        assert_eq!(ran.code, Some(0), "{cloud}: {}", ran.err);
    }
    // Who looks at it is told.
    let looked = desk.run("view out -o page.html");
    assert_eq!(looked.code, Some(0), "{}", looked.err);
    assert!(looked.err.contains("was killed"), "{}", looked.err);
}

#[test]
fn the_next_run_clears_what_a_killed_one_has_left_and_names_its_clouds() {
    let desk = Desk::new();
    killed(&desk, "simulate peregrine street -o out --scans 100000 --format pcd -q");
    desk.put("out/.macropulse-Ab12Cd.part", "half a cloud");
    let ran = desk.run("simulate peregrine wall -o out --format pcd");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains("of an older run"), "{}", ran.err);
    assert!(!desk.files().iter().any(|file| file.ends_with(".part")), "{:?}", desk.files());
    let left = manifest(&desk);
    assert_eq!(left["state"], "finished");
    assert_eq!(left["scene"]["name"], "wall");
    let files: Vec<&str> =
        left["files"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert_eq!(files, ["scan-000000.pcd", "index.html"]);
}

#[test]
fn a_run_that_is_stopped_says_so() {
    let desk = Desk::new();
    let line = "simulate peregrine street -o out --scans 100000 --format pcd -q";
    let mut child = desk.command(line).stderr(Stdio::null()).spawn().unwrap();
    let began = Instant::now();
    while !desk.path().join("out/scan-000004.pcd").exists() {
        assert!(began.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(1));
    }
    let signalled =
        std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(signalled.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let left = manifest(&desk);
    assert_eq!(left["state"], "stopped");
    let named = left["files"].as_array().unwrap().len();
    assert_eq!(named, left["counts"]["scans"].as_u64().unwrap() as usize + 1);
    assert!(
        left["files"]
            .as_array()
            .unwrap()
            .iter()
            .all(|file| { desk.path().join("out").join(file.as_str().unwrap()).exists() })
    );
}

#[test]
fn a_full_disk_and_a_folder_that_is_read_only_are_no_fault_of_the_user() {
    let desk = Desk::new();
    // A file may have 64 KiB here: a cloud is larger.
    let script = format!(
        "ulimit -f 64; exec {} simulate vlp-16 street -o out --format pcd",
        env!("CARGO_BIN_EXE_macropulse")
    );
    let mut command = std::process::Command::new("bash");
    let ran = command.args(["-c", &script]).current_dir(desk.path()).output().unwrap();
    let told = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(1), "{told}");
    assert!(told.contains("scan-000000.pcd") && told.lines().count() == 1, "{told}");
    assert!(desk.files().is_empty(), "{:?}", desk.files());
    let full =
        desk.command("sensors vlp-16").stdout(fs::File::create("/dev/full").unwrap()).output();
    let full = full.unwrap();
    assert_eq!(full.status.code(), Some(1));
    assert!(String::from_utf8(full.stderr).unwrap().contains("the disk is full"));
    // Nothing can be made in it, whoever asks.
    let ran = desk.run("simulate peregrine wall -o /proc/out --format pcd");
    assert!(ran.code != Some(0) && ran.err.contains("/proc/out"), "{}", ran.err);
}

#[test]
fn run_that_fails_says_so_in_its_manifest() {
    let desk = Desk::new();
    fs::create_dir(desk.path().join("out")).unwrap();
    let script = format!(
        "ulimit -f 64; exec {} simulate vlp-16 street -o out --format pcd",
        env!("CARGO_BIN_EXE_macropulse")
    );
    let mut command = std::process::Command::new("bash");
    let ran = command.args(["-c", &script]).current_dir(desk.path()).output().unwrap();
    assert_eq!(ran.status.code(), Some(1));
    assert_eq!(manifest(&desk)["state"], "failed");
    assert_eq!(desk.files(), ["out", "out/manifest.json"]);
}

/// Starts the words of `line` in a shell, and waits for its fifth scan.
fn begun(desk: &Desk, script: &str) -> std::process::Child {
    let line = "simulate peregrine street -o out --scans 100000 --format pcd -q --no-page";
    let script = format!("{script}; exec {} {line}", env!("CARGO_BIN_EXE_macropulse"));
    let mut command = std::process::Command::new("bash");
    command.args(["-c", &script]).current_dir(desk.path()).stderr(Stdio::null());
    let child = command.spawn().unwrap();
    there_is(desk, "out/scan-000004.pcd");
    child
}

/// Waits for a file.
fn there_is(desk: &Desk, file: &str) {
    let began = Instant::now();
    while !desk.path().join(file).exists() {
        assert!(began.elapsed() < Duration::from_secs(60), "{file}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn signal_that_is_inherited_as_ignored_stays_ignored() {
    let desk = Desk::new();
    let mut child = begun(&desk, "trap '' HUP INT");
    let send = |signal: &str| {
        let kill =
            std::process::Command::new("kill").args([signal, &child.id().to_string()]).status();
        assert!(kill.unwrap().success());
    };
    send("-HUP");
    send("-INT");
    // It goes on, with several scans that it had not begun.
    let written = desk.files().len();
    there_is(&desk, &format!("out/scan-{:06}.pcd", written + 20));
    send("-TERM");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(manifest(&desk)["state"], "stopped");
}

#[test]
fn standard_error_that_goes_away_ends_no_run() {
    let desk = Desk::new();
    let line = "simulate peregrine wall --scans 3 --format pcd --progress json -o out";
    // Nobody reads what is said.
    let mut child =
        desk.command(line).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert_eq!(manifest(&desk)["state"], "finished");
    let full = || fs::File::options().write(true).open("/dev/full").unwrap();
    let ended = |line: &str| desk.command(line).stderr(full()).output().unwrap().status.code();
    assert_eq!(ended(line), Some(0));
    assert_eq!(ended("simulate"), Some(2));
    assert_eq!(ended("no-such-command"), Some(2));
}

#[test]
fn reader_that_has_seen_enough_ends_a_run_quietly() {
    let desk = Desk::new();
    desk.run("simulate peregrine street --format ticks -o out -q");
    let program = env!("CARGO_BIN_EXE_macropulse");
    let script = format!(
        "set -o pipefail; {program} decode --sensor peregrine out/shots-000000.mps \
         out/ticks-000000.mpt -o - | head -1"
    );
    let mut command = std::process::Command::new("bash");
    let ran = command.args(["-c", &script]).current_dir(desk.path()).output().unwrap();
    let told = String::from_utf8(ran.stderr).unwrap();
    assert_eq!((ran.status.code(), told.as_str()), (Some(0), ""));
    assert!(ran.stdout.starts_with(b"x_m,"));
}

#[test]
fn page_is_written_where_there_are_clouds_and_it_is_wanted() {
    let desk = Desk::new();
    let files = |line: &str| {
        assert_eq!(desk.run(line).code, Some(0), "{line}");
        let mut files = desk.files();
        files.retain(|file| file.starts_with("out/"));
        fs::remove_dir_all(desk.path().join("out")).unwrap();
        files
    };
    let wall = "simulate peregrine wall -o out";
    assert_eq!(files(&format!("{wall} --format none")), ["out/manifest.json"]);
    let without = ["out/manifest.json", "out/scan-000000.pcd"];
    assert_eq!(files(&format!("{wall} --format pcd --no-page")), without);
    let explained = files(&format!("{wall} --format none --explain 3,4"));
    assert!(explained.contains(&"out/index.html".to_owned()), "{explained:?}");
    assert_eq!(desk.run(&format!("{wall} --format pcd --scans 12")).code, Some(0));
    let html = fs::read_to_string(desk.path().join("out/index.html")).unwrap();
    assert!(html.contains("id=\"scan-9\"") && !html.contains("id=\"scan-10\""));
    assert!(html.contains("2 clouds are not in it"));
}

#[test]
fn run_replaces_its_own_files_and_none_of_a_user() {
    let desk = Desk::new();
    let line = "simulate peregrine wall --format npy,pcd -o out";
    assert_eq!(desk.run(line).code, Some(0));
    assert_eq!(desk.run(line).code, Some(0));
    for (name, text) in [
        ("index.html", "<title>mine</title>"),
        ("manifest.json", "{\"name\": \"app\"}"),
        ("scan-000000.pcd", "VERSION 0.7\n"),
    ] {
        let folder = desk.path().join("mine");
        fs::create_dir(&folder).unwrap();
        desk.put(&format!("mine/{name}"), text);
        let words = [name, "not known to be written by macropulse", "another folder"];
        desk.refused("simulate peregrine wall --format npy,pcd -o mine", &words);
        assert_eq!(fs::read_to_string(folder.join(name)).unwrap(), text);
        // A run leaves files alone that it does not write.
        desk.put("mine/scan-000007.pcd", "mine");
        fs::remove_file(folder.join(name)).unwrap();
        assert_eq!(desk.run("simulate peregrine wall --format pcd -o mine").code, Some(0));
        assert_eq!(fs::read_to_string(folder.join("scan-000007.pcd")).unwrap(), "mine");
        fs::remove_dir_all(folder).unwrap();
    }
    for line in ["budget hdl-64e -o mine", "codes prime=5 -o mine"] {
        fs::create_dir(desk.path().join("mine")).unwrap();
        let name = if line.starts_with("budget") { "budget.html" } else { "index.html" };
        desk.put(&format!("mine/{name}"), "mine");
        desk.refused(line, &[name, "not known"]);
        fs::remove_file(desk.path().join("mine").join(name)).unwrap();
        assert_eq!((desk.run(line).code, desk.run(line).code), (Some(0), Some(0)), "{line}");
        fs::remove_dir_all(desk.path().join("mine")).unwrap();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn names_need_not_be_utf_8() {
    use std::ffi::{OsStr, OsString};
    use std::os::unix::ffi::OsStrExt;
    let desk = Desk::new();
    let odd = |ending: &str| {
        let mut name = OsStr::from_bytes(b"\xe9t\xff").to_os_string();
        name.push(ending);
        name
    };
    let put = |name: OsString, text: &str| fs::write(desk.path().join(name), text).unwrap();
    let ran = |line: &[&OsStr]| {
        let ran = desk.command("").args(line).output().unwrap();
        let told = String::from_utf8_lossy(&ran.stderr).into_owned();
        assert_eq!(ran.status.code(), Some(0), "{line:?}: {told}");
    };
    put(odd("-s.toml"), &desk.run("sensors peregrine").out);
    put(odd("-w.toml"), &desk.run("scenes wall").out);
    put(odd("-r.toml"), "version = 1\nsensor = \"peregrine\"\nscene = \"wall\"\n");
    let of = OsStr::new;
    let (sensor, scene, run) = (&odd("-s.toml"), &odd("-w.toml"), &odd("-r.toml"));
    let (out, again) = (&odd("-out"), &odd("-again"));
    ran(&[of("check"), sensor, scene, run]);
    ran(&[of("encode"), sensor, of("--pixel"), of("0,1")]);
    ran(&[of("budget"), sensor, of("-o"), &odd("-budget")]);
    ran(&[of("simulate"), sensor, scene, of("-o"), out, of("--format"), of("pcd,ticks")]);
    ran(&[of("simulate"), run, of("-o"), &odd("-run")]);
    let within = |file: &str| {
        let mut path = out.clone();
        path.push("/");
        path.push(file);
        path
    };
    let (shots, ticks) = (within("shots-000000.mps"), within("ticks-000000.mpt"));
    ran(&[of("decode"), of("--sensor"), sensor, &shots, &ticks, of("-o"), again]);
    ran(&[of("convert"), &within("scan-000000.pcd"), of("-o"), &odd("-cloud.ply")]);
    ran(&[of("view"), out, of("-o"), &odd("-page.html")]);
    ran(&[of("view"), &odd("-cloud.ply")]);
    for file in ["-cloud.ply", "-page.html", "-cloud.html", "-again/index.html", "-run/index.html"]
    {
        assert!(desk.path().join(odd(file)).exists(), "{file}");
    }
}
