//! The memory that is estimated for a run, beside what the run takes; and the limit on it.
#![cfg(target_os = "linux")]
#![allow(missing_docs, clippy::unwrap_used)]

use crate::common;

use std::process::Command;

use common::Desk;

/// An estimate is of use between these shares of what is taken.
const NEAR: std::ops::RangeInclusive<f64> = 0.7..=1.5;

/// Starts what its arguments say, and prints the most memory that it has had, KiB.
const MEASURE: &str = "import resource, subprocess, sys
ended = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
sys.exit(ended.returncode)";

const THREADS: u32 = 2;

/// Returns the memory estimated for a run of `sensor` in `scene` with two threads, and the memory that it
/// takes, bytes.
fn memory(desk: &Desk, sensor: &str, scene: &str) -> (f64, f64) {
    let text = format!("version = 1\nsensor = \"{sensor}\"\nscene = \"{scene}\"\n");
    desk.put("s.toml", &text);
    let said = desk.json(&format!("check s.toml --json -j {THREADS} --memory-limit 1TB"));
    let estimated = said["memory"]["total_bytes"].as_f64().unwrap();
    let line = format!("simulate {sensor} {scene} -q -o out --memory-limit 1TB -j {THREADS}");
    (estimated, taken(desk, &line))
}

/// The most memory that a run of the program takes, bytes.
fn taken(desk: &Desk, line: &str) -> f64 {
    let mut command = Command::new("python3");
    command.args(["-c", MEASURE, env!("CARGO_BIN_EXE_macropulse")]).current_dir(desk.path());
    let ran = command.args(line.split_whitespace()).output().unwrap();
    assert!(ran.status.success(), "{line}: {}", String::from_utf8_lossy(&ran.stderr));
    let kibibytes: f64 = String::from_utf8(ran.stdout).unwrap().trim().parse().unwrap();
    kibibytes * 1024.0
}

#[test]
fn an_estimate_is_near_what_a_run_takes() {
    let desk = Desk::new();
    for sensor in ["peregrine", "vlp-16", "hdl-64e", "rosette-mid-40", "kim-park-2016"] {
        for scene in ["wall", "street"] {
            let (estimated, taken) = memory(&desk, sensor, scene);
            let (ratio, taken) = (estimated / taken, taken * 1e-6);
            assert!(
                NEAR.contains(&ratio),
                "{sensor} in {scene}: {taken:.1} MB, {ratio:.2} estimated"
            );
        }
    }
}

/// Prints the table of docs/hardening.md. An estimate may be too high, as for coded-360 at the wall, where
/// most shots miss. An estimate that is too low would break the limit.
#[test]
#[ignore = "slow: before a release"]
fn every_sensor_takes_about_what_is_estimated() {
    let desk = Desk::new();
    println!("| sensor | scene | estimated, MB | taken, MB | ratio |\n|---|---|---|---|---|");
    let listed = desk.json("sensors --json");
    let sensors =
        listed["sensors"].as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap());
    for sensor in sensors.filter(|sensor| *sensor != "kim-park-2016-physical") {
        for scene in ["wall", "street", "crossing"] {
            let (estimated, taken) = memory(&desk, sensor, scene);
            let ratio = estimated / taken;
            println!(
                "| `{sensor}` | `{scene}` | {:.0} | {:.0} | {ratio:.2} |",
                estimated * 1e-6,
                taken * 1e-6
            );
            assert!(ratio >= *NEAR.start(), "{sensor} in {scene}: {ratio:.2}");
        }
    }
}

#[test]
fn what_takes_too_much_is_refused_before_it_is_begun() {
    let desk = Desk::new();
    let dark = "--set detector.photon-counting.dark_counts_hz=1e12";
    for (line, words) in [
        (
            "simulate kim-park-2016-fixed wall -o out --memory-limit 160MB -j 8",
            ["as -j ", "allowed"],
        ),
        (
            &format!("simulate kim-park-2016-fixed wall -o out --memory-limit 1GB -j 1 {dark}"),
            ["with 1 thread", "less noise"],
        ),
        ("check kim-park-2016-physical --memory-limit 1GB -j 2", ["with 1 thread", "less noise"]),
        ("check street --memory-limit 1MB", ["street", "fewer triangles"]),
        (
            "sweep vlp-16 wall --vary tdc.converters=16,32 -o out --memory-limit 15MB",
            ["vlp-16 in wall", "fewer pixels"],
        ),
        ("check vlp-16 --memory-limit lots", ["--memory-limit", "as 2GB"]),
    ] {
        desk.refused(line, &words);
    }
    let ran = desk.run("simulate peregrine wall --format none --memory-limit 100MB");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
}

