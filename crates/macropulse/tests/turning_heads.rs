//! Turning heads laser by laser: the ready VLP-16 beside its manual, calibration files, and what
//! becomes of the offsets in them.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::f64::consts::{PI, TAU};
use std::path::Path;

use macropulse::design::{Design, Pattern};
use macropulse::emit::bands;
use macropulse::environment::Environment;
use macropulse::points::{Outcome, PointCloud};
use macropulse::predict::Forecaster;
use macropulse::scene::Scene;
use macropulse::sim;

fn set(changes: &[(&str, &str)]) -> Vec<(String, String)> {
    changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect()
}

fn vlp_16(changes: &[(&str, &str)]) -> Design {
    Design::open("vlp-16", &set(changes)).unwrap()
}

fn scene(text: &str) -> Scene {
    let text = format!("version = 1\nenvironment = \"night\"\n{text}");
    Scene::from_toml(&text, "test.toml", Path::new("")).unwrap()
}

/// The manual's table: elevation, degrees, and vertical correction, mm, by laser.
fn manual() -> [(f64, f64); 16] {
    // Odd lasers look up, even ones down; the correction of one is that of its opposite turned over.
    let up = [(1.0, -0.7), (3.0, -2.2), (5.0, -3.7), (7.0, -5.1)];
    let high = [(9.0, -6.6), (11.0, -8.1), (13.0, -9.7), (15.0, -11.2)];
    let ups: Vec<(f64, f64)> = up.into_iter().chain(high).collect();
    std::array::from_fn(|laser| match laser % 2 {
        1 => ups[laser / 2],
        _ => {
            let (degrees, mm) = ups[7 - laser / 2];
            (-degrees, -mm)
        }
    })
}

/// Firing times, directions and origins by the manual's formulae. Laser n of firing sequence m fires after
/// 55.296 µs · m + 2.304 µs · n. The head turns by 360° in 0.1 s.
#[test]
fn the_vlp_16_fires_when_and_where_its_manual_says() {
    let design = vlp_16(&[]);
    assert_eq!((design.scan.rows, design.scan.columns), (16, 1808));
    let mut tested = 0;
    for scan in [0, 7] {
        for band in bands(&design, scan) {
            let log = band.shot_log(&design);
            for shot in log.owned.clone() {
                let number = (log.first + shot as u64) % design.shots_per_scan();
                let (sequence, laser) = ((number / 16) as f64, (number % 16) as usize);
                let (degrees, mm) = manual()[laser];
                // From the top: 15 degrees is row 0.
                let row = ((15.0 - degrees) / 2.0) as u16;
                assert_eq!((log.row[shot], log.column[shot]), (row, sequence as u16));
                let seconds = sequence * 55.296e-6 + laser as f64 * 2.304e-6;
                let fired = log.fired_at_fs[shot] as f64 * 1e-15 - scan as f64 * 0.1;
                // Shots wait for the chip clock, a tick of 13.342 ps here.
                assert!((-1e-15..13.4e-12).contains(&(seconds - fired)), "{seconds} {fired}");
                // The manual has α clockwise from its y axis. X = R cos ω sin α looks to the right,
                // Y = R cos ω cos α forward, and Z = R sin ω + correction up. We begin behind.
                let (alpha, omega) = (PI + TAU * seconds / 0.1, degrees.to_radians());
                let theirs = [omega.cos() * alpha.sin(), omega.cos() * alpha.cos(), omega.sin()];
                let ours = design.directions().of_shot(&log, shot);
                for (found, expected) in ours.into_iter().zip([theirs[1], -theirs[0], theirs[2]]) {
                    assert!((found - expected).abs() < 1e-9, "{number}: {ours:?} {theirs:?}");
                }
                let origin = design.directions().origin(row, sequence as u16);
                assert_eq!([origin[0], origin[1]], [0.0, 0.0]);
                assert!((origin[2] - mm * 1e-3).abs() < 1e-12);
                tested += 1;
            }
        }
    }
    assert_eq!(tested, 2 * 16 * 1808);
    // The recharge: the last firing of a sequence, its 2.304 µs, and 18.432 µs.
    let log = bands(&design, 0).next().unwrap().shot_log(&design);
    let gap = (log.fired_at_fs[16] - log.fired_at_fs[15]) as f64 * 1e-9;
    assert!((gap - 2.304 - 18.432).abs() < 1e-4, "{gap} us");
}

