//! Golden macropulses.

#![allow(missing_docs)]

use crate::common;

use common::Desk;
use serde_json::json;

#[test]
fn the_second_pixel_of_the_paper() {
    let shot = Desk::new().json("encode --sensor kim-park-2016 --pixel 0,1 --json");
    // Label 1 is 0000000001 and its checksum 011: bits 9, 11, 12. Word 1 over GF(29) has its
    // marks at 29·j + j.
    let marks: Vec<u32> =
        [9, 11, 12].into_iter().flat_map(|bit| (0..29).map(move |j| 841 * bit + 30 * j)).collect();
    assert_eq!(marks[0], 7569);
    assert_eq!(
        shot,
        json!({
            "schema_version": 1,
            "row": 0,
            "column": 1,
            "label": 1,
            "payload": "0000000001011",
            "code_word": 1,
            "marks": marks,
            "chips": 10_933,
            "fired_at_fs": 40_945_000_i64,
        })
    );
}

#[test]
fn several_pixels_are_an_array() {
    let line = "encode --sensor kim-park-2016 --pixel 0,0 --pixel 1,0 --scan 60 --json";
    let shots = Desk::new().json(line);
    // Column 0 is dark to the letter; pixel 848 has word 848 mod 29 = 7.
    assert_eq!(shots[0]["marks"], json!([]));
    assert_eq!(shots[0]["fired_at_fs"], 1_000_000_000_000_000_i64);
    assert_eq!(shots[1]["code_word"], 7);
}

#[test]
fn an_uncoded_sensor_sends_one_mark() {
    let shot = Desk::new().json("encode --sensor hdl-64e --pixel 3,7 --json");
    assert_eq!(shot["marks"], json!([0]));
    assert_eq!(shot["chips"], 1);
    assert_eq!(shot["payload"], json!(null));
}

#[test]
fn the_text_names_what_the_json_does() {
    let ran = Desk::new().run("encode --sensor kim-park-2016-fixed --pixel 479,847");
    assert_eq!(ran.code, Some(0));
    for word in ["row 479, column 847", "label      847", "(14 bits)", "code word"] {
        assert!(ran.out.contains(word), "{}", ran.out);
    }
}

/// The log of a scan through a pipe is that of the file, and --quiet is.
/// A word without a label is named with its marks, here those that were drawn for the sensor.
#[test]
fn a_bare_code_word_is_no_single_mark() {
    let told = Desk::new().run("encode coded-16 --pixel 0,2").out;
    assert!(told.contains("bare code word") && told.contains("0 193 232"), "{told}");
    assert!(!told.contains("one mark per shot"), "{told}");
}

#[test]
fn a_shot_log_leaves_through_standard_output() {
    let desk = Desk::new();
    let line = "encode kim-park-2016-fixed --set scan.raster.rows=2 --scan 3 --format ticks-csv";
    let ran = desk.run(&format!("{line} -o out -q"));
    assert_eq!((ran.code, ran.out.as_str(), ran.err.as_str()), (Some(0), "", ""));
    let log = std::fs::read_to_string(desk.path().join("out/shots-000003.csv")).unwrap();
    assert!(log.lines().count() > 2 * 848, "{log}");
    assert_eq!(desk.run(&format!("{line} -o -")).out, log);
}
