//! glTF.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use macropulse::scene::{Ray, Scene};

use super::tetra::{folder, object};
use super::{refused, triangles, white};

/// Four corners of a square of side 2 in the plane z = 0, then six corners of triangles as u16.
fn buffer() -> Vec<u8> {
    let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0_f32]];
    let corners = corners.into_iter().flatten().flat_map(f32::to_le_bytes);
    corners.chain([0, 1, 2, 0, 2, 3_u16].into_iter().flat_map(u16::to_le_bytes)).collect()
}

fn inline(buffer: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", STANDARD.encode(buffer))
}

/// A document of a square with further keys.
struct Square<'a> {
    nodes: &'a str,
    primitives: &'a str,
    more: &'a str,
    uri: &'a str,
}

const PLAIN: &str = r#"{"attributes":{"POSITION":0},"indices":1}"#;

impl Default for Square<'_> {
    fn default() -> Self {
        Self { nodes: r#"{"mesh":0}"#, primitives: PLAIN, more: "", uri: "" }
    }
}

impl Square<'_> {
    fn text(&self) -> String {
        let Self { nodes, primitives, more, uri } = self;
        let own = inline(&buffer());
        let uri = if uri.is_empty() { &own } else { *uri };
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],
"meshes":[{{"primitives":[{primitives}]}}],"accessors":[
{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
{{"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":12}}],
"buffers":[{{"byteLength":60,"uri":"{uri}"}}]{more}}}"#
        )
    }

    fn scene(&self) -> Scene {
        white("a.gltf", self.text()).unwrap()
    }
}

/// Range along x from 9 m before the origin, past it by these offsets to the left and above.
fn range(scene: &Scene, [y, z]: [f64; 2]) -> Option<f64> {
    let ray = Ray { origin: [-9.0, y, z], direction: [1.0, 0.0, 0.0] };
    scene.cast(&ray, 0.0, 100.0).map(|hit| hit.range)
}

#[test]
fn materials_without_a_name_stay_apart() {
    let colours = r#","materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.1,0.1,0.1,1]}},
{"pbrMetallicRoughness":{"baseColorFactor":[0.8,0.8,0.8,1]}},
{"name":"x","pbrMetallicRoughness":{"baseColorFactor":[0.2,0.2,0.2,1]}},
{"name":"x","pbrMetallicRoughness":{"baseColorFactor":[0.6,0.6,0.6,1]}}]"#;
    let of =
        |material: usize| format!(r#"{{"attributes":{{"POSITION":0}},"material":{material}}}"#);
    let primitives = (0..4).map(of).chain([PLAIN.to_owned()]).collect::<Vec<_>>().join(",");
    let square = Square { primitives: &primitives, more: colours, ..Square::default() };
    let files = folder(&[("a.gltf", square.text().as_bytes())]);
    let scene = object(files.path(), "name = \"o\"\nmesh = \"a.gltf\"").unwrap();
    let seen = |name: &str| {
        let found = scene.materials.iter().find(|material| material.name == name);
        found.map(|material| (material.at(905e-9).diffuse * 100.0).round())
    };
    let told = || scene.materials.iter().map(|one| one.name.clone()).collect::<Vec<_>>();
    assert_eq!(seen("o/material-0"), Some(10.0), "{:?}", told());
    assert_eq!(seen("o/material-1"), Some(80.0), "{:?}", told());
    assert_eq!(seen("o/x"), Some(20.0), "{:?}", told());
    assert_eq!(seen("o/x-2"), Some(60.0), "{:?}", told());
    assert_eq!(seen("unnamed"), Some(30.0), "{:?}", told());
    let keys = "mesh = \"a.gltf\"\nmaterial = \"white\"\nmaterials = { \"material 1\" = \"wood\" }";
    let names = object(files.path(), keys).unwrap().materials;
    assert_eq!(names.iter().map(|one| one.name.as_str()).collect::<Vec<_>>(), ["white", "wood"]);
}

