//! The examples of docs/examples, with the meshes by others that they are written for.
//!
//! The meshes are no part of the repository. If they are absent, a test says so and passes.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::path::{Path, PathBuf};

use macropulse::design::Design;
use macropulse::emit::{Band, short_bands};
use macropulse::environment::Environment;
use macropulse::points::Outcome;
use macropulse::predict::Forecaster;
use macropulse::scene::Scene;
use macropulse::sim::{self, Scan};
use macropulse_study::paper::SENSORS;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};

type Point = [f64; 3];

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The example called `name`, its meshes looked for in `folder` of the shared collection.
fn example(name: &str, folder: &str) -> Option<Scene> {
    changed(name, folder, |text| text)
}

/// The same, its text changed.
fn changed(name: &str, folder: &str, change: fn(String) -> String) -> Option<Scene> {
    let text = change(fs::read_to_string(here("../../docs/examples").join(name)).unwrap());
    let base = macropulse_testbed::data_of_others(&format!("meshes/{folder}"))?;
    Some(Scene::from_toml(&text, name, &base).unwrap())
}

/// Lines in each of the stretches that a coded sensor is measured in.
const LINES: u64 = 9;

/// A scan by a ready sensor; of a coded one only the stretches named.
struct Seen {
    design: Design,
    scan: Scan,
}

impl Seen {
    fn new(sensor: &str, scene: &Scene, coded: &[u64]) -> Self {
        let design = Design::open(sensor, &[]).unwrap();
        let all: Vec<Band> = short_bands(&design, 0).collect();
        let part: Vec<Band> = match design.is_coded() {
            true => all
                .into_iter()
                .filter(|band| {
                    coded.contains(&(band.first / u64::from(design.scan.columns) / LINES))
                })
                .collect(),
            false => all,
        };
        let scan = sim::scan_part(&design, scene, 11, &part).unwrap();
        Self { design, scan }
    }

    /// World coordinates of the right points whose ray first meets the object called `name`.
    fn points_on(&self, scene: &Scene, name: &str) -> Vec<Point> {
        let object = scene.objects.iter().position(|object| object.name == name).unwrap();
        let cloud = &self.scan.cloud();
        let to_world = scene.sensor.at_start().world_from_sensor();
        (0..cloud.range.len())
            .filter(|&at| {
                let seen = cloud.truth.returns.at(at);
                seen.outcome == Outcome::Right && usize::from(seen.object) == object
            })
            .map(|at| to_world.point([cloud.x[at], cloud.y[at], cloud.z[at]].map(f64::from)))
            .collect()
    }

    /// How far a right point may be from its surface, m: a little more for rounding to `f32`.
    fn tolerance(&self) -> f64 {
        self.design.right_within + 1e-4
    }
}

/// Lowest and highest value on each axis.
fn bounds(points: &[Point]) -> (Point, Point) {
    let axis = |at: usize| points.iter().map(move |point| point[at]);
    let low = [0, 1, 2].map(|at| axis(at).fold(f64::INFINITY, f64::min));
    let high = [0, 1, 2].map(|at| axis(at).fold(f64::NEG_INFINITY, f64::max));
    (low, high)
}

#[track_caller]
fn assert_within(points: &[Point], (low, high): (Point, Point), tolerance: f64) {
    for point in points {
        for axis in 0..3 {
            let inside = low[axis] - tolerance..=high[axis] + tolerance;
            assert!(inside.contains(&point[axis]), "{point:?} is outside {low:?} … {high:?}");
        }
    }
}

#[track_caller]
fn assert_on_level(points: &[Point], height: f64, tolerance: f64) {
    for point in points {
        assert!((point[2] - height).abs() <= tolerance, "{point:?}, not {height} m high");
    }
}

#[test]
fn a_hatchback_in_inches_stands_30_m_ahead() {
    let Some(scene) = example("hatchback.toml", "") else { return };
    for (sensor, least) in SENSORS.into_iter().zip([1000, 250, 120]) {
        let seen = Seen::new(sensor, &scene, &[29, 32, 33]);
        let car = seen.points_on(&scene, "hatchback");
        assert!(car.len() >= least, "{sensor}: {} points on the car", car.len());
        let (low, high) = bounds(&car);
        assert!((low[0] - 30.0).abs() < 0.05, "{sensor}: nearest at {} m", low[0]);
        // 4.00 m long, 2.14 m wide with its mirrors, 1.57 m high.
        let body = ([30.0, -1.07, 0.0], [34.01, 1.07, 1.57]);
        assert_within(&car, body, seen.tolerance());
        // All but the rims of it, which fall between samples.
        assert!(high[1] - low[1] > 1.85, "{sensor}: {low:?} … {high:?}");
        assert!(high[2] - low[2] > 0.6, "{sensor}: {low:?} … {high:?}");
        let road = seen.points_on(&scene, "ground");
        assert_on_level(&road, 0.0, seen.tolerance());
        match sensor {
            "peregrine" => assert_too_dark_for(&seen.design, &road),
            _ => assert!(road.len() > 1000, "{sensor}: {} points on the road", road.len()),
        }
    }
    // Ten times as bright, the flash sees it: where it is.
    let white =
        changed("hatchback.toml", "", |text| text.replace("\"asphalt\"", "\"white\"")).unwrap();
    let seen = Seen::new("peregrine", &white, &[]);
    let road = seen.points_on(&white, "ground");
    assert!(road.len() > 300, "{} points on a white road", road.len());
    assert_on_level(&road, 0.0, seen.tolerance());
}

