//! Shot logs and ticks, and the commands that read and write them.

use super::{Desk, Row, refused};

const FEW: &str = "--set scan.raster.rows=2 --set scan.raster.columns=8";

/// Behind `decode` of the sensor that they were recorded with, into `out`.
const FILES: &[Row] = &[
    ("ticks.csv shots.csv", &["ticks.csv: line 1", "the shot log comes first, then the ticks"]),
    ("shots.csv", &["<RECORD>"]),
    ("shots.csv gone.csv", &["gone.csv: cannot be read: there is no such file"]),
    ("folder ticks.csv", &["folder: cannot be read: it is a folder"]),
    ("shots.csv folder", &["folder: cannot be read: it is a folder"]),
    ("cloud.pcd ticks.csv", &["cloud.pcd", "`# macropulse shots 1`"]),
    ("shots.csv cloud.pcd", &["cloud.pcd", "`# macropulse ticks 1`"]),
    ("empty.csv ticks.csv", &["empty.csv", "the file is empty"]),
    ("shots.csv empty.csv", &["empty.csv", "the file is empty"]),
    ("bare.csv ticks.csv", &["bare.csv", "`# macropulse shots`"]),
    ("semicolons.csv ticks.csv", &["semicolons.csv: line 1", "values stand between commas"]),
    ("shots.csv words.csv", &["words.csv: line 4", "abc"]),
    ("shots.csv fractions.csv", &["fractions.csv: line 4", "12.5"]),
    ("shots.csv wide.csv", &["wide.csv: line 4", "3 values, where the line of names has 1"]),
    ("shots.csv columns.csv", &["columns.csv: line 2", "known are tick, channel, amplitude"]),
    ("shots.csv backwards.csv", &["backwards.csv: line 4", "sort them by tick"]),
    ("shots.csv cut.csv", &["cut.csv", "truncated"]),
    ("- -", &["only one of SHOTS and RECORD can come from stdin"]),
    ("shots.csv ticks.csv --explain 99,99", &["rows 0 to 1 and columns 0 to 7"]),
    ("shots.csv ticks.csv --explain 1", &["row,column"]),
    ("shots.csv ticks.csv --format ticks", &["formats of points"]),
    ("shots.csv ticks.csv --format pdc", &["did you mean `pcd`?"]),
];

/// Whole lines.
const LINES: &[Row] = &[
    ("decode shots.csv ticks.csv -o out", &["--sensor"]),
    (
        "decode kim-park-2016-fixed shots.csv ticks.csv -o out",
        &["the sensor is named with --sensor"],
    ),
    ("decode --sensor wall shots.csv ticks.csv -o out", &["is a scene, where a sensor is wanted"]),
    (
        "decode --sensor kim-park-2016-fixed shots.csv ticks.csv -o out",
        &["of another sensor", "the same --set"],
    ),
    ("decode --sensor hdl-64e shots.csv ticks.csv -o out", &["ticks of 2500 fs", "10000 fs"]),
    ("encode", &["<SENSOR>"]),
    ("encode kim-park-2016", &["--output"]),
    ("encode kim-prak-2016 --pixel 0,0", &["did you mean `kim-park-2016`?"]),
    ("encode wall --pixel 0,0", &["is a scene, where a sensor is wanted"]),
    ("encode shots.csv --pixel 0,0", &["shots.csv:2:5: is not TOML"]),
    ("encode kim-park-2016 --pixel 0", &["--pixel", "row,column"]),
    ("encode kim-park-2016 --pixel a,b", &["--pixel", "row,column"]),
    ("encode kim-park-2016 --pixel=0,-1", &["--pixel", "row,column"]),
    ("encode kim-park-2016 --pixel 0 0", &["'0'"]),
    ("encode kim-park-2016 --pixel 99999999999,0", &["--pixel", "row,column"]),
    ("encode kim-park-2016 --pixel 480,0", &["480,0", "rows 0 to 479 and columns 0 to 847"]),
    ("encode kim-park-2016 --pixel 0,848", &["0,848", "rows 0 to 479 and columns 0 to 847"]),
    ("encode kim-park-2016 --pixel 0,0 --scan 540000", &["--scan 540000", "0 to 539999"]),
    ("encode kim-park-2016 --pixel 0,0 --scan -1", &["--scan", "a whole number, 0 or more"]),
    ("encode kim-park-2016 -o out --wall-m 5000", &["--wall-m 5000", "from 0 to 300 m"]),
    ("encode kim-park-2016 -o out --wall-m -5", &["--wall-m -5", "from 0 to 300 m"]),
    ("encode kim-park-2016 -o out --wall-m 50m", &["--wall-m", "a number, without its unit"]),
    ("encode kim-park-2016 -o out --format csv", &["ticks (binary) and ticks-csv (text)"]),
    ("encode kim-park-2016 -o - --wall-m 30", &["-o -", "--wall-m", "a folder with -o DIR"]),
];

/// A shot log and ticks, and what becomes of them in careless hands.
fn desk() -> Desk {
    let desk = Desk::new();
    let line =
        format!("encode kim-park-2016-fixed {FEW} --wall-m 50 --format ticks-csv -o made -q");
    assert_eq!(desk.run(&line).code, Some(0));
    let made = |name: &str| std::fs::read_to_string(desk.path().join("made").join(name)).unwrap();
    let (shots, ticks) = (made("shots-000000.csv"), made("ticks-000000.csv"));
    let lines: Vec<&str> = ticks.lines().collect();
    let with = |fourth: &str| [&lines[..3], &[fourth], &lines[4..]].concat().join("\n");
    desk.put("shots.csv", &shots).put("ticks.csv", &ticks).put("empty.csv", "");
    desk.put("cloud.pcd", "# .PCD v0.7\nVERSION 0.7\n").put("bare.csv", "shot,fired_fs\n0,0\n");
    desk.put("semicolons.csv", &shots.replace(',', ";"));
    desk.put("words.csv", &with("abc")).put("fractions.csv", &with("12.5"));
    desk.put("wide.csv", &with("1,2,3")).put("columns.csv", &ticks.replace("\ntick\n", "\ntime\n"));
    let backwards: Vec<&str> = lines[..2].iter().chain(lines[2..].iter().rev()).copied().collect();
    desk.put("backwards.csv", &backwards.join("\n"));
    desk.put("cut.csv", &(lines[..9].join("\n") + "\n"));
    std::fs::create_dir(desk.path().join("folder")).unwrap();
    desk
}

#[test]
fn files() {
    let start = format!("decode --sensor kim-park-2016-fixed {FEW} -o out");
    refused(&desk(), FILES.iter().map(|(typed, words)| (format!("{start} {typed}"), *words)));
}

#[test]
fn lines() {
    refused(&desk(), LINES.iter().map(|(line, words)| ((*line).to_owned(), *words)));
}

/// The control; and what Windows writes is read as well.
#[test]
fn files_of_windows() {
    let desk = desk();
    for name in ["shots.csv", "ticks.csv"] {
        let text = std::fs::read_to_string(desk.path().join(name)).unwrap();
        desk.put(&format!("w-{name}"), &format!("\u{feff}{}", text.replace('\n', "\r\n")));
    }
    let decoded = |files: &str| {
        let line = format!("decode --sensor kim-park-2016-fixed {FEW} -o - {files}");
        let ran = desk.run(&line);
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        ran.out
    };
    let points = decoded("shots.csv ticks.csv");
    assert!(points.lines().count() > 10, "{points}");
    assert_eq!(decoded("w-shots.csv w-ticks.csv"), points);
}
