//! Sensor files.

use super::{Desk, Row, files_refused, wrong};

const HEAD: &str = "version = 1\nname = \"mine\"\nextends = \"peregrine\"\n";

const CODED: &str = "version = 1\nname = \"mine\"\nextends = \"kim-park-2016\"\n";

/// Behind three lines that extend a flash of single pulses.
const ROWS: &[Row] = &[
    ("[scan]\nmax_rnage_m = 90", &["mine.toml:5:1:", "did you mean `max_range_m`?"]),
    ("[scan]\nmax_range = 90", &["mine.toml:5:1:", "did you mean `max_range_m`?"]),
    ("[scan]\nmax_range_km = 0.09", &["mine.toml:5:1:", "did you mean `max_range_m`?"]),
    ("max_range_m = 90", &["mine.toml:4:1:", "`max_range_m` here", "it belongs in [scan]"]),
    ("[scan]\nrows = 8", &["mine.toml:5:1:", "[scan.raster] or [scan.flash]"]),
    (
        "[scan]\nmax_range_m = \"90\"",
        &[
            "mine.toml:5:1:",
            "the text \"90\"",
            "a number from 0.01 to 100000",
            "take the quotes away",
        ],
    ),
    ("[scan]\nmax_range_m = \"90 m\"", &["mine.toml:5:1:", "write it alone", "its unit"]),
    ("[scan]\nmax_range_m = 90 m", &["mine.toml:5:15:", "is not TOML", "without a unit"]),
    ("[scan]\nmax_range_m = 90,5", &["mine.toml:5:17:", "is not TOML", "with a point, as 0.5"]),
    ("[scan]\nmax_range_m = 150000", &["mine.toml:5:1:", "is 150000", "between 0.01 and 100000"]),
    ("[scan]\nmax_range_m = 0", &["mine.toml:5:1:", "is 0", "between"]),
    ("[scan]\nmax_range_m = nan", &["mine.toml:5:1:", "NaN", "between"]),
    ("[scan]\nmax_range_m = 9\n[scan]\nmin_range_m = 1", &["mine.toml:6:2:", "there twice"]),
    ("[scan.flash]\nrows = 12.5", &["mine.toml:5:1:", "is 12.5", "a whole number from 1 to 16384"]),
    ("[scan.flash]\nrows = -1", &["mine.toml:5:1:", "is -1", "a whole number from 1 to 16384"]),
    ("[scan.raster]\nrows = 10", &["mine.toml:4:7:", "scan.raster", "`columns` is missing"]),
    ("[scan.raster]\nrows = 1\n[scan.flash]\nrows = 1", &["scan.raster", "`columns` is missing"]),
    ("[scan.table]\nfile = \"gone.csv\"", &["mine.toml:5:1:", "gone.csv", "there is no such file"]),
    (
        "[light]\nwavelength_nm = 9.05e-7",
        &["mine.toml:5:1:", "wavelength_nm", "between 200 and 20000"],
    ),
    ("[light]\nwavelength_um = 0.9", &["mine.toml:5:1:", "did you mean `wavelength_nm`?"]),
    ("[light]\nenergy = 100", &["mine.toml:5:1:", "\"class-1\" or { shot_nj = … }"]),
    ("[light]\nenergy = \"class1\"", &["mine.toml:5:1:", "did you mean `class-1`?"]),
    ("[light]\nfootprint_rays = 5", &["mine.toml:5:1:", "1, 9 or 25 of a flash"]),
    ("[detector]\nkind = \"geiger\"", &["mine.toml:5:1:", "`kind`", "receiver"]),
    ("[detector.spad]\ncells = 4", &["mine.toml:4:11:", "`spad`", "photon-counting, geiger"]),
    ("[detector.single-stop]\njitter_ps = -5", &["mine.toml:5:1:", "is -5", "between 0 and"]),
    ("[detector.geiger]\nefficiency = 20", &["--with link-budget", "sensitivity: is needed"]),
    ("[tdc]\nbits = 40", &["mine.toml:5:1:", "is 40", "between 1 and 16"]),
    ("[receiver]\nkind = \"matched\"", &["mine.toml:5:1:", "`direct` is for shots without [code]"]),
    ("[receiver]\nkind = \"optimal\"", &["mine.toml:5:1:", "known are literal, blind, matched"]),
    ("[receiver]\nreturns = 20", &["mine.toml:5:1:", "is 20", "between 1 and 8"]),
    ("idealised = \"footprint\"", &["mine.toml:4:1:", "a list, as [ … ]"]),
    ("idealised = [\"sun\"]", &["mine.toml:4:1:", "`sun` is no effect; known are footprint"]),
    ("[sun]\nirradiance = 1", &["mine.toml:5:1:", "[environment] in the scene file"]),
];

