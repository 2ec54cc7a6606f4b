//! PLY, as text and as bytes.

use super::tetra::{folder, object};
use super::{BAY, assert_is_the_l, refused, triangles, white};

/// A flat polygon with these corners, as text.
fn polygon(corners: &[[f64; 2]]) -> String {
    let count = corners.len();
    let places: String = corners.iter().map(|[x, y]| format!("{x} {y} 0\n")).collect();
    let face: Vec<String> = (0..count).map(|index| index.to_string()).collect();
    format!(
        "ply\nformat ascii 1.0\ncomment material concrete\nelement vertex {count}\n\
         property float x\nproperty float y\nproperty float z\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n{places}{count} {}\n",
        face.join(" ")
    )
}

#[test]
fn a_concave_polygon_keeps_its_bay() {
    let scene = white("a.ply", polygon(&BAY)).unwrap();
    assert_is_the_l(&scene);
    assert_eq!(scene.triangles(), 4);
}

#[test]
fn comments_in_latin_1_and_byte_order_marks_do_not_matter() {
    let text = polygon(&BAY).replace("concrete", "b\u{e9}ton");
    let latin: Vec<u8> = text.chars().map(|letter| letter as u8).collect();
    assert_eq!(triangles("latin.ply", &latin), 4);
    assert_eq!(triangles("mark.ply", format!("\u{feff}{text}")), 4);
    // In the body of a file of bytes they are what they are.
    let head = text.replace("ascii", "binary_little_endian");
    let head = &head[..head.find("end_header\n").unwrap() + 11];
    let mut bytes: Vec<u8> = head.chars().map(|letter| letter as u8).collect();
    for [x, y] in BAY {
        bytes.extend([x as f32, y as f32, 0.0].into_iter().flat_map(f32::to_le_bytes));
    }
    bytes.push(6);
    bytes.extend((0..6).flat_map(i32::to_le_bytes));
    assert_is_the_l(&white("latin.ply", &bytes).unwrap());
    assert_eq!(triangles("mark.ply", [b"\xef\xbb\xbf".to_vec(), bytes].concat()), 4);
}

#[test]
fn lines_may_end_as_on_any_system() {
    let text = polygon(&BAY);
    assert_is_the_l(&white("mac.ply", text.replace('\n', "\r")).unwrap());
    assert_is_the_l(&white("windows.ply", text.replace('\n', "\r\n")).unwrap());
}

#[test]
fn faces_may_stand_before_their_vertices() {
    let text = polygon(&BAY);
    let (header, body) = text.split_once("end_header\n").unwrap();
    let (before, face) = header.split_at(header.find("element face").unwrap());
    let (start, vertex) = before.split_at(before.find("element vertex").unwrap());
    let (places, corners) = body.split_at(body.find("6 0 1").unwrap());
    let turned = format!("{start}{face}{vertex}end_header\n{corners}{places}");
    assert_is_the_l(&white("a.ply", turned).unwrap());
}

/// The index of a material, of many, is found without a look at all the others.
#[test]
fn tens_of_thousands_of_materials_take_little_time() {
    let names: String = (0..30_000).map(|index| format!("comment material m{index}\n")).collect();
    let text = polygon(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        .replace("comment material concrete\n", &names)
        .replace("element face 1", "element face 200000")
        .replace("3 0 1 2\n", &"3 0 1 2\n".repeat(200_000));
    let began = std::time::Instant::now();
    assert_eq!(triangles("a.ply", text), 200_000);
    assert!(began.elapsed().as_secs() < 5, "{:?}", began.elapsed());
}

#[test]
fn an_index_below_zero_is_of_no_material() {
    let text = polygon(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        .replace("element face 1", "element face 2")
        .replace("end_header", "property int material_index\nend_header")
        .replace("3 0 1 2\n", "3 0 1 2 -1\n3 0 1 2 0\n");
    let files = folder(&[("a.ply", text.as_bytes())]);
    let scene = object(files.path(), "name = \"o\"\nmesh = \"a.ply\"").unwrap();
    let names: Vec<&str> = scene.materials.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(names.len(), 2, "{names:?}");
}

#[test]
fn strips_of_triangles_are_surfaces() {
    let text = polygon(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [3.0, 3.0]]);
    let text = text
        .replace("element face", "element tristrips")
        .replace("5 0 1 2 3 4", "9 0 1 2 3 -1 4 3 2 -1");
    assert_eq!(triangles("a.ply", text), 3);
}

#[test]
fn what_is_no_surface_is_left_out_and_what_is_wrong_is_told_with_its_line() {
    let text = polygon(&BAY);
    let with_edges = text.replace("end_header", "element edge 1\nproperty int vertex1\nend_header");
    assert_eq!(triangles("a.ply", format!("{with_edges}0\n")), 4);
    let told = refused("a.ply", text.replace("1 3 0\n", "1 b 0\n"));
    assert!(told.contains("line 14 reads \"1 b 0\""), "{told}");
    let told = refused("a.ply", text.replace("5\n", "9\n"));
    assert!(told.contains("names vertex 9"), "{told}");
    assert!(refused("a.ply", "ply\nformat ascii 1.0\nelement point 1\n").contains("end_header"));
    let told = refused("a.ply", text.replace("vertex 6", "vertex 4000000000"));
    assert!(told.contains("says that it has 4000000001 elements, more than 67108864"), "{told}");
    let told = refused("a.ply", text.replace("property float z\n", ""));
    assert!(told.contains("without x, y or z"), "{told}");
}
