//! Code families beside each other.

#![allow(missing_docs, clippy::unwrap_used)]

use crate::common;

use common::Desk;
use serde_json::json;

#[test]
fn the_paper_and_a_dense_family_in_figures() {
    let told = Desk::new().json("codes prime=29 gold=5 --json");
    let families = &told["families"];
    let paper = &families[0];
    assert_eq!(paper["family"], "prime 29");
    assert_eq!((&paper["length_chips"], &paper["words"]), (&json!(841), &json!(29)));
    assert_eq!(
        (&paper["sidelobe_periodic"], &paper["cross_max_periodic"]),
        (&json!(29), &json!(2))
    );
    assert_eq!(paper["harmless_interferers"], 14);
    let soft = paper["bit_errors"][2]["soft"].as_f64().unwrap();
    assert!((soft / 3.972e-7 - 1.0).abs() < 1e-3, "{soft}");
    assert_eq!(families[1]["words"], 33);
    assert!(families[1]["marks_min"].as_u64() < families[1]["marks_max"].as_u64());
}

#[test]
fn the_table_has_a_line_for_each_and_no_picture_without_a_folder() {
    let desk = Desk::new();
    let ran = desk.run("codes");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    for word in ["prime 29", "sparse 841, 29", "m-sequence 7", "Gold 7", "1.3e-4 / 1.1e-12"] {
        assert!(ran.out.contains(word), "no {word:?} in {}", ran.out);
    }
    assert!(desk.files().is_empty());
}

#[test]
fn the_same_pictures_every_time() {
    let (one, other) = (Desk::new(), Desk::new());
    let line = "codes quadratic-congruence=7 m-sequence=5 -q -o out/codes";
    for desk in [&one, &other] {
        let ran = desk.run(line);
        assert_eq!((ran.code, ran.out.as_str()), (Some(0), ""), "{}", ran.err);
    }
    let files = one.files();
    for name in ["index.html", "quadratic-congruence-7.png", "m-sequence-5.png", "errors-soft.svg"]
    {
        assert!(files.contains(&format!("out/codes/{name}")), "{files:?}");
    }
    for name in files.iter().filter(|name| name.contains('.')) {
        let read = |desk: &Desk| std::fs::read(desk.path().join(name)).unwrap();
        assert_eq!(read(&one), read(&other), "{name}");
    }
}

#[test]
fn what_is_no_family_is_refused_before_anything_is_written() {
    let desk = Desk::new();
    desk.refused("codes prime=28 -o out", &["prime=28", "23 and 29"]);
    desk.refused("codes prime=29 golf=7 -o out", &["golf=7", "did you mean `gold`"]);
    desk.refused("codes 29", &["as prime=29"]);
    desk.refused("codes gold=1000000000", &["degree 1000000000"]);
    desk.refused("codes orthogonal={length=1000,weight=5,words=60}", &["49 at most"]);
}
