//! Meshes read as their authors meant them: what exporters write, and what is not meant as a surface.
#![allow(clippy::unwrap_used)]

#[allow(dead_code, reason = "other tests use more of it")]
use crate::tetra;

mod gltf;
mod obj;
mod outside;
mod ply;
mod stl;

use macropulse::scene::{Ray, Scene};
use tetra::{folder, object};

/// The scene of one white object, made of the file of this name that `bytes` are.
fn white(name: &str, bytes: impl AsRef<[u8]>) -> Result<Scene, String> {
    let files = folder(&[(name, bytes.as_ref())]);
    object(files.path(), &format!("mesh = {name:?}\nmaterial = \"white\""))
}

/// As [`white`], of what must be read: how many triangles there are.
fn triangles(name: &str, bytes: impl AsRef<[u8]>) -> usize {
    white(name, bytes).unwrap().triangles()
}

/// As [`white`], of what must be refused: one sentence with a remedy.
fn refused(name: &str, bytes: impl AsRef<[u8]>) -> String {
    let told = white(name, bytes).map(|scene| scene.triangles()).unwrap_err();
    assert!(told.contains(';') && !told.contains('\n'), "no sentence with a remedy: {told}");
    told
}

/// Returns true if a ray down on (x, y) meets something of a mesh with z up.
fn is_covered(scene: &Scene, [x, y]: [f64; 2]) -> bool {
    scene.cast(&Ray { origin: [x, y, 50.0], direction: [0.0, 0.0, -1.0] }, 0.0, 100.0).is_some()
}

/// A polygon with a bay, flat on the ground: the outline of an L, and what it covers and what not.
/// A fan about its first corner would fill the bay.
const BAY: [[f64; 2]; 6] = [[3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0], [0.0, 0.0]];
const IN_THE_L: [[f64; 2]; 3] = [[2.5, 0.5], [0.5, 2.5], [0.5, 0.5]];
const IN_THE_BAY: [[f64; 2]; 3] = [[2.0, 2.0], [1.2, 1.4], [2.5, 1.2]];

fn assert_is_the_l(scene: &Scene) {
    for at in IN_THE_L {
        assert!(is_covered(scene, at), "nothing at {at:?}");
    }
    for at in IN_THE_BAY {
        assert!(!is_covered(scene, at), "something at {at:?}");
    }
}