/// Published: some 300 000 points a second, 0.2° at 600 rpm, 100 m, 3 cm, class 1.
#[test]
fn the_vlp_16_measures_what_its_data_sheet_says() {
    let design = vlp_16(&[]);
    let per_second = design.shots_per_scan() as f64 / design.scan_period();
    assert!((285e3..=300e3).contains(&per_second), "{per_second}");
    assert!((per_second - 16.0 / 55.296e-6).abs() < 100.0);
    let Pattern::Spinning(head) = &design.scan.pattern else { panic!("it spins") };
    let step = 360.0_f64 * 55.296e-6 / 0.1;
    assert!((step - 0.199).abs() < 1e-3);
    assert_eq!((head.lasers.len(), head.columns), (16, (360.0 / step) as u32));
    // At other speeds the same firing, other steps: 0.1° at 300 rpm, 0.4° at 1200.
    for (per_s, columns) in [("5", 3616), ("20", 904)] {
        assert_eq!(vlp_16(&[("scan.scans_per_s", per_s)]).scan.columns, columns);
    }
    let day = Environment::named("clear-day").unwrap();
    let forecaster = Forecaster::new(&design, &day).unwrap();
    let [bright, far] = [forecaster.forecast(0.5, 50.0), forecaster.forecast(0.8, 100.0)];
    assert!(bright.pd > 0.99 && far.pd > 0.9, "{} {}", bright.pd, far.pd);
    // White walls square on, 20 and 60 m away: the spread of the ranges is within 3 cm.
    for distance in [20.0, 60.0] {
        let room = scene(&format!(
            "[[object]]\nshape.sphere.radius_m = {distance}\nmaterial = \"white\"\n"
        ));
        let scan = sim::scan(&design, &room, 1, 0).unwrap();
        assert!(scan.score.right_fraction() > 0.99);
        let cloud = scan.cloud();
        let errors: Vec<f64> = cloud
            .range
            .iter()
            .zip(&cloud.truth.returns.range)
            .map(|(measured, truth)| f64::from(measured - truth))
            .collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let spread = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / errors.len() as f64;
        let spread = spread.sqrt();
        assert!(errors.len() > 28_000);
        assert!((5e-3..0.03).contains(&spread) && mean.abs() < 0.03, "{mean} {spread}");
    }
}

fn whole(design: &Design, scene: &Scene) -> PointCloud {
    sim::scan(design, scene, 1, 0).unwrap().cloud()
}

/// Beams begin beside the axis: a level ground is met at (h + Δz)/sin ω, and a point is Δz above where
/// its range and direction put it.
#[test]
fn beams_begin_where_the_vertical_corrections_say() {
    let design = vlp_16(&[]);
    let ground = scene("ground = { material = \"white\" }\nsensor.position_m = [0, 0, 1.8]\n");
    let cloud = whole(&design, &ground);
    let mut by_row = [0; 16];
    for at in 0..cloud.returns() {
        let degrees = 15.0 - 2.0 * f64::from(cloud.row[at]);
        let (_, mm) = manual().into_iter().find(|laser| laser.0 == degrees).unwrap();
        let (sine, up) = (degrees.to_radians().sin(), mm * 1e-3);
        if cloud.truth.returns.outcome[at] != Outcome::Right {
            continue;
        }
        let truth = f64::from(cloud.truth.returns.range[at]);
        // To a millimetre: without the correction −15° would be 43 mm nearer. The footprint is
        // seen at its middle by the first of its rays.
        let expected = (1.8 + up) / -sine;
        let footprint = 0.06 * expected;
        assert!((truth - expected).abs() < footprint, "{degrees}: {truth}, not {expected}");
        let range = f64::from(cloud.range[at]);
        assert!((f64::from(cloud.z[at]) - (range * sine + up)).abs() < 1e-5);
        by_row[usize::from(cloud.row[at])] += 1;
    }
    assert!(by_row[..8].iter().all(|count| *count == 0), "{by_row:?}");
    assert!(by_row[12..].iter().all(|count| *count > 1700), "{by_row:?}");
    // Without a footprint it is exact.
    let sharp = read(
        "version = 1\nname = \"sharp\"\nextends = \"vlp-16\"\n\
         idealised = [\"footprint\", \"inter-chip\", \"mirror-motion\"]\n",
    );
    let sharp = sharp.unwrap();
    let cloud = whole(&sharp, &ground);
    for at in (0..cloud.returns()).filter(|at| cloud.row[*at] == 15) {
        let truth = f64::from(cloud.truth.returns.range[at]);
        let expected = 1.8112 / 15_f64.to_radians().sin();
        assert!((truth - expected).abs() < 1e-5, "{truth}, not {expected}");
    }
}

