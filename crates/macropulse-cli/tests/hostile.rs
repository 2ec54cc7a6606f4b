//! Files that would take all memory or all time are refused in a sentence, soon, and in little
//! memory.
#![cfg(target_os = "linux")]
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use crate::common;

use std::fs;
use std::io::Write;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::Desk;

/// The address space that the program may have, KiB: more than the memory that it can fill.
const SPACE: u64 = 500_000;

/// The time that it may take.
const SOON: Duration = Duration::from_secs(2);

const SCENE: &str = "version = 1
[[object]]
name = \"thing\"
mesh = \"MESH\"
unit = \"m\"
up = \"z\"
forward = \"x\"
material = \"white\"
";

/// Runs the program with the words of `line`, and asks for exit code 2, one sentence with all of
/// `words`, and nothing on the disk.
fn refused(desk: &Desk, line: &str, words: &[&str]) {
    let before = desk.files();
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -v {SPACE}; exec \"$@\""), "sh"]);
    command.arg(env!("CARGO_BIN_EXE_macropulse")).args(["-j", "1"]).args(line.split_whitespace());
    command.current_dir(desk.path()).env("MALLOC_ARENA_MAX", "1").stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let began = Instant::now();
    let mut child = command.spawn().unwrap();
    while child.try_wait().unwrap().is_none() {
        if began.elapsed() > 5 * SOON {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("{line}: still at work after {:?}", began.elapsed());
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let took = began.elapsed();
    let ended = child.wait_with_output().unwrap();
    let told = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(2), "{line}: {told}");
    assert_eq!(told.lines().count(), 1, "{line}: {told}");
    assert!(told.starts_with("macropulse: "), "{line}: {told}");
    for word in words {
        assert!(told.contains(word), "{line}: no {word:?} in {told}");
    }
    assert!(took < SOON, "{line}: {took:?}");
    assert_eq!(desk.files(), before, "{line}");
}

/// Every way to name a file that is read, with the file called `NAME.ending`.
fn all_ways(desk: &Desk, name: &str, words: &[&str]) {
    let first = [name];
    let words: Vec<&str> = first.iter().chain(words).copied().collect();
    for ending in ["obj", "stl", "ply", "glb", "gltf"] {
        desk.put("s.toml", &SCENE.replace("MESH", &format!("{name}.{ending}")));
        refused(desk, "check s.toml", &words);
    }
    for line in [
        "check NAME.toml",
        "simulate NAME.toml wall -o out",
        "simulate vlp-16 NAME.toml -o out",
        "simulate NAME.toml -o out",
        "decode --sensor vlp-16 NAME.csv NAME.csv -o out",
    ] {
        refused(desk, &line.replace("NAME", name), &words);
    }
    for ending in ["pcd", "ply", "las", "laz", "csv", "e57", "npy", "ptx", "bin", "mcap"] {
        refused(desk, &format!("view {name}.{ending} -o page.html"), &words);
        refused(desk, &format!("convert {name}.{ending} -o out.pcd"), &words);
    }
}

const ENDINGS: [&str; 15] = [
    "obj", "stl", "ply", "glb", "gltf", "toml", "csv", "pcd", "las", "laz", "e57", "npy", "ptx",
    "bin", "mcap",
];

#[test]
fn a_device_without_an_end() {
    let desk = Desk::new();
    for ending in ENDINGS {
        symlink("/dev/zero", desk.path().join(format!("zero.{ending}"))).unwrap();
    }
    all_ways(&desk, "zero", &["a device"]);
}

/// Findings of fuzzers: files at which a library that reads them panics, and a place so far away that rays
/// met surfaces that are not there.
#[test]
fn damage_that_a_library_panics_at() {
    let desk = Desk::new();
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let put = |found: &str, name: &str| {
        fs::copy(corpus.join(found), desk.path().join(name)).unwrap();
    };
    put("cloud_laz/no-such-symbol", "a.laz");
    refused(&desk, "convert a.laz -o out.pcd", &["a.laz", "its data is damaged"]);
    refused(&desk, "view a.laz -o page.html", &["a.laz", "its data is damaged"]);
    put("cloud_mcap/record-beyond-chunk", "b.mcap");
    refused(&desk, "convert b.mcap -o out.pcd", &["b.mcap"]);
    put("scene/far-away", "c.toml");
    refused(&desk, "simulate vlp-16 c.toml -o out", &["c.toml", "position_m", "1e10 m at most"]);
}

#[test]
fn a_pipe_that_nobody_writes_to() {
    let desk = Desk::new();
    for ending in ENDINGS {
        let made = Command::new("mkfifo").arg(desk.path().join(format!("dry.{ending}"))).status();
        assert!(made.unwrap().success());
    }
    all_ways(&desk, "dry", &["it is a pipe"]);
}

