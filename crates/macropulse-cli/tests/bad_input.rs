//! Wrong input is refused in one sentence that names the place and the way out, and leaves
//! nothing behind.

#![allow(missing_docs)]

mod common;

use common::Desk;

/// Simulates the sensor file `mine.toml` that holds `text`.
fn sensor_refused(text: &str, words: &[&str]) {
    let desk = Desk::new();
    desk.put("mine.toml", &format!("version = 1\nname = \"mine\"\n{text}"));
    desk.refused("simulate --sensor mine.toml --scene wall -o out", words);
    desk.refused("check mine.toml", words);
}

#[test]
fn a_good_sensor_file_is_accepted() {
    // The control of this file: what is refused below is refused for the fault it has.
    let desk = Desk::new();
    desk.put("mine.toml", "version = 1\nname = \"mine\"\nextends = \"peregrine\"\n");
    let ran = desk.run("simulate --sensor mine.toml --scene wall -o out");
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
}

#[test]
fn an_unknown_key() {
    sensor_refused(
        "extends = \"peregrine\"\n[scan]\nmax_rnage_m = 90.0\n",
        &["mine.toml:5:1:", "max_rnage_m", "did you mean `max_range_m`?"],
    );
}

#[test]
fn a_misspelt_sensor() {
    let words = ["kim-prak-2016", "did you mean `kim-park-2016`?"];
    let desk = Desk::new();
    desk.refused("simulate --sensor kim-prak-2016 --scene wall -o out", &words);
    desk.refused("encode --sensor kim-prak-2016 --pixel 0,0", &words);
    desk.refused("sensors kim-prak-2016", &words);
    desk.refused("check kim-prak-2016", &words);
}

#[test]
fn a_misspelt_scene() {
    let desk = Desk::new();
    let words = ["car-30", "did you mean", "car-30m"];
    desk.refused("simulate --sensor peregrine --scene car-30 -o out", &words);
    desk.refused("scenes car-30", &words);
}

#[test]
fn not_a_number() {
    let words = ["scan.max_range_m", "NaN", "between"];
    sensor_refused("extends = \"peregrine\"\nscan.max_range_m = nan\n", &words);
    Desk::new().refused("check peregrine --set scan.max_range_m=nan", &words);
}

#[test]
fn a_range_of_zero() {
    sensor_refused(
        "extends = \"peregrine\"\n[scan]\nmax_range_m = 0\n",
        &["mine.toml:5:1:", "scan.max_range_m", "is 0", "between"],
    );
}

#[test]
fn no_columns() {
    sensor_refused(
        "extends = \"kim-park-2016\"\n[scan.raster]\ncolumns = 0\n",
        &["mine.toml:5:1:", "scan.raster.columns", "is 0", "between 1 and"],
    );
}

#[test]
fn a_code_over_a_composite_number() {
    sensor_refused(
        "extends = \"kim-park-2016\"\n[code]\nfamily = { prime = 28 }\n",
        &["mine.toml:5:", "28 is not an odd prime", "29"],
    );
}

#[test]
fn a_payload_without_light() {
    sensor_refused(
        "extends = \"kim-park-2016-fixed\"\n[code]\nsync_bit = false\nallow_dark = false\n\
         crc = { width = 3, polynomial = 3, init = 0 }\n",
        &["mine.toml:6:1:", "code.allow_dark", "label 0", "sync_bit = true"],
    );
}

#[test]
fn a_folder_that_cannot_be_written() {
    let desk = Desk::new();
    desk.put("file", "");
    let words = ["file/below", "a file is in the way", "another one with -o"];
    desk.refused("simulate --sensor peregrine --scene wall -o file/below/out", &words);
    desk.refused("simulate --sensor peregrine --scene wall -o file", &["a file is in the way"]);
}

#[test]
fn a_folder_that_is_not_named() {
    let words = ["-o DIR", "--format none"];
    Desk::new().refused("simulate --sensor peregrine --scene wall", &words);
}

#[test]
fn a_pixel_out_of_the_image() {
    let desk = Desk::new();
    for pixel in ["480,0", "0,848", "4294967295,0"] {
        let line = format!("encode --sensor kim-park-2016 --pixel {pixel}");
        desk.refused(&line, &[pixel, "rows 0 to 479 and columns 0 to 847"]);
    }
    for pixel in ["1", "0,-1", "a,b", "99999999999,0"] {
        let line = format!("encode --sensor kim-park-2016 --pixel={pixel}");
        desk.refused(&line, &["--pixel", "row,column"]);
    }
    let line = "encode --sensor kim-park-2016 --pixel 0,0 --scan 540000";
    desk.refused(line, &["--scan 540000", "0 to 539999"]);
}

#[test]
fn too_many_scans() {
    let desk = Desk::new();
    let start = "simulate --sensor kim-park-2016 --scene wall -o out --scans";
    desk.refused(&format!("{start} 1000000000"), &["--scans", "at most 1000000", "several runs"]);
    desk.refused(&format!("{start} 600000"), &["--scans", "2.5 h", "at most 540000"]);
    desk.refused(&format!("{start} 0"), &["--scans", "at least 1"]);
    desk.refused(&format!("{start}=-1"), &["--scans"]);
}

#[test]
fn an_unknown_format() {
    let words = ["--format", "unknown format `pdc`", "did you mean `pcd`?"];
    Desk::new().refused("simulate --sensor peregrine --scene wall -o out --format pdc", &words);
}

#[test]
fn options_that_are_wrong() {
    let desk = Desk::new();
    desk.refused("simulate --sensor peregrine", &["--scene"]);
    desk.refused("simulate", &["<SENSOR>", "simulate --help"]);
    desk.refused("simulate --sead 3", &["--sead", "'--seed'"]);
    desk.refused("check peregrine --set scan.max_range_m", &["--set", "key=value"]);
    desk.refused("check peregrine --set scan.max_rnage_m=3", &["--set", "did you mean"]);
    desk.refused("simulte", &["simulte", "'simulate'"]);
    desk.refused("check peregrine --threads 5000", &["--threads", "0..=1024"]);
}

#[test]
fn a_scenario_that_is_wrong() {
    let desk = Desk::new();
    let good = "version = 1\nsensor = \"peregrine\"\nscene = \"wall\"\n";
    for (text, words) in [
        (format!("{good}scnas = 3\n"), ["s.toml:4:1:", "did you mean `scans`?"]),
        (format!("{good}scans = 1000000000\n"), ["s.toml:4:9:", "at most 1000000"]),
        (format!("{good}formats = [\"pyl\"]\n"), ["s.toml:4:12:", "did you mean `ply`?"]),
        (good.replace("wall", "wal"), ["s.toml:3:9:", "wall"]),
        (good.replace("peregrine", "perigrine"), ["s.toml:2:10:", "`peregrine`"]),
        (good.replace("peregrine", "my.toml"), ["s.toml:2:10:", "my.toml: cannot be read"]),
        ("version = ".to_owned(), ["s.toml:1:", "simulate"]),
    ] {
        desk.put("s.toml", &text);
        let words = if text == "version = " { &words[..1] } else { &words[..] };
        desk.refused("simulate s.toml -o out", words);
        desk.refused("check s.toml", &words[..1]);
    }
    desk.refused(
        "simulate gone.toml -o out",
        &["gone.toml: cannot be read: there is no such file"],
    );
    let words = ["hdl-64e: is a sensor", "`macropulse simulate hdl-64e street`"];
    desk.refused("simulate hdl-64e -o out", &words);
    desk.refused("simulate s.toml --sensor hdl-64e --scene wall -o out", &["cannot be used with"]);
}
