//! glTF files, damaged in many ways: each is read or refused in a sentence, without a panic and
//! without memory beyond what a file of its size can need.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use macropulse::scene::{Ray, Scene};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

/// Attempts for each of the files, and the seed of the first; the next file has the next seed.
const ATTEMPTS: u64 = 4000;
const FIRST_SEED: u64 = 2017;

/// Address space that reading damaged files of a few kilobytes may add to what reading sound ones
/// took, KiB. A length that is believed asks for gigabytes.
const MOST_MORE_KIB: u64 = 256 * 1024;

const CORNERS: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
const FACES: [u16; 12] = [1, 2, 3, 0, 2, 1, 0, 1, 3, 0, 3, 2];

fn buffer() -> Vec<u8> {
    let corners = CORNERS.iter().flat_map(|value| value.to_le_bytes());
    corners.chain(FACES.iter().flat_map(|corner| corner.to_le_bytes())).collect()
}

/// A document with something of everything that is read, and of most that is not.
fn text(uri: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0","generator":"a test"}},"scene":0,
"scenes":[{{"nodes":[0,2]}}],
"nodes":[{{"mesh":0,"translation":[0,0,2],"children":[1]}},
{{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1],"camera":0,"skin":0}},
{{"mesh":1,"rotation":[0,0.7071068,0,0.7071068],"scale":[2,1,1],"extras":{{"a":1}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"_OWN":0}},"indices":1,"material":0}}]}},
{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":5,"material":1,"targets":[{{"POSITION":0}}]}},
{{"attributes":{{"POSITION":0}},"mode":6}},{{"attributes":{{"POSITION":0}},"mode":1}}]}}],
"materials":[{{"name":"shell","alphaMode":"BLEND",
"pbrMetallicRoughness":{{"baseColorFactor":[0.2,0.2,0.2,1]}}}},
{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
"textures":[{{"source":0,"sampler":0}}],"images":[{{"uri":"a.png"}}],"samplers":[{{"wrapS":33071}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":1,"znear":0.1}}}}],
"skins":[{{"joints":[0,1]}}],
"animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"rotation"}}}}],
"samplers":[{{"input":2,"output":0}}]}}],
"accessors":[
{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1],
"sparse":{{"count":1,"indices":{{"bufferView":1,"componentType":5123}},
"values":{{"bufferView":0,"byteOffset":12}}}}}},
{{"bufferView":1,"byteOffset":0,"componentType":5123,"count":12,"type":"SCALAR"}},
{{"componentType":5126,"count":4,"type":"SCALAR","sparse":{{"count":1,
"indices":{{"bufferView":1,"componentType":5123}},"values":{{"bufferView":0}}}}}}],
"bufferViews":[{{"buffer":0,"byteLength":48,"byteStride":12,"target":34962}},
{{"buffer":0,"byteOffset":48,"byteLength":24,"target":34963}}],
"buffers":[{{"byteLength":72{uri}}}]}}"#
    )
}

/// A container whose lengths are those of its parts.
fn container(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let length = |length: usize| (length as u32).to_le_bytes();
    let total = 12 + 8 + json.len() + 8 + binary.len();
    let header = [b"glTF".as_slice(), &2u32.to_le_bytes(), &length(total)].concat();
    let chunk = |kind: &[u8], bytes: &[u8]| [&length(bytes.len()), kind, bytes].concat();
    [header, chunk(b"JSON", json), chunk(b"BIN\0", binary)].concat()
}

fn inline() -> String {
    use base64::Engine;
    let inline = base64::engine::general_purpose::STANDARD.encode(buffer());
    format!(",\"uri\":\"data:application/octet-stream;base64,{inline}\"")
}

fn scene(folder: &Path, name: &str) -> Result<Scene, String> {
    let text = format!("version = 1\n[[object]]\nmesh = {name:?}\nmaterial = \"white\"\n");
    Scene::from_toml(&text, "test.toml", folder).map_err(|fault| fault.to_string())
}

/// Reads `bytes` as a file of this name: whether it was sound.
fn attempt(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), String> {
    fs::write(folder.join(name), bytes).unwrap();
    let told = scene(folder, name).map(drop);
    if let Err(told) = &told {
        assert!(told.contains(';') && !told.contains('\n'), "no sentence with a remedy: {told}");
    }
    told
}

