//! The attack on Macropulse: a function for each kind of input, to be given any bytes.
//!
//! [`TARGETS`] has two callers. The fuzzers in `fuzz/` look for inputs that reach code that none has reached
//! yet. The test `corpus` runs everywhere, and gives each target its corpus and the mutations that [`mutate`]
//! makes of it.
//!
//! A target returns, whatever it is given. It panics if something in Macropulse does, or if an answer breaks
//! a promise, as an error without words does.

mod clouds;
pub mod mutate;
mod receivers;
mod recorded;
mod scenes;
mod sensors;
mod words;

use std::fs;
use std::path::Path;

use tempfile::TempDir;

/// A kind of input.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Its name, that of its corpus and its fuzzer.
    pub name: &'static str,
    /// The function that takes the bytes.
    pub run: fn(&[u8]),
    /// The longest input that is worth its time, bytes.
    pub longest: usize,
}

macro_rules! targets {
    ($($name:ident, $run:expr, $longest:expr;)*) => {
        /// Every kind of input that there is.
        pub const TARGETS: &[Target] = &[
            $(Target { name: stringify!($name), run: $run, longest: $longest }),*
        ];
    };
}

targets! {
    cloud_csv, |bytes| clouds::read("csv", bytes), 4096;
    cloud_e57, |bytes| clouds::read("e57", bytes), 1 << 16;
    cloud_kitti, |bytes| clouds::read("bin", bytes), 4096;
    cloud_las, |bytes| clouds::read("las", bytes), 1 << 14;
    cloud_laz, |bytes| clouds::read("laz", bytes), 1 << 14;
    cloud_mcap, |bytes| clouds::read("mcap", bytes), 1 << 15;
    cloud_npy, |bytes| clouds::read("npy", bytes), 4096;
    cloud_pcd, |bytes| clouds::read("pcd", bytes), 1 << 13;
    cloud_ply, |bytes| clouds::read("ply", bytes), 1 << 13;
    cloud_ptx, |bytes| clouds::read("ptx", bytes), 4096;
    range_image, clouds::range_image, 4096;
    mesh_glb, |bytes| scenes::mesh("glb", bytes), 1 << 13;
    mesh_gltf, |bytes| scenes::mesh("gltf", bytes), 1 << 13;
    mesh_mtl, scenes::materials, 4096;
    mesh_obj, |bytes| scenes::mesh("obj", bytes), 4096;
    mesh_ply, |bytes| scenes::mesh("ply", bytes), 4096;
    mesh_stl, |bytes| scenes::mesh("stl", bytes), 4096;
    scene, scenes::scene, 4096;
    sensor, sensors::sensor, 4096;
    requirements, sensors::requirements, 4096;
    directions, sensors::directions, 4096;
    calibration, sensors::calibration, 4096;
    scan, sensors::scan, 4096;
    code, sensors::code, 512;
    set, words::set, 256;
    vary, words::vary, 128;
    shots, recorded::shots, 4096;
    ticks, recorded::ticks, 4096;
    samples, recorded::samples, 8192;
    records, recorded::records, 4096;
    stream, recorded::stream, 4096;
    receiver, receivers::decode, 2048;
}

/// The target called `name`.
#[must_use]
pub fn target(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}

/// Gives `bytes` to the target called `name`, unless they are longer than its `longest`.
///
/// # Panics
/// If there is no such target, and if the target panics.
#[expect(clippy::panic, reason = "a misspelt fuzzer does nothing for ever")]
pub fn run(name: &str, bytes: &[u8]) {
    let Some(target) = target(name) else { panic!("there is no target {name}") };
    if bytes.len() <= target.longest {
        (target.run)(bytes);
    }
}

/// Calls `read` with a folder that has these files; in memory, where the system has such a place.
fn with_files<T>(files: &[(&str, &[u8])], read: impl Fn(&Path) -> T) -> T {
    thread_local!(static FOLDER: TempDir = folder());
    FOLDER.with(|folder| {
        for (name, bytes) in files {
            written(&folder.path().join(name), bytes);
        }
        read(folder.path())
    })
}

#[expect(clippy::expect_used, reason = "without a folder there is no attack")]
fn folder() -> TempDir {
    let memory = tempfile::tempdir_in("/dev/shm");
    memory.or_else(|_| tempfile::tempdir()).expect("a folder for files")
}

#[expect(clippy::expect_used, reason = "without a file there is no attack")]
fn written(path: &Path, bytes: &[u8]) {
    fs::write(path, bytes).expect("a file is written");
}

/// Asks of an error of a file that it is one line.
fn assert_told(error: &dyn std::error::Error) {
    let told = error.to_string();
    assert!(told.lines().count() == 1, "not one line: {told:?}");
}

/// Asks of an error of what a person types that it says something: it may list several reasons, and
/// repeat lines that were typed.
fn assert_says(error: &dyn std::error::Error) {
    assert!(!error.to_string().trim().is_empty(), "an error without words");
}