#[test]
fn a_tree_of_nodes_may_be_deep() {
    let depth = 100_000;
    let shift = r#""translation":[0,0,0.00005]"#;
    let nodes: Vec<String> =
        (1..depth).map(|child| format!(r#"{{{shift},"children":[{child}]}}"#)).collect();
    let nodes = format!(r#"{},{{"mesh":0}}"#, nodes.join(","));
    let scene = Square { nodes: &nodes, ..Square::default() }.scene();
    let found = range(&scene, [0.1, 0.2]).unwrap();
    assert!((found - 14.0).abs() < 1e-3, "{found}");
}

#[test]
fn nodes_that_contain_each_other_or_have_two_parents_are_refused() {
    for nodes in [
        r#"{"children":[1]},{"mesh":0,"children":[0]}"#,
        r#"{"children":[1,1]},{"mesh":0}"#,
        r#"{"children":[1,2]},{"children":[3]},{"children":[3]},{"mesh":0}"#,
    ] {
        let told = refused("a.gltf", Square { nodes, ..Square::default() }.text());
        let why = ["a child that has another parent", "which is a child"];
        assert!(told.contains("node ") && why.iter().any(|why| told.contains(why)), "{told}");
    }
    // As the graph of an attacker has it: 2 to the power of 40 squares.
    let layers = (0..40).map(|layer| format!(r#"{{"children":[{0},{0}]}}"#, layer + 1));
    let nodes = layers.chain([r#"{"mesh":0}"#.to_owned()]).collect::<Vec<_>>().join(",");
    refused("a.gltf", Square { nodes: &nodes, ..Square::default() }.text());
}

/// A copy of the square with two corners elsewhere, and a surface whose other corners are all zero.
#[test]
fn sparse_accessors_are_read() {
    let mut bytes = buffer();
    bytes.extend([2_u16, 3].into_iter().flat_map(u16::to_le_bytes));
    bytes.extend([5.0, 5.0, 0.0, -1.0, 5.0, 0.0_f32].into_iter().flat_map(f32::to_le_bytes));
    let of = |view: &str, indices: &str| {
        Square::default()
            .text()
            .replace(&inline(&buffer()), &inline(&bytes))
            .replace("\"byteLength\":60", "\"byteLength\":88")
            .replace(
                r#"{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}"#,
                &format!(
                    r#"{{{view}"componentType":5126,"count":4,"type":"VEC3","sparse":{{"count":2,
"indices":{{"bufferView":{indices},"componentType":5123}},"values":{{"bufferView":3}}}}}}"#
                ),
            )
            .replace(
                "\"byteOffset\":48,\"byteLength\":12}",
                r#""byteOffset":48,"byteLength":12},{"buffer":0,"byteOffset":60,"byteLength":4},
{"buffer":0,"byteOffset":64,"byteLength":24}"#,
            )
    };
    let scene = white("a.gltf", of("\"bufferView\":0,", "2")).unwrap();
    assert_eq!(scene.triangles(), 2);
    // Forward of a glTF is z, left is x and up is y.
    assert!(range(&scene, [0.0, 3.0]).is_some() && range(&scene, [0.5, 0.0]).is_some());
    let scene = white("a.gltf", of("", "2")).unwrap();
    assert!(range(&scene, [0.5, 3.0]).is_some() && range(&scene, [0.5, 0.2]).is_none());
    // Corners that are not there, and views that are too short.
    assert!(
        refused("a.gltf", of("\"bufferView\":0,", "1").replace("\"count\":2", "\"count\":6"))
            .contains("buffer")
    );
    let wide = of("\"bufferView\":0,", "2").replace(
        "\"bufferView\":2,\"componentType\":5123",
        "\"bufferView\":2,\"componentType\":5121",
    );
    assert_eq!(triangles("a.gltf", &wide), 2);
    let beyond = of("\"bufferView\":0,", "0");
    assert!(refused("a.gltf", beyond).contains("sparse"));
}

#[test]
fn extensions_that_do_not_touch_the_shape_may_be_required() {
    for name in
        ["KHR_materials_unlit", "KHR_texture_transform", "EXT_texture_webp", "KHR_lights_punctual"]
    {
        let more = format!(r#","extensionsUsed":["{name}"],"extensionsRequired":["{name}"]"#);
        assert_eq!(Square { more: &more, ..Square::default() }.scene().triangles(), 2, "{name}");
    }
    for (name, wanted) in [
        ("KHR_draco_mesh_compression", "without compression"),
        ("EXT_meshopt_compression", "without compression"),
        ("EXT_mesh_gpu_instancing", "without"),
        ("ACME_secret", "without"),
    ] {
        let more = format!(r#","extensionsUsed":["{name}"],"extensionsRequired":["{name}"]"#);
        let told = refused("a.gltf", Square { more: &more, ..Square::default() }.text());
        assert!(told.contains(name) && told.contains(wanted), "{told}");
    }
}

/// Such an animation is of no node, and may be of what the crate that reads it does not know.
#[test]
fn animations_of_anything_are_left_out_like_others() {
    let animation = r#"{"channels":[{"sampler":0,"target":{"path":"pointer","extensions":
{"KHR_animation_pointer":{"pointer":"/materials/0/alphaCutoff"}}}}],"samplers":[{"input":0,"output":1}]}"#;
    let more = format!(
        r#","extensionsUsed":["KHR_animation_pointer"],"extensionsRequired":["KHR_animation_pointer"],
"animations":[{animation},{animation}]"#
    );
    let scene = white("a.gltf", Square { more: &more, ..Square::default() }.text()).unwrap();
    assert_eq!(scene.triangles(), 2);
    assert!(scene.warnings.iter().any(|said| said.contains("its 2 animations are left out")));
}

#[test]
fn quantised_positions_are_read() {
    let more = r#","extensionsUsed":["KHR_mesh_quantization"],"extensionsRequired":["KHR_mesh_quantization"]"#;
    let corners = [[-1, -1, 0, 0], [1, -1, 0, 0], [1, 1, 0, 0], [-1, 1, 0, 0_i16]];
    let indices = [0, 1, 2, 0, 2, 3_u16].into_iter().flat_map(u16::to_le_bytes);
    let of = |scale: i16, keys: &str| {
        let corners = corners.map(|corner| corner.map(|value| value * scale));
        let bytes = corners.into_iter().flatten().flat_map(i16::to_le_bytes).chain(indices.clone());
        Square { more, ..Square::default() }
            .text()
            .replace(&inline(&buffer()), &inline(&bytes.collect::<Vec<u8>>()))
            .replace("\"byteLength\":48}", "\"byteLength\":32,\"byteStride\":8}")
            .replace("\"byteOffset\":48", "\"byteOffset\":32")
            .replace("\"byteLength\":60", "\"byteLength\":44")
            .replace("5126,\"count\":4", &format!("5122,{keys}\"count\":4"))
    };
    let scene = white("a.gltf", of(3, "")).unwrap();
    assert!(range(&scene, [2.5, 2.5]).is_some() && range(&scene, [3.5, 0.0]).is_none());
    let scene = white("a.gltf", of(16384, "\"normalized\":true,")).unwrap();
    assert!(range(&scene, [0.49, 0.49]).is_some() && range(&scene, [0.51, 0.0]).is_none());
}

#[test]
fn names_of_files_may_be_escaped() {
    for (uri, name) in [
        ("a%20b.bin", "a b.bin"),
        ("caf%C3%A9%23.bin", "caf\u{e9}#.bin"),
        ("100%25.bin", "100%.bin"),
        ("100%.bin", "100%.bin"),
    ] {
        let text = Square { uri, ..Square::default() }.text();
        let files = folder(&[("a.gltf", text.as_bytes()), (name, &buffer())]);
        object(files.path(), "mesh = \"a.gltf\"\nmaterial = \"white\"").unwrap();
    }
    let escaped = inline(&buffer()).replace('/', "%2F").replace('+', "%2B").replace('=', "%3D");
    let escaped = escaped.replace("application%2F", "application/");
    assert_eq!(Square { uri: &escaped, ..Square::default() }.scene().triangles(), 2);
    let bare = inline(&buffer()).replace('=', "");
    assert_eq!(Square { uri: &bare, ..Square::default() }.scene().triangles(), 2);
}

#[test]
fn rotations_are_brought_to_length_one() {
    // A quarter turn about z, twice as long as it should be, of a square moved to the side.
    let long =
        r#"{"rotation":[0,0,1.4142136,1.4142136],"children":[1]},{"translation":[4,0,0],"mesh":0}"#;
    let scene = Square { nodes: long, ..Square::default() }.scene();
    assert!(range(&scene, [0.0, 4.0]).is_some() && range(&scene, [0.0, 4.9]).is_some());
    assert!(range(&scene, [0.0, 5.1]).is_none() && range(&scene, [4.0, 0.0]).is_none());
    let none = r#"{"rotation":[0,0,0,0],"mesh":0}"#;
    assert!(range(&Square { nodes: none, ..Square::default() }.scene(), [0.9, 0.9]).is_some());
}

#[test]
fn what_is_left_out_is_told() {
    let said = |square: &Square, wanted: &str| {
        let notes = square.scene().warnings;
        assert!(notes.iter().any(|note| note.contains(wanted)), "no {wanted:?} in {notes:?}");
    };
    let skin = r#","skins":[{"joints":[0]}]"#;
    said(&Square { nodes: r#"{"mesh":0,"skin":0}"#, more: skin, ..Square::default() }, "skin");
    let animation = r#","animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}],
"samplers":[{"input":0,"output":0}]}]"#;
    said(&Square { more: animation, ..Square::default() }, "animation");
    let morph = r#"{"attributes":{"POSITION":0},"indices":1,"targets":[{"POSITION":0}]}"#;
    said(&Square { primitives: morph, ..Square::default() }, "morph target");
    let lines = format!(r#"{PLAIN},{{"attributes":{{"POSITION":0}},"mode":1}}"#);
    said(&Square { primitives: &lines, ..Square::default() }, "no surfaces");
    for (name, wanted) in [
        ("KHR_draco_mesh_compression", "KHR_draco_mesh_compression"),
        ("EXT_mesh_gpu_instancing", "EXT_mesh_gpu_instancing"),
    ] {
        let more = format!(r#","extensionsUsed":["{name}","KHR_materials_unlit"]"#);
        said(&Square { more: &more, ..Square::default() }, wanted);
    }
    let nothing = Square::default().scene().warnings;
    assert!(!nothing.iter().any(|note| note.contains("left out")), "{nothing:?}");
}

#[test]
fn a_byte_order_mark_does_not_matter() {
    assert_eq!(triangles("a.gltf", format!("\u{feff}{}", Square::default().text())), 2);
}
