//! Mistakes on the command line.

use super::{Desk, Row, refused};

/// With `simulate peregrine wall -o out` before it.
const OPTIONS: &[Row] = &[
    ("--seed -1", &["'-1'", "--seed", "a whole number, 0 or more"]),
    ("--seed abc", &["--seed", "a whole number"]),
    ("--seed 1.5", &["--seed", "a whole number"]),
    ("--sead 3", &["--sead", "'--seed'"]),
    ("--scans 0", &["--scans", "at least 1"]),
    ("--scans -3", &["--scans", "a whole number, 0 or more"]),
    ("--scans 1e3", &["--scans", "a whole number"]),
    ("--scans 1000000000", &["--scans", "at most 1000000", "several runs"]),
    ("-j -2", &["--threads", "from 0 to 1024"]),
    ("--threads 5000", &["--threads", "from 0 to 1024"]),
    ("--format pdc", &["unknown format `pdc`", "did you mean `pcd`?"]),
    ("--format pcd ply", &["'ply'", "--format pcd,ply"]),
    ("--format .pcd", &["did you mean `pcd`?"]),
    ("--format holograms", &["unknown format `holograms`", "known: pcd, ply"]),
    ("--set scan.max_range_m", &["--set", "key=value"]),
    ("--set =3", &["--set", "key=value"]),
    ("--set scan.max_range_m=", &["--set", "key=value"]),
    ("--set scan.max_range_m = 90", &["'='", "one word, as --set scan.max_range_m=90"]),
    (
        "--set scan.max_range_m=far",
        &["scan.max_range_m", "the text \"far\"", "a number from 0.01 to 100000"],
    ),
    ("--set scan.max_range_m=150m", &["scan.max_range_m", "write it alone"]),
    ("--set scan.max_range_m=150000", &["is 150000", "between 0.01 and 100000"]),
    ("--set scan.max_range_m=nan", &["NaN", "between"]),
    ("--set scan.max_rnage_m=3", &["did you mean `max_range_m`?"]),
    ("--set max_range_m=100", &["`max_range_m` here; it belongs in [scan]"]),
    ("--set scan.flash.rows=12.5", &["a whole number from 1 to 16384"]),
    ("--set object.wall.position_m.x=30", &["--set scene:object"]),
    ("--set scene:object.wal.position_m.x=30", &["did you mean `wall`?"]),
    ("--set scene:object.wall.position_m.w=30", &["there are x, y, z"]),
    ("--set scene:object.wall.positon_m.x=30", &["did you mean `position_m`?"]),
    (
        "--set scene:object.wall.position_m=30",
        &["object.wall.position_m", "is 30", "a list of 3 numbers"],
    ),
    ("--environment fog", &["did you mean `fog-50m`?"]),
    ("--set environment.visibility_km=0", &["between 0.01 and 1000"]),
    ("--without sunlight", &["`sunlight` is no effect", "background"]),
    ("--with footprint", &["9 or 25 rays"]),
    ("--with background --without background", &["leave one out"]),
    ("--explain 1", &["--explain", "row,column"]),
    ("extra", &["'extra'", "the folder for the results is named with -o"]),
];

