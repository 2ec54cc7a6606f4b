//! The memory that it takes to load a mesh. A test of its own, for it measures its process.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use macropulse::scene::Scene;

/// Rows and columns of squares, each of two triangles.
const SQUARES: u32 = 500;

/// Bytes that a triangle of an STL file may take while it is loaded. As it is read, it has three corners of
/// its own (72), their indices (12) and its material (2). Beside that, it is laid out in the world, with
/// corners (72), material and object (4): 162. Later the corners are put into another order (twice 72),
/// beside three lists of indices (12). A tenth is for the hierarchy.
const BYTES: usize = 162 + 16;

/// Bytes for all that does not grow with the triangles, the pages of the program above all: 9 MB
/// were measured.
const PROGRAM: usize = 16_000_000;

/// A figure of this process, bytes.
fn memory(name: &str) -> usize {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix(name)).unwrap();
    1024 * line.trim_matches([':', '\t', ' ', 'k', 'B']).parse::<usize>().unwrap()
}

/// Writes a field of low hills as an STL file.
fn write_hills(path: &Path) {
    let mut file = BufWriter::new(File::create(path).unwrap());
    file.write_all(&[0; 80]).unwrap();
    file.write_all(&(2 * SQUARES * SQUARES).to_le_bytes()).unwrap();
    let corner = |row: u32, column: u32| [row as f32, column as f32, (row * column % 7) as f32];
    for (row, column) in (0..SQUARES).flat_map(|row| (0..SQUARES).map(move |column| (row, column)))
    {
        let (a, b) = (corner(row, column), corner(row + 1, column));
        let (c, d) = (corner(row + 1, column + 1), corner(row, column + 1));
        for corners in [[a, b, c], [a, c, d]] {
            file.write_all(&[0; 12]).unwrap();
            for value in corners.as_flattened() {
                file.write_all(&value.to_le_bytes()).unwrap();
            }
            file.write_all(&[0; 2]).unwrap();
        }
    }
    file.flush().unwrap();
}

#[test]
fn no_list_of_all_triangles_is_kept_longer_than_it_is_needed() {
    let folder = tempfile::tempdir().unwrap();
    write_hills(&folder.path().join("hills.stl"));
    let text = "version = 1\n[[object]]\nmesh = \"hills.stl\"\nunit = \"m\"\nmaterial = \"grass\"\n\
                rest_on_ground = true\n";
    let before = memory("VmRSS");
    let scene = Scene::from_toml(text, "hills.toml", folder.path()).unwrap();
    let most = memory("VmHWM") - before;
    assert_eq!(scene.triangles(), (2 * SQUARES * SQUARES) as usize);
    let allowed = BYTES * scene.triangles() + PROGRAM;
    assert!(most <= allowed, "{most} bytes, {allowed} allowed");
}