/// Two lasers on a head; `more` stands among the keys of the second one.
fn two_lasers(more: &str) -> String {
    format!(
        "version = 1\nname = \"two\"\nextends = \"vlp-16\"\n[scan]\nmax_range_m = 60.0\n\
         light_range_m = 65.0\n[scan.spinning]\nlasers = [{{ elevation_deg = 3.0 }}, \
         {{ elevation_deg = -4.0{more} }}]\n"
    )
}

fn read(text: &str) -> Result<Design, String> {
    Design::from_toml(text, "two.toml", Path::new(""), &[]).map_err(|error| error.to_string())
}

/// A clock that starts late: ranges come out right, and the gate moves with it.
#[test]
fn a_range_offset_is_in_the_clock_and_not_in_the_points() {
    let room = |radius: f64| {
        scene(&format!("[[object]]\nshape.sphere.radius_m = {radius}\nmaterial = \"white\"\n"))
    };
    let (plain, late, early) = (
        read(&two_lasers("")).unwrap(),
        read(&two_lasers(", range_offset_mm = 1250.0")).unwrap(),
        read(&two_lasers(", range_offset_mm = -1250.0")).unwrap(),
    );
    let of_row = |design: &Design, radius: f64| {
        let cloud = whole(design, &room(radius));
        let of: Vec<f64> = (0..cloud.returns())
            .filter(|at| cloud.row[*at] == 1)
            .map(|at| f64::from(cloud.range[at]))
            .collect();
        (of.len(), of.iter().sum::<f64>() / of.len() as f64)
    };
    for design in [&plain, &late, &early] {
        let (count, mean) = of_row(design, 20.0);
        assert!(count > 1790 && (mean - 20.0).abs() < 0.01, "{count} {mean}");
        assert!(sim::scan(design, &room(20.0), 1, 0).unwrap().score.right_fraction() > 0.99);
    }
    // Seen from 0.5 m on: by the clock that starts late from 1.75 m on; and 60 m become 61.25.
    assert!(of_row(&plain, 1.6).0 > 1790 && of_row(&late, 1.6).0 == 0);
    assert!(of_row(&plain, 60.5).0 < 10 && of_row(&late, 60.5).0 > 1700);
    assert!(of_row(&early, 59.5).0 < 10 && of_row(&plain, 59.5).0 > 1700);
    let nothing = sim::scan(&late, &room(1.6), 1, 0).unwrap();
    // The other laser sees it, and this one was not expected to.
    assert!(nothing.score.right_fraction() > 0.99);
}