/// Whole lines.
const LINES: &[Row] = &[
    ("simulat peregrine wall", &["'simulate'"]),
    ("simulate", &["<SENSOR>", "simulate --help"]),
    (
        "simulate peregrine",
        &["name a scene behind it, as in `macropulse simulate peregrine street`"],
    ),
    ("simulate wall", &["name a sensor before it"]),
    ("simulate peregrine wall", &["-o DIR", "--format none"]),
    (
        "simulate wall peregrine -o out",
        &["the sensor comes first", "`macropulse simulate peregrine wall`"],
    ),
    ("simulate scene.toml peregrine -o out", &["the sensor comes first"]),
    ("simulate kim-prak-2016 wall -o out", &["did you mean `kim-park-2016`?"]),
    ("simulate hdl wall -o out", &["did you mean `hdl-64e`?"]),
    (
        "simulate peregrine.toml wall -o out",
        &["there is no such file", "is called `peregrine`, without .toml"],
    ),
    ("simulate gone.toml wall -o out", &["gone.toml: cannot be read: there is no such file"]),
    ("simulate folder wall -o out", &["folder: cannot be read: it is a folder"]),
    ("simulate peregrine car-30 -o out", &["did you mean \"car-30m\"?"]),
    ("simulate peregrine folder -o out", &["there is no scene \"folder\"", "built in are"]),
    ("simulate peregrine gone.toml -o out", &["gone.toml: cannot be read: there is no such file"]),
    ("simulate peregrine wall -o scene.toml", &["a file is in the way", "-o"]),
    ("simulate peregrine wall -o scene.toml/below", &["a file is in the way", "-o"]),
    ("simulate --sensor peregrine", &["--scene"]),
    ("simulate peregrine - -o out", &["standard input"]),
    ("simulate - - -o out", &["- is named twice"]),
    ("simulate peregrine wall -o -", &["standard output takes one stream", "name a folder"]),
    ("sweep peregrine wall --vary scan.max_range_m=10,20 -o -", &["name a folder"]),
    ("codes prime=5 -o -", &["name a folder"]),
    ("budget coded-practical -o -", &["name a folder"]),
    ("check", &["<NAME-or-FILE>"]),
    ("check peregrin", &["did you mean `peregrine`?"]),
    ("check a.obj", &["a.obj:1:3: is not TOML"]),
    ("check folder", &["it is a folder"]),
    ("sensors peregrin", &["did you mean `peregrine`?"]),
    ("sensors gone.toml", &["there is no such file"]),
    ("sensors scene.toml", &["scene.toml:2:3:", "`object`"]),
    ("scenes wal", &["did you mean `wall`?"]),
    ("environments clear_day", &["did you mean `clear-day`?"]),
    ("schema", &["<KIND>", "schema --help"]),
    ("schema sensors", &["'sensor'"]),
    ("schema sensor -o gone/sensor.json", &["gone/sensor.json", "there is no such file or folder"]),
    ("man simulat", &["no such command", "simulate"]),
    ("man", &["<COMMAND>"]),
    ("completions basch", &["'bash'"]),
    ("speed --seed x", &["--seed"]),
    ("paper -o scene.toml", &["a file is in the way"]),
    ("paper --seed x -o out", &["a whole number"]),
    ("budget", &["<SENSOR>"]),
    ("budget wall", &["wall: is a scene, where a sensor is wanted", "`macropulse sensors`"]),
    ("budget perigrine", &["did you mean `peregrine`?"]),
    ("budget scene.toml", &["scene.toml:2:3:", "`object`"]),
    ("budget coded-practical --environment foggy", &["ready ones: vacuum-dark"]),
    ("budget coded-practical --reflectance -1", &["--reflectance"]),
    ("budget coded-practical --pd 90", &["pd"]),
    ("budget coded-practical --set scene:object.a.b=1", &["belongs to a scene"]),
    ("budget coded-practical -o scene.toml", &["a file is in the way"]),
    ("codes prime", &["as prime=29"]),
    ("codes 29", &["as prime=29"]),
    ("codes prime=30", &["29 and 31"]),
    ("codes primes=29", &["did you mean `prime`?"]),
    ("codes gold=8", &["use 5, 6, 7, 9, 10 or 11"]),
    ("codes sparse={length=9}", &["`weight` is missing"]),
    ("codes gold='x'", &["a whole number"]),
    ("codes prime=29 -o scene.toml", &["a file is in the way"]),
    ("view", &["<FILE-or-DIR>"]),
    ("view gone.pcd", &["there is no such file"]),
    ("view gone", &["gone: there is no such file or folder"]),
    ("view a.obj", &["no point cloud", ".pcd, .ply"]),
    ("view folder", &["holds no point cloud", "macropulse simulate"]),
    ("view a.csv -o a.csv", &["a name that ends in .html"]),
    ("view a.pcd", &["a.pcd", "its header has no DATA line"]),
    ("convert", &["--output"]),
    ("convert a.csv a.ply", &["--output", "the file to write is named with -o, as -o cloud.ply"]),
    ("convert -o a.ply", &["<IN>"]),
    ("convert folder -o a.ply", &["folder: is a folder; name the files in it"]),
    ("convert a.csv -o folder", &["folder: is a folder; say what to write into it"]),
    ("convert a.csv -o new/", &["new/: is a folder; say what to write into it"]),
    (
        "convert a.csv -o a.las --format ply",
        &["a.las: ends as a las file does", "leave --format out"],
    ),
    ("convert a.csv -o a.las --format ply,las", &["a.las: ends as a las file does"]),
    ("convert a.csv -o a.bag", &["a.bag: says no format"]),
    ("convert a.csv -o a.csv.gz", &["a.csv.gz: says no format"]),
    ("convert a.csv -o out --format plyy", &["did you mean `ply`?"]),
    ("convert a.csv -o out --format none", &["nothing is to be written; name a format"]),
    ("convert a.csv -o a.csv --format csv", &["a.csv: is to be read and written"]),
    ("convert a.csv a.csv -o both.ply", &["several scans do not fit into one ply file"]),
    ("convert a.csv folder/a.csv --format ply -o out", &["folder/a.csv", "under one name"]),
    ("convert a.csv --out a.ply", &["'--output'"]),
    ("convert a.csv -o scene.toml/a.ply", &["scene.toml: a file is in the way"]),
    ("convert scene.toml -o a.ply", &["scene.toml: no point cloud is read from such a file"]),
    ("convert a.pcd -o a.ply", &["a.pcd", "its header has no DATA line"]),
    ("convert peregrine -o a.ply", &["peregrine: there is no such file"]),
    ("convert a.csv", &["--output"]),
    ("convert a.csv -o a.holograms", &["a.holograms: says no format", "--format ply"]),
    ("convert gone.pcd -o a.las", &["gone.pcd", "there is no such file"]),
    ("convert gone -o a.las", &["gone: there is no such file or folder"]),
    ("convert a.obj -o a.las", &["no point cloud"]),
    ("convert a.csv -o a.csv", &["a.csv"]),
];