/// A flash of 32 rows over 7.5 degrees, 2 m above the road, meets it no nearer than at 31.6 m, with a cosine
/// of 0.0634. The road returns the light of a target of 0.88 % square on: 59 photons, with 100 needed and 13
/// of noise. The thousand rays that meet the road give 0.1 expected points. Four or more come with α = 4e-6
/// (Poisson).
#[track_caller]
fn assert_too_dark_for(flash: &Design, road: &[Point]) {
    let lowest = (7.5_f64 / 2.0 - 7.5 / 64.0).to_radians();
    let (range, cosine) = (2.0 / lowest.sin(), lowest.sin());
    let day = Environment::named("clear-day").unwrap();
    let forecaster = Forecaster::new(flash, &day).unwrap();
    let [asphalt, white] = [0.139, 1.0].map(|share| forecaster.forecast(share * cosine, range).pd);
    assert!(asphalt < 1e-3 && white > 0.999, "{asphalt} of asphalt seen, {white} of white");
    assert!(road.len() < 4, "{} points on the road", road.len());
}

#[test]
fn a_toy_truck_is_made_6_m_long_and_turned() {
    let Some(scene) = example("truck.toml", "") else { return };
    for (sensor, least) in SENSORS.into_iter().zip([3500, 1400, 700]) {
        let seen = Seen::new(sensor, &scene, &[24, 29, 33]);
        let truck = seen.points_on(&scene, "truck");
        assert!(truck.len() >= least, "{sensor}: {} points on the truck", truck.len());
        // Its own frame: forward, left and up of [30, 0, 0], which it stands on.
        let (sin, cos) = 150_f64.to_radians().sin_cos();
        let own: Vec<Point> = truck
            .iter()
            .map(|[x, y, z]| [cos * (x - 30.0) + sin * y, -sin * (x - 30.0) + cos * y, *z])
            .collect();
        let body = ([-2.90, -1.551, 0.0], [3.101, 1.551, 2.894]);
        assert_within(&own, body, seen.tolerance());
        let (low, high) = bounds(&own);
        // Front and left side face the sensor.
        assert!((high[0] - 3.1).abs() < 0.1 && high[1] > 1.44, "{sensor}: {high:?}");
        assert!(high[0] - low[0] > 5.5, "{sensor}: {low:?} … {high:?}");
    }
}

/// The corners of a PLY mesh of the street.
fn corners(name: &str) -> Vec<Point> {
    let path = format!("meshes/street-canyon-with-cars/meshes/{name}.ply");
    let mut file = fs::File::open(macropulse_testbed::data_of_others(&path).unwrap()).unwrap();
    let ply = Parser::<DefaultElement>::new().read_ply(&mut file).unwrap();
    let coordinate = |vertex: &DefaultElement, axis: &str| match vertex[axis] {
        Property::Float(value) => f64::from(value),
        ref other => panic!("{axis} of {name} is {other:?}"),
    };
    let point = |vertex| ["x", "y", "z"].map(|axis| coordinate(vertex, axis));
    ply.payload["vertex"].iter().map(point).collect()
}

/// How far `point` is from the nearest side of the box from `low` to `high`.
fn from_nearest_side(point: &Point, (low, high): (Point, Point)) -> f64 {
    let sides =
        (0..3).flat_map(|axis| [(point[axis] - low[axis]).abs(), (point[axis] - high[axis]).abs()]);
    sides.fold(f64::INFINITY, f64::min)
}

#[test]
fn a_street_of_many_meshes_has_its_walls_cars_and_floor_in_place() {
    let Some(scene) = example("street-canyon.toml", "street-canyon-with-cars") else { return };
    for (sensor, least_right) in SENSORS.into_iter().zip([0.97, 0.9, 0.75]) {
        let seen = Seen::new(sensor, &scene, &[20, 31, 34]);
        let right = seen.scan.score.right_fraction();
        assert!(right > least_right, "{sensor}: {:.1} % right", 100.0 * right);
        // Two more buildings are of glass, and the points behind it lie on others.
        for (name, least) in [("building_4", 500), ("building_6", 500)] {
            let walls = seen.points_on(&scene, name);
            let body = bounds(&corners(name));
            assert!(walls.len() > least, "{sensor}: {} points on {name}", walls.len());
            assert_within(&walls, body, seen.tolerance());
            for point in &walls {
                let off = from_nearest_side(point, body);
                assert!(off <= seen.tolerance(), "{sensor}: {point:?} is {off} m off {name}");
            }
        }
        for name in ["car_5", "car_6"] {
            let car = seen.points_on(&scene, name);
            assert!(car.len() > 100, "{sensor}: {} points on {name}", car.len());
            assert_within(&car, bounds(&corners(name)), seen.tolerance());
        }
        let floor = seen.points_on(&scene, "floor");
        let level = corners("floor")[0][2];
        assert!((level + 0.03).abs() < 0.01 && floor.len() > 200, "{sensor}: {}", floor.len());
        assert_on_level(&floor, level, seen.tolerance());
    }
}
