//! Sensors of frequency-modulated light.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use macropulse::channel::Operating;
use macropulse::design::Design;
use macropulse::environment::Environment;
use macropulse::points::{Outcome, PointCloud};
use macropulse::predict::{self, Forecaster};
use macropulse::scene::Scene;
use macropulse::sim;
use macropulse::units::range_from_tof;

/// The ready sensor with its spectra drawn bin by bin, and changes.
fn sensor(changes: &[(&str, &str)]) -> Design {
    let fast = [("chirp.linewidth_khz", "0"), ("spectrum.fidelity", "\"spectrum\"")];
    let set = fast.iter().chain(changes).map(|(key, value)| ((*key).into(), (*value).into()));
    Design::open("fmcw-1550", &set.collect::<Vec<_>>()).unwrap()
}

fn opened(text: &str) -> Scene {
    Scene::from_toml(text, "test.toml", Path::new("")).unwrap()
}

/// A sphere about the sensor, which may move.
fn sphere(radius: f64, reflectance: f64, motion: &str) -> Scene {
    opened(&format!(
        "version = 1\nenvironment = \"clear-day\"\n[[material]]\nname = \"paint\"\n\
         diffuse = {reflectance:?}\n[[object]]\nshape.sphere.radius_m = {radius:?}\nmaterial = \"paint\"\n{motion}"
    ))
}

fn scanned(design: &Design, scene: &Scene) -> PointCloud {
    sim::scan(design, scene, 5, 0).unwrap().cloud()
}

