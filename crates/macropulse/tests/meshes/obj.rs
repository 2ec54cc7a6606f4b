//! Wavefront OBJ and MTL.

use super::tetra::{folder, object, refusal};
use super::{BAY, assert_is_the_l, refused, triangles, white};

const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// Names of the materials of a scene of one mesh, `a.obj`, among these files.
fn materials(files: &[(&str, &[u8])]) -> Vec<String> {
    let files = folder(files);
    let scene = object(files.path(), "name = \"o\"\nmesh = \"a.obj\"").unwrap();
    scene.materials.into_iter().map(|material| material.name).collect()
}

#[test]
fn a_concave_polygon_keeps_its_bay() {
    let corners: String = BAY.iter().map(|[x, y]| format!("v {x} {y} 0\n")).collect();
    let scene = white("a.obj", format!("{corners}f 1 2 3 4 5 6\n")).unwrap();
    assert_is_the_l(&scene);
    assert_eq!(scene.triangles(), 4);
    // Seen from below, and with a corner that is listed from behind.
    assert_is_the_l(&white("a.obj", format!("{corners}f -1 -2 -3 -4 -5 -6\n")).unwrap());
    // A dart, whichever corner comes first.
    let dart = "v 0 0 0\nv 2 2 0\nv 0 1 0\nv -2 2 0\n";
    for order in ["1 2 3 4", "2 3 4 1", "3 4 1 2", "4 1 2 3"] {
        let scene = white("a.obj", format!("{dart}f {order}\n")).unwrap();
        assert!(super::is_covered(&scene, [0.0, 0.5]) && !super::is_covered(&scene, [0.0, 1.5]));
    }
}

#[test]
fn lines_and_points_are_no_surfaces() {
    let text = format!("{CORNERS}f 1 2 3\nl 1 2 3 4\np 1 2 3 4\nl 1/1 3/3\n");
    let scene = white("a.obj", &text).unwrap();
    assert_eq!(scene.triangles(), 1);
    assert!(
        scene.warnings.iter().any(|said| said.contains("2 lines and 4 points are no surfaces"))
    );
    let told = refused("a.obj", format!("{CORNERS}l 1 2 3 4\np 1 2 3\n"));
    assert!(told.contains("holds no triangles"), "{told}");
}

#[test]
fn free_form_surfaces_are_left_out_and_told() {
    let text = format!("{CORNERS}f 1 2 3\ncstype bspline\ndeg 1 1\nsurf 0 1 0 1 1 2 4 3\nend\n");
    let scene = white("a.obj", text).unwrap();
    assert!(scene.warnings.iter().any(|said| said.contains("curves and free-form surfaces")));
}

#[test]
fn a_line_may_go_on_on_the_next() {
    let text = format!("# from C:\\models\\\n{CORNERS}f 1 \\\n 2 \\\r\n 3 4\n");
    assert_eq!(triangles("a.obj", text), 2);
}

#[test]
fn letters_may_be_of_latin_1_and_follow_a_byte_order_mark() {
    let obj = "mtllib caf\u{e9}.mtl\nusemtl Fen\u{ea}tre 2\nf 1 2 3\n";
    let mtl = "newmtl Fen\u{ea}tre 2\nKd 0.5 0.5 0.5\n";
    let latin = |text: &str| text.chars().map(|letter| letter as u8).collect::<Vec<u8>>();
    let marked = |text: &str| format!("\u{feff}{text}").into_bytes();
    let (first, second) = (format!("v 0 0 0\n{CORNERS}{obj}"), mtl);
    for obj in [latin(&first), marked(&first)] {
        for mtl in [latin(second), marked(second)] {
            let names = materials(&[("a.obj", &obj), ("caf\u{e9}.mtl", &mtl)]);
            assert_eq!(names, ["o/fen\u{ea}tre-2"]);
        }
    }
    let wide: Vec<u8> = first.encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert!(refused("a.obj", [b"\xff\xfe".to_vec(), wide].concat()).contains("UTF-16"));
}

#[test]
fn a_line_may_name_several_material_files() {
    let obj = format!("mtllib a.mtl b.mtl\n{CORNERS}usemtl one\nf 1 2 3\nusemtl two\nf 1 3 4\n");
    let [one, two] = [b"newmtl one\nKd 0 0 0\n", b"newmtl two\nKd 1 1 1\n"];
    let names = materials(&[("a.obj", obj.as_bytes()), ("a.mtl", one), ("b.mtl", two)]);
    assert_eq!(names, ["o/one", "o/two"]);
    // Or one whose name has a blank, which others write as if it were two.
    let obj = obj.replace("a.mtl b.mtl", "my car.mtl");
    let both = [one.as_slice(), two].concat();
    assert_eq!(materials(&[("a.obj", obj.as_bytes()), ("my car.mtl", &both)]), names);
    let files = folder(&[("a.obj", obj.as_bytes())]);
    let told = refusal(files.path(), "mesh = \"a.obj\"");
    assert!(told.contains("my car.mtl, which is not there"), "{told}");
    let obj = obj.replace("my car.mtl", ".\\parts\\a.mtl");
    let files = folder(&[("a.obj", obj.as_bytes())]);
    std::fs::create_dir(files.path().join("parts")).unwrap();
    std::fs::write(files.path().join("parts/a.mtl"), &both).unwrap();
    object(files.path(), "mesh = \"a.obj\"").unwrap();
}