#[test]
fn what_a_sensor_or_a_mesh_names_is_held_to_the_same() {
    let desk = Desk::new();
    symlink("/dev/zero", desk.path().join("zero.csv")).unwrap();
    symlink("/dev/zero", desk.path().join("zero.mtl")).unwrap();
    symlink("/dev/zero", desk.path().join("zero.bin")).unwrap();
    let set = "--set scan.table.file=zero.csv";
    refused(&desk, &format!("check rosette-mid-40 --set scan.pattern=table {set}"), &["scan"]);
    desk.put("a.obj", "mtllib zero.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let scene = SCENE.replace("MESH", "a.obj").replace("material = \"white\"\n", "");
    refused(desk.put("s.toml", &scene), "check s.toml", &["zero.mtl"]);
    let buffers = r#""buffers":[{"uri":"zero.bin","byteLength":400000000}]"#;
    desk.put("a.gltf", &gltf(buffers));
    refused(desk.put("s.toml", &SCENE.replace("MESH", "a.gltf")), "check s.toml", &["zero.bin"]);
}

#[test]
fn a_text_without_an_end() {
    let desk = Desk::new();
    // Files with holes: many bytes that take no room.
    for name in ["long.toml", "long.stl", "long.ply", "long.obj", "long.glb"] {
        fs::File::create(desk.path().join(name)).unwrap().set_len(1 << 36).unwrap();
    }
    for line in
        ["check long.toml", "simulate long.toml wall -o out", "simulate vlp-16 long.toml -o o"]
    {
        refused(&desk, line, &["long.toml", "16 MiB"]);
    }
    for ending in ["stl", "ply", "obj", "glb"] {
        desk.put("s.toml", &SCENE.replace("MESH", &format!("long.{ending}")));
        refused(&desk, "check s.toml", &[&format!("long.{ending}"), "GiB"]);
    }
}

/// The beginning of a file tells that it is not of its kind, however long it is.
#[test]
fn files_of_nothing_but_zeros() {
    let desk = Desk::new();
    let zeros = |name: &str, length| {
        fs::File::create(desk.path().join(name)).unwrap().set_len(length).unwrap();
    };
    for ending in ["pcd", "ply", "las", "laz", "csv", "e57", "npy", "ptx", "mcap"] {
        zeros(&format!("zeros.{ending}"), (8 << 30) - 1);
        refused(&desk, &format!("convert zeros.{ending} -o out.pcd"), &["zeros"]);
    }
    for ending in ["glb", "gltf", "stl", "obj"] {
        zeros(&format!("zeros.{ending}"), (1 << 30) - 1);
        desk.put("s.toml", &SCENE.replace("MESH", &format!("zeros.{ending}")));
        refused(&desk, "check s.toml", &["zeros"]);
    }
}

/// Faces that stand before the vertices of their file are kept until those are there.
#[test]
fn a_mesh_of_millions_of_faces_before_its_vertices() {
    let desk = Desk::new();
    let header = "ply\nformat binary_little_endian 1.0\nelement face 12000000\nproperty list uchar \
                  uchar vertex_indices\nelement vertex 3\nproperty float x\nproperty float y\n\
                  property float z\nend_header\n";
    let body = vec![0; 12_000_000 + 36];
    fs::write(desk.path().join("a.ply"), [header.as_bytes(), &body].concat()).unwrap();
    desk.put("s.toml", &SCENE.replace("MESH", "a.ply"));
    refused(&desk, "check s.toml", &["a.ply", "no triangles"]);
}

#[test]
fn a_text_of_millions_of_values() {
    let desk = Desk::new();
    let copies = "{},".repeat(5_000_000);
    desk.put("s.toml", &format!("version = 1\n[[object]]\ncar = {{}}\ncopies = [{copies}]\n"));
    refused(&desk, "check s.toml", &["s.toml", "more than 2097152 values"]);
    refused(&desk, "simulate vlp-16 s.toml -o out", &["s.toml", "more than 2097152 values"]);
}

#[test]
fn more_elements_than_a_file_has_bytes() {
    let desk = Desk::new();
    let scene = |name: &str| SCENE.replace("MESH", name);
    let tail = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    for (name, format, element) in [
        ("a.ply", "binary_little_endian", "element vertex 4000000000"),
        ("b.ply", "ascii", "element vertex 4000000000"),
        ("c.ply", "binary_big_endian", "element vertex 4000000000\nproperty double x"),
        ("d.ply", "ascii", "element vertex 4000000000\nproperty float x"),
        ("e.ply", "binary_little_endian", "element other 18446744073709551615"),
    ] {
        desk.put(name, &format!("ply\nformat {format} 1.0\n{element}\n{tail}"));
        refused(desk.put("s.toml", &scene(name)), "check s.toml", &[name]);
    }
    // A face that says that it has four thousand million corners.
    let mut face = "ply\nformat binary_little_endian 1.0\nelement vertex 0\nelement face 1\n\
                    property list uint int vertex_indices\nend_header\n"
        .as_bytes()
        .to_vec();
    face.extend(u32::MAX.to_le_bytes());
    fs::write(desk.path().join("f.ply"), face).unwrap();
    refused(desk.put("s.toml", &scene("f.ply")), "check s.toml", &["f.ply"]);
    let mut triangles = vec![0_u8; 80];
    triangles.extend(u32::MAX.to_le_bytes());
    fs::write(desk.path().join("a.stl"), triangles).unwrap();
    refused(desk.put("s.toml", &scene("a.stl")), "check s.toml", &["a.stl"]);
}