/// A mesh that does not fit is refused while it is read, not when the memory is spent.
#[test]
fn a_mesh_is_not_read_beyond_the_limit() {
    let desk = Desk::new();
    let corners = "v 0 0 0\nv 0 1 0\nv 0 0 1\n";
    let faces = "f 1 2 3\n".repeat(3_000_000);
    let vertices = "v 0 0 0\n".repeat(6_000_000);
    let solid =
        "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet\n";
    desk.put("late.obj", &format!("{corners}{faces}"));
    desk.put("early.obj", &format!("{faces}{corners}"));
    desk.put("loose.obj", &format!("{vertices}f 1 2 3\n"));
    desk.put("a.stl", &format!("solid a\n{}endsolid a\n", solid.repeat(500_000)));
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\nelement face 500000\nproperty list uchar int vertex_indices\n\
               end_header\n0 0 0\n0 1 0\n0 0 1\n";
    desk.put("a.ply", &format!("{ply}{}", "3 0 1 2\n".repeat(500_000)));
    for mesh in ["late.obj", "early.obj", "loose.obj", "a.stl", "a.ply"] {
        desk.put(
            "s.toml",
            &format!("version = 1\n[[object]]\nmesh = {mesh:?}\nmaterial = \"white\"\n"),
        );
        for line in [
            "check s.toml --memory-limit 100MB",
            "simulate peregrine s.toml -o out --memory-limit 100MB",
            "sweep peregrine s.toml --vary tdc.bits=8,9 -o out --memory-limit 100MB",
        ] {
            desk.refused(line, &[mesh, "holds more than", "--memory-limit"]);
        }
        let limited = format!(
            "ulimit -v 400000; MALLOC_ARENA_MAX=1 exec {:?} check s.toml -j 1 --memory-limit 100MB",
            env!("CARGO_BIN_EXE_macropulse")
        );
        let mut command = Command::new("sh");
        let ended = command.args(["-c", &limited]).current_dir(desk.path()).output().unwrap();
        assert_eq!(ended.status.code(), Some(2), "{mesh}: {ended:?}");
    }
}

#[test]
fn what_is_estimated_is_told() {
    let desk = Desk::new();
    let told = desk.run("check vlp-16 -j 3").out;
    assert!(told.contains("memory of a run") && told.contains("with 3 threads"), "{told}");
    let said = desk.json("check street --json");
    assert_eq!(said["memory"]["total_bytes"], said["memory"]["scene_bytes"]);
    let parts = desk.json("check vlp-16 --json -j 3")["memory"].clone();
    let part = |name: &str| parts[name].as_u64().unwrap();
    let sum = part("sensor_bytes") + part("scan_bytes") + 3 * part("band_bytes_per_thread");
    assert_eq!(part("total_bytes"), sum);
}

/// A compressed cloud is small, whatever it holds: its points are counted before they are read.
#[test]
fn a_cloud_is_not_read_beyond_the_limit() {
    use macropulse::formats::{Format, Names, write_cloud};
    use macropulse::points::PointCloud;

    const POINTS: usize = 300_000;
    let desk = Desk::new();
    let same = || vec![1.0_f32; POINTS];
    let cloud = PointCloud { x: same(), y: same(), z: same(), ..PointCloud::default() };
    for (format, name) in [(Format::Laz, "same.laz"), (Format::Npy, "same.npy")] {
        write_cloud(format, &cloud, &Names::default(), &desk.path().join(name)).unwrap();
    }
    let text = "0 0 1\n".repeat(POINTS);
    desk.put("same.xyz", &text);
    assert!(std::fs::metadata(desk.path().join("same.laz")).unwrap().len() < 100_000);
    for name in ["same.laz", "same.npy", "same.xyz"] {
        for line in [format!("convert {name} -o out.ply"), format!("view {name} -o out.html")] {
            let ran = desk.run(&format!("{line} --memory-limit 60MB"));
            assert_eq!(ran.code, Some(2), "{line}: {}", ran.err);
            assert!(ran.err.contains("points take about"), "{line}: {}", ran.err);
            assert!(ran.err.contains("allow more memory (--memory-limit)"), "{}", ran.err);
        }
        let ran = desk.run(&format!("convert {name} -o {name}.ply --memory-limit 80MB"));
        assert_eq!(ran.code, Some(0), "{}", ran.err);
    }
}