/// Behind `budget coded-practical`.
const BUDGETS: &[Row] = &[
    ("peregrine", &["'peregrine'", "it takes one sensor and no scene"]),
    ("wall", &["'wall'", "sun and air are --environment"]),
    ("--scene wall", &["'--scene'", "no scene"]),
    ("--range 0", &["--range", "a number between 0.000001"]),
    ("--range -5", &["--range", "a number between"]),
    ("--range 150m", &["'150m'", "a number"]),
    ("--reflectance 0", &["--reflectance", "a number between"]),
    ("--reflectance 10%", &["'10%'", "a number"]),
    ("--pd 1", &["--pd", "between 0 and 1, as 0.9"]),
    ("--pd high", &["'high'", "between 0 and 1, as 0.9"]),
    ("--false-points 0", &["--false-points", "between 0 and 1"]),
    ("--false-points 2", &["--false-points", "between 0 and 1"]),
    ("--set scan.max_rnage_m=3", &["did you mean `max_range_m`?"]),
    ("--set environment.visibility_m=3", &["did you mean `visibility_km`?"]),
    ("--set environment.visibility_km=x", &["the text \"x\"", "a number from 0.01 to 1000"]),
    ("--set scan.max_range_m", &["--set", "key=value"]),
    ("--json=yes", &["'yes'", "--json"]),
    ("-o budget.html", &["-o budget.html", "ends as a file does", "say -o budget"]),
    ("-o gone.json", &["say -o gone"]),
    ("--sensor peregrine", &["'--sensor'", "as in `macropulse budget coded-practical`"]),
];

