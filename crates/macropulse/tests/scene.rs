//! Scenes from files: what each mesh format and each wrong file leads to.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use macropulse::scene::{Ray, Scene, builtin_names};
use tempfile::TempDir;

/// A tetrahedron with corners at the origin and at 1 on each axis.
const OBJ: &str = "mtllib tetra.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl Front\nf 2 3 4\n\
                   usemtl brick\nf 1 3 2\nf 1 2 4\nf 1 4 3\n";
const MTL: &str = "newmtl Front\nKd 0.5 0.5 0.5\nnewmtl brick\nKd 1 0 0\n";
const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 1], [0, 1, 3], [0, 3, 2]];

fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = TempDir::new().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn object(folder: &Path, keys: &str) -> Result<Scene, String> {
    let text = format!("version = 1\n[[object]]\n{keys}\n");
    Scene::from_toml(&text, "test.toml", folder).map_err(|fault| fault.to_string())
}

fn refusal(folder: &Path, keys: &str) -> String {
    object(folder, keys).map(|scene| scene.name).unwrap_err()
}

/// Range straight down the axis from 9 m before the origin, at a small offset.
fn range_along_x(scene: &Scene) -> Option<f64> {
    let ray = Ray { origin: [-9.0, 0.1, 0.2], direction: [1.0, 0.0, 0.0] };
    scene.cast(&ray, 0.0, 100.0).map(|hit| hit.range)
}

fn ascii_stl() -> String {
    let facet = |face: &[usize; 3]| {
        let corner = |index: &usize| {
            let [x, y, z] = CORNERS[*index];
            format!("vertex {x:e} {y:e} {z:e}\n")
        };
        let corners: String = face.iter().map(corner).collect();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    };
    format!("solid tetra\n{}endsolid tetra\n", FACES.iter().map(facet).collect::<String>())
}

fn binary_stl() -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend(4u32.to_le_bytes());
    for face in FACES {
        bytes.extend([0; 12]);
        for value in face.iter().flat_map(|corner| CORNERS[*corner]) {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn ply(format: &str, body: &[u8]) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
         property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    );
    [header.as_bytes(), body].concat()
}

fn ascii_ply() -> Vec<u8> {
    let vertices: String = CORNERS.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    let faces: String = FACES.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")).collect();
    ply("ascii", format!("{vertices}{faces}").as_bytes())
}

fn binary_ply() -> Vec<u8> {
    let mut body: Vec<u8> =
        CORNERS.iter().flatten().flat_map(|value| value.to_be_bytes()).collect();
    for face in FACES {
        body.push(3);
        body.extend(face.iter().flat_map(|corner| (*corner as i32).to_be_bytes()));
    }
    ply("binary_big_endian", &body)
}

/// Positions, then indices.
fn gltf_buffer() -> Vec<u8> {
    let corners = CORNERS.iter().flatten().flat_map(|value| value.to_le_bytes());
    let faces = FACES.iter().flatten().flat_map(|corner| (*corner as u16).to_le_bytes());
    corners.chain(faces).collect()
}

/// The node is shifted by 2 along z, which glTF calls forward.
fn gltf(uri: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"mesh":0,"translation":[0,0,2]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0}}]}}],
        "materials":[{{"name":"shell","pbrMetallicRoughness":{{"baseColorFactor":[0.2,0.2,0.2,1]}}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},
        {{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":24}}],
        "buffers":[{{"byteLength":72{uri}}}]}}"#
    )
}

fn glb() -> Vec<u8> {
    let mut json = gltf("").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let buffer = gltf_buffer();
    let total = 12 + 8 + json.len() + 8 + buffer.len();
    let length = |length: usize| (length as u32).to_le_bytes();
    [
        b"glTF".as_slice(),
        &2u32.to_le_bytes(),
        &length(total),
        &length(json.len()),
        b"JSON",
        &json,
        &length(buffer.len()),
        b"BIN\0",
        &buffer,
    ]
    .concat()
}

