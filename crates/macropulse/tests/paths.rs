//! Scan patterns that are no lattice: tables of directions, rosettes and figures of Lissajous.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::HashSet;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::path::Path;

use macropulse::design::Design;
use macropulse::emit::{Band, bands};
use macropulse::scene::Scene;
use macropulse::sim;

/// Azimuth and elevation, degrees, of a rosette of seven petals that are never drawn twice.
fn petals(entry: usize) -> [f64; 2] {
    let angle = TAU * entry as f64 * 0.013_7;
    let radius = 15.0 * (3.5 * angle * 1.003).sin();
    [radius * angle.cos(), radius * angle.sin()]
}

/// The rosette as simulators of such lidars write it: zenith angles, a time with five digits.
fn table(entries: usize) -> String {
    let mut text = "Time/s,Azimuth/deg,Zenith/deg\n".to_owned();
    for entry in 0..entries {
        let [azimuth, elevation] = petals(entry);
        let (time, zenith) = (entry as f64 * 1e-4, 90.0 - elevation);
        writeln!(text, "{time:.5},{azimuth:.6},{zenith:.6}").unwrap();
    }
    text
}

const SENSOR: &str = "version = 1\nname = \"mine\"\nextends = \"peregrine\"\n\
    scan.scans_per_s = 20.0\ntdc.converters = 64\n[scan.table]\nfile = \"pattern.csv\"\n";

/// The sensor of a table, `keys` among those of the table.
fn sensor(table: &str, keys: &str) -> Result<Design, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("pattern.csv"), table).unwrap();
    let text = format!("{SENSOR}{keys}\n");
    Design::from_toml(&text, "mine.toml", folder.path(), &[]).map_err(|told| told.to_string())
}

/// The unit vector of an azimuth and an elevation, degrees.
fn unit([azimuth, elevation]: [f64; 2]) -> [f64; 3] {
    let [a, e] = [azimuth, elevation].map(f64::to_radians);
    [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()]
}