/// Errors of the ranges of a cloud that are right.
fn errors(cloud: &PointCloud) -> Vec<f64> {
    let truth = &cloud.truth.returns;
    (0..cloud.returns())
        .filter(|at| truth.outcome[*at] == Outcome::Right)
        .map(|at| f64::from(cloud.range[at]) - f64::from(truth.range[at]))
        .collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// H0: with both windows, a wall is found as often and as precisely as forecast. With two ramps it moves.
/// With a single one it stands at four places within a bin, so its beats lie anywhere in theirs. N = 15 360
/// pixels for each place and radius, seed 5. A share may differ by 0.02 or 4.9 deviations (α = 1e-6). A
/// precision may differ by 15 %, as few faint echoes make much of it. Control: forecasts for three quarters
/// of the light, and half the bandwidth.
#[test]
fn walls_are_found_as_forecast() {
    let two = [(60.0, 0.02), (100.0, 0.02), (120.0, 0.15), (190.0, 0.9), (20.0, 0.5)];
    let motion = "velocity_m_s = [-7, 0, 0]\n";
    for window in ["\"hann\"", "\"none\""] {
        for place in two {
            found_as_forecast((window, "5.0"), &[place], motion);
        }
        let bin = range_from_tof(1.0 / 0.64e9);
        let places = [0.0, 0.25, 0.5, 0.75].map(|part| (100.0 + part * bin, 0.02));
        found_as_forecast((window, "0.0"), &places, "");
    }
}

/// Asserts that walls at these ranges, m, and with these reflectances are found as forecast, all together.
fn found_as_forecast((window, down): (&str, &str), places: &[(f64, f64)], motion: &str) {
    let environment = Environment::named("clear-day").unwrap();
    let set = [("spectrum.window", window), ("chirp.down_us", down), ("receiver.returns", "1")];
    let design = sensor(&set);
    let half = sensor(&[&set[..], &[("chirp.bandwidth_ghz", "0.32")]].concat());
    let [forecaster, half] = [&design, &half].map(|it| Forecaster::new(it, &environment).unwrap());
    let (radius, reflectance) = places[0];
    let forecast = forecaster.forecast(reflectance, radius);
    let mut errors = Vec::new();
    for (radius, reflectance) in places {
        let cloud = scanned(&design, &sphere(*radius, *reflectance, motion));
        errors.extend(self::errors(&cloud));
    }
    let count = 15_360.0 * places.len() as f64;
    let found = errors.len() as f64 / count;
    let place =
        format!("{window} {down}: {reflectance} at {radius} m: {forecast:?}, found {found}");
    let allowed = |pd: f64| (4.9 * (pd * (1.0 - pd) / count).sqrt()).max(0.02);
    assert!((forecast.pd - found).abs() < allowed(forecast.pd), "{place}");
    let darker = forecaster.with_light(0.75).forecast(reflectance, radius).pd;
    if forecast.pd < 0.9 {
        assert!((darker - found).abs() > allowed(darker), "{place}");
    }
    let (precision, spread) = (forecast.precision.unwrap(), rms(&errors));
    assert!((spread / precision - 1.0).abs() < 0.15, "{place}: {spread}");
    let wrong = half.forecast(reflectance, radius).precision.unwrap();
    assert!((spread / wrong - 1.0).abs() > 0.3);
}

/// A sphere that approaches at 15 m/s on one side leaves at 15 m/s on the other; its radial velocities are measured, and true
/// ones stand beside them. Control: as much the other way round is noticed.
#[test]
fn radial_velocities_are_measured() {
    let cloud = scanned(&sensor(&[]), &sphere(40.0, 0.5, "velocity_m_s = [-15, 4, 0]\n"));
    let right =
        (0..cloud.returns()).filter(|at| cloud.truth.returns.outcome[*at] == Outcome::Right);
    let (mut errors, mut mirrored) = (Vec::new(), Vec::new());
    for at in right {
        let (measured, truth) = (cloud.radial_velocity[at], cloud.truth.radial_velocity[at]);
        let [x, y, _] = cloud.position(at);
        let range = f64::from(cloud.range[at]);
        // It moves by up to 3 m in a scan, so that its middle is not where the sensor is.
        let expected = (15.0 * x - 4.0 * y) / range;
        assert!((f64::from(truth) - expected).abs() < 0.02, "{truth}, not {expected}");
        errors.push(f64::from(measured - truth));
        mirrored.push(f64::from(measured + truth));
    }
    assert!(errors.len() > 14_000, "{}", errors.len());
    assert!(rms(&errors) < 0.03 && rms(&mirrored) > 10.0, "{}", rms(&errors));
    assert_eq!(cloud.radial_velocity.len(), cloud.returns());
}

/// If a band meets nothing, its false returns have no true velocity, and all columns have the same length. A tenth of
/// all shots is false.
#[test]
fn false_returns_have_no_true_velocity() {
    let design = sensor(&[("receiver.false_alarm", "0.1"), ("spectrum.false_peaks", "5")]);
    let scene = opened(
        "version = 1\nenvironment = \"night\"\n[[material]]\nname = \"paint\"\ndiffuse = 0.5\n\
         [[object]]\nshape.box.size_m = [1.0, 4.0, 1.0]\nposition_m = [20.0, 0.0, 2.4]\nmaterial = \"paint\"\n",
    );
    let cloud = scanned(&design, &scene);
    let truth = &cloud.truth;
    assert_eq!(
        (truth.radial_velocity.len(), cloud.radial_velocity.len()),
        (cloud.returns(), cloud.returns())
    );
    let of = |outcome: Outcome| {
        (0..cloud.returns()).filter(move |at| truth.returns.outcome[*at] == outcome)
    };
    assert!(of(Outcome::False).all(|at| truth.radial_velocity[at].is_nan()));
    assert!(of(Outcome::Right).all(|at| truth.radial_velocity[at] == 0.0));
    let counts = [Outcome::False, Outcome::Right].map(|outcome| of(outcome).count());
    assert!(counts[0] > 300 && counts[1] > 50, "{counts:?}");
}

/// A single ramp takes speed for range: 15 m/s is 19.354 MHz, and with 128 MHz/µs 22.67 m.
#[test]
fn a_single_ramp_is_wrong_where_something_moves() {
    let design = sensor(&[("chirp.down_us", "0.0")]);
    let cloud = scanned(&design, &sphere(60.0, 0.9, "velocity_m_s = [-15, 0, 0]\n"));
    assert!(cloud.radial_velocity.is_empty());
    let ahead = (0..cloud.returns()).filter(|at| cloud.row[*at] == 16 && cloud.column[*at] == 240);
    let ranges: Vec<f32> = ahead.map(|at| cloud.range[at]).collect();
    let [range] = ranges[..] else { panic!("{ranges:?}") };
    // Half a scan, in which it has come nearer by 1.5 m.
    assert!((range - (60.0 - 22.67 - 1.5)).abs() < 0.3, "{range}");
}

/// Published: a sunlit white wall brings 6.5e-6 photons to a mode, in one polarisation.
#[test]
fn sunlight_brings_next_to_nothing_to_a_mode() {
    let design = sensor(&[("optics.transmission", "1.0")]);
    let noon = [("irradiance_w_m2_nm", "0.27"), ("albedo", "1.0")];
    let noon = noon.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let environment = Environment::changed("clear-day", &noon).unwrap();
    let operating = Operating::of(&design, &environment).unwrap();
    let per_mode = operating.sunlight / 512e6;
    assert!((per_mode / 6.5e-6 - 1.0).abs() < 0.02, "{per_mode}");
}

/// A forecast refuses effects that it does not model. A fault in a file gives one sentence that names its
/// key.
#[test]
fn what_does_not_go_together_is_refused() {
    let straying = sensor(&[
        ("spectrum.fidelity", "\"waveform\""),
        ("chirp.error_mhz", "1.0"),
        ("chirp.error_khz", "100.0"),
    ]);
    let environment = Environment::named("night").unwrap();
    let told = Forecaster::new(&straying, &environment).unwrap_err();
    assert!(
        matches!(told, predict::Error::NotModelled { .. }) && told.to_string().contains("strays")
    );
    for (key, value, told) in [
        ("chirp.settle_us", "0.5", "light is on its way from 200.0 m"),
        ("chirp.error_mhz", "1.0", "give both, or leave both out"),
        ("chirp.up_us", "9.0", "longer than the 13.021 µs between"),
        ("spectrum.sample_msps", "300.0", "the beat of a surface at 200 m"),
        ("spectrum.sample_msps", "512.07", "a whole number"),
        ("spectrum.sample_msps", "20000.0", "are possible"),
        ("spectrum.peaks", "0", "spectrum.peaks"),
        ("chirp.linewidth_khz", "10", "exact for ideal chirps alone"),
        (
            "modulation",
            "{ frequencies_mhz = [1.0], phases = 4, exposure_us = 40.0 }",
            "leave one of them out",
        ),
        ("burst", "{ pulses = 2, interval_ns = 100.0 }", "the light of a [chirp] has none"),
        ("light.pulse_ps", "100", "has no effect because of `chirp`"),
        ("light.linewidth_ghz", "0.1", "has no effect because of `chirp`"),
        ("optics.filter_nm", "1.0", "has no effect because of `chirp`"),
        ("detector", "{ geiger = { efficiency = 0.1, cells = 10 } }", "must be `coherent`"),
        ("receiver.kind", "matched", "`beat` for a [chirp]"),
        (
            "idealised",
            "[\"mirror-motion\", \"link-budget\", \"eye-safety\"]",
            "counts its noise in photons",
        ),
        ("with", "mirror-motion", "mirror-motion"),
    ] {
        let fast = [("chirp.linewidth_khz", "0"), ("spectrum.fidelity", "\"spectrum\"")];
        let set = fast.into_iter().chain([(key, value)]);
        let set = set.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let error = Design::open("fmcw-1550", &set.collect::<Vec<_>>()).unwrap_err().to_string();
        assert!(error.contains(told), "{key} = {value}: {error}");
    }
    let set = [("spectrum.peaks".to_owned(), "4".to_owned())];
    let error = Design::open("peregrine", &set).unwrap_err().to_string();
    assert!(error.contains("spectrum"), "{error}");
}