#[test]
fn every_format_gives_the_same_tetrahedron() {
    let files = folder(&[
        ("tetra.obj", OBJ.as_bytes()),
        ("tetra.mtl", MTL.as_bytes()),
        ("ascii.stl", ascii_stl().as_bytes()),
        ("binary.stl", &binary_stl()),
        ("ascii.ply", &ascii_ply()),
        ("binary.ply", &binary_ply()),
    ]);
    for name in ["tetra.obj", "ascii.stl", "binary.stl", "ascii.ply", "binary.ply"] {
        let scene = object(files.path(), &format!("mesh = {name:?}")).unwrap();
        assert_eq!(scene.triangles(), 4, "{name}");
        // From behind, the face in the plane x = 0.
        assert_eq!(range_along_x(&scene), Some(9.0), "{name}");
        assert!(scene.notes.iter().any(|note| note.contains("metres")), "{:?}", scene.notes);
    }
}

#[test]
fn gltf_brings_its_own_axes_and_places_its_nodes() {
    use base64::Engine;
    let inline = base64::engine::general_purpose::STANDARD.encode(gltf_buffer());
    let inline = format!(",\"uri\":\"data:application/octet-stream;base64,{inline}\"");
    let files = folder(&[
        ("a.glb", &glb()),
        ("a.gltf", gltf(",\"uri\":\"a b.bin\"").as_bytes()),
        ("a b.bin", &gltf_buffer()),
        ("inline.gltf", gltf(&inline).as_bytes()),
    ]);
    for name in ["a.glb", "a.gltf", "inline.gltf"] {
        let scene = object(files.path(), &format!("mesh = {name:?}")).unwrap();
        // Forward is z, where the node stands at 2; up is y.
        let ray = Ray { origin: [-9.0, 0.1, 0.2], direction: [1.0, 0.0, 0.0] };
        let hit = scene.cast(&ray, 0.0, 100.0).unwrap();
        approx::assert_relative_eq!(hit.range, 11.0, max_relative = 1e-12);
        let diffuse = scene.materials[hit.material as usize].diffuse;
        approx::assert_relative_eq!(diffuse, 0.2, max_relative = 1e-6);
        assert!(scene.notes.iter().any(|note| note.contains("as glTF has it")));
    }
}

#[test]
fn an_obj_keeps_its_materials_and_they_can_be_mapped() {
    let files = folder(&[("tetra.obj", OBJ.as_bytes()), ("tetra.mtl", MTL.as_bytes())]);
    let names = |keys: &str| -> Vec<String> {
        let scene = object(files.path(), keys).unwrap();
        scene.materials.into_iter().map(|material| material.name).collect()
    };
    assert_eq!(names("mesh = \"tetra.obj\""), ["object-1/front", "brick"]);
    assert_eq!(names("mesh = \"tetra.obj\"\nmaterials = { Front = \"wood\" }"), ["wood", "brick"]);
    assert_eq!(names("mesh = \"tetra.obj\"\nmaterial = \"white\""), ["white"]);
    let told = refusal(files.path(), "mesh = \"tetra.obj\"\nmaterials = { front = \"wood\" }");
    assert!(told.contains("has no material \"front\"; it has Front, brick"), "{told}");
}

#[test]
fn a_ply_names_its_materials_by_an_index_of_each_face() {
    let text = String::from_utf8(ascii_ply()).unwrap();
    let text = text
        .replace("element vertex", "comment material wood\ncomment material brick\nelement vertex");
    let text = text.replace("end_header", "property uchar material_index\nend_header");
    let [head, faces] = text.split_once("3 1 2 3\n").map(|(head, rest)| [head, rest]).unwrap();
    let faces = faces.replace('\n', " 1\n");
    let of = |name: &str, index: &str| {
        let text = format!("{head}3 1 2 3 {index}\n{faces}");
        let files = folder(&[(name, text.as_bytes())]);
        let scene = object(files.path(), &format!("mesh = {name:?}")).unwrap();
        // Aimed at the slanting face alone, from beyond it.
        let ray = Ray { origin: [9.0, 0.1, 0.2], direction: [-1.0, 0.0, 0.0] };
        let hit = scene.cast(&ray, 0.0, 100.0).unwrap();
        scene.materials[usize::from(hit.material)].name.clone()
    };
    assert_eq!((of("a.ply", "0").as_str(), of("a.ply", "1").as_str()), ("wood", "brick"));
    assert_eq!(of("a.ply", "7"), "unnamed", "an index beyond the names");
}

