//! Sensors written from `docs/formats.md` alone: pattern, detector, code and link budget are chosen
//! each by itself, and what comes out is what the forecast says.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use macropulse::design::Design;
use macropulse::emit::{Band, bands};
use macropulse::environment::Environment;
use macropulse::points::Outcome;
use macropulse::predict::Forecaster;
use macropulse::scene::Scene;
use macropulse::sim::{self, Scan};

const SENSORS: [&str; 4] = ["spinning-32", "flash-cells", "flash-linear", "flash-coded"];

fn file(name: &str) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.join("../../docs/examples/sensors").join(format!("{name}.toml"))
}

fn sensor(name: &str, set: &[(&str, &str)]) -> Design {
    let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    let set: Vec<_> = set.iter().map(owned).collect();
    Design::open(file(name), &set).unwrap()
}

/// A hollow sphere about the sensor: every shot meets it square on.
fn room(range: f64, reflectance: f64) -> Scene {
    let text = format!(
        "version = 1\nenvironment = \"clear-day\"\n[[material]]\nname = \"paint\"\n\
         diffuse = {reflectance}\n[[object]]\nshape.sphere.radius_m = {range}\n\
         material = \"paint\"\n"
    );
    Scene::from_toml(&text, "room", Path::new("")).unwrap()
}

fn day() -> Environment {
    Environment::named("clear-day").unwrap()
}

/// The first bands of a scan, with 4000 shots or a few more.
fn measure(design: &Design, scene: &Scene) -> Scan {
    let mut shots = 0;
    let few = |band: &Band| {
        let enough = shots >= 4000;
        shots += band.shots;
        !enough
    };
    let part: Vec<Band> = bands(design, 0).take_while(few).collect();
    sim::scan_part(design, scene, 1, &part).unwrap()
}

#[test]
fn a_sensor_takes_less_than_25_lines() {
    for name in SENSORS {
        let text = std::fs::read_to_string(file(name)).unwrap();
        // The first line names the schema for editors.
        assert!(text.lines().skip(1).count() < 25, "{name}");
    }
}

/// Nearly all of a wall of 30 % at 20 m is right, by day, and the budget says so.
#[test]
fn a_wall_nearby_is_seen_as_the_budget_says() {
    for name in SENSORS {
        let design = sensor(name, &[]);
        let scan = measure(&design, &room(20.0, 0.3));
        let forecast = Forecaster::new(&design, &day()).unwrap().forecast(0.3, 20.0);
        let right = scan.score.right_fraction();
        assert!(right > 0.9 && forecast.pd > 0.9, "{name}: {right}, forecast {}", forecast.pd);
        assert!(forecast.precision.unwrap() < design.right_within, "{name}");
    }
}

#[test]
fn the_ready_scenes_are_seen() {
    for name in SENSORS {
        let design = sensor(name, &[]);
        for scene in ["car-30m", "street"] {
            let mut scene = Scene::open(scene).unwrap();
            scene.environment = day();
            let scan = measure(&design, &scene);
            let right = scan.score.right_fraction();
            assert!(right > 0.5, "{name} in {}: {right}", scene.name);
            assert!(scan.tally.returns > 50, "{name} in {}", scene.name);
        }
    }
}

/// H0: returns come as often as the forecast says, of a wall that is seen by half to nine tenths.
/// N = 3072 to 4096 shots, seed 1: the share is known to 0.008, the forecast to 0.03. Control: a
/// wall of half the reflectance is told from it.
#[test]
fn the_forecast_of_every_sensor_is_what_is_simulated() {
    let walls = [
        ("spinning-32", 90.0, 0.12),
        ("flash-cells", 35.0, 0.03),
        ("flash-linear", 58.0, 0.02),
        ("flash-coded", 58.0, 0.0105),
    ];
    for (name, range, reflectance) in walls {
        let design = sensor(name, &[]);
        let forecaster = Forecaster::new(&design, &day()).unwrap();
        let of = |reflectance: f64| {
            let scan = measure(&design, &room(range, reflectance));
            let false_points = forecaster.forecast(reflectance, range).false_per_shot;
            assert!(false_points < 0.1);
            let seen = scan.score.right_fraction();
            println!("{name}: {seen} returns {} of {}", scan.tally.returns, scan.tally.shots);
            seen
        };
        let forecast = forecaster.forecast(reflectance, range).pd;
        let found = of(reflectance);
        println!("{name}: forecast {forecast:.4}, found {found:.4}");
        assert!((0.3..0.97).contains(&forecast), "{name}: {forecast}");
        assert!((found - forecast).abs() < 0.03, "{name}: {found}, forecast {forecast}");
        assert!((of(reflectance / 2.0) - forecast).abs() > 0.03, "{name}: control");
    }
}

/// H0: sixteen beams side by side, each with a detector of its own, see what is forecast. N = 13 568 shots
/// or more at three reflectances, seed 1; a difference of more than 0.03 is rejected, seven standard errors
/// or more. Control: the forecast for a tenth less light. Every beam finds points in its own rows.
#[test]
fn beams_side_by_side_see_what_is_forecast() {
    let keys = [
        ("scan.raster.beams", "16"),
        ("scan.raster.duty", "0.5"),
        ("tdc.converters", "256"),
        ("scan.raster.mirror", "sinusoidal"),
    ];
    let keys = keys.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let design = Design::open("coded-practical", &keys).unwrap();
    assert_eq!((design.channels(), design.bank().unwrap().converters), (16, 16));
    let sky = day();
    let forecaster = Forecaster::new(&design, &sky).unwrap();
    let mut rejected = 0;
    for reflectance in [0.035, 0.045, 0.1] {
        let scan = measure(&design, &room(120.0, reflectance));
        let [seen, shots] = [scan.score.count(Outcome::Right), scan.score.with_echo()];
        assert!(shots >= 13_568, "{shots}");
        let found = seen as f64 / shots as f64;
        let forecast = forecaster.forecast(reflectance, 120.0).pd;
        assert!((found - forecast).abs() < 0.03, "{reflectance}: {found} for {forecast}");
        let less = forecaster.with_light(0.9).forecast(reflectance, 120.0).pd;
        rejected += u32::from((found - less).abs() >= 0.03);
        let cloud = scan.cloud();
        let beams: std::collections::BTreeSet<u16> = cloud.row.iter().map(|row| row / 30).collect();
        assert_eq!(beams.len(), 16, "{reflectance}: {beams:?}");
    }
    assert!(rejected > 0, "the control was not rejected");
}
