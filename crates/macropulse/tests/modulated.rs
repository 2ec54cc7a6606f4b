//! Sensors of modulated light.
#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;
use std::path::Path;

use macropulse::channel::{Echo, Operating, light_of_echoes};
use macropulse::codec::Given;
use macropulse::design::Design;
use macropulse::detect::Detectors;
use macropulse::emit::bands;
use macropulse::environment::Environment;
use macropulse::points::{Outcome, PointCloud};
use macropulse::predict::{self, Forecaster};
use macropulse::random::Chance;
use macropulse::scene::Scene;
use macropulse::sim::{self, Scans};
use macropulse::units::{fs_from_s, range_from_tof, tof_from_range};

/// The ready camera with 80 × 60 pixels, and changes.
fn camera(changes: &[(&str, &str)]) -> Design {
    let size = [("scan.flash.rows", "60"), ("scan.flash.columns", "80")];
    let set = size.iter().chain(changes).map(|(key, value)| ((*key).into(), (*value).into()));
    Design::open("itof-camera", &set.collect::<Vec<_>>()).unwrap()
}

/// A sphere about the sensor.
fn sphere(radius: f64, reflectance: f64, environment: &str) -> Scene {
    let text = format!(
        "version = 1\nenvironment = \"{environment}\"\n[[material]]\nname = \"paint\"\n\
         diffuse = {reflectance:?}\n[[object]]\nshape.sphere.radius_m = {radius:?}\nmaterial = \"paint\"\n"
    );
    Scene::from_toml(&text, "sphere.toml", Path::new("")).unwrap()
}

fn scanned(design: &Design, scene: &Scene) -> PointCloud {
    sim::scan(design, scene, 5, 0).unwrap().cloud()
}

/// Mean of the ranges of a cloud, and their standard deviation.
fn moments(cloud: &PointCloud) -> (f64, f64) {
    let count = cloud.returns() as f64;
    let mean = cloud.range.iter().map(|range| f64::from(*range)).sum::<f64>() / count;
    let squares = cloud.range.iter().map(|range| (f64::from(*range) - mean).powi(2)).sum::<f64>();
    (mean, (squares / count).sqrt())
}

/// H0: a wall is found, in the right interval and to the precision of the forecast. N = 4800 pixels for each place,
/// seed 5; a share may differ by 0.02 or 4.9 deviations (α = 1e-6), a precision of 1000 points or more by a tenth.
/// Control: with half the contrast it is less precise by more than that, twice as much without sunlight.
#[test]
fn walls_are_found_as_forecast() {
    let design = camera(&[]);
    let half = camera(&[("detector.lock-in.contrast", "[0.35, 0.4]")]);
    let mut tried = 0;
    for (name, radius, reflectances) in [
        ("night", 3.43, &[0.03, 0.045, 0.05, 0.06, 0.4, 0.8][..]),
        ("overcast", 1.77, &[0.02, 0.05, 0.9]),
        ("night", 4.81, &[0.11, 0.2, 0.9]),
    ] {
        for &reflectance in reflectances {
            let environment = Environment::named(name).unwrap();
            let forecast =
                Forecaster::new(&design, &environment).unwrap().forecast(reflectance, radius);
            let cloud = scanned(&design, &sphere(radius, reflectance, name));
            let outcomes = &cloud.truth.returns.outcome;
            let found = outcomes
                .iter()
                .filter(|outcome| matches!(outcome, Outcome::Right | Outcome::Near))
                .count() as f64
                / 4800.0;
            let deviation = (forecast.pd * (1.0 - forecast.pd) / 4800.0).sqrt();
            let place = format!("{reflectance} at {radius} m, {name}: {forecast:?}, found {found}");
            assert!((forecast.pd - found).abs() < (4.9 * deviation).max(0.02), "{place}");
            // Not all faint echoes are near enough to count.
            let Some(precision) = forecast.precision.filter(|sigma| 5.0 * sigma < 0.1) else {
                continue;
            };
            let (mean, spread) = moments(&cloud);
            assert!(
                (mean - radius).abs() < 4.9 * spread / 4800_f64.sqrt() + 1e-4,
                "{place}: {mean}"
            );
            assert!((spread / precision - 1.0).abs() < 0.1, "{place}: {spread}");
            let wrong = Forecaster::new(&half, &environment).unwrap().forecast(reflectance, radius);
            assert!((spread / wrong.precision.unwrap() - 1.0).abs() > 0.3, "{place}");
            tried += 1;
        }
    }
    assert!(tried >= 3, "{tried}");
}