/// Behind three lines that extend a raster with a code.
const OF_CODES: &[Row] = &[
    ("[code]\nfamily = \"prime\"", &["mine.toml:5:1:", "code.family: must be { prime = … } or"]),
    (
        "[code]\nfamily = { prime = 29, gold = 7 }",
        &["mine.toml:5:1:", "exactly one, as { prime = … }"],
    ),
    ("[code]\nfamily = { primes = 29 }", &["mine.toml:5:12:", "did you mean `prime`?"]),
    ("[code]\nfamily = { prime = \"29\" }", &["mine.toml:5:12:", "take the quotes away"]),
    ("[code]\nfamily = { prime = 28 }", &["mine.toml:5:", "28 is not an odd prime", "29"]),
    ("[code]\nfamily = { gold = 8 }", &["mine.toml:5:1:", "use 5, 6, 7, 9, 10 or 11"]),
    (
        "[code]\nfamily = { list = { length = 9, marks = [[0, 5], [0, 5]] } }",
        &["mine.toml:5:1:", "code.family: words 0 and 1, counted from 0, are the same"],
    ),
    (
        "[code]\nfamily = { list = { length = 9, marks = [[0, 5], [0, -5]] } }",
        &["mine.toml:5:12:", "-5", "whole number"],
    ),
    (
        "[code]\nfamily = { list = { length = 9, marks = [0, 5] } }",
        &["mine.toml:5:12:", "must be a list"],
    ),
    ("[code]\nfamily = { sparse = { length = 100 } }", &["mine.toml:5:12:", "`weight` is missing"]),
    ("[code]\nchip_ps = 3", &["mine.toml:5:1:", "a whole number of TDC ticks"]),
    ("[code]\ncrc = 3", &["mine.toml:5:1:", "is 3", "{ width = …, polynomial = …, init = … }"]),
    (
        "[code]\nsync_bit = false\nallow_dark = false\nword = { first = 1, modulus = 28 }",
        &["mine.toml:6:1:", "code.allow_dark", "label 0", "sync_bit = true"],
    ),
    ("[code]\nlabel = \"row\"", &["mine.toml:5:1:", "known are column, none"]),
    ("[code]\nword = { first = 0, modulus = 100 }", &["mine.toml:5:21:", "between 1 and 29"]),
    ("[scan.raster]\ncolumns = 0", &["mine.toml:5:1:", "is 0", "between 1 and 32768"]),
    ("[scan.raster]\nmirror = \"galvo\"", &["mine.toml:5:1:", "known are uniform, sinusoidal"]),
];

/// Whole files.
const WHOLE: &[Row] = &[
    ("", &["neither a sensor", "`macropulse sensors NAME`"]),
    ("version = 2\nextends = \"peregrine\"", &["mine.toml:1:1:", "this program reads version 1"]),
    ("version = \"1\"\nextends = \"peregrine\"", &["mine.toml:1:1:", "take the quotes away"]),
    (
        "version = 1\nname = mine\nextends = \"peregrine\"",
        &["mine.toml:2:8:", "text stands in quotes"],
    ),
    (
        "extends = \"peregrin\"",
        &["mine.toml:1:1:", "peregrin: no such sensor", "did you mean `peregrine`?"],
    ),
    ("extends = \"vlp\"", &["mine.toml:1:1:", "did you mean `vlp-16`?"]),
    (
        "extends = \"base.toml\"",
        &["mine.toml:1:1:", "base.toml: cannot be read: there is no such file"],
    ),
    ("extends = \"peregrine.toml\"", &["mine.toml:1:1:", "is called `peregrine`, without .toml"]),
    ("extends = \"mine.toml\"", &["mine.toml:1:1:", "in a circle"]),
    ("extends = [\"peregrine\"]", &["mine.toml:1:1:", "the name of a sensor or file"]),
    (
        "version = 1\nname = \"a\"\n[scan]\nscans_per_s = 10",
        &["mine.toml:3:2:", "`max_range_m` is missing", "extends = \"NAME\""],
    ),
    ("version = 1\nidealised = []", &["mine.toml: ", "is missing", "extends = \"NAME\""]),
    ("version: 1\nextends: peregrine", &["mine.toml:1:", "is not TOML", "KEY = VALUE"]),
    ("{ \"version\": 1 }", &["mine.toml:1:1:", "is not TOML: it looks like JSON"]),
];

#[test]
fn sensor_files() {
    let desk = Desk::new();
    files_refused(&desk, HEAD, ROWS);
    files_refused(&desk, CODED, OF_CODES);
    files_refused(&desk, "", WHOLE);
}

