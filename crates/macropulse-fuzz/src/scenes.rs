//! Scene files, and the meshes that they name.

use std::path::Path;

use macropulse::scene::{Ray, Scene};

use crate::{assert_says, with_files};

const OF_A_MESH: &str = "version = 1
[[object]]
name = \"thing\"
mesh = \"FILE\"
unit = \"m\"
up = \"z\"
forward = \"x\"
";

fn looked_at(text: &str, folder: &Path) {
    match Scene::from_toml(text, "any.toml", folder) {
        Ok(scene) => {
            for direction in [[1.0, 0.0, 0.0], [0.8, 0.6, 0.0], [0.0, 0.6, -0.8]] {
                let ray = Ray { origin: [0.0, 0.0, 1.0], direction };
                let hit = scene.cast(&ray, 0.0, 1000.0);
                assert!(hit.is_none_or(|hit| (0.0..=1000.0).contains(&hit.range)));
            }
        }
        Err(error) => assert_says(&error),
    }
}

/// Reads `bytes` as a mesh of this `ending`, and casts rays at it.
pub fn mesh(ending: &str, bytes: &[u8]) {
    let name = format!("any.{ending}");
    with_files(&[(&name, bytes)], |folder| {
        looked_at(&OF_A_MESH.replace("FILE", &name), folder);
    });
}

/// Reads `bytes` as the materials of a mesh.
pub fn materials(bytes: &[u8]) {
    let mesh = b"mtllib a.mtl\nv 9 0 0\nv 9 1 0\nv 9 0 1\nusemtl a\nf 1 2 3\n";
    with_files(&[("of.obj", mesh), ("a.mtl", bytes)], |folder| {
        looked_at(&OF_A_MESH.replace("FILE", "of.obj"), folder);
    });
}

/// Reads `bytes` as a scene file without meshes beside it.
pub fn scene(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    with_files(&[], |folder| looked_at(text, &folder.join("nothing")));
}
