//! Files that a mesh names: those outside the folder of the scene are refused, unless they are allowed.

use std::fs;
use std::path::Path;

use macropulse::scene::Scene;
use tempfile::TempDir;

const OBJ: &str = "mtllib NAMED\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n";
const MTL: &str = "newmtl paint\nKd 0.25\n";
const GLTF: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"NAMED"}]}"#;

/// A folder with `scene/meshes/`, and files with materials and with a triangle in each folder.
fn around() -> TempDir {
    let around = TempDir::new().unwrap();
    fs::create_dir_all(around.path().join("scene/meshes")).unwrap();
    let corners: Vec<u8> = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0_f32]
        .into_iter()
        .flat_map(f32::to_le_bytes)
        .collect();
    for folder in [".", "scene", "scene/meshes"] {
        fs::write(around.path().join(folder).join("a.mtl"), MTL).unwrap();
        fs::write(around.path().join(folder).join("a.bin"), &corners).unwrap();
    }
    around
}

/// The scene in `scene/`, of a mesh in `scene/meshes/` that names this file; `keys` are of the scene.
fn scene(around: &Path, keys: &str, (mesh, named): (&str, &str)) -> Result<Scene, String> {
    let text = if mesh.ends_with("obj") { OBJ } else { GLTF };
    let folder = around.join("scene");
    fs::write(folder.join("meshes").join(mesh), text.replace("NAMED", named)).unwrap();
    let text = format!("version = 1\n{keys}[[object]]\nmesh = \"meshes/{mesh}\"\n");
    Scene::from_toml(&text, "a.toml", &folder).map_err(|error| error.to_string())
}

#[test]
fn a_mesh_names_files_in_the_folder_of_the_scene() {
    let around = around();
    let absolute = |name: &str| around.path().join(name).display().to_string();
    for (mesh, end) in [("a.obj", "mtl"), ("a.gltf", "bin")] {
        for inside in ["a.", "../a.", "../meshes/a."] {
            scene(around.path(), "", (mesh, &format!("{inside}{end}"))).unwrap();
        }
        scene(around.path(), "", (mesh, &absolute(&format!("scene/a.{end}")))).unwrap();
        for outside in [format!("../../a.{end}"), absolute(&format!("a.{end}"))] {
            let told = scene(around.path(), "", (mesh, &outside)).map(|_| ()).unwrap_err();
            let wanted =
                format!("{mesh}: names {outside}, which lies outside the folder of the scene");
            assert!(told.contains(&wanted) && told.contains("--outside-files"), "{told}");
            scene(around.path(), "outside_files = true\n", (mesh, &outside)).unwrap();
            assert!(scene(around.path(), "outside_files = false\n", (mesh, &outside)).is_err());
        }
    }
    let escaped = ("a.gltf", "%2e%2e/..%2Fa.bin");
    assert!(scene(around.path(), "", escaped).is_err(), "escaped, it is the same");
    assert!(scene(around.path(), "outside_files = true\n", escaped).is_ok());
    // A file that is refused is not even looked for.
    let told = scene(around.path(), "", ("a.obj", "/nowhere/at/all.mtl")).map(|_| ()).unwrap_err();
    assert!(told.contains("lies outside"), "{told}");
}

#[test]
fn a_change_of_the_scene_allows_it() {
    let around = around();
    scene(around.path(), "", ("a.obj", "../../a.mtl")).unwrap_err();
    let path = around.path().join("scene/a.toml");
    fs::write(&path, "version = 1\n[[object]]\nmesh = \"meshes/a.obj\"\n").unwrap();
    let change = |key: &str, value: &str| {
        let changes = [(key.to_owned(), value.to_owned())];
        Scene::open_changed(path.to_str().unwrap(), &changes).map_err(|error| error.to_string())
    };
    assert_eq!(change("outside_files", "true").unwrap().triangles(), 1);
    assert!(change("outside_files", "false").unwrap_err().contains("lies outside"));
    assert!(change("name", "\"b\"").unwrap_err().contains("lies outside"));
}

/// The scene is the user's own word: its meshes lie wherever it says, and what lies beside them is
/// theirs.
#[test]
fn a_scene_names_meshes_anywhere() {
    let (around, other) = (around(), TempDir::new().unwrap());
    fs::write(other.path().join("b.obj"), OBJ.replace("NAMED", "b.mtl")).unwrap();
    fs::write(other.path().join("b.mtl"), MTL).unwrap();
    let mesh = other.path().join("b.obj");
    let text = format!("version = 1\n[[object]]\nmesh = {:?}\n", mesh.display().to_string());
    let scene = Scene::from_toml(&text, "a.toml", around.path()).unwrap();
    assert_eq!(scene.materials[0].at(905e-9).diffuse, 0.25);
}

/// If the object brings a material, the file with materials is not opened at all.
#[test]
fn what_is_not_needed_is_not_read() {
    let around = around();
    scene(around.path(), "", ("a.obj", "/dev/zero")).unwrap_err();
    let text = "version = 1\n[[object]]\nmesh = \"meshes/a.obj\"\nmaterial = \"white\"\n";
    Scene::from_toml(text, "a.toml", &around.path().join("scene")).unwrap();
}
