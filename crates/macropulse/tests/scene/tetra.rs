//! A tetrahedron, and scenes with one object in them.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use macropulse::scene::{Ray, Scene};
use tempfile::TempDir;

/// A tetrahedron with corners at the origin and at 1 on each axis.
pub const OBJ: &str = "mtllib tetra.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl Front\nf 2 3 4\n\
                   usemtl brick\nf 1 3 2\nf 1 2 4\nf 1 4 3\n";
/// Its materials.
pub const MTL: &str = "newmtl Front\nKd 0.5 0.5 0.5\nnewmtl brick\nKd 1 0 0\n";

/// A folder with these files.
pub fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = TempDir::new().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

/// A scene of one object, which these keys describe, its mesh looked for in `folder`; or why it is
/// refused.
pub fn object(folder: &Path, keys: &str) -> Result<Scene, String> {
    let text = format!("version = 1\n[[object]]\n{keys}\n");
    Scene::from_toml(&text, "test.toml", folder).map_err(|fault| fault.to_string())
}

/// Why an object is refused.
pub fn refusal(folder: &Path, keys: &str) -> String {
    object(folder, keys).map(|scene| scene.name).unwrap_err()
}

/// Range straight down the axis from 9 m before the origin, at a small offset.
pub fn range_along_x(scene: &Scene) -> Option<f64> {
    let ray = Ray { origin: [-9.0, 0.1, 0.2], direction: [1.0, 0.0, 0.0] };
    scene.cast(&ray, 0.0, 100.0).map(|hit| hit.range)
}
