//! Meshes that cannot be used are refused in one sentence.

#![allow(missing_docs)]

use crate::common;

use common::Desk;

const SCENE: &str = "version = 1
[[object]]
name = \"thing\"
mesh = \"MESH\"
unit = \"m\"
up = \"z\"
forward = \"x\"
position_m = [10.0, 0.0, 0.0]
";

const TRIANGLE: &str = "v 0 -2 -2\nv 0 2 -2\nv 0 0 2\nf 1 2 3\n";

fn desk_with(mesh: &str, bytes: &str) -> Desk {
    let desk = Desk::new();
    desk.put(mesh, bytes).put("s.toml", &SCENE.replace("MESH", mesh));
    desk
}

fn refused(mesh: &str, bytes: &str) {
    let desk = desk_with(mesh, bytes);
    desk.refused("simulate --sensor peregrine --scene s.toml -o out", &[mesh]);
    desk.refused("check s.toml", &[mesh]);
}

#[test]
fn a_good_mesh_is_hit() {
    let desk = desk_with("good.obj", TRIANGLE);
    let line = "simulate --sensor peregrine --scene s.toml -o out --json";
    assert!(desk.json(line)["counts"]["returns"].as_u64().unwrap() > 0);
    assert_eq!(desk.json("check s.toml --json")["triangles"], 1);
}

#[test]
fn an_empty_mesh() {
    for mesh in ["a.obj", "a.stl", "a.ply", "a.glb"] {
        refused(mesh, "");
    }
    refused("vertices-only.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
}

#[test]
fn a_corrupt_mesh() {
    refused("a.obj", "v 0 0\nf 1 2 3\n");
    refused("b.obj", "v 0 0 0\nf 1 2 99\n");
    refused("a.stl", "solid a\nfacet normal 0 0\n");
    refused("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n");
    refused("a.glb", "glTF and then nothing of the kind");
}

#[test]
fn a_mesh_that_is_not_there_or_of_an_unknown_kind() {
    let desk = Desk::new();
    desk.put("s.toml", &SCENE.replace("MESH", "gone.obj"));
    desk.refused("check s.toml", &["gone.obj"]);
    refused("a.fbx", "whatever");
}

#[test]
fn a_mesh_without_its_material_file_needs_a_material() {
    let bytes = format!("mtllib gone.mtl\nusemtl paint\n{TRIANGLE}");
    let desk = desk_with("a.obj", &bytes);
    for line in ["check s.toml", "simulate --sensor peregrine --scene s.toml -o out"] {
        desk.refused(line, &["a.obj", "gone.mtl", "material = "]);
    }
    desk.put("s.toml", &format!("{}material = \"white\"\n", SCENE.replace("MESH", "a.obj")));
    assert_eq!(desk.json("check s.toml --json")["triangles"], 1);
}