#[test]
fn names_that_a_terminal_would_obey() {
    let desk = Desk::new();
    let sensor = desk.run("sensors peregrine").out;
    let named = |name: &str| sensor.replacen("name = \"peregrine\"", &format!("name = {name}"), 1);
    let name = "\"a\\u001b[31m\\u202eb\\u009b\"";
    desk.put("s.toml", &named(name));
    for line in ["check s.toml", "simulate s.toml wall --format none", "budget s.toml"] {
        let ran = desk.run(line);
        assert_eq!(ran.code, Some(0), "{line}: {}", ran.err);
        for told in [&ran.out, &ran.err] {
            assert!(!told.contains(['\u{1b}', '\u{202e}', '\u{9b}']), "{line}: {told}");
        }
    }
    let told = desk.run("simulate s.toml wall --format none --json").out;
    assert!(!told.contains('\u{202e}') && told.contains("\\u202e"));
    let json: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(json["sensor"]["name"], "a\u{1b}[31m\u{202e}b\u{9b}");
    for empty in ["\"\"", "\" \""] {
        refused(
            desk.put("s.toml", &named(empty)),
            "check s.toml",
            &["s.toml:", "name", "is empty"],
        );
    }
}

/// A glTF of one triangle with `keys` of its own.
fn gltf(keys: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},{keys},
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}],
"bufferViews":[{{"buffer":0,"byteLength":36}}]}}"#
    )
}

#[test]
fn nodes_that_double_at_each_level() {
    let desk = Desk::new();
    desk.put("s.toml", &SCENE.replace("MESH", "a.gltf"));
    let zeros = "A".repeat(48);
    let buffer = format!(
        r#""buffers":[{{"uri":"data:application/octet-stream;base64,{zeros}","byteLength":36}}]"#
    );
    for levels in [18, 60] {
        let twice = |level: u32| format!(r#"{{"children":[{0},{0}]}}"#, level + 1);
        let side_by_side =
            |level: u32| format!(r#"{{"children":[{0},{1}]}}"#, 2 * level + 2, 2 * level + 3);
        let mut one: Vec<String> = (0..levels).map(twice).collect();
        one.push(r#"{"mesh":0}"#.to_owned());
        // Two nodes at each level, each of them a child of both above it.
        let mut two: Vec<String> = (0..2 * levels).map(|n| side_by_side(n / 2)).collect();
        two.extend([r#"{"mesh":0}"#; 2].map(str::to_owned));
        for nodes in [one, two] {
            let nodes = nodes.join(",");
            let keys = format!(r#"{buffer},"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}]"#);
            refused(desk.put("a.gltf", &gltf(&keys)), "check s.toml", &["a.gltf", "node"]);
        }
    }
    let cycle = format!(
        r#"{buffer},"scenes":[{{"nodes":[0]}}],"nodes":[{{"children":[1]}},{{"children":[0]}}]"#
    );
    refused(desk.put("a.gltf", &gltf(&cycle)), "check s.toml", &["a.gltf", "node"]);
}

#[test]
fn sixty_thousand_buffers() {
    let desk = Desk::new();
    desk.put("s.toml", &SCENE.replace("MESH", "a.gltf"));
    fs::File::create(desk.path().join("a.bin")).unwrap().write_all(&[0; 16_000]).unwrap();
    let buffers = [r#"{"uri":"a.bin","byteLength":16000}"#; 60_000].join(",");
    let keys =
        format!(r#""buffers":[{buffers}],"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}]"#);
    refused(desk.put("a.gltf", &gltf(&keys)), "check s.toml", &["a.gltf", "buffers"]);
}

#[test]
fn a_pipe_that_somebody_writes_to_is_read() {
    let desk = Desk::new();
    let program = env!("CARGO_BIN_EXE_macropulse");
    let script = format!(
        "mkfifo p.toml && ({program} sensors vlp-16 > p.toml &) && {program} encode p.toml --pixel 0,1"
    );
    let ran = Command::new("sh").args(["-c", &script]).current_dir(desk.path()).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    assert!(Path::new(&desk.path().join("p.toml")).exists() && !ran.stdout.is_empty());
}