/// A calibration beside the sensor file is the same head as a list of its lasers.
#[test]
fn a_calibration_is_a_list_of_lasers() {
    let folder = tempfile::tempdir().unwrap();
    let yaml = "lasers:\n\
        - {laser_id: 0, rot_correction: 0.05, vert_correction: 0.1, dist_correction: 0.5,\n\
        \x20\x20 vert_offset_correction: 0.2, horiz_offset_correction: 0.03}\n\
        - {laser_id: 1, rot_correction: -0.02, vert_correction: -0.2}\n";
    std::fs::write(folder.path().join("two.yaml"), yaml).unwrap();
    let text = "version = 1\nname = \"mine\"\nextends = \"vlp-16\"\n\
                scan.spinning.calibration = \"two.yaml\"\n";
    std::fs::write(folder.path().join("mine.toml"), text).unwrap();
    let path = folder.path().join("mine.toml").display().to_string();
    let design = Design::open(&path, &[]).unwrap();
    let sine = 0.1_f64.sin();
    let lasers = format!(
        "scan.spinning.lasers = [{{ elevation_deg = {}, azimuth_deg = {}, range_offset_mm = 500.0, \
         origin_mm = [{}, 30.0, {}] }}, {{ elevation_deg = {}, azimuth_deg = {} }}]",
        0.1_f64.to_degrees(),
        0.05_f64.to_degrees(),
        -200.0 * sine,
        200.0 * 0.1_f64.cos(),
        (-0.2_f64).to_degrees(),
        (-0.02_f64).to_degrees(),
    );
    let listed =
        read(&format!("version = 1\nname = \"mine\"\nextends = \"vlp-16\"\n{lasers}\n")).unwrap();
    assert_eq!((design.scan.rows, listed.scan.rows), (2, 2));
    for row in 0..2 {
        for column in (0..1808).step_by(91) {
            let of = |design: &Design| {
                let directions = design.directions();
                [directions.of(row, column), directions.origin(row, column)]
            };
            let (read, typed) = (of(&design), of(&listed));
            let apart = |axis: usize| (read[axis / 3][axis % 3] - typed[axis / 3][axis % 3]).abs();
            assert!((0..6).all(|axis| apart(axis) < 1e-12), "{read:?} {typed:?}");
            assert_eq!(
                design.scan.pixel_at(design.directions().of(row, column)),
                Some((row, column))
            );
        }
        assert_eq!(design.scan.gates().offset(row), listed.scan.gates().offset(row));
    }
    // The contents of the file are in the digest of the sensor.
    let before = design.digest();
    std::fs::write(folder.path().join("two.yaml"), yaml.replace("0.05", "0.06")).unwrap();
    assert_ne!(Design::open(&path, &[]).unwrap().digest(), before);
    std::fs::write(folder.path().join("two.yaml"), yaml.replace("-0.2}", "-11.5}")).unwrap();
    let told = Design::open(&path, &[]).unwrap_err().to_string();
    assert!(told.contains("mine.toml:4:15: scan.spinning.calibration: "), "{told}");
    assert!(told.contains("two.yaml:4:") && told.contains("between -1.5708 and 1.5708"), "{told}");
    std::fs::remove_file(folder.path().join("two.yaml")).unwrap();
    let told = Design::open(&path, &[]).unwrap_err().to_string();
    assert!(told.contains("two.yaml: cannot be read"), "{told}");
}

/// The metadata of an Ouster sensor are a head: of the maker's own files where they are there.
#[test]
fn the_metadata_of_an_ouster_sensor_are_a_head() {
    let folder = tempfile::tempdir().unwrap();
    let text = "version = 1\nname = \"mine\"\nextends = \"vlp-16\"\n\
                scan.spinning = { calibration = \"beams.json\", firing_us = 0.4 }\n\
                tdc.converters = 128\n";
    std::fs::write(folder.path().join("mine.toml"), text).unwrap();
    let head = |json: &str| {
        std::fs::write(folder.path().join("beams.json"), json).unwrap();
        Design::open(folder.path().join("mine.toml").display().to_string(), &[]).unwrap()
    };
    let three = head(
        "{\"beam_altitude_angles\": [20.0, 0.5, -15.0], \"beam_azimuth_angles\": [3.0, -3.0, 0.0]}",
    );
    assert_eq!(three.scan.rows, 3);
    let [x, y, z] = three.directions().of(0, 0);
    let [_, ahead, _] = three.directions().of(2, 0);
    assert!((z - 20_f64.to_radians().sin()).abs() < 1e-12);
    // Its beam points 3 degrees to the right of that of the last laser.
    let apart = (y.atan2(x) - ahead.atan2(three.directions().of(2, 0)[0])).to_degrees();
    assert!((apart.abs() - 3.0).abs() < 0.4, "{apart}");
    let metadata = "recorded/ouster/OS-1-128_v2.3.0_1024x10.json";
    if let Some(metadata) = macropulse_testbed::data_of_others(metadata) {
        let design = head(&std::fs::read_to_string(metadata).unwrap());
        assert_eq!(design.scan.rows, 128);
        let top = design.directions().of(0, 0)[2].asin().to_degrees();
        assert!((top - 20.95).abs() < 1e-9, "{top}");
    }
}

