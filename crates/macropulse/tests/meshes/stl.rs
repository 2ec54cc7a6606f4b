//! STL, as text and as bytes.

use super::{refused, triangles, white};

/// A facet whose corners are at this height.
fn facet(z: f64) -> String {
    format!(
        "facet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex 1 0 {z}\nvertex 0 1 {z}\nendloop\n\
         endfacet\n"
    )
}

fn binary(title: &[u8], facets: u32, normal: f32) -> Vec<u8> {
    let mut bytes = title.to_vec();
    bytes.resize(80, b' ');
    bytes.extend(facets.to_le_bytes());
    for z in 0..facets {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| [x, y, z as f32]);
        let numbers = [[normal; 3]].into_iter().chain(corners).flatten();
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn all_solids_of_a_text_are_read() {
    let solid = |name: &str, z| format!("solid {name}\n{}endsolid {name}\n", facet(z));
    let text = format!("{}{}\n{}", solid("base", 0.0), solid("a b", 1.0), solid("", 2.0));
    assert_eq!(triangles("a.stl", text), 3);
}

#[test]
fn a_solid_may_be_called_as_what_it_has() {
    for name in ["facet", "big facet", "facet of a vertex endloop"] {
        let text = format!("solid {name}\n{}endsolid {name}\n", facet(0.0));
        assert_eq!(triangles("a.stl", &text), 1, "{name}");
        let twice = format!("{text}{text}").replace('\n', " ");
        assert_eq!(triangles("one-line.stl", &twice), 2, "{name}");
    }
}

#[test]
fn words_may_be_in_capitals_and_apart_by_tabs() {
    let text = format!("solid a\n{}endsolid a\n", facet(0.0));
    assert_eq!(triangles("capitals.stl", text.to_uppercase()), 1);
    assert_eq!(triangles("tabs.stl", text.replace(' ', "\t")), 1);
    assert_eq!(triangles("mac.stl", text.replace('\n', "\r")), 1);
    assert_eq!(triangles("windows.stl", text.replace('\n', "\r\n")), 1);
    assert_eq!(triangles("indented.stl", text.replace('\n', "\n \t ")), 1);
    assert_eq!(
        triangles("one-line.stl", text.replacen("solid a\n", "solid\n", 1).replace('\n', " ")),
        1
    );
}

#[test]
fn a_binary_file_may_begin_with_solid() {
    assert_eq!(triangles("a.stl", binary(b"solid exported by a program", 4, 0.0)), 4);
    assert_eq!(triangles("a.stl", binary(b"solid\n facet \n", 4, 0.0)), 4);
    // Bytes behind the facets do not count.
    let more = [binary(b"solid x", 4, 0.0), b"colours".to_vec()].concat();
    assert_eq!(triangles("a.stl", more), 4);
    let cut = &binary(b"solid x", 4, 0.0)[..250];
    assert!(
        refused("a.stl", cut).contains("says that it has 4 facets"),
        "{}",
        refused("a.stl", cut)
    );
}

/// A count of facets that was never filled in.
#[test]
fn facets_that_are_not_counted_are_told_of() {
    let mut bytes = binary(b"", 3, 0.0);
    bytes[80..84].fill(0);
    let told = refused("a.stl", &bytes);
    assert!(told.contains("no facets, and has bytes of 3"), "{told}");
    let told = refused("a.stl", &bytes[..84]);
    assert!(told.contains("holds no triangles"), "{told}");
}

#[test]
fn normals_are_not_needed() {
    assert_eq!(triangles("a.stl", binary(b"", 2, f32::NAN)), 2);
    for normal in ["nan nan nan", "-nan(ind) 0 0", "inf 0 0", "0 0"] {
        let text =
            format!("solid a\n{}endsolid\n", facet(0.0).replace("0 0 1\n", &format!("{normal}\n")));
        assert_eq!(triangles("a.stl", &text), 1, "{normal}");
    }
}

#[test]
fn names_in_latin_1_and_marks_of_the_byte_order_do_not_matter() {
    let text = format!("solid Geh\u{e4}use\n{}endsolid\n", facet(0.0));
    let latin: Vec<u8> = text.chars().map(|letter| letter as u8).collect();
    assert_eq!(triangles("latin.stl", latin), 1);
    assert_eq!(triangles("mark.stl", format!("\u{feff}{text}")), 1);
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    let text = format!("solid a\n{}{}endsolid a\n", facet(0.0), facet(1.0));
    let told = refused("a.stl", text.replacen("vertex 1 0 1\n", "vertex 1 O 1\n", 1));
    assert!(told.contains("line 12") && told.contains("\"O\""), "{told}");
    let told = refused("a.stl", text.replacen("vertex 1 0 1\n", "", 1));
    assert!(told.contains("line 13") && told.contains("2 corners"), "{told}");
    let told = refused("a.stl", &text[..text.len() - 60]);
    assert!(told.contains("cut short"), "{told}");
    assert!(white("nowhere.stl", text.replace("vertex 1 0 1", "vertex 1 inf 1")).is_err());
    let wide = "solid a\n".bytes().flat_map(|byte| [byte, 0]).collect::<Vec<u8>>();
    let told = refused("wide.stl", [b"\xff\xfe".to_vec(), wide].concat());
    assert!(told.contains("UTF-16"), "{told}");
}