#[test]
fn an_obj_without_its_mtl_needs_a_material() {
    let files = folder(&[("tetra.obj", OBJ.as_bytes())]);
    let told = refusal(files.path(), "mesh = \"tetra.obj\"");
    assert!(told.contains("tetra.mtl, which is not there; put that file beside"), "{told}");
    assert!(object(files.path(), "mesh = \"tetra.obj\"\nmaterial = \"white\"").is_ok());
}

#[test]
fn units_axes_poses_and_copies_put_a_mesh_where_they_say() {
    let files = folder(&[("a.ply", &ascii_ply())]);
    let lowest = |keys: &str| {
        let scene = object(files.path(), &format!("mesh = \"a.ply\"\n{keys}")).unwrap();
        range_along_x(&scene)
    };
    approx::assert_relative_eq!(lowest("position_m = [4, 0, 0]").unwrap(), 13.0);
    approx::assert_relative_eq!(lowest("unit = \"ft\"\nposition_m = [4, 0, 0]").unwrap(), 13.0);
    assert_eq!(lowest("unit = \"mm\""), None);
    // Turned about, the slanting face looks at the ray.
    let turned = lowest("yaw_deg = 180\nposition_m = [0, 0.3, 0]").unwrap();
    approx::assert_relative_eq!(turned, 9.0 - (1.0 - 0.2 - 0.2), max_relative = 1e-12);
    // Its y axis forward, its z axis up: what was left is now forward.
    approx::assert_relative_eq!(lowest("forward = \"y\"\nposition_m = [0, 0.5, 0]").unwrap(), 9.0);
    // Hanging one below its origin, and put back on the ground.
    let resting =
        lowest("up = \"-z\"\nforward = \"x\"\nposition_m = [0, 0.2, 0]\nrest_on_ground = true");
    approx::assert_relative_eq!(resting.unwrap(), 9.0);
    let nearer = lowest("position_m = [4, 0, 0]\ncopies = [{ position_m = [-2, 0, 0] }]");
    approx::assert_relative_eq!(nearer.unwrap(), 7.0);
}

#[test]
fn geometry_far_from_the_origin_keeps_its_millimetres() {
    let vertices = "v 500000.001 0 0\nv 500000.001 2 0\nv 500000.001 0 2\nf 1 2 3\n";
    let files = folder(&[("far.obj", vertices.as_bytes())]);
    let text =
        "version = 1\n[sensor]\nposition_m = [499900, 0, 0]\n[[object]]\nmesh = \"far.obj\"\n";
    let scene = Scene::from_toml(text, "far.toml", files.path()).unwrap();
    let ray = Ray { origin: [499_900.0, 0.5, 0.5], direction: [1.0, 0.0, 0.0] };
    approx::assert_abs_diff_eq!(scene.cast(&ray, 0.0, 1e3).unwrap().range, 100.001, epsilon = 1e-9);
}