#[test]
fn what_a_head_cannot_be_is_told() {
    let told = |keys: &str| {
        let text = format!("version = 1\nname = \"mine\"\nextends = \"vlp-16\"\n{keys}\n");
        read(&text).err().unwrap_or_default()
    };
    for (keys, said) in [
        ("scan.spinning.lasers = []", "must name 1 to 1024 lasers"),
        (
            "scan.spinning.lasers = [{ elevation_deg = 1.0 }, { elevation_deg = 91.0 }]",
            "laser 2: its elevation is 91 degrees, but must lie between -90 and 90",
        ),
        (
            "scan.spinning.lasers = [{ elevation_deg = 1.0, range_offset_mm = 20000.0 }]",
            "laser 1: its range offset is 20000 mm, but must lie between -10000 and 10000",
        ),
        ("scan.spinning.lasers = [{ elevation = 1.0 }]", "elevation"),
        ("scan.spinning.firing_us = 3.5", "must lie between 0 and 3.456"),
        ("scan.spinning.firing = \"together\"", "has no effect because of `scan.spinning.firing`"),
        ("scan.spinning.cycle_us = 40000.0", "must lie between"),
        (
            "scan.spinning = { cycle_us = 50.0, azimuth_step_deg = 0.2 }",
            "needs exactly one of azimuth_step_deg, cycle_us",
        ),
    ] {
        let message = told(keys);
        assert!(message.contains(said), "{keys}: {message}");
    }
    // A key that is named replaces what the parent has.
    assert_eq!(told("scan.spinning.azimuth_step_deg = 0.2"), "");
    let block = "scan.spinning.blocks = [{ lasers = 8, first_deg = 7.0, step_deg = -2.0 }]";
    assert_eq!(told(block), "");
}

/// A beam that begins elsewhere costs no light and moves with the sensor; one that is turned in
/// azimuth is where it says.
#[test]
fn origins_turn_with_the_head() {
    let text = "version = 1\nname = \"one\"\nextends = \"vlp-16\"\nidealised = [\"footprint\", \
                \"inter-chip\", \"mirror-motion\"]\n[scan.spinning]\nlasers = [{ elevation_deg = 0.0, \
                azimuth_deg = 30.0, origin_mm = [100.0, 50.0, 0.0] }]\n";
    let design = read(text).unwrap();
    // Known answer: the beam along a from (0.1 cos a − 0.05 sin a, …) meets the wall x = 10 after
    // (10 − 0.1 cos a + 0.05 sin a)/cos a.
    let wall = "[[object]]\nshape.plane.normal = [-1, 0, 0]\nposition_m = [10, 0, 0]\n\
                material = \"white\"\n";
    let cloud = whole(&design, &scene(wall));
    let mut found = 0;
    for at in 0..cloud.returns() {
        let head = PI - TAU * f64::from(cloud.column[at]) * 55.296e-6 / 0.1;
        let a = head + 30_f64.to_radians();
        let expected = (10.0 - 0.1 * a.cos() + 0.05 * a.sin()) / a.cos();
        if expected < 40.0 {
            let truth = f64::from(cloud.truth.returns.range[at]);
            assert!((truth - expected).abs() < 1e-4, "{truth}, not {expected}");
            let x = f64::from(cloud.x[at]);
            assert!((x - 10.0 - f64::from(cloud.range[at] - truth as f32) * a.cos()).abs() < 1e-4);
            found += 1;
        }
    }
    assert!(found > 700, "{found}");
}
