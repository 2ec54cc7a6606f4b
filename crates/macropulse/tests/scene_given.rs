//! Scenes that a program describes: tables in place of files, and meshes in memory.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use macropulse::scene::{Mesh, Ray, Scene};

/// A square across the x axis, of two triangles.
fn square() -> Mesh {
    let vertices =
        [[0.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 1.0, 1.0], [0.0, -1.0, 1.0]].to_vec();
    Mesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]])
}

fn given(text: &str, mesh: Mesh) -> Result<Scene, String> {
    let meshes = BTreeMap::from([("square".to_owned(), mesh)]);
    let table = text.parse().unwrap();
    Scene::from_table(&table, "a dictionary", Path::new(""), &meshes)
        .map_err(|error| error.to_string())
}

fn range(scene: &Scene) -> f64 {
    let ray = Ray { origin: [0.0; 3], direction: [1.0, 0.0, 0.0] };
    scene.cast(&ray, 0.0, 1e3).unwrap().range
}

const OBJECT: &str = "version = 1\n[[object]]\nname = \"plate\"\nmesh = \"square\"\n\
                      material = \"grey50\"\nposition_m = [7.5, 0.1, 0.2]\n";

#[test]
fn a_mesh_in_memory_is_met_where_it_stands() {
    let scene = given(OBJECT, square()).unwrap();
    assert_eq!((range(&scene), scene.triangles()), (7.5, 2));
    assert_eq!(scene.objects[0].name, "plate");
    let text = format!("{OBJECT}unit = \"cm\"\n");
    let moved = text.replace("[7.5, 0.1, 0.2]", "[3.0, 0.0, 0.001]");
    assert_eq!(range(&given(&moved, square()).unwrap()), 3.0);
}

/// The same mesh as a file gives the same scene; control: another mesh does not.
#[test]
fn it_is_the_scene_that_the_file_makes() {
    let folder = tempfile::tempdir().unwrap();
    let obj = "v 0 -1 -1\nv 0 1 -1\nv 0 1 1\nv 0 -1 1\nf 1 2 3\nf 1 3 4\n";
    fs::write(folder.path().join("square.obj"), obj).unwrap();
    let text = OBJECT.replace("\"square\"", "\"square.obj\"");
    let file = Scene::from_toml(&text, "a.toml", folder.path()).unwrap();
    assert_eq!(given(OBJECT, square()).unwrap().digest(), file.digest());
    let mut other = square();
    other.vertices[2][1] = 1.5;
    assert_ne!(given(OBJECT, other).unwrap().digest(), file.digest());
}

#[test]
fn what_is_wrong_is_named_by_its_key() {
    let told = |text: &str| given(text, square()).unwrap_err();
    let misspelt = told(&OBJECT.replace("position_m", "positon_m"));
    assert!(misspelt.starts_with("a dictionary: object[0].positon_m: unknown key"), "{misspelt}");
    assert!(misspelt.ends_with("did you mean `position_m`?"), "{misspelt}");
    let material = told(&OBJECT.replace("grey50", "gray50"));
    assert!(material.starts_with("a dictionary: object[0].material: there is no"), "{material}");
    let nowhere = told(&OBJECT.replace("7.5", "nan"));
    assert!(nowhere.starts_with("a dictionary: object[0].position_m: "), "{nowhere}");
    assert_eq!(told("name = \"x\"\n"), "a dictionary: the key `version` is missing");
    let mut broken = square();
    broken.triangles[1][2] = 4;
    let broken = given(OBJECT, broken).unwrap_err();
    assert!(broken.starts_with("square: triangle 1 names vertex 4"), "{broken}");
}

#[test]
fn a_scene_keeps_the_text_it_was_made_of() {
    let scene = given(OBJECT, square()).unwrap();
    let table: toml::Table = scene.text.parse().unwrap();
    assert_eq!(table, OBJECT.parse().unwrap());
    let changes = [("object.wall.position_m.x".to_owned(), "42.5".to_owned())];
    let changed = Scene::open_changed("wall", &changes).unwrap();
    let again = Scene::from_toml(&changed.text, "wall", Path::new("")).unwrap();
    assert_eq!((range(&again), again.digest()), (42.5, changed.digest()));
}