/// The range that four taps give of a surface at `range` which approaches at `velocity`. Each tap has the range of its own
/// time. The first one is `after` seconds from the shot, and the others follow `apart` seconds from each other.
fn of_moving(hz: f64, (range, velocity): (f64, f64), (after, apart): (f64, f64)) -> f64 {
    let tap = |k: f64| {
        let there = range - velocity * (after + k * apart);
        (2.0 * TAU * hz * there / 299_792_458.0 - k * TAU / 4.0).cos()
    };
    let phase = (tap(1.0) - tap(3.0)).atan2(tap(0.0) - tap(2.0));
    phase.rem_euclid(TAU) * 299_792_458.0 / (2.0 * TAU * hz)
}

/// Number, mean and standard deviation.
fn spread_of(errors: &[f64]) -> (f64, f64, f64) {
    let count = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / count;
    let squares = errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>();
    (count, mean, (squares / count).sqrt())
}

/// H0: a wall that approaches at 10 m/s is found where its taps say, each with the range of its own time. N is over 10 000
/// pixels, seed 5. The mean of measured less expected is within 4.9 standard deviations of 0 (α = 1e-6), and the spread is
/// that of a wall that stands, to a twentieth. Control: the range in the middle of all taps leaves a ripple of at most
/// v·Δt/2 = 1.25 mm. Another: the range at the shot is off by the way of the wall.
#[test]
fn taps_of_a_moving_wall_have_ranges_of_their_own() {
    let design = camera(&[
        ("modulation.frequencies_mhz", "[100.0]"),
        ("detector.lock-in.contrast", "[0.7]"),
        ("modulation.gap_us", "125.0"),
        ("detector.lock-in.full_well_e", "1e8"),
        ("detector.lock-in.adc_bits", "16"),
        ("light.energy.shot_nj", "5000.0"),
        ("scan.max_range_m", "1.4"),
    ]);
    let times = (62.5e-6, 250e-6);
    let middle = times.0 + 1.5 * times.1;
    let [mut still, mut by_tap, mut by_middle, mut by_shot] = [const { Vec::new() }; 4];
    for place in [0.45, 0.6, 0.75, 0.9] {
        for velocity in [0.0, 10.0] {
            let text = format!(
                "version = 1\nenvironment = \"vacuum-dark\"\n[[material]]\nname = \"paint\"\n\
                 diffuse = 0.8\n[[object]]\nmaterial = \"paint\"\nposition_m = [{}, 0, 0]\n\
                 velocity_m_s = [-{velocity:?}, 0, 0]\nshape.box.size_m = [0.1, 6, 6]\n",
                place + 0.05
            );
            let scene = Scene::from_toml(&text, "wall.toml", Path::new("")).unwrap();
            let cloud = scanned(&design, &scene);
            for at in 0..cloud.returns() {
                let found = f64::from(cloud.range[at]);
                // Along the middle of the pixel, which the wall crosses at right angles to the axis.
                let cosine = f64::from(cloud.x[at]) / found;
                let (range, approaches) = (place / cosine, velocity * cosine);
                if velocity == 0.0 {
                    still.push(found - range);
                    continue;
                }
                by_tap.push(found - of_moving(100e6, (range, approaches), times));
                by_middle.push(found - (range - approaches * middle));
                by_shot.push(found - range);
            }
        }
    }
    let (_, _, sigma) = spread_of(&still);
    let (count, mean, spread) = spread_of(&by_tap);
    assert!(count > 10_000.0, "{count}");
    assert!(mean.abs() < 4.9 * sigma / count.sqrt() + 2e-6, "{mean} with {sigma}");
    assert!((spread / sigma - 1.0).abs() < 0.05, "{spread} for {sigma}");
    let (_, _, ripple) = spread_of(&by_middle);
    assert!(ripple > 1.5 * sigma && ripple < 1.25e-3, "{ripple} for {sigma}");
    assert!(by_middle.iter().all(|error| error.abs() < 1.25e-3 + 6.0 * sigma));
    let (_, at_shot, _) = spread_of(&by_shot);
    assert!(at_shot < -0.9 * 10.0 * middle * 0.8, "{at_shot}");
}