/// Behind `view`, `codes`, `check`, `encode`, `sensors`, `scenes` and others.
const OTHERS: &[Row] = &[
    ("view a.csv folder", &["'folder'", "one file or folder at a time"]),
    ("view peregrine", &["is a sensor", "`macropulse simulate peregrine street -o out`"]),
    ("view street", &["is a scene", "`macropulse simulate hdl-64e street -o out`"]),
    ("view scene.toml", &["no point cloud is read from such a file"]),
    ("view empty.csv", &["empty.csv", "it is empty"]),
    ("view -", &["-: there is no such file"]),
    ("view a.csv -o -", &["a name that ends in .html"]),
    ("view a.csv -o folder", &["folder", "a name that ends in .html"]),
    ("view a.csv -o gone/a.html", &["gone/a.html", "there is no such file or folder"]),
    ("view a.csv --format html", &["'--format'", "view --help"]),
    ("view a.csv --json", &["'--json'", "view --help"]),
    ("view folder/gone.pcd", &["folder/gone.pcd", "there is no such file"]),
    ("codes prime 29", &["as prime=29"]),
    ("codes prime=29,gold=7", &["as prime=29"]),
    ("codes prime=-3", &["a whole number"]),
    ("codes prime=1", &["1 is not an odd prime", "3"]),
    ("codes prime=1000000", &["the largest possible prime is 251"]),
    ("codes m-sequence=2", &["use 3 to 15"]),
    ("codes orthogonal=5", &["is 5", "{ length = …, weight = … }"]),
    ("codes orthogonal={length=10}", &["`weight` is missing"]),
    ("codes orthogonal={length=10,weight=11}", &["use 1 to 10"]),
    ("codes sparse={length=100000,weight=3,words=9,seed=1}", &["use 1 to 65535"]),
    ("codes hadamard=8", &["no code family", "known are prime"]),
    ("codes kim-park-2016", &["as prime=29"]),
    ("codes prime=29 --format png", &["'--format'", "codes --help"]),
    ("check --sensor peregrine", &["'--sensor'", "the sensor stands alone"]),
    ("check wal", &["wal: no such sensor, scene or file", "did you mean `wall`?"]),
    ("check peregrine -o out", &["'-o'", "check --help"]),
    ("check peregrine --environment fog", &["did you mean `fog-50m`?"]),
    ("check peregrine --with rain", &["`rain` is no effect"]),
    ("check a.csv", &["a.csv:1:4: is not TOML"]),
    ("check ./peregrine", &["./peregrine: cannot be read"]),
    ("check peregrine --set", &["--set <KEY=VALUE>"]),
    ("check empty.csv", &["neither a sensor", "`macropulse sensors NAME`"]),
    ("encode kim-park-2016 --pixel -1,0", &["--pixel", "row,column"]),
    ("encode kim-park-2016 wall", &["'wall'", "it takes one sensor"]),
    ("encode kim-park-2016 --pixel 0 1", &["'1'", "as --pixel 0,1"]),
    ("encode kim-park-2016 --pixel 0,1 -o out", &["--pixel prints a macropulse, -o writes"]),
    ("encode kim-park-2016 -o shots.mps", &["ends as a file does", "say -o shots"]),
    ("simulate peregrine wall -o cloud.pcd", &["-o cloud.pcd", "say -o cloud"]),
    ("sensors wall", &["wall: is a scene, where a sensor is wanted"]),
    ("sensors peregrine hdl-64e", &["'hdl-64e'", "one at a time"]),
    ("scenes peregrine", &["is a sensor, not a scene", "`macropulse sensors peregrine`"]),
    ("scenes --materials=x", &["a number of nanometres"]),
    ("schema sensor scene", &["'scene'", "one at a time"]),
];