/// Fields that are not read take no memory: the files here are larger than the limit.
#[test]
fn a_cloud_is_read_a_part_at_a_time() {
    const POINTS: usize = 100_000;
    const BESIDE: usize = 1000;
    let desk = Desk::new();
    let point = [1.0_f32, 2.0, 2.0].map(f32::to_le_bytes).concat();
    let beside = vec![b'7'; BESIDE];
    let pcd = format!(
        "VERSION 0.7\nFIELDS x y z more\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 {BESIDE}\n\
         WIDTH {POINTS}\nHEIGHT 1\nDATA binary\n"
    );
    let points = [&point[..], &beside].concat().repeat(POINTS);
    std::fs::write(desk.path().join("a.pcd"), [pcd.as_bytes(), &points].concat()).unwrap();
    let ply = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {POINTS}\nproperty float x\n\
         property float y\nproperty float z\nproperty list ushort uchar more\nend_header\n"
    );
    let count = (BESIDE as u16).to_le_bytes();
    let points = [&point[..], &count, &beside].concat().repeat(POINTS);
    std::fs::write(desk.path().join("a.ply"), [ply.as_bytes(), &points].concat()).unwrap();
    let text = "7".repeat(BESIDE);
    desk.put("a.csv", &format!("x,y,z,more\n{}", format!("1,2,2,{text}\n").repeat(POINTS)));
    desk.put("a.xyz", &format!("x y z more\n{}", format!("1 2 2 {text}\n").repeat(POINTS)));
    for name in ["a.pcd", "a.ply", "a.csv", "a.xyz"] {
        let line = format!("convert {name} -o {name}.npy -q --memory-limit 60MB");
        let taken = taken(&desk, &line);
        assert!(taken < 60e6, "{name}: {:.1} MB", taken * 1e-6);
    }
}

/// Points with every attribute take no more than they are counted for.
#[test]
fn points_take_what_is_left_for_them() {
    use macropulse::formats::{Format, Names, write_cloud};
    use macropulse::points::{Outcome, PointCloud, Surfaces, Truth};

    const POINTS: usize = 500_000;
    let desk = Desk::new();
    let metres = || (0..POINTS).map(|at| 3.0 + at as f32 * 1e-4).collect::<Vec<f32>>();
    let numbers = || (0..POINTS).map(|at| at as u16 % 100).collect::<Vec<u16>>();
    let ones = || vec![1_u8; POINTS];
    let returns = Surfaces {
        range: metres(),
        object: numbers(),
        material: numbers(),
        cosine: vec![0.5; POINTS],
        outcome: vec![Outcome::Right; POINTS],
    };
    let cloud = PointCloud {
        row: numbers(),
        column: numbers(),
        x: metres(),
        y: metres(),
        z: metres(),
        range: metres(),
        intensity: metres(),
        time_ns: (0..POINTS).map(|at| at as f64 * 0.1).collect(),
        peak: numbers(),
        marks: numbers(),
        margin: numbers(),
        return_number: ones(),
        number_of_returns: ones(),
        truth: Truth { returns, ..Truth::default() },
        ..PointCloud::default()
    };
    for (format, name) in [(Format::Npy, "all.npy"), (Format::Csv, "all.csv")] {
        write_cloud(format, &cloud, &Names::default(), &desk.path().join(name)).unwrap();
    }
    let left = 30e6 + 130.0 * POINTS as f64;
    for (from, to) in [
        ("all.npy", "all.las"),
        ("all.npy", "all.e57"),
        ("all.csv", "csv.npy"),
        ("all.las", "las.laz"),
        ("all.e57", "e57.html"),
    ] {
        let verb = if to.ends_with("html") { "view" } else { "convert" };
        let taken = taken(&desk, &format!("{verb} {from} -o {to} -q"));
        assert!(taken < left, "{from} to {to}: {:.1} of {:.1} MB", taken * 1e-6, left * 1e-6);
    }
}