/// C6 of a camera's source, 3 mm wide: one exposure of 3.8 ms may have more than ten times the light of a point. A beam has
/// no such source.
#[test]
fn a_wide_source_sends_more_within_class_1() {
    let energy = |extended: &str| {
        let changes = [("safety.extended_source", extended), ("light.energy", "\"class-1\"")];
        camera(&changes).budget.unwrap().energy
    };
    let gain = energy("true") / energy("false");
    assert!((10.0..20.0).contains(&gain), "{gain}");
    let set = [("safety.extended_source".to_owned(), "true".to_owned())];
    let told = Design::open("fmcw-1550", &set).unwrap_err().to_string();
    assert!(told.contains("safety.extended_source: must be false, as only [scan.flash]"), "{told}");
}

/// The receiver of a sensor of one frequency, given two echoes of each shot, the second with a share `second` of the
/// photons: the mean range, m.
fn of_two(design: &Design, ranges: [f64; 2], second: f64) -> f64 {
    let band = bands(design, 0).next().unwrap();
    let log = band.shot_log(design);
    let echoes = (0..log.len()).flat_map(|shot| {
        ranges.into_iter().zip([1.0, second]).map(move |(range, share)| Echo {
            shot,
            delay_fs: fs_from_s(tof_from_range(range)),
            photons: 4e5 * share,
        })
    });
    let light = light_of_echoes(design, &log, echoes);
    let operating = Operating::of(design, &Environment::vacuum_dark()).unwrap();
    let detectors = Detectors::new(design, &operating, Chance::new(9));
    let taps = detectors.record_by_shot(&log, &light).unwrap();
    let returns = design.receive(&design.known(&log), &taps).unwrap();
    let sum: f64 = returns.tof.iter().map(|tof| range_from_tof(*tof)).sum();
    sum / returns.len() as f64
}

const ONE: [(&str, &str); 2] =
    [("modulation.frequencies_mhz", "[20.0]"), ("detector.lock-in.contrast", "[0.7]")];

/// A second path with a tenth of the light moves the range by c/4πf·atan2(γ·sin Δ, 1 + γ·cos Δ), Δ = 4πfδ/c: 27.06 mm for
/// δ = 0.3 m at 20 MHz. N = 4800, known to 0.1 mm; control: 20 mm, as if it were a tenth of the 0.3 m less a third.
#[test]
fn a_second_path_moves_the_range_by_the_closed_form() {
    let well = ("detector.lock-in.full_well_e", "1e6");
    let design = camera(&[ONE[0], ONE[1], well, ("detector.lock-in.adc_bits", "16")]);
    let found = (of_two(&design, [1.0, 1.3], 0.1) - 1.0) * 1e3;
    assert!((found - 27.06).abs() < 0.3, "{found} mm");
    assert!((found - 20.0).abs() > 0.3);
    // As much light from both: half-way.
    let found = of_two(&design, [1.0, 1.3], 1.0);
    assert!((found - 1.15).abs() < 1e-3, "{found} m");
}

/// Square waves and four taps: the phase is wrong by atan(φ/(π/2 − φ)) − φ, up to 84.83 mm at 20 MHz, unless it is
/// corrected. N = 4800, known to 0.1 mm.
#[test]
fn harmonics_are_corrected_unless_a_file_says_otherwise() {
    let well = ("detector.lock-in.full_well_e", "1e6");
    let square = ("modulation.wave", "square");
    let keys = [ONE[0], ONE[1], well, square, ("detector.lock-in.adc_bits", "16")];
    // Half the interval is 3.747 m; φ in the first quarter.
    let phase = 0.38_f64;
    let range = phase / (4.0 * std::f64::consts::PI) * 299_792_458.0 / 20e6;
    let corrected = of_two(&camera(&keys), [range, 2.0], 0.0) - range;
    assert!(corrected.abs() < 1e-3, "{corrected}");
    let wrong = (phase / (std::f64::consts::FRAC_PI_2 - phase)).atan() - phase;
    let expected = wrong / (4.0 * std::f64::consts::PI) * 299_792_458.0 / 20e6;
    let left = [&keys[..], &[("receiver.correct_harmonics", "false")]].concat();
    let design = camera(&left);
    let found = of_two(&design, [range, 2.0], 0.0) - range;
    assert!((found - expected).abs() < 1e-3 && expected.abs() > 0.05, "{found}, not {expected}");
    let refused = Forecaster::new(&design, &Environment::named("night").unwrap()).unwrap_err();
    assert!(matches!(refused, predict::Error::NotModelled { .. }), "{refused}");
}

