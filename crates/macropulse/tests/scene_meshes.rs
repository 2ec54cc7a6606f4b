//! Meshes from files: what each format and each damaged file leads to.
#![allow(clippy::unwrap_used)]

use crate::tetra;

use std::fs;
use std::path::PathBuf;

use macropulse::scene::{Ray, Scene};
use tetra::{MTL, OBJ, folder, object, range_along_x, refusal};

/// The tetrahedron as other formats have it.
const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 1], [0, 1, 3], [0, 3, 2]];

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
        let diffuse = scene.materials[hit.material as usize].at(905e-9).diffuse;
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
        ("nan.obj", "line 1 has \"nan\" where a number"),
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

/// A mesh made by others; `None`, with a sentence, where it is absent.
fn shared(name: &str) -> Option<PathBuf> {
    macropulse_testbed::data_of_others(&format!("meshes/{name}"))
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
