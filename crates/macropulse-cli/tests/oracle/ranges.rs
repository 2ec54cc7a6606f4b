//! The range of every shot: `macropulse decode` beside whoever tries every lag.

use std::collections::BTreeMap;
use std::fs;

use serde_json::{Value, json};

use super::common::Desk;
use super::{ask, points};

/// One tick of range, m.
const TICK_M: f64 = 0.375e-3;

/// Two rows as closely fired as those of a whole scan.
const SENSOR: &str = "kim-park-2016-fixed --set scan.raster.rows=2 --set scan.scans_per_s=14400";

/// Range and marks found of every point, by row and column.
type Points = BTreeMap<(u64, u64), [f64; 2]>;

/// Returns the ranges that the oracle finds in `shots` and `ticks`, for one shot in `every`.
fn found(desk: &Desk, shots: &str, ticks: &str, every: u32) -> Vec<Value> {
    let given = json!({ "shots": shots, "ticks": ticks, "every": every });
    ask(desk, "ranges", &given).as_array().unwrap().clone()
}

/// Counts the shots to which program and oracle give the same range, to a tick, and the same number of marks.
fn agreed(points: &Points, found: &[Value]) -> usize {
    let agrees = |shot: &&Value| {
        let pixel = (shot["row"].as_u64().unwrap(), shot["column"].as_u64().unwrap());
        let range = shot["range_m"].as_f64().unwrap();
        points.get(&pixel).is_some_and(|[point, peak]| {
            (point - range).abs() <= TICK_M && shot["lit"].as_f64() == Some(*peak)
        })
    };
    found.iter().filter(agrees).count()
}

fn decode(desk: &Desk, folder: &str) -> Points {
    let files = format!("{folder}/shots-000000.csv {folder}/ticks-000000.csv");
    // Without jitter a mark is looked for in its own tick alone, as the oracle does.
    let still = "--set detector.photon-counting.jitter_ps=0";
    desk.json(&format!(
        "decode --sensor {SENSOR} {still} {files} --format csv -o {folder}-again --json"
    ));
    points(desk, &format!("{folder}-again/scan-000000.csv"), ["range_m", "peak"])
}

#[test]
fn a_wall_in_clean_light_stands_where_both_find_it() {
    let desk = Desk::new();
    let ran = desk.run(&format!("encode {SENSOR} --wall-m 61.7 --format ticks-csv -o wall"));
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let points = decode(&desk, "wall");
    let (shots, ticks) = ("wall/shots-000000.csv", "wall/ticks-000000.csv");
    let found = found(&desk, shots, ticks, 8);
    assert_eq!(found.len(), 212);
    assert_eq!(agreed(&points, &found), found.len());
    for shot in &found {
        assert_eq!(shot["lit"], shot["marks"], "{shot}");
        assert!((shot["range_m"].as_f64().unwrap() - 61.7).abs() <= TICK_M, "{shot}");
    }
}

/// A street, every mark seen and nothing else: whoever tries all lags finds what the program does.
#[test]
fn a_street_in_clean_light_is_found_shot_by_shot() {
    let desk = Desk::new();
    street(&desk, "clean", "pd=1.0", "0", "0");
    let points = decode(&desk, "clean");
    let found = found(&desk, "clean/shots-000000.csv", "clean/ticks-000000.csv", 8);
    let clear: Vec<Value> = found.iter().filter(is_clear).cloned().collect();
    assert!(clear.len() > 205, "{} of {}", clear.len(), found.len());
    assert_eq!(agreed(&points, &clear), clear.len());
}

/// A fifth of the marks missed, a thousand false ticks in every microsecond.
#[test]
fn a_street_in_noise_is_found_by_both_but_for_one_shot_in_fifty() {
    let desk = Desk::new();
    street(&desk, "noise", "pd=0.99", "1e9", "0.2");
    let points = decode(&desk, "noise");
    let (shots, ticks) = ("noise/shots-000000.csv", "noise/ticks-000000.csv");
    let all = found(&desk, shots, ticks, 8);
    let clear: Vec<Value> = all.iter().filter(is_clear).cloned().collect();
    assert!(clear.len() > 205, "{} of {}", clear.len(), all.len());
    let both = agreed(&points, &clear);
    assert!(both * 50 >= clear.len() * 49, "{both} of {}", clear.len());
    controls(&desk, &points, (shots, ticks), both);
}

/// Seven marks of ten missed, 3000 false ticks in every microsecond: the program refuses what
/// chance could have lit, but nothing that stands out by more than three marks.
#[test]
fn what_stands_out_of_dense_noise_is_found() {
    let desk = Desk::new();
    street(&desk, "dense", "pd=0.99", "3e9", "0.7");
    let points = decode(&desk, "dense");
    let all = found(&desk, "dense/shots-000000.csv", "dense/ticks-000000.csv", 8);
    // Three marks of ten are seen; chance lights less than two of a hundred.
    let stands_out = |shot: &&Value| {
        let [lit, next, marks] = ["lit", "next", "marks"].map(|key| shot[key].as_u64().unwrap());
        lit > next + 3 && 5 * lit > marks
    };
    let clear: Vec<Value> = all.iter().filter(stands_out).cloned().collect();
    assert!(clear.len() > 100, "{} of {}", clear.len(), all.len());
    assert_eq!(agreed(&points, &clear), clear.len());
}

/// Returns true if one lag has more marks than any other. Two pieces of glass, one behind the other, may have
/// equal numbers.
fn is_clear(shot: &&Value) -> bool {
    shot["lit"].as_u64() > shot["next"].as_u64()
}

/// Checks that wrong files are noticed: ticks that come seven ticks late, and words of the shots beside them.
fn controls(desk: &Desk, points: &Points, (shots, ticks): (&str, &str), both: usize) {
    let edited = |from: &str, to: &str, edit: &dyn Fn(&mut Vec<i64>)| {
        let text = fs::read_to_string(desk.path().join(from)).unwrap();
        let line = |line: &str| {
            let mut numbers: Vec<i64> = line.split(',').map(|n| n.parse().unwrap()).collect();
            edit(&mut numbers);
            let words: Vec<String> = numbers.iter().map(i64::to_string).collect();
            words.join(",") + "\n"
        };
        let head = text.lines().take(2).map(|line| format!("{line}\n"));
        let text: String = head.chain(text.lines().skip(2).map(line)).collect();
        desk.put(to, &text);
    };
    edited(ticks, "late.csv", &|tick| tick[0] += 7);
    let late = found(desk, shots, "late.csv", 8);
    assert!(agreed(points, &late) * 20 < both);
    edited(shots, "mixed.csv", &|shot| shot[5] = 1 + shot[5] % 28);
    let mixed = found(desk, "mixed.csv", ticks, 8);
    assert!(agreed(points, &mixed) * 20 < both);
}

/// Two rows of a street, written as text.
fn street(desk: &Desk, folder: &str, sensitivity: &str, dark: &str, missed: &str) {
    let detector = "--set detector.photon-counting";
    let line = format!(
        "simulate {SENSOR} street --environment vacuum-dark --set scan.raster.vertical_deg=2 \
         --set scan.light_range_m=150 {detector}.sensitivity.{sensitivity} \
         {detector}.dark_counts_hz={dark} {detector}.missed_marks={missed} \
         {detector}.jitter_ps=0 --format csv,ticks-csv -o {folder} --json"
    );
    let told = desk.json(&line);
    assert!(told["counts"]["returns"].as_u64().unwrap() > 500, "{told}");
}