/// A white surface so near that its light fills all taps is not found, and the run says why.
#[test]
fn full_taps_give_nothing() {
    let design = camera(&[("scan.min_range_m", "0.1")]);
    let scan = sim::scan(&design, &sphere(0.15, 0.9, "night"), 1, 0).unwrap();
    assert_eq!(scan.tally.returns, 0);
    assert!(scan.tally.where_all_was_lost(&design).unwrap().contains("taps are full"));
    let night = Environment::named("night").unwrap();
    let forecast = |range| Forecaster::new(&design, &night).unwrap().forecast(0.9, range).pd;
    assert!(forecast(0.15) < 1e-9 && forecast(1.5) > 0.999);
}

/// Shots of a raster are decoded as those of a flash are; the coarse frequencies tell the interval of the fine one.
#[test]
fn a_scanner_resolves_its_intervals() {
    let set = [("scan.raster.rows".to_owned(), "12".to_owned())];
    let design = Design::open("amcw-scanner", &set).unwrap();
    for radius in [3.3, 17.0, 62.0] {
        let cloud = scanned(&design, &sphere(radius, 0.8, "clear-day"));
        let outcomes = &cloud.truth.returns.outcome;
        let right = outcomes.iter().filter(|outcome| **outcome == Outcome::Right).count();
        assert_eq!(right, 360 * 12, "{radius}");
    }
}

/// Bands have the taps of their own shots, and the same ones whatever the number of shots that are computed together.
#[test]
fn taps_are_those_of_each_shot() {
    let design = camera(&[]);
    let scene = sphere(2.0, 0.5, "night");
    let scans = Scans::new(&design, &scene, 3).unwrap();
    let codes = |band| match scans.record(&band) {
        (log, Given::Taps(taps)) => {
            assert_eq!((taps.taps, taps.codes.len()), (8, 8 * log.len()));
            taps.codes
        }
        _ => panic!("no taps"),
    };
    let all: Vec<u16> = bands(&design, 0).flat_map(codes).collect();
    let part = macropulse::emit::Band { scan: 0, first: 100, shots: 50 };
    assert_eq!(codes(part), all[8 * 100..8 * 150]);
}

/// Each scan pattern sends modulated light, and finds a wall with it.
#[test]
fn modulated_light_goes_with_every_scan_pattern() {
    let table = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
    let lines: String =
        (0..32).map(|line| format!("{},{}\n", 0.2 * f64::from(line), 0.1)).collect();
    std::fs::write(table.path(), format!("azimuth,elevation\n{lines}")).unwrap();
    let field = "rows = 4, columns = 8, horizontal_deg = 8.0, vertical_deg = 4.0";
    let turning =
        "azimuth_step_deg = 45.0, blocks = [{ lasers = 4, first_deg = 2.0, step_deg = -1.0 }]";
    let prisms = "shots_per_s = 320.0, prisms = [{ deflection_deg = 2.0, turns_per_s = 7.3 }, \
                  { deflection_deg = 2.0, turns_per_s = -4.7 }]";
    let mirror = "shots_per_s = 320.0, horizontal = { field_deg = 8.0, hz = 7.3 }, \
                  vertical = { field_deg = 4.0, hz = 4.7 }";
    let file = format!("file = {:?}, firings_per_s = 320.0", table.path().display().to_string());
    for (name, keys) in [
        ("raster", field),
        ("flash", field),
        ("spinning", turning),
        ("rosette", prisms),
        ("lissajous", mirror),
        ("table", &file),
    ] {
        let text = format!(
            "version = 1\nname = \"mine\"\nidealised = [\"footprint\", \"mirror-motion\", \"eye-safety\"]\n\
             scan = {{ scans_per_s = 10.0, max_range_m = 4.9, {name} = {{ {keys} }} }}\n\
             [light]\nwavelength_nm = 850.0\nenergy = {{ shot_nj = 80.0 }}\n\
             [modulation]\nfrequencies_mhz = [120.0, 90.0]\nphases = 4\nexposure_us = 125.0\n\
             [optics]\naperture_mm = 3.0\ntransmission = 0.7\nfilter_nm = 40.0\nfield = {{ cone_mrad = 7.0 }}\n\
             [detector.lock-in]\nefficiency = 0.3\ncontrast = [0.7, 0.8]\nfull_well_e = 1e5\nadc_bits = 12\n\
             [receiver]\nkind = \"phase\"\nright_within_m = 0.1\n"
        );
        let design = Design::from_toml(&text, "mine.toml", Path::new(""), &[]).unwrap();
        let scan = sim::scan(&design, &sphere(3.0, 0.8, "night"), 1, 0).unwrap();
        assert!(scan.tally.shots > 0, "{name}");
        assert_eq!(scan.score.right_fraction(), 1.0, "{name}");
    }
}