/// The control: what is refused above is refused for the fault it has.
#[test]
fn windows_and_good_files() {
    let desk = Desk::new();
    for text in [HEAD, CODED, &HEAD.replace('\n', "\r\n"), &format!("\u{feff}{HEAD}")] {
        desk.put("mine.toml", text);
        let ran = desk.run("simulate mine.toml wall --format none -q --set scan.scans_per_s=30");
        assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""), "{text}");
    }
    desk.put("mine.toml", &format!("{HEAD}scan.max_rnage_m = 3\n").replace('\n', "\r\n"));
    assert_eq!(wrong(&desk, "check mine.toml", &["mine.toml:4:6:"]), None);
    std::fs::write(desk.path().join("mine.toml"), b"\xff\xfev\0e\0").unwrap();
    assert_eq!(wrong(&desk, "check mine.toml", &["it is not text in UTF-8"]), None);
}

/// Checks `mine.toml` with each text as the file called `name` beside it.
fn beside_refused(desk: &Desk, name: &str, rows: &[Row]) {
    let wrong = rows.iter().filter_map(|(text, words)| {
        Some(format!("{text}{}", wrong(desk.put(name, text), "check mine.toml", words)?))
    });
    let wrong: Vec<String> = wrong.collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

/// A table of directions, beside the sensor file.
const DIRECTIONS: &[Row] = &[
    ("", &["dirs.csv"]),
    ("1,2\n3,4\n", &["dirs.csv", "needs a header with `azimuth`"]),
    ("azimuth;elevation\n1;2\n", &["dirs.csv"]),
    ("azimuth/deg,elevation/deg\n1\n", &["dirs.csv", "2"]),
    ("azimuth/deg,elevation/deg\n1,x\n", &["dirs.csv", "2"]),
    ("azimuth/deg,elevation/deg\n1,95\n", &["dirs.csv", "2"]),
    ("azimuth,elevation\n1,2\n", &["dirs.csv", "two at least"]),
    ("azimuth/grad,elevation/deg\n1,2\n", &["dirs.csv", "grad"]),
    ("azimuth/deg,elevation/deg,zenith/deg\n1,2,3\n", &["dirs.csv", "zenith"]),
    ("time/s,azimuth/deg,elevation/deg\n1,0,0\n0,0,0\n", &["dirs.csv"]),
    ("azimuth/deg,elevation/deg\n", &["dirs.csv"]),
];

#[test]
fn tables_of_directions() {
    let desk = Desk::new();
    desk.put(
        "mine.toml",
        "version = 1\nname = \"m\"\nextends = \"rosette-mid-40\"\n\
         [scan.table]\nfile = \"dirs.csv\"\nfirings_per_s = 1000\n",
    );
    beside_refused(&desk, "dirs.csv", DIRECTIONS);
}

const CALIBRATIONS: &[Row] = &[
    ("", &["cal.yaml"]),
    ("lasers: 3\n", &["cal.yaml:1", "a list is wanted here"]),
    ("lasers: []\n", &["cal.yaml"]),
    ("lasers:\n- {laser_id: 0, vert_correction: 0.1}\n", &["cal.yaml", "rot_correction"]),
    (
        "lasers:\n- {laser_id: 0, rot_correction: 0, vert_correction: 15}\n",
        &["cal.yaml:2", "vert_correction", "rad"],
    ),
    ("lasers:\n- {laser_id: 0, rot_correction: a, vert_correction: 0}\n", &["cal.yaml:2"]),
    ("lasers:\n- {laser_id: 1, rot_correction: 0, vert_correction: 0}\n", &["cal.yaml"]),
    (
        "lasers:\n- {laser_id: 0, rot_corection: 0, vert_correction: 0}\n",
        &["cal.yaml", "rot_corection"],
    ),
    (
        "lasers:\n- {laser_id: 0, rot_correction: 0, vert_correction: 0}\nnum_lasers: 2\n",
        &["cal.yaml", "2"],
    ),
    (
        "lasers:\n- {laser_id: 0, rot_correction: 0, vert_correction: 0, vert_correction: 0}\n",
        &["cal.yaml:2", "the key `vert_correction` stands twice"],
    ),
    ("Laser id,Elevation\n1,14.4\n", &["cal.yaml:1:1", "begins with `lasers:`"]),
    ("<xml/>\n", &["cal.yaml"]),
];

#[test]
fn calibrations() {
    let desk = Desk::new();
    desk.put(
        "mine.toml",
        "version = 1\nname = \"m\"\nextends = \"vlp-16\"\nscan.spinning.calibration = \"cal.yaml\"\n",
    );
    beside_refused(&desk, "cal.yaml", CALIBRATIONS);
}