/// Behind `sweep`.
const SWEEPS: &[Row] = &[
    ("peregrine wall -o out", &["nothing is varied; give a key with its values"]),
    ("peregrine -o out --vary scan.max_range_m=10..50:5", &["<SCENE>"]),
    ("peregrine wall --vary scan.max_range_m=10,20", &["--output"]),
    ("peregrine wall -o out --vary scan.max_range_m", &["add ="]),
    ("peregrine wall -o out --vary scan.max_range_m=", &["a key and its values"]),
    ("peregrine wall -o out --vary scan.max_range_m=10..50", &["how many values", "50..200:7"]),
    ("peregrine wall -o out --vary scan.max_range_m=10..50:0", &["2 to 1000 values"]),
    ("peregrine wall -o out --vary scan.max_range_m=10:50:5", &["equal steps as 50..200:7"]),
    ("peregrine wall -o out --vary scan.max_range_m=0..10:log3", &["both ends above 0"]),
    (
        "peregrine wall -o out --vary scan.max_range_m=10,twenty",
        &["the text \"twenty\"", "a number from"],
    ),
    ("peregrine wall -o out --vary scan.max_range_m=10,-20", &["is -20", "between"]),
    ("peregrine wall -o out --vary scan.max_rnage_m=10,20", &["did you mean `max_range_m`?"]),
    ("peregrine wall -o out --vary max_range_m=10,20", &["it belongs in [scan]"]),
    ("peregrine wall -o out --vary object.wall.position_m.x=10,20", &["scene:object"]),
    ("peregrine wall -o out --vary scene:object.wal.position_m.x=10,20", &["did you mean `wall`?"]),
    ("peregrine wal -o out --vary scan.max_range_m=10,20", &["did you mean \"wall\"?"]),
    ("wall peregrine -o out --vary scan.max_range_m=10,20", &["`macropulse sweep peregrine wall`"]),
    ("--sensors peregrine,hdl --scene wall -o out", &["did you mean `hdl-64e`?"]),
    (
        "peregrine wall -o out --vary scan.max_range_m=10,20 --seeds 0",
        &["--seeds", "from 1 to 10000"],
    ),
    ("peregrine wall -o out --vary scan.max_range_m=10,20 --shots 0", &["--shots", "1 at least"]),
    ("peregrine wall -o out --vary scan.max_range_m=10,20 --score pdd", &["known: pd, right"]),
    (
        "peregrine wall -o out --vary scan.max_range_m=10,20 --shard 3",
        &["2/4 for the second of four"],
    ),
    ("peregrine wall -o out --vary scan.max_range_m=10,20 --shard 3/2", &["1/2 to 2/2"]),
    ("peregrine wall -o out.csv --vary scan.max_range_m=10,20", &["say -o out"]),
    ("peregrine wall -o scene.toml --vary scan.max_range_m=10,20", &["a file is in the way"]),
];

fn desk() -> Desk {
    let desk = Desk::new();
    desk.put("scene.toml", "version = 1\n[[object]]\ncar = {}\nposition_m = [9, 0, 0]\n");
    desk.put("a.obj", "v 0 -2 -2\nv 0 2 -2\nv 0 0 2\nf 1 2 3\n").put("a.pcd", "");
    desk.put("a.csv", "x_m,y_m,z_m\n1,2,3\n").put("empty.csv", "");
    std::fs::create_dir(desk.path().join("folder")).unwrap();
    desk
}

#[test]
fn options() {
    let line = |typed: &str| format!("simulate peregrine wall -o out {typed}");
    refused(&desk(), OPTIONS.iter().map(|(typed, words)| (line(typed), *words)));
}

#[test]
fn lines() {
    refused(&desk(), LINES.iter().map(|(line, words)| ((*line).to_owned(), *words)));
}

#[test]
fn budgets() {
    let line = |typed: &str| format!("budget coded-practical {typed}");
    refused(&desk(), BUDGETS.iter().map(|(typed, words)| (line(typed), *words)));
}

#[test]
fn others() {
    refused(&desk(), OTHERS.iter().map(|(line, words)| ((*line).to_owned(), *words)));
}

#[test]
fn sweeps() {
    refused(&desk(), SWEEPS.iter().map(|(typed, words)| (format!("sweep {typed}"), *words)));
}

/// A folder that cannot be made, whoever asks.
#[test]
#[cfg(target_os = "linux")]
fn a_place_that_takes_nothing() {
    let desk = desk();
    let ran = desk.run("simulate peregrine wall -o /proc/out");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("cannot write into the folder /proc/out"), "{}", ran.err);
}