#[test]
fn broken_meshes_are_refused_with_what_to_do() {
    let cut = &binary_stl()[..150];
    let cut_ply = &binary_ply()[..220];
    let cut_glb = &glb()[..400];
    let files = folder(&[
        ("points.obj", b"v 0 0 0\nv 1 0 0\n"),
        ("index.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
        ("nan.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("cut.stl", cut),
        ("cut.ply", cut_ply),
        ("cut.glb", cut_glb),
        ("text.glb", b"hello"),
        ("nobuffer.gltf", gltf(",\"uri\":\"gone.bin\"").as_bytes()),
        ("short.gltf", gltf(",\"uri\":\"data:a;base64,AAAA\"").as_bytes()),
        ("a.fbx", b""),
    ]);
    for (name, wanted) in [
        ("points.obj", "holds no triangles"),
        ("index.obj", "export it again"),
        ("nan.obj", "vertex 0"),
        ("cut.stl", "cut short"),
        ("cut.ply", "cut short"),
        ("cut.glb", "cut short"),
        ("text.glb", "cut short"),
        ("nobuffer.gltf", "gone.bin: cannot be read"),
        ("short.gltf", "buffer 0 is incomplete"),
        ("a.fbx", "use .obj, .stl, .ply, .glb or .gltf"),
        ("none.obj", "cannot be read"),
    ] {
        let told = refusal(files.path(), &format!("mesh = {name:?}"));
        assert!(told.contains(wanted), "{name}: {told}");
    }
}

#[test]
fn wrong_scene_files_are_refused_at_their_place() {
    let nowhere = Path::new("");
    for (keys, wanted) in [
        ("shape = { sphere = { radius_m = 0 } }", "test.toml:3:9: `radius_m` must be finite"),
        (
            "shape = { sphere = { radius_m = 1 } }\nmaterial = \"asphlat\"",
            "did you mean \"asphalt\"?",
        ),
        ("shape = { spher = { radius_m = 1 } }", "did you mean `sphere`?"),
        ("car = {}\nyaw_deg = nan", "test.toml:4:11: yaw_deg must be a finite number"),
        ("car = {}\nposition_m = [inf, 0, 0]", "position_m must be three finite numbers"),
        ("mesh = \"a.obj\"\nmaterial = \"white\"", "cannot be read"),
        ("car = {}\nscale = 2", "`scale` belongs to objects with a `mesh`"),
        (
            "car = {}\nshape = { sphere = { radius_m = 1 } }",
            "exactly one of `mesh`, `car` and `shape`",
        ),
        ("name = \"nothing\"", "exactly one of `mesh`, `car` and `shape`"),
        ("car = {}\nyaw_degrees = 3", "did you mean `yaw_deg`?"),
        ("car = {}\n[[material]]\nname = \"velvet\"", "needs at least `diffuse`"),
        ("car = {}\n[[material]]\nname = \"velvet\"\ndiffuse = 1.5", "it must be from 0 to 1"),
    ] {
        let told = refusal(nowhere, keys);
        assert!(told.contains(wanted), "{keys}: {told}");
    }
    let files = folder(&[("a.ply", &ascii_ply())]);
    let told = refusal(files.path(), "mesh = \"a.ply\"\nscale = 0");
    assert!(told.contains("test.toml:4:9: scale is 0; it must be above zero"), "{told}");
    let told = refusal(files.path(), "mesh = \"a.ply\"\nup = \"x\"\nforward = \"-x\"");
    assert!(told.contains("same axis"), "{told}");
    let told = Scene::from_toml("version = 2\n", "test.toml", nowhere).unwrap_err().to_string();
    assert!(told.contains("write version = 1"), "{told}");
}

#[test]
fn two_objects_of_one_name_are_refused_with_both_places() {
    let named = |names: [&str; 2]| {
        let ball = |name| format!("[[object]]\nname = {name:?}\nshape.sphere.radius_m = 1\n");
        let text = format!(
            "version = 1\nground = {{ material = \"asphalt\" }}\n{}",
            names.map(ball).concat()
        );
        Scene::from_toml(&text, "test.toml", Path::new("")).map_err(|fault| fault.to_string())
    };
    assert_eq!(
        named(["ball", "ball"]).unwrap_err(),
        "test.toml:7:8: another object is called \"ball\" at line 4, column 8; give one of them \
         another name"
    );
    let told = named(["ball", "ground"]).unwrap_err();
    assert!(told.contains("called \"ground\" at line 2, column 23"), "{told}");
    assert!(named(["ball", "Ball"]).is_ok());
}

#[test]
fn built_in_scenes_give_their_known_answers() {
    let ahead = |scene: &Scene, y: f64, z: f64| {
        let ray = Ray { origin: [0.0, y, z], direction: [1.0, 0.0, 0.0] };
        scene.cast(&ray, 0.0, 1e3)
    };
    for (name, distance) in
        [("car-30m", 30.0), ("car-50m", 50.0), ("car-70m", 70.0), ("car-120m", 120.0)]
    {
        let scene = Scene::open(name).unwrap();
        // Nothing of the car is nearer than its front, and its plate lies there.
        let nearest = (0..4000).filter_map(|step| {
            let (y, z) = (f64::from(step % 80) / 40.0 - 1.0, f64::from(step / 80) / 33.0 + 0.01);
            ahead(&scene, y, z).map(|hit| hit.range)
        });
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        approx::assert_abs_diff_eq!(nearest, distance, epsilon = 1e-9);
        assert_eq!(scene.sensor.pose.position, [0.0, 0.0, 2.05]);
        assert_eq!(scene.objects.iter().filter(|object| object.is_target).count(), 1);
    }
    let wall = Scene::open("wall").unwrap();
    let (azimuth, elevation) = (0.3f64, -0.2f64);
    let direction =
        [azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin()];
    let hit = wall.cast(&Ray { origin: [0.0, 0.0, 2.0], direction }, 0.0, 1e3).unwrap();
    approx::assert_relative_eq!(hit.range, 50.0 / direction[0], max_relative = 1e-12);
    let street = Scene::open("street").unwrap();
    assert_eq!(ahead(&street, 0.0, 3.0).unwrap().range, 120.0);
    let left = Ray { origin: [20.0, 0.0, 5.0], direction: [0.0, 1.0, 0.0] };
    assert_eq!(street.cast(&left, 0.0, 1e3).unwrap().range, 9.0);
    approx::assert_abs_diff_eq!(ahead(&street, 2.0, 0.43).unwrap().range, 25.0, epsilon = 1e-9);
}

#[test]
fn every_built_in_scene_opens_and_has_a_digest_of_its_own() {
    let digests: Vec<String> =
        builtin_names().map(|name| Scene::open(name).unwrap().digest()).collect();
    let again: Vec<String> =
        builtin_names().map(|name| Scene::open(name).unwrap().digest()).collect();
    assert_eq!(digests, again);
    for (index, digest) in digests.iter().enumerate() {
        assert!(!digests[..index].contains(digest));
    }
}

#[test]
fn an_unknown_scene_is_told_with_the_nearest_name() {
    let told = Scene::open("car30m").map(|scene| scene.name).unwrap_err().to_string();
    assert!(told.contains("did you mean \"car-30m\"?") && told.contains("street"), "{told}");
    let told = Scene::open("gone/scene.toml").map(|scene| scene.name).unwrap_err().to_string();
    assert!(told.contains("gone/scene.toml: cannot be read"), "{told}");
}

/// A mesh of the shared collection; `None`, with a sentence, where that is absent.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/meshes").join(name);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

#[test]
fn meshes_of_others_are_read() {
    let size_note = |scene: &Scene| scene.notes.iter().find(|note| note.contains("long")).cloned();
    if let Some(path) = shared("hatchback.obj") {
        let folder = path.parent().unwrap();
        let keys =
            "mesh = \"hatchback.obj\"\nunit = \"in\"\nforward = \"y\"\nrest_on_ground = true";
        assert!(refusal(folder, keys).contains("hatchback.mtl, which is not there"));
        let scene = object(folder, &format!("{keys}\nmaterial = \"paint-red\"")).unwrap();
        println!("{:?}", size_note(&scene));
        assert!(scene.triangles() > 500);
        let keys = "mesh = \"suv.obj\"\nunit = \"in\"\nforward = \"y\"\nmaterial = \"paint-black\"";
        println!("{:?}", size_note(&object(folder, keys).unwrap()));
    }
    if let Some(path) = shared("truck-green.glb") {
        let scene = object(path.parent().unwrap(), "mesh = \"truck-green.glb\"").unwrap();
        println!("{:?} {} triangles", scene.notes, scene.triangles());
        assert!(scene.triangles() > 1000);
    }
    if let Some(folder) = shared("street-canyon-with-cars/meshes") {
        let mut count = 0;
        for entry in fs::read_dir(&folder).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let scene = object(&folder, &format!("mesh = {name:?}")).unwrap();
            assert!(scene.triangles() >= 2, "{name}");
            count += 1;
        }
        assert_eq!(count, 23);
    }
}

/// Whatever happens to a file, it is read or refused; it never takes the program down.
#[test]
fn damaged_files_never_panic() {
    let inline = ",\"uri\":\"a b.bin\"";
    let sound: Vec<(&str, Vec<u8>)> = vec![
        ("a.obj", OBJ.as_bytes().to_vec()),
        ("ascii.stl", ascii_stl().into_bytes()),
        ("binary.stl", binary_stl()),
        ("ascii.ply", ascii_ply()),
        ("binary.ply", binary_ply()),
        ("a.glb", glb()),
        ("a.gltf", gltf(inline).into_bytes()),
    ];
    let files = folder(&[("a b.bin", &gltf_buffer())]);
    let (mut read, mut refused) = (0, 0);
    for (name, bytes) in &sound {
        let mut attempt = |bytes: &[u8]| {
            fs::write(files.path().join(name), bytes).unwrap();
            match object(files.path(), &format!("mesh = {name:?}\nmaterial = \"white\"")) {
                Ok(_) => read += 1,
                Err(told) => {
                    assert!(told.contains(';'), "no remedy in: {told}");
                    refused += 1;
                }
            }
        };
        for index in (0..bytes.len()).step_by(3) {
            attempt(&bytes[..index]);
            let mut changed = bytes.clone();
            changed[index] ^= 0x06;
            attempt(&changed);
        }
    }
    assert!(read > 100 && refused > 500, "{read} read, {refused} refused");
}

/// A box of 2 × 3 × 1 m, as quadrilaterals, about its middle.
fn box_obj() -> String {
    let corner = |index: u32| {
        let side = |bit: u32, half: f64| if index >> bit & 1 == 1 { half } else { -half };
        format!("v {} {} {}\n", side(0, 1.0), side(1, 1.5), side(2, 0.5))
    };
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    (0..8).map(corner).collect::<String>() + faces
}

/// A sphere of radius 2 m, finely tessellated.
fn sphere_obj(rows: u32) -> String {
    use std::f64::consts::PI;
    let mut text = String::new();
    for index in 0..(rows + 1) * 2 * rows {
        let (row, column) = (f64::from(index / (2 * rows)), f64::from(index % (2 * rows)));
        let (polar, around) = (PI * row / f64::from(rows), PI * column / f64::from(rows));
        let (x, y) = (polar.sin() * around.cos(), polar.sin() * around.sin());
        text += &format!("v {} {} {}\n", 2.0 * x, 2.0 * y, 2.0 * polar.cos());
    }
    for index in 0..rows * 2 * rows {
        let (row, column) = (index / (2 * rows), index % (2 * rows));
        let at = |row: u32, column: u32| row * 2 * rows + column % (2 * rows) + 1;
        let [a, b] = [at(row, column), at(row + 1, column)];
        let [c, d] = [at(row + 1, column + 1), at(row, column + 1)];
        text += &format!("f {a} {b} {c} {d}\n");
    }
    text
}

/// 20 000 rays of seed 5 from all sides, at a body about (10, 0, 0) with a reach of 3 m.
fn rays_from_all_sides() -> impl Iterator<Item = Ray> {
    use rand::{RngExt, SeedableRng};
    let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    (0..20_000).map(move |_| {
        let mut around = |reach: f64| [0; 3].map(|_| chance.random_range(-reach..reach));
        let (from, aim) = (around(40.0), around(2.5));
        let way = [aim[0] + 10.0 - from[0], aim[1] - from[1], aim[2] - from[2]];
        let length = way.iter().map(|part| part * part).sum::<f64>().sqrt();
        Ray { origin: from, direction: way.map(|part| part / length) }
    })
}

#[test]
fn meshes_and_formulas_agree() {
    let files =
        folder(&[("box.obj", box_obj().as_bytes()), ("ball.obj", sphere_obj(200).as_bytes())]);
    let pose = "position_m = [10, 0, 0]\nyaw_deg = 30\npitch_deg = 20\nroll_deg = -50\nmaterial = \"white\"";
    let pair = |mesh: &str, shape: &str| {
        [mesh, shape].map(|kind| object(files.path(), &format!("{kind}\n{pose}")).unwrap())
    };
    // The chord of a step of π/200 lies at most this far within the sphere, along its normal.
    let sagitta = 2.0 * (1.0 - (std::f64::consts::PI / 400.0).cos()) * 2.0;
    for (mesh, shape, tolerance, grazing) in [
        ("mesh = \"box.obj\"", "shape = { box = { size_m = [2, 3, 1] } }", 1e-6, 0),
        ("mesh = \"ball.obj\"", "shape = { sphere = { radius_m = 2 } }", sagitta, 10),
    ] {
        let [meshed, exact] = pair(mesh, shape);
        let (mut hits, mut disagreements) = (0, 0);
        for ray in rays_from_all_sides() {
            match (meshed.cast(&ray, 0.0, 1e3), exact.cast(&ray, 0.0, 1e3)) {
                (Some(meshed), Some(exact)) => {
                    hits += 1;
                    let along = |normal: [f64; 3]| {
                        (0..3).map(|axis| normal[axis] * ray.direction[axis]).sum::<f64>()
                    };
                    // Along the normal, not along the ray: a grazing ray stretches any gap.
                    let gap = (meshed.range - exact.range) * along(exact.normal);
                    assert!(gap.abs() < tolerance, "{ray:?} {meshed:?} {exact:?}");
                }
                (None, None) => {}
                _ => disagreements += 1,
            }
        }
        assert!(hits > 3000, "{hits}");
        assert!(disagreements <= grazing, "{mesh}: {disagreements} of {hits}");
    }
}

/// Copies in a row along y, each seen from above; and objects of one mesh are as cheap as copies.
#[test]
fn twenty_thousand_copies_are_met_where_they_stand() {
    let copies: String =
        (1..20_000).map(|i| format!("{{ position_m = [0, {}, 0] }},\n", 4 * i)).collect();
    let scene = object(
        Path::new(""),
        &format!("car = {{}}\nposition_m = [0, 0, 0]\nrest_on_ground = true\ncopies = [{copies}]"),
    )
    .unwrap();
    let one = object(Path::new(""), "car = {}\nposition_m = [0, 0, 0]").unwrap();
    assert_eq!(scene.triangles(), 20_000 * one.triangles());
    let down = |y: f64| Ray { origin: [0.3, y + 0.2, 5.0], direction: [0.0, 0.0, -1.0] };
    let roof = one.cast(&down(0.0), 0.0, 10.0).unwrap().range;
    for copy in [0, 1, 777, 19_999] {
        let range = scene.cast(&down(f64::from(4 * copy)), 0.0, 10.0).unwrap().range;
        assert!((range - roof).abs() < 1e-6, "{copy}: {range}, not {roof}");
    }
    assert_eq!(scene.cast(&down(2.0), 0.0, 10.0), None);
}

#[test]
fn objects_share_a_mesh_only_if_it_is_read_the_same_way() {
    let folder = folder(&[("tetra.obj", OBJ.as_bytes()), ("tetra.mtl", MTL.as_bytes())]);
    let of = |more: [&str; 2]| {
        let object = |more: &str| {
            format!(
                "[[object]]\nmesh = \"tetra.obj\"\nmaterial = \"brick\"\nunit = \"m\"\n{more}\n"
            )
        };
        let text = format!("version = 1\n{}{}", object(more[0]), object(more[1]));
        Scene::from_toml(&text, "test.toml", folder.path()).unwrap()
    };
    let down = |x: f64| Ray { origin: [x + 0.1, 0.1, 9.0], direction: [0.0, 0.0, -1.0] };
    let ranges = |scene: &Scene| {
        [0.0, 20.0].map(|x| scene.cast(&down(x), 0.0, 20.0).map_or(0.0, |hit| hit.range))
    };
    let same = of(["", "position_m = [20, 0, 0]"]);
    let [near, far] = ranges(&same);
    assert!((near - 8.2).abs() < 1e-6 && (far - near).abs() < 1e-6, "{near} {far}");
    let larger = of(["", "position_m = [20, 0, 0]\nscale = 2.0"]);
    let [near, far] = ranges(&larger);
    assert!((near - 8.2).abs() < 1e-6 && (far - 7.2).abs() < 1e-6, "{near} {far}");
    assert_ne!(same.digest(), larger.digest());
    assert_ne!(same.digest(), of(["position_m = [20, 0, 0]", ""]).digest());
}

#[test]
fn rays_in_any_order_have_the_ranges_they_have_alone() {
    let scene = Scene::open("car-50m").unwrap();
    let origin = [0.0, 0.0, 2.0];
    let ray = |index: usize| {
        let [left, up] = [index * 7919 % 2003, index * 104_729 % 1999];
        let (azimuth, elevation) = (left as f64 / 2003.0 - 0.5, (up as f64 / 1999.0 - 0.5) * 0.3);
        let level = elevation.cos();
        [level * azimuth.cos(), level * azimuth.sin(), elevation.sin()]
    };
    let directions: Vec<[f64; 3]> = (0..5000).map(ray).collect();
    let ranges = scene.cast_all(origin, &directions, 300.0);
    let alone = |direction: &[f64; 3]| {
        let ray = Ray { origin, direction: *direction };
        scene.cast(&ray, 0.0, 300.0).map_or(f64::INFINITY, |hit| hit.range)
    };
    assert!(directions.iter().map(alone).eq(ranges.iter().copied()));
    assert!(ranges.iter().any(|range| range.is_finite()));
}