fn apart(one: [f64; 3], other: [f64; 3]) -> f64 {
    (0..3).map(|axis| (one[axis] - other[axis]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn a_header_of_two_lines_is_told_in_one() {
    let told = sensor("\"azimuth\n1.5\",elevation\n1,2\n", "").unwrap_err();
    assert_eq!(told.lines().count(), 1, "{told}");
    assert!(told.contains("`azimuth\\n1.5`: 1 is no unit of angles"), "{told}");
}

/// Each scan takes the next 500 of 1234 entries, and begins anew behind the last.
#[test]
fn a_table_goes_on_from_scan_to_scan() {
    let design = sensor(&table(1234), "").unwrap();
    assert_eq!((design.scan.rows, design.scan.columns), (1, 500));
    let mut entry = 0;
    for scan in 0..6 {
        for band in bands(&design, scan) {
            let log = band.shot_log(&design);
            for shot in log.owned.clone() {
                assert_eq!((log.row[shot], usize::from(log.column[shot])), (0, entry % 500));
                let fired = log.fired_at_fs[shot] as f64 * 1e-15;
                assert!((fired - entry as f64 * 1e-4).abs() < 1e-9, "{fired}");
                let found = design.directions().of_shot(&log, shot);
                assert!(apart(found, unit(petals(entry % 1234))) < 2e-8, "entry {entry}");
                entry += 1;
            }
            // Guard shots, too: the ones before belong to the scan before.
            for shot in 0..log.owned.start {
                let number = (log.first + shot as u64) as usize;
                let found = design.directions().of_shot(&log, shot);
                assert!(apart(found, unit(petals(number % 1234))) < 2e-8);
            }
        }
    }
    assert_eq!(entry, 3000);
    let told = design.warnings.join("\n");
    assert!(told.contains("1234 directions in 0.123 s, then anew; 500 of each line"), "{told}");
}

/// Points lie on the wall, wherever a scan of the pattern goes, and two scans see different places of
/// it.
#[test]
fn a_wall_is_measured_along_the_table() {
    let design = sensor(&table(1234), "").unwrap();
    let wall = Scene::open("wall").unwrap();
    let mut before = HashSet::new();
    for number in 0..2 {
        let scan = sim::scan(&design, &wall, 1, number).unwrap();
        assert!(scan.score.right_fraction() > 0.99);
        let cloud = scan.cloud();
        assert!(cloud.returns() > 490);
        let mut places = HashSet::new();
        for at in 0..cloud.returns() {
            assert!((cloud.x[at] - 50.0).abs() < 0.3, "{}", cloud.x[at]);
            let entry = number as usize * 500 + usize::from(cloud.column[at]);
            let [azimuth, elevation] = petals(entry).map(f64::to_radians);
            let range = f64::from(cloud.truth.returns.range[at]);
            assert!((range - 50.0 / (azimuth.cos() * elevation.cos())).abs() < 1e-4);
            places.insert(((cloud.y[at] * 10.0) as i32, (cloud.z[at] * 10.0) as i32));
        }
        assert!(before.intersection(&places).count() < places.len() / 4);
        before = places;
    }
}

/// Two lines take turns: each entry is a shot of one of them, on a detector of its own.
#[test]
fn lines_take_turns_or_fire_together() {
    let text = |time: fn(usize) -> f64| {
        let mut text = "time_us, elevation_rad, azimuth_rad, line\n".to_owned();
        for entry in 0..400 {
            let up = if entry % 2 == 0 { 0.1 } else { -0.1 };
            writeln!(text, "{:.3}, {up}, {:.4}, {}", time(entry), entry as f64 * 1e-3, entry % 2)
                .unwrap();
        }
        text
    };
    let in_turn = sensor(&text(|entry| entry as f64 * 500.0), "lines = 2").unwrap();
    let together = sensor(&text(|entry| (entry / 2) as f64 * 1000.0), "lines = 2").unwrap();
    for (design, second_us) in [(in_turn, 500.0), (together, 0.0)] {
        assert_eq!((design.scan.rows, design.scan.columns, design.channels()), (2, 50, 2));
        let mut shots = Vec::new();
        for band in bands(&design, 0) {
            let log = band.shot_log(&design);
            for shot in log.owned.clone() {
                let us = log.fired_at_fs[shot] as f64 * 1e-9;
                let towards = design.directions().of_shot(&log, shot);
                shots.push((log.row[shot], log.channel[shot], us, towards));
            }
        }
        let [first, second, third, ..] = shots[..] else { panic!("100 shots") };
        assert_eq!([first.0, second.0, third.0], [0, 1, 0]);
        assert_eq!([first.1, second.1, third.1], [0, 1, 0]);
        assert!((second.2 - second_us).abs() < 1e-3 && (third.2 - 1000.0).abs() < 1e-3);
        let found = second.3;
        assert!(apart(found, unit([1e-3_f64.to_degrees(), (-0.1_f64).to_degrees()])) < 1e-9);
    }
}

#[test]
fn a_table_without_times_needs_a_rate() {
    let bare = "azimuth,elevation\n0,0\n1,0\n2,0.5\n3,1\n";
    let told = sensor(bare, "").unwrap_err();
    assert!(told.contains("pattern.csv: has no times: give scan.table.firings_per_s"), "{told}");
    let design = sensor(bare, "firings_per_s = 200.0").unwrap();
    assert_eq!(design.scan.columns, 10);
    let other = sensor(&bare.replace("0.5", "0.6"), "firings_per_s = 200.0").unwrap();
    assert_eq!(design.text, other.text);
    assert_ne!(design.digest(), other.digest());
}

/// The patterns of Livox sensors in simulators number their entries in a column `Time/s`.
#[test]
fn times_that_only_count_the_entries_are_no_times() {
    let counted = "Time/s,Azimuth/deg,Zenith/deg\n1,0,90\n2,1,90\n3,2,89.5\n4,3,89\n";
    let told = sensor(counted, "").unwrap_err();
    assert!(told.contains("its times only count the entries: give scan.table.firings"), "{told}");
    let design = sensor(counted, "firings_per_s = 200.0").unwrap();
    assert_eq!((design.scan.rows, design.scan.columns), (1, 10));
    // Groups of lines may be counted as well; times of another step are times.
    let groups = "time,azimuth,elevation\n0,0,0\n0,1,0\n1,2,0\n1,3,0\n";
    assert_eq!(sensor(groups, "lines = 2\nfirings_per_s = 200.0").unwrap().scan.columns, 5);
    let even = counted.replace("\n4,", "\n5,");
    let told = sensor(&even, "firings_per_s = 200.0").unwrap_err();
    assert!(told.contains("has no effect because of `scan.table.file`"), "{told}");
}

#[test]
fn what_is_wrong_with_a_table_is_told_with_its_line() {
    let good = table(400);
    for (wrong, said) in [
        (good.replace("Zenith", "Height"), "pattern.csv:1: needs a header with `azimuth`"),
        (good.replace("Zenith/deg", "Zenith/gon"), "pattern.csv:1: `Zenith/gon`: gon is no unit"),
        (good.replace("\n0.00050,", "\n0.00050,,"), "pattern.csv:7: is no line of as many"),
        (good.replace("\n0.00050,", "\n0.00050,x"), "pattern.csv:7: `x"),
        (good.replace("\n0.00050,", "\nnan,"), "pattern.csv:7: `nan` is no number"),
        (
            good.replace("\n0.00050,", "\n0.00010,"),
            "pattern.csv:7: is earlier than the line before",
        ),
        (good.replace("\n0.03990,", "\n0.93990,"), "off the even pace"),
        ("azimuth,zenith\n0,200\n0,90\n".to_owned(), "points -110.000 degrees up"),
        ("azimuth,zenith,elevation\n0,90,0\n".to_owned(), "has both elevation and zenith"),
        ("azimuth,elevation\n".to_owned(), "0 directions; there must be two at least"),
        (String::new(), "pattern.csv:1: needs a header"),
        ("time,azimuth,elevation\n1,0,0\n1,1,0\n".to_owned(), "its times do not grow"),
    ] {
        let told = sensor(&wrong, "").unwrap_err();
        assert!(told.contains("mine.toml:7:1: scan.table.file: "), "{told}");
        assert!(told.contains(said) && !told.contains('\n'), "{said}: {told}");
    }
    let told = sensor(&good, "firings_per_s = 9.0").unwrap_err();
    assert!(told.contains("has no effect because of `scan.table.file`"), "{told}");
    let told = sensor(&good, "lines = 3").unwrap_err();
    assert!(
        told.contains("400 directions; there must be two at least, a multiple of the 3"),
        "{told}"
    );
    let told = Design::from_toml(SENSOR, "mine.toml", Path::new("/nowhere"), &[]).unwrap_err();
    assert!(told.to_string().contains("/nowhere/pattern.csv: cannot be read"), "{told}");
    let quick = sensor(&good.replace("0.0", "0.000000"), "");
    assert!(quick.unwrap_err().contains("but 1 to 65535 are possible"));
}

/// A lidar 50 m ahead whose one beam ends in our aperture, `per_s` times a second from `arrives_ns` on.
fn opposite(wavelength_nm: f64, per_s: f64, arrives_ns: f64) -> Scene {
    let phase_ns = arrives_ns - 50.0 / 0.299_792_458;
    let text = format!(
        "version = 1\nenvironment = \"vacuum-dark\"\n[[interferers]]\nsensor = \"hdl-64e\"\n\
         position_m = [50, 0, 0]\nyaw_deg = 180\nphase_ns = {phase_ns}\n\
         set = {{ light.wavelength_nm = {wavelength_nm}, scan.scans_per_s = {per_s}, \
         scan.raster = {{ rows = 1, columns = 1, horizontal_deg = 1, vertical_deg = 1 }} }}\n"
    );
    Scene::from_toml(&text, "opposite", Path::new("")).unwrap()
}

/// Known answer: a detector behind a rosette looks along its beam, in a cone with the solid angle of a cell, the
/// square of the median step. It receives another lidar in the shots whose axis is that near to it, and in no others.
#[test]
fn a_rosette_receives_another_lidar_if_it_looks_there() {
    let design = Design::open("rosette-mid-40", &[]).unwrap();
    let axes: Vec<_> = (0..10_000).map(|column| design.directions().of(0, column)).collect();
    let mut steps: Vec<f64> = axes.windows(2).map(|pair| apart(pair[0], pair[1])).collect();
    steps.sort_by(f64::total_cmp);
    let edge = steps[steps.len() / 2] / std::f64::consts::PI.sqrt();
    let expected: HashSet<u16> = (0..10_000)
        .filter(|&column| apart(axes[usize::from(column)], [1.0, 0.0, 0.0]) < edge)
        .collect();
    assert!((5..40).contains(&expected.len()), "{}", expected.len());
    let scan = sim::scan(&design, &opposite(905.0, 1e5, 400.0), 1, 0).unwrap();
    let found: HashSet<u16> = scan.cloud().column.iter().copied().collect();
    assert_eq!(found, expected);
    assert!(scan.cloud().range.iter().all(|range| (range - 59.96).abs() < 0.5));
    // Control: light is not received that arrives between the end of a gate, at 867 ns, and the next shot.
    let late = sim::scan(&design, &opposite(905.0, 1e5, 5000.0), 1, 0).unwrap();
    assert_eq!(late.cloud().returns(), 0);
}

/// Known answer: of two lines with a detector each, one alone looks at the other lidar, in two entries of fifty.
#[test]
fn a_line_of_a_table_receives_another_lidar_on_its_own_detector() {
    let mut text = "time_us, elevation_deg, azimuth_deg, line\n".to_owned();
    for entry in 0..100 {
        let azimuth = if entry % 2 == 0 { 5.0 } else { f64::from(entry % 50) - 25.0 };
        writeln!(text, "{}, 0, {azimuth}, {}", entry * 500, entry % 2).unwrap();
    }
    let design = sensor(&text, "lines = 2").unwrap();
    let scan = sim::scan(&design, &opposite(1570.0, 2e3, 400.0), 1, 0).unwrap();
    let cloud = scan.cloud();
    let found: Vec<_> = (0..cloud.returns()).map(|at| (cloud.row[at], cloud.column[at])).collect();
    assert_eq!(found, [(1, 12), (1, 37)]);
}

/// Shares of the disc, in cells of 0.2°, that a scanner of this kind meets within these times, by a
/// published table of the directions of one [Mid40]: 14.4, 26.9, 56.2 and 83.9 %.
const PUBLISHED: [(f64, f64); 4] = [(0.1, 0.144), (0.2, 0.269), (0.5, 0.562), (1.0, 0.839)];

/// The share of the disc that `design` meets in the first `scans`.
fn coverage(design: &Design, scans: u64) -> f64 {
    let mut met = HashSet::new();
    for scan in 0..scans {
        for band in bands(design, scan) {
            let log = band.shot_log(design);
            for shot in log.owned.clone() {
                let [x, y, z] = design.directions().of_shot(&log, shot);
                let off = x.acos().to_degrees() / (y * y + z * z).sqrt().max(1e-12);
                let cell = |part: f64| (part * off / 0.2).floor() as i32;
                met.insert((cell(y), cell(z)));
            }
        }
    }
    let within = |cell: i32| (f64::from(cell) + 0.5) * 0.2;
    let inside = |row: i32| (-97..97).filter(|c| within(row).hypot(within(*c)) <= 19.2).count();
    met.len() as f64 / (-97..97).map(inside).sum::<usize>() as f64
}

/// The formula of two prisms, at the turns per second of a paper, covers the field in the time that a
/// published table of directions does. Control: prisms that turn in the ratio of small numbers
/// draw the same petals again and again.
#[test]
fn the_ready_rosette_covers_its_field_as_fast_as_published() {
    let design = Design::open("rosette-mid-40", &[]).unwrap();
    assert_eq!((design.scan.rows, design.scan.columns), (1, 10_000));
    for (seconds, share) in PUBLISHED {
        let found = coverage(&design, (seconds * 10.0_f64).round() as u64);
        assert!((found - share).abs() < 0.012, "{seconds} s: {found}, not {share}");
    }
    let prisms = "[{ deflection_deg = 9.6, turns_per_s = 120.0 }, \
                  { deflection_deg = 9.6, turns_per_s = -80.0 }]";
    let again = [("scan.rosette.prisms".to_owned(), prisms.to_owned())];
    let found = coverage(&Design::open("rosette-mid-40", &again).unwrap(), 10);
    assert!(found < 0.3, "{found}");
}

/// Known answers: the beam is where both prisms deflect to; its field is twice both.
#[test]
fn a_rosette_is_the_sum_of_its_prisms() {
    let design = Design::open("rosette-mid-40", &[]).unwrap();
    let [_, left] = design.scan.extent().azimuth;
    assert!((left.to_degrees() - 19.2).abs() < 1e-9);
    // At the beginning both deflect to the left.
    assert!(apart(design.directions().of(0, 0), unit([19.2, 0.0])) < 1e-12);
    for column in [1_u16, 777, 9999] {
        let t = f64::from(column) * 1e-5;
        let turn = |rpm: f64| TAU * rpm / 60.0 * t;
        let (one, two) = (turn(7294.0), turn(-4664.0));
        let (y, z) = (9.6 * (one.cos() + two.cos()), 9.6 * (one.sin() + two.sin()));
        let [x, left, up] = design.directions().of(0, column);
        assert!((x.acos().to_degrees() - y.hypot(z)).abs() < 1e-6, "{column}");
        assert!((left.atan2(up) - y.atan2(z)).abs() < 1e-9, "{column}");
    }
    let told = |prisms: &str| {
        let set = [("scan.rosette.prisms".to_owned(), prisms.to_owned())];
        Design::open("rosette-mid-40", &set).unwrap_err().to_string()
    };
    assert!(told("[]").contains("must be two"));
    let steep = "[{ deflection_deg = 50.0, turns_per_s = 1.0 }, \
                 { deflection_deg = 1.0, turns_per_s = 1.0 }]";
    assert!(told(steep).contains("is 50, but must lie between 0 and 45"));
}

/// Known answers: azimuth and elevation are sines of time, which runs on from scan to scan. They reach both ends of the
/// field, and a frame of whole swings repeats.
#[test]
fn a_mirror_that_swings_draws_a_figure_of_lissajous() {
    let with = |horizontal_hz: f64| {
        let keys = format!(
            "{{ shots_per_s = 1e5, horizontal = {{ field_deg = 40.0, hz = {horizontal_hz:?}, phase_deg = 90.0 }}, \
             vertical = {{ field_deg = 20.0, hz = 70.0 }} }}"
        );
        let text = format!(
            "version = 1\nextends = \"rosette-mid-40\"\nname = \"mine\"\n[scan]\nlissajous = {keys}\n"
        );
        Design::from_toml(&text, "mine.toml", Path::new(""), &[]).unwrap()
    };
    let design = with(100.3);
    assert_eq!((design.scan.rows, design.scan.columns), (1, 10_000));
    let extent = design.scan.extent();
    let sides = [extent.azimuth, extent.elevation].map(|[from, to]| (to - from).to_degrees());
    assert!((sides[0] - 40.0).abs() < 1e-9 && (sides[1] - 20.0).abs() < 1e-9, "{sides:?}");
    let log = Band { scan: 3, first: 0, shots: 10_000 }.shot_log(&design);
    let directions = design.directions();
    let mut ends = [0.0_f64; 4];
    for shot in log.owned.clone() {
        let t = 0.3 + f64::from(log.column[shot]) * 1e-5;
        let azimuth = 20.0 * (TAU * 100.3 * t + PI / 2.0).sin();
        let elevation = 10.0 * (TAU * 70.0 * t).sin();
        assert!(apart(directions.of_shot(&log, shot), unit([azimuth, elevation])) < 1e-9, "{shot}");
        ends = [
            ends[0].min(azimuth),
            ends[1].max(azimuth),
            ends[2].min(elevation),
            ends[3].max(elevation),
        ];
    }
    assert!(ends[0] < -19.99 && ends[1] > 19.99 && ends[2] < -9.99 && ends[3] > 9.99, "{ends:?}");
    for (hz, repeats) in [(100.0, true), (100.3, false)] {
        let design = with(hz);
        let [one, other] = [0, 1].map(|scan| {
            let log = Band { scan, first: 0, shots: 10_000 }.shot_log(&design);
            design.directions().of_shot(&log, log.owned.start + 777)
        });
        assert_eq!(apart(one, other) < 1e-9, repeats, "{hz} Hz");
    }
}

/// 2 cm at 20 m, and all of the wall that lies in the field.
#[test]
fn the_ready_rosette_measures_as_its_manual_says() {
    let design = Design::open("rosette-mid-40", &[]).unwrap();
    let text = "version = 1\nenvironment = \"night\"\n[[object]]\nshape.sphere.radius_m = 20\n\
                material = \"grey50\"\n";
    let room = Scene::from_toml(text, "room", Path::new("")).unwrap();
    let scan = sim::scan(&design, &room, 1, 3).unwrap();
    assert!(scan.score.right_fraction() > 0.99);
    let cloud = scan.cloud();
    let count = cloud.returns() as f64;
    let mean = cloud.range.iter().map(|range| f64::from(*range)).sum::<f64>() / count;
    let square = |range: &f32| (f64::from(*range) - mean).powi(2);
    let spread = (cloud.range.iter().map(square).sum::<f64>() / count).sqrt();
    assert!((mean - 20.0).abs() < 0.02 && (0.01..0.02).contains(&spread), "{mean} {spread}");
}