#[test]
fn a_line_of_a_material_may_go_on_on_the_next() {
    let obj = format!("mtllib a.mtl\n{CORNERS}usemtl red\nf 1 2 3\n");
    let mtl = "newmtl \\\nred\nKd 1 \\\r\n 0 \\\n 0\n";
    let names = materials(&[("a.obj", obj.as_bytes()), ("a.mtl", mtl.as_bytes())]);
    assert_eq!(names, ["o/red"]);
}

/// Some programs name the file again before every part; and any file may name many.
#[test]
fn material_files_are_looked_for_once_and_not_without_end() {
    let named = |lines: &str| {
        let obj = format!("{lines}\n{CORNERS}usemtl red\nf 1 2 3\n");
        let files = folder(&[("a.obj", obj.as_bytes()), ("a.mtl", b"newmtl red\nKd 1 0 0\n")]);
        object(files.path(), "mesh = \"a.obj\"").map(|scene| scene.triangles())
    };
    let began = std::time::Instant::now();
    assert_eq!(named(&"mtllib a.mtl\n".repeat(1_000_000)), Ok(1));
    let told = named(&format!("mtllib{}", " a.mtl".repeat(1_000_000))).unwrap_err();
    assert!(told.contains("line 1 names more material files than the 4096"), "{told}");
    assert!(began.elapsed().as_secs() < 3, "{:?}", began.elapsed());
}

#[test]
fn a_material_without_a_name_is_none() {
    let obj = format!("mtllib a.mtl\n{CORNERS}usemtl\nf 1 2 3\nusemtl  \nf 1 3 4\n");
    let names = materials(&[("a.obj", obj.as_bytes()), ("a.mtl", b"newmtl red\nKd 1 0 0\n")]);
    assert_eq!(names, ["unnamed"]);
}

#[test]
fn names_of_materials_are_kept_where_no_file_tells_their_colour() {
    let obj = format!("{CORNERS}usemtl brick\nf 1 2 3\nusemtl Fascia\nf 1 3 4\n");
    assert_eq!(materials(&[("a.obj", obj.as_bytes())]), ["brick", "unnamed"]);
    let files = folder(&[("a.obj", obj.as_bytes())]);
    let keys = "mesh = \"a.obj\"\nmaterial = \"white\"\nmaterials = { Fascia = \"wood\" }";
    let names = object(files.path(), keys).unwrap().materials;
    assert_eq!(names.iter().map(|one| one.name.as_str()).collect::<Vec<_>>(), ["white", "wood"]);
}

#[test]
fn a_colour_of_one_number_is_grey_and_of_two_is_refused() {
    let obj = format!("mtllib a.mtl\n{CORNERS}usemtl paint\nf 1 2 3\n");
    let of = |colour: &str| {
        let mtl = format!("# a colour\nnewmtl paint\n{colour}\n");
        let files = folder(&[("a.obj", obj.as_bytes()), ("a.mtl", mtl.as_bytes())]);
        object(files.path(), "mesh = \"a.obj\"").map(|scene| scene.materials[0].at(905e-9).diffuse)
    };
    assert_eq!(of("Kd 0.25"), Ok(0.25));
    assert_eq!(of("Kd 0.25 0.25 0.25 # grey"), Ok(0.25));
    assert_eq!(of("\tKd xyz 0.1 0.4 0.2"), Ok(0.4), "Y is the luminance");
    assert_eq!(of("Kd spectral paint.rfl 1"), Ok(0.3), "no colour is known");
    for wrong in
        ["Kd", "Kd 0.5 0.5", "Kd a b c", "Kd nan nan nan", "Kd 1e999 0 0", "Kd 0,5 0,5 0,5"]
    {
        let told = of(wrong).unwrap_err();
        assert!(told.contains("a.mtl: line 3") && !told.contains('\n'), "{wrong}: {told}");
    }
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    let line = |text: &str, words: &[&str]| {
        let told = refused("a.obj", format!("{CORNERS}f 1 2 3\n{text}\n"));
        for word in words.iter().chain(&["line 6"]) {
            assert!(told.contains(word), "{text}: no {word:?} in {told}");
        }
    };
    line("f 1 2 9", &["9", "4"]);
    line("f 1 2 -5", &["-5", "4"]);
    line("f 0 1 2", &["0", "counted from 1"]);
    line("f 1 2 x", &["\"x\""]);
    line("v 1 2", &["three"]);
    line("v 1 2 a", &["\"a\""]);
    line("v 0 0 nan", &["nan"]);
}

/// Corners of lines and texture, colours, groups, and faces of one or two corners.
#[test]
fn the_rest_of_the_format_does_not_matter() {
    let text = "o a\ng x y\nv 0 0 0 1 0 0\nv 1 0 0 1\nv 0 1 0\nvt 0 0\nvn 0 0 1\ns off\n\
                f 1/1/1 2/1/1 3/1/1 # a face\nf 1//1 2//1 3//1\nf 1/1 2/1 3/1\nf 1 2\nf 3\nmg 1 1\n";
    assert_eq!(triangles("a.obj", text), 3);
    assert_eq!(triangles("a.obj", text.replace('\n', "\r\n")), 3);
    assert_eq!(triangles("a.obj", text.replace('\n', "\r")), 3);
    assert_eq!(triangles("a.obj", text.replace(' ', "\t")), 3);
}