fn refused(folder: &Path, name: &str, bytes: &[u8]) -> String {
    attempt(folder, name, bytes).unwrap_err()
}

/// Says which attempt it was, should one panic.
struct Attempt<'a>(&'a str, u64, u64);

impl Drop for Attempt<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("{} of seed {}, attempt {}", self.0, self.1, self.2);
        }
    }
}

/// Numbers that readers stumble over.
const NUMBERS: [&str; 14] = [
    "0",
    "1",
    "-1",
    "3",
    "4",
    "7",
    "255",
    "0.5",
    "1e999",
    "2147483648",
    "4294967295",
    "4294967297",
    "9223372036854775807",
    "18446744073709551615",
];

/// Damages `text` in one place: a number is exchanged, or bytes are.
fn damage(bytes: &mut Vec<u8>, chance: &mut ChaCha8Rng) {
    let at = chance.random_range(0..bytes.len());
    match chance.random_range(0..8) {
        0 => bytes[at] ^= 1 << chance.random_range(0..8),
        1 => bytes[at] = chance.random_range(0..=255),
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(at..(at + chance.random_range(1..40)).min(bytes.len()))),
        4 => {
            let some = bytes[at..(at + chance.random_range(1..80)).min(bytes.len())].to_vec();
            let to = chance.random_range(0..=bytes.len());
            bytes.splice(to..to, some);
        }
        // The others look for a number from there on.
        _ => {
            let digit = |byte: &u8| byte.is_ascii_digit();
            let Some(first) = bytes[at..].iter().position(digit).map(|first| at + first) else {
                return;
            };
            let length = bytes[first..].iter().take_while(|byte| digit(byte)).count();
            let number = NUMBERS[chance.random_range(0..NUMBERS.len())];
            bytes.splice(first..first + length, number.bytes());
        }
    }
}

/// Most address space the program has had, KiB; `None` where the system does not tell.
fn most_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmPeak:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// One test, so that no other allocates beside it.
#[test]
fn damaged_files_are_refused_without_a_panic_or_much_memory() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    fs::write(folder.join("a b.bin"), buffer()).unwrap();
    let beside = text(",\"uri\":\"a b.bin\"").into_bytes();
    let files = [
        ("a.glb", text("").into_bytes()),
        ("a.gltf", beside),
        ("inline.gltf", text(&inline()).into_bytes()),
        ("whole.glb", container(text("").as_bytes(), &buffer())),
    ];
    let sealed = |name: &str, bytes: &[u8]| match name {
        "a.glb" => container(bytes, &buffer()),
        _ => bytes.to_vec(),
    };
    for (name, bytes) in &files {
        attempt(folder, name, &sealed(name, bytes)).unwrap();
        let ray = Ray { origin: [-9.0, 0.1, 0.2], direction: [1.0, 0.0, 0.0] };
        assert!(scene(folder, name).unwrap().cast(&ray, 0.0, 100.0).is_some(), "{name}");
    }
    let before = most_memory();
    let (mut read, mut told) = (0, 0);
    for (seed, (name, bytes)) in (FIRST_SEED..).zip(&files) {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        for index in 0..ATTEMPTS {
            let _which = Attempt(name, seed, index);
            let mut bytes = bytes.clone();
            for _ in 0..chance.random_range(1..4) {
                if !bytes.is_empty() {
                    damage(&mut bytes, &mut chance);
                }
            }
            match attempt(folder, name, &sealed(name, &bytes)) {
                Ok(()) => read += 1,
                Err(_) => told += 1,
            }
        }
    }
    forged(folder);
    println!("{read} read, {told} refused; {before:?} to {:?} KiB", most_memory());
    assert!(read > 500 && told > 5000, "{read} read, {told} refused");
    if let (Some(before), Some(after)) = (before, most_memory()) {
        assert!(after - before < MOST_MORE_KIB, "from {before} to {after} KiB");
    }
}

