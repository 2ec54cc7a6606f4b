//! Scenario files: sensors, a scene, and how long.

use super::{Desk, Row, files_refused, refused};

const GOOD: &str = "version = 1\nsensor = \"peregrine\"\nscene = \"wall\"\n";

/// Behind three lines that are good.
const ROWS: &[Row] = &[
    ("scnas = 3", &["mine.toml:4:1:", "did you mean `scans`?"]),
    ("scans = 1000000000", &["mine.toml:4:9:", "at most 1000000"]),
    ("scans = 0", &["mine.toml:4:9:", "at least 1"]),
    ("scans = \"3\"", &["mine.toml:4:9:", "take the quotes away"]),
    ("scans = 1.5", &["mine.toml:4:9:", "is 1.5", "a whole number"]),
    ("seed = -1", &["mine.toml:4:8:", "is -1", "a whole number, 0 or more"]),
    ("formats = [\"pyl\"]", &["mine.toml:4:12:", "did you mean `ply`?"]),
    ("formats = \"ply\"", &["mine.toml:4:11:", "a list, as [ … ]"]),
    ("truth = \"yes\"", &["mine.toml:4:9:", "true or false"]),
    ("scene = \"street\"", &["mine.toml:4:1:", "there twice"]),
];

/// Whole files.
const WHOLE: &[Row] = &[
    ("version = 1\nscene = \"wall\"", &["mine.toml:1:1:", "names no sensor"]),
    ("version = 1\nsensor = \"peregrine\"", &["mine.toml:1:1:", "`scene` is missing"]),
    (
        "version = 2\nsensor = \"peregrine\"\nscene = \"wall\"",
        &["mine.toml:1:11:", "reads version 1"],
    ),
    (
        "version = 1\nsensor = \"perigrine\"\nscene = \"wall\"",
        &["mine.toml:2:10:", "did you mean `peregrine`?"],
    ),
    (
        "version = 1\nsensor = \"my.toml\"\nscene = \"wall\"",
        &["mine.toml:2:10:", "there is no such file"],
    ),
    (
        "version = 1\nsensor = \"peregrine\"\nscene = \"wal\"",
        &["mine.toml:3:9:", "did you mean \"wall\"?"],
    ),
    (
        "version = 1\nsensor = peregrine\nscene = \"wall\"",
        &["mine.toml:2:10:", "text stands in quotes"],
    ),
];

const LINES: &[Row] = &[
    ("simulate gone.toml -o out", &["gone.toml: cannot be read: there is no such file"]),
    ("simulate hdl-64e -o out", &["hdl-64e: is a sensor", "`macropulse simulate hdl-64e street`"]),
    ("simulate mine.toml -o out", &["mine.toml:4:1:", "did you mean `scans`?"]),
];

#[test]
fn scenario_files() {
    let desk = Desk::new();
    files_refused(&desk, GOOD, ROWS);
    files_refused(&desk, "", WHOLE);
    desk.put("mine.toml", &format!("{GOOD}scnas = 3\n"));
    refused(&desk, LINES.iter().map(|(line, words)| ((*line).to_owned(), *words)));
    let ran = desk.put("mine.toml", GOOD).run("simulate mine.toml --format none -q");
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
}