/// Files that ask for much in a few bytes, and one for each place where the reader of the
/// document relies on what it has been told.
fn forged(folder: &Path) {
    let whole = container(text("").as_bytes(), &buffer());
    let with = |from: &str, to: &str| {
        let text = text("");
        assert!(text.contains(from), "{from}");
        container(text.replacen(from, to, 1).as_bytes(), &buffer())
    };
    // Lengths in the container: below its own header, and beyond the file.
    for (at, length) in [(8, 0), (8, 11), (8, u32::MAX), (12, u32::MAX), (12, 0)] {
        let mut whole = whole.clone();
        whole[at..at + 4].copy_from_slice(&u32::to_le_bytes(length));
        refused(folder, "forged.glb", &whole);
    }
    let most = "18446744073709551615";
    for (from, to, wanted) in [
        // An index that the crate follows unchecked while it checks the document, and panics.
        (r#""POSITION":0,"_OWN""#, r#""POSITION":99,"_OWN""#, "an accessor that is not there"),
        (r#""mesh":0"#, r#""mesh":9"#, "names at nodes[0].mesh what is not there"),
        (r#""buffer":0"#, r#""buffer":1"#, "names at bufferViews[0].buffer what is not there"),
        (r#""scene":0"#, r#""scene":1"#, "names at scene what is not there"),
        // Sums that exceed every number.
        (r#""count":4"#, &format!(r#""count":{most}"#), "more than 33554432 vertices"),
        (r#""count":12"#, &format!(r#""count":{most}"#), "more than 33554432 vertices"),
        (r#""byteOffset":0"#, &format!(r#""byteOffset":{most}"#), "beyond its buffer"),
        (r#""byteOffset":48"#, &format!(r#""byteOffset":{most}"#), "beyond its buffer"),
        (r#""byteLength":24"#, &format!(r#""byteLength":{most}"#), "beyond its buffer"),
        (r#""byteLength":72"#, &format!(r#""byteLength":{most}"#), "more than 1 GiB together"),
        (r#""byteLength":72"#, r#""byteLength":1000000000"#, "buffer 0 is incomplete"),
        (r#""count":1,"ind"#, &format!(r#""count":{most},"ind"#), "beyond its buffer"),
        (r#""byteOffset":12"#, r#""byteOffset":37"#, "beyond its buffer"),
        // Types that the crate takes for granted.
        (r#""byteStride":12"#, r#""byteStride":4"#, "whose elements overlap"),
        (
            "5126,\"count\":4,\"type\":\"VEC3\"",
            "5123,\"count\":4,\"type\":\"VEC3\"",
            "three floats",
        ),
        ("5123,\"count\":12", "5126,\"count\":12", "not unsigned integers"),
        (r#""bufferView":1,"byteOffset":0,"#, "", "an accessor without a buffer"),
        // Nodes that contain each other, and surfaces without end.
        (r#""children":[1]"#, r#""children":[0]"#, "node 0, which is a child"),
        (
            "\"attributes\":{\"POSITION\":0},\"mode\":6",
            "\"attributes\":{},\"mode\":6",
            "without pos",
        ),
    ] {
        let told = refused(folder, "forged.glb", &with(from, to));
        assert!(told.contains(wanted), "{from} to {to}: {told}");
    }
    // A thousand nodes of a thousand each of a thousand each.
    let many = vec!["1"; 1000].join(",");
    let thousands = many.replace('1', "2");
    let tree = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[{many}]}}],
        "nodes":[{{}},{{"children":[{thousands}]}},{{"children":[{}]}}]}}"#,
        many.replace('1', "0")
    );
    let told = refused(folder, "forged.gltf", tree.as_bytes());
    assert!(told.contains("node 1 a child that has another parent"), "{told}");
    // A file that never ends.
    let told = refused(folder, "forged.gltf", text(",\"uri\":\"/dev/zero\"").as_bytes());
    assert!(told.contains("lies outside the folder of the scene"), "{told}");
    // A value that is merely missing, and not needed here, is no reason to refuse.
    attempt(folder, "forged.glb", &with(r#","min":[0,0,0],"max":[1,1,1]"#, "")).unwrap();
    attempt(folder, "forged.glb", &with(r#""byteStride":12"#, r#""byteStride":0"#)).unwrap();
}
